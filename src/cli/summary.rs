//! What `summary.json` says of a run besides its features, and the same for people.

use std::fmt::Write;

use anyhow::Context;
use serde::{Serialize, Serializer};

use super::{
    calibrated::Calibrated,
    output::aligned,
    replay::{PressureAt, Summary},
};
use crate::{
    calibration::{bench::Bench, drive::Input},
    feature::{Features, Ratio},
    measurement::sha256,
    model::chain::FiniteBodyLaws,
    report::{
        number::{engineering, fixed, significant},
        page::{Column, Table},
    },
    response::SolverWork,
    scene::{
        self, BUILT_IN, ContactLaw, DampingCoefficients, DampingPlacement, DampingTerm, DriveKind, FlatContact,
        Integrator, Limits, ModelKind, Scene, Support, TermDescription, simulated,
    },
    signal::Quantity,
    study::{
        EnsembleOutcome, EnsemblePlan, Spread,
        observation::{Watched, watched},
        published::Peaks,
    },
};

pub use crate::calibration::problem::program;

/// Pretty JSON with a newline at its end.
pub fn json(value: &impl Serialize) -> anyhow::Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value).context("the summary cannot be written as JSON")?;
    bytes.push(b'\n');
    Ok(bytes)
}

#[derive(Debug, Clone, Serialize)]
pub struct Settings {
    model: &'static str,
    integrator: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    tolerance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    step_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    numerical_dissipation: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh_density: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    elements: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    modes: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    contact_mass: Option<&'static str>,
    duration_s: f64,
    output_step_s: f64,
    beads: usize,
    alpha: f64,
    drive_frequency_hz: f64,
    precompression_n: f64,
    damping_kind: &'static str,
    #[serde(flatten, serialize_with = "by_term")]
    damping: DampingCoefficients,
    damping_at: &'static str,
    damping_tension: bool,
    /// What of the scene was set otherwise.
    pub overrides: Vec<String>,
    seed: u64,
}

/// A coefficient a term of the dashpots, in the terms' order.
fn by_term<S: Serializer>(coefficients: &DampingCoefficients, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(DampingTerm::ALL.map(|term| (term.description().setting, coefficients[term])))
}

impl Settings {
    /// Of a scene as it was run.
    pub fn new(scene: &Scene, experiment: &Bench, seed: u64) -> Self {
        let fea = Some(scene.model.fea).filter(|_| scene.model.kind == ModelKind::Fea);
        let reduced = Some(scene.model.reduced).filter(|_| scene.model.kind == ModelKind::Reduced);
        let meshing = Some(scene.model.meshing()).filter(|_| scene.model.kind.is_meshed());
        let (integrator, tolerance, step_s) = match (scene.model.kind, scene.model.integrator) {
            (ModelKind::Fea, _) => (scene.model.fea.scheme.name(), None, Some(scene.model.fea.step)),
            (ModelKind::Reduced, _) => ("kick-drift-kick", None, Some(scene.model.reduced.step)),
            (ModelKind::Chain, Integrator::DormandPrince853 { tolerance }) => {
                ("dormand-prince-853", Some(tolerance), None)
            }
            (ModelKind::Chain, Integrator::Symplectic { step }) => ("symplectic", None, Some(step)),
        };
        Self {
            model: scene.model.kind.name(),
            integrator,
            tolerance,
            step_s,
            numerical_dissipation: fea.map(|fea| fea.scheme.dissipation()),
            mesh_density: meshing.map(|meshing| meshing.density),
            elements: meshing.map(|meshing| meshing.elements.name()),
            modes: reduced.map(|reduced| reduced.modes),
            contact_mass: fea.map(|fea| fea.contact_mass.name()),
            duration_s: scene.duration,
            output_step_s: scene.output_step,
            beads: scene.chain.beads.len(),
            alpha: scene.amplitude_scale,
            drive_frequency_hz: scene.drive.frequency,
            precompression_n: scene.chain.precompression,
            damping_kind: scene.damping.kind.name(),
            damping: scene.damping.coefficients,
            damping_at: match scene.damping.placement {
                DampingPlacement::Beads => "beads",
                DampingPlacement::All => "all",
            },
            damping_tension: scene.damping.tension,
            overrides: experiment.overrides.clone(),
            seed,
        }
    }
}

