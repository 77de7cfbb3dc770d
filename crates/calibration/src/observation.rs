//! The record conditioned for the fit, with its fingerprint.

use std::sync::Arc;

use thiserror::Error;

use super::{comparison::Comparison, posterior::POWER};
use granchain_model::scene::Drive;
use granchain_record::{Record, RecordKind};
use granchain_signal::{
    CausalShape, Gap, InstrumentResponse, LowPass, NoiseSpectrum, Resampler, ResponseTable, Series,
    feature::{
        Measurand,
        alignment::{Strength, onset_threshold},
        fingerprint::{FeatureSet, Fingerprint, FingerprintError, Placed, SAMPLES_PER_CYCLE},
    },
    mean_and_rms,
    number::engineering,
};

/// Tempering exponent β for a pressure: 27 features of 40 neighbours make intervals narrower than 22 features do. With
/// the exponent of a velocity the first synthetic records missed α; for the counts see `docs/validation.md`.
const PRESSURE_POWER: f64 = 0.35;

/// Nugget of an early feature, in ln.
const EARLY_NUGGET: f64 = 0.02;

/// Nugget of a late feature, in ln.
pub(super) const LATE_NUGGET: f64 = 0.01;

/// Added to both where samples are bridged, and in the highest band, which then mostly holds undetected parts of drop-outs.
const BRIDGED_NUGGET: (f64, f64) = (0.01, 0.3);

/// Largest possible offset at the beginning of a record without quiet samples, over its peak.
const UNKNOWN_OFFSET: f64 = 0.03;

/// Rms in the first period of a record without quiet samples above which it moves: over that of the noise, and over
/// the peak (a record may have no noise).
const WAVERS: [f64; 2] = [2.0, 0.01];

/// Share of the comparable periods below which a record is called short, and their number.
const SHORT: f64 = 0.75;
const MOST_COMPARED: f64 = 40.0;

/// Periods after which the chain has forgotten the missing first cycles of a drive.
const SETTLED: f64 = 10.0;

/// Periods within which a response cannot reach full strength if the drive takes longer to reach half of its own.
const SUDDEN: f64 = 3.0;

/// Highest cutoff, Hz: above it a laser vibrometer of this class records mostly noise.
const HIGHEST_CUTOFF: f64 = 1.25e6;

/// Cutoff for traces sampled fast enough: 1.25 MHz, or the limit of 40 samples a drive period, Hz.
pub(crate) fn highest_cutoff(drive_frequency: f64) -> f64 {
    f64::min(HIGHEST_CUTOFF, 0.42 * SAMPLES_PER_CYCLE as f64 * drive_frequency)
}

/// Highest sample rate that is kept, Hz: sixteen times the highest cutoff. Faster records are averaged down to it.
const DENSEST: f64 = 16.0 * HIGHEST_CUTOFF;

/// Assumed number of independent samples behind the noise estimate of a record without quiet samples.
const UNSTATED_FREEDOM: f64 = 20.0;

/// Fewest averaged samples at rest for a noise estimate.
const FEWEST_QUIET: usize = 25;

/// The means of so many samples each, at their middles.
fn averaged(series: &Series, together: usize) -> Series {
    if together == 1 {
        return series.clone();
    }
    let mean = |samples: &[f64]| samples.iter().sum::<f64>() / together as f64;
    let values = series.values.chunks_exact(together).map(mean).collect();
    Series::new(series.start + 0.5 * (together - 1) as f64 * series.step, series.step * together as f64, values)
}

/// A recorded velocity or pressure with its instrument.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    pub measurand: Measurand,
    /// Velocity (m/s) or pressure (Pa), baseline removed, sign as in the model.
    pub signal: Series,
    /// σ of its noise, unit of the signal; 0 when unknown.
    pub noise_rms: f64,
    /// Bandwidth of the instrument, Hz, if stated.
    pub bandwidth: Option<f64>,
    /// Frequency response of the instrument, if stated.
    pub response: Option<InstrumentResponse>,
    /// Additional density of the noise of a coarse converter while the signal moves, one-sided, unit²/Hz of the
    /// signal.
    pub rounding: f64,
    /// One-sided density of noise that grows with the velocity, over its square, 1/Hz.
    pub speckle: f64,
    /// Number of quiet samples at the start.
    pub quiet: usize,
    /// Where its input was clipped, below and above, unit of the signal.
    pub clipped: [Option<f64>; 2],
    /// Whether the drive record begins inside its burst, so that the first drive cycles are unknown.
    pub begins_late: bool,
    /// Instant of the signal's clock at the drive's time 0, s.
    pub origin: f64,
    /// Stretches without valid samples, bridged in `signal`.
    pub masked: Vec<Gap>,
    /// Number of shots averaged in it.
    pub averages: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Passband {
    /// Frequency at which the gain has the value stated by `fall`, Hz; of a table that at which it is 1.
    pub bandwidth: f64,
    pub fall: Fall,
}

