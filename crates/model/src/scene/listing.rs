//! A scene written out again: key by key for a table, or as a TOML file that reads back as the same scene.

use std::{fmt::Write, path::Path};

use super::{
    DriveKind, Key, Material, Scene, SceneError, SettingValue,
    file::load_text,
    key::Get,
    table::{GOVERNORS, Governor, KEYS},
};

#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    pub key: String,
    pub value: SettingValue,
    pub meaning: &'static str,
}

impl Scene {
    /// Every key that has an effect in this scene, with its value, in the order of [`super::KEYS`].
    pub fn settings(&self) -> Vec<Setting> {
        let mut settings = Vec::new();
        let mut materials = Some(self.materials_in_use());
        for key in KEYS {
            let value = match key.get {
                Get::Nothing => None,
                Get::Number(get) => get(self).map(|number| key.quantity(number)),
                Get::Value(get) => get(self),
                // All keys of a material, then those of the next.
                Get::OfMaterial(_) => {
                    settings.extend(materials.take().into_iter().flatten().flat_map(of_material));
                    None
                }
            };
            settings.extend(value.map(|value| Setting { key: key.name.to_owned(), value, meaning: key.meaning }));
        }
        settings
    }

    /// The materials of its bodies, each once.
    pub fn materials_in_use(&self) -> Vec<&Material> {
        let beads = self.chain.beads.iter().map(|bead| &bead.material);
        let striker = self.drive.kind.striker().map(|(bead, _)| &bead.material);
        let ends = self.piston_material.iter().chain(self.support.material());
        let all = beads.chain(striker).chain(ends).chain(&self.materials);
        let mut materials: Vec<&Material> = Vec::new();
        for material in all {
            if !materials.iter().any(|known| known.name == material.name) {
                materials.push(material);
            }
        }
        materials
    }

    /// The scene as a TOML file with every key, which [`super::load_text`] reads back as the same scene.
    ///
    /// A drive of kind `record` is written by its file's name, as the program was given it. A record held in memory only has
    /// none; then `drive.file` is missing and asked for on reading.
    pub fn to_toml(&self) -> String {
        toml_of(&self.settings())
    }

    /// The same scene and drive with all keys that begin with one of `dropped` at their defaults, and then with overrides `KEY=VALUE`. A key that must be
    /// given is as its example says: no dampers, a rigid support.
    pub fn changed(&self, dropped: &[&str], sets: &[String]) -> Result<Self, SceneError> {
        let is_dropped = |key: &str| dropped.iter().any(|prefix| key.starts_with(prefix));
        let mut settings = self.settings();
        settings.retain(|setting| !is_dropped(&setting.key));
        let needed = KEYS.iter().filter(|key| is_dropped(key.name) && key.when.is_empty() && !key.example.is_empty());
        let needed = needed.filter(|key| key.default_text().is_empty()).map(|key| key.example.replace(" = ", "="));
        let is_recorded = matches!(self.drive.kind, DriveKind::Record { .. });
        // A record held in memory has no file.
        let record = is_recorded.then(|| "drive.file=in-memory".to_owned());
        let overrides: Vec<String> = record.into_iter().chain(needed).chain(sets.iter().cloned()).collect();
        let mut scene = load_text(&toml_of(&settings), Path::new("scene.toml"), &overrides)?.scene;
        if is_recorded {
            scene.drive = self.drive.clone();
        }
        Ok(scene.with_limits(self.model.limits))
    }
}

fn toml_of(settings: &[Setting]) -> String {
    let mut text = String::new();
    let mut table = "";
    for setting in settings {
        let (own, word) = setting.key.rsplit_once('.').unwrap_or(("", &setting.key));
        if own != table {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "\n[{own}]");
            table = own;
        }
        let _ = writeln!(text, "{word} = {}", setting.value.to_toml());
    }
    text
}

fn of_material(material: &Material) -> impl Iterator<Item = Setting> {
    KEYS.iter().filter_map(move |key| {
        let Get::OfMaterial(get) = key.get else { return None };
        let name = key.name.replace('*', &material.name);
        Some(Setting { key: name, value: key.quantity(get(material)), meaning: key.meaning })
    })
}

impl Key {
    /// Other keys that decide whether it has an effect, each with the values where it has. All must hold, except that [`Key::alternative`] will do.
    pub fn conditions(&self) -> Vec<(&'static str, Vec<&'static str>)> {
        let of = |governor: &Governor| {
            let holding = self.holding(governor)?;
            (holding.len() < governor.words().len()).then_some((governor.name, holding))
        };
        GOVERNORS.iter().filter_map(of).collect()
    }

