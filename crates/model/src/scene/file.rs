//! Scene files: layers of keys (built-in scene, file, overrides) → a checked [`Scene`].

use std::path::{Path, PathBuf};

use super::{
    Bead, Chain, Damping, DampingCoefficients, DampingKind, Drive, DriveKind, FlatContact, Material, ModelKind, Scene,
    SceneText, Support, TermDescription, annulus, builtin,
    condition::CHAIN_INTEGRATORS,
    contact_law, disc,
    document::{Document, Value, resolved},
    error::SceneError,
    holder, horn, loss, mesh_file, model_kind,
    reader::{Bound, Reader},
    settings,
    shown::{frequency, length, time},
    source::Author,
    water,
};
use granchain_signal::{Dimension, Quantity};

/// Default interval of the output samples, s.
pub const DEFAULT_OUTPUT_STEP: f64 = 1e-7;
/// `vibrometer.bandwidth` unless set, Hz, or four drive frequencies where that is more: of a decoder of this class; the lowest mode of a 1 mm steel bead rings at 2.6 MHz.
pub const DEFAULT_VIBROMETER_BANDWIDTH: f64 = 1.5e6;
pub const MOST_BEADS: usize = 1000;
/// Drive frequency of a scene whose record is not read yet, where it states none, Hz.
pub const UNREAD_FREQUENCY: f64 = 73e3;
const MOST_SAMPLES: f64 = 2e7;

#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Loaded {
    pub scene: Scene,
    /// Values that were chosen rather than read, one sentence each.
    pub notes: Vec<String>,
    /// Whether nothing states `drive.frequency`, which is then that of the record that drives: [`UNREAD_FREQUENCY`] until it is read.
    pub lacks_frequency: bool,
}

/// Load a built-in scene by name or a scene file by path, changed by overrides `KEY=VALUE`.
///
/// A name that is both is the built-in scene; write `./rigid` for a file called so. A drive of kind `record` is not
/// read here: see [`Scene::pending_record`].
///
/// ```
/// use granchain_model::scene::{DampingTerm, load};
///
/// let scene = load("annulus", &["damping.coefficient=0.4".into(), "chain.beads=8".into()])?;
/// assert_eq!((scene.damping.coefficients[DampingTerm::Linear], scene.chain.beads.len()), (0.4, 8));
/// # Ok::<(), granchain_model::scene::SceneError>(())
/// ```
///
/// # Errors
/// A [`SceneError`] naming place, key, what was expected and what was found.
pub fn load(name_or_path: &str, overrides: &[String]) -> Result<Scene, SceneError> {
    load_with_notes(name_or_path, overrides).map(|loaded| loaded.scene)
}

pub fn load_with_notes(name_or_path: &str, overrides: &[String]) -> Result<Loaded, SceneError> {
    load_preferring(name_or_path, overrides, ModelKind::Chain)
}

/// As [`load_with_notes`], where a scene that names no model is computed by `preferred`. Half-spaces of steel and keys of its integrators and contact laws
/// belong to the chain: a scene with them takes it instead, and a note says so.
///
/// ```
/// use granchain_model::scene::{ModelKind, load_preferring};
///
/// let kind = |name, set: &str| load_preferring(name, &[set.into()], ModelKind::Reduced).map(|loaded| loaded.scene.model.kind);
/// assert_eq!(kind("rigid", "alpha=1")?, ModelKind::Reduced);
/// assert_eq!(kind("rigid", "support.kind=half-space")?, ModelKind::Chain);
/// assert_eq!(kind("chain", "alpha=1")?, ModelKind::Chain);
/// # Ok::<(), granchain_model::scene::SceneError>(())
/// ```
pub fn load_preferring(name_or_path: &str, overrides: &[String], preferred: ModelKind) -> Result<Loaded, SceneError> {
    SceneText::read(name_or_path)?.load(overrides, preferred)
}

/// Read a scene from TOML text; `path` names it in messages, and what it points to is relative to the folder of `path`.
pub fn load_text(text: &str, path: &Path, overrides: &[String]) -> Result<Loaded, SceneError> {
    parse(text, path, overrides, ModelKind::Chain)
}

pub(super) fn parse(text: &str, path: &Path, overrides: &[String], preferred: ModelKind) -> Result<Loaded, SceneError> {
    let own = Document::parse(text, Author::File(path))?;
    let document = match own.entries.get("extends") {
        None => own,
        Some(entry) => {
            let name = own.text("extends").ok_or_else(|| SceneError::WrongType {
                place: entry.place.clone(),
                key: "extends".into(),
                expected: "the name of a built-in scene, in quotes".into(),
                found: entry.value.describe(),
            })?;
            let base = builtin::find(name, Some(entry.place.clone()))?;
            let mut document = Document::parse(base.toml, Author::BuiltIn(base.name))?;
            document.entries.remove("name");
            document.entries.remove("description");
            document.overlay(own);
            document
        }
    };
    let stem = path.file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy());
    assemble(document, overrides, &path.display().to_string(), &stem, preferred)
}