/// Roll-off of an instrument beyond its bandwidth.
#[derive(Debug, Clone, PartialEq)]
pub enum Fall {
    /// Without phase: 1 as a digital filter, 0 as a Gaussian; ½ at the bandwidth; [`LowPass::falling`].
    Steepness(f64),
    /// Causal, its flat delay removed; this gain at the bandwidth.
    Causal(CausalShape, f64),
    Table(Arc<ResponseTable>),
}

/// Default choice among [`Passband::stated`].
pub(crate) const MIDDLE: f64 = 0.5;

/// Assumed share of zero-phase instruments if only the bandwidth is stated.
const PHASELESS: f64 = 0.3;

/// Filters of the others, equally likely; the bandwidth may be that of −3 dB or of −6 dB.
const CAUSAL: [CausalShape; 5] = [
    CausalShape::Butterworth(1),
    CausalShape::Butterworth(2),
    CausalShape::Butterworth(3),
    CausalShape::Butterworth(4),
    CausalShape::Bessel,
];

impl Passband {
    /// A filter compatible with a stated bandwidth (Hz), selected by `which` from 0 to 1; ½ is the middle one.
    pub fn stated(bandwidth: f64, which: f64) -> Self {
        if which < PHASELESS {
            return Self { bandwidth, fall: Fall::Steepness(which / PHASELESS) };
        }
        let number = ((which - PHASELESS) / (1.0 - PHASELESS) * 2.0 * CAUSAL.len() as f64) as usize;
        let gain = if number.is_multiple_of(2) { 0.5f64.sqrt() } else { 0.5 };
        Self { bandwidth, fall: Fall::Causal(CAUSAL[(number / 2).min(CAUSAL.len() - 1)], gain) }
    }

    /// The filter of a stated response, of a bandwidth where that is stated, under a drive of that frequency (Hz).
    pub fn of(response: &InstrumentResponse, bandwidth: Option<f64>, drive_frequency: f64) -> Option<Self> {
        match response {
            InstrumentResponse::Filter(shape) => {
                Some(Self { bandwidth: bandwidth?, fall: Fall::Causal(*shape, 0.5f64.sqrt()) })
            }
            InstrumentResponse::Table(table) => {
                Some(Self { bandwidth: drive_frequency, fall: Fall::Table(Arc::clone(table)) })
            }
        }
    }

    pub fn pass(&self, trace: &Series) -> Series {
        match &self.fall {
            Fall::Steepness(steepness) => {
                let low_pass = LowPass::falling(trace.step, trace.len(), self.bandwidth, *steepness);
                Series::new(trace.start, trace.step, low_pass.apply(&trace.values))
            }
            Fall::Causal(shape, gain) => shape.apply(trace, self.bandwidth, *gain),
            Fall::Table(table) => table.apply(trace, self.bandwidth),
        }
    }
}

/// Clips samples as the input did, if it did.
pub fn clip(values: &mut [f64], [low, high]: [Option<f64>; 2]) {
    let (low, high) = (low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY));
    if low < high && (low.is_finite() || high.is_finite()) {
        values.iter_mut().for_each(|value| *value = value.clamp(low, high));
    }
}

/// Noise over the converter's step below which quiet samples show none of the rounding noise, and above which they
/// show all of it.
const ROUNDED: (f64, f64) = (0.3, 0.7);

/// See [`Recording::rounding`]: q²/12 over half the sample rate.
fn rounding(record: &Record) -> f64 {
    let Some(step) = record.quantisation_step.filter(|step| *step > 0.0) else { return 0.0 };
    let unseen = (ROUNDED.1 - record.noise_rms / step) / (ROUNDED.1 - ROUNDED.0);
    unseen.clamp(0.0, 1.0) * step * step / 12.0 * 2.0 * record.series.step
}

