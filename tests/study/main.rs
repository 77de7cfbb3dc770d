//! Studies: what they measure and what they write.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod accuracy;
mod regime;
mod report_study;
mod steady;
mod study_ensemble;
