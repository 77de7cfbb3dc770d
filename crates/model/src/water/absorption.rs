//! Absorption by a power law of frequency, as a causal filter over the path from the disc to a field point.
//!
//! A wave over the distance d is multiplied by
//!
//! ```text
//! H(ω) = exp(−α d − i β d),   α = α₁ x^y,   β = α₁ x tan(πy/2) (x^{y−1} − 1),   x = f/f_r,  f = ω/2π > 0,  f_r = 1 MHz
//! ```
//!
//! β is the dispersion that the Kramers–Kronig relations tie to α, so that nothing arrives before it can; f_r is the frequency at which the
//! waves run at the sound speed of the lossless water. For y → 1, β → −(2/π) α₁ x ln x. The path's own delay d/c is in the
//! record already.
//!
//! Valid where absorption is weak, α λ ≪ 1, and the layer thin: every path from the face to the point is given the same length, its
//! shortest, which a point on the axis at the distance z misses by √(z² + a²) − z of the rim's path; loading of the disc by the water is left
//! lossless. At 1 mm and 1 MHz water takes 2.5e-5 and soft tissue 6e-3 of the pressure.
//!
//! Szabo (1995), *J. Acoust. Soc. Am.* 97, 14; Waters, Hughes, Mobley, Brandenburger & Miller (2000), *J. Acoust. Soc. Am.* 108, 556;
//! water: Pinkerton (1949), *Proc. Phys. Soc. B* 62, 129.

use std::f64::consts::{FRAC_PI_2, PI};

use faer::c64;
use granchain_signal::{forward_transform, inverse_transform};

use crate::scene::{Absorption, FieldPoint};

/// f_r, Hz.
const REFERENCE: f64 = 1e6;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PowerLaw {
    /// α₁ and y.
    law: Absorption,
}

impl PowerLaw {
    /// Of losses as a scene has them, with 0 < y ≤ 2.
    pub(crate) fn new(law: Absorption) -> Self {
        Self { law }
    }

    /// α at the frequency f (Hz), Np/m.
    pub(crate) fn attenuation(&self, frequency: f64) -> f64 {
        self.law.at_1_mhz * (frequency / REFERENCE).powf(self.law.exponent)
    }

    /// β at the frequency f (Hz), rad/m: the phase that lags behind the lossless wave's.
    pub(crate) fn lag(&self, frequency: f64) -> f64 {
        if frequency <= 0.0 {
            return 0.0;
        }
        let excess = self.law.exponent - 1.0;
        let ratio = (frequency / REFERENCE).ln();
        // tan(πy/2) (e^{(y−1) ln f/f_r} − 1) with tan(πy/2) = −1/tan(π(y−1)/2): finite as y → 1.
        let bend = if excess.abs() < 1e-9 {
            -ratio / FRAC_PI_2
        } else {
            -(excess * ratio).exp_m1() / (0.5 * PI * excess).tan()
        };
        self.law.at_1_mhz * frequency / REFERENCE * bend
    }

    /// H at the frequency f (Hz) over the path d (m).
    pub(crate) fn transfer(&self, frequency: f64, path: f64) -> c64 {
        let size = (-self.attenuation(frequency) * path).exp();
        let (sine, cosine) = (self.lag(frequency) * path).sin_cos();
        c64::new(size * cosine, -size * sine)
    }

    /// A pressure record (any unit) on a clock of that step (s) after the path d (m), at the same instants.
    ///
    /// The record counts as zero outside itself; the tail that the filter leaves behind its end is dropped.
    pub(crate) fn filter(&self, record: &[f64], step: f64, path: f64) -> Vec<f64> {
        if record.is_empty() {
            return Vec::new();
        }
        let length = (2 * record.len()).next_power_of_two();
        let (forward, backward) = (forward_transform(length), inverse_transform(length));
        let (mut input, mut spectrum) = (forward.make_input_vec(), forward.make_output_vec());
        input[..record.len()].copy_from_slice(record);
        // Cannot fail: the buffers were made by the plans.
        let _ = forward.process(&mut input, &mut spectrum);
        let last = spectrum.len() - 1;
        for (bin, value) in spectrum.iter_mut().enumerate() {
            let factor = self.transfer(bin as f64 / (length as f64 * step), path);
            // At the Nyquist frequency only the real part is seen.
            let (re, im) = if bin == last { (factor.re, 0.0) } else { (factor.re, factor.im) };
            (value.re, value.im) = (value.re * re - value.im * im, value.re * im + value.im * re);
        }
        let mut output = backward.make_output_vec();
        let _ = backward.process(&mut spectrum, &mut output);
        output.truncate(record.len());
        output.iter_mut().for_each(|value| *value /= length as f64);
        output
    }
}

/// A pressure record (any unit, on a clock of that step, s) at a point of the water behind a disc of that radius (m), as it arrives there
/// through an absorbing liquid: the power law over the [`shortest_path`].
pub(crate) fn attenuated(law: Absorption, disc: f64, point: FieldPoint, record: &[f64], step: f64) -> Vec<f64> {
    PowerLaw::new(law).filter(record, step, shortest_path(disc, point))
}

