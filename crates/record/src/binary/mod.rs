//! Instruments' and programs' own files, recognised by their first bytes.
//!
//! | file | recognised by | source of the layout |
//! |---|---|---|
//! | NumPy `.npy`, `.npz` | `\x93NUMPY`; a zip archive of such | NumPy Enhancement Proposal 1 |
//! | MATLAB `.mat`, versions 4 to 7 | `MATLAB 5.0`; header and name of a matrix | MathWorks, *MAT-File Format* |
//! | NI TDMS | `TDSm` | National Instruments, *TDMS File Format Internal Structure* |
//! | LeCroy, Teledyne `.trc` | `WAVEDESC` | LeCroy, template `LECROY_2_3` |
//! | Tektronix `.isf` | `:WFMP`, `:WFMO` | Tektronix, programmer manuals, `WFMOutpre` |
//! | Tektronix `.wfm` | `:WFM#00` behind the order of bytes | Tektronix, *Reference Waveform File Format* |
//! | Keysight, Agilent, Rigol `.bin` | `AG` or `RG` and two digits | Keysight, *InfiniiVision Binary Waveform File Format* |
//! | Rigol `.wfm` | `\xa5\xa5`, a series | files beside their CSV, and `RigolWFM` (Prahl), descriptions |
//! | Rohde & Schwarz RTO, RTP | `.bin` in XML beside `.Wfm.bin` | R&S, *RTP User Manual*, waveform export |
//! | HDF5, MATLAB 7.3 | `\x89HDF`, `MATLAB 7.3` | read by `hdf5-pure` |
//! | Siglent `.bin` | switches and scales of its channels; versions 2 to 4 are read | Siglent, *How to Extract Data from the Binary File* |
//! | WAV, RF64, BW64 | `RIFF`, `RIFX`, `RF64`, `BW64` | Microsoft; EBU Tech 3306; ITU-R BS.2088 |

mod bytes;
mod hdf5;
mod keysight;
mod lecroy;
mod matlab;
mod numpy;
mod rigol;
mod rohde_schwarz;
mod siglent;
mod tdms;
mod tektronix;
mod wav;

use std::path::Path;

use granchain_signal::number;

use super::{
    MeasurementError, Place, ReadOptions, RecordKind,
    column::Column,
    place::SampleLines,
    remedy::choose_or_propose,
    samples::{self, OVER_RANGE},
    sampling,
    table::{Form, Table, guess_kind},
    time_column,
    universal::UniversalText,
};

/// Most channels of a file that are listed.
const MOST_CHANNELS: usize = 1000;
/// Most bytes that a file may unpack to, over its own length; most groups or structures within each other.
const MOST_UNPACKED: usize = 200;
const DEEPEST: usize = 6;
const SPECTRUM: &str = "expected samples in time, found a spectrum; save the record itself";

/// A recorded channel.
#[derive(Debug, Clone, PartialEq, Default)]
struct Channel {
    name: String,
    /// As the file states it; empty if it does not.
    unit: String,
    /// First instant and step, s, if the file states them.
    grid: Option<(f64, f64)>,
    values: Vec<f64>,
}

/// Content of a file.
#[derive(Debug, Clone, PartialEq, Default)]
struct Contents {
    /// Description of the file, such as `LeCroy WaveRunner (.trc)`.
    written: String,
    channels: Vec<Channel>,
    /// Statements such as `averages: 16`.
    comments: Vec<String>,
    assumptions: Vec<String>,
}

type Reader = fn(&Path, &[u8], &ReadOptions) -> Result<Contents, String>;

