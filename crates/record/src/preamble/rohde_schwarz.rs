//! Rohde & Schwarz RTO and RTP: values in `NAME.Wfm.csv`, keys in `NAME.csv` beside it.

use std::path::Path;

use super::{Line, MeasurementError, Place, Preamble, bare, cells, count, instants_from, lines, missing, number};

/// The file of keys that belongs to a file of values.
pub(super) fn beside(path: &Path, whole: &str, first: &Line<'_>) -> Result<Option<Preamble>, MeasurementError> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let lower = name.to_lowercase();
    let Some(stem) = lower.strip_suffix(".wfm.csv").map(|stem| &name[..stem.len()]) else { return Ok(None) };
    let row = cells(first.text);
    if row.is_empty() || row.iter().any(|cell| !cell.is_empty() && number(cell).is_none()) {
        return Ok(None);
    }
    let keys = path.with_file_name(format!("{stem}.csv"));
    let Ok(text) = std::fs::read_to_string(&keys) else {
        let wanted = "a file of the same name without `.Wfm` beside it, which holds the instants";
        return Err(missing(path, "Rohde & Schwarz RTO", wanted));
    };
    let pairs = lines(&text);
    let value = |wanted: &str| {
        let of = |line: &Line<'_>| {
            let (key, value) = line.text.split_once(':')?;
            (bare(key) == wanted).then(|| number(bare(value.split(':').next().unwrap_or_default())))?
        };
        pairs.iter().find_map(of)
    };
    if let Some(line) =
        pairs.iter().find(|line| line.text.starts_with("FrequencyStart") || line.text.starts_with("SignalType:FFT"))
    {
        return Err(MeasurementError::Spectrum { place: Place::cell(&keys, line.number, bare(line.text)) });
    }
    // What was recorded beside what the screen shows: the number of values says which it is.
    let rows = whole.lines().filter(|line| !line.trim().is_empty()).count() as f64;
    let hardware = value("RecordLength") != Some(rows) && value("SignalHardwareRecordLength") == Some(rows);
    let names = if hardware { ["HardwareXStart", "SignalResolution"] } else { ["XStart", "Resolution"] };
    let grid = value(names[0]).zip(value(names[1]).filter(|step| *step > 0.0));
    let Some((start, step)) = grid else {
        return Err(missing(&keys, "Rohde & Schwarz RTO", "`XStart` and `Resolution`"));
    };
    if let Some(line) = pairs.iter().find(|line| line.text.starts_with("ValuesPerXInterval:2")) {
        return Err(MeasurementError::PeakDetect { place: Place::cell(&keys, line.number, bare(line.text)) });
    }
    let width = row.iter().filter(|cell| !cell.is_empty()).count();
    // Horizontal values stand in a column of their own if they were included.
    let second = whole.lines().nth(1).map(cells).unwrap_or_default();
    let at = |row: &[&str], wanted: f64| number(row[0]).is_some_and(|found| (found - wanted).abs() < 1e-3 * step);
    let timed = width > 1 && at(&row, start) && !second.is_empty() && at(&second, start + step);
    let text = |wanted: &str| pairs.iter().find_map(|line| line.text.strip_prefix(wanted)).unwrap_or_default();
    let units: Vec<&str> = text("VerticalUnit:").split(':').map(bare).filter(|unit| !unit.is_empty()).collect();
    let unit = |channel: usize| units.get(channel).or(units.first()).copied().unwrap_or("V");
    let names = (0..width - usize::from(timed)).map(|at| format!("CH{} ({})", at + 1, unit(at)));
    Ok(Some(Preamble {
        instrument: "Rohde & Schwarz RTO",
        body_line: 1,
        header: Some(timed.then(String::new).into_iter().chain(names).collect()),
        grid: Some((start, step)),
        interval: Some(step),
        points: value(if hardware { "SignalHardwareRecordLength" } else { "RecordLength" })
            .and_then(|it| count(&it.to_string())),
        statements: pairs.iter().map(|line| line.text.to_owned()).filter(|line| !line.is_empty()).collect(),
        assumptions: vec![format!(
            "{}; values taken in {}",
            instants_from(&keys.display().to_string(), (start, step)),
            unit(0)
        )],
        ..Preamble::default()
    }))
}

/// Refuses a file of keys read instead of the file of values.
pub(super) fn refuse_keys(path: &Path, lines: &[Line<'_>]) -> Result<(), MeasurementError> {
    let has = |key: &str| lines.iter().any(|line| line.text.starts_with(key));
    if has("XStart:") && has("Resolution:") && !lines.iter().any(|line| number(line.text).is_some()) {
        let values = path.with_extension("Wfm.csv");
        return Err(MeasurementError::Keys { place: Place::file(path), values });
    }
    Ok(())
}
