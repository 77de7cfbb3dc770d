//! Shape functions of the element and of its quadratic edges.

/// Shape functions and their derivatives at one parametric point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpolation {
    /// N_i, 1.
    pub value: [f64; 8],
    /// (∂N_i/∂ξ, ∂N_i/∂η), 1.
    pub slope: [[f64; 2]; 8],
}

/// Corners and middles in (ξ, η), in node order.
pub(super) const NODES: [[f64; 2]; 8] =
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];

/// Shape functions at −1 ≤ ξ, η ≤ 1 (serendipity: 1, ξ, η, ξη, ξ², η², ξ²η, ξη²). Σ N = 1 everywhere.
///
/// Zienkiewicz & Taylor (2000), *The Finite Element Method*, vol. 1, ch. 8.
pub fn interpolate(xi: f64, eta: f64) -> Interpolation {
    let mut value = [0.0; 8];
    let mut slope = [[0.0; 2]; 8];
    for (node, [x, y]) in NODES.into_iter().enumerate() {
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
        for (node, [xi, eta]) in NODES.into_iter().enumerate() {
            for (other, value) in interpolate(xi, eta).value.into_iter().enumerate() {
                // Halves, quarters and units only: exact.
                assert_eq!(value, f64::from(u8::from(node == other)), "N{other} at node {node}");
            }
        }
    }

    #[test]
    fn slopes_are_the_derivatives_of_the_values() {
        let step = 1e-6;
        let (xi, eta) = (0.31, 0.27);
        for (node, slope) in interpolate(xi, eta).slope.into_iter().enumerate() {
            let along = |dx, dy| {
                (interpolate(xi + dx, eta + dy).value[node] - interpolate(xi - dx, eta - dy).value[node]) / (2.0 * step)
            };
            // Central difference: step²/6 times a third derivative of at most 2, and rounding 1e-16/step.
            assert!((along(step, 0.0) - slope[0]).abs() < 1e-9);
            assert!((along(0.0, step) - slope[1]).abs() < 1e-9);
        }
    }
}
