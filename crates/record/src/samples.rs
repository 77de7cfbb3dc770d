//! Conversion of rows to samples: gaps bridged, instants checked.

use std::path::Path;

use granchain_signal::Quantity;

use super::{
    DecimalSign, Delimiter, MeasurementError, Missing, Place, ReadOptions, clock,
    column::parse_unit,
    decimal::{Exact, number},
    dialect::Dialect,
    sampling,
    table::{Rows, Table, is_missing, shortened, text, text_of},
};
use granchain_signal::number::time;

/// Most letters of a cell shown in a message.
const LONGEST_CELL: usize = 40;
/// Least number that marks a value as over-range (9.9e37, 9.91e37, 9.99999e37), with tolerance for rounding.
pub(super) const OVER_RANGE: f64 = 9.89e37;
/// Instants from this number on may lose digits as doubles: seconds since 1970 are 1.7e9.
const LARGE: f64 = 1e8;
/// Most consecutive missing cells that are bridged.
pub(super) const BRIDGED: usize = 5;

/// Consecutive rows without a value, pending the next value.
#[derive(Default)]
pub(super) struct Gap {
    /// Their instants, s; zeros if the rows have none.
    pub times: Vec<f64>,
    /// How many of them are blank.
    pub blank: usize,
    /// Line and text of the first.
    pub line: u64,
    pub found: String,
    /// Line and value (s) of the first instant that does not increase.
    pub standing: Option<(u64, f64)>,
}

pub(super) struct Taking<'a> {
    pub path: &'a Path,
    pub dialect: Dialect,
    /// Whether every row ends with a delimiter.
    pub trailing: bool,
    pub missing: Missing,
    /// Whether a remark may follow the cells of a row.
    pub remarks: bool,
}

/// Warning if a stated sample rate replaces another step of the file, s.
pub(super) fn replaced(name: &str, stated: f64, step: f64) -> Option<String> {
    let differs = !((stated - step).abs() <= 1e-3 * step);
    differs.then(|| {
        format!(
            "`{name}` has one sample every {stated:.4e} s, --sample-rate one every {step:.4e} s, which is taken; leave it out if the file is right"
        )
    })
}

impl Table {
    pub(super) fn cell(&self, path: &Path, line: u64, column: usize) -> Place {
        Place::cell(path, line, &self.columns[column].header)
    }

    pub(super) fn take(&mut self, taking: &Taking<'_>, rows: &Rows<'_>, gap: &mut Gap) -> Result<(), MeasurementError> {
        let path = taking.path;
        let beyond = rows.record.iter().skip(self.columns.len());
        let filled = taking.remarks || taking.trailing && beyond.into_iter().all(|cell| cell.trim_ascii().is_empty());
        if rows.record.len() < self.columns.len() || rows.record.len() > self.columns.len() && !filled {
            return Err(MeasurementError::Ragged {
                place: Place::line(path, rows.line),
                expected: self.columns.len(),
                found: rows.record.len(),
                cut: rows.is_cut(),
                commas: taking.dialect.delimiter == Delimiter::Comma && rows.record.len() == 2 * self.columns.len(),
            });
        }
        let cell = text_of(rows, self.chosen.value);
        let missing = is_missing(cell) && (cell.is_empty() || taking.missing == Missing::Interpolate);
        let time = match self.chosen.time {
            // A row that is blank altogether but for a delimiter says nothing.
            Some(column) if missing && text_of(rows, column).is_empty() => f64::NAN,
            Some(column) => self.instant(taking, rows, column)?,
            None => 0.0,
        };
        if missing {
            if gap.times.is_empty() {
                (gap.line, gap.found) = (rows.line, cell.into());
            }
            gap.times.push(time);
            gap.blank += usize::from(cell.is_empty());
            return Ok(());
        }
        let found = gap.times.len();
        if self.values.is_empty() && found == gap.blank {
            self.blank_ends += found;
        } else if found > 0 {
            let place = self.cell(path, gap.line, self.chosen.value);
            if taking.missing != Missing::Interpolate {
                return Err(MeasurementError::MissingValue { place, found: std::mem::take(&mut gap.found) });
            }
            if found > BRIDGED || self.values.is_empty() {
                return Err(MeasurementError::GapTooLong { place, found, limit: BRIDGED });
            }
            for (index, time) in gap.times.iter().enumerate() {
                self.take_time(path, gap.line + index as u64, *time, &mut gap.standing)?;
            }
        }
        if self.chosen.time.is_some() {
            self.take_time(path, rows.line, time, &mut gap.standing)?;
        }
        let value = self.number(taking, rows, self.chosen.value)? * self.chosen.value_unit.factor;
        if found > 0 && !self.values.is_empty() {
            let before = self.values[self.values.len() - 1];
            for i in 1..=found {
                self.lines.push(gap.line + i as u64 - 1);
                self.values.push(before + (value - before) * i as f64 / (found + 1) as f64);
            }
            self.bridged += found;
        }
        self.lines.push(rows.line);
        self.values.push(value);
        gap.times.clear();
        gap.blank = 0;
        Ok(())
    }

