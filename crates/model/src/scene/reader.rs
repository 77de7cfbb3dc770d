//! Typed, checked access to the keys of a document.

use super::{
    Bead, Material, SceneError,
    document::{Document, Entry, Value},
    error::Place,
    gone::gone,
    key::{Bound, Key, ValueKind},
    plausible,
    table::GOVERNORS,
    word::Word,
};
use granchain_signal::{Dimension, Quantity, closest};

const OVERRIDE_WORDS: [&str; 4] = ["bead", "radius", "material", "mass"];

pub(super) struct Reader<'a> {
    document: &'a Document,
    origin: &'a str,
}

impl<'a> Reader<'a> {
    pub(super) fn new(document: &'a Document, origin: &'a str) -> Self {
        Self { document, origin }
    }

    pub(super) fn entry(&self, key: &str) -> Option<&'a Entry> {
        self.document.entries.get(key)
    }

    pub(super) fn has(&self, key: &str) -> bool {
        self.entry(key).is_some()
    }

    pub(super) fn place(&self, key: &str) -> Place {
        self.entry(key).map_or_else(|| Place::Scene { name: self.origin.to_owned() }, |entry| entry.place.clone())
    }

    pub(super) fn out_of_range(&self, key: &str, expected: String, found: String) -> SceneError {
        SceneError::OutOfRange { place: self.place(key), key: key.to_owned(), expected, found }
    }

    /// Refuse any of `keys`, which mean nothing without `needed`.
    pub(super) fn refuse_alone(&self, keys: &[&'static str], needed: &str) -> Result<(), SceneError> {
        match keys.iter().find(|key| self.has(key)) {
            None => Ok(()),
            Some(key) => {
                let found = format!("`{key}` alone; give `{needed}`, or leave it out");
                Err(self.out_of_range(key, format!("`{needed}` beside it"), found))
            }
        }
    }

    pub(super) fn missing(&self, key: &'static str, reason: Option<&'static str>) -> SceneError {
        let example = Key::find(key).map_or("", |key| key.example);
        SceneError::Missing { scene: self.origin.to_owned(), key, reason, example }
    }

    pub(super) fn refuse_unused(&self) -> Result<(), SceneError> {
        for governor in GOVERNORS {
            let Some(choice) = self.document.chosen(governor) else { continue };
            if !governor.words().contains(&choice) {
                continue;
            }
            for (key, when) in governor.governed() {
                if let (Some(entry), false) = (self.entry(key.name), when.holds(choice)) {
                    // Of a drive its own keys only: every one but a striker uses piston and horn.
                    let named = |key: &Key| governor.name != "drive.kind" || key.name.starts_with("drive.");
                    let used = governor.governed().filter(|(key, when)| when.holds(choice) && named(key));
                    let users = governor.words().iter().filter(|word| when.holds(word));
                    return Err(SceneError::NotUsed {
                        place: entry.place.clone(),
                        key: key.name.to_owned(),
                        governor: governor.name.to_owned(),
                        choice: choice.to_owned(),
                        used: used.map(|(key, _)| key.name.to_owned()).collect(),
                        users_of_key: users.map(|word| (*word).to_owned()).collect(),
                    });
                }
            }
        }
        Ok(())
    }

    pub(super) fn quantity(&self, key: &str, dimension: Dimension, bound: Bound) -> Result<Option<f64>, SceneError> {
        self.entry(key).map(|entry| quantity(entry, key, dimension, bound)).transpose()
    }

    /// The number of a key, of its dimension and within its bound, where it is given.
    pub(super) fn given(&self, name: &str) -> Result<Option<f64>, SceneError> {
        let key = Key::find(name);
        let dimension =
            if let Some(Key { kind: ValueKind::Quantity(dimension), .. }) = key { *dimension } else { Dimension::NONE };
        self.quantity(name, dimension, key.map_or(Bound::Finite, |key| key.bound))
    }

    pub(super) fn number(&self, key: &'static str) -> Result<f64, SceneError> {
        let default = Key::find(key).and_then(|key| key.default);
        self.given(key)?.or(default).ok_or_else(|| self.missing(key, None))
    }

    pub(super) fn required(&self, key: &'static str, reason: Option<&'static str>) -> Result<f64, SceneError> {
        self.given(key)?.ok_or_else(|| self.missing(key, reason))
    }

    pub(super) fn text(&self, key: &str) -> Result<Option<&'a str>, SceneError> {
        self.entry(key)
            .map(|entry| match &entry.value {
                Value::Text(text) => Ok(text.as_str()),
                _ => Err(wrong_type(entry, key, "a text in quotes")),
            })
            .transpose()
    }

    pub(super) fn required_text(&self, key: &'static str, reason: Option<&'static str>) -> Result<&'a str, SceneError> {
        self.text(key)?.ok_or_else(|| self.missing(key, reason))
    }

    /// The word of a choice, where it is given.
    pub(super) fn choice(&self, key: &str) -> Result<Option<&'static str>, SceneError> {
        self.choice_of(key, Key::find(key).map_or(&[], Key::words))
    }

    /// The value of a choice; the first where none is given.
    pub(super) fn word<W: Word>(&self, key: &str) -> Result<W, SceneError> {
        let given = self.choice_of(key, W::WORDS)?;
        let index = W::WORDS.iter().position(|word| given == Some(word)).unwrap_or_default();
        Ok(W::VALUES[index])
    }

    /// As [`Reader::choice`], of fewer words than the key has.
    pub(super) fn choice_of(&self, key: &str, choices: &[&'static str]) -> Result<Option<&'static str>, SceneError> {
        let Some(entry) = self.entry(key) else { return Ok(None) };
        let listed = || choices.iter().map(|choice| format!("`{choice}`")).collect::<Vec<_>>().join(", ");
        let Value::Text(found) = &entry.value else {
            return Err(wrong_type(entry, key, format!("one of {}", listed())));
        };
        let known = choices.iter().find(|choice| *choice == found).copied().map(Some);
        known.ok_or_else(|| {
            gone(key, Some(found), &entry.place).unwrap_or_else(|| SceneError::UnknownChoice {
                place: entry.place.clone(),
                key: key.to_owned(),
                found: found.clone(),
                choices: choices.iter().map(|choice| (*choice).to_owned()).collect(),
                nearest: meant(&found.to_lowercase().replace('_', "-"), choices).map(str::to_owned),
            })
        })
    }

    pub(super) fn required_choice(&self, key: &'static str) -> Result<&'static str, SceneError> {
        self.choice(key)?.ok_or_else(|| self.missing(key, None))
    }

    pub(super) fn flag(&self, key: &str) -> Result<Option<bool>, SceneError> {
        self.entry(key)
            .map(|entry| match entry.value {
                Value::Flag(flag) => Ok(flag),
                _ => Err(wrong_type(entry, key, "`true` or `false`")),
            })
            .transpose()
    }

    pub(super) fn beads(&self) -> Result<usize, SceneError> {
        let key = "chain.beads";
        let count = self.whole(key, "a whole number of beads")?;
        count.map(|count| count as usize).ok_or_else(|| self.missing(key, None))
    }

    pub(super) fn count(&self, key: &str) -> Result<Option<u32>, SceneError> {
        self.whole(key, "a whole number")
    }

    fn whole(&self, key: &str, what: &str) -> Result<Option<u32>, SceneError> {
        let Some(Key { bound: Bound::Whole(least, most), .. }) = Key::find(key) else { return Ok(None) };
        let (least, most) = (*least, *most);
        let Some(entry) = self.entry(key) else { return Ok(None) };
        match entry.value {
            Value::Number(number)
                if number.fract() == 0.0 && number >= f64::from(least) && number <= f64::from(most) =>
            {
                Ok(Some(number as u32))
            }
            Value::Number(number) => {
                Err(self.out_of_range(key, format!("{what} from {least} to {most}"), number.to_string()))
            }
            _ => Err(wrong_type(entry, key, "a whole number")),
        }
    }

    pub(super) fn material(&self, key: &'static str) -> Result<Material, SceneError> {
        let name = self.required_text(key, None)?;
        self.material_named(name, key, || self.place(key))
    }

    /// The material `name`, as `key` at `place` asks for it.
    pub(super) fn material_named(
        &self,
        name: &str,
        key: &str,
        place: impl Fn() -> Place,
    ) -> Result<Material, SceneError> {
        let prefix = format!("materials.{name}.");
        let defined = self.document.entries.keys().any(|key| key.starts_with(&prefix));
        let built_in = Material::built_in(name);
        if !defined && built_in.is_none() {
            let mut known: Vec<String> = self
                .document
                .entries
                .keys()
                .filter_map(|key| Some(key.strip_prefix("materials.")?.split_once('.')?.0.to_owned()))
                .chain(Material::all_built_in().map(|material| material.name))
                .collect();
            known.sort();
            known.dedup();
            return Err(SceneError::UnknownMaterial {
                place: place(),
                key: key.to_owned(),
                found: name.to_owned(),
                nearest: closest(name, known.iter().map(String::as_str)).map(str::to_owned),
                known,
            });
        }
        let property = |word: &'static str, dimension, of: fn(&Material) -> f64| {
            let value = self.given(&format!("{prefix}{word}"))?;
            value.or(built_in.as_ref().map(of)).ok_or_else(|| SceneError::IncompleteMaterial {
                scene: self.origin.to_owned(),
                material: name.to_owned(),
                property: word,
                expected: dimension,
            })
        };
        Ok(Material {
            name: name.to_owned(),
            youngs_modulus: property("youngs_modulus", Dimension::PRESSURE, |material| material.youngs_modulus)?,
            poissons_ratio: property("poissons_ratio", Dimension::NONE, |material| material.poissons_ratio)?,
            density: property("density", Dimension::DENSITY, |material| material.density)?,
        })
    }

    /// Check every material that is defined, also those no bead uses.
    pub(super) fn check_materials(&self) -> Result<(), SceneError> {
        for (key, entry) in &self.document.entries {
            if let Some((name, _)) = key.strip_prefix("materials.").and_then(|rest| rest.split_once('.')) {
                self.material_named(name, key, || entry.place.clone())?;
            }
        }
        Ok(())
    }

    /// Names of the materials that are defined, each once.
    pub(super) fn defined_materials(&self) -> std::collections::BTreeSet<&str> {
        let keys = self.document.entries.keys();
        keys.filter_map(|key| Some(key.strip_prefix("materials.")?.split_once('.')?.0)).collect()
    }

    pub(super) fn override_beads(&self, beads: &mut [Bead]) -> Result<(), SceneError> {
        let list_key = "chain.override";
        let Some(entry) = self.entry(list_key) else { return Ok(()) };
        let expected = "a list of tables such as `[[chain.override]]` with `bead = 3` and `radius = \"0.51 mm\"`";
        let Value::List(list) = &entry.value else { return Err(wrong_type(entry, list_key, expected)) };
        let mut seen = vec![false; beads.len()];
        for item in list {
            let Value::Table(table) = &item.value else { return Err(wrong_type(item, list_key, expected)) };
            for (word, value) in table {
                if !OVERRIDE_WORDS.contains(&word.as_str()) {
                    let (place, key) = (value.place.clone(), format!("{list_key}.{word}"));
                    let nearest = closest(word, OVERRIDE_WORDS.into_iter());
                    let nearest = nearest.map(|nearest| format!("{list_key}.{nearest}"));
                    return Err(gone(&key, None, &place).unwrap_or(SceneError::UnknownKey { place, key, nearest }));
                }
            }
            let find = |word: &str| table.iter().find(|(key, _)| key == word).map(|(_, entry)| entry);
            let number = find("bead").ok_or_else(|| {
                wrong_type(item, list_key, "`bead`, the number of the bead counted from the piston, in every table")
            })?;
            let key = "chain.override.bead";
            let index = match number.value {
                Value::Number(index) if index.fract() == 0.0 && index >= 1.0 && index <= beads.len() as f64 => {
                    index as usize - 1
                }
                Value::Number(index) => {
                    let (place, found) = (number.place.clone(), index.to_string());
                    return Err(SceneError::NoSuchBead { place, key: key.into(), beads: beads.len(), found });
                }
                _ => return Err(wrong_type(number, key, "the number of a bead")),
            };
            if std::mem::replace(&mut seen[index], true) {
                return Err(SceneError::RepeatedBead { place: number.place.clone(), bead: index + 1 });
            }
            if let Some(radius) = find("radius") {
                beads[index].radius = quantity(radius, "chain.override.radius", Dimension::LENGTH, Bound::Radius)?;
            }
            if let Some(material) = find("material") {
                let key = "chain.override.material";
                let Value::Text(name) = &material.value else {
                    return Err(wrong_type(material, key, "the name of a material in quotes"));
                };
                beads[index].material = self.material_named(name, key, || material.place.clone())?;
            }
            if let Some(mass) = find("mass") {
                self.set_mass(&mut beads[index], mass, "chain.override.mass", &format!("bead{}", index + 1))?;
            }
        }
        Ok(())
    }

    /// Give a bead a mass of its own: a material of its own, named after `owner` too, of the density that makes it so heavy.
    pub(super) fn set_mass(&self, bead: &mut Bead, entry: &Entry, key: &str, owner: &str) -> Result<(), SceneError> {
        let mass = quantity(entry, key, Dimension::MASS, Bound::Positive)?;
        let density = bead.material.density * mass / bead.mass();
        if !Bound::Density.allows(density) {
            return Err(SceneError::OutOfRange {
                place: entry.place.clone(),
                key: key.to_owned(),
                expected: format!("a mass of {} for that radius", Bound::Density.describe()),
                found: format!("{mass:e} kg, {density:.3e} kg/m^3"),
            });
        }
        bead.material.density = density;
        bead.material.name = format!("{}-{owner}", bead.material.name);
        Ok(())
    }

    /// Initial gap of each of the contacts of `beads` beads of `radius` (m).
    pub(super) fn gaps(&self, beads: usize, radius: f64) -> Result<Vec<f64>, SceneError> {
        let key = "chain.gaps";
        let mut gaps = vec![0.0; beads + 1];
        let checked = |entry: &Entry, key: &str, contact: Option<usize>| {
            let gap = quantity(entry, key, Dimension::LENGTH, Bound::Finite)?;
            if gap >= radius {
                return Err(SceneError::OutOfRange {
                    place: entry.place.clone(),
                    key: key.to_owned(),
                    expected: format!("gaps below the bead radius {}", Quantity::new(radius, Dimension::LENGTH)),
                    found: Quantity::new(gap, Dimension::LENGTH).to_string(),
                });
            }
            if gap >= 0.0 {
                return Ok(gap);
            }
            let contact = contact.unwrap_or(2.min(beads + 1));
            Err(SceneError::Overlap {
                place: entry.place.clone(),
                key: key.to_owned(),
                contact,
                gap: Quantity::new(gap, Dimension::LENGTH).to_string(),
                left: if contact == 1 { "the piston".into() } else { format!("bead {}", contact - 1) },
                right: if contact == beads + 1 { "the support".into() } else { format!("bead {contact}") },
            })
        };
        if let Some(entry) = self.entry(key) {
            if let Value::List(list) = &entry.value {
                if list.len() != beads + 1 {
                    let place = entry.place.clone();
                    let (expected, found) = (beads + 1, list.len());
                    return Err(SceneError::WrongCount { place, key: key.into(), beads, expected, found });
                }
                for (index, (gap, entry)) in gaps.iter_mut().zip(list).enumerate() {
                    *gap = checked(entry, key, Some(index + 1))?;
                }
            } else {
                gaps.fill(checked(entry, key, None)?);
            }
        }
        if let Some(entry) = self.entry("chain.gaps.all") {
            gaps.fill(checked(entry, "chain.gaps.all", None)?);
        }
        for (name, entry) in &self.document.entries {
            let Some(number) = name.strip_prefix("chain.gaps.contact") else { continue };
            let contact = number.parse::<usize>().ok().filter(|contact| (1..=beads + 1).contains(contact));
            let contact = contact.ok_or_else(|| SceneError::NoSuchContact {
                place: entry.place.clone(),
                key: name.clone(),
                contacts: beads + 1,
            })?;
            gaps[contact - 1] = checked(entry, name, Some(contact))?;
        }
        Ok(gaps)
    }
}

/// What a word means that is none of the choices: another word for one, or one misspelt.
fn meant<'a>(found: &str, choices: &[&'a str]) -> Option<&'a str> {
    let other = [("ring", "annulus"), ("wall", "rigid")].into_iter().find(|(word, _)| *word == found);
    let choice = other.and_then(|(_, meant)| choices.iter().copied().find(|choice| *choice == meant));
    choice.or_else(|| closest(found, choices.iter().copied()))
}

