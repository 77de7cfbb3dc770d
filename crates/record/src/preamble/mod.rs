//! What instruments write above their rows: which instrument it was, where the table begins, what it states about it.
//!
//! | instrument | recognised by | what is taken from it |
//! |---|---|---|
//! | Brüel & Kjær PULSE, Reflex | `X-Axis unit:`, `Y-Axis unit:` | names, units, sample interval, number of points |
//! | Digilent WaveForms | `#Digilent WaveForms` | sample rate, number of points |
//! | GW Instek | `Memory Length` … `Waveform Data` | units, names, sample interval, number of points; counts are refused |
//! | Hantek | `#timebase=` | – (seconds and millivolts, which are not written) |
//! | HIOKI 8807 | `NUM_SIGS`, `HORZ_UNITS` | names, units |
//! | Keysight InfiniiVision | header `x-axis,1` | – (units stand in the second row) |
//! | Keysight Infiniium | `XInc:` … `Data:` | units, instants where the rows have none, number of points |
//! | LabVIEW | `LabVIEW Measurement` | names, units, instants, segments |
//! | LabVIEW, Export Waveforms | `waveform` and `delta t` | names, sample interval |
//! | LeCroy | `LECROY…,…,Waveform` | segments; seconds and volts, which are not written |
//! | Polytec | `Source File Name:` | – |
//! | Rigol | `Start` and `Increment`, or `t0` and `tInc`, in the header | instants |
//! | Rohde & Schwarz RTO | `NAME.Wfm.csv` | instants, from `NAME.csv` beside it |
//! | Siglent | `Record Length,Analog:` | names, units, sample interval, number of points |
//! | Tektronix | `Record Length`, `Sample Interval` | units, sample interval, number of points |
//! | Yokogawa | `TraceName`, `HResolution` | names, units, instants, number of points |
//! | Moku, COMSOL | several lines of `%` | names |
//! | any other | a header that names a time or a counter, as wide as the rows below | – |
//!
//! Other Rohde & Schwarz and PicoScope need nothing: their headers are `in s,C1 in V` and `Time,Channel A` with units below.

mod axes;
mod digilent;
mod gwinstek;
mod hantek;
mod hioki;
mod keysight;
mod labview;
mod lecroy;
mod percent;
mod polytec;
mod rigol;
mod rohde_schwarz;
mod siglent;
mod tektronix;
mod unknown;
mod yokogawa;

use std::path::Path;

use granchain_signal::{Dimension, number::time};

use super::{DecimalSign, Delimiter, MeasurementError, Place, column::parse_unit, decimal, dialect};

#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Preamble {
    pub instrument: &'static str,
    /// Byte in the text at which the table begins with its header, or with its first row if `header` is given.
    pub body: usize,
    pub body_line: u64,
    /// Byte at which it ends, if the file holds several tables.
    pub end: Option<usize>,
    /// Names of the columns, if they are not in the table; empty for columns without samples.
    pub header: Option<Vec<String>>,
    /// Unit of time, and of everything else.
    pub units: Option<(String, String)>,
    /// First instant and sample interval (s) of rows without a time.
    pub grid: Option<(f64, f64)>,
    /// First instant and sample interval (s) of each column of `header` without instants in the rows, if they differ.
    pub clocks: Vec<Option<(f64, f64)>>,
    /// Column of the sample counter, and first instant and step (s) of its counts.
    pub counter: Option<(usize, f64, f64)>,
    /// Sample interval of the acquisition, s.
    pub interval: Option<f64>,
    pub points: Option<usize>,
    /// Whether a remark may follow the cells of a row.
    pub remarks: bool,
    /// Number of this segment, and of all segments.
    pub segment: Option<(usize, usize)>,
    /// Number of segments in the table and rows of each.
    pub segments: Option<(usize, usize)>,
    /// The preamble's lines, as comments.
    pub statements: Vec<String>,
    /// Assumptions made because of the preamble.
    pub assumptions: Vec<String>,
}

