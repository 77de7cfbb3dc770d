//! Many runs of one scene: grids of values, ensembles of small perturbations.
//!
//! A study runs and measures; it prints nothing and draws nothing.

mod bodies;
pub mod confirmation;
pub mod confirmed;
pub mod ensemble;
pub mod grid;
pub mod members;
pub mod observation;
pub mod published;
pub mod sweep;

pub use bodies::Bodies;
pub use ensemble::{EnsembleOutcome, EnsemblePlan, Moments, Spread};
pub use grid::{Axis, Grid, Value};
pub use observation::Observation;
