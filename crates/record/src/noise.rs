//! Noise of a record, and how it was estimated.

use std::f64::consts::{LN_2, PI};

use super::baseline::{FEWEST_QUIET, median};
use granchain_signal::{Series, forward_transform, mean_and_rms};

/// Source of a noise estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseSource {
    /// The quiet samples at the start.
    Quiet,
    /// The converter's step, as step/√12: larger than the quiet samples show, or there are none.
    Quantisation,
    /// The floor of the spectrum near the upper end of the vibrometer's band: there are no quiet samples.
    SpectrumFloor,
    /// None: the noise is taken as zero.
    Unknown,
}

impl NoiseSource {
    #[must_use]
    pub(crate) fn describe(self) -> &'static str {
        match self {
            Self::Quiet => "quiet samples",
            Self::Quantisation => "quantisation",
            Self::SpectrumFloor => "floor of the spectrum",
            Self::Unknown => "unknown",
        }
    }
}

/// Most samples evaluated, from the middle of the record.
const MOST: usize = 1 << 15;
/// Band of the floor, as fractions of the vibrometer's bandwidth.
const FLOOR_BAND: (f64, f64) = (0.6, 0.9);
/// A floor below this fraction of the peak is rounding.
const ROUNDING: f64 = 1e-6;
/// A floor above this fraction of the peak is motion that was sampled too slowly, not noise.
const HIGHEST_FLOOR: f64 = 0.02;

/// Noise of the recorded quantity, its own unit, rms: the larger of step/√12 and the rms of `quiet` samples at the
/// start; without quiet samples, the larger of step/√12 and the spectrum's floor.
pub(super) fn noise(raw: &Series, quiet: usize, step: Option<f64>, bandwidth: Option<f64>) -> (f64, NoiseSource) {
    let rounding = step.map_or(0.0, |step| step / 12f64.sqrt());
    let (rms, source) = if quiet >= FEWEST_QUIET {
        let quiet = &raw.values[..quiet];
        let rms = mean_and_rms(quiet).1;
        // The mean of equal samples is off by its rounding.
        let rounded = 16.0 * f64::EPSILON * quiet.iter().fold(0.0, |peak, x| f64::max(peak, x.abs()));
        (if rms <= rounded { 0.0 } else { rms }, NoiseSource::Quiet)
    } else {
        match floor(raw, bandwidth) {
            Some(rms) => (rms, NoiseSource::SpectrumFloor),
            None => (0.0, NoiseSource::Unknown),
        }
    };
    if rounding > rms { (rounding, NoiseSource::Quantisation) } else { (rms, source) }
}

/// Velocities from which, and up to which, noise counts as that of motion and of rest, as fractions of the peak.
const MOVING: f64 = 0.3;
const RESTING: f64 = 0.05;
/// Most samples evaluated, evenly spread over the record.
const MOST_SPECKLED: usize = 1 << 14;
/// Fewest samples of either kind.
const FEWEST_SPECKLED: usize = 100;
/// Median of the square of a standard normal number.
const MEDIAN_SQUARE: f64 = 0.454_936;
/// Ratio of two estimates of white noise beyond which motion is in them.
const ALIKE: f64 = 1.3;
/// Variance of the part that grows with velocity over that of the constant part, from which it is stated.
const STATED: f64 = 1.0;

/// κ of a velocity's noise variance σ² + κ² v², white, 1; 0 if it does not grow with the velocity v (about `baseline`).
///
/// Speckle of a moving surface makes such noise. It is measured by sixth differences of the samples, which hold next to
/// nothing of a finely sampled motion. If eighth differences disagree, motion is in both, and κ is unknown (0).
pub(super) fn speckle(raw: &Series, baseline: f64, step: Option<f64>) -> f64 {
    let peak = raw.values.iter().fold(0.0, |peak, x| f64::max(peak, (x - baseline).abs()));
    let of = |order: usize, total: f64| {
        let weights: Vec<f64> = (0..order).fold(vec![1.0], |row, _| {
            let next = |k: usize| row.get(k).unwrap_or(&0.0) - if k > 0 { row[k - 1] } else { 0.0 };
            (0..=row.len()).map(next).collect()
        });
        let (mut rest, mut moving) = (Vec::new(), Vec::new());
        for part in raw.values.windows(order + 1).step_by(raw.len().div_ceil(MOST_SPECKLED).max(1)) {
            let velocity = part.iter().sum::<f64>() / part.len() as f64 - baseline;
            let noise = part.iter().zip(&weights).map(|(x, weight)| x * weight).sum::<f64>().powi(2) / total;
            match velocity.abs() / peak {
                share if share < RESTING => rest.push(noise),
                share if share > MOVING => moving.push((noise / velocity.powi(2), velocity.powi(2).recip())),
                _ => {}
            }
        }
        (rest.len().min(moving.len()) >= FEWEST_SPECKLED).then(|| {
            let [shares, squares]: [Vec<f64>; 2] =
                [moving.iter().map(|it| it.0).collect(), moving.iter().map(|it| it.1).collect()];
            let constant = f64::max(median(&rest) / MEDIAN_SQUARE, step.map_or(0.0, |step| step * step / 12.0));
            (median(&shares) / MEDIAN_SQUARE, constant * median(&squares))
        })
    };
    let (Some((all, constant)), Some((again, _))) = (of(6, 924.0), of(8, 12_870.0)) else { return 0.0 };
    let grown = all - constant;
    if grown < STATED * constant || all > ALIKE * again || again > ALIKE * all { 0.0 } else { grown.sqrt() }
}

