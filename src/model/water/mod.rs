//! The disc between the chain and a half-space of water.
//!
//! The disc is linear elastic and axisymmetric, its front touched by the last bead, its back on the water z > 0 (z from the back into the
//! water, r from the axis). The plane around the disc is rigid, or free of pressure. The water is linear and lossless:
//!
//! ```text
//! M ü + K u = f − ∫ N_z p dS                     disc: f the contact force, p the pressure on its back
//! p̈ = c² ∇²p,   ρ v̇ = −∇p                        water
//! v_z = u̇_z on the disc;  v_z = 0 (rigid baffle) or p = 0 (soft baffle) beside it;  outgoing waves far away
//! ```
//!
//! Left out: absorption, flow, cavitation (pressure below the ambient one counts as it comes), and the radiation from the disc's front.

pub mod disc;
mod quadrature;
pub mod rayleigh;

/// A liquid without losses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Water {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// Speed of sound c, m/s.
    pub sound_speed: f64,
}

impl Water {
    /// Water of the source paper: ρ 1000 kg/m³, c 1500 m/s.
    #[must_use]
    pub fn fresh() -> Self {
        Self { density: 1000.0, sound_speed: 1500.0 }
    }
}
