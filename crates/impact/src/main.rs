//! `granchain-impact`: fits a column of beads on a soft ground to hits of a striker.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::ExitCode,
};

use anyhow::{Context as _, bail};
use clap::{Args, Parser};
use granchain_calibration::{agreement::DOUBTFUL, outcome::InputDigest};
use granchain_impact::{
    Experiment, ImpactOutcome, Parameter, SET_UP, Unknown, lines, page,
    synthetic::{HITS, ImpactCount, TRUTHS, synthetics},
};
use granchain_model::scene::{ModelKind, SceneText};
use granchain_record::{ReadOptions, Reading, RecordKind, SensorRecord, read_sensor, sha256, shell_line};
use granchain_report::page::Files;
use granchain_signal::{
    Dimension, Quantity, Unit,
    number::{engineering, significant},
    visible_json,
};

#[derive(Debug, Parser)]
#[command(
    version,
    about = "Fits a column of beads on soil, foam or another soft ground to hits of a striker (docs/impact.md)"
)]
enum Command {
    /// Fit modulus and loss of the ground to records of a force sensor in one of the beads
    #[command(after_help = "Example:\n  granchain-impact fit hits/*.csv --scene column.toml --out fit")]
    Fit(Box<Fit>),
    /// Count how many intervals contain the true value, on synthetic hits made and fitted here
    Coverage {
        /// Number of columns, five hits each
        #[arg(long, value_name = "N", default_value_t = 8)]
        count: u64,
        #[arg(long, value_name = "N", default_value_t = 1)]
        seed: u64,
        /// Print every column as JSON
        #[arg(long)]
        json: bool,
    },
}

#[derive(Debug, Args)]
struct Fit {
    /// Records of the force sensor, of any gain and sign: tables or instruments' own files
    #[arg(required = true, value_name = "FILE")]
    hits: Vec<PathBuf>,
    /// Scene with a striker, built-in or a file; `granchain scene init column.toml --bench impact` writes one
    #[arg(long, value_name = "NAME|FILE", default_value = "impact")]
    scene: String,
    /// Override one key of the scene: a number without unit is SI; repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Parameters to fit, at most three of support_modulus, support_loss, alpha (a factor on the striker's velocity) and damping
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "support_modulus,support_loss")]
    fit: Vec<String>,
    /// Range of a parameter, such as "support_modulus=10 MPa:400 MPa"; repeatable
    #[arg(long, value_name = "NAME=LOW:HIGH")]
    bounds: Vec<String>,
    /// The hits of each folder are of one set-up of the column
    #[arg(long)]
    set_ups: bool,
    /// Standard deviation of the striker's velocity, of the logarithm
    #[arg(long, value_name = "X", default_value_t = Unknown::default().velocity, value_parser = deviation)]
    velocity_sd: f64,
    /// Standard deviation of the beads' modulus over their mass, of the logarithm
    #[arg(long, value_name = "X", default_value_t = Unknown::default().modulus, value_parser = deviation)]
    stiffness_sd: f64,
    /// Stress at which the ground gives way, such as "2.2 MPa"; a foam's data sheet has it [default: 5 % of its modulus]
    #[arg(long, value_name = "QUANTITY", value_parser = strength)]
    strength: Option<f64>,
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Column of the sensor: its header, or its number from 1
    #[arg(long, value_name = "NAME")]
    channel: Option<String>,
    /// How the files are read, such as time_unit=us or sample_rate=51.2kHz (docs/formats.md); repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    read: Vec<String>,
    /// Folder for calibration.json and report.html, which must not exist; without it nothing is written
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

