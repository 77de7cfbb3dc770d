//! Fingerprint of a velocity or pressure record: logarithms of amplitudes that are reproducible although the motion is
//! chaotic.
//!
//! A trace of 40 samples a drive period (conditioned alike for lab and model) is reduced to
//!
//! - its two peaks, m/s or Pa;
//! - the mean over the late window of the per-period maximum and −minimum;
//! - of a velocity: rms in narrow bands around f0·{1/3, 1/2, 2/3, 1, 2, 3} and in four broad bands of the late window;
//! - of a pressure: rms in bands around the harmonics up to 1 MHz, and in one broad band below and one above f0 of the
//!   late window;
//! - the maximum and −minimum in cycles 0–3, 3–6, 6–9, 9–12 after the onset: during the ring-up the drive level rises,
//!   and chaos has not yet set in.
//!
//! The running mean over 12 drive periods is removed from the onset on. This takes out offset, drift and hum of the
//! instrument; lines at f0/2, f0/3, f0/4 and f0/6 pass unchanged, and bead motion has no content that slow.
//!
//! Each amplitude f enters as z = ½ ln(f² + (0.003 P)²), where P is the peak of the *record*. A vanishing line thus
//! has a floor, and no feature is divided by the line at the drive. The onset is the first crossing of a fixed
//! absolute threshold, so the trigger time of the record does not matter. A record that begins after the onset is
//! aligned by the decay after the burst, and only its late window is compared.

use std::borrow::Cow;

use thiserror::Error;

use super::{Measurand, alignment::fall};
use crate::{Series, about_running_mean, forward_transform};

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

/// Longest late window, periods of the drive.
const MOST_LATE: usize = 30;

/// Periods of the running mean that is taken off: whole ones of f0/2, f0/3, f0/4 and f0/6.
pub const MEAN_CYCLES: usize = 12;

/// Early windows after the onset, in cycles, with the names of the maximum and the minimum.
const EARLY_WINDOWS: [(f64, f64, &str, &str); 4] = [
    (0.0, 3.0, "early_positive_0-3", "early_negative_0-3"),
    (3.0, 6.0, "early_positive_3-6", "early_negative_3-6"),
    (6.0, 9.0, "early_positive_6-9", "early_negative_6-9"),
    (9.0, 12.0, "early_positive_9-12", "early_negative_9-12"),
];

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FeatureSet {
    Full,
    /// The two peaks and the ratios of the 1/3 and 2/3 lines to the line at the drive, as in the source paper; of a velocity.
    Paper,
}

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FingerprintError {
    #[error(
        "the {} stays below the onset threshold of {threshold:.4e} {} (its peak is {peak:.4e} {})",
        measurand.name(), measurand.unit(), measurand.unit()
    )]
    NoOnset {
        measurand: Measurand,
        /// Threshold, unit of the measurand.
        threshold: f64,
        /// Largest magnitude of the trace, unit of the measurand.
        peak: f64,
    },
    #[error(
        "the {} is nowhere as strong as where the record falls, {level:.4e} {} rms over three drive periods",
        measurand.name(), measurand.unit()
    )]
    NoFall {
        measurand: Measurand,
        /// Rms level, unit of the measurand.
        level: f64,
    },
    #[error("the trace has {available_cycles:.1} drive periods after its onset, expected at least {needed_cycles:.1}")]
    TooShort { available_cycles: f64, needed_cycles: f64 },
    #[error("the trace has {available_cycles:.1} drive periods before it falls, expected at least {needed_cycles:.1}")]
    TooSoon { available_cycles: f64, needed_cycles: f64 },
}

