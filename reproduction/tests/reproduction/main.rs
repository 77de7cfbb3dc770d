//! The studies: what they measure and what they write.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod command;
mod dissipation;
mod paper;
mod trends;
mod water;
