//! Stiffness and mass of one element.

use std::f64::consts::TAU;

use thiserror::Error;

use super::{dilatation::Dilatation, interpolate, rule};
use crate::scene::Material;

#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum ElementError {
    #[error(
        "at r = {r:.6e} m, z = {z:.6e} m the Jacobian is {jacobian:.3e} m², expected > 0; number its corners counter-clockwise in (r, z) \
         and keep its middle nodes between the quarter points of their sides"
    )]
    Jacobian { r: f64, z: f64, jacobian: f64 },
    #[error("it reaches r = {r:.6e} m at z = {z:.6e} m, expected r > 0 inside an element; move its nodes to r ≥ 0")]
    Radius { r: f64, z: f64 },
}

/// Elasticity matrix D of an isotropic material, Pa: σ = D ε in the order (rr, zz, θθ, rz) with γ_rz.
///
/// D = [λ + 2μ, λ, λ, 0; …; 0, 0, 0, μ], λ = E ν / ((1 + ν)(1 − 2ν)), μ = E / (2(1 + ν)); valid for −1 < ν < ½.
pub fn elasticity(material: &Material) -> [[f64; 4]; 4] {
    let (e, nu) = (material.youngs_modulus, material.poissons_ratio);
    let lame = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    let shear = e / (2.0 * (1.0 + nu));
    let on = lame + 2.0 * shear;
    [[on, lame, lame, 0.0], [lame, on, lame, 0.0], [lame, lame, on, 0.0], [0.0, 0.0, 0.0, shear]]
}

/// Poisson's ratio above which an element's change of volume is held to a linear field: below it nothing is gained.
pub(super) const NEARLY_INCOMPRESSIBLE: f64 = 0.45;

/// Bulk modulus E/(3(1 − 2ν)), Pa.
pub(super) fn bulk_modulus(material: &Material) -> f64 {
    material.youngs_modulus / (3.0 * (1.0 - 2.0 * material.poissons_ratio))
}

/// One point of an element in space: shape functions, their gradient, radius and volume weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Local {
    pub value: [f64; 8],
    /// (∂N/∂r, ∂N/∂z), 1/m.
    pub gradient: [[f64; 2]; 8],
    pub place: [f64; 2],
    pub jacobian: f64,
}

impl Local {
    pub(crate) fn new(places: &[[f64; 2]; 8], xi: f64, eta: f64) -> Self {
        let at = interpolate(xi, eta);
        let mut place = [0.0; 2];
        let mut map = [[0.0; 2]; 2]; // map[a][b] = ∂x_a/∂ξ_b
        for (node, x) in places.iter().enumerate() {
            for a in 0..2 {
                place[a] += at.value[node] * x[a];
                map[a][0] += x[a] * at.slope[node][0];
                map[a][1] += x[a] * at.slope[node][1];
            }
        }
        let jacobian = map[0][0] * map[1][1] - map[0][1] * map[1][0];
        let mut gradient = [[0.0; 2]; 8];
        for (out, [dxi, deta]) in gradient.iter_mut().zip(at.slope) {
            *out = [(dxi * map[1][1] - deta * map[1][0]) / jacobian, (deta * map[0][0] - dxi * map[0][1]) / jacobian];
        }
        Self { value: at.value, gradient, place, jacobian }
    }

