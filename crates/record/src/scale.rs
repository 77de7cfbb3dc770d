//! Sensitivity of a vibrometer or hydrophone: volts → velocity, displacement or pressure.

use super::{DecimalSign, decimal::may_be_grouped};
use granchain_signal::{Dimension, Quantity, Unit};

/// Smallest and largest sensitivity of a hydrophone with its amplifier, V/Pa: needles of 40 µm have about 10 nV/Pa,
/// the largest underwater hydrophones 2 mV/Pa, and an amplifier adds up to 60 dB.
const HYDROPHONE: (f64, f64) = (1e-10, 10.0);

/// Velocity, displacement or pressure per volt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// Quantity per volt, m/s/V, m/V or Pa/V; always positive.
    per_volt: f64,
    /// Dimension of the quantity: velocity, length or pressure.
    dimension: Dimension,
    /// Whether the volt stands for the full scale of a recorder, of which the file holds parts.
    of_full_scale: bool,
}

/// Why a text is not a sensitivity.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SensitivityError {
    #[error(transparent)]
    Quantity(#[from] granchain_signal::QuantityError),
    #[error(
        "expected a sensitivity such as `100 mm/s/V`, `2 um/V`, `20 kPa/V` or `250 nV/Pa`, found `{found}`; a vibrometer's range such as \
         `100 mm/s/V` stands on its front panel, a hydrophone's on its calibration certificate"
    )]
    Dimension { found: String },
    #[error("expected a sensitivity above zero, found `{found}`; invert=true turns the sign")]
    NotPositive { found: String },
    #[error(
        "expected a hydrophone's sensitivity between {} and {}, found `{found}`, which is {}: {} a volt; check the prefixes",
        volts_a_pascal(HYDROPHONE.0), volts_a_pascal(HYDROPHONE.1), volts_a_pascal(1.0 / per_volt), pascals(*per_volt)
    )]
    NoHydrophone { found: String, per_volt: f64 },
}

fn pascals(pressure: f64) -> Quantity {
    // An inverse has sixteen digits.
    Quantity::new(format!("{pressure:.3e}").parse().unwrap_or(pressure), Dimension::PRESSURE)
}

fn volts_a_pascal(sensitivity: f64) -> String {
    // Three digits: an inverse has sixteen.
    let rounded = format!("{sensitivity:.2e}").parse().unwrap_or(sensitivity);
    // Nobody names less than a tenth of a nanovolt by a prefix.
    if rounded < HYDROPHONE.0 {
        return format!("{rounded:e} V/Pa");
    }
    format!("{}/Pa", Quantity::new(rounded, Dimension::VOLTAGE))
}

/// `-220 dB re 1 V/uPa`, as data sheets of hydrophones state it; `None` for what is not in decibels.
fn in_decibels(text: &str) -> Option<Result<Quantity, granchain_signal::QuantityError>> {
    let (level, reference) = text.split_once("dB")?;
    let level: f64 = level.trim().replace('\u{2212}', "-").parse().ok()?;
    let reference = reference.trim().trim_start_matches('(').trim_end_matches(')').trim();
    let reference = reference.strip_prefix("re").unwrap_or(reference).trim_start_matches([':', '.']).trim();
    let reference = match reference.chars().next()? {
        '0'..='9' => Quantity::parse(reference),
        _ => Quantity::parse(&format!("1 {reference}")),
    };
    Some(reference.map(|unit| Quantity::new(10f64.powf(level / 20.0) * unit.value, unit.dimension)))
}

/// A sensitivity of a whole recorder, `631 Pa/FS`, `-176 dB re 1/uPa` or `-176 dB re FS/uPa`, with volts in place of full scale.
fn of_full_scale(text: &str) -> Option<String> {
    if let Some(quantity) = text.strip_suffix("/FS") {
        return Some(format!("{quantity}/V"));
    }
    let (level, reference) = text.split_once("dB")?;
    let (re, unit) = reference.split_once('/')?;
    let re = re.trim_end();
    let re = re.strip_suffix("FS").or_else(|| re.strip_suffix('1'))?.trim_end();
    Some(format!("{level}dB{} 1 V/{unit}", re.strip_suffix('1').unwrap_or(re)))
}

