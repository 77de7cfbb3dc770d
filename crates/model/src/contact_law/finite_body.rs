//! How much stiffer a whole bead is than Hertz' half-space.

/// Excess of the force between steel spheres over Hertz' at the same overlap, F/F_H − 1 = c₁ √(δ/1 µm) + c₂ δ/1 µm.
///
/// The overlap δ is that of the mass-mean motions. Hertz takes each body for a half-space far from the contact; a sphere is finite, and
/// what it does far from the contact depends on how it is held. Fitted to mesh-converged static finite-element solutions of spheres of
/// radius 0.5 mm; by similarity δ counts in parts of the radius, so that δ · 0.5 mm/a stands for δ.
///
/// Valid for ν = 0.3 and δ ≤ 3 µm at that radius; 0.14 % of F from such a solution at 1 µm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FiniteBody {
    /// Between beads that are each squeezed at both poles, as in a static chain: c₁ = 0.0126, c₂ = 0.0023.
    BeadsSqueezed,
    /// Between two beads in a collision, each held by its inertia alone: c₁ = 0.0249, c₂ = 0.0024.
    BeadsColliding,
    /// Between a bead held by its inertia alone and a rigid flat: c₁ = 0.0359, c₂ = 0.0042.
    FlatColliding,
}

/// Radius of the fitted spheres, m.
const FITTED_RADIUS: f64 = 0.5e-3;

impl FiniteBody {
    /// F/F_H − 1 at the overlap δ (m) of spheres of `radius` (m), 1; 0 where open.
    ///
    /// ```
    /// # use granchain_model::contact_law::FiniteBody;
    /// assert!((FiniteBody::BeadsColliding.excess(1e-6, 0.5e-3) - 0.0273).abs() < 1e-12);
    /// ```
    pub fn excess(self, overlap: f64, radius: f64) -> f64 {
        let (first, second) = match self {
            Self::BeadsSqueezed => (0.0126, 0.0023),
            Self::BeadsColliding => (0.0249, 0.0024),
            Self::FlatColliding => (0.0359, 0.0042),
        };
        let micrometres = overlap.max(0.0) * 1e6 * FITTED_RADIUS / radius;
        first * micrometres.sqrt() + second * micrometres
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_excess_is_the_same_for_similar_bodies_and_nothing_where_open() {
        let small = FiniteBody::FlatColliding.excess(1e-6, 0.5e-3);
        let large = FiniteBody::FlatColliding.excess(4e-6, 2e-3);
        // The published sum; rounding of the similarity.
        assert!((small - 0.0401).abs() < 1e-15 && (large - small).abs() < 1e-15);
        assert_eq!(FiniteBody::FlatColliding.excess(-1e-6, 0.5e-3), 0.0);
    }
}
