//! A compliant horn to what it drives.

use std::f64::consts::PI;

use super::Scene;

/// The tip of a horn as a source with an impedance: its *free* motion is prescribed ([`super::Drive`]), and the force F₀ of the first contact moves
/// it by q besides (Thévenin's form of a linear horn, one resonance of it):
///
/// ```text
/// u₀ = α u_horn(t) + q        M q̈ + (M ω/Q) q̇ + M ω² q = −(F₀ − F_static)        ω = 2π f_h
/// ```
///
/// M → ∞ is the prescribed motion. Energy: the source gives F₀ α u̇_horn, of which the chain gets F₀ u̇₀ and the horn the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Horn {
    /// Modal mass M at the tip, kg.
    pub mass: f64,
    /// Frequency f_h of the resonance, Hz.
    pub frequency: f64,
    /// Q of the resonance, 1; ∞ without loss.
    pub quality: f64,
}

impl Horn {
    /// M ω², N/m.
    pub fn stiffness(&self) -> f64 {
        self.mass * self.angular().powi(2)
    }

    /// M ω/Q, N·s/m.
    pub fn resistance(&self) -> f64 {
        self.mass * self.angular() / self.quality
    }

    fn angular(&self) -> f64 {
        2.0 * PI * self.frequency
    }
}

impl Scene {
    /// Give the horn a modal mass (kg); one that had none resonates at the drive, without loss.
    pub fn set_horn_mass(&mut self, mass: f64) {
        let frequency = self.drive.frequency;
        self.horn.get_or_insert(Horn { mass, frequency, quality: f64::INFINITY }).mass = mass;
    }
}
