//! Search for stretches of a record that show no motion: drop-outs and spikes.

use std::{cmp::Ordering, ops::Range};

use granchain_signal::{Gap, LowPass, Series, bridge, mean_and_rms, spline::cubic};

use super::{MaskReason, apply, gap_of};
use crate::baseline::median;

/// Least margin masked on either side of a stretch, samples and drive periods.
const EDGE: (usize, f64) = (2, 0.03);

/// Shortest unmasked stretch between two masked ones, drive periods.
const ISLAND: f64 = 0.15;

/// Highest frequency of motion, in drive frequencies.
const BAND: f64 = 12.0;
/// Upper limit of that band, as a fraction of the sample rate.
const HIGHEST: f64 = 0.36;
/// Fewest samples a drive period that distinguish a spike from an impulse.
const FEWEST: f64 = 20.0;
/// Excess from which samples are examined, over the typical impulse and over the peak.
const EXCESS: (f64, f64) = (4.0, 0.015);
/// Excess that may remain after masking, over the typical impulse and over the excess before.
const LEFT: (f64, f64) = (2.5, 0.2);
/// Largest of three periods over the deviation, below which it is that of noise.
const NOISE: f64 = 5.0;
/// Excess over the deviation of such noise from which samples are examined.
const NOISIEST: f64 = 7.0;
/// Longest spike, drive periods.
const SPIKE: f64 = 0.04;
/// Longest drop-out, drive periods.
const LOST: f64 = 2.0;
const MOST_SAMPLES: usize = 1 << 16;
/// Most spikes ignored when the largest extreme of a long record is sought.
const FEW_SPIKES: usize = 12;
const MOST_STRETCHES: usize = 100;
/// Motion, over the robust peak.
const MOVES: f64 = 0.1;
/// Periods before the first motion that are not searched for trigger spikes: motion may begin slowly.
const CLEAR: f64 = 2.0;
/// Least distance of a trigger spike from rest, over the robust deviation there and over the peak.
const LEAPS: (f64, f64) = (8.0, 0.03);
/// Largest difference between a period and its neighbours in regular motion, over the peak, for 95 of 100 samples.
const REGULAR: f64 = 0.35;
/// Least difference of a drop-out from its neighbours, over that of 95 of 100 samples and over the peak.
const UNLIKE: (f64, f64) = (2.0, 0.04);
/// Longest trigger spike, and from where to where it stands alone after it, drive periods: motion returns and grows.
const TRIGGER: f64 = 0.1;
const ALONE: (f64, f64) = (0.25, 2.0);
/// Largest excursion there, over the spike.
const SMALLER: f64 = 0.5;
/// Least jump at an end of a drop-out, over the noise.
const JUMP: f64 = 8.0;
/// Largest change of the level of a drop-out, over that jump, or over its standard error.
const LEVEL: (f64, f64) = (0.1, 4.0);
/// Least height of a spike, over that of the cusp in which its neighbours' slopes meet.
const CUSP: f64 = 1.5;

