//! The matching disc as an axisymmetric elastic body: mesh, rim, modes, flexibility.
//!
//! Its own coordinates: the front, which the last bead touches, is z = 0, the back, which is on the water, z = h; u_z is positive into the
//! water. The mesh is structured, quadratic quadrilaterals, uniform or graded geometrically to the pole of the front in both directions.

mod face;
mod mesh;

pub use crate::scene::{DiscShape, Rim};
pub(crate) use face::FaceProfile;
pub use face::half_space_flexibility;
pub use mesh::{DiscMesh, disc_mesh};

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, SymmetricEigen};
use thiserror::Error;

use crate::{
    fea::{
        assembly::{Columns, Direction, DofMap},
        body::{Body, BodyError, Hold},
        factor::{FactorError, StaticFactor},
        mesh::MeshError,
        modes::{ModesError, modes},
    },
    number::dot,
};

/// Below this frequency, Hz, a mode is the rigid motion of a free disc.
const RIGID: f64 = 1.0;

/// Radius of the patch of the contact force in thicknesses: 60 µm of the paper's disc.
pub(super) const PATCH: f64 = 0.24;

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DiscError {
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error("disc: {0}")]
    Body(#[from] BodyError),
    #[error("disc: {0}")]
    Modes(#[from] ModesError),
    #[error("disc: {0}")]
    Factor(#[from] FactorError),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Disc {
    shape: DiscShape,
    body: Body,
    front: Vec<u32>,
    back: Vec<u32>,
}

/// Modes of the disc in vacuum as the contact and the water see them; of [`Disc::basis`] also a few static shapes.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscModes {
    /// f_k = ω_k/2π, Hz, ascending; the first is 0 for a free disc.
    pub frequencies: Vec<f64>,
    /// φ_k of u_z over the back, 1/√kg (mass-normalised).
    pub back: Vec<FaceProfile>,
    /// φ_k of u_z at the pole of the front or, of [`Disc::basis`], its mean over the patch, 1/√kg.
    pub pole: Vec<f64>,
    /// How many of them are modes; the others are static shapes.
    pub modes: usize,
}

impl DiscModes {
    /// Static flexibility Σ φ_k²/ω_k² of these coordinates where the force acts, m/N; a rigid motion has none.
    pub fn flexibility(&self) -> f64 {
        let elastic = self.frequencies.iter().zip(&self.pole).filter(|(frequency, _)| **frequency > RIGID);
        elastic.map(|(frequency, shape)| (shape / (TAU * frequency)).powi(2)).sum()
    }
}

/// A disc as a contact at several points of its front and the water see it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DiscInterface {
    pub modes: DiscModes,
    /// Their displacement of every point into the water, shape by shape, 1/√kg.
    pub shapes: Vec<f64>,
    /// R = S − Σ φ φᵀ/ω², what they leave out of the static flexibility S between the points, row by row, m/N.
    pub residual: Vec<f64>,
}

impl DiscInterface {
    pub(crate) fn points(&self) -> usize {
        self.residual.len().isqrt()
    }

    /// The same with one point more that is the sum of the `count` lowest modes, each by its share at the pole, and no part of the rest.
    pub(crate) fn with_modes(&self, count: usize) -> Self {
        let points = self.points();
        let count = count.min(self.modes.modes);
        let shapes = self.shapes.chunks_exact(points).zip(&self.modes.pole).enumerate();
        let shapes =
            shapes.flat_map(|(k, (shape, pole))| shape.iter().copied().chain([if k < count { *pole } else { 0.0 }]));
        let rows = self.residual.chunks_exact(points).flat_map(|row| row.iter().copied().chain([0.0]));
        Self {
            modes: self.modes.clone(),
            shapes: shapes.collect(),
            residual: rows.chain(vec![0.0; points + 1]).collect(),
        }
    }
}

impl Disc {
    /// Mesh and assemble a disc, with its consistent mass.
    pub fn new(shape: &DiscShape, mesh: &DiscMesh) -> Result<Self, DiscError> {
        Self::assembled(shape, mesh, &[])
    }

    fn assembled(shape: &DiscShape, mesh: &DiscMesh, touched: &[&str]) -> Result<Self, DiscError> {
        let mesh = disc_mesh(shape.radius, shape.thickness, mesh)?;
        let nodes = |name: &str| mesh.boundary(name).map_or_else(Vec::new, |boundary| boundary.nodes.clone());
        let (front, back) = (nodes("front"), nodes("back"));
        let held: &[(&str, Hold)] = match shape.rim {
            Rim::Clamped => &[("rim", Hold::Clamped)],
            Rim::Supported => &[("rim", Hold::Axial)],
            Rim::Free => &[],
        };
        let body = Body::held(mesh, &shape.material, held, touched)?;
        Ok(Self { shape: shape.clone(), body, front, back })
    }

