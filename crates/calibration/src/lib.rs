//! Calibration: parameters, simulated runs, search, likelihood, posterior, prediction, diagnosis and outcome.
//!
//! ```text
//! Plan, Bench, Record ─► Problem ─ fit ─► Fitted ─ predict ─► Predictions ─ outcome ─► CalibrationOutcome
//! ```

pub mod agreement;
mod averages;
pub mod bench;
pub mod candidate;
pub mod comparison;
pub mod correction;
pub mod design;
pub mod diagnosis;
mod discrepancy;
pub mod drive;
pub mod engine;
mod estimate;
pub mod fidelity;
pub mod fingerprints;
pub mod fit;
mod fitted;
pub mod forward;
pub mod frame;
pub mod impact;
pub mod ladder;
pub mod likelihood;
pub mod measured;
pub mod multi_record;
mod nuisance;
pub mod observation;
pub mod outcome;
pub mod parameter;
pub mod plan;
pub mod posterior;
pub mod predict;
pub mod printed;
pub mod problem;
pub mod recorded_run;
pub mod refusal;
pub(crate) mod residue;
mod run_store;
pub mod search;
pub mod statement;
pub mod synthetic;
pub mod uncertainty;
pub mod waveform;

pub use fitted::{Fitted, FittedCandidate, Schedule};
pub use plan::Plan;
pub use problem::Problem;
