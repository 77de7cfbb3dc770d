//! Self-convergence of a model: filtered velocities held against a refined run, the observed order, the lead of one pulse over another.

use crate::Series;

/// Centred moving average over `length` (s): the trapezoid of the samples, over what there is of it at the ends.
#[must_use]
pub fn moving_average(series: &Series, length: f64) -> Series {
    let half = (0.5 * length / series.step).round() as usize;
    let last = series.len().saturating_sub(1);
    let values = (0..series.len())
        .map(|middle| {
            let (from, to) = (middle.saturating_sub(half), (middle + half).min(last));
            if to == from {
                return series.values[middle];
            }
            let inner: f64 = series.values[from + 1..to].iter().sum();
            (inner + 0.5 * (series.values[from] + series.values[to])) / (to - from) as f64
        })
        .collect();
    Series::new(series.start, series.step, values)
}

/// Value at an instant (s), linear between samples.
fn at(series: &Series, time: f64) -> f64 {
    let place = ((time - series.start) / series.step).max(0.0);
    let index = (place.floor() as usize).min(series.len().saturating_sub(2));
    let Some([a, b]) = series.values.get(index..index + 2) else { return 0.0 };
    a + (place - index as f64).min(1.0) * (b - a)
}

/// √(Σ (v − v̂)²/Σ v̂²) over a window of the coarser of both grids.
#[must_use]
pub fn error(velocity: &Series, reference: &Series, (from, to): (f64, f64)) -> f64 {
    let step = velocity.step.max(reference.step);
    let count = ((to - from) / step).round().max(1.0) as usize;
    let (mut distance, mut power) = (0.0, 0.0);
    for index in 0..count {
        let time = from + index as f64 * step;
        let expected = at(reference, time);
        distance += (at(velocity, time) - expected).powi(2);
        power += expected * expected;
    }
    if power > 0.0 { (distance / power).sqrt() } else { distance.sqrt() }
}

/// p of (h₁^p − h₃^p)/(h₂^p − h₃^p) = d₁/d₂ for h₁ > h₂ > h₃, between 0.1 and 8; none outside.
///
/// ```
/// # use granchain_signal::convergence::observed_order;
/// let distance = |h: f64| 3.0 * (h.powi(2) - 0.02_f64.powi(2));
/// let order = observed_order([0.1, 0.05, 0.02], [distance(0.1), distance(0.05)]);
/// assert!((order.unwrap() - 2.0).abs() < 1e-9);
/// ```
#[must_use]
pub fn observed_order([coarse, middle, fine]: [f64; 3], [far, near]: [f64; 2]) -> Option<f64> {
    let ratio = |p: f64| (coarse.powf(p) - fine.powf(p)) / (middle.powf(p) - fine.powf(p));
    let wanted = far / near;
    let (mut low, mut high) = (0.1, 8.0);
    if !(ratio(low) <= wanted && wanted <= ratio(high)) {
        return None;
    }
    for _ in 0..100 {
        let half = 0.5 * (low + high);
        *(if ratio(half) < wanted { &mut low } else { &mut high }) = half;
    }
    Some(0.5 * (low + high))
}

/// First pulse of a velocity: when it reaches a tenth of its first maximum, when that maximum, when the minimum that follows (s). An extreme
/// counts as passed once the velocity has gone back by a tenth of the largest.
#[must_use]
pub fn first_pulse(velocity: &Series) -> (f64, f64, f64) {
    let values = &velocity.values;
    let back = 0.1 * velocity.peak();
    let passed = |from: usize, sign: f64| {
        let mut best = from;
        for (index, value) in values.iter().enumerate().skip(from) {
            if sign * value > sign * values[best] {
                best = index;
            } else if sign * (values[best] - value) > back {
                break;
            }
        }
        best
    };
    if values.is_empty() {
        return (velocity.start, velocity.start, velocity.start);
    }
    let top = passed(0, 1.0);
    let bottom = passed(top, -1.0);
    let begin = values[..top].iter().rposition(|value| *value < 0.1 * values[top]).unwrap_or(0);
    (velocity.time(begin), velocity.time(top), velocity.time(bottom))
}

