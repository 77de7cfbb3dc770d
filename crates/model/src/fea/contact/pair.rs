//! Geometry of a contact between two undeformed bodies: its points, their gaps, how each body is measured and pushed there.
//!
//! Gaps come from the analytic profile wherever a body is a sphere, a flat or the annulus: 0.05 µm of false gap from meshed
//! coordinates would change peaks by tens of per cent.

use super::{
    complementarity::Ordering,
    face::{Face, OnEdge, at_parameter, at_radius, tributary_areas},
};
use crate::fea::{
    assembly::{Direction, DofMap},
    body::Body,
    mesh::HalfTorus,
};

/// How far the profile of a body falls back from the plane through its pole at the radius r, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Profile {
    /// a − √(a² − r²).
    Sphere {
        /// a, m.
        radius: f64,
    },
    Meshed,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Pole<'a> {
    /// What it is called in messages, such as `bead 3`.
    pub name: &'a str,
    pub body: &'a Body,
    /// Name of its boundary there: `front` or `back`.
    pub boundary: &'static str,
    /// +1 at the back, −1 at the front: the outward normal along z.
    pub normal: f64,
    pub profile: Profile,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Face on the body towards the piston; empty where that body is rigid.
    pub before: Face,
    /// Face on the body towards the support; empty where that body is rigid.
    pub after: Face,
    /// Axial parts of the outward normals, also of rigid bodies, 1.
    pub axial_before: Vec<f64>,
    /// The same of the body towards the support.
    pub axial_after: Vec<f64>,
    /// Gap of every point when the bodies just touch, m.
    pub gaps: Vec<f64>,
    /// Distance of every point from the middle of the contact along the surface's tangent, m: r at a pole, signed on an annulus.
    pub positions: Vec<f64>,
    /// Tributary area of every point, m².
    pub areas: Vec<f64>,
    pub ordering: Ordering,
    /// z of the sphere's centre in the support's own coordinates (m), where it touches a ring.
    pub ring_centre: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PairError {
    #[error("the mesh of {body} has no boundary `{boundary}`")]
    NoBoundary { body: String, boundary: &'static str },
    #[error(
        "{body}, boundary `{boundary}`: its first node off the axis lies at r = {radius:e} m, {gap:e} m behind the pole, so that touch would be \
         felt that much too late; refine the mesh there until this is below {most:e} m (vertices about 8e-3 of the radius apart on a sphere)"
    )]
    TooCoarse { body: String, boundary: &'static str, radius: f64, gap: f64, most: f64 },
    #[error("{body}: no point of boundary `{boundary}` faces the other body; check the coordinates of the mesh")]
    NothingFaces { body: String, boundary: &'static str },
}

/// False gap that a mesh may have over the size of its body, 1: of a bead of 1 mm 5 nm, a hundredth of the overlaps of interest, which changes no peak by
/// a per cent.
const LARGEST_FALSE_GAP: f64 = 1e-5;

impl Pole<'_> {
    fn check(&self, points: &[PolePoint]) -> Result<(), PairError> {
        let Some(first) = points.first() else {
            return Err(PairError::NothingFaces { body: self.name.into(), boundary: self.boundary });
        };
        let (gap, most) = (self.depth(first.radius, &first.place), LARGEST_FALSE_GAP * self.size());
        if gap <= most {
            return Ok(());
        }
        let (body, boundary) = (self.name.into(), self.boundary);
        Err(PairError::TooCoarse { body, boundary, radius: first.radius, gap, most })
    }

    /// Radius of a sphere, half the largest extent of any other body, m.
    fn size(&self) -> f64 {
        match self.profile {
            Profile::Sphere { radius } => radius,
            Profile::Meshed => {
                let nodes = || self.body.mesh().nodes.iter();
                let most = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::NEG_INFINITY, f64::max);
                let radius = most(&mut nodes().map(|[r, _]| *r));
                radius.max(0.5 * (most(&mut nodes().map(|[_, z]| *z)) + most(&mut nodes().map(|[_, z]| -z))))
            }
        }
    }

    fn nodes(&self) -> Result<&[u32], PairError> {
        boundary(self.body, self.name, self.boundary)
    }

    /// How far the profile falls back at the given point, m.
    fn depth(&self, radius: f64, place: &OnEdge) -> f64 {
        match self.profile {
            Profile::Sphere { radius: a } => radius * radius / (a + (a * a - radius * radius).max(0.0).sqrt()),
            Profile::Meshed => {
                let z = |node: u32| self.body.mesh().nodes[node as usize][1];
                let pole = self.nodes().map_or(0.0, |nodes| z(nodes[0]));
                self.normal * (pole - place.nodes.iter().zip(place.weights).map(|(&node, w)| w * z(node)).sum::<f64>())
            }
        }
    }

    fn terms(&self, place: &OnEdge) -> Vec<(u32, f64)> {
        terms(self.body, place, [0.0, self.normal])
    }
}

