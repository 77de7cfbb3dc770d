//! `granchain start`: from the files of a laboratory to a plan with every open choice in it.

mod unread;

use std::{
    fmt::Write as _,
    path::{Path, PathBuf},
};

use anyhow::bail;
use clap::Args;
use serde_json::json;

pub use self::unread::Unread;
use self::unread::is_named_horn;
use super::{
    Outcome,
    arguments::{Session, usage},
    experiment::refuse_hits,
    inspect, mesh,
    output::{publishing, refuse_existing, write_new},
    program,
    reading::{ChannelArguments, DriveReadArguments, ReadArguments, shown},
    scene as scene_command, typed,
};
use crate::{
    calibration::{
        measured::swapped,
        parameter::Parameter,
        plan::{Plan, ReadAs, ReadRequest, RecordPlan},
    },
    measurement::{MeasurementError, ReadOptions, Record, RecordKind, Sensitivity, read_record_bytes, shell_word},
    scene::{self, DampingKind, ModelKind, Scene},
    signal::{
        Dimension,
        feature::{Window, amplitude_spectrum},
    },
};

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain start vib.csv horn_tip.csv")]
pub struct Arguments {
    /// Bead (or hydrophone) and horn records, in any order; one file with both
    #[arg(value_name = "FILE", num_args = 0..=2)]
    pub files: Vec<PathBuf>,
    /// Which of the two is the horn's tip [default: from names, units and spectra]
    #[arg(long, value_name = "FILE")]
    pub horn: Option<PathBuf>,
    /// Built-in scene or scene file nearest to the bench [default: annulus; water for a hydrophone]
    #[arg(long, value_name = "NAME|FILE", help_heading = "Scene")]
    pub scene: Option<String>,
    /// Override one key of the scene: a number without unit is SI; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = "Scene")]
    pub set: Vec<String>,
    /// The plan to write; never replaces a file
    #[arg(long, value_name = "FILE", default_value = "plan.toml")]
    pub out: PathBuf,
    #[command(flatten)]
    pub reading: ReadArguments,
    #[command(flatten)]
    pub drive_reading: DriveReadArguments,
}

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    if arguments.files.is_empty() {
        return Err(usage(
            "expected the records of last bead and horn's tip, found none; type: granchain start vib.csv horn_tip.csv",
        ));
    }
    let words: Vec<String> = typed().skip(1).skip_while(|word| word != "start").skip(1).collect();
    begin(&arguments, &words, session)
}

/// How another file is named.
const OUT: &str = " with --out";

/// The files of a bench, read.
pub struct Files {
    pub bead: Record,
    pub horn: Option<Record>,
    /// How the two were distinguished.
    pub why: String,
}

impl Files {
    /// Why the two may be swapped.
    pub fn swapped(&self) -> Option<String> {
        let horn = self.horn.as_ref().filter(|_| self.bead.kind == RecordKind::Vibrometer)?;
        let why = swapped(&self.bead, &horn.path, horn.strongest_line()?, &horn.series)?;
        Some(format!("{}: {why}: exchange the two files or channels if so", self.bead.path.display()))
    }
}

/// Files that are in memory, by the name that stands for each; any other is on the disk.
pub struct InMemory<'a>(pub &'a [(PathBuf, Vec<u8>)]);

impl InMemory<'_> {
    fn read(&self, path: &Path, kind: Option<RecordKind>, options: &ReadOptions) -> Result<Record, MeasurementError> {
        match self.0.iter().find(|(name, _)| name == path) {
            Some((_, bytes)) => read_record_bytes(path, bytes, kind, options),
            None => inspect::read(path, kind, options),
        }
    }
}

