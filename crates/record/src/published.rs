//! Features that were published without a waveform: values with uncertainty, lines present or absent, orderings of lines.
//!
//! ```toml
//! title = "Last bead on an annulus"
//! source = "where the numbers are printed"
//! drive_frequency = "73 kHz"
//!
//! [[case]]                      # simulations printed beside the measurement, shown in reports
//! name = "linear"
//! title = "linear dampers, amplitude scale 0.5"
//!
//! [[feature]]
//! name = "positive_peak"        # positive_peak, negative_peak, amplitude_1/3, ratio_1/3, thd
//! value = "289 mm/s"
//! uncertainty = "3 mm/s"        # standard uncertainty; may be left out where none is printed
//! case.linear = "296 mm/s"
//!
//! [[feature]]
//! name = "line_1/3"             # line_P/Q: the line at P/Q of the drive
//! present = true
//!
//! [[feature]]
//! name = "thirds"               # any name
//! ordering = "1/3 > 1/2"        # amplitudes of the lines
//! case.linear = true            # whether it holds there
//! ```

mod error;

use std::{
    collections::BTreeMap,
    ops::Range,
    path::{Path, PathBuf},
};

use serde::Deserialize;
use toml::Spanned;

use granchain_signal::{Dimension, Quantity, feature::Ratio};

use super::{MeasurementError, line_of, read::read_file, sha256};

pub use error::PublishedError;

/// Published features of one measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct PublishedFeatures {
    pub path: PathBuf,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
    pub title: String,
    pub source: String,
    pub drive_frequency: f64,
    pub cases: Vec<PublishedCase>,
    /// Statements, in the file's order.
    pub features: Vec<PublishedFeature>,
}

/// A simulation printed beside the measurement.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PublishedCase {
    /// Key of its values in [`PublishedFeature::cases`].
    pub name: String,
    pub title: String,
}

#[derive(Debug, Clone, PartialEq)]
pub struct PublishedFeature {
    /// `positive_peak`, `negative_peak`, `amplitude_P/Q`, `ratio_P/Q`, `thd`, `line_P/Q`, or any name for an ordering.
    pub name: String,
    pub statement: Statement,
    /// Values in the printed simulations, by [`PublishedCase::name`].
    pub cases: BTreeMap<String, Statement>,
    pub note: Option<String>,
}

/// Quantity of a published value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PublishedQuantity {
    PositivePeak,
    NegativePeak,
    Amplitude(Ratio),
    /// Ratio of a line to the line at the drive.
    Ratio(Ratio),
    Distortion,
}

