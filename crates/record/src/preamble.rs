//! What instruments write above their rows: which instrument it was, where the table begins, what it states about it.
//!
//! | instrument | told by | what is taken from it |
//! |---|---|---|
//! | Keysight InfiniiVision | header `x-axis,1` | – (units stand in the second row) |
//! | Keysight Infiniium | `XInc:` … `Data:` | units, instants where the rows have none, number of points |
//! | LeCroy | `LECROY…,…,Waveform` | segments; seconds and volts, which are not written |
//! | Tektronix | `Record Length`, `Sample Interval` | units, sample interval, number of points |
//! | Digilent WaveForms | `#Digilent WaveForms` | sample rate, number of points |
//! | Polytec | `Source File Name:` | – |
//!
//! Rohde & Schwarz needs nothing: its header is `in s,C1 in V`.

use std::path::Path;

use granchain_signal::{Dimension, Quantity};

use super::{DecimalSign, MeasurementError, Place, column::parse_unit, decimal};

/// What stands above a table.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Preamble {
    pub instrument: &'static str,
    /// Byte in the text at which the table begins with its header, or with its first row where `header` is given.
    pub body: usize,
    /// Line of that byte.
    pub body_line: u64,
    /// Names of the columns, where they do not stand in the table; empty for those that hold no samples.
    pub header: Option<Vec<String>>,
    /// Unit of time, and of everything else.
    pub units: Option<(String, String)>,
    /// First instant and sample interval (s) of rows without a time.
    pub grid: Option<(f64, f64)>,
    /// Sample interval of the acquisition, s.
    pub interval: Option<f64>,
    /// Announced number of rows.
    pub points: Option<usize>,
    /// Number of segments and rows of each.
    pub segments: Option<(usize, usize)>,
    /// The preamble's lines, as comments.
    pub statements: Vec<String>,
    /// What is assumed because of it.
    pub assumptions: Vec<String>,
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

    /// Key and value parted by a colon; the first value of several.
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

/// The preamble of a known instrument at the beginning of `text`.
pub(super) fn recognise(path: &Path, text: &str) -> Result<Option<Preamble>, MeasurementError> {
    // A plain file is not even cut into lines.
    let first = text.trim_start().lines().next().unwrap_or_default().trim_start_matches('"');
    let begins = |words: &[&str]| {
        let first = first.trim_start_matches('#');
        words.iter().any(|word| first.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word)))
    };
    let preamble = if first.starts_with("LECROY") {
        lecroy(path, &lines(text))?
    } else if begins(&["Source File Name"]) {
        polytec(path, &lines(text))?
    } else if first.starts_with("#Digilent WaveForms") {
        digilent(&lines(text))
    } else if begins(&["x-axis,", "x-axis;", "x-axis\t"]) {
        Preamble { instrument: "Keysight InfiniiVision", body_line: 1, ..Preamble::default() }
    } else if begins(&["Model,", "Model;", "Model\t", "Record Length", "Firmware Version", "Point Format"]) {
        let Some(preamble) = tektronix(path, &lines(text))? else { return Ok(None) };
        preamble
    } else {
        // A title may precede Infiniium's first key.
        let begins_so = text.lines().take(3).any(|line| line.trim_start_matches('"').starts_with("Revision:"));
        if !begins_so {
            return Ok(None);
        }
        infiniium(path, &lines(text))?
    };
    Ok(Some(preamble))
}

fn missing(path: &Path, instrument: &'static str, wanted: &'static str) -> MeasurementError {
    MeasurementError::Preamble { place: Place::file(path), instrument, wanted }
}

