//! Why a record cannot be used: where, what was expected, what was found, what to do.

use std::path::PathBuf;

use thiserror::Error;

use granchain_signal::{Dimension, Quantity, QuantityError};

use super::{
    DecimalSign, Place, RecordKind, UniversalError,
    remedy::{by_name_or_number, listed, other_record, remedies, sensitivity, subharmonic, times, wanted},
};

/// Why a record cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "a field named `path` is the file")]
pub enum MeasurementError {
    /// There is no such file.
    #[error("{}: expected a record, found no such file{}", path.display(), nearest.as_ref().map(|near| format!("; did you mean `{near}`?")).unwrap_or_else(|| "; check the path".into()))]
    NotFound {
        /// The path as given.
        path: PathBuf,
        /// A file in the same folder whose name looks like it.
        nearest: Option<String>,
    },
    /// The path is a folder.
    #[error("{}: expected a file, found a folder; name {}", path.display(), if files.is_empty() { "a CSV file".into() } else { format!("a file in it, such as {}", listed(files)) })]
    Folder {
        /// The path as given.
        path: PathBuf,
        /// CSV files in it.
        files: Vec<String>,
    },
    /// The system refused to read.
    #[error("{}: cannot be read: {source}", path.display())]
    Io {
        /// The path as given.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Nothing in the file.
    #[error("{}: expected a header line and rows of numbers, found an empty file; export it again", path.display())]
    Empty { path: PathBuf },
    /// Not a text file.
    #[error("{}: expected text, found {found}; export the record as CSV text", path.display())]
    Binary {
        path: PathBuf,
        /// What it seems to be, or the offending byte.
        found: String,
    },
    /// Text in another encoding.
    #[error("{place}: expected UTF-8 text, found byte 0x{byte:02x}; save the file as UTF-8")]
    NotUtf8 {
        /// Where.
        place: Place,
        /// The byte.
        byte: u8,
    },
    /// Another delimiter.
    #[error("{place}: expected {expected}, found {found}; {remedy}")]
    Delimiter {
        /// Where.
        place: Place,
        /// What should separate the values.
        expected: String,
        /// What separates the values.
        found: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// Decimal points and decimal commas in one table.
    #[error(
        "{place}: expected {} as in line {since}, found `{found}`; write all decimals alike and no thousands apart",
        expected.name()
    )]
    MixedDecimals {
        /// Where.
        place: Place,
        /// The decimals of the rows before.
        expected: DecimalSign,
        /// A line that has them.
        since: u64,
        /// The cell.
        found: String,
    },
    /// A number that can be read in two ways.
    #[error(
        "{place}: expected a number that can be read in one way, found only such as `{found}`: a decimal or thousands set \
         apart; pass --read decimal={} if it is a decimal, else export without setting thousands apart",
        if *sign == DecimalSign::Comma { "comma" } else { "point" }
    )]
    AmbiguousNumber {
        /// Where.
        place: Place,
        /// The cell.
        found: String,
        /// The sign in it.
        sign: DecimalSign,
    },
    /// A cell with a unit of its own.
    #[error(
        "{place}: expected a plain number, found `{found}` with a unit; a column has one unit, in its header: convert the \
         cells to it"
    )]
    MixedUnits {
        /// Which cell.
        place: Place,
        /// The cell.
        found: String,
    },
    /// More columns than any instrument has channels.
    #[error("{place}: expected at most {limit} columns, found {found}; check the delimiter (--read delimiter=…)")]
    TooManyColumns {
        /// Where.
        place: Place,
        /// The most that are read.
        limit: usize,
        /// Columns found.
        found: usize,
    },
    /// An instrument's preamble without something that it must have.
    #[error("{place}: expected {wanted}, as {instrument} writes it, found none; export the record again")]
    Preamble {
        /// Where.
        place: Place,
        /// Whose preamble it begins like.
        instrument: &'static str,
        /// What is missing.
        wanted: &'static str,
    },
    /// Several times as many samples as announced.
    #[error("{place}: expected {announced} samples as announced, found {}: several records in one file; keep one", times(*announced, *found))]
    MoreThanAnnounced {
        place: Place,
        /// Samples announced.
        announced: usize,
        /// Samples found.
        found: usize,
    },
    /// Counts of a converter in place of volts.
    #[error(
        "{place}: expected instants and volts, found counts of the converter (as with `Mode,Fast`): volts are counts × {scale} / 25, less the vertical \
         position; export in the mode Detail, or write the volts into the file"
    )]
    Counts {
        /// First row.
        place: Place,
        /// Volts a division, as written.
        scale: String,
    },
    /// The file that says how another is read.
    #[error("{place}: expected samples, found settings alone; the samples stand in {}: name that file", values.display())]
    Keys {
        place: Place,
        /// The file with the samples.
        values: PathBuf,
    },
    /// Settings of an instrument that nobody knows.
    #[error(
        "{place}: expected a header that names the columns with their units, found settings such as `{found}`, of an instrument that is not known; \
         delete lines {first} to {last} and write a header such as `time_s,velocity_mm_per_s` in their place"
    )]
    UnknownPreamble {
        /// First line of it.
        place: Place,
        /// Its first line.
        first: u64,
        /// Its last line.
        last: u64,
        /// One of them.
        found: String,
    },
    /// Several segments and no choice, or a choice that is not there.
    #[error(
        "{place}: expected one segment to read, found {count}{}{}; choose one with --read dataset=1…{count}",
        size.map(|size| format!(" of {size} samples each")).unwrap_or_default(),
        wanted.map(|wanted| format!(" and no segment {wanted}")).unwrap_or_default()
    )]
    Segments {
        /// Where.
        place: Place,
        /// How many there are.
        count: usize,
        /// Rows of each, where all have as many.
        size: Option<usize>,
        /// The one asked for.
        wanted: Option<usize>,
    },
    /// `dataset` for a file that holds one record.
    #[error("{}: dataset={wanted} names a function or a segment; the file is a plain table with one: leave it out", path.display())]
    NoDatasets {
        path: PathBuf,
        /// The number asked for.
        wanted: usize,
    },
    /// A universal file that cannot be used.
    #[error(transparent)]
    Universal(#[from] UniversalError),
    /// Polytec's own files.
    #[error(
        "{}: expected text or a universal file, found a file in Polytec's own binary form ({extension}), which only Polytec's \
         software reads; open it in PSV or VibSoft and export the time data as universal file (UFF 58) or as ASCII",
        path.display()
    )]
    PolytecBinary {
        path: PathBuf,
        /// `.svd` or `.pvd`.
        extension: String,
    },
    /// `--scale` for what is no voltage.
    #[error("{place}: --scale is for a column in volts, found the unit `{unit}`; leave --scale out, or pass --unit V")]
    ScaleWithoutVolts {
        /// Which column.
        place: Place,
        /// The unit as written.
        unit: String,
    },
    /// `range` of another quantity than the record's.
    #[error("{}: expected a range in the record's own quantity or, with --scale, in volts, found `{found}`", path.display())]
    WrongRange {
        path: PathBuf,
        /// The range.
        found: String,
    },
    /// The first row is no header.
    #[error(
        "{place}: expected a header that names the columns with their units, found `{found}`; add one such as \
         `time_s,velocity_mm_per_s`, or pass both --read time_unit=UNIT and --unit UNIT"
    )]
    NoHeader {
        /// Where.
        place: Place,
        /// The row.
        found: String,
    },
    /// A header and nothing below.
    #[error("{place}: expected rows of numbers below the header, found none; export the record again")]
    NoRows {
        /// Where the file ends.
        place: Place,
    },
    /// Not enough rows.
    #[error("{}: expected at least {needed} samples, found {found}; export the whole record", path.display())]
    TooFewSamples {
        path: PathBuf,
        /// Samples needed.
        needed: usize,
        /// Samples found, on the even grid.
        found: usize,
    },
    /// No column holds time.
    #[error(
        "{place}: expected a column of time such as `time_s`, found the columns {}; rename one, or pass --read time_column=NAME \
         and --read time_unit=UNIT, or --sample-rate if there is no time in the file",
        listed(columns)
    )]
    NoTime {
        /// Where the header is.
        place: Place,
        /// All headers.
        columns: Vec<String>,
    },
    /// No column holds what a record of this kind needs.
    #[error(
        "{place}: a {} record needs {}; found the columns {}; rename one, or pass --channel and --unit",
        kind.name(), wanted(*kind), listed(columns)
    )]
    NoQuantity {
        /// Where the header is.
        place: Place,
        /// Kind of record.
        kind: RecordKind,
        /// All headers.
        columns: Vec<String>,
    },
    /// The named column is not there.
    #[error("{place}: {flag} names `{wanted}`, which is no column here; the columns are {}", listed(columns))]
    NoSuchColumn {
        /// Where the header is.
        place: Place,
        /// Which flag.
        flag: &'static str,
        /// Its value.
        wanted: String,
        /// All headers.
        columns: Vec<String>,
    },
    /// More than one column would do.
    #[error(
        "{place}: expected one column to read, found {}: {}; choose one {}",
        candidates.len(), listed(candidates), by_name_or_number(flag, candidates, numbers)
    )]
    Ambiguous {
        /// Where the header is.
        place: Place,
        /// The flag that chooses.
        flag: &'static str,
        /// The columns that would do.
        candidates: Vec<String>,
        /// Their numbers, from 1.
        numbers: Vec<usize>,
    },
    /// Amplitudes over frequencies.
    #[error("{place}: expected samples in time, found a spectrum; export the time data")]
    Spectrum {
        /// Its column of frequencies.
        place: Place,
    },
    /// More than one thing is not said.
    #[error("{}; all at once: {}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n  and "), remedies(.0))]
    Several(Vec<MeasurementError>),
    /// Minimum and maximum at every instant.
    #[error(
        "{place}: expected one sample at every instant, found two: the extremes that an oscilloscope writes in the mode Peak Detect, which are no          samples; record again in the mode Sample"
    )]
    PeakDetect {
        /// Where the second instant is the first.
        place: Place,
    },
    /// A column without a unit.
    #[error("{place}: expected a unit, found none; write it in the header as in `{example}`, or pass {flag}")]
    NoUnit {
        /// Which column.
        place: Place,
        /// A header with a unit.
        example: &'static str,
        /// The flag that gives it.
        flag: &'static str,
    },
    /// A unit nobody knows.
    #[error("{place}: {source}; correct the header, or pass {flag}")]
    UnknownUnit {
        /// Which column.
        place: Place,
        /// The flag that gives it.
        flag: &'static str,
        /// What the unit's reader said.
        source: QuantityError,
    },
    /// A unit of something else.
    #[error("{place}: expected {expected}, found the unit `{unit}`{}; name another column with {flag}, or correct the unit{}", actual.name().map(|name| format!(" of {name}")).unwrap_or_default(), other_record(*kind, *actual))]
    WrongQuantity {
        /// Which column.
        place: Place,
        /// What is needed.
        expected: &'static str,
        /// The unit as written.
        unit: String,
        /// Its dimension.
        actual: Dimension,
        /// The flag that chooses the column.
        flag: &'static str,
        /// Kind of record.
        kind: RecordKind,
    },
    /// A voltage says nothing about the recorded quantity.
    #[error("{place}: expected {}, found volts (`{unit}`), which need {}", sensitivity(*kind).0, sensitivity(*kind).1)]
    Volts {
        /// Which column.
        place: Place,
        /// Kind of record.
        kind: RecordKind,
        /// The unit as written.
        unit: String,
    },
    /// A sensitivity for another quantity than the record's.
    #[error(
        "{place}: a {} record is {}, and the sensitivity {scale} makes volts {}; volts of this record need {}{}",
        kind.name(), sensitivity(*kind).0, found.describe(), sensitivity(*kind).1, other_record(*kind, *found)
    )]
    WrongSensitivity {
        /// Which column.
        place: Place,
        /// Kind of record.
        kind: RecordKind,
        /// The sensitivity.
        scale: String,
        /// What it makes of volts.
        found: Dimension,
    },
    /// A peak that no horn, no bead and no ultrasound in water has.
    #[error("{}: expected a peak {expected}, found {peak} ({from}); {remedy}", path.display())]
    AbsurdPeak { path: PathBuf, expected: String, peak: Quantity, from: String, remedy: &'static str },
    /// A row with fewer or more cells than the header.
    #[error(
        "{place}: expected {expected} cells as in the header, found {found}{}",
        if *cut { "; the file ends in the middle of this line, so the transfer was cut short: copy it again, or delete the line" }
        else if *commas { "; decimal commas cannot be told from commas between values: export with semicolons, or with decimal points" }
        else { "; complete the row or delete it" }
    )]
    Ragged {
        /// Which line.
        place: Place,
        /// Cells in the header.
        expected: usize,
        /// Cells in the row.
        found: usize,
        /// Whether it is the last line and lacks its end.
        cut: bool,
        /// Whether commas separate the cells and there are twice as many as there should be.
        commas: bool,
    },
    /// Text where a number belongs.
    #[error(
        "{place}: expected a number, found `{found}`{}",
        if *cut { "; the file ends in the middle of this line, so the transfer was cut short: copy it again, or delete the line" }
        else if found.contains(',') { "; write decimal points, not commas, or pass --read decimal=comma" }
        else { "; correct the cell or delete the row" }
    )]
    NotANumber {
        /// Which cell.
        place: Place,
        /// The cell.
        found: String,
        /// Whether it is the last line and lacks its end.
        cut: bool,
    },
    /// `n/a`, an empty cell, NaN.
    #[error("{place}: expected a finite number, found `{found}`; drop the row or pass --read missing=interpolate")]
    MissingValue {
        /// Which cell.
        place: Place,
        /// The cell.
        found: String,
    },
    /// A gap that no straight line can bridge.
    #[error(
        "{place}: expected at most {limit} missing cells in a row with a number before and after, found {found}; cut \
         the record there"
    )]
    GapTooLong {
        /// The first cell of the gap.
        place: Place,
        /// Its length, cells.
        found: usize,
        /// The longest that is bridged.
        limit: usize,
    },
    /// An infinite value.
    #[error(
        "{place}: expected a finite number, found `{found}`; the input was overloaded or the export is wrong: record it again"
    )]
    Infinite {
        /// Which cell.
        place: Place,
        /// The cell.
        found: String,
    },
    /// Time stands still or runs backwards.
    #[error(
        "{place}: expected a time later than {previous:e} s, found {found:e} s; {}",
        if previous == found { "the time column needs more digits, or the row is there twice" }
        else { "sort the rows by time, or keep one sweep only" }
    )]
    TimeNotIncreasing {
        /// Which cell.
        place: Place,
        /// Time of the row before, s.
        previous: f64,
        /// Time of this row, s.
        found: f64,
    },
    /// The samples are not evenly spaced.
    #[error(
        "{place}: expected evenly spaced samples, one every {expected:.6e} s within {:.0} % of that, found a step of \
         {found:.6e} s; restore the rows that were lost, or pass --read resample=true", 100.0 * tolerance
    )]
    Uneven {
        /// Where the step departs most.
        place: Place,
        /// Mean step, s.
        expected: f64,
        /// The step found, s.
        found: f64,
        /// Tolerance as a fraction of the step, 1.
        tolerance: f64,
    },
    /// Samples too far apart to be interpolated.
    #[error(
        "{place}: expected steps of at most {limit} times the usual {median:.6e} s, found one of {found:.6e} s; what \
         happened between cannot be interpolated: cut the record there"
    )]
    TooUneven {
        /// Where the step departs most.
        place: Place,
        /// Median step, s.
        median: f64,
        /// The step found, s.
        found: f64,
        /// The longest that is interpolated across, in median steps.
        limit: f64,
    },
    /// `baseline=pretrigger` without a pre-trigger.
    #[error(
        "{}: baseline=pretrigger needs at least {needed} quiet samples before the trigger, found {found}; pass \
         --read trigger=TIME with the instant of the trigger, or another baseline", path.display()
    )]
    NoPretrigger {
        path: PathBuf,
        /// Samples needed.
        needed: usize,
        /// Quiet samples found.
        found: usize,
    },
    /// `baseline=plateau` without a plateau.
    #[error(
        "{}: baseline=plateau needs a burst with at least {needed} drive periods above 0.8 of its peak, found \
         {found}; pass --drive-frequency, or another baseline", path.display()
    )]
    NoPlateau {
        path: PathBuf,
        /// Periods needed.
        needed: usize,
        /// Periods found.
        found: usize,
    },
    /// The drive frequency can be had from nowhere.
    #[error("{}: expected a periodic drive, found no spectral line; pass --drive-frequency", path.display())]
    NoDriveFrequency { path: PathBuf },
    /// The drive is too short to be one.
    #[error(
        "{}: expected a drive of at least two cycles, found {cycles:.2} at {:.4} kHz; record a longer burst, or \
         correct --drive-frequency", path.display(), frequency / 1e3
    )]
    DriveTooShort {
        path: PathBuf,
        /// Cycles found.
        cycles: f64,
        /// Drive frequency, Hz.
        frequency: f64,
    },
    /// The horn moves at another frequency than stated.
    #[error(
        "{}{line}: expected a strongest line at the drive frequency of {:.4} kHz ({place}), found it at {:.4} kHz; correct the frequency or the unit of \
         time, or pass --read force_frequency=true{}", path.display(), stated / 1e3, found / 1e3, subharmonic(*stated, *found)
    )]
    FrequencyDisagrees {
        path: PathBuf,
        /// `:` and the line that states it, where one does.
        line: String,
        /// As stated, Hz.
        stated: f64,
        /// Where it is stated.
        place: &'static str,
        /// The strongest line, Hz.
        found: f64,
    },
    /// Too few samples a cycle.
    #[error(
        "{}: expected at least 4 samples a drive cycle ({:.1} kHz for a drive of {:.4} kHz), found a sample rate of \
         {:.1} kHz; record it faster, or correct the unit of time", path.display(), 4e-3 * frequency, frequency / 1e3,
        sample_rate / 1e3
    )]
    SampledTooLow {
        path: PathBuf,
        /// Sample rate, Hz.
        sample_rate: f64,
        /// Drive frequency, Hz.
        frequency: f64,
    },
    /// Too much of a record shows no motion.
    #[error(
        "{}: expected at most {:.0} % of the samples without a valid signal, found {:.1} % ({found}); record again, or pass --read mask=FROM:TO,… with the \
         stretches to leave out, --read mask=none to use every sample", path.display(), 100.0 * allowed, 100.0 * share
    )]
    Masked {
        path: PathBuf,
        /// Share of the samples that are masked.
        share: f64,
        /// Share that may be.
        allowed: f64,
        /// What was found, in words.
        found: String,
    },
    /// A record that is no drive.
    #[error("{}: expected a horn-tip record to drive the piston, found a {} record; name the horn's record", path.display(), kind.name())]
    NotADrive {
        path: PathBuf,
        /// Its kind.
        kind: RecordKind,
    },
}