impl Recording {
    /// From a bead's or hydrophone's record; for `begins_late` see the field.
    pub fn of(record: &Record, begins_late: bool) -> Self {
        let measurand = match record.kind {
            RecordKind::Hydrophone => Measurand::Pressure,
            RecordKind::HornTip | RecordKind::Vibrometer => Measurand::Velocity,
        };
        let together = ((DENSEST * record.series.step).recip() + 1e-9).floor().max(1.0) as usize;
        let signal = averaged(&record.series, together);
        let quiet = record.pretrigger / together;
        let noise_rms = match together {
            1 => record.noise_rms,
            // As the quiet samples have it after averaging; else as white noise.
            _ if quiet >= FEWEST_QUIET => mean_and_rms(&signal.values[..quiet]).1,
            _ => record.noise_rms / (together as f64).sqrt(),
        };
        Self {
            measurand,
            signal,
            noise_rms,
            bandwidth: record.bandwidth,
            response: record.response.clone(),
            rounding: rounding(record),
            speckle: 2.0 * record.series.step * record.speckle.powi(2),
            quiet,
            clipped: record.clipped,
            begins_late,
            origin: 0.0,
            masked: record.masked.iter().map(|masked| masked.gap).collect(),
            averages: record.averages,
        }
    }

    /// Passband of its instrument, if stated.
    pub fn passband(&self) -> Option<Passband> {
        self.bandwidth.map(|bandwidth| Passband::stated(bandwidth, MIDDLE))
    }

    /// Noise spectrum, if the quiet samples show a 1/f part.
    fn flicker(&self) -> Option<NoiseSpectrum> {
        NoiseSpectrum::of(&self.signal.values[..self.quiet.min(self.signal.len())], self.signal.step)
            .filter(|spectrum| spectrum.flicker > 0.0)
    }

    /// One-sided density of the noise in the compared band, given the signal below `cutoff` (Hz): white up to half the
    /// sample rate (converter), or up to the bandwidth (vibrometer), or in between, as the quiet samples show.
    fn noise_density(&self, filtered: &[f64], cutoff: f64) -> f64 {
        let half = 0.5 * self.signal.sample_rate();
        let (white, shaped) =
            (self.noise_rms.powi(2) / half, self.noise_rms.powi(2) / self.bandwidth.unwrap_or(half).min(half));
        // Clear of the motion that the filter spreads, and enough of them that their rms is known to a tenth.
        let clear = self.quiet.saturating_sub((2.0 / (cutoff * self.signal.step)).ceil() as usize);
        if (clear as f64) * self.signal.step * cutoff < 25.0 {
            return shaped;
        }
        (variance(&filtered[..clear]) / cutoff).clamp(white, shaped)
    }
}

/// Why a record cannot be fitted.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ObservationError {
    #[error(
        "every sample is {value} {}; check that the input was connected and that this is the right column (--channel)", measurand.unit()
    )]
    Constant {
        measurand: Measurand,
        /// That value, after the baseline is removed, unit of the measurand.
        value: f64,
    },
    #[error(
        "the noise of the record ({} rms) hides its onset: 6 σ exceeds a quarter of its peak ({}); average more shots, lower the bandwidth \
         (--read bandwidth=…), or record longer if the record ends before the bead moves", engineering(*noise, measurand.unit(), 2),
        engineering(*peak, measurand.unit(), 2)
    )]
    NoisyOnset {
        measurand: Measurand,
        /// σ, unit of the measurand.
        noise: f64,
        peak: f64,
    },
    #[error(
        "the record ends {available_cycles:.1} drive periods after its onset, expected at least {needed_cycles}; record \
         longer, or check --drive-frequency"
    )]
    TooShort { available_cycles: f64, needed_cycles: usize },
    #[error(
        "no features can be measured in the record; check its column (--channel), its unit and the drive frequency"
    )]
    Fingerprint(#[from] FingerprintError),
}

/// The record conditioned for the fit.
#[derive(Debug, Clone)]
pub struct Observation {
    /// The record at [`SAMPLES_PER_CYCLE`] a drive period, low-passed, m/s or Pa.
    pub trace: Series,
    pub fingerprint: Fingerprint,
    /// How runs are compared with it.
    pub comparison: Comparison,
    /// Warnings about parts left out, shown beside the verdict.
    pub warnings: Vec<String>,
}

