//! `granchain study`: whole studies with a page each.

pub mod chain_length;
pub mod dissipation;
pub mod paper;
pub mod precompression;
mod trend;
pub mod water;
mod whole;

use std::{
    fmt::Write as _,
    time::{Duration, Instant},
};

use clap::{Args, Subcommand};
use indicatif::ProgressBar;

use super::{
    Outcome,
    arguments::{ModelChoice, OutputArguments, Session},
    interrupt,
    output::OutputFolder,
    parts::{self, Divisible, PartArguments},
    progress,
    timing::{self, Timing},
};
use crate::{
    measurement::shell_word,
    report::page::Files,
    scene::{ModelKind, Scene},
    signal::{Series, feature::Measurand},
    study::{
        Bodies, EnsemblePlan,
        chain_length::ChainLengths,
        decoder::Decoder,
        ensemble::STEPS_PER_PERIOD,
        members::{self, perturbations},
        observation,
        portrait::Portrait,
        precompression::Precompressions,
    },
};

/// Arguments of `granchain study`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain study paper --out paper")]
pub struct Arguments {
    /// Which study.
    #[command(subcommand)]
    pub which: Which,
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

/// The studies.
#[derive(Debug, Subcommand)]
pub enum Which {
    /// The source paper's experiment: every printed number beside ours
    Paper(paper::Arguments),
    /// Two to ten beads: which fractional lines appear, how wide the spectrum is
    ChainLength(trend::Arguments),
    /// Static force along the chain: where the impulses vanish
    Precompression(trend::Arguments),
    /// The scene before water under every reading of mount, baffle and dampers: pressure and content over the drive
    Water(water::Arguments),
    /// Which dampers, with which effects beside them, bring the printed peaks and thirds
    Dissipation(dissipation::Arguments),
}

/// Run it.
///
/// # Errors
/// Whatever is wrong with the scene; a run that everything rests on; a folder that cannot be written; Ctrl-C.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let (part, session) = (arguments.which.shared().part.part, arguments.session.clone());
    let study = command(arguments)?;
    match part {
        Some(part) => parts::write(part, study.as_ref(), &session),
        None => study.run_here(),
    }
}

/// The study that flags ask for, to be run in parts.
pub(super) fn divisible(arguments: Arguments) -> anyhow::Result<Box<dyn Divisible>> {
    Ok(command(arguments)?)
}

fn command(Arguments { which, session }: Arguments) -> anyhow::Result<Box<dyn whole::Command>> {
    Ok(match which {
        Which::Paper(flags) => Box::new(paper::read(flags, session)?),
        Which::ChainLength(flags) => Box::new(trend::read::<ChainLengths>(flags, session)?),
        Which::Precompression(flags) => Box::new(trend::read::<Precompressions>(flags, session)?),
        Which::Water(flags) => Box::new(water::read(flags, session)?),
        Which::Dissipation(flags) => Box::new(dissipation::read(flags, session)?),
    })
}

impl Which {
    /// What all of them share.
    fn shared(&self) -> &StudyArguments {
        match self {
            Self::Paper(flags) => &flags.study,
            Self::ChainLength(flags) | Self::Precompression(flags) => &flags.study,
            Self::Water(flags) => &flags.study,
            Self::Dissipation(flags) => &flags.study,
        }
    }

    /// Where results go.
    pub(super) fn output(&mut self) -> &mut OutputArguments {
        match self {
            Self::Paper(flags) => &mut flags.output,
            Self::ChainLength(flags) | Self::Precompression(flags) => &mut flags.output,
            Self::Water(flags) => &mut flags.output,
            Self::Dissipation(flags) => &mut flags.output,
        }
    }
}

/// `--model`, `--set`, `--quick`, `--part`: what all studies share.
#[derive(Debug, Clone, Default, Args)]
pub struct StudyArguments {
    /// Rung of the fidelity ladder
    #[arg(long, value_enum, help_heading = "Scene")]
    pub model: Option<ModelChoice>,
    /// Override one key of every scene: a plain number is SI, else with its unit; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = "Scene")]
    pub set: Vec<String>,
    /// Few runs and a coarse grid, for a first look
    #[arg(long, help_heading = "Study")]
    pub quick: bool,
    /// Which part of the points is run.
    #[command(flatten)]
    pub part: PartArguments,
}

/// Model of most studies where none is named.
const DEFAULT_MODEL: ModelChoice = ModelChoice::Reduced;

impl StudyArguments {
    /// The overrides of every scene, on the model `usual` where none is named.
    fn overrides(&self, usual: ModelChoice) -> Vec<String> {
        let model = format!("model.kind={}", self.model.unwrap_or(usual).name());
        std::iter::once(model).chain(self.set.iter().cloned()).collect()
    }

    /// The command line that makes the same report, without what cannot change it.
    fn command_line(&self, name: &str, members: Option<u32>, session: &Session) -> String {
        let mut text = format!("granchain study {name}");
        // Writing to a string cannot fail.
        if let Some(model) = self.model {
            let _ = write!(text, " --model {}", model.name());
        }
        text.push_str(&set_flags(&self.set));
        if self.quick {
            text.push_str(" --quick");
        }
        if let Some(members) = members {
            let _ = write!(text, " --members {members}");
        }
        if let Some(seed) = session.seed {
            let _ = write!(text, " --seed {seed}");
        }
        text
    }
}

/// Overrides as one types them.
pub(super) fn set_flags(sets: &[String]) -> String {
    sets.iter().map(|set| format!(" --set {}", shell_word(set))).collect()
}

/// Time a whole study will take, from a first few of its runs and their measurement: those are thrown away.
///
/// # Errors
/// When the model cannot run the scene.
fn estimate(bodies: &Bodies, scene: &Scene, runs: usize) -> anyhow::Result<Duration> {
    let members = rayon::current_num_threads() * if scene.model.kind == ModelKind::Chain { 8 } else { 1 };
    let variations = perturbations(scene, &EnsemblePlan::new(members, 0));
    let settings = observation::settings(scene)?;
    // Not counted: made once.
    bodies.prepared(scene)?;
    let started = Instant::now();
    let decoder = Decoder::of_reconstruction(0);
    let see = |index, velocity: &Series| Portrait::of(&decoder.sees(velocity, index), &settings);
    members::run(
        bodies,
        scene,
        &variations,
        STEPS_PER_PERIOD,
        Measurand::Velocity,
        &progress::Bar(ProgressBar::hidden()),
        see,
    )?;
    interrupt::check()?;
    Ok(started.elapsed() * u32::try_from(runs.div_ceil(members)).unwrap_or(u32::MAX))
}

/// Last line of a study that was not asked to keep anything.
const NOTHING_WRITTEN: &str = "Nothing was written; pass --out DIR for the page, the figures and the tables.\n";

/// Keep the files of a report and the time it took.
pub(super) fn write(folder: OutputFolder, files: Files, mut timing: Timing, session: &Session) -> anyhow::Result<()> {
    for (name, bytes) in files {
        folder.write(name, bytes)?;
        interrupt::check()?;
    }
    timing.stage("write");
    folder.write(timing::FILE, timing.to_json())?;
    let place = folder.finish()?;
    session.note(format_args!("written to {}", place.display()));
    Ok(())
}
