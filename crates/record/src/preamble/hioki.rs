//! HIOKI 8807 and its family: quoted keys, the units and names of all columns, then `"DATA"`.

use super::{Line, Preamble, cells, row_of};

pub(super) fn hioki(lines: &[Line<'_>]) -> Option<Preamble> {
    let names = row_of(lines, "SIGNAL")?;
    let units = row_of(lines, "VERT_UNITS")?;
    let data = lines.iter().position(|line| cells(line.text) == ["DATA"])?;
    let first = lines.get(data + 1).filter(|_| names.len() == units.len())?;
    let named = |(name, unit): (&&str, &&str)| format!("{name} ({unit})");
    Some(Preamble {
        header: Some(names.iter().zip(&units).map(named).collect()),
        ..Preamble::above("HIOKI", first, lines)
    })
}
