//! Lines above a table by an unknown instrument.

use super::{
    super::{
        column::{Column, is_counter},
        dialect::row_delimiter,
    },
    Line, Preamble, cells, number, parse_unit,
};

/// Rows of numbers that make a table.
const ROWS: usize = 4;

/// Beginnings of the name of a time column.
const TIMES: [&str; 7] = ["time", "zeit", "temps", "second", "t ", "t(", "t["];

/// A header below other lines that names a time or a counter and is as wide as the rows of numbers below it; a row of
/// units may follow it.
pub(super) fn unknown(lines: &[Line<'_>]) -> Option<Preamble> {
    let rows: Vec<Vec<&str>> = lines.iter().map(|line| cells(line.text)).collect();
    let filled = |row: &[&str]| row.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    let is_row = |row: &[&str]| filled(row) > 1 && row[..filled(row)].iter().all(|cell| number(cell).is_some());
    let wide = |at: usize| {
        let width = filled(&rows[at]);
        (0..ROWS).all(|next| rows.get(at + next).is_some_and(|row| is_row(row) && filled(row) == width))
    };
    let first = (0..rows.len()).find(|at| wide(*at))?;
    let width = filled(&rows[first]);
    let words = |at: usize| filled(&rows[at]) == width && rows[at].iter().all(|cell| number(cell).is_none());
    let named = |at: usize| {
        let name = rows[at].first().map(|name| name.to_lowercase()).unwrap_or_default();
        let counts = is_counter(&name) && !name.is_empty();
        words(at) && (name == "t" || counts || TIMES.iter().any(|time| name.starts_with(time)))
    };
    let mut header = [1, 2].into_iter().filter_map(|above| first.checked_sub(above)).find(|at| named(*at))?;
    // `Second,Volt` are units of the names above them.
    if header > 0 && words(header - 1) && parse_unit(rows[header][0]).is_ok() {
        header -= 1;
    }
    // A header in the first line is read anyway, and so is what stands below comments alone.
    let speaks = |line: &Line<'_>| !line.text.trim().is_empty() && !line.text.starts_with('#');
    if !lines[..header].iter().any(speaks) || (header + 1 < first && !words(header + 1)) {
        return None;
    }
    let line = &lines[header];
    Some(passed_over(line, lines, "header"))
}

/// Rows without names below several lines of text, the last of which may be the name of a single column.
pub(super) fn unnamed(lines: &[Line<'_>]) -> Option<Preamble> {
    let has_text = |line: &&Line<'_>| !line.text.trim().is_empty() && !line.text.starts_with('#');
    let filled: Vec<&Line<'_>> = lines.iter().filter(has_text).collect();
    let shape = |line: &Line<'_>| {
        let delimiter = row_delimiter(line.text, None)?;
        Some((delimiter, line.text.split(delimiter.character()).count()))
    };
    let first = filled.iter().position(|line| shape(line).is_some())?;
    let (delimiter, width) = shape(filled[first])?;
    let is_table = filled[first..].iter().take(ROWS).all(|line| shape(line) == Some((delimiter, width)));
    if first < 2 || filled.len() < first + ROWS || !is_table {
        return None;
    }
    let last = filled[first - 1].text;
    let parts = last.split([',', ';', '\t']).filter(|cell| !cell.trim().is_empty()).count();
    // A row of remarks below names may be blank.
    let is_wide = parts > 1 || last.split(delimiter.character()).count() == width;
    let is_names = width > 1 && is_wide && !last.contains(['=', ':']);
    if is_names || parse_unit(last).is_ok() {
        return None;
    }
    let named = width == 1 && Column::from_header(last).dimension().is_some();
    let line = filled[first - usize::from(named)];
    Some(passed_over(line, lines, "rows"))
}

fn passed_over(line: &Line<'_>, lines: &[Line<'_>], what: &str) -> Preamble {
    let assumptions = vec![format!("lines 1 to {} above the {what} are passed over", line.number - 1)];
    Preamble { assumptions, ..Preamble::above("unknown", line, lines) }
}