    /// A disc for a contact that is solved on its mesh: graded to the pole of its front, whose nodes carry no mass (each element keeps its
    /// whole mass on its other nodes).
    ///
    /// - `density`: n ≥ 1; the element at the pole has a side of h/(10 n), 8n/3 elements lie through the thickness, 6n along r of a disc with
    ///   a = 4h
    pub(crate) fn for_contact(shape: &DiscShape, density: usize) -> Result<Self, DiscError> {
        let n = density.max(1);
        let slenderness = (shape.radius / shape.thickness).max(1.0).log2();
        let mesh = DiscMesh {
            radial: (2.0 * n as f64 * (1.0 + slenderness)).ceil() as usize,
            through: (8 * n).div_ceil(3),
            pole_side: Some(0.1 * shape.thickness / n as f64),
        };
        Self::assembled(shape, &mesh, &["front"])
    }

    pub(crate) fn shape(&self) -> &DiscShape {
        &self.shape
    }

    pub fn body(&self) -> &Body {
        &self.body
    }

    pub(crate) fn into_body(self) -> Body {
        self.body
    }

    /// Nodes along the front from the pole to the rim: vertex, middle, vertex, …
    pub fn front(&self) -> &[u32] {
        &self.front
    }

    /// Nodes along the back from the axis to the rim: vertex, middle, vertex, …
    pub(crate) fn back(&self) -> &[u32] {
        &self.back
    }

    /// The radii of those nodes, m.
    pub(super) fn radii(&self, nodes: &[u32]) -> Vec<f64> {
        nodes.iter().map(|&node| self.body.mesh().nodes[node as usize][0]).collect()
    }

    /// Its `count` lowest axisymmetric modes in vacuum, the rigid one of a free disc included.
    pub fn modes(&self, count: usize) -> Result<DiscModes, DiscError> {
        let found = modes(&self.body, count)?;
        Ok(self.seen(found.frequencies, &found.shapes, &self.patch_load(0.0), count))
    }

    /// The same, [`DiscModes::pole`] being the mean over r ≤ `patch` (m) of the front.
    pub fn modes_on_patch(&self, count: usize, patch: f64) -> Result<DiscModes, DiscError> {
        let found = modes(&self.body, count)?;
        Ok(self.seen(found.frequencies, &found.shapes, &self.patch_load(patch), count))
    }

    /// The same, and as further coordinates what these modes leave out of the static deformations u_i = K⁻¹ f_i under a few loads f_i: a force
    /// spread evenly over r ≤ `patch` (m) of the front, and the pressures P_n(2r²/a² − 1), n = 0, 1, 2, on the back (Legendre's polynomials):
    ///
    /// r_i = u_i − Σ φ_k (φ_kᵀ f_i)/ω_k²,  then K r = ω² M r within their span.
    ///
    /// They are orthogonal to the modes in M and in K, so the equations stay uncoupled; their frequencies lie above the highest mode's. A slowly
    /// pushed disc then deforms exactly as its mesh does: Σ φ_k²/ω_k² over all is [`Disc::flexibility`]. Of the water's pressure the modes
    /// would miss how it compresses the disc through its thickness. [`DiscModes::pole`] is the mean over the patch.
    ///
    /// MacNeal (1971), *Comput. Struct.* 1, 581; Craig & Kurdila (2006), *Fundamentals of Structural Dynamics*, §17.
    pub fn basis(&self, count: usize, patch: f64) -> Result<DiscModes, DiscError> {
        let (frequencies, vectors) = self.span(count, patch)?;
        Ok(self.seen(frequencies, &vectors, &self.patch_load(patch), count))
    }

    /// The coordinates of [`Disc::basis`] as a contact at several points sees them; a point is a displacement along z as a sum over unknowns.
    pub(super) fn interface(
        &self,
        count: usize,
        patch: f64,
        points: &[Vec<(u32, f64)>],
    ) -> Result<DiscInterface, DiscError> {
        let (frequencies, vectors) = self.span(count, patch)?;
        let shapes: Vec<f64> =
            vectors.iter().flat_map(|vector| points.iter().map(|point| along(point, vector))).collect();
        let mut residual = self.point_flexibility(points)?;
        let rigid = usize::from(self.body.is_free());
        for (shape, frequency) in shapes.chunks_exact(points.len()).zip(&frequencies).skip(rigid) {
            let square = (TAU * frequency).powi(2);
            for (row, a) in residual.chunks_exact_mut(points.len()).zip(shape) {
                row.iter_mut().zip(shape).for_each(|(sum, b)| *sum -= a * b / square);
            }
        }
        let modes = self.seen(frequencies, &vectors, &self.patch_load(patch), count);
        Ok(DiscInterface { modes, shapes, residual })
    }