/// Largest lead that is looked for, s.
const LONGEST_LEAD: f64 = 1e-6;

/// By how much `early` runs ahead of `late` in a window: the shift τ of the least Σ (early(t) − late(t + τ))², from the parabola through the
/// best of a grid of the samples' own step and its neighbours, s.
#[must_use]
pub fn lead(early: &Series, late: &Series, (from, to): (f64, f64)) -> f64 {
    let step = early.step;
    let count = ((to - from) / step).round().max(1.0) as usize;
    let distance = |shift: i64| -> f64 {
        let times = (0..=count).map(|index| from + index as f64 * step);
        times.map(|time| (at(early, time) - at(late, time + shift as f64 * step)).powi(2)).sum()
    };
    let most = (LONGEST_LEAD / step).round() as i64;
    let best = (-most..=most).min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap_or(0);
    let [before, here, after] = [best - 1, best, best + 1].map(distance);
    let bend = before - 2.0 * here + after;
    let refined = if bend > 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
    (best as f64 + refined) * step
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_average_over_whole_periods_removes_a_sine_and_keeps_a_line() {
        let line = Series::new(0.0, 1e-7, (0..50).map(|i| 2.0 + 0.5 * f64::from(i)).collect());
        let tone = |i: usize| (0.5 * std::f64::consts::PI * i as f64).sin();
        let both = Series::new(0.0, 1e-7, line.values.iter().enumerate().map(|(i, v)| v + tone(i)).collect());
        let averaged = moving_average(&both, 4e-7);
        for index in 2..48 {
            assert!((averaged.values[index] - line.values[index]).abs() < 1e-12);
        }
    }

    #[test]
    fn the_error_of_a_delayed_sine_is_its_delay_over_its_radian_whatever_the_grids() {
        let sine = |step: f64, delay: f64| {
            let count = (40e-6 / step) as usize;
            Series::new(0.0, step, (0..count).map(|i| (1e6 * (i as f64 * step - delay)).sin()).collect())
        };
        // 1 % of a radian; linear interpolation of steps of 0.02 rad costs 1e-4 of it.
        let found = error(&sine(5e-8, 1e-8), &sine(2e-8, 0.0), (0.0, 31.4159e-6));
        assert!((found - 0.01).abs() < 1e-4, "{found}");
    }

    #[test]
    fn a_pulse_runs_from_a_tenth_of_its_first_maximum_to_the_minimum_behind_it_and_its_lead_is_its_shift() {
        let pulse = |t: f64| {
            let bell = |middle: f64| (-(t - middle).powi(2) / 1e-12).exp();
            0.5 * bell(3e-6) - 0.4 * bell(6e-6) + 0.8 * bell(9e-6)
        };
        let series =
            |delay: f64| Series::new(0.0, 2e-8, (0..600).map(|i| pulse(f64::from(i) * 2e-8 - delay)).collect());
        let (begin, top, bottom) = first_pulse(&series(0.0));
        // e^(−x²) = 0.1 at x = √ln 10; on the grid.
        assert!((begin - (3e-6 - 1e-6 * 10f64.ln().sqrt())).abs() < 2e-8, "{begin:e}");
        assert!((top - 3e-6).abs() < 1e-12 && (bottom - 6e-6).abs() < 1e-12, "{top:e} {bottom:e}");
        let found = lead(&series(0.0), &series(0.33e-7), (begin, bottom));
        // A parabola and linear interpolation on a grid of 20 ns.
        assert!((found - 0.33e-7).abs() < 2e-10, "{found:e}");
        assert!((lead(&series(0.33e-7), &series(0.0), (begin, bottom)) + found).abs() < 4e-10);
    }

    #[test]
    fn no_order_is_named_where_three_runs_show_none() {
        assert_eq!(observed_order([4.0, 2.0, 1.0], [1.0, 2.0]), None);
        let order = observed_order([1.0 / 8.0, 1.0 / 12.0, 1.0 / 16.0], [3.0, 1.0]).unwrap();
        assert!((1.0..3.0).contains(&order), "{order}");
    }
}