    /// Instant of a row, s; a large first instant is subtracted from all before conversion to doubles.
    fn instant(&mut self, taking: &Taking<'_>, rows: &Rows<'_>, column: usize) -> Result<f64, MeasurementError> {
        if self.columns[column].is_clock()
            && let Some(exact) = clock::instant(text_of(rows, column))
        {
            // Since the first: nobody's axis begins at midnight.
            let (first, _) = *self.origin.get_or_insert((exact, 0.0));
            return Ok(exact.minus(first).unwrap_or(f64::NAN));
        }
        let value = self.number(taking, rows, column)?;
        let factor = self.chosen.time_factor;
        if self.origin.is_none() && !(value.abs() >= LARGE && self.times.is_empty()) {
            return Ok(value * factor);
        }
        let exact = Exact::of(text_of(rows, column), taking.dialect.decimal);
        if self.origin.is_none() {
            self.origin = exact.map(|exact| (exact, value * factor));
        }
        let Some((first, origin)) = self.origin else { return Ok(value * factor) };
        Ok(exact.and_then(|exact| exact.minus(first)).map_or(value * factor - origin, |since| since * factor))
    }

    /// The instant subtracted from all others, s.
    pub(super) fn origin(&self) -> f64 {
        self.origin.map_or(0.0, |(_, origin)| origin)
    }

    /// Takes the next instant; equal instants may be due to rounding.
    fn take_time(
        &mut self,
        path: &Path,
        line: u64,
        time: f64,
        standing: &mut Option<(u64, f64)>,
    ) -> Result<(), MeasurementError> {
        if self.chosen.time.is_none() {
            return Ok(());
        }
        if let Some(&previous) = self.times.last() {
            // Written so that it also catches what cannot be compared.
            if !(time >= previous) {
                let place = self.cell(path, line, self.chosen.time.unwrap_or(0));
                let (previous, found) = (self.origin() + previous, self.origin() + time);
                return Err(MeasurementError::TimeNotIncreasing { place, previous, found });
            }
            if time == previous {
                standing.get_or_insert((line, time));
            }
        }
        self.times.push(time);
        Ok(())
    }