    /// Static flexibility S between points, row by row, m/N; of a free disc relative to its mass mean, under inertia relief.
    pub(super) fn point_flexibility(&self, points: &[Vec<(u32, f64)>]) -> Result<Vec<f64>, DiscError> {
        let factor = StaticFactor::new(&self.body, &[])?;
        let (mut force, mut u, mut work) = (self.body.columns(1), self.body.columns(1), factor.factor().half(1));
        let mut flexibility = Vec::with_capacity(points.len() * points.len());
        for point in points {
            force.clear();
            for &(dof, weight) in point {
                force.as_mut_slice()[dof as usize] += weight;
            }
            factor.solve(&mut force, &mut work, &mut u);
            flexibility.extend(points.iter().map(|other| along(other, u.as_slice())));
        }
        Ok(flexibility)
    }

    /// Frequencies (Hz) and vectors of the `count` lowest modes and of the static shapes.
    fn span(&self, count: usize, patch: f64) -> Result<(Vec<f64>, Vec<Vec<f64>>), DiscError> {
        let found = modes(&self.body, count)?;
        let mut vectors = found.shapes;
        let mut frequencies = found.frequencies;
        let load = self.patch_load(patch);
        let rim = self.shape.radius;
        let legendre: [fn(f64) -> f64; 3] = [|_| 1.0, |x| x, |x| 1.5 * x * x - 0.5];
        let pressures = legendre.map(|shape| self.back_load(|r| shape(2.0 * (r / rim).powi(2) - 1.0)));
        let mut rests = Vec::new();
        for force in std::iter::once(&load).chain(&pressures) {
            let mut rest = self.deformation(force)?;
            for (vector, frequency) in vectors.iter().zip(&frequencies).skip(usize::from(self.body.is_free())) {
                let share = dot(vector, force) / (TAU * frequency).powi(2);
                rest.iter_mut().zip(vector).for_each(|(rest, value)| *rest -= share * value);
            }
            rests.push(rest);
        }
        for (vector, frequency) in self.within(rests) {
            vectors.push(vector);
            frequencies.push(frequency);
        }
        Ok((frequencies, vectors))
    }

    /// Weights w, by the body's unknowns, with wᵀu̇ = Σ_{k ≤ count} φ_k q̇_k: of a velocity field the part that moves in the lowest modes, as a
    /// patch of that radius (m) at the pole sees it. It has neither the local indentation nor what rings above these modes.
    pub(crate) fn modal_weights(&self, count: usize, patch: f64) -> Result<Vec<f64>, DiscError> {
        let found = modes(&self.body, count)?;
        let load = self.patch_load(patch);
        let (mut image, mut weights) = (self.body.columns(1), vec![0.0; load.len()]);
        for vector in &found.shapes {
            self.body.multiply_mass(&Columns::from_vector(vector), &mut image);
            let seen = dot(vector, &load);
            weights.iter_mut().zip(image.as_slice()).for_each(|(weight, momentum)| *weight += seen * momentum);
        }
        Ok(weights)
    }

    /// Modes and frequencies (Hz) within the span of a few vectors, ascending; of nearly dependent vectors one less.
    fn within(&self, mut vectors: Vec<Vec<f64>>) -> Vec<(Vec<f64>, f64)> {
        let mut image = self.body.columns(1);
        let mut images = |vectors: &[Vec<f64>], stiffness: bool| -> Vec<Vec<f64>> {
            let product = |vector: &Vec<f64>| {
                let x = Columns::from_vector(vector);
                if stiffness {
                    self.body.multiply_stiffness(&x, &mut image);
                } else {
                    self.body.multiply_mass(&x, &mut image);
                }
                image.as_slice().to_vec()
            };
            vectors.iter().map(product).collect()
        };
        // Orthonormal in M first, dropping what the vectors before span.
        let mut kept: Vec<Vec<f64>> = Vec::new();
        for mut vector in vectors.drain(..) {
            let length = |vector: &Vec<f64>, weighted: &[Vec<f64>]| dot(vector, &weighted[0]).max(0.0).sqrt();
            let before = length(&vector, &images(std::slice::from_ref(&vector), false));
            for _ in 0..2 {
                for (own, weighted) in kept.iter().zip(images(&kept, false)) {
                    let share = dot(&vector, &weighted);
                    vector.iter_mut().zip(own).for_each(|(value, own)| *value -= share * own);
                }
            }
            let after = length(&vector, &images(std::slice::from_ref(&vector), false));
            if after > 1e-6 * before {
                vector.iter_mut().for_each(|value| *value /= after);
                kept.push(vector);
            }
        }
        let stressed = images(&kept, true);
        let count = kept.len();
        let projected =
            DMatrix::from_fn(count, count, |i, j| 0.5 * (dot(&kept[i], &stressed[j]) + dot(&kept[j], &stressed[i])));
        let SymmetricEigen { eigenvalues, eigenvectors } = SymmetricEigen::new(projected);
        let mut out: Vec<(Vec<f64>, f64)> = (0..count)
            .map(|mode| {
                let mut vector = vec![0.0; self.body.dofs().len()];
                for (own, weight) in kept.iter().zip(eigenvectors.column(mode).iter()) {
                    vector.iter_mut().zip(own).for_each(|(value, own)| *value += weight * own);
                }
                (vector, eigenvalues[mode].max(0.0).sqrt() / TAU)
            })
            .collect();
        out.sort_by(|a, b| a.1.total_cmp(&b.1));
        out
    }

