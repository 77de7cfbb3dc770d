//! Series, units and what is measured of a trace.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod feature_lines;
mod feature_peaks;
mod feature_trains;
mod signal_quantity;
