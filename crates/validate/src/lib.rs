//! How far models and calibrations can be trusted: coverage on synthetic records, accuracy against time, cost of effects, hard cases.

pub mod accuracy;
pub mod effects;
pub mod laboratory;
pub mod page;
