//! Sine and cosine of four angles at once.

#![allow(clippy::needless_range_loop, reason = "one index for several arrays is what the compiler turns into vectors")]
#![allow(clippy::excessive_precision, clippy::unreadable_literal, reason = "published coefficients, digit for digit")]

/// Angles taken together.
pub(super) const TOGETHER: usize = 4;
/// Largest angle that is reduced exactly, rad: so many quarter turns times the first part of π/2 have no rounding.
pub(super) const LARGEST: f64 = 1e6;

/// π/2 in three parts, the first two of 33 bits.
const QUARTER: [f64; 3] = [1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21];
/// sin r = r + r³ (S₀ + S₁ r² + …) for |r| ≤ π/4.
const SINE: [f64; 6] = [
    -1.66666666666666324348e-01,
    8.33333333332248946124e-03,
    -1.98412698298579493134e-04,
    2.75573137070700676789e-06,
    -2.50507602534068634195e-08,
    1.58969099521155010221e-10,
];
/// cos r = 1 − r²/2 + r⁴ (C₀ + C₁ r² + …) for |r| ≤ π/4.
const COSINE: [f64; 6] = [
    4.16666666666666019037e-02,
    -1.38888888888741095749e-03,
    2.48015872894767294178e-05,
    -2.75573143513906633035e-07,
    2.08757232129817482790e-09,
    -1.13596475577881948265e-11,
];

/// Sine and cosine, to two units in the last place, of angles up to [`LARGEST`] (rad). The coefficients are those of the C library fdlibm.
#[inline(always)]
pub(super) fn sin_cos(angles: [f64; TOGETHER]) -> ([f64; TOGETHER], [f64; TOGETHER]) {
    /// 2⁵² + 2⁵¹: what is added to it is rounded to an integer, which its last bits then show.
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    let (mut sine, mut cosine) = ([0.0; TOGETHER], [0.0; TOGETHER]);
    for k in 0..TOGETHER {
        let shifted = angles[k] * std::f64::consts::FRAC_2_PI + MAGIC;
        let (turns, quarter) = (shifted - MAGIC, shifted.to_bits());
        let r = angles[k] - turns * QUARTER[0] - turns * QUARTER[1] - turns * QUARTER[2];
        let z = r * r;
        let of = |c: [f64; 6]| c[0] + z * (c[1] + z * (c[2] + z * (c[3] + z * (c[4] + z * c[5]))));
        let (s, c) = ((r + r * z * of(SINE)).to_bits(), (1.0 - (0.5 * z - z * z * of(COSINE))).to_bits());
        // An odd number of quarter turns exchanges the two.
        let exchanged = (s ^ c) & (quarter & 1).wrapping_neg();
        sine[k] = f64::from_bits(s ^ exchanged ^ (quarter & 2) << 62);
        cosine[k] = f64::from_bits(c ^ exchanged ^ (quarter.wrapping_add(1) & 2) << 62);
    }
    (sine, cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_are_good_to_two_units_in_the_last_place() {
        for i in 0..200_000 {
            let x = f64::from(i - 100_000) * if i % 3 == 0 { 9.9 } else { 3.7e-4 };
            let (sine, cosine) = sin_cos([x, 0.0, 0.5 * x, -x]);
            for (found, expected) in [
                (sine[0], x.sin()),
                (cosine[0], x.cos()),
                (sine[2], (0.5 * x).sin()),
                (cosine[2], (0.5 * x).cos()),
                (sine[3], (-x).sin()),
            ] {
                assert!((found - expected).abs() <= 2.0 * f64::EPSILON * expected.abs(), "{x}: {found} {expected}");
            }
        }
        assert_eq!(sin_cos([0.0; 4]), ([0.0; 4], [1.0; 4]));
    }
}
