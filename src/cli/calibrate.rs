//! `granchain calibrate`: fit a scene to a record and leave a report.
//!
//! plan and flags → record and drive → one fit a damping law → the accurate run at the fit → report.

mod bench;
pub(super) mod definition;
pub mod files;
pub(super) mod manifest;
mod page;

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use clap::Args;

use self::{
    definition::refused,
    files::{Files, Stop},
};
pub use self::{
    definition::{InMemory, SceneOfPlan},
    page::{Preview, preview},
};
use super::{
    Outcome,
    arguments::{OutputArguments, SceneArguments, Session, Words, one_of, whole},
    interrupt,
    output::{NOTHING_SAVED, OutputFolder},
    reading::{DriveReadArguments, ReadArguments},
    summary,
    timing::{self, Timing},
};
use crate::{
    calibration::{Problem, drive::Input, fit::FitError, recorded_run::labels, refusal::Refusal},
    feature::Measurand,
    measurement::read_back::{SMALL, read_back},
    scene::simulated,
};

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
                  granchain calibrate --measured vib.csv --drive horn_tip.csv --scene annulus\n  \
                  granchain calibrate --measured s.csv --channel CH2 --drive-read channel=CH1")]
pub struct Arguments {
    /// Record (CSV, UFF or an instrument's own binary file); several records are fitted together. If they share one horn record they
    /// are treated as repeated shots of one experiment
    #[arg(long, value_name = "FILE", num_args = 1.., help_heading = "Fit")]
    pub measured: Vec<PathBuf>,
    /// Plan of the fit (TOML); flags win over it
    #[arg(long, value_name = "FILE", help_heading = "Fit")]
    pub plan: Option<PathBuf>,
    /// Parameters to fit
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', help_heading = "Fit")]
    pub fit: Vec<String>,
    /// Damping laws to fit, of linear, kuwabara-kono and linear+kuwabara-kono, such as linear,kuwabara-kono [default: the scene's own]
    #[arg(long, value_name = "LAW,…", value_delimiter = ',', help_heading = "Fit")]
    pub damping: Vec<String>,
    /// Plot drive, record and the unfitted response at the scene's α, then stop
    #[arg(long, help_heading = "Fit")]
    pub dry_run: bool,
    /// End with exit code 4 if the verdict is `outside scatter`
    #[arg(long, help_heading = "Fit")]
    pub strict: bool,
    /// Continue the fit that Ctrl-C or a crash left behind
    #[arg(long, help_heading = "Fit")]
    pub resume: bool,
    /// Recorded quantity [default: velocity]
    #[arg(long, value_parser = one_of(&QUANTITIES), help_heading = "Fit")]
    pub quantity: Option<Measurand>,
    /// Range of a parameter, such as alpha=0.3:1.5 or "damping=0.1 N s/m:1 N s/m"; repeatable
    #[arg(long, value_name = "NAME=LOW:HIGH", help_heading = "Fit")]
    pub bounds: Vec<String>,
    /// Uncertainty of what the laboratory does not control, such as "gap=0.5 nm" (a number without unit is SI); repeatable. Names: gap (scale
    /// of a half-normal distribution), drive (half-width of a uniform one), and as standard deviations gap_scale, baseline, sensitivity, precompression,
    /// support_stiffness, modulus, mass [default: gap=0.3nm, gap_scale=0.4, drive=0.005, sensitivity=0.003,
    /// modulus=0.012, mass=0.012, baseline: estimated from the horn-tip record]
    #[arg(long, value_name = "NAME=VALUE", help_heading = "Fit")]
    pub uncertainty: Vec<String>,
    /// Number of runs for each damping law [default: 600; 1800 for three or more parameters; 1200 for several records. The intervals were tested with
    /// these numbers]
    #[arg(long, value_name = "N", value_parser = whole(200_u32, Some(100_000)), help_heading = "Fit")]
    pub evaluations: Option<u32>,
    /// Factor from 1 to 100 on every 90 % interval; `coverage --plan` states the one that a bench needs
    #[arg(long, value_name = "X", help_heading = "Fit")]
    pub widen: Option<f64>,
    #[command(flatten)]
    pub scene: SceneArguments,
    #[command(flatten)]
    pub output: OutputArguments,
    #[command(flatten)]
    pub reading: ReadArguments,
    #[command(flatten)]
    pub drive_reading: DriveReadArguments,
    #[command(flatten)]
    pub session: Session,
}

impl Arguments {
    /// Whether the stated drive frequency is used, for either record.
    fn forces_frequency(&self) -> bool {
        [self.reading.options(None), self.drive_reading.options(None)].iter().any(|options| options.force_frequency)
    }
}

pub const QUANTITIES: Words<Measurand, 2> = [
    ("velocity", "Velocity of the last bead's far pole", Measurand::Velocity),
    ("pressure", "Pressure at the scene's first field point", Measurand::Pressure),
];

