//! B&K PULSE and Reflex: keys of the axes, then number and value of every sample, or number, instant and value.

use super::{Line, Preamble, cells, count, instants_from, number, seconds};

pub(super) fn axes(lines: &[Line<'_>]) -> Option<Preamble> {
    let pairs = || lines.iter().filter_map(|line| line.text.split_once(':'));
    let keyed =
        |wanted: &str| pairs().find(|(key, _)| key.trim().eq_ignore_ascii_case(wanted)).map(|(_, value)| value.trim());
    let axis = |axis: &str, name: &str| {
        let title = keyed(&format!("{axis}-Axis title")).filter(|title| !title.is_empty()).unwrap_or(name);
        Some(format!("{title} ({})", keyed(&format!("{axis}-Axis unit"))?))
    };
    let (x, y) = (axis("X", "time")?, axis("Y", "value")?);
    let rows: Vec<Vec<&str>> = lines.iter().map(|line| cells(line.text)).collect();
    let is_row = |row: &Vec<&str>| row.iter().all(|cell| number(cell).is_some());
    let at = rows.windows(2).position(|pair| pair.iter().all(is_row))?;
    let (first, second) = (&rows[at], &rows[at + 1]);
    let counts = first.len() > 1 && number(second[0])? - number(first[0])? == 1.0;
    let values = first.len() - usize::from(counts);
    let factor = seconds(keyed("X-Axis unit")?);
    let given = |key: &str| keyed(key).and_then(number).zip(factor).map(|(value, factor)| value * factor);
    let step = given("X-Axis delta").filter(|step| *step > 0.0);
    let grid = step.filter(|_| values == 1).map(|step| (given("X-Axis start").unwrap_or(0.0), step));
    if !(1..=2).contains(&values) || values == 1 && factor.is_some() && grid.is_none() {
        return None;
    }
    let names = counts.then(String::new).into_iter().chain((values == 2).then_some(x)).chain([y]);
    Some(Preamble {
        header: Some(names.collect()),
        grid,
        interval: step,
        points: keyed("Number of points").and_then(count),
        assumptions: grid.map(|grid| instants_from("X-Axis delta", grid)).into_iter().collect(),
        ..Preamble::above("Brüel & Kjær", &lines[at], lines)
    })
}
