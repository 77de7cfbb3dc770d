//! Physics: from a scene to a response, or to a typed failure.

pub mod analytical;
pub mod chain;
pub mod contact_law;

use thiserror::Error;

use crate::{response::Response, scene::Scene};

/// Called by a model now and then with the simulated time (s); returning `false` stops the run.
pub type Progress<'a> = &'a mut dyn FnMut(f64) -> bool;

/// A model turns a scene into a response.
pub trait Model {
    /// Run the scene from rest (or precompressed equilibrium) to its duration.
    ///
    /// # Errors
    /// A typed [`ModelError`] when the scene cannot be run or the run failed; never NaN in a response.
    fn run(&self, scene: &Scene, progress: Progress<'_>) -> Result<Response, ModelError>;
}

/// Why a run failed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// The model cannot run this scene.
    #[error("model `{model}`: {reason}")]
    Unsupported {
        /// Which model.
        model: &'static str,
        /// What it cannot do, and what to do instead.
        reason: String,
    },
    /// The run was stopped by its caller.
    #[error("stopped at {time:.6e} s")]
    Stopped {
        /// Simulated time reached, s.
        time: f64,
    },
}
