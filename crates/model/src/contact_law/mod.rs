//! What a contact answers when pressed: elastic law F(δ) and dashpot, shared by all models.
//!
//! With the overlap δ (m, positive when pressed) and its rate δ̇ (m/s) the force of a contact is
//!
//! F = F_el(δ) + (c + γ √δ) δ̇ for δ > 0, and 0 once separated,
//!
//! never negative unless the dashpot may pull (`damping.tension`). A contact that yields changes its elastic law as it does ([`Yielding`]).
//! Friction between beads, adhesion and the retardation of waves inside the bodies are left out.

mod annulus;
mod dashpot;
mod finite_body;
mod finite_hertz;
pub mod foundation;
mod hertz;
mod yielding;

use serde::{Deserialize, Serialize};

pub use annulus::Annulus;
pub(crate) use dashpot::{ALL_TERMS, Terms, for_terms, terms_of};
pub use dashpot::{Dashpot, dashpots};
pub use finite_body::FiniteBody;
pub use finite_hertz::FiniteHertz;
pub(crate) use foundation::foundation;
pub use foundation::{HertzOnSpring, plate_on_half_space};
pub(crate) use hertz::touching;
pub use hertz::{Hertz, bead_face_stiffness, bead_flat_stiffness, bead_pair_stiffness, hertz_force, hertz_stiffness};
pub(crate) use hertz::{effective_modulus, hertz_energy};
pub use yielding::{Yielding, yield_force};

pub trait ElasticLaw: Copy {
    /// Whether the law is F = k δ₊^(3/2), so that a chain may treat it like every other contact.
    const IS_HERTZ: bool;
    /// Whether the contacts of the chain are those of finite bodies, which feel one another.
    const IS_COUPLED: bool = false;
    /// Whether the chain has effects beside contacts and dashpots: a compliant horn, a bead guide, contacts that yield or relax.
    const HAS_EFFECTS: bool = false;
    /// Force, N, ≥ 0; zero for `overlap` ≤ 0 (m).
    fn force(&self, overlap: f64) -> f64;
    /// dF/dδ, N/m; zero for `overlap` ≤ 0 (m).
    fn tangent_stiffness(&self, overlap: f64) -> f64;
    /// ∫F dδ from 0 to `overlap` (m), J.
    fn energy(&self, overlap: f64) -> f64;
    /// The overlap (m) that carries `force` (N); zero for `force` ≤ 0.
    fn overlap(&self, force: f64) -> f64;
}

/// A massless one-sided linear spring, F = K δ₊.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spring {
    #[serde(rename = "stiffness_n_per_m")]
    pub stiffness: f64,
}

impl ElasticLaw for Spring {
    const IS_HERTZ: bool = false;

    fn force(&self, overlap: f64) -> f64 {
        self.stiffness * overlap.max(0.0)
    }

    fn tangent_stiffness(&self, overlap: f64) -> f64 {
        if overlap > 0.0 { self.stiffness } else { 0.0 }
    }

    fn energy(&self, overlap: f64) -> f64 {
        0.5 * self.stiffness * overlap.max(0.0).powi(2)
    }

    fn overlap(&self, force: f64) -> f64 {
        force.max(0.0) / self.stiffness
    }
}

/// Any of the laws, where which one is only known at run time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// Two curved solids, or a sphere and a flat.
    Hertz(Hertz),
    FiniteHertz(FiniteHertz),
    /// The resin annulus under the last bead.
    Annulus(Annulus),
    Spring(Spring),
    /// The last bead on a plate on a half-space.
    HertzOnSpring(HertzOnSpring),
}

impl ElasticLaw for Law {
    const IS_HERTZ: bool = false;

    fn force(&self, overlap: f64) -> f64 {
        match self {
            Self::Hertz(law) => law.force(overlap),
            Self::FiniteHertz(law) => law.force(overlap),
            Self::Annulus(law) => law.force(overlap),
            Self::Spring(law) => law.force(overlap),
            Self::HertzOnSpring(law) => law.force(overlap),
        }
    }