impl Observation {
    /// Condition and reduce a record.
    ///
    /// - `drive`: what was driven with; the record is used no longer after its onset than the burst lasts
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
        let (noise_density, flicker) = match recording.flicker() {
            Some(NoiseSpectrum { white, flicker }) => (white, flicker),
            None => (recording.noise_density(&filtered, cutoff), 0.0),
        };
        let step = 1.0 / (drive_frequency * SAMPLES_PER_CYCLE as f64);
        let count = ((signal.end() - signal.start) / step).floor() as usize + 1;
        let resampler = Resampler::interpolating(signal.start, signal.step, signal.len(), signal.start, step, count);
        let trace = resampler.series(&filtered);
        let noise = NoiseSpectrum { white: noise_density, flicker }.variance(0.1 * drive_frequency, cutoff).sqrt();
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
        // At rest no trace is beyond the threshold within the first quarter of a period, nor, before a wave can have come through, beyond what an unknown
        // offset and noise explain.
        let unseen = f64::max(6.0 * noise, UNKNOWN_OFFSET * peak);
        let beginning = |samples: usize| &trace.values[..samples.min(trace.len())];
        let first = beginning(SAMPLES_PER_CYCLE / 4);
        let wavers = || {
            let unwavering = f64::max(WAVERS[0] * noise, WAVERS[1] * peak);
            variance(beginning(SAMPLES_PER_CYCLE)) > unwavering * unwavering
        };
        let moving =
            onset < first.len() || recording.quiet == 0 && (first.iter().any(|value| value.abs() > unseen) || wavers());
        let strength = Strength::of(&trace);
        // Nor is it soon as strong as it ever gets, where the drive is not: a bead may rest between two impulses just where its record begins.
        let sudden = strength.from_the_first
            && (recording.quiet as f64 * signal.step) * drive_frequency < SUDDEN
            && drive.ring_up() * drive_frequency > SUDDEN;
        let moving = moving || sudden;
        let mut warnings = Vec::new();
        let fingerprint = if moving || recording.begins_late {
            // Of a drive that begins inside its burst a run lacks what the chain did before.
            let settled = if recording.begins_late { SETTLED } else { 0.0 };
            let inside = |placed, level: f64, samples: usize| {
                let cycles = f64::min(samples as f64 / SAMPLES_PER_CYCLE as f64, drive_cycles) - settled;
                Fingerprint::inside(placed, measurand, set, (level, peak), cycles.max(0.0) as usize, drive_frequency)
            };
            let falls = strength.falls.filter(|_| drive.ends());
            let falling = falls.and_then(|fall| inside(Placed::Fall, strength.level, fall));
            let somewhere = || inside(Placed::Somewhere, threshold, trace.len() - onset).filter(|_| moving);
            let (needed, start) = (fingerprint.cycles_needed(), fingerprint.late_start());
            let (fingerprint, compared) = if let Some(falling) = falling {
                let compared = format!("only the {} periods before the response falls", falling.cycles_needed());
                (falling, compared)
            } else if let Some(somewhere) = somewhere() {
                let cycles = somewhere.cycles_needed();
                (somewhere, format!("only {cycles} periods, and where in the burst they lie is drawn into every run"))
            } else {
                (fingerprint.late_only(), format!("only the {} periods from the {start}th on", needed - start))
            };
            let which = if moving {
                "the record begins inside the response"
            } else {
                "the drive's record begins inside its burst"
            };
            warnings.push(format!(
                "{which}: early peaks and the extremes of the whole are not compared, {compared}; record from before the burst on"
            ));
            fingerprint
        } else {
            fingerprint
        };
        // On one clock; if the bead moves before the horn, they have two, and the bead's onset is the beginning of the burst.
        let began = trace.time(onset).min(recording.origin + begins);
        let early = drive_cycles - (trace.end() - began) * drive_frequency;
        if fingerprint.by_onset() && early > 0.0 && available < SHORT * drive_cycles.min(MOST_COMPARED) {
            warnings.push(format!(
                "the record ends {available:.1} drive periods after its onset, {early:.1} before the end of the burst: nothing later is compared; record to \
                 the end of the burst"
            ));
        }
        let features = fingerprint.measure(&trace)?;
        let bridged = |name: &str| match name {
            _ if recording.masked.is_empty() => 0.0,
            "band_4-8" => BRIDGED_NUGGET.1,
            _ => BRIDGED_NUGGET.0,
        };
        let nugget = |(early, name): (bool, &std::borrow::Cow<'_, str>)| {
            f64::hypot(if early { EARLY_NUGGET } else { LATE_NUGGET }, bridged(name))
        };
        let nuggets = fingerprint.early().into_iter().zip(&fingerprint.names()).map(nugget).collect();
        let Recording { bandwidth, clipped, .. } = *recording;
        let alignment = fingerprint.alignment_time(&trace)?;
        let masked = recording.masked.iter().map(|gap| gap.later(-alignment)).collect();
        let comparison = Comparison {
            cutoff,
            bandwidth,
            passband: recording.response.as_ref().and_then(|it| Passband::of(it, bandwidth, drive_frequency)),
            clipped,
            masked,
            sampling: signal.step,
            noise_density,
            flicker,
            rounding: recording.rounding,
            speckle: recording.speckle,
            noise_freedom: (2.0 * cutoff * recording.quiet as f64 * signal.step).max(UNSTATED_FREEDOM),
            averages: recording.averages,
            fingerprint: fingerprint.clone(),
            weights: vec![1.0; features.len()],
            features,
            nuggets,
            power: match measurand {
                Measurand::Velocity => POWER,
                Measurand::Pressure => PRESSURE_POWER,
            },
            sensitivity: 0.0,
        };
        Ok(Self { trace, fingerprint, comparison, warnings })
    }
}

