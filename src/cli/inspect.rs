//! `granchain inspect FILE`: what is understood and assumed of a record, before anything is done with it.

mod folder;

use std::{
    fmt::{self, Write as _},
    path::{Path, PathBuf},
};

use anyhow::bail;
use clap::Args;
use serde::Serialize;

use crate::{
    measurement::{
        MeasurementError, NoiseSource, ReadOptions, Record, RecordKind, RecordedQuantity, inspect_record,
        read_back::read_text, read_record, shell_word,
    },
    signal::Dimension,
};

use super::{
    Outcome,
    arguments::{Session, Words, drive_frequency, one_of},
    reading::{ReadArguments, shown},
};

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  granchain inspect vib.csv\n  granchain inspect .", after_long_help = FORM)]
pub struct Arguments {
    /// A record (CSV or another export) or a folder (one line is printed for each file)
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Kind of record [default: from the file's name and units]
    #[arg(long, value_parser = one_of(&KINDS))]
    pub kind: Option<RecordKind>,
    /// Drive frequency with its unit, such as 73kHz [default: stated in the file, otherwise the strongest line of
    /// the horn-tip record]
    #[arg(long, value_name = "QUANTITY", value_parser = drive_frequency)]
    pub drive_frequency: Option<f64>,
    #[command(flatten)]
    pub reading: ReadArguments,
}

const FORM: &str = r#"Examples:
  granchain inspect vib.csv
  granchain inspect .

Form of a record:
    Comments; bandwidth, delay, trigger, pretrigger, drive frequency and sensitivity are understood:
  # bandwidth: 1.5 MHz
    Header with units; or `Time (us),Velocity [mm/s]`; or a second row of units:
  time_us,velocity_mm_per_s
  0.0,0.12

Form of a hydrophone's record:
    Sensitivity of a column in volts (or `4 MPa/V`):
  # sensitivity: 250 nV/Pa
  time_us,hydrophone_mv
  0.0,0.12"#;

pub const KINDS: Words<RecordKind, 3> = [
    ("horn-tip", "Displacement of the horn tip, or its velocity (granchain integrates it)", RecordKind::HornTip),
    ("vibrometer", "Velocity of the last bead's far pole", RecordKind::Vibrometer),
    ("hydrophone", "Pressure at a point of the water", RecordKind::Hydrophone),
];

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let file = &arguments.file;
    if file.is_dir() {
        let rows = folder::rows(&arguments)?;
        session.result(folder::text(file, &rows), &rows)?;
        return Ok(Outcome::Done);
    }
    if let Some(other) = other_file(file) {
        bail!("{}: {other}", file.display());
    }
    let options = arguments.reading.options_of_any(arguments.kind, arguments.drive_frequency)?;
    let record = read(file, arguments.kind, &options)?;
    let summary = Summary::of(&record, horn_frequency(&record));
    session.result(Text { record: &record, summary: &summary }, &summary)?;
    Ok(Outcome::Done)
}

