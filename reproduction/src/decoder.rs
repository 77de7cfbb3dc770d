//! Vibrometer filter for simulated velocities: its bandwidth and its noise.
//!
//! Bodies of the finer models ring at 2.6 MHz and above, far beyond what a vibrometer passes; without it their peaks would be the ringing's.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use granchain_model::scene::DEFAULT_VIBROMETER_BANDWIDTH;
use granchain_signal::{Series, feature::FeatureSettings, low_pass};

/// White noise of `noise_rms` and a zero-phase low-pass at `bandwidth`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decoder {
    /// Rms of the noise behind the low-pass, m/s; 0 for none.
    pub noise_rms: f64,
    /// Bandwidth (−6 dB), Hz.
    pub bandwidth: f64,
    pub seed: u64,
}

impl Decoder {
    /// What the studies look through: 1.5 MHz and 1 mm/s, as the reconstruction; invented, no record is published.
    #[must_use]
    pub fn of_reconstruction(seed: u64) -> Self {
        Self { noise_rms: 1e-3, bandwidth: DEFAULT_VIBROMETER_BANDWIDTH, seed }
    }

    /// The velocity (m/s) within the bandwidth, without noise.
    #[must_use]
    pub fn passes(&self, velocity: &Series) -> Series {
        low_pass(velocity, self.bandwidth)
    }

    /// The velocity (m/s) within the bandwidth, with noise number `index` on it.
    #[must_use]
    pub fn sees(&self, velocity: &Series, index: usize) -> Series {
        if self.noise_rms == 0.0 {
            return self.passes(velocity);
        }
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(index as u64 + 1);
        // White noise keeps the share of its power that passes.
        let share = (2.0 * self.bandwidth * velocity.step).min(1.0);
        let factor = self.noise_rms / share.sqrt();
        let noisy = velocity.map(|value| {
            let white: f64 = StandardNormal.sample(&mut random);
            value + factor * white
        });
        self.passes(&noisy)
    }

    /// The settings that know of the noise, so that peaks are read without its bias.
    #[must_use]
    pub fn settings(&self, clean: &FeatureSettings) -> FeatureSettings {
        let noise_bandwidth = (self.noise_rms > 0.0).then_some(self.bandwidth);
        FeatureSettings { noise_rms: self.noise_rms, noise_bandwidth, ..clean.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DECODER: Decoder = Decoder { noise_rms: 1e-3, bandwidth: 1.5e6, seed: 3 };

    fn rms(series: &Series) -> f64 {
        (series.values.iter().map(|v| v * v).sum::<f64>() / series.len() as f64).sqrt()
    }

    #[test]
    fn the_noise_has_its_rms_and_differs_from_run_to_run() {
        let quiet = Series::new(0.0, 1e-7, vec![0.0; 20_000]);
        let (first, second) = (DECODER.sees(&quiet, 0), DECODER.sees(&quiet, 1));
        // 20 000 samples at 30 % of the band are some 6 000 independent ones: 1 % of statistical error, and the filter's skirt.
        assert!((rms(&first) / 1e-3 - 1.0).abs() < 0.04, "{}", rms(&first));
        assert_eq!(first, DECODER.sees(&quiet, 0));
        assert_ne!(first, second);
        assert_eq!(Decoder { noise_rms: 0.0, ..DECODER }.sees(&quiet, 0), quiet);
    }

    #[test]
    fn the_ringing_of_a_bead_does_not_pass_and_the_drive_does() {
        let tone = |frequency: f64| {
            let value = |i: i32| (std::f64::consts::TAU * frequency * f64::from(i) * 1e-7).sin();
            Series::new(0.0, 1e-7, (0..20_000).map(value).collect())
        };
        // The lowest mode of a 1 mm steel bead: 2.646 MHz. A tone that begins and ends at once has its edges in every band: away from them.
        let ringing = DECODER.passes(&tone(2.646e6));
        let inner = Series::new(0.0, ringing.step, ringing.values[2000..18_000].to_vec());
        assert!(rms(&inner) < 1e-3, "{}", rms(&inner));
        assert!((rms(&DECODER.passes(&tone(73e3))) / rms(&tone(73e3)) - 1.0).abs() < 1e-5);
    }
}
