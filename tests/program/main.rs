//! The program as somebody uses it: commands, folders of results, reports.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

#[path = "../calibration/calibrate_bench/mod.rs"]
mod calibrate_bench;
mod cli_contract;
mod cli_interrupt;
mod convert_command;
mod documents;
mod fea_replay;
mod figures;
#[path = "../harness/mod.rs"]
mod harness;
mod hostile_files;
mod inspect_command;
mod mesh_command;
mod messages;
mod output_safety;
mod pages;
mod parts;
mod reduced_replay;
mod report_calibration;

mod scene_command;
mod slips;
mod spectrum_command;
mod start_command;
mod suggestions;
mod terminal;
mod verify_command;
mod water_command;
