//! Flags that say how a record is to be read, shared by every subcommand that reads one.

use std::{fmt, path::PathBuf};

use clap::{
    Args,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};

use crate::{
    measurement::{
        Baseline, BenchReadings, Choice, DecimalSign, Delimiter, MaskError, Masking, MeasurementError, Missing,
        ReadOptions, RecordKind, Sensitivity, SensitivityError,
    },
    signal::{Dimension, Quantity, QuantityError, Unit},
};

use super::arguments::{frequency, time, usage};

/// The flags of one channel, each behind a prefix.
macro_rules! channel_arguments {
    ($(#[$about:meta])* $name:ident, $prefix:literal, $heading:literal) => {
        $(#[$about])*
        #[derive(Debug, Clone, PartialEq, Default, Args)]
        pub struct $name {
            /// Column of the recorded quantity: its header, or its number from 1
            #[arg(id = concat!($prefix, "column"), long = concat!($prefix, "column"), visible_alias = concat!($prefix, "channel"),
                value_name = "NAME", help_heading = $heading)]
            pub column: Option<String>,
            /// Column of time: its header, or its number from 1
            #[arg(id = concat!($prefix, "time-column"), long = concat!($prefix, "time-column"), value_name = "NAME", help_heading = $heading)]
            pub time_column: Option<String>,
            /// Unit of the recorded quantity, such as mm/s; overrides the file
            #[arg(id = concat!($prefix, "unit"), long = concat!($prefix, "unit"), value_name = "UNIT", value_parser = motion_unit,
                help_heading = $heading)]
            pub unit: Option<String>,
            /// Unit of time, such as us; overrides the file
            #[arg(id = concat!($prefix, "time-unit"), long = concat!($prefix, "time-unit"), value_name = "UNIT", value_parser = time_unit,
                help_heading = $heading)]
            pub time_unit: Option<String>,
            /// Which offset is removed
            #[arg(id = concat!($prefix, "baseline"), long = concat!($prefix, "baseline"), value_parser = choice::<Baseline>(),
                default_value = "auto", help_heading = $heading)]
            pub baseline: Baseline,
            /// Turn the sign: positive must be from piston to support
            #[arg(id = concat!($prefix, "invert"), long = concat!($prefix, "invert"), help_heading = $heading)]
            pub invert: bool,
            /// −6 dB bandwidth of the decoder, such as 1.5MHz
            #[arg(id = concat!($prefix, "bandwidth"), long = concat!($prefix, "bandwidth"), value_name = "QUANTITY", value_parser = frequency,
                help_heading = $heading)]
            pub bandwidth: Option<f64>,
            /// Delay of the decoder, such as 4.2us: the record shows the motion that much later
            #[arg(id = concat!($prefix, "delay"), long = concat!($prefix, "delay"), value_name = "QUANTITY", value_parser = time,
                allow_hyphen_values = true, help_heading = $heading)]
            pub delay: Option<f64>,
            /// Instant of the trigger on the file's time axis, such as 50us; it becomes t = 0
            #[arg(id = concat!($prefix, "trigger"), long = concat!($prefix, "trigger"), value_name = "QUANTITY", value_parser = time,
                allow_hyphen_values = true, help_heading = $heading)]
            pub trigger: Option<f64>,
            /// What is done about cells such as n/a
            #[arg(id = concat!($prefix, "missing"), long = concat!($prefix, "missing"), value_parser = choice::<Missing>(),
                default_value = "refuse", help_heading = $heading)]
            pub missing: Missing,
            /// What separates the values [default: as the rows show]
            #[arg(id = concat!($prefix, "delimiter"), long = concat!($prefix, "delimiter"), value_parser = choice::<Delimiter>(),
                help_heading = $heading)]
            pub delimiter: Option<Delimiter>,
            /// How decimals are written [default: as the rows show]
            #[arg(id = concat!($prefix, "decimal"), long = concat!($prefix, "decimal"), value_parser = choice::<DecimalSign>(),
                help_heading = $heading)]
            pub decimal: Option<DecimalSign>,
            /// Sample rate of a file without a column of time, such as 5MHz; it wins over a column of time
            #[arg(id = concat!($prefix, "sample-rate"), long = concat!($prefix, "sample-rate"), value_name = "QUANTITY",
                value_parser = frequency, help_heading = $heading)]
            pub sample_rate: Option<f64>,
            /// Sensitivity of decoder or hydrophone, for a column in volts: '100 mm/s/V', '2 um/V', '250 nV/Pa', '20 kPa/V'
            #[arg(id = concat!($prefix, "scale"), long = concat!($prefix, "scale"), value_name = "QUANTITY", value_parser = sensitivity,
                help_heading = $heading)]
            pub scale: Option<Sensitivity>,
            /// Full-scale value of decoder or hydrophone, such as 1m/s or 2MPa, or 10V with a sensitivity
            #[arg(id = concat!($prefix, "range"), long = concat!($prefix, "range"), value_name = "QUANTITY", value_parser = range,
                help_heading = $heading)]
            pub range: Option<Quantity>,
            /// Interpolate uneven samples onto an even grid
            #[arg(id = concat!($prefix, "resample"), long = concat!($prefix, "resample"), help_heading = $heading)]
            pub resample: bool,
            /// Function of a universal file, or segment of a file with several; from 1
            #[arg(id = concat!($prefix, "dataset"), long = concat!($prefix, "dataset"), value_name = "N", help_heading = $heading)]
            pub dataset: Option<usize>,
            /// Number of shots that the record is the mean of, as an oscilloscope stores that averages
            #[arg(id = concat!($prefix, "averages"), long = concat!($prefix, "averages"), value_name = "N", help_heading = $heading,
                value_parser = clap::value_parser!(u32).range(1..=100_000))]
            pub averages: Option<u32>,
            /// Samples that are masked: auto, none, or stretches of the file's time axis such as 12.1us:13.4us,50us:51us
            #[arg(id = concat!($prefix, "mask"), long = concat!($prefix, "mask"), value_name = "STRETCHES", default_value = "auto",
                value_parser = mask, help_heading = $heading)]
            pub mask: Masking,
        }

        impl $name {
            /// The options for the reader; `drive_frequency` (Hz) where it is known.
            #[must_use]
            pub fn options(&self, drive_frequency: Option<f64>, force_frequency: bool) -> ReadOptions {
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
                    force_frequency,
                    missing: self.missing,
                    delimiter: self.delimiter,
                    decimal: self.decimal,
                    sample_rate: self.sample_rate,
                    scale: self.scale,
                    range: self.range,
                    resample: self.resample,
                    dataset: self.dataset,
                    mask: self.mask.clone(),
                    averages: self.averages.map(|count| count as usize),
                }
            }
        }
    };
}

