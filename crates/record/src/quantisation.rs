//! Step of the converter: the greatest spacing of which all differences between samples are multiples.

use std::collections::BTreeSet;

/// Most samples evaluated, evenly spread over the record.
const MOST: usize = 1 << 14;
/// Smallest relevant step, as a fraction of half the record's range: 14 bits of twice the range.
const FINEST: f64 = 1e-4;
/// Largest distance of a level from a multiple of the step, in steps: allows for rounded decimals.
const OFF: f64 = 0.15;
/// The same while the step is still being refined.
const NEAR: f64 = 0.35;
/// Share of the samples whose levels must be multiples; the rest may be bridged cells.
const ENOUGH: f64 = 0.98;
/// Distances between levels that differ by less, relative, are tried once.
const APART: f64 = 0.02;
/// Fewest levels for which a spacing is meaningful.
const FEWEST_LEVELS: usize = 5;

/// The converter's step, unit of `values`; `None` if there is none, or if it is too fine to matter.
///
/// The greatest distance between neighbouring levels, or a half, third or quarter of the smallest if codes are missing, of
/// which nearly all samples are multiples, counted from the most frequent level. The step is refined from level to level,
/// v_i = v_0 + k_i q with whole k_i, so that rounded decimals do not matter.
pub(super) fn quantisation_step(values: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().step_by(values.len().div_ceil(MOST).max(1)).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let (low, high) = (*sorted.first()?, *sorted.last()?);
    let range = high - low;
    if !(range > 0.0 && range.is_finite()) {
        return None;
    }
    let mut levels: Vec<(f64, usize)> = Vec::new();
    for value in &sorted {
        match levels.last_mut() {
            Some((level, count)) if value - *level <= 1e-9 * range => *count += 1,
            _ => levels.push((*value, 1)),
        }
    }
    if levels.len() < FEWEST_LEVELS {
        return None;
    }
    let mut steps: Vec<f64> = levels.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    steps.sort_unstable_by(|a, b| b.total_cmp(a));
    let smallest = steps[steps.len() - 1];
    steps.dedup_by(|smaller, larger| *smaller > (1.0 - APART) * *larger);
    let parts = (2..=4).map(|part| smallest / f64::from(part));
    let finest = 0.5 * FINEST * range;
    steps.into_iter().chain(parts).take_while(|step| *step >= finest).find_map(|step| followed(&levels, step))
}

/// `step` refined along the levels, if they are its multiples.
fn followed(levels: &[(f64, usize)], step: f64) -> Option<f64> {
    let (middle, (first, most)) = levels.iter().copied().enumerate().max_by_key(|(_, (_, count))| *count)?;
    let (above, below) = (levels[middle + 1..].iter(), levels[..middle].iter().rev());
    let all: usize = levels.iter().map(|(_, count)| *count).sum();
    let levels = || above.clone().chain(below.clone()).map(|(level, count)| (level - first, *count));
    // Least squares: frequent and far levels tell most.
    let (mut products, mut squares) = (step, 1.0);
    for (from, count) in levels() {
        let (refined, weight) = (products / squares, (count * count) as f64);
        let code = (from / refined).round();
        if (from - code * refined).abs() <= NEAR * refined {
            products += weight * code * from;
            squares += weight * code * code;
        }
    }
    let refined = products / squares;
    let is_on = |from: f64| (from - (from / refined).round() * refined).abs() <= OFF * refined;
    // A spike alone is no level of a converter.
    let codes: BTreeSet<i64> =
        levels().filter(|(from, _)| is_on(*from)).map(|(from, _)| (from / refined).round() as i64).collect();
    let on: usize = levels().filter(|(from, _)| is_on(*from)).map(|(_, count)| count).sum();
    (codes.len() >= FEWEST_LEVELS - 1 && on as f64 >= ENOUGH * (all - most) as f64).then_some(refined)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(count: usize) -> impl Iterator<Item = f64> {
        (0..count).map(|i| {
            let i = i as f64;
            (0.0917 * i).sin() * (1.0 - (-i / 300.0).exp()) + 0.004 * (i * i * 0.7133).sin()
        })
    }

    fn rounded(x: f64, step: f64) -> f64 {
        (x / step).round() * step
    }

    #[test]
    fn converters_of_8_to_12_bits_are_recognised_whatever_the_decimals() {
        for bits in [8, 10, 12] {
            let step = 2.5 / f64::from(1u32 << bits);
            for decimal in [1e-4, 1e-6, 1e-15] {
                let written: Vec<f64> = wave(4000).map(|x| rounded(rounded(x, step), decimal)).collect();
                let found = quantisation_step(&written).unwrap();
                assert!((found / step - 1.0).abs() < 2e-3, "{bits} bits, {decimal}: {found} {step}");
            }
        }
    }

    #[test]
    fn a_single_cycle_that_leaves_codes_out_is_recognised_too() {
        let step = 2.5 / 256.0;
        let written: Vec<f64> = (0..400).map(|i| rounded((0.09 * f64::from(i)).sin(), step)).collect();
        assert!((quantisation_step(&written).unwrap() / step - 1.0).abs() < 1e-6);
    }

    #[test]
    fn decimals_that_resolve_everything_and_full_precision_are_no_steps() {
        let fine: Vec<f64> = wave(4000).map(|x| rounded(x, 1e-5)).collect();
        assert_eq!(quantisation_step(&fine), None);
        assert_eq!(quantisation_step(&wave(4000).collect::<Vec<_>>()), None);
        assert_eq!(quantisation_step(&[1.0; 50]), None);
        assert_eq!(quantisation_step(&[]), None);
    }

    /// Two records of one converter at one sensitivity, one with a few values off its codes, as a bridge leaves them: the
    /// greatest step of which the others are multiples, not a part of it that fits them too.
    #[test]
    fn the_step_is_the_greatest_and_the_same_in_two_records_of_a_converter() {
        for (bits, decimal, part) in [(8, 1e-5, 7.0), (8, 1e-4, 5.0), (10, 1e-6, 7.0), (12, 1e-9, 3.0)] {
            let step = 2.5 / f64::from(1u32 << bits);
            for (gain, every) in [(1.0, 5000), (0.3, 97), (0.7, 211)] {
                let mut written: Vec<f64> = wave(4000).map(|x| rounded(rounded(gain * x, step), decimal)).collect();
                for i in (60..3900).step_by(every) {
                    written[i] += step * (0.5 + i as f64 % part).floor() / part;
                }
                let found = quantisation_step(&written).unwrap();
                assert!((found / step - 1.0).abs() < 5e-3, "{bits} bits, 1/{part}, {gain}: {found} {step}");
            }
        }
    }

    #[test]
    fn bridged_cells_do_not_hide_the_step() {
        let step = 2.5 / 256.0;
        let mut written: Vec<f64> = wave(4000).map(|x| rounded(x, step)).collect();
        for i in (50..3900).step_by(100) {
            written[i] = 0.5 * (written[i - 1] + written[i + 1]) + 0.1 * step;
        }
        assert!((quantisation_step(&written).unwrap() / step - 1.0).abs() < 1e-4);
    }
}
