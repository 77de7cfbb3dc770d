//! Errors as exceptions: one class a stage, the message with place and remedy, the remedy in keywords.

use granchain::{
    calibration::{bench::BenchError, refusal::Refusal},
    cli::{self, arguments::UsageError as OfUsage},
    feature::FeatureError as OfFeature,
    measurement::{BenchReadingsError, MeasurementError},
    model::ModelError,
    scene::SceneError as OfScene,
    study::{grid::GridError, sweep::SweepError},
};
use pyo3::{create_exception, exceptions::PyException, prelude::*};

use crate::keyword::in_keywords;

create_exception!(granchain, GranchainError, PyException, "What granchain refuses, or could not do.");
create_exception!(granchain, UsageError, GranchainError, "Keywords that contradict each other, or say nothing.");
create_exception!(granchain, RecordError, GranchainError, "A record that cannot be read.");
create_exception!(granchain, SceneError, GranchainError, "A scene that cannot be.");
create_exception!(granchain, SimulationError, GranchainError, "A run that failed.");
create_exception!(granchain, FeatureError, GranchainError, "A trace on which there is nothing to measure.");
create_exception!(granchain, CalibrationError, GranchainError, "A calibration that cannot be made.");

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("GranchainError", py.get_type::<GranchainError>())?;
    module.add("UsageError", py.get_type::<UsageError>())?;
    module.add("RecordError", py.get_type::<RecordError>())?;
    module.add("SceneError", py.get_type::<SceneError>())?;
    module.add("SimulationError", py.get_type::<SimulationError>())?;
    module.add("FeatureError", py.get_type::<FeatureError>())?;
    module.add("CalibrationError", py.get_type::<CalibrationError>())
}

type Class = fn(String) -> PyErr;

/// The stage at which something went wrong.
fn class(error: &(dyn std::error::Error + 'static)) -> Option<Class> {
    if error.is::<MeasurementError>() || error.is::<BenchReadingsError>() {
        return Some(RecordError::new_err);
    }
    if error.is::<OfScene>() || error.is::<cli::calibrate::SceneOfPlan>() {
        return Some(SceneError::new_err);
    }
    if error.is::<ModelError>() {
        return Some(SimulationError::new_err);
    }
    if error.is::<OfFeature>() {
        return Some(FeatureError::new_err);
    }
    if error.is::<OfUsage>() || error.is::<GridError>() {
        return Some(UsageError::new_err);
    }
    if error.is::<SweepError>() {
        return Some(SimulationError::new_err);
    }
    match error.downcast_ref::<Refusal>() {
        Some(Refusal::Measurement(_) | Refusal::Bench(BenchError::Drive(_))) => Some(RecordError::new_err),
        Some(Refusal::Bench(BenchError::Scene(_))) => Some(SceneError::new_err),
        Some(Refusal::Model(_)) => Some(SimulationError::new_err),
        Some(_) => Some(CalibrationError::new_err),
        None if error.is::<cli::reading::DriveUnread>() => Some(RecordError::new_err),
        None => match error.downcast_ref::<BenchError>() {
            Some(BenchError::Drive(_)) => Some(RecordError::new_err),
            Some(_) => Some(SceneError::new_err),
            None => None,
        },
    }
}

/// As an exception of the class of the outermost error that has one.
pub fn raised(error: impl Into<anyhow::Error>) -> PyErr {
    let error = error.into();
    let mut message = cli::with_causes(&error);
    if let Some(end) = message.find("\n\nFor more information, try '--help'.") {
        message.truncate(end);
    }
    if let Some(remedy) = error.chain().find_map(cli::remedy) {
        message.push_str(&format!("\n  so pass, with values of this bench: {remedy}"));
    }
    error.chain().find_map(class).unwrap_or(GranchainError::new_err)(in_keywords(&message))
}

/// Keywords that the parser of flags refuses.
pub fn refused(error: &clap::Error) -> PyErr {
    let text = error.to_string();
    let about = text.split("\n\nUsage:").next().unwrap_or(&text);
    let about = about.split("\n\nFor more information").next().unwrap_or(about);
    UsageError::new_err(in_keywords(about.trim_start_matches("error: ").trim()))
}
