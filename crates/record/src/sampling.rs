//! Even sampling: checked with a stated tolerance, or made by interpolation on request.

use std::path::Path;

use granchain_signal::{Series, number::time};

use super::{MeasurementError, Place, table::Table};

/// Largest departure of an instant from the even grid, as a fraction of the step. Times printed with few digits are
/// rounded by up to a few per cent of a step; a lost row is off by half a step or more.
pub const SAMPLING_TOLERANCE: f64 = 0.05;

/// Fewest samples of a record.
pub(super) const FEWEST: usize = 8;

/// Fewest values that show a ramp: of a slow record a few are one.
const FEWEST_OF_RAMP: usize = 32;

/// Longest step of uneven samples that is interpolated across, in median steps.
const LONGEST_STEP: f64 = 6.0;

/// The even series of a table.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Sampled {
    pub series: Series,
    /// Shortest and longest step (s) of samples that have been interpolated onto the even grid.
    pub resampled: Option<(f64, f64)>,
}

/// The values on the even grid through the first and the last instant, or the place where the record leaves it. With
/// `resample` an uneven record is interpolated onto a grid of its median step, or of the mean of its usual steps if
/// rounding affects the median.
pub(super) fn even_series(path: &Path, table: &mut Table, resample: bool) -> Result<Sampled, MeasurementError> {
    let times = &table.times;
    let count = table.values.len();
    if count < FEWEST {
        return Err(MeasurementError::TooFewSamples { path: path.into(), needed: FEWEST, found: count });
    }
    if is_ramp(&table.values) {
        let columns = || table.columns.iter().map(|it| it.header.clone()).filter(|it| !it.is_empty());
        let place = Place { line: None, ..Place::cell(path, 0, &table.columns[table.chosen.value].header) };
        return Err(MeasurementError::Ramp { place, columns: columns().collect() });
    }
    if let Some((start, step)) = table.grid {
        let series = Series::new(table.origin() + start, step, std::mem::take(&mut table.values));
        return Ok(Sampled { series, resampled: None });
    }
    let start = times[0];
    let step = (times[times.len() - 1] - start) / (times.len() - 1) as f64;
    if is_even(times) {
        let series = Series::new(table.origin() + start, step, std::mem::take(&mut table.values));
        return Ok(Sampled { series, resampled: None });
    }
    // The step that differs most from the median step is where rows were lost or the clock changed.
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let (at, found) =
        times.windows(2).map(|pair| pair[1] - pair[0]).enumerate().fold((0, median), |worst, (i, step)| {
            if (step - median).abs() > (worst.1 - median).abs() { (i, step) } else { worst }
        });
    let (shortest, longest) =
        steps.iter().fold((f64::INFINITY, 0.0), |(low, high), &step| (f64::min(low, step), f64::max(high, step)));
    let step = if table.digit > ROUNDED * median { usual_step(&steps, median, table.digit) } else { median };
    drop(steps);
    // The last instant may be rounded down.
    let slack = if table.digit > ROUNDED * median { (table.digit / step).min(0.5) } else { 0.0 };
    let even = ((times[count - 1] - start) / step * (1.0 + 1e-9) + slack).floor() + 1.0;
    // A clock of two speeds makes no more samples than a few times what there are.
    if !resample || longest > LONGEST_STEP * median || !(even <= 4.0 * count as f64) {
        let column = table.chosen.time.map_or("time", |time| &table.columns[time].header);
        let place = match table.lines.get(at + 1) {
            Some(line) => Place::cell(path, line, column),
            None => Place { line: None, ..Place::cell(path, 0, column) },
        };
        return Err(if resample {
            MeasurementError::TooUneven { place, median, found, limit: LONGEST_STEP }
        } else {
            MeasurementError::Uneven { place, expected: median, found, tolerance: SAMPLING_TOLERANCE }
        });
    }
    // Steps shorter than the median leave fewer samples than rows.
    let even = even as usize;
    if even < FEWEST {
        return Err(MeasurementError::TooFewSamples { path: path.into(), needed: FEWEST, found: even });
    }
    let values = interpolated(times, &table.values, start, step, even);
    // Slopes between values near the largest number overflow.
    if values.iter().any(|value| !value.is_finite()) {
        let largest = (0..count).max_by(|&a, &b| table.values[a].abs().total_cmp(&table.values[b].abs())).unwrap_or(0);
        let line = table.lines.get(largest).unwrap_or(0);
        let place = Place::cell(path, line, &table.columns[table.chosen.value].header);
        return Err(MeasurementError::Infinite { place, found: format!("{:.3e}", table.values[largest]) });
    }
    Ok(Sampled { series: Series::new(table.origin() + start, step, values), resampled: Some((shortest, longest)) })
}

