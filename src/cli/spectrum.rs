//! `granchain spectrum FILE`: lines, peaks and bandwidth of one trace, recorded or simulated.

use std::{
    io::BufRead as _,
    path::{Path, PathBuf},
};

use anyhow::Context;
use clap::Args;
use serde::Serialize;

use super::{
    Outcome,
    arguments::{OutputArguments, Session, drive_frequency, one_of, time, usage},
    inspect::{self, KINDS, warn},
    output::{OutputFolder, aligned},
    reading::{DriveReadArguments, DriveUnread, ReadArguments},
    summary,
};
use crate::{
    feature::{FeatureSettings, Features, Window, amplitude_spectrum, measure, refine_frequency, strongest_frequency},
    measurement::{Baseline, ReadOptions, Record, RecordKind, read_head, read_record},
    report::{
        number::{self, engineering, fixed, significant},
        spectrum as page,
    },
    signal::Series,
};

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain spectrum vib.csv --drive horn_tip.csv --out spectrum")]
pub struct Arguments {
    /// A vibrometer or horn-tip record, or a response.csv of a replay (its pole velocity)
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// Kind of record [default: from the file's name and units]
    #[arg(long, value_parser = one_of(&KINDS))]
    pub kind: Option<RecordKind>,
    /// Drive frequency with its unit, such as 73kHz [default: refined from the drive record, else the file's header, else
    /// the strongest line]
    #[arg(long, value_name = "QUANTITY", value_parser = drive_frequency)]
    pub drive_frequency: Option<f64>,
    /// Horn-tip record of the drive [default: piston column of a response, else horn_tip.csv beside FILE]
    #[arg(long, value_name = "FILE")]
    pub drive: Option<PathBuf>,
    /// Start of the analysis window after the trigger, such as 50us [default: where the drive's envelope exceeds half its peak]
    #[arg(long, value_name = "QUANTITY", value_parser = time, allow_hyphen_values = true)]
    pub from: Option<f64>,
    /// End of the analysis window after the trigger, such as 550us
    #[arg(long, value_name = "QUANTITY", value_parser = time, allow_hyphen_values = true)]
    pub to: Option<f64>,
    #[command(flatten)]
    pub reading: ReadArguments,
    #[command(flatten)]
    pub drive_reading: DriveReadArguments,
    #[command(flatten)]
    pub output: OutputArguments,
}

/// Columns of a `response.csv` of ours.
const POLE: &str = "pole_velocity_m_per_s";
const PISTON: &str = "piston_displacement_m";

/// The JSON form: the features, and where frequency and window came from.
#[derive(Debug, Serialize)]
pub struct Summary {
    pub file: String,
    pub sha256: String,
    /// What the record is of.
    pub quantity: &'static str,
    pub drive_frequency_from: String,
    pub window_from: String,
    #[serde(flatten)]
    pub features: Features,
    /// What was assumed on reading.
    pub assumptions: Vec<String>,
}

impl Summary {
    /// A record measured over the window of `drive`, at `frequency` (Hz) where that is stated, with its noise; ends of the window (s) where they
    /// are stated.
    pub fn of(
        record: &Record,
        drive: Option<&Drive>,
        frequency: Option<f64>,
        span: (Option<f64>, Option<f64>),
        noise_rms: f64,
        session: &Session,
    ) -> anyhow::Result<Self> {
        let (frequency, drive_frequency_from) = drive_line(record, drive, frequency, session)?;
        record.check_sampling(frequency)?;
        let (window, window_from) = window(record, drive, frequency, span)?;
        let settings = FeatureSettings {
            drive_frequency: frequency,
            window: Some(window),
            noise_rms,
            noise_bandwidth: record.bandwidth,
            band: None,
            unit: record.kind.unit().to_owned(),
        };
        let file = record.path.display();
        let features = measure(&record.series, &settings).with_context(|| format!("{file}: nothing to measure"))?;
        Ok(Self {
            file: file.to_string(),
            sha256: record.sha256.clone(),
            quantity: record.kind.quantity(),
            drive_frequency_from,
            window_from,
            features,
            assumptions: record.assumptions.clone(),
        })
    }
}

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let Arguments { file, kind, drive_frequency, drive, from, to, reading, drive_reading, output } = arguments;
    if let (Some(from), Some(to)) = (from, to)
        && from >= to
    {
        return Err(usage(format!("--from {} must come before --to {}", number::time(from), number::time(to))));
    }
    let options = reading.options_of_any(kind, drive_frequency)?;
    let folder = output.stage(&["spectrum.csv"])?;
    let ours = is_response(&file);
    let record = if ours {
        // A simulation has neither an offset nor noise, and its free flights are no clipping.
        let column = options.column.clone().or_else(|| Some(POLE.to_owned()));
        let options = ReadOptions { column, baseline: Baseline::None, ..options.clone() };
        read_record(&file, RecordKind::Vibrometer, &options).context("the response cannot be used")?
    } else {
        let record = inspect::read(&file, kind, &options).context("the record cannot be used")?;
        warn(&record, session);
        record
    };
    // A drive that says otherwise is warned of; here it only says the window.
    let of_drive = reading
        .filled(RecordKind::HornTip, ReadOptions { force_frequency: true, ..drive_reading.options(drive_frequency) })?;
    let drive = drive.or_else(|| drive_reading.options(None).column.is_some().then(|| file.clone()));
    let of_drive = if drive.as_ref() == Some(&file) { of_drive.of_same_file(&options) } else { of_drive };
    let drive = Drive::find(&file, &record, ours, drive, &of_drive, session)?;
    let noise_rms = if ours { 0.0 } else { record.noise_rms };
    let summary = Summary::of(&record, drive.as_ref(), drive_frequency, (from, to), noise_rms, session)?;
    if let Some(folder) = folder {
        let place = write(folder, &record.series, &summary)?;
        session.note(format_args!("written to {}", place.display()));
    }
    session.result(text(&summary), &summary)?;
    Ok(Outcome::Done)
}

