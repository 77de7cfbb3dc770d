//! Files of laboratories: read, refused with their place, made into a drive.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod horn_drive;
mod instrument_files;
mod instruments;
mod laboratory_cases;
mod laboratory_columns;
mod laboratory_files;
mod laboratory_kinds;
mod read_back;
mod reader_dialects;
mod reader_errors;
mod reader_forms;
mod universal_files;
