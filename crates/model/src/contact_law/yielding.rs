//! Where contacts begin to yield.

use std::f64::consts::PI;

/// Force at which a Hertz contact begins to yield, N: the pressure in its middle, p₀ = (6 F E*²/(π³ R*²))^(1/3), is 1.6 Y there.
///
/// ```text
/// F_y = (1.6 π Y)³ R*²/(6 E*²)
/// ```
///
/// - `effective_modulus`: E*, Pa
/// - `effective_radius`: R*, m
/// - `yield_strength`: Y of the softer body, Pa
///
/// Johnson (1985), *Contact Mechanics*, eqs. (4.24) and (6.9): the first yield lies 0.48 contact radii below the surface, at ν = 0.3.
///
/// ```
/// # use granchain_model::contact_law::yield_force;
/// // Two steel beads of 0.5 mm radius: E* = 110 GPa, R* = 0.25 mm, Y = 2.03 GPa.
/// assert!((yield_force(110.44e9, 0.25e-3, 2.03e9) - 0.908).abs() < 1e-3);
/// ```
#[must_use]
pub fn yield_force(effective_modulus: f64, effective_radius: f64, yield_strength: f64) -> f64 {
    (1.6 * PI * yield_strength).powi(3) * effective_radius.powi(2) / (6.0 * effective_modulus.powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact_law::hertz_stiffness;

    #[test]
    fn the_pressure_in_the_middle_is_then_1_6_of_the_strength() {
        let (modulus, radius, strength) = (110e9, 0.25e-3, 2.03e9);
        let force = yield_force(modulus, radius, strength);
        // From the overlap: p₀ = 3F/(2πa²), a² = R δ, F = k δ^(3/2).
        let overlap = (force / hertz_stiffness(modulus, radius)).powf(2.0 / 3.0);
        let pressure = 3.0 * force / (2.0 * PI * radius * overlap);
        assert!((pressure / (1.6 * strength) - 1.0).abs() < 1e-12, "{pressure}");
    }
}
