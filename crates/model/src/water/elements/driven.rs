//! Water driven by a face of known velocity.

use super::{
    Baffle, ElementsError, Water, WaterMesh, factor::QuasiDefinite, mesh::Hemisphere, sparse::Sparse, waves::Waves,
};
use crate::water::rayleigh::field::FieldPoint;

/// A half-space of water in front of a face that moves as v(t) φ(r), v positive into the water.
#[derive(Debug, Clone)]
pub struct DrivenWater {
    waves: Waves,
    factor: QuasiDefinite,
    face: Vec<f64>,
    velocity: f64,
    step: f64,
    solution: Vec<f64>,
    work: f64,
}

impl DrivenWater {
    /// Water at rest.
    ///
    /// - `disc`: radius a of the face, m
    /// - `shape`: φ(r), 1
    /// - `step`: s
    pub fn new(
        disc: f64,
        shape: impl Fn(f64) -> f64,
        (water, baffle): (Water, Baffle),
        mesh: &WaterMesh,
        points: &[FieldPoint],
        step: f64,
    ) -> Result<Self, ElementsError> {
        let waves = Waves::new(disc, mesh, water, baffle, points, step)?;
        let face = waves.acoustics.face_load(shape);
        let factor = QuasiDefinite::new(&Sparse::new(waves.unknowns(), waves.matrix(0)))?;
        let solution = vec![0.0; waves.unknowns()];
        Ok(Self { waves, factor, face, velocity: 0.0, step, solution, work: 0.0 })
    }

    /// Go one step, at whose end the velocity is v (m/s).
    pub fn advance(&mut self, velocity: f64) {
        let mean = 0.5 * (self.velocity + velocity);
        self.velocity = velocity;
        self.solution.copy_from_slice(self.waves.known());
        self.solution.iter_mut().zip(&self.face).for_each(|(load, face)| *load -= face * mean);
        self.factor.solve(&mut self.solution);
        let force: f64 = self.solution.iter().zip(&self.face).map(|(pressure, face)| pressure * face).sum();
        self.work += self.step * mean * force;
        let face = &self.face;
        self.waves.advance(&self.solution, |load| {
            load.iter_mut().zip(face).for_each(|(load, face)| *load += 2.0 * mean * face);
        });
    }

    /// Pressure at field point `point`, Pa.
    pub fn pressure(&self, point: usize) -> f64 {
        self.waves.pressure_at(point)
    }

    /// ∫ φ p dS over the face, N.
    pub fn force(&self) -> f64 {
        self.waves.pressure.iter().zip(&self.face).map(|(pressure, face)| pressure * face).sum()
    }

    /// Work of the face on the water, energy in the hemisphere, energy that left through it, J.
    pub fn energy(&self) -> [f64; 3] {
        [self.work, self.waves.energy(), self.waves.radiated]
    }

    pub fn mesh(&self) -> &Hemisphere {
        &self.waves.acoustics.mesh
    }

    /// ψ (Pa·s) and p (Pa) at a node; 0 on a soft baffle.
    pub fn at_node(&self, node: u32) -> (f64, f64) {
        self.waves
            .acoustics
            .unknown
            .get(node as usize)
            .and_then(|&place| Some((*self.waves.potential.get(place as usize)?, self.waves.pressure[place as usize])))
            .unwrap_or((0.0, 0.0))
    }
}
