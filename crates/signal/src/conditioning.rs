//! Instrument model for simulated traces: bandwidth, delay, sign and sample instants of the record.

use super::{LowPass, Resampler, Series};

/// Instrument model between true motion and recorded samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditioning {
    /// −6 dB point of a zero-phase low-pass, Hz; `None` leaves the trace as it is.
    pub bandwidth: Option<f64>,
    /// Delay of the record behind the motion, s.
    pub delay: f64,
    /// Whether the record has the opposite sign.
    pub invert: bool,
    /// First instant of the record, s.
    pub start: f64,
    /// Interval of the record, s.
    pub step: f64,
    /// Number of samples of the record.
    pub count: usize,
}

impl Conditioning {
    /// Resampling onto the instants of `record`, without filter, delay or change of sign.
    pub fn onto(record: &Series) -> Self {
        Self { bandwidth: None, delay: 0.0, invert: false, start: record.start, step: record.step, count: record.len() }
    }

    /// `trace` as the instrument would record it. Outside the trace its end values are held.
    pub fn apply(&self, trace: &Series) -> Series {
        let Self { bandwidth, delay, invert, start, step, count } = *self;
        // A low-pass whose stop band begins below half the output rate has left nothing to alias.
        let clean = bandwidth.is_some_and(|bandwidth| 1.15 * bandwidth * step.max(trace.step) <= 0.5);
        let ratio = if clean { 1.0 } else { trace.step / step };
        let resampler = Resampler::with_ratio(trace.start, trace.step, trace.len(), start - delay, step, count, ratio);
        let filter = bandwidth.map(|bandwidth| LowPass::new(trace.step, trace.len(), bandwidth));
        let mut values = resampler.apply(&filter.map_or_else(|| trace.values.clone(), |it| it.apply(&trace.values)));
        if invert {
            values.iter_mut().for_each(|value| *value = -*value);
        }
        Series::new(start, step, values)
    }
}

/// Samples minus their running mean over `width` samples. Within `width` of an end, the mean of the first or last
/// `width` samples is subtracted; a shorter series loses its overall mean. This removes offset, drift and hum. Lines
/// of which `width` holds whole periods pass unchanged.
///
/// ```
/// use granchain_signal::about_running_mean;
///
/// // One period is four samples: what is added to it goes, the wave stays.
/// let wave: Vec<f64> = (0..40).map(|i| [0.0, 1.0, 0.0, -1.0][i % 4]).collect();
/// let raised: Vec<f64> = wave.iter().map(|value| value + 0.3).collect();
/// let left = about_running_mean(&raised, 8);
/// assert!(left.iter().zip(&wave).all(|(left, wave)| (left - wave).abs() < 1e-12));
/// ```
pub fn about_running_mean(values: &[f64], width: usize) -> Vec<f64> {
    let width = width.min(values.len());
    let mut sum: f64 = values[..width].iter().sum();
    let mut first = 0;
    let about = |(index, value): (usize, &f64)| {
        let wanted = index.saturating_sub(width / 2).min(values.len() - width);
        while first < wanted {
            sum += values[first + width] - values[first];
            first += 1;
        }
        value - sum / width as f64
    };
    values.iter().enumerate().map(about).collect()
}

/// Range (largest minus smallest value) of the running mean over `width` samples; 0 for a shorter series.
///
/// ```
/// use granchain_signal::wander;
///
/// let ramp: Vec<f64> = (0..10).map(f64::from).collect();
/// assert_eq!(wander(&ramp, 4), 6.0);
/// ```
pub fn wander(values: &[f64], width: usize) -> f64 {
    if width == 0 || values.len() < width {
        return 0.0;
    }
    let mut sum = 0.0;
    let sums: Vec<f64> = std::iter::once(0.0)
        .chain(values.iter().map(|value| {
            sum += value;
            sum
        }))
        .collect();
    let means = || sums.windows(width + 1).map(|part| (part[width] - part[0]) / width as f64);
    means().fold(f64::NEG_INFINITY, f64::max) - means().fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_tone_comes_out_late_inverted_and_on_the_lab_s_instants() {
        let omega = 2.0 * PI * 73e3;
        let trace = Series::new(0.0, 1e-7, (0..8000).map(|i| (omega * 1e-7 * i as f64).sin()).collect());
        let lab = Conditioning {
            bandwidth: Some(1e6),
            delay: 3.3e-6,
            invert: true,
            start: 101.7e-6,
            step: 3.1e-7,
            count: 1800,
        };
        let out = lab.apply(&trace);
        assert_eq!((out.start, out.step, out.len()), (lab.start, lab.step, 1800));
        for (i, value) in out.values.iter().enumerate() {
            let expected = -(omega * (out.time(i) - 3.3e-6)).sin();
            assert!((value - expected).abs() < 3e-5, "{i}: {value} {expected}"); // ripple of filter and resampler
        }
    }

    #[test]
    fn before_the_trace_begins_the_record_shows_rest() {
        let trace = Series::new(0.0, 1e-7, (0..2000).map(|i| (1e-3 * f64::from(i)).powi(2)).collect());
        let record = Series::new(-50e-6, 2e-7, vec![0.0; 400]);
        let out = Conditioning::onto(&record).apply(&trace);
        assert!(out.values[..250].iter().all(|x| x.abs() < 1e-9));
        assert!((out.values[300] - trace.values[100]).abs() < 1e-5);
    }
}
