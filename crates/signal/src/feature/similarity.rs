//! Similarity of two traces, independent of the trigger and of the phase of a period-m state.

use serde::{Deserialize, Serialize};

use super::{FeatureError, Window, correlation::lagged_sums, interpolation::interpolate, line};
use crate::Series;

/// Periods m of the states whose m copies are tried (numbers of drive periods after which a response repeats).
const STATE_PERIODS: [u32; 4] = [1, 2, 3, 6];

/// Two traces at their best alignment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Similarity {
    /// Normalised cross-correlation ρ, −1…1.
    pub correlation: f64,
    /// Lag in all, s: `candidate(t + lag)` lies over `reference(t)`.
    pub lag_s: f64,
    /// Whole drive periods in the lag: which copy of a period-m state.
    pub shift_periods: i32,
    /// Smallest m of 1, 2, 3, 6 whose shifts reach the best alignment.
    pub state_period: u32,
    /// ρ with the lag confined to half a drive period: no copies allowed.
    pub unshifted_correlation: f64,
    /// √⟨(reference − candidate(t + lag))²⟩ at that lag, offsets included, unit of the series.
    pub rms_difference: f64,
    /// The same over the reference's rms about its mean, 1.
    pub relative_rms_difference: f64,
}

/// Best normalised cross-correlation of two traces over the lag, ±½ drive period of trigger error plus whole shifts of
/// up to m − 1 drive periods either way, m = 1, 2, 3, 6.
///
/// ρ = Σ (a − ā)(b − b̄)/√(Σ (a − ā)² Σ (b − b̄)²), a the reference in the window, b the candidate at t + lag on the
/// reference's instants (band-limited interpolation), means over the overlap; a lag with less than half of the window
/// overlapping is not tried. A shift counts as better than a smaller one only when it raises ρ by more than 1e-6.
///
/// - `reference`, `candidate`: same unit, sample steps may differ, both already limited to the same band
/// - `window`: on the reference's clock
pub fn similarity(
    reference: &Series,
    candidate: &Series,
    window: Window,
    drive_frequency: f64,
) -> Result<Similarity, FeatureError> {
    line::check(reference, drive_frequency)?;
    line::check(candidate, drive_frequency)?;
    let window = window.on(reference)?;
    let range = window.indices(reference);
    let origin = reference.time(range.start);
    let a = &reference.values[range];
    let constant = || FeatureError::Constant { from_s: window.from, to_s: window.to };

    // The candidate on the reference's instants, as far as a lag may reach.
    let period = 1.0 / (drive_frequency * reference.step); // samples
    let reach = (5.5 * period).ceil() as isize + 1;
    let position =
        |index: isize, lag: f64| (origin + (index as f64 + lag) * reference.step - candidate.start) / candidate.step;
    let last = (candidate.len() - 1) as f64;
    let b: Vec<Option<f64>> = (-reach..a.len() as isize + reach)
        .map(|index| {
            let position = position(index, 0.0);
            (-1e-6..=last + 1e-6).contains(&position).then(|| interpolate(&candidate.values, position))
        })
        .collect();
    let first = b.iter().position(Option::is_some).unwrap_or(0);
    let known: Vec<f64> = b[first..].iter().map_while(|value| *value).collect();
    // About their means, so that nothing cancels in the sums.
    let centred = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        values.iter().map(|value| value - mean).collect::<Vec<f64>>()
    };
    let (left, right) = (centred(a), centred(&known));
    let (of_left, of_right) = (Sums::of(&left), Sums::of(&right));
    let products = lagged_sums(&left, &right);
    let correlation_at = |lag: isize| {
        // a[i] meets known[i + lag + reach − first]
        let shift = lag + reach - first as isize;
        let from = (-shift).max(0);
        let to = (known.len() as isize - shift).min(a.len() as isize);
        if 2 * (to - from) < a.len() as isize || to - from < 3 {
            return None;
        }
        let count = (to - from) as f64;
        let (sa, aa) = of_left.between(from as usize, to as usize);
        let (sb, bb) = of_right.between((from + shift) as usize, (to + shift) as usize);
        let product = products[shift.rem_euclid(products.len() as isize) as usize];
        let (aa, bb, ab) = (aa - sa * sa / count, bb - sb * sb / count, product - sa * sb / count);
        (aa > 0.0 && bb > 0.0).then(|| ab / (aa * bb).sqrt())
    };
    let rho: Vec<Option<f64>> = (-reach..=reach).map(correlation_at).collect();
    let at = |lag: isize| rho.get((lag + reach) as usize).copied().flatten();

    let mut best: Option<(f64, f64, u32)> = None;
    let mut unshifted = None;
    for state_period in STATE_PERIODS {
        let furthest = (f64::from(state_period) - 0.5) * period;
        let mut found: Option<(f64, isize)> = None;
        let most = furthest.floor() as isize;
        for lag in -most..=most {
            if let Some(value) = at(lag)
                && found.is_none_or(|(highest, _)| value > highest)
            {
                found = Some((value, lag));
            }
        }
        let Some((value, lag)) = found else { continue };
        // Parabola through the neighbours: where between two sample shifts the traces agree best.
        let (mut peak, mut fraction) = (value, 0.0);
        if let (Some(below), Some(above)) = (at(lag - 1), at(lag + 1)) {
            let curvature = 2.0 * value - below - above;
            if curvature > 0.0 {
                fraction = (0.5 * (above - below) / curvature).clamp(-0.5, 0.5);
                peak = value + 0.25 * (above - below) * fraction;
            }
        }
        unshifted = unshifted.or(Some(peak));
        if best.is_none_or(|(highest, ..)| peak > highest + 1e-6) {
            best = Some((peak, lag as f64 + fraction, state_period));
        }
    }
    let (_, lag, state_period) = best.ok_or_else(constant)?;

    // The traces themselves at that lag, not the parabola's word for it.
    let (mut left, mut right) = (Vec::with_capacity(a.len()), Vec::with_capacity(a.len()));
    for (index, &value) in a.iter().enumerate() {
        let position = position(index as isize, lag);
        if (0.0..=last).contains(&position) {
            left.push(value);
            right.push(interpolate(&candidate.values, position));
        }
    }
    let found = correlation(&left, &right).ok_or_else(constant)?;
    let count = left.len() as f64;
    let mean = left.iter().sum::<f64>() / count;
    let spread = (left.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
    let difference = (left.iter().zip(&right).map(|(x, y)| (x - y).powi(2)).sum::<f64>() / count).sqrt();
    Ok(Similarity {
        correlation: found,
        lag_s: lag * reference.step,
        shift_periods: (lag / period).round() as i32,
        state_period,
        unshifted_correlation: if state_period == 1 { found } else { unshifted.unwrap_or(found) },
        rms_difference: difference,
        relative_rms_difference: difference / spread,
    })
}

struct Sums(Vec<(f64, f64)>);

impl Sums {
    fn of(values: &[f64]) -> Self {
        let mut sums = Vec::with_capacity(values.len() + 1);
        let mut sum = (0.0, 0.0);
        sums.push(sum);
        for value in values {
            sum = (sum.0 + value, sum.1 + value * value);
            sums.push(sum);
        }
        Self(sums)
    }

    fn between(&self, from: usize, to: usize) -> (f64, f64) {
        (self.0[to].0 - self.0[from].0, self.0[to].1 - self.0[from].1)
    }
}

/// Pearson's ρ; `None` where a trace is constant.
fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let count = a.len() as f64;
    let (sa, sb) = (a.iter().sum::<f64>() / count, b.iter().sum::<f64>() / count);
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        let (x, y) = (x - sa, y - sb);
        aa += x * x;
        bb += y * y;
        ab += x * y;
    }
    (aa > 0.0 && bb > 0.0).then(|| ab / (aa * bb).sqrt())
}
