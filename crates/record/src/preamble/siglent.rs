use super::{Line, Preamble, cells, count, number};

/// `Record Length,Analog:140000` / `Sample Interval,CH1:0.000002` / … / `Source,CH1` / `Second,Volt`, then instants of few digits and volts. Newer ones write
/// `Second,Value`, and the unit of each channel above: `Vertical Units,CH1:V,CH2:A`.
pub(super) fn siglent(lines: &[Line<'_>]) -> Option<Preamble> {
    // The value of a key without the channel that stands before it.
    let value = |wanted: &str| {
        let (_, value) = lines.iter().filter_map(Line::pair).find(|(key, _)| key.eq_ignore_ascii_case(wanted))?;
        Some(value.rsplit(':').next().unwrap_or(value).trim())
    };
    let units =
        lines.iter().position(|line| cells(line.text).first().is_some_and(|it| it.eq_ignore_ascii_case("Second")))?;
    // Siglent's converter of binary files leaves the row `Source` out.
    let names = lines[..units].iter().rev().map(|line| cells(line.text)).find(|cells| cells.first() == Some(&"Source"));
    let names = names.unwrap_or_default();
    let first = lines.get(units + 1)?;
    let unit_cells = cells(lines[units].text);
    let vertical = lines.iter().map(|line| cells(line.text)).find(|cells| cells.first() == Some(&"Vertical Units"));
    let stated = |name: &str| {
        let mut units = vertical.iter().flatten().filter_map(|cell| cell.split_once(':'));
        units.find(|(channel, _)| *channel == name).map_or("Value", |(_, unit)| unit)
    };
    let column = |(at, unit): (usize, &&str)| {
        if at == 0 {
            return "Time (s)".to_owned();
        }
        let name = names.get(at).map_or_else(|| format!("CH{at}"), |name| (*name).to_owned());
        let unit = if unit.eq_ignore_ascii_case("Value") { stated(&name) } else { unit };
        format!("{name} ({unit})")
    };
    Some(Preamble {
        header: Some(unit_cells.iter().enumerate().filter(|(_, unit)| !unit.is_empty()).map(column).collect()),
        interval: value("Sample Interval").and_then(number).filter(|step| *step > 0.0),
        points: value("Record Length").and_then(count),
        ..Preamble::above("Siglent", first, lines)
    })
}
