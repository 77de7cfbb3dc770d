//! Published features as the fit sees them: one z a statement, where no waveform exists.
//!
//! A run's pole velocity, conditioned as always (low-passed, 40 samples a drive period), is measured in the analysis
//! window of the model's own time, where the drive's envelope exceeds half its peak. With f the simulated number,
//! floor = 0.003 of the largest printed velocity (0.003 for pure numbers), r the ratio of a line to the line at f0:
//!
//! | statement | z of a run | z₀ |
//! |---|---|---|
//! | a value (the magnitude of a negative peak) | ½ ln(f² + floor²) | of the printed value |
//! | a line is present | ½ ln(min(r, r₀)² + 0.003²) | at r = r₀ |
//! | a line is absent | ½ ln(max(r, r₀)² + 0.003²) | at r = r₀ |
//! | line a is stronger than line b | min(½ ln((r_a² + 0.003²)/(r_b² + 0.003²)), 0) | 0 |
//!
//! - r₀ = `PRESENT_FROM` = 0.1 (−20 dB): spectra are printed normalised and on a linear scale, where a line below a tenth
//!   of the largest is not seen as one.
//! - A value's covariance carries its printed standard uncertainty σ: nugget² = 0.01² + (σ/f)². Where none is printed, σ is
//!   half a unit in the last printed digit.
//! - A one-sided statement that holds has no scatter of its own. Its nugget is `SOFTNESS` = 3 dB: nobody reads a printed
//!   spectrum more sharply, and a narrower one would reward a region for holding it always over one where it holds
//!   mostly by the ratio of scatter to nugget, far more than the ratio of probabilities.

use thiserror::Error;

use super::observation::{LATE_NUGGET, highest_cutoff};
use granchain_record::{PublishedFeature, PublishedFeatures, PublishedQuantity as Quantity, Statement};
use granchain_signal::{
    Dimension, Series,
    feature::{
        FeatureError, MINIMUM_LINE_PERIODS, PeakSettings, Ratio, Window, line_amplitude, peaks,
        total_harmonic_distortion,
    },
};

/// r₀: a line counts as present from this fraction of the line at the drive, as absent below it.
pub(crate) const PRESENT_FROM: f64 = 0.1;

/// Standard uncertainty of a one-sided statement, in ln: 3 dB.
pub(crate) const SOFTNESS: f64 = 0.345;

/// Tempering exponent β for published features: they are few and little correlated, so no tempering is needed.
///
/// Chosen on 40 synthetic records (rigid wall and annulus, both laws) and tested on 40 others of which both peaks, the
/// drive line and three one-sided statements were published: 90 % intervals covered α 36 and damping 39 times (median
/// widths 0.45 and 0.67 in ln); without the drive line 39 and 39 times (0.58 and 0.80). At β = 0.5 all were covered,
/// with up to 1.6 times the width.
pub(crate) const POWER: f64 = 1.0;

/// Floor of every feature, relative to the largest printed velocity, or absolute for pure numbers.
const FLOOR: f64 = 0.003;

/// Relative difference of drive frequencies above which scene and publication are different experiments.
const SAME_FREQUENCY: f64 = 0.02;

/// Highest usable line over the cutoff: below it the filter does not affect amplitudes.
const PASSED: f64 = 0.85;

/// Whether the number behind a statement is a velocity.
pub(crate) fn is_velocity(statement: &Statement) -> bool {
    matches!(statement, Statement::Value { quantity, .. } if quantity.dimension() == Dimension::VELOCITY)
}

/// Key of the feature of a published value; `None` for a one-sided statement.
fn key(feature: &PublishedFeature) -> Option<String> {
    match feature.statement {
        Statement::Value { quantity: Quantity::Amplitude(ratio), .. } => Some(format!("line_{ratio}")),
        Statement::Value { quantity: Quantity::Ratio(ratio), .. } => Some(format!("ratio_{ratio}")),
        Statement::Value { .. } => Some(feature.name.clone()),
        _ => None,
    }
}

/// Why published features cannot be compared with a scene.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PublishedMismatch {
    #[error(
        "the features were published for a drive of {published_hz:.0} Hz, the scene is driven at {scene_hz:.0} Hz; name the \
         right scene or drive, or pass --drive-frequency"
    )]
    DriveFrequency { published_hz: f64, scene_hz: f64 },
    #[error(
        "feature `{name}`: the line at {frequency_hz:.0} Hz lies above {limit_hz:.0} Hz, up to which runs are compared; delete it"
    )]
    LineTooHigh { name: String, frequency_hz: f64, limit_hz: f64 },
    #[error(
        "feature `{name}`: the drive is on for {periods:.1} periods of the line at {frequency_hz:.0} Hz, expected at least \
         {MINIMUM_LINE_PERIODS}; delete it, or use a longer burst"
    )]
    LineTooLow { name: String, frequency_hz: f64, periods: f64 },
}

