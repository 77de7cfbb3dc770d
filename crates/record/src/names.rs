//! Names and units above the rows of a table, or the flags that stand for them.

use std::path::Path;

use granchain_signal::{Dimension, Unit};

use super::{
    Delimiter, MeasurementError, Place, ReadOptions, clock,
    column::{Column, parse_unit},
    decimal::number,
    dialect::{Dialect, cells},
    preamble::Preamble,
    separated,
    table::{Rows, is_missing, text, text_of},
    time_column::says_time,
};

/// The columns and the position of their header.
pub(super) struct Header {
    pub columns: Vec<Column>,
    pub line: Option<u64>,
    pub units_line: Option<u64>,
    /// Whether it is the comment above the rows.
    pub commented: bool,
    /// Names that no cell stands below, which are passed over.
    pub bare: Vec<String>,
}

/// Names at the end of a header that may have no cells: LabVIEW's remarks, Rigol's start and step once their row was cut off.
const BARE: [&str; 4] = ["", "comment", "start", "increment"];
/// Rows that show whether the first column rises.
const LOOKED_AT: usize = 2000;

/// The comment above the first row as a header, if it is as wide and names a time with its unit, as some programs
/// write it.
fn header_above(rows: &Rows<'_>, first: &[String], dialect: Dialect) -> Option<Vec<String>> {
    let end = rows.reader.position().byte() as usize;
    let before = std::str::from_utf8(rows.bytes.get(..end)?).ok()?.trim_end().rsplit_once('\n')?.0;
    let parted = |text: &str, by: Delimiter| cells(text, by).map(str::to_owned).collect::<Vec<String>>();
    // Programs write names with blanks or commas above rows parted otherwise.
    let named = |line: &str| {
        let comment = line.strip_prefix('#')?;
        let own = std::iter::once(dialect.delimiter);
        let mut names = own.chain(Delimiter::ALL.into_iter().rev()).map(|by| parted(comment, by));
        let names = names.find(|names| names.len() == first.len());
        names.or_else(|| Some(parted(&separated::names(comment, first.len())?, Delimiter::Tab)))
    };
    let mut above = before.lines().rev().map_while(named);
    let mut names = above.next()?;
    // Units stand below the names of gnuplot.
    if names.iter().all(|name| parse_unit(name).is_ok())
        && let Some(titles) = above.next()
    {
        names = titles.iter().zip(&names).map(|(title, unit)| format!("{title} ({unit})")).collect();
    }
    let is_time = |name: &String| {
        let column = Column::from_header(name);
        column.unit.is_some_and(|unit| unit.is_ok_and(|unit| unit.dimension == Dimension::TIME))
    };
    names.iter().any(is_time).then_some(names)
}

/// Whether any of the rows is one of numbers; else the text is no table.
pub(super) fn has_numbers(rows: &Rows<'_>, dialect: Dialect) -> bool {
    let mut below = Rows::new(rows.bytes, rows.line, dialect.delimiter);
    (0..LOOKED_AT).any(|_| {
        let cells = if below.advance() { below.cells() } else { Vec::new() };
        let is_number = |cell: &String| number(cell, dialect.decimal).is_some() || clock::instant(cell).is_some();
        cells.iter().any(is_number) && cells.iter().all(|cell| is_number(cell) || is_missing(cell))
    })
}

/// The numbers of a column in the first rows.
fn first_of(rows: &Rows<'_>, dialect: Dialect, column: usize) -> Vec<f64> {
    let mut below = Rows::new(rows.bytes, rows.line, dialect.delimiter);
    let mut found = Vec::new();
    while found.len() < LOOKED_AT && below.advance() {
        found.extend(number(text_of(&below, column), dialect.decimal));
    }
    found
}

/// Whether the first column counts every row.
pub(super) fn counts(rows: &Rows<'_>, dialect: Dialect) -> bool {
    first_of(rows, dialect, 0).windows(2).all(|pair| pair[1] - pair[0] == 1.0)
}

/// Whether a column rises from row to row, as instants do.
pub(super) fn rises(rows: &Rows<'_>, dialect: Dialect, column: usize) -> bool {
    let instants = first_of(rows, dialect, column);
    // Of rounded instants two may be the same.
    let later = instants.windows(2).filter(|pair| pair[1] > pair[0]).count();
    later > 0 && 2 * later >= instants.len() && instants.is_sorted()
}

