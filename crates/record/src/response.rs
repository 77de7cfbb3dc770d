//! Calibration table of an instrument in a file: rows of a frequency, a magnitude and perhaps a phase below a line that names their units.

use std::path::Path;

use granchain_signal::InstrumentResponse;

use super::{DecimalSign, MeasurementError, ReadingError, column::Column, decimal, encoding, read::read_file};

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
    // Frequency, magnitude and phase as the header has them; a third column may be something else.
    let units_of = |names: &[&str]| {
        let lower = |at: usize| names.get(at).map(|name| name.to_lowercase()).unwrap_or_default();
        let hertz = [("ghz", "GHz"), ("mhz", "MHz"), ("khz", "kHz"), ("hz", "Hz")];
        let (_, frequency) = hertz.into_iter().find(|(word, _)| lower(0).contains(word))?;
        let is_level = lower(1).contains("(db") || lower(1).contains("[db") || lower(1).contains("_db");
        let of_magnitude = || Column::from_header(names[1]).unit_text.unwrap_or_default();
        let phase =
            [("deg", "deg"), ("°", "deg"), ("rad", "rad")].into_iter().find(|(word, _)| lower(2).contains(word));
        let magnitude = if is_level { "dB".to_owned() } else { of_magnitude() };
        Some((names.len(), frequency, magnitude, phase.map(|(_, unit)| unit)))
    };
    let mut units = None;
    let mut rows = Vec::new();
    for line in text.lines() {
        let cells = cells(line);
        let numbers: Option<Vec<f64>> = cells.iter().map(|cell| number(cell)).collect();
        match (numbers.as_deref(), &units) {
            (Some([frequency, magnitude, rest @ ..]), Some((width, of, unit, phase))) if rest.len() + 2 <= *width => {
                let phase = rest.first().zip(*phase).map(|(value, unit)| format!(":{value}{unit}"));
                rows.push(format!("{frequency}{of}:{magnitude}{unit}{}", phase.unwrap_or_default()));
            }
            _ if cells.len() >= 2 && rows.is_empty() => units = units_of(&cells).or(units),
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
            ("frequency_hz,sensitivity_db,uncertainty_pct\n1e5,-2,10\n2e5,-3,10\n", "100000Hz:-2dB\n200000Hz:-3dB"),
        ] {
            assert_eq!(rows(text).as_deref(), Some(expected));
            assert!(expected.parse::<InstrumentResponse>().is_ok(), "{expected}");
        }
        assert_eq!(rows("0.1,52\n0.2,50\n"), None);
    }
}