/// Why a run cannot be compared with published features.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ReductionError {
    #[error(transparent)]
    Feature(#[from] FeatureError),
    #[error("the response has no line at the drive frequency, so no ratio to it")]
    NoDriveLine,
}

/// All statements of one publication, prepared for comparison with runs.
#[derive(Debug, Clone, PartialEq)]
pub struct PublishedComparison {
    /// In the publication's order.
    pub(super) statements: Vec<PublishedFeature>,
    drive_frequency: f64,
    /// Of the features, model time.
    pub(super) window: Window,
    /// Of the low-pass that every run goes through, Hz.
    pub(super) cutoff: f64,
    velocity_floor: f64,
}

impl PublishedComparison {
    /// Statements of a publication, for runs driven at `drive_frequency` (Hz) and measured in `window` (model time).
    pub fn new(published: &PublishedFeatures, drive_frequency: f64, window: Window) -> Result<Self, PublishedMismatch> {
        let published_hz = published.drive_frequency;
        if (drive_frequency / published_hz - 1.0).abs() > SAME_FREQUENCY {
            return Err(PublishedMismatch::DriveFrequency { published_hz, scene_hz: drive_frequency });
        }
        let cutoff = highest_cutoff(drive_frequency);
        let statements = published.features.clone();
        for feature in &statements {
            for ratio in lines(&feature.statement) {
                let name = feature.name.clone();
                let (frequency_hz, limit_hz) = (ratio.value() * drive_frequency, PASSED * cutoff);
                let periods = frequency_hz * window.duration();
                if frequency_hz > limit_hz {
                    return Err(PublishedMismatch::LineTooHigh { name, frequency_hz, limit_hz });
                }
                if periods < MINIMUM_LINE_PERIODS {
                    return Err(PublishedMismatch::LineTooLow { name, frequency_hz, periods });
                }
            }
        }
        let largest = statements.iter().filter_map(|feature| match feature.statement {
            Statement::Value { value, .. } if is_velocity(&feature.statement) => Some(value.abs()),
            _ => None,
        });
        let velocity_floor = FLOOR * largest.fold(0.0, f64::max);
        Ok(Self { statements, drive_frequency, window, cutoff, velocity_floor })
    }

    /// The published value of a feature, by its key (`positive_peak`, `line_1/3` for the amplitude of a line,
    /// `ratio_1/3`, `thd`), SI; `None` if no number is published.
    pub(crate) fn value(&self, key: &str) -> Option<f64> {
        let found = self.statements.iter().find(|feature| self::key(feature).as_deref() == Some(key))?;
        match found.statement {
            Statement::Value { value, .. } => Some(value),
            _ => None,
        }
    }

    pub(crate) fn targets(&self) -> Vec<f64> {
        let target = |feature: &PublishedFeature| match feature.statement {
            Statement::Value { value, .. } => floored(value.abs(), self.floor(&feature.statement)),
            Statement::Line { .. } => floored(PRESENT_FROM, FLOOR),
            Statement::Ordering { .. } => 0.0,
        };
        self.statements.iter().map(target).collect()
    }

    /// Smallest scatter of each statement, in ln.
    pub(crate) fn nuggets(&self) -> Vec<f64> {
        let nugget = |feature: &PublishedFeature| match feature.statement {
            Statement::Value { value, uncertainty, rounding, .. } => {
                LATE_NUGGET.hypot(uncertainty.unwrap_or(rounding) / value)
            }
            _ => SOFTNESS,
        };
        self.statements.iter().map(nugget).collect()
    }

    fn floor(&self, statement: &Statement) -> f64 {
        if is_velocity(statement) { self.velocity_floor } else { FLOOR }
    }

