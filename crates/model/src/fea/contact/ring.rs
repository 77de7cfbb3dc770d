//! A sphere on a ring whose normals move with it.
//!
//! The exact gap of point i of the ring is its distance from the displaced sphere, less what the sphere's surface bulges beyond it:
//!
//! g_i = |X_i + u_i − C − U ẑ| − a − n_i · (w_i − U ẑ),   n_i = (X_i + u_i − C − U ẑ)/|…|
//!
//! - X_i, u_i: point of the ring and its displacement, m
//! - C, U, a: centre, rigid displacement along z and radius of the sphere, m
//! - w_i: displacement of the sphere's surface at the foot of the undeformed normal, rigid motion included, m
//!
//! With the normals of the undeformed bodies kept, the force is too large by 0.19 % per µm of travel for the resin annulus under a 1 mm
//! bead. About the displacements of an iterate the gap is linear again, with that iterate's normals.

use super::face::{Face, OnEdge};
use crate::fea::{
    assembly::{Direction, DofMap},
    body::Body,
};

/// Largest change of a gap by a turn of the normals that is not worth another, m: a hundred roundings of the distances it comes from. The
/// turn itself is the square root of it, and the forces belong to the normals before it.
pub(crate) const SETTLED: f64 = 1e-17;

/// The outward normal of the sphere is n, that of the ring −n.
const SIGNS: [f64; 2] = [1.0, -1.0];

/// One term of a face: the part of a point's displacement along r or z that it measures.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    point: usize,
    axis: usize,
    weight: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Ring {
    /// Radius a of the sphere, m.
    pub radius: f64,
    /// z of the sphere's centre in the support's own coordinates, m.
    pub centre: f64,
    /// Points of the ring (r, z) in the support's own coordinates, m.
    pub points: Vec<[f64; 2]>,
    /// Where each point's normal meets the sphere's meshed surface.
    pub feet: Vec<OnEdge>,
    pub nodes: Vec<u32>,
    parts: [Vec<Part>; 2],
}

/// The gaps about some displacements: g = offset − n · (w − u).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Linearised {
    /// Normals n of the sphere at every point, (r, z).
    pub normals: Vec<[f64; 2]>,
    /// Gaps at zero displacement, m.
    pub offsets: Vec<f64>,
}

impl Linearised {
    pub(crate) fn new(points: usize) -> Self {
        Self { normals: vec![[0.0; 2]; points], offsets: vec![0.0; points] }
    }
}

impl Ring {
    /// Points (r, z), the feet of their normals on the sphere, and the support's nodes there.
    pub(crate) fn new(radius: f64, centre: f64, points: Vec<[f64; 2]>, feet: Vec<OnEdge>, nodes: Vec<u32>) -> Self {
        Self { radius, centre, points, feet, nodes, parts: [Vec::new(), Vec::new()] }
    }

    pub(crate) fn at_rest(&self) -> Linearised {
        let mut linearised = Linearised::new(self.points.len());
        self.linearise(|_| [[0.0; 2]; 2], 0.0, &mut linearised);
        linearised
    }

    /// The gaps about given displacements of the sphere's surface at the feet and of the ring's points, `moved(i)` = [w, u], and the
    /// sphere's rigid displacement, all m. Returns by how much any gap at these displacements differs from the old `linearised`'s, m.
    fn linearise(&self, moved: impl Fn(usize) -> [[f64; 2]; 2], rigid: f64, linearised: &mut Linearised) -> f64 {
        let mut change: f64 = 0.0;
        let values = linearised.normals.iter_mut().zip(&mut linearised.offsets);
        for (i, ((normal, offset), point)) in values.zip(&self.points).enumerate() {
            let [w, u] = moved(i);
            let arm = [point[0] + u[0], point[1] + u[1] - self.centre - rigid];
            let distance = arm[0].hypot(arm[1]);
            let n = [arm[0] / distance, arm[1] / distance];
            let gap = distance - self.radius - (n[0] * w[0] + n[1] * (w[1] - rigid));
            let linear = |n: [f64; 2]| n[0] * (w[0] - u[0]) + n[1] * (w[1] - u[1]);
            change = change.max((gap - (*offset - linear(*normal))).abs());
            (*normal, *offset) = (n, gap + linear(n));
        }
        change
    }

