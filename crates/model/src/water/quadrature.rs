//! Gauss–Legendre quadrature of any order.

use std::f64::consts::PI;

/// Nodes and weights on (0, 1): ∫₀¹ f dx = Σ w f(x), exact for polynomials up to degree 2n − 1.
///
/// Newton's iteration on Legendre's polynomial. Davis & Rabinowitz (1984), *Methods of Numerical Integration*, §2.7.
pub(crate) fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    (0..count)
        .map(|k| {
            let mut x = (PI * (k as f64 + 0.75) / (count as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut before, mut value) = (1.0, x);
                for n in 2..=count {
                    let n = n as f64;
                    (before, value) = (value, ((2.0 * n - 1.0) * x * value - (n - 1.0) * before) / n);
                }
                slope = count as f64 * (x * value - before) / (x * x - 1.0);
                let change = value / slope;
                x -= change;
                if change.abs() < 1e-15 {
                    break;
                }
            }
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monomials_up_to_the_stated_degree_are_exact() {
        for count in [1, 2, 3, 4, 7, 16, 48] {
            let rule = gauss_legendre(count);
            let integral = |power: usize| rule.iter().map(|(x, w)| w * x.powi(power as i32)).sum::<f64>();
            for power in 0..2 * count {
                // Rounding of the nodes and of `count` terms.
                assert!((integral(power) * (power + 1) as f64 - 1.0).abs() < 2e-13, "{count} points, x^{power}");
            }
            let missed = (integral(2 * count) * (2 * count + 1) as f64 - 1.0).abs();
            assert!(count > 7 || missed > 1e-9, "{count}: one degree more is not exact");
        }
    }
}
