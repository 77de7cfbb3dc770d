//! What a key of a scene file is: name, kind of value, range, default, when it has an effect, where it stands in a scene, meaning.

use super::{DampingKind, DampingTerm, Material, Scene, listing::SettingValue, reader::Bound, table::KEYS, word::Word};
use granchain_signal::{Dimension, Quantity};

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ValueKind {
    /// A quantity of one dimension; a plain number is SI.
    Quantity(Dimension),
    DampingCoefficient,
    Count,
    Flag,
    Choice(&'static [&'static str]),
    Text,
    Path,
    /// Gaps: one length, a list of N + 1, or a table `all`, `contact1` … `contact{N+1}`.
    Gaps,
    /// A list of tables with `bead` and what differs for it.
    BeadOverrides,
    /// Points of the water: a list of tables with `r` and `z`.
    FieldPoints,
}

#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Its name with its tables; `*` stands for the name of a material.
    pub name: &'static str,
    pub kind: ValueKind,
    pub meaning: &'static str,
    pub(super) bound: Bound,
    /// Taken where it is not given.
    pub(super) default: Option<f64>,
    /// The same where it depends on others, for people; empty where it must be given.
    usually: &'static str,
    /// How one writes it, for who left it out.
    pub(super) example: &'static str,
    /// All that must be so for it to have an effect.
    pub(super) when: &'static [When],
    pub(super) get: Get,
}

/// What a scene has for a key; nothing where the key has no effect in it.
#[derive(Debug, Clone, Copy)]
pub(super) enum Get {
    Nothing,
    Number(fn(&Scene) -> Option<f64>),
    OfMaterial(fn(&Material) -> f64),
    Value(fn(&Scene) -> Option<SettingValue>),
}

/// A condition of a key: the value of another, its governor.
#[derive(Debug, Clone, Copy)]
pub(super) enum When {
    /// That key has one of these values.
    Is(&'static str, &'static [&'static str]),
    /// The law of the dashpots has one term alone, or (`true`) any.
    Damped(bool),
    /// It is a sum with this term.
    Beside(DampingTerm),
}

impl When {
    pub(super) const fn governor(&self) -> &'static str {
        match self {
            Self::Is(governor, _) => governor,
            Self::Damped(_) | Self::Beside(_) => "damping.kind",
        }
    }

    /// Whether the key has an effect where its governor has that value.
    pub(super) fn holds(&self, value: &str) -> bool {
        let terms = || DampingKind::named(value).map_or(&[][..], DampingKind::terms);
        match self {
            Self::Is(_, values) => values.contains(&value),
            Self::Damped(any) => terms().len() == 1 || *any && !terms().is_empty(),
            Self::Beside(term) => terms().len() > 1 && terms().contains(term),
        }
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Governor {
    pub(super) name: &'static str,
    /// Keys whose meaning changes with its value.
    pub(super) reinterpreted: &'static [&'static str],
}

/// In the order in which they are asked.
pub(super) const GOVERNORS: &[Governor] = &[
    // First: it decides which integrators there are.
    Governor {
        name: "model.kind",
        reinterpreted: &["model.integrator", "model.numerical_dissipation", "model.tolerance", "model.step"],
    },
    // Says what it uses only where the model is the chain.
    Governor { name: "contact.law", reinterpreted: &[] },
    Governor { name: "drive.kind", reinterpreted: &[] },
    Governor { name: "support.kind", reinterpreted: &[] },
    Governor { name: "water.medium", reinterpreted: &["water.density", "water.sound_speed"] },
    // Says what it uses only where there is water.
    Governor { name: "water.method", reinterpreted: &[] },
    Governor { name: "damping.kind", reinterpreted: &["damping.coefficient"] },
    Governor { name: "model.integrator", reinterpreted: &[] },
];

impl Governor {
    pub(super) fn words(&self) -> &'static [&'static str] {
        Key::find(self.name).map_or(&[], |key| key.words())
    }

    pub(super) fn governed(&self) -> impl Iterator<Item = (&'static Key, &'static When)> {
        KEYS.iter().filter_map(|key| Some((key, key.under(self)?)))
    }
}

/// A key that a scene has no value of its own for, until [`Key::value`] or one of its like says where it stands.
pub(super) const fn key(name: &'static str, kind: ValueKind, meaning: &'static str) -> Key {
    let (bound, get) = (Bound::Finite, Get::Nothing);
    Key { name, kind, meaning, usually: "", bound, default: None, example: "", when: &[], get }
}

pub(super) const fn number(name: &'static str, dimension: Dimension, bound: Bound, meaning: &'static str) -> Key {
    Key { bound, ..key(name, ValueKind::Quantity(dimension), meaning) }
}

/// A number that is 0 where it is not given.
pub(super) const fn optional(name: &'static str, dimension: Dimension, meaning: &'static str) -> Key {
    number(name, dimension, Bound::NotNegative, meaning).usually("0")
}

/// The key of a term's coefficient beside another.
pub(super) const fn beside(term: DampingTerm, meaning: &'static str) -> Key {
    let description = term.description();
    number(description.key, description.dimension, Bound::NotNegative, meaning).usually("the paper's")
}

pub(super) const fn count(name: &'static str, range: (u32, u32), meaning: &'static str) -> Key {
    Key { bound: Bound::Whole(range.0, range.1), ..key(name, ValueKind::Count, meaning) }
}

/// A key with the words of `W`, the first of which is taken where none is given.
pub(super) const fn word<W: Word>(name: &'static str, meaning: &'static str) -> Key {
    key(name, ValueKind::Choice(W::WORDS), meaning).usually(W::WORDS[0])
}

impl Key {
    pub(super) const fn or(mut self, default: f64) -> Self {
        self.default = Some(default);
        self
    }

