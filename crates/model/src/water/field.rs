//! The pressure field of the disc: at chosen instants, at chosen frequencies, and far away.
//!
//! Disc and water are linear, so the force history of a finished run is all that is needed: [`FaceMotion::under`] sends it once more through a
//! disc in its shapes and keeps their velocities v_k(t). From these follow
//!
//! ```text
//! p(x, t) = Σ_k ∫ h_k(τ) v̇_k(t − τ) dτ                             a map at instants ([`FaceMotion::map`])
//! P(x, ω) = Σ_k V_k iω ∫ h_k(τ) e^{−iωτ} dτ                         a map at a frequency ([`amplitude_map`])
//! D(θ)    = |P(d sin θ, d cos θ)|,  d finite or without end           a beam pattern ([`beam_pattern`], [`far_field`])
//! v(r, t) = Σ_k φ_k(r) v_k(t)                                       the face itself ([`FaceMotion::face`])
//! ```
//!
//! with h_k the kernels of [`super::rayleigh::field`]: exact for a rigid baffle. The second, independent source of a map, and the only one for
//! a soft baffle, is the mesh of [`super::elements`] at its nodes.

mod soft;

pub(crate) use soft::FacePressure;

use faer::c64;
use rayon::prelude::*;

use super::{
    OnWater, Water,
    quadrature::gauss_legendre,
    rayleigh::{
        field::{FieldPoint, FieldPointError},
        instant::InstantRule,
        motion::WetDisc,
        radiation::Radiator,
    },
};
use granchain_signal::{
    Series,
    spline::{Ends, Spline},
};

#[derive(Debug, Clone, PartialEq)]
pub struct FieldGrid {
    /// Radii r ≥ 0, m, ascending.
    pub radius: Vec<f64>,
    /// Distances z ≥ 0 from the disc's back, m, ascending.
    pub distance: Vec<f64>,
}

impl FieldGrid {
    /// Evenly spaced, from the axis to `reach` (m) and from the back to `depth` (m), about `spacing` (m) apart.
    pub fn even(reach: f64, depth: f64, spacing: f64) -> Self {
        let line = |length: f64| {
            let pieces = (length / spacing).round().max(1.0);
            (0..=pieces as usize).map(|i| length * i as f64 / pieces).collect()
        };
        Self { radius: line(reach), distance: line(depth) }
    }

    /// The points, row by row: the point of `radius[i]` and `distance[j]` is number j × (number of radii) + i.
    pub(crate) fn points(&self) -> impl Iterator<Item = FieldPoint> + '_ {
        self.distance
            .iter()
            .flat_map(|&distance| self.radius.iter().map(move |&radius| FieldPoint { radius, distance }))
    }
}

#[derive(Debug, Clone)]
pub struct FaceMotion {
    velocity: Vec<Series>,
    splines: Vec<Spline>,
    step: f64,
}

impl FaceMotion {
    /// From the velocities v_k(t) of the shapes, m/s over the unit of the shape, from rest, all on one clock.
    pub fn new(velocity: Vec<Series>) -> Self {
        let step = velocity.first().map_or(f64::INFINITY, |series| series.step);
        let splines = velocity.iter().map(|series| Spline::new(series, Ends::Natural)).collect();
        Self { velocity, splines, step }
    }

    /// Motion of a disc at rest under the forces F(n Δ) (N) on its pole, n = 0, 1, … on its own clock.
    pub fn under(mut disc: WetDisc, forces: &[f64]) -> Self {
        let step = disc.step();
        let mut velocity: Vec<Series> =
            disc.modal_velocity().iter().map(|&rest| Series::new(0.0, step, vec![rest])).collect();
        for &force in forces.iter().skip(1) {
            disc.predict();
            disc.push(force);
            velocity.iter_mut().zip(disc.modal_velocity()).for_each(|(series, &v)| series.values.push(v));
        }
        Self::new(velocity)
    }

    pub fn velocity(&self) -> &[Series] {
        &self.velocity
    }

    /// Velocity of the back, m/s, positive into the water and 0 beyond the disc, at many radii (m) and times (s): one list over the times each
    /// radius.
    pub fn face(&self, radiator: &Radiator<'_>, radii: &[f64], times: &[f64]) -> Vec<Vec<f64>> {
        let shapes: Vec<Vec<f64>> = radii
            .iter()
            .map(|&radius| {
                let mut shapes = vec![0.0; self.splines.len()];
                radiator.values(radius, &mut shapes);
                shapes
            })
            .collect();
        let mut rows = vec![Vec::with_capacity(times.len()); radii.len()];
        let mut now = vec![0.0; self.splines.len()];
        for &time in times {
            now.iter_mut().zip(&self.splines).for_each(|(value, spline)| *value = spline.at(time).0);
            for (row, shapes) in rows.iter_mut().zip(&shapes) {
                row.push(shapes.iter().zip(&now).map(|(shape, v)| shape * v).sum());
            }
        }
        rows
    }