/// The reader of a file with these first bytes.
fn reader(path: &Path, head: &[u8]) -> Option<Reader> {
    let within = |word: &[u8]| head[..head.len().min(64)].windows(word.len()).any(|part| part == word);
    Some(match head {
        [b'T', b'D', b'S', b'm', ..] => tdms::read,
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => numpy::read_array,
        [b'P', b'K', 3, 4, ..] if numpy::is_archive(head) => numpy::read_archive,
        _ if wav::is_file(head) => wav::read,
        [b'A' | b'R', b'G', b'0' | b'1' | b'2' | b'3', b'0'..=b'9', ..] => keysight::read,
        _ if head.starts_with(b"MATLAB 5.0") => matlab::read,
        _ if matlab::is_4(head) => matlab::read_4,
        _ if hdf5::is_file(head) => hdf5::read,
        _ if tektronix::is_isf(head) => tektronix::read,
        _ if tektronix::is_wfm(head) => tektronix::read_wfm,
        _ if within(b"WAVEDESC") => lecroy::read,
        _ if rohde_schwarz::is_export(path, head) => rohde_schwarz::read,
        _ => return rigol::reader(head).or_else(|| siglent::is_file(head).then_some(siglent::read as Reader)),
    })
}

/// Whether the first bytes are those of a file that is read here.
pub(super) fn is_binary(path: &Path, head: &[u8]) -> bool {
    reader(path, head).is_some()
}

/// Reads the channel that `options` choose, or the only one of `kind`; `None` if it is no such file.
pub(super) fn read(
    path: &Path,
    bytes: &[u8],
    kind: Option<RecordKind>,
    options: &ReadOptions,
) -> Option<Result<(Table, RecordKind), MeasurementError>> {
    let contents = reader(path, bytes)?(path, bytes, options);
    let refused = |text| MeasurementError::Instrument { path: path.into(), text };
    Some(contents.map_err(refused).and_then(|contents| table(path, contents, kind, options)))
}

/// All channels of a file; `None` if it is no such file.
pub(super) fn columns(
    path: &Path,
    bytes: &[u8],
    options: &ReadOptions,
) -> Option<Result<Vec<Column>, MeasurementError>> {
    let contents = reader(path, bytes)?(path, bytes, options);
    let refused = |text| MeasurementError::Instrument { path: path.into(), text };
    let named = |channel: &Channel| Column::named(&channel.name, &channel.unit);
    Some(contents.map(|contents| contents.channels.iter().take(MOST_CHANNELS).map(named).collect()).map_err(refused))
}

