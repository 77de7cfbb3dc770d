//! Closed forms with references: the tests' oracle and the documentation's figures.

mod collision;
mod piston;
mod plate;
mod precompressed;
mod solitary_wave;

pub use collision::Collision;
pub use piston::BaffledPiston;
pub use plate::{LAMB_COEFFICIENT, ThinPlate};
pub use precompressed::{cutoff_frequency, mode_frequency};
pub use solitary_wave::{
    DISCRETE_SPEED_FACTOR, DiscretePulse, NESTERENKO_SPEED_FACTOR, nesterenko_profile, nesterenko_speed_at_force,
    nesterenko_width, solitary_wave_speed,
};
