//! Studies: what they measure and what they write.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod accuracy;
mod report_study;
mod stress;
mod study_command;
mod study_dissipation;
mod study_ensemble;
mod study_paper;
mod study_trends;
mod study_water;
