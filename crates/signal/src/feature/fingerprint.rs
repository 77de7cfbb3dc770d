//! The fingerprint of a record, a bead's velocity or the pressure in the water: absolute amplitudes that survive chaos, in logarithms.
//!
//! A trace of 40 samples a drive period (conditioned alike for lab and model) is reduced to
//!
//! - its two peaks, m/s or Pa;
//! - the mean over the late window of the per-period maximum and −minimum;
//! - of a velocity: rms in narrow bands around f0·{1/3, 1/2, 2/3, 1, 2, 3} and in four broad bands of the late window;
//! - of a pressure: rms in bands around the harmonics up to 1 MHz, and in one broad band below and one above f0 of the late window;
//! - the maximum and −minimum in cycles 0–3, 3–6, 6–9, 9–12 after the onset: the ring-up is a free sweep of
//!   drive level before chaos forgets.
//!
//! All of them about the running mean over 12 drive periods from the onset on: offset, drift and hum of an instrument stay outside, lines at
//! f0/2, f0/3, f0/4 and f0/6 pass as they are, and a bead that stays where it is has no velocity as slow as that.
//!
//! Each amplitude f enters as z = ½ ln(f² + (0.003 P)²), P the peak of the *record*, so that a vanishing line has a
//! floor and nothing is divided by the line at the drive. The onset is the first crossing of one fixed absolute
//! threshold, so the trigger of the record drops out.

use std::{borrow::Cow, sync::Arc};

use realfft::{RealFftPlanner, RealToComplex};
use thiserror::Error;

use super::Measurand;
use crate::{Series, about_running_mean};

/// Samples a drive period of a conditioned trace.
pub const SAMPLES_PER_CYCLE: usize = 40;

/// Floor of every amplitude, relative to the peak of the record.
const FLOOR: f64 = 0.003;

/// Narrow bands: centre and half-width in units of f0, and name.
const NARROW_BANDS: [(f64, f64, &str); 6] = [
    (1.0 / 3.0, 0.05, "band_1/3"),
    (0.5, 0.05, "band_1/2"),
    (2.0 / 3.0, 0.05, "band_2/3"),
    (1.0, 0.05, "band_1"),
    (2.0, 0.1, "band_2"),
    (3.0, 0.15, "band_3"),
];

/// Broad bands: lower and upper edge in units of f0, and name.
const BROAD_BANDS: [(f64, f64, &str); 4] = [
    (0.12, 0.95, "band_0.12-0.95"),
    (1.05, 1.95, "band_1.05-1.95"),
    (2.05, 4.0, "band_2.05-4"),
    (4.0, 8.0, "band_4-8"),
];

/// Highest frequency of a harmonic of the pressure that is compared, Hz.
const HIGHEST_HARMONIC: f64 = 1e6;

/// Half-width of its band, in units of f0: the lines between harmonics stay outside.
const HARMONIC_HALF_WIDTH: f64 = 0.25;

/// Periods of the running mean that is taken off: whole ones of f0/2, f0/3, f0/4 and f0/6.
pub const MEAN_CYCLES: usize = 12;

/// Early windows after the onset, in cycles, with the names of the maximum and the minimum.
const EARLY_WINDOWS: [(f64, f64, &str, &str); 4] = [
    (0.0, 3.0, "early_positive_0-3", "early_negative_0-3"),
    (3.0, 6.0, "early_positive_3-6", "early_negative_3-6"),
    (6.0, 9.0, "early_positive_6-9", "early_negative_6-9"),
    (9.0, 12.0, "early_positive_9-12", "early_negative_9-12"),
];

/// Which amplitudes are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FeatureSet {
    /// All of them.
    Full,
    /// The two peaks and the ratios of the 1/3 and 2/3 lines to the line at the drive, as in the source paper; of a velocity.
    Paper,
}