fn boundary<'a>(body: &'a Body, whose: &str, name: &'static str) -> Result<&'a [u32], PairError> {
    match body.mesh().boundary(name) {
        Some(boundary) if boundary.nodes.len() >= 3 => Ok(&boundary.nodes),
        _ => Err(PairError::NoBoundary { body: whose.into(), boundary: name }),
    }
}

impl Pair {
    /// Whether both bodies are flat: then all points touch at once, and no contact is too large.
    pub(crate) fn is_flat(&self) -> bool {
        self.gaps.iter().all(|gap| gap.abs() < FLAT)
    }

    pub fn len(&self) -> usize {
        self.gaps.len()
    }

    pub fn is_empty(&self) -> bool {
        self.gaps.is_empty()
    }

    /// A pole against a rigid flat; `flat_before` says that the flat lies towards the piston.
    pub(crate) fn on_flat(pole: Pole<'_>, flat_before: bool) -> Result<Self, PairError> {
        let points = pole_points(pole)?;
        let face = Face::new(points.iter().map(|point| (pole.terms(&point.place), pole.normal)));
        let flat = vec![-pole.normal; points.len()];
        let gaps = points.iter().map(|point| pole.depth(point.radius, &point.place)).collect();
        let own = face.axial.clone();
        let (before, after, axial_before, axial_after) =
            if flat_before { (Face::default(), face, flat, own) } else { (face, Face::default(), own, flat) };
        Ok(Self {
            before,
            after,
            axial_before,
            axial_after,
            gaps,
            positions: points.iter().map(|point| point.radius).collect(),
            areas: points.iter().map(|point| point.area).collect(),
            ordering: Ordering::Prefix,
            ring_centre: None,
        })
    }

