//! The baffled rigid piston: a disc that moves as a whole in an infinite rigid plane, and the fluid on one side of it.
//!
//! Time factor e^{+iωt}: a positive imaginary part of an impedance is a mass.

use std::f64::consts::PI;

/// A rigid piston of radius a in a rigid baffle that radiates into a half-space of density ρ and sound speed c.
///
/// Rayleigh (1896), *The Theory of Sound*, §302; Kinsler, Frey, Coppens & Sanders (2000), *Fundamentals of Acoustics*, §7.4–7.5.
///
/// ```
/// # use granchain_model::analytical::BaffledPiston;
/// let piston = BaffledPiston { radius: 1e-3, density: 1000.0, sound_speed: 1500.0 };
/// // A velocity that steps to 1 m/s at t = 0: the plane wave ρc arrives on the axis after z/c, the rim ends it.
/// let step = |t: f64| f64::from(u8::from(t >= 0.0));
/// assert_eq!(piston.axial_pressure(1e-3, 0.8e-6, step), 1.5e6);
/// assert_eq!(piston.axial_pressure(1e-3, 1.0e-6, step), 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaffledPiston {
    pub radius: f64,
    /// Density of the fluid ρ, kg/m³.
    pub density: f64,
    /// Speed of sound in the fluid c, m/s.
    pub sound_speed: f64,
}

impl BaffledPiston {
    /// Pressure on the axis at the distance z (m) in front of the piston and the time t (s), Pa:
    ///
    /// p(z, t) = ρc [v(t − z/c) − v(t − √(z² + a²)/c)].
    ///
    /// - `velocity`: v(t), m/s, positive into the fluid, 0 before the motion begins
    ///
    /// Exact for a linear, lossless fluid and every velocity. Stepanishen (1971), *J. Acoust. Soc. Am.* 49, 1629.
    pub fn axial_pressure(&self, distance: f64, time: f64, velocity: impl Fn(f64) -> f64) -> f64 {
        let direct = time - distance / self.sound_speed;
        let edge = time - distance.hypot(self.radius) / self.sound_speed;
        self.density * self.sound_speed * (velocity(direct) - velocity(edge))
    }

    /// Radiation impedance Z = F/v at the angular frequency ω (rad/s), N·s/m, as (resistance, reactance):
    ///
    /// Z = ρcπa² [1 − J₁(2ka)/(ka) + i H₁(2ka)/(ka)],  k = ω/c, H₁ Struve's function.
    ///
    /// Exact; the resistance loses digits to cancellation as ka → 0 (relative 1e-15/(ka)²).
    pub fn impedance(&self, angular_frequency: f64) -> (f64, f64) {
        let plane = self.density * self.sound_speed * PI * self.radius * self.radius;
        let ka = angular_frequency * self.radius / self.sound_speed;
        if ka == 0.0 {
            return (0.0, 0.0);
        }
        (plane * (1.0 - libm::j1(2.0 * ka) / ka), plane * struve_1(2.0 * ka) / ka)
    }

    /// Pressure far away at the angle θ (rad) from the axis over that on the axis, 2 J₁(x)/x with x = ka sin θ, at the angular frequency ω (rad/s).
    ///
    /// Valid at distances ≫ a and ≫ ka². Its first zero is x = 3.8317, its −6 dB point x = 2.2150.
    pub fn directivity(&self, angle: f64, angular_frequency: f64) -> f64 {
        let x = angular_frequency * self.radius / self.sound_speed * angle.sin();
        // 1 − x²/8 + …: below, J₁ itself loses no digits but 0/0 is none.
        if x.abs() < 1e-8 { 1.0 } else { 2.0 * libm::j1(x) / x }
    }

    /// Mass of fluid that moves with the piston at low frequency, (8/3) ρ a³, kg: the limit of Im Z/ω.
    pub fn added_mass(&self) -> f64 {
        8.0 / 3.0 * self.density * self.radius.powi(3)
    }
}

