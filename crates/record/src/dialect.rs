//! Delimiter and decimal sign of a table.

use std::path::Path;

use super::{DecimalSign, MeasurementError, Place, ReadOptions, choice::choice, clock, decimal, table::is_missing};

choice! {
    /// What stands between two cells of a row.
    pub enum Delimiter {
        /// ,
        #[default]
        Comma = "comma",
        /// ;
        Semicolon = "semicolon",
        /// A tabulator
        Tab = "tab",
    }
}

impl Delimiter {
    pub(super) const ALL: [Self; 3] = [Self::Semicolon, Self::Tab, Self::Comma];

    #[must_use]
    pub(crate) fn character(self) -> char {
        char::from(self.byte())
    }

    pub(super) fn byte(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab => b'\t',
        }
    }

    /// Its name in messages, in the plural.
    #[must_use]
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Comma => "commas",
            Self::Semicolon => "semicolons",
            Self::Tab => "tabs",
        }
    }
}

/// Delimiter and decimal sign of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Dialect {
    pub delimiter: Delimiter,
    pub decimal: DecimalSign,
}

/// Lines searched for the first row of numbers.
const SEARCHED_LINES: usize = 400;
/// Rows of numbers that decide the decimal sign. Every later row must agree with them.
const SAMPLED_ROWS: usize = 50;

/// Detects the dialect from the first rows of numbers in `text`, whose first line is line `first` of the file.
///
/// A row of numbers is a line whose cells are all numbers or missing, under one of the delimiters. Semicolons and tabs
/// always separate cells; commas do if there is neither. The first rows decide the decimal sign. If both signs occur,
/// or if all numbers may have thousands separators, the file is refused.
pub(super) fn detect(path: &Path, text: &str, first: u64, options: &ReadOptions) -> Result<Dialect, MeasurementError> {
    let lines = || {
        let numbered = text.lines().zip(first..);
        numbered.filter(|(line, _)| !line.starts_with('#') && !line.trim().is_empty()).take(SEARCHED_LINES)
    };
    // Decimal commas in one column: nothing parts its cells.
    let is_one = |line: &str| {
        decimal::number(line.trim(), DecimalSign::Comma).is_some() || !line.contains([',', ';', '\t', '"'])
    };
    let one = options.decimal == Some(DecimalSign::Comma) && lines().all(|(line, _)| is_one(line));
    let wanted = options.delimiter.or(one.then_some(Delimiter::Semicolon));
    let mut rows = lines().filter_map(|(line, at)| Some((row_delimiter(line, wanted)?, line, at)));
    let Some((delimiter, _, found_at)) = rows.next() else { return without_numbers(path, lines(), options) };
    let delimiter = wanted.unwrap_or(delimiter);
    if let Some((header, at)) = lines().next().filter(|(_, at)| *at < found_at) {
        let count = |delimiter: Delimiter| header.matches(delimiter.character()).count();
        let other = Delimiter::ALL.into_iter().find(|other| *other != delimiter && count(*other) > 0);
        if let (0, Some(other)) = (count(delimiter), other)
            && lines().any(|(line, at)| at >= found_at && line.contains(delimiter.character()))
        {
            return Err(MeasurementError::Delimiter {
                place: Place::line(path, at),
                expected: format!("{} between the names, as in line {found_at}", delimiter.name()),
                found: other.name(),
                remedy: if delimiter == Delimiter::Comma {
                    "decimal commas cannot be distinguished from commas between values: export with decimal points, or with \
                     semicolons in every line"
                } else {
                    "export with one delimiter throughout"
                },
            });
        }
    }
    let sampled = || lines().filter(|(_, at)| *at >= found_at).take(SAMPLED_ROWS);
    let decimal = match (options.decimal, delimiter) {
        (Some(decimal), _) => decimal,
        (None, Delimiter::Comma) if !sampled().all(|(line, _)| line.contains('"')) => DecimalSign::Point,
        (None, _) => match decimal_of(path, sampled(), delimiter)? {
            Some(decimal) => decimal,
            // Whole numbers so far: a quiet signal in few digits.
            None => {
                let is_row = |line: &str| line.contains([',', '.']) && row_delimiter(line, Some(delimiter)).is_some();
                let later = text.lines().zip(first..).filter(|(line, _)| is_row(line)).take(SAMPLED_ROWS);
                decimal_of(path, later, delimiter)?.unwrap_or_default()
            }
        },
    };
    Ok(Dialect { delimiter, decimal })
}

