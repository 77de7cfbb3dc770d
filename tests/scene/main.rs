//! Scenes: read, refused, written again.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod scene_fea;
mod scene_files;
mod scene_round_trip;
mod scene_water;
