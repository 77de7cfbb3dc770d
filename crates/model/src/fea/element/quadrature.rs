use crate::fea::mesh::Shape;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussPoint {
    pub xi: f64,
    pub eta: f64,
    /// Weight, 1: the weights sum to the parametric area, 4 or ½.
    pub weight: f64,
}

pub(super) const MOST_POINTS: usize = 9;

/// √0.6, abscissa of the three-point Gauss rule.
const GAUSS_3: f64 = 0.774_596_669_241_483_4;
/// Abscissa and weight of the three-point Gauss rule on −1…1, of degree 5.
pub(crate) const GAUSS_LINE: [(f64, f64); 3] = [(-GAUSS_3, 5.0 / 9.0), (0.0, 8.0 / 9.0), (GAUSS_3, 5.0 / 9.0)];
const ROOT_15: f64 = 3.872_983_346_207_417;

/// Points of an element: 3 × 3 Gauss (degree 5 in each direction) or the 7-point rule of degree 5 on the triangle.
///
/// Hammer, Marlowe & Stroud (1956) for the triangle; Stroud (1971), *Approximate Calculation of Multiple Integrals*, T2:5-1.
pub fn rule(shape: Shape) -> impl Iterator<Item = GaussPoint> {
    let mut points = [GaussPoint { xi: 0.0, eta: 0.0, weight: 0.0 }; MOST_POINTS];
    let count = match shape {
        Shape::Quadrilateral8 => {
            for (k, point) in points.iter_mut().enumerate() {
                let ((xi, along), (eta, across)) = (GAUSS_LINE[k % 3], GAUSS_LINE[k / 3]);
                *point = GaussPoint { xi, eta, weight: along * across };
            }
            9
        }
        Shape::Triangle6 => {
            points[0] = GaussPoint { xi: 1.0 / 3.0, eta: 1.0 / 3.0, weight: 9.0 / 80.0 };
            for (ring, sign) in [-1.0, 1.0].into_iter().enumerate() {
                let near = (6.0 + sign * ROOT_15) / 21.0;
                let far = 1.0 - 2.0 * near;
                let weight = (155.0 + sign * ROOT_15) / 2400.0;
                for (k, (xi, eta)) in [(near, near), (far, near), (near, far)].into_iter().enumerate() {
                    points[1 + 3 * ring + k] = GaussPoint { xi, eta, weight };
                }
            }
            7
        }
    };
    points.into_iter().take(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn integral(shape: Shape, p: i32, q: i32) -> f64 {
        rule(shape).map(|point| point.weight * point.xi.powi(p) * point.eta.powi(q)).sum()
    }

    fn factorial(n: i32) -> f64 {
        (1..=n).map(f64::from).product()
    }

    #[test]
    fn rules_integrate_their_degree_exactly() {
        for p in 0..=5 {
            for q in 0..=5 {
                let line = |n: i32| if n % 2 == 0 { 2.0 / f64::from(n + 1) } else { 0.0 };
                // Rounding of nine terms of order one.
                assert!((integral(Shape::Quadrilateral8, p, q) - line(p) * line(q)).abs() < 1e-15, "{p} {q}");
                if p + q <= 5 {
                    let exact = factorial(p) * factorial(q) / factorial(p + q + 2);
                    assert!((integral(Shape::Triangle6, p, q) - exact).abs() < 1e-15, "{p} {q}");
                }
            }
        }
        assert!((integral(Shape::Triangle6, 6, 0) - factorial(6) / factorial(8)).abs() > 1e-6);
    }
}