impl Preamble {
    /// Of a table that begins with the line `body`, below the lines of the preamble.
    fn above(instrument: &'static str, body: &Line<'_>, lines: &[Line<'_>]) -> Self {
        let (body, body_line) = (body.at, body.number);
        Self { instrument, body, body_line, statements: statements(lines, body_line), ..Self::default() }
    }
}

/// Most lines of a preamble.
const LONGEST: usize = 200;

/// A line, its number and the byte at which it begins.
#[derive(Clone, Copy)]
struct Line<'a> {
    text: &'a str,
    number: u64,
    at: usize,
}

impl<'a> Line<'a> {
    /// The first two cells: key and value.
    fn pair(&self) -> Option<(&'a str, &'a str)> {
        let text = self.text.trim_start_matches('#');
        let mut cells = text.split(text.chars().find(is_delimiter)?);
        Some((bare(cells.next()?), bare(cells.next()?)))
    }

    /// Key and value separated by a colon; the first value of several.
    fn keyed(&self) -> Option<(&'a str, &'a str)> {
        let (key, value) = self.text.trim_start_matches('#').split_once(':')?;
        Some((bare(key), bare(bare(value).split(|letter| is_delimiter(&letter)).next().unwrap_or_default())))
    }
}

fn is_delimiter(letter: &char) -> bool {
    matches!(letter, ',' | ';' | '\t')
}

fn bare(text: &str) -> &str {
    text.trim_matches(|letter: char| letter.is_whitespace() || matches!(letter, '"' | ',' | ';' | ':'))
}

fn number(text: &str) -> Option<f64> {
    let value = decimal::number(text, DecimalSign::Point).or_else(|| decimal::number(text, DecimalSign::Comma));
    value.filter(|value| value.is_finite())
}

fn count(text: &str) -> Option<usize> {
    number(text).filter(|value| *value >= 1.0 && *value < 1e15 && value.fract() == 0.0).map(|value| value as usize)
}

fn lines(text: &str) -> Vec<Line<'_>> {
    let mut at = 0;
    let mut found = Vec::new();
    for (text, number) in text.split_inclusive('\n').zip(1..).take(LONGEST) {
        found.push(Line { text: text.trim_end_matches(['\n', '\r']), number, at });
        at += text.len();
    }
    found
}

/// The line of `text` that begins at byte `at`.
fn line_at(text: &str, at: usize) -> Line<'_> {
    let at = at.min(text.len());
    let number = 1 + text[..at].bytes().filter(|byte| *byte == b'\n').count() as u64;
    Line { text: text[at..].lines().next().unwrap_or_default(), number, at }
}

/// Cells of a line, split at its most frequent delimiter, without surrounding blanks and quotes.
fn cells(line: &str) -> Vec<&str> {
    let count = |delimiter: &Delimiter| dialect::cells(line, *delimiter).count();
    // The first of those that are as frequent; a comma where there is none.
    let most = Delimiter::ALL.into_iter().max_by_key(|it| (count(it), *it != Delimiter::Comma));
    dialect::cells(line, most.filter(|it| count(it) > 1).unwrap_or_default()).collect()
}

/// Values after a key in the first row that it begins, one for every channel.
fn row_of<'a>(lines: &[Line<'a>], wanted: &str) -> Option<Vec<&'a str>> {
    let row = lines.iter().map(|line| cells(line.text)).find(|row| row[0].eq_ignore_ascii_case(wanted))?;
    Some(row.into_iter().skip(1).filter(|cell| !cell.is_empty()).collect())
}

/// Values after each occurrence of a key in the row that it begins, one for every waveform.
fn values<'a>(lines: &[Line<'a>], wanted: &str) -> Vec<&'a str> {
    let rows = lines.iter().map(|line| cells(line.text));
    let mut rows = rows.filter(|row| row.first().is_some_and(|key| key.eq_ignore_ascii_case(wanted)));
    let row = rows.next().unwrap_or_default();
    let keys = (0..row.len()).filter(|at| row[*at].eq_ignore_ascii_case(wanted));
    keys.filter_map(|at| row.get(at + 1).copied()).collect()
}

