//! The record prepared for the waveform likelihood.

use realfft::num_complex::Complex;

use super::ensemble::Placed;
use crate::comparison::Comparison;
use granchain_signal::{Gap, Series, feature::fingerprint::SAMPLES_PER_CYCLE, forward_transform, inverse_transform};

/// Least noise over the peak: the interpolation error between samples.
const LEAST_NOISE: f64 = 1e-3;

/// Fraction of the clipping level from which a sample counts as clipped.
const CLIPPED: f64 = 0.98;

/// Samples by which an invalid stretch is widened, for the spread of the low-pass.
const SPREAD: usize = 16;

/// Samples of a record with drop-outs, and of one with clipped stretches, per sample that may be left out as an outlier.
const SPARE: usize = 10;
const SPARE_CLIPPED: usize = 4;

/// Deviation in σ from which a sample is an outlier, and T/N above which outliers are looked for: of a record with
/// drop-outs, and of a clipped one, whose overload fades slowly.
const OUTLYING: (f64, f64) = (6.0, 1.2);
const OUTLYING_CLIPPED: (f64, f64) = (3.0, 1.0);

/// Samples after a clipped one in which an amplifier may still recover from it: a drive period.
const RECOVERY: usize = SAMPLES_PER_CYCLE;

/// Periods by which a record is continued at either end before it is shifted.
const CONTINUED: usize = 3;

/// Rms of a cycle over the noise from which it counts as motion, and the most such cycles before the onset.
const MOTION: f64 = 3.0;
const RISING: usize = 24;

/// A record of [`SAMPLES_PER_CYCLE`] samples a drive period, low-passed.
#[derive(Debug, Clone)]
pub(super) struct RecordTrace {
    pub step: f64,
    /// Instant of its first sample, s.
    start: f64,
    pub onset: usize,
    /// Samples before its onset in which it moves already.
    pub rise: usize,
    pub peak: f64,
    /// Standard deviation of a sample of white noise that has the density of the record's up to half the sample rate, m/s.
    pub sigma: f64,
    /// Standard deviation of what grows with the velocity, over the velocity, in that band.
    speckle: f64,
    /// Share of that band with noise; the low-pass removed the rest.
    pub band: f64,
    /// Number of independent samples behind σ.
    pub freedom: f64,
    /// Frequency at which the 1/f part of the noise equals the white one, Hz; 0 if there is none. Below it, record and
    /// runs are attenuated until the noise is white.
    pub corner: f64,
    values: Vec<f64>,
    valid: Vec<bool>,
    /// Samples that may still be left out; 0 for a record without drop-outs or clipped stretches.
    spare: usize,
    /// Of a record without drop-outs, the samples that may be left out: those soon after a clipped one.
    recovering: Option<Vec<bool>>,
    /// Number of samples left out: masked ones with their neighbours, and outliers.
    pub left_out: usize,
    /// Transform of the record, continued at both ends.
    spectrum: Vec<Complex<f64>>,
    padded: usize,
}

impl RecordTrace {
    /// From a record with an onset; `None` for others.
    pub(crate) fn of(trace: &Series, comparison: &Comparison) -> Option<Self> {
        let fingerprint = &comparison.fingerprint;
        if !fingerprint.by_onset() {
            return None;
        }
        let onset = fingerprint.alignment(trace).ok()?;
        let alignment = fingerprint.alignment_time(trace).ok()?;
        let mut valid = vec![true; trace.len()];
        for gap in comparison.masked.iter().map(|gap: &Gap| gap.later(alignment)) {
            let from = ((gap.from - trace.start) / trace.step).floor() as isize;
            let to = ((gap.to - trace.start) / trace.step).ceil() as isize;
            let spread = SPREAD as isize;
            let (from, to) =
                (from.saturating_sub(spread).max(0), to.saturating_add(spread).min(trace.len() as isize - 1));
            (from..=to).for_each(|i| valid[i as usize] = false);
        }
        let left_out = valid.iter().filter(|valid| !**valid).count();
        let [low, high] = comparison.clipped;
        let is_clipped = |value: f64| {
            low.is_some_and(|low| value <= CLIPPED * low) || high.is_some_and(|high| value >= CLIPPED * high)
        };
        let mut recovering = vec![false; trace.len()];
        for index in (0..trace.len()).filter(|index| is_clipped(trace.values[*index])) {
            valid[index.saturating_sub(SPREAD)..(index + SPREAD + 1).min(trace.len())].fill(false);
            recovering[index..(index + RECOVERY + 1).min(trace.len())].fill(true);
        }
        let spare = match (comparison.masked.is_empty(), recovering.contains(&true)) {
            (false, _) => trace.len() / SPARE,
            (true, true) => trace.len() / SPARE_CLIPPED,
            (true, false) => 0,
        };
        let half = 0.5 / trace.step;
        let peak = trace.peak();
        let sigma = ((comparison.noise_density + comparison.rounding) * half).sqrt().max(LEAST_NOISE * peak);
        let corner = comparison.flicker * half / (sigma * sigma);
        let values = whitened(&trace.values, trace.step, corner);
        let padding = CONTINUED * SAMPLES_PER_CYCLE;
        let padded = (trace.len() + 2 * padding).next_multiple_of(2);
        let mut input: Vec<f64> =
            (0..padded).map(|i| continued(&values, i as isize - padding as isize, padding)).collect();
        let plan = forward_transform(padded);
        let mut spectrum = plan.make_output_vec();
        plan.process(&mut input, &mut spectrum).ok()?;
        Some(Self {
            step: trace.step,
            start: trace.start,
            onset,
            rise: rise(&values[..onset], MOTION * sigma),
            peak,
            sigma,
            speckle: (comparison.speckle * half).sqrt(),
            band: (comparison.cutoff / half).min(1.0),
            freedom: comparison.noise_freedom.max(2.0),
            corner,
            values,
            valid,
            spare,
            recovering: comparison.masked.is_empty().then_some(recovering),
            left_out,
            spectrum,
            padded,
        })
    }

