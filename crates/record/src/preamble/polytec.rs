use std::path::Path;

use super::{Line, MeasurementError, Preamble, missing};

/// `Source File Name:` and other keys, a blank line, a header, a row of units in brackets.
pub(super) fn polytec(path: &Path, lines: &[Line<'_>]) -> Result<Preamble, MeasurementError> {
    // The header is the line above the units, which stand in brackets.
    let bracketed = |line: &Line<'_>| line.text.trim_start().starts_with('[') && line.text.trim_end().ends_with(']');
    let header = lines
        .windows(2)
        .find(|pair| bracketed(&pair[1]))
        .map(|pair| pair[0])
        .ok_or_else(|| missing(path, "Polytec", "a line of units such as `[ s ]	[ m/s ]` below the header"))?;
    Ok(Preamble::above("Polytec", &header, lines))
}
