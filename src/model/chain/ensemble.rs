//! Many runs of one scene at a fixed step, eight side by side.

use crate::{model::ModelError, scene::Scene, signal::Series};

/// What one run of an ensemble changes in the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Variation {
    /// α, in place of the scene's own, 1.
    pub amplitude_scale: f64,
    /// c in place of the scene's own, N·s/m; 0 for none.
    pub linear_damping: f64,
    /// γ in place of the scene's own, N·s·m^(-3/2); 0 for none.
    pub kuwabara_kono_damping: f64,
    /// Added to the scene's N + 1 gaps, m; may be negative.
    pub gap_offsets: Vec<f64>,
    /// F₀ in place of the scene's own, N.
    pub precompression: f64,
    /// Factor on the support's force, over and above the scene's own, 1.
    pub support_stiffness_factor: f64,
}

impl Variation {
    /// The scene as it is.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        Self {
            amplitude_scale: scene.amplitude_scale,
            linear_damping: scene.damping.linear,
            kuwabara_kono_damping: scene.damping.kuwabara_kono,
            gap_offsets: vec![0.0; scene.chain.beads.len() + 1],
            precompression: scene.chain.precompression,
            support_stiffness_factor: 1.0,
        }
    }
}

/// A scene prepared for many runs.
#[derive(Debug, Clone)]
pub struct Ensemble {
    steps: usize,
    step: f64,
}

impl Ensemble {
    /// Steps a drive period when nothing else is asked for.
    pub const STEPS_PER_PERIOD: u32 = 160;

    /// Prepare the scene: fixed step T0/`steps_per_period`, drive sampled once for all runs.
    ///
    /// # Errors
    /// When the scene cannot be run on the chain.
    pub fn new(scene: &Scene, steps_per_period: u32) -> Result<Self, ModelError> {
        let step = 1.0 / (scene.drive.frequency * f64::from(steps_per_period));
        Ok(Self { steps: (scene.duration / step).round() as usize, step })
    }

    /// Run every variation; the velocity of the last bead's pole (m/s) at every step, or why that run failed.
    #[must_use]
    pub fn run(&self, variations: &[Variation]) -> Vec<Result<Series, ModelError>> {
        let _ = (self.steps, self.step);
        let missing = ModelError::Unsupported { model: "chain", reason: "the ensemble is not linked in yet".into() };
        variations.iter().map(|_| Err(missing.clone())).collect()
    }
}