/// The files a run was made from.
#[derive(Debug, Clone, Serialize)]
pub struct Inputs {
    #[serde(skip_serializing_if = "Option::is_none")]
    drive: Option<Input>,
    #[serde(skip_serializing_if = "Option::is_none")]
    scene: Option<Input>,
    #[serde(skip_serializing_if = "Option::is_none")]
    calibration: Option<Input>,
}

impl Inputs {
    /// With the digests of what was read.
    pub fn new(experiment: &Bench, calibrated: Option<&Calibrated>) -> Self {
        Self {
            drive: experiment.drive.as_ref().map(|drive| drive.input.clone()),
            scene: experiment.scene_file(),
            calibration: calibrated.map(|calibrated| calibrated.input.clone()),
        }
    }
}

/// Mean, scatter and sensitivity of every watched number, by name.
#[derive(Debug, Clone, Serialize)]
pub struct EnsembleTable {
    plan: EnsemblePlan,
    runs: usize,
    failed_runs: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    failures: Vec<String>,
    features: serde_json::Map<String, serde_json::Value>,
}

impl EnsembleTable {
    /// The outcome with names and units.
    pub fn new(outcome: &EnsembleOutcome) -> Self {
        let row = |watched: Watched, spread: &Spread| {
            let unit = if watched.unit.is_empty() { "1" } else { watched.unit };
            let value = serde_json::json!({
                "unit": unit, "mean": spread.mean, "scatter": spread.scatter,
                "sensitivity": spread.sensitivity, "sensitivity_error": spread.sensitivity_error,
            });
            (watched.key, value)
        };
        Self {
            plan: outcome.plan,
            runs: outcome.runs,
            failed_runs: outcome.failures.len(),
            failures: outcome.failures.clone(),
            features: watched()
                .into_iter()
                .zip(&outcome.spreads)
                .filter_map(|(watched, spread)| spread.as_ref().map(|spread| row(watched, spread)))
                .collect(),
        }
    }
}

/// SHA-256 of everything that decides what a scene's runs are: its debug form holds every number, recorded drive included, to the last bit. What a
/// run may ask for decides nothing.
pub fn scene_digest(scene: &Scene) -> String {
    sha256(format!("{:?}", scene.clone().with_limits(Limits::default())).as_bytes())
}

/// A scene's own words where they hold: a bench that was changed, or a file that took over the words of a built-in scene, is described by what stands on
/// it. The model has its own place.
pub fn described(scene: &Scene, overrides: &[String]) -> String {
    let changed = overrides.iter().any(|set| !set.starts_with("model."));
    let of_another =
        |name: &str| name != scene.name && scene::load(name, &[]).is_ok_and(|own| own.description == scene.description);
    let taken_over = || BUILT_IN.iter().any(|own| of_another(own.name));
    if !changed && !scene.description.is_empty() && !taken_over() {
        return scene.description.clone();
    }
    in_words(scene)
}

/// What stands on a bench, in a line.
pub fn in_words(scene: &Scene) -> String {
    let beads = &scene.chain.beads;
    let support = match &scene.support {
        Support::Flat(FlatContact::Rigid) => "rigid wall",
        Support::Flat(FlatContact::HalfSpace) => "half-space of the bead's material",
        Support::Annulus { .. } => "annulus",
        Support::Spring { .. } => "spring",
        Support::Foundation { plate: None, .. } => "elastic half-space",
        Support::Foundation { .. } => "plate on a half-space",
        Support::Disc { .. } if scene.water.is_some() => "disc on water",
        Support::Disc { .. } => "disc in vacuum",
        Support::Body { .. } => "meshed body",
        Support::Free => "free end",
    };
    format!(
        "{} {} beads of radius {}, {support}, {}, damping {}",
        beads.len(),
        beads[0].material.name,
        engineering(beads[0].radius, "m", 4),
        if scene.is_struck() { "struck".to_owned() } else { engineering(scene.drive.frequency, "Hz", 4) },
        scene.damping.kind.name()
    )
}

pub fn text(scene: &Scene, summary: &Summary, spread: Option<&EnsembleOutcome>) -> String {
    let mut text = format!("{}: {}\n", scene.name, described(scene, &summary.settings.overrides));
    for (name, value) in facts(scene, summary) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {name:<11}{value}");
    }
    if let Some(spread) = spread {
        let _ = write!(text, "\n{}", aligned(&ensemble(summary, spread)));
    }
    text
}

