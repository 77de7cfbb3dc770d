//! Calibration table of an instrument in a file: rows of a frequency, a magnitude and perhaps a phase below a line that names their units.

use std::path::Path;

use granchain_signal::{Dimension, InstrumentResponse};

use super::{
    DecimalSign, MeasurementError, ReadingError,
    column::{Column, parse_unit},
    decimal, encoding,
    read::read_file,
};

/// What `response` states: a filter, rows, or a file with a table.
pub(super) fn stated(text: &str) -> Result<InstrumentResponse, ReadingError> {
    let path = Path::new(text);
    if !path.is_file() {
        return Ok(text.parse()?);
    }
    let refused = |error: MeasurementError| ReadingError::ResponseFile(error.to_string());
    let bytes = read_file(path, encoding::refuse_early).map_err(refused)?;
    let table = encoding::decode(path, &bytes).map_err(refused)?.text;
    let rows = rows(&table).ok_or_else(|| {
        let expected = "expected a line such as `Frequency (MHz), Sensitivity (mV/MPa), Phase (deg)` or `frequency_mhz,sensitivity_db` above the rows";
        ReadingError::ResponseFile(format!("{text}: {expected}, found none"))
    })?;
    Ok(rows.parse()?)
}

/// Cells of a line, parted by `;`, tabs, commas or blanks outside brackets.
fn cells(line: &str) -> Vec<&str> {
    let line = line.trim_start_matches(['#', '%', '!', '"', ' ']);
    let part = [';', '\t', ','].into_iter().find(|sign| line.contains(*sign)).unwrap_or(' ');
    let mut depth = 0;
    let parts = line.split(move |letter| {
        depth += i32::from("([".contains(letter)) - i32::from(")]".contains(letter));
        letter == part && depth <= 0
    });
    parts.map(|cell| cell.trim_matches(['"', ' ', '\r'])).filter(|cell| !cell.is_empty()).collect()
}

/// The rows as `response` takes them on a command line.
fn rows(text: &str) -> Option<String> {
    let number = |cell: &str| {
        let found = decimal::number(cell, DecimalSign::Point).or_else(|| decimal::number(cell, DecimalSign::Comma));
        found.filter(|value| value.is_finite())
    };
    let unit = |header: &str| Column::from_header(header).unit_text.unwrap_or_default();
    let mut units: Option<Vec<String>> = None;
    let mut rows = Vec::new();
    for line in text.lines() {
        let cells = cells(line);
        let numbers: Option<Vec<f64>> = cells.iter().map(|cell| number(cell)).collect();
        match (numbers, &units) {
            (Some(numbers), Some(units)) if numbers.len() >= 2 && numbers.len() <= units.len() => {
                let mut row = format!("{}{}", numbers[0], units[0]);
                for (value, unit) in numbers.iter().zip(units).skip(1).take(2).filter(|(_, unit)| !unit.is_empty()) {
                    row += &format!(":{value}{unit}");
                }
                rows.push(row);
            }
            _ if cells.len() >= 2 && rows.is_empty() => {
                let frequency = unit(cells[0]);
                if parse_unit(&frequency).is_ok_and(|unit| unit.dimension == Dimension::FREQUENCY) {
                    let of = |(at, name): (usize, &&str)| {
                        let unit = unit(name);
                        let lower = name.to_lowercase();
                        match at {
                            0 => frequency.replace("hz", "Hz").replace("khz", "kHz").replace("mHz", "MHz"),
                            1 if unit.contains("dB") || lower.contains("_db") => "dB".into(),
                            1 => unit,
                            2 if lower.contains("deg") || lower.contains('°') => "deg".into(),
                            2 if lower.contains("rad") => "rad".into(),
                            _ => String::new(),
                        }
                    };
                    units = Some(cells.iter().enumerate().map(of).collect());
                }
            }
            _ => {}
        }
    }
    (!rows.is_empty()).then(|| rows.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn certificates_of_several_forms_are_read() {
        for (text, expected) in [
            (
                "MODEL\tX1\n# Freq(MHz) Sens(dB re. 1V/uPa) Sens(V/Pa)\nDATA_FIELDS\t3\n 0.250\t -251.58\t  2.636E-07\n 1.0\t -250.0\t 3E-7\n",
                "0.25MHz:-251.58dB\n1MHz:-250dB",
            ),
            (
                "Frequency (kHz);Sensitivity (mV/MPa);Phase (deg)\n100;52,5;-3\n200;50;-6,5\n",
                "100kHz:52.5mV/MPa:-3deg\n200kHz:50mV/MPa:-6.5deg",
            ),
            ("frequency_Hz,sensitivity_db,uncertainty_pct\n1e5,-2,10\n2e5,-3,10\n", "100000Hz:-2dB\n200000Hz:-3dB"),
        ] {
            assert_eq!(rows(text).as_deref(), Some(expected));
            assert!(expected.parse::<InstrumentResponse>().is_ok(), "{expected}");
        }
        assert_eq!(rows("0.1,52\n0.2,50\n"), None);
    }
}
