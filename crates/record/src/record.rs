//! A record as it enters a comparison or drives the piston.

use std::path::{Path, PathBuf};

use granchain_signal::{Dimension, InstrumentResponse, Quantity, Series};

use super::{
    HornDrive, Masked, Masking, MeasurementError, NoiseSource, ReadOptions, RecordKind, horn_drive::Recorded, line,
    mask, noise::noise_band, notes::to_three_figures,
};

/// Quantity of the file's column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RecordedQuantity {
    Displacement,
    Velocity,
    /// Pressure about the ambient one, Pa.
    Pressure,
}

impl RecordedQuantity {
    /// Its name, SI unit and dimension.
    pub(super) const fn described(self) -> (&'static str, &'static str, Dimension) {
        match self {
            Self::Displacement => ("displacement", "m", Dimension::LENGTH),
            Self::Velocity => ("velocity", "m/s", Dimension::VELOCITY),
            Self::Pressure => ("pressure", "Pa", Dimension::PRESSURE),
        }
    }

    #[must_use]
    pub fn unit(self) -> &'static str {
        self.described().1
    }
}

/// Refuses a horn that does not move at all.
pub(super) fn check_motion(path: &Path, raw: &Series, recorded: RecordedQuantity) -> Result<(), MeasurementError> {
    let (.., dimension) = recorded.described();
    let still = raw.values.first().filter(|first| raw.values.iter().all(|value| value == *first));
    let value = still.map(|value| to_three_figures(*value, dimension));
    value.map_or(Ok(()), |value| Err(MeasurementError::ConstantDrive { path: path.into(), value }))
}

/// See [`Record::check_sampling`].
pub(super) fn check_sampling(path: &Path, sample_rate: f64, frequency: f64) -> Result<(), MeasurementError> {
    if sample_rate < 4.0 * frequency * (1.0 - 1e-9) {
        return Err(MeasurementError::SampledTooLow { path: path.into(), sample_rate, frequency });
    }
    Ok(())
}

/// One record in SI, with everything understood and assumed. Motion is positive from piston to support, pressure above
/// the ambient one.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    pub path: PathBuf,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
    pub kind: RecordKind,
    /// Quantity of the column; a horn tip's velocity has been integrated.
    pub recorded: RecordedQuantity,
    /// Displacement (m) of a horn tip, velocity (m/s) of a bead, or pressure (Pa) of a hydrophone. Sign and baseline
    /// are corrected, t = 0 is the trigger, and the vibrometer's delay is removed.
    pub series: Series,
    /// Recorded quantity as in the file, SI, on the file's own time axis; masked samples are bridged.
    pub raw: Series,
    /// Number of shots averaged in the record; 1 unless stated.
    pub averages: usize,
    /// Masked samples, which are bridged in `series` and `raw`; on the clock of `series`.
    pub masked: Vec<Masked>,
    /// Noise, unit of `series`, rms: the larger of step/√12 and the rms of the quiet samples (without quiet samples,
    /// the spectrum's floor); 0 if unknown.
    pub noise_rms: f64,
    /// Source of the noise estimate.
    pub noise_source: NoiseSource,
    /// Noise of the recorded quantity: m/s for a horn tip's velocity.
    pub recorded_noise_rms: f64,
    /// κ of the noise variance σ² + κ² v² of a bead's velocity v, if it grows with v as that of speckle does; 0 otherwise.
    pub speckle: f64,
    /// The converter's step, SI unit of the recorded quantity, if coarse enough to matter.
    pub quantisation_step: Option<f64>,
    /// Clipping levels, below and above, in the values of `series`; for a horn tip's velocity, before integration.
    pub clipped: [Option<f64>; 2],
    /// Number of quiet samples at the start.
    pub pretrigger: usize,
    /// Offset that was removed from the recorded quantity (before the sign was changed), SI; 0 if none.
    pub baseline: f64,
    /// Standard error of that offset from the noise of the quiet samples, taken as white, SI; `None` without quiet
    /// samples, without a mean, or for an integrated velocity.
    pub baseline_error: Option<f64>,
    /// −6 dB bandwidth of the vibrometer, Hz, if stated.
    pub bandwidth: Option<f64>,
    /// Frequency response of the instrument, if stated.
    pub response: Option<InstrumentResponse>,
    /// Group delay of the vibrometer that has been removed, s.
    pub delay: f64,
    /// Instant of the trigger on the file's time axis, s.
    pub trigger: f64,
    /// Drive frequency stated by the options or the header, Hz.
    pub stated_drive_frequency: Option<f64>,
    /// File format: delimiter, decimals, encoding, instrument.
    pub form: String,
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
    pub assumptions: Vec<String>,
    /// Warnings, as text: what was seen, why it matters, what to do.
    pub warnings: Vec<String>,
    pub options: ReadOptions,
}

