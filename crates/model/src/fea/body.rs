//! A body: a mesh with its material, boundary conditions, stiffness and mass.
//!
//! ```text
//! M ü + K u = f,   u_r = 0 on the axis,   u = 0 on clamped boundaries
//! ```
//!
//! A body without a clamped boundary is free: its one rigid motion is the translation along z (an axisymmetric body cannot turn or grow
//! without strain). What is left out: rotation, torsion, large strain, gravity, damping.

mod error;
mod stress;

pub use error::BodyError;

use super::{
    assembly::{Columns, Direction, DofMap, SymmetricSparse},
    element::ElementMatrices,
    mesh::Mesh,
};
use crate::{scene::Material, tally};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Hold {
    /// Clamped: u = 0.
    Clamped,
    /// u_z = 0, u_r free: a frictionless guide across the axis.
    Axial,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    mesh: Mesh,
    material: Material,
    dofs: DofMap,
    stiffness: SymmetricSparse,
    mass: SymmetricSparse,
    node_mass: Vec<f64>,
    total_mass: f64,
    is_free: bool,
}

impl Body {
    /// Assemble the body.
    ///
    /// - `clamped`: names of boundaries whose nodes do not move
    /// - `contact`: names of boundaries that may touch something: their nodes carry no mass, the rest of each touched element carries all of
    ///   its mass. The contact is then quasi-static, and its force converges as the step falls. Without any the mass is consistent.
    pub fn new(mesh: Mesh, material: &Material, clamped: &[&str], contact: &[&str]) -> Result<Self, BodyError> {
        let held: Vec<(&str, Hold)> = clamped.iter().map(|&name| (name, Hold::Clamped)).collect();
        Self::held(mesh, material, &held, contact)
    }

    /// Assemble a body whose boundaries are held one way or the other; else as [`Body::new`].
    pub(crate) fn held(
        mesh: Mesh,
        material: &Material,
        held: &[(&str, Hold)],
        contact: &[&str],
    ) -> Result<Self, BodyError> {
        error::check(&mesh, material)?;
        tally::add(|made| made.bodies += 1);
        let named = |hold: &[Hold]| -> Vec<&str> {
            held.iter().filter(|(_, how)| hold.contains(how)).map(|&(name, _)| name).collect()
        };
        let clamped = marked(&mesh, &named(&[Hold::Clamped]))?;
        let held = marked(&mesh, &named(&[Hold::Clamped, Hold::Axial]))?;
        let bare = marked(&mesh, contact)?;
        let is_free: Vec<bool> =
            (0..mesh.nodes.len()).flat_map(|n| [!clamped[n] && mesh.nodes[n][0] != 0.0, !held[n]]).collect();
        let dofs = DofMap::new(is_free);

        let neighbours = neighbours(&mesh);
        let mut mass = neighbours.clone();
        let mut stiffness = by_direction(&neighbours);
        for (index, element) in mesh.elements.iter().enumerate() {
            let massless = element.map(|node| bare[node as usize]);
            let mut matrices = ElementMatrices::new(&mesh.places(element), material)
                .map_err(|source| BodyError::Element { element: index, source })?;
            if massless.contains(&true) && !matrices.drop_mass(&massless) {
                return Err(BodyError::MasslessElement { element: index });
            }
            scatter(&mut stiffness, &mut mass, element, &matrices);
        }
        let stiffness = stiffness.without(|dof| dofs.is_free(dof));
        let mass = mass.without(|node| !bare[node as usize]);

        let ones = vec![1.0; mesh.nodes.len()];
        let mut node_mass = ones.clone();
        mass.multiply(&ones, &mut node_mass, 1);
        let total_mass = node_mass.iter().sum();
        let is_free = !held.contains(&true);
        Ok(Self { mesh, material: material.clone(), dofs, stiffness, mass, node_mass, total_mass, is_free })
    }

    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    pub(crate) fn material(&self) -> &Material {
        &self.material
    }

    pub fn dofs(&self) -> &DofMap {
        &self.dofs
    }

    /// K, N/m, by unknowns; rows and columns of fixed unknowns are empty.
    pub fn stiffness(&self) -> &SymmetricSparse {
        &self.stiffness
    }

    /// M, kg, by **nodes**: the same for both directions; rows and columns of massless nodes are empty.
    pub fn mass(&self) -> &SymmetricSparse {
        &self.mass
    }

