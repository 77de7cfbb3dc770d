//! Pressure at single instants: the same integral as on a clock, with the accelerations taken where they are needed.
//!
//! p(x, t) = Σ_k ∫ h_k(τ) v̇_k(t − τ) dτ with the kernels of [`super::field`], by Gauss–Legendre quadrature in the angle of each piece. On a
//! clock the cost of a point is that of every step; here it is that of the instants asked for, which is what a map of many points needs.

use super::{
    field::{FieldPoint, FieldPointError},
    radiation::Radiator,
};
use crate::water::{Water, quadrature::gauss_legendre};

/// Points of the quadrature over a piece of the memory: these, and one for each time to be distinguished in 2a/c.
const LEAST_POINTS: usize = 24;

#[derive(Debug, Clone)]
pub struct InstantRule {
    rule: Vec<(f64, f64)>,
}

impl InstantRule {
    /// A rule for motions in which no more than one thing happens within `resolution` (s), such as the step of the motion's clock.
    pub fn new(radius: f64, water: &Water, resolution: f64) -> Self {
        let cells = (2.0 * radius / (water.sound_speed * resolution)).min(1e4);
        Self { rule: gauss_legendre(LEAST_POINTS + cells as usize) }
    }
}

impl Radiator<'_> {
    /// Pressure (Pa) at a point at each of `times` (s).
    ///
    /// - `accelerations`: writes v̇_k(t), m/s² over the unit of the shape k, 0 before the motion begins
    pub fn pressure_at(
        &self,
        water: &Water,
        point: FieldPoint,
        times: &[f64],
        rule: &InstantRule,
        accelerations: &dyn Fn(f64, &mut [f64]),
    ) -> Result<Vec<f64>, FieldPointError> {
        let memory = self.memory_at(water, point.checked()?);
        let mut motion = vec![0.0; self.shapes.len()];
        let mut pressure = vec![0.0; times.len()];
        for piece in memory.breaks.windows(2) {
            memory.over(piece[0], piece[1], &rule.rule, |tau, weight, kernel| {
                for (sum, time) in pressure.iter_mut().zip(times) {
                    accelerations(time - tau, &mut motion);
                    *sum += weight * kernel.iter().zip(&motion).map(|(h, a)| h * a).sum::<f64>();
                }
            });
        }
        Ok(pressure)
    }
}
