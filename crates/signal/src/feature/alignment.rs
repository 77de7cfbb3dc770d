//! Alignment references of a trace: its onset, or the decay after the burst.

use super::fingerprint::{Fingerprint, FingerprintError, MEAN_CYCLES, SAMPLES_PER_CYCLE};
use crate::{Series, about_running_mean};

/// Periods over which the rms is taken when the decay is located: whole periods of f0/3.
const FALL_CYCLES: usize = 3;

/// Mean square over [`FALL_CYCLES`] periods, about the running mean, by the first of their samples.
fn strength(values: &[f64]) -> Vec<f64> {
    let width = FALL_CYCLES * SAMPLES_PER_CYCLE;
    let mut sums = vec![0.0];
    sums.extend(about_running_mean(values, MEAN_CYCLES * SAMPLES_PER_CYCLE).iter().scan(0.0, |sum, value| {
        *sum += value * value;
        Some(*sum)
    }));
    sums.iter().zip(sums.iter().skip(width)).map(|(before, after)| (after - before) / width as f64).collect()
}

/// Sample at which the decay begins: half a period after the highest sample of the first of the last three periods
/// with an rms of at least `level`. Periods are thus cut between their impulses.
fn fall_of(values: &[f64], strength: &[f64], level: f64) -> Option<usize> {
    let first = strength.iter().rposition(|square| *square >= level * level)?;
    let period = values[first..].iter().take(SAMPLES_PER_CYCLE);
    let (highest, _) = period.enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
    Some(first + highest + SAMPLES_PER_CYCLE / 2)
}

pub(super) fn fall(values: &[f64], level: f64) -> Option<usize> {
    fall_of(values, &strength(values), level)
}

impl Fingerprint {
    /// Instant of the alignment reference ([`Fingerprint::alignment`]), s; an onset is interpolated between two
    /// samples.
    pub fn alignment_time(&self, trace: &Series) -> Result<f64, FingerprintError> {
        let index = self.alignment(trace)?;
        let Some(before) = index.checked_sub(1).filter(|_| !self.falls()) else { return Ok(trace.time(index)) };
        let [low, high] = [before, index].map(|i| trace.values[i].abs());
        Ok(trace.time(before) + ((self.threshold() - low) / (high - low)).clamp(0.0, 1.0) * trace.step)
    }
}

/// Running rms of a record over three periods, about its running mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strength {
    /// Half of the largest running rms, m/s or Pa.
    pub level: f64,
    /// Whether the first three periods reach this level.
    pub from_the_first: bool,
    /// Sample at which the decay begins, if at least six periods follow it.
    pub falls: Option<usize>,
}

impl Strength {
    /// Measures a record of [`SAMPLES_PER_CYCLE`] samples a period.
    pub fn of(record: &Series) -> Self {
        let strength = strength(&record.values);
        let level = 0.5 * strength.iter().copied().fold(0.0, f64::max).sqrt();
        let seen = |fall: &usize| fall + 2 * FALL_CYCLES * SAMPLES_PER_CYCLE <= record.values.len();
        Self {
            level,
            from_the_first: strength.first().is_some_and(|square| *square >= level * level),
            falls: fall_of(&record.values, &strength, level).filter(seen),
        }
    }
}

/// The onset threshold of a record, m/s or Pa: between max(4 % P, 6 σ) and 25 % P, as far as possible (in ratio) from every
/// early extremum, so that neither noise nor a small change of the drive makes the onset slip by a cycle.
///
/// - `record`: conditioned velocity or pressure
/// - `noise_rms`: σ of the conditioned record, unit of the record
///
/// `None` when 6 σ exceeds 25 % of the peak: the onset cannot be distinguished from noise.
pub fn onset_threshold(record: &Series, noise_rms: f64) -> Option<f64> {
    const CANDIDATES: usize = 64;
    let peak = record.peak();
    let lowest = f64::max(0.04 * peak, 6.0 * noise_rms);
    let highest = 0.25 * peak;
    if !(lowest <= highest && peak > 0.0) {
        return None;
    }
    let magnitude: Vec<f64> = record.values.iter().map(|v| v.abs()).collect();
    let beyond = magnitude.iter().position(|&v| v >= highest)?;
    let noise = 4.0 * noise_rms;
    let extrema: Vec<f64> = (1..magnitude.len().saturating_sub(1))
        .take_while(|&i| i <= beyond + 2 * SAMPLES_PER_CYCLE)
        .filter(|&i| magnitude[i] >= magnitude[i - 1] && magnitude[i] > magnitude[i + 1] && magnitude[i] > noise)
        .map(|i| magnitude[i])
        .collect();
    let clearance =
        |threshold: f64| extrema.iter().map(|extremum| (extremum / threshold).ln().abs()).fold(f64::INFINITY, f64::min);
    let candidates = (0..=CANDIDATES).map(|i| lowest * (highest / lowest).powf(i as f64 / CANDIDATES as f64));
    candidates.map(|threshold| (clearance(threshold), threshold)).max_by(|a, b| a.0.total_cmp(&b.0)).map(|best| best.1)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn the_onset_threshold_keeps_clear_of_early_extrema() {
        let step = 1.0 / SAMPLES_PER_CYCLE as f64;
        // Lobes of 0.05, 0.1, 0.5, 1: the widest clear span between 4 % and 25 % of the peak is 0.1 … 0.25.
        let heights = [0.05, 0.1, 0.5, 1.0];
        let value = |i: usize| heights[(i / 20).min(3)] * (TAU * i as f64 * step).sin();
        let record = Series::new(0.0, step, (0..400).map(value).collect());
        let threshold = onset_threshold(&record, 1e-4).unwrap();
        assert!((0.2..=0.25).contains(&threshold), "{threshold}");
        assert!(onset_threshold(&record, 0.1).is_none());
    }
}
