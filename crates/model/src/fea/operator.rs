//! Everything linear of one step size: a factor for each kind of body, and the compliances of the contacts condensed on them.

use super::{
    FeaError,
    arrangement::Arrangement,
    contact::{
        chain::{Contacts, DashpotBase, Link, Mobility},
        complementarity::Compliance,
        face::Face,
        pair::Pair,
    },
    factor::Factor,
    loss::StepLoss,
    scheme::Coefficients,
};

#[derive(Debug, Clone)]
pub(crate) struct Operator {
    pub coefficients: Coefficients,
    /// Factor of M + (1 − α) β h² K of every kind of body, with drag and material loss where it has any (`loss.rs`).
    pub factors: Vec<Factor>,
    /// What every kind loses in a step; none where nothing.
    pub(crate) losses: Vec<Option<StepLoss>>,
    pub contacts: Contacts,
}

/// The contacts' faces, numbered over the interface unknowns of their kind: the same for all step sizes.
#[derive(Debug, Clone)]
pub(crate) struct Interfaces {
    /// Interface unknowns of every kind, ascending.
    pub unknowns: Vec<Vec<u32>>,
    /// Faces of every contact on the bodies before and after it; empty where that body is rigid.
    pub faces: Vec<[Face; 2]>,
}

impl Interfaces {
    pub(crate) fn new(arrangement: &Arrangement) -> Self {
        Self::including(arrangement, |_| Vec::new())
    }

    /// The same with further unknowns of every kind, such as those watched at its centre.
    pub(crate) fn including(arrangement: &Arrangement, further: impl Fn(usize) -> Vec<u32>) -> Self {
        let unknowns: Vec<Vec<u32>> = (0..arrangement.kinds.len())
            .map(|kind| {
                let mut unknowns = arrangement.interface(kind);
                unknowns.extend(further(kind));
                unknowns.sort_unstable();
                unknowns.dedup();
                unknowns
            })
            .collect();
        let local = |slot: usize, face: &Face| match arrangement.kind(slot) {
            None => Face::default(),
            Some(kind) => face.renumbered(|unknown| {
                // Every unknown of a face is in its kind's list by construction.
                unknowns[kind].binary_search(&unknown).map_or(u32::MAX, |position| position as u32)
            }),
        };
        let faces = arrangement
            .contacts
            .iter()
            .enumerate()
            .map(|(contact, &pair)| {
                let pair: &Pair = &arrangement.pairs[pair];
                [local(contact, &pair.before), local(contact + 1, &pair.after)]
            })
            .collect();
        Self { unknowns, faces }
    }

    /// Forces (N) on the interface unknowns of the body in a slot, from those of the points of the contacts around it.
    pub(crate) fn press<'a>(
        &self,
        slot: usize,
        of_contact: impl Fn(usize) -> Option<&'a Vec<f64>>,
        on_unknowns: &mut [f64],
    ) {
        on_unknowns.fill(0.0);
        for (contact, side) in [(slot - 1, 1), (slot, 0)] {
            if let Some(forces) = of_contact(contact) {
                self.faces[contact][side].press(forces, on_unknowns);
            }
        }
    }

    /// Gaps of all contacts (m) from those at zero displacement, the piston's displacement (m) and that of the bodies' interfaces:
    /// `value(slot, row)`, none where the body is rigid.
    pub(crate) fn gaps(
        &self,
        rest: &[Vec<f64>],
        links: &[Link],
        piston: f64,
        value: impl Fn(usize, usize) -> Option<f64>,
        out: &mut [Vec<f64>],
    ) {
        for (contact, gaps) in out.iter_mut().enumerate() {
            gaps.copy_from_slice(&rest[contact]);
            for (slot, face) in [contact, contact + 1].into_iter().zip(&self.faces[contact]) {
                if slot == 0 {
                    gaps.iter_mut().zip(&links[0].axial_before).for_each(|(gap, axial)| *gap -= axial * piston);
                } else if !face.is_empty() {
                    for (i, gap) in gaps.iter_mut().enumerate() {
                        *gap -= face
                            .terms(i)
                            .map(|(row, coefficient)| coefficient * value(slot, row).unwrap_or(0.0))
                            .sum::<f64>();
                    }
                }
            }
        }
    }

    /// W of a contact row by row, times `weight`, into `matrix`: both its faces on bodies that answer with the dense matrices `inverse` (one a
    /// kind, m/N).
    pub(crate) fn compliance(
        &self,
        arrangement: &Arrangement,
        contact: usize,
        inverse: &[Vec<f64>],
        weight: f64,
        matrix: &mut [f64],
    ) {
        matrix.fill(0.0);
        for (slot, face) in [contact, contact + 1].into_iter().zip(&self.faces[contact]) {
            if let Some(kind) = arrangement.kind(slot) {
                face.add_compliance(face, &inverse[kind], self.unknowns[kind].len(), matrix);
            }
        }
        matrix.iter_mut().for_each(|value| *value *= weight);
    }

    /// V of a contact row by row, times `weight`, into `matrix`: across the body of that kind to the contact before.
    fn coupling(&self, contact: usize, kind: usize, inverse: &[Vec<f64>], weight: f64, matrix: &mut [f64]) {
        matrix.fill(0.0);
        let [own, other] = [&self.faces[contact][0], &self.faces[contact - 1][1]];
        own.add_compliance(other, &inverse[kind], self.unknowns[kind].len(), matrix);
        matrix.iter_mut().for_each(|value| *value *= weight);
    }
}

