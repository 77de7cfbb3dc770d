//! Viscous dampers of a contact.

use crate::scene::{Damping, DampingKind, DampingPlacement};

/// Dashpot of one contact, F = (c + γ √δ) δ̇ while pressed; either term may be zero.
///
/// The second term is the viscoelastic Hertz contact of Kuwabara and Kono (1987), *Jpn. J. Appl. Phys.* 26, 1230; the first is the
/// plain linear dashpot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Dashpot {
    /// c, N·s/m.
    pub linear: f64,
    /// γ, N·s·m^(-3/2).
    pub kuwabara_kono: f64,
}

impl Dashpot {
    /// Force (N) at the overlap δ (m) and its rate δ̇ (m/s); zero once separated, negative while parting.
    #[must_use]
    pub fn force(&self, overlap: f64, rate: f64) -> f64 {
        if overlap > 0.0 { (self.linear + self.kuwabara_kono * overlap.sqrt()) * rate } else { 0.0 }
    }

    /// Whether there is nothing to damp.
    #[must_use]
    pub fn is_absent(&self) -> bool {
        self.linear == 0.0 && self.kuwabara_kono == 0.0
    }
}

/// Dashpot of each contact: the terms of the kind, at the contacts of the placement.
#[must_use]
pub fn dashpots(damping: &Damping, contacts: usize) -> Vec<Dashpot> {
    let (linear, kuwabara_kono) = match damping.kind {
        DampingKind::None => (0.0, 0.0),
        DampingKind::Linear => (damping.linear, 0.0),
        DampingKind::KuwabaraKono => (0.0, damping.kuwabara_kono),
        DampingKind::LinearAndKuwabaraKono => (damping.linear, damping.kuwabara_kono),
    };
    (0..contacts)
        .map(|contact| {
            let end = contact == 0 || contact + 1 == contacts;
            match damping.placement {
                DampingPlacement::Beads if end => Dashpot::default(),
                DampingPlacement::Beads | DampingPlacement::All => Dashpot { linear, kuwabara_kono },
            }
        })
        .collect()
}