impl PublishedQuantity {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "positive_peak" => Self::PositivePeak,
            "negative_peak" => Self::NegativePeak,
            "thd" => Self::Distortion,
            _ => match name.split_once('_')? {
                ("amplitude", line) => Self::Amplitude(ratio(line)?),
                ("ratio", line) => Self::Ratio(ratio(line)?),
                _ => return None,
            },
        })
    }

    /// A velocity, or a pure number.
    #[must_use]
    pub fn dimension(self) -> Dimension {
        match self {
            Self::PositivePeak | Self::NegativePeak | Self::Amplitude(_) => Dimension::VELOCITY,
            Self::Ratio(_) | Self::Distortion => Dimension::NONE,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Statement {
    Value {
        quantity: PublishedQuantity,
        value: f64,
        /// Its standard uncertainty, SI, where printed.
        uncertainty: Option<f64>,
        /// Half a unit in its last printed digit, SI: used if no uncertainty is printed.
        rounding: f64,
    },
    /// The line at this fraction of the drive is present, or is not.
    Line { ratio: Ratio, present: bool },
    /// One line is stronger than another, or (in a printed simulation) is not.
    Ordering { stronger: Ratio, weaker: Ratio, holds: bool },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    title: String,
    #[serde(default)]
    source: String,
    drive_frequency: Spanned<Cell>,
    #[serde(default)]
    case: Vec<Case>,
    #[serde(default)]
    feature: Vec<Spanned<Feature>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    name: String,
    #[serde(default)]
    title: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Feature {
    name: Spanned<String>,
    value: Option<Spanned<Cell>>,
    uncertainty: Option<Spanned<Cell>>,
    unit: Option<String>,
    present: Option<bool>,
    ordering: Option<Spanned<String>>,
    #[serde(default)]
    case: BTreeMap<String, Spanned<Cell>>,
    note: Option<String>,
}

#[derive(Deserialize, Clone)]
#[serde(untagged)]
enum Cell {
    Holds(bool),
    Number(f64),
    Text(String),
}

impl Cell {
    fn shown(&self) -> String {
        match self {
            Self::Holds(holds) => holds.to_string(),
            Self::Number(number) => number.to_string(),
            Self::Text(text) => format!("\"{text}\""),
        }
    }
}

/// `P` or `P/Q` in positive whole numbers.
fn ratio(text: &str) -> Option<Ratio> {
    let whole = |text: &str| text.parse().ok().filter(|n| *n > 0);
    let (p, q) = text.split_once('/').unwrap_or((text, "1"));
    Some(Ratio::new(whole(p)?, whole(q)?))
}

impl PublishedFeatures {
    /// Read a TOML file of published features.
    ///
    /// # Errors
    /// [`PublishedError`] with file and line.
    pub fn read(path: &Path) -> Result<Self, PublishedError> {
        Self::from_bytes(path, &read_file(path, |_, _| Ok(()))?)
    }

    /// Read from bytes already in memory; `path` names them in messages.
    ///
    /// # Errors
    /// [`PublishedError`] with file and line.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, PublishedError> {
        let text = std::str::from_utf8(bytes).map_err(|error| {
            let byte = bytes[error.valid_up_to()];
            MeasurementError::NotUtf8 { place: super::Place::file(path), byte }
        })?;
        let reader = Reader { path, text };
        let file: File = toml::from_str(text).map_err(|error| {
            let (line, column) = reader.position(error.span().unwrap_or(0..0));
            PublishedError::Form { path: path.into(), line, column, message: error.message().into() }
        })?;
        if file.feature.is_empty() {
            return Err(PublishedError::NoFeature { path: path.into() });
        }
        let drive_frequency = reader.quantity("drive_frequency", &file.drive_frequency, None, Dimension::FREQUENCY)?;
        let cases: Vec<_> =
            file.case.into_iter().map(|case| PublishedCase { name: case.name, title: case.title }).collect();
        let mut features: Vec<PublishedFeature> = Vec::with_capacity(file.feature.len());
        for feature in &file.feature {
            let line = reader.position(feature.as_ref().name.span()).0;
            let feature = reader.feature(feature.as_ref(), line, &cases)?;
            if features.iter().any(|other| other.name == feature.name) {
                return Err(PublishedError::Repeated { path: path.into(), line, name: feature.name });
            }
            features.push(feature);
        }
        Ok(Self {
            path: path.into(),
            sha256: sha256(bytes),
            title: file.title,
            source: file.source,
            drive_frequency,
            cases,
            features,
        })
    }

    /// The feature of that name.
    #[must_use]
    pub fn feature(&self, name: &str) -> Option<&PublishedFeature> {
        self.features.iter().find(|feature| feature.name == name)
    }

    /// The value of the feature of that name, SI, if one is printed.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        match self.feature(name)?.statement {
            Statement::Value { value, .. } => Some(value),
            _ => None,
        }
    }
}