/// Stretches of a record that show no motion. `frequency` (Hz) is that of the drive; `of_horn`: the record is of the
/// horn itself. Empty if there are too few samples a period.
pub(super) fn find(series: &Series, frequency: f64, of_horn: bool) -> Vec<(Range<usize>, MaskReason)> {
    let period = 1.0 / (frequency * series.step);
    let count = series.len();
    // Neither does a frequency that is none.
    if !(period >= FEWEST && (count as f64) >= 8.0 * period) {
        return Vec::new();
    }
    if count > MOST_SAMPLES {
        // The memory of an oscilloscope may be long, the motion is not.
        let Some(motion) = moving(series, period).filter(|motion| motion.len() <= MOST_SAMPLES) else {
            return Vec::new();
        };
        let cut = Series::new(series.time(motion.start), series.step, series.values[motion.clone()].to_vec());
        let later = |(samples, reason): (Range<usize>, MaskReason)| {
            (samples.start + motion.start..samples.end + motion.start, reason)
        };
        return find(&cut, frequency, of_horn).into_iter().map(later).collect();
    }
    let highest = HIGHEST / series.step;
    let mut cutoffs = vec![f64::min(BAND * frequency, highest)];
    while let Some(cutoff) =
        cutoffs.last().map(|last| f64::min(2.0 * last, highest)).filter(|it| *it > 1.5 * cutoffs[cutoffs.len() - 1])
    {
        cutoffs.push(cutoff);
    }
    let level = median(&series.values);
    let mut distances: Vec<f64> = series.values.iter().map(|value| (value - level).abs()).collect();
    let rank = ((count as f64) * 0.99) as usize;
    let peak = *distances.select_nth_unstable_by(rank.min(count - 1), f64::total_cmp).1;
    if !(peak > 0.0) {
        return Vec::new();
    }
    let block = (0.5 * period).round() as usize;
    // A record that begins or ends at rest shows it there.
    let few = usize::max(16, block / 2).min(count);
    // More samples than a spike has.
    let enough = (SPIKE * period).ceil() as usize + 1;
    let moves = |rest: f64| -> Vec<bool> {
        let moving = |part: &[f64]| part.iter().filter(|x| (*x - rest).abs() > MOVES * peak).count();
        series.values.chunks(block).map(|part| moving(part) >= enough.min(part.len())).collect()
    };
    // Motion goes on.
    let goes_on = |eight: &[bool]| eight[0] && eight[1..4].contains(&true) && eight[4..].contains(&true);
    let first_motion = moves(median(&series.values[..few])).windows(8).position(goes_on).unwrap_or(0) * block;
    let last_motion =
        moves(median(&series.values[count - few..])).windows(8).rposition(goes_on).map_or(0, |last| last + 4) * block;
    let mut found = before_motion(series, first_motion, period, peak);
    let mut repaired = series.clone();
    apply(&mut repaired, &found);
    let noise = rest_noise(&repaired.values, first_motion.saturating_sub((CLEAR * period) as usize));
    let search = |cutoff| Search { period, cutoff, block, first_motion, last_motion, peak, noise, of_horn };
    for cutoff in cutoffs {
        for _ in 0..MOST_STRETCHES {
            let Some(further) = search(cutoff).next(&repaired, &found) else { break };
            repaired.clone_from(series);
            found.extend(further);
            found = merged(found, 0);
            apply(&mut repaired, &found);
        }
    }
    found.extend(search(highest).unlike_neighbours(&repaired));
    // A vibrometer takes some samples to lose its signal and to find it again.
    let edge = usize::max(EDGE.0, (EDGE.1 * period).round() as usize);
    for (samples, _) in found.iter_mut().filter(|(_, reason)| *reason != MaskReason::TriggerSpike) {
        *samples = samples.start.saturating_sub(edge)..(samples.end + edge).min(count);
    }
    // The few samples between two stretches carry no bridge.
    merged(found, (ISLAND * period).ceil() as usize - 1)
}

/// Samples around the motion of a long record: all half periods that reach a tenth of the largest extreme (a few
/// spikes excepted), and twenty periods before and after them.
fn moving(series: &Series, period: f64) -> Option<Range<usize>> {
    let block = (0.5 * period).round() as usize;
    let rest = median(&series.values[..usize::max(16, block / 2).min(series.len())]);
    let extremes: Vec<f64> = series
        .values
        .chunks(block)
        .map(|part| part.iter().fold(0.0, |most, x| f64::max(most, (x - rest).abs())))
        .collect();
    let mut sorted = extremes.clone();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let limit = MOVES * sorted.get(FEW_SPIKES).or(sorted.last())?;
    let (first, last) = (extremes.iter().position(|it| *it > limit)?, extremes.iter().rposition(|it| *it > limit)?);
    Some(first.saturating_sub(40) * block..((last + 40) * block).min(series.len()))
}

/// Sorted stretches; those at most `apart` samples apart are merged.
fn merged(mut found: Vec<(Range<usize>, MaskReason)>, apart: usize) -> Vec<(Range<usize>, MaskReason)> {
    found.sort_by_key(|(samples, _)| samples.start);
    let mut all: Vec<(Range<usize>, MaskReason)> = Vec::new();
    for (samples, reason) in found {
        match all.last_mut() {
            Some((last, known)) if samples.start <= last.end + apart => {
                last.end = last.end.max(samples.end);
                *known = (*known).min(reason);
            }
            _ => all.push((samples, reason)),
        }
    }
    all
}

