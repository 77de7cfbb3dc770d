//! The contact of the last bead with the disc.
//!
//! The bead's centre is at u, the disc's front at w where the contact force F is spread over a small patch. Hertz' law describes the
//! indentation of two half-spaces; the disc's own displacement of the patch holds an indentation too, which must not count twice:
//!
//! ```text
//! u − w = (F/k_d)^(2/3) + c_r F,    c_r = C_s − C_p < 0
//! ```
//!
//! - k_d: Hertz' stiffness of bead on disc, 1/E* = (1 − ν²)/E of both, R* = a, N·m^(-3/2)
//! - C_p: static flexibility of the patch as disc and mesh have it, m/N; C_s: that of the disc as a structure ([`structural`]), m/N
//!
//! With w = w⁰ + s F at the end of a step ([`super::OnWater`]) and x = F^(1/3) this is one equation, x²/k_d^(2/3) + (c_r + s) x³ = u − w⁰,
//! with one root in the branch that grows from zero. Where c_r + s < 0 the branch ends at x = 2/(3 k_d^(2/3) |c_r + s|): the patch is
//! narrower there than the contact, and a wider one is needed.
//!
//! A dashpot stands beside the indentation δ = (F_el/k_d)^(2/3), as between beads, and sees the bead approach the disc in its lowest modes:
//!
//! ```text
//! F = F_el + (c + γ √δ) (u̇ − ẇ_m),    u − w = δ + c_r F
//! ```
//!
//! ẇ_m is the part of the disc's velocity in its first `DASHPOT_MODES` modes (`Disc::modal_weights`). The velocity of the patch itself would not
//! do: it holds the indentation a second time, and follows the jump of the force at first touch within a step, whatever its length. The
//! force at the end of the step is found together with both velocities there, since each of them depends on it.

use thiserror::Error;