    /// M 1 by nodes, kg: the weights of [`Body::mass_mean`].
    pub fn node_mass(&self) -> &[f64] {
        &self.node_mass
    }

    pub fn total_mass(&self) -> f64 {
        self.total_mass
    }

    pub fn is_free(&self) -> bool {
        self.is_free
    }

    pub fn columns(&self, count: usize) -> Columns {
        Columns::new(self.dofs.len(), count)
    }

    /// y = M x for all columns; fixed rows of y are zero. Nothing is allocated.
    pub fn multiply_mass(&self, x: &Columns, y: &mut Columns) {
        // A node's two directions lie together: rows of twice the width by nodes.
        self.mass.multiply(x.as_slice(), y.as_mut_slice(), 2 * x.width());
        for &dof in self.dofs.fixed() {
            y.row_mut(dof as usize).fill(0.0);
        }
    }

    /// y = K x for all columns. Nothing is allocated.
    pub fn multiply_stiffness(&self, x: &Columns, y: &mut Columns) {
        self.stiffness.multiply(x.as_slice(), y.as_mut_slice(), x.width());
    }

    /// The rigid translation: 1 along z at every free node, 0 along r. A motion without strain only if the body is free.
    pub fn rigid(&self) -> Vec<f64> {
        (0..self.dofs.len() as u32)
            .map(|dof| f64::from(u8::from(self.dofs.is_free(dof) && DofMap::place(dof).1 == Direction::Axial)))
            .collect()
    }

    /// Mass mean of the axial displacement (or velocity) of each column, ∫ρ u_z dV / m, into `mean` (one number a column).
    pub fn mass_mean(&self, u: &Columns, mean: &mut [f64]) {
        mean.fill(0.0);
        for (row, weight) in u.as_slice().chunks_exact(2 * u.width()).zip(&self.node_mass) {
            for (mean, value) in mean.iter_mut().zip(&row[u.width()..]) {
                *mean += weight * value;
            }
        }
        for mean in mean {
            *mean /= self.total_mass;
        }
    }
}

fn marked(mesh: &Mesh, names: &[&str]) -> Result<Vec<bool>, BodyError> {
    let mut marked = vec![false; mesh.nodes.len()];
    for name in names {
        let boundary = mesh.boundary(name).ok_or_else(|| BodyError::Boundary {
            boundary: (*name).to_owned(),
            known: mesh.boundaries.iter().map(|boundary| boundary.name.clone()).collect(),
        })?;
        for &node in &boundary.nodes {
            marked[node as usize] = true;
        }
    }
    Ok(marked)
}

/// Zero matrix by nodes: an entry where two nodes share an element.
fn neighbours(mesh: &Mesh) -> SymmetricSparse {
    let mut below: Vec<Vec<u32>> = vec![Vec::new(); mesh.nodes.len()];
    for element in &mesh.elements {
        for &column in element {
            below[column as usize].extend(element.iter().filter(|&&row| row >= column));
        }
    }
    let mut starts = vec![0];
    let mut rows = Vec::new();
    for mut column in below {
        column.sort_unstable();
        column.dedup();
        rows.append(&mut column);
        starts.push(rows.len() as u32);
    }
    SymmetricSparse::zeros(starts, rows)
}

fn by_direction(nodes: &SymmetricSparse) -> SymmetricSparse {
    let mut starts = vec![0];
    let mut rows = Vec::new();
    for node in 0..nodes.order() {
        for column in [2 * node as u32, 2 * node as u32 + 1] {
            rows.extend(
                nodes.column(node).0.iter().flat_map(|row| [2 * row, 2 * row + 1]).filter(|&row| row >= column),
            );
            starts.push(rows.len() as u32);
        }
    }
    SymmetricSparse::zeros(starts, rows)
}

fn scatter(stiffness: &mut SymmetricSparse, mass: &mut SymmetricSparse, nodes: &[u32; 8], element: &ElementMatrices) {
    for (i, &row) in nodes.iter().enumerate() {
        for (j, &column) in nodes.iter().enumerate().filter(|&(_, &column)| column <= row) {
            mass.add(row, column, element.mass[i][j]);
            for (d, e) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let (row, column) = (2 * row + d as u32, 2 * column + e as u32);
                if column <= row {
                    stiffness.add(row, column, element.stiffness[2 * i + d][2 * j + e]);
                }
            }
        }
    }
}
