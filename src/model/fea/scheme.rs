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
//! Trapezoid: α = 0, β = ¼, γ = ½. Hilber, Hughes and Taylor (1977), *Earthquake Eng. Struct. Dyn.* 5, 283; Newmark (1959), *J. Eng.
//! Mech. Div. ASCE* 85, 67.

use crate::scene::Scheme;

/// Numbers of a scheme at one step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// h, s.
    pub step: f64,
    /// α, 1.
    pub lag: f64,
    /// γ, 1.
    pub gamma: f64,
    /// β, 1.
    pub beta: f64,
    /// β h², s²: displacement per acceleration.
    pub gain: f64,
}

impl Coefficients {
    /// Of a scheme at the step h (s).
    #[must_use]
    pub fn new(scheme: Scheme, step: f64) -> Self {
        let beta = scheme.beta();
        Self { step, lag: scheme.lag(), gamma: scheme.gamma(), beta, gain: beta * step * step }
    }

    /// Displacement per force and inverse mass at the end of the step, (1 − α) β h², s².
    #[must_use]
    pub fn new_force_gain(&self) -> f64 {
        (1.0 - self.lag) * self.gain
    }

    /// ũ = u₀ + h v₀ + h² (½ − β) a₀.
    #[inline(always)]
    #[must_use]
    pub fn predicted(&self, u: f64, v: f64, a: f64) -> f64 {
        u + self.step * (v + self.step * (0.5 - self.beta) * a)
    }

    /// v₁ from v₀, a₀ and a₁.
    #[inline(always)]
    #[must_use]
    pub fn velocity(&self, v: f64, a: f64, new: f64) -> f64 {
        v + self.step * ((1.0 - self.gamma) * a + self.gamma * new)
    }
}
