//! The instant of the largest contact force, and the stress around that contact then.

use serde::{Deserialize, Serialize};

use super::{Simulation, arrangement::Arrangement, assembly::Columns, frame, trace};
use crate::response::FieldBody;

/// Follows an analysis and keeps the displacements of the two bodies at the contact that presses hardest.
///
/// Keeping costs a copy of two vectors in steps that set a new largest force, a comparison a contact in all others. What is kept goes
/// with a saved state, so that a run taken up again ends with the same.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    kept: Option<Kept>,
}

/// The largest force so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Kept {
    time_s: f64,
    /// Counted from 0 at the piston.
    contact: usize,
    force_n: f64,
    radius_m: f64,
    /// The point that presses hardest.
    point: usize,
    /// Displacements of the bodies before and after the contact, m; empty where rigid.
    displacement: [Vec<f64>; 2],
}

/// The bodies at the contact of the largest force.
#[derive(Debug, Clone, PartialEq)]
pub struct PeakStress {
    /// When, s.
    pub time: f64,
    /// Contact, counted from 1 at the piston.
    pub contact: usize,
    /// What touches there, from the piston's side: names such as `bead 3`.
    pub names: [String; 2],
    /// Axial force of all pressed points, N, without that of a dashpot.
    pub force: f64,
    /// Contact radius, or half width of the band on a ring, m.
    pub radius: f64,
    /// Where the undeformed surfaces touch (r, z), m; 0 is the piston's face.
    pub place: [f64; 2],
    /// The body before and after the contact, with displacement and stress; none where it is rigid. Displacements are relative to that of
    /// the body's surface at [`place`](Self::place), so that the deformed surfaces meet there.
    pub bodies: [Option<FieldBody>; 2],
}

impl Peak {
    /// Look at the contacts as they are now.
    pub fn follow(&mut self, simulation: &Simulation) {
        let largest = self.kept.as_ref().map_or(0.0, |kept| kept.force_n);
        let forces = simulation.contacts().iter().map(|contact| contact.pressing);
        let Some((contact, force_n)) = forces.enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b)) else { return };
        if !(force_n > largest) {
            return;
        }
        let arrangement = simulation.arrangement();
        let state = &simulation.contacts()[contact];
        let hardest = state.forces.iter().enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b));
        let body = |slot: usize| {
            let columns = simulation.motion().columns(slot);
            columns.map_or_else(Vec::new, |(displacement, _, column)| displacement.column(column))
        };
        self.kept = Some(Kept {
            time_s: simulation.time(),
            contact,
            force_n,
            radius_m: trace::contact_radius(&arrangement.pairs[arrangement.contacts[contact]], state),
            point: hardest.map_or(0, |(point, _)| point),
            displacement: [body(contact), body(contact + 1)],
        });
    }

    /// Whether what is kept is of a contact of these bodies.
    #[must_use]
    pub fn fits(&self, arrangement: &Arrangement) -> bool {
        self.kept.as_ref().is_none_or(|kept| kept.contact < arrangement.contacts.len())
    }

    /// The stress of the two bodies at that instant; none if nothing ever pressed.
    #[must_use]
    pub fn stress(&self, arrangement: &Arrangement) -> Option<PeakStress> {
        let kept = self.kept.as_ref()?;
        let slots = [kept.contact, kept.contact + 1];
        let place = place(arrangement, kept)?;
        let mut bodies = [None, None];
        for ((body, slot), values) in bodies.iter_mut().zip(slots).zip(&kept.displacement) {
            *body = deformed(arrangement, slot, values, place);
        }
        Some(PeakStress {
            time: kept.time_s,
            contact: kept.contact + 1,
            names: slots
                .map(|slot| if slot > arrangement.beads.len() { "support".into() } else { arrangement.name(slot) }),
            force: kept.force_n,
            radius: kept.radius_m,
            place,
            bodies,
        })
    }
}

/// Where the undeformed surfaces touch.
fn place(arrangement: &Arrangement, kept: &Kept) -> Option<[f64; 2]> {
    let pair = &arrangement.pairs[arrangement.contacts[kept.contact]];
    if let Some(ring) = &pair.ring {
        let [r, z] = *ring.points.get(kept.point)?;
        return Some([r, z + arrangement.origins.get(kept.contact)?]);
    }
    let before = kept.contact.checked_sub(1).and_then(|_| arrangement.kind(kept.contact));
    let z = match before {
        Some(kind) => arrangement.origins.get(kept.contact - 1)? + trace::poles(arrangement.kinds[kind].mesh()).1,
        None => 0.0,
    };
    Some([0.0, z])
}

/// A body with its stress, moved so that its surface at `place` stays where it is.
fn deformed(arrangement: &Arrangement, slot: usize, values: &[f64], place: [f64; 2]) -> Option<FieldBody> {
    let body = &arrangement.kinds[arrangement.kind(slot)?];
    let offset = *arrangement.origins.get(slot.checked_sub(1)?)?;
    if values.len() != body.dofs().len() {
        return None;
    }
    let displacement = |node: usize| [values[2 * node], values[2 * node + 1]];
    let distance = |[r, z]: [f64; 2]| (r - place[0]).hypot(z + offset - place[1]);
    let nodes = &body.mesh().nodes;
    let (nearest, _) = nodes.iter().enumerate().min_by(|(_, a), (_, b)| distance(**a).total_cmp(&distance(**b)))?;
    let still = displacement(nearest);
    let mut out = FieldBody::at_rest(arrangement.name(slot), body.mesh().to_field_mesh().into(), offset);
    out.displacement = (0..nodes.len()).map(|node| [0, 1].map(|d| displacement(node)[d] - still[d])).collect();
    out.stress = frame::stress(body, &Columns::from_vector(values), 0);
    out.von_mises = out.stress.iter().map(|stress| super::element::von_mises(*stress)).collect();
    Some(out)
}