fn begin(arguments: &Arguments, words: &[String], session: &Session) -> anyhow::Result<Outcome> {
    let load = |name: &str| scene::load_preferring(name, &arguments.set, ModelKind::Reduced);
    let named = arguments.scene.as_deref().map(load).transpose()?;
    named.iter().try_for_each(|named| refuse_hits(&named.scene))?;
    let picture = arguments.out.with_extension("png");
    [&arguments.out, &picture].into_iter().try_for_each(|path| refuse_existing(path, OUT))?;
    let files = read(arguments, &InMemory(&[]))?;
    let Files { bead, horn, .. } = &files;
    let usual = if bead.kind == RecordKind::Hydrophone { "water" } else { "annulus" };
    let name = arguments.scene.as_deref().unwrap_or(usual);
    let loaded = named.map_or_else(|| load(usual), Ok)?;
    let plan = definition(arguments, words, name, &loaded.scene, bead, horn.as_ref());
    let drawn = mesh::picture(&loaded.scene);
    // Both files or none.
    publishing(|| {
        drawn.as_ref().map_or(Ok(()), |png| write_new(&picture, png, "", OUT))?;
        let written = write_new(&arguments.out, plan.as_bytes(), "", OUT);
        written.inspect_err(|_| {
            if drawn.is_ok() {
                _ = std::fs::remove_file(&picture)
            }
        })
    })?;
    let drawn = drawn.map(|_| picture);
    let drawn =
        drawn.inspect_err(|error| session.note(format_args!("warning: the bench is not drawn: {error:#}"))).ok();
    for record in [Some(bead), horn.as_ref()].into_iter().flatten() {
        inspect::warn(record, session);
    }
    let frequency = horn.as_ref().and_then(Record::strongest_line);
    session.warn(files.swapped());
    let text = summary(arguments, &files, (name, &loaded.scene), drawn.as_deref())?;
    session.result(
        text,
        &json!({
            "plan": arguments.out, "picture": drawn, "measured": bead.path, "drive": horn.as_ref().map(|horn| &horn.path), "why": files.why,
            "scene": name, "drive_frequency_hz": frequency,
        }),
    )?;
    Ok(Outcome::Done)
}

/// Read the record to be fitted and the horn's; missing metadata of both is listed at once.
pub fn read(arguments: &Arguments, in_memory: &InMemory) -> anyhow::Result<Files> {
    let (measured, horn, why) = roles(arguments, in_memory)?;
    let record = RecordPlan { measured, ..RecordPlan::default() };
    let request = ReadRequest {
        measured: arguments.reading.options(None),
        drive: arguments.drive_reading.options(None),
        drive_file: horn,
    };
    let ReadAs { measured: options, drive } = Plan::default().read_as(&record, request)?;
    let own_file = drive.as_ref().is_none_or(|(file, ..)| *file == record.measured);
    let (mut unread_bead, mut unread_horn) = (None, None);
    let open = options.clone();
    let bead = match in_memory.read(&record.measured, None, &options) {
        Ok(probe) => {
            let kind = if probe.kind == RecordKind::Hydrophone { probe.kind } else { RecordKind::Vibrometer };
            in_memory.read(&record.measured, Some(kind), &arguments.reading.filled(kind, options)?)
        }
        Err(error) => Err(error),
    };
    let bead = bead.map_err(|error| unread_bead = Some(error)).ok();
    let horn = match drive {
        Some((file, options, _)) => {
            let options = arguments.reading.filled(RecordKind::HornTip, options)?;
            let read = in_memory.read(&file, Some(RecordKind::HornTip), &options);
            read.map_err(|error| unread_horn = Some(error)).ok()
        }
        None => None,
    };
    match (bead, unread_bead, unread_horn) {
        (Some(bead), _, None) => Ok(Files { bead, horn, why }),
        (_, Some(error), None) if own_file && horn.is_none() => {
            let file = &record.measured;
            Err(Unread::of_one(error, |columns| is_horn_first(in_memory, file, columns, &open))?.into())
        }
        (_, bead, horn) => Err(Unread::of(bead, horn, None)?.into()),
    }
}

