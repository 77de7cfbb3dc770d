//! The answer to a force at one instant: disc and water are linear, so this is all that a chain in front of them needs.

use super::OnWater;

/// Displacement and pressure after a force that is 1 N at the first instant and 0 at all others, straight in between.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitResponse {
    /// Step Δ of the clock, s.
    pub step: f64,
    /// Displacement of the front where the force acts, m/N, at the instant of the force and after.
    pub pole: Vec<f64>,
    /// Pressure at each field point, Pa/N.
    pub pressure: Vec<Vec<f64>>,
}

impl UnitResponse {
    /// Record `instants` values from a disc at rest, at its first `points` field points.
    pub fn record(mut disc: impl OnWater, points: usize, instants: usize) -> Self {
        let mut out = Self { step: disc.step(), pole: Vec::new(), pressure: vec![Vec::new(); points] };
        for instant in 0..instants {
            disc.predict();
            disc.push(if instant == 0 { 1.0 } else { 0.0 });
            out.pole.push(disc.pole_displacement());
            for (point, trace) in out.pressure.iter_mut().enumerate() {
                trace.push(disc.pressure(point));
            }
        }
        out
    }

    /// Pressure at field point `point` under the forces F(n Δ) (N), Pa: a discrete convolution.
    #[must_use]
    pub fn pressure_under(&self, point: usize, forces: &[f64]) -> Vec<f64> {
        convolve(&self.pressure[point], forces)
    }

    /// Displacement of the front under the forces F(n Δ) (N), m.
    #[must_use]
    pub fn pole_under(&self, forces: &[f64]) -> Vec<f64> {
        convolve(&self.pole, forces)
    }
}

fn convolve(response: &[f64], forces: &[f64]) -> Vec<f64> {
    let sum = |n: usize| response.iter().take(n + 1).enumerate().map(|(m, value)| value * forces[n - m]).sum();
    (0..forces.len()).map(sum).collect()
}
