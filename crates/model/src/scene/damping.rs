//! Dashpots at the contacts.

use serde::{Deserialize, Serialize};

/// Which law the dashpots follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DampingKind {
    /// No dashpots.
    None,
    /// F = c δ̇ while pressed.
    Linear,
    /// F = γ √δ δ̇.
    KuwabaraKono,
    /// The sum of both.
    #[serde(rename = "linear+kuwabara-kono")]
    LinearAndKuwabaraKono,
}

impl DampingKind {
    /// Every law.
    pub const ALL: [Self; 4] = [Self::None, Self::Linear, Self::KuwabaraKono, Self::LinearAndKuwabaraKono];

    /// Its name in scene files, flags and outcomes.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Linear => "linear",
            Self::KuwabaraKono => "kuwabara-kono",
            Self::LinearAndKuwabaraKono => "linear+kuwabara-kono",
        }
    }
}

/// Which contacts have a dashpot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DampingPlacement {
    /// Bead–bead contacts only.
    Beads,
    /// Piston–bead and bead–support too.
    All,
}

/// Dashpots at the contacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    /// The law.
    pub kind: DampingKind,
    /// c, N·s/m; 0 where the law has no such term.
    pub linear: f64,
    /// γ, N·s·m^(-3/2); 0 where the law has no such term.
    pub kuwabara_kono: f64,
    /// Which contacts.
    pub placement: DampingPlacement,
    /// Whether the total contact force may pull while a contact parts.
    pub tension: bool,
}