    /// What is taken where it is not given depends on others.
    pub(super) const fn usually(mut self, usually: &'static str) -> Self {
        self.usually = usually;
        self
    }

    /// It must be given, such as here (by some, where `usually` follows).
    pub(super) const fn needed(mut self, example: &'static str) -> Self {
        (self.example, self.usually) = (example, "");
        self
    }

    /// Where it stands in a scene.
    pub(super) const fn value(mut self, get: fn(&Scene) -> Option<SettingValue>) -> Self {
        self.get = Get::Value(get);
        self
    }

    pub(super) const fn number(mut self, get: fn(&Scene) -> Option<f64>) -> Self {
        self.get = Get::Number(get);
        self
    }

    pub(super) const fn of_material(mut self, get: fn(&Material) -> f64) -> Self {
        self.get = Get::OfMaterial(get);
        self
    }

    pub(super) const fn when(mut self, conditions: &'static [When]) -> Self {
        self.when = conditions;
        self
    }

    /// What is taken where it is not given, for people; empty where it must be given.
    pub fn default_text(&self) -> String {
        match (self.default, self.kind) {
            (Some(default), ValueKind::Quantity(dimension)) => Quantity::new(default, dimension).to_string(),
            _ => self.usually.to_owned(),
        }
    }

    /// What it takes, for people: `a length such as `0.5 mm``, ``rigid` or `half-space``.
    pub fn takes(&self) -> String {
        match self.kind {
            ValueKind::Quantity(Dimension::NONE) => "a number".to_owned(),
            ValueKind::Quantity(dimension) => dimension.describe(),
            ValueKind::DampingCoefficient => "a damping coefficient of the law's dimension".to_owned(),
            ValueKind::Count => match self.bound {
                Bound::Whole(least, most) => format!("a whole number from {least} to {most}"),
                _ => "a whole number".to_owned(),
            },
            ValueKind::Flag => "`true` or `false`".to_owned(),
            ValueKind::Choice(words) => words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", "),
            ValueKind::Text => "a text".to_owned(),
            ValueKind::Path => "a file".to_owned(),
            ValueKind::Gaps => "a length, a list of N + 1, or a table `all`, `contact1`, `contact2` …".to_owned(),
            ValueKind::BeadOverrides => "tables `bead`, `radius`, `material`, `mesh`, `mesh_unit`".to_owned(),
            ValueKind::FieldPoints => "a list of points such as `[{ r = \"0 mm\", z = \"1 mm\" }]`".to_owned(),
        }
    }

