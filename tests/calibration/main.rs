//! Fits, from a record on the disk to the verdict.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod calibrate_bench;
mod calibrate_channels;
mod calibrate_contract;
mod calibrate_interrupt;
mod calibrate_joint;
mod calibrate_ladder;
mod calibrate_parameters;
mod calibrate_pressure;
mod calibrate_refusal;
mod calibrate_replay;
mod causes;
#[path = "../harness/mod.rs"]
mod harness;
mod invariance;
mod laboratory;
mod ladder;
mod own_bench;
#[path = "../harness/record.rs"]
mod record;
mod synthetic;
