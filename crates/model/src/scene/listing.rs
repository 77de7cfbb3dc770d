//! A scene written out again: key by key for a table, or as a TOML file that reads back as the same scene.

use std::fmt::Write;

use super::{
    Bead, ContactLaw, ContactNormal, Damping, DampingKind, DampingPlacement, DriveKind, FieldPoint, FlatContact,
    Integrator, Key, Material, MeshFile, ModelKind, Scene, Scheme, Support, disc, water,
};
use granchain_signal::{Dimension, Quantity};

/// One key of a scene with its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The key with its tables.
    pub key: String,
    /// Its value.
    pub value: SettingValue,
    /// What it means.
    pub meaning: &'static str,
}

/// A value of a scene.
#[derive(Debug, Clone, PartialEq)]
pub enum SettingValue {
    /// A number with its dimension.
    Quantity(Quantity),
    /// One length for each contact.
    Lengths(Vec<f64>),
    /// A whole number.
    Count(usize),
    /// A word or text.
    Text(String),
    /// Yes or no.
    Flag(bool),
    /// Beads that differ from the first, each with its number.
    Beads(Vec<(usize, Bead)>),
    /// Points of the water.
    FieldPoints(Vec<FieldPoint>),
}

impl SettingValue {
    /// As it stands in a TOML file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        match self {
            Self::Quantity(quantity) => quantity_toml(quantity),
            Self::Lengths(lengths) => list(lengths.iter().map(|length| length_toml(*length))),
            Self::Count(count) => count.to_string(),
            Self::Text(text) => quoted(text),
            Self::Flag(flag) => flag.to_string(),
            Self::Beads(beads) => list(beads.iter().map(|(number, bead)| {
                let (radius, material) = (length_toml(bead.radius), quoted(&bead.material.name));
                let mesh = bead
                    .mesh
                    .as_ref()
                    .map(|mesh| format!(", mesh = {}, mesh_unit = {}", quoted(&written(mesh)), length_toml(mesh.unit)));
                format!("{{ bead = {number}, radius = {radius}, material = {material}{} }}", mesh.unwrap_or_default())
            })),
            Self::FieldPoints(points) => {
                list(points.iter().map(|point| {
                    format!("{{ r = {}, z = {} }}", length_toml(point.radius), length_toml(point.distance))
                }))
            }
        }
    }

    /// For people.
    #[must_use]
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
    #[must_use]
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

fn written(mesh: &MeshFile) -> String {
    mesh.path.display().to_string()
}

fn list(items: impl Iterator<Item = String>) -> String {
    format!("[{}]", items.collect::<Vec<_>>().join(", "))
}

/// A TOML basic string.
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

#[derive(Default)]
pub(super) struct Settings(Vec<Setting>);

impl Settings {
    pub(super) fn add(&mut self, key: &str, value: SettingValue) {
        let meaning = Key::find(key).map_or("", |known| known.meaning);
        self.0.push(Setting { key: key.to_owned(), value, meaning });
    }

    pub(super) fn quantity(&mut self, key: &str, value: f64, dimension: Dimension) {
        self.add(key, SettingValue::Quantity(Quantity::new(value, dimension)));
    }

    pub(super) fn text(&mut self, key: &str, text: impl Into<String>) {
        self.add(key, SettingValue::Text(text.into()));
    }
}

