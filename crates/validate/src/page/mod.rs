//! Figures, tables and pages of the accuracy of models, the cost of effects and the coverage of calibrations.

pub mod accuracy;
pub mod effects;
pub mod laboratory;
