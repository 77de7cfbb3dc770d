//! Hertz' law corrected for the finite size of the bodies.

use serde::{Deserialize, Serialize};

use super::ElasticLaw;

/// The law F = k δ₊^(3/2) (1 + c₁ √δ₊ + c₂ δ₊) of two finite bodies, each held by its inertia alone.
///
/// - k: Hertz stiffness, N·m^(-3/2)
/// - c₁: m^(-1/2), c₂: 1/m, both ≥ 0
/// - δ: approach of the mass-mean motions of the bodies, m, less what the forces at their other contacts take of it
///
/// Hertz takes both bodies for half-spaces. A force F also strains the whole body, whose mass mean then lies nearer to its pole than in a
/// half-space by B F, the same B for all F: δ = (F/k)^(2/3) − B F, of which c₁ = ³⁄₂ B k is the first term in √δ. What remains of that, and that a
/// sphere is no paraboloid, goes into c₂. By similarity c₁ goes as 1/√a and c₂ as 1/a. k is Hertz' own; c₁ and c₂ are fitted to the bodies'
/// static finite element solutions.
///
/// ```
/// # use granchain_model::contact_law::{ElasticLaw, FiniteHertz};
/// let law = FiniteHertz { stiffness: 2.328e9, first: 24.9, second: 2.4e3 };
/// let hertz = 2.328e9 * 1e-6f64.powf(1.5);
/// assert!((law.force(1e-6) / hertz - 1.0273).abs() < 1e-12); // 2.7 % stiffer at 1 µm
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FiniteHertz {
    #[serde(rename = "stiffness_n_per_m1.5")]
    pub stiffness: f64,
    /// c₁, m^(-1/2).
    #[serde(rename = "c1_per_m0.5")]
    pub first: f64,
    /// c₂, 1/m.
    #[serde(rename = "c2_per_m")]
    pub second: f64,
}

impl ElasticLaw for FiniteHertz {
    const IS_HERTZ: bool = false;

    fn force(&self, overlap: f64) -> f64 {
        let pressed = overlap.max(0.0);
        let root = pressed.sqrt();
        self.stiffness * pressed * root * (1.0 + self.first * root + self.second * pressed)
    }

    fn tangent_stiffness(&self, overlap: f64) -> f64 {
        let pressed = overlap.max(0.0);
        let root = pressed.sqrt();
        self.stiffness * root * (1.5 + 2.0 * self.first * root + 2.5 * self.second * pressed)
    }

    fn energy(&self, overlap: f64) -> f64 {
        let pressed = overlap.max(0.0);
        let root = pressed.sqrt();
        let bracket = 0.4 + self.first * root / 3.0 + self.second * pressed * (2.0 / 7.0);
        self.stiffness * pressed * pressed * root * bracket
    }

    fn overlap(&self, force: f64) -> f64 {
        if !(force > 0.0) {
            return 0.0;
        }
        // Newton in √δ from Hertz' root, which lies above: convex and increasing, so it falls monotonically.
        let mut root = libm::cbrt(force / self.stiffness);
        for _ in 0..60 {
            let excess = root * root * root * (1.0 + root * (self.first + root * self.second)) - force / self.stiffness;
            let slope = root * root * (3.0 + root * (4.0 * self.first + 5.0 * root * self.second));
            let change = excess / slope;
            root -= change;
            if change.abs() <= 1e-15 * root {
                break;
            }
        }
        root * root
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_corrections_it_is_the_law_of_hertz() {
        let law = FiniteHertz { stiffness: 2.3e9, first: 0.0, second: 0.0 };
        let hertz = super::super::Hertz { stiffness: 2.3e9 };
        for overlap in [1e-9, 1e-6, 4e-6] {
            assert!((law.force(overlap) / hertz.force(overlap) - 1.0).abs() < 1e-15);
            assert!((law.energy(overlap) / hertz.energy(overlap) - 1.0).abs() < 1e-15);
        }
    }
}
