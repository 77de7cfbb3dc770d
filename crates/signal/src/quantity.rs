//! Numbers with units: `"3.96 um"`, `"0.3 N s/m"`, `73kHz`, `"3660 N s m^-3/2"` → SI.
//!
//! A quantity is a decimal number followed by a unit (the grammar of units stands at [`Unit::parse`]). Prefixes are applied to
//! the decimal exponent before the number is rounded to `f64`, so `"3.96 um"` is the very `f64` that `3.96e-6` is.

use std::{fmt, str::FromStr};

use thiserror::Error;

use super::unit::{MOST_OPEN, Scale, Unit};

/// The exponent 1.
pub(super) const WHOLE: i8 = 4;

/// Exponents of metre, kilogram, second and volt, each in quarters (`metre: 4` is m¹, `metre: -6` is m^(-3/2)).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Dimension {
    /// Four times the exponent of the metre.
    pub metre: i8,
    /// Four times the exponent of the kilogram.
    pub kilogram: i8,
    /// Four times the exponent of the second.
    pub second: i8,
    /// Four times the exponent of the volt.
    pub volt: i8,
}

impl Dimension {
    pub(super) const fn of(metre: i8, kilogram: i8, second: i8) -> Self {
        Self { metre, kilogram, second, volt: 0 }
    }
    pub const NONE: Self = Self::of(0, 0, 0);
    pub const LENGTH: Self = Self::of(4, 0, 0);
    pub const MASS: Self = Self::of(0, 4, 0);
    pub const TIME: Self = Self::of(0, 0, 4);
    pub const FREQUENCY: Self = Self::of(0, 0, -4);
    pub const VELOCITY: Self = Self::of(4, 0, -4);
    pub const ACCELERATION: Self = Self::of(4, 0, -8);
    pub const FORCE: Self = Self::of(4, 4, -8);
    pub const ENERGY: Self = Self::of(8, 4, -8);
    /// Pressure or elastic modulus, Pa.
    pub const PRESSURE: Self = Self::of(-4, 4, -8);
    pub const DENSITY: Self = Self::of(-12, 4, 0);
    pub const STIFFNESS: Self = Self::of(0, 4, -8);
    /// Hertz stiffness, N·m^(-3/2).
    pub const HERTZ_STIFFNESS: Self = Self::of(-2, 4, -8);
    /// Linear damping coefficient, N·s/m.
    pub const LINEAR_DAMPING: Self = Self::of(0, 4, -4);
    /// Kuwabara–Kono damping coefficient, N·s·m^(-3/2).
    pub const KUWABARA_KONO_DAMPING: Self = Self::of(-2, 4, -4);
    /// Attenuation of an amplitude along a path, Np/m (1 dB = ln 10/20 Np).
    pub const ATTENUATION: Self = Self::of(-4, 0, 0);
    pub const VOLTAGE: Self = Self { metre: 0, kilogram: 0, second: 0, volt: 4 };

    /// Name with its article, such as "a length"; `None` for a dimension without a common name.
    pub fn name(self) -> Option<&'static str> {
        self.known().map(|known| known.name)
    }

    /// Its SI unit, `m/s` or `N·s·m^(-3/2)`; empty for a pure number.
    pub fn si_unit(self) -> String {
        // A mass is written in grams, and kept in kilograms.
        let known = self.known().filter(|_| self != Self::MASS);
        known.map_or_else(|| self.base_units("·"), |known| known.people.to_owned())
    }

    /// "a length such as `0.5 mm`", for a message.
    pub fn describe(self) -> String {
        self.known().map_or_else(
            || format!("a quantity in {}", self.base_units("·")),
            |known| format!("{} such as `{}`", known.name, known.example),
        )
    }

    fn base_units(self, separator: &str) -> String {
        let mut text = String::new();
        for (symbol, quarters) in [("kg", self.kilogram), ("m", self.metre), ("s", self.second), ("V", self.volt)] {
            if quarters == 0 {
                continue;
            }
            if !text.is_empty() {
                text.push_str(separator);
            }
            text.push_str(symbol);
            if quarters != WHOLE {
                text.push('^');
                text.push_str(&(f64::from(quarters) / f64::from(WHOLE)).to_string());
            }
        }
        text
    }

    fn known(self) -> Option<&'static Known> {
        KNOWN.iter().find(|known| known.dimension == self)
    }
}

