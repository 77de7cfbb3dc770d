//! All features of one trace.

use serde::{Deserialize, Serialize};

use super::{
    AbsentLine, FeatureError, Line, PeakSettings, Peaks, Ratio, Repetition, Window, amplitude_spectrum, bandwidth,
    lines, peaks, repetition, total_harmonic_distortion,
};
use crate::{Series, mean_and_rms};

/// Settings of the measurement, the same for lab and model.
#[derive(Debug, Clone, PartialEq)]
pub struct FeatureSettings {
    /// f0, Hz, refined from the drive record.
    pub drive_frequency: f64,
    /// Window in which the drive is on; `None`: the whole trace.
    pub window: Option<Window>,
    /// Rms of the noise in this trace, unit of the series; 0 for none.
    pub noise_rms: f64,
    /// Bandwidth up to which that noise is white, Hz; `None`: up to the Nyquist frequency.
    pub noise_bandwidth: Option<f64>,
    /// Highest harmonic counted as distortion, Hz; `None`: 0.8 of the Nyquist frequency.
    pub band: Option<f64>,
    /// SI unit of the series, written beside the values, such as `m/s`.
    pub unit: String,
}

impl FeatureSettings {
    /// A noise-free velocity trace in the window.
    pub fn velocity(drive_frequency: f64, window: Window) -> Self {
        Self {
            drive_frequency,
            window: Some(window),
            noise_rms: 0.0,
            noise_bandwidth: None,
            band: None,
            unit: "m/s".to_owned(),
        }
    }
}

/// All features of one trace. Amplitudes are in `unit`, an SI unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Features {
    /// SI unit of every amplitude below.
    pub unit: String,
    pub drive_frequency_hz: f64,
    /// The window measured in, s.
    pub window: Window,
    /// Sample rate of the trace, Hz.
    pub sample_rate_hz: f64,
    /// Noise assumed in the trace, in `unit`.
    pub noise_rms: f64,
    pub peaks: Peaks,
    /// Rms about the mean, in `unit`.
    pub rms: f64,
    pub lines: Vec<Line>,
    pub absent: Vec<AbsentLine>,
    /// Median amplitude outside the lines, in `unit`; `None` if the window is too short.
    pub noise_floor: Option<f64>,
    /// Rms of the drive's harmonics over the total rms, 1.
    pub thd: f64,
    /// Highest frequency at −6 dB re the drive line, Hz.
    pub bandwidth_hz: Option<f64>,
    /// Highest frequency at −20 dB re the drive line, Hz.
    pub bandwidth_20db_hz: Option<f64>,
    /// Impulse train, if there are two impulses or more.
    pub repetition: Option<Repetition>,
}

impl Features {
    /// The line of a ratio, if it could be measured.
    pub fn line(&self, ratio: Ratio) -> Option<&Line> {
        self.lines.iter().find(|line| line.ratio == ratio)
    }
}

/// Measure everything.
pub fn measure(series: &Series, settings: &FeatureSettings) -> Result<Features, FeatureError> {
    let frequency = settings.drive_frequency;
    super::line::check(series, frequency)?;
    let window = settings.window.unwrap_or_else(|| Window::whole(series)).on(series)?;
    let samples = &series.values[window.indices(series)];
    let (_, rms) = mean_and_rms(samples);

    let noise = PeakSettings { noise_rms: settings.noise_rms, noise_bandwidth: settings.noise_bandwidth };
    let peaks = peaks(series, window, &noise)?;
    let spectrum = amplitude_spectrum(series, window)?;
    let noise_floor = spectrum.noise_floor(frequency);
    let (lines, absent) = lines(series, window, frequency, Some(&spectrum))?;
    let drive = super::line_amplitude(series, window, frequency);
    Ok(Features {
        unit: settings.unit.clone(),
        drive_frequency_hz: frequency,
        window,
        sample_rate_hz: series.sample_rate(),
        noise_rms: settings.noise_rms,
        peaks,
        rms,
        lines,
        absent,
        noise_floor,
        thd: total_harmonic_distortion(series, window, frequency, settings.band)?,
        bandwidth_hz: bandwidth(&spectrum, drive, -6.0),
        bandwidth_20db_hz: bandwidth(&spectrum, drive, -20.0),
        repetition: repetition(series, window, frequency, peaks.positive)?,
    })
}