/// Why a trace has no fingerprint.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FingerprintError {
    /// The trace never crosses the onset threshold.
    #[error(
        "the {} stays below the onset threshold of {threshold:.4e} {} (its peak is {peak:.4e} {})",
        measurand.name(), measurand.unit(), measurand.unit()
    )]
    NoOnset {
        /// What the trace is of.
        measurand: Measurand,
        /// The threshold, unit of the measurand.
        threshold: f64,
        /// Largest value of the trace in size, likewise.
        peak: f64,
    },
    /// The trace ends too early after its onset.
    #[error("the trace has {available_cycles:.1} drive periods after its onset, expected at least {needed_cycles:.1}")]
    TooShort {
        /// Periods after the onset.
        available_cycles: f64,
        /// Periods needed.
        needed_cycles: f64,
    },
}

/// How traces are reduced: the same instance serves the record and every run compared with it.
#[derive(Clone)]
pub struct Fingerprint {
    measurand: Measurand,
    set: FeatureSet,
    bands: Vec<Band>,
    threshold: f64,
    scale: f64,
    late_start: usize,
    late_cycles: usize,
    early_windows: usize,
    /// Whether only the late window is looked at: the ring-up was not recorded.
    late_only: bool,
    window: Vec<f64>,
    transform: Arc<dyn RealToComplex<f64>>,
}

/// A band of the late window's spectrum: lower and upper edge in units of f0, and name.
#[derive(Clone)]
struct Band(f64, f64, Cow<'static, str>);

/// The bands of a measurand's fingerprint under a drive of that frequency, Hz.
fn bands(measurand: Measurand, drive_frequency: f64) -> Vec<Band> {
    let around = |centre: f64, half: f64, name| Band(centre - half, centre + half, name);
    match measurand {
        Measurand::Velocity => {
            let narrow = NARROW_BANDS.iter().map(|band| around(band.0, band.1, Cow::Borrowed(band.2)));
            let broad = BROAD_BANDS.iter().map(|band| Band(band.0, band.1, Cow::Borrowed(band.2)));
            narrow.chain(broad).collect()
        }
        Measurand::Pressure => {
            let highest = (HIGHEST_HARMONIC / drive_frequency).floor().clamp(1.0, 16.0) as u32;
            let harmonics = (1..=highest)
                .map(|order| around(f64::from(order), HARMONIC_HALF_WIDTH, Cow::Owned(format!("band_{order}"))));
            let broad = BROAD_BANDS[..2].iter().map(|band| Band(band.0, band.1, Cow::Borrowed(band.2)));
            harmonics.chain(broad).collect()
        }
    }
}

impl std::fmt::Debug for Fingerprint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Fingerprint")
            .field("measurand", &self.measurand)
            .field("set", &self.set)
            .field("threshold", &self.threshold)
            .field("scale", &self.scale)
            .field("late_start", &self.late_start)
            .field("late_cycles", &self.late_cycles)
            .finish_non_exhaustive()
    }
}

impl Fingerprint {
    /// A fingerprint for traces compared with one record of a velocity.
    ///
    /// - `threshold`: onset threshold, m/s, see [`onset_threshold`]
    /// - `scale`: P, the peak of the record, m/s
    /// - `cycles`: drive periods that may be used after the onset
    ///
    /// The late window begins 10 periods after the onset and lasts up to 30; a shorter record shortens both, the late
    /// window to a multiple of 6 periods where that leaves one (whole periods of f0/3 and of f0/2). Early windows that
    /// do not fit are left out. `None` below [`Fingerprint::FEWEST_CYCLES`].
    #[must_use]
    pub fn new(set: FeatureSet, threshold: f64, scale: f64, cycles: usize) -> Option<Self> {
        // No band of a velocity depends on the drive's frequency.
        Self::of(Measurand::Velocity, set, (threshold, scale), cycles, 1.0)
    }