/// The flags that stand for a header and are missing: instants, column, unit.
fn without_header(rows: &Rows<'_>, dialect: Dialect, options: &ReadOptions) -> Vec<String> {
    let width = rows.record.len();
    // Of a counter and the instants beside it those are the time.
    let time = usize::from(width > 2 && counts(rows, dialect) && rises(rows, dialect, 1));
    let rises = width > 1 && rises(rows, dialect, time);
    let mut flags = Vec::new();
    match (rises || options.time_column.is_some(), options.sample_rate) {
        (_, Some(_)) => {}
        (true, None) => {
            if width > 2 && options.time_column.is_none() {
                flags.push(format!("--read time_column={}", 1 + time));
            }
            if options.time_unit.is_none() {
                flags.push("--read time_unit=UNIT".into());
            }
        }
        (false, None) => flags.push("--sample-rate RATE".into()),
    }
    // Of two columns the one that is not time is meant.
    if options.column.is_none() && width > if rises && options.sample_rate.is_none() { 2 } else { 1 } {
        flags.push(format!("--channel {}", 1 + time + usize::from(rises)));
    }
    if options.unit.is_none() && options.scale.is_none() {
        flags.push("--unit UNIT".into());
    }
    flags
}

/// Refuses rows with one comma each and no point, which may be two whole numbers or one with a decimal comma.
fn refuse_commas(
    path: &Path,
    rows: &Rows<'_>,
    dialect: Dialect,
    options: &ReadOptions,
) -> Result<(), MeasurementError> {
    let text = std::str::from_utf8(rows.bytes).unwrap_or_default();
    let mut lines = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let of_two = options.time_column.is_some() || options.time_unit.is_some() || options.delimiter.is_some();
    let of_two = of_two || rises(rows, dialect, 0);
    let one_comma = |line: &str| line.matches(',').count() == 1 && !line.contains(['.', '"']);
    if of_two || dialect.delimiter != Delimiter::Comma || !lines.all(one_comma) {
        return Ok(());
    }
    let mut one = vec!["--read decimal=comma".to_owned()];
    if options.sample_rate.is_none() {
        one.push("--sample-rate RATE".into());
    }
    if options.unit.is_none() && options.scale.is_none() {
        one.push("--unit UNIT".into());
    }
    let mut two = without_header(rows, dialect, options);
    two.insert(0, "--read delimiter=comma".into());
    Err(MeasurementError::OneComma {
        place: Place::line(path, rows.line),
        found: rows.cells().join(","),
        one: one.join(" "),
        two: two.join(" "),
    })
}

impl Header {
    /// From the first row; afterwards `rows` stands at the first row of numbers.
    pub(crate) fn read(
        path: &Path,
        rows: &mut Rows<'_>,
        preamble: Option<&Preamble>,
        dialect: Dialect,
        options: &ReadOptions,
    ) -> Result<Self, MeasurementError> {
        let mut header = Self { columns: Vec::new(), line: None, units_line: None, commented: false, bare: Vec::new() };
        let first = rows.cells();
        let number = |cell: &String| number(cell, dialect.decimal).is_some();
        if let Some(names) = preamble.and_then(|preamble| preamble.header.as_ref()) {
            header.columns.extend(names.iter().map(|name| Column::from_header(name)));
        } else if first.iter().any(number) && first.iter().all(|cell| number(cell) || is_missing(cell)) {
            if let Some(names) = header_above(rows, &first, dialect) {
                header.columns.extend(names.iter().map(|name| Column::from_header(name)));
                header.commented = true;
                return Ok(header);
            }
            refuse_commas(path, rows, dialect, options)?;
            let flags = without_header(rows, dialect, options);
            if !flags.is_empty() {
                let found = first.join(&dialect.delimiter.character().to_string());
                let flags = flags.join(" ");
                return Err(MeasurementError::NoHeader { place: Place::line(path, rows.line), found, flags });
            }
            // Without a header the columns are known by their numbers.
            header.columns.extend((1..=first.len()).map(|number| Column::from_header(&number.to_string())));
        } else {
            if let Some(found) = first.iter().find(|cell| cell.starts_with('#') && cell.contains('=')) {
                let (from, found) = (rows.line, found.clone());
                let mut last = from;
                while rows.advance() && !rows.cells().first().is_some_and(number) {
                    last = rows.line;
                }
                return Err(MeasurementError::UnknownPreamble {
                    place: Place::line(path, from),
                    first: 1,
                    last,
                    found,
                });
            }
            header.columns.extend(first.iter().map(|cell| Column::from_header(cell)));
            header.line = Some(rows.line);
            header.next(path, rows)?;
            header.take_units(path, rows)?;
            header.drop_bare(rows);
            if preamble.is_none_or(|preamble| preamble.grid.is_none()) {
                header.mark_clocks(rows, dialect, options);
            }
        }
        if let Some((time, other)) = preamble.and_then(|preamble| preamble.units.as_ref()) {
            for column in header.columns.iter_mut().filter(|column| !column.header.is_empty()) {
                let is_time = column.name.to_lowercase().starts_with("time");
                column.add_unit_cell(if is_time { time } else { other });
            }
        }
        Ok(header)
    }

