//! The one CSV reader: bytes → two columns of numbers in SI, with the line of whatever is wrong.
//!
//! Comma-separated text in UTF-8, with or without a byte-order mark, lines ended by LF or CR LF. Lines that begin with
//! `#` are comments and are kept. The first other line is the header; a line of units may follow it. Blank lines are
//! passed over. Memory: the file itself and 24 bytes a row.

use std::path::Path;

use csv::{ByteRecord, ReaderBuilder};

use super::{
    MeasurementError, Missing, Place, ReadOptions, RecordKind,
    column::{Chosen, Column, choose},
};

/// Most missing cells in a row that are bridged.
const BRIDGED: usize = 5;

/// What stands in a record's file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table {
    /// Comment lines without the `#`.
    pub comments: Vec<String>,
    /// Line of the header; `None` if there was none.
    pub header_line: Option<u64>,
    /// Line of the units row, if there was one.
    pub units_line: Option<u64>,
    pub columns: Vec<Column>,
    pub chosen: Chosen,
    /// Times, s.
    pub times: Vec<f64>,
    /// Values, SI.
    pub values: Vec<f64>,
    /// Line of each sample.
    pub lines: Vec<u64>,
    /// Cells that were interpolated.
    pub bridged: usize,
    /// Whether the last line has no line end.
    pub open_end: bool,
}

/// A row of cells and its line.
struct Rows<'a> {
    bytes: &'a [u8],
    reader: csv::Reader<&'a [u8]>,
    record: ByteRecord,
    counted_to: usize,
    line: u64,
}

impl<'a> Rows<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let reader = ReaderBuilder::new().has_headers(false).flexible(true).comment(Some(b'#')).from_reader(bytes);
        Self { bytes, reader, record: ByteRecord::new(), counted_to: 0, line: 1 }
    }

    /// Read the next row that is not blank; false at the end.
    fn advance(&mut self) -> bool {
        // Reading from memory with flexible rows has nothing to fail at.
        while matches!(self.reader.read_byte_record(&mut self.record), Ok(true)) {
            // The byte after the row is known, the line is counted from it: comments and blank lines have been passed over.
            let end = usize::try_from(self.reader.position().byte()).unwrap_or(usize::MAX).min(self.bytes.len());
            let last = end.saturating_sub(1).max(self.counted_to);
            self.line += self.bytes[self.counted_to..last].iter().filter(|&&byte| byte == b'\n').count() as u64;
            self.counted_to = last;
            if self.record.iter().any(|cell| !cell.trim_ascii().is_empty()) {
                return true;
            }
        }
        false
    }

    fn cells(&self) -> Vec<String> {
        self.record.iter().map(|cell| text(cell).to_owned()).collect()
    }

    /// Whether this row is the last line and the file ends within it.
    fn is_cut(&self) -> bool {
        self.reader.position().byte() as usize >= self.bytes.len() && open_end(self.bytes)
    }
}

fn open_end(bytes: &[u8]) -> bool {
    !matches!(bytes.last(), Some(b'\n' | b'\r') | None)
}

fn text(cell: &[u8]) -> &str {
    // The whole input has been checked to be UTF-8, and commas and quotes never split a character.
    std::str::from_utf8(cell).unwrap_or_default().trim()
}

fn is_missing(cell: &str) -> bool {
    matches!(
        cell.to_lowercase().as_str(),
        "" | "n/a" | "na" | "nan" | "-nan" | "+nan" | "-" | "--" | "null" | "none" | "missing"
    )
}

fn number(cell: &str) -> Option<f64> {
    cell.parse().ok()
}

