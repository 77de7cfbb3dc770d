//! What a fit is held against: the record, conditioned, with its fingerprint.

use thiserror::Error;

use crate::{
    feature::{
        Measurand,
        fingerprint::{FeatureSet, Fingerprint, FingerprintError, SAMPLES_PER_CYCLE, onset_threshold},
    },
    scene::Drive,
    signal::{LowPass, Resampler, Series},
};

/// Nugget of an early feature, in ln.
const EARLY_NUGGET: f64 = 0.02;

/// Nugget of a late feature, in ln.
pub(super) const LATE_NUGGET: f64 = 0.01;

/// Highest cutoff, Hz: above it a laser vibrometer of this class records little but noise.
const HIGHEST_CUTOFF: f64 = 1.25e6;

/// The cutoff of traces whose own sampling sets no lower one: 1.25 MHz, or what 40 samples a drive period carry, Hz.
#[must_use]
pub fn highest_cutoff(drive_frequency: f64) -> f64 {
    f64::min(HIGHEST_CUTOFF, 0.42 * SAMPLES_PER_CYCLE as f64 * drive_frequency)
}

/// A recorded velocity or pressure and what is known of how it was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// What it is of.
    pub measurand: Measurand,
    /// Velocity (m/s) or pressure (Pa), baseline removed, sign as in the model.
    pub signal: Series,
    /// σ of its noise, unit of the signal; 0 when unknown.
    pub noise_rms: f64,
    /// Bandwidth of the instrument, Hz, if stated.
    pub bandwidth: Option<f64>,
    /// Number of quiet samples at the start.
    pub quiet: usize,
    /// Whether the record of the drive begins inside its burst, so that nobody knows what the chain did first.
    pub begins_late: bool,
}

impl Recording {
    /// One-sided density of its noise in what is compared, given the signal below `cutoff` (Hz): white up to half the sample rate, as that of a
    /// converter; up to the bandwidth, as that which a decoder shapes; in between, as the quiet samples have it.
    fn noise_density(&self, filtered: &[f64], cutoff: f64) -> f64 {
        let half = 0.5 * self.signal.sample_rate();
        let (white, shaped) =
            (self.noise_rms.powi(2) / half, self.noise_rms.powi(2) / self.bandwidth.unwrap_or(half).min(half));
        // Clear of the motion that the filter spreads, and enough of them that their rms is known to a tenth.
        let clear = self.quiet.saturating_sub((2.0 / (cutoff * self.signal.step)).ceil() as usize);
        if (clear as f64) * self.signal.step * cutoff < 25.0 {
            return shaped;
        }
        let quiet = &filtered[..clear];
        let mean = quiet.iter().sum::<f64>() / clear as f64;
        let seen = quiet.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / clear as f64;
        (seen / cutoff).clamp(white, shaped)
    }
}

/// Why a record cannot be fitted to.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ObservationError {
    /// Every sample is the same.
    #[error(
        "expected a signal, found {value:e} {} in every sample; check that the input was connected and that this \
         is the right column (--column)", measurand.unit()
    )]
    Constant {
        /// What was recorded.
        measurand: Measurand,
        /// That value, after the baseline is removed, unit of the measurand.
        value: f64,
    },
    /// Noise hides the onset.
    #[error(
        "the noise of the record ({noise:.3e} {} rms) hides its onset: 6 σ exceeds a quarter of its peak \
         ({peak:.3e} {}); average more shots or lower --bandwidth", measurand.unit(), measurand.unit()
    )]
    NoisyOnset {
        /// What was recorded.
        measurand: Measurand,
        /// σ, unit of the measurand.
        noise: f64,
        /// Peak, likewise.
        peak: f64,
    },
    /// Too few drive periods after the onset.
    #[error(
        "the record ends {available_cycles:.1} drive periods after its onset, expected at least {needed_cycles}; record \
         longer, or check --drive-frequency"
    )]
    TooShort {
        /// Periods after the onset.
        available_cycles: f64,
        /// Periods needed.
        needed_cycles: usize,
    },
    /// The record has no fingerprint.
    #[error("the record has no fingerprint")]
    Fingerprint(#[from] FingerprintError),
}