/// Struve's function H₁(x) for x ≥ 0, to about 1e-15 relative.
///
/// H₁ = (2/π) [x²/(1²·3) − x⁴/(1²·3²·5) + …] up to x = 2 and
/// H₁ = (2/π) (1 − J₀) + (4/π) Σ_{k≥1} J_{2k}/(4k² − 1) beyond, where nothing cancels.
///
/// Abramowitz & Stegun (1964), *Handbook of Mathematical Functions*, 12.1.5 and 12.1.20.
pub(crate) fn struve_1(x: f64) -> f64 {
    if x <= 2.0 {
        let (mut term, mut sum, mut odd) = (x * x / 3.0, 0.0, 3.0);
        while sum + term != sum {
            sum += term;
            term *= -x * x / (odd * (odd + 2.0));
            odd += 2.0;
        }
        return 2.0 / PI * sum;
    }
    // J_n(x) falls faster than any power once n > x.
    let most = (0.5 * x + 10.0 + 5.0 * x.cbrt()) as i32;
    let tail: f64 = (1..=most).rev().map(|k| libm::jn(2 * k, x) / f64::from(4 * k * k - 1)).sum();
    2.0 / PI * (1.0 - libm::j0(x)) + 4.0 / PI * tail
}

#[cfg(test)]
mod tests {
    use super::*;

    const PISTON: BaffledPiston = BaffledPiston { radius: 1e-3, density: 1000.0, sound_speed: 1500.0 };

    #[test]
    fn struves_function_is_its_integral() {
        // Poisson's integral H₁(x) = (2x/π) ∫₀¹ √(1 − t²) sin(xt) dt, by the midpoint rule in t = sin θ.
        for x in [0.01, 0.2, 1.0, 1.999_999, 2.000_001, 3.0, 7.0, 20.0, 60.0, 300.0] {
            let (panels, mut sum) = (200_000, 0.0);
            for k in 0..panels {
                let (sine, cosine) = (0.5 * PI * (k as f64 + 0.5) / panels as f64).sin_cos();
                sum += cosine * cosine * (x * sine).sin();
            }
            let integral = 2.0 * x / PI * sum * 0.5 * PI / panels as f64;
            // The midpoint rule's x h²/24 slope jump at θ = 0, h = 8e-6, and 2e5 roundings.
            assert!((struve_1(x) - integral).abs() < 1e-11 * (1.0 + x * x) * struve_1(x), "{x} {integral}");
        }
    }

    #[test]
    fn impedance_is_as_tabulated() {
        let plane = PISTON.density * PISTON.sound_speed * PI * PISTON.radius.powi(2);
        for (ka, resistance, reactance) in [
            (0.1, 0.004_992, 0.084_657),
            (0.31, 0.047_287, 0.256_466),
            (1.0, 0.423_275, 0.646_764),
            (3.0, 1.092_228, 0.159_392),
        ] {
            let (real, imaginary) = PISTON.impedance(ka * PISTON.sound_speed / PISTON.radius);
            // Six decimals printed.
            assert!((real / plane - resistance).abs() < 6e-7 && (imaginary / plane - reactance).abs() < 6e-7, "{ka}");
        }
    }

    #[test]
    fn at_low_frequency_the_reactance_is_the_added_mass() {
        let omega = 1e-3 * PISTON.sound_speed / PISTON.radius;
        let (resistance, reactance) = PISTON.impedance(omega);
        // The next terms are (ka)² relative.
        assert!((reactance / (omega * PISTON.added_mass()) - 1.0).abs() < 1e-6);
        // Low-frequency resistance ρω²S²/(2πc), of any source of that volume velocity.
        let area = PI * PISTON.radius.powi(2);
        let point = PISTON.density * (omega * area).powi(2) / (2.0 * PI * PISTON.sound_speed);
        assert!((resistance / point - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_steady_tone_on_the_axis_has_the_textbook_amplitude() {
        // |p| = 2ρc |sin(k/2 (√(z² + a²) − z))|, Kinsler eq. (7.4.5).
        let (omega, z) = (2.0 * PI * 0.8e6, 0.7e-3);
        let samples: Vec<f64> =
            (0..4).map(|q| PISTON.axial_pressure(z, q as f64 * 0.5 * PI / omega, |t| (omega * t).sin())).collect();
        let amplitude = (0.5 * (samples[0] - samples[2])).hypot(0.5 * (samples[1] - samples[3]));
        let k = omega / PISTON.sound_speed;
        let exact = 2.0 * 1.5e6 * (0.5 * k * (z.hypot(PISTON.radius) - z)).sin().abs();
        assert!((amplitude / exact - 1.0).abs() < 1e-12);
    }
}