/// σ of normally distributed samples about a level, from their median distance.
fn deviation(values: &[f64], level: f64) -> f64 {
    1.4826 * median(&values.iter().map(|x| (x - level).abs()).collect::<Vec<_>>())
}

/// σ of normally distributed samples, from the median of their first differences.
fn from_differences(values: &[f64]) -> f64 {
    median(&values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect::<Vec<_>>()) / 0.954
}

/// σ of the samples at rest, or of all samples by their differences.
fn rest_noise(values: &[f64], quiet: usize) -> f64 {
    match &values[..quiet] {
        quiet if quiet.len() >= 32 => deviation(quiet, median(quiet)),
        _ => from_differences(values),
    }
}

/// Short excursions from rest before the motion.
fn before_motion(series: &Series, first_motion: usize, period: f64, peak: f64) -> Vec<(Range<usize>, MaskReason)> {
    let until = first_motion.saturating_sub((CLEAR * period) as usize);
    let quiet = &series.values[..until];
    if quiet.len() < 16 {
        return Vec::new();
    }
    let level = median(quiet);
    // Half the converter's step where that shows.
    let steps = quiet.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0);
    let deviation = f64::max(deviation(quiet, level), 0.5 * steps.fold(f64::INFINITY, f64::min).min(peak));
    let limit = f64::max(LEAPS.0 * deviation, LEAPS.1 * peak);
    let largest = |samples: Range<usize>| {
        let samples = samples.start.min(series.len())..samples.end.min(series.len());
        series.values[samples].iter().map(|x| (x - level).abs()).fold(0.0, f64::max)
    };
    let longest = (TRIGGER * period).ceil() as usize;
    let mut found = Vec::new();
    let mut i = 0;
    while i < until {
        if (quiet[i] - level).abs() <= limit {
            i += 1;
            continue;
        }
        // Up to where it is back at rest, and the tails of a filter with it.
        let at_rest = |x: &f64| (x - level).abs() <= f64::max(3.0 * deviation, 0.1 * limit);
        let past = quiet[i..].iter().position(at_rest).map_or(until, |n| i + n);
        let first = quiet[..i].iter().rposition(at_rest).map_or(0, |before| before + 1);
        let after = [ALONE.0, ALONE.1].map(|periods| past + (periods * period) as usize);
        if past - first <= longest && largest(after[0]..after[1]) < SMALLER * largest(first..past) {
            found.push((first..past, MaskReason::TriggerSpike));
        }
        i = past.max(i + 1);
    }
    found
}

struct Search {
    period: f64,
    cutoff: f64,
    block: usize,
    first_motion: usize,
    last_motion: usize,
    peak: f64,
    noise: f64,
    of_horn: bool,
}

impl Search {
    /// Samples to search: all but the ends. The motion of a horn, and of a record that begins inside it, may begin
    /// with a jump; there the search starts with the second period of motion.
    fn motion(&self, count: usize) -> Range<usize> {
        let period = self.period as usize;
        let at_rest = self.first_motion as f64 >= (CLEAR + 1.0) * self.period;
        let begins = if at_rest && !self.of_horn { period } else { self.first_motion + period };
        // A horn may stop with a jump of its velocity.
        let end = if self.of_horn { usize::min(count, self.last_motion.saturating_sub(2 * self.block)) } else { count };
        begins..end.saturating_sub(period)
    }

    /// Content above the band of motion.
    fn above(&self, series: &Series) -> Vec<f64> {
        let low = LowPass::new(series.step, series.len(), self.cutoff).apply(&series.values);
        series.values.iter().zip(low).map(|(value, low)| value - low).collect()
    }

