//! Meshes of the meridian half-plane (r, z): quadratic quadrilaterals and triangles.
//!
//! [`bead`] and [`annulus`] make the bodies of the bench from one density; [`quality`] says what a mesh is worth.

mod annulus;
mod bead;
mod butterfly;
mod error;
mod quality;
mod weave;

pub use annulus::{AnnulusMesh, HalfTorus, annulus};
pub use bead::{BeadMesh, bead};
pub use error::MeshError;
pub use quality::{CLAMPED_BOUNDARY, CONTACT_BOUNDARIES, Quality, quality};

use crate::response::{CellKind, FieldMesh};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Shape {
    /// 8-node serendipity quadrilateral: four corners counter-clockwise in (r, z), then the middles of sides 1–2, 2–3, 3–4, 4–1.
    Quadrilateral8,
    /// 6-node triangle: three corners counter-clockwise in (r, z), then the middles of sides 1–2, 2–3, 3–1.
    Triangle6,
}

impl Shape {
    pub(crate) const fn nodes(self) -> usize {
        match self {
            Self::Quadrilateral8 => 8,
            Self::Triangle6 => 6,
        }
    }

    pub const fn corners(self) -> usize {
        self.nodes() / 2
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Element {
    pub shape: Shape,
    /// Its nodes in the order of [`Shape`]; only the first `Shape::nodes` count.
    pub nodes: [u32; 8],
    /// Index of its material in the body's list of materials.
    pub material: u16,
}

impl Element {
    pub fn nodes(&self) -> &[u32] {
        &self.nodes[..self.shape.nodes()]
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Boundary {
    pub name: String,
    /// Nodes along it: vertex, middle, vertex, middle, …, vertex (odd count). From the pole outwards where it is a pole's patch.
    pub nodes: Vec<u32>,
}

/// A mesh of the meridian half-plane in the body's own coordinates (r ≥ 0, z positive from piston to support), m.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// Node coordinates (r, z), m; nodes on the axis have r = 0 exactly.
    pub nodes: Vec<[f64; 2]>,
    pub elements: Vec<Element>,
    pub boundaries: Vec<Boundary>,
}

impl Mesh {
    pub fn boundary(&self, name: &str) -> Option<&Boundary> {
        self.boundaries.iter().find(|boundary| boundary.name == name)
    }

    /// z of the front and the back pole, m: the ends of the axis.
    pub(crate) fn poles(&self) -> (f64, f64) {
        let axis = || self.nodes.iter().filter(|place| place[0] == 0.0).map(|place| place[1]);
        (axis().fold(f64::INFINITY, f64::min), axis().fold(f64::NEG_INFINITY, f64::max))
    }

    pub fn to_field_mesh(&self) -> FieldMesh {
        let kind = |element: &Element| match element.shape {
            Shape::Quadrilateral8 => CellKind::QuadraticQuadrilateral,
            Shape::Triangle6 => CellKind::QuadraticTriangle,
        };
        FieldMesh {
            points: self.nodes.clone(),
            kinds: self.elements.iter().map(kind).collect(),
            connectivity: self.elements.iter().flat_map(|element| element.nodes().iter().copied()).collect(),
            materials: self.elements.iter().map(|element| element.material).collect(),
        }
    }
}
