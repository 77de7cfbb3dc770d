//! The data sets of a universal file and the headers of its functions.

use std::{borrow::Cow, path::Path};

use encoding_rs::WINDOWS_1252;

use super::{
    super::Place,
    ByteOrder, Precision, UniversalError,
    number::{Numbers, number},
};

/// Position in the file's bytes, and the line there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cursor {
    pub at: usize,
    /// Line of the byte at `at`, from 1.
    pub line: u64,
}

impl Cursor {
    /// The next line without its end (LF, CR LF, CR CR LF), and its number.
    pub(super) fn next_line<'a>(&mut self, bytes: &'a [u8]) -> Option<(&'a [u8], u64)> {
        let rest = bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&byte| byte == b'\n').map_or(rest.len(), |end| end + 1);
        let line = self.line;
        self.at += length;
        self.line += 1;
        let mut text = &rest[..length];
        while let [before @ .., b'\n' | b'\r'] = text {
            text = before;
        }
        Some((text, line))
    }

    /// Pass over bytes that are no lines of text, and count the line feeds among them as lines.
    pub(super) fn pass_over(&mut self, bytes: &[u8], to: usize) {
        self.line += bytes[self.at..to].iter().filter(|&&byte| byte == b'\n').count() as u64;
        self.at = to;
    }
}

/// UTF-8, else Windows-1252: headers name people and places.
pub(super) fn text(line: &[u8]) -> Cow<'_, str> {
    std::str::from_utf8(line).map_or_else(|_| WINDOWS_1252.decode_without_bom_handling(line).0, Cow::Borrowed)
}

pub(super) fn is_mark(line: &[u8]) -> bool {
    line.trim_ascii() == b"-1"
}

/// An axis of a function.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Axis {
    /// Specific data type: 8 displacement, 11 velocity, 17 time, …
    pub quantity: i64,
    /// Exponents of length, force and temperature.
    pub exponents: [i64; 3],
    /// Label and unit; empty where `NONE`.
    pub label: String,
    pub unit: String,
}

/// How the values of a function stand in the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Binary {
    pub order: ByteOrder,
    pub bytes: usize,
}

/// The header of a function (data set 58).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Head {
    /// Line of its first `-1`.
    pub line: u64,
    pub title: String,
    pub function: i64,
    pub node: String,
    pub complex: bool,
    pub precision: Precision,
    pub count: usize,
    pub even: bool,
    pub start: f64,
    pub step: f64,
    /// Significant digits with which the step is written.
    pub digits: usize,
    pub abscissa: Axis,
    pub ordinate: Axis,
    pub denominator: Axis,
    pub binary: Option<Binary>,
    pub data: Cursor,
    /// The line behind which they begin, for messages.
    pub data_line: u64,
}

pub(super) const FUNCTIONS: [&str; 28] = [
    "general function",
    "time response",
    "auto spectrum",
    "cross spectrum",
    "frequency response",
    "transmissibility",
    "coherence",
    "auto correlation",
    "cross correlation",
    "power spectral density",
    "energy spectral density",
    "probability density",
    "spectrum",
    "cumulative distribution",
    "peaks and valleys",
    "stress cycles",
    "strain cycles",
    "orbit",
    "mode indicator",
    "force pattern",
    "partial power",
    "partial coherence",
    "eigenvalue",
    "eigenvector",
    "shock response spectrum",
    "impulse response filter",
    "multiple coherence",
    "order function",
];

