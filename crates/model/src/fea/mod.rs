//! The contact finite element analysis: axisymmetric bodies in quadratic elements, frictionless contact by Lagrange multipliers.
//!
//! Every body b (beads, annulus) is linear elastic and axisymmetric about the chain's axis, u = (u_r, u_z)(r, z, t):
//!
//! ```text
//! M_b ü_b + K_b u_b = f_b + Σ_c B_{bc}ᵀ λ_c        in each body, f the dashpots on its rigid motion
//! λ_c ≥ 0,  g_c(u) ≥ 0,  λ_c g_c = 0               at every surface node of contact c: it presses or it is open
//! ```
//!
//! The gap g is the analytic distance of the undeformed profiles plus the normal displacements; it never comes from meshed coordinates.
//! Everything but the contact is linear: one factor a kind of body and step size serves all beads and all steps.
//!
//! Data flows mesh → element → assembly → body → contact → statics and transient.

pub mod arrangement;
pub mod assembly;
pub mod body;
pub(crate) mod contact;
pub mod control;
pub mod element;
pub(crate) mod energy;
pub(crate) mod equilibrium;
mod error;
pub mod factor;
mod frame;
pub(crate) mod loss;
pub mod mesh;
pub mod modes;
pub(crate) mod motion;
pub(crate) mod operator;
pub mod profile;
pub(crate) mod resolution;
pub(crate) mod scheme;
pub(crate) mod simulation;
pub mod statics;
pub(crate) mod trace;
pub(crate) mod yielding;

pub use control::{Control, Cut};
pub use error::FeaError;
pub use frame::Frames;
pub use simulation::{Simulation, Snapshot};

use super::{ModelError, Progress, estimate::refuse_excess, need_drive};
use crate::{
    response::Response,
    scene::{PistonMotion, Scene},
};

const STEPS_PER_REPORT: usize = 8;

/// Run a scene, the piston moving as `motion`; mesh, scheme and step come from the scene.
pub(crate) fn run(scene: &Scene, motion: &dyn PistonMotion, progress: Progress<'_>) -> Result<Response, ModelError> {
    need_drive(scene, "fea")?;
    refuse_excess(scene)?;
    let mut simulation = Simulation::with_motion(scene, Box::new(motion), Control::default())?;
    let mut steps = 0_usize;
    while !simulation.is_done() {
        simulation.advance()?;
        steps += 1;
        if steps.is_multiple_of(STEPS_PER_REPORT) && !progress(simulation.time()) {
            return Err(ModelError::Stopped { time: simulation.time() });
        }
    }
    Ok(simulation.response())
}
