//! Contacts that yield: Thornton's elastic–perfectly plastic sphere.

use super::{Hertz, hertz_force, touching};
use crate::scene::{Bead, Material};

/// Pressure in the middle of a contact at which its material begins to flow, over its yield strength Y: von Mises' criterion is first met below the
/// surface, at p₀ = 1.6 Y for ν = 0.3 (Johnson (1985), *Contact Mechanics*, §6.1).
pub(crate) const YIELD_PRESSURE: f64 = 1.6;

/// Force F_y at which a contact begins to yield, π³ R*² p_y³/(6 E*²) with p_y = 1.6 Y, N.
///
/// - `effective_modulus`: E*, Pa; `effective_radius`: R*, m; `yield_strength`: Y of the softer body, Pa
///
/// ```
/// # use granchain_model::contact_law::yield_force;
/// // Two steel beads of 1 mm, Y = 2 GPa: E* = 110.4 GPa, R* = 0.25 mm.
/// assert!((yield_force(110.4e9, 0.25e-3, 2e9) - 0.868).abs() < 0.001);
/// ```
pub fn yield_force(effective_modulus: f64, effective_radius: f64, yield_strength: f64) -> f64 {
    let pressure = std::f64::consts::PI * YIELD_PRESSURE * yield_strength;
    pressure.powi(3) * effective_radius.powi(2) / (6.0 * effective_modulus.powi(2))
}

/// Hertz' contact up to the pressure p_y in its middle, which then stays: Thornton (1997), *J. Appl. Mech.* 64, 383.
///
/// ```text
/// δ ≤ δ_y        F = k δ^(3/2)                                          δ_y = (π p_y/2E*)² R*
/// first pressed  F = F_y + π p_y R* (δ − δ_y)                           as stiff as Hertz' at δ_y
/// after F_m      F = k_p (δ − δ_p)^(3/2), up to F_m and down again      k_p = k √(R_p/R*),  R_p/R* = (F_y/F_m) ((2 F_m + F_y)/(3 F_y))^(3/2)
/// ```
///
/// A contact pressed with F_m keeps the indentation δ_p. Restitution of a free impact at the speed V, from V_y on, at which it begins to yield:
/// [`Yielding::restitution`]. Valid while the contact is small and its pressure that of the onset; a fully plastic one (p ≈ 2.8 Y, from some 100 F_y on) is harder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Yielding {
    /// k of the contact before it yields, N·m^(-3/2).
    pub stiffness: f64,
    /// δ_y, m.
    pub yield_overlap: f64,
}

impl Yielding {
    /// Of a bead and what it touches, of the yield strength Y (Pa): another bead, or a flat of that material that is no softer; `None` is rigid.
    pub fn of(bead: &Bead, other: Result<&Bead, Option<&Material>>, yield_strength: f64) -> Self {
        let (modulus, radius) = touching(bead, other);
        let slope = std::f64::consts::PI * YIELD_PRESSURE * yield_strength / (2.0 * modulus);
        Self { stiffness: super::hertz_stiffness(modulus, radius), yield_overlap: slope * slope * radius }
    }

    /// The same along an axis that is oblique to the normal by θ: forces and overlaps are cos θ times those along the normal.
    #[must_use]
    pub(crate) fn oblique(self, cosine: f64) -> Self {
        Self { stiffness: self.stiffness * cosine.powf(2.5), yield_overlap: self.yield_overlap / cosine }
    }

    /// F_y, N.
    pub(crate) fn yield_force(&self) -> f64 {
        hertz_force(self.stiffness, self.yield_overlap)
    }

    /// dF/dδ while it yields, π p_y R*, N/m.
    pub(crate) fn slope(&self) -> f64 {
        1.5 * self.stiffness * self.yield_overlap.sqrt()
    }

    /// The elastic law after the contact was pressed with `hardest` (N), and its overlap there, from the lasting indentation δ_p on (m).
    pub(crate) fn after(&self, hardest: f64) -> (Hertz, f64) {
        let first = self.yield_force();
        let hardest = hardest.max(first);
        let flattening = (first / hardest) * ((2.0 * hardest + first) / (3.0 * first)).powf(1.5);
        let stiffness = self.stiffness * flattening.sqrt();
        (Hertz { stiffness }, (hardest / stiffness).powf(2.0 / 3.0))
    }

    /// Lasting indentation δ_p after `hardest` (N), m.
    #[cfg(test)]
    fn indentation(&self, hardest: f64) -> f64 {
        let hardest = hardest.max(self.yield_force());
        self.yield_overlap + (hardest - self.yield_force()) / self.slope() - self.after(hardest).1
    }

