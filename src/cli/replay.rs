//! `granchain replay`: run one scene and write what came out.

mod analysis;
mod field;

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use serde::Serialize;

use self::{
    analysis::{Analysis, AnalysisArguments, AnalysisSummary},
    field::FieldArguments,
};
use super::{
    Outcome,
    arguments::{OutputArguments, SceneArguments, Session, Words, one_of, preferred_model, usage, whole},
    calibrated::Calibrated,
    experiment,
    forecast::Forecast,
    interrupt,
    output::OutputFolder,
    progress,
    reading::ReadArguments,
    summary,
    timing::{self, Timing},
};
use crate::{
    calibration::bench::Bench,
    feature::{FeatureError, FeatureSettings, Features, PressureFeatures, PressureSettings, Window, measure_pressure},
    model::{Estimate, ModelError, Prepared, chain::FiniteBodyLaws},
    report::{dynamics, figure::Figure, hydrophone, number::significant, replay::ReplayReport},
    response::{EnergyBalance, ObservedPoint, Response, SolverWork, write_csv},
    scene::{Effect, Integrator, ModelKind, Scene, Support, effects},
    study::{Bodies, EnsembleOutcome, EnsemblePlan, ensemble, observation},
};

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain replay --scene annulus --drive horn_tip.csv --alpha 0.7 --out run")]
pub struct Arguments {
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Use α, damping, scene, horn record and model of an earlier calibration
    #[arg(long, value_name = "DIR", help_heading = "Scene")]
    pub calibration: Option<PathBuf>,
    /// Also run N variants (random gaps, drive ± 0.01 %) at each of three drive levels (99, 100 and 101 %), and print mean, standard
    /// deviation and sensitivity; the default model is then the chain
    #[arg(long, value_name = "N", value_parser = whole(2_u32, None), help_heading = "Study")]
    pub ensemble: Option<u32>,
    /// Draw these figures too; several with commas between them
    #[arg(long, value_name = "KINDS", value_delimiter = ',', value_parser = one_of(&PICTURES), requires = "out", help_heading = "Output")]
    pub figure: Vec<&'static str>,
    #[command(flatten)]
    pub output: OutputArguments,
    #[command(flatten)]
    pub analysis: AnalysisArguments,
    #[command(flatten)]
    pub field: FieldArguments,
    #[command(flatten)]
    pub reading: ReadArguments,
}

/// What a replay draws on request.
const PICTURES: Words<&str, 3> = [
    ("waterfall", "Velocity of every bead over the last 24 drive periods", "waterfall"),
    ("spectrogram", "Spectrum of the last bead over time, in windows of eight drive periods", "spectrogram"),
    ("phase", "Velocity of the last bead against its displacement, and once a drive period as a point", "phase"),
];

/// Pressure metrics at a point of the water.
#[derive(Debug, Clone, Serialize)]
pub struct PressureAt {
    /// Distance from the axis, m.
    pub r_m: f64,
    /// Depth below the disc's back, m.
    pub z_m: f64,
    #[serde(flatten)]
    pub features: PressureFeatures,
}

#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    pub program: String,
    /// Scene as named on the command line.
    pub scene: String,
    /// Where on the last bead its velocity was measured, below the scene's `vibrometer.bandwidth`.
    pub observed: ObservedPoint,
    /// What was measured of it; nothing where the last bead does not move.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub features: Option<Features>,
    /// What was measured on the pressure at each field point, where there is water.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pressure: Vec<PressureAt>,
    /// Where the work of the piston went.
    pub energy: EnergyBalance,
    /// What the run cost, in counts.
    pub work: SolverWork,
    /// Contact laws fitted to the bodies, with their errors, where the chain has such.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact_laws: Option<FiniteBodyLaws>,
    /// What a finite element run has besides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub analysis: Option<AnalysisSummary>,
    pub settings: summary::Settings,
    /// Mean, scatter and sensitivity, if requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ensemble: Option<summary::EnsembleTable>,
    /// Which effects were on, and why.
    pub effects: Vec<Effect>,
    /// What was assumed on the way.
    pub assumptions: Vec<String>,
    /// What looks wrong with the horn's record, and what it spoils.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Instant of the horn's record (t = 0 at its trigger) at time 0 of `response.csv`, where a record drives.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive_origin_s: Option<f64>,
    pub inputs: summary::Inputs,
}