struct Known {
    dimension: Dimension,
    name: &'static str,
    example: &'static str,
    people: &'static str,
    /// Unit in ASCII, as it is written to files.
    ascii: &'static str,
    /// Largest and smallest power of ten (in steps of three) of the prefix put before the unit.
    prefixes: std::ops::RangeInclusive<i32>,
}

const fn known(
    dimension: Dimension,
    name: &'static str,
    example: &'static str,
    units: [&'static str; 2],
    prefixes: std::ops::RangeInclusive<i32>,
) -> Known {
    Known { dimension, name, example, people: units[0], ascii: units[1], prefixes }
}

static KNOWN: [Known; 17] = [
    known(Dimension::NONE, "a number without unit", "0.7", ["", ""], 0..=0),
    known(Dimension::LENGTH, "a length", "0.5 mm", ["m", "m"], -12..=3),
    known(Dimension::MASS, "a mass", "4.1 mg", ["g", "g"], -9..=3),
    known(Dimension::TIME, "a time", "120 us", ["s", "s"], -12..=0),
    known(Dimension::FREQUENCY, "a frequency", "73 kHz", ["Hz", "Hz"], 0..=9),
    known(Dimension::VELOCITY, "a velocity", "289 mm/s", ["m/s", "m/s"], -9..=3),
    known(Dimension::ACCELERATION, "an acceleration", "9.81 m/s^2", ["m/s²", "m/s^2"], 0..=0),
    known(Dimension::FORCE, "a force", "0.05 N", ["N", "N"], -9..=6),
    known(Dimension::ENERGY, "an energy", "2 nJ", ["J", "J"], -15..=6),
    known(Dimension::PRESSURE, "a pressure or elastic modulus", "201 GPa", ["Pa", "Pa"], -3..=12),
    known(Dimension::DENSITY, "a density", "7833 kg/m^3", ["kg/m³", "kg/m^3"], 0..=0),
    known(Dimension::STIFFNESS, "a stiffness", "1e6 N/m", ["N/m", "N/m"], 0..=9),
    known(Dimension::HERTZ_STIFFNESS, "a Hertz stiffness", "2.3e9 N/m^1.5", ["N·m^(-3/2)", "N/m^1.5"], 0..=0),
    known(Dimension::LINEAR_DAMPING, "a linear damping coefficient", "0.3 N s/m", ["N·s/m", "N s/m"], 0..=0),
    known(
        Dimension::KUWABARA_KONO_DAMPING,
        "a Kuwabara–Kono damping coefficient",
        "3660 N s/m^1.5",
        ["N·s·m^(-3/2)", "N s/m^1.5"],
        0..=0,
    ),
    known(Dimension::ATTENUATION, "an attenuation", "0.5 dB/cm", ["Np/m", "Np/m"], 0..=0),
    known(Dimension::VOLTAGE, "a voltage", "1 V", ["V", "V"], -9..=6),
];

/// A value in SI with its dimension.
///
/// ```
/// use granchain_signal::{Dimension, Quantity};
/// let amplitude = Quantity::parse("3.96 um")?;
/// assert_eq!((amplitude.value, amplitude.dimension), (3.96e-6, Dimension::LENGTH));
/// assert_eq!(Quantity::parse_as("73kHz", Dimension::FREQUENCY)?, 73e3);
/// assert_eq!(amplitude.to_string(), "3.96 µm");
/// # Ok::<(), granchain_signal::QuantityError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// Value in coherent SI units.
    pub value: f64,
    pub dimension: Dimension,
}

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum QuantityError {
    #[error("expected a number with a unit such as `3.96 um`, found `{found}`")]
    NoNumber { found: String },
    #[error("expected {}, found `{found}`", expected.describe())]
    NoSuchNumber { expected: Dimension, found: String },
    #[error("expected a decimal point, found a comma in `{found}`; write `{suggestion}`")]
    DecimalComma { found: String, suggestion: String },
    #[error("`{found}` is too large to be represented")]
    TooLarge { found: String },
    #[error("unknown unit `{unit}`{}{}", if unit == found { String::new() } else { format!(" in `{found}`") }, nearest.as_ref().map_or_else(
        || "; examples: mm/s, um, nm, V, kPa".to_owned(), |nearest| format!("; did you mean `{nearest}`?")))]
    UnknownUnit { unit: String, found: String, nearest: Option<String> },
    #[error("`{exponent}` in `{found}` is no exponent; expected a multiple of 1/4 such as `^2`, `^-3/2` or `^1.25`")]
    Exponent { exponent: String, found: String },
    #[error("cannot read the unit in `{found}` at `{rest}`; expected a unit such as `mm/s` or `N s/m^1.5`")]
    Malformed { rest: String, found: String },
    #[error("expected a unit with at most {MOST_OPEN} parentheses in one another, found more in `{found}…`")]
    Nested { found: String },
    #[error("expected {}, found `{found}` without a unit", expected.describe())]
    MissingUnit { expected: Dimension, found: String },
    #[error(
        "expected {}, found `{found}`, which is {}",
        expected.describe(),
        actual.name().map_or_else(|| format!("in {}", actual.si_unit()), str::to_owned)
    )]
    WrongDimension { expected: Dimension, actual: Dimension, found: String },
}

