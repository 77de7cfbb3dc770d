//! Elastic contacts that feel one another through the bodies between them.
//!
//! ```text
//! δ_c = d_c − s_c F_{c−1} − s_{c+1} F_{c+1},    F_c = F_el,c(δ_c)
//! ```
//!
//! - d_c: overlap of the rigid (mass-mean) motions of the bodies at contact c = 0 … N, m
//! - s_i: coupling through bead i = 1 … N, between its contacts i − 1 and i, m/N: how far a force at one pole draws the surface at the other
//!   back towards the mass mean; positive in a sphere
//!
//! The forces are those of a potential,
//!
//! ```text
//! V(d) = Σ_c E_c(δ_c) + Σ_i s_i F_{i−1} F_i,    ∂V/∂d_c = F_c,
//! ```
//!
//! since s_i couples both ways alike. They are found by inserting them into one another, which contracts by |s| dF/dδ a time: 0.006 for 1 mm steel
//! beads 1 µm into each other.

use crate::contact_law::{ElasticLaw, Law};

/// Insertions after which a state is taken as it is; a contraction of a tenth is at rounding after fifteen.
const MOST_INSERTIONS: u32 = 40;
/// Change of an overlap over the largest at which the forces are taken to be settled.
const SETTLED: f64 = 1e-12;

/// What the contacts of finite bodies need beyond their overlaps, in arrays as long as the chain's blocks.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Coupling {
    /// k, c₁ and c₂ of the contacts, 0 for a last one of another form.
    pub stiffness: Vec<f64>,
    pub first: Vec<f64>,
    pub second: Vec<f64>,
    /// s towards the contact before and after, 0 where there is none.
    pub before: Vec<f64>,
    pub after: Vec<f64>,
    /// Ones: the gates of [`Coupling::settle`] with every contact taking part.
    pub all: Vec<f64>,
    /// Law of the last contact where it is not polynomial.
    pub last: Option<Law>,
    contacts: usize,
}

/// Overlaps, rates and elastic forces of all contacts at one instant.
#[derive(Debug, Clone, Default)]
pub(super) struct Survey {
    /// d, m, and ḋ, m/s, of the rigid motions.
    pub rigid: Vec<f64>,
    pub rigid_rate: Vec<f64>,
    /// δ, m, and δ̇, m/s.
    pub overlap: Vec<f64>,
    pub rate: Vec<f64>,
    /// F_el, N.
    pub force: Vec<f64>,
}

impl Survey {
    pub(crate) fn new(padded: usize) -> Self {
        let zeros = || vec![0.0; padded];
        Self { rigid: zeros(), rigid_rate: zeros(), overlap: zeros(), rate: zeros(), force: zeros() }
    }
}

impl Coupling {
    /// The contacts' laws and the beads' couplings (m/N), in blocks of length `padded`.
    pub(crate) fn new(laws: &[Law], beads: &[f64], padded: usize) -> Self {
        let zeros = || vec![0.0; padded];
        let contacts = laws.len();
        let mut coupling = Self {
            stiffness: zeros(),
            first: zeros(),
            second: zeros(),
            before: zeros(),
            after: zeros(),
            all: vec![1.0; padded],
            last: None,
            contacts,
        };
        for (contact, law) in laws.iter().enumerate() {
            match law {
                Law::Hertz(hertz) => coupling.stiffness[contact] = hertz.stiffness,
                Law::FiniteHertz(law) => {
                    coupling.stiffness[contact] = law.stiffness;
                    coupling.first[contact] = law.first;
                    coupling.second[contact] = law.second;
                }
                // Only a support has another law.
                Law::Annulus(_) | Law::Spring(_) | Law::HertzOnSpring(_) => coupling.last = Some(*law),
            }
        }
        for (bead, coupled) in beads.iter().enumerate() {
            coupling.after[bead] = *coupled;
            coupling.before[bead + 1] = *coupled;
        }
        coupling
    }

    /// By how much the overlap of the rigid motions is larger than that of the contact when all carry `force` (N), m.
    pub(crate) fn under(&self, contact: usize, force: f64) -> f64 {
        (self.before[contact] + self.after[contact]) * force
    }

