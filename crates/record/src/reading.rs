//! Bench file: how the channels of a bench are read, stated once for all records.
//!
//! ```toml
//! [vibrometer]
//! channel = "CH2"
//! scale = "125 mm/s/V"
//! bandwidth = "1.5 MHz"
//! delay = "4.2 us"
//!
//! [horn-tip]
//! channel = "CH1"
//! scale = "2 um/V"
//! ```

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use granchain_signal::{Dimension, Quantity, QuantityError, ResponseError, read_back::read_text};

use super::{
    Choice, MaskError, Masking, ReadOptions, RecordKind, Sensitivity, SensitivityError, key_at, line_of, plain_message,
    response, sha256,
};

/// Reading options in a file; absent options are taken from the record.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reading {
    /// Column of the recorded quantity, by its header or number.
    #[serde(alias = "column")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_column: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_unit: Option<String>,
    /// Sensitivity of vibrometer or hydrophone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<String>,
    /// −6 dB bandwidth of the vibrometer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bandwidth: Option<String>,
    /// Frequency response of vibrometer or hydrophone: a filter, a table, or a file with one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub response: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delay: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trigger: Option<String>,
    /// Sample rate of rows without a time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sample_rate: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baseline: Option<String>,
    /// Treatment of missing cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub delimiter: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decimal: Option<String>,
    /// Whether the sign is inverted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub invert: Option<bool>,
    /// Whether uneven samples are interpolated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resample: Option<bool>,
    /// Function or segment, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dataset: Option<usize>,
    /// Number of shots averaged in the record.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub averages: Option<usize>,
    /// Which samples are masked: `auto`, `none`, or stretches such as `12.1us:13.4us`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<String>,
}

