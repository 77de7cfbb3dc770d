//! Impulses of a trace: when each arrives, how high and how wide it is. No drive and no period is assumed.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::{FeatureError, Window, interpolation::maximum_near, line::check_finite};
use crate::Series;

/// Level below which an impulse has ended, over that at which it begins: noise must not cut one in two.
const FALL: f64 = 0.7;

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Impulse {
    /// Centroid of what exceeds the level, s.
    pub arrival: f64,
    /// Largest value of the band-limited signal between its samples, unit of the series.
    pub peak: f64,
    /// Full width at half of its own peak, s; of one with several tops from the first rise to the last fall.
    pub width: f64,
}

/// The impulses of a window that exceed `share` of its largest value, in time. An impulse begins where the trace rises above that level and ends where it has
/// fallen below 0.7 of it; one that an end of the window cuts is left out.
///
/// Works at the series' own sampling: five samples an impulse are enough for a tenth of a step.
///
/// - `share`: 0 to 1
///
/// ```
/// # use granchain_signal::{Series, feature::{Window, impulses}};
/// let bell = |t: f64, at: f64| (-((t - at) / 30e-6).powi(2)).exp();
/// let time = |i: usize| i as f64 * 19.531e-6;
/// let trace = Series::new(0.0, 19.531e-6, (0..200).map(|i| bell(time(i), 500e-6) + 0.4 * bell(time(i), 2207e-6)).collect());
/// let found = impulses(&trace, Window::whole(&trace), 0.2)?;
/// assert!((found[1].arrival - found[0].arrival - 1707e-6).abs() < 1e-6 && (found[1].peak / found[0].peak - 0.4).abs() < 1e-3);
/// # Ok::<(), granchain_signal::feature::FeatureError>(())
/// ```
pub fn impulses(series: &Series, window: Window, share: f64) -> Result<Vec<Impulse>, FeatureError> {
    check_finite(series)?;
    let range = window.on(series)?.indices(series);
    let largest = series.values[range.clone()].iter().copied().fold(0.0, f64::max);
    let rise = share * largest;
    let spans = spans(series, range, rise, FALL * rise);
    Ok(spans.into_iter().map(|(span, arrival)| impulse(series, span, arrival)).collect())
}

/// Samples of every impulse, up to the one below `fall`, and the centroid (s) of what exceeds `rise`.
pub(super) fn spans(series: &Series, range: Range<usize>, rise: f64, fall: f64) -> Vec<(Range<usize>, f64)> {
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

fn impulse(series: &Series, span: Range<usize>, arrival: f64) -> Impulse {
    let values = &series.values;
    let top = span.clone().max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(span.start);
    let (_, peak) = maximum_near(values, top);
    let half = 0.5 * peak;
    let above = |index: &usize| values[*index] > half;
    let first = span.clone().find(above).unwrap_or(top);
    let last = span.rev().find(above).unwrap_or(top);
    // The samples beyond which it lies below half its peak, which may be less than the level.
    let first = (0..=first).rev().take_while(above).last().unwrap_or(first);
    let last = (last..values.len()).take_while(above).last().unwrap_or(last);
    // What lies beyond them up to the half peak, on the line to the next sample.
    let further = |inside: usize, outside: Option<usize>| {
        let next = outside.and_then(|outside| values.get(outside)).copied().unwrap_or(half);
        if values[inside] > next { (values[inside] - half) / (values[inside] - next) } else { 0.0 }
    };
    let width = (last - first) as f64 + further(first, first.checked_sub(1)) + further(last, Some(last + 1));
    Impulse { arrival, peak, width: width * series.step }
}

/// What an impulse that comes back says of where it was, free of the gain of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Return {
    /// Time from the incident impulse to the next, s.
    pub delay: f64,
    /// Ratio of their peaks, 1.
    pub ratio: f64,
    /// Widths of both, s.
    pub widths: [f64; 2],
}

impl Return {
    /// Of the first of some impulses and the second; none of fewer.
    pub fn of(impulses: &[Impulse]) -> Option<Self> {
        let [incident, returned, ..] = impulses else { return None };
        Some(Self {
            delay: returned.arrival - incident.arrival,
            ratio: returned.peak / incident.peak,
            widths: [incident.width, returned.width],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 19.531e-6;

    /// cos⁶ of 100 µs from foot to foot, the force of a solitary wave, at any instants.
    fn trace(step: f64, bells: &[(f64, f64)]) -> Series {
        let bell = |t: f64| {
            let phase = t / 130e-6 * std::f64::consts::PI;
            if phase.abs() < 0.5 * std::f64::consts::PI { phase.cos().powi(6) } else { 0.0 }
        };
        let value = |t: f64| bells.iter().map(|(at, height)| height * bell(t - at)).sum::<f64>();
        let count = (4e-3 / step) as usize;
        Series::new(0.0, step, (0..count).map(|i| value(i as f64 * step)).collect())
    }

    #[test]
    fn a_few_samples_an_impulse_tell_its_arrival_height_and_width_wherever_they_fall() {
        let fine = trace(1e-7, &[(600e-6, 1.0)]);
        let fine = impulses(&fine, Window::whole(&fine), 0.2).unwrap()[0];
        for shift in 0..20 {
            let at = 600e-6 + STEP * f64::from(shift) / 20.0;
            let trace = trace(STEP, &[(at, 1.0), (at + 1.7e-3, 0.45)]);
            let found = impulses(&trace, Window::whole(&trace), 0.2).unwrap();
            let Return { delay, ratio, widths } = Return::of(&found).unwrap();
            // A tenth of a sample; one impulse is 2.4 samples wide at half its height.
            assert!((found[0].arrival - at).abs() < 0.1 * STEP && (delay - 1.7e-3).abs() < 0.1 * STEP, "{found:?}");
            assert!((ratio / 0.45 - 1.0).abs() < 0.05 && (found[0].peak - 1.0).abs() < 0.03, "{found:?}");
            assert!(widths.iter().all(|width| (width / fine.width - 1.0).abs() < 0.15), "{found:?} {fine:?}");
        }
    }

    #[test]
    fn an_impulse_of_two_tops_is_one_and_what_the_window_cuts_is_none() {
        let two = trace(STEP, &[(600e-6, 1.0), (2000e-6, 0.5), (2060e-6, 0.45)]);
        let whole = Window::whole(&two);
        let found = impulses(&two, whole, 0.2).unwrap();
        assert!(found.len() == 2 && found[1].width > 1.8 * found[0].width, "{found:?}");
        assert_eq!(impulses(&two, Window::new(600e-6, 4e-3), 0.2).unwrap().len(), 1);
        assert_eq!(impulses(&two, Window::new(0.0, 2000e-6), 0.2).unwrap().len(), 1);
        let silent = Series::new(0.0, STEP, vec![0.0; 100]);
        assert_eq!(impulses(&silent, Window::whole(&silent), 0.2).unwrap(), []);
        assert_eq!(Return::of(&found[..1]), None);
    }
}
