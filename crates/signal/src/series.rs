//! A uniformly sampled real signal.

use serde::{Deserialize, Serialize};

/// Values at the instants t_i = `start` + i `step`, all in SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Time of the first sample, s.
    pub start: f64,
    /// Sampling interval, s, positive.
    pub step: f64,
    /// Sample values, SI unit of the quantity.
    pub values: Vec<f64>,
}

/// Mean, and rms about it; 0 for no values.
pub fn mean_and_rms(values: &[f64]) -> (f64, f64) {
    if values.is_empty() {
        return (0.0, 0.0);
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt())
}

impl Series {
    pub fn new(start: f64, step: f64, values: Vec<f64>) -> Self {
        Self { start, step, values }
    }

    /// Instant of sample `index`, s.
    pub fn time(&self, index: usize) -> f64 {
        self.start + index as f64 * self.step
    }

    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    pub fn sample_rate(&self) -> f64 {
        1.0 / self.step
    }

    /// Instant of the last sample, s; `start` when empty.
    pub fn end(&self) -> f64 {
        self.time(self.len().saturating_sub(1))
    }

    /// The samples whose instants lie in [`from`, `to`] (half a step of slack at both ends).
    pub fn window(&self, from: f64, to: f64) -> Self {
        let first = ((from - self.start) / self.step - 0.5).ceil().max(0.0) as usize;
        let past = (((to - self.start) / self.step + 0.5).floor().max(-1.0) as isize).saturating_add(1);
        let past = past.max(0).min(self.len() as isize) as usize;
        let first = first.min(past);
        Self { start: self.time(first), step: self.step, values: self.values[first..past].to_vec() }
    }

    /// The same instants with `f` applied to every value.
    pub fn map(&self, f: impl FnMut(f64) -> f64) -> Self {
        Self { start: self.start, step: self.step, values: self.values.iter().copied().map(f).collect() }
    }

    /// Largest magnitude of any sample; 0 when empty.
    pub fn peak(&self) -> f64 {
        self.values.iter().fold(0.0, |peak, value| f64::max(peak, value.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_may_reach_beyond_both_ends_or_to_infinity() {
        let series = Series::new(-1.0, 0.5, vec![0.0, 1.0, 2.0, 3.0]);
        assert_eq!(series.window(f64::NEG_INFINITY, f64::INFINITY), series);
        assert_eq!(series.window(-0.5, 0.0), Series::new(-0.5, 0.5, vec![1.0, 2.0]));
        assert!(series.window(3.0, 4.0).is_empty() && series.window(-9.0, -8.0).is_empty());
    }
}
