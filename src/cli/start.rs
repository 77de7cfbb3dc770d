//! `granchain start`: from the files of a laboratory to a fit definition with every open choice in it.

use std::{
    fmt::Write as _,
    fs::OpenOptions,
    io::{ErrorKind, Write as _},
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use clap::Args;
use serde_json::json;

use super::{
    Outcome,
    arguments::{Session, usage},
    inspect, program,
    reading::{ChannelArguments, DriveReadArguments, DriveUnread, ReadArguments, shown},
    shell_word, typed,
};
use crate::{
    calibration::plan::{Asked, Plan, ReadAs, RecordPlan},
    measurement::{Record, RecordKind, read_record},
    scene::{self, ModelKind, Scene},
    signal::{
        Dimension,
        feature::{Measurand, Window, amplitude_spectrum},
    },
};

/// Arguments of `granchain start`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain start vib.csv horn_tip.csv")]
pub struct Arguments {
    /// Records of the last bead (or of a hydrophone) and of the horn's tip, in any order; or one file with both channels
    #[arg(value_name = "FILE", required = true, num_args = 1..=2)]
    pub files: Vec<PathBuf>,
    /// Which of the two is the horn's tip [default: told from names, units and spectra]
    #[arg(long, value_name = "FILE")]
    pub horn: Option<PathBuf>,
    /// Built-in scene or scene file nearest to the bench [default: annulus; water for a hydrophone]
    #[arg(long, value_name = "NAME|FILE", help_heading = "Scene")]
    pub scene: Option<String>,
    /// Override one key of it: a plain number is SI, else with its unit; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = "Scene")]
    pub set: Vec<String>,
    /// The fit definition to write; never replaces a file
    #[arg(long, value_name = "FILE", default_value = "plan.toml")]
    pub out: PathBuf,
    /// How the record is read.
    #[command(flatten)]
    pub reading: ReadArguments,
    /// How the drive is read.
    #[command(flatten)]
    pub drive_reading: DriveReadArguments,
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

/// Run it.
///
/// # Errors
/// When a file is no record, none or both are the horn's, the scene is refused, or the definition exists or cannot be written.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let (measured, horn, why) = roles(&arguments)?;
    let record = RecordPlan { measured, ..RecordPlan::default() };
    let asked = Asked {
        measured: arguments.reading.options(None),
        drive: arguments.drive_reading.options(None, arguments.reading.force_frequency),
        drive_file: horn,
    };
    let ReadAs { measured: options, drive } = Plan::default().read_as(&record, asked)?;
    let probe = inspect::read(&record.measured, None, &options)?;
    let kind = if probe.kind == RecordKind::Hydrophone { RecordKind::Hydrophone } else { RecordKind::Vibrometer };
    let bead = read_record(&record.measured, kind, &arguments.reading.filled(kind, options)?)?;
    let drive = match drive {
        Some((file, options, _)) => {
            let options = arguments.reading.filled(RecordKind::HornTip, options)?;
            Some(read_record(&file, RecordKind::HornTip, &options).map_err(DriveUnread)?)
        }
        None => None,
    };
    let usual = if kind == RecordKind::Hydrophone { "water" } else { "annulus" };
    let name = arguments.scene.as_deref().unwrap_or(usual);
    let loaded = scene::load_preferring(name, &arguments.set, ModelKind::Reduced)?;
    let plan = definition(&arguments, name, &loaded.scene, &bead, drive.as_ref());
    write_new(&arguments.out, &plan)?;
    let session = &arguments.session;
    for record in [Some(&bead), drive.as_ref()].into_iter().flatten() {
        inspect::warn(record, session);
    }
    let frequency = drive.as_ref().and_then(Record::strongest_line);
    let text = summary(&arguments, &bead, drive.as_ref(), &why, name)?;
    session.result(
        text,
        &json!({
            "plan": arguments.out, "measured": bead.path, "drive": drive.as_ref().map(|drive| &drive.path), "why": why, "scene": name,
            "drive_frequency_hz": frequency,
        }),
    )?;
    Ok(Outcome::Done)
}

/// The record to be fitted, that of the horn's tip where it is another file, and what told them apart.
fn roles(arguments: &Arguments) -> anyhow::Result<(PathBuf, Option<PathBuf>, String)> {
    let [first, second] = match &arguments.files[..] {
        [only] => return Ok((only.clone(), arguments.horn.clone(), "one file".into())),
        [first, second, ..] => [first, second],
        [] => return Err(usage("expected a record, found none")),
    };
    let apart = |horn_is_first: bool, why: String| {
        let (bead, horn) = if horn_is_first { (second, first) } else { (first, second) };
        Ok((bead.clone(), Some(horn.clone()), why))
    };
    if let Some(horn) = &arguments.horn {
        if horn != first && horn != second {
            return Err(usage(format!("--horn {}: expected one of the two files", horn.display())));
        }
        return apart(horn == first, "named with --horn".into());
    }
    let options = arguments.reading.options(None);
    let records = [inspect::read(first, None, &options)?, inspect::read(second, None, &options)?];
    let is_horn = records.each_ref().map(|record| record.kind == RecordKind::HornTip);
    if is_horn[0] != is_horn[1] {
        return apart(is_horn[0], "told from names and units".into());
    }
    // A horn moves as a sine, the last bead in impulses.
    let [one, other] = records.each_ref().map(share_of_strongest_line);
    let what = |of: f64| format!("{:.0} %", 100.0 * of);
    if (one - other).abs() < 0.1 {
        bail!(
            "{} and {}: expected a horn's tip, which moves as a sine, beside a record of the last bead, found {} and {} of each motion within 5 % of its strongest \
             line; say which is the horn's with --horn FILE",
            first.display(),
            second.display(),
            what(one),
            what(other)
        );
    }
    let (most, least) = (one.max(other), one.min(other));
    apart(
        one > other,
        format!(
            "the horn's motion is a sine: {} of it lies at its strongest line, of the other {}",
            what(most),
            what(least)
        ),
    )
}

/// Share of the squared motion within 5 % of its strongest line, 1; 0 where there is none.
fn share_of_strongest_line(record: &Record) -> f64 {
    let Some(line) = record.strongest_line() else { return 0.0 };
    let Ok(spectrum) = amplitude_spectrum(&record.series, Window::whole(&record.series)) else { return 0.0 };
    let squares =
        || spectrum.amplitudes.iter().enumerate().skip(1).map(|(index, a)| (spectrum.frequency(index), a * a));
    let whole: f64 = squares().map(|(_, square)| square).sum();
    let near: f64 = squares().filter(|(f, _)| (f / line - 1.0).abs() < 0.05).map(|(_, square)| square).sum();
    if whole > 0.0 { near / whole } else { 0.0 }
}

/// Scene keys that say what stands on a bench.
const OF_THE_BENCH: [&str; 6] = ["chain.", "piston.", "support.", "disc.", "water.", "vibrometer."];

/// The fit definition as text.
fn definition(arguments: &Arguments, name: &str, scene: &Scene, bead: &Record, drive: Option<&Record>) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |words: String| {
        let _ = writeln!(text, "{words}");
    };
    let place = |path: &Path| {
        let beside = arguments.out.parent().is_none_or(|folder| folder.as_os_str().is_empty());
        let path = if beside { path.to_owned() } else { std::path::absolute(path).unwrap_or_else(|_| path.to_owned()) };
        format!("'{}'", path.display())
    };
    line("# A fit definition, begun by `granchain start`. Lines behind `#` are choices left open, with what is taken now.".into());
    line(format!("#\n#   granchain calibrate --plan {}\n#", shell_word(&arguments.out.display().to_string())));
    line(format!("measured = {} # {}", place(&bead.path), of_record(bead)));
    let own_file = drive.is_some_and(|drive| drive.path == bead.path);
    match drive {
        Some(drive) if !own_file => line(format!("drive.file = {} # {}", place(&drive.path), of_record(drive))),
        Some(drive) => line(format!("# The horn's tip is in the same file: {}.", of_record(drive))),
        None => line("# drive = 'horn_tip.csv' # without one, the piston moves as the scene's own drive says".into()),
    }
    if bead.kind == RecordKind::Hydrophone {
        line(format!("quantity = '{}'", Measurand::Pressure.name()));
    }
    line("\n# How the files are read: sensitivity of a column in volts, delay, sign (`granchain inspect --help` has every key).".into());
    let channels = [
        ("reading", flags::<ChannelArguments>(""), ["scale = '100 mm/s/V'", "delay = '4.2 us'", "invert = true"]),
        (
            "drive.reading",
            flags::<DriveReadArguments>("drive-"),
            ["scale = '2 um/V'", "delay = '0 s'", "invert = true"],
        ),
    ];
    for (table, given, examples) in channels {
        let is_given = |example: &&str| given.iter().any(|(key, _)| example.starts_with(key.as_str()));
        examples.iter().filter(|example| !is_given(example)).for_each(|example| line(format!("# {table}.{example}")));
        given.iter().for_each(|(key, value)| line(format!("{table}.{key} = {value}")));
    }
    if let Some(bench) = &arguments.reading.bench {
        line(format!("bench = {}", place(bench)));
    }
    line("\n# The bench: the built-in scene or scene file nearest to it, and what differs. `granchain scene keys` explains every key.".into());
    line(format!("scene = '{name}'\nset = ["));
    arguments.set.iter().for_each(|set| line(format!("    {},", toml_text(set))));
    let own: Vec<&str> = arguments.set.iter().filter_map(|set| Some(set.split_once('=')?.0.trim())).collect();
    for setting in scene.settings() {
        if OF_THE_BENCH.iter().any(|table| setting.key.starts_with(table)) && !own.contains(&setting.key.as_str()) {
            let value = setting.value.to_toml();
            let value = value.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(&value);
            line(format!("    # '{}={value}', # {}", setting.key, setting.meaning));
        }
    }
    line("]\n".into());
    line("# What is fitted. alpha is the factor between the horn's record and the drive of the chain: 1 if both sensitivities are right.".into());
    line("# fit = ['alpha', 'damping'] # and precompression, support_stiffness, gap, bandwidth".into());
    line(format!(
        "# damping = ['{}'] # laws that compete: linear, kuwabara-kono, linear+kuwabara-kono",
        scene.damping.kind.name()
    ));
    line("# features = 'full' # or 'paper': two peaks, and the lines at 1/3 and 2/3 over the drive line".into());
    line("# seed = 1\n# [parameters.alpha]\n# low = 0.2\n# high = 2.0".into());
    line(
        "# [uncertainty] # what the bench leaves open, drawn into every run\n# gap = '0.3 nm'\n# drive = 0.005".into(),
    );
    text
}

