//! The strongest spectral line of a record.

use std::f64::consts::PI;

use super::baseline::median;
use granchain_signal::{Series, forward_transform};

/// Up to this length samples are padded to four times their number; longer records are summed at quarters of a bin
/// instead, to save memory.
const PADDED: usize = 1 << 14;

/// Most samples evaluated, from the middle of the record.
const MOST: usize = 1 << 16;

/// Frequency (Hz) of the strongest line, refined between the bins.
///
/// The samples from the first to the last that exceed a tenth of the peak (the middle 65,536 of more), less their mean, under a Hann window,
/// padded with zeros to at least four times their number; beyond 16,384 samples only to the next power of two, and the spectrum is summed at
/// quarters of a bin around the largest. Then a parabola through the logarithms of the largest of these points and its neighbours (error
/// below 1e-3 of a bin for a steady tone). `None` if there are fewer than 8 such samples or nothing but an offset.
pub(super) fn strongest_line(series: &Series) -> Option<f64> {
    let active = active_span(series);
    let beside = active.len().saturating_sub(MOST) / 2;
    let values = series.values.get(active.start + beside..active.end - beside)?;
    let n = values.len();
    if n < 8 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / n as f64;
    let windowed =
        |(i, value): (usize, &f64)| (value - mean) * (1.0 - libm::cos(2.0 * PI * (i as f64 + 0.5) / n as f64));
    let size = if n <= PADDED { (4 * n).next_power_of_two() } else { n.next_power_of_two() };
    let plan = forward_transform(size);
    let mut input = plan.make_input_vec();
    input.iter_mut().zip(values.iter().enumerate().map(windowed)).for_each(|(slot, value)| *slot = value);
    let mut output = plan.make_output_vec();
    plan.process(&mut input, &mut output).ok()?;
    let power = |bin: usize| output[bin].norm_sqr();
    // Below one cycle in the span is drift.
    let from = (size / n).max(1);
    let peak = (from..output.len() - 1).max_by(|&a, &b| power(a).total_cmp(&power(b)))?;
    if power(peak) <= 0.0 || !power(peak).is_finite() {
        return None;
    }
    let vertex = |[a, b, c]: [f64; 3]| {
        let [a, b, c] = [a, b, c].map(|x| x.max(f64::MIN_POSITIVE).ln());
        let curvature = a - 2.0 * b + c;
        if curvature < 0.0 { (0.5 * (a - c) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
    };
    let bin = if n <= PADDED {
        peak as f64 + vertex([power(peak - 1), power(peak), power(peak + 1)])
    } else {
        let quarter = |k: i32| peak as f64 + 0.25 * f64::from(k);
        let at = |bin: f64| {
            let (mut cosine, mut sine) = (0.0, 0.0);
            for (i, value) in values.iter().enumerate().map(|(i, value)| (i, windowed((i, value)))) {
                let phase = 2.0 * PI * bin * i as f64 / size as f64;
                cosine += value * libm::cos(phase);
                sine += value * libm::sin(phase);
            }
            cosine * cosine + sine * sine
        };
        let powers: Vec<f64> = (-5..=5).map(|k| at(quarter(k))).collect();
        let largest = (1..powers.len() - 1).max_by(|&a, &b| powers[a].total_cmp(&powers[b]))?;
        let around = [powers[largest - 1], powers[largest], powers[largest + 1]];
        quarter(largest as i32 - 5) + 0.25 * vertex(around)
    };
    Some(bin / (size as f64 * series.step))
}

/// Samples from the first to the last whose distance from the median exceeds a tenth of the largest.
pub(super) fn active_span(series: &Series) -> std::ops::Range<usize> {
    let median = median(&series.values);
    let peak = series.values.iter().fold(0.0, |peak, x| f64::max(peak, (x - median).abs()));
    let loud = |x: &f64| (x - median).abs() > 0.1 * peak;
    let first = series.values.iter().position(loud).unwrap_or(0);
    let past = series.values.iter().rposition(loud).map_or(0, |last| last + 1);
    first..past.max(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_between_bins_is_found() {
        for frequency in [73_000.0, 73_123.4, 24_333.3] {
            let tone = Series::new(
                0.0,
                2e-7,
                (0..4000).map(|i| 0.3 + (2.0 * PI * frequency * 2e-7 * f64::from(i) + 0.4).sin()).collect(),
            );
            let found = strongest_line(&tone).unwrap();
            // A bin is 1.25 kHz; the negative frequency's side lobes pull by less than 1e-3 of it.
            assert!((found - frequency).abs() < 1.25, "{frequency}: {found}");
        }
    }

    #[test]
    fn a_tone_in_a_long_record_is_found_as_exactly() {
        for (frequency, count) in [(73_123.4, 20_000), (73_123.4, 300_000), (24_333.3, 65_537)] {
            let tone = |i| 0.3 + (2.0 * PI * frequency * 2e-7 * f64::from(i) + 0.4).sin();
            let found = strongest_line(&Series::new(0.0, 2e-7, (0..count).map(tone).collect())).unwrap();
            // A bin of the samples looked at is 250 to 76 Hz.
            let bin = 5e6 / f64::from(count.min(65_536));
            assert!((found - frequency).abs() < 1e-3 * bin, "{frequency} {count}: {found}");
        }
    }

    #[test]
    fn silence_has_no_line() {
        assert_eq!(strongest_line(&Series::new(0.0, 1.0, vec![0.0; 100])), None);
        assert_eq!(strongest_line(&Series::new(0.0, 1.0, vec![])), None);
    }
}