/// Recognises the preamble of an instrument at the beginning of `text`; `dataset` selects one of several segments.
pub(super) fn recognise(path: &Path, text: &str, dataset: Option<usize>) -> Result<Option<Preamble>, MeasurementError> {
    let whole = lines(text);
    let Some(line) = whole.iter().find(|line| !line.text.trim().is_empty()) else { return Ok(None) };
    let first = line.text.trim_start().trim_start_matches('"');
    let begins = |words: &[&str]| {
        let first = first.trim_start_matches('#');
        words.iter().any(|word| first.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word)))
    };
    let any = |word: &str| whole.iter().take(30).any(|line| line.text.trim_start_matches(['"', ' ']).starts_with(word));
    if first.starts_with("LECROY") {
        return lecroy::lecroy(path, &whole).map(Some);
    } else if begins(&["Source File Name"]) {
        return polytec::polytec(path, &whole).map(Some);
    } else if first.starts_with("#Digilent WaveForms") {
        return Ok(Some(digilent::digilent(&whole)));
    } else if begins(&["x-axis,", "x-axis;", "x-axis\t"]) {
        return Ok(Some(Preamble { instrument: "Keysight InfiniiVision", body_line: 1, ..Preamble::default() }));
    } else if labview::begins(line) {
        return labview::labview(path, text, dataset).map(Some);
    } else if begins(&["File Format, Waveform", "File Format,Waveform"]) {
        return keysight::waveform(path, &whole).map(Some);
    } else if any("NUM_SIGS") && any("HORZ_UNITS") {
        return Ok(hioki::hioki(&whole));
    } else if any("X-Axis unit:") && any("Y-Axis unit:") {
        return Ok(axes::axes(&whole));
    } else if begins(&["waveform\t", "waveform,", "waveform;"]) {
        return Ok(labview::waveforms(&whole));
    } else if first.starts_with("#timebase=") {
        return Ok(hantek::hantek(&whole));
    } else if whole.iter().take(3).any(|line| line.text.trim_start_matches('"').starts_with("Revision:")) {
        // A title may precede Infiniium's first key.
        return keysight::infiniium(path, &whole).map(Some);
    }
    let known = if first.starts_with('%') {
        percent::percent(&whole)
    } else if begins(&["Memory Length", "Format,"]) {
        gwinstek::gwinstek(path, &whole)?
    } else if begins(&["Record Length,Analog", "Record Length,CH", "Record Length;Analog"]) {
        siglent::siglent(&whole)
    } else if begins(&["Model,", "Model;", "Model\t", "Record Length", "Firmware Version", "Point Format"]) {
        tektronix::tektronix(path, &whole)?
    } else if any("TraceName") {
        yokogawa::yokogawa(&whole)
    } else {
        rigol::rigol(&whole[whole.iter().position(|it| it.at == line.at).unwrap_or(0)..])
    };
    if known.is_some() {
        return Ok(known);
    }
    rohde_schwarz::refuse_keys(path, &whole)?;
    let beside = rohde_schwarz::beside(path, text, line)?;
    let unknown = || unknown::unknown(&whole).or_else(|| unknown::unnamed(&whole));
    Ok(beside.or_else(|| tektronix::plain(line)).or_else(unknown))
}

/// Factor from a unit of time to seconds.
fn seconds(unit: &str) -> Option<f64> {
    parse_unit(unit).ok().filter(|unit| unit.dimension == Dimension::TIME).map(|unit| unit.factor)
}

/// States where even instants are from; `grid` is the first one and their interval, s.
fn instants_from(what: &str, (start, step): (f64, f64)) -> String {
    format!("instants from {what}: {} and every {}", time(start), time(step))
}

fn missing(path: &Path, instrument: &'static str, wanted: &'static str) -> MeasurementError {
    MeasurementError::Preamble { place: Place::file(path), instrument, wanted }
}

/// Non-empty lines before line `before`.
fn statements(lines: &[Line<'_>], before: u64) -> Vec<String> {
    let above = lines.iter().filter(|line| line.number < before).map(|line| bare(line.text.trim_start_matches('#')));
    above.filter(|text| !text.is_empty()).map(str::to_owned).collect()
}