    /// Strain (rr, zz, θθ, rz) of a unit displacement of `node` along r and along z; on the axis N/r is its limit ∂N/∂r.
    pub(crate) fn strain(&self, node: usize) -> [[f64; 4]; 2] {
        let [dr, dz] = self.gradient[node];
        let hoop = if self.place[0] > 0.0 { self.value[node] / self.place[0] } else { dr };
        [[dr, 0.0, hoop, dz], [0.0, dz, 0.0, dr]]
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ElementMatrices {
    /// K_e, N/m: row and column 2 i + d is direction d (0 r, 1 z) of node i.
    pub stiffness: [[f64; 16]; 16],
    /// M_e, kg, one scalar matrix for both directions: row and column i is node i.
    pub mass: [[f64; 8]; 8],
    /// Its volume of revolution, m³.
    pub volume: f64,
}

impl ElementMatrices {
    /// Matrices of the element with its nodes at `places` (r, z), m.
    pub(crate) fn new(places: &[[f64; 2]; 8], material: &Material) -> Result<Self, ElementError> {
        let mut d = elasticity(material);
        let mut dilatation = (material.poissons_ratio > NEARLY_INCOMPRESSIBLE).then(Dilatation::new);
        if dilatation.is_some() {
            let bulk = bulk_modulus(material);
            d.iter_mut().take(3).flat_map(|row| &mut row[..3]).for_each(|entry| *entry -= bulk);
        }
        let mut out = Self { stiffness: [[0.0; 16]; 16], mass: [[0.0; 8]; 8], volume: 0.0 };
        for point in rule() {
            let local = Local::new(places, point.xi, point.eta);
            let [r, z] = local.place;
            if !(local.jacobian > 0.0) {
                return Err(ElementError::Jacobian { r, z, jacobian: local.jacobian });
            }
            if !(r > 0.0) {
                return Err(ElementError::Radius { r, z });
            }
            let weight = point.weight * local.jacobian * TAU * r;
            out.volume += weight;
            let mut strain = [[0.0; 4]; 16];
            let mut stress = [[0.0; 4]; 16];
            for node in 0..8 {
                let [along_r, along_z] = local.strain(node);
                strain[2 * node] = along_r;
                strain[2 * node + 1] = along_z;
            }
            if let Some(dilatation) = &mut dilatation {
                dilatation.add(point.xi, point.eta, weight, &strain);
            }
            for (stress, strain) in stress.iter_mut().zip(&strain) {
                for (component, row) in stress.iter_mut().zip(&d) {
                    *component = weight * dot(row, strain);
                }
            }
            for (row, (entries, strain)) in out.stiffness.iter_mut().zip(&strain).enumerate() {
                for (entry, stress) in entries.iter_mut().zip(&stress).take(row + 1) {
                    *entry += dot(strain, stress);
                }
            }
            for row in 0..8 {
                for column in 0..=row {
                    out.mass[row][column] += weight * material.density * local.value[row] * local.value[column];
                }
            }
        }
        if let Some(dilatation) = dilatation {
            let (bulk, change) = (bulk_modulus(material), dilatation.stiffness());
            for (row, entries) in out.stiffness.iter_mut().enumerate() {
                entries.iter_mut().enumerate().for_each(|(column, entry)| *entry += bulk * change[(row, column)]);
            }
        }
        for row in 0..16 {
            for column in 0..row {
                out.stiffness[column][row] = out.stiffness[row][column];
            }
        }
        for row in 0..8 {
            for column in 0..row {
                out.mass[column][row] = out.mass[row][column];
            }
        }
        Ok(out)
    }

    /// Take the mass off the marked nodes: their rows and columns vanish and the rest is scaled so that the element keeps its mass.
    ///
    /// Returns `false`, changing nothing, when no node is left to carry it.
    ///
    /// Mass redistribution: arXiv 1601.00778; massless contact boundaries in dynamics: arXiv 2111.07693.
    pub(crate) fn drop_mass(&mut self, massless: &[bool; 8]) -> bool {
        let sum = |mass: &[[f64; 8]; 8]| mass.iter().flatten().sum::<f64>();
        let before = sum(&self.mass);
        let mut rest = self.mass;
        for (row, &bare) in massless.iter().enumerate() {
            for (column, &bare_too) in massless.iter().enumerate() {
                if bare || bare_too {
                    rest[row][column] = 0.0;
                }
            }
        }
        let after = sum(&rest);
        if !(after > 0.0) {
            return false;
        }
        for entry in rest.iter_mut().flatten() {
            *entry *= before / after;
        }
        self.mass = rest;
        true
    }
}

pub(super) fn dot(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVED: [[f64; 2]; 8] =
        [[0.1, 0.0], [1.0, 0.1], [1.2, 0.9], [0.0, 1.0], [0.5, -0.05], [1.15, 0.5], [0.6, 1.05], [0.04, 0.45]];

    #[test]
    fn rigid_translation_along_the_axis_has_no_stiffness_and_the_whole_mass() {
        let steel = Material::chrome_steel();
        let element = ElementMatrices::new(&CURVED, &steel).unwrap();
        let largest = element.stiffness.iter().flatten().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        for row in &element.stiffness {
            let force: f64 = (0..8).map(|node| row[2 * node + 1]).sum();
            // Rounding of eight terms.
            assert!(force.abs() < 1e-14 * largest);
        }
        let mass: f64 = element.mass.iter().flatten().sum();
        assert!((mass / (steel.density * element.volume) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn dropping_mass_keeps_the_whole() {
        let mut element = ElementMatrices::new(&CURVED, &Material::chrome_steel()).unwrap();
        let before: f64 = element.mass.iter().flatten().sum();
        assert!(element.drop_mass(&[true, true, false, false, true, false, false, false]));
        let after: f64 = element.mass.iter().flatten().sum();
        assert!((after / before - 1.0).abs() < 1e-14);
        assert!(element.mass[0].iter().all(|&entry| entry == 0.0));
        assert!(!element.drop_mass(&[true; 8]));
    }

    #[test]
    fn a_clockwise_element_is_refused_with_the_place() {
        let mut places = CURVED;
        places.swap(1, 3);
        places.swap(4, 7);
        places.swap(5, 6);
        let refusal = ElementMatrices::new(&places, &Material::chrome_steel());
        let Err(ElementError::Jacobian { r, z, jacobian }) = refusal else { panic!("{refusal:?}") };
        assert!(jacobian < 0.0 && (0.0..1.3).contains(&r) && (-0.1..1.1).contains(&z));
    }
}
