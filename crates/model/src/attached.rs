//! Compliant horn and bead guide of a run at a fixed step: what acts on a chain beside its contacts.

use crate::{holder::Hold, horn::HornStep, scene::Scene};

/// None where the scene has none.
#[derive(Debug, Default)]
pub(crate) struct Attached<N> {
    pub(crate) horn: Option<HornStep<N>>,
    pub(crate) hold: Option<Hold<N>>,
}

impl Attached<f64> {
    /// Of a scene, whose beads have the masses `masses` (kg), in steps of `step` (s).
    pub(crate) fn of(scene: &Scene, masses: &[f64], step: f64) -> Self {
        Self { horn: HornStep::of(scene, step), hold: Hold::of(scene, masses, step) }
    }
}
