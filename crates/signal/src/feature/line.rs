//! Amplitudes of single spectral lines, evaluated at the line itself.
//!
//! A(f) = 2 |Σ w_i (x_i − x̄) e^(−2πi f t_i)| / Σ w_i over the samples of the window, x̄ = Σ w x / Σ w.
//!
//! The taper w is Hann's, sin²(π (t − from)/(to − from)), at the samples' own instants: a trace sampled elsewhere or
//! at another rate gives the same A. Hann is chosen over flat-top and Blackman–Harris because the line is evaluated at
//! its own frequency, so there is no scalloping to flatten, and because its main lobe is the narrowest of the three:
//! ±2/T against ±4/T. The closest lines looked for, 2/3 and 3/4 or 1/4 and 1/3, lie f0/12 apart: 3.3/T in a window of
//! 40 periods. Its side lobes fall with the cube of the distance; there, a drive line leaks less than −90 dB into 1/3.

use serde::{Deserialize, Serialize};

use super::{AmplitudeSpectrum, FRACTIONAL_LINES, FeatureError, Ratio, Window};
use crate::Series;

/// Highest share of the Nyquist frequency at which amplitudes are used: anti-alias filters roll off above.
pub const USABLE_NYQUIST_FRACTION: f64 = 0.8;

/// Fewest periods of a line that the window must hold: below, Hann's main lobe (±2/T) reaches half way to 0 Hz.
pub const MINIMUM_LINE_PERIODS: f64 = 4.0;

/// A line counts as below the noise floor under this multiple of the median amplitude of noise around it: an amplitude of
/// noise alone is Rayleigh-distributed and exceeds three medians with probability 2⁻⁹ = 0.2 %.
pub(super) const FLOOR_FACTOR: f64 = 3.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phasor {
    /// A, unit of the series, ≥ 0.
    pub amplitude: f64,
    /// φ of A cos(2πf t + φ), t on the series' own clock, rad, in −π…π.
    pub phase: f64,
}

/// Amplitude of the line at `frequency`, see the module header.
///
/// - `series`: x, any unit
/// - `window`: clipped to the series; 0 is returned where fewer than three samples lie in it
/// - `frequency`: f, Hz, any value below the Nyquist frequency
///
/// Returns A in the unit of the series. A steady tone of amplitude A gives A to the side lobes of its image and of
/// its neighbours. Does not allocate; 10 µs for 8000 samples.
///
/// ```
/// # use granchain_signal::{feature::{Window, line_amplitude}, Series};
/// let tone = Series::new(0.0, 1e-7, (0..5321).map(|i| 0.25 * (0.045_867 * i as f64).sin()).collect());
/// let amplitude = line_amplitude(&tone, Window::whole(&tone), 0.045_867e7 / std::f64::consts::TAU);
/// assert!((amplitude - 0.25).abs() < 1e-6);
/// ```
pub fn line_amplitude(series: &Series, window: Window, frequency: f64) -> f64 {
    moments::<1>(series, window, frequency).map_or(0.0, |sums| 2.0 * sums.line[0].0.hypot(sums.line[0].1) / sums.weight)
}

/// Amplitude and phase of the line at `frequency`; as [`line_amplitude`].
pub fn line_phasor(series: &Series, window: Window, frequency: f64) -> Phasor {
    let Some(sums) = moments::<1>(series, window, frequency) else { return Phasor { amplitude: 0.0, phase: 0.0 } };
    let (re, im) = sums.line[0];
    // The sum's clock starts at its own origin: turn it back to the series'.
    let phase = im.atan2(re) - std::f64::consts::TAU * (frequency * sums.origin).fract();
    let turns = (phase / std::f64::consts::TAU).round();
    Phasor { amplitude: 2.0 * re.hypot(im) / sums.weight, phase: phase - turns * std::f64::consts::TAU }
}