struct Reader<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Reader<'_> {
    fn position(&self, span: Range<usize>) -> (usize, usize) {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        (line_of(self.text, Some(span.start)), before[line_start..].chars().count() + 1)
    }

    fn quantity(
        &self,
        name: &str,
        cell: &Spanned<Cell>,
        unit: Option<&str>,
        dimension: Dimension,
    ) -> Result<f64, PublishedError> {
        let line = self.position(cell.span()).0;
        let text = match (cell.as_ref(), unit) {
            (Cell::Number(number), Some(unit)) => format!("{number:e} {unit}"),
            (Cell::Number(number), None) => format!("{number:e}"),
            (Cell::Text(text), _) => text.clone(),
            (Cell::Holds(_), _) => {
                return Err(self.statement(line, name, "a quantity such as \"289 mm/s\"", cell.as_ref().shown()));
            }
        };
        Quantity::parse_as(&text, dimension).map_err(|source| PublishedError::Quantity {
            path: self.path.into(),
            line,
            name: name.into(),
            source,
        })
    }

    /// Half a unit in the last digit of a value as written in the file, SI: 0.5 mm/s for `289 mm/s`, 0.05 for `0.3`.
    fn rounding(
        &self,
        name: &str,
        cell: &Spanned<Cell>,
        unit: Option<&str>,
        dimension: Dimension,
    ) -> Result<f64, PublishedError> {
        let written = self.text.get(cell.span()).unwrap_or_default().trim_matches(['"', '\'']).trim();
        let end = written
            .char_indices()
            .take_while(|(at, letter)| {
                let exponent = matches!(letter, 'e' | 'E')
                    && written[at + 1..].starts_with(|next: char| next.is_ascii_digit() || "+-".contains(next));
                letter.is_ascii_digit() || ".+-_−".contains(*letter) || exponent
            })
            .last()
            .map_or(0, |(at, letter)| at + letter.len_utf8());
        let (number, rest) = written.split_at(end);
        let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
        let decimals = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len() as i32);
        let exponent: i32 = exponent.parse().unwrap_or(0);
        let half = 0.5 * 10f64.powi(exponent - decimals);
        let unit = unit.filter(|_| matches!(cell.as_ref(), Cell::Number(_))).unwrap_or(rest);
        let text = Spanned::new(cell.span(), Cell::Text(format!("{half:e} {unit}")));
        self.quantity(name, &text, None, dimension)
    }

    fn statement(&self, line: usize, name: &str, expected: &'static str, found: String) -> PublishedError {
        PublishedError::Statement { path: self.path.into(), line, name: name.into(), expected, found }
    }

    fn feature(
        &self,
        feature: &Feature,
        line: usize,
        cases: &[PublishedCase],
    ) -> Result<PublishedFeature, PublishedError> {
        let name = feature.name.as_ref().as_str();
        let statement = match (&feature.value, feature.present, &feature.ordering) {
            (Some(value), None, None) => {
                let quantity = self.quantity_named(name, line)?;
                let dimension = quantity.dimension();
                let unit = feature.unit.as_deref();
                let uncertainty =
                    feature.uncertainty.as_ref().map(|u| self.quantity(name, u, unit, dimension)).transpose()?;
                if let Some(bad) = uncertainty.filter(|u| *u <= 0.0) {
                    return Err(self.statement(line, name, "a positive uncertainty", format!("{bad}")));
                }
                let at = self.position(value.span()).0;
                let cell = value;
                let value = self.quantity(name, cell, unit, dimension)?;
                let rounding = self.rounding(name, cell, unit, dimension)?;
                if name == "negative_peak" && value >= 0.0 {
                    let expected = "a value below 0 (positive is from piston to support)";
                    return Err(self.statement(at, name, expected, format!("{value}")));
                }
                if name != "negative_peak" && value <= 0.0 {
                    return Err(self.statement(at, name, "a value above 0", format!("{value}")));
                }
                Statement::Value { quantity, value, uncertainty, rounding }
            }
            (None, Some(present), None) => match name.strip_prefix("line_").and_then(ratio) {
                Some(ratio) => Statement::Line { ratio, present },
                None => {
                    let expected = "a name such as `line_1/3` for a line that is present or absent";
                    return Err(self.statement(line, name, expected, format!("`{name}`")));
                }
            },
            (None, None, Some(ordering)) => {
                let parts = ordering.as_ref().split_once('>').map(|(a, b)| (a.trim(), b.trim()));
                match parts.and_then(|(a, b)| Some((ratio(a)?, ratio(b)?))) {
                    Some((stronger, weaker)) => Statement::Ordering { stronger, weaker, holds: true },
                    None => {
                        let line = self.position(ordering.span()).0;
                        let expected = "two lines such as \"1/3 > 1/2\"";
                        return Err(self.statement(line, name, expected, format!("\"{}\"", ordering.as_ref())));
                    }
                }
            }
            (value, present, ordering) => {
                let given: Vec<_> = [
                    value.is_some().then_some("value"),
                    present.is_some().then_some("present"),
                    ordering.is_some().then_some("ordering"),
                ]
                .into_iter()
                .flatten()
                .collect();
                let found = if given.is_empty() { "none of them".into() } else { given.join(" and ") };
                return Err(self.statement(line, name, "one of value, present, ordering", found));
            }
        };
        let mut printed = BTreeMap::new();
        for (case, cell) in &feature.case {
            let line = self.position(cell.span()).0;
            if !cases.iter().any(|known| known.name == *case) {
                let (feature, case) = (name.into(), case.clone());
                return Err(PublishedError::UnknownCase { path: self.path.into(), line, feature, case });
            }
            let given = match (statement, cell.as_ref()) {
                (Statement::Value { quantity, .. }, _) => Statement::Value {
                    quantity,
                    value: self.quantity(name, cell, feature.unit.as_deref(), quantity.dimension())?,
                    uncertainty: None,
                    rounding: self.rounding(name, cell, feature.unit.as_deref(), quantity.dimension())?,
                },
                (Statement::Line { ratio, .. }, Cell::Holds(present)) => Statement::Line { ratio, present: *present },
                (Statement::Ordering { stronger, weaker, .. }, Cell::Holds(holds)) => {
                    Statement::Ordering { stronger, weaker, holds: *holds }
                }
                (_, cell) => return Err(self.statement(line, name, "true or false", cell.shown())),
            };
            printed.insert(case.clone(), given);
        }
        Ok(PublishedFeature { name: name.into(), statement, cases: printed, note: feature.note.clone() })
    }

    fn quantity_named(&self, name: &str, line: usize) -> Result<PublishedQuantity, PublishedError> {
        if let Some(quantity) = PublishedQuantity::named(name) {
            return Ok(quantity);
        }
        let nearest = ["positive_peak", "negative_peak", "thd", "amplitude_1/3", "ratio_1/3", "line_1/3"]
            .into_iter()
            .map(|known| (strsim::jaro_winkler(known, name), known))
            .filter(|(likeness, _)| *likeness > 0.75)
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, known)| known.to_owned());
        Err(PublishedError::UnknownFeature { path: self.path.into(), line, name: name.into(), nearest })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"