/// Whether the first line that is no comment names the columns of our `response.csv`.
fn is_response(path: &Path) -> bool {
    // The reader reports a file that cannot be opened.
    let Ok((head, _)) = read_head(path) else { return false };
    let mut lines = head.lines().map_while(Result::ok);
    let header = lines.find(|line| !line.trim_start().starts_with('#') && !line.trim().is_empty());
    header.is_some_and(|header| {
        let mut columns = header.split(',').map(str::trim);
        columns.clone().any(|column| column == POLE) && columns.any(|column| column == PISTON)
    })
}

/// The drive's displacement and where it came from.
pub struct Drive {
    displacement: Series,
    frequency: Option<f64>,
    named: String,
}

impl Drive {
    /// A horn tip as read, and what it is called.
    pub fn of(horn: Record, named: String) -> Self {
        Self { frequency: horn.drive_frequency(), displacement: horn.series, named }
    }

    fn find(
        file: &Path,
        record: &Record,
        ours: bool,
        given: Option<PathBuf>,
        options: &ReadOptions,
        session: &Session,
    ) -> anyhow::Result<Option<Self>> {
        let read = |path: &Path, options: &ReadOptions, named: String| -> anyhow::Result<Option<Self>> {
            let horn = read_record(path, RecordKind::HornTip, options).map_err(DriveUnread)?;
            warn(&horn, session);
            Ok(Some(Self::of(horn, named)))
        };
        if let Some(path) = given {
            return read(&path, options, path.display().to_string());
        }
        if ours {
            let options = ReadOptions { column: Some(PISTON.to_owned()), baseline: Baseline::None, ..options.clone() };
            let piston = read_record(file, RecordKind::HornTip, &options)?;
            return Ok(Some(Self::of(piston, "the response's own piston".to_owned())));
        }
        if record.kind == RecordKind::HornTip {
            return Ok(Some(Self::of(record.clone(), "the record".to_owned())));
        }
        let beside = file.parent().unwrap_or(Path::new("")).join("horn_tip.csv");
        if beside.is_file() {
            return read(&beside, options, "horn_tip.csv beside it".to_owned());
        }
        Ok(None)
    }
}

/// f0 in Hz and where it was taken from.
fn drive_line(
    record: &Record,
    drive: Option<&Drive>,
    stated: Option<f64>,
    session: &Session,
) -> anyhow::Result<(f64, String)> {
    let refined = drive.and_then(|drive| {
        let guess = stated.or(drive.frequency)?;
        Some((refine_frequency(&drive.displacement, guess).ok()?, drive))
    });
    match (stated, refined, record.stated_drive_frequency) {
        (Some(stated), refined, _) => {
            // 5e-4 of f0 is 0.16 bins at the eighth harmonic of a 40-period window: read 2 % low.
            if let Some((refined, drive)) = refined.filter(|(refined, _)| (refined / stated - 1.0).abs() > 5e-4) {
                session.note(format_args!(
                    "warning: {} shows its line at {:.4} kHz, not at the {:.4} kHz of --drive-frequency; harmonics are read \
                     beside their tops; leave the flag out to use the record's",
                    drive.named,
                    1e-3 * refined,
                    1e-3 * stated
                ));
            }
            Ok((stated, "--drive-frequency".to_owned()))
        }
        (None, Some((refined, drive)), _) => Ok((refined, format!("refined from {}", drive.named))),
        (None, None, Some(stated)) => Ok((stated, "the file's header".to_owned())),
        (None, None, None) => {
            let strongest = strongest_frequency(&record.series, Window::whole(&record.series))
                .with_context(|| format!("{}: no drive frequency", record.path.display()))?;
            session.note(format_args!(
                "warning: no drive record and no --drive-frequency: the strongest line, {:.4} kHz, is taken for the drive's; a \
                 subharmonic may be stronger than it",
                1e-3 * strongest
            ));
            Ok((strongest, "assumed: the record's strongest line".to_owned()))
        }
    }
}