    /// z of each statement for a conditioned pole velocity (m/s, model time).
    pub fn measure(&self, trace: &Series) -> Result<Vec<f64>, ReductionError> {
        let (window, drive) = (self.window, self.drive_frequency);
        let extremes = peaks(trace, window, &PeakSettings::default())?;
        let reference = line_amplitude(trace, window, drive);
        let line = |ratio: Ratio| line_amplitude(trace, window, ratio.value() * drive);
        let relative =
            |ratio: Ratio| if reference > 0.0 { Ok(line(ratio) / reference) } else { Err(ReductionError::NoDriveLine) };
        let one = |statement: &Statement| -> Result<f64, ReductionError> {
            Ok(match *statement {
                Statement::Value { quantity, .. } => {
                    let simulated = match quantity {
                        Quantity::PositivePeak => extremes.positive.max(0.0),
                        Quantity::NegativePeak => (-extremes.negative).max(0.0),
                        Quantity::Amplitude(ratio) => line(ratio),
                        Quantity::Ratio(ratio) => relative(ratio)?,
                        Quantity::Distortion => total_harmonic_distortion(trace, window, drive, Some(self.cutoff))?,
                    };
                    floored(simulated, self.floor(statement))
                }
                Statement::Line { ratio, present: true } => floored(relative(ratio)?.min(PRESENT_FROM), FLOOR),
                Statement::Line { ratio, present: false } => floored(relative(ratio)?.max(PRESENT_FROM), FLOOR),
                Statement::Ordering { stronger, weaker, holds } => {
                    let (stronger, weaker) = if holds { (stronger, weaker) } else { (weaker, stronger) };
                    (floored(relative(stronger)?, FLOOR) - floored(relative(weaker)?, FLOOR)).min(0.0)
                }
            })
        };
        self.statements.iter().map(|feature| one(&feature.statement)).collect()
    }

    /// Description of how each statement is compared.
    pub(crate) fn assumptions(&self) -> Vec<String> {
        let mut sentences: Vec<String> = self
            .statements
            .iter()
            .filter_map(|feature| match feature.statement {
                Statement::Value { value, uncertainty: None, rounding, .. } => Some(format!(
                    "{}: no uncertainty is printed, half a unit of its last digit ({:.2} %) is taken for one standard deviation",
                    feature.name,
                    100.0 * rounding / value.abs()
                )),
                _ => None,
            })
            .collect();
        let named = |wanted: fn(&Statement) -> bool| {
            let names: Vec<&str> = self
                .statements
                .iter()
                .filter(|feature| wanted(&feature.statement))
                .map(|feature| feature.name.as_str())
                .collect();
            names.join(", ")
        };
        let decibel = 20.0 * PRESENT_FROM.log10();
        for (names, what) in [
            (named(|it| matches!(it, Statement::Line { present: true, .. })), "present: counts as fulfilled from"),
            (named(|it| matches!(it, Statement::Line { present: false, .. })), "absent: counts as fulfilled up to"),
        ] {
            if !names.is_empty() {
                sentences.push(format!(
                    "{names} {what} {PRESENT_FROM} of the line at the drive ({decibel:.0} dB; a normalised spectrum on a linear \
                     scale shows no less), to one side only and no sharper than 3 dB"
                ));
            }
        }
        let ordered = named(|it| matches!(it, Statement::Ordering { .. }));
        if !ordered.is_empty() {
            sentences
                .push(format!("{ordered}: amplitudes of lines compared, to one side only and no sharper than 3 dB"));
        }
        sentences.push(format!(
            "no waveform: runs are measured from {:.0} to {:.0} µs, where the drive's envelope exceeds half its peak, \
             low-passed at {:.2} MHz",
            self.window.from * 1e6,
            self.window.to * 1e6,
            self.cutoff * 1e-6
        ));
        sentences
    }
}

/// ½ ln(f² + floor²).
fn floored(value: f64, floor: f64) -> f64 {
    0.5 * (value * value + floor * floor).ln()
}

/// The lines a statement is about.
fn lines(statement: &Statement) -> Vec<Ratio> {
    match *statement {
        Statement::Value { quantity: Quantity::Amplitude(ratio) | Quantity::Ratio(ratio), .. }
        | Statement::Line { ratio, .. } => vec![ratio],
        Statement::Ordering { stronger, weaker, .. } => vec![stronger, weaker],
        Statement::Value { .. } => vec![],
    }
}

#[cfg(test)]
mod tests {
    use std::{f64::consts::TAU, path::Path};

    use super::*;

    const F0: f64 = 73e3;

    fn printed(feature: &str) -> PublishedComparison {
        let text = format!("drive_frequency = \"73 kHz\"\n[[feature]]\n{feature}");
        let published = PublishedFeatures::from_bytes(Path::new("features.toml"), text.as_bytes()).unwrap();
        PublishedComparison::new(&published, F0, Window::new(100e-6, 600e-6)).unwrap()
    }

