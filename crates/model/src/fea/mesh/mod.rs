//! Meshes of the meridian half-plane (r, z): 8-node quadrilaterals.
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

use crate::response::FieldMesh;

/// Nodes of an 8-node serendipity quadrilateral: four corners counter-clockwise in (r, z), then the middles of sides 1–2, 2–3, 3–4, 4–1.
pub type Element = [u32; 8];

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
        FieldMesh { points: self.nodes.clone(), cells: self.elements.clone() }
    }
}
