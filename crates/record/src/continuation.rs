//! Continuation of a burst beyond its samples: lines with linearly changing amplitudes, fitted to the periods next to
//! an end.

use std::f64::consts::PI;

/// Harmonics of the drive that are fitted, if the sample rate allows.
const HARMONICS: usize = 3;
/// Highest line that is fitted, as a fraction of the sample rate.
const HIGHEST: f64 = 0.4;

/// x(u) = c + Σ_k (a_k + b_k u) cos kωu + (d_k + e_k u) sin kωu about an edge, u in samples inwards, by least squares
/// under the weights 1 + cos(πu/U) over U samples.
///
/// Exact for a steady tone, and for the ring-up u sin ωu. Outwards (u < 0) the linear growth u is limited to −L
/// tanh(u/L).
#[derive(Debug, Clone)]
pub(super) struct Continuation {
    /// ω, rad a sample.
    angular: f64,
    /// L, samples.
    levels_off: f64,
    mean: f64,
    /// a, b, d, e of each harmonic.
    lines: Vec<[f64; 4]>,
}

impl Continuation {
    /// Fits the samples `inwards(0)`, `inwards(1)`, … up to `reach` of them; the first lies `offset` samples inside
    /// the edge, `period` is in samples. `None` if there are fewer samples than unknowns.
    pub(crate) fn fit(inwards: impl Fn(usize) -> f64, reach: usize, offset: f64, period: f64) -> Option<Self> {
        let angular = 2.0 * PI / period;
        let possible = (HIGHEST * period) as usize;
        let unknowns = |harmonics: usize| 4 * harmonics + 1;
        let harmonics = (1..=HARMONICS.min(possible)).rfind(|&harmonics| reach > unknowns(harmonics) + 2)?;
        let size = unknowns(harmonics);
        let span = reach as f64;
        let mut normal = vec![0.0; size * size];
        let mut right = vec![0.0; size];
        let mut row = vec![0.0; size];
        for i in 0..reach {
            let u = i as f64 + offset;
            let weight = 1.0 + libm::cos(PI * i as f64 / span);
            row[0] = 1.0;
            for k in 0..harmonics {
                let (sin, cos) = sin_cos(angular * (k + 1) as f64 * u);
                let grown = u / span;
                row[4 * k + 1..4 * k + 5].copy_from_slice(&[cos, grown * cos, sin, grown * sin]);
            }
            let value = inwards(i);
            for (p, x) in row.iter().enumerate() {
                right[p] += weight * x * value;
                for (q, y) in row.iter().enumerate() {
                    normal[p * size + q] += weight * x * y;
                }
            }
        }
        let solution = solve(normal, right)?;
        let lines = solution[1..].chunks_exact(4).map(|c| [c[0], c[1] / span, c[2], c[3] / span]).collect();
        Some(Self { angular, levels_off: 3.0 * period, mean: solution[0], lines })
    }

    /// The same with each line kept at half its edge amplitude or more: for a burst that goes on beyond the edge.
    pub(crate) fn going_on(mut self) -> Self {
        if let Some([a, b, d, e]) = self.lines.first() {
            let (size, growth) = (libm::hypot(*a, *d), libm::hypot(*b, *e));
            if growth > 0.0 {
                self.levels_off = self.levels_off.min(0.5 * size / growth);
            }
        }
        self
    }

    /// The value `u` samples inside the edge, or outside (negative).
    pub(crate) fn at(&self, u: f64) -> f64 {
        let grown = if u < 0.0 { self.levels_off * libm::tanh(u / self.levels_off) } else { u };
        let line = |(k, [a, b, d, e]): (usize, &[f64; 4])| {
            let (sin, cos) = sin_cos(self.angular * (k + 1) as f64 * u);
            (a + b * grown) * cos + (d + e * grown) * sin
        };
        self.mean + self.lines.iter().enumerate().map(line).sum::<f64>()
    }