/// Complex weights (real and imaginary parts), one a sample: Σ weight · x equals amplitude · e^(i phase) of
/// [`line_phasor`] for every series on this clock. Use them when there are too many series to store. Only start, step
/// and number of samples of `clock` matter.
pub fn line_weights(clock: &Series, window: Window, frequency: f64) -> Vec<(f64, f64)> {
    let mut weights = vec![(0.0, 0.0); clock.len()];
    let Ok(window) = window.on(clock) else { return weights };
    let range = window.indices(clock);
    let own = &mut weights[range.clone()];
    let (mut sum, mut line) = (0.0, (0.0, 0.0));
    let taper = |time: f64| 0.5 * (1.0 - (std::f64::consts::TAU * (time - window.from) / window.duration()).cos());
    for (index, weight) in range.clone().zip(own.iter_mut()) {
        let time = clock.time(index);
        let (sine, cosine) = (std::f64::consts::TAU * (frequency * time).fract()).sin_cos();
        let share = taper(time);
        *weight = (share * cosine, -share * sine);
        (sum, line) = (sum + share, (line.0 + weight.0, line.1 + weight.1));
    }
    // The weighted mean of the samples is taken off first.
    for (index, weight) in range.zip(own) {
        let share = taper(clock.time(index)) / sum;
        *weight = (2.0 / sum * (weight.0 - share * line.0), 2.0 / sum * (weight.1 - share * line.1));
    }
    weights
}

/// Σ w, and Σ w x τ^k e^(−iωτ) for k < K with the weighted mean of x removed; τ = t − origin, in s.
pub(super) struct Moments<const K: usize> {
    origin: f64,
    weight: f64,
    pub(super) line: [(f64, f64); K],
}

/// Samples handled side by side: independent rotations let the processor pipeline and vectorise the sum.
const LANES: usize = 4;

/// Compiled for the widest vectors this machine has; nothing is fused, so every machine finds the same.
pub(super) fn moments<const K: usize>(series: &Series, window: Window, frequency: f64) -> Option<Moments<K>> {
    struct Sums<'a, const K: usize>(&'a Series, Window, f64);
    impl<const K: usize> pulp::NullaryFnOnce for Sums<'_, K> {
        type Output = Option<Moments<K>>;

        #[inline(always)]
        fn call(self) -> Self::Output {
            sums(self.0, self.1, self.2)
        }
    }
    crate::vectors::of_four(Sums(series, window, frequency))
}

