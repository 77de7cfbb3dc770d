//! The disc between the chain and a half-space of water.
//!
//! The disc is linear elastic and axisymmetric, its front touched by the last bead, its back on the water z > 0 (z from the back into the
//! water, r from the axis). The plane around the disc is rigid, or free of pressure. The water is linear and lossless:
//!
//! ```text
//! M ü + K u = f − ∫ N_z p dS                     disc: f the contact force, p the pressure on its back
//! p̈ = c² ∇²p,   ρ v̇ = −∇p                        water
//! v_z = u̇_z on the disc;  v_z = 0 (rigid baffle) or p = 0 (soft baffle) beside it;  outgoing waves far away
//! ```
//!
//! Two ways that share nothing but the disc: [`rayleigh`] integrates over the disc's face in its modes, without a mesh of the water and for
//! a rigid baffle only; [`elements`] meshes a hemisphere of water, with an absorbing boundary. Both step behind one interface, [`OnWater`]; a
//! [`chain`] of beads in front of either touches the disc through [`contact`].
//!
//! Left out: absorption, flow, cavitation (pressure below the ambient one counts as it comes), and the radiation from the disc's front.

pub(crate) mod absorption;
pub mod chain;
pub mod contact;
pub mod disc;
pub mod elements;
mod error;
pub mod field;
pub(crate) mod front;
pub(crate) mod loaded_disc;
mod quadrature;
pub mod rayleigh;
pub mod source;
mod support;
mod unit_response;

use crate::response::SolverWork;
pub use crate::scene::Water;
pub(crate) use error::WaterError;
pub(crate) use support::DiscSupport;
pub use unit_response::UnitResponse;

/// A disc on the water that is pushed at the pole of its front, on a clock of constant step Δ. Between instants the force is a straight line.
///
/// A step is [`OnWater::predict`] and then [`OnWater::push`]: with the free displacement w⁰ and the compliance s of the first, a contact finds
/// the force at the end of the step from its own law and w = w⁰ + s F.
pub trait OnWater {
    /// Step Δ of the clock, s.
    fn step(&self) -> f64;
    /// Displacement of the pole at the end of the next step for a unit force there, s, m/N.
    fn compliance(&self) -> f64;
    /// Where the pole would be at the end of the next step without a force there, w⁰, m.
    fn predict(&mut self) -> f64;
    /// Finish the step that [`OnWater::predict`] began, with the force F (N) at its end.
    fn push(&mut self, force: f64);
    /// Velocity of the disc's few lowest modes at the pole at the end of the step that [`OnWater::predict`] began, without a force there, m/s:
    /// what a dashpot sees ([`contact`]).
    fn predicted_modal_velocity(&self) -> f64;
    /// What a unit force at the end of the step adds to it, m/s/N.
    fn modal_compliance(&self) -> f64;
    /// Velocity of the middle of the disc's back, m/s, positive into the water.
    fn back_velocity(&self) -> f64;
    /// Displacement of the pole, m, positive into the water.
    fn pole_displacement(&self) -> f64;
    /// Pressure at field point `point` of those it was made with, Pa.
    fn pressure(&self, point: usize) -> f64;
    /// Energy of the disc, kinetic and elastic, J.
    fn energy(&mut self) -> f64;
    /// Work the disc has done on the water so far, J.
    fn work_on_water(&self) -> f64;
    /// Add its unknowns, and what it did so far, to the counts of a run.
    fn count(&self, work: &mut SolverWork);
}