    fn accelerations(&self, time: f64, out: &mut [f64]) {
        out.iter_mut().zip(&self.splines).for_each(|(value, spline)| *value = spline.at(time).1);
    }

    /// Pressure (Pa) at a point at each of `times` (s).
    pub fn pressure(
        &self,
        radiator: &Radiator<'_>,
        water: &Water,
        point: FieldPoint,
        times: &[f64],
    ) -> Result<Vec<f64>, FieldPointError> {
        let rule = InstantRule::new(radiator.radius, water, self.step);
        radiator.pressure_at(water, point, times, &rule, &|time, out| self.accelerations(time, out))
    }

    /// Pressure (Pa) over a grid at each of `times` (s): one list of the grid's points each.
    pub fn map(
        &self,
        radiator: &Radiator<'_>,
        water: &Water,
        grid: &FieldGrid,
        times: &[f64],
    ) -> Result<Vec<Vec<f64>>, FieldPointError> {
        let rule = InstantRule::new(radiator.radius, water, self.step);
        let accelerations = |time: f64, out: &mut [f64]| self.accelerations(time, out);
        let points: Vec<FieldPoint> = grid.points().collect();
        let by_point = points
            .par_iter()
            .map(|&point| radiator.pressure_at(water, point, times, &rule, &accelerations))
            .collect::<Result<Vec<_>, _>>()?;
        Ok((0..times.len()).map(|time| by_point.iter().map(|pressure| pressure[time]).collect()).collect())
    }
}

/// Complex amplitude of the pressure (Pa, time factor e^{+iωt}) over a grid when the shapes move with the complex velocity amplitudes V_k, at
/// the angular frequency ω (rad/s).
pub fn amplitude_map(
    radiator: &Radiator<'_>,
    water: &Water,
    grid: &FieldGrid,
    velocities: &[c64],
    angular_frequency: f64,
) -> Result<Vec<c64>, FieldPointError> {
    let points: Vec<FieldPoint> = grid.points().collect();
    points.par_iter().map(|&point| amplitude(radiator, water, point, velocities, angular_frequency)).collect()
}

/// The same at the angles θ (rad) from the axis at the distance d (m) from the middle of the disc's back.
pub fn beam_pattern(
    radiator: &Radiator<'_>,
    water: &Water,
    (distance, angles): (f64, &[f64]),
    velocities: &[c64],
    angular_frequency: f64,
) -> Result<Vec<c64>, FieldPointError> {
    let at = |&angle: &f64| {
        // The cosine of 90° in floating point is not zero, and may be below it.
        let (sine, cosine) = (angle.abs().sin(), angle.cos());
        let point = FieldPoint {
            radius: distance * sine,
            distance: distance * if cosine.abs() < 1e-12 { 0.0 } else { cosine },
        };
        amplitude(radiator, water, point, velocities, angular_frequency)
    };
    angles.par_iter().map(at).collect()
}

fn amplitude(
    radiator: &Radiator<'_>,
    water: &Water,
    point: FieldPoint,
    velocities: &[c64],
    angular_frequency: f64,
) -> Result<c64, FieldPointError> {
    let kernels = radiator.pressure_spectrum(water, point, angular_frequency)?;
    Ok(kernels.iter().zip(velocities).map(|(kernel, velocity)| kernel * velocity).sum())
}

/// What beam patterns tend to far away: P d e^{ikd} as d → ∞ (Pa·m), at the angles θ (rad) from the axis.
///
/// P d e^{ikd} → iωρ ∫₀ᵃ V(r) J₀(k r sin θ) r dr,  V = Σ V_k φ_k,  k = ω/c
///
/// for a rigid baffle. Reached when d ≫ a and d ≫ k a². Kinsler, Frey, Coppens & Sanders (2000), *Fundamentals of Acoustics*, §7.4.
pub fn far_field(
    radiator: &Radiator<'_>,
    water: &Water,
    angles: &[f64],
    velocities: &[c64],
    angular_frequency: f64,
) -> Vec<c64> {
    let wave_number = angular_frequency / water.sound_speed;
    // The integrand turns once in 2π of k r.
    let rule = gauss_legendre(48 + (2.0 * wave_number * radiator.radius).min(1e4) as usize);
    let mut shapes = vec![0.0; velocities.len()];
    let source: Vec<(f64, c64)> = rule
        .iter()
        .map(|&(x, weight)| {
            let radius = x * radiator.radius;
            radiator.values(radius, &mut shapes);
            let velocity: c64 = velocities.iter().zip(&shapes).map(|(v, shape)| v * *shape).sum();
            (radius, velocity * (weight * radiator.radius * radius))
        })
        .collect();
    let factor = c64::new(0.0, angular_frequency * water.density);
    let at = |&angle: &f64| -> c64 {
        let across = wave_number * angle.sin();
        factor * source.iter().map(|(radius, part)| part * libm::j0(across * radius)).sum::<c64>()
    };
    angles.iter().map(at).collect()
}
