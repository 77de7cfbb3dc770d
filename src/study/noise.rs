//! The noise of a decoder, added to simulated velocities before they are measured.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::{
    feature::FeatureSettings,
    signal::{LowPass, Series},
};

/// White noise of `rms` (m/s) within `bandwidth` (Hz), a sequence of its own for each index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Rms, m/s; 0 for none.
    pub rms: f64,
    /// Bandwidth, Hz.
    pub bandwidth: f64,
    /// Seed of all sequences.
    pub seed: u64,
}

impl Noise {
    /// What the studies add: 1 mm/s within 1.5 MHz, as in the reconstruction; invented, no record is published.
    #[must_use]
    pub fn of_reconstruction(seed: u64) -> Self {
        Self { rms: 1e-3, bandwidth: 1.5e6, seed }
    }

    /// The velocity with noise number `index` on it.
    #[must_use]
    pub fn on(&self, velocity: &Series, index: usize) -> Series {
        if self.rms == 0.0 {
            return velocity.clone();
        }
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(index as u64 + 1);
        let white: Vec<f64> = (0..velocity.len()).map(|_| StandardNormal.sample(&mut random)).collect();
        // White noise of density 1 up to the Nyquist frequency keeps the share of it that passes.
        let share = (2.0 * self.bandwidth * velocity.step).min(1.0);
        let passed = LowPass::new(velocity.step, white.len(), self.bandwidth).apply(&white);
        let factor = self.rms / share.sqrt();
        let values = velocity.values.iter().zip(passed).map(|(value, noise)| value + factor * noise).collect();
        Series::new(velocity.start, velocity.step, values)
    }

    /// The settings that know of the noise, so that peaks are read without its bias.
    #[must_use]
    pub fn settings(&self, clean: &FeatureSettings) -> FeatureSettings {
        let noise_bandwidth = (self.rms > 0.0).then_some(self.bandwidth);
        FeatureSettings { noise_rms: self.rms, noise_bandwidth, ..clean.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_noise_has_its_rms_and_differs_from_run_to_run() {
        let quiet = Series::new(0.0, 1e-7, vec![0.0; 20_000]);
        let noise = Noise { rms: 1e-3, bandwidth: 1.5e6, seed: 3 };
        let rms = |series: &Series| (series.values.iter().map(|v| v * v).sum::<f64>() / series.len() as f64).sqrt();
        let (first, second) = (noise.on(&quiet, 0), noise.on(&quiet, 1));
        // 20 000 samples at 30 % of the band are some 6 000 independent ones: 1 % of statistical error, and the filter's skirt.
        assert!((rms(&first) / 1e-3 - 1.0).abs() < 0.04, "{}", rms(&first));
        assert_eq!(first, noise.on(&quiet, 0));
        assert_ne!(first, second);
        assert_eq!(Noise { rms: 0.0, ..noise }.on(&quiet, 0), quiet);
    }
}