pub(super) fn wrong_type(entry: &Entry, key: &str, expected: impl Into<String>) -> SceneError {
    SceneError::WrongType {
        place: entry.place.clone(),
        key: key.to_owned(),
        expected: expected.into(),
        found: entry.value.describe(),
    }
}

pub(super) fn quantity(entry: &Entry, key: &str, dimension: Dimension, bound: Bound) -> Result<f64, SceneError> {
    let value = match &entry.value {
        Value::Number(number) => *number,
        Value::Text(text) => Quantity::parse_as(text, dimension).map_err(|source| SceneError::Quantity {
            place: entry.place.clone(),
            key: key.to_owned(),
            source,
        })?,
        _ => return Err(wrong_type(entry, key, dimension.describe())),
    };
    if bound.allows(value) {
        return match plausible::doubt(key, value, dimension) {
            None => Ok(value),
            Some((expected, doubt)) => Err(SceneError::OutOfRange {
                place: entry.place.clone(),
                key: key.to_owned(),
                expected,
                found: format!("{}, {doubt}", Quantity::new(value, dimension)),
            }),
        };
    }
    Err(SceneError::OutOfRange {
        place: entry.place.clone(),
        key: key.to_owned(),
        // A range is printed only for a number that could lie in it.
        expected: if value > 0.0 && value.is_finite() { bound } else { bound.sign() }.describe(),
        found: if value.is_finite() { Quantity::new(value, dimension).to_string() } else { value.to_string() },
    })
}
