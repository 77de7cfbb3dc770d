use std::path::Path;

use super::{Line, MeasurementError, Preamble, cells, count, missing, number, row_of, seconds, statements, values};

/// Keys and values above a header `TIME,CH1`, or beside the first rows (`Record Length,2500,,-0.1,0.02`).
pub(super) fn tektronix(path: &Path, lines: &[Line<'_>]) -> Result<Option<Preamble>, MeasurementError> {
    let pairs = || lines.iter().filter_map(Line::pair);
    let value = |wanted: &str| {
        let found = pairs().find(|(key, value)| key.eq_ignore_ascii_case(wanted) && !value.is_empty());
        found.map(|(_, value)| value)
    };
    let (Some(length), Some(interval)) = (value("Record Length"), value("Sample Interval")) else { return Ok(None) };
    let unit = |key: &str| value(key).map(str::to_owned);
    let time = match unit("Horizontal Units") {
        // `S` is what some of them call a second.
        Some(unit) if unit == "S" => "s".to_owned(),
        Some(unit) => unit,
        None => "s".to_owned(),
    };
    let amplitude = unit("Vertical Units").unwrap_or_else(|| "V".to_owned());
    let seconds = seconds(&time);
    // Of several waveforms each may have its own.
    let same = |key: &str| values(lines, key).windows(2).all(|pair| pair[0] == pair[1]);
    let assumptions = [("Horizontal Units", "time taken in s"), ("Vertical Units", "amplitude taken in V")]
        .into_iter()
        .filter(|(key, _)| unit(key).is_none())
        .map(|(key, taken)| format!("Tektronix states no `{key}`: {taken}"))
        .collect();
    let mut preamble = Preamble {
        instrument: "Tektronix",
        units: Some((time, amplitude)),
        interval: number(interval)
            .filter(|value| *value > 0.0 && same("Sample Interval"))
            .zip(seconds)
            .map(|(value, factor)| value * factor),
        points: count(length).filter(|_| same("Record Length")),
        assumptions,
        ..Preamble::default()
    };
    let header = lines.iter().find(|line| {
        line.text.trim_start_matches(['#', '"']).get(..4).is_some_and(|start| start.eq_ignore_ascii_case("time"))
            && line.text.contains([',', ';', '\t'])
    });
    if let Some(header) = header {
        preamble.statements = statements(lines, header.number);
        let names = cells(header.text.trim_start_matches('#'));
        let times: Vec<usize> = (0..names.len()).filter(|at| names[*at].eq_ignore_ascii_case("time")).collect();
        let mut below = lines.iter().filter(|line| line.number > header.number);
        if let (true, Some(first)) = (times.len() > 1, below.next()) {
            let rows = [Some(first), below.next()].map(|line| line.map(|line| cells(line.text)).unwrap_or_default());
            preamble.header = Some(side_by_side(lines, &times, &names, &rows));
            (preamble.body, preamble.body_line) = (first.at, first.number);
            return Ok(Some(preamble));
        }
        // A unit for each channel.
        let units = row_of(lines, "Vertical Units").unwrap_or_default();
        let several = units.iter().any(|unit| *unit != units[0]);
        if let (true, Some(first)) = (several, lines.iter().find(|line| line.number > header.number)) {
            let named = |(at, name): (usize, &&str)| match units.get(at.wrapping_sub(1)) {
                Some(unit) if at > 0 => format!("{name} ({unit})"),
                _ => (*name).to_owned(),
            };
            preamble.header = Some(names.iter().enumerate().map(named).collect());
            (preamble.body, preamble.body_line) = (first.at, first.number);
            return Ok(Some(preamble));
        }
        // The header of some is a comment.
        let marks = header.text.len() - header.text.trim_start_matches('#').len();
        (preamble.body, preamble.body_line) = (header.at + marks, header.number);
        return Ok(Some(preamble));
    }
    // Keys beside the rows: two or three columns of them, then time and value; another waveform may follow to the right.
    let Some(first) = lines.first() else { return Ok(None) };
    let row = cells(first.text);
    let width = row.len() - usize::from(row.last().is_some_and(|cell| cell.is_empty()));
    let keys: Vec<usize> = (0..width).filter(|at| row[*at] == row[0]).collect();
    let times = keys.iter().zip(keys.iter().skip(1).chain([&width])).filter_map(|(from, to)| {
        let at = (from + 2..*to).find(|at| number(row[*at]).is_some())?;
        (at + 1 < width).then_some(at)
    });
    let times: Vec<usize> = times.collect();
    if times.is_empty() {
        return Err(missing(path, "Tektronix", "a header `TIME,CH1`, or rows beside the keys"));
    }
    let second = lines.get(1).map(|line| cells(line.text)).unwrap_or_default();
    preamble.header = Some(side_by_side(lines, &times, &vec![""; width], &[row, second]));
    preamble.body_line = 1;
    Ok(Some(preamble))
}

/// `TIME,CH1` without keys above it: seconds and volts.
pub(super) fn plain(first: &Line<'_>) -> Option<Preamble> {
    let names = cells(first.text);
    let is_channel = |name: &&str| name.strip_prefix("CH").is_some_and(|number| number.parse::<u8>().is_ok());
    let channels = names.get(1..).unwrap_or_default();
    (names.first() == Some(&"TIME") && !channels.is_empty() && channels.iter().all(is_channel)).then(|| Preamble {
        instrument: "Tektronix",
        body: first.at,
        body_line: first.number,
        units: Some(("s".into(), "V".into())),
        assumptions: vec!["`TIME,CH1` without units, as Tektronix writes it: time taken in s, amplitude in V".into()],
        ..Preamble::default()
    })
}

/// Names of the columns, of which `names` may say some. Behind each column of instants (`times`) stand the values of a waveform; a column that
/// repeats the first waveform's instants in the first two `rows` has no name.
fn side_by_side(lines: &[Line<'_>], times: &[usize], names: &[&str], rows: &[Vec<&str>; 2]) -> Vec<String> {
    let (sources, units) = (values(lines, "Source"), values(lines, "Vertical Units"));
    let mut header = vec![String::new(); names.len()];
    let ends = times.iter().copied().skip(1).chain([names.len()]);
    for (waveform, (&at, end)) in times.iter().zip(ends).enumerate() {
        let source = match sources.get(waveform).filter(|name| !name.is_empty()) {
            Some(name) => (*name).to_owned(),
            None if waveform == 0 => "value".to_owned(),
            None => format!("waveform {}", waveform + 1),
        };
        let unit = units.get(waveform).filter(|unit| times.len() > 1 && !["", "None"].contains(unit));
        let mut first = None;
        for column in at + 1..end {
            let name = match names[column] {
                "" if column == at + 1 => source.clone(),
                name => name.to_owned(),
            };
            first = first.or_else(|| Some(name.clone()));
            header[column] = match unit {
                Some(unit) if !name.is_empty() => format!("{name} ({unit})"),
                _ => name,
            };
        }
        if waveform == 0 {
            header[at] = "TIME".to_owned();
        } else if rows.iter().any(|row| row.get(at) != row.get(times[0])) {
            header[at] = format!("TIME - {}", first.unwrap_or(source));
        }
    }
    header
}
