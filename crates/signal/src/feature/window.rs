//! The analysis window: where the drive is on.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::FeatureError;
use crate::Series;

/// A span of time, s; the same for every trace that is compared.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Window {
    #[serde(rename = "from_s")]
    pub from: f64,
    #[serde(rename = "to_s")]
    pub to: f64,
}

impl Window {
    /// A window from its ends, s.
    pub const fn new(from: f64, to: f64) -> Self {
        Self { from, to }
    }

    pub fn whole(series: &Series) -> Self {
        Self { from: series.start, to: series.end() }
    }

    /// Span in which the drive's envelope exceeds half its peak: the connected span that holds the peak, ends
    /// interpolated.
    ///
    /// - `drive`: the drive's displacement (any unit; its scale, sign and offset drop out)
    /// - `drive_frequency`: f0, Hz
    ///
    /// The drive counts as zero outside its record, so a burst cut off at full level ends there, and a burst that
    /// starts or stops at once gives exactly its own span (the envelope's smoothing is symmetric). See [`envelope`].
    pub fn of_drive(drive: &Series, drive_frequency: f64) -> Result<Self, FeatureError> {
        let envelope = envelope(drive, drive_frequency)?;
        let values = &envelope.values;
        let (mut top, mut peak) = (0, 0.0);
        for (index, &value) in values.iter().enumerate() {
            if value > peak {
                (top, peak) = (index, value);
            }
        }
        // An envelope of rounding errors is no drive.
        if peak <= 1e-12 * drive.peak() {
            return Err(FeatureError::Constant { from_s: drive.start, to_s: drive.end() });
        }
        let half = 0.5 * peak;
        let crossing = |below: usize, above: usize| {
            let share = (half - values[below]) / (values[above] - values[below]);
            envelope.time(below) + share * (envelope.time(above) - envelope.time(below))
        };
        let from = match values[..top].iter().rposition(|&value| value < half) {
            Some(below) => crossing(below, below + 1),
            None => envelope.start,
        };
        let to = match values[top..].iter().position(|&value| value < half) {
            Some(after) => crossing(top + after, top + after - 1),
            None => envelope.end(),
        };
        Ok(Self { from, to })
    }

    /// Span in which a trace is strong, for records without a drive: from the first to the last instant at which its
    /// rms over six drive periods exceeds 1/√2 of the largest.
    ///
    /// Six periods average over the beat of period-2, -3 and -6 states; a trace that starts or stops at once begins and
    /// ends there. The span is within a period or so of the truth: a drive record is to be preferred.
    pub fn of_trace(trace: &Series, drive_frequency: f64) -> Result<Self, FeatureError> {
        super::line::check(trace, drive_frequency)?;
        let mean = trace.values.iter().sum::<f64>() / trace.len() as f64;
        let mut sums = Vec::with_capacity(trace.len() + 1);
        let mut sum = 0.0;
        sums.push(sum);
        for value in &trace.values {
            sum += (value - mean).powi(2);
            sums.push(sum);
        }
        let reach = (3.0 / (drive_frequency * trace.step)).round() as usize;
        let power = |index: usize| sums[(index + reach + 1).min(trace.len())] - sums[index.saturating_sub(reach)];
        let largest = (0..trace.len()).map(power).fold(0.0, f64::max);
        let on = |index: &usize| power(*index) > 0.5 * largest;
        match ((0..trace.len()).find(on), (0..trace.len()).rfind(on)) {
            (Some(first), Some(last)) if last > first => Ok(Self { from: trace.time(first), to: trace.time(last) }),
            _ => Err(FeatureError::Constant { from_s: trace.start, to_s: trace.end() }),
        }
    }

    /// This window, with `from` and `to` replaced if given.
    #[must_use]
    pub fn overridden(self, from: Option<f64>, to: Option<f64>) -> Self {
        Self { from: from.unwrap_or(self.from), to: to.unwrap_or(self.to) }
    }

    pub fn duration(self) -> f64 {
        self.to - self.from
    }

    /// The part of the window that the series covers.
    pub fn on(self, series: &Series) -> Result<Self, FeatureError> {
        let clipped = Self { from: self.from.max(series.start), to: self.to.min(series.end()) };
        // NaN ends fail the comparison too.
        if clipped.to > clipped.from && clipped.indices(series).len() >= 3 {
            return Ok(clipped);
        }
        if series.len() < 3 {
            return Err(FeatureError::TooFewSamples { needed: 3, found: series.len() });
        }
        Err(FeatureError::WindowOutside {
            from_s: self.from,
            to_s: self.to,
            start_s: series.start,
            end_s: series.end(),
        })
    }

    /// Indices of the series' samples inside the window (ends included, with 1e-9 of a step of slack).
    pub fn indices(self, series: &Series) -> Range<usize> {
        let first = ((self.from - series.start) / series.step - 1e-9).ceil().max(0.0);
        let past = ((self.to - series.start) / series.step + 1e-9).floor() + 1.0;
        let past = past.clamp(0.0, series.len() as f64);
        let first = first.min(past);
        first as usize..past as usize
    }
}

