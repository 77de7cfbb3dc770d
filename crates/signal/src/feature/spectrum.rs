//! Amplitude spectrum on the grid of an FFT.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use super::{FeatureError, Window, line};
use crate::{Series, forward_transform};

/// Samples of zeros appended, as a factor on the length: four points a bin, so that no line is read more than 0.1 dB
/// low (Hann's scalloping at an eighth of a bin).
const PADDING: usize = 4;

/// Longest window padded to four points a bin, samples. Padding a longer one would take seven times the size of the
/// record's file; lines are evaluated at their own frequency in any case.
const LONGEST_PADDED: usize = 1 << 20;

/// A(f) of [`line_amplitude`](super::line_amplitude) at f = k·`step_hz`, k = 0, 1, …
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AmplitudeSpectrum {
    /// Distance of the points, Hz: at most a quarter of the window's resolution; at most the resolution in windows of
    /// more than 2²⁰ samples.
    pub step_hz: f64,
    /// The window's own resolution 1/T, Hz.
    pub resolution_hz: f64,
    /// Amplitudes, unit of the series.
    pub amplitudes: Vec<f64>,
}

/// Amplitude spectrum of the window: mean removed, Hann taper, coherent gain removed.
///
/// A(f) = 2 |Σ w (x − x̄) e^(−2πi f t)| / Σ w (half that at 0 Hz and at the Nyquist frequency): a steady tone of
/// amplitude A reads A at its line. Zero-padded to four points a bin at least; in windows of more than 2²⁰ samples to one, where a line between two points
/// is read up to 1.4 dB low.
pub fn amplitude_spectrum(series: &Series, window: Window) -> Result<AmplitudeSpectrum, FeatureError> {
    line::check_finite(series)?;
    let window = window.on(series)?;
    let range = window.indices(series);
    let padded = points(range.len());
    let plan = forward_transform(padded);
    let mut input = plan.make_input_vec();
    let (mut weight, mut offset) = (0.0, 0.0);
    let taper = |index: usize| {
        let phase = (series.time(index) - window.from) / window.duration();
        (std::f64::consts::PI * phase).sin().powi(2)
    };
    for index in range.clone() {
        weight += taper(index);
        offset += taper(index) * series.values[index];
    }
    let mean = if weight > 0.0 { offset / weight } else { 0.0 };
    for (slot, index) in input.iter_mut().zip(range) {
        *slot = taper(index) * (series.values[index] - mean);
    }
    let mut output = plan.make_output_vec();
    // Cannot fail: both buffers were made by the plan.
    let _ = plan.process(&mut input, &mut output);
    drop(input);
    let gain = if weight > 0.0 { 2.0 / weight } else { 0.0 };
    let last = output.len() - 1;
    let amplitudes = output
        .iter()
        .enumerate()
        .map(|(index, value)| value.norm() * if index == 0 || index == last { 0.5 * gain } else { gain })
        .collect();
    Ok(AmplitudeSpectrum {
        step_hz: series.sample_rate() / padded as f64,
        resolution_hz: 1.0 / window.duration(),
        amplitudes,
    })
}

/// Length of the transform for a window of `samples`: even, with small prime factors.
fn points(samples: usize) -> usize {
    if samples <= LONGEST_PADDED {
        return (PADDING * samples).next_power_of_two();
    }
    let least = |odd: usize| odd * samples.div_ceil(odd).next_power_of_two();
    least(1).min(least(3)).min(least(5))
}

/// The point (frequency, amplitude) of largest amplitude, the first of equals; (0, 0) if none is positive.
pub(super) fn largest(points: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    points.fold((0.0, 0.0), |best, point| if point.1 > best.1 { point } else { best })
}

impl AmplitudeSpectrum {
    /// Frequency of point `index`, Hz.
    pub fn frequency(&self, index: usize) -> f64 {
        index as f64 * self.step_hz
    }