    /// As [`Fingerprint::new`] for any measurand, threshold and peak of the record in its unit, under a drive of that frequency (Hz). Of a
    /// pressure there is the whole set only.
    #[must_use]
    pub fn of(
        measurand: Measurand,
        set: FeatureSet,
        (threshold, scale): (f64, f64),
        cycles: usize,
        drive_frequency: f64,
    ) -> Option<Self> {
        let set = if measurand == Measurand::Pressure { FeatureSet::Full } else { set };
        if cycles < Self::FEWEST_CYCLES {
            return None;
        }
        let late_start = usize::min(10, cycles / 3);
        let left = usize::min(30, cycles - late_start);
        let late_cycles = if left >= 6 { left / 6 * 6 } else { 3 };
        let early_windows =
            EARLY_WINDOWS.iter().take_while(|window| window.1 <= (late_start + late_cycles) as f64).count();
        let count = late_cycles * SAMPLES_PER_CYCLE;
        let window =
            (0..count).map(|i| (std::f64::consts::PI * (i as f64 + 0.5) / count as f64).sin().powi(2)).collect();
        let transform = RealFftPlanner::new().plan_fft_forward(count);
        let bands = bands(measurand, drive_frequency);
        Some(Self {
            measurand,
            set,
            bands,
            threshold,
            scale,
            late_start,
            late_cycles,
            early_windows,
            late_only: false,
            window,
            transform,
        })
    }