/// Largest distance of a stated drive frequency from the strongest line, relative.
const SAME_FREQUENCY: f64 = 0.005;
/// Default cutoff of a drive, in drive frequencies.
const DRIVE_CUTOFF: f64 = 10.0;

impl RecordKind {
    /// Quantity of [`Record::series`] of this kind.
    const fn of_series(self) -> RecordedQuantity {
        match self {
            Self::HornTip => RecordedQuantity::Displacement,
            Self::Vibrometer => RecordedQuantity::Velocity,
            Self::Hydrophone => RecordedQuantity::Pressure,
        }
    }

    /// SI unit of [`Record::series`] of this kind.
    #[must_use]
    pub fn unit(self) -> &'static str {
        self.of_series().unit()
    }

    #[must_use]
    pub fn quantity(self) -> &'static str {
        self.of_series().described().0
    }

    #[must_use]
    pub fn dimension(self) -> Dimension {
        self.of_series().described().2
    }
}

impl Record {
    /// Drive frequency f0, Hz: as stated by the options or the file, else the strongest line of a horn-tip record.
    /// `None` for other records that do not state it: their strongest line may be a subharmonic.
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

    /// Refuses a stated drive frequency that is not the strongest line of a horn tip: more than 0.5 % off, or 0.5/n²
    /// for a burst of n < 10 cycles, whose ends shift its line that far.
    ///
    /// # Errors
    /// [`MeasurementError::FrequencyDisagrees`].
    pub(super) fn check_stated_frequency(&self, line: impl Fn() -> Option<usize>) -> Result<(), MeasurementError> {
        let (Some(stated), Some(found)) = (self.stated_drive_frequency, self.strongest_line()) else { return Ok(()) };
        let cycles = line::active_span(&self.series).len() as f64 * self.series.step * stated;
        if (found - stated).abs() <= stated * f64::max(SAME_FREQUENCY, 0.5 / (cycles * cycles)) {
            return Ok(());
        }
        let given = self.options.drive_frequency.is_some();
        let place = if given { "--drive-frequency" } else { "the file's header" };
        let line = line().filter(|_| !given).map_or_else(String::new, |line| format!(":{line}"));
        Err(MeasurementError::FrequencyDisagrees { path: self.path.clone(), line, stated, place, found })
    }

    /// Samples that such a mask replaces in a record that was read without one, in words; `None` if there are none.
    #[must_use]
    pub fn would_mask(&self, masking: &Masking) -> Option<String> {
        let line = || self.stated_drive_frequency.or_else(|| line::strongest_line(&self.raw));
        let found = mask::found(masking, (&self.raw, self.kind), line);
        (!found.is_empty()).then(|| mask::in_words(&mask::placed(&self.raw, &found)))
    }

    /// Refuses a record with fewer than 4 samples a cycle of `drive_frequency` (Hz).
    ///
    /// # Errors
    /// [`MeasurementError::SampledTooLow`].
    pub fn check_sampling(&self, drive_frequency: f64) -> Result<(), MeasurementError> {
        check_sampling(&self.path, self.series.sample_rate(), drive_frequency)
    }

