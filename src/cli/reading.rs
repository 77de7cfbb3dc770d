//! Flags that say how a record is to be read, shared by every subcommand that reads one.

use std::path::PathBuf;

use clap::Args;

use crate::{
    measurement::{BenchReadings, MeasurementError, ReadOptions, Reading, RecordKind, Sensitivity, plain_message},
    signal::{Dimension, Quantity, Unit},
};

use super::arguments::{expected, frequency, usage};

/// One `KEY=VALUE` of `--read`: a key of a bench file, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    reading: Reading,
    /// Whether it is `force_frequency=true`, which no bench file has.
    force_frequency: bool,
}

/// Value parser of `--read` and `--drive-read`.
pub fn setting(text: &str) -> Result<Setting, String> {
    let parts = text.split_once('=').map(|(key, value)| (key.trim().replace('-', "_"), value.trim()));
    let Some((key, value)) = parts.filter(|(key, value)| !key.is_empty() && !value.is_empty()) else {
        return Err(expected("KEY=VALUE such as time_unit=us or delay=4.2us", text));
    };
    if key == "force_frequency" && value == "true" {
        return Ok(Setting { reading: Reading::default(), force_frequency: true });
    }
    let value = match key.as_str() {
        "invert" | "resample" => value.parse().map(toml::Value::Boolean).ok(),
        "dataset" | "averages" => value.parse().map(toml::Value::Integer).ok(),
        _ => None,
    }
    .unwrap_or_else(|| toml::Value::String(value.into()));
    let table = toml::Table::from_iter([(key.clone(), value)]);
    let form = |error: toml::de::Error| plain_message(error.message(), Some(key.as_str()));
    let reading: Reading = table.try_into().map_err(form)?;
    reading.below(ReadOptions::default()).map_err(|error| error.to_string())?;
    Ok(Setting { reading, force_frequency: false })
}

/// `options`, and below them what settings state, the last of a key first.
fn with_settings(options: ReadOptions, settings: &[Setting]) -> ReadOptions {
    settings.iter().rev().fold(options, |options, setting| {
        // Each was checked as it was parsed.
        let mut read = setting.reading.below(options.clone()).unwrap_or(options);
        read.force_frequency |= setting.force_frequency;
        read
    })
}

/// What a file does not say about itself.
#[derive(Debug, Clone, PartialEq, Default, Args)]
pub struct ChannelArguments {
    /// Column of the recorded quantity: its header, or its number from 1
    #[arg(long, value_name = "NAME", help_heading = "Reading")]
    pub channel: Option<String>,
    /// Unit of the recorded quantity, such as mm/s [default: the file's]
    #[arg(long, value_name = "UNIT", value_parser = motion_unit, help_heading = "Reading")]
    pub unit: Option<String>,
    /// Sensitivity, for a column in volts: '100 mm/s/V', '2 um/V', '250 nV/Pa'
    #[arg(long, value_name = "QUANTITY", value_parser = Sensitivity::parse, allow_hyphen_values = true, help_heading = "Reading")]
    pub scale: Option<Sensitivity>,
    /// Sample rate, such as 5MHz: for a file without a time column, or to replace the steps of this column
    #[arg(long, value_name = "QUANTITY", value_parser = frequency, help_heading = "Reading")]
    pub sample_rate: Option<f64>,
    /// Any other reading key, such as time_unit=us, delay=4.2us, invert=true (docs/formats.md); repeatable
    #[arg(long, value_name = "KEY=VALUE", value_parser = setting, help_heading = "Reading")]
    pub read: Vec<Setting>,
}

impl ChannelArguments {
    /// The options for the reader; `drive_frequency` (Hz) where it is known.
    pub fn options(&self, drive_frequency: Option<f64>) -> ReadOptions {
        let given = ReadOptions {
            column: self.channel.clone(),
            unit: self.unit.clone(),
            scale: self.scale,
            sample_rate: self.sample_rate,
            drive_frequency,
            ..ReadOptions::default()
        };
        with_settings(given, &self.read)
    }
}

/// The same of the horn's tip, where another record is read as well. Options on the form of a file hold for the drive too if it is in the
/// same one.
#[derive(Debug, Clone, PartialEq, Default, Args)]
pub struct DriveReadArguments {
    /// Reading key of the horn's record, such as channel=CH1 or 'scale=2 um/V'; repeatable
    #[arg(long, value_name = "KEY=VALUE", value_parser = setting, help_heading = "Reading")]
    pub drive_read: Vec<Setting>,
}

impl DriveReadArguments {
    /// The options for the reader; `drive_frequency` (Hz) where it is known.
    pub fn options(&self, drive_frequency: Option<f64>) -> ReadOptions {
        with_settings(ReadOptions { drive_frequency, ..ReadOptions::default() }, &self.drive_read)
    }
}

/// How a record is to be read.
#[derive(Debug, Clone, PartialEq, Default, Args)]
pub struct ReadArguments {
    #[command(flatten)]
    pub channel: ChannelArguments,
    /// File that says how each channel is read (docs/formats.md), not what stands on the bench (--scene); flags win over it
    #[arg(long, value_name = "FILE", help_heading = "Reading")]
    pub bench: Option<PathBuf>,
}

