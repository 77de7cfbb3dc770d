//! Files of laboratories: read, refused with their place, made into a drive.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod horn_drive;
mod horn_drive_chain;
mod reader_dialects;
mod reader_errors;
mod reader_forms;
mod reader_hydrophone;
mod reader_shipped;
mod universal_files;
