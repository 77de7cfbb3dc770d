//! The discrete chain: one unknown a bead.

pub mod ensemble;

use super::{Model, ModelError, Progress};
use crate::{response::Response, scene::Scene};

/// The chain model; the integrator and its tolerance come from the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ChainModel;

/// Where the beads are and how they move at time zero, relative to the scene's own start.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialState {
    /// Displacement of each bead, m.
    pub displacements: Vec<f64>,
    /// Velocity of each bead, m/s.
    pub velocities: Vec<f64>,
}

impl InitialState {
    /// All beads in place and at rest.
    #[must_use]
    pub fn at_rest(beads: usize) -> Self {
        Self { displacements: vec![0.0; beads], velocities: vec![0.0; beads] }
    }
}

impl Model for ChainModel {
    fn run(&self, scene: &Scene, progress: Progress<'_>) -> Result<Response, ModelError> {
        self.run_from(scene, &InitialState::at_rest(scene.chain.beads.len()), progress)
    }
}

impl ChainModel {
    /// Run the scene from a given state of the beads. A gap of `f64::INFINITY` takes a contact away, such as piston or support
    /// of a free chain.
    ///
    /// # Errors
    /// A typed [`ModelError`] when the scene cannot be run or the run failed.
    pub fn run_from(
        &self,
        scene: &Scene,
        initial: &InitialState,
        progress: Progress<'_>,
    ) -> Result<Response, ModelError> {
        let _ = (scene, initial, progress);
        Err(ModelError::Unsupported { model: "chain", reason: "the integrator is not linked in yet".into() })
    }
}