    /// Leaves out samples and their neighbours, if the record has drop-outs or is clipped and few are left out in all;
    /// returns whether any was.
    pub(crate) fn leave_out(&mut self, outliers: &[usize]) -> bool {
        let mut valid = self.valid.clone();
        let may = |at: &&usize| self.recovering.as_ref().is_none_or(|soon| soon.get(**at) == Some(&true));
        for at in outliers.iter().filter(may) {
            let near = at.saturating_sub(SPREAD)..(at + SPREAD + 1).min(valid.len());
            valid[near].fill(false);
        }
        let count = |valid: &[bool]| valid.iter().filter(|valid| **valid).count();
        let more = count(&self.valid) - count(&valid);
        if more == 0 || more > self.spare {
            return false;
        }
        (self.valid, self.spare) = (valid, self.spare - more);
        self.left_out += more;
        true
    }

    /// Standard deviation of a sample at the velocities `mean`, over σ; empty if it is 1 at all of them.
    pub(crate) fn louder(&self, mean: impl Iterator<Item = f64>) -> Vec<f64> {
        let speckle = self.speckle / self.sigma;
        if speckle > 0.0 { mean.map(|velocity| (speckle * velocity).hypot(1.0)).collect() } else { vec![] }
    }

    /// Instant of a place between samples, s.
    pub(crate) fn time(&self, place: f64) -> f64 {
        self.start + self.step * place
    }

    pub(crate) fn len(&self) -> usize {
        self.values.len()
    }

    /// The samples around its onset, and whether each is valid.
    pub(crate) fn around_onset(&self, before: usize, after: usize) -> (&[f64], &[bool]) {
        let around = self.onset.saturating_sub(before)..(self.onset + after).min(self.len());
        (&self.values[around.clone()], &self.valid[around])
    }

    /// The record on the samples of a run, aligned as `placed`, and the compared ones among them.
    pub(crate) fn compared(&self, placed: &Placed) -> (Vec<f64>, Vec<usize>) {
        let (values, valid) = self.shifted(placed.shift, placed.to);
        (values, (placed.from..placed.to).filter(|t| valid[*t]).collect())
    }

    pub(crate) fn outlying(&self) -> (f64, f64) {
        if self.recovering.is_some() { OUTLYING_CLIPPED } else { OUTLYING }
    }

    /// Whether samples may still be left out.
    pub(crate) fn may_leave_out(&self) -> bool {
        self.spare > 0
    }

    /// Value of the record at `shift + i` samples, i from 0 to `count`, and whether it is recorded and valid.
    fn shifted(&self, shift: f64, count: usize) -> (Vec<f64>, Vec<bool>) {
        let whole = shift.floor();
        let part = shift - whole;
        let mut spectrum: Vec<Complex<f64>> = self
            .spectrum
            .iter()
            .enumerate()
            .map(|(k, bin)| {
                let angle = std::f64::consts::TAU * k as f64 * part / self.padded as f64;
                bin * Complex::new(libm::cos(angle), libm::sin(angle))
            })
            .collect();
        if let Some(last) = spectrum.last_mut() {
            last.im = 0.0;
        }
        spectrum[0].im = 0.0;
        let plan = inverse_transform(self.padded);
        let mut output = plan.make_output_vec();
        if plan.process(&mut spectrum, &mut output).is_err() {
            output.fill(0.0);
        }
        let scale = 1.0 / self.padded as f64;
        let padding = (CONTINUED * SAMPLES_PER_CYCLE) as isize;
        let place = |i: usize| i as isize + whole as isize;
        let inside = |at: isize| at >= 0 && at + 1 < self.len() as isize;
        let value = |i: usize| {
            let at = place(i) + padding;
            if at >= 0 && (at as usize) < self.padded { scale * output[at as usize] } else { 0.0 }
        };
        let valid = |i: usize| {
            let at = place(i);
            inside(at) && self.valid[at as usize] && self.valid[at as usize + 1]
        };
        ((0..count).map(value).collect(), (0..count).map(valid).collect())
    }
}