pub(super) fn assemble(
    mut document: Document,
    overrides: &[String],
    origin: &str,
    name: &str,
    preferred: ModelKind,
) -> Result<Loaded, SceneError> {
    document.entries.remove("extends");
    let overrides = Document::from_overrides(overrides)?;
    if let Some(entry) = overrides.entries.get("extends") {
        return Err(SceneError::OutOfRange {
            place: entry.place.clone(),
            key: "extends".into(),
            expected: "this key in scene files only".into(),
            found: "an override; use --scene NAME".into(),
        });
    }
    document.overlay(overrides);
    let mut notes = Vec::new();
    for key in FLATS.into_iter().filter(|key| document.text(key) == Some("steel")).collect::<Vec<_>>() {
        notes.push(format!(
            "`{key}` = \"steel\" is called \"half-space\" now: of the bead's own material, whichever that is"
        ));
        if let Some(entry) = document.entries.get_mut(key) {
            entry.value = Value::Text("half-space".into());
        }
    }
    if preferred != ModelKind::Chain && document.text("model.kind").is_none() {
        match of_the_chain(&document) {
            Some(reason) => notes.push(format!("`model.kind` is not given; taken as chain, since {reason}")),
            None => document.insert_default("model.kind", preferred.name(), origin),
        }
    }
    let reader = Reader::new(&document, origin);
    reader.refuse_unused()?;
    let scene = scene(&reader, name, &mut notes)?;
    reader.check_materials()?;
    let lacks_frequency = !reader.has("drive.frequency");
    Ok(Loaded { scene, notes, lacks_frequency })
}

/// Drive frequency below which the unit was probably forgotten, Hz.
const SLOWEST_HORN: f64 = 1e3;

const FLATS: [&str; 2] = ["piston.contact", "support.kind"];

fn of_the_chain(document: &Document) -> Option<String> {
    if let Some(key) = FLATS.into_iter().find(|key| document.text(key) == Some("half-space")) {
        return Some(format!("the half-space of `{key}` has no body that could be meshed"));
    }
    if document.text("support.kind") == Some("disc") {
        return Some(
            "it is the usual model before the disc of `support.kind` = \"disc\"; reduced and fea run there when named"
                .to_owned(),
        );
    }
    let is_own = document.entries.contains_key("model.tolerance")
        || document.text("model.integrator").is_some_and(|word| CHAIN_INTEGRATORS.contains(&word));
    if is_own {
        return Some("its integrator is asked for".into());
    }
    ["contact.law", "contact.yield_strength"]
        .into_iter()
        .find(|key| document.entries.contains_key(*key))
        .map(|key| format!("`{key}` is of the chain"))
}

fn scene(reader: &Reader<'_>, name: &str, notes: &mut Vec<String>) -> Result<Scene, SceneError> {
    let chain = chain(reader)?;
    let drive = drive(reader)?;
    if drive.frequency < SLOWEST_HORN {
        notes.push(format!(
            "`drive.frequency` is {}: a plain number is in Hz, and no horn is as slow as that; write it with its unit, such as \"73 kHz\"",
            frequency(drive.frequency)
        ));
    }
    let amplitude_scale = reader.number("alpha")?;
    if !matches!(drive.kind, DriveKind::UnreadRecord { .. }) {
        let motion = amplitude_scale * drive.amplitude;
        let radius = chain.beads[0].radius;
        if motion >= radius {
            let expected = format!("α × amplitude below the bead radius {}", length(radius));
            return Err(reader.out_of_range("drive.amplitude", expected, length(motion)));
        }
    }
    let duration = reader.number("duration")?;
    let output_step = reader.number("output_step")?;
    if output_step > duration {
        let expected = format!("at most the duration {}", time(duration));
        let key = if reader.has("output_step") { "output_step" } else { "duration" };
        return Err(reader.out_of_range(key, expected, time(output_step)));
    }
    if duration / output_step > MOST_SAMPLES {
        let expected = format!("at most {MOST_SAMPLES} samples in {}", time(duration));
        return Err(reader.out_of_range("output_step", expected, time(output_step)));
    }
    let bandwidth = reader.given("vibrometer.bandwidth")?;
    let vibrometer_bandwidth = bandwidth.unwrap_or(f64::max(DEFAULT_VIBROMETER_BANDWIDTH, 4.0 * drive.frequency));
    if vibrometer_bandwidth <= drive.frequency {
        let expected = format!("above the drive frequency {}", frequency(drive.frequency));
        return Err(reader.out_of_range("vibrometer.bandwidth", expected, frequency(vibrometer_bandwidth)));
    }
    let support = support(reader, &chain)?;
    let water = match &support {
        Support::Disc { shape, .. } => water::read(reader, shape)?,
        _ => None,
    };
    let kind = model_kind::kind(reader)?;
    let exact_friction = holder::is_exact(kind, &support);
    let least_radius = chain.beads.iter().map(|bead| bead.radius).fold(f64::INFINITY, f64::min);
    Ok(Scene {
        name: reader.text("name")?.unwrap_or(name).to_owned(),
        description: reader.text("description")?.unwrap_or("").to_owned(),
        piston: reader.word("piston.contact")?,
        materials: mesh_file::materials(reader, &chain, &support)?,
        support,
        water,
        damping: damping(reader, notes)?,
        contact_law: contact_law::read(reader)?,
        yield_strength: reader.given("contact.yield_strength")?,
        horn: horn::read(reader, drive.frequency)?,
        holder: holder::read(reader, (exact_friction, kind.is_meshed()), least_radius)?,
        loss: loss::read(reader)?,
        model: settings::read(reader, drive.frequency, output_step, notes)?,
        chain,
        drive,
        amplitude_scale,
        duration,
        output_step,
        vibrometer_bandwidth,
    })
}

