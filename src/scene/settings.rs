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
    /// Fixed-step symplectic stepper (velocity Verlet), for searches. Error of the last bead's velocity over its peak, undamped, first 70 µs of
    /// the rigid scene: 6e-3 at 0.05 µs, 2e-4 at 0.01 µs; with linear dashpots 1.5e-2 and 6e-3.
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
