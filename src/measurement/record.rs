//! A record as it enters a comparison or drives the piston.

use std::path::PathBuf;

use crate::signal::{Dimension, Series, low_pass};

use super::{MeasurementError, ReadOptions, RecordKind, line};

/// What the file's column held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RecordedQuantity {
    /// Displacement, m.
    Displacement,
    /// Velocity, m/s.
    Velocity,
    /// Pressure about the ambient one, Pa.
    Pressure,
}

impl RecordedQuantity {
    /// Its SI unit.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Displacement => "m",
            Self::Velocity => "m/s",
            Self::Pressure => "Pa",
        }
    }
}

/// One record, in SI, motion positive from piston to support, pressure positive above the ambient one, with what was understood and assumed.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// The file.
    pub path: PathBuf,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
    /// What was recorded where.
    pub kind: RecordKind,
    /// What the column held; a horn tip's velocity has been integrated.
    pub recorded: RecordedQuantity,
    /// Displacement (m) of a horn tip, velocity (m/s) of a bead, pressure (Pa) of a hydrophone; sign and baseline done, t = 0 at the trigger, the decoder's
    /// delay removed.
    pub series: Series,
    /// The recorded quantity as it stands in the file, SI, on the file's own time axis.
    pub raw: Series,
    /// Rms of the quiet samples before the trigger, unit of `series`; 0 if unknown.
    pub noise_rms: f64,
    /// Number of quiet samples at the start.
    pub pretrigger: usize,
    /// The offset that was removed from the recorded quantity (before the sign was turned), SI; 0 if none.
    pub baseline: f64,
    /// Standard error of that offset by the noise of the quiet samples, taken as white, SI; `None` where none are quiet, where no mean was
    /// taken, or where a horn tip's velocity was integrated.
    pub baseline_error: Option<f64>,
    /// −6 dB bandwidth of the decoder, Hz, where stated.
    pub bandwidth: Option<f64>,
    /// Delay of the decoder, s, that has been removed.
    pub delay: f64,
    /// Instant of the trigger on the file's time axis, s.
    pub trigger: f64,
    /// Drive frequency stated by the options or the header, Hz.
    pub stated_drive_frequency: Option<f64>,
    /// How the file is written: delimiter, decimals, encoding, whose preamble.
    pub form: String,
    /// Headers of all columns.
    pub columns: Vec<String>,
    /// Header and unit of the time column.
    pub time_column: (String, String),
    /// Header and unit of the column that was read.
    pub value_column: (String, String),
    /// Comment lines, without `#`.
    pub comments: Vec<String>,
    /// The first lines of the file.
    pub first_lines: Vec<String>,
    /// Cells that were missing and have been interpolated.
    pub interpolated: usize,
    /// What was assumed, in words.
    pub assumptions: Vec<String>,
    /// What looks wrong but could be read, in words: what was seen, why it matters, what to do.
    pub warnings: Vec<String>,
    /// The options it was read with.
    pub options: ReadOptions,
}

/// Cycles over which a drive fades at its end.
const FADE_CYCLES: f64 = 2.0;
/// Default cutoff of a drive, in drive frequencies.
const DRIVE_CUTOFF: f64 = 10.0;

impl RecordKind {
    /// SI unit of [`Record::series`] of this kind.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::HornTip => "m",
            Self::Vibrometer => "m/s",
            Self::Hydrophone => "Pa",
        }
    }

    /// What that series is.
    #[must_use]
    pub fn quantity(self) -> &'static str {
        match self {
            Self::HornTip => "displacement",
            Self::Vibrometer => "velocity",
            Self::Hydrophone => "pressure",
        }
    }

    /// Its dimension.
    #[must_use]
    pub fn dimension(self) -> Dimension {
        match self {
            Self::HornTip => Dimension::LENGTH,
            Self::Vibrometer => Dimension::VELOCITY,
            Self::Hydrophone => Dimension::PRESSURE,
        }
    }
}

impl Record {
    /// The drive frequency f0, Hz: as stated by the options or the file, else the strongest line of a horn-tip record. `None`
    /// for any other record that does not state it: its strongest line may well be a subharmonic.
    #[must_use]
    pub fn drive_frequency(&self) -> Option<f64> {
        self.stated_drive_frequency.or_else(|| match self.kind {
            RecordKind::HornTip => self.strongest_line(),
            RecordKind::Vibrometer | RecordKind::Hydrophone => None,
        })
    }

