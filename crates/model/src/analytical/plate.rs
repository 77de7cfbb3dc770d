//! The thin circular plate in bending: Kirchhoff's theory.

use std::f64::consts::{PI, TAU};

use crate::scene::Material;

/// A thin plate of radius a and thickness h, without shear deformation or rotary inertia; for h ≪ a.
///
/// Timoshenko & Woinowsky-Krieger (1959), *Theory of Plates and Shells*, §16–17; Leissa (1969), *Vibration of Plates*, NASA SP-160, §2.1.
#[derive(Debug, Clone, PartialEq)]
pub struct ThinPlate {
    pub radius: f64,
    pub thickness: f64,
    pub material: Material,
}

impl ThinPlate {
    /// Flexural rigidity D = E h³/(12 (1 − ν²)), N·m.
    pub(crate) fn rigidity(&self) -> f64 {
        let Material { youngs_modulus, poissons_ratio, .. } = self.material;
        youngs_modulus * self.thickness.powi(3) / (12.0 * (1.0 - poissons_ratio * poissons_ratio))
    }

    /// Frequency of the axisymmetric mode `mode` (from 1) of the plate clamped at its rim, Hz:
    ///
    /// f = λ²/(2πa²) √(D/(ρh)),  J₀(λ) I₁(λ) + I₀(λ) J₁(λ) = 0,  λ = 3.19622, 6.30644, 9.43950, …
    pub fn clamped_frequency(&self, mode: usize) -> f64 {
        // One root in each (nπ, nπ + π/2), where J₀ and J₁ of equal sign become unequal.
        let determinant = |x: f64| libm::j0(x) * bessel_ratio(x) + libm::j1(x);
        let (mut low, mut high) = (mode as f64 * PI, (mode as f64 + 0.5) * PI);
        let sign = determinant(low).signum();
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if determinant(middle).signum() == sign { low = middle } else { high = middle }
        }
        let mass = self.material.density * self.thickness;
        low * low / (TAU * self.radius * self.radius) * (self.rigidity() / mass).sqrt()
    }

    /// Deflection of the middle of the clamped plate under a unit force there, a²/(16πD), m/N.
    pub fn clamped_flexibility(&self) -> f64 {
        self.radius * self.radius / (16.0 * PI * self.rigidity())
    }

    /// Deflection of the middle of the simply supported plate under a unit force there, (3 + ν)/(1 + ν) a²/(16πD), m/N.
    pub fn supported_flexibility(&self) -> f64 {
        let nu = self.material.poissons_ratio;
        (3.0 + nu) / (1.0 + nu) * self.clamped_flexibility()
    }

    /// Lamb's frequency of the lowest mode of the clamped plate, one side in an incompressible half-space of density ρ_f, Hz:
    ///
    /// f = f₁/√(1 + β ρ_f a/(ρh)),  β = [`LAMB_COEFFICIENT`].
    ///
    /// Lamb (1920), *Proc. R. Soc. A* 98, 205.
    pub fn lamb_frequency(&self, fluid_density: f64) -> f64 {
        let ratio = fluid_density * self.radius / (self.material.density * self.thickness);
        self.clamped_frequency(1) / (1.0 + LAMB_COEFFICIENT * ratio).sqrt()
    }
}

/// Added-mass coefficient β of Lamb's plate, kinetic energy of the water over that of the plate in units of ρ_f a/(ρh), one side in a rigid
/// baffle, 1: 65536/(31185 π) = 0.6689.
///
/// Of the shape (1 − r²/a²)², whose Hankel transform is 8 J₃(κ)/κ³ (a = 1): β = 640 ∫₀^∞ J₃²(κ) κ⁻⁶ dκ, in closed form by
/// Abramowitz & Stegun (1964) 11.4.33.
pub const LAMB_COEFFICIENT: f64 = 65_536.0 / (31_185.0 * PI);