/// The record to be fitted, that of the horn's tip where it is another file, and how they were distinguished.
fn roles(arguments: &Arguments, in_memory: &InMemory) -> anyhow::Result<(PathBuf, Option<PathBuf>, String)> {
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
    let records = match [first, second].map(|file| in_memory.read(file, None, &options)) {
        [Ok(first), Ok(second)] => [first, second],
        unread => return Err(unidentified([first, second], unread.map(Result::err))?.into()),
    };
    let is_horn = records.each_ref().map(|record| record.kind == RecordKind::HornTip);
    if is_horn[0] != is_horn[1] {
        return apart(is_horn[0], "recognised by names and units".into());
    }
    // A horn moves as a sine, the last bead in impulses.
    let [one, other] = records.each_ref().map(share_of_strongest_line);
    let what = |of: f64| format!("{:.0} %", 100.0 * of);
    if (one - other).abs() < CLEARLY {
        bail!(
            "{} and {}: expected a nearly sinusoidal horn tip beside the last bead, found only {} and {} of their power within 5 % of the strongest \
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

/// Missing metadata of two files that cannot be distinguished without it. The file named like a horn's counts as the horn's, else the second; the
/// message names it.
fn unidentified(files: [&PathBuf; 2], [first, second]: [Option<MeasurementError>; 2]) -> anyhow::Result<Unread> {
    let horn_is_first = is_named_horn(files[0]) && !is_named_horn(files[1]);
    let (bead, horn, file) = if horn_is_first { (second, first, files[0]) } else { (first, second, files[1]) };
    Unread::of(bead, horn, Some(format!("--horn {}", shell_word(&file.display().to_string()))))
}

/// Whether the first of two columns is a sine and the second is not: a horn moves as a sine, the last bead in impulses. Read as volts of any
/// sensitivity, or as a velocity, for the shape alone.
fn is_horn_first(in_memory: &InMemory, file: &Path, columns: [&str; 2], options: &ReadOptions) -> bool {
    let share = |column: &str| {
        let of = |unit: Option<&str>, scale: Option<&str>| ReadOptions {
            column: Some(column.into()),
            unit: unit.map(str::to_owned).or_else(|| options.unit.clone()),
            scale: scale.and_then(|scale| Sensitivity::parse(scale).ok()).or(options.scale),
            ..options.clone()
        };
        let ways = [of(None, None), of(None, Some("1 m/s/V")), of(Some("m/s"), None)];
        let read = ways.iter().find_map(|way| in_memory.read(file, Some(RecordKind::Vibrometer), way).ok());
        read.as_ref().map(share_of_strongest_line)
    };
    let [first, second] = columns.map(share);
    first.zip(second).is_some_and(|(first, second)| first > second + CLEARLY)
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

/// By how much more of a horn's motion lies at its strongest line than of a bead's, 1.
const CLEARLY: f64 = 0.1;

/// Scene keys that say what stands on a bench.
const OF_THE_BENCH: [&str; 6] = ["chain.", "piston.", "support.", "disc.", "water.", "vibrometer."];

/// The lines of `set`: what is stated, and every other key of the bench as a comment.
fn open_settings(stated: &[String], scene: &Scene) -> String {
    let mut lines: Vec<String> = stated.iter().map(|set| format!("    {},\n", toml_text(set))).collect();
    let own: Vec<&str> = stated.iter().filter_map(|set| Some(set.split_once('=')?.0.trim())).collect();
    for setting in scene.settings() {
        if OF_THE_BENCH.iter().any(|table| setting.key.starts_with(table)) && !own.contains(&setting.key.as_str()) {
            let value = setting.value.to_toml();
            let value = value.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')).unwrap_or(&value);
            lines.push(format!("    # '{}={value}', # {}\n", setting.key, setting.meaning));
        }
    }
    lines.concat()
}

/// The plan as text.
fn definition(
    arguments: &Arguments,
    words: &[String],
    name: &str,
    scene: &Scene,
    bead: &Record,
    drive: Option<&Record>,
) -> String {
    let plan = shell_word(&arguments.out.display().to_string()).into_owned();
    let (measured, of_bead) = (place(arguments, &bead.path), of_record(bead));
    let drive = match drive {
        Some(drive) if drive.path != bead.path => {
            format!("drive.file = {} # {}", place(arguments, &drive.path), of_record(drive))
        }
        Some(drive) => format!("# The horn's tip is in the same file: {}.", of_record(drive)),
        None => "# drive = 'horn_tip.csv' # without one, the piston moves as the scene's own drive says".into(),
    };
    let quantity = if bead.kind == RecordKind::Hydrophone { "quantity = 'pressure'\n" } else { "" };
    let channel = |table: &str, given: Vec<(String, String)>, scale: &str, delay: &str| -> String {
        let examples = [("scale", scale), ("delay", delay), ("invert", "true")];
        let open = examples.into_iter().filter(|(key, _)| !given.iter().any(|(own, _)| own == key));
        let open = open.map(|(key, value)| format!("# {table}.{key} = {value}\n"));
        open.chain(given.iter().map(|(key, value)| format!("{table}.{key} = {value}\n"))).collect()
    };
    let reading = channel("reading", flags::<ChannelArguments>(words, ""), "'100 mm/s/V'", "'4.2 us'");
    let drive_reading = channel("drive.reading", flags::<DriveReadArguments>(words, "drive-"), "'2 um/V'", "'0 s'");
    let bench = arguments.reading.bench.as_ref();
    let bench = bench.map_or_else(String::new, |bench| format!("bench = {}\n", place(arguments, bench)));
    let settings = open_settings(&arguments.set, scene);
    let others = Parameter::names().into_iter().filter(|name| !["alpha", "damping"].contains(name));
    let others = others.collect::<Vec<_>>().join(", ");
    let damping = match scene.damping.kind {
        DampingKind::None => "damping = ['linear'] # the scene has none;".into(),
        law => format!("# damping = ['{}'] #", law.name()),
    };

    format!(
        "# A plan, begun by `granchain start`. Lines behind `#` are examples: remove the `#` and type your own value.\n\
         #\n#   granchain calibrate --plan {plan}\n#\nmeasured = {measured} # {of_bead}\n{drive}\n{quantity}\n\
         # How the files are read: sensitivity of a column in volts, delay, sign (docs/formats.md has every key).\n\
         {reading}{drive_reading}{bench}\n{BENCH}\nscene = '{name}'\nset = [\n{settings}]\n\n\
         # What is fitted. alpha is the drive at the first bead divided by the true motion of the horn: 1 if both sensitivities are right and the horn's face moves as its recorded point.\n\
         # fit = ['alpha', 'damping'] # and {others}\n\
         {damping} laws that compete: linear, kuwabara-kono, linear+kuwabara-kono\n\
         # features = 'full' # or 'paper': two peaks, and the lines at 1/3 and 2/3 over the drive line\n\
         # seed = 1\n# [parameters.alpha]\n# low = 0.05\n# high = 3.0\n\
         # [uncertainty] # what the laboratory does not control\n# gap = '0.3 nm'\n# drive = 0.005 # horn scale; 0.01 if the horn was recorded in another shot than the bead\n"
    )
}

/// The line above the bench of a plan.
const BENCH: &str = "# The bench: the built-in scene or scene file nearest to it, and what differs. `granchain scene keys` explains every key.";

/// A file as a plan names it: from the root where the plan lies in another folder.
fn place(arguments: &Arguments, path: &Path) -> String {
    let beside = arguments.out.parent().is_none_or(|folder| folder.as_os_str().is_empty());
    let path = if beside { path.to_owned() } else { std::path::absolute(path).unwrap_or_else(|_| path.to_owned()) };
    toml_text(&path.display().to_string())
}

/// A text as TOML, literal where it can be.
fn toml_text(text: &str) -> String {
    if text.contains('\'') { toml::Value::String(text.to_owned()).to_string() } else { format!("'{text}'") }
}

/// The flags of one channel that were typed, as keys of a plan: their names with `_` for `-`.
fn flags<A: Args>(words: &[String], prefix: &str) -> Vec<(String, String)> {
    let command = A::augment_args(clap::Command::new(""));
    let mut words = words.iter().cloned();
    let mut found = Vec::new();
    while let Some(word) = words.next() {
        let Some(flag) = word.strip_prefix("--") else { continue };
        let (flag, joined) = flag.split_once('=').map_or((flag, None), |(flag, value)| (flag, Some(value.to_owned())));
        let Some(known) = command.get_arguments().find(|it| it.get_long() == Some(flag)) else { continue };
        let value = joined.unwrap_or_else(|| words.next().unwrap_or_default());
        let key = known.get_long().unwrap_or(flag);
        let (key, value) = match key.strip_prefix(prefix).unwrap_or(key) {
            "read" => value.split_once('=').unwrap_or((&value, "")),
            key => (key, value.as_str()),
        };
        found.push((key.trim().replace('-', "_"), plain_or_quoted(value.trim())));
    }
    found
}

fn plain_or_quoted(value: &str) -> String {
    let plain = value.parse::<usize>().is_ok() || value.parse::<bool>().is_ok();
    if plain { value.to_owned() } else { toml_text(value) }
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

/// A column of the record's file that is neither its time nor what was read.
fn further_column(record: &Record) -> Option<&String> {
    let used = [&record.time_column.0, &record.value_column.0];
    record.columns.iter().find(|column| !column.is_empty() && !used.contains(column))
}

fn summary(
    arguments: &Arguments,
    Files { bead, horn, why }: &Files,
    (name, scene): (&str, &Scene),
    picture: Option<&Path>,
) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    let what = if bead.kind == RecordKind::Hydrophone { "pressure" } else { "last bead" };
    writeln!(text, "  {what:<10} {}: {}", bead.path.display(), of_record(bead))?;
    match horn {
        Some(horn) => {
            let line = horn.strongest_line().map_or_else(String::new, |line| format!(", {:.2} kHz", 1e-3 * line));
            writeln!(text, "  {:<10} {}: {}{line}", "horn tip", horn.path.display(), of_record(horn))?;
            if arguments.files.len() > 1 {
                writeln!(text, "  {:<10} ({why})", "")?;
            }
        }
        None => {
            writeln!(text, "  {:<10} no record: the piston moves as the scene says", "horn tip")?;
            if let Some(other) = further_column(bead) {
                let quoted = shell_word(other);
                writeln!(
                    text,
                    "  {:<10} (if `{other}` is the horn's: --drive-read channel={quoted}, in volts with --drive-read scale='<VALUE> um/V')",
                    ""
                )?;
            }
        }
    }
    writeln!(text, "  {:<10} {name}; list what differs under `set` in the plan", "scene")?;
    writeln!(text, "\nscene check of {name}: valid")?;
    for (label, value) in scene_command::consequences_of_bench(scene) {
        writeln!(text, "  {label:<30}  {value}")?;
    }
    let plan = arguments.out.display().to_string();
    let plan = shell_word(&plan);
    writeln!(text, "\nwrote {plan}: every choice left open is a line in it")?;
    if let Some(picture) = picture {
        writeln!(text, "wrote {}: drawing of the bench in the plan", picture.display())?;
    }
    let program = program();
    let program = shell_word(&program);
    writeln!(text, "\nLook at records and uncalibrated response, then fit and report:\n")?;
    writeln!(text, "  {program} calibrate --plan {plan} --dry-run --out look")?;
    writeln!(text, "  {program} calibrate --plan {plan} --out fit")?;
    Ok(text)
}
