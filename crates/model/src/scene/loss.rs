//! Losses within the bodies: of their elastic modes, of a viscoelastic annulus, of contacts that yield.

/// Frequency at which loss factors are given, Hz.
pub(crate) const LOSS_FREQUENCY: f64 = 1e6;

/// Losses of the material of the bodies. All 0: elastic.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MaterialLoss {
    /// Loss factor η of the beads at `LOSS_FREQUENCY`, 1, growing with frequency (Kelvin–Voigt): in the meshed models.
    pub beads: f64,
    pub support: f64,
    /// Relaxation of the support's material, a standard linear solid: E(t) = E (1 + g e^(−t/τ)).
    pub relaxation: Option<Relaxation>,
}

/// A standard linear solid: the modulus E of slow processes and E (1 + g) of fast ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxation {
    /// g, 1.
    pub strength: f64,
    /// τ, s.
    pub time: f64,
}

impl MaterialLoss {
    /// Retardation β (s) and relaxation of the material of the support, or of a bead.
    pub(crate) fn of_body(&self, is_support: bool) -> (f64, Option<Relaxation>) {
        if is_support {
            (Self::retardation(self.support), self.relaxation)
        } else {
            (Self::retardation(self.beads), None)
        }
    }

    /// Time β of E (1 + β d/dt) that has the loss factor `factor` at [`LOSS_FREQUENCY`], s.
    fn retardation(factor: f64) -> f64 {
        factor / (2.0 * std::f64::consts::PI * LOSS_FREQUENCY)
    }
}
