//! Band-limited interpolation onto any other uniform instants.

use std::collections::HashMap;

use super::Series;
use super::kernel::{Tabulated, continued, half_length, windowed_sinc};

/// Full width of the transition band, as a fraction of the lower of the two sample rates.
const TRANSITION: f64 = 0.1;
/// Fractions of a sample are resolved to 2⁻³²; the error of a tone is below π 2⁻³² of its amplitude.
const PHASES: f64 = 4_294_967_296.0;
/// Most weights kept in a plan (16 MB); a plan that needs more computes them as it goes.
const KEPT_WEIGHTS: usize = 1 << 21;
/// Most weights computed from the kernel itself rather than from its table.
const EXACT_WEIGHTS: usize = 1 << 15;

/// A planned resampling from one uniform grid to another, by a Kaiser-windowed sinc.
///
/// - same or higher rate: tones up to 0.45 of the input rate come out within 2e-5 of their amplitude (images from 0.55
///   on are suppressed likewise); instants that coincide with input samples return them;
/// - lower rate: tones up to 0.40 of the output rate within 1e-5, and nothing above half the output rate is left to
///   alias by more than 1e-5;
/// - no delay, no phase; the mean is kept exactly;
/// - near its ends the input is continued by reflection through its end points; outside its span the nearest end
///   value is held.
#[derive(Debug, Clone)]
pub struct Resampler {
    input_len: usize,
    start: f64,
    step: f64,
    /// First tap of each output sample, and which phase it uses.
    taps: Vec<(isize, u32)>,
    fractions: Vec<f64>,
    reach: usize,
    kernel: Kernel,
    /// Weights of all phases one after the other, or none when there are too many to keep.
    weights: Vec<f64>,
}

#[derive(Debug, Clone)]
struct Kernel {
    cutoff: f64,
    half: f64,
    table: Option<Tabulated>,
}

impl Kernel {
    /// Weights of the 2 `reach` taps around an instant `fraction` of a sample after the `reach`-th of them; sum 1.
    fn weigh(&self, fraction: f64, reach: usize, weights: &mut [f64]) {
        let mut sum = 0.0;
        for (tap, weight) in weights.iter_mut().enumerate() {
            let x = fraction + (reach as f64 - 1.0) - tap as f64;
            *weight = match &self.table {
                Some(table) => table.at(x),
                None => windowed_sinc(x, self.cutoff, self.half),
            };
            sum += *weight;
        }
        for weight in weights {
            *weight /= sum;
        }
    }
}

impl Resampler {
    /// Plan from `input_len` samples at `input_start` + i `input_step` to `count` instants `start` + k `step` (all s), for an input without content
    /// above half the output rate (low-passed to 0.43 of it): pure interpolation, without a second filter.
    pub fn interpolating(
        input_start: f64,
        input_step: f64,
        input_len: usize,
        start: f64,
        step: f64,
        count: usize,
    ) -> Self {
        Self::with_ratio(input_start, input_step, input_len, start, step, count, 1.0)
    }

    /// The same for any input: of rates as `ratio` = `input_step`/`step` says; interpolation alone where it is 1.
    pub(crate) fn with_ratio(
        input_start: f64,
        input_step: f64,
        input_len: usize,
        start: f64,
        step: f64,
        count: usize,
        ratio: f64,
    ) -> Self {
        // Rates equal to a millionth are the same rate: rounding of a step must not switch the anti-alias filter on.
        let (scale, cutoff) = if ratio > 1.0 - 1e-6 { (1.0, 0.5) } else { (ratio, 0.45 * ratio) };
        let half = half_length(TRANSITION * scale);
        let reach = half.ceil() as usize;
        let last = input_len.saturating_sub(1) as f64;
        let mut phase_of = HashMap::new();
        let mut fractions = Vec::new();
        let taps = (0..count)
            .map(|k| {
                let position = ((start + k as f64 * step - input_start) / input_step).clamp(0.0, last);
                let mut whole = position.floor();
                let mut key = ((position - whole) * PHASES).round();
                if key >= PHASES {
                    (whole, key) = (whole + 1.0, 0.0);
                }
                let phase = *phase_of.entry(key as u64).or_insert_with(|| {
                    fractions.push(key / PHASES);
                    fractions.len() as u32 - 1
                });
                (whole as isize - reach as isize + 1, phase)
            })
            .collect();
        let needed = fractions.len().saturating_mul(2 * reach);
        let table = (needed > EXACT_WEIGHTS).then(|| Tabulated::new(cutoff, half));
        let kernel = Kernel { cutoff, half, table };
        let mut weights = Vec::new();
        if needed <= KEPT_WEIGHTS {
            weights.resize(needed, 0.0);
            for (fraction, weights) in fractions.iter().zip(weights.chunks_mut(2 * reach)) {
                kernel.weigh(*fraction, reach, weights);
            }
        }
        Self { input_len, start, step, taps, fractions, reach, kernel, weights }
    }