channel_arguments! {
    /// `--column`, `--unit`, `--baseline`, …: what the file does not say about itself.
    ChannelArguments, "", "Reading"
}

channel_arguments! {
    /// `--drive-channel`, `--drive-scale`, …: the same of the horn's tip, where another record is read as well. What is said of the form of a
    /// file holds for the drive too where it stands in the same one.
    DriveReadArguments, "drive-", "Reading of the drive"
}

/// How a record is to be read.
#[derive(Debug, Clone, PartialEq, Default, Args)]
pub struct ReadArguments {
    /// Its channel.
    #[command(flatten)]
    pub channel: ChannelArguments,
    /// Bench file with sensitivities, delays, bandwidths of all channels, typed once (docs/formats.md); flags win over it
    #[arg(long, value_name = "FILE", help_heading = "Reading")]
    pub bench: Option<PathBuf>,
    /// Take the drive frequency as stated, though the strongest line of the horn's record is another
    #[arg(long, help_heading = "Reading")]
    pub force_frequency: bool,
}

impl ReadArguments {
    /// The options for the reader; `drive_frequency` (Hz) where it is known.
    #[must_use]
    pub fn options(&self, drive_frequency: Option<f64>) -> ReadOptions {
        self.channel.options(drive_frequency, self.force_frequency)
    }

    /// The same for a record of a known kind: what flags leave open the bench file says.
    ///
    /// # Errors
    /// When the bench file cannot be used.
    pub fn options_of(&self, kind: RecordKind, drive_frequency: Option<f64>) -> anyhow::Result<ReadOptions> {
        self.filled(kind, self.options(drive_frequency))
    }

    /// `options`, and what they leave open as the bench file says it of this kind.
    ///
    /// # Errors
    /// When the bench file cannot be used.
    pub fn filled(&self, kind: RecordKind, options: ReadOptions) -> anyhow::Result<ReadOptions> {
        let Some(path) = &self.bench else { return Ok(options) };
        Ok(BenchReadings::read(path)?.of(kind).below(options)?)
    }

    /// The same for a record whose kind may be left to the file.
    ///
    /// # Errors
    /// A usage error for a bench file without a kind; when the bench file cannot be used.
    pub fn options_of_any(
        &self,
        kind: Option<RecordKind>,
        drive_frequency: Option<f64>,
    ) -> anyhow::Result<ReadOptions> {
        match (kind, &self.bench) {
            (Some(kind), _) => self.options_of(kind, drive_frequency),
            (None, None) => Ok(self.options(drive_frequency)),
            (None, Some(_)) => Err(usage("--bench says how each kind of record is read: name this one's with --kind")),
        }
    }
}

/// Why the record of a drive cannot be used, where the flags of its reading are those with `drive-`.
#[derive(Debug)]
pub struct DriveUnread(pub MeasurementError);

impl DriveUnread {
    /// `text` with the drive's flags in place of the record's.
    pub fn of_drive(text: &str) -> String {
        let command = DriveReadArguments::augment_args(clap::Command::new(""));
        let flags: Vec<String> = command.get_arguments().filter_map(|it| it.get_long().map(str::to_owned)).collect();
        let mut parts = text.split("--");
        let mut written = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let name: String =
                part.chars().take_while(|letter| letter.is_ascii_lowercase() || *letter == '-').collect();
            let of_drive = format!("drive-{name}");
            written.push_str(if flags.contains(&of_drive) { "--drive-" } else { "--" });
            written.push_str(part);
        }
        written
    }
}

impl fmt::Display for DriveUnread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&Self::of_drive(&self.0.to_string()))
    }
}

impl std::error::Error for DriveUnread {}

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

fn mask(text: &str) -> Result<Masking, MaskError> {
    text.parse()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_of_a_drive_are_named_as_they_are_typed() {
        let text = "choose one with --column; pass --time-unit us, --drive-frequency or --sample-rate 1MHz -- or not";
        assert_eq!(
            DriveUnread::of_drive(text),
            "choose one with --drive-column; pass --drive-time-unit us, --drive-frequency or --drive-sample-rate 1MHz -- or not"
        );
    }
}
