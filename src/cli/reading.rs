//! Flags that say how a record is to be read, shared by every subcommand that reads one.

use clap::{
    Args,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};

use crate::{
    measurement::{Baseline, Choice, DecimalSign, Delimiter, Missing, ReadOptions, Sensitivity, SensitivityError},
    signal::{Dimension, Quantity, QuantityError, Unit},
};

use super::arguments::{frequency, time};

/// `--column`, `--unit`, `--baseline`, …: what the file does not say about itself.
#[derive(Debug, Clone, PartialEq, Default, Args)]
pub struct ReadArguments {
    /// Column of the recorded quantity: its header, or its number from 1
    #[arg(long, value_name = "NAME", help_heading = "Reading")]
    pub column: Option<String>,
    /// Column of time: its header, or its number from 1
    #[arg(long, value_name = "NAME", help_heading = "Reading")]
    pub time_column: Option<String>,
    /// Unit of the recorded quantity, such as mm/s; overrides the file
    #[arg(long, value_name = "UNIT", value_parser = motion_unit, help_heading = "Reading")]
    pub unit: Option<String>,
    /// Unit of time, such as us; overrides the file
    #[arg(long, value_name = "UNIT", value_parser = time_unit, help_heading = "Reading")]
    pub time_unit: Option<String>,
    /// Which offset is removed
    #[arg(long, value_parser = choice::<Baseline>(), default_value = "auto", help_heading = "Reading")]
    pub baseline: Baseline,
    /// Turn the sign: positive must be from piston to support
    #[arg(long, help_heading = "Reading")]
    pub invert: bool,
    /// −6 dB bandwidth of the decoder, such as 1.5MHz
    #[arg(long, value_name = "QUANTITY", value_parser = frequency, help_heading = "Reading")]
    pub bandwidth: Option<f64>,
    /// Delay of the decoder, such as 4.2us: the record shows the motion that much later
    #[arg(long, value_name = "QUANTITY", value_parser = time, allow_hyphen_values = true, help_heading = "Reading")]
    pub delay: Option<f64>,
    /// Instant of the trigger on the file's time axis, such as 50us; it becomes t = 0
    #[arg(long, value_name = "QUANTITY", value_parser = time, allow_hyphen_values = true, help_heading = "Reading")]
    pub trigger: Option<f64>,
    /// Take the drive frequency as stated, though the strongest line of the horn's record is another
    #[arg(long, help_heading = "Reading")]
    pub force_frequency: bool,
    /// What is done about cells such as n/a
    #[arg(long, value_parser = choice::<Missing>(), default_value = "refuse", help_heading = "Reading")]
    pub missing: Missing,
    /// What separates the values [default: told from the rows]
    #[arg(long, value_parser = choice::<Delimiter>(), help_heading = "Reading")]
    pub delimiter: Option<Delimiter>,
    /// How decimals are written [default: told from the rows]
    #[arg(long, value_parser = choice::<DecimalSign>(), help_heading = "Reading")]
    pub decimal: Option<DecimalSign>,
    /// Sample rate of a file without a column of time, such as 5MHz
    #[arg(long, value_name = "QUANTITY", value_parser = frequency, help_heading = "Reading")]
    pub sample_rate: Option<f64>,
    /// Sensitivity of decoder or hydrophone, for a column in volts: '100 mm/s/V', '2 um/V', '250 nV/Pa', '20 kPa/V'
    #[arg(long, value_name = "QUANTITY", value_parser = sensitivity, help_heading = "Reading")]
    pub scale: Option<Sensitivity>,
    /// Full-scale value of decoder or hydrophone, such as 1m/s or 2MPa, or 10V with --scale
    #[arg(long, value_name = "QUANTITY", value_parser = range, help_heading = "Reading")]
    pub range: Option<Quantity>,
    /// Interpolate uneven samples onto an even grid
    #[arg(long, help_heading = "Reading")]
    pub resample: bool,
    /// Function of a universal file, or segment of a file with several; from 1
    #[arg(long, value_name = "N", help_heading = "Reading")]
    pub dataset: Option<usize>,
}

impl ReadArguments {
    /// The options for the reader; `drive_frequency` (Hz) where it is known.
    #[must_use]
    pub fn options(&self, drive_frequency: Option<f64>) -> ReadOptions {
        ReadOptions {
            time_column: self.time_column.clone(),
            column: self.column.clone(),
            time_unit: self.time_unit.clone(),
            unit: self.unit.clone(),
            baseline: self.baseline,
            invert: self.invert,
            bandwidth: self.bandwidth,
            delay: self.delay,
            trigger: self.trigger,
            drive_frequency,
            force_frequency: self.force_frequency,
            missing: self.missing,
            delimiter: self.delimiter,
            decimal: self.decimal,
            sample_rate: self.sample_rate,
            scale: self.scale,
            range: self.range,
            resample: self.resample,
            dataset: self.dataset,
        }
    }
}

/// A parser of the words of a choice; `--help` says what each means.
fn choice<C: Choice>() -> impl TypedValueParser<Value = C> {
    let values = C::WORDS.iter().map(|(word, _, meaning)| PossibleValue::new(*word).help(meaning.trim()));
    PossibleValuesParser::new(values).map(|word| C::of_word(&word).unwrap_or_default())
}

/// Why a unit flag is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UnitError {
    /// No unit.
    #[error(transparent)]
    Unknown(#[from] QuantityError),
    /// A unit of something else.
    #[error("expected the unit of {expected}, found that of {}", found.describe())]
    Dimension {
        /// What is needed.
        expected: &'static str,
        /// What was given.
        found: Dimension,
    },
    /// Not above zero.
    #[error("expected a range above zero, found `{found}`")]
    NotPositive {
        /// The text.
        found: String,
    },
}

fn time_unit(text: &str) -> Result<String, UnitError> {
    match Unit::parse(text)?.dimension {
        Dimension::TIME => Ok(text.into()),
        found => Err(UnitError::Dimension { expected: "a time such as `us`", found }),
    }
}

fn motion_unit(text: &str) -> Result<String, UnitError> {
    match Unit::parse(text)?.dimension {
        // Volts without --scale are refused where the record is read.
        Dimension::VELOCITY | Dimension::LENGTH | Dimension::PRESSURE | Dimension::VOLTAGE => Ok(text.into()),
        found => Err(UnitError::Dimension {
            expected: "a velocity such as `mm/s`, a length such as `um` or a pressure such as `kPa`",
            found,
        }),
    }
}

fn sensitivity(text: &str) -> Result<Sensitivity, SensitivityError> {
    Sensitivity::parse(text)
}

fn range(text: &str) -> Result<Quantity, UnitError> {
    let quantity = Quantity::parse(text)?;
    match quantity.dimension {
        Dimension::VELOCITY | Dimension::LENGTH | Dimension::PRESSURE | Dimension::VOLTAGE if quantity.value > 0.0 => {
            Ok(quantity)
        }
        Dimension::VELOCITY | Dimension::LENGTH | Dimension::PRESSURE | Dimension::VOLTAGE => {
            Err(UnitError::NotPositive { found: text.into() })
        }
        found => Err(UnitError::Dimension { expected: "a range such as `1 m/s`, `50 um` or `10 V`", found }),
    }
}

/// A quantity for people, in four digits.
#[must_use]
pub fn shown(value: f64, dimension: Dimension) -> String {
    let rounded = format!("{value:.3e}").parse().unwrap_or(value);
    Quantity::new(rounded, dimension).to_string()
}
