//! Reading a file into a [`Record`].

use std::{
    fs::{self, File},
    io::{self, Read as _},
    path::{Path, PathBuf},
};

use granchain_signal::{Dimension, InstrumentResponse, Quantity, Series, Unit, integral, mean_and_rms, sha256};

use super::{
    Baseline, MeasurementError, NoiseSource, ReadOptions, Record, RecordKind, RecordedQuantity, Sensitivity,
    baseline::{FEWEST_PERIODS, FEWEST_QUIET, plateau_mean, quiet_lead, without_drift},
    binary,
    column::{Column, is_of, is_peak_detect},
    encoding, estimate, header, line, mask,
    noise::{noise, noise_band, speckle},
    notes::{Notes, hertz, to_three_figures, written},
    place::SampleLines,
    quantisation::quantisation_step,
    record, sampling, table, universal,
};

/// Read a record of a known kind.
///
/// # Errors
/// [`MeasurementError`] with file, line and column.
pub fn read_record(path: &Path, kind: RecordKind, options: &ReadOptions) -> Result<Record, MeasurementError> {
    read_record_bytes(path, &read_file(path, refuse_early)?, Some(kind), options)
}

/// Reads a record and detects its kind from name and units: `horn`, `tip` or `drive` in the file name, or a
/// displacement and no velocity, mean a horn-tip record; `hydrophone` or `pressure`, or a pressure and no motion, a
/// hydrophone record.
///
/// # Errors
/// [`MeasurementError`] with file, line and column.
pub fn inspect_record(path: &Path, options: &ReadOptions) -> Result<Record, MeasurementError> {
    read_record_bytes(path, &read_file(path, refuse_early)?, None, options)
}

/// Header of the one column that names the horn tip in a table with another quantity; `None` if there is none or
/// several.
#[must_use]
pub fn horn_column(path: &Path, options: &ReadOptions) -> Option<String> {
    horn_column_of(path, read_head(path).ok()?.0, options)
}

/// The same of the first bytes of a file.
#[must_use]
pub fn horn_column_of(path: &Path, mut head: Vec<u8>, options: &ReadOptions) -> Option<String> {
    let end = head.iter().rposition(|byte| matches!(byte, b'\n' | b'\r'))?;
    head.truncate(end + 1);
    if universal::is_universal(&head) || binary::is_binary(path, &head) {
        return None;
    }
    let columns = table::columns(path, &head, options).ok()?;
    let of_horn = |column: &&Column| is_of(&column.header, RecordKind::HornTip);
    let mut named = columns.iter().filter(of_horn);
    let (only, further) = (named.next()?, named.next());
    // Time, the horn, and what it moved.
    (further.is_none() && columns.iter().filter(|column| !column.header.is_empty()).count() > 2)
        .then(|| only.header.clone())
}

/// The first MiB of a file (longer than any header) and the open file.
///
/// # Errors
/// When it cannot be opened or read.
pub fn read_head(path: &Path) -> io::Result<(Vec<u8>, File)> {
    let mut file = File::open(path)?;
    let mut head = Vec::with_capacity(1 << 20);
    file.by_ref().take(1 << 20).read_to_end(&mut head)?;
    Ok((head, file))
}

/// Why a file with these first bytes is not a record.
fn refuse_early(path: &Path, head: &[u8]) -> Result<(), MeasurementError> {
    refuse_polytec_binary(path)?;
    encoding::refuse_early(path, head)
}

/// The bytes of a file, or why it cannot be read; reading stops if the first bytes are refused.
pub(super) fn read_file(
    path: &Path,
    refused: impl Fn(&Path, &[u8]) -> Result<(), MeasurementError>,
) -> Result<Vec<u8>, MeasurementError> {
    if path.is_dir() {
        return Err(MeasurementError::Folder { path: path.into(), files: csv_files(path) });
    }
    let unread = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => MeasurementError::NotFound { path: path.into(), nearest: nearest(path) },
        _ => MeasurementError::Io { path: path.into(), source },
    };
    let (mut bytes, mut file) = read_head(path).map_err(unread)?;
    refused(path, &bytes)?;
    let length = file.metadata().map_or(0, |metadata| metadata.len() as usize);
    bytes.reserve_exact(length.saturating_sub(bytes.len()));
    file.read_to_end(&mut bytes).map_err(unread)?;
    Ok(bytes)
}

