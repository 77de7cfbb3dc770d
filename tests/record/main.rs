//! Records on their way into a drive and a calibration.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod horn_drive_chain;
mod reader_hydrophone;
mod reader_shipped;
