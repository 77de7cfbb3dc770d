//! The water behind the disc.

use super::word::words;
use granchain_signal::{Dimension, Quantity};

/// Default step of a chain, reduced model or finite element analysis in front of a disc, s.
pub const DEFAULT_WATER_STEP: f64 = 2.5e-8;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Water {
    pub density: f64,
    /// Speed of sound c, m/s.
    pub sound_speed: f64,
}

impl Water {
    /// Water of the source paper: ρ 1000 kg/m³, c 1500 m/s.
    pub fn fresh() -> Self {
        Self { density: 1000.0, sound_speed: 1500.0 }
    }

    /// Soft tissue on average: ρ 1050 kg/m³, c 1540 m/s, the speed that diagnostic scanners assume.
    ///
    /// Duck (1990), *Physical Properties of Tissue*, ch. 4.
    pub fn tissue() -> Self {
        Self { density: 1050.0, sound_speed: 1540.0 }
    }
}

/// What is behind the disc, by name; density and speed of sound may differ from what the name stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    Water,
    Tissue,
}

words!(Medium { Water = "water", Tissue = "tissue" });

impl Medium {
    pub(crate) fn liquid(self) -> Water {
        match self {
            Self::Water => Water::fresh(),
            Self::Tissue => Water::tissue(),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Baffle {
    Rigid,
    /// It carries no pressure: a free surface.
    Soft,
}

words!(Baffle { Rigid = "rigid", Soft = "soft" });

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaterMesh {
    /// Radius R of the hemisphere, m: beyond the disc and every field point.
    pub radius: f64,
    /// Side h of an element along the radius, m, and half of it in front of the disc, whose bending has a near field; along the arc it is π/2 h
    /// at R and less inside.
    pub side: f64,
}

impl Default for WaterMesh {
    /// R 2.5 mm, h 0.05 mm: for the 2 mm disc to 1 MHz.
    fn default() -> Self {
        Self { radius: 2.5e-3, side: 0.05e-3 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WaterMethod {
    /// Baffled Rayleigh integral in the disc's shapes; rigid baffle only.
    Rayleigh,
    /// Acoustic finite elements in a hemisphere with an absorbing boundary.
    Elements(WaterMesh),
}

impl WaterMethod {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rayleigh => "rayleigh",
            Self::Elements(_) => "elements",
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldPoint {
    /// Distance r from the axis, m.
    pub radius: f64,
    /// Distance z from the plane of the disc's back, m.
    pub distance: f64,
}

impl FieldPoint {
    /// A point on the axis at the distance z (m).
    pub fn on_axis(distance: f64) -> Self {
        Self { radius: 0.0, distance }
    }
}

/// Loss of amplitude along a path, e^(−α d) with α(f) = α₁ (f/1 MHz)^y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Absorption {
    /// α₁, the attenuation of amplitude at 1 MHz, Np/m (1 dB = ln 10/20 Np).
    pub at_1_mhz: f64,
    /// y, 1.
    pub exponent: f64,
}

/// The half-space of water behind the disc: method and field points.
#[derive(Debug, Clone, PartialEq)]
pub struct WaterSettings {
    pub medium: Medium,
    pub liquid: Water,
    /// Losses between the disc and a field point; none by default.
    pub absorption: Option<Absorption>,
    pub baffle: Baffle,
    pub method: WaterMethod,
    /// Field points of the pressure, at least one.
    pub field_points: Vec<FieldPoint>,
}

impl Default for WaterSettings {
    /// Water by the Rayleigh integral with a rigid baffle, one field point on the axis at 1 mm.
    fn default() -> Self {
        Self {
            medium: Medium::Water,
            liquid: Water::fresh(),
            absorption: None,
            baffle: Baffle::Rigid,
            method: WaterMethod::Rayleigh,
            field_points: vec![FieldPoint::on_axis(1e-3)],
        }
    }
}

/// A point as it stands in messages and labels: `r = 0 m, z = 1 mm`.
impl std::fmt::Display for FieldPoint {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let show = |value| Quantity::new(value, Dimension::LENGTH);
        write!(formatter, "r = {}, z = {}", show(self.radius), show(self.distance))
    }
}
