//! Many runs of one scene: grids of values, ensembles of small perturbations.
//!
//! A study runs and measures; it prints nothing and draws nothing.

pub mod accuracy;
mod bodies;
pub mod chain_length;
pub mod confirmation;
pub mod confirmed;
pub mod convergence;
pub mod decoder;
pub mod dissipation;
pub mod divided;
pub mod effects;
pub mod ensemble;
pub mod failure;
pub mod grid;
pub mod laboratory;
pub mod members;
pub mod observation;
pub mod paper;
pub mod portrait;
pub mod precompression;
pub mod published;
mod seen;
pub mod stress;
pub mod sweep;
pub mod trend;
pub mod twins;
pub mod water;

pub use bodies::Bodies;
pub use divided::Divided;
pub use ensemble::{EnsembleOutcome, EnsemblePlan, Moments, Spread};
pub use grid::{Axis, Grid, Value};
pub use observation::Observation;
