use std::path::Path;

use super::{Line, MeasurementError, Preamble, count, missing};

/// `LECROY…,serial,Waveform` / `Segments,n,SegmentSize,m` / `Segment,TrigTime,TimeSinceSegment1` / `#1,…` / `Time,Ampl`.
pub(super) fn lecroy(path: &Path, lines: &[Line<'_>]) -> Result<Preamble, MeasurementError> {
    let header = lines.iter().find(|line| line.text.trim_start_matches('"').starts_with("Time"));
    let header = header.ok_or_else(|| missing(path, "LeCroy", "a line `Time,Ampl` above the rows"))?;
    let segments = lines.iter().find_map(|line| {
        let cells: Vec<&str> = line.text.split([',', ';', '\t']).map(str::trim).collect();
        match cells[..] {
            ["Segments", number, "SegmentSize", size, ..] => Some((count(number)?, count(size)?)),
            _ => None,
        }
    });
    Ok(Preamble {
        units: Some(("s".into(), "V".into())),
        points: segments.map(|(number, size)| number.saturating_mul(size)),
        segments,
        assumptions: vec!["LeCroy writes no units: time taken in s, amplitude in V".into()],
        ..Preamble::above("LeCroy", header, lines)
    })
}
