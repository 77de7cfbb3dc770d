//! Many runs of one scene: grids of values, ensembles of small perturbations.
//!
//! A study runs and measures; it prints nothing and draws nothing.

mod bodies;
pub mod confirmation;
pub mod convergence;
pub mod ensemble;
pub mod grid;
pub mod observation;
pub mod published;
pub mod run_log;
pub mod sweep;
pub mod twins;

pub use bodies::Bodies;
pub use ensemble::{EnsembleOutcome, EnsemblePlan, Spread};
pub use grid::{Axis, Grid, Value};
pub use observation::Observation;
