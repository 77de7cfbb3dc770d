//! Prediction: the answer run accurately, posterior predictive runs, and their comparison with the record. Also many
//! runs of one scene, over a grid of values or under small perturbations.

mod bodies;
pub mod ensemble;
pub mod grid;
pub mod observation;
pub mod predicted;
pub mod prediction;
pub mod regime;
pub mod replicates;
pub mod steady;
pub mod sweep;

pub use bodies::Bodies;
pub use ensemble::{EnsembleOutcome, EnsemblePlan, Moments, Spread};
pub use grid::{Axis, Grid, Value};
pub use observation::Observation;
