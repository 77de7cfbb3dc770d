//! Similarity of two records whose clocks have an unknown lag.

use serde::{Deserialize, Serialize};

use super::{FeatureError, line::check_finite};
use crate::{Series, forward_transform, inverse_transform};

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CorrelationPeak {
    /// Largest normalised cross-correlation, −1…1.
    pub value: f64,
    /// Lag, s: `candidate(t + lag)` lies over `reference(t)`, both on their own clocks.
    pub lag_s: f64,
}

/// Largest normalised cross-correlation of two records over every lag,
///
/// max over τ of Σ a(t) b(t + τ)/√(Σ a² Σ b²).
///
/// The sums run over all samples; records count as zero outside their span, and no mean is removed. The value is 1 for
/// records that differ only by a delay and a positive factor. It does not depend on the size of either record; remove
/// an offset first. The companion paper uses it to compare a modelled impulse train with a hydrophone record.
/// [`similarity`](super::similarity) is the stricter measure for two steady responses to one drive: it limits the lag
/// to a few drive periods.
///
/// - `reference`, `candidate`: of any unit each, same sample step (to 1e-9); the maximum is interpolated between
///   samples by a parabola
///
/// ```
/// # use granchain_signal::{feature::correlation_peak, Series};
/// let pulse = |at: f64, size: f64| {
///     Series::new(0.0, 1e-8, (0..4000).map(|i| size * (-((i as f64 - at) / 40.0).powi(2)).exp()).collect())
/// };
/// let found = correlation_peak(&pulse(900.0, 1.0), &pulse(2100.0, 7.0))?;
/// assert!((found.value - 1.0).abs() < 1e-9 && (found.lag_s - 12e-6).abs() < 1e-11);
/// # Ok::<(), granchain_signal::feature::FeatureError>(())
/// ```
pub fn correlation_peak(reference: &Series, candidate: &Series) -> Result<CorrelationPeak, FeatureError> {
    check_finite(reference)?;
    check_finite(candidate)?;
    if (candidate.step / reference.step - 1.0).abs() > 1e-9 {
        return Err(FeatureError::Steps { reference_s: reference.step, candidate_s: candidate.step });
    }
    let energy = |series: &Series| series.values.iter().map(|value| value * value).sum::<f64>();
    let product = (energy(reference) * energy(candidate)).sqrt();
    for series in [reference, candidate] {
        if energy(series) <= 0.0 {
            return Err(FeatureError::Constant { from_s: series.start, to_s: series.end() });
        }
    }
    let sums = lagged_sums(&reference.values, &candidate.values);
    let length = sums.len();
    let best = (0..length).fold(0, |best, index| if sums[index] > sums[best] { index } else { best });
    let at = |index: usize| sums[index % length] / product;
    let (below, middle, above) = (at(best + length - 1), at(best), at(best + 1));
    let curvature = 2.0 * middle - below - above;
    let fraction = if curvature > 0.0 { (0.5 * (above - below) / curvature).clamp(-0.5, 0.5) } else { 0.0 };
    let lag = if best < candidate.len() { best as f64 } else { best as f64 - length as f64 };
    Ok(CorrelationPeak {
        value: (middle + 0.25 * (above - below) * fraction).min(1.0),
        lag_s: (lag + fraction) * reference.step + candidate.start - reference.start,
    })
}

/// Σ a(i) b(i + lag) over all samples that overlap, for every lag by one transform; a negative lag counts from the end.
pub(super) fn lagged_sums(a: &[f64], b: &[f64]) -> Vec<f64> {
    // Room for every lag: no lag meets a wrapped copy.
    let length = (a.len() + b.len()).next_power_of_two();
    let (forward, backward) = (forward_transform(length), inverse_transform(length));
    let transform = |values: &[f64]| {
        let (mut input, mut output) = (forward.make_input_vec(), forward.make_output_vec());
        input[..values.len()].copy_from_slice(values);
        // Cannot fail: both buffers were made by the plan.
        let _ = forward.process(&mut input, &mut output);
        output
    };
    let mut cross = transform(b);
    for (value, other) in cross.iter_mut().zip(transform(a)) {
        *value *= other.conj();
    }
    // Real by symmetry; rounding is not, and the plan insists.
    cross[0].im = 0.0;
    cross[length / 2].im = 0.0;
    let mut sums = backward.make_output_vec();
    let _ = backward.process(&mut cross, &mut sums);
    let scale = 1.0 / length as f64;
    sums.iter_mut().for_each(|sum| *sum *= scale);
    sums
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn pulse(at: f64, width: f64) -> Series {
        Series::new(0.0, 1e-8, (0..6000).map(|i| (-0.5 * ((i as f64 * 1e-8 - at) / width).powi(2)).exp()).collect())
    }

    #[test]
    fn two_gaussians_of_other_widths_agree_as_their_overlap_says() {
        // ∫ab/√(∫a² ∫b²) = √(2 s t/(s² + t²)).
        for (s, t) in [(1e-6, 1e-6), (1e-6, 2e-6), (0.5e-6, 3e-6)] {
            let found = correlation_peak(&pulse(20e-6, s), &pulse(33.3e-6, t)).unwrap();
            let exact = (2.0 * s * t / (s * s + t * t)).sqrt();
            assert!((found.value - exact).abs() < 1e-6, "{s} {t}: {} {exact}", found.value);
            assert!((found.lag_s - 13.3e-6).abs() < 1e-10, "{}", found.lag_s);
        }
    }

    #[test]
    fn a_negative_lag_and_records_of_other_lengths_and_clocks() {
        let early = pulse(11e-6, 1e-6);
        let mut late = pulse(42e-6, 1e-6);
        assert!((correlation_peak(&late, &early).unwrap().lag_s + 31e-6).abs() < 1e-10);
        late.start = 5e-6;
        late.values.truncate(4500);
        assert!((correlation_peak(&late, &early).unwrap().lag_s + 36e-6).abs() < 1e-10);
    }

    #[test]
    fn an_inverted_burst_agrees_half_a_period_later() {
        let (f, count) = (73e3, 12000);
        let burst = |sign: f64| {
            let value = |i: usize| {
                let t = i as f64 * 1e-8;
                sign * (TAU * f * t).sin() * (-0.5 * ((t - 60e-6) / 15e-6).powi(2)).exp()
            };
            Series::new(0.0, 1e-8, (0..count).map(value).collect())
        };
        let found = correlation_peak(&burst(1.0), &burst(-1.0)).unwrap();
        // ½ exp(−(τ/2s)²) cos at τ = T/2, the envelope pulling the maximum in a little.
        let envelope = |tau: f64| (-(tau / 30e-6).powi(2)).exp();
        assert!(found.value > envelope(0.5 / f) && found.value < envelope(0.47 / f), "{}", found.value);
        assert!((found.lag_s.abs() * f - 0.5).abs() < 0.03, "{}", found.lag_s);
    }

    #[test]
    fn silence_and_other_steps_are_refused() {
        let silent = Series::new(0.0, 1e-8, vec![0.0; 100]);
        assert!(matches!(correlation_peak(&silent, &pulse(1e-6, 1e-6)), Err(FeatureError::Constant { .. })));
        let slower = Series { step: 2e-8, ..pulse(1e-6, 1e-6) };
        let refusal = correlation_peak(&pulse(1e-6, 1e-6), &slower).unwrap_err();
        assert!(refusal.to_string().contains("resample"), "{refusal}");
    }
}
