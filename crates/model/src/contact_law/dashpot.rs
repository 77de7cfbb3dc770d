//! Viscous dampers of a contact: the only place with their formulas.

use std::ops::Mul;

use crate::scene::{Damping, DampingCoefficients, DampingPlacement, DampingTerm};

/// A number, or several side by side.
pub(crate) trait Number: Copy + Mul<Output = Self> {
    /// Its square root.
    fn root(self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
}

/// Terms of a law as a set, bit by bit: a parameter of the loops that are made for it.
pub(crate) type Terms = u8;

impl DampingTerm {
    /// The set of this term alone.
    #[inline(always)]
    pub(crate) const fn alone(self) -> Terms {
        1 << self as u8
    }

    /// Force over rate, of a coefficient and √δ: c, γ √δ.
    #[inline(always)]
    pub(crate) fn resistance<X: Number>(self, coefficient: X, root: X) -> X {
        match self {
            Self::Linear => coefficient,
            Self::KuwabaraKono => coefficient * root,
        }
    }
}

/// A block made for each set of terms that a law has; larger sets stand for those that none has.
macro_rules! for_terms {
    ($terms:expr, $name:ident => $body:expr) => {
        match $terms {
            0 => {
                const $name: $crate::contact_law::Terms = 0;
                $body
            }
            1 => {
                const $name: $crate::contact_law::Terms = 1;
                $body
            }
            2 => {
                const $name: $crate::contact_law::Terms = 2;
                $body
            }
            _ => {
                const $name: $crate::contact_law::Terms = $crate::contact_law::ALL_TERMS;
                $body
            }
        }
    };
}
pub(crate) use for_terms;

/// The set of all terms.
pub(crate) const ALL_TERMS: Terms = (1 << DampingTerm::ALL.len()) - 1;

/// Dashpot of one contact, F = (c + γ √δ) δ̇ while pressed; either term may be zero.
///
/// The second term is the viscoelastic Hertz contact of Kuwabara and Kono (1987), *Jpn. J. Appl. Phys.* 26, 1230; the first is the
/// plain linear dashpot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Dashpot {
    /// c (N·s/m), γ (N·s·m^(-3/2)).
    pub coefficients: DampingCoefficients,
}

impl Dashpot {
    /// Force over rate, N·s/m, at √δ (m^½).
    #[inline(always)]
    #[must_use]
    pub fn resistance(&self, root: f64) -> f64 {
        DampingTerm::ALL.into_iter().fold(0.0, |sum, term| sum + term.resistance(self.coefficients[term], root))
    }

    /// Force (N) at the overlap δ (m) and its rate δ̇ (m/s); zero once separated, negative while parting.
    #[must_use]
    pub fn force(&self, overlap: f64, rate: f64) -> f64 {
        if overlap > 0.0 { self.resistance(overlap.sqrt()) * rate } else { 0.0 }
    }

    /// Whether it resists from the first touch on, δ = 0.
    #[inline(always)]
    #[must_use]
    pub fn is_sudden(&self) -> bool {
        self.coefficients[DampingTerm::Linear] > 0.0
    }

    /// A continuous function of overlap (m) and rate (m/s) with the sign of the force that is left of an elastic one (N): their sum, or without
    /// resistance at first touch their sum over √δ, which is not singular at closing.
    #[inline(always)]
    pub(crate) fn pull(&self, elastic: f64, overlap: f64, rate: f64) -> f64 {
        if self.is_sudden() {
            return elastic + self.resistance(overlap.sqrt()) * rate;
        }
        let viscous = self.coefficients[DampingTerm::KuwabaraKono] * rate;
        if overlap > 0.0 { elastic / overlap.sqrt() + viscous } else { viscous }
    }

    /// Whether there is nothing to damp.
    #[must_use]
    pub fn is_absent(&self) -> bool {
        self.coefficients.are_absent()
    }

    /// The terms it has.
    pub(crate) fn terms(&self) -> Terms {
        terms_of(&self.coefficients)
    }
}

/// The terms with a coefficient above zero.
pub(crate) fn terms_of(coefficients: &DampingCoefficients) -> Terms {
    let present = |term: &DampingTerm| coefficients[*term] > 0.0;
    DampingTerm::ALL.into_iter().filter(present).fold(0, |terms, term| terms | term.alone())
}

/// Dashpot of each contact: the terms of the kind, at the contacts of the placement.
#[must_use]
pub fn dashpots(damping: &Damping, contacts: usize) -> Vec<Dashpot> {
    let mut everywhere = Dashpot::default();
    for term in damping.kind.terms() {
        everywhere.coefficients[*term] = damping.coefficients[*term];
    }
    (0..contacts)
        .map(|contact| {
            let end = contact == 0 || contact + 1 == contacts;
            match damping.placement {
                DampingPlacement::Beads if end => Dashpot::default(),
                DampingPlacement::Beads | DampingPlacement::All => everywhere,
            }
        })
        .collect()
}