/// Mean square about the mean, independent of an offset.
fn variance(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// White noise of rms 1 at 10 MHz, as a converter adds it behind a vibrometer of 0.5 MHz.
    fn recording(bandwidth: Option<f64>) -> Recording {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let values = (0..8000).map(|_| StandardNormal.sample(&mut random)).collect();
        let measurand = Measurand::Velocity;
        let signal = Series::new(0.0, 1e-7, values);
        Recording {
            measurand,
            signal,
            noise_rms: 1.0,
            bandwidth,
            response: None,
            rounding: 0.0,
            speckle: 0.0,
            quiet: 4000,
            clipped: [None; 2],
            begins_late: false,
            origin: 0.0,
            masked: vec![],
            averages: 1,
        }
    }

    #[test]
    fn noise_beyond_a_stated_band_follows_from_the_quiet_samples() {
        let cutoff = 1.25e6;
        let density = |recording: &Recording, shaped: bool| {
            let mut filtered = LowPass::new(1e-7, 8000, cutoff).apply(&recording.signal.values);
            if shaped {
                // As loud, all of it below 0.5 MHz.
                let low = LowPass::new(1e-7, 8000, 0.5e6).apply(&recording.signal.values);
                filtered = low.iter().map(|value| value * 10f64.sqrt()).collect();
            }
            recording.noise_density(&filtered, cutoff)
        };
        let (white, shaped) = (1.0 / 5e6, 1.0 / 0.5e6);
        assert!((density(&recording(Some(0.5e6)), false) / white - 1.0).abs() < 0.15);
        // Of 0.5 MHz 0.4 µs are independent: a thousand samples.
        assert!((density(&recording(Some(0.5e6)), true) * cutoff / (shaped * 0.5e6) - 1.0).abs() < 0.2);
        assert_eq!(density(&recording(None), false), white);
        let unseen = Recording { quiet: 100, ..recording(Some(0.5e6)) };
        assert_eq!(density(&unseen, false), shaped);
    }

    /// A bead that is heard 25 periods into its burst of 40: a record that ends 12 periods behind the burst does not end early,
    /// whether or not both clocks begin at the same instant; one that ends 10 periods before its end does.
    #[test]
    fn a_record_ends_early_by_the_clock_of_its_horn_not_by_its_late_onset() {
        let frequency = 73e3;
        let drive = granchain_model::scene::load("annulus", &["drive.cycles=40".to_owned()]).unwrap().drive;
        let said = |periods: f64, origin: f64| {
            let step = 1e-7;
            let value = |t: f64| {
                let after = (t - origin) * frequency - 25.0;
                if after < 0.0 { 0.0 } else { libm::sin(std::f64::consts::TAU * after) }
            };
            let values = (0..(periods / frequency / step) as usize).map(|i| value(i as f64 * step + origin)).collect();
            let signal = Series::new(origin, step, values);
            let recording = Recording { signal, noise_rms: 1e-3, quiet: 0, origin, ..recording(None) };
            Observation::new(&recording, &drive, FeatureSet::Full).unwrap().warnings
        };
        for origin in [0.0, -3e-3, 5e-3] {
            assert_eq!(said(52.0, origin), Vec::<String>::new(), "{origin}");
            let early = said(30.0 + 12.0, origin);
            assert_eq!(early, Vec::<String>::new(), "{origin}");
            let early = said(36.0, origin).join("");
            assert!(
                early.contains("ends 11.0 drive periods after its onset, 4.0 before the end of the burst"),
                "{early}"
            );
        }
    }

    #[test]
    fn an_input_is_clipped_at_the_ends_that_are_known() {
        let clipped = |limits| {
            let mut values = vec![-2.0, -0.5, 0.5, 2.0];
            clip(&mut values, limits);
            values
        };
        assert_eq!(clipped([None, None]), [-2.0, -0.5, 0.5, 2.0]);
        assert_eq!(clipped([None, Some(1.0)]), [-2.0, -0.5, 0.5, 1.0]);
        assert_eq!(clipped([Some(-1.0), Some(1.0)]), [-1.0, -0.5, 0.5, 1.0]);
    }
}
