//! The solitary wave of an uncompressed chain.

/// κ of the discrete chain: a number of the project's table of reference values, not a closed form. A run of 200 beads
/// (`tests/chain_exact.rs`) confirms it to 1e-6; the further digits are taken over from the table.
pub const DISCRETE_SPEED_FACTOR: f64 = 0.907_470_078_412;

/// κ of Nesterenko's continuum, (4/5)^(2/5) = 0.9146…: Nesterenko (2001), *Dynamics of Heterogeneous Materials*, §1.3.
pub const NESTERENKO_SPEED_FACTOR: f64 = 0.914_610_103_855;

/// Speed V = 2a κ (k/m)^(2/5) v_m^(1/5), m/s, of a solitary wave in an uncompressed chain of equal beads.
///
/// - `speed_factor`: κ, [`DISCRETE_SPEED_FACTOR`] or [`NESTERENKO_SPEED_FACTOR`]
/// - `radius`: a, m
/// - `mass`: m, kg
/// - `hertz_stiffness`: k, N·m^(-3/2)
/// - `peak_velocity`: largest velocity of a bead v_m, m/s
///
/// ```
/// # use granchain::model::analytical::{DISCRETE_SPEED_FACTOR, solitary_wave_speed};
/// let speed = solitary_wave_speed(DISCRETE_SPEED_FACTOR, 0.5e-3, 4.101349209e-6, 2.328270365e9, 0.1);
/// assert!((speed - 456.535947).abs() < 1e-5);
/// ```
#[must_use]
pub fn solitary_wave_speed(speed_factor: f64, radius: f64, mass: f64, hertz_stiffness: f64, peak_velocity: f64) -> f64 {
    2.0 * radius * speed_factor * (hertz_stiffness / mass).powf(0.4) * peak_velocity.powf(0.2)
}

/// Width of Nesterenko's solitary wave, π√10 a: just under five bead diameters, whatever its amplitude.
#[must_use]
pub fn nesterenko_width(radius: f64) -> f64 {
    std::f64::consts::PI * 10f64.sqrt() * radius
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_continuum_factor_is_a_power_of_four_fifths() {
        assert!((NESTERENKO_SPEED_FACTOR - 0.8f64.powf(0.4)).abs() < 1e-12);
    }

    #[test]
    fn the_width_is_just_under_five_diameters() {
        assert!((nesterenko_width(0.5e-3) / 1e-3 - 4.967).abs() < 1e-3);
    }
}
