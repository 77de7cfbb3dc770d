//! Kernels of finite length: their averages over the steps of a clock, and their spectrum.
//!
//! A kernel is smooth between its breaks, where it may begin or end like a square root: each piece is integrated by Gauss–Legendre
//! quadrature in the angle of x = m − h cos θ, in which such ends are smooth.

use std::f64::consts::PI;

use faer::c64;

use crate::{tally, water::quadrature::gauss_legendre};

/// Points of the quadrature in a piece of one cell.
const POINTS: usize = 8;

/// A family of kernels h_i(τ), i < width, that vanish outside the first and the last break.
pub(super) struct Memory<F: Fn(f64, &mut [f64])> {
    /// τ of the breaks, s, ascending.
    pub breaks: Vec<f64>,
    pub width: usize,
    /// Writes h_i(τ).
    pub kernel: F,
}

impl<F: Fn(f64, &mut [f64])> Memory<F> {
    /// Σ over the points of (from, to) of weight × (τ, h(τ)).
    pub(super) fn over(&self, from: f64, to: f64, rule: &[(f64, f64)], mut add: impl FnMut(f64, f64, &[f64])) {
        let mut values = vec![0.0; self.width];
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        for &(x, weight) in rule {
            let (sine, cosine) = (PI * x).sin_cos();
            let tau = middle - half * cosine;
            (self.kernel)(tau, &mut values);
            add(tau, weight * PI * half * sine, &values);
        }
    }

    /// Averages over the cells (m Δ, (m + 1) Δ): number m × width + i is (1/Δ) ∫ h_i dτ.
    pub(crate) fn averages(&self, step: f64) -> Vec<f64> {
        tally::add(|made| made.kernels += 1);
        let rule = gauss_legendre(POINTS);
        let end = self.breaks.last().copied().unwrap_or(0.0);
        let cells = (end / step - 1e-9).ceil().max(0.0) as usize;
        let mut out = vec![0.0; cells * self.width];
        for (cell, sums) in out.chunks_exact_mut(self.width).enumerate() {
            let (from, to) = (cell as f64 * step, (cell + 1) as f64 * step);
            for piece in self.breaks.windows(2) {
                let (low, high) = (piece[0].max(from), piece[1].min(to));
                if low < high {
                    self.over(low, high, &rule, |_, weight, values| {
                        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value / step);
                    });
                }
            }
        }
        out
    }

    /// ∫ h_i(τ) e^{−iωτ} dτ.
    pub(crate) fn spectrum(&self, angular_frequency: f64) -> Vec<c64> {
        let mut out = vec![c64::new(0.0, 0.0); self.width];
        for piece in self.breaks.windows(2) {
            let phase = angular_frequency.abs() * (piece[1] - piece[0]);
            let rule = gauss_legendre(28 + phase.min(1e4) as usize);
            self.over(piece[0], piece[1], &rule, |tau, weight, values| {
                let (sine, cosine) = (angular_frequency * tau).sin_cos();
                for (sum, value) in out.iter_mut().zip(values) {
                    *sum += c64::new(weight * value * cosine, -weight * value * sine);
                }
            });
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// √(τ − 1) on (1, 3), and 1.
    fn memory() -> Memory<impl Fn(f64, &mut [f64])> {
        let kernel = |tau: f64, out: &mut [f64]| out.copy_from_slice(&[(tau - 1.0).max(0.0).sqrt(), 1.0]);
        Memory { breaks: vec![1.0, 3.0], width: 2, kernel }
    }

    #[test]
    fn averages_of_a_square_root_are_exact_where_it_begins_and_add_up() {
        let averages = memory().averages(0.3);
        assert_eq!(averages.len(), 2 * 10);
        assert_eq!(averages[..6], [0.0; 6]);
        let primitive = |tau: f64| (tau - 1.0).clamp(0.0, 2.0).powf(1.5) / 1.5;
        for cell in 0..10 {
            let exact = (primitive(0.3 * (cell + 1) as f64) - primitive(0.3 * cell as f64)) / 0.3;
            // Eight points on a smooth function of the angle.
            assert!((averages[2 * cell] - exact).abs() < 1e-8, "{cell}: {} {exact}", averages[2 * cell]);
        }
        let sum: f64 = averages.iter().skip(1).step_by(2).sum();
        assert!((0.3 * sum - 2.0).abs() < 1e-8);
    }

    #[test]
    fn the_spectrum_of_a_box_is_a_sinc() {
        for omega in [0.0, 0.7, 5.0, 60.0] {
            let found = memory().spectrum(omega)[1];
            let size = if omega == 0.0 { 2.0 } else { 2.0 * omega.sin() / omega };
            let exact = c64::new(size * (2.0 * omega).cos(), -size * (2.0 * omega).sin());
            assert!((found - exact).norm() < 1e-12, "{omega}: {found} {exact}");
        }
    }
}