/// What a run's report says, line by line: name and value.
pub fn facts(scene: &Scene, summary: &Summary) -> Vec<(String, String)> {
    let mut facts = Vec::new();
    let mut row = |name: &str, value: String| facts.push((name.to_owned(), value));
    row("model", model(scene));
    let simulated = simulated(scene);
    row("effects", simulated.strip_prefix("Effects simulated: ").unwrap_or(&simulated).to_owned());
    row(
        "drive",
        format!(
            "{}{}, alpha {}, {} simulated",
            drive(scene),
            if scene.is_struck() {
                String::new()
            } else {
                format!(" at {}", engineering(scene.drive.frequency, "Hz", 4))
            },
            short(scene.amplitude_scale),
            engineering(scene.duration, "s", 4)
        ),
    );
    row("damping", damping(scene));
    if !scene.is_struck() {
        row("peaks", peaks(scene, summary));
        row("lines", lines(summary));
    }
    if let Some(features) = &summary.features {
        row("distortion", format!("{} (rms of the drive's harmonics / Hann-weighted rms)", fixed(features.thd, 3)));
    }
    row(
        "energy",
        format!(
            "{}, {} dissipated, residual {} of the peak energy",
            if scene.is_struck() {
                format!("{} at the start", engineering(summary.energy.initial_j, "J", 3))
            } else {
                format!("{} put in by the piston", engineering(summary.energy.piston_work_j, "J", 3))
            },
            engineering(summary.energy.dissipated_j, "J", 3),
            significant(summary.energy.residual_j / summary.energy.largest_j, 2)
        ),
    );
    if let Some(channels) = summary.energy.channels {
        let parts = [
            ("in drag", channels.drag_j),
            ("in friction", channels.friction_j),
            ("where contacts yielded", channels.yielding_j),
            ("within the bodies", channels.material_j),
            ("in the horn", channels.horn_lost_j),
        ];
        let lost = parts.iter().filter(|(_, energy)| *energy != 0.0);
        let lost: Vec<String> =
            lost.map(|(place, energy)| format!("{} {place}", engineering(*energy, "J", 3))).collect();
        if !lost.is_empty() {
            row("", format!("besides lost: {}", lost.join(", ")));
        }
    }
    if let (Some(water), in_disc) = (summary.energy.water_j, summary.energy.disc_j) {
        let share = match in_disc {
            Some(disc) => format!(
                "{} radiated into the water, {} in the disc",
                engineering(water, "J", 3),
                engineering(disc, "J", 2)
            ),
            None => format!("{} given to disc and water together", engineering(water, "J", 3)),
        };
        row("", share);
    }
    for point in &summary.pressure {
        row("pressure", pressure(point));
    }
    row("work", work(summary));
    if let Some(laws) = &summary.contact_laws {
        row("contacts", contacts(laws));
    }
    facts
}

/// The model and what its accuracy hangs on.
pub fn model(scene: &Scene) -> String {
    let model = &scene.model;
    let step = |step: f64| format!("step {}", engineering(step, "s", 3));
    let settings = match (model.kind, model.integrator) {
        (ModelKind::Chain, integrator) => {
            let law =
                if scene.contact_law == ContactLaw::Hertz { "Hertz contacts" } else { "contacts of finite bodies" };
            match integrator {
                Integrator::DormandPrince853 { tolerance } => {
                    format!("{law}, adaptive steps, tolerance {tolerance:.0e}")
                }
                Integrator::Symplectic { step: fixed } => format!("{law}, {}", step(fixed)),
            }
        }
        (ModelKind::Reduced, _) => format!(
            "mesh density {}, {} modes a body, {}",
            model.meshing().density,
            model.reduced.modes,
            step(model.reduced.step)
        ),
        (ModelKind::Fea, _) => {
            format!("mesh density {}, {}, {}", model.meshing().density, model.fea.scheme.name(), step(model.fea.step))
        }
    };
    format!("{}: {settings}", model.kind.name())
}

