//! granchain replays laboratory experiments on driven granular chains and calibrates models against them.

pub mod calibration;
pub mod cli;
pub mod feature;
pub mod measurement;
pub mod model;
pub mod report;
pub mod response;
pub mod scene;
pub mod signal;
pub mod study;
