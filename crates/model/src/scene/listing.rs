//! A scene written out again: key by key for a table, or as a TOML file that reads back as the same scene.

use std::fmt::Write;

use super::{
    Absorption, AnnulusShape, Bead, ContactLaw, Damping, DampingTerm, DiscShape, FieldPoint, Material, MeshFile,
    Meshing, Scene, Support, WaterMesh, WaterMethod, WaterSettings, key::Get, table::KEYS,
};
use granchain_signal::{Dimension, Quantity};

#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    pub key: String,
    pub value: SettingValue,
    pub meaning: &'static str,
}

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
                let mesh = bead.mesh.as_ref().map(|mesh| {
                    format!(
                        ", mesh = {}, mesh_unit = {}",
                        quoted(&mesh.path.display().to_string()),
                        length_toml(mesh.unit)
                    )
                });
                format!("{{ bead = {number}, radius = {radius}, material = {material}{} }}", mesh.unwrap_or_default())
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

    fn materials_in_use(&self) -> Vec<&Material> {
        let beads = self.chain.beads.iter().map(|bead| &bead.material);
        let all = beads.chain(self.support.material()).chain(&self.materials);
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
        let mut text = String::new();
        let mut table = "";
        let settings = self.settings();
        for setting in &settings {
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
}

fn of_material(material: &Material) -> impl Iterator<Item = Setting> {
    KEYS.iter().filter_map(move |key| {
        let Get::OfMaterial(get) = key.get else { return None };
        let name = key.name.replace('*', &material.name);
        Some(Setting { key: name, value: key.quantity(get(material)), meaning: key.meaning })
    })
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

pub(super) fn path(mesh: &MeshFile) -> Option<SettingValue> {
    text(&mesh.path.display().to_string())
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

/// The mesh of all beads; where not all have the same, each that has one says so itself.
pub(super) fn shared_mesh(scene: &Scene) -> Option<&MeshFile> {
    let beads = &scene.chain.beads;
    let first = beads.first().filter(|first| beads.iter().all(|bead| bead.mesh == first.mesh));
    first.and_then(|first| first.mesh.as_ref())
}

pub(super) fn differing_beads(scene: &Scene) -> Option<SettingValue> {
    let beads = &scene.chain.beads;
    let shared = shared_mesh(scene).is_some();
    let differs = |bead: &Bead| Some(bead) != beads.first() || !shared && bead.mesh.is_some();
    let numbered = beads.iter().enumerate().filter(|(_, bead)| differs(bead));
    let differing: Vec<_> = numbered.map(|(index, bead)| (index + 1, bead.clone())).collect();
    (!differing.is_empty()).then_some(SettingValue::Beads(differing))
}

pub(super) fn support_mesh(scene: &Scene) -> Option<&MeshFile> {
    if let Support::Body { mesh, .. } = &scene.support { Some(mesh) } else { None }
}

pub(super) fn ring(scene: &Scene) -> Option<&AnnulusShape> {
    if let Support::Annulus { shape, .. } = &scene.support { Some(shape) } else { None }
}

pub(super) fn disc(scene: &Scene) -> Option<&DiscShape> {
    if let Support::Disc { shape, .. } = &scene.support { Some(shape) } else { None }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{key::GOVERNORS, load};

    /// What a key says of when it has an effect is when a scene has a value for it.
    #[test]
    fn a_scene_lists_a_key_where_its_conditions_hold_and_nowhere_else() {
        let variants: [&[&str]; 15] = [
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
                let holds = GOVERNORS.iter().all(|governor| match (key.under(governor), listed(governor.name)) {
                    (Some(when), Some(SettingValue::Text(word))) => when.holds(word),
                    _ => true,
                });
                let left_out = matches!(key.name, "chain.mesh" | "chain.mesh_unit" | "chain.override")
                    || ["water.absorption", "horn.", "holder.", "loss.", "contact.yield_strength"]
                        .iter()
                        .any(|optional| key.name.starts_with(optional));
                let is_listed = listed(key.name).is_some();
                assert!(is_listed == holds || left_out && !is_listed, "{} with {overrides:?}", key.name);
            }
        }
    }
}