/// The fitted contact laws and how well they follow the bodies' statics.
fn contacts(laws: &FiniteBodyLaws) -> String {
    // Before a ring alone the others are Hertz' by choice.
    let fitted = laws.fits.iter().filter(|fit| fit.quality.is_some() || !laws.couplings.is_empty());
    let fits = fitted.map(|fit| match fit.quality {
        Some(quality) => format!(
            "{} within {} % ({} to {})",
            fit.between,
            significant(100.0 * quality.largest_error, 2),
            engineering(quality.forces_n.0, "N", 2),
            engineering(quality.forces_n.1, "N", 2)
        ),
        None => format!("{} not fitted", fit.between),
    });
    format!("fitted at mesh density {}: {}", laws.mesh_density, fits.collect::<Vec<_>>().join(", "))
}

fn work(summary: &Summary) -> String {
    let SolverWork { unknowns, steps, rejected_steps, evaluations, events, factorisations, .. } = summary.work;
    match &summary.analysis {
        // The reduced model counts neither evaluations nor contacts.
        None if evaluations == 0 => format!("{unknowns} unknowns, {steps} steps"),
        None => format!(
            "{unknowns} unknowns, {steps} steps, {rejected_steps} rejected, {evaluations} evaluations, {events} contact events"
        ),
        Some(analysis) => format!(
            "{} elements, {unknowns} unknowns, {steps} steps, {rejected_steps} taken back and halved, {factorisations} factored \
             bodies",
            analysis.elements
        ),
    }
}

pub fn drive(scene: &Scene) -> String {
    let peak = engineering(scene.drive.amplitude, "m", 3);
    match &scene.drive.kind {
        DriveKind::SineCycles { cycles } => format!("{} cycles of {peak}", short(*cycles)),
        DriveKind::ToneBurst { cycles, ring_up } => {
            format!("tone burst of {} cycles and {peak}, ring-up {}", short(*cycles), engineering(*ring_up, "s", 3))
        }
        DriveKind::GaussianBurst { cycles } => format!("Gaussian burst of {} cycles and {peak}", short(*cycles)),
        DriveKind::Striker { bead, velocity } => {
            format!("striker of radius {} at {}", engineering(bead.radius, "m", 3), engineering(*velocity, "m/s", 3))
        }
        DriveKind::Record { displacement, file, .. } => {
            let name = file.as_ref().map_or("in memory".into(), |file| file.display().to_string());
            format!("recorded horn displacement ({name}), peak {}", engineering(displacement.peak(), "m", 3))
        }
        DriveKind::UnreadRecord { file } => format!("record {}", file.display()),
    }
}

/// Four significant digits without trailing zeros.
fn short(value: f64) -> String {
    format!("{value:.3e}").parse::<f64>().unwrap_or(value).to_string()
}

pub fn damping(scene: &Scene) -> String {
    let law = &scene.damping;
    let place = match law.placement {
        DampingPlacement::Beads => "between beads only",
        DampingPlacement::All => "at every contact",
    };
    let term = |term: &DampingTerm| {
        let TermDescription { title, dimension, .. } = *term.description();
        let rounded = format!("{:.3e}", law.coefficients[*term]).parse().unwrap_or(law.coefficients[*term]);
        (title, Quantity::new(rounded, dimension).format_si())
    };
    match law.kind.terms() {
        [] => "none".into(),
        [only] => {
            let (title, coefficient) = term(only);
            format!("{title}, {coefficient}, {place}")
        }
        several => {
            let terms = several.iter().map(term).map(|(title, coefficient)| format!("{title} {coefficient}"));
            format!("{}, {place}", terms.collect::<Vec<_>>().join(" + "))
        }
    }
}

fn peaks(scene: &Scene, summary: &Summary) -> String {
    let pair = |positive: f64, negative: f64| format!("+{}/{}", fixed(1e3 * positive, 0), fixed(1e3 * negative, 0));
    let (place, band) = (summary.observed.name(), engineering(scene.vibrometer_bandwidth, "Hz", 3));
    let mut text = match &summary.features {
        Some(Features { peaks, .. }) => {
            format!("{} mm/s at the {place} of the last bead, below {band}", pair(peaks.positive, peaks.negative))
        }
        None => format!("none: the {place} of the last bead does not move"),
    };
    if let Some(published) = &summary.published {
        let measured = published.measured;
        let _ = write!(text, "; paper: measured {}", pair(measured.positive_m_per_s, measured.negative_m_per_s));
        if let Some(simulated) = published.simulated {
            let _ = write!(text, ", simulated {}", pair(simulated.positive_m_per_s, simulated.negative_m_per_s));
        }
    }
    text
}