    /// The samples at the planned instants.
    ///
    /// # Panics
    /// If `values` has another length than planned.
    pub fn apply(&self, values: &[f64]) -> Vec<f64> {
        assert_eq!(values.len(), self.input_len, "Resampler planned for another length");
        if values.is_empty() {
            return vec![0.0; self.taps.len()];
        }
        let width = 2 * self.reach;
        // One reflected continuation for all taps, so that the inner loop is a plain dot product.
        let mut padded = Vec::with_capacity(values.len() + 2 * width);
        let margin = self.reach as isize;
        padded.extend((-margin..0).map(|i| continued(values, i)));
        padded.extend_from_slice(values);
        let len = values.len() as isize;
        padded.extend((len..len + margin).map(|i| continued(values, i)));
        let mut own = if self.weights.is_empty() { vec![0.0; width] } else { Vec::new() };
        self.taps
            .iter()
            .map(|&(first, phase)| {
                let from = (first + margin) as usize;
                let window = &padded[from..from + width];
                let weights = if self.weights.is_empty() {
                    self.kernel.weigh(self.fractions[phase as usize], self.reach, &mut own);
                    &own[..]
                } else {
                    &self.weights[phase as usize * width..][..width]
                };
                dot(window, weights)
            })
            .collect()
    }

    /// The planned instants with `values` resampled onto them.
    pub fn series(&self, values: &[f64]) -> Series {
        Series::new(self.start, self.step, self.apply(values))
    }
}

/// Dot product in four interleaved sums: a fixed order that the compiler can vectorise.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a_chunks, b_chunks) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = a_chunks.remainder().iter().zip(b_chunks.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a_chunks.zip(b_chunks) {
        for lane in 0..4 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + tail
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn tone(frequency: f64, start: f64, step: f64, count: usize) -> Series {
        Series::new(
            start,
            step,
            (0..count).map(|i| (2.0 * PI * frequency * (start + step * i as f64) + 0.4).sin()).collect(),
        )
    }

    fn resample(series: &Series, start: f64, step: f64, count: usize) -> Series {
        let ratio = series.step / step;
        Resampler::with_ratio(series.start, series.step, series.len(), start, step, count, ratio).series(&series.values)
    }

    fn worst(a: &Series, b: &Series) -> f64 {
        a.values.iter().zip(&b.values).fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs()))
    }

    #[test]
    fn a_tone_at_045_of_the_rate_is_interpolated_to_1e_5() {
        for fraction in [0.01, 0.2, 0.45] {
            let input = tone(fraction, 0.0, 1.0, 1000);
            // An irrational step, so that every phase occurs.
            let step = 1.0 / 2f64.sqrt();
            let out = resample(&input, 100.3, step, 1000);
            let error = worst(&out, &tone(fraction, 100.3, step, 1000));
            assert!(error < 2e-5, "{fraction}: {error:e}"); // at the band edge ripple and image, 1e-5 each
        }
    }

    #[test]
    fn lowering_the_rate_keeps_tones_below_04_and_removes_those_above_half() {
        let step = 4.0;
        for (fraction, stays) in [(0.05, 1.0), (0.40, 1.0), (0.50, 0.0), (0.7, 0.0), (1.9, 0.0)] {
            let input = tone(fraction / step, 0.0, 1.0, 4000);
            let out = resample(&input, 800.0, step, 500);
            let expected = tone(fraction / step, 800.0, step, 500).map(|x| stays * x);
            let error = worst(&out, &expected);
            assert!(error < 1.5e-5, "{fraction}: {error:e}"); // design ripple 1e-5
        }
    }

    #[test]
    fn the_same_instants_return_the_same_samples() {
        let input = tone(0.37, -5.0, 0.1, 300);
        let out = resample(&input, -5.0, 0.1, 300);
        assert!(worst(&input, &out) < 1e-13); // rounding
        let later = resample(&input, -2.0, 0.1, 100);
        assert!(worst(&later, &input.window(-2.0, 7.9)) < 1e-7); // −2 is 30 steps only to rounding: phase 2⁻³²
    }

    #[test]
    fn kept_table_and_running_weights_agree() {
        let input = tone(0.1, 0.0, 1.0, 3000);
        let step = 0.97 * 2f64.sqrt();
        let mut plan = Resampler::with_ratio(0.0, 1.0, 3000, 3.1, step, 2000, 1.0 / step);
        assert!(plan.kernel.table.is_some() && !plan.weights.is_empty());
        let kept = plan.apply(&input.values);
        plan.weights.clear();
        assert_eq!(kept, plan.apply(&input.values));
        plan.kernel.table = None;
        let exact = plan.apply(&input.values);
        assert!(kept.iter().zip(&exact).all(|(a, b)| (a - b).abs() < 1e-9)); // 1e-11 of the kernel, 90 taps
    }

    #[test]
    fn interpolating_keeps_what_the_alias_filter_would_take() {
        let (step, fraction) = (3.7, 0.45);
        let input = tone(fraction / step, 0.0, 1.0, 3000);
        let kept = Resampler::interpolating(0.0, 1.0, 3000, 500.0, step, 500).series(&input.values);
        let expected = tone(fraction / step, 500.0, step, 500);
        assert!(worst(&kept, &expected) < 2e-5); // ripple and image
        let filtered = resample(&input, 500.0, step, 500);
        assert!(worst(&filtered, &expected) > 0.4); // −6 dB at 0.45
    }

    #[test]
    fn outside_the_span_the_end_values_are_held() {
        let input = Series::new(0.0, 1.0, vec![2.0, 3.0, 5.0]);
        let out = resample(&input, -10.0, 1.0, 30);
        assert!(out.values[..10].iter().all(|x| (x - 2.0).abs() < 1e-12));
        assert!(out.values[13..].iter().all(|x| (x - 5.0).abs() < 1e-12));
        assert_eq!(resample(&Series::new(0.0, 1.0, vec![]), 0.0, 1.0, 3).values, [0.0; 3]);
    }
}
