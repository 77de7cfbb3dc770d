use super::{Line, Preamble, cells, count, instants_from, number, row_of, seconds};

/// Quoted keys padded with blanks, a column a trace (`"TraceName"`, `"VUnit"`, `"HResolution"`, `"HOffset"`), then rows of values alone.
pub(super) fn yokogawa(lines: &[Line<'_>]) -> Option<Preamble> {
    let rows: Vec<Vec<&str>> = lines.iter().map(|line| cells(line.text)).collect();
    let value = |wanted| row_of(lines, wanted);
    let (names, units) = (value("TraceName")?, value("VUnit").unwrap_or_default());
    let steps = value("HResolution")?;
    let factor = match value("HUnit").and_then(|units| units.first().copied()) {
        Some(unit) => seconds(unit)?,
        None => 1.0,
    };
    let starts = value("HOffset").unwrap_or_default();
    let clock = |at: usize| {
        let step = number(steps.get(at)?).filter(|step| *step > 0.0)? * factor;
        Some((starts.get(at).and_then(|start| number(start)).unwrap_or(0.0) * factor, step))
    };
    let (start, step) = clock(0)?;
    let clocks: Vec<_> = (0..names.len()).map(clock).collect();
    let one = clocks.iter().all(|clock| *clock == clocks[0]);
    let is_row = |row: &&Vec<&str>| {
        let mut filled = row.iter().filter(|cell| !cell.is_empty()).peekable();
        filled.peek().is_some() && filled.all(|cell| number(cell).is_some())
    };
    let at = rows.iter().position(|row| is_row(&row))?;
    let first = &lines[at];
    let column = |(at, name): (usize, &&str)| match units.get(at) {
        Some(unit) => format!("{name} ({unit})"),
        None => (*name).to_owned(),
    };
    // Values may stand below the traces' names, one cell to the right of the keys.
    let shifted = rows[at].first().is_some_and(|cell| cell.is_empty());
    let shift = shifted.then(String::new);
    Some(Preamble {
        header: Some(shift.into_iter().chain(names.iter().enumerate().map(column)).collect()),
        grid: Some((start, step)).filter(|_| one),
        clocks: if one { Vec::new() } else { shifted.then_some(None).into_iter().chain(clocks).collect() },
        interval: Some(step).filter(|_| one),
        points: value("BlockSize").and_then(|it| count(it.first()?)),
        assumptions: one.then(|| instants_from("HOffset and HResolution", (start, step))).into_iter().collect(),
        ..Preamble::above("Yokogawa", first, lines)
    })
}
