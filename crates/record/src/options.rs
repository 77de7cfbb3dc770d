//! Reading options for what a file does not state.

use granchain_signal::{InstrumentResponse, Quantity};

use super::{DecimalSign, Delimiter, Masking, Sensitivity, choice::choice};

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RecordKind {
    /// The horn's tip, free: displacement, or velocity that is integrated.
    HornTip,
    /// The far pole of the last bead: velocity.
    Vibrometer,
    /// A point of the water: pressure about the ambient one.
    Hydrophone,
}

impl RecordKind {
    /// The name used in messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::HornTip => "horn-tip",
            Self::Vibrometer => "vibrometer",
            Self::Hydrophone => "hydrophone",
        }
    }
}

choice! {
    /// Offset that is subtracted from the recorded quantity.
    pub enum Baseline {
        /// The pre-trigger mean if there are at least 8 quiet samples, else none
        #[default]
        Auto = "auto",
        /// The mean of the quiet samples before the trigger; refused if there are fewer than 8
        Pretrigger = "pretrigger",
        /// The mean of the whole record
        Mean = "mean",
        /// The Hann-weighted mean over a whole number of drive periods in the plateau of the burst
        Plateau = "plateau",
        /// Nothing is removed
        None = "none",
    }
}

choice! {
    /// Treatment of cells such as `n/a`.
    pub enum Missing {
        /// They are refused
        #[default]
        Refuse = "refuse",
        /// Up to five in a row are bridged by a straight line
        Interpolate = "interpolate",
    }
}

/// Reading options. `None` takes the value from the file's header or from a stated assumption.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReadOptions {
    /// Column of time, by its header (or the name part of it) or by its number from 1.
    pub time_column: Option<String>,
    /// Column of the recorded quantity, by its header, name or number.
    pub column: Option<String>,
    /// Unit of time, such as `us`; overrides the file.
    pub time_unit: Option<String>,
    /// Unit of the recorded quantity, such as `mm/s`; overrides the file.
    pub unit: Option<String>,
    pub baseline: Baseline,
    /// Whether the sign is inverted, for a vibrometer head that faces the other way. Positive is from piston to
    /// support.
    pub invert: bool,
    /// −6 dB bandwidth of the vibrometer, Hz.
    pub bandwidth: Option<f64>,
    /// Frequency response of vibrometer or hydrophone.
    pub response: Option<InstrumentResponse>,
    /// Group delay of the vibrometer, s: the record lags the motion by it.
    pub delay: Option<f64>,
    /// Instant of the trigger on the file's own time axis, s; it becomes t = 0.
    pub trigger: Option<f64>,
    /// Drive frequency f0, Hz, if known.
    pub drive_frequency: Option<f64>,
    /// Whether a stated drive frequency is accepted although the strongest line of the horn tip is another.
    pub force_frequency: bool,
    /// Treatment of missing cells.
    pub missing: Missing,
    /// Delimiter, for a file that can be read in two ways.
    pub delimiter: Option<Delimiter>,
    /// Decimal sign, for a file that can be read in two ways.
    pub decimal: Option<DecimalSign>,
    /// Sample rate (Hz) of a file without a time column; its first sample is at 0.
    pub sample_rate: Option<f64>,
    /// Sensitivity of the vibrometer or hydrophone, for a column in volts; overrides the file.
    pub scale: Option<Sensitivity>,
    /// Full-scale value of the vibrometer: velocity, length or, with a sensitivity, volts.
    pub range: Option<Quantity>,
    /// Whether uneven samples are interpolated onto an even grid.
    pub resample: bool,
    /// Number of the function of a universal file, or of the segment, from 1.
    pub dataset: Option<usize>,
    pub mask: Masking,
    /// Number of shots averaged in the record.
    pub averages: Option<usize>,
}

impl ReadOptions {
    /// These options for another channel of the file that `other` reads: options on the file's format are taken from
    /// `other` if not given.
    #[must_use]
    pub fn of_same_file(self, other: &Self) -> Self {
        Self {
            time_column: self.time_column.or_else(|| other.time_column.clone()),
            time_unit: self.time_unit.or_else(|| other.time_unit.clone()),
            sample_rate: self.sample_rate.or(other.sample_rate),
            delimiter: self.delimiter.or(other.delimiter),
            decimal: self.decimal.or(other.decimal),
            trigger: self.trigger.or(other.trigger),
            dataset: self.dataset.or(other.dataset),
            resample: self.resample || other.resample,
            missing: if self.missing == Missing::default() { other.missing } else { self.missing },
            ..self
        }
    }
}
