//! The report of a calibration: what a researcher sends to a colleague.
//!
//! [`CalibrationReport`] is plain data in SI, filled by whoever made the calibration and stored beside it (`report.json`), so
//! that a finished calibration can be rendered again without running anything.

mod input;

pub use input::{
    AlphaSweep, CalibrationReport, DensityMap, Estimate, FeatureRow, InputFile, LawReport, Lobe, Provenance, RunPoint,
    Verdict,
};
