//! Shape functions of the two elements: geometry and displacement use the same (isoparametric).
//!
//! Quadrilateral on −1 ≤ ξ, η ≤ 1, corners (−1, −1), (1, −1), (1, 1), (−1, 1) numbered 1 to 4, middles 5 to 8 after them:
//!
//! ```text
//! N_i = ¼ (1 + ξξ_i)(1 + ηη_i)(ξξ_i + ηη_i − 1)     corners
//! N_i = ½ (1 − ξ²)(1 + ηη_i)                         middles with ξ_i = 0
//! N_i = ½ (1 + ξξ_i)(1 − η²)                         middles with η_i = 0
//! ```
//!
//! Triangle on ξ, η ≥ 0, ξ + η ≤ 1 with L = (1 − ξ − η, ξ, η): N_i = L_i (2L_i − 1) at corners, 4 L_i L_j in the middle of side i–j.
//!
//! Zienkiewicz, Taylor & Zhu (2013), *The Finite Element Method*, 7th ed., §6.2 and §6.2.8.

use super::Shape;

/// Corners, then middles, of the reference quadrilateral.
const QUADRILATERAL: [[f64; 2]; 8] =
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];

/// Corners, then middles, of the reference triangle.
const TRIANGLE: [[f64; 2]; 6] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];

/// √(3/5).
const GAUSS: f64 = 0.774_596_669_241_483_4;

/// 3 × 3 Gauss points (ξ, η, weight) of the quadrilateral: exact to degree 5 in each of ξ, η.
const QUADRILATERAL_RULE: [[f64; 3]; 9] = {
    let (place, weight) = ([-GAUSS, 0.0, GAUSS], [5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0]);
    let mut rule = [[0.0; 3]; 9];
    let mut i = 0;
    while i < 9 {
        rule[i] = [place[i % 3], place[i / 3], weight[i % 3] * weight[i / 3]];
        i += 1;
    }
    rule
};

/// Radon's seven points of the triangle: exact to degree 5. a = (6 ∓ √15)/21, weights (155 ∓ √15)/2400 and 9/80.
const TRIANGLE_RULE: [[f64; 3]; 7] = {
    const A: f64 = 0.101_286_507_323_456_33;
    const B: f64 = 0.470_142_064_105_115_1;
    const WA: f64 = 0.062_969_590_272_413_58;
    const WB: f64 = 0.066_197_076_394_253_1;
    [
        [1.0 / 3.0, 1.0 / 3.0, 0.1125],
        [A, A, WA],
        [1.0 - 2.0 * A, A, WA],
        [A, 1.0 - 2.0 * A, WA],
        [B, B, WB],
        [1.0 - 2.0 * B, B, WB],
        [B, 1.0 - 2.0 * B, WB],
    ]
};

/// Values and derivatives of the shape functions at one point of the reference element; entries past the element's nodes are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeFunctions {
    /// N_i, 1.
    pub values: [f64; 8],
    /// (∂N_i/∂ξ, ∂N_i/∂η), 1.
    pub derivatives: [[f64; 2]; 8],
}

impl Shape {
    /// Number of its corners.
    #[must_use]
    pub const fn corners(self) -> usize {
        self.nodes() / 2
    }

    /// Its nodes (ξ, η) in the reference element.
    #[must_use]
    pub const fn reference_nodes(self) -> &'static [[f64; 2]] {
        match self {
            Self::Quadrilateral8 => &QUADRILATERAL,
            Self::Triangle6 => &TRIANGLE,
        }
    }

    /// Quadrature points (ξ, η, weight): 3 × 3 Gauss for the quadrilateral, seven points of degree 5 for the triangle.
    #[must_use]
    pub const fn quadrature(self) -> &'static [[f64; 3]] {
        match self {
            Self::Quadrilateral8 => &QUADRILATERAL_RULE,
            Self::Triangle6 => &TRIANGLE_RULE,
        }
    }

    /// Shape functions and their derivatives at (ξ, η).
    #[must_use]
    pub fn functions(self, xi: f64, eta: f64) -> ShapeFunctions {
        let mut values = [0.0; 8];
        let mut derivatives = [[0.0; 2]; 8];
        match self {
            Self::Quadrilateral8 => {
                for (i, &[a, b]) in QUADRILATERAL.iter().enumerate() {
                    let (p, q) = (1.0 + xi * a, 1.0 + eta * b);
                    if i < 4 {
                        values[i] = 0.25 * p * q * (p + q - 3.0);
                        derivatives[i] = [0.25 * a * q * (2.0 * p + q - 3.0), 0.25 * b * p * (p + 2.0 * q - 3.0)];
                    } else if a == 0.0 {
                        values[i] = 0.5 * (1.0 - xi * xi) * q;
                        derivatives[i] = [-xi * q, 0.5 * b * (1.0 - xi * xi)];
                    } else {
                        values[i] = 0.5 * p * (1.0 - eta * eta);
                        derivatives[i] = [0.5 * a * (1.0 - eta * eta), -eta * p];
                    }
                }
            }
            Self::Triangle6 => {
                let part = [1.0 - xi - eta, xi, eta];
                let slope = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
                for i in 0..3 {
                    let j = (i + 1) % 3;
                    values[i] = part[i] * (2.0 * part[i] - 1.0);
                    values[3 + i] = 4.0 * part[i] * part[j];
                    for d in 0..2 {
                        derivatives[i][d] = (4.0 * part[i] - 1.0) * slope[i][d];
                        derivatives[3 + i][d] = 4.0 * (slope[i][d] * part[j] + part[i] * slope[j][d]);
                    }
                }
            }
        }
        ShapeFunctions { values, derivatives }
    }
}