fn folder_of(path: &Path) -> PathBuf {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).map_or_else(|| PathBuf::from("."), Path::to_path_buf)
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<_> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn csv_files(folder: &Path) -> Vec<String> {
    names_in(folder).into_iter().filter(|name| name.to_lowercase().ends_with(".csv")).take(5).collect()
}

fn nearest(path: &Path) -> Option<String> {
    let wanted = path.file_name()?.to_string_lossy().to_lowercase();
    names_in(&folder_of(path))
        .into_iter()
        .map(|name| (strsim::jaro_winkler(&name.to_lowercase(), &wanted), name))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name)
}

/// Reads a record from bytes in memory; `path` names them in messages. Without a kind, it is detected from name and
/// units.
///
/// # Errors
/// [`MeasurementError`] with file, line and column.
pub fn read_record_bytes(
    path: &Path,
    bytes: &[u8],
    kind: Option<RecordKind>,
    options: &ReadOptions,
) -> Result<Record, MeasurementError> {
    refuse_polytec_binary(path)?;
    let (mut table, kind) = table::read(path, bytes, kind, options)?;
    let sampled = sampling::even_series(path, &mut table, options.resample)?;
    let stated = header::stated(&table.comments);
    let mut notes = Notes::default();
    let instrument = table.form.preamble().is_some();
    for comment in stated.puzzling.iter().filter(|_| !instrument) {
        notes.warn(format!(
            "the comment `{comment}` was not understood and is ignored; write it as `# bandwidth: 1.5 MHz`"
        ));
    }
    notes.about_table(&table, options);
    notes.about_sampling(&sampled);
    let mut raw = sampled.series;
    if let Some(column) = table.columns.iter().find(|column| is_peak_detect(column)) {
        notes.assume(format!("`{}` (extremes between samples, mode Peak Detect) is passed over", column.header));
    }
    let (start, step) = (raw.start, raw.step);
    (table.times, table.lines) = (Vec::new(), SampleLines::default());
    let recorded = match table.chosen.value_unit.dimension {
        Dimension::LENGTH => RecordedQuantity::Displacement,
        Dimension::PRESSURE => RecordedQuantity::Pressure,
        _ => RecordedQuantity::Velocity,
    };

    // The trigger.
    let trigger = match (options.trigger, stated.trigger, stated.pretrigger) {
        (Some(flag), ..) => notes.take("t = 0 is the trigger at", flag, "trigger"),
        (None, Some(header), _) => notes.take("t = 0 is the trigger at", header, "the header"),
        // An axis that has negative times already counts from the trigger.
        (None, None, Some(before)) if start >= 0.0 => {
            notes.take("t = 0 is the trigger at", start + before, "the header's pre-trigger")
        }
        _ => {
            notes.assume("t = 0 of the file's own time axis is the trigger".into());
            0.0
        }
    };
    let delay = match (options.delay, stated.delay) {
        (Some(flag), _) => notes.take("instrument delay removed:", flag, "delay"),
        (None, Some(header)) => notes.take("instrument delay removed:", header, "the header"),
        (None, None) => {
            notes.assume("instrument delay: not stated; taken as 0".into());
            0.0
        }
    };
    let bandwidth = options.bandwidth.or(stated.bandwidth);
    let stated_drive_frequency = options.drive_frequency.or(stated.drive_frequency);
    check_stated(path, "bandwidth", (options.bandwidth, stated.bandwidth), (f64::MIN_POSITIVE, f64::INFINITY))?;
    check_stated(path, "drive frequency", (options.drive_frequency, stated.drive_frequency), DRIVE_FREQUENCIES)?;
    if let Some(frequency) = stated_drive_frequency {
        record::check_sampling(path, raw.sample_rate(), frequency)?;
    }
    let of_instrument = table.form.preamble().and_then(|preamble| header::averaged(&preamble.statements));
    let averages = options.averages.or(stated.averages).or(of_instrument.flatten()).unwrap_or(1).max(1);
    if of_instrument == Some(None) && averages == 1 && options.averages.is_none() {
        notes.warn(
            "the instrument says that the record is an average, not of how many shots: state it with --read averages=N"
                .into(),
        );
    }
    if averages > 1 {
        let from = if options.averages.is_some() { "averages" } else { "the header" };
        notes.assume(format!("the mean of {averages} shots ({from}): compared with means of as many runs"));
    }
    match (options.bandwidth, stated.bandwidth) {
        (Some(flag), _) => notes.assume(format!("instrument bandwidth {} (--read bandwidth=…)", hertz(flag))),
        (None, Some(header)) => notes.assume(format!("instrument bandwidth {} (the header)", hertz(header))),
        (None, None) => {
            notes.assume("instrument bandwidth: not stated; assumed higher than half the sample rate".into())
        }
    }
    if let Some(response) = &options.response {
        notes.assume(match (kind, response, bandwidth) {
            (RecordKind::HornTip, ..) => return Err(MeasurementError::ResponseOfHorn { path: path.into() }),
            (_, InstrumentResponse::Filter(_), None) => {
                return Err(MeasurementError::ResponseWithoutBandwidth { path: path.into(), filter: response.to_string() });
            }
            (_, InstrumentResponse::Filter(_), Some(at)) => {
                format!("instrument: {response}, −3 dB at {}, applied to every run (response)", hertz(at))
            }
            (_, InstrumentResponse::Table(table), _) => format!(
                "instrument: frequency response of {}, relative to the drive frequency, applied to every run (response)",
                table.in_words()
            ),
        });
    }

    // Rounded to nothing where the axis is meant to hold the trigger.
    let before_trigger = raw.values.len().min((((trigger - start) / step) - 1e-6).ceil().max(0.0) as usize);
    let line_of_raw = || stated_drive_frequency.or_else(|| line::strongest_line(&raw));
    let quantisation_step = quantisation_step(&raw.values);
    let found = mask::found(&options.mask, (&raw, kind), line_of_raw);
    let mut masked = mask::apply(&mut raw, &found);
    masked.iter_mut().for_each(|masked| masked.gap = masked.gap.later(-trigger - delay));
    let share = masked.iter().map(|masked| masked.samples).sum::<usize>() as f64 / raw.len() as f64;
    if share > mask::MOST {
        let found = mask::in_words(&masked);
        return Err(MeasurementError::Masked { path: path.into(), share, allowed: mask::MOST, found });
    }
    notes.about_mask(&masked);
    let likely = stated_drive_frequency.or_else(|| line::strongest_line(&raw));
    let pretrigger = quiet_lead(&raw.values, before_trigger, likely.map(|frequency| 1.0 / (frequency * step)));
    if before_trigger >= FEWEST_QUIET && pretrigger == 0 {
        notes.warn(format!(
            "the {before_trigger} samples before the trigger are not quiet, so they give neither baseline nor noise; check \
             the instant of the trigger (--read trigger=TIME)"
        ));
    } else if before_trigger == 0 && pretrigger > 0 {
        notes.assume(format!("no samples before the trigger; the first {pretrigger} are quiet and are taken as such"));
    } else if pretrigger < before_trigger && pretrigger > 0 {
        notes.assume(format!(
            "motion begins before the trigger; the first {pretrigger} of the {before_trigger} samples before it are quiet and are taken as such"
        ));
    }

    let frequency = || {
        record::check_motion(path, &raw, recorded)?;
        likely.ok_or_else(|| MeasurementError::NoDriveFrequency { path: path.into() })
    };
    let (quiet_mean, quiet_rms) = mean_and_rms(&raw.values[..pretrigger]);
    // Of independent samples with the noise of the quiet ones; the weights of a Hann window count for two thirds of their number.
    let standard_error = |samples: f64| (pretrigger >= FEWEST_QUIET).then(|| quiet_rms / samples.sqrt());
    let mut baseline_error = None;
    let baseline = match options.baseline {
        Baseline::Auto if pretrigger >= FEWEST_QUIET => {
            notes.assume(format!("baseline: mean of {pretrigger} quiet samples at the start"));
            baseline_error = standard_error(pretrigger as f64);
            quiet_mean
        }
        Baseline::Auto => {
            notes.assume("baseline: none removed (fewer than 8 quiet samples at the start)".into());
            0.0
        }
        Baseline::Pretrigger if pretrigger >= FEWEST_QUIET => {
            notes.assume(format!("baseline: mean of {pretrigger} quiet samples at the start (baseline=pretrigger)"));
            baseline_error = standard_error(pretrigger as f64);
            quiet_mean
        }
        Baseline::Pretrigger => {
            return Err(MeasurementError::NoPretrigger { path: path.into(), needed: FEWEST_QUIET, found: pretrigger });
        }
        Baseline::Mean => {
            notes.assume("baseline: mean of the whole record (baseline=mean)".into());
            mean_and_rms(&raw.values).0
        }
        Baseline::Plateau => match plateau_mean(&raw, frequency()?) {
            Ok((mean, periods)) => {
                baseline_error = standard_error(periods as f64 / (frequency()? * raw.step) / 1.5);
                notes.assume(format!("baseline: Hann-weighted mean over {periods} drive periods of the plateau"));
                mean
            }
            Err(found) => {
                return Err(MeasurementError::NoPlateau { path: path.into(), needed: FEWEST_PERIODS, found });
            }
        },
        Baseline::None => {
            notes.assume("baseline: none removed (baseline=none)".into());
            0.0
        }
    };
    let peak = raw.values.iter().map(|value| (value - baseline).abs()).fold(0.0, f64::max);
    notes.about_plausibility(table.chosen.value_unit.dimension, peak);
    let sign = if options.invert { -1.0 } else { 1.0 };
    let positive = match kind {
        RecordKind::Hydrophone => "above the ambient pressure",
        RecordKind::HornTip | RecordKind::Vibrometer => "from piston to support",
    };
    notes.assume(if options.invert {
        format!("sign turned (invert): the file's negative is positive, {positive}")
    } else {
        format!("sign as in the file: positive {positive}")
    });

    let mut series = raw.map(|x| sign * (x - baseline));
    if kind == RecordKind::HornTip && recorded == RecordedQuantity::Velocity {
        let frequency = frequency()?;
        series = integral(&series);
        series = without_drift(&series, frequency);
        notes.assume(format!(
            "displacement: velocity integrated (sixth order), drift removed as the Hann-weighted running mean over eight \
             periods of {:.4} kHz",
            frequency / 1e3
        ));
    }
    series.start = start - trigger - delay;
    refuse_absurd(path, (&raw, &series), table.chosen.volts, kind)?;
    let (recorded_noise_rms, noise_source) = noise(&raw, pretrigger, quantisation_step, bandwidth);
    let integrated = kind == RecordKind::HornTip && recorded == RecordedQuantity::Velocity;
    let noise_rms = match noise_source {
        _ if !integrated => recorded_noise_rms,
        NoiseSource::Quiet => mean_and_rms(&series.values[..pretrigger]).1,
        // White noise of a velocity, integrated, above what is taken for drift.
        _ => {
            let density = recorded_noise_rms.powi(2) / noise_band(raw.sample_rate(), bandwidth);
            (density / (estimate::DRIFT * frequency()?)).sqrt() / (2.0 * std::f64::consts::PI)
        }
    };
    let speckle = match (kind, recorded) {
        (RecordKind::Vibrometer, RecordedQuantity::Velocity) => speckle(&raw, baseline, quantisation_step),
        _ => 0.0,
    };
    if speckle > 0.0 {
        notes.assume(format!(
            "noise grows with velocity as that of speckle: besides, {:.1} % of the velocity",
            100.0 * speckle
        ));
    }
    notes.about_noise_source(recorded, recorded_noise_rms, noise_source, quantisation_step);
    let mut clipped = notes.about_clipping(&raw, None).map(|limit| Some(sign * (limit? - baseline)));
    if options.invert {
        clipped.reverse();
    }
    match kind {
        RecordKind::HornTip => notes.about_noise(&series, noise_rms),
        RecordKind::Vibrometer | RecordKind::Hydrophone => notes.about_loud_noise(&series, noise_rms),
    }
    notes.about_time(stated_drive_frequency, likely, raw.len() as f64 * raw.step, kind);
    // The strongest line of a bead may be a subharmonic.
    let strongest = || likely.filter(|_| kind == RecordKind::HornTip);
    if let Some(frequency) = stated_drive_frequency.or_else(strongest) {
        notes.about_drift(&series, frequency, kind);
    }
    notes.about_range(path, &raw, &table, options)?;
    notes.about_decimation(&raw, &table, bandwidth);
    raw.start = start;

    let name_and_unit = |i: usize| {
        let column = &table.columns[i];
        (column.header.clone(), column.unit_text.clone().unwrap_or_default())
    };
    let mut statements = table.form.preamble().map(|preamble| preamble.statements.clone()).unwrap_or_default();
    statements.append(&mut table.comments);
    let record = Record {
        path: path.into(),
        sha256: sha256(bytes),
        kind,
        recorded,
        series,
        raw,
        averages,
        masked,
        noise_rms,
        noise_source,
        recorded_noise_rms,
        speckle,
        quantisation_step,
        clipped,
        pretrigger,
        baseline,
        baseline_error: baseline_error
            .filter(|_| kind != RecordKind::HornTip || recorded == RecordedQuantity::Displacement),
        bandwidth,
        response: options.response.clone(),
        delay,
        trigger,
        stated_drive_frequency,
        columns: table.columns.iter().map(|column| column.header.clone()).collect(),
        form: written(&table),
        time_column: table.chosen.time.map_or_else(|| ("none".into(), "s".into()), name_and_unit),
        value_column: name_and_unit(table.chosen.value),
        first_lines: table.first_lines,
        comments: statements,
        interpolated: table.bridged,
        assumptions: notes.assumptions,
        warnings: notes.warnings,
        options: options.clone(),
    };
    if let Some(frequency) = record.drive_frequency() {
        record.check_sampling(frequency)?;
        if kind == RecordKind::HornTip {
            record.check_cycles(frequency)?;
        }
    }
    if kind == RecordKind::HornTip && !options.force_frequency {
        record.check_stated_frequency(|| Some(header::drive_frequency_line(&String::from_utf8_lossy(bytes))?.0))?;
    }
    Ok(record)
}

