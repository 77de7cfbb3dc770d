//! Positive and negative peak of a record, between its samples, freed of what noise adds to an extreme.
//!
//! # Definition
//!
//! The peak is the extreme of the *signal*, not of the record: the largest value the noise-free, band-limited signal
//! takes at any instant of the window. With `noise_rms` σ = 0 it is that of the samples' band-limited interpolation. With
//! noise the largest sample is biased upwards twice over, and each part is undone:
//!
//! 1. *Within an impulse* the largest of many noisy samples is picked. So the record is smoothed by local parabolas
//!    (Epanechnikov weights) over ±h, h = 0.3 × the impulse's width at half height × min(σ/(0.03 P), 1)^(2/9): the
//!    exponent at which the squared bias ∝ h⁸ and the variance ∝ σ²/h balance; σ → 0 turns it off. The width is measured
//!    for each sign, the broader counted as at most 2.5 times the narrower. What smoothing takes off a sharp top is added
//!    back (the loss seen on smoothing once more: Tukey's twicing), and what picking the smoothed curve's top adds,
//!    σ'²/(2|s″|) with σ' the rms slope of its noise, is subtracted.
//! 2. *Among K impulses of nearly one height* the luckiest is picked. Their heights, each with the known error σ_s of
//!    the smoothed record, are shrunk towards their mean by 1 − σ_s²/variance (Efron & Morris 1975, *JASA* 70, 311),
//!    and what the maximum of those plus fresh noise exceeds their largest by is subtracted.
//!
//! Left over, for σ = 3 % of the larger peak and 1.5 to 10 MHz: 0.8 % of it for trains of equal impulses and for single
//! ones (raw extreme: up to 8 %), −1.6 % where heights scatter by as much as the noise and cannot be distinguished from it; 5 % of
//! a trough four to six times shallower than the impulses (raw extreme: 20 to 38 %). `tests/signal/feature_peaks.rs` measures it.
//!
//! For white noise, or noise white up to a stated bandwidth. A record limited to its band with its noise rms measured
//! after that is the intended input.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::{
    FeatureError, Window,
    interpolation::{interpolate, maximum_near},
    line::check_finite,
};
use crate::{Series, kernel::continued};

/// Half-width of the smoothing over the impulse's width at half height, at 3 % noise and more.
const SMOOTHING: f64 = 0.3;
/// Widest impulse believed, as a factor on the narrower of the two sides: a smoothing as wide as the long trough between
/// impulses would run into their flanks.
const WIDEST: f64 = 2.5;
/// Longest half-width of the smoothing, samples; for longer ones the samples are averaged in bins first.
const LONGEST_REACH: f64 = 200.0;
/// Most impulses compared for step 3.
const MOST_IMPULSES: usize = 48;

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PeakSettings {
    /// σ, unit of the series; 0 for none.
    pub noise_rms: f64,
    /// Bandwidth up to which the noise is white, Hz; `None`: up to the Nyquist frequency.
    pub noise_bandwidth: Option<f64>,
}

/// The two peaks of a record, unit of the series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Peaks {
    /// Largest value of the signal.
    pub positive: f64,
    pub positive_time_s: f64,
    /// Smallest (most negative) value of the signal.
    pub negative: f64,
    pub negative_time_s: f64,
    /// Largest sample as it stands, noise and all.
    pub raw_positive: f64,
    /// Smallest sample as it stands.
    pub raw_negative: f64,
}

/// Both peaks of the window; definition in the module header.
///
/// - `series`: any unit, finite, content below 0.42 of its sample rate
/// - `window`: clipped to the series
pub fn peaks(series: &Series, window: Window, settings: &PeakSettings) -> Result<Peaks, FeatureError> {
    check_finite(series)?;
    let range = window.on(series)?.indices(series);
    // What lies beyond the reach of smoothing and interpolation cannot matter.
    let first = range.start.saturating_sub(300);
    let past = (range.end + 300).min(series.len());
    let range = range.start - first..range.end - first;
    let mut values = series.values[first..past].to_vec();
    let noise = settings.noise_bandwidth.map(|bandwidth| (2.0 * bandwidth * series.step).min(1.0)).unwrap_or(1.0);
    let time = |position: f64| series.time(first) + position * series.step;

    let sigma = settings.noise_rms;
    let width_up = width_at_half_height(&values, &range, sigma);
    values.iter_mut().for_each(|value| *value = -*value);
    let width_down = width_at_half_height(&values, &range, sigma);
    let broadest = WIDEST * width_up.min(width_down);
    let down = extreme(&values, range.clone(), width_down.min(broadest), sigma, noise);
    values.iter_mut().for_each(|value| *value = -*value);
    let up = extreme(&values, range, width_up.min(broadest), sigma, noise);
    Ok(Peaks {
        positive: up.value,
        positive_time_s: time(up.position),
        negative: -down.value,
        negative_time_s: time(down.position),
        raw_positive: up.raw,
        raw_negative: -down.raw,
    })
}