fn chain(reader: &Reader<'_>) -> Result<Chain, SceneError> {
    let count = reader.beads()?;
    let radius = reader.number("chain.radius")?;
    let material = reader.material("chain.material")?;
    let mesh = mesh_file::read(reader, "chain.mesh", "chain.mesh_unit")?;
    let mut beads = vec![Bead { radius, material, mesh }; count];
    reader.override_beads(&mut beads)?;
    let gaps = reader.gaps(count, radius)?;
    let precompression = reader.number("chain.precompression")?;
    // Overlaps of 7 % of the radius: far beyond Hertz' small contacts, and beyond the yield of any steel.
    let softest =
        beads.iter().map(|bead| bead.material.youngs_modulus * bead.radius.powi(2)).fold(f64::INFINITY, f64::min);
    if precompression > 0.01 * softest {
        let force = |value| Quantity::new(value, Dimension::FORCE).to_string();
        let limit = format!("{:.2e}", 0.01 * softest).parse().unwrap_or(softest);
        let expected = format!("at most {} (E a²/100), where contacts are still small", force(limit));
        return Err(reader.out_of_range("chain.precompression", expected, force(precompression)));
    }
    if precompression > 0.0
        && let Some(open) = gaps.iter().position(|gap| *gap > 0.0)
    {
        return Err(SceneError::PrecompressedGap {
            place: reader.place("chain.precompression"),
            force: Quantity::new(precompression, Dimension::FORCE).to_string(),
            contact: open + 1,
            gap: length(gaps[open]),
        });
    }
    let chain = Chain { beads, gaps, precompression };
    mesh_file::refuse_idle_unit(reader, &chain)?;
    Ok(chain)
}

fn drive(reader: &Reader<'_>) -> Result<Drive, SceneError> {
    let kind = reader.required_choice("drive.kind")?;
    if kind == "record" {
        let frequency = reader.given("drive.frequency")?.unwrap_or(UNREAD_FREQUENCY);
        let reason = Some("a drive of kind `record` is read from a file");
        let file = reader.required_text("drive.file", reason)?;
        let file = resolved(file, &reader.place("drive.file"));
        return Ok(Drive { kind: DriveKind::UnreadRecord { file }, amplitude: 1.0, frequency });
    }
    let frequency = reader.number("drive.frequency")?;
    let (amplitude, cycles) = (reader.number("drive.amplitude")?, reader.number("drive.cycles")?);
    // Elsewhere the burst would begin or end away from zero, and the piston would have to jump.
    let must_close = |parts: f64, expected: &str| {
        if (cycles * parts).fract() == 0.0 {
            return Ok(());
        }
        let expected = format!("{expected}, where the sine passes zero; else the piston would jump");
        Err(reader.out_of_range("drive.cycles", expected, cycles.to_string()))
    };
    let kind = match kind {
        "sine" => {
            must_close(2.0, "a whole or half number of cycles")?;
            DriveKind::SineCycles { cycles }
        }
        "gaussian-burst" => {
            must_close(1.0, "a whole number of cycles")?;
            DriveKind::GaussianBurst { cycles }
        }
        _ => {
            let ring_up = reader.number("drive.ring_up")?;
            if ring_up == 0.0 {
                must_close(2.0, "a whole or half number of cycles (with ring_up = 0)")?;
            }
            DriveKind::ToneBurst { cycles, ring_up }
        }
    };
    Ok(Drive { kind, amplitude, frequency })
}