/// Unit of the last digit, over the step, from which the median of the steps is affected by rounding.
const ROUNDED: f64 = 1e-3;

/// Mean of the steps that differ from the median by rounding only: rounding errors of neighbouring steps cancel.
fn usual_step(steps: &[f64], median: f64, digit: f64) -> f64 {
    let usual = steps.iter().filter(|step| (**step - median).abs() <= 1.01 * digit);
    let (sum, count) = usual.fold((0.0, 0.0), |(sum, count), step| (sum + step, count + 1.0));
    sum / count
}

/// The step (s) that several statements agree on, with the first of them; or which two contradict each other.
pub(super) fn agreed<N: std::fmt::Display>(
    stated: impl IntoIterator<Item = (N, f64)>,
) -> Result<Option<(N, f64)>, String> {
    let mut stated = stated.into_iter();
    let Some((name, step)) = stated.next() else { return Ok(None) };
    match stated.find(|(_, other)| !((other / step - 1.0).abs() <= 1e-3)) {
        None => Ok(Some((name, step))),
        Some((other, differs)) => Err(format!(
            "`{name}` means one sample every {}, `{other}` one every {}: they contradict each other; pass the right rate as --sample-rate RATE",
            time(step),
            time(differs)
        )),
    }
}

/// Whether values rise or fall evenly from the first to the last, to 0.5 % of their range, as instants and counts do and no vibration.
pub(super) fn is_ramp(values: &[f64]) -> bool {
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return false };
    let slope = (last - first) / (values.len() - 1) as f64;
    let on_line = |(i, value): (usize, &f64)| (value - first - slope * i as f64).abs() <= 5e-3 * (last - first).abs();
    let turns = |pair: &[f64]| (pair[1] - pair[0]) * slope < 0.0;
    slope != 0.0
        && values.len() >= FEWEST_OF_RAMP
        && !values.windows(2).any(turns)
        && values.iter().enumerate().all(on_line)
}

/// Whether instants lie on the even grid through the first and the last.
pub(super) fn is_even(times: &[f64]) -> bool {
    let (Some(start), Some(end)) = (times.first(), times.last()) else { return true };
    let step = (end - start) / (times.len() - 1).max(1) as f64;
    times.iter().enumerate().all(|(i, time)| (time - (start + i as f64 * step)).abs() <= SAMPLING_TOLERANCE * step)
}

/// Largest uncertainty of the step of rounded instants, as a fraction of it.
const WIDEST: f64 = 2e-3;

/// An even clock behind rounded instants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clock {
    pub start: f64,
    pub step: f64,
    /// Uncertainty of the step, as a fraction of it; `None` if it is stated.
    pub room: Option<f64>,
}