/// A text as TOML, literal where it can be.
fn toml_text(text: &str) -> String {
    if text.contains('\'') { toml::Value::String(text.to_owned()).to_string() } else { format!("'{text}'") }
}

/// The flags of one channel that were typed, as keys of a plan: their names with `_` for `-`.
fn flags<A: Args>(prefix: &str) -> Vec<(String, String)> {
    let command = A::augment_args(clap::Command::new(""));
    let mut words = typed().skip(1).peekable();
    let mut found = Vec::new();
    while let Some(word) = words.next() {
        let Some(flag) = word.strip_prefix("--") else { continue };
        let (flag, joined) = flag.split_once('=').map_or((flag, None), |(flag, value)| (flag, Some(value.to_owned())));
        let known = command.get_arguments().find(|it| {
            it.get_long() == Some(flag) || it.get_all_aliases().iter().flatten().any(|alias| *alias == flag)
        });
        let Some(known) = known else { continue };
        let value = match (known.get_action().takes_values(), joined) {
            (false, _) => "true".to_owned(),
            (true, Some(value)) => plain_or_quoted(&value),
            (true, None) => plain_or_quoted(&words.next().unwrap_or_default()),
        };
        let key = known.get_long().unwrap_or(flag);
        found.push((key.strip_prefix(prefix).unwrap_or(key).replace('-', "_"), value));
    }
    found
}