/// I₁(x)/I₀(x) by Gauss' continued fraction x/(2 + x²/(4 + x²/(6 + …))).
fn bessel_ratio(x: f64) -> f64 {
    let first = 2 * (20 + x.abs() as u32);
    let tail = (2..=first / 2).rev().fold(f64::from(first), |below, k| f64::from(2 * k - 2) + x * x / below);
    x / tail
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plate() -> ThinPlate {
        let material = Material { name: "carbon".into(), youngs_modulus: 35e9, poissons_ratio: 0.15, density: 1540.0 };
        ThinPlate { radius: 1e-3, thickness: 0.02e-3, material }
    }

    #[test]
    fn clamped_frequencies_have_leissas_factors() {
        let plate = plate();
        let unit = (plate.rigidity() / (plate.material.density * plate.thickness)).sqrt() / (TAU * 1e-6);
        // Leissa (1969), table 2.1: λ² = 10.2158, 39.771, 89.104, printed to five digits.
        for (mode, factor) in [(1, 10.2158), (2, 39.771), (3, 89.104)] {
            assert!((plate.clamped_frequency(mode) / (factor * unit) - 1.0).abs() < 2e-5, "{mode}");
        }
        // The project's table of reference values, four digits: E/ρ = 1.75 km²/s².
        let heavy = ThinPlate { material: Material { density: 20e3, ..plate.material.clone() }, ..plate };
        assert!((heavy.clamped_frequency(1) / 12_560.0 - 1.0).abs() < 1e-4, "{}", heavy.clamped_frequency(1));
    }

    #[test]
    fn the_ratio_of_modified_bessel_functions_is_that_of_their_series() {
        for x in [0.3_f64, 2.0, 7.5, 20.0] {
            let series = |order: i32| -> f64 {
                let factorial = |n: i32| libm::tgamma(f64::from(n + 1));
                (0..80).map(|k| (0.5 * x).powi(2 * k + order) / (factorial(k) * factorial(k + order))).sum()
            };
            assert!((bessel_ratio(x) * series(0) / series(1) - 1.0).abs() < 1e-13, "{x}");
        }
    }

    #[test]
    fn lambs_coefficient_is_the_hankel_integral() {
        // The integrand is smooth at 0 (κ⁰/48²) and decays as κ⁻⁷; trapezoid to 60.
        let step = 1e-3;
        let integrand = |x: f64| if x == 0.0 { 1.0 / 48f64.powi(2) } else { (libm::jn(3, x) / x.powi(3)).powi(2) };
        let sum: f64 = (1..60_000).map(|k| integrand(f64::from(k) * step)).sum::<f64>() + 0.5 * integrand(0.0);
        assert!((640.0 * step * sum / LAMB_COEFFICIENT - 1.0).abs() < 1e-7, "{}", 640.0 * step * sum);
    }

    #[test]
    fn the_clamped_plate_is_the_static_limit_of_its_modes() {
        // Σ w_n(0)²/(m_n ω_n²) = a²/(16πD); the sum's terms fall as n⁻³, 40 modes leave 1/(2·40²) of the first.
        let plate = plate();
        let mass = plate.material.density * plate.thickness;
        let mut sum = 0.0;
        for mode in 1..=40 {
            let omega = TAU * plate.clamped_frequency(mode);
            let lambda = (omega * 1e-6 * (mass / plate.rigidity()).sqrt()).sqrt();
            // w = J₀(λr) − J₀(λ)/I₀(λ) I₀(λr); ∫w²r dr = J₀²(λ) on the unit disc (Leissa's norm) when clamped.
            let at_middle = 1.0 - libm::j0(lambda) / bessel_0(lambda);
            sum += at_middle.powi(2) / (mass * TAU * 1e-6 * libm::j0(lambda).powi(2) * omega * omega);
        }
        assert!((sum / plate.clamped_flexibility() - 1.0).abs() < 1e-3, "{}", sum / plate.clamped_flexibility());
    }

    fn bessel_0(x: f64) -> f64 {
        let (mut term, mut sum) = (1.0, 0.0);
        for k in 1..400 {
            sum += term;
            term *= 0.25 * x * x / f64::from(k * k);
        }
        sum
    }
}
