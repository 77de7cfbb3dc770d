use std::path::Path;

use super::{Line, MeasurementError, Preamble, bare, cells, count, instants_from, missing, number, seconds};

/// `Revision:,0` … `XInc:,1e-7` … `Data:`, then values, or instants and values.
pub(super) fn infiniium(path: &Path, lines: &[Line<'_>]) -> Result<Preamble, MeasurementError> {
    let data = lines.iter().position(|line| bare(line.text).eq_ignore_ascii_case("data"));
    let data = data.filter(|at| at + 1 < lines.len());
    let at = data.ok_or_else(|| missing(path, "Keysight Infiniium", "a line `Data:` with rows below it"))?;
    let first = lines[at + 1];
    let pairs = || lines[..at].iter().filter_map(Line::keyed);
    let value = |wanted: &str| pairs().find(|(key, _)| *key == wanted).map(|(_, value)| value);
    let unit = |key: &str, usual: &str| value(key).filter(|unit| !unit.is_empty()).unwrap_or(usual).to_owned();
    let units = (unit("XUnits", "Second"), unit("YUnits", "Volt"));
    let origin = value("XOrg").and_then(number);
    let step = value("XInc").and_then(number).filter(|step| *step > 0.0);
    let grid = origin.zip(step).zip(seconds(&units.0)).map(|((origin, step), factor)| (origin * factor, step * factor));
    let cells = first.text.split([',', ';', '\t']).filter(|cell| !cell.trim().is_empty()).count();
    let timed = cells > 1;
    if !timed && grid.is_none() {
        return Err(missing(path, "Keysight Infiniium", "`XOrg`, `XInc` and `XUnits`, for the rows have no instants"));
    }
    let assumptions = grid.filter(|_| !timed).map(|grid| instants_from("XOrg and XInc", grid)).into_iter().collect();
    Ok(Preamble {
        header: Some(if timed { vec!["time".into(), "value".into()] } else { vec!["value".into()] }),
        units: Some(units),
        grid: grid.filter(|_| !timed),
        interval: grid.map(|(_, step)| step),
        points: value("Points").and_then(count),
        assumptions,
        ..Preamble::above("Keysight Infiniium", &first, lines)
    })
}

/// `File Format, WaveformYValues` … `XOrg, -1e-5` … `Data,` and the type of the values, then those alone, or below
/// `WaveformXYValues` with their instants.
pub(super) fn waveform(path: &Path, lines: &[Line<'_>]) -> Result<Preamble, MeasurementError> {
    let value = |wanted: &str| lines.iter().filter_map(Line::pair).find(|(key, _)| *key == wanted).map(|(_, it)| it);
    let data = lines.iter().position(|line| bare(line.text) == "Data");
    let is_row = |line: &&Line<'_>| cells(line.text).iter().all(|cell| number(cell).is_some());
    let first = data.and_then(|at| lines[at + 1..].iter().find(is_row));
    let time_unit = value("X Units").unwrap_or("Second");
    let clock = [value("XOrg"), value("XInc")].map(|it| it.and_then(number));
    let (Some(first), [Some(start), Some(step)], Some(factor)) = (first, clock, seconds(time_unit)) else {
        return Err(missing(
            path,
            "Keysight",
            "`XOrg`, `XInc`, `X Units` in units of time, and `Data` with values below it",
        ));
    };
    let (start, step) = (start * factor, step * factor);
    let timed = cells(first.text).len() > 1;
    let names = timed.then(|| format!("time ({time_unit})")).into_iter();
    let assumed = instants_from("XOrg and XInc", (start, step));
    Ok(Preamble {
        header: Some(names.chain([format!("value ({})", value("Y Units").unwrap_or("Volt"))]).collect()),
        grid: Some((start, step)).filter(|_| !timed),
        interval: Some(step),
        points: value("Points").and_then(count),
        assumptions: Some(assumed).filter(|_| !timed).into_iter().collect(),
        ..Preamble::above("Keysight Infiniium", first, lines)
    })
}