    /// Coefficient of restitution of a body of the effective mass `mass` (kg) that meets it at `speed` (m/s), in closed form by energy: what the
    /// elastic law gives back over what was spent.
    ///
    /// With V_y² = (4/5) F_y δ_y/m*, F_m from ½ m* V² = (2/5) F_y δ_y + (F_m² − F_y²)/(2 π p_y R*); e² = (2/5) F_m (δ_m − δ_p)/(½ m* V²).
    pub fn restitution(&self, mass: f64, speed: f64) -> f64 {
        let (first, slope) = (self.yield_force(), self.slope());
        let spent = 0.5 * mass * speed * speed;
        let beyond = spent - 0.4 * first * self.yield_overlap;
        if beyond <= 0.0 {
            return 1.0;
        }
        let hardest = (first * first + 2.0 * slope * beyond).sqrt();
        (0.4 * hardest * self.after(hardest).1 / spent).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;

    fn steel() -> Yielding {
        let bead = Bead::sphere(0.5e-3, Material::chrome_steel());
        Yielding::of(&bead, Ok(&bead), 2e9)
    }

    /// The law in E*, R*, p_y, as Thornton writes it.
    #[test]
    fn it_is_the_law_in_modulus_radius_and_pressure() {
        let law = steel();
        let (modulus, radius) = (201e9 / 0.91 / 2.0, 0.25e-3);
        let pressure = YIELD_PRESSURE * 2e9;
        assert!((law.yield_force() / yield_force(modulus, radius, 2e9) - 1.0).abs() < 1e-13);
        let slope = std::f64::consts::PI * pressure * radius;
        assert!((law.slope() / slope - 1.0).abs() < 1e-13);
        for hardest in [1.0, 3.0, 30.0] {
            let first = law.yield_force();
            let flattened = 4.0 * modulus / (3.0 * hardest)
                * ((2.0 * hardest + first) / (2.0 * std::f64::consts::PI * pressure)).powf(1.5);
            let (after, overlap) = law.after(hardest);
            assert!((after.stiffness / (4.0 / 3.0 * modulus * flattened.sqrt()) - 1.0).abs() < 1e-13);
            assert!((hertz_force(after.stiffness, overlap) / hardest - 1.0).abs() < 1e-13);
            let left = law.yield_overlap + (hardest - first) / slope
                - (3.0 * hardest / (4.0 * modulus * flattened.sqrt())).powf(2.0 / 3.0);
            assert!((law.indentation(hardest) / left - 1.0).abs() < 1e-9, "{hardest}: {left}");
        }
        assert!((law.after(0.1).0.stiffness / law.stiffness - 1.0).abs() < 1e-14);
        assert!(law.indentation(0.1).abs() < 1e-20);
    }

    #[test]
    fn the_pressure_in_the_middle_is_1_6_of_the_strength_when_it_begins() {
        let (modulus, radius, strength) = (110e9, 0.25e-3, 2.03e9);
        let force = yield_force(modulus, radius, strength);
        // From the overlap: p₀ = 3F/(2πa²), a² = R δ, F = k δ^(3/2).
        let overlap = (force / super::super::hertz_stiffness(modulus, radius)).powf(2.0 / 3.0);
        let pressure = 3.0 * force / (2.0 * std::f64::consts::PI * radius * overlap);
        assert!((pressure / (1.6 * strength) - 1.0).abs() < 1e-12, "{pressure}");
    }

    /// Thornton (1997), eq. (57): e = (6√3/5)^½ [1 − x²/6]^½ [x/(x + 2 √(6/5 − x²/5))]^¼, x = V_y/V; for x → 0, e = 1.185 x^¼.
    #[test]
    fn restitution_is_thornton_s_published_function_of_speed() {
        let law = steel();
        let mass = 2e-6;
        let slowest = (0.8 * law.yield_force() * law.yield_overlap / mass).sqrt();
        for ratio in [1.0, 1.5, 3.0, 10.0, 100.0, 1e5] {
            let x = 1.0f64 / ratio;
            let published = (1.2 * 3f64.sqrt()).sqrt()
                * (1.0 - x * x / 6.0).sqrt()
                * (x / (x + 2.0 * (1.2 - 0.2 * x * x).sqrt())).powf(0.25);
            let found = law.restitution(mass, ratio * slowest);
            assert!((found / published - 1.0).abs() < 1e-9, "{ratio}: {found} {published}");
        }
        assert_eq!(law.restitution(mass, 0.9 * slowest), 1.0);
        let fast = law.restitution(mass, 1e6 * slowest);
        assert!((fast / (1.185 * 1e-6f64.powf(0.25)) - 1.0).abs() < 1e-3, "{fast}");
    }
}
