//! Settings of the reduced model.

use super::fea::DEFAULT_CONTACT_PATCH;

/// Default mesh density of the reduced model, 1.
pub(crate) const DEFAULT_REDUCED_DENSITY: u32 = 16;
/// Default step of the reduced model, s.
pub(crate) const DEFAULT_REDUCED_STEP: f64 = 5e-8;
/// Default number of elastic modes of a body, 1.
pub const DEFAULT_MODES: u32 = 8;

/// Settings of the reduced model; they have an effect where `model.kind = "reduced"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReducedSettings {
    /// Mesh density of the bodies, 1, ≥ 2; as [`super::FeaSettings::density`].
    pub density: u32,
    /// As [`super::FeaSettings::contact_patch`], 1.
    pub contact_patch: f64,
    /// Step h, s. The output step is a whole multiple of it (see [`super::Scene`]).
    pub step: f64,
    /// Most elastic modes of a body, 1. Those with ω h > 2 are left out in any case, their flexibility never.
    pub modes: u32,
}

impl Default for ReducedSettings {
    fn default() -> Self {
        Self {
            density: DEFAULT_REDUCED_DENSITY,
            contact_patch: DEFAULT_CONTACT_PATCH,
            step: DEFAULT_REDUCED_STEP,
            modes: DEFAULT_MODES,
        }
    }
}
