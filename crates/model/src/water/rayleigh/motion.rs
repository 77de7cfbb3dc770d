//! The disc in its modes on the water, stepped in time.
//!
//! With u_z(back) = Σ φ_k q_k, mass-normalised, a contact force F at the pole of the front and the water's force −f:
//!
//! ```text
//! q̈_k + ω_k² q_k = φ_k(0) F − f_k,    f = ρ H * q̈ ([`super::radiation`])
//! ```
//!
//! In time: the trapezoidal rule, the kernel on the same clock, the modes coupled by H(0) within a step. What the modes leave out of the
//! pole's flexibility, C_s − Σ φ_k(0)²/ω_k², belongs to the contact that pushes.

use faer::{Mat, linalg::solvers::Solve as _};
use std::f64::consts::TAU;

use super::{
    field::{FieldPoint, FieldPointError},
    radiation::{RadiationKernel, Radiator},
};
use crate::{
    number::dot,
    response::SolverWork,
    water::{OnWater, Water, disc::DiscModes},
};

#[derive(Debug, Clone)]
pub struct WetDisc {
    step: f64,
    squares: Vec<f64>,
    pole: Vec<f64>,
    /// φ_k(0) on the back, 1/√kg.
    back: Vec<f64>,
    modes: usize,
    kernel: RadiationKernel,
    pressure_kernels: Vec<Vec<f64>>,
    /// (2/Δ + Λ Δ/2 + W₀)⁻¹, row by row.
    inverse: Vec<f64>,
    /// Displacement of the pole at the end of a step for a unit force there, m/N.
    compliance: f64,
    displacement: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    /// The free increment of velocity of the step under way, and what makes it.
    free: Vec<f64>,
    load: Vec<f64>,
    /// Increments of velocity, a ring of rows; `newest` is the last one written.
    increments: Vec<f64>,
    newest: usize,
    /// Force on the water at the last instant, N·√kg⁻¹, and the work done on it so far, J.
    water_force: Vec<f64>,
    water_work: f64,
    terms: u64,
}

impl WetDisc {
    /// A disc at rest, on a clock of that step (s), with field points.
    pub fn new(
        radius: f64,
        modes: &DiscModes,
        water: &Water,
        points: &[FieldPoint],
        step: f64,
    ) -> Result<Self, FieldPointError> {
        let count = modes.frequencies.len();
        let radiator = Radiator::of_modes(radius, &modes.back);
        // Nothing pushes back in a vacuum: no kernel, and no memory of the past.
        let kernel =
            if water.density > 0.0 { radiator.kernel(water, step) } else { RadiationKernel::none(count, step) };
        let pressure_kernels =
            points.iter().map(|&point| radiator.pressure_kernel(water, point, step)).collect::<Result<Vec<_>, _>>()?;
        let squares: Vec<f64> = modes.frequencies.iter().map(|frequency| (TAU * frequency).powi(2)).collect();
        let matrix = Mat::from_fn(count, count, |j, k| {
            kernel.first(j, k) + if j == k { 2.0 / step + 0.5 * step * squares[j] } else { 0.0 }
        });
        let solved = matrix.partial_piv_lu().solve(Mat::<f64>::identity(count, count));
        let inverse: Vec<f64> = (0..count * count).map(|i| solved[(i / count, i % count)]).collect();
        let pushed = inverse.chunks_exact(count).zip(&modes.pole).map(|(row, own)| own * dot(row, &modes.pole));
        let compliance = 0.5 * step * pushed.sum::<f64>();
        let rows = pressure_kernels
            .iter()
            .map(|pressure_kernels| pressure_kernels.len() / count)
            .chain([kernel.cells()])
            .fold(1, usize::max);
        let zeros = vec![0.0; count];
        Ok(Self {
            step,
            squares,
            pole: modes.pole.clone(),
            back: modes.back.iter().map(|shape| shape.at(0.0)).collect(),
            modes: modes.modes,
            kernel,
            pressure_kernels,
            inverse,
            compliance,
            displacement: zeros.clone(),
            velocity: zeros.clone(),
            acceleration: zeros.clone(),
            free: zeros.clone(),
            load: zeros.clone(),
            increments: vec![0.0; rows * count],
            newest: 0,
            water_force: zeros,
            water_work: 0.0,
            terms: 0,
        })
    }

    /// Velocities of the modes, m·√kg/s.
    pub fn modal_velocity(&self) -> &[f64] {
        &self.velocity
    }

    /// Displacements of the modes, m·√kg.
    pub(crate) fn modal_displacement(&self) -> &[f64] {
        &self.displacement
    }

