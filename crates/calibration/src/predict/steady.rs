//! The regime of a steadily driven motion: periodic, quasi-periodic or chaotic.
//!
//! The motion is looked at once a drive period T0 (stroboscopic section). A point of the section is what the signal does within that period, 40 samples
//! from the drive's phase 0 on: one sample alone may stand still where the motion does not.
//!
//! - **period n**: the section has n points. n is the least number of periods, up to 12, after which the signal is what it was: over the second half of
//!   the window, rms of x(t + nT0) − x(t) at most [`RETURNED`] of the rms of x about its mean.
//! - **quasi-periodic** and **chaotic**: the section has more points, and the floor between the spectral lines tells both apart. A quasi-periodic motion
//!   has lines alone, a chaotic one a broadband part: at least [`BROADBAND`] of the power.
//!
//! The broadband share: in each band of one drive frequency around 0, f0, 2 f0 … the lower quartile of |X|² (Hann window) is the floor, since lines fill
//! less than three quarters of a band; of noise it is ln 4⁄3 times the mean. With whole samples a period, aliased lines fall on lines.

use std::fmt;

use serde::{Deserialize, Serialize};

use granchain_signal::{
    Series,
    feature::{FeatureError, Window},
    forward_transform, mean_and_rms,
    spline::cubic,
};

/// Samples of a drive period.
const SAMPLES: usize = 40;
/// Longest period looked for, in drive periods.
const LONGEST: usize = 12;
/// Fewest drive periods of a window.
const FEWEST: usize = 4 * LONGEST;
/// Largest rms difference after a period, over the rms.
pub const RETURNED: f64 = 0.08;
/// Least share of broadband power of a chaotic motion.
pub const BROADBAND: f64 = 5e-3;

/// How a motion repeats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Regime {
    /// After so many drive periods.
    Period(u32),
    /// Never, with spectral lines alone.
    QuasiPeriodic,
    /// Never, with a broadband part.
    Chaotic,
}

impl fmt::Display for Regime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Period(periods) => write!(f, "period {periods}"),
            Self::QuasiPeriodic => f.write_str("quasi-periodic"),
            Self::Chaotic => f.write_str("chaotic"),
        }
    }
}

/// A steadily driven motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SteadyMotion {
    pub regime: Regime,
    /// Power of the floor between the spectral lines over that of all about the mean, 1.
    pub broadband_share: f64,
    /// The signal at phase 0 of each drive period, its unit.
    #[serde(default, rename = "section_m_per_s", skip_serializing_if = "Vec::is_empty")]
    pub section: Vec<f64>,
}

impl SteadyMotion {
    /// Of a signal in a window in which neither drive nor transient changes, of at least `FEWEST` drive periods. Phase 0 is at time 0.
    pub fn of(series: &Series, window: Window, drive_frequency: f64) -> Result<Self, FeatureError> {
        let period = 1.0 / drive_frequency;
        let window = window.on(series)?;
        // A window of whole periods has its ends on samples up to rounding.
        let whole = Window::new((window.from / period - 1e-6).ceil() * period, window.to);
        let step = period / SAMPLES as f64;
        let mut samples = stroboscope(series, whole, step);
        let periods = samples.len() / SAMPLES;
        if periods < FEWEST {
            let needed = (FEWEST as f64 * period / series.step).ceil() as usize;
            return Err(FeatureError::TooFewSamples { needed, found: window.indices(series).len() });
        }
        samples.truncate(periods * SAMPLES);
        let (_, rms) = mean_and_rms(&samples);
        if rms <= 1e-12 * series.peak() {
            return Err(FeatureError::Constant { from_s: window.from, to_s: window.to });
        }
        let broadband_share = broadband_share(&samples, periods);
        let late = &samples[periods / 2 * SAMPLES..];
        let returns = |after: &usize| {
            let later = &late[after * SAMPLES..];
            let sum: f64 = later.iter().zip(late).map(|(later, before)| (later - before).powi(2)).sum();
            (sum / later.len() as f64).sqrt() <= RETURNED * rms
        };
        let regime = match (1..=LONGEST).find(returns) {
            Some(after) => Regime::Period(after as u32),
            None if broadband_share < BROADBAND => Regime::QuasiPeriodic,
            None => Regime::Chaotic,
        };
        Ok(Self { regime, broadband_share, section: samples.into_iter().step_by(SAMPLES).collect() })
    }
}

/// A signal at the beginning of the window and every `interval` (s) on, by cubic interpolation.
pub fn stroboscope(series: &Series, window: Window, interval: f64) -> Vec<f64> {
    let count = ((window.to.min(series.end()) - window.from) / interval + 1e-6).floor().max(-1.0) as i64 + 1;
    let last = series.len().saturating_sub(1);
    let at = |index: i64| {
        let place = ((window.from + index as f64 * interval - series.start) / series.step).clamp(0.0, last as f64);
        // Rounding must not interpolate where a sample lies.
        let nearest = place.round();
        if (place - nearest).abs() < 1e-6 {
            return series.values[nearest as usize];
        }
        let (whole, t) = (place.floor() as usize, place.fract());
        cubic([0, 1, 2, 3].map(|k| series.values[(whole + k).saturating_sub(1).min(last)]), t)
    };
    if series.is_empty() { Vec::new() } else { (0..count).map(at).collect() }
}

/// Share of the power that lies in the floor between the lines, of so many whole periods.
fn broadband_share(samples: &[f64], periods: usize) -> f64 {
    let count = samples.len();
    let taper = |index: usize| (std::f64::consts::PI * (index as f64 + 0.5) / count as f64).sin().powi(2);
    let weighted: f64 = samples.iter().enumerate().map(|(index, value)| taper(index) * value).sum();
    let mean = weighted / (0.5 * count as f64);
    let plan = forward_transform(count);
    let (mut input, mut output) = (plan.make_input_vec(), plan.make_output_vec());
    for (index, (slot, value)) in input.iter_mut().zip(samples).enumerate() {
        *slot = taper(index) * (value - mean);
    }
    // Cannot fail: both buffers were made by the plan.
    let _ = plan.process(&mut input, &mut output);
    let mut power: Vec<f64> = output.iter().map(|value| value.norm_sqr()).collect();
    let total: f64 = power.iter().sum();
    // Bins are f0 / periods apart.
    let floor: f64 = power
        .chunks_mut(periods)
        .map(|band| {
            let (rank, bins) = (band.len() / 4, band.len() as f64);
            bins * *band.select_nth_unstable_by(rank, f64::total_cmp).1
        })
        .sum();
    floor / (4.0_f64 / 3.0).ln() / total
}
