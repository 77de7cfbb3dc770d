//! The sensitivity of a decoder: volts → velocity or displacement.

use crate::signal::{Dimension, Quantity, Unit};

/// Velocity or displacement for one volt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// Motion a volt, m/s/V or m/V; the sign turns nothing, so it is positive.
    per_volt: f64,
    /// What it is a sensitivity for: velocity or length.
    motion: Dimension,
}

/// Why a text is no sensitivity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SensitivityError {
    /// No quantity.
    #[error(transparent)]
    Quantity(#[from] crate::signal::QuantityError),
    /// A quantity of something else.
    #[error(
        "expected a sensitivity such as `100 mm/s/V` or `2 um/V`, found `{found}`; a decoder's range such as \
         `100 mm/s/V` stands on its front panel"
    )]
    Dimension {
        /// The text.
        found: String,
    },
    /// Zero or below.
    #[error("expected a sensitivity above zero, found `{found}`; --invert turns the sign")]
    NotPositive {
        /// The text.
        found: String,
    },
}

impl Sensitivity {
    /// Read `100 mm/s/V`, `2 um/V`, `0.5 (mm/s)/mV`.
    ///
    /// ```
    /// use granchain::{measurement::Sensitivity, signal::{Dimension, Unit}};
    /// let sensitivity = Sensitivity::parse("100 mm/s/V")?;
    /// let unit = sensitivity.unit_of_motion(Unit::parse("mV")?);
    /// assert!((unit.factor - 1e-4).abs() < 1e-18); // m/s a millivolt
    /// assert_eq!(unit.dimension, Dimension::VELOCITY);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SensitivityError`] for anything but a positive velocity or length a volt.
    pub fn parse(text: &str) -> Result<Self, SensitivityError> {
        let quantity = Quantity::parse(text)?;
        let volt = Dimension::VOLTAGE.volt;
        let motion = Dimension { volt: quantity.dimension.volt.saturating_add(volt), ..quantity.dimension };
        if motion != Dimension::VELOCITY && motion != Dimension::LENGTH {
            return Err(SensitivityError::Dimension { found: text.into() });
        }
        if !(quantity.value > 0.0 && quantity.value.is_finite()) {
            return Err(SensitivityError::NotPositive { found: text.into() });
        }
        Ok(Self { per_volt: quantity.value, motion })
    }

    /// What one `voltage` (a unit of volts) is in motion.
    #[must_use]
    pub fn unit_of_motion(self, voltage: Unit) -> Unit {
        Unit { factor: voltage.factor * self.per_volt, dimension: self.motion }
    }

    /// Velocity (m/s) or length (m) for one volt.
    #[must_use]
    pub fn per_volt(self) -> f64 {
        self.per_volt
    }

    /// Velocity or length.
    #[must_use]
    pub fn motion(self) -> Dimension {
        self.motion
    }
}

impl std::fmt::Display for Sensitivity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/V", Quantity::new(self.per_volt, self.motion))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_and_displacement_decoders_are_understood() {
        for (text, per_volt, motion) in [
            ("100 mm/s/V", 0.1, Dimension::VELOCITY),
            ("100 (mm/s)/V", 0.1, Dimension::VELOCITY),
            ("0.125 m/s/V", 0.125, Dimension::VELOCITY),
            ("2 um/V", 2e-6, Dimension::LENGTH),
            ("5 nm/mV", 5e-6, Dimension::LENGTH),
        ] {
            let found = Sensitivity::parse(text).unwrap();
            assert!((found.per_volt - per_volt).abs() < 1e-15 * per_volt, "{text}: {found:?}");
            assert_eq!(found.motion, motion, "{text}");
        }
        assert_eq!(Sensitivity::parse("100 mm/s/V").unwrap().to_string(), "0.1 m/s/V");
    }

    #[test]
    fn anything_else_is_refused() {
        for text in ["100 mm/s", "100", "3 V", "10 V/mm", "1 m/s^2/V", "x"] {
            assert!(Sensitivity::parse(text).is_err(), "{text}");
        }
        for text in ["0 mm/s/V", "-100 mm/s/V"] {
            assert!(matches!(Sensitivity::parse(text), Err(SensitivityError::NotPositive { .. })), "{text}");
        }
    }
}