    /// The same for traces of which every amplitude is `factor` times as large.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { threshold: factor * self.threshold, scale: factor * self.scale, ..self }
    }

    /// The same without what is measured before the late window, peaks included: for a record that begins inside its burst, whose ring-up nobody
    /// saw.
    #[must_use]
    pub fn late_only(self) -> Self {
        Self { early_windows: 0, late_only: true, ..self }
    }

    /// Fewest drive periods after the onset that make a fingerprint.
    pub const FEWEST_CYCLES: usize = 5;

    /// Names of the features, in the order of [`Fingerprint::measure`].
    #[must_use]
    pub fn names(&self) -> Vec<Cow<'static, str>> {
        match self.set {
            FeatureSet::Paper => ["positive_peak", "negative_peak", "ratio_1/3", "ratio_2/3"].map(Cow::Borrowed).into(),
            FeatureSet::Full => {
                let mut names: Vec<Cow<'static, str>> =
                    ["positive_peak", "negative_peak", "mean_maximum", "mean_minimum"].map(Cow::Borrowed).into();
                names.extend(self.bands.iter().map(|band| band.2.clone()));
                for window in &EARLY_WINDOWS[..self.early_windows] {
                    names.extend([window.2, window.3].map(Cow::Borrowed));
                }
                names
            }
        }
    }

    /// What it is of.
    #[must_use]
    pub fn measurand(&self) -> Measurand {
        self.measurand
    }

    /// Whether each feature is an early one (measured in the ring-up).
    #[must_use]
    pub fn early(&self) -> Vec<bool> {
        self.names().iter().map(|name| name.starts_with("early_")).collect()
    }

    /// The amplitude behind a value z: the inverse of ½ ln(f² + floor²), clipped at 0.
    #[must_use]
    pub fn amplitude(&self, index: usize, z: f64) -> f64 {
        ((2.0 * z).exp() - self.floor(index).powi(2)).max(0.0).sqrt()
    }

    /// The onset threshold, m/s or Pa.
    #[must_use]
    pub fn threshold(&self) -> f64 {
        self.threshold
    }

    /// Drive periods after the onset at which the late window begins.
    #[must_use]
    pub fn late_start(&self) -> usize {
        self.late_start
    }

    /// Drive periods a trace must have after its onset.
    #[must_use]
    pub fn cycles_needed(&self) -> usize {
        self.late_start + self.late_cycles
    }

    fn floor(&self, index: usize) -> f64 {
        if self.set == FeatureSet::Paper && index >= 2 { FLOOR } else { FLOOR * self.scale }
    }

    /// Reduce a conditioned trace (m/s or Pa, [`SAMPLES_PER_CYCLE`] samples a drive period) to its features z.
    ///
    /// # Errors
    /// No onset, or too few periods after it.
    pub fn measure(&self, trace: &Series) -> Result<Vec<f64>, FingerprintError> {
        let values = &trace.values;
        let onset = values.iter().position(|v| v.abs() >= self.threshold).ok_or_else(|| FingerprintError::NoOnset {
            measurand: self.measurand,
            threshold: self.threshold,
            peak: trace.peak(),
        })?;
        let after = &values[onset..];
        let needed = self.cycles_needed() * SAMPLES_PER_CYCLE;
        if after.len() < needed {
            return Err(FingerprintError::TooShort {
                available_cycles: after.len() as f64 / SAMPLES_PER_CYCLE as f64,
                needed_cycles: self.cycles_needed() as f64,
            });
        }
        let late_start = self.late_start * SAMPLES_PER_CYCLE;
        let compared = about_running_mean(
            &after[if self.late_only { late_start } else { 0 }..needed],
            MEAN_CYCLES * SAMPLES_PER_CYCLE,
        );
        let late = &compared[compared.len() - (needed - late_start)..];
        let power = self.power(late);
        let (highest, lowest) = extremes(&compared);
        let mut amplitudes = vec![highest, -lowest];
        match self.set {
            FeatureSet::Paper => {
                // Amplitude of a line ∝ root of the power at its own bin: the late window holds whole periods of f0/3.
                let line = |ratio: f64| power[(ratio * self.late_cycles as f64).round() as usize].sqrt();
                let drive = line(1.0).max(f64::MIN_POSITIVE);
                amplitudes.extend([line(1.0 / 3.0) / drive, line(2.0 / 3.0) / drive]);
            }
            FeatureSet::Full => {
                let (mut maximum, mut minimum) = (0.0, 0.0);
                for cycle in late.chunks_exact(SAMPLES_PER_CYCLE) {
                    let (high, low) = extremes(cycle);
                    maximum += high / self.late_cycles as f64;
                    minimum += low / self.late_cycles as f64;
                }
                amplitudes.extend([f64::max(maximum, 0.0), f64::max(-minimum, 0.0)]);
                amplitudes.extend(self.bands.iter().map(|band| self.band_rms(&power, band.0, band.1)));
                for (from, to, _, _) in &EARLY_WINDOWS[..self.early_windows] {
                    let cycles = SAMPLES_PER_CYCLE as f64;
                    let (high, low) = extremes(&compared[(from * cycles) as usize..(to * cycles) as usize]);
                    amplitudes.extend([high.max(0.0), (-low).max(0.0)]);
                }
            }
        }
        Ok(amplitudes
            .iter()
            .enumerate()
            .map(|(index, amplitude)| 0.5 * (amplitude.powi(2) + self.floor(index).powi(2)).ln())
            .collect())
    }

    /// One-sided power (unit of the trace squared) of the Hann-windowed late window in each bin of width f0 / `late_cycles`, its sum the
    /// mean square of the trace.
    fn power(&self, late: &[f64]) -> Vec<f64> {
        let mut input: Vec<f64> = late.iter().zip(&self.window).map(|(value, weight)| value * weight).collect();
        let mut output = self.transform.make_output_vec();
        // Lengths agree by construction: both come from the plan.
        if self.transform.process(&mut input, &mut output).is_err() {
            return vec![0.0; output.len()];
        }
        // Mean square of the Hann window sin² is 3/8.
        let scale = 2.0 / (0.375 * (late.len() as f64).powi(2));
        output.iter().map(|value| value.norm_sqr() * scale).collect()
    }

    fn band_rms(&self, power: &[f64], lower: f64, upper: f64) -> f64 {
        let cycles = self.late_cycles as f64;
        let slack = 1e-6;
        let first = (lower * cycles - slack).ceil().max(0.0) as usize;
        let last = ((upper * cycles + slack).floor() as usize).min(power.len() - 1);
        power[first.min(last)..=last].iter().sum::<f64>().sqrt()
    }
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::NEG_INFINITY, f64::INFINITY), |(high, low), &v| (high.max(v), low.min(v)))
}