impl Quantity {
    pub const fn new(value: f64, dimension: Dimension) -> Self {
        Self { value, dimension }
    }

    /// Reads a number with its unit; without a unit it is a pure number.
    pub fn parse(text: &str) -> Result<Self, QuantityError> {
        let trimmed = text.trim();
        let (number, unit) = split_number(trimmed)?;
        let unit = unit.trim();
        let scale = if unit.is_empty() { Scale::ONE } else { Scale::parse(unit, trimmed)? };
        let value = scale.apply(&number);
        if !value.is_finite() {
            return Err(QuantityError::TooLarge { found: trimmed.to_owned() });
        }
        Ok(Self { value, dimension: scale.dimension })
    }

    pub fn parse_as(text: &str, expected: Dimension) -> Result<f64, QuantityError> {
        let quantity = Self::parse(text).map_err(|error| match error {
            QuantityError::NoNumber { found } => QuantityError::NoSuchNumber { expected, found },
            error => error,
        })?;
        if quantity.dimension == expected {
            return Ok(quantity.value);
        }
        let found = text.trim().to_owned();
        if quantity.dimension == Dimension::NONE && !found.ends_with('%') {
            return Err(QuantityError::MissingUnit { expected, found });
        }
        Err(QuantityError::WrongDimension { expected, actual: quantity.dimension, found })
    }

    /// The quantity in ASCII with a convenient prefix, such as `0.5 mm` or `3660 N s/m^1.5`.
    ///
    /// Reading it back gives the same `f64`; with a unit that has a half exponent no prefix is used.
    pub fn format_si(&self) -> String {
        self.written(false)
    }

    fn written(&self, people: bool) -> String {
        let Some(known) = self.dimension.known() else {
            let separator = if people { "·" } else { " " };
            return format!("{:?} {}", self.value, self.dimension.base_units(separator)).replace(".0 ", " ");
        };
        let unit = if people { known.people } else { known.ascii };
        if unit.is_empty() {
            return shifted(self.value, 0);
        }
        // The gram carries the prefix, the kilogram is the SI unit.
        let offset = if known.dimension == Dimension::MASS { 3 } else { 0 };
        let (number, power) = known
            .prefixes
            .clone()
            .filter(|power| power % 3 == 0)
            .map(|power| (shifted(self.value, offset - power), power))
            .min_by_key(|(number, power)| readability(number, *power, self.dimension))
            .unwrap_or_else(|| (shifted(self.value, offset), 0));
        format!("{number} {}{unit}", prefix(power, people))
    }
}

