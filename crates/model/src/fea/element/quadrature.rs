#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussPoint {
    pub xi: f64,
    pub eta: f64,
    /// Weight, 1: the weights sum to the parametric area, 4.
    pub weight: f64,
}

/// √0.6, abscissa of the three-point Gauss rule.
const GAUSS_3: f64 = 0.774_596_669_241_483_4;
/// Abscissa and weight of the three-point Gauss rule on −1…1, of degree 5.
pub(crate) const GAUSS_LINE: [(f64, f64); 3] = [(-GAUSS_3, 5.0 / 9.0), (0.0, 8.0 / 9.0), (GAUSS_3, 5.0 / 9.0)];

/// Points of an element: 3 × 3 Gauss, of degree 5 in each direction.
pub fn rule() -> [GaussPoint; 9] {
    std::array::from_fn(|k| {
        let ((xi, along), (eta, across)) = (GAUSS_LINE[k % 3], GAUSS_LINE[k / 3]);
        GaussPoint { xi, eta, weight: along * across }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_integrate_their_degree_exactly() {
        for p in 0..=5 {
            for q in 0..=5 {
                let line = |n: i32| if n % 2 == 0 { 2.0 / f64::from(n + 1) } else { 0.0 };
                let sum: f64 = rule().iter().map(|point| point.weight * point.xi.powi(p) * point.eta.powi(q)).sum();
                // Rounding of nine terms of order one.
                assert!((sum - line(p) * line(q)).abs() < 1e-15, "{p} {q}");
            }
        }
    }
}
