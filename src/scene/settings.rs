//! How a run is computed.

/// Rung of the fidelity ladder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// One unknown a bead.
    Chain,
    /// Modes and quasi-static contact nodes.
    Reduced,
    /// All nodes.
    Fea,
}

/// Time integrator of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Integrator {
    /// Adaptive Dormand–Prince 8(5,3) with contact events located on the dense output.
    DormandPrince853 {
        /// Relative tolerance of a step, 1.
        tolerance: f64,
    },
    /// Fixed-step symplectic stepper, for searches.
    Symplectic {
        /// Step, s.
        step: f64,
    },
}

/// How a run is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelSettings {
    /// Which model.
    pub kind: ModelKind,
    /// Which integrator.
    pub integrator: Integrator,
}
