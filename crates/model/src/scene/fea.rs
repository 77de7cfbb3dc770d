//! Settings of the contact finite element analysis.

use super::word::words;

pub(crate) const DEFAULT_MESH_DENSITY: u32 = 12;
/// Radius of a polar patch over the bead's unless the scene says otherwise: three times the contact radius at 1 µm overlap of 1 mm steel beads.
pub(crate) const DEFAULT_CONTACT_PATCH: f64 = 0.1;
/// Default step of the finite element analysis, s: the paper's.
pub const DEFAULT_FEA_STEP: f64 = 1e-7;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Elements {
    /// 8-node quadrilaterals throughout.
    Quadrilaterals,
    /// 6-node triangles in the patches around the contacts, 8-node quadrilaterals elsewhere.
    Mixed,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactMass {
    /// They carry none; the rest of each touched element carries all of its mass. The contact is then quasi-static, and its force
    /// converges as the step falls.
    Massless,
    /// The consistent mass of the elements, as commercial programs have it. The error of the contact force grows as the step falls.
    Consistent,
}

/// Time integration of M ü + K u = f, implicit, unconditionally stable, second order.
///
/// In all of them, with h the step,
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
    /// Newmark (1959) with numerical damping g: γ = ½ + g, β = (½ + γ)²/4 = (1 + g)²/4; first order where g > 0.
    Newmark {
        /// g, 1, 0 to ½; 0 is the trapezoid.
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

    /// Share α of the step by which the forces lag, 1; 0 but for [`Scheme::HilberHughesTaylor`].
    pub fn lag(self) -> f64 {
        if let Self::HilberHughesTaylor { dissipation } = self { dissipation } else { 0.0 }
    }

    /// Numerical damping, 1: α, g, or 0 of the trapezoid.
    pub fn dissipation(self) -> f64 {
        match self {
            Self::Trapezoid => 0.0,
            Self::HilberHughesTaylor { dissipation } | Self::Newmark { dissipation } => dissipation,
        }
    }

    pub const fn name(self) -> &'static str {
        match self {
            Self::Trapezoid => "trapezoid",
            Self::HilberHughesTaylor { .. } => "hht",
            Self::Newmark { .. } => "newmark",
        }
    }
}

/// Settings of the contact finite element analysis; they have an effect where `model.kind = "fea"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeaSettings {
    /// Mesh density n, 1, ≥ 2: elements along a quarter of each block around a contact; element size goes as 1/n.
    pub density: u32,
    pub elements: Elements,
    /// Radius of the finely meshed patch at a bead's pole over the bead's radius, 1, above 0 and at most 0.5.
    pub contact_patch: f64,
    /// Step, s. The output step is a whole multiple of it (see [`super::Scene`]).
    pub step: f64,
    /// Whether the nodes that may touch carry mass.
    pub contact_mass: ContactMass,
    pub scheme: Scheme,
}

impl Default for FeaSettings {
    /// Density 12, quadrilaterals, the paper's step of 0.1 µs, trapezoid with massless contact nodes.
    fn default() -> Self {
        Self {
            density: DEFAULT_MESH_DENSITY,
            elements: Elements::Quadrilaterals,
            contact_patch: DEFAULT_CONTACT_PATCH,
            step: DEFAULT_FEA_STEP,
            contact_mass: ContactMass::Massless,
            scheme: Scheme::Trapezoid,
        }
    }
}

words!(Elements { Quadrilaterals = "quadrilaterals", Mixed = "mixed" });

words!(ContactMass { Massless = "massless", Consistent = "consistent" });