/// Cells of a line without blanks and quotes; a quote that begins a cell keeps the delimiters in it together.
pub(super) fn cells(line: &str, delimiter: Delimiter) -> impl Iterator<Item = &str> {
    let (mut quoted, mut blank) = (false, true);
    let parts = line.split(move |letter: char| {
        quoted ^= letter == '"' && (quoted || blank);
        let ends = letter == delimiter.character() && !quoted;
        blank = ends || blank && letter.is_whitespace();
        ends
    });
    parts.map(|cell| cell.trim().trim_matches('"').trim())
}

/// The delimiter under which `line` is a row of numbers.
pub(super) fn row_delimiter(line: &str, wanted: Option<Delimiter>) -> Option<Delimiter> {
    Delimiter::ALL.into_iter().filter(|delimiter| wanted.is_none_or(|wanted| wanted == *delimiter)).find(|&delimiter| {
        let is_number = |cell: &str| {
            decimal::number(cell, DecimalSign::Point).is_some() || decimal::number(cell, DecimalSign::Comma).is_some()
        };
        // What holds no delimiter at all is left to the comma, unless one was named.
        (line.contains(delimiter.character()) || delimiter == Delimiter::Comma || wanted.is_some())
            && cells(line, delimiter).any(is_number)
            && cells(line, delimiter).all(|cell| is_missing(cell) || is_number(cell) || clock::instant(cell).is_some())
    })
}

fn decimal_of<'a>(
    path: &Path,
    rows: impl Iterator<Item = (&'a str, u64)>,
    delimiter: Delimiter,
) -> Result<Option<DecimalSign>, MeasurementError> {
    let mut sign: Option<(DecimalSign, u64)> = None;
    let mut grouped: Option<(u64, String)> = None;
    let mut settled = false;
    for (line, at) in rows {
        // A time of day has signs of its own.
        for cell in cells(line, delimiter).filter(|cell| clock::instant(cell).is_none()) {
            for found in [DecimalSign::Comma, DecimalSign::Point] {
                if !cell.contains(found.character()) || !cell.contains(|letter: char| letter.is_ascii_digit()) {
                    continue;
                }
                match sign {
                    None => sign = Some((found, at)),
                    Some((other, since)) if other != found => {
                        return Err(MeasurementError::MixedDecimals {
                            place: Place::line(path, at),
                            expected: other,
                            since,
                            found: cell.into(),
                        });
                    }
                    Some(_) => {}
                }
                if decimal::may_be_grouped(cell, found) {
                    grouped.get_or_insert_with(|| (at, cell.into()));
                } else {
                    settled = true;
                }
            }
        }
    }
    match (sign, grouped) {
        (Some((sign, _)), Some((at, found))) if !settled => {
            Err(MeasurementError::AmbiguousNumber { place: Place::line(path, at), found, sign })
        }
        (sign, _) => Ok(sign.map(|(sign, _)| sign)),
    }
}

