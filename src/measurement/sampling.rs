//! Even sampling, checked with a stated tolerance.

use std::path::Path;

use super::{MeasurementError, Place, table::Table};

/// Largest departure of an instant from the even grid, as a fraction of the step. Times printed with few digits are
/// rounded by up to a few per cent of a step; a lost row is off by half a step or more.
pub const SAMPLING_TOLERANCE: f64 = 0.05;

/// Fewest samples of a record.
pub(super) const FEWEST: usize = 8;

/// Start and step (s) of the even grid through the first and the last instant, or where the record leaves it.
pub(super) fn even_grid(path: &Path, table: &Table) -> Result<(f64, f64), MeasurementError> {
    let times = &table.times;
    if times.len() < FEWEST {
        return Err(MeasurementError::TooFewSamples { path: path.into(), needed: FEWEST, found: times.len() });
    }
    let start = times[0];
    let step = (times[times.len() - 1] - start) / (times.len() - 1) as f64;
    let off = |&(i, &time): &(usize, &f64)| !((time - (start + i as f64 * step)).abs() <= SAMPLING_TOLERANCE * step);
    if times.iter().enumerate().any(|at| off(&at)) {
        // The step that differs most from the median step is where rows were lost or the clock changed.
        let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let all = steps.clone();
        steps.sort_by(f64::total_cmp);
        let median = steps[steps.len() / 2];
        let (at, found) = all.iter().enumerate().fold((0, median), |worst, (i, &step)| {
            if (step - median).abs() > (worst.1 - median).abs() { (i, step) } else { worst }
        });
        let line = table.lines[at + 1];
        let column = &table.columns[table.chosen.time].header;
        let place = Place::cell(path, line, column);
        return Err(MeasurementError::Uneven { place, expected: median, found, tolerance: SAMPLING_TOLERANCE });
    }
    Ok((start, step))
}
