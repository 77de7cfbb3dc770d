//! What a key of a scene file is: name, kind of value, range, default, when it has an effect, where it stands in a scene, meaning.

use super::{DampingKind, DampingTerm, Material, Scene, setting::SettingValue, word::Word};
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

/// Which values a quantity may have; infinite and undefined ones it never may.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Bound {
    Finite,
    Positive,
    NotNegative,
    Between(f64, f64),
    Whole(u32, u32),
    /// 1 nm to 1 km: bodies of a bench, with room.
    Radius,
    /// 1 Pa to 10¹⁵ Pa: foam to a thousand times diamond.
    Modulus,
    /// 1 g/m³ to 10⁹ kg/m³.
    Density,
    UpToAThird,
    /// −1 < ν < 0.5, where a solid is stable and not incompressible.
    PoissonsRatio,
}

impl Bound {
    pub(super) fn allows(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Finite | Self::Whole(..) => true,
                Self::Positive => value > 0.0,
                Self::NotNegative => value >= 0.0,
                Self::Between(low, high) => (low..=high).contains(&value),
                Self::Radius => (1e-9..=1e3).contains(&value),
                Self::Modulus => (1.0..=1e15).contains(&value),
                Self::Density => (1e-3..=1e9).contains(&value),
                Self::UpToAThird => (0.0..=1.0 / 3.0).contains(&value),
                Self::PoissonsRatio => value > -1.0 && value < 0.5,
            }
    }

    /// What is checked before any range.
    pub(super) fn sign(self) -> Self {
        match self {
            Self::Radius | Self::Modulus | Self::Density => Self::Positive,
            other => other,
        }
    }

    pub(super) fn describe(self) -> String {
        match self {
            Self::Finite | Self::Whole(..) => "a finite value".to_owned(),
            Self::Positive => "a positive, finite value".to_owned(),
            Self::NotNegative => "a finite value of 0 or more".to_owned(),
            Self::Between(low, high) => format!("a value between {low:e} and {high:e}"),
            Self::Radius => "a length between 1 nm and 1 km".to_owned(),
            Self::Modulus => "a modulus between 1 Pa and 1e15 Pa".to_owned(),
            Self::Density => "a density between 1e-3 kg/m^3 and 1e9 kg/m^3".to_owned(),
            Self::UpToAThird => "a value from 0 to 1/3".to_owned(),
            Self::PoissonsRatio => "Poisson's ratio above −1 and below 0.5".to_owned(),
        }
    }
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
            ValueKind::Text if self.name.ends_with("material") => {
                let names = Material::all_built_in().map(|material| format!("`{}`", material.name));
                format!("{}, or NAME defined under `[materials.NAME]`", names.join(", "))
            }
            ValueKind::Text => "a text".to_owned(),
            ValueKind::Path => "a file".to_owned(),
            ValueKind::Gaps => "a length, a list of N + 1, or a table `all`, `contact1`, `contact2` …".to_owned(),
            ValueKind::BeadOverrides => "tables `bead`, `radius`, `material`, `mass`".to_owned(),
            ValueKind::FieldPoints => "a list of points such as `[{ r = \"0 mm\", z = \"1 mm\" }]`".to_owned(),
        }
    }

    pub(super) fn quantity(&self, number: f64) -> SettingValue {
        let dimension = if let ValueKind::Quantity(dimension) = self.kind { dimension } else { Dimension::NONE };
        SettingValue::Quantity(Quantity::new(number, dimension))
    }

    pub(super) const fn words(&self) -> &'static [&'static str] {
        if let ValueKind::Choice(words) = self.kind { words } else { &[] }
    }

    pub(super) fn under(&self, governor: &str) -> Option<&'static When> {
        self.when.iter().find(|when| when.governor() == governor)
    }

    pub(super) fn matches(&self, name: &str) -> bool {
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
}