    /// Stretches that explain the largest excesses, at least a period apart; `None` if there are none.
    fn next(&self, series: &Series, known: &[(Range<usize>, MaskReason)]) -> Option<Vec<(Range<usize>, MaskReason)>> {
        let above = self.above(series);
        let mut tops: Vec<(f64, usize)> = above
            .chunks(self.block)
            .enumerate()
            .filter_map(|(number, part)| {
                let (at, top) = part.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
                Some((top.abs(), number * self.block + at))
            })
            .collect();
        // A motion may have its strongest impulse in every third period only, and drop-outs in every other such stretch.
        let moving: Vec<f64> = tops.iter().filter(|(_, at)| *at >= self.first_motion).map(|(top, _)| *top).collect();
        let mut largest: Vec<f64> = moving.chunks(6).map(|part| part.iter().copied().fold(0.0, f64::max)).collect();
        largest.sort_by(f64::total_cmp);
        let rank = |share: f64| largest.get((share * largest.len() as f64) as usize).copied().unwrap_or(0.0);
        let deviation = deviation(&above, 0.0);
        // Where impulses leave nothing but noise, an excess is one over the largest noise.
        let typical = rank(0.3);
        let noisy = rank(0.4) < NOISE * deviation;
        let (limit, allowed) = if noisy {
            (f64::max(rank(0.4) + EXCESS.0 * (rank(0.4) - rank(0.1)), NOISIEST * deviation), rank(0.4))
        } else {
            (EXCESS.0 * typical, LEFT.0 * typical)
        };
        let limit = f64::max(limit, EXCESS.1 * self.peak);
        let motion = self.motion(series.len());
        tops.retain(|(top, at)| {
            *top > limit && motion.contains(at) && !known.iter().any(|(samples, _)| samples.contains(at))
        });
        tops.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut found: Vec<(Range<usize>, MaskReason)> = Vec::new();
        for (top, at) in tops.into_iter().take(MOST_STRETCHES) {
            let apart = |(samples, _): &(Range<usize>, MaskReason)| {
                samples.start.abs_diff(at).min(samples.end.abs_diff(at)) as f64 > self.period
            };
            if found.iter().all(apart)
                && let Some(stretch) = self.explained(series, known, (top, at), allowed)
            {
                found.push(stretch);
            }
        }
        (!found.is_empty()).then_some(found)
    }

    /// The shortest stretch about sample `at` that explains the excess `top`.
    fn explained(
        &self,
        series: &Series,
        known: &[(Range<usize>, MaskReason)],
        (top, at): (f64, usize),
        allowed: f64,
    ) -> Option<(Range<usize>, MaskReason)> {
        let reach = (12.0 / (self.cutoff * series.step)).ceil() as usize + (LOST * self.period) as usize;
        let (from, past) = (at.saturating_sub(reach), (at + reach + 1).min(series.len()));
        let local = Series::new(0.0, series.step, series.values[from..past].to_vec());
        let at = at - from;
        let is_known = |i: usize| known.iter().any(|(samples, _)| samples.contains(&(i + from)));
        let low_pass = LowPass::new(local.step, local.len(), self.cutoff);
        let beside = (2.0 / (self.cutoff * local.step)).ceil() as usize;
        let above = |series: &Series| -> Vec<f64> {
            let low = low_pass.apply(&series.values);
            series.values.iter().zip(low).map(|(value, low)| (value - low).abs()).collect()
        };
        let longest = (SPIKE * self.period).ceil() as usize;
        // A second spike, so near that its tails reach here.
        let near = longest + 1..beside + longest;
        let own = above(&local);
        let second = own.iter().enumerate().filter(|(i, _)| near.contains(&i.abs_diff(at)));
        let second = second.max_by(|a, b| a.1.total_cmp(b.1)).filter(|(_, value)| **value > 0.5 * top);
        let second = second.map(|(i, _)| gap_of(&local, &(i..i + 1)));
        let left = |samples: &Range<usize>| {
            let around = samples.start.saturating_sub(beside)..(samples.end + beside).min(local.len());
            let left_by = |gaps: &[Gap]| {
                let mut mended = local.clone();
                bridge(&mut mended, gaps);
                above(&mended)[around.clone()].iter().copied().fold(0.0, f64::max)
            };
            let gap = gap_of(&local, samples);
            second.iter().map(|second| left_by(&[gap, *second])).fold(left_by(&[gap]), f64::min)
        };
        let allowed = f64::max(allowed, LEFT.1 * top);
        let mut options: Vec<(Range<usize>, MaskReason)> = Vec::new();
        for length in 1..=longest {
            for first in (at + 1).saturating_sub(length)..=at {
                if first + length <= local.len() {
                    options.push((first..first + length, MaskReason::Spike));
                }
            }
        }
        options.extend(self.flat(&local, at, is_known).into_iter().map(|samples| (samples, MaskReason::SignalLost)));
        // First what was lost, the stretch whose level is best known: good samples on the other side of its jump explain that too.
        let level_error = |samples: &Range<usize>| {
            let (_, rms) = mean_and_rms(&local.values[samples.clone()]);
            (rms + self.noise + 1e-3 * self.peak) / (samples.len() as f64).sqrt()
        };
        options.sort_by(|(a, first), (b, second)| match first.cmp(second) {
            Ordering::Equal if *first == MaskReason::SignalLost => level_error(a).total_cmp(&level_error(b)),
            Ordering::Equal => a.len().cmp(&b.len()),
            unlike => unlike,
        });
        let motion = self.motion(series.len());
        let last = |reason: &MaskReason| if *reason == MaskReason::Spike { motion.end } else { self.last_motion };
        let inside = |(samples, reason): &(Range<usize>, MaskReason)| {
            samples.start + from >= motion.start && samples.end + from <= last(reason)
        };
        let moved = |(samples, reason): &(Range<usize>, MaskReason)| match reason {
            MaskReason::Spike => !self.is_cusp(&local, samples),
            _ => self.jumps(&local.values, samples),
        };
        let (samples, reason) =
            options.into_iter().find(|option| inside(option) && moved(option) && left(&option.0) <= allowed)?;
        Some((samples.start + from..samples.end + from, reason))
    }

