//! What a hit says of its column, free of the gain of the sensor: the same function of a record and of a run.

use granchain_signal::{
    Series,
    feature::{FeatureError, Return, Window, impulses},
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

/// Share of the largest excursion, 1, from which the trace is no longer quiet.
const QUIET: f64 = 0.1;

/// Fewest quiet samples that give a baseline.
const FEWEST: usize = 4;

/// The incident and the returned impulse of one hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impulses {
    pub returned: Return,
    /// Largest value of the incident impulse, unit of the series.
    pub peak: f64,
    /// Arrival of the incident impulse, s.
    pub arrival: f64,
}

impl Impulses {
    /// ln of return time (s), of the ratio of the peaks and of the ratio of the widths, returned over incident, and of the incident width (s), which
    /// the beads and the striker alone decide. A filter that passes both impulses alike leaves the first three nearly as they are.
    pub(crate) fn features(&self) -> Features {
        let Return { delay, ratio, widths: [incident, returned] } = self.returned;
        Features::new(delay.ln(), ratio.ln(), (returned / incident).ln(), incident.ln())
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
pub fn observe(series: &Series, earliest: f64) -> Result<Option<Impulses>, FeatureError> {
    let level = levelled(series);
    let mut found = impulses(&level, Window::whole(&level), LEVEL)?;
    let Some(first) = found.first().copied() else { return Ok(None) };
    found.retain(|impulse| impulse.arrival == first.arrival || impulse.arrival - first.arrival >= earliest);
    let returned = Return::of(&found);
    Ok(returned.map(|returned| Impulses { returned, peak: first.peak, arrival: first.arrival }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trace(gain: f64, offset: f64) -> Series {
        let bell = |t: f64, at: f64| (-((t - at) / 35e-6).powi(2)).exp();
        let value = |i: usize| i as f64 * 19.5e-6;
        Series::new(
            0.0,
            19.5e-6,
            (0..200).map(|i| offset + gain * (bell(value(i), 5e-4) + 0.4 * bell(value(i), 2e-3))).collect(),
        )
    }

    #[test]
    fn neither_gain_nor_sign_nor_offset_of_the_sensor_changes_a_feature() {
        let of = |gain, offset| observe(&trace(gain, offset), 0.0).unwrap().unwrap().features();
        let newtons = of(20.0, 0.0);
        assert!((newtons[0].exp() - 1.5e-3).abs() < 2e-6 && (newtons[1].exp() - 0.4).abs() < 0.01, "{newtons}");
        for (gain, offset) in [(0.017, 1.6e-4), (-0.017, 0.0), (-3.0, 11.0)] {
            assert!((of(gain, offset) - newtons).norm() < 1e-9, "{gain} {offset}");
        }
    }
}
