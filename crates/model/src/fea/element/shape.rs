//! Shape functions of the two elements and of their quadratic edges.

use crate::fea::mesh::Shape;

/// Shape functions and their derivatives at one parametric point; only the first `Shape::nodes` entries count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpolation {
    /// N_i, 1.
    pub value: [f64; 8],
    /// (∂N_i/∂ξ, ∂N_i/∂η), 1.
    pub slope: [[f64; 2]; 8],
}

/// Corners and middles of the quadrilateral in (ξ, η), in node order.
pub(super) const QUADRILATERAL_NODES: [[f64; 2]; 8] =
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];

/// Corners and middles of the triangle in (ξ, η), in node order.
pub(super) const TRIANGLE_NODES: [[f64; 2]; 6] =
    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];

/// Shape functions at (ξ, η).
///
/// The quadrilateral lives on −1 ≤ ξ, η ≤ 1 (serendipity: 1, ξ, η, ξη, ξ², η², ξ²η, ξη²), the triangle on ξ, η ≥ 0, ξ + η ≤ 1
/// (complete quadratics). Σ N = 1 everywhere.
///
/// Zienkiewicz & Taylor (2000), *The Finite Element Method*, vol. 1, ch. 8.
pub fn interpolate(shape: Shape, xi: f64, eta: f64) -> Interpolation {
    let mut value = [0.0; 8];
    let mut slope = [[0.0; 2]; 8];
    match shape {
        Shape::Quadrilateral8 => {
            for (node, [x, y]) in QUADRILATERAL_NODES.into_iter().enumerate() {
                let (p, q) = (1.0 + xi * x, 1.0 + eta * y);
                (value[node], slope[node]) = if x == 0.0 {
                    (0.5 * (1.0 - xi * xi) * q, [-xi * q, 0.5 * (1.0 - xi * xi) * y])
                } else if y == 0.0 {
                    (0.5 * p * (1.0 - eta * eta), [0.5 * x * (1.0 - eta * eta), -eta * p])
                } else {
                    let sum = xi * x + eta * y;
                    (0.25 * p * q * (sum - 1.0), [0.25 * x * q * (sum + xi * x), 0.25 * y * p * (sum + eta * y)])
                };
            }
        }
        Shape::Triangle6 => {
            let l = [1.0 - xi - eta, xi, eta];
            let d = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
            for corner in 0..3 {
                value[corner] = l[corner] * (2.0 * l[corner] - 1.0);
                slope[corner] = d[corner].map(|g| (4.0 * l[corner] - 1.0) * g);
                let next = (corner + 1) % 3;
                value[3 + corner] = 4.0 * l[corner] * l[next];
                slope[3 + corner] = [0, 1].map(|axis| 4.0 * (d[corner][axis] * l[next] + l[corner] * d[next][axis]));
            }
        }
    }
    Interpolation { value, slope }
}

/// Shape functions of a quadratic edge at −1 ≤ t ≤ 1, in the order first vertex, middle, last vertex.
pub fn edge(t: f64) -> [f64; 3] {
    [0.5 * t * (t - 1.0), 1.0 - t * t, 0.5 * t * (t + 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_function_is_one_at_its_node_and_zero_at_the_others() {
        for shape in [Shape::Quadrilateral8, Shape::Triangle6] {
            for node in 0..shape.nodes() {
                let [xi, eta] = match shape {
                    Shape::Quadrilateral8 => QUADRILATERAL_NODES[node],
                    Shape::Triangle6 => TRIANGLE_NODES[node],
                };
                for (other, value) in interpolate(shape, xi, eta).value.into_iter().take(shape.nodes()).enumerate() {
                    // Halves, quarters and units only: exact.
                    assert_eq!(value, f64::from(u8::from(node == other)), "{shape:?} N{other} at node {node}");
                }
            }
        }
    }

    #[test]
    fn slopes_are_the_derivatives_of_the_values() {
        let step = 1e-6;
        for shape in [Shape::Quadrilateral8, Shape::Triangle6] {
            let (xi, eta) = (0.31, 0.27);
            for (node, slope) in interpolate(shape, xi, eta).slope.into_iter().enumerate().take(shape.nodes()) {
                let along = |dx, dy| {
                    let ahead = interpolate(shape, xi + dx, eta + dy).value[node];
                    let behind = interpolate(shape, xi - dx, eta - dy).value[node];
                    (ahead - behind) / (2.0 * step)
                };
                // Central difference: step²/6 times a third derivative of at most 2, and rounding 1e-16/step.
                assert!((along(step, 0.0) - slope[0]).abs() < 1e-9);
                assert!((along(0.0, step) - slope[1]).abs() < 1e-9);
            }
        }
    }
}