    /// Other keys that decide whether it has an effect, each with the values where it has.
    pub fn conditions(&self) -> Vec<(&'static str, Vec<&'static str>)> {
        let of = |governor: &Governor| {
            let when = self.under(governor)?;
            let words = governor.words();
            let holding: Vec<_> = words.iter().copied().filter(|word| when.holds(word)).collect();
            (holding.len() < words.len()).then_some((governor.name, holding))
        };
        GOVERNORS.iter().filter_map(of).collect()
    }

    /// The key of a full name such as `materials.brass.density` or `chain.gaps.contact2`.
    pub fn find(name: &str) -> Option<&'static Self> {
        KEYS.iter().find(|key| key.matches(name))
    }

    pub(super) fn quantity(&self, number: f64) -> SettingValue {
        let dimension = if let ValueKind::Quantity(dimension) = self.kind { dimension } else { Dimension::NONE };
        SettingValue::Quantity(Quantity::new(number, dimension))
    }

    pub(super) const fn words(&self) -> &'static [&'static str] {
        if let ValueKind::Choice(words) = self.kind { words } else { &[] }
    }

    pub(super) fn under(&self, governor: &Governor) -> Option<&'static When> {
        self.when.iter().find(|when| when.governor() == governor.name)
    }

    fn matches(&self, name: &str) -> bool {
        if let Some((before, after)) = self.name.split_once('*') {
            return name
                .strip_prefix(before)
                .and_then(|rest| rest.strip_suffix(after))
                .is_some_and(|middle| !middle.is_empty() && !middle.contains('.'));
        }
        self.name == name
            || self.kind == ValueKind::Gaps
                && name.strip_prefix(self.name).is_some_and(|rest| rest == ".all" || rest.starts_with(".contact"))
    }

    pub(super) fn is_table(table: &str) -> bool {
        let inside = |name: &str| name.strip_prefix(table).is_some_and(|rest| rest.starts_with('.'));
        KEYS.iter().any(|key| inside(key.name)) || table == "chain.gaps" || table.starts_with("materials.")
    }

    /// The valid key most like `name`: the spelling as a whole, or the same last word in another table.
    pub fn nearest(name: &str) -> Option<String> {
        let last = name.rsplit('.').next().unwrap_or(name);
        // In `materials.NAME.…` the name is the user's, only the last word can be misspelt.
        if let Some((material, word)) = name.strip_prefix("materials.").and_then(|rest| rest.split_once('.')) {
            let words = ["youngs_modulus", "poissons_ratio", "density"];
            return closest(word, words.iter().copied()).map(|word| format!("materials.{material}.{word}"));
        }
        if let Some(inside) = KEYS.iter().find(|key| key.name.strip_prefix(name).is_some_and(|r| r.starts_with('.'))) {
            return Some(inside.name.to_owned());
        }
        let plain = || KEYS.iter().map(|key| key.name).filter(|key| !key.contains('*'));
        plain()
            .find(|key| key.rsplit('.').next() == Some(last) && strsim::jaro_winkler(key, name) > 0.7)
            .or_else(|| closest(name, plain()))
            .or_else(|| plain().find(|key| key.rsplit('.').next() == Some(last)))
            .or_else(|| {
                let words = plain().filter_map(|key| key.rsplit('.').next());
                let word = closest(last, words)?;
                plain().find(|key| key.rsplit('.').next() == Some(word))
            })
            .map(str::to_owned)
    }
}

/// The candidate that `text` is most likely a misspelling of; `None` when none is near.
pub(super) fn closest<'a>(text: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    candidates
        .map(|candidate| (strsim::damerau_levenshtein(text, candidate), candidate))
        .filter(|(distance, candidate)| 3 * distance <= candidate.len().max(3))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}