    /// Point of largest amplitude in a band: frequency (Hz) and amplitude; (0, 0) if none is positive.
    pub(super) fn largest(&self, band: RangeInclusive<f64>) -> (f64, f64) {
        let points = self.amplitudes.iter().enumerate().map(|(index, &amplitude)| (self.frequency(index), amplitude));
        largest(points.filter(|(frequency, _)| band.contains(frequency)))
    }

    /// Noise floor: the median of the points from f0/8 to 8 f0 (at most 0.8 of the Nyquist frequency), unit of the
    /// series.
    ///
    /// Lines fill the lesser part of the spectrum when the window holds 16 drive periods or more; with fewer the
    /// floor cannot be distinguished from the lines and `None` is returned. White noise of rms σ over n samples has the floor
    /// 2σ √(3/(2n)) √(ln 2). In a chaotic response the floor is its broadband part.
    pub fn noise_floor(&self, drive_frequency: f64) -> Option<f64> {
        self.quantile(drive_frequency, [drive_frequency / 8.0, 8.0 * drive_frequency], 2, 1)
    }

    /// Noise floor around `frequency` (Hz): the median of the noise, estimated from the lower quartile of the points
    /// within half a drive frequency (f0/8 to 0.8 of the Nyquist frequency), × √(ln 2/ln 4⁄3).
    ///
    /// The quartile leaves room for lines in three quarters of the band; a steeply falling broadband part is followed.
    /// `None` as for [`noise_floor`](Self::noise_floor).
    pub fn local_floor(&self, frequency: f64, drive_frequency: f64) -> Option<f64> {
        let lowest = (frequency - 0.5 * drive_frequency).max(drive_frequency / 8.0);
        let quartile = self.quantile(drive_frequency, [lowest, frequency + 0.5 * drive_frequency], 4, 16)?;
        Some(quartile * (2.0_f64.ln() / (4.0_f64 / 3.0).ln()).sqrt())
    }

    /// The 1/`part` quantile of the points of a band, Hz, up to 0.8 of the Nyquist frequency; `None` of fewer than `fewest`, and in a window of fewer than
    /// 16 drive periods.
    fn quantile(&self, drive_frequency: f64, [lowest, highest]: [f64; 2], part: usize, fewest: usize) -> Option<f64> {
        if drive_frequency < 16.0 * self.resolution_hz {
            return None;
        }
        let nyquist = self.frequency(self.amplitudes.len() - 1);
        let highest = highest.min(super::USABLE_NYQUIST_FRACTION * nyquist);
        let first = (lowest / self.step_hz).ceil() as usize;
        let past = ((highest / self.step_hz) as usize + 1).min(self.amplitudes.len());
        let mut band = self.amplitudes.get(first..past)?.to_vec();
        let rank = band.len() / part;
        (band.len() >= fewest).then(|| *band.select_nth_unstable_by(rank, f64::total_cmp).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_window_is_not_padded_fourfold() {
        assert_eq!(points(1000), 4096);
        assert_eq!(points(1 << 20), 1 << 22);
        for samples in [(1 << 20) + 1, 3_000_000, 10_000_000, 41_943_041] {
            let points = points(samples);
            assert!(
                points >= samples && 3 * points <= 4 * samples + 64 && points.is_multiple_of(2),
                "{samples}: {points}"
            );
        }
    }

    #[test]
    fn a_tone_of_a_long_window_reads_its_amplitude() {
        let (rate, tone) = (1e8, 73e3);
        let series = Series::new(
            0.0,
            1.0 / rate,
            (0..1_200_000).map(|i| (std::f64::consts::TAU * tone * f64::from(i) / rate).sin()).collect(),
        );
        let spectrum = amplitude_spectrum(&series, Window::whole(&series)).unwrap();
        assert!(spectrum.step_hz <= spectrum.resolution_hz);
        let (frequency, amplitude) = spectrum.largest(0.0..=0.5 * rate);
        assert!((frequency - tone).abs() <= spectrum.step_hz, "{frequency}");
        assert!((0.85..=1.0 + 1e-6).contains(&amplitude), "{amplitude}");
    }
}
