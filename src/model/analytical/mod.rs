//! Closed forms with references: the tests' oracle and the documentation's figures.

mod collision;
mod precompressed;
mod solitary_wave;

pub use collision::Collision;
pub use precompressed::{cutoff_frequency, mode_frequency};
pub use solitary_wave::{DISCRETE_SPEED_FACTOR, NESTERENKO_SPEED_FACTOR, nesterenko_width, solitary_wave_speed};