/// For a file without a row of numbers: the most frequent delimiter of the first line, unless spaces or other signs
/// separate its values.
fn without_numbers<'a>(
    path: &Path,
    mut lines: impl Iterator<Item = (&'a str, u64)> + Clone,
    options: &ReadOptions,
) -> Result<Dialect, MeasurementError> {
    let decimal = options.decimal.unwrap_or_default();
    let Some((header, at)) = lines.next() else { return Ok(Dialect { decimal, ..Dialect::default() }) };
    let rows = lines.clone().take(SAMPLED_ROWS);
    let count = |delimiter: Delimiter| header.matches(delimiter.character()).count();
    if let Some(delimiter) = options.delimiter {
        if count(delimiter) == 0
            && let Some(other) = Delimiter::ALL.into_iter().find(|other| count(*other) > 0)
        {
            return Err(MeasurementError::Delimiter {
                place: Place::line(path, at),
                expected: format!("values separated by {} (delimiter)", delimiter.name()),
                found: other.name(),
                remedy: "leave it out, or name the right one",
            });
        }
        return Ok(Dialect { delimiter, decimal });
    }
    let number = |part: &str| decimal::number(part, DecimalSign::Point).is_some();
    for (line, at) in lines {
        let mut words = line.split_whitespace();
        let spaced = words.clone().count() > 1 && words.all(number);
        let barred = line.contains('|') && line.split('|').all(|part| part.trim().is_empty() || number(part.trim()));
        if spaced || barred {
            return Err(MeasurementError::Delimiter {
                place: Place::line(path, at),
                expected: "values separated by commas, semicolons or tabs".into(),
                found: if spaced { "spaces" } else { "vertical bars" },
                remedy: "replace them by commas",
            });
        }
    }
    let delimiter =
        Delimiter::ALL.into_iter().rev().max_by_key(|delimiter| (count(*delimiter), *delimiter == Delimiter::Comma));
    let delimiter = delimiter.unwrap_or_default();
    // Beside a column of words the numbers say their sign as well.
    let has = |sign: DecimalSign| {
        let is_decimal = |cell: &str| {
            cell.contains(sign.character())
                && decimal::number(cell, sign).is_some()
                && !decimal::may_be_grouped(cell, sign)
        };
        rows.clone().any(|(line, _)| cells(line, delimiter).any(is_decimal))
    };
    let commas = options.decimal.is_none() && has(DecimalSign::Comma) && !has(DecimalSign::Point);
    Ok(Dialect { delimiter, decimal: if commas { DecimalSign::Comma } else { decimal } })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detected(text: &str, options: &ReadOptions) -> Result<Dialect, String> {
        detect(Path::new("a.csv"), text, 1, options).map_err(|error| error.to_string())
    }

    #[test]
    fn rows_of_numbers_tell_delimiter_and_decimals() {
        use {DecimalSign as D, Delimiter as S};
        for (text, delimiter, decimal) in [
            ("t,v\n0.5,1\n", S::Comma, D::Point),
            ("t;v\n0,5;1\n", S::Semicolon, D::Comma),
            ("t;v\n0.5;1\n", S::Semicolon, D::Point),
            ("t\tv\n1\t2\n1,5\t2\n", S::Tab, D::Comma),
            ("Zeit, lang [s];v, schnell [mm/s]\n0;1\n", S::Semicolon, D::Point),
            ("v\n0.5\n0.6\n", S::Comma, D::Point),
            ("t;v\n", S::Semicolon, D::Point),
            ("t;v\n1,234;n/a\n0,5;2\n", S::Semicolon, D::Comma),
        ] {
            assert_eq!(detected(text, &ReadOptions::default()), Ok(Dialect { delimiter, decimal }), "{text}");
        }
    }

    #[test]
    fn what_can_be_read_in_two_ways_is_refused_until_a_flag_says_which() {
        let grouped = "t;v\n1,234;2,345\n2,234;3,345\n";
        assert!(detected(grouped, &ReadOptions::default()).unwrap_err().contains("`1,234`"));
        let given = ReadOptions { decimal: Some(DecimalSign::Comma), ..ReadOptions::default() };
        assert_eq!(detected(grouped, &given).unwrap().decimal, DecimalSign::Comma);
        let mixed = detected("t;v\n0,5;1\n1,5;2.5\n", &ReadOptions::default()).unwrap_err();
        assert!(mixed.starts_with("a.csv:3: expected decimal commas as in line 2, found `2.5`"), "{mixed}");
    }

    #[test]
    fn another_delimiter_is_named() {
        for (text, expected) in [
            ("t v\n0 1\n1 2\n", "a.csv:2: expected values separated by commas, semicolons or tabs, found spaces"),
            ("t|v\n0|1\n", "a.csv:2: expected values separated by commas, semicolons or tabs, found vertical bars"),
            ("t;v\n0,1\n", "a.csv:1: expected commas between the names, as in line 2, found semicolons"),
        ] {
            let message = detected(text, &ReadOptions::default()).unwrap_err();
            assert!(message.starts_with(expected), "{message}");
        }
        let wrong = ReadOptions { delimiter: Some(Delimiter::Tab), ..ReadOptions::default() };
        assert!(detected("t;v\n0;1\n", &wrong).unwrap_err().contains("(delimiter), found semicolons"));
    }
}
