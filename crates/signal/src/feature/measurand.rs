//! What a record or a run is measured for: the motion of the last bead, or the sound behind the disc.

use serde::{Deserialize, Serialize};

/// The quantity that a record holds and that runs are compared with it by.
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