#[inline(always)]
fn sums<const K: usize>(series: &Series, window: Window, frequency: f64) -> Option<Moments<K>> {
    let window = window.on(series).ok()?;
    let range = window.indices(series);
    let samples = &series.values[range.clone()];
    // Origin near the middle, on a sample: τ stays small, and so does the rotation's rounding.
    let middle = samples.len() / 2;
    let rate = std::f64::consts::TAU * frequency * series.step;
    let taper_rate = std::f64::consts::TAU * series.step / window.duration();
    let taper_start = taper_rate * ((series.time(range.start) - window.from) / series.step);

    let lane = |rate: f64, start: f64| {
        let angles: [f64; LANES] = std::array::from_fn(|k| start + rate * k as f64);
        (angles.map(f64::cos), angles.map(f64::sin))
    };
    let (mut zc, mut zs) = lane(-rate, rate * middle as f64);
    let (mut hc, mut hs) = lane(taper_rate, taper_start);
    let (zrs, zrc) = (-rate * LANES as f64).sin_cos();
    let (hrs, hrc) = (taper_rate * LANES as f64).sin_cos();

    let mut weight = [0.0; LANES];
    let mut offset = [0.0; LANES];
    // Real and imaginary parts.
    let mut line = [[[0.0; LANES]; 2]; K];
    let mut kernel = [[[0.0; LANES]; 2]; K];
    let mut index = 0.0 - middle as f64;
    let (chunks, rest) = samples.as_chunks::<LANES>();
    let mut last = [0.0; LANES];
    last[..rest.len()].copy_from_slice(rest);
    let last = (!rest.is_empty()).then_some((&last, rest.len()));
    for (chunk, live) in chunks.iter().map(|chunk| (chunk, LANES)).chain(last) {
        for k in 0..LANES {
            let w = if k < live { 0.5 * (1.0 - hc[k]) } else { 0.0 };
            let wx = w * chunk[k];
            weight[k] += w;
            offset[k] += wx;
            let mut power = 1.0;
            for order in 0..K {
                line[order][0][k] += wx * power * zc[k];
                line[order][1][k] += wx * power * zs[k];
                kernel[order][0][k] += w * power * zc[k];
                kernel[order][1][k] += w * power * zs[k];
                power *= (index + k as f64) * series.step;
            }
            (zc[k], zs[k]) = (zc[k] * zrc - zs[k] * zrs, zs[k] * zrc + zc[k] * zrs);
            (hc[k], hs[k]) = (hc[k] * hrc - hs[k] * hrs, hs[k] * hrc + hc[k] * hrs);
        }
        index += LANES as f64;
    }
    let weight: f64 = weight.iter().sum();
    if weight <= 0.0 {
        return None;
    }
    let mean = offset.iter().sum::<f64>() / weight;
    let total =
        |[re, im]: &[[f64; LANES]; 2]| re.iter().zip(im).fold((0.0, 0.0), |sum, (re, im)| (sum.0 + re, sum.1 + im));
    let line = std::array::from_fn(|order| {
        let (signal, taper) = (total(&line[order]), total(&kernel[order]));
        (signal.0 - mean * taper.0, signal.1 - mean * taper.1)
    });
    Some(Moments { origin: series.time(range.start + middle), weight, line })
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Frequency over f0, exact.
    pub ratio: Ratio,
    pub frequency_hz: f64,
    /// A, SI unit of the series.
    pub amplitude: f64,
    /// A/A(f0), 1; 0 where the drive line is 0.
    pub relative: f64,
    /// 20 lg of `relative`, dB; floored at −400.
    pub db: f64,
    /// Below three times the noise floor around it (or the broadband part of a chaotic response): an upper bound rather
    /// than a value.
    pub below_noise_floor: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AbsentLine {
    /// Frequency over f0, exact.
    pub ratio: Ratio,
    pub frequency_hz: f64,
    /// Why the line was not measured, with the numbers.
    pub reason: String,
}

/// Amplitudes of all [`FRACTIONAL_LINES`] of a drive, and those that cannot be measured, both by ascending ratio.
///
/// - `drive_frequency`: f0, Hz
/// - `spectrum`: of the same window; with it each line is held against the floor around it
///   ([`AmplitudeSpectrum::local_floor`])
///
/// Absent with a reason: lines above 0.8 of the Nyquist frequency, and lines of which the window holds less than
/// [`MINIMUM_LINE_PERIODS`] periods.
pub fn lines(
    series: &Series,
    window: Window,
    drive_frequency: f64,
    spectrum: Option<&AmplitudeSpectrum>,
) -> Result<(Vec<Line>, Vec<AbsentLine>), FeatureError> {
    check(series, drive_frequency)?;
    let window = window.on(series)?;
    let limit = usable_limit(series);
    let reference = line_amplitude(series, window, drive_frequency);
    let (mut lines, mut absent) = (Vec::new(), Vec::new());
    for ratio in FRACTIONAL_LINES {
        let frequency_hz = ratio.value() * drive_frequency;
        let periods = frequency_hz * window.duration();
        if frequency_hz > limit {
            let reason = format!("above 0.8 of the Nyquist frequency ({:.1} kHz)", 1e-3 * limit);
            absent.push(AbsentLine { ratio, frequency_hz, reason });
        } else if periods < MINIMUM_LINE_PERIODS {
            let reason = format!(
                "window holds {:.1} of its periods, {MINIMUM_LINE_PERIODS} needed",
                (10.0 * periods).floor() / 10.0
            );
            absent.push(AbsentLine { ratio, frequency_hz, reason });
        } else {
            let amplitude = if ratio == Ratio::ONE { reference } else { line_amplitude(series, window, frequency_hz) };
            let relative = if reference > 0.0 { amplitude / reference } else { 0.0 };
            lines.push(Line {
                ratio,
                frequency_hz,
                amplitude,
                relative,
                db: 20.0 * relative.max(1e-20).log10(),
                below_noise_floor: spectrum
                    .and_then(|spectrum| spectrum.local_floor(frequency_hz, drive_frequency))
                    .is_some_and(|floor| amplitude < FLOOR_FACTOR * floor),
            });
        }
    }
    Ok((lines, absent))
}

pub(super) fn usable_limit(series: &Series) -> f64 {
    0.5 * USABLE_NYQUIST_FRACTION * series.sample_rate()
}

pub(super) fn check(series: &Series, drive_frequency: f64) -> Result<(), FeatureError> {
    check_finite(series)?;
    let limit_hz = usable_limit(series);
    if !(drive_frequency > 0.0 && drive_frequency <= limit_hz) {
        return Err(FeatureError::DriveFrequency { frequency_hz: drive_frequency, limit_hz });
    }
    Ok(())
}

/// Refuses a series that is too short or has a value that is not finite.
pub(super) fn check_finite(series: &Series) -> Result<(), FeatureError> {
    if series.len() < 3 {
        return Err(FeatureError::TooFewSamples { needed: 3, found: series.len() });
    }
    match series.values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(FeatureError::NotFinite { index, value: series.values[index] }),
        None => Ok(()),
    }
}
