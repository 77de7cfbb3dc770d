//! Where a body can be touched: points whose outward normal displacement is measured, and pushed, through its unknowns.

use crate::fea::{
    element::{GAUSS_LINE, edge as edge_functions},
    mesh::Mesh,
};

/// A point of a curve of quadratic edges: three nodes and their shape functions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnEdge {
    pub nodes: [u32; 3],
    /// Quadratic shape functions there; their sum is 1.
    pub weights: [f64; 3],
}

/// Outward normal displacements p = Bᵀ u of the points of one contact on one body, as sparse combinations of unknowns.
///
/// A force λᵢ ≥ 0 at point i pushes the body inwards: it adds −Bᵢ λᵢ to the forces on the unknowns.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Face {
    starts: Vec<u32>,
    unknowns: Vec<u32>,
    coefficients: Vec<f64>,
    /// Outward normal displacement of each point when the body moves by 1 m along z, 1.
    pub axial: Vec<f64>,
}

impl Face {
    /// Points given by their terms (unknown, coefficient) and their axial parts.
    pub(crate) fn new<T: IntoIterator<Item = (u32, f64)>>(points: impl IntoIterator<Item = (T, f64)>) -> Self {
        let mut face = Self { starts: vec![0], ..Self::default() };
        for (terms, axial) in points {
            for (unknown, coefficient) in terms {
                face.unknowns.push(unknown);
                face.coefficients.push(coefficient);
            }
            face.starts.push(face.unknowns.len() as u32);
            face.axial.push(axial);
        }
        face
    }

    pub(crate) fn len(&self) -> usize {
        self.axial.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.axial.is_empty()
    }

    /// Unknowns that occur, ascending, each once.
    pub(crate) fn unknowns(&self) -> Vec<u32> {
        let mut unknowns = self.unknowns.clone();
        unknowns.sort_unstable();
        unknowns.dedup();
        unknowns
    }

    /// The same face over another numbering; `position` gives the new number of an unknown.
    pub(crate) fn renumbered(&self, position: impl Fn(u32) -> u32) -> Self {
        Self { unknowns: self.unknowns.iter().map(|&unknown| position(unknown)).collect(), ..self.clone() }
    }

    pub(crate) fn terms(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        self.unknowns[range.clone()]
            .iter()
            .map(|&unknown| unknown as usize)
            .zip(self.coefficients[range].iter().copied())
    }

    /// Outward normal displacement of point i, m.
    pub(crate) fn displacement(&self, i: usize, unknowns: &[f64]) -> f64 {
        self.terms(i).map(|(unknown, coefficient)| coefficient * unknowns[unknown]).sum()
    }

    /// Add the forces λ (N, pressing inwards) to the forces on the unknowns: f −= B λ.
    pub(crate) fn press(&self, forces: &[f64], on_unknowns: &mut [f64]) {
        for (i, &force) in forces.iter().enumerate() {
            if force != 0.0 {
                for (unknown, coefficient) in self.terms(i) {
                    on_unknowns[unknown] -= coefficient * force;
                }
            }
        }
    }

    /// Bᵀ A⁻¹ B′ between the points of this face and of `other`, row by row, added to `sum`; `inverse` is A⁻¹ over the `size` unknowns
    /// both faces are numbered in, symmetric.
    pub(crate) fn add_compliance(&self, other: &Self, inverse: &[f64], size: usize, sum: &mut [f64]) {
        for i in 0..self.len() {
            let row = &mut sum[i * other.len()..(i + 1) * other.len()];
            for (a, p) in self.terms(i) {
                let line = &inverse[a * size..(a + 1) * size];
                for (j, value) in row.iter_mut().enumerate() {
                    *value += p * other.terms(j).map(|(b, q)| q * line[b]).sum::<f64>();
                }
            }
        }
    }
}

/// The point of a boundary at the radius r (m), the boundary running outwards from the pole; `None` beyond its end.
pub(crate) fn at_radius(mesh: &Mesh, boundary: &[u32], radius: f64) -> Option<OnEdge> {
    at_parameter(boundary, radius, |node| mesh.nodes[node as usize][0])
}

