//! Noise with a power density of 1/f below a corner frequency and constant above.

use std::f64::consts::{LN_2, TAU};

use realfft::RealFftPlanner;

/// One-sided density S(f) = `white` + `flicker`/f.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseSpectrum {
    /// Density of the white part, unit²/Hz.
    pub white: f64,
    /// Density of the 1/f part times the frequency, unit².
    pub flicker: f64,
}

/// Fewest samples for a spectrum.
const FEWEST: usize = 64;
/// Twice the gain in log-likelihood above which a 1/f part is significant: exceeded by chance in one record of a
/// thousand.
const GAIN: f64 = 10.8;
/// Ratio of the corners of two neighbouring sections of the generator.
const RATIO: f64 = 4.0;

impl NoiseSpectrum {
    /// Estimates the spectrum of samples at rest by Whittle's likelihood of their periodogram (Hann window). White if
    /// a 1/f part is not significant; `None` for too few samples.
    pub fn of(quiet: &[f64], step: f64) -> Option<Self> {
        let n = quiet.len();
        if n < FEWEST {
            return None;
        }
        let mean = quiet.iter().sum::<f64>() / n as f64;
        let plan = RealFftPlanner::<f64>::new().plan_fft_forward(n);
        let mut input = plan.make_input_vec();
        for (i, (slot, value)) in input.iter_mut().zip(quiet).enumerate() {
            *slot = (value - mean) * (1.0 - (TAU * (i as f64 + 0.5) / n as f64).cos());
        }
        let mut output = plan.make_output_vec();
        plan.process(&mut input, &mut output).ok()?;
        // One-sided density; the weights 1 − cos have a mean square of 3/2. The mean takes the lowest two bins with it.
        let bins: Vec<(f64, f64)> = (2..output.len().saturating_sub(1))
            .map(|k| (k as f64 / (n as f64 * step), 2.0 * step * output[k].norm_sqr() / (1.5 * n as f64)))
            .collect();
        if bins.len() < FEWEST / 4 || bins.iter().all(|(_, power)| *power == 0.0) {
            return None;
        }
        // With S = w (1 + c/f) the best w is the mean of I/(1 + c/f).
        let profile = |corner: f64| {
            let shape = |f: f64| 1.0 + corner / f;
            let white = bins.iter().map(|(f, power)| power / shape(*f)).sum::<f64>() / bins.len() as f64;
            let cost: f64 = bins.iter().map(|(f, _)| (white * shape(*f)).ln()).sum();
            (cost, white)
        };
        let (plain, white) = profile(0.0);
        let (lowest, highest) = (bins[0].0, bins[bins.len() - 1].0);
        let corners = (0..=60).map(|i| 0.5 * lowest * (2.0 * 100.0 * highest / lowest).powf(f64::from(i) / 60.0));
        let best = corners.map(|corner| (profile(corner), corner)).min_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
        // Neighbouring bins of a Hann window are not independent: two thirds of them are.
        let ((cost, with), corner) = best;
        if 2.0 * (plain - cost) / 1.5 < GAIN {
            return Some(Self { white, flicker: 0.0 });
        }
        Some(Self { white: with, flicker: with * corner })
    }

    /// Variance between two frequencies, Hz.
    pub fn variance(&self, low: f64, high: f64) -> f64 {
        self.white * (high - low) + self.flicker * (high / low).ln()
    }
}

/// A source of 1/f noise: a sum of first-order sections whose corners are a factor of four apart.
#[derive(Debug, Clone)]
pub struct FlickerSource {
    /// Per section: decay factor, gain of the input, state.
    sections: Vec<[f64; 3]>,
}

impl FlickerSource {
    /// A source of density `flicker`/f down to `lowest` (Hz) for samples every `step` seconds; `draw` gives standard
    /// normal numbers.
    pub fn new(flicker: f64, step: f64, lowest: f64, mut draw: impl FnMut() -> f64) -> Self {
        let highest = 0.5 / step;
        let count = ((highest / lowest).ln() / (2.0 * LN_2)).ceil().max(1.0) as usize + 1;
        let deviation = (flicker * RATIO.ln()).sqrt();
        let section = |i: usize| {
            let kept = (-TAU * lowest * RATIO.powi(i as i32) * step).exp();
            [kept, deviation * (1.0 - kept * kept).sqrt(), deviation]
        };
        let mut sections: Vec<[f64; 3]> = (0..count).map(section).collect();
        sections.iter_mut().for_each(|section| section[2] *= draw());
        Self { sections }
    }

    pub fn next(&mut self, mut draw: impl FnMut() -> f64) -> f64 {
        self.sections
            .iter_mut()
            .map(|[kept, added, state]| {
                *state = *kept * *state + *added * draw();
                *state
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal(seed: &mut u64) -> f64 {
        let mut even = || {
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((*seed >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        };
        (-2.0 * even().ln()).sqrt() * (TAU * even()).cos()
    }

    #[test]
    fn white_and_flicker_noise_are_separated_with_their_strengths() {
        let (step, mut seed) = (1e-7, 11);
        let mut found = Vec::new();
        for _ in 0..40 {
            let white: Vec<f64> = (0..1000).map(|_| normal(&mut seed)).collect();
            let spectrum = NoiseSpectrum::of(&white, step).unwrap();
            assert_eq!(spectrum.flicker, 0.0);
            assert!((spectrum.white / (2.0 * step) - 1.0).abs() < 0.2);
            let mut source = FlickerSource::new(1.0, step, 1e3, || normal(&mut seed));
            let pink: Vec<f64> = (0..1000).map(|_| source.next(|| normal(&mut seed))).collect();
            found.push(NoiseSpectrum::of(&pink, step).unwrap().flicker);
        }
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        assert!((mean - 1.0).abs() < 0.15 && found.iter().all(|it| (0.5..2.0).contains(it)), "{mean} {found:?}");
    }
}
