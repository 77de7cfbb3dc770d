//! Drag and material loss of a body in the implicit schemes.
//!
//! ```text
//! M a₁ + (1 − α) (C v₁ + K (u₁ + g d₁)) + α (C v₀ + K (u₀ + g d₀)) = (1 − α) f₁ + α f₀,      C = (b/m) M + β K
//! τ ḋ = τ u̇ − d
//! ```
//!
//! with v₁ = ṽ + c (u₁ − ũ), ṽ = v₀ + h (1 − γ) a₀, c = γ/(β_N h) of the scheme ([`super::scheme`]), and d exact for a u that is straight over the step,
//! d₁ = k (u₁ − u₀) + e d₀, e = e^(−h/τ), k = (1 − e) τ/h. Still one matrix a step:
//!
//! ```text
//! (1 + θ b/m) M + (1 − α) β_N h² (1 + c β + g k) K,      θ = (1 − α) γ h
//! ```
//!
//! - b: drag on a bead, N·s/m;  β: retardation of the material, s: E (1 + β d/dt)
//! - g, τ: relaxation E (1 + g e^(−t/τ)), 1 and s; d = u − z, what of the displacement is not yet relaxed, m
//!
//! Nodes without mass have no v₀ and a₀ of their own: theirs is the slope of what they did in the last two steps, so that the viscous part stays of second
//! order without ringing from step to step, which the trapezoid makes of a first-order equation.
//!
//! Loss of a step, exact for the trapezoid: h v̄ᵀ C v̄ + ½ g (d₀ + d₁)ᵀ K Δz with v̄ = Δu/h, z = u − d.

use super::{FeaError, body::Body, scheme::Coefficients};
use crate::scene::{MaterialLoss, Relaxation, Scene};

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct BodyLoss {
    /// b/m, 1/s.
    pub(crate) drag: f64,
    /// β, s.
    pub(crate) retardation: f64,
    pub(crate) relaxation: Option<Relaxation>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepLoss {
    pub(crate) own: BodyLoss,
    /// c, 1/s.
    pub(crate) rate: f64,
    /// θ, s.
    pub(crate) share: f64,
    /// g, e and k; zeros without relaxation.
    pub(crate) relaxing: [f64; 3],
    /// When, in steps from the start, the velocity of a massless node is looked for, 1.
    at: f64,
    step: f64,
}

impl BodyLoss {
    /// Of every kind of body of a scene, none where it loses nothing.
    pub(crate) fn of(kinds: &[Body], support: Option<usize>, scene: &Scene) -> Vec<Option<Self>> {
        let drag = scene.holder.map_or(0.0, |holder| holder.drag);
        let of_kind = |kind: usize| {
            let is_support = support == Some(kind);
            let (retardation, relaxation) = scene.loss.of_body(is_support);
            let drag = if is_support { 0.0 } else { drag / kinds[kind].total_mass() };
            Self { drag, retardation, relaxation }
        };
        (0..kinds.len()).map(|kind| Some(of_kind(kind)).filter(|loss| *loss != Self::default())).collect()
    }
}

impl StepLoss {
    pub(crate) fn new(own: BodyLoss, c: &Coefficients) -> Self {
        let rate = c.gamma * c.step / c.gain;
        let relaxing = own.relaxation.map_or([0.0; 3], |Relaxation { strength, time }| {
            let x = c.step / time;
            [strength, (-x).exp(), -(-x).exp_m1() / x]
        });
        // v₁ is exact for a velocity that is straight: c h (t = ½) less (c h − 1) (t = `at`) is 1.
        let at = (0.5 * rate * c.step - 1.0) / (rate * c.step - 1.0);
        Self { own, rate, share: (1.0 - c.lag) * c.gamma * c.step, relaxing, at, step: c.step }
    }

    /// Factor on M, 1.
    pub(crate) fn mass_scale(&self) -> f64 {
        1.0 + self.share * self.own.drag
    }

    /// Factor on K beside that of the scheme, 1.
    pub(crate) fn stiffness_scale(&self) -> f64 {
        let [strength, _, mean] = self.relaxing;
        1.0 + self.rate * self.own.retardation + strength * mean
    }

    /// c ũ − ṽ of a node without mass, m/s, from its displacement (m), velocity in the last step (m/s) and the change of that over the step (m/s²).
    pub(crate) fn massless_history(&self, u: f64, v: f64, a: f64) -> f64 {
        let velocity = v + (self.at + 0.5) * self.step * a;
        self.rate * u + (self.rate * self.step - 1.0) * velocity
    }

    /// h/2, s.
    pub(crate) fn half_step(&self) -> f64 {
        0.5 * self.step
    }

    /// Acceleration of a rigid motion by the forces per mass (m/s²) when drag brakes it, from the velocity at the start and ṽ (m/s).
    pub(crate) fn braked(&self, forced: f64, lag: f64, [start, predicted]: [f64; 2]) -> f64 {
        (forced - self.own.drag * ((1.0 - lag) * predicted + lag * start)) / self.mass_scale()
    }
}

pub(crate) fn refuse_losses(scene: &Scene) -> Result<(), FeaError> {
    let key = match scene.loss {
        MaterialLoss { relaxation: Some(_), .. } => "loss.relaxation",
        MaterialLoss { support, .. } if support > 0.0 => "loss.support",
        _ => return Ok(()),
    };
    let steps_with_water = scene.support.disc().is_some() && scene.water.is_some();
    if scene.support.is_meshed() && !steps_with_water { Ok(()) } else { Err(FeaError::LossWithoutBody { key }) }
}
