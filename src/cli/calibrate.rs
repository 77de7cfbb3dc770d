//! `granchain calibrate`: fit a scene to a record and leave a report.
//!
//! plan and flags → record and drive → one fit a damping law → the accurate run at the fit → report.

mod alpha_sweep;
mod candidate;
mod companion;
mod companion_page;
mod definition;
pub(super) mod derived;
pub(super) mod manifest;
mod measured;
mod page;
pub(super) mod rungs;
pub(super) mod uncertainty;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use self::{
    candidate::{Candidate, candidates},
    companion::{Companion, companions, labels, refuse_twice, refuse_upper},
    definition::Definition,
    derived::Derived,
    measured::Measured,
    rungs::{FittedLaw, saved_fits},
};
use super::{
    Outcome,
    arguments::{OutputArguments, SceneArguments, Session, usage},
    experiment::Experiment,
    interrupt,
    output::{NOTHING_SAVED, OutputFolder},
    reading::ReadArguments,
    summary,
    timing::{self, Timing},
};
use crate::{
    calibration::{comparison::Comparison, fit::FitError, forward::Uncertainty},
    feature::Measurand,
    scene::{ModelKind, Scene, Support},
};

/// Arguments of `granchain calibrate`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Record of a vibrometer or hydrophone (CSV), or TOML of published features; repeated: records fitted together
    #[arg(long, value_name = "FILE", help_heading = "Fit")]
    pub measured: Vec<PathBuf>,
    /// Horn-tip record of each --measured, in the same order [default: horn_tip.csv beside it]
    #[arg(long, value_name = "FILE", conflicts_with = "drive", conflicts_with = "scene_drive", help_heading = "Fit")]
    pub input: Vec<PathBuf>,
    /// Override one key of the scene for record N alone, such as 2:chain.beads=7; repeatable
    #[arg(long, value_name = "N:KEY=VALUE", help_heading = "Fit")]
    pub record_set: Vec<String>,
    /// What was recorded [default: velocity]
    #[arg(long, value_enum, help_heading = "Fit")]
    pub quantity: Option<QuantityChoice>,
    /// Fit definition (TOML); flags win over it
    #[arg(long, value_name = "FILE", help_heading = "Fit")]
    pub plan: Option<PathBuf>,
    /// Damping laws to fit, such as linear,kuwabara-kono [default: the scene's own]
    #[arg(long, value_name = "LAW,…", value_delimiter = ',', help_heading = "Fit")]
    pub damping: Vec<String>,
    /// Mounts of the disc to compare [default for a pressure: clamped,supported,free, or disc.rim where it is set]
    #[arg(long, value_name = "MOUNT,…", value_delimiter = ',', help_heading = "Fit")]
    pub mount: Vec<String>,
    /// Parameters to fit, of alpha, damping, precompression, support_stiffness, gap, bandwidth; the others keep the scene's value [default:
    /// alpha,damping]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', help_heading = "Fit")]
    pub fit: Vec<String>,
    /// Bounds of a parameter, such as alpha=0.3:1.5 or "damping=0.1 N s/m:1 N s/m"; repeatable
    #[arg(long, value_name = "NAME=LOW:HIGH", help_heading = "Fit")]
    pub bounds: Vec<String>,
    /// Which features are compared: all, or the two peaks and the 1/3 and 2/3 ratios as in the source paper
    #[arg(long, value_enum, help_heading = "Fit")]
    pub features: Option<FeatureChoice>,
    /// How the box is searched; the answer is read from a regression over all runs in any case
    #[arg(long, value_enum, default_value = "likelihood", help_heading = "Fit")]
    pub search: SearchChoice,
    /// Uncertainty of what the bench leaves open, drawn into every run: of gap, baseline, drive, precompression, support_stiffness, such as
    /// "gap=0.5 nm"; repeatable [default: gap=0.3nm, drive=0.005, baseline as the horn-tip record tells]
    #[arg(long, value_name = "NAME=VALUE", help_heading = "Fit")]
    pub uncertainty: Vec<String>,
    /// Runs a damping law [default: the number whose intervals were tested, 600, or 1200 for more than two parameters or several records]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(200..=100_000), help_heading = "Fit")]
    pub evaluations: Option<u32>,
    /// Drive with the scene's own drive even where a horn_tip.csv lies beside the record
    #[arg(long, conflicts_with = "drive", help_heading = "Fit")]
    pub scene_drive: bool,
    /// Run another model once at the answer and show its features beside the others'
    #[arg(long, value_enum, value_name = "MODEL", help_heading = "Fit")]
    pub confirm: Option<ConfirmChoice>,
    /// Continue the fit that Ctrl-C or a crash left behind
    #[arg(long, help_heading = "Fit")]
    pub resume: bool,
    /// Draw drive, record and the uncalibrated response, then stop
    #[arg(long, help_heading = "Fit")]
    pub dry_run: bool,
    /// What is simulated.
    #[command(flatten)]
    pub scene: SceneArguments,
    /// How the record is read.
    #[command(flatten)]
    pub reading: ReadArguments,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