impl Head {
    pub(super) fn kind(&self) -> &'static str {
        usize::try_from(self.function).ok().and_then(|kind| FUNCTIONS.get(kind)).copied().unwrap_or("unknown function")
    }

    pub(super) fn described(&self, number: usize) -> String {
        let of = |axis: &Axis| match (axis.label.as_str(), axis.unit.as_str()) {
            ("", "") => format!("quantity {}", axis.quantity),
            (label, "") => label.to_owned(),
            ("", unit) => format!("in {unit}"),
            (label, unit) => format!("{label} in {unit}"),
        };
        let title = if self.title.is_empty() { String::new() } else { format!(", `{}`", self.title) };
        let node = if self.node.is_empty() { String::new() } else { format!(" at {}", self.node) };
        let (kind, count, line) = (self.kind(), self.count, self.line);
        format!("{number}: {kind}{node}, {}, {count} values, line {line}{title}", of(&self.ordinate))
    }

    /// Read the eleven lines that follow the identifier; `id` is the identifier's line.
    pub(super) fn read(
        path: &Path,
        bytes: &[u8],
        cursor: &mut Cursor,
        id: (&str, u64),
    ) -> Result<Self, UniversalError> {
        let mut lines = Vec::with_capacity(11);
        for _ in 0..11 {
            let Some((line, number)) = cursor.next_line(bytes) else {
                return Err(UniversalError::Header {
                    place: Place::line(path, cursor.line.saturating_sub(1)),
                    expected: "eleven lines of header and values behind them",
                    found: "the end of the file".into(),
                });
            };
            lines.push((text(line), number));
        }
        let malformed = |record: usize, expected: &'static str| {
            let (line, number) = &lines[record - 1];
            let found = line.trim().chars().take(80).collect();
            UniversalError::Header { place: Place::line(path, *number), expected, found }
        };
        let kind = integer(columns(&lines[5].0, 0, 5)).or_else(|| integer(lines[5].0.split_whitespace().next()?));
        let form = "ordinate type, number of values, spacing, first abscissa, step (3I10,3E13.5)";
        let seventh = &lines[6].0;
        let fixed = || {
            let whole = |from| integer(columns(seventh, from, from + 10));
            let real = |from| number(columns(seventh, from, from + 13));
            Some((whole(0)?, whole(10)?, whole(20)?, real(30)?, real(43)?, columns(seventh, 43, 56)))
        };
        let free = || {
            let words: Vec<&str> = seventh.split_whitespace().collect();
            let &[kind, count, spacing, start, step, ..] = &words[..] else { return None };
            Some((integer(kind)?, integer(count)?, integer(spacing)?, number(start)?, number(step)?, step))
        };
        let (data, count, spacing, start, step, written) = fixed().or_else(free).ok_or_else(|| malformed(7, form))?;
        let (complex, precision) = match data {
            2 => (false, Precision::Single),
            4 => (false, Precision::Double),
            5 => (true, Precision::Single),
            6 => (true, Precision::Double),
            _ => return Err(malformed(7, "an ordinate type of 2, 4, 5 or 6")),
        };
        let count = usize::try_from(count).map_err(|_| malformed(7, form))?;
        if !matches!(spacing, 0 | 1) {
            return Err(malformed(7, "a spacing of 0 (uneven) or 1 (even)"));
        }
        if spacing == 1 && !complex && !(step > 0.0 && step.is_finite() && start.is_finite()) {
            return Err(malformed(7, "a positive step of the abscissa"));
        }
        let mantissa = written.trim().split(['E', 'e', 'D', 'd']).next().unwrap_or_default();
        let digits = mantissa.trim_start_matches(['+', '-', '0', '.']).bytes().filter(u8::is_ascii_digit).count();
        let axis = |record: usize| axis(&lines[record - 1].0).ok_or_else(|| malformed(record, AXIS));
        let node = node(&lines[5].0);
        Ok(Self {
            line: id.1 - 1,
            title: named(lines[0].0.trim()),
            function: kind.ok_or_else(|| malformed(6, "a function type (I5) and degrees of freedom"))?,
            node,
            complex,
            precision,
            count,
            even: spacing == 1,
            start,
            step,
            digits,
            abscissa: axis(8)?,
            ordinate: axis(9)?,
            denominator: axis(10)?,
            binary: binary(path, id)?,
            data: *cursor,
            data_line: cursor.line,
        })
    }
}

const AXIS: &str = "quantity, three exponents, label and unit of an axis (I10,3I5,2(1X,A20))";