    /// Frequency of the strongest spectral line of `series`, Hz (Hann window over the active part, refined between the bins).
    #[must_use]
    pub fn strongest_line(&self) -> Option<f64> {
        line::strongest_line(&self.series)
    }

    /// Refuse a record with fewer than 4 samples a cycle of `drive_frequency` (Hz).
    ///
    /// # Errors
    /// [`MeasurementError::SampledTooLow`].
    pub fn check_sampling(&self, drive_frequency: f64) -> Result<(), MeasurementError> {
        let sample_rate = self.series.sample_rate();
        if sample_rate < 4.0 * drive_frequency * (1.0 - 1e-9) {
            let path = self.path.clone();
            return Err(MeasurementError::SampledTooLow { path, sample_rate, frequency: drive_frequency });
        }
        Ok(())
    }

    /// Refuse a drive whose active part (from the first to the last sample above a tenth of its peak) is shorter than two
    /// cycles of `drive_frequency` (Hz).
    ///
    /// # Errors
    /// [`MeasurementError::DriveTooShort`].
    pub fn check_cycles(&self, drive_frequency: f64) -> Result<(), MeasurementError> {
        let active = line::active_span(&self.series);
        // Two whole cycles of a sine spend 0.032 of a cycle below a tenth of the peak at their ends.
        let cycles = active.len() as f64 * self.series.step * drive_frequency + 0.04;
        if cycles < 2.0 {
            return Err(MeasurementError::DriveTooShort {
                path: self.path.clone(),
                cycles,
                frequency: drive_frequency,
            });
        }
        Ok(())
    }

    /// The cutoff of [`Record::to_drive`], Hz: the least of 0.4 of the sample rate, the decoder's bandwidth and 10 f0.
    #[must_use]
    pub fn drive_cutoff(&self, drive_frequency: f64) -> f64 {
        let cutoff = (0.4 * self.series.sample_rate()).min(DRIVE_CUTOFF * drive_frequency);
        self.bandwidth.map_or(cutoff, |bandwidth| cutoff.min(bandwidth))
    }

    /// A horn-tip record as the piston's displacement (m), ready to be interpolated twice differentiably.
    ///
    /// - zero-phase low-pass at [`Record::drive_cutoff`];
    /// - begins one drive period before the trigger, or where the record begins if that is later, and rises from zero over
    ///   what there is before the trigger (half a cosine); a record that begins with the burst rises over half a period;
    /// - falls to zero over the last two drive periods (half a cosine), so that the piston ends at rest;
    /// - same time axis: t = 0 at the trigger.
    ///
    /// # Errors
    /// [`MeasurementError`] when it is no horn-tip record, shorter than two cycles, sampled below 4 f0, or has no line.
    pub fn to_drive(&self) -> Result<Series, MeasurementError> {
        if self.kind != RecordKind::HornTip {
            return Err(MeasurementError::NotADrive { path: self.path.clone(), kind: self.kind });
        }
        let frequency =
            self.drive_frequency().ok_or_else(|| MeasurementError::NoDriveFrequency { path: self.path.clone() })?;
        self.check_sampling(frequency)?;
        self.check_cycles(frequency)?;
        let period = 1.0 / frequency;
        let mut drive = low_pass(&self.series, self.drive_cutoff(frequency)).window(-period, f64::INFINITY);
        if drive.is_empty() {
            return Err(MeasurementError::DriveTooShort { path: self.path.clone(), cycles: 0.0, frequency });
        }
        let (start, end) = (drive.start, drive.end());
        let rise = if start < -0.5 * drive.step { -start } else { 0.5 * period };
        let fall = (FADE_CYCLES * period).min(0.5 * (end - start));
        let ease = |u: f64| 0.5 - 0.5 * libm::cos(std::f64::consts::PI * u.clamp(0.0, 1.0));
        for i in 0..drive.len() {
            let t = drive.time(i);
            drive.values[i] *= ease((t - start) / rise) * ease((end - t) / fall);
        }
        Ok(drive)
    }

    /// What [`Record::to_drive`] does with this record, in words.
    #[must_use]
    pub fn drive_statement(&self, drive_frequency: f64) -> String {
        format!(
            "drive low-passed (zero phase) at {:.0} kHz, rising from zero before the trigger and falling to zero over its \
             last {FADE_CYCLES} cycles by half cosines",
            self.drive_cutoff(drive_frequency) / 1e3
        )
    }
}
