//! `granchain-reproduction`: one study from its scenes to its page.

mod chain_length;
mod dissipation;
mod paper;
mod precompression;
mod trend;
mod water;

use std::{
    fmt::Write as _,
    process::ExitCode,
    time::{Duration, Instant},
};

use anyhow::Context;
use clap::{Parser, ValueEnum};
use indicatif::ProgressBar;
use serde_json::Value;

use crate::{chain_length::ChainLengths, divided::Divided, failure::StudyError, precompression::Precompressions};
use crate::{decoder::Decoder, portrait::Portrait};
use granchain::cli::{
    arguments::{MODELS, OutputArguments, Session, one_of},
    interrupt::{self, Interrupted},
    output::{OutputFolder, page_results, publish, set_flags},
    progress, summary,
    timing::Timing,
    with_causes,
};
use granchain_calibration::predict::{
    Bodies, EnsemblePlan,
    ensemble::STEPS_PER_PERIOD,
    observation,
    replicates::{self, perturbations},
};
use granchain_model::scene::{ModelKind, Scene};
use granchain_report::page::Files;
use granchain_signal::{Series, feature::Measurand};

/// Reproduce the source paper: its experiment, or one of the studies that follow from it.
#[derive(Debug, Parser)]
#[command(version, after_help = "Example:\n  granchain-reproduction paper --quick --out paper")]
pub struct Arguments {
    #[arg(value_enum)]
    pub study: Choice,
    /// Model of all runs [default: reduced; chain for `water`]
    #[arg(long, value_parser = one_of(&MODELS))]
    pub model: Option<ModelKind>,
    /// Override one key of every scene: a number without unit is SI; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Few runs and a coarse grid, for a first look
    #[arg(long)]
    pub quick: bool,
    /// Replicates of each point [default: 16 of paper, 8 of trends, 5 of water, 3 of dissipation; fewer with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    pub replicates: Option<u32>,
    #[command(flatten)]
    pub output: OutputArguments,
    #[command(flatten)]
    pub session: Session,
}

/// The studies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Choice {
    /// The paper's experiment: every printed number beside ours
    Paper,
    /// Two to ten beads: which fractional lines appear, how wide the spectrum is
    ChainLength,
    /// Static force along the chain: where the impulses vanish
    Precompression,
    /// The chain before water under every reading of mount, baffle and dampers
    Water,
    /// Which dampers, with which effects beside them, bring the printed peaks and thirds
    Dissipation,
}

/// Run the program with the process's own arguments.
#[must_use]
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let outcome = interrupt::watch()
        .map_err(anyhow::Error::from)
        .and_then(|()| arguments.session.start())
        .and_then(|()| arguments.execute());
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", with_causes(&error));
            ExitCode::from(interrupt::exit_code().unwrap_or(1))
        }
    }
}

impl Arguments {
    fn execute(self) -> anyhow::Result<()> {
        match self.study {
            Choice::Paper => Whole::of(paper::read(&self)?, self).run(),
            Choice::ChainLength => Whole::of(trend::read::<ChainLengths>(&self)?, self).run(),
            Choice::Precompression => Whole::of(trend::read::<Precompressions>(&self)?, self).run(),
            Choice::Water => Whole::of(water::read(&self)?, self).run(),
            Choice::Dissipation => Whole::of(dissipation::read(&self)?, self).run(),
        }
    }

    /// The overrides of every scene, on the model `usual` where none is named.
    fn overrides(&self, usual: ModelKind) -> Vec<String> {
        let model = format!("model.kind={}", self.model.unwrap_or(usual).name());
        std::iter::once(model).chain(self.set.iter().cloned()).collect()
    }

    /// Replicates asked for, else `usual`.
    fn replicates(&self, usual: usize) -> usize {
        self.replicates.map_or(usual, |replicates| replicates as usize)
    }

    /// The command line that makes the same report, without what cannot change it.
    fn command_line(&self, name: &str) -> String {
        let mut text = format!("granchain-reproduction {name}");
        // Writing to a string cannot fail.
        if let Some(model) = self.model {
            let _ = write!(text, " --model {}", model.name());
        }
        text.push_str(&set_flags(&self.set));
        if self.quick {
            text.push_str(" --quick");
        }
        if let Some(replicates) = self.replicates {
            let _ = write!(text, " --replicates {replicates}");
        }
        if let Some(seed) = self.session.seed {
            let _ = write!(text, " --seed {seed}");
        }
        text
    }
}