    /// Elastic forces (N) and overlaps (m) at the rigid overlaps d (m); contacts with a zero in `gate` carry nothing, the others `gate` times
    /// their law.
    #[inline(always)]
    pub(crate) fn settle(&self, rigid: &[f64], gate: &[f64], overlap: &mut [f64], force: &mut [f64]) {
        let blocks = rigid.len() / 4;
        let rigid = &rigid.as_chunks::<4>().0[..blocks];
        let gate_blocks = &gate.as_chunks::<4>().0[..blocks];
        let stiffness = &self.stiffness.as_chunks::<4>().0[..blocks];
        let first = &self.first.as_chunks::<4>().0[..blocks];
        let second = &self.second.as_chunks::<4>().0[..blocks];
        let before = &self.before.as_chunks::<4>().0[..blocks];
        let after = &self.after.as_chunks::<4>().0[..blocks];
        overlap.copy_from_slice(rigid.as_flattened());
        for _ in 0..MOST_INSERTIONS {
            {
                let overlap = &overlap.as_chunks::<4>().0[..blocks];
                let force = &mut force.as_chunks_mut::<4>().0[..blocks];
                for block in 0..blocks {
                    let mut pressed = [0.0; 4];
                    let mut root = [0.0; 4];
                    for i in 0..4 {
                        let overlap = overlap[block][i];
                        pressed[i] = if overlap > 0.0 { overlap } else { 0.0 };
                    }
                    for i in 0..4 {
                        root[i] = pressed[i].sqrt();
                    }
                    for i in 0..4 {
                        let bracket = 1.0 + first[block][i] * root[i] + second[block][i] * pressed[i];
                        force[block][i] = gate_blocks[block][i] * stiffness[block][i] * pressed[i] * root[i] * bracket;
                    }
                }
            }
            if let Some(law) = &self.last {
                let last = self.contacts - 1;
                force[last] = gate[last] * law.force(overlap[last]);
            }
            let force = &force.as_chunks::<4>().0[..blocks];
            let overlap = &mut overlap.as_chunks_mut::<4>().0[..blocks];
            let (mut change, mut largest) = ([0.0f64; 4], [0.0f64; 4]);
            let mut behind = 0.0;
            for block in 0..blocks {
                let here = force[block];
                let next = if block + 1 < blocks { force[block + 1][0] } else { 0.0 };
                let left = [behind, here[0], here[1], here[2]];
                let right = [here[1], here[2], here[3], next];
                behind = here[3];
                for i in 0..4 {
                    let new = rigid[block][i] - before[block][i] * left[i] - after[block][i] * right[i];
                    let moved = (new - overlap[block][i]).abs();
                    change[i] = if moved > change[i] { moved } else { change[i] };
                    largest[i] = if new > largest[i] { new } else { largest[i] };
                    overlap[block][i] = new;
                }
            }
            let change = change.into_iter().fold(0.0, f64::max);
            if !(change > SETTLED * largest.into_iter().fold(0.0, f64::max)) {
                break;
            }
        }
    }

    /// δ̇ (m/s) at the overlaps δ from the rates ḋ of the rigid motions.
    pub(crate) fn rates(&self, laws: &[Law], survey: &mut Survey) {
        survey.rate.copy_from_slice(&survey.rigid_rate);
        // What is left, a millionth, does not matter: rates say which way a contact moves and start a search.
        for _ in 0..3 {
            let mut behind = 0.0;
            for (contact, law) in laws.iter().enumerate() {
                let growth = |c: usize, law: &Law, rate: f64| law.tangent_stiffness(survey.overlap[c]) * rate;
                let own = growth(contact, law, survey.rate[contact]);
                let next = laws.get(contact + 1).map_or(0.0, |law| growth(contact + 1, law, survey.rate[contact + 1]));
                survey.rate[contact] =
                    survey.rigid_rate[contact] - self.before[contact] * behind - self.after[contact] * next;
                behind = own;
            }
        }
    }

