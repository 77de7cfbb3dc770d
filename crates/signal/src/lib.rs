//! Uniformly sampled series and the quantities written at the program's borders.
//!
//! Everything in memory is coherent SI in `f64`. A number meets its unit exactly once, here.

pub mod feature;

mod calculus;
mod causal;
mod conditioning;
pub mod convergence;
mod digest;
mod filter;
mod flicker;
mod kernel;
pub mod number;
mod quantity;
pub mod read_back;
mod repair;
mod resample;
mod response;
mod series;
pub mod spline;
mod statistics;
mod unit;
pub mod vectors;
mod visible;
mod word;

pub use calculus::integral;
pub use causal::CausalShape;
pub use conditioning::{Conditioning, about_running_mean, wander};
pub use digest::{hexadecimal, sha256, sha256_bytes};
pub use filter::{LowPass, forward_transform, inverse_transform, low_pass};
pub use flicker::{FlickerSource, NoiseSpectrum};
pub use quantity::{Dimension, Quantity, QuantityError};
pub use repair::{Gap, bridge};
pub use resample::Resampler;
pub use response::{InstrumentResponse, ResponseError, ResponseTable};
pub use series::{Series, mean_and_rms};
pub use statistics::median;
pub use unit::Unit;
pub use visible::{visible, visible_json};
pub use word::closest;