struct Extreme {
    value: f64,
    position: f64,
    raw: f64,
}

/// Maximum of the signal in `range`; `noise_band`: share of the Nyquist band that the noise fills.
fn extreme(values: &[f64], range: Range<usize>, width: f64, noise_rms: f64, noise_band: f64) -> Extreme {
    let highest = largest(values, range.clone());
    let raw = values[highest];
    if noise_rms > 0.0 && width.is_finite() && raw > 4.0 * noise_rms {
        let half_width = SMOOTHING * width * (noise_rms / (0.03 * raw)).min(1.0).powf(2.0 / 9.0);
        let per_bin = (half_width / LONGEST_REACH).floor().max(1.0);
        if per_bin > 1.0 {
            let (value, position) = in_bins(values, &range, half_width, noise_rms, noise_band, per_bin as usize);
            return Extreme { value, position, raw };
        }
        let kernel = Kernel::local_parabola(half_width);
        let (value, position) = without_noise(values, &range, &kernel, 2.0 * half_width, noise_rms, noise_band);
        return Extreme { value, position, raw };
    }
    let (position, value) = band_limited_maximum(values, &range, highest);
    Extreme { value, position, raw }
}

/// Steps 1 to 3 on means of `count` samples, for a long kernel: the cost then grows only with the record. Averaging
/// lowers a peak by 1/(24 · 200²) of what the kernel does. White noise in the share `noise_band` of the band keeps
/// 1/(count · noise_band) of its variance, at most all of it.
fn in_bins(
    values: &[f64],
    range: &Range<usize>,
    half_width: f64,
    noise_rms: f64,
    noise_band: f64,
    count: usize,
) -> (f64, f64) {
    let means: Vec<f64> = values.chunks_exact(count).map(|bin| bin.iter().sum::<f64>() / count as f64).collect();
    let per_bin = count as f64;
    let first = (range.start / count).min(means.len() - 1);
    let past = range.end.div_ceil(count).min(means.len()).max(first + 1);
    let kernel = Kernel::local_parabola(half_width / per_bin);
    let noise_rms = noise_rms / (per_bin * noise_band).max(1.0).sqrt();
    let noise_band = (per_bin * noise_band).min(1.0);
    let (value, position) =
        without_noise(&means, &(first..past), &kernel, 2.0 * half_width / per_bin, noise_rms, noise_band);
    (value, per_bin * position + 0.5 * (per_bin - 1.0))
}

fn largest(values: &[f64], range: Range<usize>) -> usize {
    let start = range.start;
    range.fold(start, |best, index| if values[index] > values[best] { index } else { best })
}

fn is_local_maximum(values: &[f64], index: usize) -> bool {
    let before = index.checked_sub(1).map_or(f64::NEG_INFINITY, |i| values[i]);
    let after = values.get(index + 1).copied().unwrap_or(f64::NEG_INFINITY);
    values[index] >= before && values[index] > after
}

/// Maximum between samples: every local maximum that could overtop the highest sample is looked at.
fn band_limited_maximum(values: &[f64], range: &Range<usize>, highest: usize) -> (f64, f64) {
    // A parabola through three samples tells how far a top may rise between them; below 0.42 of the sample rate the
    // true rise stays under 4 times that.
    let rise = |index: usize| {
        if index == 0 || index + 1 >= values.len() {
            return 0.0;
        }
        let (a, b, c) = (values[index - 1], values[index], values[index + 1]);
        let curvature = 2.0 * b - a - c;
        if curvature > 0.0 { (a - c).powi(2) / (8.0 * curvature) } else { 0.0 }
    };
    let floor = values[highest] + rise(highest);
    let mut best = maximum_near(values, highest);
    for index in range.clone() {
        if index != highest && is_local_maximum(values, index) && values[index] + 4.0 * rise(index) > floor {
            let found = maximum_near(values, index);
            if found.1 > best.1 {
                best = found;
            }
        }
    }
    best
}