fn main() -> ExitCode {
    let done = match Command::parse() {
        Command::Fit(arguments) => fit(&arguments),
        Command::Coverage { count, seed, json } => coverage(count, seed, json),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn fit(arguments: &Fit) -> anyhow::Result<()> {
    if let Some(out) = arguments.out.as_deref().filter(|out| out.symlink_metadata().is_ok()) {
        bail!("{}: exists already; name another folder with --out, or remove it", out.display());
    }
    let text = SceneText::read(&arguments.scene)?;
    let loaded = text.load(&arguments.set, ModelKind::Chain)?;
    let scene = loaded.scene;
    granchain_impact::expect_hits(&scene)?;
    let options =
        Reading { channel: arguments.channel.clone(), ..reading(&arguments.read)? }.below(ReadOptions::default())?;
    let (mut records, mut assumptions) = (Vec::new(), loaded.notes);
    for file in &arguments.hits {
        let folder = || file.parent().unwrap_or(Path::new("")).display().to_string();
        let set_up = arguments.set_ups.then(folder);
        records.extend(read_sensor(file, &options)?.into_iter().map(|hit| (hit, set_up.clone())));
    }
    assumptions.extend(assumed(&records));
    let unknown = Unknown { velocity: arguments.velocity_sd, modulus: arguments.stiffness_sd };
    assumptions.push(in_words(unknown));
    let mut parameters = Vec::new();
    for name in &arguments.fit {
        parameters.extend(Parameter::named(name, &scene)?);
    }
    for bounds in &arguments.bounds {
        set_bounds(&mut parameters, bounds)?;
    }
    let stated = scene.duration;
    let mut experiment = Experiment::of(records, scene, parameters)?;
    (experiment.unknown, experiment.strength, experiment.seed) = (unknown, arguments.strength, arguments.seed);
    if experiment.scene.duration > stated {
        let [lasting, stated] = [experiment.scene.duration, stated].map(|time| engineering(time, "s", 2));
        assumptions.push(format!("runs last {lasting}, not {stated} (`duration`): the hits return late"));
    }
    let fit = experiment.fit()?;
    let causes = if fit.p_value < DOUBTFUL { experiment.causes(&fit) } else { Vec::new() };
    let outcome = ImpactOutcome {
        scene: arguments.scene.clone(),
        overrides: arguments.set.clone(),
        inputs: inputs(&text, &experiment),
        assumptions,
        ..ImpactOutcome::of(&experiment, &fit, causes)
    };
    let json = serde_json::to_string_pretty(&outcome)? + "\n";
    if let Some(out) = &arguments.out {
        let mut files = page(&outcome, &experiment, &fit, &shell_line(std::env::args()))?;
        files.push(("calibration.json".into(), json.clone().into_bytes()));
        write(out, &files).with_context(|| format!("{}: cannot be written", out.display()))?;
    }
    if arguments.json {
        print!("{}", visible_json(&json));
        return Ok(());
    }
    outcome.assumptions.iter().for_each(|text| eprintln!("assumed: {text}"));
    outcome.warnings.iter().for_each(|text| eprintln!("warning: {text}"));
    let (hits, s) = (outcome.hits.len(), if outcome.hits.len() == 1 { "" } else { "s" });
    print!("{}: {}, {hits} hit{s} of a striker\n{}", outcome.verdict, outcome.scene, lines(&outcome));
    println!("{} runs, {} not usable", outcome.evaluations, outcome.failed_runs);
    if let Some(out) = &arguments.out {
        println!("report: {}", out.join("report.html").display());
    }
    Ok(())
}

fn deviation(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value| (0.0..1.0).contains(value));
    value.ok_or_else(|| format!("expected a number from 0 to 1, such as 0.05 for 5 %, found `{text}`"))
}

fn strength(text: &str) -> Result<f64, String> {
    let value = Quantity::parse_as(text, Dimension::PRESSURE).map_err(|error| error.to_string())?;
    if value > 0.0 { Ok(value) } else { Err(format!("expected a stress above zero, found `{text}`")) }
}

/// The settings of `--read` as keys of a bench file.
fn reading(settings: &[String]) -> anyhow::Result<Reading> {
    let mut table = toml::Table::new();
    for text in settings {
        let (key, value) = text.split_once('=').with_context(|| format!("--read {text}: expected KEY=VALUE"))?;
        let (key, value) = (key.trim().replace('-', "_"), value.trim());
        let other = match key.as_str() {
            "invert" | "resample" => value.parse().map(toml::Value::Boolean).ok(),
            "dataset" | "averages" => value.parse().map(toml::Value::Integer).ok(),
            _ => None,
        };
        table.insert(key, other.unwrap_or_else(|| toml::Value::String(value.into())));
    }
    table.try_into().context("--read")
}

fn set_bounds(parameters: &mut [Parameter], text: &str) -> anyhow::Result<()> {
    let parts = text.split_once('=').and_then(|(name, range)| Some((name.trim(), range.split_once(':')?)));
    let (name, (low, high)) = parts.with_context(|| {
        format!("--bounds {text}: expected NAME=LOW:HIGH such as \"support_modulus=10 MPa:400 MPa\"")
    })?;
    let parameter = parameters.iter_mut().find(|parameter| parameter.name == name);
    let parameter =
        parameter.with_context(|| format!("--bounds {text}: `{name}` is not fitted; name it with --fit"))?;
    let dimension = Unit::parse(&parameter.unit)?.dimension;
    let value = |text: &str| Quantity::parse_as(text, dimension).with_context(|| format!("--bounds {text}"));
    let (low, high) = (value(low)?, value(high)?);
    if !(low > 0.0 && low < high && high.is_finite()) {
        bail!("--bounds {text}: expected 0 < LOW < HIGH");
    }
    *parameter = parameter.clone().between(low, high);
    Ok(())
}

/// What the reader assumed: of all hits once, of one with its file.
fn assumed(records: &[(SensorRecord, Option<String>)]) -> Vec<String> {
    let mut assumed = Vec::new();
    for (record, _) in records {
        for text in &record.assumptions {
            let of_all = records.iter().all(|(hit, _)| hit.assumptions.contains(text));
            let text = if of_all { text.clone() } else { format!("{}: {text}", record.path.display()) };
            if !assumed.contains(&text) {
                assumed.push(text);
            }
        }
    }
    assumed
}

fn in_words(unknown: Unknown) -> String {
    let [velocity, modulus] = [unknown.velocity, unknown.modulus].map(|deviation| 100.0 * deviation);
    let [time, peak, width, incident] = SET_UP.map(|deviation| 100.0 * deviation);
    format!(
        "not known, and the same in all hits: the striker's velocity ±{velocity} %, the beads' stiffness over their mass ±{modulus} %, the corner of the \
         sensor's AC coupling (0.25 to 2.5 kHz), where in its bead it reads, how the column stands and what its sensor passes (±{time} % of return time, \
         ±{peak} % of the ratio of peaks, ±{width} % of that of widths, ±{incident} % of the incident width)"
    )
}

/// Every file that was read, by role.
fn inputs(scene: &SceneText, experiment: &Experiment) -> BTreeMap<String, InputDigest> {
    let of_scene = scene.file().map(|(path, text)| {
        let path = path.display().to_string();
        ("scene".to_owned(), InputDigest { path, sha256: sha256(text.as_bytes()), ..InputDigest::default() })
    });
    let hits = experiment.files().enumerate().map(|(number, record)| {
        let digest = InputDigest::read_with(&record.path, &record.sha256, RecordKind::Vibrometer, &record.options);
        (format!("measured-{}", number + 1), digest)
    });
    of_scene.into_iter().chain(hits).collect()
}

/// The folder as a whole or not at all: made beside its place, then renamed.
fn write(out: &Path, files: &Files) -> anyhow::Result<()> {
    let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(parent)?;
    let place = tempfile::Builder::new().prefix(".granchain-impact-").tempdir_in(parent)?;
    let made = place.path().join("made");
    for (name, bytes) in files {
        let path = made.join(name);
        fs::create_dir_all(path.parent().unwrap_or(&made))?;
        fs::write(path, bytes)?;
    }
    Ok(fs::rename(made, out)?)
}

fn coverage(count: u64, seed: u64, json: bool) -> anyhow::Result<()> {
    let records = synthetics(count, seed).map_err(anyhow::Error::msg)?;
    let count = ImpactCount::of(&records);
    if json {
        let value = serde_json::json!({ "seed": seed, "count": count, "records": records });
        println!("{}", serde_json::to_string_pretty(&value)?);
        return Ok(());
    }
    println!("{} columns, {HITS} hits each; 90 % intervals", count.count);
    for (d, (name, _)) in TRUTHS.into_iter().enumerate() {
        let (width, error) = (significant(count.widths[d], 2), significant(count.errors[d], 2));
        let (held, of) = (count.held[d], count.count);
        println!("{name}: {held} of {of} contain the true value; median width {width}, median error {error} (ln)");
    }
    println!("outside scatter: {}; p < 0.05: {}", count.outside, count.below_five_percent);
    Ok(())
}
