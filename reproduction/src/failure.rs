//! Why a study of many runs has no outcome.

use thiserror::Error;

use crate::portrait::{Portrait, PortraitMoments, Trait};
use granchain_model::{ModelError, scene::SceneError};
use granchain_signal::feature::FeatureError;

/// Why a study has no outcome.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StudyError {
    #[error("`{what}`: expected at least {least}, found {found}")]
    TooFew { what: &'static str, least: usize, found: usize },
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("{what}: {source}")]
    Run { what: String, source: ModelError },
    #[error("{what}: {source}")]
    Feature { what: String, source: FeatureError },
    #[error("{what}: {failed} of {runs} perturbed runs failed, the first because: {first}")]
    Failed { what: String, runs: usize, failed: usize, first: String },
    #[error("stopped")]
    Stopped,
}

/// Why runs failed, one a failed run.
pub(super) fn reasons(portraits: &[Result<Portrait, String>]) -> Vec<String> {
    portraits.iter().filter_map(|portrait| portrait.as_ref().err().cloned()).collect()
}

/// The moments, where at least two replicates had a positive peak.
pub(super) fn enough(
    moments: PortraitMoments,
    replicates: &[Result<Portrait, String>],
    what: impl Fn() -> String,
) -> Result<PortraitMoments, StudyError> {
    if moments.get(Trait::PositivePeak).is_some() {
        return Ok(moments);
    }
    let failures = reasons(replicates);
    let first = failures.first().cloned().unwrap_or_default();
    Err(StudyError::Failed { what: what(), runs: replicates.len(), failed: failures.len(), first })
}
