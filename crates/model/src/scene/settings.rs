//! How a run is computed.

use super::{FeaSettings, Limits, ModelKind, ReducedSettings};

/// Relative tolerance of the adaptive chain where nothing else is asked for.
pub const DEFAULT_TOLERANCE: f64 = 1e-10;
/// Default interval of the output samples, s.
pub(crate) const DEFAULT_OUTPUT_STEP: f64 = 1e-7;
/// `vibrometer.bandwidth` unless set, Hz, or four drive frequencies where that is more: of a vibrometer of this class; the lowest mode of a 1 mm steel bead rings at 2.6 MHz.
pub const DEFAULT_VIBROMETER_BANDWIDTH: f64 = 1.5e6;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Integrator {
    /// Adaptive Dormand–Prince 8(5,3) with contact events located on the dense output.
    DormandPrince853 {
        /// Relative tolerance of a step, 1.
        tolerance: f64,
    },
    /// Velocity Verlet on the clock of the disc that the last bead touches.
    OnDisc { step: f64 },
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelSettings {
    pub kind: ModelKind,
    pub integrator: Integrator,
    pub reduced: ReducedSettings,
    pub fea: FeaSettings,
    /// What a run may ask for; no scene file says so.
    pub limits: Limits,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meshing {
    pub density: u32,
    /// Radius of the finely meshed patch at a bead's pole over the bead's, 1.
    pub contact_patch: f64,
}

impl Integrator {
    pub(crate) const fn name(&self) -> &'static str {
        match self {
            Self::DormandPrince853 { .. } => "dormand-prince-853",
            Self::OnDisc { .. } => "symplectic",
        }
    }
}

impl ModelSettings {
    pub fn chain(integrator: Integrator) -> Self {
        let (reduced, fea) = (ReducedSettings::default(), FeaSettings::default());
        Self { kind: ModelKind::Chain, integrator, reduced, fea, limits: Limits::default() }
    }

    /// Fixed step of the model, s; none where the chain's integrator chooses its own.
    pub fn step(&self) -> Option<f64> {
        match (self.kind, self.integrator) {
            (ModelKind::Fea, _) => Some(self.fea.step),
            (ModelKind::Reduced, _) => Some(self.reduced.step),
            (ModelKind::Chain, Integrator::OnDisc { step }) => Some(step),
            (ModelKind::Chain, Integrator::DormandPrince853 { .. }) => None,
        }
    }

    /// How the bodies of this model are meshed; for the chain, which has none, as for the finite element analysis.
    pub fn meshing(&self) -> Meshing {
        let (density, contact_patch) = match self.kind {
            ModelKind::Reduced => (self.reduced.density, self.reduced.contact_patch),
            ModelKind::Chain | ModelKind::Fea => (self.fea.density, self.fea.contact_patch),
        };
        Meshing { density, contact_patch }
    }
}
