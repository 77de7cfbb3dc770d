//! Flags that several subcommands share.

use std::{
    collections::BTreeSet,
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::{
    Args,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};
use console::Term;

use crate::{
    calibration::problem::DEFAULT_SEED,
    model::{self, ModelError, Prepared, reduced::Cache},
    scene::{Limits, ModelKind, Scene},
    signal::{Dimension, Quantity, visible_json},
};

use super::{
    accuracy::level,
    calibrated::Calibrated,
    output::{OutputError, OutputFolder, print, shown_on},
};

/// Most threads a core, and how many are no matter on any machine.
const THREADS_A_CORE: usize = 8;
const FEWEST_MOST_THREADS: usize = 64;

/// What is assumed of every record that does not state otherwise, as its reader says it and in short.
const USUAL: [(&str, &str); 5] = [
    ("t = 0 of the file's own time axis is the trigger", "t = 0 is the trigger"),
    ("instrument delay: not stated", "no delay"),
    ("instrument bandwidth: not stated", "no limit of bandwidth"),
    ("sign as in the file", "sign as in the file"),
    ("the instrument's full-scale value is not stated", "no full scale"),
];

/// Flags of every subcommand: amount of output, threads, seed.
#[derive(Debug, Clone, Default, Args)]
pub struct Session {
    /// Print the summary as JSON alone on standard output
    #[arg(long, global = true, help_heading = "Session")]
    pub json: bool,
    /// Print only results and errors
    #[arg(long, global = true, help_heading = "Session")]
    pub quiet: bool,
    /// Worker threads; the results are the same for any number [default: one per core]
    #[arg(long, global = true, value_name = "N", value_parser = threads, help_heading = "Session")]
    pub threads: Option<NonZeroUsize>,
    /// Folder in which the computed modes of beads and supports are kept for the next command, or `none` [default: granchain in $XDG_CACHE_HOME or
    /// ~/.cache]
    #[arg(long, global = true, value_name = "DIR", help_heading = "Session")]
    pub cache: Option<PathBuf>,
    /// Seed of everything drawn at random [default: 1]
    #[arg(long, global = true, value_name = "N", help_heading = "Session")]
    pub seed: Option<u64>,
    /// Run even if the estimate of work or memory is too large
    #[arg(long, global = true, help_heading = "Session")]
    pub no_limits: bool,
}

impl Session {
    /// The seed given, else [`DEFAULT_SEED`].
    pub fn seed(&self) -> u64 {
        self.seed.unwrap_or(DEFAULT_SEED)
    }

    /// What a run may ask for.
    pub fn limits(&self) -> Limits {
        if self.no_limits { Limits::NONE } else { Limits::default() }
    }

    /// Where reduced bodies are kept; none with `--cache none`, or where the user has no folder for such things.
    pub fn cache(&self) -> Option<Cache> {
        if let Some(folder) = &self.cache {
            return (folder.as_os_str() != "none").then(|| Cache::new(folder));
        }
        let absolute = |variable: &str| std::env::var_os(variable).map(PathBuf::from).filter(|path| path.is_absolute());
        let folder = absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache")))?;
        Some(Cache::new(folder.join("granchain")))
    }

    /// Make the bodies of a scene ready, and say so if they cannot be kept.
    pub fn prepare(&self, scene: &Scene) -> Result<Prepared, ModelError> {
        let prepared = model::prepare_with(scene, self.cache().as_ref())?;
        self.warn(prepared.warning());
        Ok(prepared)
    }

    /// Set up the worker threads; called once by the frame before the subcommand runs.
    pub fn start(&self) -> anyhow::Result<()> {
        let Some(threads) = self.threads else { return Ok(()) };
        let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        let most = (THREADS_A_CORE * cores).max(FEWEST_MOST_THREADS);
        if threads.get() > most {
            return Err(usage(format!(
                "--threads {threads}: expected at most {most}; this machine has {cores} cores, and more threads than those gain nothing"
            )));
        }
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads.get())
            .build_global()
            .with_context(|| format!("--threads {threads}: the worker threads could not be started"))
    }

    /// A remark for the person at the terminal, on standard error; nothing with `--quiet`.
    pub fn note(&self, text: impl std::fmt::Display) {
        if !self.quiet {
            eprintln_quietly(&text);
        }
    }

    /// What looks wrong, on standard error.
    pub fn warn(&self, warnings: impl IntoIterator<Item = impl std::fmt::Display>) {
        warnings.into_iter().for_each(|warning| self.note(format_args!("warning: {warning}")));
    }

    /// What was assumed, on standard error: what concerns a file below its name, what holds of every record that states nothing in one line. Reports
    /// have all of it.
    pub fn assumed<'a>(&self, assumptions: impl IntoIterator<Item = &'a String>) {
        let mut of_files: Vec<(&str, Vec<&str>)> = Vec::new();
        for assumption in assumptions {
            match assumption.split_once(": ").filter(|(file, _)| Path::new(file).is_file()) {
                None => self.note(format_args!("assumed: {assumption}")),
                Some((file, text)) => match of_files.iter_mut().find(|(known, _)| *known == file) {
                    Some((_, texts)) => texts.push(text),
                    None => of_files.push((file, vec![text])),
                },
            }
        }
        for (file, texts) in of_files {
            self.note(format_args!("assumed of {file}:"));
            let (usual, own): (Vec<&str>, Vec<&str>) =
                texts.iter().partition(|text| USUAL.iter().any(|(full, _)| text.starts_with(full)));
            for text in own {
                self.note(format_args!("  {text}"));
            }
            let short = usual.iter().filter_map(|text| USUAL.iter().find(|(full, _)| text.starts_with(full)));
            let mut short: Vec<&str> = short.map(|(_, short)| *short).collect();
            // Both channels of one file assume the same.
            let mut seen = BTreeSet::new();
            short.retain(|text| seen.insert(*text));
            if !short.is_empty() {
                self.note(format_args!("  as nothing else is stated: {}", short.join(", ")));
            }
        }
    }

    /// The result of a command: `text` for people, or `value` as JSON with `--json`.
    pub fn result(&self, text: impl std::fmt::Display, value: &impl serde::Serialize) -> anyhow::Result<()> {
        if self.json {
            let json = serde_json::to_string_pretty(value).context("the summary cannot be written as JSON")?;
            print(format_args!("{}\n", visible_json(&json)))
        } else {
            print(shown_on(&Term::stdout(), &text.to_string()))
        }
    }
}

