//! What a hit says of its column, free of the gain of the sensor: the same function of a record and of a run.

use granchain_signal::{
    Series,
    feature::{impulse_spans, maximum_near},
    mean_and_rms,
};
use nalgebra::SVector;

/// Number of features of a hit.
pub(crate) const FEATURES: usize = 4;

/// Names of the features, in order; all enter as logarithms.
pub const NAMES: [&str; FEATURES] = ["return_time", "peak_ratio", "width_ratio", "incident_width"];

/// Which of them is the width of the incident impulse.
pub(crate) const INCIDENT_WIDTH: usize = 3;

pub type Features = SVector<f64, FEATURES>;

/// Level over the largest value, 1, above which an impulse is one.
const LEVEL: f64 = 0.15;

/// Level below which an impulse has ended, over that at which it begins: noise must not cut one in two.
const FALL: f64 = 0.7;

/// Share of the largest excursion, 1, from which the trace is no longer quiet.
const QUIET: f64 = 0.1;

/// Fewest quiet samples that give a baseline.
const FEWEST: usize = 4;

/// The incident and the returned impulse of one hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impulses {
    /// Arrival of the incident impulse, s.
    pub arrival: f64,
    /// Largest value of the incident impulse, unit of the series.
    pub peak: f64,
    /// Time from the incident impulse to the returned one, s.
    pub delay: f64,
    /// Ratio of their peaks, returned over incident, 1.
    pub ratio: f64,
    /// Widths of both, s.
    pub widths: [f64; 2],
}

impl Impulses {
    /// ln of return time (s), of the ratio of the peaks and of the ratio of the widths, returned over incident, and of the incident width (s), which
    /// the beads and the striker alone decide. A filter that passes both impulses alike leaves the first three nearly as they are.
    pub(crate) fn features(&self) -> Features {
        let [incident, returned] = self.widths;
        Features::new(self.delay.ln(), self.ratio.ln(), (returned / incident).ln(), incident.ln())
    }
}

/// The trace above its baseline, the sign turned where the largest excursion is negative, since the gain has any sign.
pub fn levelled(series: &Series) -> Series {
    let mut sorted = series.values.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or_default();
    let largest =
        series.values.iter().map(|value| value - median).fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    let first = series.values.iter().position(|value| (value - median).abs() > QUIET * largest.abs()).unwrap_or(0);
    // The sample before it may stand on the foot of the impulse already.
    let lead = first.saturating_sub(2);
    let baseline = if lead < FEWEST { median } else { mean_and_rms(&series.values[..lead]).0 };
    series.map(|value| largest.signum() * (value - baseline))
}

/// The first impulse of a trace, and the first that comes `earliest` (s) or more after it; `None` without one.
pub fn observe(series: &Series, earliest: f64) -> Option<Impulses> {
    let found = impulses(&levelled(series), LEVEL);
    let incident = found.first()?;
    let returned = found[1..].iter().find(|impulse| impulse.arrival - incident.arrival >= earliest)?;
    Some(Impulses {
        arrival: incident.arrival,
        peak: incident.peak,
        delay: returned.arrival - incident.arrival,
        ratio: returned.peak / incident.peak,
        widths: [incident.width, returned.width],
    })
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Impulse {
    /// Centroid of what exceeds the level, s.
    arrival: f64,
    /// Largest value of the band-limited signal between its samples, unit of the series.
    peak: f64,
    /// Full width at half of its own peak, s; of one with several tops from the first rise to the last fall.
    width: f64,
}

/// The impulses that exceed `share` of the largest value, in time, at the series' own sampling: five samples an impulse are enough for a tenth of a
/// step. One that an end of the series cuts is left out.
fn impulses(series: &Series, share: f64) -> Vec<Impulse> {
    let rise = share * series.values.iter().copied().fold(0.0, f64::max);
    let values = &series.values;
    let impulse = |(span, arrival): (std::ops::Range<usize>, f64)| {
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
    };
    impulse_spans(series, 0..series.len(), rise, FALL * rise).into_iter().map(impulse).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 19.531e-6;

    #[test]
    fn neither_gain_nor_sign_nor_offset_of_the_sensor_changes_a_feature() {
        let trace = |gain: f64, offset: f64| {
            let bell = |t: f64, at: f64| (-((t - at) / 35e-6).powi(2)).exp();
            let value = |t: f64| offset + gain * (bell(t, 5e-4) + 0.4 * bell(t, 2e-3));
            Series::new(0.0, 19.5e-6, (0..200).map(|i| value(f64::from(i) * 19.5e-6)).collect())
        };
        let of = |gain, offset| observe(&trace(gain, offset), 0.0).unwrap().features();
        let newtons = of(20.0, 0.0);
        assert!((newtons[0].exp() - 1.5e-3).abs() < 2e-6 && (newtons[1].exp() - 0.4).abs() < 0.01, "{newtons}");
        for (gain, offset) in [(0.017, 1.6e-4), (-0.017, 0.0), (-3.0, 11.0)] {
            assert!((of(gain, offset) - newtons).norm() < 1e-9, "{gain} {offset}");
        }
    }

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
        let fine = impulses(&trace(1e-7, &[(600e-6, 1.0)]), 0.2)[0];
        for shift in 0..20 {
            let at = 600e-6 + STEP * f64::from(shift) / 20.0;
            let trace = trace(STEP, &[(at, 1.0), (at + 1.7e-3, 0.45)]);
            let found = impulses(&trace, 0.2);
            let [Impulse { arrival, peak, .. }, returned] = found[..] else { panic!("{found:?}") };
            let (delay, ratio) = (returned.arrival - arrival, returned.peak / peak);
            let widths = [found[0].width, returned.width];
            // A tenth of a sample; one impulse is 2.4 samples wide at half its height.
            assert!((arrival - at).abs() < 0.1 * STEP && (delay - 1.7e-3).abs() < 0.1 * STEP, "{arrival} {delay}");
            assert!((ratio / 0.45 - 1.0).abs() < 0.05 && (peak - 1.0).abs() < 0.03, "{ratio} {peak}");
            assert!(widths.iter().all(|width| (width / fine.width - 1.0).abs() < 0.15), "{widths:?} {fine:?}");
        }
    }

    #[test]
    fn an_impulse_of_two_tops_is_one_and_what_an_end_cuts_is_none() {
        let two = trace(STEP, &[(600e-6, 1.0), (2000e-6, 0.5), (2060e-6, 0.45)]);
        let found = impulses(&two, 0.2);
        assert!(found.len() == 2 && found[1].width > 1.8 * found[0].width, "{found:?}");
        assert_eq!(impulses(&two.window(600e-6, 4e-3), 0.2).len(), 1);
        assert_eq!(impulses(&two.window(0.0, 2000e-6), 0.2).len(), 1);
        let silent = Series::new(0.0, STEP, vec![0.0; 100]);
        assert_eq!(impulses(&silent, 0.2), []);
        assert_eq!(observe(&two.window(0.0, 2000e-6), 0.0), None);
    }
}
