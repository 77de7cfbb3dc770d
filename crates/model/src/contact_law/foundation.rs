//! A bead on an elastic half-space of its own, with a thin plate on it or without: the foot of a column.
//!
//! Without plate the contact is Hertz' of bead and half-space. A thin plate spreads the force over a circle of some l₀ = (2D/E′)^(1/3), wide
//! against the contact, so that plate and half-space under it give way in proportion:
//!
//! ```text
//! δ = (F/k)^(2/3) + F/K        K = 3√3 D^(1/3) (E′/2)^(2/3)        D = E_p h³/12(1 − ν_p²)        E′ = E/(1 − ν²)
//! ```
//!
//! - k: Hertz stiffness of the bead on the plate's material, N·m^(-3/2)
//! - K: force over deflection of the plate under a point, N/m; F l₀²√3/9D is the deflection
//! - E, ν of the half-space, E_p, ν_p and h of the plate
//!
//! Timoshenko, Woinowsky-Krieger (1959), *Theory of Plates and Shells*, §61. Valid for contact radius ≪ h ≪ l₀ ≪ the plate's width, no friction between
//! plate and half-space, which never part. Left out: inertia of both and waves that run away in the half-space.
//!
//! **Loss.** To first order in τ a half-space with E (1 + τ d/dt) adds a dashpot: without plate that of Kuwabara and Kono with γ = (3/2) k τ E*/E′ (k ∝ E*,
//! and E*/E′ is the half-space's share of the compliance), beneath a plate a linear one with c = (2/3) K τ (K ∝ E^(2/3)), which takes the contact on
//! the plate for stiff against K.

use serde::{Deserialize, Serialize};

use super::{Dashpot, ElasticLaw, FiniteHertz, Hertz, Law, effective_modulus, hertz_stiffness};
use crate::scene::{Bead, DampingTerm, Material, Support};

/// The contact of a bead, by Hertz or of a finite body, in series with a linear spring: δ = δ_contact(F) + F/K.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct HertzOnSpring {
    #[serde(flatten)]
    pub contact: FiniteHertz,
    /// K, N/m.
    #[serde(rename = "spring_n_per_m")]
    pub spring: f64,
}

impl HertzOnSpring {
    /// The overlap of the contact (m) where both together have `overlap` (m): x² with x² + (k/K) x³ (1 + c₁ x + c₂ x²) = δ.
    fn of_contact(&self, overlap: f64) -> f64 {
        let FiniteHertz { stiffness, first, second } = self.contact;
        let ratio = stiffness / self.spring;
        // Newton from above both limits, √δ and (δ K/k)^(1/3): convex and increasing, so it falls monotonically.
        let mut root = overlap.sqrt().min(libm::cbrt(overlap / ratio));
        for _ in 0..60 {
            let beside = root * root * (1.0 + ratio * root * (1.0 + root * (first + root * second))) - overlap;
            let change = beside / (root * (2.0 + ratio * root * (3.0 + root * (4.0 * first + root * 5.0 * second))));
            root -= change;
            if change.abs() <= 1e-15 * root {
                break;
            }
        }
        root * root
    }
}

impl ElasticLaw for HertzOnSpring {
    const IS_HERTZ: bool = false;

    fn force(&self, overlap: f64) -> f64 {
        if overlap > 0.0 { self.contact.force(self.of_contact(overlap)) } else { 0.0 }
    }

    fn tangent_stiffness(&self, overlap: f64) -> f64 {
        if !(overlap > 0.0) {
            return 0.0;
        }
        let contact = self.contact.tangent_stiffness(self.of_contact(overlap));
        contact * self.spring / (contact + self.spring)
    }

    fn energy(&self, overlap: f64) -> f64 {
        if !(overlap > 0.0) {
            return 0.0;
        }
        let of_contact = self.of_contact(overlap);
        self.contact.energy(of_contact) + 0.5 * self.contact.force(of_contact).powi(2) / self.spring
    }

    fn overlap(&self, force: f64) -> f64 {
        self.contact.overlap(force) + force.max(0.0) / self.spring
    }
}

/// Bending stiffness of a plate on a half-space under a point force, K = 3√3 D^(1/3) (E′/2)^(2/3), N/m.
///
/// - `bending_stiffness`: D, N·m
/// - `plane_modulus`: E′ of the half-space, Pa
///
/// ```
/// # use granchain_model::contact_law::plate_on_half_space;
/// assert!((plate_on_half_space(1.0, 2.0) - 5.196152422706632).abs() < 1e-12);
/// ```
pub fn plate_on_half_space(bending_stiffness: f64, plane_modulus: f64) -> f64 {
    27f64.sqrt() * libm::cbrt(bending_stiffness) * libm::cbrt(0.25 * plane_modulus * plane_modulus)
}

/// Law and dashpot of the contact of `bead` with a [`Support::Foundation`]; none of any other support.
pub(crate) fn foundation(bead: &Bead, support: &Support) -> Option<(Law, Dashpot)> {
    let Support::Foundation { youngs_modulus, poissons_ratio, loss_time, plate } = support else { return None };
    let plane_modulus = youngs_modulus / (1.0 - poissons_ratio * poissons_ratio);
    let hertz = |other: &Material| {
        let modulus = effective_modulus(&bead.material, Some(other));
        (modulus, hertz_stiffness(modulus, bead.radius))
    };
    let (law, damping) = match plate {
        None => {
            let half_space = Material {
                name: String::new(),
                youngs_modulus: *youngs_modulus,
                poissons_ratio: *poissons_ratio,
                density: 0.0,
            };
            let (modulus, stiffness) = hertz(&half_space);
            let share = modulus / plane_modulus;
            (Law::Hertz(Hertz { stiffness }), (DampingTerm::KuwabaraKono, 1.5 * stiffness * loss_time * share))
        }
        Some(plate) => {
            let of = &plate.material;
            let bending = of.youngs_modulus * plate.thickness.powi(3) / (12.0 * (1.0 - of.poissons_ratio.powi(2)));
            let spring = plate_on_half_space(bending, plane_modulus);
            let contact = FiniteHertz { stiffness: hertz(of).1, first: 0.0, second: 0.0 };
            let law = HertzOnSpring { contact, spring };
            (Law::HertzOnSpring(law), (DampingTerm::Linear, 2.0 / 3.0 * spring * loss_time))
        }
    };
    Some((law, Dashpot { coefficients: [damping].into() }))
}