impl ReadArguments {
    /// The options for the reader; `drive_frequency` (Hz) where it is known.
    pub fn options(&self, drive_frequency: Option<f64>) -> ReadOptions {
        self.channel.options(drive_frequency)
    }

    /// The same for a record of a known kind: what flags leave open the bench file says.
    pub fn options_of(&self, kind: RecordKind, drive_frequency: Option<f64>) -> anyhow::Result<ReadOptions> {
        self.filled(kind, self.options(drive_frequency))
    }

    /// `options`, and what they leave open as the bench file says it of this kind.
    pub fn filled(&self, kind: RecordKind, options: ReadOptions) -> anyhow::Result<ReadOptions> {
        let Some(path) = &self.bench else { return Ok(options) };
        Ok(BenchReadings::read(path)?.of(kind).below(options)?)
    }

    /// The same for a record whose kind may be left to the file.
    pub fn options_of_any(
        &self,
        kind: Option<RecordKind>,
        drive_frequency: Option<f64>,
    ) -> anyhow::Result<ReadOptions> {
        match (kind, &self.bench) {
            (Some(kind), _) => self.options_of(kind, drive_frequency),
            (None, None) => Ok(self.options(drive_frequency)),
            (None, Some(_)) => Err(usage("--bench has a reading for each kind of record: state the kind with --kind")),
        }
    }
}

/// Why the record of a drive cannot be used, where the flags of its reading are those with `drive-`.
#[derive(Debug, thiserror::Error)]
#[error("{}", Self::of_drive(&.0.to_string()))]
pub struct DriveUnread(pub MeasurementError);

impl DriveUnread {
    /// `text` with the drive's flags in place of the record's.
    pub fn of_drive(text: &str) -> String {
        // A value follows; else the flag is only spoken of.
        let is_value = |letter: char| letter.is_ascii_uppercase() || letter.is_ascii_digit() || "'<".contains(letter);
        Self::with_drive_flags(text, |rest| rest.starts_with(is_value))
    }

    /// The same of flags to type, each with its value.
    pub fn flags_of_drive(flags: &str) -> String {
        Self::with_drive_flags(flags, |_| true)
    }

    fn with_drive_flags(text: &str, is_value: impl Fn(&str) -> bool) -> String {
        let flags =
            [("--channel", "channel"), ("--scale", "scale"), ("--unit", "unit"), ("--sample-rate", "sample_rate")];
        let mut written = text.replace("--read ", "--drive-read ");
        for (flag, key) in flags {
            let mut parts = written.split(flag);
            let mut with_key = parts.next().unwrap_or_default().to_owned();
            for part in parts {
                let value = part.strip_prefix(' ').filter(|rest| is_value(rest));
                with_key.push_str("--drive-read ");
                with_key.push_str(key);
                with_key.push_str(&value.map_or_else(|| part.to_owned(), |value| format!("={value}")));
            }
            written = with_key;
        }
        written
    }
}

fn motion_unit(text: &str) -> Result<String, String> {
    match Unit::parse(text).map_err(|error| error.to_string())?.dimension {
        // Volts without --scale are refused where the record is read.
        Dimension::VELOCITY | Dimension::LENGTH | Dimension::PRESSURE | Dimension::VOLTAGE => Ok(text.into()),
        found => Err(format!(
            "expected the unit of a velocity such as `mm/s`, a length such as `um` or a pressure such as `kPa`, found that of {}",
            found.describe()
        )),
    }
}

/// A quantity for people, in four digits.
pub fn shown(value: f64, dimension: Dimension) -> String {
    let rounded = format!("{value:.3e}").parse().unwrap_or(value);
    Quantity::new(rounded, dimension).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_of_a_drive_are_named_as_they_are_typed() {
        let text = "choose one with --channel; pass --read time_unit=us, --channel 'CH1 (V)' --scale '<VALUE> um/V', --drive-frequency or \
                    --sample-rate RATE -- or not";
        assert_eq!(
            DriveUnread::of_drive(text),
            "choose one with --drive-read channel; pass --drive-read time_unit=us, --drive-read channel='CH1 (V)' --drive-read scale='<VALUE> um/V', \
             --drive-frequency or --drive-read sample_rate=RATE -- or not"
        );
    }

    #[test]
    fn settings_are_keys_of_a_bench_file_and_the_last_of_a_key_holds() {
        let read = ["delay=4us", "delay=5us", "invert=true", "time-unit=ms", "force_frequency=true"].map(setting);
        let channel = ChannelArguments { read: read.into_iter().flatten().collect(), ..ChannelArguments::default() };
        let options = channel.options(None);
        assert_eq!((options.delay, options.invert, options.force_frequency), (Some(5e-6), true, true));
        assert_eq!(options.time_unit.as_deref(), Some("ms"));
        for (wrong, what) in [
            ("delay", "expected KEY=VALUE"),
            ("colour=red", "expected one of"),
            ("delay=4V", "`delay`"),
            ("invert=yes", "boolean"),
        ] {
            let error = setting(wrong).unwrap_err();
            assert!(error.contains(what), "{wrong}: {error}");
        }
    }
}