/// Results that every replay has.
const RESULTS: [&str; 5] = ["report.html", "response.csv", "scene.toml", "summary.json", timing::FILE];

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let mut timing = Timing::start();
    let calibrated = arguments.calibration.as_deref().map(Calibrated::read).transpose()?;
    let preferred = preferred_model(calibrated.as_ref(), arguments.ensemble);
    let flags = SceneArguments { session: session.clone(), ..arguments.scene.clone() };
    let mut experiment = experiment::read(&flags, &arguments.reading, calibrated.as_ref(), preferred)?;
    experiment.limits = session.limits();
    let scene = experiment.scene_with(&[])?;
    if !arguments.figure.is_empty() && scene.is_struck() {
        return Err(usage("--figure: expected a drive with periods, found a scene that is hit by a striker"));
    }
    analysis::refuse_idle(&arguments.analysis, &scene)?;
    field::refuse_idle(&arguments.field, &scene)?;
    let output = &arguments.output;
    Estimate::of(&scene).check(&scene.model.limits)?;
    let plan = arguments.ensemble.map(|replicates| EnsemblePlan::new(replicates as usize, session.seed()));
    if let Some(plan) = &plan {
        plan.estimate(&scene).check(&scene.model.limits)?;
    }
    session.assumed(&experiment.assumptions);
    session.warn(experiment.warnings());
    let stage = |out| OutputFolder::stage(out, &RESULTS, output.force);
    let calibrated = calibrated.as_ref();
    let job = Job { arguments: &arguments, session, calibrated, experiment: &experiment, scene: &scene, plan };
    let settings = observation::settings(&scene)?;
    let folder = output.out.as_deref().map(stage).transpose()?;
    timing.stage("read");
    let (text, summary) = job.execute(folder.as_ref(), &settings, &mut timing)?;
    match folder {
        Some(folder) => {
            let place = folder.finish()?;
            session.note(format_args!("written to {}", place.display()));
            session.result(text, &summary)?;
        }
        None => session.result(
            format!("{text}\nNothing was written; pass --out DIR for response.csv, summary.json, figures and a page of them.\n"),
            &summary,
        )?,
    }
    Ok(Outcome::Done)
}

/// Everything read and checked before anything is run.
struct Job<'a> {
    arguments: &'a Arguments,
    session: &'a Session,
    calibrated: Option<&'a Calibrated>,
    experiment: &'a Bench,
    scene: &'a Scene,
    plan: Option<EnsemblePlan>,
}

