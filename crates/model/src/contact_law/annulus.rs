//! Static force law of the steel bead on the resin annulus.

use serde::{Deserialize, Serialize};

use super::ElasticLaw;

/// Axial force of a 1 mm steel bead pressed into the resin annulus that holds the last bead of the chain.
///
/// Bead and annulus touch along a circle, so the contact is one of two cylinders bent round, and the approach w of a line
/// contact under the axial force F is
///
/// w = F (C − D ln(F/1 N)), D = 1/(cos²φ · 2πr · π E*)
///
/// with the circle's radius r = 0.367 mm, the normal φ = 47.2° from the axis, E* = 1.584 GPa of steel on resin: D = 0.1888 µm/N.
/// C, which holds everything far from the contact, has no such closed form. Both are fitted here, by least squares of the relative
/// error in F, to five points of a converged static finite-element solution (0.0498 N at 0.1 µm, 0.298 at 0.5, 0.653 at 1,
/// 1.444 at 2, 4.198 at 5 µm): C = 1.4542, D = 0.1842 µm/N (2.4 % below the theoretical D), residuals in F
/// +0.07, +0.04, −0.10, −0.12, +0.11 %.
///
/// Valid up to 5 µm. The closed form has a turning point, dF/dw → ∞, at 182 µm and 987 N, where the bead would have sunk through
/// the resin; from 20 µm (23 N) on its tangent is continued instead, so force and tangent stay continuous and monotone at any w.
///
/// Johnson (1985), *Contact Mechanics*, §5.6.
///
/// ```
/// # use granchain_model::contact_law::{Annulus, ElasticLaw};
/// assert!((Annulus::new(1.0).force(1e-6) - 0.653).abs() < 0.001);
/// ```
///
/// `fitted` is the same law with C and D of another ring, bead or mesh.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Annulus {
    stiffness_factor: f64,
    #[serde(rename = "c_m_per_n")]
    constant: f64,
    #[serde(rename = "d_m_per_n")]
    slope: f64,
    /// Approaches between which the polynomial holds, m; beyond the larger the tangent is continued.
    #[serde(rename = "approaches_m")]
    pub(crate) between: (f64, f64),
    /// Force (N), tangent (N/m) and energy (J) at the larger for a factor of 1.
    #[serde(rename = "at_largest_n_n_per_m_j")]
    largest: (f64, f64, f64),
}

impl Annulus {
    /// C, m/N.
    pub(crate) const C: f64 = 1.4542e-6;
    /// D, m/N.
    pub(crate) const D: f64 = 0.1842e-6;
    /// Approach beyond which the tangent is continued, m.
    pub(crate) const LARGEST: f64 = 20e-6;

    /// Smallest approach the polynomial is fitted for, m.
    pub(crate) const SMALLEST_FITTED: f64 = 1e-11;
    /// Middle and half width of √a between both.
    pub(crate) const MIDDLE: f64 = 2.999_946_192_941_544;
    pub(crate) const HALF_WIDTH: f64 = 1.209_076_497_160_271_7;
    /// g in powers of t = (√a − middle)/half width, fitted at Chebyshev points with the relative error as weight: 4e-8.
    pub(crate) const POLYNOMIAL: [f64; 11] = [
        11.436_486_175_733_176,
        7.949_423_753_999_912,
        1.337_200_136_426_945,
        0.033_572_612_334_601_56,
        -0.011_648_575_483_805_091,
        0.005_121_192_920_463_171,
        -0.002_680_226_872_446_657_4,
        0.000_644_761_819_264_571_1,
        3.798_436_599_489_766e-5,
        0.000_684_447_439_066_563_5,
        -0.000_504_536_487_982_777_5,
    ];

    /// The law with its force multiplied by `stiffness_factor` (1).
    pub fn new(stiffness_factor: f64) -> Self {
        Self::between(Self::C, Self::D, (Self::SMALLEST_FITTED, Self::LARGEST)).times(stiffness_factor)
    }

    /// The law with C (`constant`, m/N) and D (`slope`, m/N, positive) of its own and a factor of 1.
    ///
    /// Its tangent is continued from where it has the same share of the approach at the turning point, w = D e^(C/D − 1).
    pub(crate) fn fitted(constant: f64, slope: f64) -> Self {
        let reached = |overlap: f64| {
            let a = Self::C / Self::D - libm::log(overlap / Self::D);
            slope * libm::exp(constant / slope - a)
        };
        Self::between(constant, slope, (reached(Self::SMALLEST_FITTED), reached(Self::LARGEST)))
    }

    fn between(constant: f64, slope: f64, between: (f64, f64)) -> Self {
        let mut law = Self { stiffness_factor: 1.0, constant, slope, between, largest: (0.0, 0.0, 0.0) };
        let secant = law.secant_compliance(between.1);
        let force = between.1 / secant;
        law.largest = (force, 1.0 / (secant - slope), law.stored(force, secant));
        law
    }

    /// The same with its force multiplied once more.
    #[must_use]
    pub(crate) fn times(self, factor: f64) -> Self {
        Self { stiffness_factor: factor * self.stiffness_factor, ..self }
    }

    /// The same with a stiffness factor of 1.
    #[must_use]
    pub(crate) fn unscaled(self) -> Self {
        Self { stiffness_factor: 1.0, ..self }
    }

    pub(crate) fn constant(&self) -> f64 {
        self.constant
    }

    pub(crate) fn slope(&self) -> f64 {
        self.slope
    }

    /// The factor on the force, 1.
    pub(crate) fn stiffness_factor(&self) -> f64 {
        self.stiffness_factor
    }

