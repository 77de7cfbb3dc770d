use std::path::Path;

use super::{Line, MeasurementError, Place, Preamble, cells, count, number, values};

/// `Memory Length,25000,` … `Vertical Scale,5.0E-02,` … `Sampling Period,2.0E-10,` … `Waveform Data,`, then instants and volts (`Mode,Detail,`),
/// channel beside channel, or counts alone (`Mode,Fast,`), 25 of them a division.
pub(super) fn gwinstek(path: &Path, lines: &[Line<'_>]) -> Result<Option<Preamble>, MeasurementError> {
    let is_data =
        |line: &&Line<'_>| cells(line.text).first().is_some_and(|it| it.eq_ignore_ascii_case("Waveform Data"));
    let Some(data) = lines.iter().find(is_data) else { return Ok(None) };
    let Some(first) = lines.iter().find(|line| line.number > data.number && !line.text.trim().is_empty()) else {
        return Ok(None);
    };
    let above: Vec<Line<'_>> = lines.iter().copied().filter(|line| line.number < data.number).collect();
    let values = |wanted| values(&above, wanted);
    let interval = values("Sampling Period").first().and_then(|it| number(it)).filter(|step| *step > 0.0);
    let row = cells(first.text);
    let width = row.iter().filter(|cell| !cell.is_empty()).count();
    if width == 1 {
        let scale = values("Vertical Scale").first().copied().unwrap_or("V/div").to_owned();
        return Err(MeasurementError::Counts { place: Place::line(path, first.number), scale });
    }
    let (sources, units) = (values("Source"), values("Vertical Units"));
    let column = |at: usize| match (at % 2, at / 2) {
        (0, 0) => "time (s)".to_owned(),
        // Every channel has the same instants.
        (0, _) => String::new(),
        (_, channel) => {
            let name = sources.get(channel).map_or_else(|| format!("CH{}", channel + 1), |name| (*name).to_owned());
            format!("{name} ({})", units.get(channel).unwrap_or(&"V"))
        }
    };
    Ok(Some(Preamble {
        header: Some((0..width).map(column).collect()),
        interval,
        points: values("Memory Length").first().and_then(|it| count(it)),
        ..Preamble::above("GW Instek", first, lines)
    }))
}