/// The record as the fit sees it.
#[derive(Debug, Clone)]
pub struct Observation {
    /// The record at [`SAMPLES_PER_CYCLE`] a drive period, low-passed, m/s or Pa.
    pub trace: Series,
    /// Cutoff applied to record and runs alike, Hz.
    pub cutoff: f64,
    /// Stated bandwidth of the instrument, Hz.
    pub bandwidth: Option<f64>,
    /// Spectral density of the record's noise, one-sided, (m/s)²/Hz or Pa²/Hz.
    pub noise_density: f64,
    /// How traces are reduced.
    pub fingerprint: Fingerprint,
    /// Features z₀ of the record.
    pub features: Vec<f64>,
    /// Smallest scatter allowed to each feature, in ln.
    pub nuggets: Vec<f64>,
    /// What is left out and why, in words; shown beside the verdict.
    pub warnings: Vec<String>,
}

impl Observation {
    /// Condition and reduce a record.
    ///
    /// - `drive`: what was driven with; the record is used no longer after its onset than the burst lasts
    ///
    /// # Errors
    /// When the onset cannot be told from noise or too little follows it.
    pub fn new(recording: &Recording, drive: &Drive, set: FeatureSet) -> Result<Self, ObservationError> {
        let drive_frequency = drive.frequency;
        let (begins, ends) = drive.burst();
        let drive_cycles = (ends - begins) * drive_frequency;
        let Recording { measurand, ref signal, .. } = *recording;
        if let Some(&first) = signal.values.first()
            && signal.values.iter().all(|&value| value == first)
        {
            return Err(ObservationError::Constant { measurand, value: first });
        }
        let rate = signal.sample_rate();
        let cutoff = f64::min(0.42 * rate, highest_cutoff(drive_frequency));
        let filtered = LowPass::new(signal.step, signal.len(), cutoff).apply(&signal.values);
        let noise_density = recording.noise_density(&filtered, cutoff);
        let step = 1.0 / (drive_frequency * SAMPLES_PER_CYCLE as f64);
        let count = ((signal.end() - signal.start) / step).floor() as usize + 1;
        let resampler = Resampler::interpolating(signal.start, signal.step, signal.len(), signal.start, step, count);
        let trace = resampler.series(&filtered);
        let noise = (noise_density * cutoff).sqrt();
        let peak = trace.peak();
        let threshold =
            onset_threshold(&trace, noise).ok_or(ObservationError::NoisyOnset { measurand, noise, peak })?;
        let onset = trace.values.iter().position(|v| v.abs() >= threshold).unwrap_or(0);
        let available = (trace.len() - onset) as f64 / SAMPLES_PER_CYCLE as f64;
        let fingerprint = Fingerprint::of(
            measurand,
            set,
            (threshold, peak),
            f64::min(available, drive_cycles).floor() as usize,
            drive_frequency,
        )
        .ok_or(ObservationError::TooShort { available_cycles: available, needed_cycles: Fingerprint::FEWEST_CYCLES })?;
        // At rest no trace is beyond the threshold within the first quarter of a period.
        let moving = onset < SAMPLES_PER_CYCLE / 4;
        let (fingerprint, warnings) = if moving || recording.begins_late {
            let which = if moving {
                "the record begins inside the answer"
            } else {
                "the drive's record begins inside its burst"
            };
            let warning = format!(
                "{which}: early peaks and the extremes of the whole are not compared, only the {} periods from the {}th on; record \
                 from before the burst on",
                fingerprint.cycles_needed() - fingerprint.late_start(),
                fingerprint.late_start()
            );
            (fingerprint.late_only(), vec![warning])
        } else {
            (fingerprint, vec![])
        };
        let features = fingerprint.measure(&trace)?;
        let nuggets = fingerprint.early().iter().map(|&early| if early { EARLY_NUGGET } else { LATE_NUGGET }).collect();
        let bandwidth = recording.bandwidth;
        Ok(Self { trace, cutoff, bandwidth, noise_density, fingerprint, features, nuggets, warnings })
    }
}
