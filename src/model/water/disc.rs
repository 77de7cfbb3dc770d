//! The matching disc as an axisymmetric elastic body: mesh, rim, modes, flexibility.
//!
//! Its own coordinates: the front, which the last bead touches, is z = 0, the back, which is on the water, z = h; u_z is positive into the
//! water. The mesh is structured, quadratic quadrilaterals, uniform or graded geometrically to the pole of the front in both directions.

mod face;
mod mesh;

pub use face::{FaceProfile, half_space_flexibility};
pub use mesh::{DiscMesh, disc_mesh};

use thiserror::Error;

use crate::{
    model::fea::{
        assembly::{Columns, Direction, DofMap},
        body::{Body, BodyError, ContactMass, Hold},
        factor::{FactorError, StaticFactor},
        mesh::MeshError,
        modes::{ModesError, modes},
    },
    scene::Material,
};

/// How the lateral face of the disc is held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rim {
    /// u = 0 on the whole lateral face.
    Clamped,
    /// u_z = 0 on the whole lateral face, u_r free: a frictionless guide. (A support along one circle is no model here: in the continuum
    /// it carries no load, and on a mesh its stiffness is that of the elements beside it.)
    Supported,
    /// Not held at all: the disc drifts once it is pushed.
    Free,
}

/// What the disc is.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscShape {
    /// Radius a, m.
    pub radius: f64,
    /// Thickness h < a, m.
    pub thickness: f64,
    /// What it is made of.
    pub material: Material,
    /// How it is held.
    pub rim: Rim,
}

/// Why there is no disc.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DiscError {
    /// A number of its shape or of its mesh is out of range.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Its elements make no body.
    #[error("disc: {0}")]
    Body(#[from] BodyError),
    /// Its modes could not be found.
    #[error("disc: {0}")]
    Modes(#[from] ModesError),
    /// Its stiffness has no factor.
    #[error("disc: {0}")]
    Factor(#[from] FactorError),
}

/// A meshed disc.
#[derive(Debug, Clone, PartialEq)]
pub struct Disc {
    shape: DiscShape,
    body: Body,
    front: Vec<u32>,
    back: Vec<u32>,
}

/// Modes of the disc in vacuum as the contact and the water see them.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscModes {
    /// f_k = ω_k/2π, Hz, ascending; the first is 0 for a free disc.
    pub frequencies: Vec<f64>,
    /// φ_k of u_z over the back, 1/√kg (mass-normalised).
    pub back: Vec<FaceProfile>,
    /// φ_k of u_z at the pole of the front, 1/√kg.
    pub pole: Vec<f64>,
}

impl Disc {
    /// Mesh and assemble a disc, with its consistent mass.
    ///
    /// # Errors
    /// [`DiscError`]: a thickness not below the radius, numbers of the mesh out of range, an unphysical material.
    pub fn new(shape: &DiscShape, mesh: &DiscMesh) -> Result<Self, DiscError> {
        let mesh = disc_mesh(shape.radius, shape.thickness, mesh)?;
        let nodes = |name: &str| mesh.boundary(name).map_or_else(Vec::new, |boundary| boundary.nodes.clone());
        let (front, back) = (nodes("front"), nodes("back"));
        let held: &[(&str, Hold)] = match shape.rim {
            Rim::Clamped => &[("rim", Hold::Clamped)],
            Rim::Supported => &[("rim", Hold::Axial)],
            Rim::Free => &[],
        };
        let materials = std::slice::from_ref(&shape.material);
        let body = Body::held(mesh, materials, held, &[], ContactMass::Consistent)?;
        Ok(Self { shape: shape.clone(), body, front, back })
    }

    /// What it is.
    #[must_use]
    pub fn shape(&self) -> &DiscShape {
        &self.shape
    }

    /// Its finite elements.
    #[must_use]
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Nodes along the front from the pole to the rim: vertex, middle, vertex, …
    #[must_use]
    pub fn front(&self) -> &[u32] {
        &self.front
    }

    /// Nodes along the back from the axis to the rim: vertex, middle, vertex, …
    #[must_use]
    pub fn back(&self) -> &[u32] {
        &self.back
    }

    /// Unknown of u_z at the pole of the front.
    #[must_use]
    pub fn pole(&self) -> u32 {
        DofMap::dof(self.front[0], Direction::Axial)
    }

    /// The radii of those nodes, m.
    pub(super) fn radii(&self, nodes: &[u32]) -> Vec<f64> {
        nodes.iter().map(|&node| self.body.mesh().nodes[node as usize][0]).collect()
    }

    /// Its `count` lowest axisymmetric modes in vacuum, the rigid one of a free disc included.
    ///
    /// # Errors
    /// [`DiscError::Modes`].
    pub fn modes(&self, count: usize) -> Result<DiscModes, DiscError> {
        let found = modes(&self.body, count)?;
        let radii = self.radii(&self.back);
        let axial = |node: u32, mode: usize| found.shapes[(DofMap::dof(node, Direction::Axial) as usize, mode)];
        let back = (0..count)
            .map(|mode| FaceProfile::new(&radii, self.back.iter().map(|&node| axial(node, mode)).collect()))
            .collect();
        let pole = (0..count).map(|mode| axial(self.front[0], mode)).collect();
        Ok(DiscModes { frequencies: found.frequencies, back, pole })
    }

    /// Consistent nodal forces of 1 N spread evenly over r ≤ `patch` (m) of the front, N, by the body's unknowns; a patch of 0 is a point force
    /// on the pole.
    #[must_use]
    pub fn patch_load(&self, patch: f64) -> Vec<f64> {
        let mut load = vec![0.0; self.body.dofs().len()];
        let shares = face::patch_shares(&self.radii(&self.front), patch.min(self.shape.radius));
        for (&node, share) in self.front.iter().zip(shares) {
            let dof = DofMap::dof(node, Direction::Axial);
            load[dof as usize] = if self.body.dofs().is_free(dof) { share } else { 0.0 };
        }
        load
    }

    /// Static flexibility of the front under 1 N spread evenly over r ≤ `patch` (m), mean displacement of the patch, m/N; of a free disc
    /// relative to its mass mean, under inertia relief.
    ///
    /// # Errors
    /// [`DiscError::Factor`].
    pub fn flexibility(&self, patch: f64) -> Result<f64, DiscError> {
        let factor = StaticFactor::new(&self.body, &[])?;
        let load = self.patch_load(patch);
        let (mut force, mut u, mut work) =
            (Columns::from_vector(&load), self.body.columns(1), factor.factor().columns(1));
        factor.solve(&mut force, &mut work, &mut u);
        Ok(load.iter().zip(u.as_slice()).map(|(share, u)| share * u).sum())
    }

    /// The same without the local indentation, m/N: less the mean displacement of an elastic half-space under the same patch,
    /// 16 (1 − ν²)/(3π² E b). Its limit b → 0 is C_s, the flexibility of the disc as a structure; the indentation belongs to Hertz' law.
    ///
    /// # Errors
    /// [`DiscError::Factor`].
    pub fn structural_flexibility(&self, patch: f64) -> Result<f64, DiscError> {
        Ok(self.flexibility(patch)? - half_space_flexibility(&self.shape.material, patch))
    }
}
