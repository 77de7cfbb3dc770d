//! What the first and the last bead touch.

use super::{AnnulusShape, DiscShape, Material, word::words};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlatContact {
    /// A rigid, frictionless flat: Hertz stiffness (4/3) E/(1 − ν²) √a.
    Rigid,
    /// A half-space, of the touching bead's own material unless it has another: Hertz stiffness (2/3) E/(1 − ν²) √a.
    HalfSpace,
}

impl FlatContact {
    /// What it is made of under a bead of that material; a rigid one of nothing.
    pub const fn material(self, own: &Material) -> Option<&Material> {
        match self {
            Self::Rigid => None,
            Self::HalfSpace => Some(own),
        }
    }
}

/// A thin elastic plate that lies on a half-space and is wide against its bending.
#[derive(Debug, Clone, PartialEq)]
pub struct Plate {
    /// Thickness h, m.
    pub thickness: f64,
    pub material: Material,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Support {
    Flat(FlatContact),
    /// A ring on which the last bead lies. In the chain by its static force law, in the finite element analysis meshed, with the normals of the
    /// undeformed surfaces: the force is 0.19 % too large per µm of travel.
    Annulus {
        shape: AnnulusShape,
        /// Factor on the force of the law, and on Young's modulus of the meshed body, 1.
        stiffness_factor: f64,
        material: Material,
    },
    /// Nothing: the last bead is free.
    Free,
    Spring {
        stiffness: f64,
    },
    /// An elastic half-space of its own, with a thin plate on it or without. In the chain by its static force law
    /// ([`crate::contact_law::foundation`]).
    Foundation {
        /// Young's modulus E, Pa.
        youngs_modulus: f64,
        /// Poisson's ratio ν, 1.
        poissons_ratio: f64,
        /// Time constant τ of its loss, E (1 + τ d/dt), s; 0 without loss.
        loss_time: f64,
        plate: Option<Plate>,
    },
    /// A disc that the last bead touches in the middle of its front, on the water ([`super::Scene::water`]) or in vacuum.
    Disc {
        shape: DiscShape,
        /// Mesh density n, 1: elements through the thickness, and 4/3 as many to the same length along r.
        mesh_density: u32,
    },
}

impl Support {
    /// The paper's annulus, its stiffness multiplied by `stiffness_factor` (1).
    pub fn resin_annulus(stiffness_factor: f64) -> Self {
        Self::Annulus { shape: AnnulusShape::published(), stiffness_factor, material: Material::resin() }
    }

    /// What makes it stiffer or softer as a whole: the factor of an annulus, 1, the stiffness of a spring, N/m, or the modulus of a foundation, Pa.
    pub const fn stiffness(&self) -> Option<f64> {
        match self {
            Self::Annulus { stiffness_factor: own, .. }
            | Self::Spring { stiffness: own }
            | Self::Foundation { youngs_modulus: own, .. } => Some(*own),
            Self::Flat(_) | Self::Free | Self::Disc { .. } => None,
        }
    }

    pub const fn stiffness_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Annulus { stiffness_factor: own, .. }
            | Self::Spring { stiffness: own }
            | Self::Foundation { youngs_modulus: own, .. } => Some(own),
            Self::Flat(_) | Self::Free | Self::Disc { .. } => None,
        }
    }

    /// The flat that the last bead meets: a rigid one on a spring, and out of reach before a free end; none of a body.
    pub(crate) const fn flat(&self) -> Option<FlatContact> {
        match self {
            Self::Flat(flat) => Some(*flat),
            Self::Free | Self::Spring { .. } => Some(FlatContact::Rigid),
            Self::Annulus { .. } | Self::Foundation { .. } | Self::Disc { .. } => None,
        }
    }

    /// Whether the far pole of the last bead is pressed on a wall or a spring.
    pub(crate) const fn presses_the_pole(&self) -> bool {
        matches!(self, Self::Flat(_) | Self::Spring { .. } | Self::Foundation { .. })
    }

    pub(crate) const fn is_free(&self) -> bool {
        matches!(self, Self::Free)
    }

    /// Its ring, the factor on its stiffness (1) and its material.
    pub(crate) const fn ring(&self) -> Option<(&AnnulusShape, f64, &Material)> {
        let Self::Annulus { shape, stiffness_factor, material, .. } = self else { return None };
        Some((shape, *stiffness_factor, material))
    }

    /// Its disc, and how finely it is meshed (1).
    pub(crate) const fn disc(&self) -> Option<(&DiscShape, u32)> {
        if let Self::Disc { shape, mesh_density } = self { Some((shape, *mesh_density)) } else { None }
    }

    /// Whether it is a body with a mesh, in the models that mesh their bodies.
    pub(crate) const fn is_meshed(&self) -> bool {
        self.flat().is_none() && !matches!(self, Self::Foundation { .. })
    }

    /// Stiffness of the one-sided linear spring that it is, N/m.
    pub(crate) const fn spring(&self) -> Option<f64> {
        if let Self::Spring { stiffness } = self { Some(*stiffness) } else { None }
    }

    /// Whether a plate on a foundation, if there is one, is thinner than l₀ = (2D/E′)^(1/3), over which it spreads a force: else it is no plate.
    pub fn is_plate_thin(&self) -> bool {
        let Self::Foundation { youngs_modulus, poissons_ratio, plate: Some(Plate { material, .. }), .. } = self else {
            return true;
        };
        let plane = |modulus: f64, ratio: f64| modulus / (1.0 - ratio * ratio);
        // D = E_p′ h³/12: the thickness falls out.
        plane(material.youngs_modulus, material.poissons_ratio) > 6.0 * plane(*youngs_modulus, *poissons_ratio)
    }

    pub(crate) const fn plate(&self) -> Option<&Plate> {
        if let Self::Foundation { plate: Some(plate), .. } = self { Some(plate) } else { None }
    }

    pub(crate) const fn material(&self) -> Option<&Material> {
        match self {
            Self::Annulus { material, .. } => Some(material),
            Self::Disc { shape, .. } => Some(&shape.material),
            Self::Foundation { plate: Some(plate), .. } => Some(&plate.material),
            Self::Flat(_) | Self::Free | Self::Spring { .. } | Self::Foundation { .. } => None,
        }
    }

    pub(crate) const fn name(&self) -> &'static str {
        match self {
            Self::Flat(flat) => flat.name(),
            Self::Free => "free",
            Self::Annulus { .. } => "annulus",
            Self::Spring { .. } => "spring",
            Self::Foundation { .. } => "foundation",
            Self::Disc { .. } => "disc",
        }
    }
}

words!(FlatContact { Rigid = "rigid", HalfSpace = "half-space" });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plate_is_one_on_a_softer_half_space_alone() {
        let on = |youngs_modulus: f64| {
            let plate = Some(Plate { thickness: 1e-3, material: Material::resin() });
            Support::Foundation { youngs_modulus, poissons_ratio: 0.3, loss_time: 0.0, plate }.is_plate_thin()
        };
        let own = Material::resin().youngs_modulus;
        assert!(on(0.01 * own) && !on(own) && Support::Free.is_plate_thin());
    }
}
