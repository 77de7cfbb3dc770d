//! Measured quantity: velocity of the last bead, or pressure behind the disc.

use serde::{Deserialize, Serialize};

/// Quantity of a record, and of the runs compared with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measurand {
    /// Velocity of the last bead's far pole, m/s.
    #[default]
    Velocity,
    /// Pressure at a point of the water about the ambient one, Pa.
    Pressure,
}

impl Measurand {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Velocity => "velocity",
            Self::Pressure => "pressure",
        }
    }

    pub const fn unit(self) -> &'static str {
        match self {
            Self::Velocity => "m/s",
            Self::Pressure => "Pa",
        }
    }
}
