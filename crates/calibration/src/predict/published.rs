//! Peaks published in the source paper (Sec. IV.B, text to Fig. 6), shown beside runs of its scenes; its other statements are judged in the study of it.
//!
//! The one place where they are written in code.

use serde::Serialize;

use granchain_model::scene::{DampingKind, DampingTerm, FlatContact, Material, Scene, Support};

/// A pair of printed peak velocities, m/s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Peaks {
    pub positive_m_per_s: f64,
    pub negative_m_per_s: f64,
}

/// Measured by laser vibrometer at the pole of the last bead.
pub const MEASURED: Peaks = Peaks { positive_m_per_s: 0.289, negative_m_per_s: -0.247 };

/// Finite elements, linear dashpots of 0.3 N·s/m, α = 0.5.
pub const LINEAR: Peaks = Peaks { positive_m_per_s: 0.296, negative_m_per_s: -0.207 };

/// Finite elements, Kuwabara–Kono dashpots of 3.66e3 N·s·m^(-3/2), α = 1.5.
pub const KUWABARA_KONO: Peaks = Peaks { positive_m_per_s: 0.214, negative_m_per_s: -0.071 };

/// What the paper prints about a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Published {
    pub measured: Peaks,
    /// The paper's own simulation with the scene's damping and α, where it made one.
    pub simulated: Option<Peaks>,
}

/// What the paper prints about this scene: six 1 mm steel beads on the resin annulus at 73 kHz, else nothing.
pub fn published(scene: &Scene) -> Option<Published> {
    let same = |value: f64, printed: f64| (value - printed).abs() <= 1e-9 * printed;
    let elastic = |one: &Material, other: &Material| {
        same(one.youngs_modulus, other.youngs_modulus) && same(one.poissons_ratio, other.poissons_ratio)
    };
    let steel = Material::chrome_steel();
    let beads = &scene.chain.beads;
    let printed_beads =
        beads.len() == 6 && beads.iter().all(|bead| same(bead.radius, 0.5e-3) && elastic(&bead.material, &steel));
    let annulus = matches!(scene.support, Support::Annulus { .. }) && !scene.has_own_ring();
    if !(annulus && printed_beads && scene.piston == FlatContact::Rigid && same(scene.drive.frequency, 73e3)) {
        return None;
    }
    let coefficients = &scene.damping.coefficients;
    let simulated = match scene.damping.kind {
        DampingKind::Linear if same(coefficients[DampingTerm::Linear], 0.3) && same(scene.amplitude_scale, 0.5) => {
            Some(LINEAR)
        }
        DampingKind::KuwabaraKono
            if same(coefficients[DampingTerm::KuwabaraKono], 3660.0) && same(scene.amplitude_scale, 1.5) =>
        {
            Some(KUWABARA_KONO)
        }
        _ => None,
    };
    Some(Published { measured: MEASURED, simulated })
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_model::scene;

    fn of(name: &str, overrides: &[&str]) -> Option<Published> {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        published(&scene::load(name, &overrides).unwrap())
    }

    #[test]
    fn printed_peaks_stand_only_beside_the_scene_they_were_printed_for() {
        assert_eq!(of("annulus", &[]).unwrap().simulated, Some(LINEAR));
        let other_law = ["damping.kind=kuwabara-kono", "damping.coefficient=3660", "alpha=1.5"];
        assert_eq!(of("annulus", &other_law).unwrap().simulated, Some(KUWABARA_KONO));
        assert_eq!(of("annulus", &["alpha=0.6"]).unwrap(), Published { measured: MEASURED, simulated: None });
        for other in [
            "chain.beads=5",
            "chain.radius=0.495 mm",
            "chain.override=[{bead=3,radius=\"0.4 mm\"}]",
            "chain.material=aluminium",
            "support.ring_radius=0.6 mm",
            "support.section_radius=0.3 mm",
            "support.material=acrylic",
            "piston.contact=half-space",
            "drive.frequency=72 kHz",
        ] {
            assert_eq!(of("annulus", &[other]), None, "{other}");
        }
        assert_eq!(of("rigid", &[]), None);
    }
}
