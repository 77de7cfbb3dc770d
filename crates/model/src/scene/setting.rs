//! Values of a scene as they are written, and where they stand in it.

use std::fmt::Write;

use super::{
    Absorption, AnnulusShape, Bead, ContactLaw, Damping, DampingTerm, DiscShape, FieldPoint, Meshing, Scene, WaterMesh,
    WaterMethod, WaterSettings,
};
use granchain_signal::{Dimension, Quantity};

#[derive(Debug, Clone, PartialEq)]
pub enum SettingValue {
    Quantity(Quantity),
    Lengths(Vec<f64>),
    Count(usize),
    Text(String),
    Flag(bool),
    /// Beads that differ from the first, each with its number.
    Beads(Vec<(usize, Bead)>),
    FieldPoints(Vec<FieldPoint>),
}

impl SettingValue {
    pub fn to_toml(&self) -> String {
        match self {
            Self::Quantity(quantity) => quantity_toml(quantity),
            Self::Lengths(lengths) => list(lengths.iter().map(|length| length_toml(*length))),
            Self::Count(count) => count.to_string(),
            Self::Text(text) => quoted(text),
            Self::Flag(flag) => flag.to_string(),
            Self::Beads(beads) => list(beads.iter().map(|(number, bead)| {
                let (radius, material) = (length_toml(bead.radius), quoted(&bead.material.name));
                format!("{{ bead = {number}, radius = {radius}, material = {material} }}")
            })),
            Self::FieldPoints(points) => {
                list(points.iter().map(|point| {
                    format!("{{ r = {}, z = {} }}", length_toml(point.radius), length_toml(point.distance))
                }))
            }
        }
    }

    pub fn display(&self) -> String {
        match self {
            Self::Quantity(quantity) => quantity.to_string(),
            Self::Lengths(lengths) => {
                list(lengths.iter().map(|length| Quantity::new(*length, Dimension::LENGTH).to_string()))
            }
            Self::FieldPoints(points) => list(points.iter().map(|point| format!("({point})"))),
            Self::Text(text) => text.clone(),
            other => other.to_toml(),
        }
    }

    /// Unit of a plain number given for it: `m`, `N·s/m`; empty where there is none.
    pub fn unit(&self) -> String {
        match self {
            Self::Quantity(quantity) if quantity.dimension == Dimension::MASS => "kg".to_owned(),
            Self::Quantity(quantity) => quantity.dimension.si_unit(),
            Self::Lengths(_) | Self::FieldPoints(_) => "m".to_owned(),
            _ => String::new(),
        }
    }
}

fn quantity_toml(quantity: &Quantity) -> String {
    let text = quantity.format_si();
    if quantity.dimension == Dimension::NONE { text } else { format!("\"{text}\"") }
}

fn length_toml(value: f64) -> String {
    quantity_toml(&Quantity::new(value, Dimension::LENGTH))
}

fn list(items: impl Iterator<Item = String>) -> String {
    format!("[{}]", items.collect::<Vec<_>>().join(", "))
}

fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for letter in text.chars() {
        match letter {
            '"' => quoted.push_str("\\\""),
            '\\' => quoted.push_str("\\\\"),
            control if control.is_control() => {
                // Writing to a string cannot fail.
                let _ = write!(quoted, "\\u{:04X}", control as u32);
            }
            plain => quoted.push(plain),
        }
    }
    quoted.push('"');
    quoted
}

/// A number that is 0 where it is not given.
pub(super) fn given(value: f64) -> Option<f64> {
    (value > 0.0).then_some(value)
}

pub(super) fn text(text: &str) -> Option<SettingValue> {
    Some(SettingValue::Text(text.to_owned()))
}

pub(super) fn beads(count: usize) -> SettingValue {
    SettingValue::Count(count)
}

pub(super) fn whole(count: u32) -> SettingValue {
    SettingValue::Count(count as usize)
}

pub(super) fn gaps(scene: &Scene) -> Option<SettingValue> {
    let gaps = &scene.chain.gaps;
    let first = gaps.first().copied().unwrap_or(0.0);
    Some(if gaps.iter().all(|other| *other == first) {
        SettingValue::Quantity(Quantity::new(first, Dimension::LENGTH))
    } else {
        SettingValue::Lengths(gaps.clone())
    })
}

pub(super) fn differing_beads(scene: &Scene) -> Option<SettingValue> {
    let beads = &scene.chain.beads;
    let numbered = beads.iter().enumerate().filter(|(_, bead)| Some(*bead) != beads.first());
    let differing: Vec<_> = numbered.map(|(index, bead)| (index + 1, bead.clone())).collect();
    (!differing.is_empty()).then_some(SettingValue::Beads(differing))
}

pub(super) fn ring(scene: &Scene) -> Option<&AnnulusShape> {
    Some(scene.support.ring()?.0)
}

pub(super) fn disc(scene: &Scene) -> Option<&DiscShape> {
    Some(scene.support.disc()?.0)
}

pub(super) fn water(scene: &Scene) -> Option<&WaterSettings> {
    disc(scene).and(scene.water.as_ref())
}

pub(super) fn absorption(scene: &Scene) -> Option<Absorption> {
    water(scene)?.absorption
}

pub(super) fn water_mesh(scene: &Scene) -> Option<WaterMesh> {
    if let WaterMethod::Elements(mesh) = water(scene)?.method { Some(mesh) } else { None }
}

pub(super) fn meshing(scene: &Scene) -> Option<Meshing> {
    let meshed = scene.model.kind.is_meshed() || scene.contact_law == ContactLaw::FiniteBody;
    meshed.then(|| scene.model.meshing())
}

pub(super) fn damped(scene: &Scene) -> Option<&Damping> {
    Some(&scene.damping).filter(|damping| !damping.kind.terms().is_empty())
}

pub(super) fn coefficient(scene: &Scene, term: DampingTerm) -> Option<SettingValue> {
    Some(SettingValue::Quantity(Quantity::new(scene.damping.coefficients[term], term.description().dimension)))
}

/// The coefficient of a term of a law that has others too.
pub(super) fn of_sum(scene: &Scene, term: DampingTerm) -> Option<f64> {
    let terms = scene.damping.kind.terms();
    (terms.len() > 1 && terms.contains(&term)).then(|| scene.damping.coefficients[term])
}