impl Job<'_> {
    /// Run, measure and write; the text for people and the summary.
    fn execute(
        &self,
        folder: Option<&OutputFolder>,
        settings: &FeatureSettings,
        timing: &mut Timing,
    ) -> anyhow::Result<(String, Summary)> {
        let Self { arguments, session, calibrated, experiment, scene, plan } = *self;
        let mut assumptions = experiment.assumptions.clone();
        let (mut contact_laws, mut kept) = (None, None);
        let (response, analysis) = if scene.model.kind == ModelKind::Fea {
            let analysis = Analysis::new(scene, &arguments.analysis, folder, session)?;
            timing.stage("mesh_and_factor");
            let finished = analysis.run()?;
            timing.breakdown("analysis", &finished.stages);
            session.warn(&finished.warnings);
            assumptions.extend(finished.warnings);
            (finished.response, Some(finished.summary))
        } else {
            let prepared = session.prepare(scene)?;
            timing.stage("prepare");
            contact_laws = prepared.contact_laws().cloned();
            let response = run(&prepared, scene, session)?;
            let warnings = prepared.warnings(scene, &response);
            session.warn(&warnings);
            assumptions.extend(warnings);
            kept = Some(prepared);
            (response, None)
        };
        timing.stage("run");
        let features = match observation::measure_response(scene, &response, settings) {
            // What is measured is the answer to a periodic drive.
            _ if scene.is_struck() => None,
            Err(FeatureError::Constant { .. }) => {
                let warning = "the last bead does not move while the drive is on, so there are no features; a gap may be too wide for the drive, or \
                               friction too strong";
                session.warn([warning]);
                assumptions.push(warning.into());
                None
            }
            measured => Some(measured?),
        };
        let by_tolerance = match (&features, &kept) {
            (Some(features), Some(prepared)) => by_tolerance(scene, prepared, features, settings),
            _ => None,
        };
        session.warn(&by_tolerance);
        assumptions.extend(by_tolerance);
        let window = features.as_ref().map(|features| features.window).or(settings.window);
        let window = window.unwrap_or_else(|| Window::whole(response.observed_velocity()));
        let pressure = pressures(scene, &response, window)?;
        timing.stage("features");
        let spread = plan.map(|plan| ensemble::run_on(&Bodies::new(session.cache()), scene, &plan)).transpose()?;
        timing.stage("ensemble");
        let prepared = || kept.map_or_else(|| session.prepare(scene), Ok);
        let field = field::make(&arguments.field, scene, prepared, window)?;
        if arguments.field.is_given() {
            timing.stage("field");
        }

        let summary = Summary {
            program: summary::program(),
            scene: experiment.source.clone(),
            pressure,
            energy: response.energy,
            work: response.work,
            contact_laws,
            analysis,
            settings: summary::Settings::new(scene, experiment, session.seed()),
            ensemble: spread.as_ref().map(summary::EnsembleTable::new),
            effects: effects(scene),
            assumptions,
            warnings: experiment.warnings().to_vec(),
            observed: response.observed,
            drive_origin_s: experiment.drive.as_ref().map(|drive| drive.motion.origin),
            inputs: summary::Inputs::new(experiment, calibrated),
            features,
        };
        let text = summary::text(scene, &summary, spread.as_ref());
        if let Some(folder) = folder {
            field::write(folder, field)?;
            let figures = self.pictures(&response, Window::new(window.from, window.to.min(scene.drive.burst().1)));
            write(folder, (scene, figures), &response, spread.as_ref(), &summary, timing)?;
        }
        Ok((text, summary))
    }

    /// What `--figure` asks for, of a drive that is on in `window`.
    fn pictures(&self, response: &Response, window: Window) -> Vec<(&'static str, Figure)> {
        let frequency = self.scene.drive.frequency;
        let draw = |name: &str| match name {
            "waterfall" => dynamics::waterfall(response, window, frequency),
            "phase" => dynamics::phase(response, window, frequency),
            _ => dynamics::spectrogram(&observation::seen(self.scene, response.observed_velocity()), frequency),
        };
        let wanted = PICTURES.iter().filter(|(name, ..)| self.arguments.figure.contains(name));
        let (drawn, missing): (Vec<_>, Vec<_>) =
            wanted.map(|(name, ..)| (*name, draw(name))).partition(|(_, figure)| figure.is_some());
        let why = "expected a moving last bead and ten drive periods or more; not drawn";
        self.session.warn(missing.iter().map(|(name, _)| format!("--figure {name}: {why}")));
        drawn.into_iter().filter_map(|(name, figure)| Some((name, figure?))).collect()
    }
}

/// The pressure at every field point, measured over the window of the drive; where it is silent, nothing.
pub fn pressures(scene: &Scene, response: &Response, window: Window) -> Result<Vec<PressureAt>, FeatureError> {
    let (Some(water), Some(disc)) = (&scene.water, &response.disc) else { return Ok(Vec::new()) };
    let loud = water.field_points.iter().zip(&disc.pressure).filter(|(_, pressure)| pressure.peak() > 0.0);
    loud.map(|(point, pressure)| {
        let settings = PressureSettings::new(scene.drive.frequency, window);
        let features = measure_pressure(pressure, &settings)?;
        Ok(PressureAt { r_m: point.radius, z_m: point.distance, features })
    })
    .collect()
}

