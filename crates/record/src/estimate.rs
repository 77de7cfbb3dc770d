//! Estimate of the motion under noise: a Wiener filter.

use std::f64::consts::PI;

use rand::Rng;
use realfft::num_complex::Complex;

use granchain_signal::{NoiseSpectrum, Series, forward_transform, inverse_transform};

/// Half-width over which a spectrum is smoothed before it is compared with the noise, in drive frequencies.
const SMOOTHED: f64 = 1.0 / 24.0;
const FEWEST_BINS: usize = 3;
/// σ by which a smoothed bin must exceed the mean of noise before the filter opens.
const STRICT: f64 = 3.0;
/// Fraction of the drive frequency below which an integral counts as drift.
pub(super) const DRIFT: f64 = 0.125;
/// Most values of a residual density.
const MOST_BINS: usize = 2048;

/// Residual noise in a drive: its one-sided spectral density.
///
/// A realisation is Σ √(2 S(f_k) δf) cos(2πf_k t + φ_k) with random φ_k, or noise of that spectrum made in any other way.
#[derive(Debug, Clone, PartialEq)]
pub struct Remainder {
    /// Distance of the frequencies, Hz; the first is 0.
    pub frequency_step: f64,
    /// S at k `frequency_step`, m²/Hz.
    pub density: Vec<f64>,
}

impl Remainder {
    #[must_use]
    pub fn rms(&self) -> f64 {
        (self.density.iter().sum::<f64>() * self.frequency_step).sqrt()
    }

    /// A realisation at the instants of `like`, m. It is zero at both ends, where the drive rests, and rises over
    /// `settle` s.
    #[must_use]
    pub fn realisation(&self, like: &Series, settle: f64, random: &mut impl Rng) -> Series {
        let n = (like.len() + like.len() % 2).max(2);
        let plan = inverse_transform(n);
        let apart = 1.0 / (n as f64 * like.step);
        let mut spectrum = plan.make_input_vec();
        for (k, bin) in spectrum.iter_mut().enumerate().skip(1) {
            let phase = 2.0 * PI * random.random::<f64>();
            let half = 0.5 * (2.0 * self.at(k as f64 * apart) * apart).sqrt();
            *bin = Complex::new(half * libm::cos(phase), half * libm::sin(phase));
        }
        if let Some(last) = spectrum.last_mut() {
            last.im = 0.0;
        }
        let mut values = plan.make_output_vec();
        // Sizes come from the plan.
        if plan.process(&mut spectrum, &mut values).is_err() {
            values.fill(0.0);
        }
        values.truncate(like.len());
        let reach = ((settle / like.step).ceil() as usize).clamp(1, like.len());
        for i in 0..reach {
            let part = i as f64 / reach as f64;
            let eased = part * part * (3.0 - 2.0 * part);
            let last = values.len() - 1 - i;
            values[i] *= eased;
            values[last] *= eased;
        }
        Series::new(like.start, like.step, values)
    }

    /// S at a frequency (Hz), m²/Hz; 0 beyond the last.
    #[must_use]
    pub(crate) fn at(&self, frequency: f64) -> f64 {
        let bin = (frequency / self.frequency_step).round();
        if bin >= 0.0 { self.density.get(bin as usize).copied().unwrap_or(0.0) } else { 0.0 }
    }
}

/// Noisy samples, `step` s apart, that decay towards both ends.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noisy<'a> {
    pub values: &'a [f64],
    pub step: f64,
    /// Number of recorded (noisy) samples.
    pub recorded: usize,
    pub sigma: f64,
    /// Band of the noise, Hz: white below, nothing above.
    pub band: f64,
    /// Spectrum of the noise, if quiet samples of a displacement show a 1/f part.
    pub spectrum: Option<NoiseSpectrum>,
    pub drive_frequency: f64,
    /// Whether the samples are a velocity, to be integrated to a displacement.
    pub integrated: bool,
}

