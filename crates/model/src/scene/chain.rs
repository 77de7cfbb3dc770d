//! The beads, from piston to support.

use super::Material;
use granchain_signal::Series;

pub const MOST_BEADS: usize = 1000;

#[derive(Debug, Clone, PartialEq)]
pub struct Bead {
    pub radius: f64,
    pub material: Material,
}

impl Bead {
    /// A sphere of that radius (m) and material.
    pub fn sphere(radius: f64, material: Material) -> Self {
        Self { radius, material }
    }

    /// Mass (4/3) π a³ ρ, kg.
    pub fn mass(&self) -> f64 {
        4.0 / 3.0 * std::f64::consts::PI * self.radius.powi(3) * self.material.density
    }
}

impl Bead {
    /// Duration of a Hertz collision with another bead at a relative speed v (m/s), 2.9433 ((15/16) m_r/(E* √R* √v))^(2/5), s: how fast what happens under a
    /// striker is. [`crate::analytical::Collision`] has it from a stiffness.
    pub(super) fn collision_duration(&self, other: &Self, speed: f64) -> f64 {
        let compliance = |bead: &Self| (1.0 - bead.material.poissons_ratio.powi(2)) / bead.material.youngs_modulus;
        let modulus = 1.0 / (compliance(self) + compliance(other));
        let radius = self.radius * other.radius / (self.radius + other.radius);
        let reduced_mass = self.mass() * other.mass() / (self.mass() + other.mass());
        2.943_275_184_324_7 * (0.9375 * reduced_mass / (modulus * radius.sqrt() * speed.sqrt())).powf(0.4)
    }
}

/// N beads and the N + 1 contacts around them, numbered from the piston.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    pub beads: Vec<Bead>,
    /// Initial gap of each of the N + 1 contacts, m, ≥ 0; the first lies between piston and bead 1.
    pub gaps: Vec<f64>,
    /// Static force F₀ along the chain before the drive starts, N, ≥ 0; needs all gaps closed.
    pub precompression: f64,
    /// Acceleration of gravity along the axis, from piston or striker to the support, m/s²; 0 for none.
    pub gravity: f64,
    /// A force sensor embedded in a bead; none without one.
    pub sensor: Option<Sensor>,
}

/// A force sensor embedded in a bead: it reads s F₋ + (1 − s) F₊.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Number of the bead, from 1.
    pub bead: usize,
    /// Share s of F₋, the force of the contact before the bead, 0 to 1; F₊ is that of the contact behind it. ½ reads their mean.
    pub share: f64,
}

impl Sensor {
    /// Its reading, N, of the forces of all contacts, the first before bead 1.
    pub fn reads(self, forces: &[Series]) -> Series {
        let [before, behind] = [&forces[self.bead - 1], &forces[self.bead]];
        let both = before.values.iter().zip(&behind.values);
        Series { values: both.map(|(a, b)| self.share * a + (1.0 - self.share) * b).collect(), ..before.clone() }
    }
}

impl Chain {
    /// What its sensor reads, N, of the forces of all contacts.
    pub(crate) fn reading(&self, forces: &[Series]) -> Option<Series> {
        self.sensor.map(|sensor| sensor.reads(forces))
    }

    /// The first contact that is open at the start, counted from 1 at the piston, and its gap, m.
    pub(crate) fn first_open_gap(&self) -> Option<(usize, f64)> {
        self.gaps.iter().position(|gap| *gap > 0.0).map(|contact| (contact + 1, self.gaps[contact]))
    }
}