fn eprintln_quietly(text: &dyn std::fmt::Display) {
    use std::io::Write;
    // A closed standard error is no reason to stop a run.
    let _ = writeln!(std::io::stderr().lock(), "{}", shown_on(&Term::stderr(), &text.to_string()));
}

/// `--scene`, `--model`, `--drive`, `--drive-frequency`, `--alpha`, `--set`: which experiment is simulated, and how.
#[derive(Debug, Clone, Default, Args)]
pub struct SceneArguments {
    /// Built-in scene (see `granchain scene list`) or scene file
    #[arg(long, value_name = "NAME|FILE", help_heading = "Scene")]
    pub scene: Option<String>,
    /// Model [default: the scene's, else reduced, or chain if only it can run the scene]
    #[arg(long, value_parser = one_of(&MODELS), help_heading = "Scene")]
    pub model: Option<ModelKind>,
    /// Choose the fastest model and settings with at most this error on this scene, such as 1%; errors not yet known are measured first, as by
    /// `granchain accuracy`
    #[arg(long, value_name = "LEVEL", value_parser = level, conflicts_with = "model", help_heading = "Scene")]
    pub accuracy: Option<f64>,
    /// Horn-tip record that drives the piston [default: the scene's own drive]
    #[arg(long, value_name = "FILE", help_heading = "Scene")]
    pub drive: Vec<PathBuf>,
    /// Drive frequency with its unit, such as 73kHz
    #[arg(long, value_name = "QUANTITY", value_parser = drive_frequency, help_heading = "Scene")]
    pub drive_frequency: Option<f64>,
    /// α, motion of the horn's face at the first bead divided by that of the recorded point; a stated α is not fitted
    #[arg(long, value_name = "X", value_parser = positive_number, allow_negative_numbers = true, help_heading = "Scene")]
    pub alpha: Option<f64>,
    /// Override one key of the scene: a number without unit is SI; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = assignment, help_heading = "Scene")]
    pub set: Vec<String>,
    /// What a plan sets, below all flags.
    #[arg(skip)]
    pub planned: Vec<String>,
    /// What measures for `accuracy`.
    #[arg(skip)]
    pub session: Session,
}

impl SceneArguments {
    /// Keys of the scene that plan and `--set` override.
    pub fn overridden(&self) -> impl Iterator<Item = &str> {
        self.planned.iter().chain(&self.set).map(String::as_str)
    }
}

/// `--out`, `--force`: where results go.
#[derive(Debug, Clone, Default, Args)]
pub struct OutputArguments {
    /// Folder for the results, written as a whole or not at all; without it nothing is written
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    pub out: Option<PathBuf>,
    /// Write into a folder that also contains other files (these are never changed), or replace the results of another command
    #[arg(long, help_heading = "Output")]
    pub force: bool,
}

