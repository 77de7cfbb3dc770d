//! Stress at the nodes of one element.

use std::f64::consts::TAU;

use super::{
    dilatation::Dilatation,
    matrix::{Local, NEARLY_INCOMPRESSIBLE, dot, elasticity},
    rule,
    shape::NODES,
};
use crate::scene::Material;

/// Stress (rr, zz, θθ, rz) at the nodes of an element, Pa, tension positive.
///
/// Sampled where quadratic elements are most accurate (2 × 2 Gauss points) and extrapolated bilinearly: exact for a linear stress on an
/// affine element.
///
/// - `places`: its nodes (r, z), m
/// - `displacement`: (u_r, u_z) of its nodes, m
///
/// Barlow (1976), *Int. J. Numer. Meth. Engng* 10, 243.
pub(crate) fn node_stress(places: &[[f64; 2]; 8], material: &Material, displacement: &[[f64; 2]; 8]) -> [[f64; 4]; 8] {
    let d = elasticity(material);
    let dilatation = (material.poissons_ratio > NEARLY_INCOMPRESSIBLE).then(|| {
        let mut dilatation = Dilatation::new();
        for point in rule() {
            let local = Local::new(places, point.xi, point.eta);
            let mut strain = [[0.0; 4]; 16];
            (0..8).for_each(|node| [strain[2 * node], strain[2 * node + 1]] = local.strain(node));
            dilatation.add(point.xi, point.eta, point.weight * local.jacobian * TAU * local.place[0], &strain);
        }
        dilatation
    });
    let sample = |xi: f64, eta: f64| {
        let local = Local::new(places, xi, eta);
        let mut strain = [0.0; 4];
        for (node, [u_r, u_z]) in displacement.iter().enumerate() {
            let [along_r, along_z] = local.strain(node);
            for (k, sum) in strain.iter_mut().enumerate() {
                *sum += along_r[k] * u_r + along_z[k] * u_z;
            }
        }
        if let Some(dilatation) = &dilatation {
            let excess = (dilatation.of(displacement)(xi, eta) - strain[0] - strain[1] - strain[2]) / 3.0;
            strain.iter_mut().take(3).for_each(|component| *component += excess);
        }
        [0, 1, 2, 3].map(|k| dot(&d[k], &strain))
    };
    let mut out = [[0.0; 4]; 8];
    let g = 1.0 / 3.0_f64.sqrt();
    let samples = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| (x, y, sample(g * x, g * y)));
    for (stress, [xi, eta]) in out.iter_mut().zip(NODES) {
        for (x, y, value) in &samples {
            let weight = 0.25 * (1.0 + x * xi / g) * (1.0 + y * eta / g);
            for (sum, part) in stress.iter_mut().zip(value) {
                *sum += weight * part;
            }
        }
    }
    out
}

/// Von Mises' equivalent stress of (rr, zz, θθ, rz), Pa:
/// √(½[(σ_rr − σ_zz)² + (σ_zz − σ_θθ)² + (σ_θθ − σ_rr)²] + 3 σ_rz²).
///
/// ```
/// # use granchain_model::fea::element::von_mises;
/// assert_eq!(von_mises([0.0, -5.0e6, 0.0, 0.0]), 5.0e6); // one axis
/// assert_eq!(von_mises([7.0, 7.0, 7.0, 0.0]), 0.0); // pressure alone
/// ```
pub fn von_mises([rr, zz, tt, rz]: [f64; 4]) -> f64 {
    let square = |x: f64| x * x;
    (0.5 * (square(rr - zz) + square(zz - tt) + square(tt - rr)) + 3.0 * square(rz)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_stress_is_recovered_at_the_nodes_of_affine_elements() {
        // u_z = z²/2 gives strain zz = z and nothing else; u_r = 0.
        let steel = Material::chrome_steel();
        let stiff = elasticity(&steel);
        let [a, b] = [[0.9, 0.2], [0.1, 0.7]];
        let corner = |x: f64, y: f64| [0.3 + a[0] * x + b[0] * y, 0.1 + a[1] * x + b[1] * y];
        let places = [(0., 0.), (1., 0.), (1., 1.), (0., 1.), (0.5, 0.), (1., 0.5), (0.5, 1.), (0., 0.5)]
            .map(|(x, y)| corner(x, y));
        let stress = node_stress(&places, &steel, &places.map(|[_, z]| [0.0, 0.5 * z * z]));
        for (place, stress) in places.iter().zip(stress) {
            for k in 0..4 {
                // Rounding of sums of terms of order D.
                assert!((stress[k] - stiff[k][1] * place[1]).abs() < 1e-13 * stiff[1][1], "{k}");
            }
        }
    }
}