/// Read the columns that `options` and the header choose.
pub(super) fn read(
    path: &Path,
    bytes: &[u8],
    kind: impl Into<Option<RecordKind>>,
    options: &ReadOptions,
) -> Result<(Table, RecordKind), MeasurementError> {
    let text = decode(path, bytes)?;
    let comments = text
        .lines()
        .filter_map(|line| line.strip_prefix('#'))
        .map(|comment| comment.trim_start_matches('#').trim().to_owned())
        .collect();
    let bytes = text.as_bytes();
    let mut rows = Rows::new(bytes);
    if !rows.advance() {
        return Err(MeasurementError::Empty { path: path.into() });
    }
    let first = rows.cells();
    refuse_delimiters(path, rows.line, text)?;

    let mut line = rows.line;
    let (mut columns, mut header_line, mut pending) = (Vec::new(), None, true);
    if first.iter().any(|cell| number(cell).is_some())
        && first.iter().all(|cell| number(cell).is_some() || is_missing(cell))
    {
        if options.time_unit.is_none() || options.unit.is_none() {
            return Err(MeasurementError::NoHeader { place: Place::line(path, line), found: first.join(",") });
        }
        // Without a header the columns are known by their numbers.
        columns.extend((1..=first.len()).map(|number| Column::from_header(&number.to_string())));
    } else {
        columns.extend(first.iter().map(|cell| Column::from_header(cell)));
        header_line = Some(line);
        pending = rows.advance();
        if !pending {
            return Err(MeasurementError::NoRows { place: Place::line(path, line) });
        }
    }
    let mut units_line = None;
    let second = rows.cells();
    // A row of units: no cell is a number, at least one looks like a unit, none begins like a number.
    let wordy =
        |cell: &String| !is_missing(cell) && !cell.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
    if header_line.is_some()
        && second.len() == columns.len()
        && second.iter().all(|cell| cell.is_empty() || wordy(cell))
        && columns.iter().zip(&second).filter(|(column, cell)| column.unit.is_none() && !cell.is_empty()).count() * 2
            >= columns.iter().filter(|column| column.unit.is_none()).count().max(1)
    {
        for (column, cell) in columns.iter_mut().zip(&second) {
            column.add_unit_cell(cell);
        }
        (units_line, line) = (Some(rows.line), rows.line);
        pending = rows.advance();
        if !pending {
            return Err(MeasurementError::NoRows { place: Place::line(path, line) });
        }
    }
    let kind = kind.into().unwrap_or_else(|| guess_kind(path, &columns, options));
    let header_at = header_line.unwrap_or(line);
    let chosen = choose(path, units_line.unwrap_or(header_at), &mut columns, kind, options)?;

    let mut table = Table {
        comments,
        header_line,
        units_line,
        columns,
        chosen,
        times: Vec::with_capacity(bytes.len() / 24),
        values: Vec::with_capacity(bytes.len() / 24),
        lines: Vec::with_capacity(bytes.len() / 24),
        bridged: 0,
        open_end: open_end(bytes),
    };
    let mut gap = 0;
    while pending {
        table.take(path, &rows, options.missing, &mut gap)?;
        pending = rows.advance();
    }
    if gap > 0 {
        let place = table.cell(path, rows.line, table.chosen.value);
        return Err(MeasurementError::GapTooLong { place, found: gap, limit: BRIDGED });
    }
    Ok((table, kind))
}

impl Table {
    fn cell(&self, path: &Path, line: u64, column: usize) -> Place {
        Place::cell(path, line, &self.columns[column].header)
    }

    fn take(
        &mut self,
        path: &Path,
        rows: &Rows<'_>,
        missing: Missing,
        gap: &mut usize,
    ) -> Result<(), MeasurementError> {
        if rows.record.len() != self.columns.len() {
            return Err(MeasurementError::Ragged {
                place: Place::line(path, rows.line),
                expected: self.columns.len(),
                found: rows.record.len(),
                cut: rows.is_cut(),
            });
        }
        let time = self.number(path, rows, self.chosen.time)? * self.chosen.time_factor;
        if let Some(&previous) = self.times.last() {
            // Written so that it also catches what cannot be compared.
            if !(time > previous) {
                let place = self.cell(path, rows.line, self.chosen.time);
                return Err(MeasurementError::TimeNotIncreasing { place, previous, found: time });
            }
        }
        self.times.push(time);
        self.lines.push(rows.line);
        let cell = text(rows.record.get(self.chosen.value).unwrap_or_default());
        if missing == Missing::Interpolate && is_missing(cell) {
            *gap += 1;
            if *gap > BRIDGED || self.values.is_empty() {
                let place = self.cell(path, rows.line, self.chosen.value);
                return Err(MeasurementError::GapTooLong { place, found: *gap, limit: BRIDGED });
            }
            return Ok(());
        }
        let value = self.number(path, rows, self.chosen.value)? * self.chosen.value_unit.factor;
        if *gap > 0 {
            let before = self.values[self.values.len() - 1];
            for i in 1..=*gap {
                self.values.push(before + (value - before) * i as f64 / (*gap + 1) as f64);
            }
            self.bridged += *gap;
            *gap = 0;
        }
        self.values.push(value);
        Ok(())
    }

