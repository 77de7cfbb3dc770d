//! How far models and calibrations can be trusted: coverage on synthetic records, hard cases.

pub mod laboratory;
pub mod page;
