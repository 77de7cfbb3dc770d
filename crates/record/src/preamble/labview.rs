use std::path::Path;

use super::{Line, MeasurementError, Place, Preamble, cells, instants_from, line_at, missing, number, row_of};
use granchain_signal::number::time;

const END: &str = "***End_of_Header***";

/// Keys of the file, a header of each segment with `X0`, `Delta_X`, `Y_Unit_Label` channel by channel, then `X_Value<tab>name …<tab>Comment`.
pub(super) fn labview(path: &Path, text: &str, dataset: Option<usize>) -> Result<Preamble, MeasurementError> {
    // Every segment has a line that names its columns.
    let heads: Vec<usize> = text
        .match_indices("X_Value")
        .map(|(at, _)| at)
        .filter(|at| text[..*at].rfind('\n').is_none_or(|end| end + 1 == *at))
        .collect();
    let count = heads.len();
    let chosen = match dataset {
        _ if count == 0 => return Err(missing(path, "LabVIEW", "a line `X_Value` with the names of the channels")),
        Some(wanted) if (1..=count).contains(&wanted) => wanted - 1,
        None if count == 1 => 0,
        wanted => return Err(MeasurementError::Segments { place: Place::file(path), count, size: None, wanted }),
    };
    let head = heads[chosen];
    let names = line_at(text, head);
    let separator = if names.text.contains('\t') { '\t' } else { ',' };
    let row_of = |line: &'_ str| line.split(separator).map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let from = if chosen == 0 { 0 } else { heads[chosen - 1] };
    let above = || text[from..head].lines().map(row_of);
    let value = |key: &str| above().rfind(|row| row[0] == key).map(|row| row[1..].to_vec());
    let file =
        |key: &str| text.lines().take(40).map(row_of).find(|row| row[0] == key).and_then(|row| row.get(1).cloned());
    let timed = file("X_Columns").unwrap_or_else(|| "One".into());
    let cells: Vec<String> = row_of(names.text);
    // A comment may follow the samples of a row.
    let cells: Vec<String> = cells.into_iter().take_while(|cell| cell != "Comment").collect();
    let units = value("Y_Unit_Label").unwrap_or_default();
    let mut channel = 0;
    let mut header = Vec::new();
    for name in &cells {
        header.push(if name == "X_Value" {
            match (timed.as_str(), channel) {
                ("No", _) => String::new(),
                ("Multi", after) if after > 0 => format!("X_Value {} (s)", after + 1),
                _ => "X_Value (s)".into(),
            }
        } else {
            channel += 1;
            match units.get(channel - 1).filter(|unit| !unit.is_empty()) {
                Some(unit) => format!("{name} ({unit})"),
                None => name.clone(),
            }
        });
    }
    let all = |key: &str| -> Vec<f64> { value(key).unwrap_or_default().iter().filter_map(|it| number(it)).collect() };
    let (starts, steps) = (all("X0"), all("Delta_X"));
    let one = |values: &[f64]| values.first().copied().filter(|first| values.iter().all(|value| value == first));
    let grid = one(&starts).zip(one(&steps)).filter(|(_, step)| *step > 0.0);
    // The one column of instants is that of the first channel; of others with a clock of their own, X0 and Delta_X alone hold.
    let of_channel = |at: usize| starts.get(at).copied().zip(steps.get(at).copied()).filter(|(_, step)| *step > 0.0);
    let mut clocks = Vec::new();
    if grid.is_none() && timed != "Multi" {
        let mut channel = 0;
        for name in &cells {
            let is_channel = name != "X_Value";
            clocks.push(
                of_channel(channel)
                    .filter(|own| is_channel && (timed == "No" || of_channel(0).is_some_and(|first| first != *own))),
            );
            channel += usize::from(is_channel);
        }
    }
    if timed == "No" && grid.is_none() && clocks.iter().all(Option::is_none) {
        return Err(missing(path, "LabVIEW", "`X0` and `Delta_X` of the channels, for the rows have no instants"));
    }
    let body = line_at(text, names.at + names.text.len() + 1);
    let end =
        heads.get(chosen + 1).map(|next| text[..*next].find(END).map_or(*next, |_| segment_end(text, body.at, *next)));
    let assumed = grid.filter(|_| timed == "No").map(|grid| instants_from("X0 and Delta_X", grid));
    Ok(Preamble {
        instrument: "LabVIEW",
        body: body.at,
        body_line: body.number,
        end,
        header: Some(header),
        grid: grid.filter(|_| timed == "No"),
        clocks,
        remarks: true,
        segment: (count > 1).then_some((chosen + 1, count)),
        interval: grid.map(|(_, step)| step),
        statements: text[..names.at]
            .lines()
            .map(|line| line.trim().to_owned())
            .filter(|line| !line.is_empty())
            .collect(),
        assumptions: assumed.into_iter().collect(),
        ..Preamble::default()
    })
}

/// Export Waveforms to Spreadsheet File: `waveform`, `t0` and `delta t` above names, `time` or `time[0]` for the instants; the rows repeat the
/// time of day in milliseconds, so the first row is taken as 0. Each waveform may have a clock of its own.
pub(super) fn waveforms(lines: &[Line<'_>]) -> Option<Preamble> {
    let steps: Vec<f64> = row_of(lines, "delta t")?.into_iter().map(number).collect::<Option<_>>()?;
    let (step, one) = (*steps.first()?, steps.windows(2).all(|pair| pair[0] == pair[1]));
    let is_time = |name: &str| name == "time" || name.starts_with("time[");
    let head = lines.iter().position(|line| is_time(cells(line.text)[0]))?;
    let first = lines.get(head + 1)?;
    let names = cells(lines[head].text);
    let header: Vec<String> =
        names.iter().map(|name| if is_time(name) { String::new() } else { (*name).to_owned() }).collect();
    let mut own = steps.iter();
    let clocks = header.iter().map(|name| if name.is_empty() { None } else { own.next().map(|step| (0.0, *step)) });
    let clocks: Vec<_> = if one { Vec::new() } else { clocks.collect() };
    let assumed = format!("instants from delta t: the first sample at 0, one every {}", time(step));
    steps.iter().all(|step| *step > 0.0).then(|| Preamble {
        header: Some(header),
        grid: one.then_some((0.0, step)),
        clocks,
        interval: one.then_some(step),
        assumptions: one.then_some(assumed).into_iter().collect(),
        ..Preamble::above("LabVIEW", first, lines)
    })
}

/// Where the rows of a segment end: before the first line of the next header, which begins with a word.
fn segment_end(text: &str, from: usize, next: usize) -> usize {
    let mut at = from;
    for line in text[from..next].split_inclusive('\n') {
        if line
            .trim_start()
            .starts_with(|letter: char| letter.is_alphabetic() && !matches!(letter, 'e' | 'E' | 'N' | 'I'))
        {
            return at;
        }
        at += line.len();
    }
    next
}

/// Whether a text begins as such a file does.
pub(super) fn begins(first: &Line<'_>) -> bool {
    first.text.trim_start_matches('"').starts_with("LabVIEW Measurement")
}
