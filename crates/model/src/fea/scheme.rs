//! The implicit one-step schemes.
//!
//! ```text
//! M a₁ + (1 − α) K u₁ + α K u₀ = (1 − α) f₁ + α f₀
//! u₁ = ũ + β h² a₁,                 ũ = u₀ + h v₀ + h² (½ − β) a₀
//! v₁ = v₀ + h ((1 − γ) a₀ + γ a₁)
//! ```
//!
//! so that one matrix is solved a step:
//!
//! ```text
//! (M + (1 − α) β h² K) u₁ = M ũ + β h² ((1 − α) f₁ + α (f₀ − K u₀))
//! ```
//!
//! Trapezoid: α = 0, β = ¼, γ = ½. Hilber, Hughes and Taylor (1977), *Earthquake Eng. Struct. Dyn.* 5, 283.

use crate::scene::Scheme;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Coefficients {
    /// h, s.
    pub step: f64,
    /// α, 1.
    pub lag: f64,
    pub gamma: f64,
    pub beta: f64,
    /// β h², s²: displacement per acceleration.
    pub gain: f64,
}

impl Coefficients {
    /// Of a scheme at the step h (s).
    pub(crate) fn new(scheme: Scheme, step: f64) -> Self {
        let beta = scheme.beta();
        Self { step, lag: scheme.dissipation(), gamma: scheme.gamma(), beta, gain: beta * step * step }
    }

    /// Displacement per force and inverse mass at the end of the step, (1 − α) β h², s².
    pub(crate) fn new_force_gain(&self) -> f64 {
        (1.0 - self.lag) * self.gain
    }

    /// ũ = u₀ + h v₀ + h² (½ − β) a₀.
    #[inline(always)]
    pub(crate) fn predicted(&self, u: f64, v: f64, a: f64) -> f64 {
        u + self.step * (v + self.step * (0.5 - self.beta) * a)
    }

    /// v₁ from v₀, a₀ and a₁.
    #[inline(always)]
    pub(crate) fn velocity(&self, v: f64, a: f64, new: f64) -> f64 {
        v + self.step * ((1.0 - self.gamma) * a + self.gamma * new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energy ½(v² + ω²u²) left of 1 after so many steps of u″ = −ω²u, with ωh = `angle`.
    fn left(scheme: Scheme, angle: f64, steps: u32) -> f64 {
        let c = Coefficients::new(scheme, angle);
        // ω = 1, so that h is the angle.
        let (mut u, mut v, mut a) = (1.0, 0.0, -1.0);
        for _ in 0..steps {
            let predicted = c.predicted(u, v, a);
            let new = (predicted - c.lag * c.gain * u) / (1.0 + c.new_force_gain());
            let acceleration = (new - predicted) / c.gain;
            (u, v, a) = (new, c.velocity(v, a, acceleration), acceleration);
        }
        u * u + v * v
    }

    #[test]
    fn the_trapezoid_keeps_the_energy_of_an_oscillator_whatever_its_step() {
        for angle in [0.1, 1.0, 10.0] {
            // Rounding of 1000 steps.
            assert!((left(Scheme::Trapezoid, angle, 1000) - 1.0).abs() < 1e-11, "{angle}");
        }
    }

    #[test]
    fn hht_loses_little_energy_and_an_eighth_at_half_the_step() {
        let (angle, steps) = (0.1, 2000);
        let lost = |angle, steps| -left(Scheme::HilberHughesTaylor { dissipation: 0.1 }, angle, steps).ln();
        let (whole, halved) = (lost(angle, steps), lost(0.5 * angle, 2 * steps));
        // Newmark's rule with γ = ½ + 0.1 would lose 0.1 times the squared angle a step, to leading order.
        assert!(whole > 0.0 && whole < 0.005 * angle * angle * f64::from(steps), "{whole}");
        // Of third order in a given time, but for the swing of the energy within a period.
        assert!((whole / halved - 8.0).abs() < 0.5, "{whole} {halved}");
    }

    #[test]
    fn constant_force_is_followed_exactly() {
        let c = Coefficients::new(Scheme::Trapezoid, 0.3);
        let (mut u, mut v) = (0.0, 0.0);
        for _ in 0..10 {
            u = c.predicted(u, v, 2.0) + c.gain * 2.0;
            v = c.velocity(v, 2.0, 2.0);
        }
        assert!((u - 9.0).abs() < 1e-12 && (v - 6.0).abs() < 1e-12, "{u} {v}");
    }
}
