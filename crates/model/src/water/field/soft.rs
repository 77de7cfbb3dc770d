//! The field behind a soft baffle, from the pressure on the disc's back.
//!
//! A baffle free of pressure leaves the face's own pressure p(r, 0) as the one source of the half-space (Rayleigh's second integral), R the distance
//! from a point of the face:
//!
//! ```text
//! P(x) = (1/2π) ∫ P(r′, 0) (z/R) (1/R + ik) e^{−ikR}/R dS′
//! P d e^{ikd} → ik cos θ ∫₀ᵃ P(r, 0) J₀(k r sin θ) r dr,   k = ω/c                     far away
//! ```
//!
//! The velocity of the face does not do instead: beside the disc the plane moves.
//!
//! Kinsler, Frey, Coppens & Sanders (2000), *Fundamentals of Acoustics*, §7.4; Williams (1999), *Fourier Acoustics*, §2.10.

use faer::c64;

use crate::water::{Water, quadrature::gauss_legendre};
use granchain_signal::{
    Series,
    spline::{Ends, Spline},
};

/// Pressure on the disc's back over time, at radii from the axis to the rim, straight in between.
#[derive(Debug, Clone)]
pub struct FacePressure {
    radii: Vec<f64>,
    pressure: Vec<Series>,
}

impl FacePressure {
    /// Of the pressures (Pa) at ascending radii (m), the first on the axis and the last at the rim.
    pub(crate) fn new(radii: Vec<f64>, pressure: Vec<Series>) -> Self {
        Self { radii, pressure }
    }

    /// One series a radius, Pa.
    pub fn pressure(&self) -> &[Series] {
        &self.pressure
    }

    pub fn radii(&self) -> &[f64] {
        &self.radii
    }

    /// Pressure (Pa) at many radii (m) and times (s): one list over the times each radius; 0 beyond the rim.
    pub fn face(&self, radii: &[f64], times: &[f64]) -> Vec<Vec<f64>> {
        let splines: Vec<Spline> = self.pressure.iter().map(|series| Spline::new(series, Ends::Natural)).collect();
        radii
            .iter()
            .map(|&radius| {
                let shares = shares(&self.radii, radius);
                times
                    .iter()
                    .map(|&time| shares.iter().map(|&(node, share)| share * splines[node].at(time).0).sum())
                    .collect()
            })
            .collect()
    }
}

/// Neighbours of a radius with their shares; none beyond the last.
fn shares(radii: &[f64], radius: f64) -> Vec<(usize, f64)> {
    let after = radii.partition_point(|&own| own < radius);
    match after {
        0 => vec![(0, 1.0)],
        // Rounding of the rim itself.
        after if after == radii.len() => {
            let rim = radii.len() - 1;
            if radius <= radii[rim] * (1.0 + 1e-9) { vec![(rim, 1.0)] } else { Vec::new() }
        }
        after => {
            let share = (radius - radii[after - 1]) / (radii[after] - radii[after - 1]);
            vec![(after - 1, 1.0 - share), (after, share)]
        }
    }
}

/// What beam patterns tend to far away: P d e^{ikd} as d → ∞ (Pa·m), at the angles θ (rad) from the axis, of a face with the complex pressure
/// amplitudes P (Pa) at `radii` (m), at the angular frequency ω (rad/s).
pub fn soft_far_field(
    (radii, amplitudes): (&[f64], &[c64]),
    water: &Water,
    angles: &[f64],
    angular_frequency: f64,
) -> Vec<c64> {
    let wave_number = angular_frequency / water.sound_speed;
    // Between two radii the pressure is straight and k r turns by little.
    let rule = gauss_legendre(8);
    let pieces = radii.windows(2).zip(amplitudes.windows(2));
    let source: Vec<(f64, c64)> = pieces
        .flat_map(|(ends, values)| {
            let length = ends[1] - ends[0];
            rule.iter().map(move |&(x, weight)| {
                let radius = ends[0] + x * length;
                (radius, (values[0] * (1.0 - x) + values[1] * x) * (weight * length * radius))
            })
        })
        .collect();
    let at = |&angle: &f64| -> c64 {
        let across = wave_number * angle.sin();
        let sum: c64 = source.iter().map(|(radius, part)| part * libm::j0(across * radius)).sum();
        // The cosine of 90° in floating point is not zero.
        c64::new(0.0, wave_number * if angle.cos() < 1e-12 { 0.0 } else { angle.cos() }) * sum
    };
    angles.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_face_has_the_closed_forms_of_a_disc_of_pressure() {
        let water = Water { density: 1000.0, sound_speed: 1500.0 };
        let (a, omega) = (1e-3, 6e6);
        let k = omega / water.sound_speed;
        let radii: Vec<f64> = (0..=20).map(|i| a * f64::from(i) / 20.0).collect();
        let amplitudes = vec![c64::new(2.0, 0.0); radii.len()];
        let angles = [0.0, 0.3, 0.8, 1.3, std::f64::consts::FRAC_PI_2];
        let far = soft_far_field((&radii, &amplitudes), &water, &angles, omega);
        for (angle, found) in angles.iter().zip(&far) {
            let x = k * a * angle.sin();
            let shape = if x == 0.0 { 0.5 } else { libm::j1(x) / x };
            let exact = 2.0 * k * a * a * shape * angle.cos();
            assert!((found.im - exact).abs() < 1e-9 * k * a * a && found.re.abs() < 1e-15, "{angle}: {found} {exact}");
        }
    }

    #[test]
    fn between_radii_it_is_straight_and_beyond_the_rim_nothing() {
        let clock = |scale: f64| Series::new(0.0, 1e-7, (0..50).map(|i| scale * f64::from(i)).collect());
        let face = FacePressure::new(vec![0.0, 1e-3], vec![clock(1.0), clock(3.0)]);
        let found = face.face(&[0.0, 0.5e-3, 1e-3, 1.1e-3], &[1e-6]);
        for (found, exact) in found.iter().zip([10.0, 20.0, 30.0, 0.0]) {
            assert!((found[0] - exact).abs() < 1e-9, "{} {exact}", found[0]);
        }
    }
}