    /// Whether some samples are no higher than the cusp in which the slopes on either side meet, a collision, or than the
    /// step from one side to the other, the beginning of a motion.
    fn is_cusp(&self, local: &Series, samples: &Range<usize>) -> bool {
        let values = &local.values;
        let (Some(first), last) = (samples.start.checked_sub(3), samples.end + 2) else { return true };
        if last >= values.len() {
            return true;
        }
        let slopes = [(first, samples.start - 1), (samples.end, last)].map(|(a, b)| 0.5 * (values[b] - values[a]));
        let mut mended = local.clone();
        bridge(&mut mended, &[gap_of(local, samples)]);
        let height = samples.clone().map(|i| (values[i] - mended.values[i]).abs()).fold(0.0, f64::max);
        let step = (values[samples.end] - values[samples.start - 1]).abs();
        height <= f64::max(step, CUSP * 0.25 * (samples.len() + 1) as f64 * (slopes[1] - slopes[0]).abs())
    }

    /// Stretches at rest while neighbouring periods move at the same phase: a drop-out without a jump is visible in
    /// regular motion only.
    fn unlike_neighbours(&self, series: &Series) -> Vec<(Range<usize>, MaskReason)> {
        let values = &series.values;
        let count = values.len() as isize;
        let at = |place: f64| {
            let (whole, part) = (place.floor() as isize, place - place.floor());
            cubic([-1, 0, 1, 2].map(|k| values[(whole + k).clamp(0, count - 1) as usize]), part)
        };
        let rest = median(&values[..usize::min(self.first_motion, values.len())]);
        let noise = self.noise;
        // Of motions that repeat after one, two or three periods.
        let unlike = |periods: usize| -> Vec<f64> {
            let lag = periods as f64 * self.period;
            // Both the periods before and those behind must differ, and to the same side: at its ends a burst differs from one of them.
            let beside = |i: usize, side: f64| {
                let [a, b, c] = [1.0, 2.0, 3.0].map(|k| at(i as f64 + side * k * lag));
                values[i] - f64::max(f64::min(a, b), f64::min(f64::max(a, b), c))
            };
            let least = |(before, behind): (f64, f64)| match before * behind > 0.0 {
                true if before.abs() < behind.abs() => before,
                true => behind,
                false => 0.0,
            };
            (0..values.len()).map(|i| least((beside(i, -1.0), beside(i, 1.0)))).collect()
        };
        let scale = |residual: &[f64]| {
            let mut sorted: Vec<f64> =
                residual[self.first_motion.min(residual.len())..].iter().map(|x| x.abs()).collect();
            let rank = (0.95 * sorted.len() as f64) as usize;
            if sorted.is_empty() { f64::INFINITY } else { *sorted.select_nth_unstable_by(rank, f64::total_cmp).1 }
        };
        let candidates = [1, 2, 3].map(|periods| {
            let residual = unlike(periods);
            (scale(&residual), periods, residual)
        });
        let Some((scale, periods, residual)) = candidates.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) else {
            return vec![];
        };
        if scale > REGULAR * self.peak {
            return vec![];
        }
        let limit = f64::max(UNLIKE.0 * scale, UNLIKE.1 * self.peak);
        let level = f64::max(4.0 * noise, 0.005 * self.peak);
        let still = |i: usize| (values[i] - rest).abs() <= level;
        let mut found = Vec::new();
        // Three periods of the motion on either side.
        let beside = (3.0 * periods as f64 * self.period) as usize;
        let mut i = self.first_motion + beside;
        while i + beside < self.last_motion {
            if residual[i].abs() <= limit || !still(i) {
                i += 1;
                continue;
            }
            let first = (0..i).rev().take_while(|&k| still(k)).last().unwrap_or(i);
            let past = (i..values.len()).find(|&k| !still(k)).unwrap_or(values.len());
            let beyond = (first..past).filter(|&k| residual[k].abs() > limit).count();
            if beyond >= 2 && ((past - first) as f64) < LOST * self.period && self.jumps(values, &(first..past)) {
                found.push((first..past, MaskReason::SignalLost));
            }
            i = past.max(i + 1);
        }
        found
    }

    /// Whether some samples stay at one level that the signal leaves, or reaches, by a jump: within one sample or two,
    /// whereas motion that begins steeply goes on as steeply.
    fn jumps(&self, values: &[f64], lost: &Range<usize>) -> bool {
        let inside = &values[lost.clone()];
        let (level, half) = (median(inside), inside.len() / 2);
        let drift = (mean_and_rms(&inside[..half]).0 - mean_and_rms(&inside[inside.len() - half..]).0).abs();
        let drift = drift - LEVEL.1 * self.noise * (2.0 / half as f64).sqrt();
        let beyond = |k: usize, ahead: bool| match ahead {
            true => values.get(lost.end + k),
            false => lost.start.checked_sub(k + 1).map(|at| &values[at]),
        };
        let jumps = |(k, ahead): (usize, bool)| {
            let (Some(first), Some(last)) = (beyond(k, ahead), beyond(k + 2, ahead)) else { return false };
            let continued = (k + 1) as f64 * 0.5 * (last - first);
            let jump = (first - level - continued).abs();
            jump > f64::max(JUMP * self.noise, continued.abs()) && drift <= LEVEL.0 * jump
        };
        [(0, true), (0, false), (1, true), (1, false)].into_iter().any(jumps)
    }

    /// Stretches at one level that begin or end next to `at`; they may include samples already masked.
    fn flat(&self, local: &Series, at: usize, is_known: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
        let values = &local.values;
        let beside = (0.01 * self.period).ceil() as usize + 1;
        let noise = from_differences(values);
        let mut found: Vec<Range<usize>> = Vec::new();
        for start in at.saturating_sub(beside)..=(at + beside).min(values.len() - 1) {
            // Noise of the lost signal, which nobody knows: as little as the record's, as much as a hundredth of the peak.
            for tolerance in [0.01 * self.peak, f64::max(0.04 * self.peak, f64::min(4.0 * noise, 0.06 * self.peak))] {
                let level = values[start];
                let same = |x: &f64| (x - level).abs() <= tolerance;
                let first =
                    (0..start).rev().find(|i| !(same(&values[*i]) || is_known(*i))).map_or(0, |before| before + 1);
                let past = (start..values.len()).find(|i| !(same(&values[*i]) || is_known(*i))).unwrap_or(values.len());
                let length = past - first;
                if length >= 2 && (length as f64) < LOST * self.period && !found.contains(&(first..past)) {
                    found.push(first..past);
                }
            }
        }
        found
    }
}
