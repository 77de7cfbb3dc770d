//! What a mesh is worth: counts, volume, distortion.

use std::f64::consts::TAU;

use serde::Serialize;

use super::{Element, Mesh, MeshError};
use crate::fea::element::{Interpolation, interpolate, rule};

/// Boundaries whose nodes can come into contact.
pub const CONTACT_BOUNDARIES: [&str; 3] = ["front", "back", "contact"];
/// The boundary whose nodes are held.
pub const CLAMPED_BOUNDARY: &str = "clamped";

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quality {
    pub elements: usize,
    pub nodes: usize,
    /// Displacements left once u_r is held on the axis and both on `clamped`.
    pub unknowns: usize,
    /// Nodes of `front`, `back` and `contact`, each counted once.
    pub contact_nodes: usize,
    /// ∫ 2πr dA by the elements' own quadrature, m³.
    #[serde(rename = "volume_m3")]
    pub volume: f64,
    /// Smallest over largest Jacobian determinant within one element, of the worst element, at quadrature points and corners, 1.
    pub worst_jacobian_ratio: f64,
    /// Shortest side of an element, corner to corner, m.
    #[serde(rename = "shortest_side_m")]
    pub shortest_side: f64,
    /// Longest side of an element, corner to corner, m.
    #[serde(rename = "longest_side_m")]
    pub longest_side: f64,
}

impl Quality {
    /// Volume over the exact one, less 1; the error of the mass too.
    pub fn volume_error(&self, exact: f64) -> f64 {
        self.volume / exact - 1.0
    }
}

pub fn quality(mesh: &Mesh) -> Quality {
    let mut volume = 0.0;
    let mut worst = f64::INFINITY;
    let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
    for element in &mesh.elements {
        let places = mesh.places(element);
        for point in rule() {
            let functions = interpolate(point.xi, point.eta);
            volume += point.weight * TAU * position(&functions, &places)[0] * determinant(&functions, &places);
        }
        let range = determinants(&places);
        worst = worst.min(range.smallest / range.largest.abs());
        for i in 0..4 {
            let (a, b) = (places[i], places[(i + 1) % 4]);
            let side = (b[0] - a[0]).hypot(b[1] - a[1]);
            shortest = shortest.min(side);
            longest = longest.max(side);
        }
    }
    let mut held = vec![false; mesh.nodes.len()];
    let clamped = mesh.boundary(CLAMPED_BOUNDARY).map_or(&[][..], |boundary| &boundary.nodes);
    for node in clamped {
        held[*node as usize] = true;
    }
    let free = |(node, [r, _]): (usize, &[f64; 2])| match (held[node], *r == 0.0) {
        (true, _) => 0,
        (false, true) => 1,
        (false, false) => 2,
    };
    let unknowns = mesh.nodes.iter().enumerate().map(free).sum();
    let contact = CONTACT_BOUNDARIES.iter().filter_map(|name| mesh.boundary(name));
    let mut contact: Vec<u32> = contact.flat_map(|boundary| boundary.nodes.iter().copied()).collect();
    contact.sort_unstable();
    contact.dedup();
    Quality {
        elements: mesh.elements.len(),
        nodes: mesh.nodes.len(),
        unknowns,
        contact_nodes: contact.len(),
        volume,
        worst_jacobian_ratio: worst,
        shortest_side: shortest,
        longest_side: longest,
    }
}

struct Range {
    smallest: f64,
    largest: f64,
    at: [f64; 2],
}

fn position(functions: &Interpolation, places: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|d| places.iter().zip(&functions.value).map(|(place, value)| place[d] * value).sum())
}

fn determinant(functions: &Interpolation, places: &[[f64; 2]]) -> f64 {
    let slope = |d: usize, e: usize| -> f64 {
        places.iter().zip(&functions.slope).map(|(place, slope)| place[d] * slope[e]).sum()
    };
    slope(0, 0) * slope(1, 1) - slope(0, 1) * slope(1, 0)
}

fn determinants(places: &[[f64; 2]]) -> Range {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let points = rule().map(|point| [point.xi, point.eta]);
    let mut range = Range { smallest: f64::INFINITY, largest: f64::NEG_INFINITY, at: [0.0; 2] };
    for at in points.into_iter().chain(corners) {
        let determinant = determinant(&interpolate(at[0], at[1]), places);
        range.largest = range.largest.max(determinant);
        // A determinant that is no number is the smallest there is.
        if !(determinant >= range.smallest) {
            (range.smallest, range.at) = (determinant, at);
        }
    }
    range
}

impl Mesh {
    /// Positions (r, z) of an element's nodes, m.
    pub(crate) fn places(&self, element: &Element) -> [[f64; 2]; 8] {
        element.map(|node| self.nodes[node as usize])
    }

    /// Refuse an element that is turned inside out anywhere; elements are counted from 1.
    pub fn check(&self) -> Result<(), MeshError> {
        for (index, element) in self.elements.iter().enumerate() {
            let places = self.places(element);
            let range = determinants(&places);
            if !(range.smallest > 0.0) {
                let at = position(&interpolate(range.at[0], range.at[1]), &places);
                let determinant = range.smallest;
                return Err(MeshError::NegativeJacobian { element: index as u64 + 1, r: at[0], z: at[1], determinant });
            }
        }
        Ok(())
    }
}