/// The even clock whose instants, rounded to their last digits (units `digits`, s), are `times`: with the stated step,
/// else with the roundest that explains them.
///
/// With tᵢ = t₀ + iΔ + rᵢ and |rᵢ| ≤ uᵢ/2 there is a t₀ where g(Δ) = maxᵢ(tᵢ − uᵢ/2 − iΔ) − minᵢ(tᵢ + uᵢ/2 − iΔ) ≤ 0; g is convex, and its least
/// lies where the two extremes are at one i. Two instants differ from the step by less than a unit, else one is there twice or lost.
pub(super) fn rounded(times: &[f64], digits: &[f64], interval: Option<f64>) -> Option<Clock> {
    let (&first, &last) = times.first().zip(times.last())?;
    let coarsest = digits.iter().copied().fold(0.0, f64::max);
    let unit = |i: usize| if digits.len() == times.len() { digits[i] } else { coarsest };
    let count = (times.len() - 1) as f64;
    let mean = (last - first) / count;
    // Halves are rounded up by some and to even by others, and the decimal fractions are not exact.
    let half = |i: usize, step: f64| 0.5 * unit(i) * (1.0 + 1e-6) + 1e-9 * step;
    let extremes = |step: f64| {
        let none = ((0, f64::NEG_INFINITY), (0, f64::INFINITY));
        times.iter().enumerate().fold(none, |(low, high), (i, time)| {
            let (offset, half) = (time - i as f64 * step, half(i, step));
            let low = if offset - half > low.1 { (i, offset - half) } else { low };
            (low, if offset + half < high.1 { (i, offset + half) } else { high })
        })
    };
    let possible = |step: f64| {
        let ((_, low), (_, high)) = extremes(step);
        (step > 0.0 && low <= high).then_some((low, high))
    };
    let explains = |step: f64, room: Option<f64>| {
        let (low, high) = possible(step)?;
        let mut steps = times.windows(2).enumerate();
        let near = |(i, pair): (usize, &[f64])| {
            (pair[1] - pair[0] - step).abs() <= (1.0 - 1e-6) * unit(i).max(unit(i + 1)) + 1e-9 * step
        };
        steps.all(near).then(|| Clock { start: first.clamp(low, high), step, room })
    };
    if let Some(found) = interval.and_then(|step| explains(step, None)) {
        return Some(found);
    }
    // A step from the ends is off by at most a unit over the whole record.
    let ends = (mean - coarsest / count, mean + coarsest / count);
    let (mut below, mut above) = ends;
    let mut inside = None;
    for _ in 0..HALVINGS {
        let step = 0.5 * (below + above);
        let ((low, _), (high, _)) = extremes(step);
        inside = possible(step).map(|_| step);
        match low.cmp(&high) {
            _ if inside.is_some() => break,
            std::cmp::Ordering::Equal => return None,
            // The slope of g is the difference of the two places.
            std::cmp::Ordering::Less => above = step,
            std::cmp::Ordering::Greater => below = step,
        }
    }
    let inside = inside?;
    // The last possible step on the way to one that is not.
    let last_possible = |beyond: f64| {
        let (mut within, mut beyond) = (inside, beyond);
        for _ in 0..HALVINGS {
            let step = 0.5 * (within + beyond);
            if possible(step).is_some() { within = step } else { beyond = step }
        }
        within
    };
    let (shortest, longest) = (last_possible(ends.0), last_possible(ends.1));
    let room = 0.5 * (longest - shortest) / inside;
    if !(room <= WIDEST) {
        return None;
    }
    explains(roundest(shortest, longest), Some(room))
}

/// Halvings of an interval of steps; it is left 1e-12 of what it was.
const HALVINGS: usize = 40;

/// The step between `shortest` and `longest` with the fewest digits in itself or in its rate.
fn roundest(shortest: f64, longest: f64) -> f64 {
    let middle = 0.5 * (shortest + longest);
    let cut = |value: f64, places: usize| format!("{value:.places$e}").parse().unwrap_or(value);
    let candidates = (0..17).flat_map(|places| [cut(middle, places), 1.0 / cut(1.0 / middle, places)]);
    candidates.into_iter().find(|step| (shortest..=longest).contains(step)).unwrap_or(middle)
}