/// Drive frequencies of a scene, Hz.
const DRIVE_FREQUENCIES: (f64, f64) = (1.0, 1e8);

/// Refuses a frequency stated by an option or the header (the option wins) outside `low` to `high`, Hz.
fn check_stated(
    path: &Path,
    key: &'static str,
    (option, header): (Option<f64>, Option<f64>),
    (low, high): (f64, f64),
) -> Result<(), MeasurementError> {
    let Some(found) = option.or(header).filter(|found| !(low..=high).contains(found)) else { return Ok(()) };
    let place = if option.is_some() { "an option" } else { "the file's header" };
    let expected = if high.is_finite() { "1 Hz to 0.1 GHz" } else { "a frequency above 0" };
    let found = Quantity::new(found, Dimension::FREQUENCY);
    Err(MeasurementError::Unlikely { path: path.into(), key, found, place, expected })
}

/// Smallest and largest plausible peak of a hydrophone record, Pa: below thermal noise, and far above the strongest
/// shock waves of lithotripters (100 MPa).
const PRESSURES: (f64, f64) = (1e-3, 1e9);
/// Smallest and largest peak at the input of an instrument, V: beyond both, bytes are something else.
const INPUTS: (f64, f64) = (1e-12, 1e6);

fn refuse_absurd(
    path: &Path,
    (raw, series): (&Series, &Series),
    volts: Option<(Unit, Sensitivity)>,
    kind: RecordKind,
) -> Result<(), MeasurementError> {
    let refuse = |peak: f64, dimension, (low, high): (f64, f64), of: &str, from: String, remedy| {
        if peak == 0.0 || (low..=high).contains(&peak) {
            return Ok(());
        }
        let [low, high] = [low, high].map(|limit| Quantity::new(limit, dimension));
        let expected = format!("{of} between {low} and {high}");
        Err(MeasurementError::AbsurdPeak {
            path: path.into(),
            expected,
            peak: to_three_figures(peak, dimension),
            from,
            remedy,
        })
    };
    if let Some((volts, scale)) = volts {
        let from = format!("by its unit: volts of the file × {}", volts.factor);
        let remedy = "its numbers are no volts: name another channel or its unit (--unit), or export it as CSV";
        refuse(raw.peak() / scale.per_volt(), Dimension::VOLTAGE, INPUTS, "at an input", from, remedy)?;
    }
    if kind == RecordKind::Hydrophone {
        let from = match volts {
            Some((volts, scale)) => format!("volts of the file × {} at {scale}", volts.factor),
            None => "by the unit of its column".to_owned(),
        };
        let remedy = "correct the unit or the sensitivity: hydrophones have 1 nV/Pa to 10 mV/Pa, with their amplifier";
        refuse(series.peak(), Dimension::PRESSURE, PRESSURES, "of a hydrophone's record", from, remedy)?;
    }
    Ok(())
}

/// Refuses Polytec's binary format, recognised by its extension.
fn refuse_polytec_binary(path: &Path) -> Result<(), MeasurementError> {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_lowercase();
    if ["svd", "pvd"].contains(&extension.as_str()) {
        return Err(MeasurementError::PolytecBinary { path: path.into(), extension: format!(".{extension}") });
    }
    Ok(())
}