    /// V at the settled overlaps and forces, J.
    pub(crate) fn energy(&self, laws: &[Law], overlap: &[f64], force: &[f64]) -> f64 {
        let stored: f64 = laws.iter().zip(overlap).map(|(law, overlap)| law.energy(*overlap)).sum();
        let coupled: f64 = (1..laws.len()).map(|c| self.before[c] * force[c - 1] * force[c]).sum();
        stored + coupled
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact_law::{Annulus, FiniteHertz, Hertz};

    /// Four beads, an annulus behind the last, couplings large enough to matter in every digit looked at.
    fn chain() -> (Vec<Law>, Coupling) {
        let pair = Law::FiniteHertz(FiniteHertz { stiffness: 2.3e9, first: 25.0, second: 2.2e3 });
        let laws = vec![Law::Hertz(Hertz { stiffness: 6.6e9 }), pair, pair, pair, Law::Annulus(Annulus::new(1.0))];
        let coupling = Coupling::new(&laws, &[1.7e-9, 1.5e-9, 2.0e-9, -1.1e-9], 8);
        (laws, coupling)
    }

    fn settled(coupling: &Coupling, rigid: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut padded = vec![f64::NEG_INFINITY; 8];
        padded[..rigid.len()].copy_from_slice(rigid);
        let (mut overlap, mut force) = (vec![0.0; 8], vec![0.0; 8]);
        coupling.settle(&padded, &coupling.all, &mut overlap, &mut force);
        (overlap, force)
    }

    #[test]
    fn forces_fit_the_overlaps_they_leave() {
        let (laws, coupling) = chain();
        let rigid = [1.2e-6, 0.8e-6, -0.1e-6, 2.0e-6, 1.0e-6];
        let (overlap, force) = settled(&coupling, &rigid);
        let beads = [1.7e-9, 1.5e-9, 2.0e-9, -1.1e-9];
        for contact in 0..5 {
            let before = if contact > 0 { beads[contact - 1] * force[contact - 1] } else { 0.0 };
            let after = if contact < 4 { beads[contact] * force[contact + 1] } else { 0.0 };
            // The insertions stop at 1e-12 of the largest overlap.
            assert!((overlap[contact] - (rigid[contact] - before - after)).abs() < 1e-17, "{contact}");
            assert!((force[contact] - laws[contact].force(overlap[contact])).abs() < 1e-11 * 5.0, "{contact}");
        }
        assert!(force[2] == 0.0 && overlap[2] < rigid[2]);
    }

    #[test]
    fn forces_are_the_slope_of_the_energy() {
        let (laws, coupling) = chain();
        let rigid = [1.2e-6, 0.8e-6, 0.4e-6, 2.0e-6, 1.0e-6];
        let energy = |rigid: &[f64]| {
            let (overlap, force) = settled(&coupling, rigid);
            coupling.energy(&laws, &overlap, &force)
        };
        let (_, force) = settled(&coupling, &rigid);
        for contact in 0..5 {
            let moved = |by: f64| {
                let mut moved = rigid;
                moved[contact] += by;
                energy(&moved)
            };
            let slope = (moved(1e-11) - moved(-1e-11)) / 2e-11;
            // Central difference, (h/δ)² ~ 1e-9, and the rounding of 1e-6 J over 2e-11 m.
            assert!((slope / force[contact] - 1.0).abs() < 1e-6, "{contact}: {slope} {}", force[contact]);
        }
    }

    #[test]
    fn rates_are_the_change_of_the_overlaps() {
        let (laws, coupling) = chain();
        let (rigid, rigid_rate) = ([1.2e-6, 0.8e-6, 0.4e-6, 2.0e-6, 1.0e-6], [0.3, -0.2, 0.5, 0.1, -0.4]);
        let mut survey = Survey::new(8);
        (survey.overlap, survey.force) = settled(&coupling, &rigid);
        survey.rigid_rate[..5].copy_from_slice(&rigid_rate);
        coupling.rates(&laws, &mut survey);
        let after = |time: f64| {
            let moved: Vec<f64> = rigid.iter().zip(rigid_rate).map(|(d, rate)| d + time * rate).collect();
            settled(&coupling, &moved).0
        };
        let (before, behind) = (after(-1e-10), after(1e-10));
        for contact in 0..5 {
            let slope = (behind[contact] - before[contact]) / 2e-10;
            // Two insertions into one another: 1e-5.
            assert!((survey.rate[contact] - slope).abs() < 1e-4 * 0.5, "{contact}: {} {slope}", survey.rate[contact]);
        }
    }
}