/// Links, compliances W and couplings V of all contacts, as [`Contacts`] has them.
pub(crate) type Condensed = (Vec<Link>, Vec<Compliance>, Vec<Vec<f64>>);

/// Compliances and couplings of all contacts on bodies whose interfaces answer with the dense matrices `inverse` (one a kind, m/N),
/// times `weight`.
pub(crate) fn condensed(
    arrangement: &Arrangement,
    interfaces: &Interfaces,
    inverse: &[Vec<f64>],
    weight: f64,
) -> Result<Condensed, FeaError> {
    let (mut links, mut compliances, mut couplings) = (Vec::new(), Vec::new(), Vec::new());
    let mut known_compliances = Vec::new();
    let mut known_couplings = Vec::new();
    for (contact, &pair) in arrangement.contacts.iter().enumerate() {
        let kinds = [arrangement.kind(contact), arrangement.kind(contact + 1)];
        let geometry = &arrangement.pairs[pair];
        let n = geometry.len();
        let key = (pair, kinds);
        let compliance = match known_compliances.iter().position(|known| *known == key) {
            Some(known) => known,
            None => {
                let mut matrix = vec![0.0; n * n];
                interfaces.compliance(arrangement, contact, inverse, weight, &mut matrix);
                if contact + 1 == arrangement.contacts.len() && arrangement.spring.is_finite() {
                    // The flat gives way by F/K wherever it is pressed.
                    matrix.iter_mut().for_each(|value| *value += 1.0 / arrangement.spring);
                }
                let compliance = Compliance::new(matrix, n, geometry.ordering)
                    .map_err(|_| FeaError::Compliance { contact: contact + 1 })?;
                known_compliances.push(key);
                compliances.push(compliance);
                compliances.len() - 1
            }
        };
        let coupling = match (contact, kinds[0]) {
            (1.., Some(kind)) => {
                let earlier = arrangement.contacts[contact - 1];
                let key = (pair, earlier, kind);
                Some(match known_couplings.iter().position(|known| *known == key) {
                    Some(known) => known,
                    None => {
                        let mut matrix = vec![0.0; n * interfaces.faces[contact - 1][1].len()];
                        interfaces.coupling(contact, kind, inverse, weight, &mut matrix);
                        known_couplings.push(key);
                        couplings.push(matrix);
                        couplings.len() - 1
                    }
                })
            }
            _ => None,
        };
        links.push(Link {
            compliance,
            coupling,
            axial_before: geometry.axial_before.clone(),
            axial_after: geometry.axial_after.clone(),
            dashpot: arrangement.dashpots[contact],
        });
    }
    Ok((links, compliances, couplings))
}

/// Let the last contact give way besides by a compliance of its points (row by row, m/N).
pub(super) fn soften(own: &mut Compliance, arrangement: &Arrangement, further: &[f64]) -> Result<(), FeaError> {
    let rows = (0..own.size()).flat_map(|row| own.row(row)).zip(further);
    let matrix = rows.map(|(own, further)| own + further).collect();
    let contact = arrangement.contacts.len();
    let ordering = arrangement.pairs[arrangement.contacts[contact - 1]].ordering;
    *own = Compliance::new(matrix, own.size(), ordering).map_err(|_| FeaError::Compliance { contact })?;
    Ok(())
}

impl Operator {
    /// Factor all kinds of bodies for steps of these coefficients and condense them on the contacts.
    pub(crate) fn new(
        arrangement: &Arrangement,
        interfaces: &Interfaces,
        coefficients: Coefficients,
        tension: bool,
    ) -> Result<Self, FeaError> {
        let gain = coefficients.new_force_gain();
        let losses: Vec<Option<StepLoss>> =
            arrangement.losses.iter().map(|loss| loss.map(|loss| StepLoss::new(loss, &coefficients))).collect();
        let factors = arrangement.of_kinds(&interfaces.unknowns, |kind, body, interface| {
            let scales = losses[kind].map_or((1.0, 1.0), |loss| (loss.stiffness_scale(), loss.mass_scale()));
            Factor::new(body, gain * scales.0, scales.1, interface)
        })?;
        let inverse: Vec<Vec<f64>> = factors.iter().map(Factor::interface_compliance).collect();
        let (links, compliances, couplings) = condensed(arrangement, interfaces, &inverse, gain)?;
        let slots = arrangement.beads.len() + 2;
        let mobilities = (0..slots)
            .map(|slot| match arrangement.kind(slot) {
                Some(kind) if arrangement.kinds[kind].is_free() => {
                    let mass = arrangement.kinds[kind].total_mass();
                    let braking = losses[kind].map_or(1.0, |loss| loss.mass_scale());
                    let per_force = (1.0 - coefficients.lag) / (mass * braking);
                    Mobility {
                        displacement: per_force * coefficients.gain,
                        velocity: per_force * coefficients.gamma * coefficients.step,
                    }
                }
                _ => Mobility::default(),
            })
            .collect();
        let contacts =
            Contacts { links, compliances, couplings, mobilities, dashpot_base: DashpotBase::default(), tension };
        Ok(Self { coefficients, factors, losses, contacts })
    }

    /// Let what the last contact touches give way besides by a compliance of its points (row by row, m/N).
    pub(crate) fn soften_last(&mut self, arrangement: &Arrangement, further: &[f64]) -> Result<(), FeaError> {
        let last = arrangement.contacts.len() - 1;
        soften(&mut self.contacts.compliances[self.contacts.links[last].compliance], arrangement, further)
    }
}