/// How traces are reduced: the same instance serves the record and every run compared with it.
#[derive(Debug, Clone)]
pub struct Fingerprint {
    measurand: Measurand,
    set: FeatureSet,
    bands: Vec<Band>,
    threshold: f64,
    scale: f64,
    late_start: usize,
    late_cycles: usize,
    early_windows: usize,
    placed: Placed,
    window: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placed {
    Onset,
    /// Aligned by the onset, but only the late window is used: the ring-up was not recorded.
    Late,
    /// Aligned by the first sample; its position in the response is unknown. Only the late window is used.
    Somewhere,
    /// Aligned by the decay after the burst; only the late window before it is used.
    Fall,
}

/// A band of the late window's spectrum: lower and upper edge in units of f0, and name.
#[derive(Debug, Clone)]
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

impl Fingerprint {
    /// A fingerprint for traces compared with one record, under a drive of that frequency (Hz). Of a pressure there is the whole set only.
    ///
    /// - `threshold`: onset threshold, m/s or Pa, see [`onset_threshold`](super::alignment::onset_threshold)
    /// - `scale`: P, the peak of the record, m/s or Pa
    /// - `cycles`: drive periods that may be used after the onset
    ///
    /// The late window begins 10 periods after the onset and lasts up to 30; a shorter record shortens both, the late
    /// window to a multiple of 6 periods where that leaves one (whole periods of f0/3 and of f0/2). Early windows that
    /// do not fit are left out. `None` below [`Fingerprint::FEWEST_CYCLES`].
    pub fn of(
        measurand: Measurand,
        set: FeatureSet,
        (threshold, scale): (f64, f64),
        cycles: usize,
        drive_frequency: f64,
    ) -> Option<Self> {
        if cycles < Self::FEWEST_CYCLES {
            return None;
        }
        let late_start = usize::min(10, cycles / 3);
        let left = usize::min(MOST_LATE, cycles - late_start);
        let late_cycles = if left >= 6 { left / 6 * 6 } else { 3 };
        let early_windows =
            EARLY_WINDOWS.iter().take_while(|window| window.1 <= (late_start + late_cycles) as f64).count();
        let placed = (Placed::Onset, late_start, late_cycles, early_windows);
        Some(Self::placed(measurand, set, (threshold, scale), placed, drive_frequency))
    }

    /// As [`Fingerprint::of`] for a record that begins after the onset: a late window of up to 30 periods (a multiple
    /// of 6) and nothing else.
    ///
    /// - `placed`: by the fall where that was recorded, else somewhere
    /// - `level`: rms of the fall, see [`Strength`](super::alignment::Strength), or onset threshold
    /// - `cycles`: periods that may be used before the fall, or from the beginning on; `None` below 6
    pub fn inside(
        placed: Placed,
        measurand: Measurand,
        set: FeatureSet,
        (level, scale): (f64, f64),
        cycles: usize,
        drive_frequency: f64,
    ) -> Option<Self> {
        let cycles = usize::min(MOST_LATE, cycles) / 6 * 6;
        (cycles > 0).then(|| Self::placed(measurand, set, (level, scale), (placed, 0, cycles, 0), drive_frequency))
    }

    fn placed(
        measurand: Measurand,
        set: FeatureSet,
        (threshold, scale): (f64, f64),
        (placed, late_start, late_cycles, early_windows): (Placed, usize, usize, usize),
        drive_frequency: f64,
    ) -> Self {
        let set = if measurand == Measurand::Pressure { FeatureSet::Full } else { set };
        let count = late_cycles * SAMPLES_PER_CYCLE;
        let window =
            (0..count).map(|i| (std::f64::consts::PI * (i as f64 + 0.5) / count as f64).sin().powi(2)).collect();
        let bands = bands(measurand, drive_frequency);
        Self { measurand, set, bands, threshold, scale, late_start, late_cycles, early_windows, placed, window }
    }

    /// The same for traces whose amplitudes are `factor` times as large.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { threshold: factor * self.threshold, scale: factor * self.scale, ..self }
    }

    /// The same without features before the late window, peaks included: for a drive record that begins inside the
    /// burst, so that the drive of the ring-up is unknown.
    #[must_use]
    pub fn late_only(self) -> Self {
        Self { early_windows: 0, placed: Placed::Late, ..self }
    }

