//! Studies: what they measure and what they write.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod accuracy;
mod effects_costs;
mod report_study;
mod study_ensemble;
