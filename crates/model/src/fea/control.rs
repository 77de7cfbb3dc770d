//! When a step is taken back, and how well the contact conditions were met.

use std::fmt;

use super::contact::chain::Failure;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Energy that contacts may make or lose in one step by opening and closing within it, over all work done so far (at least the kinetic
    /// energy of the first bead at the piston's largest speed), 1.
    pub contact_energy: f64,
    pub halvings: u32,
}

impl Default for Control {
    /// 5 %, eight halvings.
    fn default() -> Self {
        Self { contact_energy: 0.05, halvings: 8 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Cause {
    NotFinite,
    NoActiveSet,
    NotSettled,
    ContactEnergy,
    PatchExceeded,
}

impl Cause {
    /// Why contacts could not be solved, and which contact (0 = piston).
    pub(crate) fn of(failure: Failure) -> (Self, usize) {
        match failure {
            Failure::NoActiveSet { contact, .. } => (Self::NoActiveSet, contact),
            Failure::NotSettled { contact, .. } => (Self::NotSettled, contact),
        }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "displacements are not finite",
            Self::NoActiveSet => "no set of pressed points satisfies the contact conditions",
            Self::NotSettled => "the forces of coupled contacts do not settle",
            Self::ContactEnergy => "opening and closing within the step makes or loses too much energy",
            Self::PatchExceeded => "the contact is larger than the finely meshed patch",
        })
    }
}

#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Cut {
    /// Time at the beginning of the step, s.
    pub time_s: f64,
    pub step_s: f64,
    /// Contact, counted from 1 at the piston.
    pub contact: usize,
    pub cause: Cause,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Complementarity {
    /// Deepest penetration of any point, m.
    pub penetration_m: f64,
    /// Largest pull of any point, N.
    pub adhesion_n: f64,
    /// Largest force times gap of any point, J.
    pub product_j: f64,
    /// Steps in which a point penetrated by more than [`PENETRATION`] or pulled at all.
    pub violations: u64,
}

/// Penetration that counts as a violation, m: a millionth of the motions of interest, a million roundings.
pub const PENETRATION: f64 = 1e-12;
