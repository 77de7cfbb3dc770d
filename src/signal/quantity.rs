//! Numbers with units: `"3.96 um"`, `"0.3 N s/m"`, `73kHz`, `"3660 N s m^-3/2"` → SI.

use thiserror::Error;

/// Exponents of metre, kilogram, second and volt, each in halves (`metre: 2` is m¹, `metre: -3` is m^(-3/2)).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Dimension {
    /// Twice the exponent of the metre.
    pub metre: i8,
    /// Twice the exponent of the kilogram.
    pub kilogram: i8,
    /// Twice the exponent of the second.
    pub second: i8,
    /// Twice the exponent of the volt.
    pub volt: i8,
}

impl Dimension {
    const fn of(metre: i8, kilogram: i8, second: i8) -> Self {
        Self { metre, kilogram, second, volt: 0 }
    }
    /// A pure number.
    pub const NONE: Self = Self::of(0, 0, 0);
    /// Length, m.
    pub const LENGTH: Self = Self::of(2, 0, 0);
    /// Time, s.
    pub const TIME: Self = Self::of(0, 0, 2);
    /// Frequency, Hz.
    pub const FREQUENCY: Self = Self::of(0, 0, -2);
    /// Velocity, m/s.
    pub const VELOCITY: Self = Self::of(2, 0, -2);
    /// Force, N.
    pub const FORCE: Self = Self::of(2, 2, -4);
    /// Pressure or elastic modulus, Pa.
    pub const PRESSURE: Self = Self::of(-2, 2, -4);
    /// Density, kg/m³.
    pub const DENSITY: Self = Self::of(-6, 2, 0);
    /// Stiffness, N/m.
    pub const STIFFNESS: Self = Self::of(0, 2, -4);
    /// Linear damping coefficient, N·s/m.
    pub const LINEAR_DAMPING: Self = Self::of(0, 2, -2);
    /// Kuwabara–Kono damping coefficient, N·s·m^(-3/2).
    pub const KUWABARA_KONO_DAMPING: Self = Self::of(-1, 2, -2);
    /// Electric potential, V.
    pub const VOLTAGE: Self = Self { metre: 0, kilogram: 0, second: 0, volt: 2 };
}

/// A value in SI with its dimension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// Value in coherent SI units.
    pub value: f64,
    /// Its dimension.
    pub dimension: Dimension,
}

/// Why a text is no quantity.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum QuantityError {
    /// No leading number.
    #[error("expected a number with a unit such as `3.96 um`, found `{found}`")]
    NoNumber {
        /// The text as given.
        found: String,
    },
    /// A unit nobody knows.
    #[error("unknown unit `{unit}` in `{found}`")]
    UnknownUnit {
        /// The part that is no unit.
        unit: String,
        /// The text as given.
        found: String,
    },
}
