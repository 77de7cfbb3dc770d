//! Bodies at rest under a static force along the chain.
//!
//! Every contact carries the same axial force F₀. With the static compliance of each interface (of a free body relative to its mass mean,
//! where the two forces of a body balance) the approach d_c of contact c is found such that its forces add up to F₀:
//!
//! ```text
//! g_c = g⁰_c − a_c d_c + W_c λ_c + V_c λ_{c−1} + V_{c+1}ᵀ λ_{c+1},   g_c ≥ 0, λ_c ≥ 0, λ_c g_c = 0,   a_c · λ_c = F₀
//! ```

use super::{
    FeaError,
    arrangement::Arrangement,
    contact::{
        chain::{ContactState, Link},
        complementarity::{Compliance, Scratch},
    },
    factor::StaticFactor,
    operator::{Interfaces, condensed, soften},
};
use crate::{
    scene::Scene,
    water::{
        WaterError,
        front::{Front, Held},
    },
};

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Equilibrium {
    /// Forces of the points of every contact, N.
    pub forces: Vec<Vec<f64>>,
    /// Approach d of the rigid motions on both sides of every contact, m.
    pub approaches: Vec<f64>,
    /// Sweeps over all contacts it took.
    pub sweeps: u32,
}

impl Equilibrium {
    fn unpressed(arrangement: &Arrangement) -> Self {
        Self {
            forces: arrangement.contacts.iter().map(|&pair| vec![0.0; arrangement.pairs[pair].len()]).collect(),
            approaches: vec![0.0; arrangement.contacts.len()],
            sweeps: 0,
        }
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Statics {
    factors: Vec<StaticFactor>,
    links: Vec<Link>,
    compliances: Vec<Compliance>,
    couplings: Vec<Vec<f64>>,
}

const MOST_ITERATIONS: u32 = 200;

impl Statics {
    /// Factor the stiffness of every kind of body.
    pub(crate) fn new(arrangement: &Arrangement, interfaces: &Interfaces) -> Result<Self, FeaError> {
        let factors =
            arrangement.of_kinds(&interfaces.unknowns, |_, body, interface| StaticFactor::new(body, interface))?;
        let inverse: Vec<Vec<f64>> =
            factors.iter().zip(&arrangement.kinds).map(|(factor, body)| factor.interface_compliance(body)).collect();
        let (links, compliances, couplings) = condensed(arrangement, interfaces, &inverse, 1.0)?;
        Ok(Self { factors, links, compliances, couplings })
    }

    /// W of a contact, m/N.
    pub(crate) fn compliance(&self, contact: usize) -> &Compliance {
        &self.compliances[self.links[contact].compliance]
    }

    fn soften_last(&mut self, arrangement: &Arrangement, further: &[f64]) -> Result<(), FeaError> {
        let last = arrangement.contacts.len() - 1;
        soften(&mut self.compliances[self.links[last].compliance], arrangement, further)
    }

    /// V through the body before a contact, row by row, points of the contact × points of the contact before, m/N: how far a gap opens for a
    /// force there; none at the first contact.
    pub(crate) fn coupling(&self, contact: usize) -> Option<&[f64]> {
        self.links[contact].coupling.map(|coupling| self.couplings[coupling].as_slice())
    }

    /// All contacts under the axial force F₀ (N).
    pub(crate) fn under(&self, arrangement: &Arrangement, force: f64) -> Result<Equilibrium, FeaError> {
        let Equilibrium { mut forces, mut approaches, .. } = Equilibrium::unpressed(arrangement);
        let press = |contact, guess| self.press(arrangement, contact, force, guess, &mut forces);
        let sweeps = settle(force, &mut approaches, press)?;
        Ok(Equilibrium { forces, approaches, sweeps })
    }

    /// The approach (m) at which contact c carries `force` (N), its neighbours' forces given; its own are set.
    fn press(
        &self,
        arrangement: &Arrangement,
        contact: usize,
        force: f64,
        guess: f64,
        forces: &mut [Vec<f64>],
    ) -> Result<f64, FeaError> {
        let link = &self.links[contact];
        let compliance = &self.compliances[link.compliance];
        let n = compliance.size();
        let mut free = arrangement.pairs[arrangement.contacts[contact]].gaps.clone();
        if let Some(coupling) = link.coupling {
            let earlier = &forces[contact - 1];
            let matrix = &self.couplings[coupling];
            for (i, gap) in free.iter_mut().enumerate() {
                let row = &matrix[i * earlier.len()..(i + 1) * earlier.len()];
                *gap += row.iter().zip(earlier).map(|(v, force)| v * force).sum::<f64>();
            }
        }
        if let Some(coupling) = self.links.get(contact + 1).and_then(|next| next.coupling) {
            for (j, force) in forces[contact + 1].iter().enumerate() {
                for (i, gap) in free.iter_mut().enumerate() {
                    *gap += self.couplings[coupling][j * n + i] * force;
                }
            }
        }
        let mut own = std::mem::take(&mut forces[contact]);
        let found = force_at(compliance, &link.axial_before, &free, force, guess, &mut own);
        forces[contact] = own;
        found.map_err(|iterations| FeaError::NoEquilibrium { force, contact: contact + 1, iterations })
    }

    /// Displacements (m) of the body in every slot under the given contact forces (N), of a free body relative to its mass mean; none where
    /// it is rigid.
    fn displacements(
        &self,
        arrangement: &Arrangement,
        interfaces: &Interfaces,
        forces: &[Vec<f64>],
    ) -> Vec<Option<Vec<f64>>> {
        (0..arrangement.beads.len() + 2)
            .map(|slot| {
                let kind = arrangement.kind(slot)?;
                let (body, factor) = (&arrangement.kinds[kind], &self.factors[kind]);
                let unknowns = &interfaces.unknowns[kind];
                let mut local = vec![0.0; unknowns.len()];
                interfaces.press(slot, |contact| forces.get(contact), &mut local);
                let mut load = body.columns(1);
                for (&unknown, force) in unknowns.iter().zip(&local) {
                    load.set(unknown as usize, 0, *force);
                }
                let (mut half, mut u) = (factor.factor().half(1), body.columns(1));
                factor.solve(&mut load, &mut half, &mut u);
                Some(u.column(0))
            })
            .collect()
    }
}

/// A disc on water under the static force (N), whose motion is then counted from there; none without one.
pub(crate) fn held(front: Option<&Front>, force: f64) -> Result<Option<Held>, FeaError> {
    let Some(front) = front else { return Ok(None) };
    let held = front.held().map_err(|source| Box::new(WaterError::from(source)))?;
    held.ok_or(FeaError::FreeDiscUnderForce { force }).map(Some)
}

/// Approaches (m) of all contacts under `force` (N), one after another until none changes any more: `press(contact, guess)` is the approach
/// at which a contact carries the force, its neighbours' forces given. Returns the number of sweeps.
pub(crate) fn settle(
    force: f64,
    approaches: &mut [f64],
    mut press: impl FnMut(usize, f64) -> Result<f64, FeaError>,
) -> Result<u32, FeaError> {
    let mut sweep = 0;
    loop {
        sweep += 1;
        let mut change: f64 = 0.0;
        for (contact, approach) in approaches.iter_mut().enumerate() {
            let before = *approach;
            *approach = press(contact, before)?;
            change = change.max((*approach - before).abs() / approach.abs());
        }
        // Rounding of the approach itself.
        if change < 1e-13 {
            return Ok(sweep);
        }
        if sweep == MOST_ITERATIONS || !change.is_finite() {
            return Err(FeaError::NoEquilibrium { force, contact: 1, iterations: sweep });
        }
    }
}

/// The approach d (m) at which the forces λ of W λ + q − a d ≥ 0 add up to a·λ = `force` (N), λ into `forces`; regula falsi with the
/// Illinois modification on a monotone function. On failure the number of iterations.
pub(crate) fn force_at(
    compliance: &Compliance,
    axial: &[f64],
    free: &[f64],
    force: f64,
    guess: f64,
    forces: &mut [f64],
) -> Result<f64, u32> {
    let n = compliance.size();
    let (mut scratch, mut gaps, mut shifted) = (Scratch::new(n), vec![0.0; n], vec![0.0; n]);
    let mut iterations = 0;
    let mut excess = |approach: f64, forces: &mut [f64]| -> Result<f64, u32> {
        iterations += 1;
        if iterations > MOST_ITERATIONS {
            return Err(iterations);
        }
        for ((shifted, free), axial) in shifted.iter_mut().zip(free).zip(axial) {
            *shifted = free - axial * approach;
        }
        compliance.solve(&shifted, forces, &mut gaps, &mut scratch).map_err(|_| iterations)?;
        Ok(forces.iter().zip(axial).map(|(force, axial)| force * axial).sum::<f64>() - force)
    };
    let touching = free.iter().zip(axial).map(|(gap, axial)| gap / axial).fold(f64::INFINITY, f64::min);
    let (mut low, mut at_low) = (touching, -force);
    let mut high = if guess > touching { guess } else { touching + 1e-9 };
    let mut at_high = excess(high, forces)?;
    while at_high < 0.0 {
        (low, at_low) = (high, at_high);
        high = touching + 2.0 * (high - touching);
        at_high = excess(high, forces)?;
    }
    loop {
        if at_high == 0.0 || (high - low) <= 4.0 * f64::EPSILON * high.abs() {
            excess(high, forces)?;
            return Ok(high);
        }
        let middle = (high - at_high * (high - low) / (at_high - at_low)).clamp(low, high);
        let value = excess(middle, forces)?;
        if value.abs() <= 1e-14 * force {
            return Ok(middle);
        }
        if value < 0.0 {
            if low == middle {
                return Ok(middle);
            }
            (low, at_low) = (middle, value);
            at_high *= 0.5;
        } else {
            if high == middle {
                return Ok(middle);
            }
            (high, at_high) = (middle, value);
            at_low *= 0.5;
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rest {
    /// The contacts and their forces; their gaps are not measured yet.
    pub contacts: Vec<ContactState>,
    /// Gap of every contact's points at zero displacement, m.
    pub gaps: Vec<Vec<f64>>,
    /// Overlap of the rigid motions at every contact at zero displacement, m.
    pub overlaps: Vec<f64>,
    /// Displacements of the body in every slot relative to its mass mean, m; none where it is rigid or undeformed.
    pub displacements: Vec<Option<Vec<f64>>>,
    /// Sweeps over all contacts that the equilibrium took; 0 without a precompression.
    pub sweeps: u32,
}

impl Rest {
    /// Of a scene; nothing is factored without a precompression.
    pub(crate) fn new(arrangement: &Arrangement, interfaces: &Interfaces, scene: &Scene) -> Result<Self, FeaError> {
        let (chain, force) = (&scene.chain, scene.chain.precompression);
        let mut disc = None;
        let (rest, displacements) = if force > 0.0 {
            if let Some((contact, gap)) = chain.first_open_gap() {
                return Err(FeaError::OpenGapUnderPrecompression { force, contact, gap });
            }
            let mut statics = Statics::new(arrangement, interfaces)?;
            disc = held(arrangement.front.as_ref(), force)?;
            if let Some(disc) = &disc {
                statics.soften_last(arrangement, &disc.points)?;
            }
            let rest = statics.under(arrangement, force)?;
            let displacements = statics.displacements(arrangement, interfaces, &rest.forces);
            (rest, displacements)
        } else {
            (Equilibrium::unpressed(arrangement), vec![None; arrangement.beads.len() + 2])
        };
        let sweeps = rest.sweeps;
        let mut overlaps: Vec<f64> =
            rest.approaches.iter().zip(scene.gaps()).map(|(approach, gap)| approach - gap).collect();
        let (mut contacts, mut gaps) = (Vec::new(), Vec::new());
        for ((forces, &pair), overlap) in rest.forces.into_iter().zip(&arrangement.contacts).zip(&overlaps) {
            let pair = &arrangement.pairs[pair];
            let mut state = ContactState::open(forces.len());
            state.pressing = forces.iter().zip(&pair.axial_before).map(|(force, axial)| force * axial).sum();
            state.forces = forces;
            contacts.push(state);
            gaps.push(pair.gaps.iter().zip(&pair.axial_before).map(|(gap, axial)| gap - axial * overlap).collect());
        }
        let mut gaps: Vec<Vec<f64>> = gaps;
        if let (Some(disc), [.., gaps], [.., last], [.., overlap]) =
            (disc, &mut gaps[..], &contacts[..], &mut overlaps[..])
        {
            let (points, modes) = disc.under(&last.forces);
            gaps.iter_mut().zip(points).for_each(|(gap, retreat)| *gap += retreat);
            *overlap -= modes;
        }
        Ok(Self { contacts, gaps, overlaps, displacements, sweeps })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        contact_law::{FiniteBody, bead_flat_stiffness, bead_pair_stiffness},
        fea::contact::complementarity::Ordering,
        scene::{self, FlatContact},
    };

    #[test]
    fn one_spring_gives_way_by_its_compliance_times_the_force() {
        let compliance = Compliance::new(vec![2e-7], 1, Ordering::Prefix).unwrap();
        let mut forces = [0.0];
        let approach = force_at(&compliance, &[1.0], &[1e-6], 3.0, 0.0, &mut forces).unwrap();
        assert!((approach - 1.6e-6).abs() < 1e-20 && (forces[0] - 3.0).abs() < 1e-13, "{approach:e} {forces:?}");
    }

    #[test]
    fn springs_at_an_angle_share_a_force_by_its_axial_part() {
        // Two points with normals of axial part 0.6 and 0.8, the second 0.1 µm off.
        let compliance = Compliance::new(vec![1e-7, 0.0, 0.0, 1e-7], 2, Ordering::Any).unwrap();
        let (axial, free) = ([0.6, 0.8], [0.0, 1e-7]);
        let mut forces = [0.0; 2];
        let d = force_at(&compliance, &axial, &free, 5.0, 1e-6, &mut forces).unwrap();
        for i in 0..2 {
            assert!((forces[i] - (axial[i] * d - free[i]) / 1e-7).abs() < 1e-12);
        }
        assert!((axial[0] * forces[0] + axial[1] * forces[1] - 5.0).abs() < 1e-12);
    }

    #[test]
    fn a_static_chain_carries_one_force_at_the_overlaps_of_squeezed_beads() {
        let scene = scene::load("rigid", &["model.kind=fea".into(), "model.mesh_density=8".into()]).unwrap();
        let arrangement = Arrangement::new(&scene).unwrap();
        let interfaces = Interfaces::new(&arrangement);
        let rest = Statics::new(&arrangement, &interfaces).unwrap().under(&arrangement, 1.0).unwrap();
        for (contact, forces) in rest.forces.iter().enumerate() {
            let axial = &arrangement.pairs[arrangement.contacts[contact]].axial_before;
            let sum: f64 = forces.iter().zip(axial).map(|(force, axial)| force * axial).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{contact}: {sum}");
        }
        let bead = &scene.chain.beads[0];
        let middle = rest.approaches[3];
        let hertz = bead_pair_stiffness(bead, bead) * middle.powf(1.5);
        let excess = FiniteBody::BeadsSqueezed.excess(middle, bead.radius);
        // The issue of the mesh: 0.4 % of the force at density 8 and half a micrometre.
        assert!((1.0 / hertz - 1.0 - excess).abs() < 4e-3, "{} {excess}", 1.0 / hertz - 1.0);
        // Piston and support are mirror images.
        assert!((rest.approaches[0] / rest.approaches[6] - 1.0).abs() < 1e-9);
        assert!(rest.approaches[0] < (1.0 / bead_flat_stiffness(bead, FlatContact::Rigid)).powf(2.0 / 3.0));
    }

    #[test]
    fn nothing_is_computed_without_a_force() {
        let scene = scene::load("rigid", &["model.kind=fea".into(), "model.mesh_density=4".into()]).unwrap();
        let arrangement = Arrangement::new(&scene).unwrap();
        let rest = Rest::new(&arrangement, &Interfaces::new(&arrangement), &scene).unwrap();
        assert!(rest.displacements.iter().all(Option::is_none) && rest.overlaps.iter().all(|d| *d == 0.0));
    }
}
