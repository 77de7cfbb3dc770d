//! The peaks printed in the source paper (Sec. IV.B, text to Fig. 6), to stand beside a simulation of the same scene.
//!
//! The one place where they are written in code. The paper prints no line amplitudes.

use serde::Serialize;

use crate::scene::{DampingKind, Scene, Support};

/// A pair of printed peak velocities, m/s.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Peaks {
    /// Positive peak, m/s.
    pub positive_m_per_s: f64,
    /// Negative peak, m/s.
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
    /// Measured.
    pub measured: Peaks,
    /// The paper's own simulation with the scene's damping and α, where it made one.
    pub simulated: Option<Peaks>,
}

/// What the paper prints about this scene: six beads on the resin annulus at 73 kHz, else nothing.
#[must_use]
pub fn published(scene: &Scene) -> Option<Published> {
    let same = |value: f64, printed: f64| (value - printed).abs() <= 1e-9 * printed;
    let annulus = matches!(scene.support, Support::Annulus { .. });
    if !(annulus && scene.chain.beads.len() == 6 && same(scene.drive.frequency, 73e3)) {
        return None;
    }
    let damping = &scene.damping;
    let simulated = match damping.kind {
        DampingKind::Linear if same(damping.linear, 0.3) && same(scene.amplitude_scale, 0.5) => Some(LINEAR),
        DampingKind::KuwabaraKono if same(damping.kuwabara_kono, 3660.0) && same(scene.amplitude_scale, 1.5) => {
            Some(KUWABARA_KONO)
        }
        _ => None,
    };
    Some(Published { measured: MEASURED, simulated })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

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
        assert_eq!(of("annulus", &["chain.beads=5"]), None);
        assert_eq!(of("rigid", &[]), None);
    }
}