/// Model of most studies where none is named.
const DEFAULT_MODEL: ModelKind = ModelKind::Reduced;

/// What is known of a page before its outcome.
struct Head {
    program: String,
    /// Command line that makes the same page.
    command_line: String,
}

/// A study as it is shown.
trait Shown: Divided {
    /// Its name, and that of its summary.
    const NAME: &str;

    /// Say how many runs there are and how long they take, by a few of them.
    ///
    /// # Errors
    /// When they cannot be run.
    fn foretell(&self, session: &Session) -> anyhow::Result<()>;

    fn text(&self, outcome: &Self::Outcome) -> String;

    fn json(&self, outcome: &Self::Outcome) -> Value;

    /// The page and its files.
    ///
    /// # Errors
    /// A figure that cannot be drawn.
    fn files(&self, outcome: Self::Outcome, head: Head) -> anyhow::Result<Files>;
}

/// A study with what the command line says besides.
struct Whole<S> {
    study: S,
    arguments: Arguments,
    timing: Timing,
}

impl<S: Shown> Whole<S> {
    fn of(study: S, arguments: Arguments) -> Self {
        Self { study, arguments, timing: Timing::start() }
    }

    fn run(self) -> anyhow::Result<()> {
        let Self { study, arguments, mut timing } = self;
        let Arguments { output, session, .. } = &arguments;
        let main = format!("{}.json", S::NAME);
        let stage = |out| OutputFolder::stage(out, &page_results(&main), output.force);
        let folder = output.out.as_deref().map(stage).transpose()?;
        study.foretell(session)?;
        timing.stage("estimate");
        let bar = progress::Bar(progress::bar(session, study.runs() as u64, "runs"));
        let mut points = Vec::with_capacity(study.points());
        for (stage, count) in study.stages() {
            let made = study.part(points.len()..points.len() + count, &bar);
            points.extend(stopped(made).inspect_err(|_| bar.0.finish_and_clear())?);
            timing.stage(stage);
        }
        bar.0.finish_and_clear();
        let outcome = stopped(study.outcome(points))?;
        timing.stage("evaluate");
        let (mut text, json) = (study.text(&outcome), study.json(&outcome));
        if let Some(folder) = folder {
            let head = Head { program: summary::program(), command_line: arguments.command_line(S::NAME) };
            publish(folder, study.files(outcome, head).context("the report cannot be made")?, timing, session)?;
        } else {
            text.push_str("Nothing was written; pass --out DIR for the page, the figures and the tables.\n");
        }
        session.result(text, &json)
    }
}

/// A study that was stopped is a program that was interrupted.
fn stopped<T>(outcome: Result<T, StudyError>) -> anyhow::Result<T> {
    match outcome {
        Err(StudyError::Stopped) => Err(Interrupted.into()),
        outcome => Ok(outcome?),
    }
}

/// Time a whole study will take, from a first few of its runs and their measurement: those are thrown away.
///
/// # Errors
/// When the model cannot run the scene.
fn estimate(bodies: &Bodies, scene: &Scene, runs: usize) -> anyhow::Result<Duration> {
    let replicates = rayon::current_num_threads() * if scene.model.kind == ModelKind::Chain { 8 } else { 1 };
    let variations = perturbations(scene, &EnsemblePlan::new(replicates, 0));
    let settings = observation::settings(scene)?;
    // Not counted: made once.
    bodies.prepared(scene)?;
    let started = Instant::now();
    let decoder = Decoder::of_reconstruction(0);
    let see = |index, velocity: &Series| Portrait::of(&decoder.sees(velocity, index), &settings);
    let hidden = progress::Bar(ProgressBar::hidden());
    replicates::run(bodies, scene, &variations, STEPS_PER_PERIOD, Measurand::Velocity, &hidden, see)?;
    interrupt::check()?;
    Ok(started.elapsed() * u32::try_from(runs.div_ceil(replicates)).unwrap_or(u32::MAX))
}
