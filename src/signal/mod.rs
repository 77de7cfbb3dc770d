//! Uniformly sampled series and the quantities written at the program's borders.
//!
//! Everything in memory is coherent SI in `f64`. A number meets its unit exactly once, here.

mod quantity;
mod series;
pub mod spline;
mod unit;

pub use quantity::{Dimension, Quantity, QuantityError};
pub use series::Series;
pub use unit::Unit;
