//! The structured mesh of a disc.

use crate::fea::mesh::{Boundary, Mesh, MeshError};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscMesh {
    pub radial: usize,
    pub through: usize,
    /// Side of the element at the pole of the front, m: from there sides grow by a constant factor in both directions. A contact wants a
    /// fifth of its radius or less. `None`: uniform.
    pub pole_side: Option<f64>,
}

impl Default for DiscMesh {
    /// 32 × 6 uniform elements: first mode of the 2 mm disc, clamped, 0.04 % above its limit.
    fn default() -> Self {
        Self { radial: 32, through: 6, pole_side: None }
    }
}

/// Mesh of a disc of radius a and thickness h (m), 0 ≤ z ≤ h, with the boundaries `front` (z = 0), `back` (z = h), both from the axis to
/// the rim, and `rim` (r = a).
pub fn disc_mesh(radius: f64, thickness: f64, mesh: &DiscMesh) -> Result<Mesh, MeshError> {
    let body = "disc";
    let refuse = |name, expected, found| Err(MeshError::Parameter { body, name, expected, found });
    if !(radius > 0.0 && radius.is_finite()) {
        return refuse("radius, m,", "finite and > 0", radius);
    }
    if !(thickness > 0.0 && thickness < radius) {
        return refuse("thickness, m,", "above 0 and below the radius", thickness);
    }
    for (name, count) in [("elements along r", mesh.radial), ("elements through the thickness", mesh.through)] {
        if !(1..=10_000).contains(&count) {
            return refuse(name, "between 1 and 10000", count as f64);
        }
    }
    if let Some(side) = mesh.pole_side
        && !(side > 0.0 && side * mesh.radial as f64 <= radius && side * mesh.through as f64 <= thickness)
    {
        return refuse("side of the element at the pole, m,", "above 0 and at most that of a uniform mesh", side);
    }
    let along_r = graded(radius, mesh.radial, mesh.pole_side);
    let along_z = graded(thickness, mesh.through, mesh.pole_side);

    // Lines of nodes at half steps; the middles of elements carry none.
    let (columns, rows) = (2 * mesh.radial + 1, 2 * mesh.through + 1);
    let mut nodes = Vec::new();
    let mut number = vec![vec![u32::MAX; rows]; columns];
    for (i, column) in number.iter_mut().enumerate() {
        for (j, place) in column.iter_mut().enumerate().filter(|(j, _)| i % 2 == 0 || j % 2 == 0) {
            *place = nodes.len() as u32;
            nodes.push([half(&along_r, i), half(&along_z, j)]);
        }
    }
    let mut elements = Vec::new();
    for i in (0..columns - 1).step_by(2) {
        for j in (0..rows - 1).step_by(2) {
            let at = |di: usize, dj: usize| number[i + di][j + dj];
            elements.push([at(0, 0), at(2, 0), at(2, 2), at(0, 2), at(1, 0), at(2, 1), at(1, 2), at(0, 1)]);
        }
    }
    let boundary = |name: &str, nodes: Vec<u32>| Boundary { name: name.into(), nodes };
    let boundaries = vec![
        boundary("front", number.iter().map(|column| column[0]).collect()),
        boundary("back", number.iter().map(|column| column[rows - 1]).collect()),
        boundary("rim", number[columns - 1].clone()),
    ];
    Ok(Mesh { nodes, elements, boundaries })
}

/// Vertices of `count` elements from 0 to `length`, each longer than the one before by a constant factor if the first has a given side.
fn graded(length: f64, count: usize, first: Option<f64>) -> Vec<f64> {
    let sum = |growth: f64| (0..count).fold((0.0, 1.0), |(sum, term), _| (sum + term, term * growth)).0;
    let mut growth = 1.0;
    if let Some(first) = first {
        let (mut low, mut high) = (1.0, 1.0 + length / first);
        for _ in 0..100 {
            growth = 0.5 * (low + high);
            if sum(growth) * first < length { low = growth } else { high = growth }
        }
    }
    let unit = length / sum(growth);
    let mut out = vec![0.0];
    let mut side = unit;
    for _ in 1..count {
        out.push(out[out.len() - 1] + side);
        side *= growth;
    }
    out.push(length);
    out
}

fn half(vertices: &[f64], index: usize) -> f64 {
    if index.is_multiple_of(2) { vertices[index / 2] } else { 0.5 * (vertices[index / 2] + vertices[index / 2 + 1]) }
}
