//! The annulus' law for eight runs side by side.

#![allow(clippy::needless_range_loop, reason = "one index for several arrays is what the compiler turns into vectors")]

use crate::{
    contact_law::{Annulus, ElasticLaw},
    number::{Lane, Number, WIDTH},
};

/// ln x for 2⁻⁶⁴ < x < 2⁶⁴: exponent and mantissa apart, the mantissa within [√½, √2) by the series of artanh. Error below 3e-9.
#[inline(always)]
fn logarithm(x: Lane) -> Lane {
    /// Bits of √½ less 64 in the exponent, so that the shifted exponent stays positive.
    const ORIGIN: u64 = std::f64::consts::FRAC_1_SQRT_2.to_bits() - (64 << 52);
    /// 2⁵² + 2⁵¹: adding a small integer to its bits adds it to its value.
    const MAGIC: f64 = 6_755_399_441_055_744.0;
    let mut shifted = [0u64; WIDTH];
    let (mut mantissa, mut exponent) = (Lane::ZERO, Lane::ZERO);
    for k in 0..WIDTH {
        shifted[k] = x.0[k].to_bits().wrapping_sub(ORIGIN) >> 52;
    }
    for k in 0..WIDTH {
        mantissa.0[k] = f64::from_bits(x.0[k].to_bits().wrapping_sub(shifted[k].wrapping_sub(64) << 52));
    }
    for k in 0..WIDTH {
        exponent.0[k] = f64::from_bits(MAGIC.to_bits() + shifted[k]) - (MAGIC + 64.0);
    }
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let q = s * s;
    let series = (((q * (1.0 / 9.0) + 1.0 / 7.0) * q + 1.0 / 5.0) * q + 1.0 / 3.0) * q + 1.0;
    exponent * std::f64::consts::LN_2 + s * 2.0 * series
}

/// The law of [`Annulus`] with a stiffness factor of 1, by a polynomial in place of its Newton iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AnnulusLane {
    /// C/D, 1.
    ratio: f64,
    /// D, m/N.
    slope: f64,
    /// Approaches between which the polynomial holds, m.
    between: (f64, f64),
    /// Tangent beyond, N/m.
    end_tangent: f64,
}

impl AnnulusLane {
    pub(crate) fn new(law: Annulus) -> Self {
        let law = law.unscaled();
        Self {
            ratio: law.constant() / law.slope(),
            slope: law.slope(),
            between: law.between,
            end_tangent: law.tangent_stiffness(2.0 * law.between.1),
        }
    }

    /// Force (N) for δ ≥ 0 (m). Relative error below 2e-7 above 0.01 nm; below, where the force is under 3 µN, the law is continued as a
    /// line through the origin.
    #[inline(always)]
    pub(crate) fn force(&self, overlap: Lane) -> Lane {
        let inside = overlap.at_most(self.between.1);
        let argument = inside.at_least(self.between.0);
        // g − ln g = a, with w = F D g; g is smooth in √a.
        let a = Lane([self.ratio; WIDTH]) - logarithm(argument * (1.0 / self.slope));
        let t = (a.root() - Annulus::MIDDLE) * (1.0 / Annulus::HALF_WIDTH);
        let mut g = Lane([Annulus::POLYNOMIAL[10]; WIDTH]);
        for coefficient in Annulus::POLYNOMIAL[..10].iter().rev() {
            g = g * t + *coefficient;
        }
        inside / (g * self.slope) + (overlap - inside) * self.end_tangent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_logarithm_is_good_to_three_parts_in_a_billion() {
        for i in 0..20_000 {
            let x = 1e-6 * 1.002f64.powi(i % 14_000) * (1.0 + f64::from(i) * 1e-7);
            // Truncation of the series at s¹¹: 2 s¹¹/11 = 7e-10 for |s| ≤ 0.1716.
            assert!((logarithm(Lane([x; WIDTH])).0[3] - x.ln()).abs() < 3e-9, "{x}");
        }
    }

    #[test]
    fn the_fast_annulus_follows_the_exact_one() {
        let exact = Annulus::new(1.0);
        let lane = AnnulusLane::new(exact);
        let fast = |overlap: f64| lane.force(Lane([overlap; WIDTH])).0[0];
        for i in 0..8000 {
            let overlap = 1e-11 * 1.002f64.powi(i);
            // Fit 4e-8, logarithm 3e-9 in a: together below 2e-7.
            assert!((fast(overlap) / exact.force(overlap) - 1.0).abs() < 2e-7, "{overlap}");
        }
        for overlap in [0.0, 1e-15, 1e-12, 5e-12] {
            assert!((fast(overlap) - exact.force(overlap)).abs() < 1e-6);
        }
        assert_eq!(fast(0.0), 0.0);
    }
}
