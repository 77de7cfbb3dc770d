//! Several lines that begin with `%`, the last of which names the columns: Moku, COMSOL.

use super::{Line, Preamble, cells, number};

/// The names stand apart by the delimiter of the rows, or by two blanks where blanks alone separate those.
pub(super) fn percent(lines: &[Line<'_>]) -> Option<Preamble> {
    let above = lines.iter().take_while(|line| line.text.starts_with('%')).count();
    let (header, first) = (lines.get(above.checked_sub(1)?)?.text.trim_start_matches('%').trim(), lines.get(above)?);
    let blanks = !first.text.contains([',', ';', '\t']);
    let row: Vec<&str> = if blanks { first.text.split_whitespace().collect() } else { cells(first.text) };
    let names: Vec<&str> = match blanks {
        true => header.split("  ").map(str::trim).filter(|name| !name.is_empty()).collect(),
        false => cells(header),
    };
    if above < 2 || names.len() != row.len() || !row.iter().all(|cell| number(cell).is_some()) {
        return None;
    }
    Some(Preamble {
        header: Some(names.into_iter().map(str::to_owned).collect()),
        ..Preamble::above("unknown", first, lines)
    })
}
