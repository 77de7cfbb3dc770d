//! Peaks published in the source paper (Sec. IV.B, text to Fig. 6).
//!
//! The one place where they are written in code.

use serde::Serialize;

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
