//! Kaiser-windowed sinc of all filters here, and continuation of a record beyond its ends.
//!
//! h(x) = 2c sinc(2c x) · I₀(β √(1 − (x/L)²))/I₀(β) for |x| ≤ L, else 0; x in samples, c the −6 dB cutoff in cycles a
//! sample, L half the length. The design is for 100 dB: β = 0.1102 (100 − 8.7), and a transition band of full width Δ
//! (cycles a sample) needs 2L = (100 − 7.95)/(2.285 · 2πΔ). Pass band within 1e-5 of one, stop band below 1e-5.
//!
//! Kaiser (1974), "Nonrecursive digital filter design using the I₀-sinh window function"; Oppenheim & Schafer,
//! *Discrete-Time Signal Processing*, 3rd ed., §7.6.

use std::f64::consts::PI;

const ATTENUATION_DB: f64 = 100.0;

/// β of the Kaiser window.
const BETA: f64 = 0.1102 * (ATTENUATION_DB - 8.7);

/// I₀(β).
const AT_CENTRE: f64 = bessel_i0(BETA * BETA);

/// Half the length (samples) that a transition band of full width `transition` (cycles a sample) needs.
pub(super) fn half_length(transition: f64) -> f64 {
    0.5 * (ATTENUATION_DB - 7.95) / (2.285 * 2.0 * PI * transition)
}

/// h at `x` samples from the centre, for −6 dB cutoff `cutoff` (cycles a sample) and half length `half` (samples).
pub(super) fn windowed_sinc(x: f64, cutoff: f64, half: f64) -> f64 {
    if x.abs() >= half { 0.0 } else { unbounded(x, cutoff, half) }
}

/// The kernel with its window continued smoothly beyond ±L (where I₀ turns into J₀).
fn unbounded(x: f64, cutoff: f64, half: f64) -> f64 {
    let u = x / half;
    let phase = 2.0 * PI * cutoff * x;
    let sinc = if phase.abs() < 1e-8 { 1.0 } else { libm::sin(phase) / phase };
    2.0 * cutoff * sinc * bessel_i0(BETA * BETA * (1.0 - u * u)) / AT_CENTRE
}

/// Modified Bessel function I₀(√`square`) by its power series Σ (square/4)ᵏ/k!².
const fn bessel_i0(square: f64) -> f64 {
    let (mut sum, mut term, mut k) = (1.0, 1.0, 1.0);
    while f64::abs(term) > 1e-17 * f64::abs(sum) {
        term *= 0.25 * square / (k * k);
        sum += term;
        k += 1.0;
    }
    sum
}

/// The windowed sinc tabulated finely enough (1,024 points a lobe, cubic between them) to be good to 1e-11 of its peak.
#[derive(Debug, Clone)]
pub(super) struct Tabulated {
    half: f64,
    spacing: f64,
    values: Vec<f64>,
}

impl Tabulated {
    pub(super) fn new(cutoff: f64, half: f64) -> Self {
        let spacing = 1.0 / (2.0 * cutoff * 1024.0);
        let count = (half / spacing).ceil() as usize + 4;
        // One point before the centre, so that the cubic never runs out of points.
        let values = (0..count).map(|i| unbounded((i as f64 - 1.0) * spacing, cutoff, half)).collect();
        Self { half, spacing, values }
    }

    pub(super) fn at(&self, x: f64) -> f64 {
        if x.abs() >= self.half {
            return 0.0;
        }
        let position = x.abs() / self.spacing;
        let whole = position as usize;
        let Some(&[a, b, c, d]) = self.values.get(whole..whole + 4).and_then(|w| <&[f64; 4]>::try_from(w).ok()) else {
            return 0.0;
        };
        let s = position - whole as f64;
        // Cubic Lagrange through the points at −1, 0, 1, 2.
        let (p, q, r) = (s + 1.0, s - 1.0, s - 2.0);
        -s * q * r / 6.0 * a + p * q * r / 2.0 * b - p * s * r / 2.0 * c + p * s * q / 6.0 * d
    }
}

/// Sample `index` of `values` continued beyond its ends by reflection through the end points: x₋ᵢ = 2x₀ − xᵢ. A straight
/// line continues as itself. Beyond one reflected length the last reflected value is held.
pub(super) fn continued(values: &[f64], index: isize) -> f64 {
    let last = values.len() as isize - 1;
    if index < 0 {
        2.0 * values[0] - values[index.unsigned_abs().min(last as usize)]
    } else if index > last {
        2.0 * values[last as usize] - values[(2 * last - index).max(0) as usize]
    } else {
        values[index as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_i0_meets_tabulated_values() {
        // Abramowitz & Stegun, table 9.8 and 9.11: I0(1), I0(5), I0(10).
        for (x, expected) in
            [(1.0, 1.266_065_877_752_008_4), (5.0, 27.239_871_823_604_442), (10.0, 2_815.716_628_466_254)]
        {
            assert!((bessel_i0(x * x) / expected - 1.0).abs() < 1e-14, "I0({x}) = {}", bessel_i0(x * x));
        }
    }

    #[test]
    fn table_follows_the_kernel() {
        let (cutoff, half) = (0.31, 24.3);
        let table = Tabulated::new(cutoff, half);
        for i in 0..5000 {
            let x = i as f64 * 0.005;
            // (π/1024)⁴ · 3/128 = 2e-12 of the lobe, with room for the window's own curvature.
            assert!((table.at(x) - windowed_sinc(x, cutoff, half)).abs() < 1e-11, "at {x}");
        }
    }

    #[test]
    fn a_straight_line_continues_as_itself() {
        let line: Vec<f64> = (0..10).map(|i| 3.0 - 0.5 * f64::from(i)).collect();
        for index in -9..19 {
            assert!((continued(&line, index) - (3.0 - 0.5 * index as f64)).abs() < 1e-14);
        }
    }
}
