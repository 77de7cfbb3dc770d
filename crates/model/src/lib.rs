//! Physics: from a scene to a response, or to a typed failure.

pub mod analytical;
mod attached;
pub mod chain;
pub mod contact_law;
mod estimate;
pub mod fea;
mod holder;
mod horn;
mod number;
mod prepared;
pub mod reduced;
pub mod response;
pub mod scene;
mod tally;
mod valid;
mod vector_unit;
pub mod water;

pub use estimate::Estimate;
pub use prepared::{Prepared, prepare, prepare_with};
pub use vector_unit::vector_unit;

use thiserror::Error;

use crate::{response::Response, scene::Scene};

/// Called by a model now and then with the simulated time (s); returning `false` stops the run.
pub(crate) type Progress<'a> = &'a mut dyn FnMut(f64) -> bool;

fn need_drive(scene: &Scene, model: &'static str) -> Result<(), ModelError> {
    let Some(file) = scene.pending_record() else { return Ok(()) };
    let reason =
        format!("the drive record {} has not been read; hand it over with `with_drive_record`", file.display());
    Err(ModelError::Unsupported { model, reason })
}

/// Run a scene on the model it asks for: [`prepare`], then [`Prepared::run`].
pub fn run(scene: &Scene, progress: Progress<'_>) -> Result<Response, ModelError> {
    prepare(scene)?.run(scene, progress)
}

impl From<fea::FeaError> for ModelError {
    fn from(error: fea::FeaError) -> Self {
        Self::Fea(Box::new(error))
    }
}

const GIB: f64 = 1024.0 * 1024.0 * 1024.0;

/// Why a run failed. Numbers are SI; contacts and beads count from 1 at the piston.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ModelError {
    #[error("model `{model}`: {reason}")]
    Unsupported { model: &'static str, reason: String },
    #[error("`{part}` differs from the scene the bodies were prepared for; prepare this scene")]
    OtherBodies { part: &'static str },
    #[error("`{quantity}`: expected {expected}, found {found:e}; correct the scene")]
    Unphysical { quantity: String, expected: &'static str, found: f64 },
    #[error("`{quantity}`: expected {expected} values, found {found}")]
    Count { quantity: &'static str, expected: usize, found: usize },
    #[error(
        "`chain.precompression` {force:e} N needs every gap closed, but gap {contact} (1 = piston) is {gap:e} m; \
         set that gap or the precompression to zero"
    )]
    OpenGapUnderPrecompression { force: f64, contact: usize, gap: f64 },
    #[error(
        "the state of bead {bead} is not finite at {time:.9e} s (step {step:.3e} s); the drive, the stiffnesses or a \
         fixed step are out of range"
    )]
    NonFinite { time: f64, step: f64, bead: usize },
    #[error(
        "the step shrank to {step:.3e} s at {time:.9e} s, last at contact {contact} (1 = piston), without meeting \
         tolerance {tolerance:e}; loosen `model.tolerance` or look for a stiffness or damping out of range"
    )]
    StepUnderflow { time: f64, step: f64, contact: usize, tolerance: f64 },
    #[error(
        "energy balance: expected at most 10 % of the largest energy unaccounted for, found {residual_j:.3e} J of {largest_j:.3e} J; shorten \
         `model.step` or lower `model.tolerance`, and refine the mesh"
    )]
    EnergyUnbalanced { residual_j: f64, largest_j: f64 },
    #[error(
        "the run is estimated at {work:.1e} unknowns × steps, above the limit of {limit:.0e}; shorten `duration`, lengthen the step, take fewer \
         beads or runs, or lift the limits with --no-limits (in a program, `Scene::with_limits`)"
    )]
    TooMuchWork { work: f64, limit: f64 },
    #[error(
        "the run is estimated at {:.1} GiB of memory, above the limit of {:.1} GiB; lengthen `output_step`, shorten `duration`, take fewer beads \
         or runs or a coarser mesh, or lift the limits with --no-limits (in a program, `Scene::with_limits`)",
        memory / GIB, limit / GIB
    )]
    TooMuchMemory { memory: f64, limit: f64 },
    #[error(
        "the dashpot of contact {contact} (1 = piston), {coefficient:.1e} N·s/m, is {ratio:.1e} times as fast as the contact, above the limit of \
         {limit:.0e}: the chain's steps would shrink with it; lower `damping.coefficient`, give the bodies that it holds together as one, or lift \
         the limits with --no-limits (in a program, `Scene::with_limits`)"
    )]
    StiffDashpot { contact: usize, coefficient: f64, ratio: f64, limit: f64 },
    #[error(
        "after {steps} steps the run is at {time:.9e} s of {end:.3e} s and would take {expected:.1e} steps, above the limit of {limit:.1e}; look for \
         a stiffness, damping or bead out of range, loosen `model.tolerance`, or lift the limits with --no-limits (in a program, \
         `Scene::with_limits`)"
    )]
    TooManySteps { steps: u64, time: f64, end: f64, expected: f64, limit: f64 },
    #[error(transparent)]
    Fea(#[from] Box<fea::FeaError>),
    #[error(transparent)]
    Water(Box<water::WaterError>),
    #[error("stopped at {time:.6e} s")]
    Stopped { time: f64 },
}

pub fn check_energy(energy: &response::EnergyBalance) -> Result<(), ModelError> {
    if energy.is_broken() {
        return Err(ModelError::EnergyUnbalanced { residual_j: energy.residual_j, largest_j: energy.largest_j });
    }
    Ok(())
}
