//! How a record is to be read, where the file does not say it.

use granchain_signal::Quantity;

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
    /// Which offset is taken off the recorded quantity.
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
    /// What is done about cells such as `n/a`.
    pub enum Missing {
        /// They are refused
        #[default]
        Refuse = "refuse",
        /// Up to five in a row are bridged by a straight line
        Interpolate = "interpolate",
    }
}

/// How a record is to be read. Whatever is `None` is taken from the file's header, or from a stated assumption.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReadOptions {
    /// Column of time, by its header (or the name part of it) or by its number from 1.
    pub time_column: Option<String>,
    /// Column of the recorded quantity, likewise.
    pub column: Option<String>,
    /// Unit of time, such as `us`; overrides the file.
    pub time_unit: Option<String>,
    /// Unit of the recorded quantity, such as `mm/s`; overrides the file.
    pub unit: Option<String>,
    pub baseline: Baseline,
    /// Whether the sign is turned, for a head that looks the other way. Positive is from piston to support.
    pub invert: bool,
    /// −6 dB bandwidth of the decoder, Hz.
    pub bandwidth: Option<f64>,
    /// Delay of the decoder, s: the record shows the motion that much later.
    pub delay: Option<f64>,
    /// Instant of the trigger on the file's own time axis, s; it becomes t = 0.
    pub trigger: Option<f64>,
    /// Drive frequency f0, Hz, where it is known.
    pub drive_frequency: Option<f64>,
    /// Whether a horn tip's drive frequency is taken as stated though its strongest line is another.
    pub force_frequency: bool,
    /// What is done about missing cells.
    pub missing: Missing,
    /// What separates the values, where the file can be read in two ways.
    pub delimiter: Option<Delimiter>,
    /// How decimals are written, likewise.
    pub decimal: Option<DecimalSign>,
    /// Samples a second (Hz) of a file without a column of time; its first sample is at 0.
    pub sample_rate: Option<f64>,
    /// Sensitivity of the decoder or hydrophone, for a column in volts; overrides the file.
    pub scale: Option<Sensitivity>,
    /// Full-scale value of the decoder: velocity, length or, with a sensitivity, volts.
    pub range: Option<Quantity>,
    /// Whether uneven samples are interpolated onto an even grid.
    pub resample: bool,
    /// Which function of a universal file, or which segment, from 1.
    pub dataset: Option<usize>,
    pub mask: Masking,
    /// Number of shots that the record is the mean of.
    pub averages: Option<usize>,
}

impl ReadOptions {
    /// These, for another channel of a file that is read by `other`: what they leave open of the file's form is the same.
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
