//! Why a record cannot be used: where, what was expected, what was found, what to do.

use std::path::PathBuf;

use thiserror::Error;

use granchain_signal::{Dimension, Quantity, QuantityError};

use super::{
    DecimalSign, Place, RecordKind, UniversalError,
    decimal::may_be_grouped,
    remedy::{by_name_or_number, listed, other_record, remedies, sensitivity, subharmonic, time_flags, times, wanted},
};
use granchain_signal::number::time;

/// A step of time (s) for people.
fn span(seconds: f64) -> Quantity {
    rounded(seconds, Dimension::TIME)
}

/// A frequency (Hz) for people.
fn rate(hertz: f64) -> Quantity {
    rounded(hertz, Dimension::FREQUENCY)
}

fn rounded(value: f64, dimension: Dimension) -> Quantity {
    Quantity::new(format!("{value:.3e}").parse().unwrap_or(value), dimension)
}

/// Why a record cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MeasurementError {
    #[error("{}: expected a record, found no such file{}", path.display(), nearest.as_ref().map(|near| format!("; did you mean `{near}`?")).unwrap_or_else(|| "; check the path".into()))]
    NotFound {
        path: PathBuf,
        /// A file in the same folder whose name looks like it.
        nearest: Option<String>,
    },
    #[error("{}: expected a file, found a folder; name {}", path.display(), if files.is_empty() { "a CSV file".into() } else { format!("a file in it, such as {}", listed(files)) })]
    Folder { path: PathBuf, files: Vec<String> },
    #[error("{}: cannot be read: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    #[error("{}: expected a header line and rows of numbers, found an empty file; export it again", path.display())]
    Empty { path: PathBuf },
    #[error("{}: {text}", path.display())]
    Instrument { path: PathBuf, text: String },
    #[error("{}: expected text, found {found}; export the record as CSV text", path.display())]
    Binary {
        path: PathBuf,
        /// Detected file type, or the offending byte.
        found: String,
    },
    #[error("{place}: expected UTF-8 text, found byte 0x{byte:02x}; save the file as UTF-8")]
    NotUtf8 { place: Place, byte: u8 },
    #[error("{place}: expected {expected}, found {found}; {remedy}")]
    Delimiter { place: Place, expected: String, found: &'static str, remedy: &'static str },
    #[error(
        "{place}: expected {} as in line {since}, found `{found}`; use one decimal sign and no thousands separators",
        expected.name()
    )]
    MixedDecimals { place: Place, expected: DecimalSign, since: u64, found: String },
    #[error(
        "{place}: `{found}` is a decimal or a thousands separator: pass --read decimal={} if it is a decimal, else export without thousands separators",
        if *sign == DecimalSign::Comma { "comma" } else { "point" }
    )]
    AmbiguousNumber { place: Place, found: String, sign: DecimalSign },
    #[error(
        "{place}: expected a plain number, found `{found}` with a unit; a column has one unit, in its header: convert the \
         cells to it"
    )]
    MixedUnits { place: Place, found: String },
    #[error("{place}: expected at most {limit} columns, found {found}; check the delimiter (--read delimiter=…)")]
    TooManyColumns { place: Place, limit: usize, found: usize },
    #[error("{place}: expected {wanted}, as {instrument} writes it, found none; export the record again")]
    Preamble { place: Place, instrument: &'static str, wanted: &'static str },
    #[error("{place}: expected {announced} samples as announced, found {}: several records in one file; keep one", times(*announced, *found))]
    MoreThanAnnounced { place: Place, announced: usize, found: usize },
    #[error(
        "{place}: the file has converter counts, not volts (`Mode,Fast`): volts are counts × {scale} / 25, less the vertical position; export in the \
         mode Detail, or write the volts into the file"
    )]
    Counts {
        place: Place,
        /// Volts a division, as written.
        scale: String,
    },
    #[error("{place}: expected samples, found settings alone; the samples stand in {}: name that file", values.display())]
    Keys { place: Place, values: PathBuf },
    #[error(
        "{place}: expected a header that names the columns with their units, found settings such as `{found}`, of an instrument that is not known; \
         delete lines {first} to {last} and write a header such as `time_s,velocity_mm_per_s` in their place"
    )]
    UnknownPreamble { place: Place, first: u64, last: u64, found: String },
    #[error(
        "{place}: expected one segment to read, found {count}{}{}; choose one with --read dataset=1…{count}",
        size.map(|size| format!(" of {size} samples each")).unwrap_or_default(),
        wanted.map(|wanted| format!(" and no segment {wanted}")).unwrap_or_default()
    )]
    Segments {
        place: Place,
        count: usize,
        /// Rows of each, if all have the same number.
        size: Option<usize>,
        wanted: Option<usize>,
    },
    #[error("{}: dataset={wanted} names a function or a segment; the file is a plain table: leave `dataset` out", path.display())]
    NoDatasets { path: PathBuf, wanted: usize },
    #[error(transparent)]
    Universal(#[from] UniversalError),
    #[error(
        "{}: expected text or a universal file, found a file in Polytec's own binary form ({extension}), which only Polytec's \
         software reads; open it in PSV or VibSoft and export the time data as universal file (UFF 58) or as ASCII",
        path.display()
    )]
    PolytecBinary { path: PathBuf, extension: String },
    #[error(
        "{place}: --scale is for a column in volts, found the unit `{unit}`; leave --scale out, or pass --unit V if its values are in volts"
    )]
    ScaleWithoutVolts { place: Place, unit: String },
    #[error(
        "{place}: --scale '{scale}' is for parts of a recorder's full scale, found the unit `{unit}`; pass what a volt means, such as \
         --scale '250 nV/Pa'"
    )]
    NoFullScale { place: Place, scale: String, unit: String },
    #[error("{}: expected a range in the record's own quantity or, with --scale, in volts, found `{found}`", path.display())]
    WrongRange { path: PathBuf, found: String },
    #[error(
        "{place}: expected a header that names the columns with their units, found `{found}`; add one such as \
         `time_s,velocity_mm_per_s`, or pass {flags}"
    )]
    NoHeader {
        place: Place,
        found: String,
        /// Flags that say what a header would.
        flags: String,
    },
    #[error(
        "{place}: expected a header or a decimal point, found `{found}` and one comma in every row: pass {one} for one column of decimal \
         commas, or {two} for two columns of whole numbers"
    )]
    OneComma {
        place: Place,
        found: String,
        /// Flags for one column.
        one: String,
        /// Flags for two columns.
        two: String,
    },
    #[error(
        "{place}: expected a line for every instant, found one of {found} cells for every channel; transpose the table"
    )]
    Transposed { place: Place, found: usize },
    #[error("{place}: expected rows of numbers below the header, found none; export the record again")]
    NoRows { place: Place },
    #[error("{}: expected at least {needed} samples, found {found}; export the whole record", path.display())]
    TooFewSamples {
        path: PathBuf,
        needed: usize,
        /// Samples found on the even grid.
        found: usize,
    },
    #[error(
        "{place}: expected a column of time such as `time_s`, found the columns {}; rename one, or pass {}, or --sample-rate if there is no time in \
         the file",
        listed(columns), time_flags(likely.as_ref())
    )]
    NoTime {
        place: Place,
        columns: Vec<String>,
        /// A column without unit that rises from row to row, and its likely unit.
        likely: Option<(String, &'static str)>,
    },
    #[error(
        "{place}: a {} record needs {}; found the columns {}; rename one, or pass --channel and --unit",
        kind.name(), wanted(*kind), listed(columns)
    )]
    NoQuantity {
        place: Place,
        kind: RecordKind,
        columns: Vec<String>,
        /// Of these the ones without a unit, which may be meant.
        open: Vec<String>,
    },
    #[error(
        "{place}: expected the force of a sensor in newtons or volts, found {}; the columns are {}; choose one with --channel",
        if found.is_empty() { "none".into() } else { listed(found) }, listed(columns)
    )]
    NoForce { place: Place, found: Vec<String>, columns: Vec<String> },
    #[error("{place}: {flag} names `{wanted}`, which is no column here; the columns are {}", listed(columns))]
    NoSuchColumn { place: Place, flag: &'static str, wanted: String, columns: Vec<String> },
    #[error(
        "{place}: expected one column to read, found {}: {}; choose one {}",
        candidates.len(), listed(candidates), by_name_or_number(flag, candidates, numbers)
    )]
    Ambiguous { place: Place, flag: &'static str, candidates: Vec<String>, numbers: Vec<usize> },
    #[error(
        "{place}: expected a vibration, found values that rise or fall evenly, as instants or counts do; name the record's column with --channel NAME \
         (the columns are {}), and the instants' with --read time_column=NAME",
        listed(columns)
    )]
    Ramp { place: Place, columns: Vec<String> },
    #[error("{place}: expected samples in time, found a spectrum; export the time data")]
    Spectrum { place: Place },
    #[error(
        "{}{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n  and "),
        remedies(.0).map(|flags| format!("; all at once: {flags}")).unwrap_or_default()
    )]
    Several(Vec<MeasurementError>),
    #[error(
        "{place}: expected one sample at every instant, found two: the extremes that an oscilloscope writes in the mode Peak Detect, which are no samples; record again in the mode Sample"
    )]
    PeakDetect { place: Place },
    #[error(
        "{place}: expected one sample at every instant, found an envelope: `{least}` and `{greatest}` are the extremes of each stretch, which \
         are no samples; record again without envelope or peak detect"
    )]
    Envelope { place: Place, least: String, greatest: String },
    #[error("{place}: expected a unit, found none; write it in the header as in `{example}`, or pass {flag}")]
    NoUnit { place: Place, example: &'static str, flag: &'static str },
    #[error(
        "{place}: expected {}, found a current in `{unit}`; name another column with --channel, or record the probe's output in volts and state what \
         a volt means with --scale", sensitivity(*kind).0
    )]
    Current { place: Place, kind: RecordKind, unit: String },
    #[error("{place}: {source}; correct the header, or pass {flag}")]
    UnknownUnit { place: Place, flag: &'static str, source: QuantityError },
    #[error("{place}: expected {expected}, found the unit `{unit}`{}; name another column with {flag}, or correct the unit{}", actual.name().map(|name| format!(" of {name}")).unwrap_or_default(), other_record(*kind, *actual))]
    WrongQuantity {
        place: Place,
        expected: &'static str,
        unit: String,
        actual: Dimension,
        flag: &'static str,
        kind: RecordKind,
    },
    #[error("{place}: expected {}, found volts (`{unit}`), which need {}", sensitivity(*kind).0, sensitivity(*kind).1)]
    Volts { place: Place, kind: RecordKind, unit: String },
    #[error(
        "{place}: --scale '{scale}' gives {}, but a {} record must be {}: it needs {}{}",
        found.name().map_or_else(|| format!("a quantity in {}", found.si_unit()), str::to_owned), kind.name(), sensitivity(*kind).0,
        sensitivity(*kind).1, other_record(*kind, *found)
    )]
    WrongSensitivity { place: Place, kind: RecordKind, scale: String, found: Dimension },
    #[error("{}: expected a peak {expected}, found {peak} ({from}); {remedy}", path.display())]
    AbsurdPeak { path: PathBuf, expected: String, peak: Quantity, from: String, remedy: &'static str },
    #[error(
        "{place}: expected {expected} cells as in the header, found {found}{}",
        if *cut { "; the file ends in the middle of this line, so the transfer was cut short: copy it again, or delete the line" }
        else if *commas && *expected == 1 { "; for one column of decimal commas pass --read decimal=comma, and --sample-rate RATE" }
        else if *commas { "; decimal commas cannot be distinguished from commas between values: export with semicolons, or with decimal points" }
        else { "; complete the row or delete it" }
    )]
    Ragged {
        place: Place,
        expected: usize,
        found: usize,
        /// Whether it is the last line and has no line end.
        cut: bool,
        /// Whether commas separate the cells and there are twice as many as expected.
        commas: bool,
    },
    #[error(
        "{place}: expected a number, found `{found}`{}",
        if *cut { "; the file ends in the middle of this line, so the transfer was cut short: copy it again, or delete the line" }
        else if may_be_grouped(found, DecimalSign::Comma) { "; write numbers without thousands separators" }
        else if found.contains(',') { "; write decimal points, not commas, or pass --read decimal=comma" }
        else { "; correct the cell or delete the row" }
    )]
    NotANumber {
        place: Place,
        found: String,
        /// Whether it is the last line and has no line end.
        cut: bool,
    },
    #[error("{place}: expected a finite number, found `{found}`; drop the row or pass --read missing=interpolate")]
    MissingValue { place: Place, found: String },
    #[error(
        "{place}: expected at most {limit} missing cells in a row with a number before and after, found {found}; cut \
         the record there"
    )]
    GapTooLong { place: Place, found: usize, limit: usize },
    #[error(
        "{place}: expected a finite number, found `{found}`; the input was overloaded or the export is wrong: record it again"
    )]
    Infinite { place: Place, found: String },
    #[error(
        "{}: expected the bandwidth of the instrument beside its response `{filter}`; add --read bandwidth=…, the frequency of −3 dB", path.display()
    )]
    ResponseWithoutBandwidth { path: PathBuf, filter: String },
    #[error(
        "{}: `response` applies to vibrometer and hydrophone only; remove it from the horn's reading", path.display()
    )]
    ResponseOfHorn { path: PathBuf },
    #[error(
        "{place}: expected a time later than {}, found {}; {}", time(*previous), time(*found),
        if previous == found { "the time column needs more digits, or the row is there twice" }
        else { "the instants fall or jump: keep one sweep only, or correct the sign or the unit of the time column" }
    )]
    TimeNotIncreasing {
        place: Place,
        /// Time of the row before, s.
        previous: f64,
        /// Time of this row, s.
        found: f64,
    },
    #[error(
        "{place}: the samples are not evenly spaced: a step of {} at this line, {} elsewhere ({:.0} % allowed); restore the rows that were \
         lost, or pass --read resample=true", span(*found), span(*expected), 100.0 * tolerance
    )]
    Uneven {
        place: Place,
        /// Mean step, s.
        expected: f64,
        found: f64,
        /// Tolerance as a fraction of the step, 1.
        tolerance: f64,
    },
    #[error(
        "{place}: expected steps of at most {limit} times the usual {}, found one of {}; what happened between cannot be interpolated: cut the \
         record there", span(*median), span(*found)
    )]
    TooUneven {
        place: Place,
        /// Median step, s.
        median: f64,
        found: f64,
        /// Longest step that is interpolated across, in median steps.
        limit: f64,
    },
    #[error(
        "{}: baseline=pretrigger needs at least {needed} quiet samples before the trigger, found {found}; pass \
         --read trigger=TIME with the instant of the trigger, or another baseline", path.display()
    )]
    NoPretrigger { path: PathBuf, needed: usize, found: usize },
    #[error(
        "{}: baseline=plateau needs a burst with at least {needed} drive periods above 0.8 of its peak, found \
         {found}; pass --drive-frequency, or another baseline", path.display()
    )]
    NoPlateau { path: PathBuf, needed: usize, found: usize },
    #[error("{}: expected a periodic drive, found no spectral line; pass --drive-frequency", path.display())]
    NoDriveFrequency { path: PathBuf },
    #[error("{}: {key} of {found} ({place}): expected {expected}; correct it there", path.display())]
    Unlikely { path: PathBuf, key: &'static str, found: Quantity, place: &'static str, expected: &'static str },
    #[error(
        "{}: expected a drive of at least two cycles, found {cycles:.2} at {:.4} kHz; record a longer burst, or \
         correct --drive-frequency", path.display(), frequency / 1e3
    )]
    DriveTooShort { path: PathBuf, cycles: f64, frequency: f64 },
    #[error("{}: the horn's record does not oscillate (all samples are {value}); check the channel", path.display())]
    ConstantDrive { path: PathBuf, value: Quantity },
    #[error(
        "{}{line}: expected a strongest line at the drive frequency of {:.4} kHz ({place}), found it at {:.4} kHz; correct the frequency or the unit of \
         time, or pass --read force_frequency=true{}", path.display(), stated / 1e3, found / 1e3, subharmonic(*stated, *found)
    )]
    FrequencyDisagrees {
        path: PathBuf,
        /// `:` and the line that states it, if there is one.
        line: String,
        stated: f64,
        place: &'static str,
        found: f64,
    },
    #[error(
        "{}: a drive of {} needs a sample rate of at least {} (4 samples per cycle); the record has {}; check --drive-frequency and the unit of time, \
         or record it faster", path.display(), rate(*frequency), rate(4.0 * frequency), rate(*sample_rate)
    )]
    SampledTooLow { path: PathBuf, sample_rate: f64, frequency: f64 },
    #[error(
        "{}: expected at most {:.0} % of the samples without a valid signal, found {:.1} % ({found}); record again, or pass --read mask=FROM:TO,… with the \
         stretches to leave out, --read mask=none to use every sample", path.display(), 100.0 * allowed, 100.0 * share
    )]
    Masked {
        path: PathBuf,
        share: f64,
        allowed: f64,
        /// What was found, in words.
        found: String,
    },
    #[error("{}: expected a horn-tip record to drive the piston, found a {} record; name the horn's record", path.display(), kind.name())]
    NotADrive { path: PathBuf, kind: RecordKind },
}
