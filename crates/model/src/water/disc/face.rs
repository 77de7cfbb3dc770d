//! Quantities along a plane face of the disc.

use std::f64::consts::{PI, TAU};

use crate::{fea::element::edge, scene::Material, water::quadrature::gauss_legendre};

/// A quantity along r on a face of the disc, quadratic in each element.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceProfile {
    /// Radii of the vertices, m, ascending from 0 to a.
    ends: Vec<f64>,
    /// Values at vertex, middle, vertex, …
    values: Vec<f64>,
}

impl FaceProfile {
    /// From radii (m) and values at vertex, middle, vertex, …; every middle lies half-way.
    pub(super) fn new(radii: &[f64], values: Vec<f64>) -> Self {
        Self { ends: radii.iter().copied().step_by(2).collect(), values }
    }

    /// The value at the radius r (m); 0 beyond the face.
    pub fn at(&self, radius: f64) -> f64 {
        let Some(&rim) = self.ends.last() else { return 0.0 };
        if radius > rim {
            return 0.0;
        }
        let element = self.ends.partition_point(|&end| end <= radius).clamp(1, self.ends.len() - 1) - 1;
        let (from, to) = (self.ends[element], self.ends[element + 1]);
        let t = (2.0 * radius - from - to) / (to - from);
        let values = &self.values[2 * element..2 * element + 3];
        0.5 * t * (t - 1.0) * values[0] + (1.0 - t * t) * values[1] + 0.5 * t * (t + 1.0) * values[2]
    }
}

/// Mean displacement of the surface of an elastic half-space under 1 N spread evenly over a circle of radius b, 16 (1 − ν²)/(3π² E b), m/N.
///
/// Johnson (1985), *Contact Mechanics*, eq. (3.29b) with the mean over the circle.
pub fn half_space_flexibility(material: &Material, radius: f64) -> f64 {
    let plane = material.youngs_modulus / (1.0 - material.poissons_ratio * material.poissons_ratio);
    16.0 / (3.0 * PI * PI * plane * radius)
}

/// Consistent forces on the nodes (at `radii`: vertex, middle, vertex, …, m) of a pressure φ(r) (Pa) over r ≤ `end` (m), N.
pub(super) fn nodal_forces(radii: &[f64], end: f64, shape: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut forces = vec![0.0; radii.len()];
    let rule = gauss_legendre(6);
    for first in (0..radii.len() - 2).step_by(2) {
        let (from, to) = (radii[first], radii[first + 2]);
        let reached = to.min(end);
        if reached <= from {
            break;
        }
        for &(x, weight) in &rule {
            let radius = from + x * (reached - from);
            let t = (2.0 * radius - from - to) / (to - from);
            let force = TAU * radius * weight * (reached - from) * shape(radius);
            for (sum, n) in forces[first..].iter_mut().zip(edge(t)) {
                *sum += force * n;
            }
        }
    }
    forces
}