/// Field 3 to 6 of the identifier of 58b.
fn binary(path: &Path, (id, line): (&str, u64)) -> Result<Option<Binary>, UniversalError> {
    let Some((_, rest)) = id.split_once(['b', 'B']) else { return Ok(None) };
    let fields: Vec<i64> = rest.split_whitespace().map_while(integer).collect();
    let unknown =
        || UniversalError::Format { place: Place::line(path, line), found: id.trim().chars().take(80).collect() };
    let &[order, format, _, bytes, ..] = &fields[..] else { return Err(unknown()) };
    let order = match order {
        1 => ByteOrder::Little,
        2 => ByteOrder::Big,
        _ => return Err(unknown()),
    };
    let bytes = usize::try_from(bytes).map_err(|_| unknown())?;
    if format == 2 { Ok(Some(Binary { order, bytes })) } else { Err(unknown()) }
}

/// Characters `from`..`to` of a line, fewer where it ends.
fn columns(line: &str, from: usize, to: usize) -> &str {
    let at = |column: usize| line.char_indices().nth(column).map_or(line.len(), |(at, _)| at);
    &line[at(from)..at(to)]
}

fn integer(field: &str) -> Option<i64> {
    let field = field.trim();
    field.parse().ok().or_else(|| number(field).filter(|it| it.fract() == 0.0 && it.abs() < 1e15).map(|it| it as i64))
}

fn named(text: &str) -> String {
    let text = text.trim_matches(|letter: char| letter.is_whitespace() || letter == '\0');
    if text.eq_ignore_ascii_case("none") { String::new() } else { text.to_owned() }
}

fn axis(line: &str) -> Option<Axis> {
    let fields = [(0, 10), (10, 15), (15, 20), (20, 25)].map(|(from, to)| integer(columns(line, from, to)));
    if let [Some(quantity), Some(length), Some(force), Some(temperature)] = fields {
        return Some(Axis {
            quantity,
            exponents: [length, force, temperature],
            label: named(columns(line, 26, 46)),
            unit: named(columns(line, 47, 67)),
        });
    }
    // Columns have shifted, or the line is short: the numbers in order, then words if there are two.
    let words: Vec<&str> = line.split_whitespace().collect();
    let numbers: Vec<i64> = words.iter().take(4).map_while(|word| integer(word)).collect();
    let quantity = *numbers.first()?;
    let exponent = |i: usize| numbers.get(i).copied().unwrap_or(0);
    let rest = words.get(numbers.len()..).unwrap_or_default();
    let (label, unit) = match rest {
        [label, unit] => (named(label), named(unit)),
        [] => (String::new(), String::new()),
        _ => return None,
    };
    Some(Axis { quantity, exponents: [exponent(1), exponent(2), exponent(3)], label, unit })
}

/// Response node and direction, such as `12+Z`.
fn node(line: &str) -> String {
    let (Some(node), Some(direction)) = (integer(columns(line, 41, 51)), integer(columns(line, 51, 55))) else {
        return String::new();
    };
    let axes = ["", "X", "Y", "Z", "RX", "RY", "RZ"];
    let axis = usize::try_from(direction.abs()).ok().and_then(|axis| axes.get(axis)).copied().unwrap_or_default();
    let sign = if axis.is_empty() {
        ""
    } else if direction < 0 {
        "-"
    } else {
        "+"
    };
    format!("{node}{sign}{axis}")
}

/// Units of data set 164: the factor by which lengths in the file are divided to become metres.
pub(super) fn length_factor(bytes: &[u8], cursor: &mut Cursor) -> Option<f64> {
    let (first, _) = cursor.next_line(bytes)?;
    if is_mark(first) {
        return None;
    }
    let (second, _) = cursor.next_line(bytes)?;
    let factor = Numbers::new(&text(second)).next()?.ok()?;
    (factor > 0.0 && factor.is_finite()).then_some(factor)
}