/// Width of the highest impulse at half its height, samples, ends interpolated; infinite where only noise rises.
fn width_at_half_height(values: &[f64], range: &Range<usize>, noise_rms: f64) -> f64 {
    let top = largest(values, range.clone());
    // The top sample stands about 2.5 σ too high, and 1.5 σ lower a dip of noise rarely ends the impulse early.
    let half = 0.5 * (values[top] - 2.5 * noise_rms) - 1.5 * noise_rms;
    if half <= 0.0 {
        return f64::INFINITY;
    }
    let side = |mut indices: Box<dyn Iterator<Item = usize> + '_>| {
        let mut inner = top;
        indices
            .find_map(|index| {
                if values[index] < half {
                    return Some(inner.abs_diff(top) as f64 + (values[inner] - half) / (values[inner] - values[index]));
                }
                inner = index;
                None
            })
            .unwrap_or(inner.abs_diff(top) as f64)
    };
    side(Box::new((0..top).rev())) + side(Box::new(top + 1..values.len()))
}

struct Kernel {
    /// k_0, k_1 … k_r; k_−j = k_j.
    weights: Vec<f64>,
}

impl Kernel {
    /// Local parabola with Epanechnikov weights 1 − (j/h)² over |j| < h; less than five samples: the sample itself.
    fn local_parabola(half_width: f64) -> Self {
        let reach = (half_width.ceil() as usize).saturating_sub(1);
        if reach < 2 {
            return Self { weights: vec![1.0] };
        }
        let weight = |j: usize| 1.0 - (j as f64 / half_width).powi(2);
        let moment = |power: i32| {
            (1..=reach).map(|j| 2.0 * weight(j) * (j as f64).powi(power)).sum::<f64>()
                + if power == 0 { 1.0 } else { 0.0 }
        };
        let (m0, m2, m4) = (moment(0), moment(2), moment(4));
        let determinant = m0 * m4 - m2 * m2;
        Self { weights: (0..=reach).map(|j| weight(j) * (m4 - m2 * (j * j) as f64) / determinant).collect() }
    }

    fn reach(&self) -> usize {
        self.weights.len() - 1
    }

    /// Smoothed value at `index`; beyond the ends the signal is continued by point reflection in its end value.
    fn at(&self, values: &[f64], index: usize) -> f64 {
        let reach = self.reach();
        let centre = self.weights[0] * values[index];
        if index >= reach && index + reach < values.len() {
            let (left, right) = (&values[index - reach..index], &values[index + 1..=index + reach]);
            let pairs = left.iter().rev().zip(right);
            return centre + self.weights[1..].iter().zip(pairs).map(|(w, (a, b))| w * (a + b)).sum::<f64>();
        }
        let (index, at) = (index as isize, |i: isize| continued(values, i));
        let pair = |j: usize| at(index - j as isize) + at(index + j as isize);
        centre + (1..=reach).map(|j| self.weights[j] * pair(j)).sum::<f64>()
    }

    /// Variance that white noise of unit variance and bandwidth `noise_band` (of Nyquist) keeps after 2K − K∗K, and the
    /// variance of its slope (per sample²) after K.
    fn noise_gain(&self, noise_band: f64) -> (f64, f64) {
        let reach = self.reach() as isize;
        let k = |j: isize| self.weights.get(j.unsigned_abs()).copied().unwrap_or(0.0);
        let once: Vec<f64> = (-reach..=reach).map(k).collect();
        let twice: Vec<f64> = (-2 * reach..=2 * reach)
            .map(|j| 2.0 * k(j) - (-reach..=reach).map(|i| k(i) * k(j - i)).sum::<f64>())
            .collect();
        let correlation = |lag: isize| {
            let phase = std::f64::consts::PI * noise_band * lag as f64;
            if lag == 0 { 1.0 } else { phase.sin() / phase }
        };
        // Σ_ij a_i a_j ρ(i − j + lag) = Σ_d (a ⋆ a)_d ρ(d + lag)
        let covariance = |a: &[f64], lag: isize| {
            let reach = a.len() as isize - 1;
            let own = |d: isize| a[d.unsigned_abs()..].iter().zip(a).map(|(x, y)| x * y).sum::<f64>();
            if noise_band >= 1.0 {
                return if lag > reach { 0.0 } else { own(lag) };
            }
            (-reach..=reach).map(|d| own(d) * correlation(d + lag)).sum()
        };
        let slope = 2.0 * (covariance(&once, 0) - covariance(&once, 1));
        (covariance(&twice, 0), slope)
    }
}

