//! The column of time: by its unit or its name, and of several the one beside the chosen value.

use granchain_signal::Dimension;

use super::{
    MeasurementError, Place, ReadOptions,
    column::{Column, ambiguous, find, positions},
};

const TIME_NAMES: [&str; 6] = ["time", "t", "times", "zeit", "seconds", "x_value"];
const FREQUENCY_NAMES: [&str; 5] = ["frequency", "freq", "f", "frequenz", "band no."];

/// The beginning of a name: what follows says nothing of time, and a name may be as long as the file.
fn lower(name: &str) -> String {
    name.chars().take(100).flat_map(char::to_lowercase).collect()
}

/// Whether a name is that of a time: then `min` is a minute and `uS` a microsecond.
pub(super) fn says_time(name: &str) -> bool {
    let name = lower(name.trim());
    let words = ["time", "zeit", "temps", "elapsed", "duration", "dauer"];
    TIME_NAMES.contains(&name.as_str()) || words.iter().any(|word| name.contains(word))
}

fn is_named(column: &Column) -> bool {
    TIME_NAMES.contains(&lower(&column.name).as_str())
}

/// Whether a name is that of a time, perhaps in a structure or with a number or its channel: `rec.time`, `Time2`, `Time.1`, `X_Value 2`, `Time - Bead`.
pub(super) fn is_named_or_numbered(column: &Column) -> bool {
    let name = lower(&column.name);
    let name = name.split(" - ").next().unwrap_or_default();
    let numbers = |letter: char| letter.is_ascii_digit() || matches!(letter, '.' | '_' | ' ' | '[' | ']');
    let name = name.trim_end_matches(numbers);
    TIME_NAMES.contains(&name.rsplit('.').next().unwrap_or(name))
}

/// The columns that may be time.
pub(super) fn candidates(
    place: &Place,
    columns: &[Column],
    options: &ReadOptions,
) -> Result<Vec<usize>, MeasurementError> {
    if let Some(wanted) = &options.time_column {
        return Ok(vec![find(place, columns, wanted, "--read time_column=NAME")?]);
    }
    let of_time = |column: &Column| column.dimension() == Some(Dimension::TIME);
    let is_open = |column: &Column| column.dimension().is_none();
    let mut found = positions(columns, |column| of_time(column) || is_open(column) && is_named_or_numbered(column));
    let mut named: Vec<usize> = found.iter().copied().filter(|&at| is_named_or_numbered(&columns[at])).collect();
    // Beside `time_s` a `t2` without a unit is something else.
    let with_unit = named.iter().any(|&at| of_time(&columns[at]));
    let mut plain = named.iter().filter(|&&at| is_named(&columns[at])).peekable();
    if with_unit && (plain.peek().is_none() || plain.any(|&at| of_time(&columns[at]))) {
        named.retain(|&at| of_time(&columns[at]));
    }
    if !named.is_empty() {
        found = named;
    }
    // Two columns without names for either: the first is time when its unit is given.
    if found.is_empty() && columns.len() == 2 && options.time_unit.is_some() && columns[0].unit.is_none() {
        found.push(0);
    }
    Ok(found)
}

/// The time among `found` of the value in column `value`: the nearest to its left.
pub(super) fn beside(
    place: &Place,
    columns: &[Column],
    found: &[usize],
    value: usize,
    timed: bool,
) -> Result<Option<usize>, MeasurementError> {
    let [first, _, ..] = found else {
        return match found.first() {
            None if !timed => Err(without(place, columns)),
            only => Ok(only.copied()),
        };
    };
    let ambiguous = |pool: &[usize]| Err(ambiguous(place, columns, pool, "--read time_column=NAME"));
    let Some(nearest) = found.iter().rposition(|&at| at < value) else { return one_of(columns, found, ambiguous) };
    // Where a value stands first, the instants may stand to the right of each.
    if columns[..*first].iter().any(|column| column.dimension().is_some()) || !is_named_or_numbered(&columns[*first]) {
        return ambiguous(found);
    }
    let from = (0..nearest).rev().take_while(|&at| found[at] + (nearest - at) == found[nearest]).last();
    one_of(columns, &found[from.unwrap_or(nearest)..=nearest], ambiguous)
}

/// The only one, or the only one that bears the plain name.
fn one_of(
    columns: &[Column],
    pool: &[usize],
    ambiguous: impl Fn(&[usize]) -> Result<Option<usize>, MeasurementError>,
) -> Result<Option<usize>, MeasurementError> {
    let named: Vec<usize> = pool.iter().copied().filter(|&at| is_named(&columns[at])).collect();
    match (pool, &named[..]) {
        ([only], _) | (_, [only]) => Ok(Some(*only)),
        _ => ambiguous(pool),
    }
}

fn without(place: &Place, columns: &[Column]) -> MeasurementError {
    let over = |column: &&Column| {
        let name = lower(&column.name);
        column.dimension() == Some(Dimension::FREQUENCY) || FREQUENCY_NAMES.contains(&name.as_str())
    };
    match columns.iter().find(over) {
        Some(column) => MeasurementError::Spectrum { place: place.of(&column.header) },
        None => {
            let columns = columns.iter().map(|column| column.header.clone()).collect();
            MeasurementError::NoTime { place: place.clone(), columns, likely: None }
        }
    }
}