/// The point of a boundary where a monotone coordinate of its nodes takes the given value; `None` outside its range.
pub(crate) fn at_parameter(boundary: &[u32], value: f64, coordinate: impl Fn(u32) -> f64) -> Option<OnEdge> {
    let edges = boundary.len() / 2;
    let ends = |edge: usize| (coordinate(boundary[2 * edge]), coordinate(boundary[2 * edge + 2]));
    let edge = (0..edges).find(|&edge| {
        let (a, b) = ends(edge);
        (a.min(b)..=a.max(b)).contains(&value)
    })?;
    let nodes = [boundary[2 * edge], boundary[2 * edge + 1], boundary[2 * edge + 2]];
    let [a, middle, b] = nodes.map(&coordinate);
    // value = ½ξ(ξ−1) a + (1−ξ²) middle + ½ξ(ξ+1) b; Newton from the linear guess, exact at once for an evenly spaced edge.
    let (half, bend) = (0.5 * (b - a), 0.5 * (a + b) - middle);
    let mut xi = ((value - middle) / half).clamp(-1.0, 1.0);
    for _ in 0..20 {
        let error = middle + xi * (half + xi * bend) - value;
        let change = error / (half + 2.0 * xi * bend);
        xi -= change;
        if change.abs() <= 1e-15 {
            break;
        }
    }
    Some(OnEdge { nodes, weights: edge_functions(xi) })
}

/// Tributary area ∫ N 2πr ds of each node of a boundary, m²: what a nodal force is divided by to give a pressure.
pub(crate) fn tributary_areas(mesh: &Mesh, boundary: &[u32]) -> Vec<f64> {
    // Three points: exact to degree five, and N r √(r′² + z′²) is of degree three on a straight edge.
    let mut areas = vec![0.0; boundary.len()];
    for edge in 0..boundary.len() / 2 {
        let corners = [0, 1, 2].map(|k| mesh.nodes[boundary[2 * edge + k] as usize]);
        for (xi, weight) in GAUSS_LINE {
            let shape = edge_functions(xi);
            let slope = [xi - 0.5, -2.0 * xi, xi + 0.5];
            let sum = |factors: [f64; 3], axis: usize| (0..3).map(|k| factors[k] * corners[k][axis]).sum::<f64>();
            let length = sum(slope, 0).hypot(sum(slope, 1));
            let ring = 2.0 * std::f64::consts::PI * sum(shape, 0);
            for k in 0..3 {
                areas[2 * edge + k] += weight * shape[k] * ring * length;
            }
        }
    }
    areas
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> (Mesh, Vec<u32>) {
        let nodes = vec![[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.75, 0.0], [2.5, 0.0]];
        (Mesh { nodes, elements: Vec::new(), boundaries: Vec::new() }, vec![0, 1, 2, 3, 4])
    }

    #[test]
    fn areas_of_a_flat_disc_follow_the_one_to_four_rule_and_vanish_at_the_pole() {
        let (mesh, boundary) = line();
        let areas = tributary_areas(&mesh, &boundary);
        let total = std::f64::consts::PI * 2.5 * 2.5;
        // Rounding.
        assert!(areas[0].abs() < 1e-14);
        assert!((areas.iter().sum::<f64>() - total).abs() < 1e-13);
        // Inner edge: L r/6 at a vertex, 4 L r/6 at the middle, times 2π.
        assert!((areas[1] - 2.0 * std::f64::consts::PI * 4.0 * 0.5 / 6.0).abs() < 1e-14);
    }

    #[test]
    fn a_point_of_an_edge_reproduces_quadratics() {
        let (mesh, boundary) = line();
        for radius in [0.0, 0.3, 1.0, 1.9, 2.5] {
            let point = at_radius(&mesh, &boundary, radius).unwrap();
            let sum = |power: i32| {
                point
                    .nodes
                    .iter()
                    .zip(point.weights)
                    .map(|(&n, w)| w * mesh.nodes[n as usize][0].powi(power))
                    .sum::<f64>()
            };
            for power in 0..3 {
                assert!((sum(power) - radius.powi(power)).abs() < 1e-14);
            }
        }
        assert_eq!(at_radius(&mesh, &boundary, 2.6), None);
    }

    #[test]
    fn pressing_is_the_transpose_of_measuring() {
        let face = Face::new([(vec![(0, 0.6), (2, -0.8)], 0.6), (vec![(1, 1.0)], 1.0)]);
        let (u, forces) = ([0.3, -0.2, 0.7], [2.0, 5.0]);
        let mut on_unknowns = [0.0; 3];
        face.press(&forces, &mut on_unknowns);
        let work: f64 = on_unknowns.iter().zip(u).map(|(f, u)| f * u).sum();
        let measured: f64 = (0..2).map(|i| forces[i] * face.displacement(i, &u)).sum();
        assert!((work + measured).abs() < 1e-15);
    }
}