/// A decimal comma as a point; what may part thousands stays.
pub(super) fn with_point(text: &str) -> std::borrow::Cow<'_, str> {
    let end = text.find(|letter: char| !(letter.is_ascii_digit() || letter == ',')).unwrap_or(text.len());
    let number = &text[..end];
    let is_decimal = number.matches(',').count() == 1 && !may_be_grouped(number, DecimalSign::Comma);
    if is_decimal { text.replacen(',', ".", 1).into() } else { text.into() }
}

impl Sensitivity {
    /// Reads `100 mm/s/V`, `2 um/V`, `0.5 (mm/s)/mV`, `20 kPa/V`, or the usual form for hydrophones, volts per
    /// pressure: `250 nV/Pa`, `50 mV/MPa`, `-220 dB re 1 V/uPa`; also volts per velocity, `8 mV/(mm/s)`, a decimal comma, and
    /// `-176 dB re 1/uPa` or `631 Pa/FS` of a recorder whose file holds parts of full scale.
    ///
    /// ```
    /// use granchain_record::Sensitivity;
    /// use granchain_signal::{Dimension, Unit};
    /// let sensitivity = Sensitivity::parse("100 mm/s/V")?;
    /// let unit = sensitivity.unit_of(Unit::parse("mV")?);
    /// assert!((unit.factor - 1e-4).abs() < 1e-18); // m/s a millivolt
    /// assert_eq!(unit.dimension, Dimension::VELOCITY);
    /// let hydrophone = Sensitivity::parse("250 nV/Pa")?;
    /// assert_eq!(hydrophone, Sensitivity::parse("4 MPa/V")?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SensitivityError`] for anything but a positive velocity, length or pressure a volt, and for what no hydrophone has.
    pub fn parse(text: &str) -> Result<Self, SensitivityError> {
        let plain = with_point(text);
        let full_scale = of_full_scale(&plain);
        let plain = full_scale.as_deref().unwrap_or(&plain);
        let quantity = match in_decibels(plain) {
            Some(quantity) => quantity?,
            None => Quantity::parse(plain)?,
        };
        let volt = Dimension::VOLTAGE.volt;
        let measured = Dimension { volt: quantity.dimension.volt.saturating_add(volt), ..quantity.dimension };
        let pressure = Dimension::PRESSURE;
        let volts_for_pressure =
            Dimension { metre: -pressure.metre, kilogram: -pressure.kilogram, second: -pressure.second, volt };
        // Velocity sensors are given in volts for a velocity: `8 mV/(mm/s)`.
        let volts_for_velocity = Dimension { metre: -4, second: 4, ..Dimension::VOLTAGE };
        let (per_volt, dimension) = match measured {
            Dimension::VELOCITY | Dimension::LENGTH | Dimension::PRESSURE => (quantity.value, measured),
            _ if quantity.dimension == volts_for_pressure => (1.0 / quantity.value, pressure),
            _ if quantity.dimension == volts_for_velocity => (1.0 / quantity.value, Dimension::VELOCITY),
            _ => return Err(SensitivityError::Dimension { found: text.into() }),
        };
        if !(quantity.value > 0.0 && quantity.value.is_finite() && per_volt.is_finite()) {
            return Err(SensitivityError::NotPositive { found: text.into() });
        }
        if dimension == pressure && !(HYDROPHONE.0..=HYDROPHONE.1).contains(&(1.0 / per_volt)) {
            return Err(SensitivityError::NoHydrophone { found: text.into(), per_volt });
        }
        Ok(Self { per_volt, dimension, of_full_scale: full_scale.is_some() })
    }

    /// Value of one unit of `voltage`.
    #[must_use]
    pub fn unit_of(self, voltage: Unit) -> Unit {
        Unit { factor: voltage.factor * self.per_volt, dimension: self.dimension }
    }

    /// Whether it is for parts of a recorder's full scale instead of volts.
    #[must_use]
    pub(crate) fn is_of_full_scale(self) -> bool {
        self.of_full_scale
    }

    /// Velocity (m/s), length (m) or pressure (Pa) per volt.
    #[must_use]
    pub(crate) fn per_volt(self) -> f64 {
        self.per_volt
    }

    #[must_use]
    pub(crate) fn dimension(self) -> Dimension {
        self.dimension
    }
}