fn table(
    path: &Path,
    contents: Contents,
    kind: Option<RecordKind>,
    options: &ReadOptions,
) -> Result<(Table, RecordKind), MeasurementError> {
    let Contents { written, mut channels, comments, mut assumptions } = contents;
    let mut warnings = Vec::new();
    channels.truncate(MOST_CHANNELS);
    let refused = |text: String| MeasurementError::Instrument { path: path.into(), text };
    let without_samples = || refused(format!("{written}: expected samples, found none; export the record again"));
    let mut columns: Vec<Column> = channels.iter().map(|channel| Column::named(&channel.name, &channel.unit)).collect();
    if columns.is_empty() {
        return Err(without_samples());
    }
    let stated = super::header::stated(&comments).sensitivity;
    let kind = kind.unwrap_or_else(|| guess_kind(path, &columns, options, stated));
    let timed = options.sample_rate.is_some() || channels.iter().any(|channel| channel.grid.is_some());
    for (column, channel) in columns.iter_mut().zip(&channels) {
        if time_column::is_named_or_numbered(column)
            && column.unit.is_none()
            && options.time_unit.is_none()
            && let Some(unit) = unit_of_instants(channel)
        {
            assumptions.push(format!("instants of `{}` in {unit}, as their step shows", channel.name));
            column.override_unit(unit);
        }
    }
    // Instants of programs are in seconds.
    let rises = |column: &Column, channel: &Channel| column.unit.is_none() && sampling::is_ramp(&channel.values);
    let likely = |columns: &[Column]| {
        columns.iter().zip(&channels).position(|(column, channel)| rises(column, channel)).map(|at| (at, "s"))
    };
    let mut chosen = choose_or_propose(&Place::line(path, 1), &mut columns, kind, options, timed, stated, likely)?;
    let value = chosen.value;
    let count = channels[value].values.len();
    // A column of instants is what was measured; a step beside it may be another's.
    if chosen.time.is_some_and(|time| channels[time].values.len() != count) && options.time_column.is_none() && timed {
        chosen.time = None;
    }
    let mut times: Vec<f64> = match chosen.time {
        Some(time) => channels[time].values.iter().map(|at| at * chosen.time_factor).collect(),
        None => Vec::new(),
    };
    let own = match (&times[..], channels[value].grid) {
        ([first, .., last], _) => Some((*first, (last - first) / (times.len() - 1) as f64)),
        (_, grid) => grid,
    };
    if let (Some((_, array)), Some((_, stated))) = (own, channels[value].grid)
        && (stated / array - 1.0).abs() > 1e-3
        && options.sample_rate.is_none()
    {
        warnings.push(format!(
            "the instants of `{}` are {} apart; the step of {} that the file states besides is not used",
            chosen.time.map_or("", |time| channels[time].name.as_str()),
            number::time(array),
            number::time(stated),
        ));
    }
    let grid = match options.sample_rate {
        Some(rate) => {
            let (start, stated) = own.unzip();
            let name = &channels[chosen.time.unwrap_or(value)].name;
            warnings.extend(stated.and_then(|stated| samples::replaced(name, stated, 1.0 / rate)));
            Some((start.unwrap_or(0.0), 1.0 / rate))
        }
        None => own.filter(|_| chosen.time.is_none()),
    };
    match grid {
        Some((start, step)) if !(start.is_finite() && step.is_finite() && step > 0.0) => {
            return Err(refused(format!(
                "channel `{}`: expected a positive sample interval, found {step} s; export the record again, or pass --sample-rate",
                channels[value].name
            )));
        }
        Some(_) => {
            chosen.time = None;
            times.clear();
        }
        None if chosen.time.is_none() => {
            return Err(refused(format!(
                "channel `{}`: expected its instants, found none; pass --sample-rate",
                channels[value].name
            )));
        }
        None => {}
    }
    let mut values = std::mem::take(&mut channels[value].values);
    if values.is_empty() {
        return Err(without_samples());
    }
    if let Some(at) = values.iter().position(|value| !(value.abs() < OVER_RANGE)) {
        let found = values[at];
        return Err(refused(format!(
            "channel `{}`: expected numbers below 9.9e37, found {found:.3e} at sample {at}: the input was overloaded, or the samples are of another type than \
             the header says; export the record again, as CSV",
            channels[value].name
        )));
    }
    if chosen.time.is_some() && times.len() != values.len() {
        return Err(refused(format!(
            "expected as many instants as values, found {} and {}; choose another column with --channel or --read time_column=NAME",
            times.len(),
            values.len()
        )));
    }
    if let Some(at) = times.windows(2).position(|pair| !(pair[1] > pair[0])) {
        let place = Place::cell(path, 0, &columns[chosen.time.unwrap_or(0)].header);
        return Err(MeasurementError::TimeNotIncreasing { place, previous: times[at], found: times[at + 1] });
    }
    for value in &mut values {
        *value *= chosen.value_unit.factor;
    }
    let table = Table {
        form: Form::Universal(Box::new(UniversalText { written, assumptions, warnings })),
        first_lines: Vec::new(),
        comments,
        columns,
        grid: grid.filter(|_| chosen.time.is_none()),
        chosen,
        times,
        origin: None,
        digit: 0.0,
        stated_step: None,
        values,
        lines: SampleLines::default(),
        bridged: 0,
        blank_ends: 0,
        assumptions: Vec::new(),
        warnings: Vec::new(),
        open_end: false,
    };
    Ok((table, kind))
}

/// Unit in which instants without one have the step that the file states besides.
fn unit_of_instants(channel: &Channel) -> Option<&'static str> {
    let (first, last, (_, step)) = (channel.values.first()?, channel.values.last()?, channel.grid?);
    let found = (last - first) / (channel.values.len() - 1) as f64;
    let units = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
    units.into_iter().find(|(_, factor)| (found * factor / step - 1.0).abs() < 1e-3).map(|(unit, _)| unit)
}

/// The part that `--read dataset=N` chooses of `count`.
fn part(options: &ReadOptions, count: usize, what: &str) -> Result<usize, String> {
    match (options.dataset, count) {
        (None, 1) | (Some(1), 1) => Ok(0),
        (Some(wanted), count) if (1..=count).contains(&wanted) => Ok(wanted - 1),
        _ => Err(format!("expected one {what}, found {count}; choose one with --read dataset=1 to dataset={count}")),
    }
}
