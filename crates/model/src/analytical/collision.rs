//! Head-on collision of two elastic spheres.

use std::f64::consts::PI;

/// An undamped Hertz collision, m_r δ̈ = −k δ^(3/2).
///
/// Hertz (1882); Landau, Lifshitz, *Theory of Elasticity*, §9, problem 1; Johnson (1985), *Contact Mechanics*, §11.4.
///
/// ```
/// # use granchain_model::analytical::Collision;
/// let steel = Collision { reduced_mass: 2.050674604e-6, hertz_stiffness: 2.328270365e9, speed: 0.1 };
/// assert!((steel.duration() / 4.84774996e-6 - 1.0).abs() < 1e-8);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collision {
    /// m_r = m₁ m₂/(m₁ + m₂), kg.
    pub reduced_mass: f64,
    pub hertz_stiffness: f64,
    /// Relative speed before the collision v, m/s.
    pub speed: f64,
}

impl Collision {
    /// Largest overlap δ_max = (5 m_r v²/(4k))^(2/5), m.
    pub fn largest_overlap(&self) -> f64 {
        (1.25 * self.reduced_mass * self.speed * self.speed / self.hertz_stiffness).powf(0.4)
    }

    /// Largest force k δ_max^(3/2), N.
    pub fn largest_force(&self) -> f64 {
        self.hertz_stiffness * self.largest_overlap().powf(1.5)
    }

    /// Duration (4√π/5) Γ(2/5)/Γ(9/10) δ_max/v = 2.9432751843247 δ_max/v, s.
    pub fn duration(&self) -> f64 {
        let factor = 0.8 * PI.sqrt() * libm::tgamma(0.4) / libm::tgamma(0.9);
        factor * self.largest_overlap() / self.speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steel_beads_at_a_tenth_of_a_metre_a_second_collide_as_tabulated() {
        let collision =
            Collision { reduced_mass: 4.101_349_209e-6 / 2.0, hertz_stiffness: 2.328_270_365e9, speed: 0.1 };
        // The table carries nine digits.
        assert!((collision.largest_overlap() / 0.164_705_97e-6 - 1.0).abs() < 1e-7);
        assert!((collision.duration() / 4.847_749_96e-6 - 1.0).abs() < 1e-8);
        assert!((collision.largest_force() / 0.155_631_472 - 1.0).abs() < 1e-8);
        let factor = collision.duration() * collision.speed / collision.largest_overlap();
        assert!((factor - 2.943_275_184_324_7).abs() < 1e-12);
    }
}
