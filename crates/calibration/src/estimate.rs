//! Quoted values from a posterior: the most likely point, the interval of each parameter, and their change in the last
//! batch.

use argmin::{
    core::{CostFunction, Error, Executor, State},
    solver::neldermead::NelderMead,
};
use serde::{Deserialize, Serialize};

use super::{likelihood::TrainingRuns, parameter::Parameter, posterior::Posterior};

/// One parameter as fitted, SI.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    pub name: String,
    pub unit: String,
    /// The jointly most likely value.
    pub value: f64,
    pub median: f64,
    /// 5 % quantile.
    pub low: f64,
    /// 95 % quantile.
    pub high: f64,
    /// Whether the interval or the value touches a bound of the box.
    pub at_bound: bool,
    /// Whether the interval is hardly narrower than the box: the record does not constrain the parameter.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub unidentified: bool,
}

/// Width of a 90 % interval over the box's from which a parameter is unidentified; without any information it is 0.9.
const UNIDENTIFIED: f64 = 0.6;

/// The estimates of all parameters, and the most likely point in unit coordinates.
pub(super) fn estimates_of(
    parameters: &[Parameter],
    training: &TrainingRuns,
    posterior: &Posterior,
) -> (Vec<Estimate>, Vec<f64>) {
    let most_likely = polish(training, posterior);
    let each = parameters.iter().enumerate().map(|(d, parameter)| estimate(parameter, posterior, most_likely[d], d));
    (each.collect(), most_likely)
}

fn estimate(parameter: &Parameter, posterior: &Posterior, most_likely: f64, d: usize) -> Estimate {
    let [low, median, high] = [0.05, 0.5, 0.95].map(|probability| posterior.quantile(d, probability));
    Estimate::between(parameter, most_likely, [low, median, high])
}

impl Estimate {
    /// Of the most likely value and the quantiles 5, 50 and 95 %, in unit coordinates; where that value lies outside its interval the median is quoted.
    pub(super) fn between(parameter: &Parameter, most_likely: f64, [low, median, high]: [f64; 3]) -> Self {
        let most_likely = if (low..=high).contains(&most_likely) { most_likely } else { median };
        let pressed = Parameter::pressed(low, most_likely, high);
        Self {
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            value: parameter.value(most_likely),
            median: parameter.value(median),
            low: parameter.value(low),
            high: parameter.value(high),
            unidentified: high - low > UNIDENTIFIED,
            at_bound: pressed.0 || pressed.1,
        }
    }
}

/// Half-width in ln below which a change of the median does not matter: the drive is known to half a per cent.
const NARROW: f64 = 0.01;

/// Largest change of a median, in half-widths of its interval; `spans` converts unit coordinates to logarithms.
pub(super) fn drift(before: &Posterior, after: &Posterior, spans: &[f64]) -> f64 {
    (0..after.dimension())
        .map(|d| {
            let half_width = 0.5 * (after.quantile(d, 0.95) - after.quantile(d, 0.05)) * spans[d];
            let moved = (before.quantile(d, 0.5) - after.quantile(d, 0.5)).abs() * spans[d];
            moved / half_width.max(NARROW)
        })
        .fold(0.0, f64::max)
}

/// −SL with a smooth wall around the unit box, for Nelder–Mead.
struct Surface<'a>(&'a TrainingRuns);

impl CostFunction for Surface<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, position: &Vec<f64>) -> Result<f64, Error> {
        let inside = position.iter().all(|u| (0.0..=1.0).contains(u));
        let value = if inside { -self.0.log_likelihood(position) } else { f64::INFINITY };
        Ok(if value.is_finite() { value } else { 1e9 })
    }
}

/// The most likely point: argmin's Nelder–Mead on the likelihood surface, from the densest cell.
fn polish(training: &TrainingRuns, posterior: &Posterior) -> Vec<f64> {
    let start = posterior.centre(posterior.densest());
    let mut simplex = vec![start.clone()];
    for d in 0..start.len() {
        let mut corner = start.clone();
        // A fifth of the interval where cells lie askew in the box.
        let step = match posterior.frame {
            Some(_) => 0.2 * (posterior.quantile(d, 0.95) - posterior.quantile(d, 0.05)),
            None => (posterior.high[d] - posterior.low[d]) / posterior.cells as f64,
        };
        corner[d] += if corner[d] + step > 1.0 { -step } else { step };
        simplex.push(corner);
    }
    let Ok(solver) = NelderMead::new(simplex).with_sd_tolerance(1e-6) else { return start };
    let polished = Executor::new(Surface(training), solver)
        .configure(|state| state.max_iters(200))
        .ctrlc(false)
        .run()
        .ok()
        .and_then(|result| result.state.get_best_param().cloned());
    match polished {
        Some(point) if training.log_likelihood(&point) >= training.log_likelihood(&start) => point,
        _ => start,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quoted_value_lies_in_its_interval_wherever_the_mode_is() {
        let alpha = Parameter::alpha();
        for (mode, quoted) in [(0.1, 0.5), (0.45, 0.45), (0.9, 0.5)] {
            let found = Estimate::between(&alpha, mode, [0.4, 0.5, 0.6]);
            assert!(
                found.value == alpha.value(quoted) && found.low < found.value && found.value < found.high,
                "{mode}"
            );
        }
    }
}