    fn seen(&self, frequencies: Vec<f64>, vectors: &[Vec<f64>], load: &[f64], modes: usize) -> DiscModes {
        let radii = self.radii(&self.back);
        let axial = |vector: &[f64], node: u32| vector[DofMap::dof(node, Direction::Axial) as usize];
        let profile =
            |vector: &Vec<f64>| FaceProfile::new(&radii, self.back.iter().map(|&node| axial(vector, node)).collect());
        let back = vectors.iter().map(profile).collect();
        let pole = vectors.iter().map(|vector| dot(vector, load)).collect();
        DiscModes { frequencies, back, pole, modes }
    }

    /// Static displacement under a load, by the body's unknowns, m; of a free disc relative to its mass mean, under inertia relief.
    fn deformation(&self, load: &[f64]) -> Result<Vec<f64>, DiscError> {
        let factor = StaticFactor::new(&self.body, &[])?;
        let (mut force, mut u, mut work) = (Columns::from_vector(load), self.body.columns(1), factor.factor().half(1));
        factor.solve(&mut force, &mut work, &mut u);
        Ok(u.as_slice().to_vec())
    }

    /// Consistent nodal forces of 1 N spread evenly over r ≤ `patch` (m) of the front, N, by the body's unknowns; a patch of 0 is a point force
    /// on the pole.
    pub fn patch_load(&self, patch: f64) -> Vec<f64> {
        let mut load = vec![0.0; self.body.dofs().len()];
        let radii = self.radii(&self.front);
        let patch = patch.min(self.shape.radius);
        let shares = if patch > 0.0 {
            face::nodal_forces(&radii, patch, |_| 1.0 / (PI * patch * patch))
        } else {
            (0..radii.len()).map(|node| f64::from(u8::from(node == 0))).collect()
        };
        for (&node, share) in self.front.iter().zip(shares) {
            let dof = DofMap::dof(node, Direction::Axial);
            load[dof as usize] = if self.body.dofs().is_free(dof) { share } else { 0.0 };
        }
        load
    }

    /// Consistent nodal forces of the pressure φ(r) (Pa) on the back, along u_z, N, by the body's unknowns.
    fn back_load(&self, shape: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut load = vec![0.0; self.body.dofs().len()];
        let forces = face::nodal_forces(&self.radii(&self.back), self.shape.radius, shape);
        for (&node, force) in self.back.iter().zip(forces) {
            let dof = DofMap::dof(node, Direction::Axial);
            load[dof as usize] = if self.body.dofs().is_free(dof) { force } else { 0.0 };
        }
        load
    }

    /// Static flexibility of the front under 1 N spread evenly over r ≤ `patch` (m), mean displacement of the patch, m/N; of a free disc
    /// relative to its mass mean, under inertia relief.
    pub fn flexibility(&self, patch: f64) -> Result<f64, DiscError> {
        let load = self.patch_load(patch);
        Ok(dot(&load, &self.deformation(&load)?))
    }

    /// The same without the local indentation, m/N: less the mean displacement of an elastic half-space under the same patch,
    /// 16 (1 − ν²)/(3π² E b). Its limit b → 0 is C_s, the flexibility of the disc as a structure; the indentation belongs to Hertz' law.
    pub fn structural_flexibility(&self, patch: f64) -> Result<f64, DiscError> {
        Ok(self.flexibility(patch)? - half_space_flexibility(&self.shape.material, patch))
    }
}

fn along(point: &[(u32, f64)], by_dof: &[f64]) -> f64 {
    point.iter().map(|&(dof, weight)| weight * by_dof[dof as usize]).sum()
}