/// Samples at the end of a record's beginning, in whole cycles, whose rms is above `least` without a pause.
fn rise(beginning: &[f64], least: f64) -> usize {
    let cycles = beginning.rchunks_exact(SAMPLES_PER_CYCLE).take(RISING);
    let moves = |cycle: &&[f64]| cycle.iter().map(|v| v * v).sum::<f64>() > least * least * cycle.len() as f64;
    SAMPLES_PER_CYCLE * cycles.take_while(moves).count()
}

/// A trace filtered so that noise of density w (1 + corner/f) becomes white: gain 1/√(1 + corner/f), zero phase.
pub(super) fn whitened(values: &[f64], step: f64, corner: f64) -> Vec<f64> {
    if corner <= 0.0 || values.is_empty() {
        return values.to_vec();
    }
    let padding = CONTINUED * SAMPLES_PER_CYCLE;
    let padded = (values.len() + 2 * padding).next_multiple_of(2);
    let (forward, backward) = (forward_transform(padded), inverse_transform(padded));
    let mut work: Vec<f64> = (0..padded).map(|i| continued(values, i as isize - padding as isize, padding)).collect();
    let mut spectrum = forward.make_output_vec();
    if forward.process(&mut work, &mut spectrum).is_err() {
        return values.to_vec();
    }
    let apart = 1.0 / (padded as f64 * step);
    for (k, bin) in spectrum.iter_mut().enumerate() {
        *bin *= (1.0 + corner / (apart * k.max(1) as f64)).sqrt().recip() / padded as f64;
    }
    if backward.process(&mut spectrum, &mut work).is_err() {
        return values.to_vec();
    }
    work[padding..padding + values.len()].to_vec()
}

/// Sample `index` of a series continued by point reflection about its ends, fading within `padding`.
fn continued(values: &[f64], index: isize, padding: usize) -> f64 {
    let last = values.len() as isize - 1;
    let (end, beyond) = match index {
        i if i < 0 => (0, -i),
        i if i > last => (last, i - last),
        i => return values[i as usize],
    };
    let mirrored = (if end == 0 { beyond } else { last - beyond }).clamp(0, last);
    let turned = 2.0 * values[end as usize] - values[mirrored as usize];
    let part = (beyond as f64 / padding as f64).min(1.0);
    turned * 0.5 * (1.0 + libm::cos(std::f64::consts::PI * part))
}

#[cfg(test)]
mod tests {
    use super::{super::source::misfit, *};
    use granchain_signal::feature::{
        Measurand,
        fingerprint::{FeatureSet, Fingerprint},
    };

    fn record(values: impl Iterator<Item = f64>, masked: Vec<Gap>) -> RecordTrace {
        let fingerprint = Fingerprint::of(Measurand::Velocity, FeatureSet::Full, (0.1, 1.0), 14, 1.0).unwrap();
        let comparison = Comparison {
            cutoff: 0.42,
            bandwidth: None,
            passband: None,
            clipped: [None; 2],
            masked,
            sampling: 1.0,
            noise_density: 0.0,
            flicker: 0.0,
            rounding: 0.0,
            speckle: 0.0,
            noise_freedom: 100.0,
            averages: 1,
            fingerprint,
            features: vec![],
            nuggets: vec![],
            weights: vec![],
            power: 1.0,
            sensitivity: 0.0,
        };
        RecordTrace::of(&Series::new(0.0, 1.0, values.collect()), &comparison).unwrap()
    }

    #[test]
    fn a_run_that_begins_to_move_sooner_than_the_record_is_worse() {
        // Cycles of quiet, of a slow rise, and of a motion that repeats after two of them.
        let motion = |quiet: usize, rise: usize| {
            let amplitude = move |t: usize| match t / SAMPLES_PER_CYCLE {
                cycle if cycle < quiet => 0.0,
                cycle if cycle < quiet + rise => 0.05,
                _ => 1.0,
            };
            let tone = move |t: usize| {
                libm::sin(std::f64::consts::PI * (t % (2 * SAMPLES_PER_CYCLE)) as f64 / SAMPLES_PER_CYCLE as f64)
            };
            (0..40 * SAMPLES_PER_CYCLE).map(move |t| amplitude(t) * tone(t))
        };
        let record = record(motion(10, 10), vec![]);
        let [right, sooner] = [10, 12].map(|rise| misfit(&record, &motion(2, rise).collect::<Vec<f64>>()));
        assert!(right.0 < 1e-12 && (right.1 - 320.0).abs() < 0.01, "{right:?}");
        assert!(sooner.0 > 1e-4, "{sooner:?}");
    }

    #[test]
    fn a_record_is_shifted_by_parts_of_a_sample() {
        let tone = |t: f64| libm::sin(0.9 * t) * libm::exp(-((t - 300.0) / 90.0).powi(2));
        let masked = vec![Gap { from: 50.0, to: 52.0, support: 1.0 }];
        let record = record((0..900).map(|i| tone(i as f64)), masked);
        let (values, valid) = record.shifted(-7.3, 500);
        for (i, value) in values.iter().enumerate().skip(20) {
            assert!((value - tone(i as f64 - 7.3)).abs() < 1e-6, "{i}");
        }
        assert!(!valid[0] && valid[20]);
        let masked = record.onset + 51 + 8;
        assert!(!valid[masked] && valid[masked + 25]);
    }
}
