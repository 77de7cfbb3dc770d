//! Prediction: the answer run accurately, posterior predictive runs, and their comparison with the record. Also many
//! runs of one scene, over a grid of values or under small perturbations.

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
