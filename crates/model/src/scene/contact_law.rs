//! The elastic law of the chain's contacts.

use super::word::words;

/// Elastic law of the contacts where `model.kind = "chain"`; the other models compute their contacts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ContactLaw {
    #[default]
    Hertz,
    /// F = k δ^(3/2) (1 + c₁ √δ + c₂ δ), fitted to the bodies' own static finite element solutions, and the coupling through each bead.
    FiniteBody,
}

words!(ContactLaw { Hertz = "hertz", FiniteBody = "finite-body" });