/// Peaks and levels of the pressure at one point.
fn pressure(point: &PressureAt) -> String {
    let PressureAt { r_m, z_m, features } = point;
    let place = if *r_m == 0.0 {
        format!("{} on the axis", engineering(*z_m, "m", 3))
    } else {
        format!("r {}, z {}", engineering(*r_m, "m", 3), engineering(*z_m, "m", 3))
    };
    let kpa = |pascal: f64| significant(1e-3 * pascal, 3);
    let mut text = format!("+{}/{} kPa at {place}", kpa(features.peaks.positive), kpa(features.peaks.negative));
    let level = |order: u32| features.harmonics.iter().find(|harmonic| harmonic.order == order);
    let shown: Vec<String> = [2, 3, 4]
        .into_iter()
        .filter_map(level)
        .map(|harmonic| format!("{} f0 {} dB", harmonic.order, fixed(harmonic.level_db, 1)))
        .collect();
    let probe = features
        .probe_level_db
        .map(|level| format!("{} {} dB", engineering(features.probe_hz, "Hz", 2), fixed(level, 1)));
    let levels: Vec<String> = shown.into_iter().chain(probe).collect();
    if !levels.is_empty() {
        // Writing to a string cannot fail.
        let _ = write!(text, "; {} re f0", levels.join(", "));
    }
    if let Some(highest) = features.content_hz {
        let _ = write!(
            text,
            "; within {} dB up to {}",
            fixed(-features.content_level_db, 0),
            engineering(highest, "Hz", 3)
        );
    }
    text
}

fn lines(summary: &Summary) -> String {
    let shown = [(1, 3), (1, 2), (2, 3), (1, 1), (2, 1), (3, 1)].map(|(num, den)| Ratio::new(num, den));
    let line = |ratio: Ratio| {
        let found = summary.features.as_ref().and_then(|features| features.line(ratio));
        let amplitude = found.map_or("–".into(), |line| fixed(1e3 * line.amplitude, 1));
        format!("{ratio}: {amplitude}")
    };
    format!("at n f0, mm/s: {}", shown.map(line).join("  "))
}

/// What an ensemble says.
pub fn ensemble(summary: &Summary, outcome: &EnsembleOutcome) -> Table {
    let (plan, published) = (&outcome.plan, summary.published.as_ref());
    let row = |(watched, spread): (Watched, &Option<Spread>)| {
        let spread = spread.as_ref()?;
        let (factor, unit, digits) = if watched.unit == "m/s" { (1e3, " mm/s", 1) } else { (1.0, "", 3) };
        let shown = |value: f64| fixed(factor * value, digits);
        let mut row = vec![
            format!("{}{unit}", watched.key.replace('_', " ")),
            shown(spread.mean),
            shown(spread.scatter),
            format!("{} ± {}", shown(spread.sensitivity), shown(spread.sensitivity_error)),
        ];
        let pick = |peaks: Peaks| match watched.key.as_str() {
            "positive_peak" => fixed(1e3 * peaks.positive_m_per_s, 0),
            "negative_peak" => fixed(1e3 * peaks.negative_m_per_s, 0),
            _ => String::new(),
        };
        row.extend(
            published
                .map(|it| [Some(it.measured), it.simulated].map(|it| it.map_or_else(String::new, pick)))
                .into_iter()
                .flatten(),
        );
        Some(row)
    };
    let printed: &[&str] = if published.is_some() { &["measured", "simulated"] } else { &[] };
    let columns = ["mean", "scatter", "per +1 % drive"].iter().chain(printed).map(|title| Column::numbers(*title));
    Table {
        caption: format!(
            "Ensemble of {} (gaps ± {} nm, drive ± {} %; fixed-step runs at 0, +1 and −1 % drive, {} failed{})",
            plan.replicates,
            significant(1e9 * plan.gap_jitter_m, 2),
            significant(100.0 * plan.drive_jitter, 2),
            outcome.failures.len(),
            if published.is_some() { "; measured, simulated: as printed in the source paper" } else { "" }
        ),
        columns: [Column::words("")].into_iter().chain(columns).collect(),
        rows: watched().into_iter().zip(&outcome.spreads).filter_map(row).collect(),
    }
}