    /// Refuses an implausible peak: a unit or a sensitivity is wrong by a power of ten.
    ///
    /// # Errors
    /// [`MeasurementError::AbsurdPeak`].
    pub fn check_plausible(&self) -> Result<(), MeasurementError> {
        let (high, dimension) = match self.recorded {
            RecordedQuantity::Displacement => (1e-3, Dimension::LENGTH),
            RecordedQuantity::Velocity => (50.0, Dimension::VELOCITY),
            RecordedQuantity::Pressure => return Ok(()),
        };
        let peak = self.raw.values.iter().map(|value| (value - self.baseline).abs()).fold(0.0, f64::max);
        if peak <= high {
            return Ok(());
        }
        let unit = Some(&self.value_column.1).filter(|unit| !unit.is_empty());
        Err(MeasurementError::AbsurdPeak {
            path: self.path.clone(),
            expected: format!("of at most {}", Quantity::new(high, dimension)),
            peak: to_three_figures(peak, dimension),
            from: unit.map_or_else(|| "as read".into(), |unit| format!("the file's unit is {unit}")),
            remedy: "correct the unit (--unit, such as mm/s or um) or the sensitivity (--scale)",
        })
    }

    /// Refuses a drive whose active part (from the first to the last sample above a tenth of its peak) is shorter than
    /// two cycles of `drive_frequency` (Hz).
    ///
    /// # Errors
    /// [`MeasurementError::DriveTooShort`].
    pub(crate) fn check_cycles(&self, drive_frequency: f64) -> Result<(), MeasurementError> {
        check_motion(&self.path, &self.raw, self.recorded)?;
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

    /// Cutoff of [`Record::to_drive`], Hz: the least of 0.4 of the sample rate, the vibrometer's bandwidth and 10 f0.
    #[must_use]
    pub(crate) fn drive_cutoff(&self, drive_frequency: f64) -> f64 {
        let cutoff = (0.4 * self.series.sample_rate()).min(DRIVE_CUTOFF * drive_frequency);
        self.bandwidth.map_or(cutoff, |bandwidth| cutoff.min(bandwidth))
    }

    /// Piston motion from a horn-tip record, whatever t = 0 means.
    ///
    /// - The piston rests until motion begins; the start is traced back from the first departure to its zero crossing.
    ///   No window is applied to recorded samples.
    /// - The motion is continued beyond both ends by a prediction from its outermost periods, and low-passed with zero
    ///   phase at `Record::drive_cutoff`.
    /// - Separable noise and drift are removed.
    /// - A velocity is integrated; content below f0/8 is removed.
    /// - The model's clock is the record's, unless motion begins before t = 0 or twenty periods after it.
    ///
    /// # Errors
    /// [`MeasurementError`] when it is no horn-tip record, shorter than two cycles, sampled below 4 f0, or has no
    /// line.
    pub fn to_drive(&self) -> Result<HornDrive, MeasurementError> {
        if self.kind != RecordKind::HornTip {
            return Err(MeasurementError::NotADrive { path: self.path.clone(), kind: self.kind });
        }
        check_motion(&self.path, &self.raw, self.recorded)?;
        let frequency =
            self.drive_frequency().ok_or_else(|| MeasurementError::NoDriveFrequency { path: self.path.clone() })?;
        self.check_sampling(frequency)?;
        self.check_cycles(frequency)?;
        let integrated = self.recorded == RecordedQuantity::Velocity;
        let series = if integrated {
            let sign = if self.options.invert { -1.0 } else { 1.0 };
            Series { start: self.series.start, ..self.raw.map(|x| sign * (x - self.baseline)) }
        } else {
            self.series.clone()
        };
        let noise_band = noise_band(series.sample_rate(), self.bandwidth);
        let cutoff = self.drive_cutoff(frequency);
        let recorded = Recorded {
            series,
            integrated,
            quiet: self.pretrigger,
            sigma: self.recorded_noise_rms,
            noise_band,
            quantisation_step: self.quantisation_step,
            drive_frequency: frequency,
            cutoff,
        };
        let too_short = || MeasurementError::DriveTooShort { path: self.path.clone(), cycles: 0.0, frequency };
        recorded.drive().ok_or_else(too_short)
    }
}