    /// The same at the end of the step that [`OnWater::predict`] began, without forces there.
    pub(crate) fn free_displacement(&self) -> impl Iterator<Item = f64> {
        let parts = self.displacement.iter().zip(&self.velocity).zip(&self.free);
        parts.map(|((displacement, velocity), free)| displacement + self.step * (velocity + 0.5 * free))
    }

    /// What unit modal forces at the end of a step add to it, row by row, m·√kg/(N/√kg).
    pub(crate) fn shape_compliance(&self) -> Vec<f64> {
        self.inverse.iter().map(|value| 0.5 * self.step * value).collect()
    }

    /// Finish the step that [`OnWater::predict`] began, with these forces on the modes (N/√kg) at its end.
    pub(crate) fn push_modal(&mut self, forces: &[f64]) {
        let count = self.pole.len();
        let rows = self.increments.len() / count;
        self.newest = (self.newest + 1) % rows;
        let ring = &mut self.increments[self.newest * count..(self.newest + 1) * count];
        let half = 0.5 * self.step;
        for (k, newest) in ring.iter_mut().enumerate() {
            let increment = self.free[k] + dot(&self.inverse[k * count..(k + 1) * count], forces);
            let before = self.velocity[k];
            self.velocity[k] += increment;
            self.displacement[k] += half * (before + self.velocity[k]);
            self.acceleration[k] = 2.0 / self.step * increment - self.acceleration[k];
            *newest = increment;
            // What the modes' own equation leaves for the water.
            let on_water = forces[k] - self.acceleration[k] - self.squares[k] * self.displacement[k];
            self.water_work += half * 0.5 * (before + self.velocity[k]) * (self.water_force[k] + on_water);
            self.water_force[k] = on_water;
        }
    }
}

impl OnWater for WetDisc {
    fn step(&self) -> f64 {
        self.step
    }

    fn compliance(&self) -> f64 {
        self.compliance
    }

    fn predict(&mut self) -> f64 {
        let count = self.pole.len();
        for (k, load) in self.load.iter_mut().enumerate() {
            *load = self.acceleration[k] - self.squares[k] * (self.displacement[k] + self.step * self.velocity[k]);
        }
        let rows = self.increments.len() / count;
        for cell in 1..self.kernel.cells() {
            let place = (self.newest + rows + 1 - cell) % rows;
            let increment = &self.increments[place * count..(place + 1) * count];
            for (load, row) in self.load.iter_mut().zip(self.kernel.cell(cell).chunks_exact(count)) {
                *load -= dot(row, increment);
            }
        }
        self.terms += self.kernel.cells().saturating_sub(1) as u64;
        for (free, row) in self.free.iter_mut().zip(self.inverse.chunks_exact(count)) {
            *free = dot(row, &self.load);
        }
        self.pole.iter().zip(self.free_displacement()).map(|(shape, end)| shape * end).sum()
    }

    fn push(&mut self, force: f64) {
        let mut forces = std::mem::take(&mut self.load);
        forces.iter_mut().zip(&self.pole).for_each(|(out, shape)| *out = force * shape);
        self.push_modal(&forces);
        self.load = forces;
    }

    fn predicted_modal_velocity(&self) -> f64 {
        (0..self.modes).map(|k| self.pole[k] * (self.velocity[k] + self.free[k])).sum()
    }

    fn modal_compliance(&self) -> f64 {
        let rows = self.inverse.chunks_exact(self.pole.len()).zip(&self.pole);
        rows.take(self.modes).map(|(row, own)| own * dot(row, &self.pole)).sum()
    }

    fn back_velocity(&self) -> f64 {
        dot(&self.back, &self.velocity)
    }

    fn pole_displacement(&self) -> f64 {
        dot(&self.pole, &self.displacement)
    }

    fn energy(&mut self) -> f64 {
        let own = |k: usize| self.velocity[k].powi(2) + self.squares[k] * self.displacement[k].powi(2);
        0.5 * (0..self.pole.len()).map(own).sum::<f64>()
    }

    fn work_on_water(&self) -> f64 {
        self.water_work
    }

    fn count(&self, work: &mut SolverWork) {
        work.unknowns += self.pole.len() as u64;
        work.memory_terms += self.terms;
    }

    fn pressure(&self, point: usize) -> f64 {
        let count = self.pole.len();
        let rows = self.increments.len() / count;
        let cells = self.pressure_kernels[point].chunks_exact(count).enumerate();
        cells
            .map(|(cell, weights)| {
                let place = (self.newest + rows - cell) % rows;
                dot(weights, &self.increments[place * count..(place + 1) * count])
            })
            .sum()
    }
}
