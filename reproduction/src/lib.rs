//! The source paper's experiment and studies, reproduced: its printed numbers beside those of the models.

pub mod chain_length;
pub mod command;
pub mod decoder;
pub mod dissipation;
pub mod divided;
pub mod failure;
pub mod instrument;
pub mod page;
pub mod paper;
pub mod portrait;
pub mod precompression;
pub mod published;
pub mod trend;
pub mod water;