    /// Fewest drive periods after the onset that make a fingerprint.
    pub const FEWEST_CYCLES: usize = 5;

    /// Names of the features, in the order of [`Fingerprint::measure`].
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

    pub fn measurand(&self) -> Measurand {
        self.measurand
    }

    /// Whether each feature is an early one (measured in the ring-up).
    pub fn early(&self) -> Vec<bool> {
        self.names().iter().map(|name| name.starts_with("early_")).collect()
    }

    /// The amplitude behind a value z: the inverse of ½ ln(f² + floor²), clipped at 0.
    pub fn amplitude(&self, index: usize, z: f64) -> f64 {
        ((2.0 * z).exp() - self.floor(index).powi(2)).max(0.0).sqrt()
    }

    /// The onset threshold, or the rms of the [decay](Fingerprint::falls), m/s or Pa.
    pub fn threshold(&self) -> f64 {
        self.threshold
    }

    /// Whether traces are aligned by their decay instead of their onset.
    pub fn falls(&self) -> bool {
        self.placed == Placed::Fall
    }

    /// Whether traces are aligned by their onset.
    pub fn by_onset(&self) -> bool {
        matches!(self.placed, Placed::Onset | Placed::Late)
    }

    /// Whether the position of the record within the response is unknown.
    pub fn lies_somewhere(&self) -> bool {
        self.placed == Placed::Somewhere
    }

    /// Alignment reference of a trace: the sample of its onset, or the start of its decay.
    pub fn alignment(&self, trace: &Series) -> Result<usize, FingerprintError> {
        let (measurand, threshold, values) = (self.measurand, self.threshold, &trace.values);
        if self.falls() {
            return fall(values, threshold).ok_or(FingerprintError::NoFall { measurand, level: threshold });
        }
        let onset = values.iter().position(|v| v.abs() >= threshold);
        onset.ok_or_else(|| FingerprintError::NoOnset { measurand, threshold, peak: trace.peak() })
    }

    /// Drive periods after the onset at which the late window begins.
    pub fn late_start(&self) -> usize {
        self.late_start
    }

    /// Drive periods a trace must have after its onset.
    pub fn cycles_needed(&self) -> usize {
        self.late_start + self.late_cycles
    }

    fn floor(&self, index: usize) -> f64 {
        if self.set == FeatureSet::Paper && index >= 2 { FLOOR } else { FLOOR * self.scale }
    }

