//! Linear elastic, isotropic materials.

/// A linear elastic, isotropic material.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name, as in a scene file.
    pub name: String,
    /// Young's modulus E, Pa.
    pub youngs_modulus: f64,
    /// Poisson's ratio ν, 1.
    pub poissons_ratio: f64,
    /// Density ρ, kg/m³.
    pub density: f64,
}

impl Material {
    /// Chrome steel of the beads: E 201 GPa, ν 0.3, ρ 7833 kg/m³.
    #[must_use]
    pub fn chrome_steel() -> Self {
        Self { name: "chrome-steel".into(), youngs_modulus: 201e9, poissons_ratio: 0.3, density: 7833.0 }
    }
}