/// By how much finer the steps of a second run are, and the change of a peak that is worth a warning, 1.
const FINER: f64 = 0.01;
const WORTH_A_WARNING: f64 = 0.01;

/// Warning where the peaks of a chain depend on the tolerance of its steps: motion so sensitive has no peaks of its own, only a distribution of them.
fn by_tolerance(scene: &Scene, prepared: &Prepared, features: &Features, settings: &FeatureSettings) -> Option<String> {
    let (ModelKind::Chain, Integrator::DormandPrince853 { tolerance }) = (scene.model.kind, scene.model.integrator)
    else {
        return None;
    };
    let mut finer = scene.clone();
    finer.model.integrator = Integrator::DormandPrince853 { tolerance: (FINER * tolerance).max(f64::EPSILON) };
    let response = prepared.run(&finer, &mut |_| !interrupt::requested()).ok()?;
    let other = observation::measure_response(&finer, &response, settings).ok()?.peaks;
    let peaks = [(features.peaks.positive, other.positive), (features.peaks.negative, other.negative)];
    let change = peaks.map(|(one, other)| (one / other - 1.0).abs()).into_iter().fold(0.0, f64::max);
    (change > WORTH_A_WARNING).then(|| {
        format!(
            "with steps {:.0} times finer (model.tolerance) a peak changes by {} %: the motion is chaotic, and single peaks mean little; compare averages \
             over runs (--ensemble N)",
            FINER.recip(),
            significant(100.0 * change, 2)
        )
    })
}

fn run(prepared: &Prepared, scene: &Scene, session: &Session) -> anyhow::Result<Response> {
    let bar = progress::simulated_time(session, "simulated time");
    let forecast = Forecast::new(session, "the run");
    let outcome = prepared.run(scene, &mut |time| {
        forecast.at(time / scene.duration);
        progress::advance_to(&bar, time, scene.duration);
        !interrupt::requested()
    });
    bar.finish_and_clear();
    match outcome {
        Err(ModelError::Stopped { .. }) if interrupt::requested() => Err(interrupt::Interrupted.into()),
        outcome => Ok(outcome?),
    }
}

fn write(
    folder: &OutputFolder,
    (scene, figures): (&Scene, Vec<(&'static str, Figure)>),
    response: &Response,
    spread: Option<&EnsembleOutcome>,
    summary: &Summary,
    timing: &mut Timing,
) -> anyhow::Result<()> {
    let mut table = Vec::new();
    write_csv(response, &mut table).context("response.csv cannot be made")?;
    folder.write("response.csv", table)?;
    folder.write("scene.toml", scene.to_toml())?;
    folder.write("summary.json", summary::json(summary)?)?;
    timing.stage("write");
    let seen = observation::seen(scene, response.observed_velocity());
    let mut others = hydrophone::figures(response, summary.pressure.iter().map(|point| &point.features))?;
    others.extend(figures);
    let report = ReplayReport {
        scene: (&scene.name, &summary::described(scene, &summary.settings.overrides)),
        facts: summary::facts(scene, summary),
        has_support: scene.support != Support::Free,
        bead_diameter: scene.chain.beads.first().map_or(0.0, |bead| 2.0 * bead.radius),
        response,
        seen: &seen,
        drive_frequency: scene.drive.frequency,
        features: summary.features.as_ref(),
        others,
        ensemble: spread.map(summary::ensemble),
        assumptions: summary.warnings.iter().chain(&summary.assumptions).cloned().collect(),
    };
    folder.write_all(report.files()?)?;
    timing.stage("figures");
    folder.write(timing::FILE, timing.to_json())?;
    Ok(())
}