    /// Reduce a conditioned trace (m/s or Pa, [`SAMPLES_PER_CYCLE`] samples a drive period) to its features z.
    pub fn measure(&self, trace: &Series) -> Result<Vec<f64>, FingerprintError> {
        let values = &trace.values;
        let alignment = self.alignment(trace)?;
        let [needed, late_start] = [self.cycles_needed(), self.late_start].map(|cycles| cycles * SAMPLES_PER_CYCLE);
        let available = if self.falls() { alignment } else { values.len() - alignment };
        if available < needed {
            let available_cycles = available as f64 / SAMPLES_PER_CYCLE as f64;
            let needed_cycles = self.cycles_needed() as f64;
            return Err(match self.placed {
                Placed::Fall => FingerprintError::TooSoon { available_cycles, needed_cycles },
                _ => FingerprintError::TooShort { available_cycles, needed_cycles },
            });
        }
        let looked_at = match self.placed {
            Placed::Onset => alignment..alignment + needed,
            Placed::Late | Placed::Somewhere => alignment + late_start..alignment + needed,
            Placed::Fall => alignment - needed..alignment,
        };
        let compared = about_running_mean(&values[looked_at], MEAN_CYCLES * SAMPLES_PER_CYCLE);
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
        let transform = forward_transform(input.len());
        let mut output = transform.make_output_vec();
        // Lengths agree by construction: both come from the plan.
        if transform.process(&mut input, &mut output).is_err() {
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

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::{super::alignment::Strength, *};

    fn of_velocity(threshold: f64, cycles: usize) -> Option<Fingerprint> {
        Fingerprint::of(Measurand::Velocity, FeatureSet::Full, (threshold, 0.3), cycles, 1.0)
    }

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
        let fingerprint = of_velocity(0.08, 40).unwrap();
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
        let fingerprint = of_velocity(0.05, 40).unwrap();
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
    fn the_harmonics_of_a_pressure_are_separated_up_to_1_mhz() {
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
        let fingerprint = of_velocity(0.05, 40).unwrap();
        let (early, late) =
            (fingerprint.measure(&burst(2.0)).unwrap(), fingerprint.measure(&burst(7.0 + 0.4 / 40.0)).unwrap());
        // 0.4 of a sample of the 40 a period moves an extreme by at most (2π·0.4/40)²/2 = 2e-3.
        assert!(early.iter().zip(&late).all(|(a, b)| (a - b).abs() < 1e-2), "{early:?} {late:?}");
    }

    #[test]
    fn the_beginning_of_a_record_drops_out_where_its_end_was_recorded() {
        // On from period 2 to 45, then a tail of a tenth.
        let whole = {
            let on = burst(2.0);
            let strength = |index: usize| if index < 45 * SAMPLES_PER_CYCLE { 1.0 } else { 0.1 };
            Series::new(0.0, on.step, on.values.iter().enumerate().map(|(i, v)| strength(i) * v).collect())
        };
        let cut = |from: usize, to: usize| {
            let values = whole.values[from * SAMPLES_PER_CYCLE..to * SAMPLES_PER_CYCLE].to_vec();
            Series::new(0.0, whole.step, values)
        };
        let strength = Strength::of(&whole);
        assert!(!strength.from_the_first && (strength.level / (0.5 * 0.025_f64.sqrt()) - 1.0).abs() < 0.02);
        // Three periods of which a quarter of the power is left.
        let fall = strength.falls.unwrap() as f64 / SAMPLES_PER_CYCLE as f64;
        assert!((43.5..46.5).contains(&fall), "{fall}");
        let measured = |trace: &Series| {
            let Strength { level, falls, .. } = Strength::of(trace);
            let cycles = falls.unwrap() / SAMPLES_PER_CYCLE;
            let of = |set| {
                Fingerprint::inside(Placed::Fall, Measurand::Velocity, set, (level, 0.3), cycles.min(24), 1.0).unwrap()
            };
            (of(FeatureSet::Full).measure(trace).unwrap(), of(FeatureSet::Paper).measure(trace).unwrap())
        };
        let expected = measured(&whole);
        for from in [9, 13, 20] {
            let late = cut(from, 60);
            assert!(Strength::of(&late).from_the_first);
            let found = measured(&late);
            let pairs = expected.0.iter().zip(&found.0).chain(expected.1.iter().zip(&found.1));
            for (a, b) in pairs {
                assert!((a - b).abs() < 1e-9, "{from}: {expected:?} {found:?}");
            }
        }
        assert!(Strength::of(&cut(9, 44)).falls.is_none() && Strength::of(&cut(9, 47)).falls.is_none());
        let fingerprint =
            Fingerprint::inside(Placed::Fall, Measurand::Velocity, FeatureSet::Full, (0.08, 0.3), 30, 1.0).unwrap();
        assert!(matches!(fingerprint.measure(&whole.map(|v| 0.1 * v)), Err(FingerprintError::NoFall { .. })));
        assert!(matches!(fingerprint.measure(&cut(20, 60)), Err(FingerprintError::TooSoon { .. })));
    }

    #[test]
    fn silence_has_no_onset_and_a_short_record_too_few_periods() {
        let fingerprint = of_velocity(0.05, 40).unwrap();
        let silent = burst(2.0).map(|value| 0.1 * value);
        assert!(matches!(fingerprint.measure(&silent), Err(FingerprintError::NoOnset { .. })));
        assert!(matches!(fingerprint.measure(&burst(30.0)), Err(FingerprintError::TooShort { .. })));
        assert!(of_velocity(0.05, 4).is_none());
    }
}
