//! Studies: what they measure and what they write.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod accuracy;
mod report_study;
mod stress;
mod study_ensemble;