    /// The values of `model.kind` that do in place of its other conditions: those whose models have none of the keys that these name.
    pub fn alternative(&self) -> Option<(&'static str, Vec<&'static str>)> {
        let (kind, others) = GOVERNORS.split_first()?;
        let condition =
            |governor: &Governor| self.under(governor.name).and(Self::find(governor.name)?.under(kind.name));
        let conditions: Vec<_> = others.iter().filter_map(condition).collect();
        let free =
            self.holding(kind)?.into_iter().filter(|word| !conditions.iter().any(|when| when.holds(word))).collect();
        Some((kind.name, free)).filter(|(_, free): &(_, Vec<_>)| !conditions.is_empty() && !free.is_empty())
    }

    fn holding(&self, governor: &Governor) -> Option<Vec<&'static str>> {
        let when = self.under(governor.name)?;
        Some(governor.words().iter().copied().filter(|word| when.holds(word)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Key, load, table::GOVERNORS};

    #[test]
    fn keys_of_meshes_and_of_the_step_need_no_chain() {
        let of = |name: &str| Key::find(name).and_then(Key::alternative);
        let meshed = Some(("model.kind", vec!["reduced", "fea"]));
        for name in ["model.mesh_density", "model.elements", "model.contact_patch"] {
            assert_eq!(of(name), meshed, "{name}");
        }
        assert_eq!(of("model.step"), Some(("model.kind", vec!["reduced"])));
        assert_eq!((of("model.modes"), of("support.normal"), of("model.tolerance")), (None, None, None));
    }

    #[test]
    fn a_scene_in_which_nothing_is_changed_is_the_same() {
        for (name, sets) in
            [("rigid", &["model.kind=reduced"][..]), ("annulus", &["chain.gaps=[1e-9,0,0,0,0,0,0]"]), ("water", &[])]
        {
            let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
            let scene = load(name, &sets).unwrap();
            assert_eq!(scene.changed(&[], &[]).unwrap(), scene, "{name}");
        }
        let annulus = load("annulus", &["damping.tension=true".into()]).unwrap();
        let bare = annulus
            .changed(&["damping.", "support."], &["model.step=25 ns".into(), "model.kind=reduced".into()])
            .unwrap();
        assert!(
            bare.damping.coefficients.are_absent()
                && bare.support == crate::scene::Support::Flat(crate::scene::FlatContact::Rigid)
        );
        assert_eq!((bare.model.reduced.step, &bare.drive), (25e-9, &annulus.drive));
    }

    /// What a key says of when it has an effect is when a scene has a value for it.
    #[test]
    fn a_scene_lists_a_key_where_its_conditions_hold_and_nowhere_else() {
        let variants: [&[&str]; 17] = [
            &[],
            &["model.kind=reduced"],
            &["model.kind=fea"],
            &["model.kind=fea", "model.integrator=newmark", "model.numerical_dissipation=0.1"],
            &["contact.law=finite-body"],
            &["model.integrator=symplectic", "model.step=50 ns"],
            &["support.kind=annulus"],
            &["support.kind=annulus", "model.kind=fea"],
            &["support.kind=spring", "support.stiffness=1e6"],
            &["support.kind=disc"],
            &["support.kind=free"],
            &["support.kind=foundation", "support.youngs_modulus=58 MPa"],
            &["drive.kind=striker", "drive.height=3 mm"],
            &["support.kind=disc", "water.medium=none"],
            &["support.kind=disc", "water.method=elements", "model.kind=reduced"],
            &["damping.kind=none", "drive.kind=gaussian-burst"],
            &["damping.kind=linear+kuwabara-kono", "drive.kind=record", "drive.file=horn.csv"],
        ];
        for overrides in variants {
            let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
            let settings = load("rigid", &overrides).unwrap().settings();
            let listed = |name: &str| settings.iter().find(|setting| setting.key == name).map(|setting| &setting.value);
            for key in KEYS.iter().filter(|key| !matches!(key.get, Get::Nothing | Get::OfMaterial(_))) {
                let holds = GOVERNORS.iter().all(|governor| match (key.under(governor.name), listed(governor.name)) {
                    (Some(when), Some(SettingValue::Text(word))) => when.holds(word),
                    _ => true,
                });
                let named = |(name, words): (&str, Vec<&str>)| match listed(name) {
                    Some(SettingValue::Text(word)) => words.contains(&word.as_str()),
                    _ => false,
                };
                let documented = key.conditions().into_iter().all(named) || key.alternative().is_some_and(named);
                assert_eq!(documented, holds, "{} with {overrides:?}", key.name);
                let left_out = matches!(key.name, "chain.mesh" | "chain.mesh_unit" | "chain.override")
                    || [
                        "water.absorption",
                        "horn.",
                        "holder.",
                        "loss.",
                        "contact.yield_strength",
                        "chain.gravity",
                        "chain.sensor",
                        "support.plate_",
                        "piston.material",
                    ]
                    .iter()
                    .any(|optional| key.name.starts_with(optional));
                let is_listed = listed(key.name).is_some();
                assert!(is_listed == holds || left_out && !is_listed, "{} with {overrides:?}", key.name);
            }
        }
    }
}