    fn number(&self, path: &Path, rows: &Rows<'_>, column: usize) -> Result<f64, MeasurementError> {
        let cell = text(rows.record.get(column).unwrap_or_default());
        let place = || self.cell(path, rows.line, column);
        if is_missing(cell) {
            return Err(MeasurementError::MissingValue { place: place(), found: cell.into() });
        }
        match number(cell) {
            Some(value) if value.is_finite() => Ok(value),
            Some(_) => Err(MeasurementError::Infinite { place: place(), found: cell.into() }),
            None => Err(MeasurementError::NotANumber { place: place(), found: shortened(cell), cut: rows.is_cut() }),
        }
    }
}

fn shortened(cell: &str) -> String {
    const LONGEST: usize = 40;
    if cell.chars().count() <= LONGEST { cell.into() } else { cell.chars().take(LONGEST).chain(['…']).collect() }
}

/// Bytes → text without byte-order mark, or what else the bytes seem to be.
fn decode<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a str, MeasurementError> {
    let binary = |found: &str| MeasurementError::Binary { path: path.into(), found: found.into() };
    for (magic, what) in [
        (&b"PK\x03\x04"[..], "a zip archive or a spreadsheet (.xlsx)"),
        (b"\xd0\xcf\x11\xe0", "an old spreadsheet (.xls)"),
        (b"\x89HDF", "an HDF5 file (or MATLAB 7.3)"),
        (b"MATLAB 5.0", "a MATLAB file"),
        (b"RIFF", "a RIFF (WAV) file"),
        (b"\x1f\x8b", "gzip-compressed data"),
        (b"\xff\xfe", "UTF-16 text"),
        (b"\xfe\xff", "UTF-16 text"),
    ] {
        if bytes.starts_with(magic) {
            return Err(binary(what));
        }
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.trim_ascii().is_empty() {
        return Err(MeasurementError::Empty { path: path.into() });
    }
    let odd = |byte: u8| (byte < 0x20 && !matches!(byte, b'\t' | b'\n' | b'\r' | 0x0c)) || byte == 0x7f;
    if let Some(at) = bytes.iter().position(|&byte| odd(byte)) {
        return Err(binary(&format!("byte 0x{:02x} at offset {at}", bytes[at])));
    }
    std::str::from_utf8(bytes).map_err(|error| {
        let at = error.valid_up_to();
        let line = 1 + bytes[..at].iter().filter(|&&byte| byte == b'\n').count() as u64;
        MeasurementError::NotUtf8 { place: Place::line(path, line), byte: bytes[at] }
    })
}

/// Semicolons or tabs in the first line that is no comment.
fn refuse_delimiters(path: &Path, line: u64, text: &str) -> Result<(), MeasurementError> {
    let header = text.lines().find(|line| !line.starts_with('#') && !line.trim().is_empty()).unwrap_or_default();
    let commas = header.matches(',').count();
    for (delimiter, name) in [(';', "semicolons"), ('\t', "tabs")] {
        if header.matches(delimiter).count() > commas {
            return Err(MeasurementError::Delimiter { place: Place::line(path, line), delimiter: name });
        }
    }
    Ok(())
}

/// A record of unsaid kind is a horn-tip record if it is named so or holds no velocity but a displacement.
fn guess_kind(path: &Path, columns: &[Column], options: &ReadOptions) -> RecordKind {
    use crate::signal::Dimension;
    let named_horn = path
        .file_name()
        .map(|name| name.to_string_lossy().to_lowercase())
        .is_some_and(|name| name.contains("horn") || name.contains("tip") || name.contains("drive"));
    let dimension =
        |column: &Column| column.unit.as_ref().and_then(|unit| unit.as_ref().ok()).map(|unit| unit.dimension);
    let has = |wanted| columns.iter().any(|column| dimension(column) == Some(wanted));
    let flag = options.unit.as_deref().and_then(|unit| super::column::parse_unit(unit).ok()).map(|unit| unit.dimension);
    let displacement = match flag {
        Some(dimension) => dimension == Dimension::LENGTH,
        None => has(Dimension::LENGTH) && !has(Dimension::VELOCITY),
    };
    if named_horn || displacement { RecordKind::HornTip } else { RecordKind::Vibrometer }
}