use super::disc::{Disc, DiscError, DiscMesh, DiscModes};
use crate::{
    contact_law::{Dashpot, effective_modulus, hertz_stiffness},
    scene::Bead,
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscContact {
    pub hertz_stiffness: f64,
    /// c_r, m/N.
    pub residual: f64,
}

/// How many of the disc's modes move the disc that a dashpot sees.
pub(crate) const DASHPOT_MODES: usize = 4;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Pressing {
    /// F, N.
    pub force: f64,
    /// Hertz' indentation δ, m; 0 while open.
    pub indentation: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Approach {
    /// u̇ − ẇ_m at the end of the step without a force on the disc, m/s.
    pub rate: f64,
    /// By how much a unit force lowers it, m/s/N.
    pub yielding: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "bead on disc: an overlap of {overlap:e} m needs more than the {largest:e} N up to which the patch of the contact force is as wide as \
     the contact; spread the force over a wider patch"
)]
pub struct PatchError {
    /// u − w⁰, m.
    pub overlap: f64,
    /// Force at the end of the branch, N.
    pub largest: f64,
}

/// Flexibility C_s (m/N) of a disc as a structure: [`Disc::structural_flexibility`] on a mesh graded to a hundredth of the thickness at the
/// pole, from patches of 0.16 and 0.08 of the thickness to none, with their error as the patch squared.
pub fn structural(disc: &Disc) -> Result<f64, DiscError> {
    let thickness = disc.shape().thickness;
    let radial = (24.0 + 16.0 * (0.25 * disc.shape().radius / thickness).max(1.0).sqrt()) as usize;
    let graded = DiscMesh { radial, through: 20, pole_side: Some(0.008 * thickness) };
    let fine = Disc::new(disc.shape(), &graded)?;
    let (wide, narrow) =
        (fine.structural_flexibility(0.16 * thickness)?, fine.structural_flexibility(0.08 * thickness)?);
    Ok(narrow + (narrow - wide) / 3.0)
}

impl DiscContact {
    /// Contact of `bead` with `disc` whose force is spread over r ≤ `patch` (m) of the front.
    pub fn new(bead: &Bead, disc: &Disc, patch: f64) -> Result<Self, DiscError> {
        let modulus = effective_modulus(&bead.material, Some(&disc.shape().material));
        Ok(Self {
            hertz_stiffness: hertz_stiffness(modulus, bead.radius),
            residual: structural(disc)? - disc.flexibility(patch)?,
        })
    }

    /// Contact of `bead` with `disc` as a few of its modes have it, everything else static: c_r = C_s − Σ φ_k²/ω_k².
    pub fn modal(bead: &Bead, disc: &Disc, modes: &DiscModes) -> Result<Self, DiscError> {
        let modulus = effective_modulus(&bead.material, Some(&disc.shape().material));
        Ok(Self {
            hertz_stiffness: hertz_stiffness(modulus, bead.radius),
            residual: structural(disc)? - modes.flexibility(),
        })
    }

    /// Force F (N) with u − w⁰ = `overlap` (m), when the disc gives way by s F (`compliance` s, m/N) besides; 0 while open.
    pub fn force(&self, overlap: f64, compliance: f64) -> Result<f64, PatchError> {
        if overlap <= 0.0 {
            return Ok(0.0);
        }
        let soft = self.hertz_stiffness.powf(-2.0 / 3.0);
        let linear = self.residual + compliance;
        let hertz = (overlap / soft).sqrt();
        // The root lies between Hertz' own and the end of the branch, or below Hertz' own.
        let (mut low, mut high) = if linear < 0.0 { (hertz, 2.0 * soft / (3.0 * -linear)) } else { (0.0, hertz) };
        let excess = |x: f64| x * x * (soft + linear * x) - overlap;
        if excess(high) < -1e-15 * overlap {
            return Err(PatchError { overlap, largest: high.powi(3) });
        }
        let mut x = hertz;
        for _ in 0..60 {
            let value = excess(x);
            if value > 0.0 {
                high = x
            } else {
                low = x
            }
            let next = x - value / (x * (2.0 * soft + 3.0 * linear * x));
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            let change = (next - x).abs();
            x = next;
            if change <= 1e-15 * x {
                break;
            }
        }
        Ok(x.powi(3))
    }

    /// Force with a dashpot beside the indentation: the root of u − w⁰ = δ + (c_r + s) F(δ) on the branch that grows from zero, with
    /// F(δ) = (k_d δ^(3/2) + D r)/(1 + D y), D = c + γ √δ, r and y of the [`Approach`]; cut off at 0 unless it may pull (`tension`). Where a
    /// contact closes and even the smallest δ would carry too much, δ is 0 and the force what the disc's yielding leaves.
    pub(crate) fn damped(
        &self,
        overlap: f64,
        compliance: f64,
        dashpot: &Dashpot,
        approach: Approach,
        tension: bool,
    ) -> Result<Pressing, PatchError> {
        if overlap <= 0.0 {
            return Ok(Pressing::default());
        }
        let linear = self.residual + compliance;
        let stiffness = self.hertz_stiffness;
        let force = |indentation: f64| {
            let root = indentation.sqrt();
            let damper = dashpot.resistance(root);
            let force = (stiffness * indentation * root + damper * approach.rate) / (1.0 + damper * approach.yielding);
            if tension { force } else { force.max(0.0) }
        };
        let excess = |indentation: f64| indentation + linear * force(indentation) - overlap;
        if excess(0.0) >= 0.0 {
            return Ok(Pressing { force: overlap / linear, indentation: 0.0 });
        }
        // Without a dashpot the branch ends here at the latest.
        let end = if linear < 0.0 { (2.0 / (3.0 * stiffness * linear)).powi(2) } else { f64::INFINITY };
        let (mut low, mut high) = (0.0, overlap.min(end));
        while excess(high) < 0.0 {
            if high >= end {
                return Err(PatchError { overlap, largest: force(end) });
            }
            (low, high) = (high, (2.0 * high).min(end));
        }
        // Regula falsi in the Illinois form: safe, and quick on a curve this straight.
        let (mut below, mut above) = (excess(low), excess(high));
        let (mut indentation, mut last_side) = (high, 0);
        for _ in 0..100 {
            indentation = (low * above - high * below) / (above - below);
            let value = excess(indentation);
            if value == 0.0 || high - low <= 1e-15 * high || value.abs() <= 1e-15 * overlap {
                break;
            }
            if value > 0.0 {
                (high, above) = (indentation, value);
                below *= if last_side > 0 { 0.5 } else { 1.0 };
                last_side = 1;
            } else {
                (low, below) = (indentation, value);
                above *= if last_side < 0 { 0.5 } else { 1.0 };
                last_side = -1;
            }
        }
        Ok(Pressing { force: force(indentation), indentation })
    }

    /// Hertz' indentation (m) that the force F (N) makes alone.
    pub fn indentation(&self, force: f64) -> f64 {
        (force / self.hertz_stiffness).powf(2.0 / 3.0)
    }

    /// As [`DiscContact::energy`], of a contact with a dashpot.
    pub(crate) fn stored(&self, pressing: &Pressing) -> f64 {
        0.4 * self.hertz_stiffness * pressing.indentation.powf(2.5) + 0.5 * self.residual * pressing.force.powi(2)
    }

    /// Elastic energy (J) at the force F (N): (2/5) k_d δ^(5/2) + c_r F²/2, the second term taking back what the disc holds twice.
    #[cfg(test)]
    fn energy(&self, force: f64) -> f64 {
        0.4 * force * (force / self.hertz_stiffness).cbrt().powi(2) + 0.5 * self.residual * force * force
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::DampingTerm;

    #[test]
    fn the_force_solves_the_equation_on_either_side_of_hertz() {
        for residual in [-0.3e-6, 0.0, 0.4e-6] {
            let contact = DiscContact { hertz_stiffness: 9.2e8, residual };
            for force in [1e-9, 1e-3, 0.3, 5.0, 9.0] {
                for compliance in [0.0, 0.1e-6] {
                    let overlap = (force / 9.2e8_f64).powf(2.0 / 3.0) + (residual + compliance) * force;
                    let found = contact.force(overlap, compliance).unwrap();
                    assert!((found / force - 1.0).abs() < 1e-11, "{residual} {force} {compliance}: {found}");
                }
            }
            assert_eq!(contact.force(-1e-9, 0.0), Ok(0.0));
        }
    }

    #[test]
    fn a_dashpot_solves_its_equation_and_without_one_the_force_is_the_elastic_one() {
        let laws = [(0.3, 0.0), (0.0, 3660.0), (0.3, 3660.0)];
        for residual in [-0.1e-6, 0.0, 0.2e-6] {
            let contact = DiscContact { hertz_stiffness: 9.2e8, residual };
            for (overlap, rate) in [(2e-9, 0.3), (1e-7, 0.1), (1e-7, -0.05), (1e-6, -0.3), (1e-6, 0.3)] {
                for (linear, kuwabara_kono) in laws {
                    let terms = [(DampingTerm::Linear, linear), (DampingTerm::KuwabaraKono, kuwabara_kono)];
                    let dashpot = Dashpot { coefficients: terms.into() };
                    let approach = Approach { rate, yielding: 0.01 };
                    let found = contact.damped(overlap, 0.02e-6, &dashpot, approach, false).unwrap();
                    let Pressing { force, indentation } = found;
                    // u − w⁰ − s F = δ + c_r F.
                    let closed = indentation + (residual + 0.02e-6) * force - overlap;
                    assert!(closed.abs() < 1e-12 * overlap, "{residual} {overlap} {rate}: {closed:e}");
                    let rate_then = rate - 0.01 * force;
                    let law = 9.2e8 * indentation.powf(1.5) + dashpot.force(indentation, rate_then);
                    let is_met =
                        if indentation > 0.0 { (law.max(0.0) - force).abs() < 1e-11 } else { force <= linear * rate };
                    assert!(is_met && force >= 0.0, "{residual} {overlap} {rate}: {law} {force}");
                }
                let approach = Approach { rate, yielding: 0.01 };
                let plain = contact.damped(overlap, 0.0, &Dashpot::default(), approach, false).unwrap();
                let elastic = contact.force(overlap, 0.0).unwrap();
                assert!((plain.force / elastic - 1.0).abs() < 1e-10, "{plain:?} {elastic}");
            }
        }
    }

    #[test]
    fn a_dashpot_pulls_only_where_it_may_and_never_on_an_open_contact() {
        let contact = DiscContact { hertz_stiffness: 9.2e8, residual: 0.05e-6 };
        let dashpot = Dashpot { coefficients: [(DampingTerm::Linear, 0.3)].into() };
        let parting = Approach { rate: -1.0, yielding: 0.01 };
        let force = |overlap, tension| contact.damped(overlap, 0.0, &dashpot, parting, tension).unwrap().force;
        assert_eq!(force(1e-8, false), 0.0);
        assert!(force(1e-8, true) < -0.2 && force(1e-8, true) > -0.3);
        assert_eq!(force(-1e-9, true), 0.0);
    }

    #[test]
    fn beyond_the_branch_there_is_a_typed_refusal() {
        let contact = DiscContact { hertz_stiffness: 9.2e8, residual: -0.3e-6 };
        let refusal = contact.force(3e-6, 0.0).unwrap_err();
        // x = 2/(3 k^(2/3) c).
        let largest = (2.0 / (3.0 * 9.2e8_f64.powf(2.0 / 3.0) * 0.3e-6)).powi(3);
        assert!((refusal.largest / largest - 1.0).abs() < 1e-12 && refusal.to_string().contains("wider patch"));
    }

    #[test]
    fn the_energy_is_the_work_of_the_force() {
        let contact = DiscContact { hertz_stiffness: 9.2e8, residual: -0.2e-6 };
        let approach = |force: f64| (force / 9.2e8_f64).powf(2.0 / 3.0) - 0.2e-6 * force;
        let (parts, most) = (200_000, 4.0);
        let mut work = 0.0;
        for k in 0..parts {
            let (a, b) = (most * k as f64 / parts as f64, most * (k + 1) as f64 / parts as f64);
            work += 0.5 * (a + b) * (approach(b) - approach(a));
        }
        // The trapezoid's first parts, (1/parts)^(2/3) of the law's bend.
        assert!((work / contact.energy(most) - 1.0).abs() < 1e-7, "{work:e} {:e}", contact.energy(most));
    }
}