/// Sort key for ways to write a number: between 0.1 and 1000 first, then the shortest, then fewer trailing zeros, then
/// the smaller prefix. Times are in microseconds unless another prefix is shorter.
fn readability(number: &str, power: i32, dimension: Dimension) -> (bool, usize, usize, i32) {
    let magnitude = number.parse::<f64>().map_or(0.0, f64::abs);
    if magnitude == 0.0 {
        return (false, 0, 0, power.abs());
    }
    let zeros = if number.contains('.') { 0 } else { number.len() - number.trim_end_matches('0').len() };
    let zeros = if dimension == Dimension::TIME { usize::from(power != -6) } else { zeros };
    (!(0.1..1000.0).contains(&magnitude), number.len(), zeros, power.abs())
}

/// `value` × 10^`power` in the shortest decimals that determine `value`, by moving the point, not by multiplying.
fn shifted(value: f64, power: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.abs().to_string();
    }
    let scientific = format!("{value:e}");
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent = exponent.parse::<i32>().unwrap_or(0) + power;
    let (sign, mantissa) = mantissa.strip_prefix('-').map_or(("", mantissa), |rest| ("-", rest));
    let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    let count = digits.len() as i32;
    match exponent {
        0..=8 if count <= exponent + 1 => format!("{sign}{digits}{}", "0".repeat((exponent + 1 - count) as usize)),
        0..=8 => {
            let (whole, fraction) = digits.split_at((exponent + 1) as usize);
            format!("{sign}{whole}.{fraction}")
        }
        -4..=-1 => format!("{sign}0.{}{digits}", "0".repeat((-exponent - 1) as usize)),
        _ => format!("{sign}{mantissa}e{exponent}"),
    }
}

fn prefix(power: i32, people: bool) -> &'static str {
    match power {
        -15 => "f",
        -12 => "p",
        -9 => "n",
        -6 if people => "µ",
        -6 => "u",
        -3 => "m",
        3 => "k",
        6 => "M",
        9 => "G",
        12 => "T",
        _ => "",
    }
}

/// Typeset form: `3.96 µm`, `0.3 N·s/m`.
impl fmt::Display for Quantity {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.written(true))
    }
}

impl FromStr for Quantity {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        Self::parse(text)
    }
}

impl FromStr for Unit {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        Self::parse(text)
    }
}

/// The leading decimal number (in ASCII, ready for `f64::from_str`) and what follows it.
fn split_number(text: &str) -> Result<(String, &str), QuantityError> {
    let no_number = || QuantityError::NoNumber { found: text.to_owned() };
    let mut number = String::new();
    let mut rest = text;
    if let Some(unsigned) = rest.strip_prefix(['-', '\u{2212}']) {
        number.push('-');
        rest = unsigned;
    } else if let Some(unsigned) = rest.strip_prefix('+') {
        rest = unsigned;
    }
    let mut digits = 0;
    let mut point = false;
    let mut end = 0;
    for (at, letter) in rest.char_indices() {
        match letter {
            '0'..='9' => digits += 1,
            '_' if digits > 0 && rest[at + 1..].starts_with(|next: char| next.is_ascii_digit()) => {
                end = at + 1;
                continue;
            }
            '.' if !point => point = true,
            _ => break,
        }
        number.push(letter);
        end = at + letter.len_utf8();
    }
    if digits == 0 {
        return Err(no_number());
    }
    rest = &rest[end..];
    if let Some(fraction) = rest.strip_prefix(',')
        && fraction.starts_with(|next: char| next.is_ascii_digit())
    {
        return Err(QuantityError::DecimalComma { found: text.to_owned(), suggestion: text.replacen(',', ".", 1) });
    }
    if let Some(exponent) = rest.strip_prefix(['e', 'E']) {
        let unsigned = exponent.strip_prefix(['-', '+', '\u{2212}']).unwrap_or(exponent);
        let length = unsigned.bytes().take_while(u8::is_ascii_digit).count();
        if length > 0 {
            number.push('e');
            if exponent.starts_with(['-', '\u{2212}']) {
                number.push('-');
            }
            number.push_str(&unsigned[..length]);
            rest = &unsigned[length..];
        }
    }
    Ok((number, rest))
}