fn is_toml(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// What a file of this program is that is no record, and which command reads it.
fn other_file(file: &Path) -> Option<String> {
    let text = is_toml(file).then(|| read_text(file).ok()).flatten()?;
    let table: toml::Table = text.parse().ok()?;
    let has = |keys: &[&str]| keys.iter().any(|key| table.contains_key(*key));
    let shown = file.display().to_string();
    let shown = shell_word(&shown);
    if has(&["measured", "record", "fit", "evaluations", "parameters"]) {
        Some(format!("this is a plan, not a record; use `granchain calibrate --plan {shown}`"))
    } else if has(&["vibrometer", "horn-tip", "hydrophone"]) && !has(&["chain"]) {
        Some(format!("this is a bench file, not a record; name it with --bench {shown}"))
    } else if has(&["chain", "extends", "support", "materials"]) {
        Some(format!("this is a scene file, not a record; use `granchain scene check {shown}`"))
    } else {
        None
    }
}

/// A record whose kind is named or recognised from the file.
pub fn read(file: &Path, kind: Option<RecordKind>, options: &ReadOptions) -> Result<Record, MeasurementError> {
    match kind {
        Some(kind) => read_record(file, kind, options),
        None => inspect_record(file, options),
    }
}

/// The drive frequency of the horn-tip record beside a vibrometer's or hydrophone's record.
fn horn_frequency(record: &Record) -> Option<f64> {
    if record.kind == RecordKind::HornTip || record.stated_drive_frequency.is_some() {
        return None;
    }
    let horn = record.path.parent().unwrap_or(Path::new("")).join("horn_tip.csv");
    // Its own warnings appear when it is inspected itself.
    read_record(&horn, RecordKind::HornTip, &ReadOptions::default()).ok()?.drive_frequency()
}

/// The JSON form; SI with the unit in the key.
#[derive(Debug, Serialize)]
pub struct Summary {
    file: String,
    sha256: String,
    kind: RecordKind,
    recorded: RecordedQuantity,
    /// Unit of the numbers below.
    unit: &'static str,
    form: String,
    columns: Vec<String>,
    time_column: String,
    time_unit: String,
    value_column: String,
    value_unit: String,
    first_lines: Vec<String>,
    comments: Vec<String>,
    samples: usize,
    sample_rate_hz: f64,
    start_s: f64,
    duration_s: f64,
    positive_peak: f64,
    negative_peak: f64,
    rms: f64,
    baseline_removed: f64,
    pretrigger_samples: usize,
    noise_rms: Option<f64>,
    noise_db_re_peak: Option<f64>,
    bandwidth_hz: Option<f64>,
    delay_s: f64,
    trigger_s: f64,
    drive_frequency_hz: Option<f64>,
    drive_frequency_from: &'static str,
    strongest_line_hz: Option<f64>,
    interpolated_cells: usize,
    assumptions: Vec<String>,
    warnings: Vec<String>,
}

impl Summary {
    /// `beside`: the drive frequency (Hz) of a horn-tip record beside it.
    pub fn of(record: &Record, beside: Option<f64>) -> Self {
        let values = &record.series.values;
        let peak = record.series.peak();
        let noise = (record.noise_source != NoiseSource::Unknown).then_some(record.noise_rms);
        let (drive_frequency_hz, drive_frequency_from) = match (record.stated_drive_frequency, record.kind, beside) {
            (Some(stated), ..) if record.options.drive_frequency.is_some() => (Some(stated), "--drive-frequency"),
            (Some(stated), ..) => (Some(stated), "the file's header"),
            (None, RecordKind::HornTip, _) => (record.drive_frequency(), "the record's strongest line"),
            (None, _, Some(beside)) => (Some(beside), "horn_tip.csv beside it"),
            (None, _, None) => (None, "unknown"),
        };
        let mut warnings = record.warnings.clone();
        if let Some(frequency) = drive_frequency_hz {
            let samples = record.series.sample_rate() / frequency;
            if samples < 20.0 {
                warnings.push(format!(
                    "{samples:.1} samples a drive cycle: lines above {:.1} f0 and the true height of short impulses are lost; \
                     20 or more are wanted",
                    0.4 * samples
                ));
            }
        }
        Self {
            file: record.path.display().to_string(),
            sha256: record.sha256.clone(),
            kind: record.kind,
            recorded: record.recorded,
            unit: record.kind.unit(),
            form: record.form.clone(),
            columns: record.columns.clone(),
            time_column: record.time_column.0.clone(),
            time_unit: record.time_column.1.clone(),
            value_column: record.value_column.0.clone(),
            value_unit: record.value_column.1.clone(),
            first_lines: record.first_lines.clone(),
            comments: record.comments.clone(),
            samples: values.len(),
            sample_rate_hz: record.series.sample_rate(),
            start_s: record.series.start,
            duration_s: record.series.end() - record.series.start,
            positive_peak: values.iter().copied().fold(0.0, f64::max),
            negative_peak: values.iter().copied().fold(0.0, f64::min),
            rms: (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt(),
            baseline_removed: record.baseline,
            pretrigger_samples: record.pretrigger,
            noise_rms: noise,
            noise_db_re_peak: noise.filter(|noise| *noise > 0.0 && peak > 0.0).map(|n| 20.0 * (n / peak).log10()),
            bandwidth_hz: record.bandwidth,
            delay_s: record.delay,
            trigger_s: record.trigger,
            drive_frequency_hz,
            drive_frequency_from,
            strongest_line_hz: record.strongest_line(),
            interpolated_cells: record.interpolated,
            assumptions: record.assumptions.clone(),
            warnings,
        }
    }
}

struct Text<'a> {
    record: &'a Record,
    summary: &'a Summary,
}

impl fmt::Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (record, summary) = (self.record, self.summary);
        let motion = record.kind.dimension();
        let recorded = match record.recorded {
            RecordedQuantity::Displacement => Dimension::LENGTH,
            RecordedQuantity::Velocity => Dimension::VELOCITY,
            RecordedQuantity::Pressure => Dimension::PRESSURE,
        };
        let hertz = |value| shown(value, Dimension::FREQUENCY);
        let row = |f: &mut fmt::Formatter<'_>, name: &str, text: String| writeln!(f, "  {name:<18}{text}");
        writeln!(f, "{}: a {} record", record.path.display(), record.kind.name())?;
        row(f, "sha-256", summary.sha256.clone())?;
        row(f, "form", summary.form.clone())?;
        row(f, "columns", summary.columns.join(", "))?;
        row(f, "time", format!("`{}` in {}", summary.time_column, summary.time_unit))?;
        let integrated = if motion == recorded { "" } else { ", integrated to a displacement" };
        row(f, "quantity", format!("`{}` in {}{integrated}", summary.value_column, summary.value_unit))?;
        let time = |value| shown(value, Dimension::TIME);
        let span = format!("{} to {}", time(summary.start_s), time(summary.start_s + summary.duration_s));
        row(
            f,
            "samples",
            format!("{} at {}, from {span}; the trigger is at 0", summary.samples, hertz(summary.sample_rate_hz)),
        )?;
        let peaks = format!("{} and {}", shown(summary.positive_peak, motion), shown(summary.negative_peak, motion));
        row(f, "peaks", peaks)?;
        row(f, "rms", shown(summary.rms, motion))?;
        row(f, "baseline removed", shown(summary.baseline_removed, recorded))?;
        row(f, "pre-trigger", format!("{} quiet samples", summary.pretrigger_samples))?;
        let mut noise =
            summary.noise_rms.map_or_else(|| "unknown".into(), |noise| format!("{} rms", shown(noise, motion)));
        if let Some(db) = summary.noise_db_re_peak {
            write!(noise, ", {db:.1} dB re peak")?;
        }
        row(f, "noise floor", noise)?;
        let unknown = || "unknown; pass --drive-frequency".to_owned();
        let digits = |value: f64| format!("{:.4} kHz", value / 1e3);
        let drive = summary
            .drive_frequency_hz
            .map_or_else(unknown, |value| format!("{} ({})", digits(value), summary.drive_frequency_from));
        row(f, "drive frequency", drive)?;
        row(f, "strongest line", summary.strongest_line_hz.map_or_else(|| "none".into(), digits))?;
        writeln!(f, "first lines")?;
        for line in &summary.first_lines {
            writeln!(f, "  | {line}")?;
        }
        for (title, lines) in
            [("comments", &summary.comments), ("assumed", &summary.assumptions), ("warnings", &summary.warnings)]
        {
            if !lines.is_empty() {
                writeln!(f, "{title}")?;
            }
            for line in lines {
                writeln!(f, "  {} {line}", if title == "comments" { '#' } else { '-' })?;
            }
        }
        Ok(())
    }
}

/// Say on standard error what looks wrong in a record.
pub fn warn(record: &Record, session: &Session) {
    for warning in &record.warnings {
        session.note(format_args!("warning: {}: {warning}", record.path.display()));
    }
}
