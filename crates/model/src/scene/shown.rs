//! Quantities as messages show them.

use granchain_signal::{Dimension, Quantity};

pub(super) fn length(value: f64) -> String {
    Quantity::new(value, Dimension::LENGTH).to_string()
}

pub(super) fn frequency(value: f64) -> String {
    Quantity::new(value, Dimension::FREQUENCY).to_string()
}

pub(super) fn time(value: f64) -> String {
    Quantity::new(value, Dimension::TIME).to_string()
}
