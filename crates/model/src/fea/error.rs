//! Why a contact finite element analysis cannot be run, or failed.

use thiserror::Error;

use super::{
    body::BodyError, contact::pair::PairError, control::Cause, factor::FactorError, mesh::MeshError, modes::ModesError,
};

/// Why a contact finite element analysis cannot be run, or failed. Numbers are SI; contacts and beads count from 1 at the piston.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FeaError {
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error("{body}: {source}")]
    Body { body: String, source: BodyError },
    #[error("{body}: {source}")]
    Factor { body: String, source: FactorError },
    #[error("{body}: {source}")]
    Modes { body: String, source: ModesError },
    #[error(transparent)]
    Pair(#[from] PairError),
    #[error("`{key}` = \"half-space\": it cannot be meshed; use \"rigid\", or model.kind = \"chain\"")]
    HalfSpace { key: &'static str },
    #[error("model `fea` does not have {what}; set `model.kind` = \"chain\"")]
    BeyondModel { what: &'static str },
    #[error(transparent)]
    Front(#[from] Box<crate::water::WaterError>),
    #[error("`chain.precompression` {force:e} N on a free disc: nothing holds it; set `disc.rim` or no precompression")]
    FreeDiscUnderForce { force: f64 },
    #[error("an analysis with water behind the disc cannot be taken up again; run it from the start")]
    WaterNotKept,
    #[error(
        "`{key}` is of the material of an annulus; this scene's support is none, or a disc that steps with its water: leave the key out"
    )]
    LossWithoutBody { key: &'static str },
    #[error(
        "contact {contact} (1 = piston): its compliance is not positive definite; two of its points coincide or a body is not held"
    )]
    Compliance { contact: usize },
    #[error(
        "the beads approach by {approach:.3e} m, but on this mesh a contact presses its third point only at {needed:.3e} m: its stiffness would be \
         that of a stamp; refine `model.mesh_density`, enlarge `drive.amplitude`, `alpha` or `chain.precompression`, or use model.kind = \"chain\""
    )]
    Unresolved { approach: f64, needed: f64 },
    #[error(
        "no equilibrium under {force:e} N at contact {contact} (1 = piston) within {iterations} iterations; the force needs more than the \
         finely meshed patch"
    )]
    NoEquilibrium { force: f64, contact: usize, iterations: u32 },
    #[error(
        "`chain.precompression` {force:e} N needs every gap closed, but gap {contact} (1 = piston) is {gap:e} m; set that gap or the \
         precompression to zero"
    )]
    OpenGapUnderPrecompression { force: f64, contact: usize, gap: f64 },
    #[error(
        "step given up at {time:.9e} s with {step:.3e} s, contact {contact} (1 = piston): {cause}; shorten `model.step`, refine \
         `model.mesh_density`, enlarge `model.contact_patch`, or look for a drive or impact out of range"
    )]
    StepGivenUp { time: f64, step: f64, contact: usize, cause: Cause },
    #[error(
        "at {time:.6e} s there is {made_j:.3e} J more than the {given_j:.3e} J that were put in: contacts opening and closing within steps of \
         {step:.3e} s made it, which a shorter step does not cure; take `model.integrator = \"hht\"` or `model.kind = \"reduced\"`, or \
         end the run earlier"
    )]
    EnergyMade { time: f64, step: f64, made_j: f64, given_j: f64 },
    #[error(
        "the saved state is of another analysis ({found} of {expected}); start again or give the scene it was saved with"
    )]
    OtherState { expected: String, found: String },
    #[error(
        "the saved state has series, contacts or a number of steps that its analysis cannot have; start over with --force"
    )]
    ImpossibleState,
}
