//! Deviation of a response from a sine: distortion and bandwidth.

use super::{AmplitudeSpectrum, FeatureError, Window, amplitude_spectrum, line, line_amplitude};
use crate::Series;

/// Highest harmonic order evaluated at its own frequency. Higher orders use the FFT, since their number grows with the
/// length of the record.
const HIGHEST_SUMMED: u32 = 100;

/// Rms of the drive's harmonics over the total rms, √(Σ_{n ≥ 2} A_n²/2)/x_rms, 0…1.
///
/// - `drive_frequency`: f0, Hz; A_n is [`line_amplitude`] at n f0, for every n ≥ 2 with n f0 ≤ 0.8 of the Nyquist
///   frequency and at most `band`, where given; for n > 100 it is the nearest point of [`amplitude_spectrum`], at most 0.1 dB low in windows of
///   up to 2²⁰ samples
/// - x_rms = √(Σ w (x − x̄)²/Σ w) with the lines' own Hann weights w: all that moves, the fractional lines and the noise
///   included, so a strong third lowers it
///
/// The normalisation is to the total (THD_R), not to the fundamental.
pub fn total_harmonic_distortion(
    series: &Series,
    window: Window,
    drive_frequency: f64,
    band: Option<f64>,
) -> Result<f64, FeatureError> {
    line::check(series, drive_frequency)?;
    let window = window.on(series)?;
    let total = weighted_rms(series, window);
    if total <= 0.0 {
        return Err(FeatureError::Constant { from_s: window.from, to_s: window.to });
    }
    let limit = band.unwrap_or(f64::INFINITY).min(line::usable_limit(series));
    let mut harmonics = 0.0;
    let mut spectrum = None;
    for order in 2_u32.. {
        let frequency = f64::from(order) * drive_frequency;
        // A record has no more lines than samples.
        if frequency > limit || order as usize > series.values.len() {
            break;
        }
        let amplitude = if order <= HIGHEST_SUMMED {
            line_amplitude(series, window, frequency)
        } else {
            let AmplitudeSpectrum { step_hz, amplitudes, .. } = match &mut spectrum {
                Some(spectrum) => spectrum,
                none => none.insert(amplitude_spectrum(series, window)?),
            };
            amplitudes.get((frequency / *step_hz).round() as usize).copied().unwrap_or(0.0)
        };
        harmonics += 0.5 * amplitude.powi(2);
    }
    Ok(harmonics.sqrt() / total)
}

/// √(Σ w (x − x̄)²/Σ w) with Hann's weights.
fn weighted_rms(series: &Series, window: Window) -> f64 {
    let (mut weight, mut first, mut second) = (0.0, 0.0, 0.0);
    for index in window.indices(series) {
        let phase = std::f64::consts::PI * (series.time(index) - window.from) / window.duration();
        let (w, x) = (phase.sin().powi(2), series.values[index]);
        weight += w;
        first += w * x;
        second += w * x * x;
    }
    if weight > 0.0 { (second / weight - (first / weight).powi(2)).max(0.0).sqrt() } else { 0.0 }
}

/// Highest frequency at which the amplitude spectrum still reaches `level_db` (such as −6) re the amplitude of the drive
/// line, Hz; up to 0.8 of the Nyquist frequency.
///
/// The crossing is interpolated between the spectrum's points (four a bin). `None` when nothing reaches the level, or
/// the record has no drive line. The line's own Hann skirt counts: a pure tone of frequency f has about f + 1/T at −6 dB.
pub fn bandwidth(spectrum: &AmplitudeSpectrum, drive_amplitude: f64, level_db: f64) -> Option<f64> {
    let level = drive_amplitude * 10.0_f64.powf(0.05 * level_db);
    if level <= 0.0 {
        return None;
    }
    let points = spectrum.amplitudes.len();
    let past = (super::USABLE_NYQUIST_FRACTION * (points - 1) as f64) as usize + 1;
    let amplitudes = &spectrum.amplitudes[..past.min(points)];
    let last = amplitudes.iter().rposition(|&amplitude| amplitude >= level)?;
    let share = match amplitudes.get(last + 1) {
        Some(next) => (amplitudes[last] - level) / (amplitudes[last] - next),
        None => 0.0,
    };
    Some((last as f64 + share) * spectrum.step_hz)
}
