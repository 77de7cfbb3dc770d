//! The ring that holds the last bead, and of which rings the chain has a law without pressing them.

use super::{Bead, ContactLaw, Material, Scene};

/// A ring: a half disc revolved about the axis, its flat side outwards and clamped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnnulusShape {
    /// Radius R of the circle of the half discs' centres and of the clamped side, m.
    pub ring_radius: f64,
    /// Radius b < R of the half disc, m.
    pub section_radius: f64,
}

/// How much too large a force on the ring is at a mesh density of 12, over the bead's share of the compliance where both touch: away from its
/// poles a bead is meshed coarsely. Found at 1 µm for steel, aluminium and acrylic rings and beads against a density of 96: 0.34 to 0.38.
const COARSE_BEAD: f64 = 0.36;
/// Excess of the force that is worth a word, 1.
const WORTH_A_WORD: f64 = 0.02;
/// Radius of the bead of the law of the paper's ring, m, and by how much another may differ, 1.
const LAW_BEAD: (f64, f64) = (0.5e-3, 0.02);
/// By how much the plane-strain compliance of bead and ring together may differ from that of chrome steel and resin, 1.
const LAW_COMPLIANCE: f64 = 0.02;

impl AnnulusShape {
    /// The annulus of the source paper: R 0.55 mm, b 0.25 mm.
    pub const fn published() -> Self {
        Self { ring_radius: 0.55e-3, section_radius: 0.25e-3 }
    }

    /// Radius of the opening, R − b, m.
    pub fn opening(&self) -> f64 {
        self.ring_radius - self.section_radius
    }

    /// Angle φ of the contact normal of a bead of radius a (m) from the axis, rad: sin φ = R/(a + b).
    ///
    /// ```
    /// use granchain_model::scene::AnnulusShape;
    ///
    /// assert!((AnnulusShape::published().contact_angle(0.5e-3).to_degrees() - 47.17).abs() < 0.01);
    /// ```
    pub fn contact_angle(&self, bead_radius: f64) -> f64 {
        (self.ring_radius / (bead_radius + self.section_radius)).asin()
    }
}

/// (1 − ν²)/E, 1/Pa: what a body gives way where it is touched along a line.
fn compliance(material: &Material) -> f64 {
    (1.0 - material.poissons_ratio.powi(2)) / material.youngs_modulus
}

impl Scene {
    /// What a reader of the results must know where the last bead is not much harder than its ring: that its mesh is too coarse there.
    pub fn coarse_ring(&self) -> Option<String> {
        let ((_, _, material), bead) = (self.support.ring()?, self.chain.beads.last()?);
        let share = compliance(&bead.material) / (compliance(&bead.material) + compliance(material));
        (COARSE_BEAD * share > WORTH_A_WORD).then(|| {
            format!(
                "where bead and ring touch, the bead gives way by {:.0} % of both, and is meshed coarsely there: at a mesh density of 12 the ring is \
                 about {:.0} % too stiff, at 24 half as much; a fit of support_stiffness makes up for it",
                100.0 * share,
                100.0 * COARSE_BEAD * share
            )
        })
    }

    /// Whether the laws of the chain's contacts are fitted to statics of its bodies: those of all contacts, or that of a ring that
    /// [`crate::contact_law::Annulus::new`] is not the law of.
    pub fn has_fitted_laws(&self) -> bool {
        self.contact_law == ContactLaw::FiniteBody || self.has_own_ring()
    }

    /// Whether the last bead lies on a ring other than the paper's under a 1 mm steel bead: of another shape, Young's modulus or Poisson's
    /// ratio, under a bead of a radius more than 2 % from 0.5 mm, or of one so soft that both together give way by 2 % more.
    pub fn has_own_ring(&self) -> bool {
        let Some((shape, _, material)) = self.support.ring() else { return false };
        let Some(Bead { radius, material: of_bead, .. }) = self.chain.beads.last() else { return false };
        let resin = Material::resin();
        let elastic = |material: &Material| (material.youngs_modulus, material.poissons_ratio);
        let softer = compliance(of_bead) - compliance(&Material::chrome_steel());
        *shape != AnnulusShape::published()
            || elastic(material) != elastic(&resin)
            || (radius / LAW_BEAD.0 - 1.0).abs() > LAW_BEAD.1
            || softer.abs() > LAW_COMPLIANCE * compliance(&resin)
    }
}
