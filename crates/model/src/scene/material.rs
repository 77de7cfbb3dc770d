#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    pub name: String,
    pub youngs_modulus: f64,
    /// Poisson's ratio ν, 1, above −1 and below ½.
    pub poissons_ratio: f64,
    pub density: f64,
}

impl Material {
    /// Chrome steel of the beads: E 201 GPa, ν 0.3, ρ 7833 kg/m³.
    pub fn chrome_steel() -> Self {
        Self { name: "chrome-steel".into(), youngs_modulus: 201e9, poissons_ratio: 0.3, density: 7833.0 }
    }

    /// Resin of the annulus: E 1.4 GPa, ν 0.35, ρ 1235 kg/m³.
    pub fn resin() -> Self {
        Self { name: "resin".into(), youngs_modulus: 1.4e9, poissons_ratio: 0.35, density: 1235.0 }
    }

    /// Vitreous (glassy) carbon of the disc on the water: E 35 GPa, ν 0.15, ρ 1540 kg/m³.
    pub fn vitreous_carbon() -> Self {
        Self { name: "vitreous-carbon".into(), youngs_modulus: 35e9, poissons_ratio: 0.15, density: 1540.0 }
    }

    /// Soda-lime glass: E 70 GPa, ν 0.22, ρ 2500 kg/m³ (nominal values of flat glass, EN 572-1).
    pub fn glass() -> Self {
        Self { name: "glass".into(), youngs_modulus: 70e9, poissons_ratio: 0.22, density: 2500.0 }
    }

    /// Aluminium alloy: E 70 GPa, ν 0.33, ρ 2700 kg/m³ (nominal values of wrought alloys).
    pub fn aluminium() -> Self {
        Self { name: "aluminium".into(), youngs_modulus: 70e9, poissons_ratio: 0.33, density: 2700.0 }
    }

    /// Acrylic glass (PMMA): E 3.3 GPa, ν 0.37, ρ 1190 kg/m³ (nominal values at room temperature; losses left out).
    pub(crate) fn acrylic() -> Self {
        Self { name: "acrylic".into(), youngs_modulus: 3.3e9, poissons_ratio: 0.37, density: 1190.0 }
    }

    /// Titanium alloy Ti-6Al-4V of horns: E 114 GPa, ν 0.34, ρ 4430 kg/m³ (nominal values).
    pub fn titanium() -> Self {
        Self { name: "titanium".into(), youngs_modulus: 114e9, poissons_ratio: 0.34, density: 4430.0 }
    }

    /// Tungsten carbide with cobalt: E 600 GPa, ν 0.22, ρ 14,900 kg/m³ (nominal values).
    pub fn tungsten_carbide() -> Self {
        Self { name: "tungsten-carbide".into(), youngs_modulus: 600e9, poissons_ratio: 0.22, density: 14_900.0 }
    }

    pub fn all_built_in() -> [Self; 8] {
        let discs = [Self::vitreous_carbon(), Self::glass(), Self::aluminium(), Self::acrylic()];
        let [carbon, glass, aluminium, acrylic] = discs;
        let [titanium, carbide] = [Self::titanium(), Self::tungsten_carbide()];
        [Self::chrome_steel(), Self::resin(), carbon, glass, aluminium, acrylic, titanium, carbide]
    }

    pub(crate) fn built_in(name: &str) -> Option<Self> {
        Self::all_built_in().into_iter().find(|material| material.name == name)
    }
}
