//! Instrument effects that no run contains, as columns of the covariance.

use std::f64::consts::{PI, TAU};

use faer::Mat;

use granchain_model::scene::Scene;

/// Standard deviation of the remaining time shift, s.
const SHIFT: f64 = 4e-6;

/// Standard deviation of the ratio of two clocks.
pub(crate) const CLOCK: f64 = 1e-4;

/// Standard deviation of the corner of an instrument's AC coupling, Hz.
const COUPLING: f64 = 700.0;

/// Standard deviation of a slow drift over the record's peak, and twice the highest frequency of a drift over the
/// drive's.
const DRIFT: f64 = 0.03;
const SLOW: f64 = 0.1;

/// Standard deviation of crosstalk of the drive, over the record's peak, in phase and in quadrature.
pub(super) const CROSSTALK: f64 = 0.01;

/// Standard deviations of all of them.
#[derive(Debug, Clone)]
pub(crate) struct Nuisances {
    pub shift: f64,
    /// Of the ratio of the two clocks.
    pub clock: f64,
    /// Of ln of the sensitivity.
    pub sensitivity: f64,
    /// Motion of the horn over its peak, in phase and in quadrature, at the samples of a run.
    pub horn: [Vec<f64>; 2],
    pub frequency: f64,
}

impl Nuisances {
    /// For a record of that sensitivity under that motion of the horn, at the samples of a run.
    pub(crate) fn new(sensitivity: f64, horn: [Vec<f64>; 2], frequency: f64) -> Self {
        Self { shift: SHIFT, clock: CLOCK, sensitivity, horn, frequency }
    }

    /// The same for the horn of a scene, at samples of that interval (s).
    pub(crate) fn of_scene(sensitivity: f64, scene: &Scene, step: f64) -> Self {
        let motion = scene.drive.motion(1.0);
        let count = (scene.duration / step) as usize + 1;
        let [mut along, mut across] = [vec![0.0; count], vec![0.0; count]];
        let angular = TAU * scene.drive.frequency;
        for i in 0..count {
            let (displacement, velocity) = motion.at(i as f64 * step);
            (along[i], across[i]) = (displacement, velocity / angular);
        }
        let peak = along.iter().fold(f64::MIN_POSITIVE, |most, x| f64::max(most, x.abs()));
        [&mut along, &mut across].into_iter().flatten().for_each(|x| *x /= peak);
        Self::new(sensitivity, [along, across], scene.drive.frequency)
    }

    /// The column of the shift.
    pub(crate) fn shift_column(&self, step: f64, mean: &[f64], rows: &[usize]) -> Mat<f64> {
        let slope = slope(mean, step);
        Mat::from_fn(rows.len(), 1, |i, _| self.shift * slope[rows[i]])
    }

    /// The column of the clock, about the middle of the samples.
    pub(crate) fn clock_column(&self, step: f64, mean: &[f64], rows: &[usize]) -> Mat<f64> {
        let slope = slope(mean, step);
        let [first, last] = [rows.first(), rows.last()].map(|row| row.copied().unwrap_or(0));
        let middle = 0.5 * (first + last) as f64;
        let value = |t: usize| self.clock * (t as f64 - middle) * step * slope[t];
        Mat::from_fn(rows.len(), 1, |i, _| value(rows[i]))
    }

    /// The columns of the crosstalk, in phase and in quadrature.
    pub(crate) fn crosstalk(&self, peak: f64, rows: &[usize]) -> Mat<f64> {
        let value = |t: usize, j: usize| CROSSTALK * peak * self.horn[j].get(t).copied().unwrap_or(0.0);
        Mat::from_fn(rows.len(), 2, |i, j| value(rows[i], j))
    }

    /// All but the shift, of a record sampled at `step` (s) with that peak.
    pub(crate) fn columns(&self, (step, peak): (f64, f64), mean: &[f64], rows: &[usize]) -> Mat<f64> {
        let clock = self.clock_column(step, mean, rows);
        let mut integral = vec![0.0; mean.len()];
        for t in 1..mean.len() {
            integral[t] = integral[t - 1] + 0.5 * step * (mean[t] + mean[t - 1]);
        }
        let [first, last] = [rows.first(), rows.last()].map(|row| row.copied().unwrap_or(0));
        let length = (last + 1 - first) as f64;
        let mut columns: Vec<Vec<f64>> = vec![
            (0..rows.len()).map(|i| clock[(i, 0)]).collect(),
            rows.iter().map(|t| TAU * COUPLING * integral[*t]).collect(),
        ];
        if self.sensitivity > 0.0 {
            columns.push(rows.iter().map(|t| self.sensitivity * mean[*t]).collect());
        }
        let crosstalk = self.crosstalk(peak, rows);
        columns.extend((0..2).map(|j| (0..rows.len()).map(|i| crosstalk[(i, j)]).collect()));
        // Cosines over the window and half of it before and behind, so that neither end is special.
        let slow = (2.0 * length * step * SLOW * self.frequency) as usize;
        for number in 0..=slow {
            let angle = PI * number as f64 / (2.0 * length);
            columns.push(
                rows.iter().map(|t| DRIFT * peak * libm::cos(angle * ((t - first) as f64 + 0.5 * length))).collect(),
            );
        }
        Mat::from_fn(rows.len(), columns.len(), |i, j| columns[j][i])
    }
}

/// Derivative of a trace by central differences of fourth order, unit of the trace over s.
fn slope(trace: &[f64], step: f64) -> Vec<f64> {
    let last = trace.len() as isize - 1;
    let at = |i: isize| trace[i.clamp(0, last) as usize];
    (0..trace.len() as isize)
        .map(|i| (8.0 * (at(i + 1) - at(i - 1)) - (at(i + 2) - at(i - 2))) / (12.0 * step))
        .collect()
}