/// `--quantity`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum QuantityChoice {
    /// Velocity of the last bead's far pole
    Velocity,
    /// Pressure at the scene's first field point
    Pressure,
}

/// `--features`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FeatureChoice {
    /// All: peaks, early peaks, bands
    Full,
    /// The two peaks and the 1/3 and 2/3 ratios
    Paper,
}

/// `--confirm`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ConfirmChoice {
    /// The finite element analysis: one run, half a minute or so
    Fea,
}

/// `--search`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SearchChoice {
    /// Regression synthetic likelihood
    Likelihood,
    /// Scattered Nelder–Mead on the plain misfit, for comparison
    NelderMead,
    /// Particle swarm on the plain misfit, for comparison
    ParticleSwarm,
}

/// Everything read and checked before anything is run.
pub(super) struct Job {
    /// The arguments that can change a result, as typed.
    told: Vec<String>,
    /// The program that the results are said to be of.
    pub(super) program: String,
    pub(super) definition: Definition,
    experiment: Experiment,
    measured: Measured,
    comparison: Comparison,
    /// Further records that are fitted together with the first.
    companions: Vec<Companion>,
    pub(super) candidates: Vec<Candidate>,
    /// What is drawn into the runs of the first record.
    uncertainty: Uncertainty,
    /// The model above the chain that corrects and confirms, where there is one.
    upper: Option<ModelKind>,
    assumptions: Vec<String>,
    /// Which model was taken, where nobody said, for the terminal.
    model_taken: Option<String>,
}

impl Job {
    /// What the records are called side by side, the first one first.
    fn labels(&self) -> Vec<String> {
        let further = self.companions.iter().map(|companion| companion.measured.path());
        labels(&std::iter::once(self.measured.path()).chain(further).collect::<Vec<_>>())
    }

    /// The model that answers.
    fn model(&self) -> &'static str {
        self.upper.unwrap_or(ModelKind::Chain).name()
    }
}

/// The command, as a state names it.
const COMMAND: &str = "calibrate";
/// Results that every calibration has.
const RESULTS: [&str; 5] = ["calibration.json", "report.html", "report.md", manifest::FILE, timing::FILE];

/// Run it.
///
/// # Errors
/// Whatever is wrong with plan, scene, records or runs; a folder that cannot be written.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let mut timing = Timing::start();
    let mut session = arguments.session.clone();
    let output = arguments.output.clone();
    let (resume, dry_run) = (arguments.resume, arguments.dry_run);
    let job = prepare(arguments, manifest::told(std::env::args().skip(1)))?;
    session.seed = session.seed.or(job.definition.seed);
    for assumption in &job.assumptions {
        session.note(format_args!("assumed: {assumption}"));
    }
    if let Some(taken) = &job.model_taken {
        session.note(format_args!("assumed: {taken}"));
    }
    timing.stage("read");
    let target = output.out.clone().unwrap_or_else(|| default_target(&job));
    if dry_run {
        return page::dry_run(&job, &target, output.force, &session);
    }

    let folder = OutputFolder::resumable(&target, &RESULTS, COMMAND, resume, output.force)?;
    if resume && !folder.is_resumed() {
        session.note(NOTHING_SAVED);
    }
    let outcome = fit_and_report(&job, folder, &session, timing);
    if outcome.as_ref().is_err_and(|error| error.is::<interrupt::Interrupted>()) {
        session.note("the runs made so far are kept; continue with the same command and --resume");
    }
    outcome
}

/// Fit, confirm, report, write. Stopped on the way, the folder keeps its state.
fn fit_and_report(job: &Job, folder: OutputFolder, session: &Session, mut timing: Timing) -> anyhow::Result<Outcome> {
    // A state that cannot be continued is refused before anything is run, and left as it is: it may be hours of work.
    let saved = saved_fits(job, &folder, session.seed())?;
    let fitted = match derived::fitted(job, saved, session, &mut timing) {
        Ok(fitted) => fitted,
        Err(error) if error.is::<interrupt::Interrupted>() => return Err(error),
        Err(error) => {
            // Another failure, such as a full disk, may pass.
            let final_answer = matches!(error.downcast_ref(), Some(FitError::TooFewRuns { .. }));
            if final_answer || !folder.is_saved() {
                folder.discard();
            }
            return Err(error);
        }
    };
    let Derived { outcome, files } = derived::derive(job, &fitted, session, &mut timing)?;
    for (name, bytes) in files {
        folder.write(name, bytes)?;
    }
    timing.stage("write");
    folder.write(timing::FILE, timing.to_json())?;
    let place = folder.finish()?;
    let text = page::text(&outcome, job.measured.noun(), &place);
    session.result(text, &outcome)?;
    Ok(Outcome::of(outcome.verdict))
}

