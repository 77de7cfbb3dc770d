//! Rigol: start and step of the record stand in the header.

use super::{Line, Preamble, cells, instants_from, number, seconds};

/// `X,CH1,CH2,Start,Increment,` above `Sequence,Volt,Volt,-1.2e-03,4e-08`, with or without the counter X; or, on one line,
/// `CH1V,CH2V,t0 =-1.2e-03, tInc = 4e-08,`. Older ones write a column of time, and nothing that is not read anyway.
pub(super) fn rigol(lines: &[Line<'_>]) -> Option<Preamble> {
    let names = cells(lines.first()?.text);
    let keyed = |wanted: &str| {
        let of = |cell: &&str| {
            let (key, value) = cell.split_once('=')?;
            (key.trim() == wanted).then(|| number(value.trim().trim_end_matches('s')))?
        };
        names.iter().find_map(of)
    };
    let (grid, head, units) = match (keyed("t0"), keyed("tInc")) {
        (Some(start), Some(step)) => {
            let until = names.iter().position(|cell| cell.contains('='))?;
            ((start, step), &names[..until], Vec::new())
        }
        _ => {
            let at = |wanted: &str| names.iter().position(|cell| cell.eq_ignore_ascii_case(wanted));
            let (start, increment) = (at("Start")?, at("Increment")?);
            let units = cells(lines.get(1)?.text);
            let value = |at: usize| number(units.get(at)?);
            ((value(start)?, value(increment)?), &names[..start.min(increment)], units)
        }
    };
    let first = lines.get(if units.is_empty() { 1 } else { 2 })?;
    let row = cells(first.text);
    if !(grid.1 > 0.0) || head.is_empty() {
        return None;
    }
    let x = head.iter().position(|name| name.trim().eq_ignore_ascii_case("X"));
    // X counts the samples unless a unit of time stands below it: then it is the instant, and start and step are in that unit too.
    let of_x = x.and_then(|at| units.get(at));
    let clock = of_x.and_then(|unit| seconds(unit));
    let factor = clock.unwrap_or(1.0);
    let grid = (grid.0 * factor, grid.1 * factor);
    let x_unit = of_x.filter(|_| clock.is_some()).copied().unwrap_or("s");
    let column = |(at, name): (usize, &&str)| {
        let name = name.trim();
        // The counter goes on over samples that were cut or left out; where a column of time is blank, the header says the instants.
        match units.get(at) {
            _ if row.get(at).is_none_or(|cell| cell.is_empty()) => String::new(),
            _ if name.eq_ignore_ascii_case("X") => format!("X ({x_unit})"),
            Some(unit) if !unit.is_empty() => format!("{name} ({unit})"),
            _ => match name.strip_suffix('V').filter(|channel| channel.ends_with(|c: char| c.is_ascii_digit())) {
                Some(channel) => format!("{channel} (V)"),
                None => name.to_owned(),
            },
        }
    };
    let x = x.filter(|at| row.get(*at).is_some_and(|cell| !cell.is_empty()));
    Some(Preamble {
        counter: x.filter(|_| clock.is_none()).map(|at| (at, grid.0, grid.1)),
        header: Some(head.iter().enumerate().map(column).collect()),
        grid: Some(grid).filter(|_| x.is_none()),
        interval: Some(grid.1),
        assumptions: match clock {
            Some(_) => Vec::new(),
            None => vec![instants_from("the header", grid)],
        },
        ..Preamble::above("Rigol", first, lines)
    })
}