/// A problem, and what the command line says besides.
pub struct Job {
    /// What is fitted to what.
    pub problem: Problem,
    /// The arguments that can change a result, as typed.
    arguments: Vec<String>,
    /// Name of the program in the results.
    pub(super) program: String,
    /// The plan and the bench file, where there are such, by role.
    plans: Vec<(&'static str, Input)>,
    /// Whether an answer that does not explain the record is a failure.
    strict: bool,
}

/// The command, as a state names it.
const COMMAND: &str = "calibrate";
/// Results that every calibration has.
pub const RESULTS: [&str; 5] = ["calibration.json", "report.html", "report.md", manifest::FILE, timing::FILE];

pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let mut timing = Timing::start();
    let (session, output) = (arguments.session.clone(), arguments.output.clone());
    let (resume, dry_run) = (arguments.resume, arguments.dry_run);
    let typed = manifest::typed(super::typed().skip(1));
    let job = prepare(arguments, typed, &InMemory::default())?;
    session.assumed(job.problem.assumptions.iter().chain(&model_taken(&job.problem)?));
    session.warn(job.problem.warnings());
    timing.stage("read");
    let usual = || free_target(&records(&job.problem));
    if dry_run {
        // A folder that was named is the one meant; else nothing may take the place of a fit.
        let preview = || {
            let name = usual();
            let stem = name.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            name.with_file_name(format!("{stem}-dry-run"))
        };
        return page::dry_run(&job, &output.out.clone().unwrap_or_else(preview), output.force, &session);
    }
    let target = output.out.clone().unwrap_or_else(usual);
    let folder = OutputFolder::resumable(&target, &RESULTS, COMMAND, resume, output.force)?;
    if resume && !folder.is_resumed() {
        session.note(NOTHING_SAVED);
    }
    fit_and_report(&job, folder, &session, timing)
}

/// Fit, confirm, report, write. Stopped on the way, the folder keeps the finite element runs.
fn fit_and_report(job: &Job, folder: OutputFolder, session: &Session, mut timing: Timing) -> anyhow::Result<Outcome> {
    let saved = job.problem.saved(&folder.state_path());
    let made = files::fitted(job, saved, session, &mut timing)
        .and_then(|fitted| Files::of(job, &fitted, session, &mut timing, &Stop::on_interrupt()));
    let Files { outcome, files } = match made {
        Ok(files) => files,
        Err(error) => {
            // Another failure, such as a full disk, may pass.
            let too_few = |cause: &(dyn std::error::Error + 'static)| {
                matches!(cause.downcast_ref(), Some(FitError::TooFewRuns { .. }))
                    || matches!(cause.downcast_ref(), Some(Refusal::NoFit { .. }))
            };
            if error.chain().any(too_few) || !folder.is_saved() {
                folder.discard();
            } else if error.is::<interrupt::Interrupted>() {
                session.note("the runs made so far are kept; continue with the same command and --resume");
            }
            return Err(error);
        }
    };
    let place = folder.finish_with(files, timing)?;
    let text = page::text(&outcome, "record", &place);
    let best = job.problem.candidates.iter().find(|candidate| candidate.law == outcome.best.damping_kind);
    let effects = best.map_or(String::new(), |candidate| format!("{}.\n", simulated(candidate.scene())));
    session.result(text + &effects, &outcome)?;
    Ok(Outcome::of(outcome.best.verdict, job.strict))
}

/// Read and check everything that the arguments name, but for the records that are in memory; `typed` is what they were on the command line.
pub fn prepare(arguments: Arguments, typed: Vec<String>, in_memory: &InMemory) -> anyhow::Result<Job> {
    let (problem, plans) = definition::problem(&arguments, in_memory)?;
    let strict = arguments.strict;
    Ok(Job { problem, arguments: typed, program: summary::program(), plans, strict })
}

/// What a stopped or a refused pipeline is to the terminal.
fn ended(error: Refusal) -> anyhow::Error {
    match error {
        Refusal::Stopped => interrupt::Interrupted.into(),
        error => refused(error),
    }
}

/// Which model was chosen by default, for the terminal.
fn model_taken(problem: &Problem) -> anyhow::Result<Option<String>> {
    if problem.recorded_runs.len() > 1 {
        return Ok(Some("model `chain`: only the chain can fit several records together".into()));
    }
    Ok(problem.lead().bench.model_taken()?)
}

/// The records of a problem: path and digest.
fn records(problem: &Problem) -> Vec<(&Path, &str)> {
    problem
        .recorded_runs
        .iter()
        .map(|recorded_run| (recorded_run.measured.path(), recorded_run.measured.sha256()))
        .collect()
}

/// The usual folder, or `NAME-2`, `NAME-3` … where it holds the fit of other records of that name.
fn free_target(records: &[(&Path, &str)]) -> PathBuf {
    let usual = default_target(records);
    let name = usual.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let further = (2..).map(|number| usual.with_file_name(format!("{name}-{number}")));
    let free = std::iter::once(usual.clone()).chain(further).find(|folder| !is_of_others(folder, records));
    free.unwrap_or(usual)
}

/// Whether a folder holds a calibration, and that of other records.
fn is_of_others(folder: &Path, records: &[(&Path, &str)]) -> bool {
    let read = read_back(&folder.join(manifest::FILE), SMALL).ok();
    let Some(manifest) = read.and_then(|bytes| serde_json::from_slice::<manifest::Manifest>(&bytes).ok()) else {
        return false;
    };
    let inputs = manifest.inputs.iter().filter(|(role, _)| role.starts_with("measured"));
    let of: BTreeSet<&str> = inputs.map(|(_, input)| input.sha256.as_str()).collect();
    of != records.iter().map(|(_, sha256)| *sha256).collect()
}

/// `calibrations/NAME`: the record's folder where the record is its `vib.csv` or `hydrophone.csv`, else the record's own name; of several
/// records the folder that holds them all, else all their names.
fn default_target(records: &[(&Path, &str)]) -> PathBuf {
    let paths: Vec<&Path> = records.iter().map(|(path, _)| *path).collect();
    let measured = paths[0];
    if paths.len() > 1 {
        let holds = |folder: &&Path| paths.iter().all(|path| path.starts_with(folder));
        let common = measured.ancestors().skip(1).find(holds).and_then(Path::file_name);
        let name = common.map_or_else(|| labels(&paths).join("-"), |name| name.to_string_lossy().into_owned());
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