/// `LECROY…,serial,Waveform` / `Segments,n,SegmentSize,m` / `Segment,TrigTime,TimeSinceSegment1` / `#1,…` / `Time,Ampl`.
fn lecroy(path: &Path, lines: &[Line<'_>]) -> Result<Preamble, MeasurementError> {
    let header = lines.iter().find(|line| line.text.trim_start_matches('"').starts_with("Time"));
    let header = header.ok_or_else(|| missing(path, "LeCroy", "a line `Time,Ampl` above the rows"))?;
    let segments = lines.iter().find_map(|line| {
        let cells: Vec<&str> = line.text.split([',', ';', '\t']).map(str::trim).collect();
        match cells[..] {
            ["Segments", number, "SegmentSize", size, ..] => Some((count(number)?, count(size)?)),
            _ => None,
        }
    });
    Ok(Preamble {
        instrument: "LeCroy",
        body: header.at,
        body_line: header.number,
        units: Some(("s".into(), "V".into())),
        points: segments.map(|(number, size)| number.saturating_mul(size)),
        segments,
        statements: statements(lines, header.number),
        assumptions: vec!["LeCroy writes no units: time taken in s, amplitude in V".into()],
        ..Preamble::default()
    })
}

/// `Source File Name:` and other keys, a blank line, a header, a row of units in brackets.
fn polytec(path: &Path, lines: &[Line<'_>]) -> Result<Preamble, MeasurementError> {
    // The header is the line above the units, which stand in brackets.
    let bracketed = |line: &Line<'_>| line.text.trim_start().starts_with('[') && line.text.trim_end().ends_with(']');
    let header = lines
        .windows(2)
        .find(|pair| bracketed(&pair[1]))
        .map(|pair| pair[0])
        .ok_or_else(|| missing(path, "Polytec", "a line of units such as `[ s ]	[ m/s ]` below the header"))?;
    Ok(Preamble {
        instrument: "Polytec",
        body: header.at,
        body_line: header.number,
        statements: statements(lines, header.number),
        ..Preamble::default()
    })
}

/// `#Digilent WaveForms Oscilloscope Acquisition`, further `#` lines, `Time (s),Channel 1 (V)`.
fn digilent(lines: &[Line<'_>]) -> Preamble {
    let keys = || lines.iter().take_while(|line| line.text.starts_with('#')).filter_map(Line::keyed);
    let rate = keys().find(|(key, _)| *key == "Sample rate").map(|(_, value)| value);
    let rate = rate.and_then(|value| Quantity::parse_as(value, Dimension::FREQUENCY).ok()).filter(|rate| *rate > 0.0);
    Preamble {
        instrument: "Digilent WaveForms",
        body_line: 1,
        interval: rate.map(|rate| 1.0 / rate),
        points: keys().find(|(key, _)| *key == "Samples").and_then(|(_, value)| count(value)),
        ..Preamble::default()
    }
}

/// Keys and values above a header `TIME,CH1`, or beside the first rows (`Record Length,2500,,-0.1,0.02`).
fn tektronix(path: &Path, lines: &[Line<'_>]) -> Result<Option<Preamble>, MeasurementError> {
    let pairs = || lines.iter().filter_map(Line::pair);
    let value = |wanted: &str| {
        let found = pairs().find(|(key, value)| key.eq_ignore_ascii_case(wanted) && !value.is_empty());
        found.map(|(_, value)| value)
    };
    let (Some(length), Some(interval)) = (value("Record Length"), value("Sample Interval")) else { return Ok(None) };
    let unit = |key: &str| value(key).map(str::to_owned);
    let time = match unit("Horizontal Units") {
        // `S` is what some of them call a second.
        Some(unit) if unit == "S" => "s".to_owned(),
        Some(unit) => unit,
        None => "s".to_owned(),
    };
    let amplitude = unit("Vertical Units").unwrap_or_else(|| "V".to_owned());
    let seconds = parse_unit(&time).ok().filter(|unit| unit.dimension == Dimension::TIME).map(|unit| unit.factor);
    let assumptions = [("Horizontal Units", "time taken in s"), ("Vertical Units", "amplitude taken in V")]
        .into_iter()
        .filter(|(key, _)| unit(key).is_none())
        .map(|(key, taken)| format!("Tektronix states no `{key}`: {taken}"))
        .collect();
    let mut preamble = Preamble {
        instrument: "Tektronix",
        units: Some((time, amplitude)),
        interval: number(interval).filter(|value| *value > 0.0).zip(seconds).map(|(value, factor)| value * factor),
        points: count(length),
        assumptions,
        ..Preamble::default()
    };
    let header = lines.iter().find(|line| {
        line.text.trim_start_matches(['#', '"']).get(..4).is_some_and(|start| start.eq_ignore_ascii_case("time"))
            && line.text.contains([',', ';', '\t'])
    });
    if let Some(header) = header {
        preamble.statements = statements(lines, header.number);
        // The header of some is a comment.
        let marks = header.text.len() - header.text.trim_start_matches('#').len();
        (preamble.body, preamble.body_line) = (header.at + marks, header.number);
        return Ok(Some(preamble));
    }
    // Keys beside the rows: two or three columns of them, then time and value.
    let Some(first) = lines.first() else { return Ok(None) };
    let delimiter = first.text.chars().find(|letter| matches!(letter, ',' | ';' | '\t')).unwrap_or(',');
    let cells: Vec<&str> = first.text.split(delimiter).map(str::trim).collect();
    let values = cells.iter().skip(2).position(|cell| number(cell).is_some()).map(|at| at + 2);
    let Some(at) = values.filter(|at| at + 1 < cells.len()) else {
        return Err(missing(path, "Tektronix", "a header `TIME,CH1`, or rows beside the keys"));
    };
    let source = value("Source").unwrap_or("value").to_owned();
    let width = cells.len() - usize::from(cells.last().is_some_and(|cell| cell.is_empty()));
    preamble.header = Some(
        (0..width)
            .map(|i| match i {
                _ if i == at => "TIME".to_owned(),
                _ if i == at + 1 => source.clone(),
                _ => String::new(),
            })
            .collect(),
    );
    preamble.body_line = 1;
    Ok(Some(preamble))
}

/// `Revision:,0` … `XInc:,1e-7` … `Data:`, then values, or instants and values.
fn infiniium(path: &Path, lines: &[Line<'_>]) -> Result<Preamble, MeasurementError> {
    let data = lines.iter().position(|line| bare(line.text).eq_ignore_ascii_case("data"));
    let data = data.filter(|at| at + 1 < lines.len());
    let at = data.ok_or_else(|| missing(path, "Keysight Infiniium", "a line `Data:` with rows below it"))?;
    let first = lines[at + 1];
    let pairs = || lines[..at].iter().filter_map(Line::keyed);
    let value = |wanted: &str| pairs().find(|(key, _)| *key == wanted).map(|(_, value)| value);
    let unit = |key: &str, usual: &str| value(key).filter(|unit| !unit.is_empty()).unwrap_or(usual).to_owned();
    let units = (unit("XUnits", "Second"), unit("YUnits", "Volt"));
    let seconds = parse_unit(&units.0).ok().filter(|unit| unit.dimension == Dimension::TIME).map(|unit| unit.factor);
    let origin = value("XOrg").and_then(number);
    let step = value("XInc").and_then(number).filter(|step| *step > 0.0);
    let grid = match (origin, step, seconds) {
        (Some(origin), Some(step), Some(factor)) => Some((origin * factor, step * factor)),
        _ => None,
    };
    let cells = first.text.split([',', ';', '\t']).filter(|cell| !cell.trim().is_empty()).count();
    let timed = cells > 1;
    if !timed && grid.is_none() {
        return Err(missing(path, "Keysight Infiniium", "`XOrg`, `XInc` and `XUnits`, for the rows have no instants"));
    }
    let mut assumptions = Vec::new();
    if let (false, Some((start, step))) = (timed, grid) {
        assumptions.push(format!("instants from XOrg and XInc: {start:e} s and every {step:e} s"));
    }
    Ok(Preamble {
        instrument: "Keysight Infiniium",
        body: first.at,
        body_line: first.number,
        header: Some(if timed { vec!["time".into(), "value".into()] } else { vec!["value".into()] }),
        units: Some(units),
        grid: grid.filter(|_| !timed),
        interval: grid.map(|(_, step)| step),
        points: value("Points").and_then(count),
        statements: statements(lines, first.number),
        assumptions,
        ..Preamble::default()
    })
}

/// The lines before line `before` that say something.
fn statements(lines: &[Line<'_>], before: u64) -> Vec<String> {
    let above = lines.iter().filter(|line| line.number < before).map(|line| bare(line.text.trim_start_matches('#')));
    above.filter(|text| !text.is_empty()).map(str::to_owned).collect()
}