/// The onset threshold of a record, m/s or Pa: between max(4 % P, 6 σ) and 25 % P, as far as possible (in ratio) from every
/// early extremum, so that neither noise nor a small change of the drive makes the onset slip by a cycle.
///
/// - `record`: conditioned velocity or pressure
/// - `noise_rms`: σ of the conditioned record, unit of the record
///
/// `None` when 6 σ exceeds 25 % of the peak: the onset cannot be told from noise.
#[must_use]
pub fn onset_threshold(record: &Series, noise_rms: f64) -> Option<f64> {
    const CANDIDATES: usize = 64;
    let peak = record.peak();
    let lowest = f64::max(0.04 * peak, 6.0 * noise_rms);
    let highest = 0.25 * peak;
    if !(lowest <= highest && peak > 0.0) {
        return None;
    }
    let magnitude: Vec<f64> = record.values.iter().map(|v| v.abs()).collect();
    let beyond = magnitude.iter().position(|&v| v >= highest)?;
    let noise = 4.0 * noise_rms;
    let extrema: Vec<f64> = (1..magnitude.len().saturating_sub(1))
        .take_while(|&i| i <= beyond + 2 * SAMPLES_PER_CYCLE)
        .filter(|&i| magnitude[i] >= magnitude[i - 1] && magnitude[i] > magnitude[i + 1] && magnitude[i] > noise)
        .map(|i| magnitude[i])
        .collect();
    let clearance =
        |threshold: f64| extrema.iter().map(|extremum| (extremum / threshold).ln().abs()).fold(f64::INFINITY, f64::min);
    let candidates = (0..=CANDIDATES).map(|i| lowest * (highest / lowest).powf(i as f64 / CANDIDATES as f64));
    candidates.map(|threshold| (clearance(threshold), threshold)).max_by(|a, b| a.0.total_cmp(&b.0)).map(|best| best.1)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// A burst that starts `delay` periods late: line amplitudes 0.1 at f0/3 and 0.2 at f0, m/s.
    fn burst(delay: f64) -> Series {
        let step = 1.0 / SAMPLES_PER_CYCLE as f64;
        let value = |i: usize| {
            let cycles = i as f64 * step - delay;
            if cycles < 0.0 { 0.0 } else { 0.2 * (TAU * cycles).sin() + 0.1 * (TAU * cycles / 3.0).sin() }
        };
        Series::new(0.0, step, (0..60 * SAMPLES_PER_CYCLE).map(value).collect())
    }

    #[test]
    fn offset_drift_and_hum_of_an_instrument_change_no_feature() {
        let fingerprint = Fingerprint::new(FeatureSet::Full, 0.08, 0.3, 40).unwrap();
        let clean = fingerprint.measure(&burst(2.0)).unwrap();
        for (offset, slope, hum) in [(0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01)] {
            let mut moved = burst(2.0);
            for (index, value) in moved.values.iter_mut().enumerate() {
                let cycles = index as f64 / SAMPLES_PER_CYCLE as f64;
                // 50 Hz of a drive at 73 kHz.
                *value += offset + slope * cycles / 52.0 + hum * (TAU * cycles * 50.0 / 73e3).sin();
            }
            let seen = fingerprint.measure(&moved).unwrap();
            for ((name, clean), seen) in fingerprint.names().iter().zip(&clean).zip(&seen) {
                // 5 % of the smallest peak without: the offset. What is left: a slope's share of 6 periods at the ends.
                assert!((clean - seen).abs() < 0.008, "{name}: {clean} {seen}");
            }
        }
    }

    #[test]
    fn band_amplitudes_are_the_lines_rms() {
        let fingerprint = Fingerprint::new(FeatureSet::Full, 0.05, 0.3, 40).unwrap();
        let z = fingerprint.measure(&burst(2.0)).unwrap();
        let amplitude = |name: &str| {
            let index = fingerprint.names().iter().position(|known| *known == name).unwrap();
            fingerprint.amplitude(index, z[index])
        };
        // Whole periods of both lines in the window: a Hann-windowed line lies in three bins, exactly.
        assert!((amplitude("band_1/3") - 0.1 / 2.0_f64.sqrt()).abs() < 1e-4);
        assert!((amplitude("band_1") - 0.2 / 2.0_f64.sqrt()).abs() < 1e-4);
        assert!(amplitude("band_1/2") < 1e-4 && amplitude("band_4-8") < 1e-4);
    }

    #[test]
    fn the_harmonics_of_a_pressure_are_told_apart_up_to_1_mhz() {
        // n-th harmonic of amplitude 100/n Pa, n up to 14, under a drive of 73 kHz.
        let step = 1.0 / SAMPLES_PER_CYCLE as f64;
        let value = |i: usize| {
            let cycles = i as f64 * step - 2.0;
            let harmonic = |n: u32| 100.0 / f64::from(n) * (TAU * f64::from(n) * cycles).sin();
            if cycles < 0.0 { 0.0 } else { (1..=14).map(harmonic).sum() }
        };
        let pressure = Series::new(0.0, step, (0..60 * SAMPLES_PER_CYCLE).map(value).collect());
        let fingerprint = Fingerprint::of(Measurand::Pressure, FeatureSet::Full, (20.0, 300.0), 40, 73e3).unwrap();
        let (names, z) = (fingerprint.names(), fingerprint.measure(&pressure).unwrap());
        for n in 1..=13 {
            let index = names.iter().position(|name| *name == format!("band_{n}")).unwrap();
            let found = fingerprint.amplitude(index, z[index]);
            assert!((found * f64::from(n) / (100.0 / 2.0_f64.sqrt()) - 1.0).abs() < 1e-3, "{n}: {found} Pa");
        }
        // 14 × 73 kHz lie above 1 MHz.
        assert!(!names.iter().any(|name| name == "band_14") && names.len() == 27, "{names:?}");
        let silent = fingerprint.measure(&pressure.map(|value| 0.01 * value)).unwrap_err().to_string();
        assert!(silent.contains("the pressure stays below") && silent.contains("Pa"), "{silent}");
    }

    #[test]
    fn the_trigger_drops_out() {
        let fingerprint = Fingerprint::new(FeatureSet::Full, 0.05, 0.3, 40).unwrap();
        let (early, late) =
            (fingerprint.measure(&burst(2.0)).unwrap(), fingerprint.measure(&burst(7.0 + 0.4 / 40.0)).unwrap());
        // 0.4 of a sample of the 40 a period moves an extreme by at most (2π·0.4/40)²/2 = 2e-3.
        assert!(early.iter().zip(&late).all(|(a, b)| (a - b).abs() < 1e-2), "{early:?} {late:?}");
    }

    #[test]
    fn silence_has_no_onset_and_a_short_record_too_few_periods() {
        let fingerprint = Fingerprint::new(FeatureSet::Full, 0.05, 0.3, 40).unwrap();
        let silent = burst(2.0).map(|value| 0.1 * value);
        assert!(matches!(fingerprint.measure(&silent), Err(FingerprintError::NoOnset { .. })));
        assert!(matches!(fingerprint.measure(&burst(30.0)), Err(FingerprintError::TooShort { .. })));
        assert!(Fingerprint::new(FeatureSet::Full, 0.05, 0.3, 4).is_none());
    }

    #[test]
    fn the_onset_threshold_keeps_clear_of_early_extrema() {
        let step = 1.0 / SAMPLES_PER_CYCLE as f64;
        // Lobes of 0.05, 0.1, 0.5, 1: the widest clear span between 4 % and 25 % of the peak is 0.1 … 0.25.
        let heights = [0.05, 0.1, 0.5, 1.0];
        let value = |i: usize| heights[(i / 20).min(3)] * (TAU * i as f64 * step).sin();
        let record = Series::new(0.0, step, (0..400).map(value).collect());
        let threshold = onset_threshold(&record, 1e-4).unwrap();
        assert!((0.2..=0.25).contains(&threshold), "{threshold}");
        assert!(onset_threshold(&record, 0.1).is_none());
    }
}
