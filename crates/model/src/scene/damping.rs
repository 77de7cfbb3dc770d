//! Dashpots at the contacts: the terms their force may have, the laws made of them, how each is called.
//!
//! A new term is a row here, its formula in [`crate::contact_law::Dashpot`], and its box where it is fitted.

use std::ops::{Index, IndexMut};

use super::word::words;
use granchain_signal::Dimension;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DampingTerm {
    /// c δ̇.
    Linear,
    /// γ √δ δ̇.
    KuwabaraKono,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TermDescription {
    pub title: &'static str,
    pub effect: &'static str,
    pub coefficient: &'static str,
    pub symbol: &'static str,
    pub dimension: Dimension,
    /// The paper's coefficient, SI: taken where none is given.
    pub default: f64,
    /// Scene key of the coefficient in a law of several terms.
    pub key: &'static str,
    pub expected: &'static str,
    /// The coefficient in `summary.json`, with its unit.
    pub setting: &'static str,
}

impl DampingTerm {
    pub const ALL: [Self; 2] = [Self::Linear, Self::KuwabaraKono];

    pub const fn description(self) -> &'static TermDescription {
        match self {
            Self::Linear => &TermDescription {
                title: "linear",
                effect: "linear dampers",
                coefficient: "linear damping coefficient",
                symbol: "c",
                dimension: Dimension::LINEAR_DAMPING,
                default: 0.3,
                key: "damping.linear_coefficient",
                expected: "a coefficient ≥ 0, N·s/m",
                setting: "linear_damping_n_s_per_m",
            },
            Self::KuwabaraKono => &TermDescription {
                title: "Kuwabara–Kono",
                effect: "Kuwabara–Kono dampers",
                coefficient: "Kuwabara–Kono damping coefficient",
                symbol: "γ",
                dimension: Dimension::KUWABARA_KONO_DAMPING,
                default: 3660.0,
                key: "damping.kuwabara_kono_coefficient",
                expected: "a coefficient ≥ 0, N·s·m^(-3/2)",
                setting: "kuwabara_kono_damping_n_s_per_m1_5",
            },
        }
    }
}

/// A coefficient of each term, SI; 0 for a term that a law does not have.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DampingCoefficients([f64; DampingTerm::ALL.len()]);

/// Some terms with their coefficients, the others absent.
///
/// ```
/// use granchain_model::scene::{DampingCoefficients, DampingTerm};
/// let linear = DampingCoefficients::from([(DampingTerm::Linear, 0.3)]); // N·s/m
/// assert_eq!((linear[DampingTerm::Linear], linear[DampingTerm::KuwabaraKono]), (0.3, 0.0));
/// ```
impl<const N: usize> From<[(DampingTerm, f64); N]> for DampingCoefficients {
    fn from(pairs: [(DampingTerm, f64); N]) -> Self {
        let mut coefficients = Self::default();
        pairs.into_iter().for_each(|(term, coefficient)| coefficients[term] = coefficient);
        coefficients
    }
}

impl DampingCoefficients {
    pub fn are_absent(&self) -> bool {
        self.0.iter().all(|coefficient| *coefficient == 0.0)
    }
}

impl Index<DampingTerm> for DampingCoefficients {
    type Output = f64;

    #[inline(always)]
    fn index(&self, term: DampingTerm) -> &f64 {
        &self.0[term as usize]
    }
}

impl IndexMut<DampingTerm> for DampingCoefficients {
    #[inline(always)]
    fn index_mut(&mut self, term: DampingTerm) -> &mut f64 {
        &mut self.0[term as usize]
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DampingKind {
    None,
    /// F = c δ̇ while pressed.
    Linear,
    /// F = γ √δ δ̇.
    KuwabaraKono,
    #[serde(rename = "linear+kuwabara-kono")]
    LinearAndKuwabaraKono,
}

impl DampingKind {
    pub const ALL: [Self; 4] = [Self::None, Self::Linear, Self::KuwabaraKono, Self::LinearAndKuwabaraKono];

    pub const fn terms(self) -> &'static [DampingTerm] {
        match self {
            Self::None => &[],
            Self::Linear => &[DampingTerm::Linear],
            Self::KuwabaraKono => &[DampingTerm::KuwabaraKono],
            Self::LinearAndKuwabaraKono => &[DampingTerm::Linear, DampingTerm::KuwabaraKono],
        }
    }

    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    pub(super) const fn key_of(self, term: DampingTerm) -> &'static str {
        if self.terms().len() == 1 { "damping.coefficient" } else { term.description().key }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DampingPlacement {
    Beads,
    All,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    pub kind: DampingKind,
    /// Of its terms; 0 where the law has no such term.
    pub coefficients: DampingCoefficients,
    pub placement: DampingPlacement,
    /// Whether the total contact force may pull while a contact parts.
    pub tension: bool,
}

words!(DampingKind {
    None = "none",
    Linear = "linear",
    KuwabaraKono = "kuwabara-kono",
    LinearAndKuwabaraKono = "linear+kuwabara-kono"
});

words!(DampingPlacement { All = "all", Beads = "beads" });
