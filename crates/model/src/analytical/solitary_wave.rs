//! The solitary wave of an uncompressed chain.

use granchain_signal::spline::cubic;

/// κ of the discrete chain: a number of the project's table of reference values, not a closed form. A run of 200 beads
/// (`tests/model/chain_exact.rs`) confirms it to 1e-6, [`DiscretePulse`] to 1e-8; the further digits are taken over from the table.
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
/// # use granchain_model::analytical::{DISCRETE_SPEED_FACTOR, solitary_wave_speed};
/// let speed = solitary_wave_speed(DISCRETE_SPEED_FACTOR, 0.5e-3, 4.101349209e-6, 2.328270365e9, 0.1);
/// assert!((speed - 456.535947).abs() < 1e-5);
/// ```
pub fn solitary_wave_speed(speed_factor: f64, radius: f64, mass: f64, hertz_stiffness: f64, peak_velocity: f64) -> f64 {
    2.0 * radius * speed_factor * (hertz_stiffness / mass).powf(0.4) * peak_velocity.powf(0.2)
}

/// Speed of Nesterenko's solitary wave of peak force F in a chain of equal beads under the static force F₀, m/s:
///
/// V² = (2a)² k^(2/3)/m · (2/5) (3 F₀^(5/3) + 2 F^(5/3) − 5 F^(2/3) F₀)/(F^(2/3) − F₀^(2/3))²
///
/// - `radius`: a, m
/// - `mass`: m, kg
/// - `hertz_stiffness`: k, N·m^(-3/2)
/// - `peak_force`: F with the static force in it, N, above `static_force`
/// - `static_force`: F₀, N; 0 gives V = 0.6802 (2E/(2a ρ^(3/2) (1 − ν²)))^(1/3) F^(1/6)
///
/// Long-wave limit. Nesterenko (2001), *Dynamics of Heterogeneous Materials*, §1.3; Coste, Falcon, Fauve (1997), *Phys. Rev. E* 56, 6104; Daraio,
/// Nesterenko, Herbold, Jin (2005), *Phys. Rev. E* 72, 016603.
///
/// ```
/// # use granchain_model::analytical::nesterenko_speed_at_force;
/// let speed = nesterenko_speed_at_force(2.38e-3, 0.4518e-3, 4.877e9, 20.0, 0.0);
/// assert!((speed / 2.0f64.powf(1.0 / 6.0) - nesterenko_speed_at_force(2.38e-3, 0.4518e-3, 4.877e9, 10.0, 0.0)).abs() < 1e-9);
/// ```
pub fn nesterenko_speed_at_force(
    radius: f64,
    mass: f64,
    hertz_stiffness: f64,
    peak_force: f64,
    static_force: f64,
) -> f64 {
    let [peak, rest] = [peak_force, static_force].map(libm::cbrt);
    let strain = peak * peak - rest * rest;
    let work = 3.0 * rest.powi(5) + 2.0 * peak.powi(5) - 5.0 * peak * peak * static_force;
    2.0 * radius * (0.4 * work / mass).sqrt() * libm::cbrt(hertz_stiffness) / strain
}

/// Width of Nesterenko's solitary wave, π√10 a: just under five bead diameters, whatever its amplitude.
pub fn nesterenko_width(radius: f64) -> f64 {
    std::f64::consts::PI * 10f64.sqrt() * radius
}

/// Velocity of the beads in Nesterenko's solitary wave over its largest, cos⁴(√10 x/5) for |x| ≤ 5π/(2√10), else 0; its force is the
/// 3/2 power of that, cos⁶.
///
/// - `place`: x, distance from the crest in bead diameters
///
/// Long-wave limit, though the wave is only five beads long. Nesterenko (2001), §1.3.
///
/// ```
/// # use granchain_model::analytical::nesterenko_profile;
/// assert_eq!((nesterenko_profile(0.0), nesterenko_profile(2.6)), (1.0, 0.0));
/// ```
pub fn nesterenko_profile(place: f64) -> f64 {
    let angle = 0.4f64.sqrt() * place;
    if angle.abs() < std::f64::consts::FRAC_PI_2 { angle.cos().powi(4) } else { 0.0 }
}

/// Intervals a bead diameter of the grid on which [`DiscretePulse`] is solved.
const CELLS: usize = 64;

/// Half of the grid, bead diameters: the tails fall faster than any exponential, at 7 to below 1e-100 of the crest.
const REACH: usize = 7;

/// Largest change of an iteration at which the pulse counts as solved.
const SOLVED: f64 = 1e-15;

/// Most iterations; thirty or so are needed.
const MOST_ITERATIONS: usize = 500;

/// The solitary wave of the discrete chain of equal beads, free of the long-wave limit.
///
/// A wave δ(x), x = n − V't in bead diameters, of the overlaps in m δ̈ₙ = k (δₙ₋₁^(3/2) − 2 δₙ^(3/2) + δₙ₊₁^(3/2)) obeys
///
/// V'² δ(x) = (k/m) ∫ Λ(x − y) δ(y)^(3/2) dy, Λ(x) = max(1 − |x|, 0),
///
/// solved here by iteration from a bell, its crest held at 1; the sum has an error of fourth order in the grid's interval, some 1e-9. With
/// the eigenvalue M of the crest and J = ∫ δ^(3/2) over the middle diameter, κ = M^(3/5) J^(-1/5).
///
/// English, Pego (2005), *Proc. Amer. Math. Soc.* 133, 1763; tails: Chatterjee (1999), *Phys. Rev. E* 59, 5912.
///
/// ```
/// # use granchain_model::analytical::{DISCRETE_SPEED_FACTOR, DiscretePulse};
/// let pulse = DiscretePulse::solve();
/// assert!((pulse.speed_factor() / DISCRETE_SPEED_FACTOR - 1.0).abs() < 1e-8);
/// assert!((pulse.force(0.0) - 1.0).abs() < 1e-12 && pulse.force(3.0) < 1e-6);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DiscretePulse {
    /// Force over its largest, from −[`REACH`] to [`REACH`].
    force: Vec<f64>,
    /// Velocity of a bead over its largest, on the same grid.
    velocity: Vec<f64>,
    speed_factor: f64,
}

