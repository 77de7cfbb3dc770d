//! What a computation cost, in counts that do not depend on the machine.

use serde::{Deserialize, Serialize};

/// Counts of what a run did, from the first step to the response; of what was made ready before it: [`Preparation`].
///
/// Each is an integer beside the work itself, so that an effect a scene does not have shows as a zero, and two runs can be compared
/// wherever they were made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct SolverWork {
    pub unknowns: u64,
    pub steps: u64,
    pub rejected_steps: u64,
    pub evaluations: u64,
    pub events: u64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub factorisations: u64,
    /// Sweeps over all contacts of the steps' complementarity problems.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub contact_sweeps: u64,
    /// The most that one step took; files have the sum only.
    #[serde(skip)]
    pub most_contact_sweeps: u64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub active_sets: u64,
    /// Solutions with a factor in the steps: one a kind of body and step tried, for all bodies of the kind at once; one a step of disc and water
    /// by elements.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub solves: u64,
    /// Of the unknowns, those of the mesh of the water.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub acoustic_unknowns: u64,
    /// Kernels of the water made in the run: that of the disc's load, and one a field point.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub kernels: u64,
    /// Past instants summed over for the water's load on the disc: cells of its kernel, or past forces of a recorded answer.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub memory_terms: u64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub pressure_samples: u64,
    /// Records of the pressure that went through the absorption of the water.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub absorbed_records: u64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub dashpot_evaluations: u64,
    /// Sweeps over all contacts for the equilibrium under the precompression.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub equilibrium_sweeps: u64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub horn_evaluations: u64,
    /// Evaluations of the bead guide's drag and friction, one a bead.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub holder_evaluations: u64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub friction_turns: u64,
    /// Evaluations of the weight of a bead.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub gravity_evaluations: u64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub yields: u64,
    /// Evaluations of the relaxation of a support.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub relaxation_evaluations: u64,
    /// Evaluations of the loss within a body.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub loss_evaluations: u64,
}

/// Counts of what making bodies ready took, before any run.
///
/// Bodies read from a cache cost none of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Preparation {
    pub bodies: u64,
    pub factorisations: u64,
    pub modes: u64,
    pub fitted_laws: u64,
    pub water_meshes: u64,
    /// Kernels of the water: that of the disc's load, and one a field point.
    pub kernels: u64,
    /// Steps of disc and water taken to record their answer to a force.
    pub recorded_steps: u64,
}

/// Counts that a model does not have stay out of its files.
fn is_zero(count: &u64) -> bool {
    *count == 0
}