/// Why reading options are invalid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadingError {
    #[error("`{key}`: {source}")]
    Quantity { key: &'static str, source: QuantityError },
    #[error("`{key}`: expected a value above zero, found `{found}`")]
    NotPositive { key: &'static str, found: String },
    #[error("`scale`: {0}")]
    Scale(#[from] SensitivityError),
    #[error("`response`: {0}, which is no file either")]
    Response(#[from] ResponseError),
    #[error("`response`: {0}")]
    ResponseFile(String),
    #[error("`mask`: {0}")]
    Mask(#[from] MaskError),
    #[error("`{key}`: expected one of {expected}, found `{found}`")]
    Word { key: &'static str, expected: String, found: String },
}

fn word<C: Choice>(key: &'static str, text: &str) -> Result<C, ReadingError> {
    C::of_word(text).ok_or_else(|| ReadingError::Word {
        key,
        expected: C::WORDS.iter().map(|(word, ..)| format!("`{word}`")).collect::<Vec<_>>().join(", "),
        found: text.into(),
    })
}

fn quantity(key: &'static str, text: &str, dimension: Dimension) -> Result<f64, ReadingError> {
    Quantity::parse_as(text, dimension).map_err(|source| ReadingError::Quantity { key, source })
}

fn positive(key: &'static str, text: &str, dimension: Dimension) -> Result<f64, ReadingError> {
    let value = quantity(key, text, dimension)?;
    if value > 0.0 { Ok(value) } else { Err(ReadingError::NotPositive { key, found: text.into() }) }
}

/// `given`, else the parsed `text`.
fn or<T>(
    given: Option<T>,
    text: Option<&String>,
    parse: impl Fn(&str) -> Result<T, ReadingError>,
) -> Result<Option<T>, ReadingError> {
    match given {
        Some(given) => Ok(Some(given)),
        None => text.map(|text| parse(text)).transpose(),
    }
}

impl Reading {
    /// The options as stated, such that [`Reading::below`] the default options restores them; the drive frequency is
    /// not included.
    #[must_use]
    pub fn of(options: &ReadOptions) -> Self {
        // A choice that is the default states nothing.
        fn chosen<C: Choice + PartialEq>(choice: C) -> Option<String> {
            Some(choice).filter(|choice| *choice != C::default()).and_then(written)
        }
        fn written<C: Choice + PartialEq>(choice: C) -> Option<String> {
            C::WORDS.iter().find(|(_, of, _)| *of == choice).map(|(word, ..)| (*word).to_owned())
        }
        let si = |value: f64, dimension| Quantity::new(value, dimension).format_si();
        let hertz = |value| si(value, Dimension::FREQUENCY);
        let seconds = |value| si(value, Dimension::TIME);
        Self {
            channel: options.column.clone(),
            time_column: options.time_column.clone(),
            unit: options.unit.clone(),
            time_unit: options.time_unit.clone(),
            scale: options.scale.map(|scale| {
                format!(
                    "{}/{}",
                    si(scale.per_volt(), scale.dimension()),
                    if scale.is_of_full_scale() { "FS" } else { "V" }
                )
            }),
            range: options.range.map(|range| range.format_si()),
            bandwidth: options.bandwidth.map(hertz),
            response: options.response.as_ref().map(ToString::to_string),
            delay: options.delay.map(seconds),
            trigger: options.trigger.map(seconds),
            sample_rate: options.sample_rate.map(hertz),
            baseline: chosen(options.baseline),
            missing: chosen(options.missing),
            delimiter: options.delimiter.and_then(written),
            decimal: options.decimal.and_then(written),
            invert: options.invert.then_some(true),
            resample: options.resample.then_some(true),
            dataset: options.dataset,
            averages: options.averages,
            mask: match &options.mask {
                Masking::Auto => None,
                Masking::None => Some("none".into()),
                Masking::Stretches(stretches) => {
                    let stretch = |[from, to]: &[f64; 2]| format!("{}:{}", seconds(*from), seconds(*to));
                    Some(stretches.iter().map(stretch).collect::<Vec<_>>().join(","))
                }
            },
        }
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// `options` with their gaps filled from this reading.
    ///
    /// # Errors
    /// [`ReadingError`] with the key.
    pub fn below(&self, options: ReadOptions) -> Result<ReadOptions, ReadingError> {
        // A choice that is the default says nothing.
        fn chosen<C: Choice + PartialEq>(
            key: &'static str,
            given: C,
            text: Option<&String>,
        ) -> Result<C, ReadingError> {
            Ok(or(Some(given).filter(|given| *given != C::default()), text, |text| word(key, text))?
                .unwrap_or_default())
        }
        let range =
            |text: &str| Quantity::parse(text).map_err(|source| ReadingError::Quantity { key: "range", source });
        Ok(ReadOptions {
            time_column: options.time_column.or_else(|| self.time_column.clone()),
            column: options.column.or_else(|| self.channel.clone()),
            time_unit: options.time_unit.or_else(|| self.time_unit.clone()),
            unit: options.unit.or_else(|| self.unit.clone()),
            baseline: chosen("baseline", options.baseline, self.baseline.as_ref())?,
            invert: options.invert || self.invert.unwrap_or(false),
            bandwidth: or(options.bandwidth, self.bandwidth.as_ref(), |text| {
                positive("bandwidth", text, Dimension::FREQUENCY)
            })?,
            response: or(options.response, self.response.as_ref(), response::stated)?,
            delay: or(options.delay, self.delay.as_ref(), |text| quantity("delay", text, Dimension::TIME))?,
            trigger: or(options.trigger, self.trigger.as_ref(), |text| quantity("trigger", text, Dimension::TIME))?,
            missing: chosen("missing", options.missing, self.missing.as_ref())?,
            delimiter: or(options.delimiter, self.delimiter.as_ref(), |text| word("delimiter", text))?,
            decimal: or(options.decimal, self.decimal.as_ref(), |text| word("decimal", text))?,
            sample_rate: or(options.sample_rate, self.sample_rate.as_ref(), |text| {
                positive("sample_rate", text, Dimension::FREQUENCY)
            })?,
            scale: or(options.scale, self.scale.as_ref(), |text| Ok(Sensitivity::parse(text)?))?,
            range: or(options.range, self.range.as_ref(), range)?,
            resample: options.resample || self.resample.unwrap_or(false),
            dataset: options.dataset.or(self.dataset),
            averages: options.averages.or(self.averages),
            mask: or(Some(options.mask).filter(|mask| *mask != Masking::Auto), self.mask.as_ref(), |text| {
                Ok(text.parse::<Masking>()?)
            })?
            .unwrap_or_default(),
            drive_frequency: options.drive_frequency,
            force_frequency: options.force_frequency,
        })
    }
}

/// The channels of a bench: sensitivities, delays and bandwidths.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct BenchReadings {
    #[serde(default)]
    pub vibrometer: Reading,
    #[serde(default)]
    pub horn_tip: Reading,
    #[serde(default)]
    pub hydrophone: Reading,
    #[serde(skip)]
    pub path: PathBuf,
    /// SHA-256 of the bytes read, hexadecimal.
    #[serde(skip)]
    pub sha256: String,
}

/// Why a bench file cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchReadingsError {
    #[error("{}: the bench file cannot be read", path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error(
        "{}:{line}: {message}; a bench file has the tables [vibrometer], [horn-tip] and [hydrophone] with the keys of a [reading]",
        path.display()
    )]
    Form { path: PathBuf, line: usize, message: String },
    #[error("{}: [{table}] {source}", path.display())]
    Reading { path: PathBuf, table: &'static str, source: ReadingError },
}

impl BenchReadings {
    /// Reads a bench file and checks it.
    ///
    /// # Errors
    /// [`BenchReadingsError`] with file and line or table.
    pub fn read(path: &Path) -> Result<Self, BenchReadingsError> {
        let text = read_text(path).map_err(|source| BenchReadingsError::Unreadable { path: path.into(), source })?;
        let mut bench: Self = toml::from_str(&text).map_err(|error| BenchReadingsError::Form {
            path: path.into(),
            line: line_of(&text, error.span().map(|span| span.start)),
            message: plain_message(error.message(), key_at(&text, error.span())),
        })?;
        for kind in [RecordKind::Vibrometer, RecordKind::HornTip, RecordKind::Hydrophone] {
            let refused = |source| BenchReadingsError::Reading { path: path.into(), table: kind.name(), source };
            bench.of(kind).below(ReadOptions::default()).map_err(refused)?;
        }
        (bench.path, bench.sha256) = (path.into(), sha256(text.as_bytes()));
        Ok(bench)
    }

    /// How records of a kind are read.
    #[must_use]
    pub fn of(&self, kind: RecordKind) -> &Reading {
        match kind {
            RecordKind::Vibrometer => &self.vibrometer,
            RecordKind::HornTip => &self.horn_tip,
            RecordKind::Hydrophone => &self.hydrophone,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn what_is_asked_wins_over_what_is_stated() {
        let stated = Reading {
            channel: Some("CH2".into()),
            scale: Some("125 mm/s/V".into()),
            delay: Some("4 us".into()),
            baseline: Some("mean".into()),
            invert: Some(true),
            ..Reading::default()
        };
        let requested = ReadOptions { column: Some("CH3".into()), ..ReadOptions::default() };
        let both = stated.below(requested).unwrap();
        assert_eq!(both.column.as_deref(), Some("CH3"));
        assert_eq!((both.delay, both.invert), (Some(4e-6), true));
        assert_eq!(both.baseline, super::super::Baseline::Mean);
        assert_eq!(both.scale, Sensitivity::parse("125 mm/s/V").ok());
        for (wrong, key) in [
            (Reading { delay: Some("4 V".into()), ..Reading::default() }, "`delay`"),
            (Reading { bandwidth: Some("-1 MHz".into()), ..Reading::default() }, "`bandwidth`"),
            (Reading { decimal: Some("dot".into()), ..Reading::default() }, "`decimal`"),
            (Reading { scale: Some("3".into()), ..Reading::default() }, "`scale`"),
        ] {
            let message = wrong.below(ReadOptions::default()).unwrap_err().to_string();
            assert!(message.starts_with(key), "{message}");
        }
    }

    #[test]
    fn a_reading_gives_back_the_options_it_was_made_of() {
        use super::super::{Baseline, DecimalSign, Missing};
        let full = |scale: &str, number: f64| ReadOptions {
            time_column: Some("Time (s)".into()),
            column: Some("CH2, V".into()),
            time_unit: Some("us".into()),
            unit: Some("mm/s".into()),
            baseline: Baseline::Plateau,
            invert: true,
            bandwidth: Some(1e6 * number),
            delay: Some(-1e-6 * number),
            trigger: Some(1e-5 / number),
            missing: Missing::Interpolate,
            decimal: Some(DecimalSign::default()),
            sample_rate: Some(1e7 / number),
            scale: Some(Sensitivity::parse(scale).unwrap()),
            range: Quantity::parse("10 V").ok(),
            resample: true,
            dataset: Some(2),
            mask: Masking::Stretches(vec![[1e-6 * number, 2e-6 * number], [1e-5 * number, 1e-3 * number]]),
            ..ReadOptions::default()
        };
        let mut all = vec![ReadOptions::default(), ReadOptions { mask: Masking::None, ..ReadOptions::default() }];
        for (scale, number) in
            [("125 mm/s/V", 1.0), ("2 um/V", 4.2), ("3.7 mV/MPa", 1.0 / 3.0), ("0.37 (mm/s)/mV", std::f64::consts::PI)]
        {
            all.push(full(scale, number));
        }
        for options in all {
            let reading = Reading::of(&options);
            let text = serde_json::to_string(&reading).unwrap();
            assert!(!text.contains("null"), "{text}");
            let kept: Reading = serde_json::from_str(&text).unwrap();
            assert_eq!(kept.below(ReadOptions::default()).unwrap(), options, "{text}");
            assert_eq!(kept.is_empty(), options == ReadOptions::default());
        }
    }

    #[test]
    fn a_bench_file_is_checked_whole_and_named_by_line_or_table() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bench.toml");
        let read = |text: &str| {
            fs::write(&path, text).unwrap();
            BenchReadings::read(&path)
        };
        let bench = read("[vibrometer]\nscale = \"125 mm/s/V\"\n[horn-tip]\nchannel = \"CH1\"\n").unwrap();
        assert_eq!(bench.of(RecordKind::HornTip).channel.as_deref(), Some("CH1"));
        assert_eq!(bench.of(RecordKind::Hydrophone), &Reading::default());
        assert!(
            read("[vibrometer]\nscal = \"1\"\n").unwrap_err().to_string().contains("bench.toml:2: unknown key `scal`")
        );
        assert!(read("[horn-tip]\nscale = \"1\"\n").unwrap_err().to_string().contains("[horn-tip] `scale`"));
    }
}