impl OutputArguments {
    /// The folder for results, if one was named, staged for a run that writes `names`.
    pub fn stage(&self, names: &[&str]) -> Result<Option<OutputFolder>, OutputError> {
        self.out.as_deref().map(|out| OutputFolder::stage(out, names, self.force)).transpose()
    }
}

/// The words of a flag: each with its help and what it stands for.
pub type Words<T, const N: usize> = [(&'static str, &'static str, T); N];

pub const MODELS: Words<ModelKind, 3> = [
    ("chain", "One degree of freedom per bead", ModelKind::Chain),
    ("reduced", "Elastic bodies, each described by a few modes and static contact flexibility", ModelKind::Reduced),
    ("fea", "All nodes of the finite-element mesh", ModelKind::Fea),
];

/// Value parser of one of these words.
pub fn one_of<T: Copy + Send + Sync, const N: usize>(words: &'static Words<T, N>) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(words.iter().map(|(word, help, _)| PossibleValue::new(*word).help(*help)))
        .try_map(move |found| words.iter().find(|(word, ..)| *word == found).map(|(.., meant)| *meant).ok_or("unknown"))
}

/// Why a flag's value is refused.
pub(super) fn expected(expected: impl std::fmt::Display, found: &str) -> String {
    format!("expected {expected}, found `{found}`")
}

/// Value parser of a whole number in a range.
pub fn whole<N: Copy + std::str::FromStr + PartialOrd + std::fmt::Display>(
    low: N,
    high: Option<N>,
) -> impl Fn(&str) -> Result<N, String> + Clone {
    move |text| match text.trim().parse() {
        Ok(number) if number >= low && high.is_none_or(|high| number <= high) => Ok(number),
        _ => {
            let range = high.map_or_else(|| format!("{low} up"), |high| format!("{low} to {high}"));
            Err(expected(format_args!("a whole number from {range}"), text))
        }
    }
}

fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let refused =
        || expected("a whole number of threads from 1 up", text) + "; omit the flag to use one thread per core";
    text.trim().parse().map_err(|_| refused())
}

const POSITIVE: &str = "a positive number";

/// Value parser of a positive frequency with its unit, Hz.
pub fn frequency(text: &str) -> Result<f64, String> {
    positive_quantity(text, Dimension::FREQUENCY)
}

/// Least and greatest frequency of a drive, Hz.
const DRIVE_FREQUENCIES: std::ops::RangeInclusive<f64> = 1.0..=1e8;

/// Value parser of a drive frequency with its unit, Hz: 1 Hz to 100 MHz.
pub fn drive_frequency(text: &str) -> Result<f64, String> {
    let refused = || expected("a drive frequency from 1 Hz to 100 MHz", text) + "; check the unit";
    Some(frequency(text)?).filter(|value| DRIVE_FREQUENCIES.contains(value)).ok_or_else(refused)
}

/// Value parser of a positive time with its unit, s.
pub fn positive_time(text: &str) -> Result<f64, String> {
    positive_quantity(text, Dimension::TIME)
}

/// Value parser of a time with its unit, s; of either sign.
pub fn time(text: &str) -> Result<f64, String> {
    Quantity::parse_as(text, Dimension::TIME).map_err(|error| error.to_string())
}

/// A positive quantity of one dimension, SI.
pub fn positive_quantity(text: &str, dimension: Dimension) -> Result<f64, String> {
    let value = Quantity::parse_as(text, dimension).map_err(|error| error.to_string())?;
    if value > 0.0 { Ok(value) } else { Err(expected(POSITIVE, text)) }
}

/// Value parser of a positive, finite pure number.
fn positive_number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err(expected(POSITIVE, text)),
    }
}

fn assignment(text: &str) -> Result<String, String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() && !value.trim().is_empty() => Ok(text.into()),
        _ => Err(expected("KEY=VALUE such as `damping.coefficient=0.4`", text)),
    }
}

/// A usage error that clap cannot see: exit code 2.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}\n\nFor more information, try '--help'.")]
pub struct UsageError {
    /// What is wrong and what to do.
    pub message: String,
}

/// The model of a scene that names none: the one that answered in a calibration; else the chain for an ensemble, and the reduced one for a single run.
pub fn preferred_model(calibrated: Option<&Calibrated>, ensemble: Option<u32>) -> ModelKind {
    let otherwise = if ensemble.is_some() { ModelKind::Chain } else { ModelKind::Reduced };
    calibrated.map_or(otherwise, |calibrated| calibrated.model)
}

/// A [`UsageError`] with this message.
pub fn usage(message: impl Into<String>) -> anyhow::Error {
    UsageError { message: message.into() }.into()
}