impl DiscretePulse {
    pub fn solve() -> Self {
        let count = 2 * REACH * CELLS + 1;
        let middle = REACH * CELLS;
        let place = |index: usize| (index as f64 - middle as f64) / CELLS as f64;
        let mut overlap: Vec<f64> = (0..count).map(|index| (-place(index).powi(2)).exp()).collect();
        let mut eigenvalue = 1.0;
        for _ in 0..MOST_ITERATIONS {
            let force: Vec<f64> = overlap.iter().map(|overlap| overlap.powf(1.5)).collect();
            let mut next: Vec<f64> = (0..count).map(|index| averaged(&force, index)).collect();
            eigenvalue = next[middle];
            next.iter_mut().for_each(|value| *value /= eigenvalue);
            let change = next.iter().zip(&overlap).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            overlap = next;
            if change < SOLVED {
                break;
            }
        }
        let force: Vec<f64> = overlap.iter().map(|overlap| overlap.powf(1.5)).collect();
        let velocity: Vec<f64> = (0..count).map(|index| over_a_diameter(&force, index)).collect();
        let largest = velocity[middle];
        Self {
            speed_factor: eigenvalue.powf(0.6) * largest.powf(-0.2),
            velocity: velocity.into_iter().map(|velocity| velocity / largest).collect(),
            force,
        }
    }

    /// κ.
    pub fn speed_factor(&self) -> f64 {
        self.speed_factor
    }

    /// Force of a contact over its largest, at `place` bead diameters from the crest.
    pub fn force(&self, place: f64) -> f64 {
        interpolated(&self.force, place)
    }

    /// Velocity of a bead over its largest, at `place` bead diameters from the crest.
    pub fn velocity(&self, place: f64) -> f64 {
        interpolated(&self.velocity, place)
    }
}

fn at(values: &[f64], index: usize, shift: isize) -> f64 {
    index.checked_add_signed(shift).and_then(|index| values.get(index)).copied().unwrap_or(0.0)
}

/// ∫ Λ(x − y) f(y) dy by the trapezoidal rule, freed of the error that the kinks of Λ make.
fn averaged(f: &[f64], index: usize) -> f64 {
    let cells = CELLS as isize;
    let sum: f64 = (-cells..=cells).map(|j| (cells - j.abs()) as f64 * at(f, index, j)).sum();
    let step = 1.0 / CELLS as f64;
    let kinks = at(f, index, cells) - 2.0 * f[index] + at(f, index, -cells);
    sum * step * step + step * step / 12.0 * kinks
}

/// ∫ f(y) dy over the bead diameter around x, by Simpson's rule.
fn over_a_diameter(f: &[f64], index: usize) -> f64 {
    let half = CELLS as isize / 2;
    let weight = |j: isize| match (j.abs() == half, (j + half) % 2) {
        (true, _) => 1.0,
        (false, 1) => 4.0,
        (false, _) => 2.0,
    };
    (-half..=half).map(|j| weight(j) * at(f, index, j)).sum::<f64>() / (3.0 * CELLS as f64)
}

fn interpolated(values: &[f64], place: f64) -> f64 {
    let position = (place + REACH as f64) * CELLS as f64;
    if !(position >= 1.0 && position < (values.len() - 2) as f64) {
        return 0.0;
    }
    let (index, t) = (position.floor() as usize, position.fract());
    let neighbours = [-1, 0, 1, 2].map(|shift| at(values, index, shift));
    cubic(neighbours, t)
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
        let edge = 0.5 * nesterenko_width(0.5);
        assert!(nesterenko_profile(edge + 1e-9) == 0.0 && nesterenko_profile(edge - 1e-3) > 0.0);
    }

    #[test]
    fn the_discrete_pulse_solves_its_own_equation_and_has_the_tabulated_speed() {
        let pulse = DiscretePulse::solve();
        // Fourth order in 1/64; the table has twelve digits.
        assert!((pulse.speed_factor() / DISCRETE_SPEED_FACTOR - 1.0).abs() < 1e-8, "{}", pulse.speed_factor());
        // V' dv/dx = F(x + ½) − F(x − ½) in the pulse's own units, v beside the crest of a bead: the ratio is the same everywhere.
        let ratio = |x: f64| {
            let slope = (pulse.velocity(x + 1e-3) - pulse.velocity(x - 1e-3)) / 2e-3;
            slope / (pulse.force(x + 0.5) - pulse.force(x - 0.5))
        };
        for x in [0.2, 0.5, 1.0, 1.4, -0.8] {
            // The slope of a cubic through points 1/64 apart is good to a thousandth.
            assert!((ratio(x) / ratio(0.3) - 1.0).abs() < 2e-3, "{x}: {} {}", ratio(x), ratio(0.3));
        }
    }
}
