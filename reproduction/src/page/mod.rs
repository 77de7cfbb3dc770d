//! Figures, tables and pages of the studies.

pub mod chain_length;
pub mod dissipation;
pub mod paper;
pub mod precompression;
mod trend;
pub mod water;
