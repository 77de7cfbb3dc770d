//! Settings of the contact finite element analysis.

pub(crate) const DEFAULT_MESH_DENSITY: u32 = 12;
/// Radius of a polar patch over the bead's unless the scene says otherwise: three times the contact radius at 1 µm overlap of 1 mm steel beads.
pub(crate) const DEFAULT_CONTACT_PATCH: f64 = 0.1;
/// Default step of the finite element analysis, s: the paper's.
pub const DEFAULT_FEA_STEP: f64 = 1e-7;

/// Time integration of M ü + K u = f, implicit, unconditionally stable, second order.
///
/// In both, with h the step,
///
/// ```text
/// u₁ = u₀ + h v₀ + h² ((½ − β) a₀ + β a₁),    v₁ = v₀ + h ((1 − γ) a₀ + γ a₁)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scheme {
    /// Trapezoid: γ = ½, β = ¼. No numerical damping.
    Trapezoid,
    /// Hilber, Hughes and Taylor (1977): γ = ½ + α, β = (1 + α)²/4, elastic and external forces at the time t₁ − α h.
    HilberHughesTaylor {
        /// α, 1, 0 to 1/3; 0 is the trapezoid. Often written as −α.
        dissipation: f64,
    },
}

impl Scheme {
    pub fn beta(self) -> f64 {
        0.25 * (1.0 + self.dissipation()).powi(2)
    }

    pub fn gamma(self) -> f64 {
        0.5 + self.dissipation()
    }

    /// α, 1: numerical damping, and the share of the step by which the forces lag; 0 of the trapezoid.
    pub fn dissipation(self) -> f64 {
        match self {
            Self::Trapezoid => 0.0,
            Self::HilberHughesTaylor { dissipation } => dissipation,
        }
    }

    pub const fn name(self) -> &'static str {
        match self {
            Self::Trapezoid => "trapezoid",
            Self::HilberHughesTaylor { .. } => "hht",
        }
    }
}

/// Settings of the contact finite element analysis; they have an effect where `model.kind = "fea"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeaSettings {
    /// Mesh density n, 1, ≥ 2: elements along a quarter of each block around a contact; element size goes as 1/n.
    pub density: u32,
    /// Radius of the finely meshed patch at a bead's pole over the bead's radius, 1, above 0 and at most 0.5.
    pub contact_patch: f64,
    /// Step, s. The output step is a whole multiple of it (see [`super::Scene`]).
    pub step: f64,
    pub scheme: Scheme,
}

impl Default for FeaSettings {
    /// Density 12, the paper's step of 0.1 µs, trapezoid.
    fn default() -> Self {
        Self {
            density: DEFAULT_MESH_DENSITY,
            contact_patch: DEFAULT_CONTACT_PATCH,
            step: DEFAULT_FEA_STEP,
            scheme: Scheme::Trapezoid,
        }
    }
}
