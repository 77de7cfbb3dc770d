//! Repetition of the impulses of a train.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::{FeatureError, Window, line::check_finite};
use crate::Series;

/// The train of impulses above half the positive peak.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Repetition {
    pub impulses: usize,
    /// Mean interval, drive periods: 3.00 where every third period carries one impulse.
    pub mean_interval_periods: f64,
    /// Standard deviation of the intervals over their mean: 0 is perfectly regular.
    pub irregularity: f64,
}

/// Mean interval and regularity of the impulses above half of `positive_peak` in the window.
///
/// An impulse begins where the trace rises above half the peak and ends where it has fallen below 0.35 of it (noise
/// must not cut one in two); its instant is the centroid of what exceeds half the peak. `None` with fewer than two.
///
/// - `positive_peak`: from [`peaks`](super::peaks), unit of the series
/// - `drive_frequency`: f0, Hz
pub fn repetition(
    series: &Series,
    window: Window,
    drive_frequency: f64,
    positive_peak: f64,
) -> Result<Option<Repetition>, FeatureError> {
    check_finite(series)?;
    let range = window.on(series)?.indices(series);
    if positive_peak <= 0.0 {
        return Ok(None);
    }
    let (rise, fall) = (0.5 * positive_peak, 0.35 * positive_peak);
    // One cut off by an end of the window has no centroid and is left out.
    let instants: Vec<f64> =
        impulse_spans(series, range, rise, fall).into_iter().map(|(_, centroid)| centroid).collect();
    if instants.len() < 2 {
        return Ok(None);
    }
    let intervals: Vec<f64> = instants.windows(2).map(|pair| (pair[1] - pair[0]) * drive_frequency).collect();
    let count = intervals.len() as f64;
    let mean = intervals.iter().sum::<f64>() / count;
    let variance = intervals.iter().map(|interval| (interval - mean).powi(2)).sum::<f64>() / count;
    Ok(Some(Repetition { impulses: instants.len(), mean_interval_periods: mean, irregularity: variance.sqrt() / mean }))
}

/// Samples of every impulse of a range, up to the one below `fall`, and the centroid (s) of what exceeds `rise`.
pub fn impulse_spans(series: &Series, range: Range<usize>, rise: f64, fall: f64) -> Vec<(Range<usize>, f64)> {
    let mut spans = Vec::new();
    if rise <= 0.0 {
        return spans;
    }
    let (mut begun, mut weight, mut moment) = (None, 0.0, 0.0);
    for index in range.clone() {
        let value = series.values[index];
        if value > rise {
            begun = begun.or(Some(index));
        }
        let Some(first) = begun else { continue };
        let above = (value - rise).max(0.0);
        weight += above;
        moment += above * series.time(index);
        if value < fall {
            // One the window begins in has no centroid.
            if first > range.start {
                spans.push((first..index, moment / weight));
            }
            (begun, weight, moment) = (None, 0.0, 0.0);
        }
    }
    spans
}