    /// Replaces instants with few digits by those of an even clock if rounding explains all differences; a stated rate
    /// is preferred.
    pub(super) fn settle_times(
        &mut self,
        path: &Path,
        standing: Option<(u64, f64)>,
        options: &ReadOptions,
        digits: impl Fn(usize) -> [Vec<f64>; 2],
    ) -> Result<(), MeasurementError> {
        let (Some(column), Some(&start)) = (self.chosen.time, self.times.first()) else { return Ok(()) };
        let name = self.columns[column].header.clone();
        if let Some(rate) = options.sample_rate {
            let step = 1.0 / rate;
            let text = format!(
                "one sample every {} (--sample-rate); of `{name}` the first instant alone is taken",
                time(step)
            );
            self.assumptions.push(text);
            let stated = (self.times[self.times.len() - 1] - start) / (self.times.len() - 1).max(1) as f64;
            self.warnings.extend(replaced(&name, stated, step));
            (self.grid, self.times) = (Some((start, step)), Vec::new());
            return Ok(());
        }
        if standing.is_none() && sampling::is_even(&self.times) {
            return Ok(());
        }
        let interval = self.form.preamble().and_then(|preamble| preamble.interval);
        let mut digits = digits(column);
        digits.iter_mut().flatten().for_each(|unit| *unit *= self.chosen.time_factor);
        self.digit = digits[0].iter().copied().fold(0.0, f64::max);
        // Two notations have digits that no missing zeros explain.
        if let Some(clock) = digits.iter().find_map(|digits| sampling::rounded(&self.times, digits, interval)) {
            let from = match clock.room {
                None => "by the preamble's interval".to_owned(),
                Some(room) => format!("(the roundest possible; it may be off by {room:.1e} of itself)"),
            };
            self.assumptions.push(format!(
                "`{name}` is rounded: one sample every {} {from}, which all instants agree with",
                time(clock.step)
            ));
            (self.grid, self.times) = (Some((clock.start, clock.step)), Vec::new());
            return Ok(());
        }
        let twice = self.times.chunks_exact(2).filter(|pair| pair[0] == pair[1]).count();
        match standing {
            Some((line, _)) if 20 * twice > 9 * self.times.len() && self.times.last() > Some(&start) => {
                Err(MeasurementError::PeakDetect { place: self.cell(path, line, column) })
            }
            Some((line, time)) => {
                let place = self.cell(path, line, column);
                let time = self.origin() + time;
                Err(MeasurementError::TimeNotIncreasing { place, previous: time, found: time })
            }
            None => Ok(()),
        }
    }

    fn number(&self, taking: &Taking<'_>, rows: &Rows<'_>, column: usize) -> Result<f64, MeasurementError> {
        let cell = text(rows.record.get(column).unwrap_or_default());
        let place = || self.cell(taking.path, rows.line, column);
        if is_missing(cell) {
            return Err(MeasurementError::MissingValue { place: place(), found: cell.into() });
        }
        match number(cell, taking.dialect.decimal) {
            // From 9.9e37 on a number stands for over-range or nothing in what instruments of the SCPI family send.
            Some(value) if value.abs() < OVER_RANGE => Ok(value),
            Some(_) => Err(MeasurementError::Infinite { place: place(), found: cell.into() }),
            // As PicoScope writes what overloads it.
            None if cell.contains('∞') => Err(MeasurementError::Infinite { place: place(), found: cell.into() }),
            None => Err(self.no_number(taking, rows, place(), cell)),
        }
    }

    /// Why `cell` is not a number.
    fn no_number(&self, taking: &Taking<'_>, rows: &Rows<'_>, place: Place, cell: &str) -> MeasurementError {
        let Dialect { delimiter, decimal } = taking.dialect;
        let found = shortened(cell, LONGEST_CELL);
        let other = decimal.other().character();
        let opposite = number(&cell.replace([',', '.'], ""), DecimalSign::Point).is_some();
        if cell.contains(other) && opposite && (delimiter != Delimiter::Comma || decimal == DecimalSign::Comma) {
            let since = self.lines.get(0).unwrap_or(rows.line);
            return MeasurementError::MixedDecimals { place, expected: decimal, since, found };
        }
        if Quantity::parse(&cell.replacen(decimal.character(), ".", 1)).is_ok() || parse_unit(cell).is_ok() {
            return MeasurementError::MixedUnits { place, found };
        }
        MeasurementError::NotANumber { place, found, cut: rows.is_cut() }
    }
}