fn support(reader: &Reader<'_>, chain: &Chain) -> Result<Support, SceneError> {
    let kind = reader.required_choice("support.kind")?;
    Ok(match kind {
        "annulus" => {
            let radius = chain.beads.last().map_or(0.0, |bead| bead.radius);
            let stiffness_factor = reader.number("support.stiffness_factor")?;
            let (shape, material) = (annulus::read(reader, radius)?, support_material(reader)?);
            Support::Annulus { shape, stiffness_factor, material, normal: reader.word("support.normal")? }
        }
        "body" => {
            if !model_kind::kind(reader)?.is_meshed() {
                let expected = "a support with a force law where `model.kind` is \"chain\"".to_owned();
                return Err(reader.out_of_range("support.kind", expected, "`body`, which is meshed".to_owned()));
            }
            let reason = Some("a support of kind `body` is read from a mesh file");
            let Some(mesh) = mesh_file::read(reader, "support.mesh", "support.mesh_unit")? else {
                return Err(reader.missing("support.mesh", reason));
            };
            Support::Body { mesh, material: support_material(reader)?, normal: reader.word("support.normal")? }
        }
        "spring" => {
            let reason = Some("a support of kind `spring` needs it");
            Support::Spring { stiffness: reader.required("support.stiffness", reason)? }
        }
        "disc" => disc::read(reader)?,
        "free" => {
            if chain.precompression > 0.0 {
                let force = Quantity::new(chain.precompression, Dimension::FORCE).to_string();
                let expected =
                    "0 N before a free end (`support.kind` = \"free\"), which holds no static force".to_owned();
                return Err(reader.out_of_range("chain.precompression", expected, force));
            }
            Support::Free
        }
        "half-space" => Support::Flat(FlatContact::HalfSpace),
        _ => Support::Flat(FlatContact::Rigid),
    })
}

fn support_material(reader: &Reader<'_>) -> Result<Material, SceneError> {
    let key = "support.material";
    let name = reader.text(key)?.map_or_else(|| Material::resin().name, str::to_owned);
    reader.material_named(&name, key, || reader.place(key))
}

fn damping(reader: &Reader<'_>, notes: &mut Vec<String>) -> Result<Damping, SceneError> {
    let kind = reader.required_choice("damping.kind")?;
    let mut coefficient = |key: &str, dimension, default| {
        let given = reader.quantity(key, dimension, Bound::NotNegative)?;
        Ok(given.unwrap_or_else(|| {
            let value = Quantity::new(default, dimension);
            notes.push(format!("`{key}` is not given for `damping.kind = \"{kind}\"`; taken as the paper's {value}"));
            default
        }))
    };
    let kind = DampingKind::named(kind).unwrap_or(DampingKind::None);
    let mut coefficients = DampingCoefficients::default();
    for term in kind.terms() {
        let TermDescription { dimension, default, .. } = *term.description();
        coefficients[*term] = coefficient(kind.key_of(*term), dimension, default)?;
    }
    let placement = reader.word("damping.at")?;
    Ok(Damping { kind, coefficients, placement, tension: reader.flag("damping.tension")?.unwrap_or(false) })
}

impl Scene {
    /// The horn-tip record this scene wants and does not hold yet: read it and hand it to [`Scene::with_drive_record`].
    pub fn pending_record(&self) -> Option<&Path> {
        match &self.drive.kind {
            DriveKind::UnreadRecord { file } => Some(file),
            _ => None,
        }
    }

    /// The same scene driven by a record.
    ///
    /// - `displacement`: m, positive towards the chain, band-limited, starting and ending near 0, at t ≥ 0
    /// - `frequency`: its drive frequency f0, Hz
    /// - `file`: where it came from, for provenance; a pending file's name stays if `None`
    #[must_use]
    pub fn with_drive_record(
        self,
        displacement: granchain_signal::Series,
        frequency: f64,
        file: Option<PathBuf>,
    ) -> Self {
        let recorded_until = displacement.end();
        self.with_continued_record(displacement, recorded_until, vec![], frequency, file)
    }

    /// The same scene driven by a record that was continued beyond what was recorded.
    ///
    /// - `recorded_until`: last instant of recorded motion, s; burst and comparison end there at the latest
    /// - `shakes`: realisations of what is not known of the displacement, m, at its instants
    ///
    /// The others as in [`Scene::with_drive_record`].
    #[must_use]
    pub fn with_continued_record(
        mut self,
        displacement: granchain_signal::Series,
        recorded_until: f64,
        shakes: Vec<granchain_signal::Series>,
        frequency: f64,
        file: Option<PathBuf>,
    ) -> Self {
        let file = file.or_else(|| match &self.drive.kind {
            DriveKind::UnreadRecord { file } => Some(file.clone()),
            DriveKind::Record { file, .. } => file.clone(),
            _ => None,
        });
        self.drive =
            Drive { kind: DriveKind::Record { displacement, recorded_until, shakes, file }, amplitude: 1.0, frequency };
        self
    }
}
