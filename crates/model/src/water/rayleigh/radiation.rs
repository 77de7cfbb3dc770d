//! What the water does to the disc: the kernel H, impedance, added mass.

use std::fmt;

use faer::c64;

use super::memory::Memory;
use crate::water::{Water, disc::FaceProfile, quadrature::gauss_legendre};

const LENS_POINTS: usize = 40;

/// A shape φ(r) over the disc, even in r where it is smooth.
pub trait Shape: Sync {
    /// φ at the radius r (m) inside the disc; unit of its choice.
    fn at(&self, radius: f64) -> f64;
}

impl Shape for FaceProfile {
    fn at(&self, radius: f64) -> f64 {
        Self::at(self, radius)
    }
}

impl<F: Fn(f64) -> f64 + Sync> Shape for F {
    fn at(&self, radius: f64) -> f64 {
        self(radius)
    }
}

pub struct Radiator<'a> {
    pub radius: f64,
    pub shapes: Vec<&'a dyn Shape>,
}

impl fmt::Debug for Radiator<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Radiator").field("radius", &self.radius).field("shapes", &self.shapes.len()).finish()
    }
}

impl<'a> Radiator<'a> {
    /// A rigid piston, φ = 1.
    pub fn piston(radius: f64) -> Self {
        Self { radius, shapes: vec![&|_: f64| 1.0] }
    }

    pub fn of_modes(radius: f64, shapes: &'a [FaceProfile]) -> Self {
        Self { radius, shapes: shapes.iter().map(|shape| shape as &dyn Shape).collect() }
    }

    /// φ_k(r) of all shapes; zero outside the disc.
    pub(in crate::water) fn values(&self, radius: f64, out: &mut [f64]) {
        for (value, shape) in out.iter_mut().zip(&self.shapes) {
            *value = if radius <= self.radius * (1.0 + 1e-12) { shape.at(radius.min(self.radius)) } else { 0.0 };
        }
    }

    /// Correlation C_jk(s) = ∫ φ_j(|x|) φ_k(|x − s e|) dS of two shapes displaced by s (m), averaged over j, k and k, j: row by row, m² × the
    /// units of the shapes. H_jk(τ) = c C_jk(cτ).
    ///
    /// The overlap is a lens; one half is x = a cos t, y = a w sin t with 0 < t < acos(s/2a), 0 < w < 1, dS = a² sin²t dt dw, where everything
    /// is smooth.
    pub fn correlation(&self, lag: f64, out: &mut [f64]) {
        self.correlation_by(&gauss_legendre(LENS_POINTS), lag, out);
    }

    fn correlation_by(&self, rule: &[(f64, f64)], lag: f64, out: &mut [f64]) {
        let count = self.shapes.len();
        out.fill(0.0);
        if lag >= 2.0 * self.radius {
            return;
        }
        let (mut near, mut far) = (vec![0.0; count], vec![0.0; count]);
        let opening = (0.5 * lag / self.radius).acos();
        for &(u, across) in rule {
            let (sine, cosine) = (u * opening).sin_cos();
            let x = self.radius * cosine;
            for &(w, along) in rule {
                let y = self.radius * sine * w;
                let area = 2.0 * across * along * opening * (self.radius * sine).powi(2);
                self.values(x.hypot(y), &mut near);
                self.values((lag - x).hypot(y), &mut far);
                for (j, row) in out.chunks_exact_mut(count).enumerate() {
                    let (one, other) = (area * near[j], area * far[j]);
                    for (sum, (near, far)) in row.iter_mut().zip(near.iter().zip(&far)).take(j + 1) {
                        *sum += one * far + other * near;
                    }
                }
            }
        }
        for j in 0..count {
            for k in 0..j {
                out[k * count + j] = out[j * count + k];
            }
        }
    }

    fn memory(&self, water: &Water) -> Memory<impl Fn(f64, &mut [f64]) + '_> {
        let (width, c, rho) = (self.shapes.len().pow(2), water.sound_speed, water.density);
        let rule = gauss_legendre(LENS_POINTS);
        let kernel = move |tau: f64, out: &mut [f64]| {
            self.correlation_by(&rule, c * tau, out);
            out.iter_mut().for_each(|value| *value *= rho * c);
        };
        Memory { breaks: vec![0.0, 2.0 * self.radius / c], width, kernel }
    }

    /// ρ H_jk averaged over the cells of a clock of that step (s): see [`RadiationKernel`].
    pub fn kernel(&self, water: &Water, step: f64) -> RadiationKernel {
        RadiationKernel { count: self.shapes.len(), step, weights: self.memory(water).averages(step) }
    }

    /// Radiation impedance Z_jk = F_j/v_k = iωρ ∫ H_jk e^{−iωτ} dτ at the angular frequency ω (rad/s), row by row; time factor e^{+iωt};
    /// N·s/m × the units of the shapes.
    pub fn impedance(&self, water: &Water, angular_frequency: f64) -> Vec<c64> {
        let factor = c64::new(0.0, angular_frequency);
        self.memory(water).spectrum(angular_frequency).into_iter().map(|value| factor * value).collect()
    }

    /// Added mass of incompressible water, ρ ∫ C_jk(s) ds, row by row, kg × the units of the shapes: the limit of Im Z/ω.
    pub fn added_mass(&self, water: &Water) -> Vec<f64> {
        self.memory(water).spectrum(0.0).into_iter().map(|value| value.re).collect()
    }
}

/// The kernel of a radiator on a clock.
///
/// Between the instants of the clock velocities are taken as straight lines, so that the force is a sum over the increments of velocity,
///
/// F_j(n Δ) = Σ_{m ≥ 0} W_jk,m (v_k,n−m − v_k,n−m−1),  W_m = (ρ/Δ) ∫_{mΔ}^{(m+1)Δ} H dτ:
///
/// exact for such velocities, and of second order in Δ for smooth ones. After 2a/c nothing is remembered.
#[derive(Debug, Clone, PartialEq)]
pub struct RadiationKernel {
    pub count: usize,
    /// Step Δ of the clock, s.
    pub step: f64,
    /// W_jk,m, matrix after matrix, row by row.
    pub weights: Vec<f64>,
}

impl RadiationKernel {
    pub(crate) fn none(count: usize, step: f64) -> Self {
        Self { count, step, weights: Vec::new() }
    }

    /// W_jk,0; 0 where there is no cell.
    pub(super) fn first(&self, j: usize, k: usize) -> f64 {
        self.weights.get(j * self.count + k).copied().unwrap_or(0.0)
    }

    pub(crate) fn cells(&self) -> usize {
        self.weights.len() / (self.count * self.count)
    }

    pub fn cell(&self, cell: usize) -> &[f64] {
        let size = self.count * self.count;
        &self.weights[cell * size..(cell + 1) * size]
    }
}