    fn next(&self, path: &Path, rows: &mut Rows<'_>) -> Result<(), MeasurementError> {
        let line = rows.line;
        if rows.advance() { Ok(()) } else { Err(MeasurementError::NoRows { place: Place::line(path, line) }) }
    }

    /// Marks a column of times of day where no other has instants; with a stated rate instants in other words are none.
    fn mark_clocks(&mut self, rows: &Rows<'_>, dialect: Dialect, options: &ReadOptions) {
        let is_time = |(column, cell): (&Column, &[u8])| {
            let says = column.dimension() == Some(Dimension::TIME) || says_time(&column.name);
            says && number(text(cell), dialect.decimal).is_some()
        };
        let timed = self.columns.iter().zip(&rows.record).any(is_time);
        let cells = rows.record.iter().map(text);
        for (column, cell) in self.columns.iter_mut().zip(cells).filter(|(column, _)| column.unit.is_none()) {
            if clock::instant(cell).is_some() && !timed {
                column.unit_text = Some(clock::UNIT.into());
                column.unit = Some(Unit::parse("s"));
            } else if options.sample_rate.is_some()
                && says_time(&column.name)
                && !is_missing(cell)
                && number(cell, dialect.decimal).is_none()
            {
                column.unit_text = Some("words".into());
                column.unit = Some(Unit::parse("1"));
            }
        }
    }

    /// Drops the names at the end that no cell of the first row stands below.
    fn drop_bare(&mut self, rows: &Rows<'_>) {
        let filled = rows.record.iter().rposition(|cell| !cell.trim_ascii().is_empty()).map_or(0, |last| last + 1);
        let from = self.columns.len() - self.columns.len().min(BARE.len());
        let is_bare = |column: &Column| BARE.contains(&column.header.to_lowercase().as_str());
        let is_labview = self.columns.first().is_some_and(|column| column.header == "X_Value");
        let keep = match self.columns.iter().skip(from).position(|column| !column.header.is_empty() && is_bare(column))
        {
            Some(at) if self.columns[from + at..].iter().all(is_bare) => from + at,
            _ => return,
        };
        // LabVIEW writes a remark into some rows only.
        let shorter = rows.record.len() < self.columns.len();
        if keep > 0 && (shorter && keep >= filled || is_labview && self.columns[keep].header == "Comment") {
            self.bare.extend(self.columns.drain(keep..).map(|column| column.header).filter(|name| !name.is_empty()));
        }
    }

    /// Takes a row of units: no cell is a number, at least one looks like a unit, none begins like a number.
    fn take_units(&mut self, path: &Path, rows: &mut Rows<'_>) -> Result<(), MeasurementError> {
        let mut cells = rows.cells();
        // A delimiter may end this row and not the one above.
        while cells.len() > self.columns.len() && cells.last().is_some_and(String::is_empty) {
            cells.pop();
        }
        let wordy =
            |cell: &String| !is_missing(cell) && !cell.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        // A channel without a unit has a dash.
        let is_unit = |cell: &String| parse_unit(cell).is_ok_and(|unit| unit.dimension != Dimension::NONE);
        if cells.iter().any(is_unit) {
            cells.iter_mut().filter(|cell| *cell == "-").for_each(String::clear);
        }
        let without = self.columns.iter().filter(|column| column.unit.is_none()).count();
        let given = self.columns.iter().zip(&cells).filter(|(column, cell)| column.unit.is_none() && !cell.is_empty());
        if cells.len() == self.columns.len()
            && cells.iter().all(|cell| cell.is_empty() || wordy(cell))
            && given.count() * 2 >= without.max(1)
        {
            for (column, cell) in self.columns.iter_mut().zip(&cells) {
                column.add_unit_cell(cell);
            }
            self.units_line = Some(rows.line);
            self.next(path, rows)?;
        }
        Ok(())
    }
}