impl std::fmt::Display for Sensitivity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.of_full_scale {
            let figures = format!("{:.3e}", self.per_volt).parse().unwrap_or(self.per_volt);
            return write!(f, "{}/FS", Quantity::new(figures, self.dimension));
        }
        if self.dimension == Dimension::PRESSURE {
            return write!(f, "{}/V ({})", pascals(self.per_volt), volts_a_pascal(1.0 / self.per_volt));
        }
        write!(f, "{}/V", Quantity::new(self.per_volt, self.dimension))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vibrometers_and_hydrophones_are_understood() {
        for (text, per_volt, motion) in [
            ("100 mm/s/V", 0.1, Dimension::VELOCITY),
            ("100 (mm/s)/V", 0.1, Dimension::VELOCITY),
            ("0.125 m/s/V", 0.125, Dimension::VELOCITY),
            ("2 um/V", 2e-6, Dimension::LENGTH),
            ("5 nm/mV", 5e-6, Dimension::LENGTH),
            ("0,125 m/s/V", 0.125, Dimension::VELOCITY),
            ("8 mV/(mm/s)", 0.125, Dimension::VELOCITY),
            ("8 V s/m", 0.125, Dimension::VELOCITY),
            ("20 kPa/V", 2e4, Dimension::PRESSURE),
            ("0.2 bar/V", 2e4, Dimension::PRESSURE),
            ("50 uV/Pa", 2e4, Dimension::PRESSURE),
            ("50 V/MPa", 2e4, Dimension::PRESSURE),
            ("250 nV/Pa", 4e6, Dimension::PRESSURE),
            ("250 mV/MPa", 4e6, Dimension::PRESSURE),
            ("2.5e-7 V/Pa", 4e6, Dimension::PRESSURE),
        ] {
            let found = Sensitivity::parse(text).unwrap();
            assert!((found.per_volt - per_volt).abs() < 4e-16 * per_volt, "{text}: {found:?}");
            assert_eq!(found.dimension, motion, "{text}");
        }
        for text in ["-220 dB re 1 V/uPa", "\u{2212}220 dB re 1V/\u{b5}Pa", "-220 dB (re: V/uPa)", "-100 dB re 1 V/Pa"]
        {
            let found = Sensitivity::parse(text).unwrap();
            assert!((found.per_volt - 1e5).abs() < 1e-9 && found.dimension == Dimension::PRESSURE, "{text}: {found:?}");
        }
        // Of a whole recorder: 10^(176/20) µPa at full scale.
        for text in ["-176 dB re 1/uPa", "-176 dB re FS/\u{b5}Pa", "-176 dB re 1 FS/uPa", "630.957344480193 Pa/FS"] {
            let found = Sensitivity::parse(text).unwrap();
            assert!(
                (found.per_volt - 630.957_344_480_193).abs() < 1e-9 && found.is_of_full_scale(),
                "{text}: {found:?}"
            );
            assert_eq!(found.to_string(), "631 Pa/FS");
        }
        assert!(!Sensitivity::parse("20 kPa/V").unwrap().is_of_full_scale());
        assert!(Sensitivity::parse("-220 dB").is_err() && Sensitivity::parse("-220 dB re 1 V").is_err());
        assert_eq!(Sensitivity::parse("100 mm/s/V").unwrap().to_string(), "0.1 m/s/V");
        assert_eq!(Sensitivity::parse("250 nV/Pa").unwrap().to_string(), "4 MPa/V (250 nV/Pa)");
    }

    #[test]
    fn what_no_hydrophone_has_is_refused_with_figures() {
        for (text, figures) in
            [("250 V/Pa", "4 mPa a volt"), ("3 pV/Pa", "3e-12 V/Pa: 333.3 GPa a volt"), ("4 Pa/kV", "250 V/Pa")]
        {
            let message = Sensitivity::parse(text).unwrap_err().to_string();
            assert!(message.contains(figures) && message.contains("0.1 nV/Pa and 10 V/Pa"), "{message}");
        }
    }

    #[test]
    fn anything_else_is_refused() {
        for text in ["100 mm/s", "100", "3 V", "10 V/mm", "1 m/s^2/V", "1,250 mm/s/V", "x"] {
            assert!(Sensitivity::parse(text).is_err(), "{text}");
        }
        for text in ["0 mm/s/V", "-100 mm/s/V"] {
            assert!(matches!(Sensitivity::parse(text), Err(SensitivityError::NotPositive { .. })), "{text}");
        }
    }
}
