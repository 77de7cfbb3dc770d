//! Bridges invalid samples, the same way in records and in simulated traces.

use serde::Serialize;

use super::Series;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gap {
    /// Last valid instant before the gap, s; −∞ if a series begins inside it.
    pub from: f64,
    /// First valid instant after the gap, s; +∞ if a series ends inside it.
    pub to: f64,
    /// Length of each of the four means that carry the bridge, two on either side, s.
    pub support: f64,
}

impl Gap {
    /// The same, `by` seconds later.
    #[must_use]
    pub fn later(self, by: f64) -> Self {
        Self { from: self.from + by, to: self.to + by, ..self }
    }
}

/// Replace the samples inside each gap by the cubic through two means on either side of it.
///
/// Each mean is that of the samples over [`Gap::support`], so that noise counts alike whatever the sample rate. A gap at an end of the series is filled
/// with the mean that is nearest to it.
///
/// ```
/// # use granchain_signal::{Gap, Series, bridge};
/// let mut line = Series::new(0.0, 0.1, (0..100).map(f64::from).collect());
/// line.values[50] = 1e3;
/// bridge(&mut line, &[Gap { from: 4.9, to: 5.1, support: 0.1 }]);
/// assert!((line.values[50] - 50.0).abs() < 1e-9);
/// ```
pub fn bridge(series: &mut Series, gaps: &[Gap]) {
    for gap in gaps {
        bridge_one(series, gap);
    }
}

fn bridge_one(series: &mut Series, gap: &Gap) {
    let (start, step, count) = (series.start, series.step, series.len());
    // A hair inside, so that an instant at an end of the gap counts as valid.
    let hair = 1e-6 * step;
    let index = |t: f64| (((t - start) / step).ceil().max(0.0) as usize).min(count);
    let (first, past) = (index(gap.from + hair), index(gap.to - hair));
    if first >= past {
        return;
    }
    let width = ((gap.support / step).round() as usize).max(1);
    let mean = |from: usize, past: usize| {
        let values = &series.values[from..past];
        let middle = 0.5 * (from + past - 1) as f64;
        (middle, values.iter().sum::<f64>() / values.len() as f64)
    };
    let mut points = Vec::with_capacity(4);
    for number in [2, 1] {
        if first >= number * width {
            points.push(mean(first - number * width, first - (number - 1) * width));
        }
    }
    for number in [1, 2] {
        if past + number * width <= count {
            points.push(mean(past + (number - 1) * width, past + number * width));
        }
    }
    let at_an_end = first < width || past + width > count;
    let bridged = |x: f64| match points.as_slice() {
        [] => None,
        points if at_an_end => {
            points.iter().min_by(|a, b| (a.0 - x).abs().total_cmp(&(b.0 - x).abs())).map(|point| point.1)
        }
        points => Some(lagrange(points, x)),
    };
    let values: Option<Vec<f64>> = (first..past).map(|i| bridged(i as f64)).collect();
    if let Some(values) = values {
        series.values[first..past].copy_from_slice(&values);
    }
}

/// The polynomial through some points.
fn lagrange(points: &[(f64, f64)], x: f64) -> f64 {
    let weight = |i: usize| {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, (other, _))| (x - other) / (points[i].0 - other)).product::<f64>()
    };
    points.iter().enumerate().map(|(i, (_, value))| weight(i) * value).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_in_a_slow_tone_is_bridged_alike_at_any_sample_rate() {
        let tone = |step: f64| {
            Series::new(0.0, step, (0..(200.0 / step) as usize).map(|i| (0.1 * i as f64 * step).sin()).collect())
        };
        let gap = Gap { from: 50.0, to: 58.0, support: 2.0 };
        for step in [0.1, 0.5, 1.0] {
            let (truth, mut broken) = (tone(step), tone(step));
            let inside = |t: f64| t > 50.0 + 1e-9 && t < 58.0 - 1e-9;
            for i in 0..broken.len() {
                if inside(broken.time(i)) {
                    broken.values[i] = 9.0;
                }
            }
            bridge(&mut broken, &[gap]);
            for i in 0..truth.len() {
                let error = (truth.values[i] - broken.values[i]).abs();
                assert!(error < if inside(truth.time(i)) { 0.02 } else { 1e-15 }, "{step} {i}: {error}");
            }
        }
    }

    #[test]
    fn a_gap_at_an_end_is_filled_with_what_stands_beside_it() {
        let mut series = Series::new(0.0, 1.0, vec![9.0, 9.0, 1.0, 1.0, 1.0, 1.0, 7.0]);
        let ends = [
            Gap { from: f64::NEG_INFINITY, to: 2.0, support: 1.0 },
            Gap { from: 5.0, to: f64::INFINITY, support: 1.0 },
        ];
        bridge(&mut series, &ends);
        assert_eq!(series.values, [1.0; 7]);
    }
}