    /// A drive line of 0.2 m/s with lines at 1/3 and 1/2 of the given ratios to it.
    fn trace(third: f64, half: f64) -> Series {
        let step = 1.0 / (40.0 * F0);
        let value = |t: f64| {
            let line = |ratio: f64, a: f64| a * (TAU * F0 * ratio * t).sin();
            0.2 * (line(1.0, 1.0) + line(1.0 / 3.0, third) + line(0.5, half))
        };
        Series::new(0.0, step, (0..(700e-6 / step) as usize).map(|i| value(i as f64 * step)).collect())
    }

    /// z − z₀ of the only statement.
    fn deviation(feature: &str, third: f64, half: f64) -> f64 {
        let printed = printed(feature);
        printed.measure(&trace(third, half)).unwrap()[0] - printed.targets()[0]
    }

    #[test]
    fn one_sided_statements_penalise_only_their_wrong_side() {
        // Tolerance: Hann side lobes of the neighbours, −60 dB of the drive line at most, over a ratio of 0.03.
        let near = |found: f64, expected: f64| (found - expected).abs() < 0.04;
        let present = "name = \"line_1/3\"\npresent = true";
        assert!(deviation(present, 0.5, 0.0).abs() < 1e-12 && deviation(present, 0.11, 0.9).abs() < 1e-12);
        assert!(near(deviation(present, 0.03, 0.0), 0.3_f64.ln()), "{}", deviation(present, 0.03, 0.0));
        let absent = "name = \"line_1/3\"\npresent = false";
        assert!(deviation(absent, 0.0, 0.9).abs() < 1e-12 && deviation(absent, 0.09, 0.0).abs() < 1e-12);
        assert!(near(deviation(absent, 0.3, 0.0), 3.0_f64.ln()), "{}", deviation(absent, 0.3, 0.0));
        let ordering = "name = \"thirds\"\nordering = \"1/3 > 1/2\"";
        assert!(deviation(ordering, 0.31, 0.3).abs() < 1e-12 && deviation(ordering, 0.5, 0.0).abs() < 1e-12);
        assert!(near(deviation(ordering, 0.1, 0.4), 0.25_f64.ln()), "{}", deviation(ordering, 0.1, 0.4));
    }

    #[test]
    fn values_deviate_to_both_sides_by_the_logarithm_of_their_ratio() {
        let ratio = "name = \"ratio_1/3\"\nvalue = 0.2";
        for simulated in [0.1, 0.2, 0.4] {
            // Side lobes as above.
            let expected = f64::ln(simulated / 0.2);
            assert!((deviation(ratio, simulated, 0.0) - expected).abs() < 0.01, "{simulated}");
        }
        // 0.2 m/s of a pure tone: 40 samples a period, interpolated.
        assert!(deviation("name = \"negative_peak\"\nvalue = \"-200 mm/s\"", 0.0, 0.0).abs() < 1e-3);
    }

    #[test]
    fn printed_uncertainty_widens_a_value_and_the_last_digit_stands_in_for_it() {
        let stated = printed("name = \"positive_peak\"\nvalue = \"200 mm/s\"\nuncertainty = \"20 mm/s\"");
        assert!((stated.nuggets()[0] - LATE_NUGGET.hypot(0.1)).abs() < 1e-12);
        let bare = printed("name = \"ratio_1/3\"\nvalue = 0.2");
        assert!((bare.nuggets()[0] - LATE_NUGGET.hypot(0.25)).abs() < 1e-12);
        assert!(bare.assumptions()[0].contains("25.00 %"), "{:?}", bare.assumptions());
    }

    #[test]
    fn another_drive_frequency_or_an_unmeasurable_line_is_refused() {
        let text = "drive_frequency = \"73 kHz\"\n[[feature]]\nname = \"line_15\"\npresent = true";
        let published = PublishedFeatures::from_bytes(Path::new("features.toml"), text.as_bytes()).unwrap();
        let long = Window::new(0.0, 500e-6);
        assert!(matches!(PublishedComparison::new(&published, F0, long), Err(PublishedMismatch::LineTooHigh { .. })));
        assert!(matches!(
            PublishedComparison::new(&published, 50e3, long),
            Err(PublishedMismatch::DriveFrequency { .. })
        ));
        let text = text.replace("line_15", "line_1/3");
        let published = PublishedFeatures::from_bytes(Path::new("features.toml"), text.as_bytes()).unwrap();
        let short = Window::new(0.0, 10.0 / F0);
        assert!(matches!(PublishedComparison::new(&published, F0, short), Err(PublishedMismatch::LineTooLow { .. })));
    }
}