/// Envelope of a drive by complex demodulation, |2 ⟨u(t) e^(−2πi f0 t)⟩|.
///
/// - `drive`: u, any unit; the result is in the same unit, a steady tone of amplitude A has the envelope A
/// - `drive_frequency`: f0, Hz; an error of a few per cent does not matter
///
/// ⟨·⟩ is a Hann-weighted mean over two drive periods centred at t, whose spectral zeros lie at the offset's f0 and
/// the image's 2 f0: neither a baseline nor the second side band ripples the envelope. The signal counts as zero
/// outside its record. Chosen over the analytic signal by FFT because it does not wrap around at the ends and leaves
/// broadband noise behind.
pub fn envelope(drive: &Series, drive_frequency: f64) -> Result<Series, FeatureError> {
    super::line::check(drive, drive_frequency)?;
    let count = drive.len();
    let half_width = 1.0 / (drive_frequency * drive.step); // samples
    let reach = half_width.floor() as isize;
    // Σ u_j e^(−iωj) [1 + cos(π (j − i)/half_width)] from prefix sums of three demodulated signals, O(n).
    let carrier = std::f64::consts::TAU * drive_frequency * drive.step;
    let side = std::f64::consts::PI / half_width;
    let prefix = |rate: f64| {
        let mut sums = Vec::with_capacity(count + 1);
        let (mut re, mut im) = (0.0, 0.0);
        sums.push((re, im));
        for (index, value) in drive.values.iter().enumerate() {
            let (sine, cosine) = (rate * index as f64).sin_cos();
            re += value * cosine;
            im -= value * sine;
            sums.push((re, im));
        }
        sums
    };
    let (middle, upper, lower) = (prefix(carrier), prefix(carrier + side), prefix(carrier - side));
    let gain = 1.0 / half_width; // 2/Σ of the Hann weights (½[1 + cos]), whose sum is half_width, times ½
    let values = (0..count)
        .map(|index| {
            let first = (index as isize - reach).max(0) as usize;
            let past = ((index as isize + reach + 1) as usize).min(count);
            let span = |sums: &[(f64, f64)]| (sums[past].0 - sums[first].0, sums[past].1 - sums[first].1);
            let (m, u, l) = (span(&middle), span(&upper), span(&lower));
            // cos(side (j − i)) = ½ [e^(−i side j) e^(i side i) + e^(i side j) e^(−i side i)]
            let (sine, cosine) = (side * index as f64).sin_cos();
            let re = m.0 + 0.5 * (u.0 * cosine - u.1 * sine + l.0 * cosine + l.1 * sine);
            let im = m.1 + 0.5 * (u.1 * cosine + u.0 * sine + l.1 * cosine - l.0 * sine);
            gain * re.hypot(im)
        })
        .collect();
    Ok(Series::new(drive.start, drive.step, values))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    const F0: f64 = 73e3;

    fn burst(step: f64, on: f64, off: f64, end: f64) -> Series {
        let count = (end / step) as usize + 1;
        let value = |t: f64| if (on..off).contains(&t) { 1e-6 * (TAU * F0 * (t - on)).sin() } else { 0.0 };
        Series::new(0.0, step, (0..count).map(|i| value(i as f64 * step)).collect())
    }

    #[test]
    fn window_of_a_rectangular_burst_is_the_burst() {
        for step in [1e-7, 1.0 / (40.0 * F0), 1.0 / (7.3 * F0)] {
            let (on, off) = (31e-6, 31e-6 + 40.0 / F0);
            let window = Window::of_drive(&burst(step, on, off, 800e-6), F0).unwrap();
            // Half the sum of the samples' own half steps and the 1 % ripple of a sine that starts at zero phase:
            // a tenth of a period.
            assert!((window.from - on).abs() < 0.1 / F0, "{} {on}", window.from);
            assert!((window.to - off).abs() < 0.1 / F0, "{} {off}", window.to);
        }
    }

    #[test]
    fn a_trace_without_a_drive_is_on_where_its_rms_is() {
        let (on, off) = (131e-6, 131e-6 + 40.0 / F0);
        let window = Window::of_trace(&burst(1e-7, on, off, 900e-6), F0).unwrap();
        // The mean square of whole periods: within a tenth of a period.
        assert!((window.from - on).abs() < 0.1 / F0 && (window.to - off).abs() < 0.1 / F0, "{window:?}");
    }

    #[test]
    fn window_ignores_offset_sign_scale_and_a_few_per_cent_of_noise_or_frequency() {
        let clean = burst(1e-7, 31e-6, 500e-6, 800e-6);
        let reference = Window::of_drive(&clean, F0).unwrap();
        let mut noise = super::super::noise::Normal::seeded(3);
        let dirty = clean.map(|value| -5.0 * (value + 0.1e-6 + 0.03e-6 * noise.draw()));
        let window = Window::of_drive(&dirty, 1.02 * F0).unwrap();
        assert!((window.from - reference.from).abs() < 1e-6 && (window.to - reference.to).abs() < 1e-6, "{window:?}");
    }

    #[test]
    fn envelope_of_a_steady_tone_is_its_amplitude_between_the_ends() {
        let tone = burst(1e-7, 0.0, 1.0, 500e-6).map(|value| value + 3e-6);
        let envelope = envelope(&tone, F0).unwrap();
        for index in 200..envelope.len() - 200 {
            // The two-period Hann mean cuts its last, vanishing weights by up to a sample: (1/137)² of the amplitude
            // and of the three times larger offset.
            assert!((envelope.values[index] - 1e-6).abs() < 4e-4 * 1e-6, "{index}: {}", envelope.values[index]);
        }
    }

    #[test]
    fn silence_has_no_window() {
        let silent = Series::new(0.0, 1e-7, vec![0.0; 4000]);
        assert!(matches!(Window::of_drive(&silent, F0), Err(FeatureError::Constant { .. })));
        assert!(matches!(Window::new(2.0, 3.0).on(&silent), Err(FeatureError::WindowOutside { .. })));
    }
}
