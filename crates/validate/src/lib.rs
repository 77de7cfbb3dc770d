//! How far models and calibrations can be trusted: coverage on synthetic records, hard cases.

pub mod convergence;
pub mod impact;
pub mod laboratory;
pub mod own_bench;
pub mod page;
pub mod stress;
pub mod synthetic;