    fn tangent_stiffness(&self, overlap: f64) -> f64 {
        match self {
            Self::Hertz(law) => law.tangent_stiffness(overlap),
            Self::FiniteHertz(law) => law.tangent_stiffness(overlap),
            Self::Annulus(law) => law.tangent_stiffness(overlap),
            Self::Spring(law) => law.tangent_stiffness(overlap),
            Self::HertzOnSpring(law) => law.tangent_stiffness(overlap),
        }
    }

    fn energy(&self, overlap: f64) -> f64 {
        match self {
            Self::Hertz(law) => law.energy(overlap),
            Self::FiniteHertz(law) => law.energy(overlap),
            Self::Annulus(law) => law.energy(overlap),
            Self::Spring(law) => law.energy(overlap),
            Self::HertzOnSpring(law) => law.energy(overlap),
        }
    }

    fn overlap(&self, force: f64) -> f64 {
        match self {
            Self::Hertz(law) => law.overlap(force),
            Self::FiniteHertz(law) => law.overlap(force),
            Self::Annulus(law) => law.overlap(force),
            Self::Spring(law) => law.overlap(force),
            Self::HertzOnSpring(law) => law.overlap(force),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫F dδ by Simpson's rule in √δ, in which all laws are smooth enough.
    fn integral(law: &impl ElasticLaw, overlap: f64) -> f64 {
        let panels = 2000;
        let width = overlap.sqrt() / f64::from(panels);
        (0..=panels)
            .map(|i| {
                let root = f64::from(i) * width;
                let weight = if i == 0 || i == panels { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
                weight * law.force(root * root) * 2.0 * root
            })
            .sum::<f64>()
            * width
            / 3.0
    }

    #[test]
    fn stored_energy_is_the_integral_of_the_force_and_the_tangent_its_slope() {
        let laws = [
            Law::Hertz(Hertz { stiffness: 2.3e9 }),
            Law::FiniteHertz(FiniteHertz { stiffness: 2.3e9, first: 24.9, second: 2.4e3 }),
            Law::Annulus(Annulus::new(1.0)),
            Law::Annulus(Annulus::new(0.7)),
            Law::Annulus(Annulus::fitted(1.3e-6, 0.2e-6).times(1.2)),
            Law::Spring(Spring { stiffness: 1e6 }),
            Law::HertzOnSpring(HertzOnSpring {
                contact: FiniteHertz { stiffness: 2.3e9, first: 0.0, second: 0.0 },
                spring: 1e6,
            }),
            Law::HertzOnSpring(HertzOnSpring {
                contact: FiniteHertz { stiffness: 3.3e9, first: 25.0, second: 2.4e3 },
                spring: 1e7,
            }),
        ];
        for law in laws {
            for overlap in [1e-8, 1e-6, 5e-6, 3e-5] {
                // Simpson with 2000 panels: the annulus' logarithm at 0 is what is left, below 1e-7.
                let energy = law.energy(overlap);
                assert!((integral(&law, overlap) / energy - 1.0).abs() < 1e-6, "{law:?} {overlap}");
                let h = 1e-4 * overlap;
                let slope = (law.force(overlap + h) - law.force(overlap - h)) / (2.0 * h);
                // Central difference: error of order (h/δ)² = 1e-8.
                assert!((law.tangent_stiffness(overlap) / slope - 1.0).abs() < 1e-6, "{law:?} {overlap}");
                // Inverse of the force, to rounding.
                assert!((law.overlap(law.force(overlap)) / overlap - 1.0).abs() < 1e-13, "{law:?} {overlap}");
            }
            assert_eq!(law.force(-1e-9), 0.0);
            assert_eq!(law.energy(-1e-9), 0.0);
            assert_eq!(law.tangent_stiffness(-1e-9), 0.0);
            assert_eq!(law.overlap(0.0), 0.0);
        }
    }
}