/// The natural cubic spline through uneven samples (`times` rising), at `start` + k `step`.
///
/// Second derivatives M solve h₋ M₋/6 + (h₋ + h₊) M/3 + h₊ M₊/6 = (y₊ − y)/h₊ − (y − y₋)/h₋ with M = 0 at both ends; the
/// error is at most 5/384 h⁴ max|y⁗| away from the ends (h the longest step): 20.3/n⁴ of the amplitude of a tone with n
/// samples a cycle.
///
/// de Boor (1978), *A Practical Guide to Splines*, ch. IV; the constant: Hall and Meyer (1976), *J. Approx. Theory* 16, 105.
fn interpolated(times: &[f64], values: &[f64], start: f64, step: f64, count: usize) -> Vec<f64> {
    let n = times.len();
    let h = |i: usize| times[i + 1] - times[i];
    let slope = |i: usize| (values[i + 1] - values[i]) / h(i);
    // Elimination and back substitution; the ends stay zero.
    let (mut upper, mut second) = (vec![0.0; n], vec![0.0; n]);
    for i in 1..n - 1 {
        let pivot = (h(i - 1) + h(i)) / 3.0 - h(i - 1) / 6.0 * upper[i - 1];
        upper[i] = h(i) / 6.0 / pivot;
        second[i] = (slope(i) - slope(i - 1) - h(i - 1) / 6.0 * second[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        second[i] -= upper[i] * second[i + 1];
    }
    let mut piece = 0;
    (0..count)
        .map(|k| {
            let t = (start + k as f64 * step).min(times[n - 1]);
            while piece + 2 < n && times[piece + 1] < t {
                piece += 1;
            }
            let (width, right) = (h(piece), (t - times[piece]) / h(piece));
            let left = 1.0 - right;
            let bend = |u: f64, m: f64| (u * u * u - u) * m * width * width / 6.0;
            left * values[piece]
                + right * values[piece + 1]
                + bend(left, second[piece])
                + bend(right, second[piece + 1])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn uneven_samples_of_a_tone_are_met_to_the_stated_error() {
        // Jittered by ±20 % of a step: longest step 1.4.
        let jitter = |i: usize| 0.2 * ((i as f64 * 12.9898).sin() * 43758.5453).fract();
        for per_cycle in [10.0, 20.0, 40.0] {
            let omega = 2.0 * PI / per_cycle;
            let times: Vec<f64> = (0..400).map(|i| i as f64 + jitter(i)).collect();
            let values: Vec<f64> = times.iter().map(|t| (omega * t).sin()).collect();
            let even = interpolated(&times, &values, times[0], 1.0, 399);
            let error = |k: usize| (even[k] - (omega * (times[0] + k as f64)).sin()).abs();
            let worst = (20..380).map(error).fold(0.0, f64::max);
            let bound = 20.3 / (per_cycle / 1.4f64).powi(4);
            assert!(worst < bound, "{per_cycle}: {worst:e}, stated {bound:e}");
            assert!(worst > 0.01 * bound, "{per_cycle}: {worst:e}, the bound says nothing");
        }
    }

    #[test]
    fn rounded_instants_are_known_from_uneven_ones() {
        let digits = |count: usize, unit: f64| vec![unit; count];
        let clock = |count: usize, step: f64, unit: f64| -> Vec<f64> {
            (0..count).map(|i| unit * ((0.3 + step * i as f64) / unit).round()).collect()
        };
        // Steps above and below the unit, also of a simple ratio to it.
        for (count, step, unit) in
            [(5000, 1.6, 1.0), (5000, 0.16, 1.0), (2000, 0.5, 1.0), (4000, 1.37, 0.1), (900, 1.0, 1.0)]
        {
            let times = clock(count, step, unit);
            let Clock { start, step: found, room } = rounded(&times, &digits(count, unit), None).unwrap();
            assert_eq!(found, step, "{unit}");
            assert!(room.is_some_and(|room| room < WIDEST), "{step} {unit}: {room:?}");
            for (i, time) in times.iter().enumerate() {
                assert!((start + i as f64 * found - time).abs() <= 0.5001 * unit, "{step} {unit}: {i}");
            }
            assert_eq!(rounded(&times, &digits(count, unit), Some(step)).map(|it| it.step), Some(step));
        }
        // A row that is lost, an instant that is there twice, a clock that changes.
        let mut lost = clock(3000, 1.6, 1.0);
        lost.drain(1000..1003);
        let mut twice = clock(3000, 2.0, 1.0);
        twice[1000] = twice[999];
        let mut once = clock(3000, 1.0, 1.0);
        once[1000] = once[999];
        let bent: Vec<f64> =
            (0..3000).map(|i| (1.6 * f64::from(i) + 0.5 * (f64::from(i) - 1500.0).max(0.0)).round()).collect();
        for (name, times) in [("lost", lost), ("twice", twice), ("once", once), ("bent", bent)] {
            assert_eq!(rounded(&times, &digits(times.len(), 1.0), None), None, "{name}");
        }
        // Too short to say a step.
        assert_eq!(rounded(&clock(50, 1.6, 1.0), &digits(50, 1.0), None), None);
    }

    #[test]
    fn a_straight_line_and_the_samples_themselves_are_met_exactly() {
        let times = [0.0, 0.9, 2.3, 3.0, 4.4, 5.0, 5.5, 7.0];
        let line: Vec<f64> = times.iter().map(|t| 3.0 - 2.0 * t).collect();
        for (k, value) in interpolated(&times, &line, 0.0, 0.5, 15).into_iter().enumerate() {
            assert!((value - (3.0 - k as f64)).abs() < 1e-13, "{k}: {value}");
        }
        let bent: Vec<f64> = times.iter().map(|t| t * t).collect();
        let at_samples = interpolated(&times, &bent, 0.0, 1.0, 8);
        assert!((at_samples[3] - 9.0).abs() < 1e-12 && (at_samples[5] - 25.0).abs() < 1e-12, "{at_samples:?}");
    }
}