/// The analysis window and where it was taken from.
fn window(
    record: &Record,
    drive: Option<&Drive>,
    frequency: f64,
    (from, to): (Option<f64>, Option<f64>),
) -> anyhow::Result<(Window, String)> {
    let (window, mut origin) = match (from, to, drive) {
        (Some(from), Some(to), _) => return Ok((Window::new(from, to), "--from, --to".to_owned())),
        (_, _, Some(drive)) => {
            let window = Window::of_drive(&drive.displacement, frequency)
                .with_context(|| format!("{}: no analysis window", drive.named))?;
            (window, format!("half the peak envelope of {}", drive.named))
        }
        (_, _, None) => {
            let window = Window::of_trace(&record.series, frequency)
                .with_context(|| format!("{}: no analysis window", record.path.display()))?;
            (window, "assumed: where the record's own rms exceeds 0.7 of its largest".to_owned())
        }
    };
    for (flag, given) in [("--from", from), ("--to", to)] {
        if given.is_some() {
            origin.push_str(", ");
            origin.push_str(flag);
        }
    }
    Ok((window.overridden(from, to), origin))
}

fn write(folder: OutputFolder, series: &Series, summary: &Summary) -> anyhow::Result<PathBuf> {
    let spectrum = amplitude_spectrum(series, summary.features.window)?;
    folder.write("spectrum.csv", page::csv(&spectrum, &summary.features))?;
    folder.write("summary.json", summary::json(summary)?)?;
    let page = page::SpectrumPage {
        file: &summary.file,
        quantity: summary.quantity,
        facts: facts(summary),
        series,
        spectrum: &spectrum,
        features: &summary.features,
        assumptions: summary.assumptions.clone(),
    };
    folder.write_all(page.files()?)?;
    Ok(folder.finish()?)
}

/// Unit in which amplitudes are shown, and its number over the SI's.
fn shown_unit(features: &Features) -> (f64, &'static str) {
    match features.unit.as_str() {
        "m" => (1e6, "µm"),
        "Pa" if features.peaks.positive.max(-features.peaks.negative) >= 1e3 => (1e-3, "kPa"),
        "Pa" => (1.0, "Pa"),
        _ => (1e3, "mm/s"),
    }
}

/// What was measured, line by line: name and value.
fn facts(summary: &Summary) -> Vec<(String, String)> {
    let Summary { drive_frequency_from, window_from, features, .. } = summary;
    let (factor, unit) = shown_unit(features);
    let mut facts = Vec::new();
    let mut row = |name: &str, text: String| facts.push((name.to_owned(), text));
    let amplitude = |value: f64| significant(factor * value, 4);
    let frequency = features.drive_frequency_hz;
    row("drive frequency", format!("{} kHz ({drive_frequency_from})", fixed(1e-3 * frequency, 4)));
    let window = features.window;
    let span = format!("{} to {} µs", fixed(1e6 * window.from, 2), fixed(1e6 * window.to, 2));
    let periods = fixed(window.duration() * frequency, 1);
    row("window", format!("{span}, {periods} drive periods ({window_from})"));
    let peaks = &features.peaks;
    let raw = if features.noise_rms > 0.0 {
        format!(", noise bias removed (raw {} and {})", amplitude(peaks.raw_positive), amplitude(peaks.raw_negative))
    } else {
        String::new()
    };
    row("peaks", format!("{} and {} {unit}{raw}", amplitude(peaks.positive), amplitude(peaks.negative)));
    row("rms", format!("{} {unit}", amplitude(features.rms)));
    row("distortion", format!("{} (rms of the drive's harmonics / Hann-weighted rms)", fixed(features.thd, 4)));
    let edge = |edge: Option<f64>| edge.map_or_else(|| "none".to_owned(), |hertz| engineering(hertz, "Hz", 4));
    let (six, twenty) = (edge(features.bandwidth_hz), edge(features.bandwidth_20db_hz));
    row("bandwidth", format!("{six} at −6 dB, {twenty} at −20 dB re the drive line"));
    let train = features.repetition.map_or_else(
        || "fewer than two impulses above half the positive peak".to_owned(),
        |train| {
            let (interval, spread) = (fixed(train.mean_interval_periods, 2), fixed(100.0 * train.irregularity, 1));
            format!("{} impulses, spaced {interval} drive periods ± {spread} %", train.impulses)
        },
    );
    row("repetition", train);
    let floor = features.noise_floor.map_or_else(
        || "window too short to tell it from the lines".to_owned(),
        |floor| format!("{} {unit} (median of the spectrum)", amplitude(floor)),
    );
    row("noise floor", floor);
    facts
}

fn text(summary: &Summary) -> String {
    let Summary { file, quantity, features, .. } = summary;
    let facts: String = facts(summary).iter().map(|(name, text)| format!("  {name:<18}{text}\n")).collect();
    let lines = aligned(&page::lines_table(features, shown_unit(features)));
    format!("{file}: spectrum of the {quantity}\n{facts}\n{lines}")
}
