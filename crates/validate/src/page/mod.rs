//! Figures, tables and pages of the coverage of calibrations.

pub mod laboratory;
pub mod own_bench;
