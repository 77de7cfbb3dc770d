//! Pressure in the half-space.
//!
//! With R the distance from the field point and σ = √(R² − z²) that from its foot on the baffle, dS = R dR dθ, so that the Rayleigh integral
//! becomes one over the arrival time τ = R/c and, off the axis, one over the arc of the circle σ that lies on the disc:
//!
//! ```text
//! p(t) = Σ_k ∫ h_k(τ) v̇_k(t − τ) dτ,    h_k(τ) = (ρc/2π) ∫ φ_k dθ;    on the axis h_k = ρc φ_k(σ)
//! ```
//!
//! The integral over τ is Gauss–Legendre in the angle of each piece between arrivals of the foot, the near and the far edge
//! (8 points a cell of the clock), that over the arc 32 points; both are exact to about 1e-8 for a smooth shape.

use std::f64::consts::{PI, TAU};

use faer::c64;
use thiserror::Error;

pub use crate::scene::FieldPoint;

use super::{memory::Memory, radiation::Radiator};
use crate::water::{Water, quadrature::gauss_legendre};

const ARC_POINTS: usize = 32;

#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "field point r = {radius:e} m, z = {distance:e} m: expected finite numbers with r ≥ 0 and z ≥ 0; z counts from the disc's back \
     into the water"
)]
pub struct FieldPointError {
    /// r, m.
    pub radius: f64,
    /// z, m.
    pub distance: f64,
}

impl FieldPoint {
    /// The point, if it lies in the half-space.
    pub(crate) fn checked(self) -> Result<Self, FieldPointError> {
        let Self { radius, distance } = self;
        let is_sound = radius >= 0.0 && distance >= 0.0 && radius.is_finite() && distance.is_finite();
        if is_sound { Ok(self) } else { Err(FieldPointError { radius, distance }) }
    }
}

impl Radiator<'_> {
    pub(super) fn memory_at(&self, water: &Water, point: FieldPoint) -> Memory<impl Fn(f64, &mut [f64]) + '_> {
        let (c, rho, a) = (water.sound_speed, water.density, self.radius);
        let FieldPoint { radius: offset, distance } = point;
        let arrival = |sigma: f64| distance.hypot(sigma) / c;
        let mut breaks = vec![arrival((offset - a).abs()), arrival(offset + a)];
        if offset < a {
            breaks.insert(0, arrival(0.0));
        }
        breaks.dedup();
        let rule = gauss_legendre(ARC_POINTS);
        let kernel = move |tau: f64, out: &mut [f64]| {
            let sigma = ((c * tau).powi(2) - distance * distance).max(0.0).sqrt();
            if offset == 0.0 || sigma == 0.0 {
                self.values(sigma.max(offset), out);
                out.iter_mut().for_each(|value| *value *= rho * c);
                return;
            }
            // From the angle where the circle enters the disc to the point nearest to the axis.
            let entry = ((a * a - offset * offset - sigma * sigma) / (2.0 * offset * sigma)).clamp(-1.0, 1.0).acos();
            let mut values = vec![0.0; out.len()];
            out.fill(0.0);
            for &(x, weight) in &rule {
                let angle = entry + x * (PI - entry);
                let square = offset * offset + sigma * sigma + 2.0 * offset * sigma * angle.cos();
                self.values(square.max(0.0).sqrt(), &mut values);
                let share = rho * c / TAU * 2.0 * weight * (PI - entry);
                out.iter_mut().zip(&values).for_each(|(sum, value)| *sum += share * value);
            }
        };
        Memory { breaks, width: self.shapes.len(), kernel }
    }

    /// Kernel of the pressure at a point on a clock of that step (s): number m × (number of shapes) + k is the pressure at the instant n
    /// for a unit increment of v_k from n − m − 1 to n − m, Pa·s/m; as in [`super::radiation::RadiationKernel`].
    pub fn pressure_kernel(&self, water: &Water, point: FieldPoint, step: f64) -> Result<Vec<f64>, FieldPointError> {
        Ok(self.memory_at(water, point.checked()?).averages(step))
    }

    /// Pressure at a point for unit velocities v_k, iω ∫ h_k e^{−iωτ} dτ, at the angular frequency ω (rad/s), Pa·s/m.
    pub fn pressure_spectrum(
        &self,
        water: &Water,
        point: FieldPoint,
        angular_frequency: f64,
    ) -> Result<Vec<c64>, FieldPointError> {
        let factor = c64::new(0.0, angular_frequency);
        let memory = self.memory_at(water, point.checked()?);
        Ok(memory.spectrum(angular_frequency).into_iter().map(|value| factor * value).collect())
    }
}