fn plain_or_quoted(value: &str) -> String {
    if value.parse::<usize>().is_ok() { value.to_owned() } else { toml_text(value) }
}

/// What a record is, in a line.
fn of_record(record: &Record) -> String {
    let peak = record.series.values.iter().fold(0.0, |peak: f64, value| peak.max(value.abs()));
    format!(
        "{} samples at {}, peak {}",
        record.series.len(),
        shown(record.series.sample_rate(), Dimension::FREQUENCY),
        shown(peak, record.kind.dimension())
    )
}

fn write_new(path: &Path, text: &str) -> anyhow::Result<()> {
    let written =
        OpenOptions::new().write(true).create_new(true).open(path).and_then(|mut file| file.write_all(text.as_bytes()));
    match written {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            bail!("{}: the file exists; name another with --out, or delete it first", path.display())
        }
        written => written.with_context(|| format!("{}: the fit definition cannot be written", path.display())),
    }
}

/// What the terminal shows.
fn summary(
    arguments: &Arguments,
    bead: &Record,
    drive: Option<&Record>,
    why: &str,
    scene: &str,
) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    let what = if bead.kind == RecordKind::Hydrophone { "pressure" } else { "last bead" };
    writeln!(text, "  {what:<10} {}: {}", bead.path.display(), of_record(bead))?;
    match drive {
        Some(drive) => {
            let line = drive.strongest_line().map_or_else(String::new, |line| format!(", {:.2} kHz", 1e-3 * line));
            writeln!(text, "  {:<10} {}: {}{line}", "horn tip", drive.path.display(), of_record(drive))?;
            if arguments.files.len() > 1 {
                writeln!(text, "             ({why})")?;
            }
        }
        None => writeln!(text, "  {:<10} no record: the piston moves as the scene says", "horn tip")?,
    }
    writeln!(text, "  {:<10} {scene}; what differs from it on your bench goes into `set`", "scene")?;
    let plan = shell_word(&arguments.out.display().to_string());
    writeln!(text, "\nwrote {plan}: every choice left open is a line in it. Then\n")?;
    writeln!(
        text,
        "  {} calibrate --plan {plan} --dry-run --out look   # records and uncalibrated response",
        program()
    )?;
    writeln!(text, "  {} calibrate --plan {plan} --out fit             # the fit and its report", program())?;
    Ok(text)
}