title = "t"
drive_frequency = "73 kHz"
[[case]]
name = "linear"
[[feature]]
name = "positive_peak"
value = "289 mm/s"
uncertainty = "3 mm/s"
case.linear = "296 mm/s"
[[feature]]
name = "negative_peak"
value = -247
unit = "mm/s"
[[feature]]
name = "line_2/3"
present = true
case.linear = true
[[feature]]
name = "thirds"
ordering = "1/3 > 1/2"
case.linear = false
"#;

    fn read(text: &str) -> Result<PublishedFeatures, PublishedError> {
        PublishedFeatures::from_bytes(Path::new("features.toml"), text.as_bytes())
    }

    fn message(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn values_lines_and_orderings_are_read() {
        let published = read(GOOD).unwrap();
        assert_eq!(published.drive_frequency, 73e3);
        assert_eq!(published.value("positive_peak"), Some(0.289));
        assert_eq!(published.value("negative_peak"), Some(-0.247));
        let peak = published.feature("positive_peak").unwrap();
        assert!(matches!(peak.statement, Statement::Value { uncertainty: Some(u), .. } if (u - 3e-3).abs() < 1e-15));
        assert!(matches!(peak.cases["linear"], Statement::Value { value, .. } if value == 0.296));
        assert_eq!(
            published.feature("line_2/3").unwrap().statement,
            Statement::Line { ratio: Ratio::new(2, 3), present: true }
        );
        assert_eq!(
            published.feature("thirds").unwrap().cases["linear"],
            Statement::Ordering { stronger: Ratio::new(1, 3), weaker: Ratio::new(1, 2), holds: false }
        );
    }

    #[test]
    fn half_a_unit_of_the_last_printed_digit_is_kept_for_values_without_uncertainty() {
        let head = "drive_frequency = \"73 kHz\"\n[[feature]]\nname = \"positive_peak\"\n";
        for (written, half) in [
            ("value = \"289 mm/s\"", 0.5e-3),
            ("value = \"0.30 m/s\"", 5e-3),
            ("value = 2.9e2\nunit = \"mm/s\"", 5e-3),
            ("value = \"289mm/s\"", 0.5e-3),
            ("value = 289\nunit = \"mm/s\"", 0.5e-3),
        ] {
            let published = read(&format!("{head}{written}")).unwrap();
            let Statement::Value { rounding, .. } = published.features[0].statement else { panic!("{written}") };
            assert!((rounding / half - 1.0).abs() < 1e-12, "{written}: {rounding}");
        }
    }

    #[test]
    fn errors_name_their_line() {
        let head = "drive_frequency = \"73 kHz\"\n[[feature]]\n";
        for (text, expected) in [
            (
                String::from("drive_frequency = 73000\n[[feature]]\nname = \"thd\"\nvalue = 1"),
                "features.toml:1: feature `drive_frequency`: expected a frequency such as `73 kHz`, found `7.3e4` without a unit",
            ),
            (
                format!("{head}name = \"positiv_peak\"\nvalue = \"1 m/s\""),
                "features.toml:3: feature `positiv_peak`: expected one of positive_peak, negative_peak, thd, amplitude_P/Q, \
                 ratio_P/Q, line_P/Q; did you mean `positive_peak`?",
            ),
            (
                format!("{head}name = \"positive_peak\"\nvalue = \"1 um\""),
                "features.toml:4: feature `positive_peak`: expected a velocity such as `289 mm/s`, found `1 um`, which is a length",
            ),
            (
                format!("{head}name = \"negative_peak\"\nvalue = \"247 mm/s\""),
                "features.toml:4: feature `negative_peak`: expected a value below 0 (positive is from piston to support), \
                 found 0.247",
            ),
            (
                format!("{head}name = \"thirds\"\nordering = \"1/3 over 1/2\""),
                "features.toml:4: feature `thirds`: expected two lines such as \"1/3 > 1/2\", found \"1/3 over 1/2\"",
            ),
            (
                format!("{head}name = \"line_1/3\""),
                "features.toml:3: feature `line_1/3`: expected one of value, present, ordering, found none of them",
            ),
            (
                format!("{head}name = \"line_1/3\"\npresent = true\ncase.x = true"),
                "features.toml:5: feature `line_1/3`: no [[case]] is named `x`; declare it, or correct the name",
            ),
            (
                String::from("drive_frequency = \"73 kHz\"\n"),
                "features.toml: expected at least one [[feature]], found none; add one such as `name = \"positive_peak\"`, \
                 `value = \"289 mm/s\"`",
            ),
        ] {
            assert_eq!(message(&text), expected);
        }
        assert!(
            message(&format!("{head}name = \"thd\"\nvalu = 1")).starts_with("features.toml:4:1: unknown field `valu`")
        );
        assert!(message("x = [").starts_with("features.toml:1:"));
    }
}