/// Read and check everything that the arguments name; `told` is what they were on the command line.
///
/// # Errors
/// Whatever is wrong with plan, scene or records.
pub(super) fn prepare(arguments: Arguments, told: Vec<String>) -> anyhow::Result<Job> {
    let definition = Definition::new(arguments)?;
    let mut assumptions = definition.assumptions.clone();
    let alone = definition.companions.is_empty();
    let experiment =
        if alone { Experiment::for_fit(&definition.scene)? } else { Experiment::for_joint_fit(&definition.scene)? };
    assumptions.extend(experiment.assumptions.iter().cloned());
    let scene = experiment.scene_with(&[])?;
    refuse_silent_scene(&definition, &scene)?;
    let model_taken = if alone {
        experiment.model_taken()?
    } else {
        refuse_upper(&scene)?;
        Some("model `chain`: several records are searched and answered on the chain".into())
    };
    let upper = rungs::upper(&scene)?;
    let uncertainty = definition.uncertainty.of(&scene, experiment.baseline_error())?;
    let companions = companions(&definition, (&experiment, &scene), &mut assumptions)?;
    let candidates = candidates(&definition, &experiment, &companions, &scene, &mut assumptions)?;
    assumptions.push(uncertainty::said(&uncertainty, &candidates[0].parameters));
    if definition.quantity == Measurand::Pressure
        && let Some(points) = scene.water.as_ref().map(|water| &water.field_points)
        && let Some(first) = points.first()
    {
        let others = if points.len() > 1 {
            ", the first of `water.field_points`"
        } else {
            "; set water.field_points for another"
        };
        assumptions.push(format!("hydrophone at {first}{others}"));
    }
    let measured = Measured::read(&definition.measured, &definition, &scene, &mut assumptions)?;
    refuse_twice(&measured, &companions)?;
    let comparison = measured.comparison().weighted(&definition.weights)?;
    Ok(Job {
        told,
        program: summary::program(),
        definition,
        experiment,
        measured,
        comparison,
        companions,
        candidates,
        uncertainty,
        upper,
        assumptions,
        model_taken,
    })
}

/// A pressure needs water to be heard in.
fn refuse_silent_scene(definition: &Definition, scene: &Scene) -> anyhow::Result<()> {
    if definition.quantity == Measurand::Velocity || scene.water.is_some() {
        return Ok(());
    }
    let (found, remedy) = match &scene.support {
        Support::Disc { .. } => ("a vacuum behind its disc", "leave `water.medium = \"none\"` out"),
        _ => ("no disc with water behind it", "take --scene water, or set support.kind=disc"),
    };
    Err(usage(format!("--quantity pressure: the scene `{}` has {found}; {remedy}", scene.name)))
}

/// The scene with the fitted values in it.
fn fitted_scene(law: &FittedLaw) -> Scene {
    let mut scene = law.scene.clone();
    for (parameter, value) in law.fit.parameters.iter().zip(law.fit.values()) {
        parameter.set(&mut scene, value);
    }
    scene
}

/// `calibrations/NAME`: the record's folder where the record is its `vib.csv` or `hydrophone.csv`, else the record's own name; of several
/// records the folder that holds them all, else all their names.
fn default_target(job: &Job) -> PathBuf {
    let measured = job.definition.measured.as_path();
    if !job.companions.is_empty() {
        let folders = measured.ancestors().skip(1);
        let holds = |folder: &&Path| job.companions.iter().all(|it| it.measured.path().starts_with(folder));
        let common = folders.into_iter().find(holds).and_then(Path::file_name);
        let name = common.map_or_else(|| job.labels().join("-"), |name| name.to_string_lossy().into_owned());
        return Path::new("calibrations").join(name);
    }
    let stem = measured.file_stem().map_or_else(|| "record".into(), |stem| stem.to_string_lossy().into_owned());
    let folder = measured.parent().and_then(Path::file_name).map(|folder| folder.to_string_lossy().into_owned());
    let name = match folder {
        Some(folder) if stem == "vib" || stem == "hydrophone" => folder,
        Some(folder) => format!("{folder}-{stem}"),
        None => stem,
    };
    Path::new("calibrations").join(name)
}