    /// The back of one body against the front of the next. The points are the nodes of the body with the finer patch; where the meshes do
    /// not match, the other is interpolated.
    pub(crate) fn of_poles(back: Pole<'_>, front: Pole<'_>) -> Result<Self, PairError> {
        let extent = |pole: &Pole<'_>| -> Result<f64, PairError> {
            let nodes = pole.nodes()?;
            Ok(pole.body.mesh().nodes[nodes[nodes.len() - 1] as usize][0])
        };
        let back_is_finer = extent(&back)? <= extent(&front)?;
        let (fine, coarse) = if back_is_finer { (back, front) } else { (front, back) };
        let coarse_nodes = coarse.nodes()?;
        let (mut own, mut other, mut gaps, mut positions, mut areas) = (vec![], vec![], vec![], vec![], vec![]);
        for point in pole_points(fine)? {
            let Some(place) = at_radius(coarse.body.mesh(), coarse_nodes, point.radius) else { continue };
            own.push((fine.terms(&point.place), fine.normal));
            other.push((coarse.terms(&place), coarse.normal));
            gaps.push(fine.depth(point.radius, &point.place) + coarse.depth(point.radius, &place));
            positions.push(point.radius);
            areas.push(point.area);
        }
        if gaps.is_empty() {
            return Err(PairError::NothingFaces { body: coarse.name.into(), boundary: coarse.boundary });
        }
        let (own, other) = (Face::new(own), Face::new(other));
        let (before, after) = if back_is_finer { (own, other) } else { (other, own) };
        let (axial_before, axial_after) = (before.axial.clone(), after.axial.clone());
        Ok(Self {
            before,
            after,
            axial_before,
            axial_after,
            gaps,
            positions,
            areas,
            ordering: Ordering::Prefix,
            ring_centre: None,
        })
    }

    pub fn is_on_ring(&self) -> bool {
        self.ring_centre.is_some()
    }

    /// A sphere (its back half towards the support) against the boundary `contact` of a support. The points are the support's nodes, with
    /// the sphere's radial normals while both are undeformed; the sphere's mesh is interpolated at the feet of the normals.
    ///
    /// The normals are kept: that makes the force 0.19 % too large per µm of travel for the resin annulus under a 1 mm bead.
    pub(crate) fn on_ring(sphere: &Body, radius: f64, support: &Body, torus: &HalfTorus) -> Result<Self, PairError> {
        let nodes = boundary(support, "the support", "contact")?;
        let surface = back_half(sphere)?;
        let angle = |node: u32| {
            let [r, z] = sphere.mesh().nodes[node as usize];
            r.atan2(z)
        };
        let centre = torus.bead_centre();
        let (mut places, mut areas, mut gaps) = (vec![], vec![], vec![]);
        let (mut on_sphere, mut on_support) = (vec![], vec![]);
        for (&node, area) in nodes.iter().zip(tributary_areas(support.mesh(), nodes)) {
            let [r, z] = support.mesh().nodes[node as usize];
            // The axis node carries no force (its area is zero), nor can one push there.
            if r <= 0.0 {
                continue;
            }
            let Some(foot) = at_parameter(&surface, r.atan2(z - centre), angle) else { continue };
            let distance = r.hypot(z - centre);
            let normal = [r / distance, (z - centre) / distance];
            let node = OnEdge { nodes: [node; 3], weights: [1.0, 0.0, 0.0] };
            on_sphere.push((terms(sphere, &foot, normal), normal[1]));
            on_support.push((terms(support, &node, normal.map(|part| -part)), -normal[1]));
            gaps.push(distance - radius);
            places.push([r, z]);
            areas.push(area);
        }
        let Some(middle) = (0..gaps.len()).min_by(|&i, &j| f64::total_cmp(&gaps[i], &gaps[j])) else {
            return Err(PairError::NothingFaces { body: "the support".into(), boundary: "contact" });
        };
        let (before, after) = (Face::new(on_sphere), Face::new(on_support));
        let [r0, z0] = places[middle];
        let distance = r0.hypot(z0 - centre);
        let tangent = [(z0 - centre) / distance, -r0 / distance];
        Ok(Self {
            axial_before: before.axial.clone(),
            axial_after: after.axial.clone(),
            before,
            after,
            gaps,
            positions: places.iter().map(|[r, z]| (r - r0) * tangent[0] + (z - z0) * tangent[1]).collect(),
            areas,
            ordering: Ordering::Any,
            ring_centre: Some(centre),
        })
    }
}

/// Terms of normal · u at a point of an edge; nodes with weight zero and fixed unknowns fall away.
fn terms(body: &Body, place: &OnEdge, normal: [f64; 2]) -> Vec<(u32, f64)> {
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

/// Gap below which a surface is flat, m: roundings of a mesh of millimetres.
const FLAT: f64 = 1e-15;

struct PolePoint {
    place: OnEdge,
    radius: f64,
    area: f64,
}

/// The nodes of a pole's patch but the pole itself, whose tributary area is zero: no force can be held there.
fn pole_points(pole: Pole<'_>) -> Result<Vec<PolePoint>, PairError> {
    let nodes = pole.nodes()?;
    let areas = tributary_areas(pole.body.mesh(), nodes);
    let points: Vec<PolePoint> = nodes
        .iter()
        .zip(areas)
        .skip(1)
        .map(|(&node, area)| PolePoint {
            place: OnEdge { nodes: [node; 3], weights: [1.0, 0.0, 0.0] },
            radius: pole.body.mesh().nodes[node as usize][0],
            area,
        })
        .collect();
    pole.check(&points)?;
    Ok(points)
}

/// Nodes of a sphere's surface from its back pole to its front pole.
fn back_half(sphere: &Body) -> Result<Vec<u32>, PairError> {
    let mut nodes = boundary(sphere, "the last bead", "back")?.to_vec();
    let side = boundary(sphere, "the last bead", "side")?;
    nodes.extend(side.iter().rev().skip(1));
    Ok(nodes)
}