/// Steps 1 to 3 of the definition: value and position (samples) of the signal's maximum.
fn without_noise(
    values: &[f64],
    range: &Range<usize>,
    kernel: &Kernel,
    apart: f64,
    noise_rms: f64,
    noise_band: f64,
) -> (f64, f64) {
    let (gain, slope_gain) = kernel.noise_gain(noise_band);
    let error = noise_rms * gain.sqrt();
    let smooth: Vec<f64> = (0..values.len()).map(|index| kernel.at(values, index)).collect();
    let top = largest(&smooth, range.clone());

    // One candidate an impulse, highest first: local maxima at least an impulse's width apart.
    let floor = smooth[top] - 6.0 * error;
    let mut tops: Vec<usize> =
        range.clone().filter(|&index| smooth[index] > floor && is_local_maximum(&smooth, index)).collect();
    tops.sort_by(|&a, &b| smooth[b].total_cmp(&smooth[a]));
    let mut impulses: Vec<usize> = Vec::new();
    for index in tops {
        if impulses.len() < MOST_IMPULSES && impulses.iter().all(|&other| other.abs_diff(index) as f64 >= apart) {
            impulses.push(index);
        }
    }
    let arm = (kernel.reach() / 2).max(1);
    let height = |index: usize| {
        let (position, value) = maximum_near(&smooth, index);
        let lost = smooth[index] - kernel.at(&smooth, index);
        let curvature = if index >= arm && index + arm < smooth.len() {
            (2.0 * smooth[index] - smooth[index - arm] - smooth[index + arm]) / (arm * arm) as f64
        } else {
            0.0
        };
        // Never more than one error: the expansion behind it holds for small shifts of the top only.
        let picked =
            if curvature > 0.0 { (noise_rms * noise_rms * slope_gain / (2.0 * curvature)).min(error) } else { 0.0 };
        (value + lost - picked, position)
    };
    let heights: Vec<(f64, f64)> = impulses.iter().map(|&index| height(index)).collect();
    let Some(&best) = heights.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else {
        return (interpolate(&smooth, top as f64), top as f64);
    };
    let mut near: Vec<f64> =
        heights.iter().map(|height| height.0).filter(|&value| value > best.0 - 5.0 * error).collect();
    (best.0 - luck_of_the_highest(&mut near, error), best.1)
}

/// E max(u_k + σ z_k) − max u_k for the heights shrunk to u_k: the bias of the largest of several noisy heights.
fn luck_of_the_highest(heights: &mut [f64], error: f64) -> f64 {
    let count = heights.len() as f64;
    if heights.len() < 2 || error <= 0.0 {
        return 0.0;
    }
    let mean = heights.iter().sum::<f64>() / count;
    let variance = heights.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let error = error.min(variance.sqrt());
    let kept = (1.0 - error * error / variance).max(0.0);
    heights.iter_mut().for_each(|value| *value = mean + kept * (*value - mean));
    let top = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // E max = b − ∫_a^b F, F = Π Φ; F vanishes below a, is 1 above b.
    let (low, high, steps) = (top - 5.0 * error, top + 6.0 * error, 110);
    let width = (high - low) / f64::from(steps);
    let below = |x: f64| {
        heights
            .iter()
            .map(|value| 0.5 * libm::erfc(-(x - value) / error * std::f64::consts::FRAC_1_SQRT_2))
            .product::<f64>()
    };
    let integral: f64 = (0..steps).map(|step| below(low + (f64::from(step) + 0.5) * width) * width).sum();
    high - integral - top
}
