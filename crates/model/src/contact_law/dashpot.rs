//! Viscous dampers of a contact: the only place with their formulas.

use crate::{
    number::Number,
    scene::{Damping, DampingCoefficients, DampingPlacement, DampingTerm},
};

/// Terms of a law as a set, bit by bit: a parameter of the loops that are made for it.
pub(crate) type Terms = u8;

impl DampingTerm {
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

    /// Power of δ in its resistance.
    pub(crate) const fn power(self) -> f64 {
        match self {
            Self::Linear => 0.0,
            Self::KuwabaraKono => 0.5,
        }
    }
}

/// A block made for no term, for the linear one, and for all: a term that is zero beside a root costs next to nothing.
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
            _ => {
                const $name: $crate::contact_law::Terms = $crate::contact_law::ALL_TERMS;
                $body
            }
        }
    };
}
pub(crate) use for_terms;

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
    pub(crate) fn resistance(&self, root: f64) -> f64 {
        DampingTerm::ALL.into_iter().fold(0.0, |sum, term| sum + term.resistance(self.coefficients[term], root))
    }

    /// Force (N) at the overlap δ (m) and its rate δ̇ (m/s); zero once separated, negative while parting.
    pub fn force(&self, overlap: f64, rate: f64) -> f64 {
        if overlap > 0.0 { self.resistance(overlap.sqrt()) * rate } else { 0.0 }
    }

    /// The term that is largest at first touch, δ → 0.
    #[inline(always)]
    pub(crate) fn leading(&self) -> Option<DampingTerm> {
        let present = DampingTerm::ALL.into_iter().filter(|term| self.coefficients[*term] > 0.0);
        present.min_by(|one, other| one.power().total_cmp(&other.power()))
    }

    /// A continuous function of overlap (m) and rate (m/s) with the sign of the force that is left of an elastic one (N): their sum over δ to
    /// the power of the leading term, which is not singular at closing.
    #[inline(always)]
    pub(crate) fn pull(&self, elastic: f64, overlap: f64, rate: f64) -> f64 {
        let Some(leading) = self.leading() else { return elastic };
        let root = overlap.sqrt();
        if leading.power() == 0.0 {
            return elastic + self.resistance(root) * rate;
        }
        let first = self.coefficients[leading] * rate;
        if overlap <= 0.0 {
            return first;
        }
        let scale = leading.resistance(1.0, root);
        let rest = DampingTerm::ALL.into_iter().filter(|term| *term != leading);
        rest.fold(elastic / scale + first, |sum, term| {
            sum + term.resistance(self.coefficients[term], root) / scale * rate
        })
    }

    pub(crate) fn is_absent(&self) -> bool {
        self.coefficients.are_absent()
    }

    pub(crate) fn terms(&self) -> Terms {
        terms_of(&self.coefficients)
    }
}

pub(crate) fn terms_of(coefficients: &DampingCoefficients) -> Terms {
    let present = |term: &DampingTerm| coefficients[*term] > 0.0;
    DampingTerm::ALL.into_iter().filter(present).fold(0, |terms, term| terms | term.alone())
}

/// Dashpot of each contact: the terms of the kind, at the contacts of the placement.
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