/// Shortest way (m) from a disc of that radius (m) to a point of the water.
pub(crate) fn shortest_path(disc: f64, point: FieldPoint) -> f64 {
    point.distance.hypot((point.radius - disc).max(0.0))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// α₁ in dB/cm, as tables have it.
    fn law(decibels: f64, exponent: f64) -> PowerLaw {
        PowerLaw::new(Absorption { at_1_mhz: 100.0 * decibels * 10f64.ln() / 20.0, exponent })
    }

    /// 60 cycles under a smooth envelope.
    fn tone(frequency: f64, step: f64) -> Vec<f64> {
        let length = 60.0 / frequency;
        let value = |i: usize| {
            let t = i as f64 * step;
            if t < length { (PI * t / length).sin().powi(2) * (TAU * frequency * t).sin() } else { 0.0 }
        };
        (0..(1.2 * length / step) as usize).map(value).collect()
    }

    /// Σ x e^{−iωt}.
    fn line(record: &[f64], frequency: f64, step: f64) -> c64 {
        let turn = |i: usize| c64::new(0.0, -TAU * frequency * i as f64 * step).exp();
        record.iter().enumerate().map(|(i, x)| turn(i) * *x).sum()
    }

    #[test]
    fn a_tone_loses_alpha_f_to_the_y_over_the_path() {
        for (decibels, exponent) in [(0.0022, 2.0), (0.5, 1.1), (0.7, 1.0), (0.4, 0.6)] {
            let law = law(decibels, exponent);
            for (frequency, path) in [(0.3e6, 1e-3), (0.95e6, 1e-3), (0.95e6, 50e-3)] {
                let step = 25e-9;
                let before = tone(frequency, step);
                let after = law.filter(&before, step, path);
                let ratio = line(&after, frequency, step) / line(&before, frequency, step);
                let lost = -20.0 * ratio.norm().log10();
                let expected = decibels * (frequency / 1e6).powf(exponent) * path * 100.0;
                // The record ends a fifth of the burst behind it.
                assert!((lost - expected).abs() < 1e-3 * expected + 1e-9, "{exponent} {frequency}: {lost} {expected}");
            }
        }
    }

    #[test]
    fn the_phase_is_that_of_the_kramers_kronig_relation() {
        // Once subtracted at f_r: β(f)/f − β(f_r)/f_r = (2/π) ∫ α(f′) [1/(f′² − f²) − 1/(f′² − f_r²)] df′, principal values. With
        // α = f^y and f_r = 1 the integral is evaluated piecewise around its poles by folding them: f′ = pole·(1 ± s).
        for exponent in [0.6, 1.0, 1.3] {
            let law = PowerLaw::new(Absorption { at_1_mhz: 1.0, exponent });
            for frequency in [0.3, 2.5] {
                let integrand =
                    |x: f64| x.powf(exponent) * (1.0 / (x * x - frequency * frequency) - 1.0 / (x * x - 1.0));
                let mut sum = 0.0;
                let (low, high) = (f64::min(1.0, frequency), f64::max(1.0, frequency));
                let reach = 0.4 * (high - low).min(low);
                let mut add = |from: f64, to: f64, f: &dyn Fn(f64) -> f64| {
                    let rule = super::super::quadrature::gauss_legendre(200);
                    sum += rule.iter().map(|&(x, w)| w * (to - from) * f(from + x * (to - from))).sum::<f64>();
                };
                for pole in [low, high] {
                    add(0.0, reach, &|s| integrand(pole + s) + integrand(pole - s));
                }
                add(0.0, 0.5 * (low - reach), &integrand);
                add(0.5 * (low - reach), low - reach, &integrand);
                add(low + reach, high - reach, &integrand);
                add(high + reach, 3.0 * high, &integrand);
                // x = 1/u from 3·high to ∞, in the root of u.
                let far = |root: f64| integrand(root.powi(-4)) * 4.0 * root.powi(-5);
                add(0.0, (3.0 * high).powf(-0.25), &far);
                let expected = 2.0 / PI * frequency * sum;
                let found = law.lag(1e6 * frequency);
                assert!(
                    (found - expected).abs() < 2e-3 * expected.abs(),
                    "y {exponent}, f {frequency}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn nothing_arrives_before_it_was_sent() {
        // A pulse from 20 to 22 µs after 10 cm of something lossy; the path's own 67 µs are not in the record.
        let (step, path) = (25e-9, 0.1);
        let pulse = |i: usize| if (800..880).contains(&i) { (PI * (i - 800) as f64 / 80.0).sin().powi(2) } else { 0.0 };
        let record: Vec<f64> = (0..8000).map(pulse).collect();
        let backwards = |mut values: Vec<f64>| {
            values.reverse();
            values
        };
        for exponent in [0.6, 1.0, 1.1, 1.5] {
            let law = law(1.0, exponent);
            let early = |values: &[f64]| values[..700].iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            let after = law.filter(&record, step, path);
            assert!(after[790..1000].iter().any(|x| *x > 0.2), "y {exponent}");
            // What is left comes around the end of the transform.
            assert!(early(&after) < 1e-4, "y {exponent}: {}", early(&after));
            // The same loss with its phase turned round is early.
            let turned = backwards(law.filter(&backwards(record.clone()), step, path));
            assert!(early(&turned) > 5e-4, "y {exponent}: {}", early(&turned));
        }
    }

    #[test]
    fn near_one_the_exponent_makes_no_jump_and_at_two_nothing_lags() {
        let lag = |exponent| law(0.5, exponent).lag(0.4e6);
        assert!((lag(1.0) / lag(1.0 + 1e-6) - 1.0).abs() < 1e-5 && (lag(1.0) / lag(1.0 - 1e-6) - 1.0).abs() < 1e-5);
        assert!(lag(2.0).abs() < 1e-12 * lag(1.0).abs(), "{} {}", lag(2.0), lag(1.0));
        assert!(law(0.5, 1.0).filter(&[], 25e-9, 1e-3).is_empty());
        let path = |radius, distance| shortest_path(1e-3, FieldPoint { radius, distance });
        assert_eq!((path(0.0, 1e-3), path(0.7e-3, 2e-3)), (1e-3, 2e-3));
        assert!((path(4e-3, 4e-3) - 5e-3).abs() < 1e-15);
    }
}
