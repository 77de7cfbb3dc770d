//! Why a study of many runs has no outcome.

use thiserror::Error;

use crate::portrait::{Portrait, PortraitMoments, Trait};
use granchain_model::{ModelError, scene::SceneError};
use granchain_signal::feature::FeatureError;

/// Why a study has no outcome.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A number of runs too small to speak of scatter, or no α.
    #[error("`{what}`: expected at least {least}, found {found}")]
    TooFew {
        /// Which number of the plan.
        what: &'static str,
        /// Least.
        least: usize,
        /// Found.
        found: usize,
    },
    /// A scene of the study cannot be built.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A run that everything rests on failed.
    #[error("{what}: {source}")]
    Run {
        /// Which.
        what: String,
        /// Why.
        source: ModelError,
    },
    /// Its response cannot be measured.
    #[error("{what}: {source}")]
    Feature {
        /// Which.
        what: String,
        /// Why.
        source: FeatureError,
    },
    /// Fewer than two perturbed runs were left.
    #[error("{what}: {failed} of {runs} perturbed runs failed, the first because: {first}")]
    Failed {
        /// Which.
        what: String,
        /// Runs made.
        runs: usize,
        /// Runs failed.
        failed: usize,
        /// Reason of the first.
        first: String,
    },
    /// The caller stopped it.
    #[error("stopped")]
    Stopped,
}

/// Why runs failed, one a failed run.
pub(super) fn reasons(portraits: &[Result<Portrait, String>]) -> Vec<String> {
    portraits.iter().filter_map(|portrait| portrait.as_ref().err().cloned()).collect()
}

/// The moments, where at least two members had a positive peak.
pub(super) fn enough(
    moments: PortraitMoments,
    members: &[Result<Portrait, String>],
    what: impl Fn() -> String,
) -> Result<PortraitMoments, StudyError> {
    if moments.get(Trait::PositivePeak).is_some() {
        return Ok(moments);
    }
    let failures = reasons(members);
    let first = failures.first().cloned().unwrap_or_default();
    Err(StudyError::Failed { what: what(), runs: members.len(), failed: failures.len(), first })
}
