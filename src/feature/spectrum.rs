//! Amplitude spectrum on the grid of an FFT.

use realfft::RealFftPlanner;
use serde::{Deserialize, Serialize};

use super::{FeatureError, Window, line};
use crate::signal::Series;

/// Samples of zeros appended, as a factor on the length: four points a bin, so that no line is read more than 0.1 dB
/// low (Hann's scalloping at an eighth of a bin).
const PADDING: usize = 4;

/// A(f) of [`line_amplitude`](super::line_amplitude) at f = k·`step_hz`, k = 0, 1, …
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AmplitudeSpectrum {
    /// Distance of the points, Hz: a quarter of the window's resolution or less.
    pub step_hz: f64,
    /// The window's own resolution 1/T, Hz.
    pub resolution_hz: f64,
    /// Amplitudes, unit of the series.
    pub amplitudes: Vec<f64>,
}

/// Amplitude spectrum of the window: mean removed, Hann taper, coherent gain removed.
///
/// A(f) = 2 |Σ w (x − x̄) e^(−2πi f t)| / Σ w (half that at 0 Hz and at the Nyquist frequency): a steady tone of
/// amplitude A reads A at its line. Zero-padded to four points a bin at least.
///
/// # Errors
/// A series that is empty or not finite, a window outside it.
pub fn amplitude_spectrum(series: &Series, window: Window) -> Result<AmplitudeSpectrum, FeatureError> {
    line::check_finite(series)?;
    let window = window.on(series)?;
    let range = window.indices(series);
    let padded = (PADDING * range.len()).next_power_of_two();
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(padded);
    let mut input = plan.make_input_vec();
    let mut output = plan.make_output_vec();
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
    // Cannot fail: both buffers were made by the plan.
    let _ = plan.process(&mut input, &mut output);
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

impl AmplitudeSpectrum {
    /// Frequency of point `index`, Hz.
    #[must_use]
    pub fn frequency(&self, index: usize) -> f64 {
        index as f64 * self.step_hz
    }

    /// Amplitude of what is no line: the median of the points from f0/8 to 8 f0 (at most 0.8 of the Nyquist
    /// frequency), unit of the series.
    ///
    /// Lines fill the lesser part of the spectrum when the window holds 16 drive periods or more; with fewer the
    /// floor cannot be told from the lines and `None` is returned. White noise of rms σ over n samples has the floor
    /// 2σ √(3/(2n)) √(ln 2). In a chaotic response the floor is its broadband part.
    #[must_use]
    pub fn noise_floor(&self, drive_frequency: f64) -> Option<f64> {
        if drive_frequency < 16.0 * self.resolution_hz {
            return None;
        }
        let nyquist = self.frequency(self.amplitudes.len() - 1);
        let highest = (8.0 * drive_frequency).min(super::USABLE_NYQUIST_FRACTION * nyquist);
        let first = (drive_frequency / 8.0 / self.step_hz).ceil() as usize;
        let past = ((highest / self.step_hz) as usize + 1).min(self.amplitudes.len());
        let mut band = self.amplitudes.get(first..past)?.to_vec();
        if band.is_empty() {
            return None;
        }
        let middle = band.len() / 2;
        Some(*band.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// Amplitude of what is no line around `frequency` (Hz): the median that noise would have there, from the lower
    /// quartile of the points within half a drive frequency (f0/8 to 0.8 of the Nyquist frequency), × √(ln 2/ln 4⁄3).
    ///
    /// The quartile leaves room for lines in three quarters of the band; a steeply falling broadband part is followed.
    /// `None` as for [`noise_floor`](Self::noise_floor).
    #[must_use]
    pub fn local_floor(&self, frequency: f64, drive_frequency: f64) -> Option<f64> {
        if drive_frequency < 16.0 * self.resolution_hz {
            return None;
        }
        let nyquist = self.frequency(self.amplitudes.len() - 1);
        let lowest = (frequency - 0.5 * drive_frequency).max(drive_frequency / 8.0);
        let highest = (frequency + 0.5 * drive_frequency).min(super::USABLE_NYQUIST_FRACTION * nyquist);
        let first = (lowest / self.step_hz).ceil() as usize;
        let past = ((highest / self.step_hz) as usize + 1).min(self.amplitudes.len());
        let mut band = self.amplitudes.get(first..past)?.to_vec();
        if band.len() < 16 {
            return None;
        }
        let quarter = band.len() / 4;
        let quartile = *band.select_nth_unstable_by(quarter, f64::total_cmp).1;
        Some(quartile * (2.0_f64.ln() / (4.0_f64 / 3.0).ln()).sqrt())
    }
}