    /// Amplitude of the drive line at the edge.
    pub(crate) fn amplitude(&self) -> f64 {
        self.lines.first().map_or(0.0, |[a, _, d, _]| libm::hypot(*a, *d))
    }

    /// The zero crossing nearest to the edge, within `from`…`to` (samples inside the edge).
    pub(crate) fn zero(&self, from: f64, to: f64) -> Option<f64> {
        const PARTS: usize = 64;
        let place = |part: usize| from + (to - from) * part as f64 / PARTS as f64;
        let crossings = (0..PARTS).filter_map(|part| {
            let (mut low, mut high) = (place(part), place(part + 1));
            let (at_low, at_high) = (self.at(low), self.at(high));
            if at_low == 0.0 {
                return Some(low);
            }
            if at_low * at_high > 0.0 || at_high == 0.0 && part + 1 < PARTS {
                return None;
            }
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if self.at(middle) * at_low > 0.0 { low = middle } else { high = middle }
            }
            Some(0.5 * (low + high))
        });
        crossings.min_by(|a, b| a.abs().total_cmp(&b.abs()))
    }
}

fn sin_cos(angle: f64) -> (f64, f64) {
    (libm::sin(angle), libm::cos(angle))
}

/// Solves the symmetric positive definite system `matrix` x = `right` by Cholesky factorisation; `None` if it is
/// singular.
fn solve(mut matrix: Vec<f64>, mut right: Vec<f64>) -> Option<Vec<f64>> {
    let n = right.len();
    for j in 0..n {
        let before = matrix[j * n + j];
        let pivot = before - (0..j).map(|k| matrix[j * n + k].powi(2)).sum::<f64>();
        if !(pivot > 1e-13 * before) {
            return None;
        }
        let root = pivot.sqrt();
        matrix[j * n + j] = root;
        for i in j + 1..n {
            let sum: f64 = (0..j).map(|k| matrix[i * n + k] * matrix[j * n + k]).sum();
            matrix[i * n + j] = (matrix[i * n + j] - sum) / root;
        }
        right[j] = (right[j] - (0..j).map(|k| matrix[j * n + k] * right[k]).sum::<f64>()) / root;
    }
    for j in (0..n).rev() {
        right[j] = (right[j] - (j + 1..n).map(|k| matrix[k * n + j] * right[k]).sum::<f64>()) / matrix[j * n + j];
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_with_harmonics_and_offset_are_continued_exactly() {
        let period = 31.7;
        let tone = |u: f64| {
            let phase = 2.0 * PI * u / period + 0.3;
            0.02 + phase.sin() + 0.05 * (2.0 * phase + 1.0).sin() - 0.01 * (3.0 * phase).cos()
        };
        let fit = Continuation::fit(|i| tone(i as f64 + 0.4), 95, 0.4, period).unwrap();
        for u in [-200.0, -31.0, -0.3, 50.0] {
            assert!((fit.at(u) - tone(u)).abs() < 1e-9, "{u}: {} {}", fit.at(u), tone(u));
        }
    }

    #[test]
    fn a_ring_up_is_continued_through_its_beginning() {
        let period = 60.0;
        let ring_up = |u: f64| u * (2.0 * PI * u / period).sin();
        let fit = Continuation::fit(|i| ring_up(i as f64), 180, 0.0, period).unwrap();
        assert!((fit.at(-5.0) - ring_up(-5.0)).abs() < 0.02, "{} {}", fit.at(-5.0), ring_up(-5.0));
    }

    #[test]
    fn four_samples_a_period_carry_one_line() {
        let tone = |u: f64| (2.0 * PI * u / 4.1).sin();
        let fit = Continuation::fit(|i| tone(i as f64 + 0.2), 12, 0.2, 4.1).unwrap();
        assert_eq!(fit.lines.len(), 1);
        assert!(fit.zero(-1.0, 0.2).unwrap().abs() < 1e-9);
        assert!(Continuation::fit(|i| tone(i as f64), 5, 0.0, 4.1).is_none());
    }
}