/// Band of white noise of a vibrometer, Hz.
pub(super) fn noise_band(sample_rate: f64, bandwidth: Option<f64>) -> f64 {
    bandwidth.map_or(0.5 * sample_rate, |bandwidth| bandwidth.min(0.5 * sample_rate))
}

/// Rms of white noise. Its density is the median of the periodogram (Hann window) between 0.6 and 0.9 of the
/// vibrometer's band, over ln 2, since the periodogram of noise is exponentially distributed. Lines do not move a
/// median.
fn floor(raw: &Series, bandwidth: Option<f64>) -> Option<f64> {
    let beside = raw.len().saturating_sub(MOST) / 2;
    let values = raw.values.get(beside..raw.len() - beside)?;
    let n = values.len();
    if n < 64 {
        return None;
    }
    let (mean, _) = mean_and_rms(values);
    let plan = forward_transform(n);
    let mut input = plan.make_input_vec();
    for (i, (slot, value)) in input.iter_mut().zip(values).enumerate() {
        *slot = (value - mean) * (1.0 - libm::cos(2.0 * PI * (i as f64 + 0.5) / n as f64));
    }
    let mut output = plan.make_output_vec();
    plan.process(&mut input, &mut output).ok()?;
    let sample_rate = raw.sample_rate();
    let band = noise_band(sample_rate, bandwidth);
    let bin = |part: f64| (part * band / sample_rate * n as f64) as usize;
    let mut powers: Vec<f64> =
        output.get(bin(FLOOR_BAND.0)..bin(FLOOR_BAND.1))?.iter().map(|bin| bin.norm_sqr()).collect();
    if powers.len() < 8 {
        return None;
    }
    let middle = powers.len() / 2;
    let median = *powers.select_nth_unstable_by(middle, f64::total_cmp).1;
    // The window's weights 1 − cos have a mean square of 3/2: |X|² of white noise is 3/2 n σ² over all of the Nyquist band.
    let density = median / LN_2 / (1.5 * n as f64);
    let rms = (density * band / (0.5 * sample_rate)).sqrt();
    let peak = values.iter().fold(0.0, |peak, x| f64::max(peak, (x - mean).abs()));
    match rms / peak {
        share if share < ROUNDING => Some(0.0),
        share if share <= HIGHEST_FLOOR => Some(rms),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform noise of rms 1 from a fixed seed.
    fn even(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * 12f64.sqrt()
    }

    fn tone(noise: f64) -> Series {
        let mut seed = 7;
        Series::new(0.0, 2e-7, (0..4000).map(|i| (0.0917 * f64::from(i)).sin() + noise * even(&mut seed)).collect())
    }

    #[test]
    fn a_record_without_quiet_samples_shows_its_noise_between_the_lines() {
        for noise_rms in [1e-2, 1e-3] {
            let (found, source) = noise(&tone(noise_rms), 0, None, None);
            // The median of 600 exponential values is known to 6 %, its root to 3 %.
            assert!((found / noise_rms - 1.0).abs() < 0.1, "{noise_rms}: {found}");
            assert_eq!(source, NoiseSource::SpectrumFloor);
        }
        assert_eq!(noise(&tone(0.0), 0, None, None), (0.0, NoiseSource::SpectrumFloor));
    }

    #[test]
    fn noise_that_grows_with_velocity_differs_from_noise_that_does_not() {
        let mut seed = 5;
        let mut record = |constant: f64, grows: f64| {
            let motion = |i: i32| {
                let t = f64::from(i - 500).max(0.0);
                (1.0 - (-t / 500.0).exp()) * ((0.0917 * t).sin() + 0.3 * (0.183 * t).sin() + 0.1 * (0.367 * t).sin())
            };
            let noisy = |i: i32| motion(i) * (1.0 + grows * even(&mut seed)) + constant * even(&mut seed);
            Series::new(0.0, 2e-7, (0..4000).map(noisy).collect())
        };
        let found = speckle(&record(2e-3, 0.03), 0.0, None);
        // 2500 samples, of which sixth differences leave a third independent: known to a twentieth.
        assert!((found / 0.03 - 1.0).abs() < 0.15, "{found}");
        assert_eq!(speckle(&record(1e-2, 0.0), 0.0, None), 0.0);
        assert_eq!(speckle(&record(0.0, 0.0), 0.0, None), 0.0);
        // Rounding shows while the record moves and not before.
        let rounded = record(0.0, 0.0).map(|x| (x / 0.01).round() * 0.01);
        assert_eq!(speckle(&rounded, 0.0, Some(0.01)), 0.0);
    }

    #[test]
    fn the_step_counts_where_it_is_more_than_the_quiet_samples_show() {
        let mut series = tone(0.0);
        series.values[..100].fill(0.0);
        let (rms, source) = noise(&series, 100, Some(0.01), None);
        assert_eq!((rms, source), (0.01 / 12f64.sqrt(), NoiseSource::Quantisation));
        assert_eq!(noise(&series, 100, None, None), (0.0, NoiseSource::Quiet));
    }
}