impl Noisy<'_> {
    /// Displacement at the same instants, and the residual noise in it.
    ///
    /// G(f) = max(0, 1 − κ N(f)/P(f)), with P the periodogram |X|² smoothed over f0/24 to either side, N that of the
    /// noise, and κ = 1 + 3/√(bins smoothed), so that bins of noise alone stay closed. A velocity is divided by iω and
    /// high-passed at f0/8 (half a cosine from f0/16) to remove drift. The residual density is N G, divided by ω² for
    /// an integral.
    pub(crate) fn estimate(&self) -> (Vec<f64>, Option<Remainder>) {
        let mut work = self.values.to_vec();
        // An even number has a last bin that is real, as the first.
        if work.len() % 2 == 1 {
            work.push(0.0);
        }
        let n = work.len();
        let (forward, backward) = (forward_transform(n), inverse_transform(n));
        let mut spectrum = forward.make_output_vec();
        let outcome = forward.process(&mut work, &mut spectrum);
        debug_assert!(outcome.is_ok(), "sizes come from the plan");
        let bin = 1.0 / (n as f64 * self.step);
        // What the periodogram of noise is at every bin.
        let white = self.sigma.powi(2) * self.recorded as f64 * (0.5 / self.step) / self.band;
        let expected = |k: usize| self.recorded as f64 * (0.5 / self.step) * self.noise(k as f64 * bin, bin);
        let noise: Vec<f64> = match self.spectrum {
            None => vec![white; spectrum.len()],
            Some(_) => (0..spectrum.len()).map(expected).collect(),
        };
        let gains = self.gains(&spectrum, &noise, bin);
        let mut density = Vec::with_capacity(spectrum.len());
        let last = spectrum.len() - 1;
        for (k, (value, gain)) in spectrum.iter_mut().zip(&gains).enumerate() {
            let frequency = k as f64 * bin;
            let to_displacement = if self.integrated { self.integration(frequency) } else { Complex::new(1.0, 0.0) };
            density.push(self.noise(frequency, bin) * gain * to_displacement.norm_sqr());
            *value *= to_displacement * *gain;
            if k == 0 || k == last {
                value.im = 0.0;
            }
        }
        let outcome = backward.process(&mut spectrum, &mut work);
        debug_assert!(outcome.is_ok(), "sizes come from the plan");
        work.truncate(self.values.len());
        work.iter_mut().for_each(|value| *value /= n as f64);
        let together = density.len().div_ceil(MOST_BINS);
        let density: Vec<f64> =
            density.chunks(together).map(|part| part.iter().sum::<f64>() / part.len() as f64).collect();
        let remainder = Remainder { frequency_step: bin * together as f64, density };
        (work, (self.sigma > 0.0 || self.spectrum.is_some()).then_some(remainder))
    }

    /// One-sided density of the noise at a frequency (Hz), unit²/Hz, for bins `bin` apart.
    fn noise(&self, frequency: f64, bin: f64) -> f64 {
        // σ holds what of the 1/f part lies in its band too: rather too much than too little.
        let white = self.sigma.powi(2) / self.band;
        let flicker = self.spectrum.map_or(0.0, |spectrum| spectrum.flicker / frequency.max(bin));
        if frequency <= self.band { white + flicker } else { flicker }
    }

    fn gains(&self, spectrum: &[Complex<f64>], noise: &[f64], bin: f64) -> Vec<f64> {
        let beside = ((SMOOTHED * self.drive_frequency / bin).round() as usize).max(FEWEST_BINS);
        let strict = 1.0 + STRICT / ((2 * beside + 1) as f64 * self.independent()).sqrt();
        let powers: Vec<f64> = spectrum.iter().map(Complex::norm_sqr).collect();
        let band = ((self.band / bin).ceil() as usize).min(powers.len());
        (0..powers.len())
            .map(|k| {
                if noise[k] == 0.0 || k >= band {
                    return 1.0;
                }
                let around = &powers[k.saturating_sub(beside)..powers.len().min(k + beside + 1)];
                let mean = around.iter().sum::<f64>() / around.len() as f64;
                if mean > 0.0 { (1.0 - strict * noise[k] / mean).max(0.0) } else { 0.0 }
            })
            .collect()
    }

    /// Share of statistically independent bins: samples added to the recorded ones increase the number of bins, not
    /// the information.
    fn independent(&self) -> f64 {
        self.recorded as f64 / self.values.len() as f64
    }

    fn integration(&self, frequency: f64) -> Complex<f64> {
        let drift = DRIFT * self.drive_frequency;
        let gain = 0.5 - 0.5 * libm::cos(PI * (2.0 * frequency / drift - 1.0).clamp(0.0, 1.0));
        if gain == 0.0 { Complex::default() } else { Complex::new(0.0, -gain / (2.0 * PI * frequency)) }
    }
}
