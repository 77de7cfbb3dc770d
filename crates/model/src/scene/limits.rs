//! How much a run may ask for.

use super::Scene;

/// What a run may ask for at most; what is estimated above is refused before it is run. They guard against slips of a unit or a digit, so they lie
/// far above what the shipped scenes and studies take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Most work, unknowns × steps, 1: about five hours on one core.
    pub work: f64,
    /// Most memory, bytes.
    pub memory: f64,
    /// Most that a dashpot may be faster than its contact, 1, for the adaptive integrator of the chain, whose steps shrink with it.
    pub stiffness: f64,
}

impl Limits {
    pub const NONE: Self = Self { work: f64::INFINITY, memory: f64::INFINITY, stiffness: f64::INFINITY };
}

impl Default for Limits {
    /// 1e11 unknowns × steps, 8 GiB, and a dashpot 300,000 times as fast as its contact.
    fn default() -> Self {
        Self { work: 1e11, memory: 8.0 * 1024.0 * 1024.0 * 1024.0, stiffness: 3e5 }
    }
}

impl Scene {
    /// The same scene, run within other limits: [`Limits::NONE`] lifts them.
    #[must_use]
    pub fn with_limits(mut self, limits: Limits) -> Self {
        self.model.limits = limits;
        self
    }
}
