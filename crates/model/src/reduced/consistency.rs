//! Whether a reduction read from a file is one of a scene's bodies: every index leads somewhere, every list has its length, every number is finite.

use super::reduction::{Face, Geometry, Kind, Member, Reduction, Watch};
use crate::scene::Scene;

impl Reduction {
    pub(super) fn is_consistent(&self, scene: &Scene) -> bool {
        let members = self.beads.iter().chain(&self.support);
        self.beads.len() == scene.chain.beads.len()
            && self.contacts.len() == self.beads.len() + 1
            && self.support.is_some() == scene.support.is_meshed()
            && self.kinds.iter().all(Kind::is_consistent)
            && self.geometries.iter().all(Geometry::is_consistent)
            && self.faces.iter().all(|face| self.holds_face(face))
            && self.members.iter().all(|member| self.holds_member(member))
            && members.clone().all(|&member| member < self.members.len())
            && self.contacts.iter().all(|&geometry| geometry < self.geometries.len())
            && (0..self.contacts.len()).all(|contact| self.meets(contact))
            && self.beads.last().is_some_and(|&last| self.members[last].watched.len() == 2)
    }

    fn holds_face(&self, face: &Face) -> bool {
        let Face { kind, axial, shapes, compliance } = face;
        let points = axial.len();
        let modes = self.kinds.get(*kind).map(|kind| kind.squares.len());
        modes.is_some_and(|modes| shapes.len() == modes * points)
            && compliance.len() == points * points
            && [axial, shapes, compliance].into_iter().all(|values| are_finite(values))
    }

    fn holds_member(&self, member: &Member) -> bool {
        let Member { kind, front, back, crossing, watched } = member;
        let points = |face: usize| self.faces.get(face).filter(|face| face.kind == *kind).map(|face| face.axial.len());
        let (Some(front), Some(body)) = (points(*front), self.kinds.get(*kind)) else { return false };
        let Some(back) = back.map_or(Some(0), points) else { return false };
        let holds = |watch: &Watch| {
            (watch.shapes.len(), watch.front.len(), watch.back.len()) == (body.squares.len(), front, back)
                && [&watch.shapes, &watch.front, &watch.back].into_iter().all(|values| are_finite(values))
        };
        crossing.len() == back * front && are_finite(crossing) && watched.iter().all(holds)
    }

    /// Whether the faces of both bodies have the points of their contact.
    fn meets(&self, contact: usize) -> bool {
        let points = self.geometries[self.contacts[contact]].gaps.len();
        let of_face = |face: usize| self.faces[face].axial.len() == points;
        let before = self.member(contact).map(|member| self.members[member].back);
        let after = self.member(contact + 1).map(|member| self.members[member].front);
        // A bead is watched at its centre, and its back is a face.
        let watched =
            contact == 0 || self.member(contact).is_some_and(|member| !self.members[member].watched.is_empty());
        watched && before.is_none_or(|back| back.is_some_and(of_face)) && after.is_none_or(of_face)
    }
}

impl Kind {
    fn is_consistent(&self) -> bool {
        let ascending = self.squares.is_sorted() && self.squares.first().is_none_or(|least| *least > 0.0);
        self.mass > 0.0 && self.mass.is_finite() && are_finite(&self.squares) && ascending
    }
}

impl Geometry {
    fn is_consistent(&self) -> bool {
        let Self { gaps, axial, positions, .. } = self;
        !gaps.is_empty()
            && gaps.len() == axial.len()
            && gaps.len() == positions.len()
            && [gaps, axial, positions].into_iter().all(|values| are_finite(values))
    }
}

fn are_finite(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite())
}