    /// Faces of the sphere and of the ring for the given normals of the sphere.
    pub(crate) fn faces(&mut self, sphere: &Body, support: &Body, normals: &[[f64; 2]]) -> [Face; 2] {
        let mut parts = [Vec::new(), Vec::new()];
        let mut face = |side: usize, body: &Body, place: &dyn Fn(usize) -> OnEdge, sign: f64| {
            Face::new((0..self.points.len()).map(|point| {
                let mut list = Vec::with_capacity(6);
                for (node, weight) in place(point).nodes.into_iter().zip(place(point).weights) {
                    // A weight this small is the rounding of a foot at a node.
                    if weight.abs() < 1e-13 {
                        continue;
                    }
                    for (axis, direction) in [Direction::Radial, Direction::Axial].into_iter().enumerate() {
                        let unknown = DofMap::dof(node, direction);
                        if body.dofs().is_free(unknown) {
                            let weight = sign * weight;
                            parts[side].push(Part { point, axis, weight });
                            list.push((unknown, weight * normals[point][axis]));
                        }
                    }
                }
                (list, sign * normals[point][1])
            }))
        };
        let feet = face(0, sphere, &|point| self.feet[point], SIGNS[0]);
        let nodes =
            face(1, support, &|point| OnEdge { nodes: [self.nodes[point]; 3], weights: [1.0, 0.0, 0.0] }, SIGNS[1]);
        self.parts = parts;
        [feet, nodes]
    }

    /// Take the normals of given displacements: `value(side, unknown)` of the unknowns of the faces, `rigid` of the sphere as a whole, and the
    /// `overlap` of the undisplaced bodies, which is a displacement of the sphere too (all m). Turns the faces, sets the gaps at zero
    /// displacement (m), and returns by how much any gap at these displacements differs from what the old normals gave, m; [`SETTLED`] when
    /// there is no more to gain.
    pub(crate) fn follow(
        &self,
        faces: &mut [Face; 2],
        value: impl Fn(usize, usize) -> f64,
        rigid: f64,
        overlap: f64,
        linearised: &mut Linearised,
        gaps: &mut [f64],
    ) -> f64 {
        let moved = |i: usize| {
            let mut moved = self.moved(faces, i, &value);
            moved[0][1] += overlap;
            moved
        };
        let change = self.linearise(moved, rigid + overlap, linearised);
        self.turn(&linearised.normals, faces);
        for ((gap, normal), offset) in gaps.iter_mut().zip(&linearised.normals).zip(&linearised.offsets) {
            *gap = offset - normal[1] * overlap;
        }
        change
    }

    fn turn(&self, normals: &[[f64; 2]], faces: &mut [Face; 2]) {
        for ((face, parts), sign) in faces.iter_mut().zip(&self.parts).zip(SIGNS) {
            face.reweigh(|k| parts[k].weight * normals[parts[k].point][parts[k].axis], |i| sign * normals[i][1]);
        }
    }

    /// Displacement (r, z) of point i measured by the terms of one side (0 the sphere, 1 the ring), `value(k)` being the displacement of the
    /// unknown of term k.
    fn measured(&self, side: usize, range: std::ops::Range<usize>, value: impl Fn(usize) -> f64) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for k in range {
            let Part { axis, weight, .. } = self.parts[side][k];
            sum[axis] += SIGNS[side] * weight * value(k);
        }
        sum
    }

    /// Displacements [w, u] (r, z) of the foot on the sphere and of the ring's point i; `value(side, unknown)` is the displacement of an
    /// unknown of the faces on that side, m.
    fn moved(&self, faces: &[Face; 2], i: usize, value: impl Fn(usize, usize) -> f64) -> [[f64; 2]; 2] {
        [0, 1].map(|side| {
            let range = faces[side].range(i);
            self.measured(side, range, |k| value(side, faces[side].unknown(k)))
        })
    }
}

/// Terms of normal · u at a point of an edge; nodes with weight zero and fixed unknowns fall away.
pub(super) fn terms(body: &Body, place: &OnEdge, normal: [f64; 2]) -> Vec<(u32, f64)> {
    let mut terms = Vec::with_capacity(6);
    for (&node, weight) in place.nodes.iter().zip(place.weights) {
        for (direction, part) in [(Direction::Radial, normal[0]), (Direction::Axial, normal[1])] {
            let unknown = DofMap::dof(node, direction);
            if body.dofs().is_free(unknown) && (weight * part).abs() > 1e-13 {
                terms.push((unknown, weight * part));
            }
        }
    }
    terms
}