impl Scene {
    /// Every key that has an effect in this scene, with its value, in the order of [`super::KEYS`].
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        let mut settings = Settings::default();
        settings.text("name", &self.name);
        settings.text("description", &self.description);
        settings.quantity("alpha", self.amplitude_scale, Dimension::NONE);
        settings.quantity("duration", self.duration, Dimension::TIME);
        settings.quantity("output_step", self.output_step, Dimension::TIME);
        settings.quantity("vibrometer.bandwidth", self.vibrometer_bandwidth, Dimension::FREQUENCY);
        self.chain_settings(&mut settings);
        settings.text("piston.contact", flat_word(self.piston));
        self.drive_settings(&mut settings);
        self.support_settings(&mut settings);
        damping_settings(&self.damping, &mut settings);
        if self.model.kind == ModelKind::Chain {
            settings.text("contact.law", self.contact_law.name());
        }
        self.model_settings(&mut settings);
        settings.0
    }

    fn support_settings(&self, settings: &mut Settings) {
        let normal_word = |normal| if normal == ContactNormal::Moving { "moving" } else { "fixed" };
        match &self.support {
            Support::Flat(flat) => settings.text("support.kind", flat_word(*flat)),
            Support::Annulus { stiffness_factor, material, normal } => {
                settings.text("support.kind", "annulus");
                settings.quantity("support.stiffness_factor", *stiffness_factor, Dimension::NONE);
                settings.text("support.material", &material.name);
                if self.model.kind.is_meshed() {
                    settings.text("support.normal", normal_word(*normal));
                }
            }
            Support::Spring { stiffness } => {
                settings.text("support.kind", "spring");
                settings.quantity("support.stiffness", *stiffness, Dimension::STIFFNESS);
            }
            Support::Disc { shape, mesh_density } => {
                settings.text("support.kind", "disc");
                disc::list(shape, *mesh_density, settings);
                water::list(self.water.as_ref(), settings);
            }
            Support::Body { mesh, material, normal } => {
                settings.text("support.kind", "body");
                settings.text("support.material", &material.name);
                settings.text("support.normal", normal_word(*normal));
                settings.text("support.mesh", written(mesh));
                settings.quantity("support.mesh_unit", mesh.unit, Dimension::LENGTH);
            }
        }
    }

    fn model_settings(&self, settings: &mut Settings) {
        settings.text("model.kind", self.model.kind.name());
        if self.model.kind == ModelKind::Fea {
            let fea = &self.model.fea;
            settings.add("model.mesh_density", SettingValue::Count(fea.density as usize));
            settings.text("model.elements", fea.elements.name());
            settings.quantity("model.contact_patch", fea.contact_patch, Dimension::NONE);
            settings.text("model.contact_mass", fea.contact_mass.name());
            settings.text("model.integrator", fea.scheme.name());
            if fea.scheme != Scheme::Trapezoid {
                settings.quantity("model.numerical_dissipation", fea.scheme.dissipation(), Dimension::NONE);
            }
            return settings.quantity("model.step", fea.step, Dimension::TIME);
        }
        if self.model.kind == ModelKind::Reduced {
            let reduced = &self.model.reduced;
            settings.add("model.mesh_density", SettingValue::Count(reduced.density as usize));
            settings.text("model.elements", reduced.elements.name());
            settings.quantity("model.contact_patch", reduced.contact_patch, Dimension::NONE);
            settings.add("model.modes", SettingValue::Count(reduced.modes as usize));
            return settings.quantity("model.step", reduced.step, Dimension::TIME);
        }
        if self.contact_law == ContactLaw::FiniteBody {
            settings.add("model.mesh_density", SettingValue::Count(self.model.fea.density as usize));
            settings.text("model.elements", self.model.fea.elements.name());
            settings.quantity("model.contact_patch", self.model.fea.contact_patch, Dimension::NONE);
        }
        match self.model.integrator {
            Integrator::DormandPrince853 { tolerance } => {
                settings.text("model.integrator", "dormand-prince-853");
                settings.quantity("model.tolerance", tolerance, Dimension::NONE);
            }
            Integrator::Symplectic { step } => {
                settings.text("model.integrator", "symplectic");
                settings.quantity("model.step", step, Dimension::TIME);
            }
        }
    }

    /// The scene as a TOML file with every key, which [`super::load_text`] reads back as the same scene.
    ///
    /// A drive of kind `record` is written by its file's name, as the program was given it. A record held in memory only has
    /// none; then `drive.file` is missing and asked for on reading.
    #[must_use]
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

    fn chain_settings(&self, settings: &mut Settings) {
        let chain = &self.chain;
        settings.add("chain.beads", SettingValue::Count(chain.beads.len()));
        let mut materials: Vec<&Material> = Vec::new();
        if let Some(first) = chain.beads.first() {
            settings.quantity("chain.radius", first.radius, Dimension::LENGTH);
            settings.text("chain.material", &first.material.name);
            materials.push(&first.material);
        }
        let gap = chain.gaps.first().copied().unwrap_or(0.0);
        if chain.gaps.iter().all(|other| *other == gap) {
            settings.quantity("chain.gaps", gap, Dimension::LENGTH);
        } else {
            settings.add("chain.gaps", SettingValue::Lengths(chain.gaps.clone()));
        }
        settings.quantity("chain.precompression", chain.precompression, Dimension::FORCE);
        // Not every bead the same mesh: then each that has one says so itself.
        let shared = chain.beads.first().filter(|first| chain.beads.iter().all(|bead| bead.mesh == first.mesh));
        if let Some(mesh) = shared.and_then(|first| first.mesh.as_ref()) {
            settings.text("chain.mesh", written(mesh));
            settings.quantity("chain.mesh_unit", mesh.unit, Dimension::LENGTH);
        }
        let differs = |bead: &Bead| Some(bead) != chain.beads.first() || shared.is_none() && bead.mesh.is_some();
        let numbered = chain.beads.iter().enumerate().filter(|(_, bead)| differs(bead));
        let differing: Vec<_> = numbered.map(|(index, bead)| (index + 1, bead.clone())).collect();
        if !differing.is_empty() {
            settings.add("chain.override", SettingValue::Beads(differing));
        }
        let of_support = match &self.support {
            Support::Annulus { material, .. } | Support::Body { material, .. } => Some(material),
            Support::Disc { shape, .. } => Some(&shape.material),
            Support::Flat(_) | Support::Spring { .. } => None,
        };
        for material in chain.beads.iter().map(|bead| &bead.material).chain(of_support).chain(&self.materials) {
            if !materials.iter().any(|known| known.name == material.name) {
                materials.push(material);
            }
        }
        for material in materials {
            let key = |word: &str| format!("materials.{}.{word}", material.name);
            settings.quantity(&key("youngs_modulus"), material.youngs_modulus, Dimension::PRESSURE);
            settings.quantity(&key("poissons_ratio"), material.poissons_ratio, Dimension::NONE);
            settings.quantity(&key("density"), material.density, Dimension::DENSITY);
        }
    }

    fn drive_settings(&self, settings: &mut Settings) {
        let drive = &self.drive;
        let (kind, cycles, ring_up, file) = match &drive.kind {
            DriveKind::SineCycles { cycles } => ("sine", Some(*cycles), None, None),
            DriveKind::ToneBurst { cycles, ring_up } => ("tone-burst", Some(*cycles), Some(*ring_up), None),
            DriveKind::GaussianBurst { cycles } => ("gaussian-burst", Some(*cycles), None, None),
            DriveKind::Record { file, .. } => ("record", None, None, file.as_ref()),
            DriveKind::UnreadRecord { file } => ("record", None, None, Some(file)),
        };
        settings.text("drive.kind", kind);
        if let Some(file) = file {
            settings.text("drive.file", file.display().to_string());
        }
        if kind != "record" {
            settings.quantity("drive.amplitude", drive.amplitude, Dimension::LENGTH);
        }
        settings.quantity("drive.frequency", drive.frequency, Dimension::FREQUENCY);
        if let Some(cycles) = cycles {
            settings.quantity("drive.cycles", cycles, Dimension::NONE);
        }
        if let Some(ring_up) = ring_up {
            settings.quantity("drive.ring_up", ring_up, Dimension::TIME);
        }
    }
}

fn flat_word(flat: FlatContact) -> &'static str {
    match flat {
        FlatContact::Rigid => "rigid",
        FlatContact::HalfSpace => "half-space",
    }
}

fn damping_settings(damping: &Damping, settings: &mut Settings) {
    settings.text("damping.kind", damping.kind.name());
    for term in damping.kind.terms() {
        settings.quantity(damping.kind.key_of(*term), damping.coefficients[*term], term.description().dimension);
    }
    if damping.kind == DampingKind::None {
        return;
    }
    let placement = match damping.placement {
        DampingPlacement::Beads => "beads",
        DampingPlacement::All => "all",
    };
    settings.text("damping.at", placement);
    settings.add("damping.tension", SettingValue::Flag(damping.tension));
}