    /// G = w/F = C − D ln F, m/N, up to where the tangent is continued: the root of G − D ln G = C − D ln w.
    ///
    /// In units of D, g − ln g = a, convex and increasing for g > 1. Above 0.01 nm a polynomial in √a, good to 4e-8, starts Newton's
    /// method, whose first step squares that error to rounding; below, the iteration starts at a + ln a, stays to the right of the minimum
    /// and is monotone from its second iterate on.
    fn secant_compliance(&self, overlap: f64) -> f64 {
        let a = self.constant / self.slope - libm::log(overlap / self.slope);
        let newton = |g: f64| (g - libm::log(g) - a) / (1.0 - 1.0 / g);
        if overlap >= self.between.0 {
            let t = (a.sqrt() - Self::MIDDLE) / Self::HALF_WIDTH;
            let g = Self::POLYNOMIAL.iter().rev().fold(0.0, |sum, coefficient| sum * t + coefficient);
            return (g - newton(g)) * self.slope;
        }
        let mut g = (a + libm::log(a.max(1.0))).max(2.0);
        for _ in 0..20 {
            let change = newton(g);
            g = (g - change).max(1.5);
            if change.abs() <= 1e-15 * g {
                break;
            }
        }
        g * self.slope
    }

    /// ∫F dw = (F²/2)(C − D/2 − D ln F), with G = C − D ln F.
    fn stored(&self, force: f64, secant: f64) -> f64 {
        0.5 * force * force * (secant - 0.5 * self.slope)
    }
}

impl ElasticLaw for Annulus {
    const IS_HERTZ: bool = false;

    fn force(&self, overlap: f64) -> f64 {
        if overlap <= 0.0 {
            0.0
        } else if overlap <= self.between.1 {
            self.stiffness_factor * overlap / self.secant_compliance(overlap)
        } else {
            let (force, tangent, _) = self.largest;
            self.stiffness_factor * (force + tangent * (overlap - self.between.1))
        }
    }

    fn tangent_stiffness(&self, overlap: f64) -> f64 {
        if overlap <= 0.0 {
            0.0
        } else if overlap <= self.between.1 {
            self.stiffness_factor / (self.secant_compliance(overlap) - self.slope)
        } else {
            self.stiffness_factor * self.largest.1
        }
    }

    fn energy(&self, overlap: f64) -> f64 {
        if overlap <= 0.0 {
            0.0
        } else if overlap <= self.between.1 {
            let secant = self.secant_compliance(overlap);
            self.stiffness_factor * self.stored(overlap / secant, secant)
        } else {
            let (force, tangent, energy) = self.largest;
            let further = overlap - self.between.1;
            self.stiffness_factor * (energy + (force + 0.5 * tangent * further) * further)
        }
    }

    fn overlap(&self, force: f64) -> f64 {
        let force = force.max(0.0) / self.stiffness_factor;
        let (largest, tangent, _) = self.largest;
        if force == 0.0 {
            0.0
        } else if force <= largest {
            force * (self.constant - self.slope * libm::log(force))
        } else {
            self.between.1 + (force - largest) / tangent
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [(f64, f64); 5] = [(0.1e-6, 0.0498), (0.5e-6, 0.298), (1e-6, 0.653), (2e-6, 1.444), (5e-6, 4.198)];

    #[test]
    fn the_law_passes_through_the_five_static_points() {
        for (approach, force) in POINTS {
            // Worst residual of the fit, 0.12 %; the points carry three to four digits.
            assert!((Annulus::new(1.0).force(approach) / force - 1.0).abs() < 1.3e-3, "{approach}");
            assert!((Annulus::new(0.7).force(approach) / (0.7 * force) - 1.0).abs() < 1.3e-3, "{approach}");
        }
    }

    #[test]
    fn the_fitted_logarithm_is_that_of_a_line_contact() {
        let modulus = 1.0 / ((1.0 - 0.35f64.powi(2)) / 1.4e9 + (1.0 - 0.3f64.powi(2)) / 201e9);
        let (radius, angle) = (0.367e-3, 47.2f64.to_radians());
        let pi = std::f64::consts::PI;
        let theory = 1.0 / (angle.cos().powi(2) * 2.0 * pi * radius * pi * modulus);
        // Five points of three digits fix D to about 3 %.
        assert!((Annulus::D / theory - 1.0).abs() < 0.03, "{theory:e}");
    }

    #[test]
    fn the_law_lies_within_four_per_cent_of_the_published_power_law() {
        for approach in [0.1f64, 0.5, 1.0, 2.0, 5.0] {
            let power = 0.668 * approach.powf(1.144);
            assert!((Annulus::new(1.0).force(approach * 1e-6) / power - 1.0).abs() < 0.045, "{approach}");
        }
    }

    #[test]
    fn force_and_tangent_grow_steadily_far_beyond_the_turning_point() {
        let law = Annulus::new(1.0);
        let approaches = (0..4000).map(|i| 1e-13 * 1.01f64.powi(i)).take_while(|w| *w < 1.0);
        let mut before = (0.0, 0.0);
        for approach in approaches {
            let now = (law.force(approach), law.tangent_stiffness(approach));
            assert!(now.0 > before.0 && now.1 >= before.1, "{approach}: {now:?} after {before:?}");
            before = now;
        }
        assert!((law.tangent_stiffness(20.1e-6) / law.tangent_stiffness(19.9e-6) - 1.0).abs() < 0.01);
        assert!((law.force(20.000_001e-6) / law.force(19.999_999e-6) - 1.0).abs() < 1e-6);
    }
}