impl ShapeFunctions {
    /// Position (r, z) of the point in an element with these node positions, m.
    #[must_use]
    pub fn position(&self, nodes: &[[f64; 2]]) -> [f64; 2] {
        let sum = |d: usize| nodes.iter().zip(&self.values).map(|(node, value)| node[d] * value).sum();
        [sum(0), sum(1)]
    }

    /// Jacobian matrix [[∂r/∂ξ, ∂r/∂η], [∂z/∂ξ, ∂z/∂η]] of the element's map, m.
    #[must_use]
    pub fn jacobian(&self, nodes: &[[f64; 2]]) -> [[f64; 2]; 2] {
        let sum =
            |d: usize, e: usize| nodes.iter().zip(&self.derivatives).map(|(node, slope)| node[d] * slope[e]).sum();
        [[sum(0, 0), sum(0, 1)], [sum(1, 0), sum(1, 1)]]
    }

    /// Determinant of [`ShapeFunctions::jacobian`], m²; positive where the element is not turned inside out.
    #[must_use]
    pub fn determinant(&self, nodes: &[[f64; 2]]) -> f64 {
        let [[a, b], [c, d]] = self.jacobian(nodes);
        a * d - b * c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [Shape; 2] = [Shape::Quadrilateral8, Shape::Triangle6];

    #[test]
    fn a_shape_function_is_one_at_its_node_and_zero_at_the_others() {
        for shape in BOTH {
            for (i, [xi, eta]) in shape.reference_nodes().iter().enumerate() {
                let functions = shape.functions(*xi, *eta);
                for (j, value) in functions.values.iter().enumerate() {
                    assert_eq!(*value, if i == j { 1.0 } else { 0.0 }, "{shape:?} function {j} at node {i}");
                }
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_values() {
        let step = 1e-6;
        for shape in BOTH {
            let (xi, eta) = (0.31, 0.17);
            let at = shape.functions(xi, eta);
            let differences = [
                (shape.functions(xi + step, eta), shape.functions(xi - step, eta)),
                (shape.functions(xi, eta + step), shape.functions(xi, eta - step)),
            ];
            for i in 0..8 {
                for (d, (after, before)) in differences.iter().enumerate() {
                    let difference = (after.values[i] - before.values[i]) / (2.0 * step);
                    // Rounding of values of order 1 over 2 × 1e-6, and third derivatives of order 1 times 1e-12.
                    assert!((difference - at.derivatives[i][d]).abs() < 1e-9, "{shape:?} function {i}");
                }
            }
        }
    }

    #[test]
    fn the_rules_integrate_all_monomials_of_degree_five() {
        let factorial = |n: i32| (1..=n).product::<i32>() as f64;
        for p in 0..=5 {
            for q in 0..=(5 - p) {
                let sum = |shape: Shape| -> f64 {
                    shape.quadrature().iter().map(|[xi, eta, weight]| weight * xi.powi(p) * eta.powi(q)).sum()
                };
                let even = |n: i32| if n % 2 == 0 { 2.0 / f64::from(n + 1) } else { 0.0 };
                assert!((sum(Shape::Quadrilateral8) - even(p) * even(q)).abs() < 1e-14);
                let exact = factorial(p) * factorial(q) / factorial(p + q + 2);
                assert!((sum(Shape::Triangle6) - exact).abs() < 1e-14);
            }
        }
    }
}
