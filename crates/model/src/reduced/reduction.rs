//! Bodies seen from the points of their contacts: all that a run needs of meshes and factors.

use serde::{Deserialize, Serialize};

use super::{array, basis::Basis};
use crate::{
    ModelError,
    fea::{
        arrangement::Arrangement, contact::complementarity::Ordering, operator::Interfaces,
        simulation::FIXED_NORMAL_TRAVEL, trace::Watched,
    },
    response::Response,
    scene::Scene,
    water::front::Front,
};

/// The bodies of a scene, reduced to their contact points and modes. Immutable; any number of runs may share it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reduction {
    pub kinds: Vec<Kind>,
    pub faces: Vec<Face>,
    pub members: Vec<Member>,
    pub beads: Vec<usize>,
    /// Member of the support; none where it is rigid.
    pub support: Option<usize>,
    pub geometries: Vec<Geometry>,
    pub contacts: Vec<usize>,
    /// The front of the disc, where the support is a disc on water; it is not kept in a cache.
    #[serde(skip)]
    pub front: Option<Front>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Kind {
    pub mass: f64,
    pub is_free: bool,
    /// ω² of its elastic modes, 1/s², ascending.
    #[serde(with = "array")]
    pub squares: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Face {
    pub kind: usize,
    /// Outward normal displacement of every point per rigid displacement along z, 1.
    #[serde(with = "array")]
    pub axial: Vec<f64>,
    /// The same of every mode, mode by mode, 1/√kg.
    #[serde(with = "array")]
    pub shapes: Vec<f64>,
    /// Static compliance S between the points, row by row, m/N.
    #[serde(with = "array")]
    pub compliance: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Member {
    pub kind: usize,
    pub front: usize,
    pub back: Option<usize>,
    /// Static compliance S between the points of its back and its front, row by row, m/N.
    #[serde(with = "array")]
    pub crossing: Vec<f64>,
    /// Its centre and, of the last bead, its far pole.
    pub watched: Vec<Watch>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Watch {
    /// Its displacement along z by every mode, 1/√kg.
    #[serde(with = "array")]
    pub shapes: Vec<f64>,
    /// Its static displacement along z per force on every point of the front, and of the back, m/N.
    #[serde(with = "array")]
    pub front: Vec<f64>,
    #[serde(with = "array")]
    pub back: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Gaps of the touching, undeformed bodies, m.
    #[serde(with = "array")]
    pub gaps: Vec<f64>,
    /// Axial part of the normal towards the support, 1.
    #[serde(with = "array")]
    pub axial: Vec<f64>,
    /// Place along the contact, m: the radius at a pole.
    #[serde(with = "array")]
    pub positions: Vec<f64>,
    pub is_ring: bool,
    /// Whether its pressed points are a prefix in nearly all states.
    pub is_prefix: bool,
    /// Whether both bodies are flat there: no contact is then too large.
    pub is_flat: bool,
}

impl Geometry {
    pub(crate) fn ordering(&self) -> Ordering {
        if self.is_prefix { Ordering::Prefix } else { Ordering::Any }
    }
}

impl Reduction {
    /// Mesh and reduce the bodies of a scene to at most `model.modes` elastic modes each.
    pub(crate) fn new(scene: &Scene) -> Result<Self, ModelError> {
        let arrangement = Arrangement::new(&plain(scene))?;
        let watched = Watched::new(&arrangement);
        let last = arrangement.beads.len() - 1;
        let interfaces = Interfaces::including(&arrangement, |kind| {
            let mut unknowns = Vec::new();
            for (bead, _) in arrangement.beads.iter().enumerate().filter(|(_, own)| **own == kind) {
                unknowns.push(watched.centres[bead]);
                if bead == last {
                    unknowns.push(watched.pole);
                }
            }
            unknowns
        });
        let modes = scene.model.reduced.modes as usize;
        let bases = (0..arrangement.kinds.len())
            .map(|kind| Basis::new(&arrangement, kind, &interfaces.unknowns[kind], modes))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Assembly::new(&arrangement, &interfaces, &bases).reduction(&watched))
    }
}

impl Reduction {
    /// Frequencies of the elastic modes of all kinds of bodies, Hz.
    pub(crate) fn mode_frequencies(&self, scene: &Scene) -> Vec<f64> {
        let support = self.support.map(|member| self.members[member].kind);
        let factor = scene.support.ring().map_or(1.0, |(_, factor, _)| factor);
        let of = |(kind, body): (usize, &Kind)| {
            let factor = if support == Some(kind) { factor } else { 1.0 };
            body.squares.iter().map(|square| (factor * square).sqrt() / std::f64::consts::TAU).collect::<Vec<_>>()
        };
        self.kinds.iter().enumerate().flat_map(of).collect()
    }

    /// What a reader of the results must know: limits of the model that the run passed.
    pub(crate) fn warnings(&self, response: &Response) -> Vec<String> {
        let is_ring = self.contacts.last().is_some_and(|&geometry| self.geometries[geometry].is_ring);
        let travel = response
            .bead_displacement
            .last()
            .filter(|_| is_ring)
            .map_or(0.0, |displacement| displacement.values.iter().fold(0.0, |most: f64, value| most.max(*value)));
        if travel <= FIXED_NORMAL_TRAVEL {
            return Vec::new();
        }
        let travel = 1e6 * travel;
        vec![format!(
            "the last bead moved {travel:.1} um into its support; past 5 um its force is 1 % and more too large (0.19 % per um: contact normals are \
             those of the undeformed surfaces)"
        )]
    }
}

/// The scene with its support as stiff as its material: a run applies the factor itself.
pub(super) fn plain(scene: &Scene) -> Scene {
    let mut plain = scene.clone();
    if let (Some(_), Some(factor)) = (scene.support.ring(), plain.support.stiffness_mut()) {
        *factor = 1.0;
    }
    plain
}

struct Assembly<'a> {
    arrangement: &'a Arrangement,
    interfaces: &'a Interfaces,
    bases: &'a [Basis],
    faces: Vec<Face>,
    /// Pair, side and kind of every face.
    known: Vec<(usize, usize, usize)>,
}

impl<'a> Assembly<'a> {
    fn new(arrangement: &'a Arrangement, interfaces: &'a Interfaces, bases: &'a [Basis]) -> Self {
        Self { arrangement, interfaces, bases, faces: Vec::new(), known: Vec::new() }
    }

    fn size(&self, kind: usize) -> usize {
        self.interfaces.unknowns[kind].len()
    }

    /// The face of the body in a slot at the contact before it (side 1 of it) or after it (side 0).
    fn face(&mut self, slot: usize, contact: usize, side: usize, kind: usize) -> usize {
        debug_assert_eq!(contact + side, slot);
        let key = (self.arrangement.contacts[contact], side, kind);
        if let Some(found) = self.known.iter().position(|known| *known == key) {
            return found;
        }
        let (face, basis) = (&self.interfaces.faces[contact][side], &self.bases[kind]);
        let normal = |unknowns: &[f64]| (0..face.len()).map(|i| face.displacement(i, unknowns)).collect::<Vec<_>>();
        let rigid: Vec<f64> = basis.axial.iter().map(|&axial| f64::from(u8::from(axial))).collect();
        let mut compliance = vec![0.0; face.len() * face.len()];
        face.add_compliance(face, &basis.compliance, self.size(kind), &mut compliance);
        let shapes = basis.shapes.iter().flat_map(|shape| normal(shape)).collect();
        self.faces.push(Face { kind, axial: normal(&rigid), shapes, compliance });
        self.known.push(key);
        self.faces.len() - 1
    }

    fn member(&mut self, slot: usize, kind: usize, watched: &[u32]) -> Member {
        let front = self.face(slot, slot - 1, 1, kind);
        let has_back = slot < self.arrangement.contacts.len();
        let back = has_back.then(|| self.face(slot, slot, 0, kind));
        let (basis, size) = (&self.bases[kind], self.size(kind));
        let before = &self.interfaces.faces[slot - 1][1];
        let after = has_back.then(|| &self.interfaces.faces[slot][0]);
        let mut crossing = vec![0.0; after.map_or(0, |after| after.len() * before.len())];
        if let Some(after) = after {
            after.add_compliance(before, &basis.compliance, size, &mut crossing);
        }
        let watch = |unknown: &u32| {
            // Every watched unknown is in its kind's list by construction.
            let row = self.interfaces.unknowns[kind].binary_search(unknown).unwrap_or(0);
            let line = &basis.compliance[row * size..(row + 1) * size];
            let answer = |face: &crate::fea::contact::face::Face| {
                (0..face.len()).map(|i| face.displacement(i, line)).collect::<Vec<_>>()
            };
            Watch {
                shapes: basis.shapes.iter().map(|shape| shape[row]).collect(),
                front: answer(before),
                back: after.map_or_else(Vec::new, answer),
            }
        };
        Member { kind, front, back, crossing, watched: watched.iter().map(watch).collect() }
    }

    fn reduction(mut self, watched: &Watched) -> Reduction {
        let mut members: Vec<Member> = Vec::new();
        let mut beads = Vec::new();
        let last = self.arrangement.beads.len() - 1;
        for (bead, kind) in self.arrangement.beads.clone().into_iter().enumerate() {
            let mut places = vec![watched.centres[bead]];
            if bead == last {
                places.push(watched.pole);
            }
            let member = self.member(bead + 1, kind, &places);
            beads.push(members.iter().position(|known| *known == member).unwrap_or(members.len()));
            if beads[bead] == members.len() {
                members.push(member);
            }
        }
        let support = self.arrangement.support.map(|kind| {
            members.push(self.member(last + 2, kind, &[]));
            members.len() - 1
        });
        let kinds = self.bases.iter().map(|basis| Kind {
            mass: basis.mass,
            is_free: basis.is_free,
            squares: basis.stiffness.clone(),
        });
        let geometries = self.arrangement.pairs.iter().map(|pair| Geometry {
            gaps: pair.gaps.clone(),
            axial: pair.axial_before.clone(),
            positions: pair.positions.clone(),
            is_ring: pair.is_on_ring(),
            is_prefix: pair.ordering == Ordering::Prefix,
            is_flat: pair.is_flat(),
        });
        Reduction {
            kinds: kinds.collect(),
            geometries: geometries.collect(),
            contacts: self.arrangement.contacts.clone(),
            front: self.arrangement.front.clone(),
            faces: self.faces,
            members,
            beads,
            support,
        }
    }
}
