//! Summary over the records of a user's bench: coverage, ranks of the truths, widths against the bound, power to reject a wrong bench.

use serde::{Deserialize, Serialize};

use super::{Experiment, OwnFit, OwnPlan, OwnRecord};
use crate::{
    fit::{Estimate, Verdict},
    waveform::{QUANTILE, WaveformBound},
};
use granchain_signal::median;

/// Probability that an interval states.
const LEVEL: f64 = 0.9;

/// Quantile of the intervals for counted shares, 95 %.
const Z: f64 = 1.96;

/// One parameter of one experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterCoverage {
    pub name: String,
    /// Intervals that hold the truth, whatever the verdict, and the 95 % interval of their share (Wilson 1927).
    pub covered: usize,
    pub coverage: (f64, f64),
    /// Median ln(high/low): as the bound lets expect, and of the fits; median ratio of the fits' to the Cramér–Rao bound.
    pub expected_width: Option<f64>,
    pub fitted_width: Option<f64>,
    pub width_over_bound: Option<f64>,
    /// Posterior probability below each truth, ascending.
    pub ranks: Vec<f64>,
    /// Largest distance of their distribution function from the uniform one (Kolmogorov), and the distance that 95 % of studies stay below,
    /// √(ln 40/(2n)) (Massart 1990).
    pub ecdf_distance: f64,
    pub ecdf_band: f64,
    /// Factor on the half-widths with which 90 % of the intervals hold the truth: the ⌈0.9 (n + 1)⌉-th smallest that an interval needs, times the one
    /// that is applied. Only where the coverage is below 90 % beyond chance.
    pub widen: Option<f64>,
}

/// One experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExperimentCount {
    pub name: String,
    /// What is wrong in the bench of the fit.
    pub wrong: Option<String>,
    pub records: usize,
    pub fits: usize,
    /// Fits that are `doubtful` or `outside scatter` (p < 0.05), refusals among them; and the 95 % interval of their share.
    pub rejected: usize,
    pub rejection: (f64, f64),
    pub not_converged: usize,
    pub refused: usize,
    /// Why, of the first of them.
    pub refusal: Option<String>,
    /// Median of the cycles that runs predict.
    pub cycles: Option<f64>,
    pub parameters: Vec<ParameterCoverage>,
    /// Expected correlation of the logarithms of each pair of parameters, median.
    pub correlations: Vec<(String, String, f64)>,
}

/// All experiments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnCount(pub Vec<ExperimentCount>);

impl OwnCount {
    #[must_use]
    pub fn of(plan: &OwnPlan, records: &[OwnRecord]) -> Self {
        let of = |(index, experiment): (usize, &Experiment)| {
            let own: Vec<&OwnRecord> = records.iter().filter(|record| record.experiment == index).collect();
            let mut count = ExperimentCount::of(experiment, &own);
            count.parameters.iter_mut().flat_map(|it| &mut it.widen).for_each(|it| *it *= plan.widen.unwrap_or(1.0));
            count
        };
        Self(plan.experiments.iter().enumerate().map(of).collect())
    }

    /// The experiments on the right bench.
    pub fn right(&self) -> impl Iterator<Item = &ExperimentCount> {
        self.0.iter().filter(|experiment| experiment.wrong.is_none())
    }

    /// Of several experiments the one with the narrowest interval of a parameter.
    #[must_use]
    pub fn narrowest(&self, parameter: usize) -> Option<(&ExperimentCount, f64)> {
        let widths = self.right().filter_map(|it| Some((it, it.parameters.get(parameter)?.width()?)));
        widths.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| self.right().count() > 1)
    }
}

impl ParameterCoverage {
    /// Median width of the fits, else the expected one.
    #[must_use]
    pub fn width(&self) -> Option<f64> {
        self.fitted_width.or(self.expected_width)
    }

    fn of<'a>(name: &str, d: usize, records: &[&'a OwnRecord]) -> Self {
        let fit = |record: &&'a OwnRecord| {
            let fit = fit_of(record)?;
            Some((record.values.get(d)?.1, fit.estimates.get(d)?, *fit.ranks.get(d)?))
        };
        let fits: Vec<(f64, &Estimate, f64)> = records.iter().filter_map(fit).collect();
        let width = |it: &Estimate| (it.high / it.low).ln();
        let of = |covariance: &[Vec<f64>]| 2.0 * QUANTILE * covariance[d][d].sqrt();
        let bound = |record: &'a OwnRecord| record.bound.as_ref().filter(|bound| bound.decides);
        let over = |record: &&'a OwnRecord| Some(width(fit(record)?.1) / of(&bound(record)?.bound));
        let covered = fits.iter().filter(|(truth, it, _)| (it.low..=it.high).contains(truth)).count();
        // Of the half-width on the side where the truth lies.
        let needed = |(truth, it, _): &(f64, &Estimate, f64)| {
            (truth / it.median).ln() / (if *truth < it.median { it.low } else { it.high } / it.median).ln()
        };
        let mut needed: Vec<f64> = fits.iter().map(needed).collect();
        let mut ranks: Vec<f64> = fits.iter().map(|(.., rank)| *rank).collect();
        [&mut needed, &mut ranks].into_iter().for_each(|values| values.sort_by(f64::total_cmp));
        let count = fits.len();
        let place = (LEVEL * (count + 1) as f64).ceil() as usize;
        let coverage = wilson(covered, count, Z);
        Self {
            name: name.into(),
            covered,
            coverage,
            expected_width: middle(records.iter().filter_map(|record| Some(of(&bound(record)?.expected)))),
            fitted_width: middle(fits.iter().map(|(_, it, _)| width(it))),
            width_over_bound: middle(records.iter().filter_map(over)),
            ecdf_distance: deviations(&ranks).map(|(_, apart)| apart.abs()).fold(0.0, f64::max),
            ecdf_band: (40.0_f64.ln() / (2.0 * count.max(1) as f64)).sqrt(),
            ranks,
            widen: needed.get(place.saturating_sub(1)).copied().filter(|_| coverage.1 < LEVEL),
        }
    }
}

impl ExperimentCount {
    fn of(experiment: &Experiment, records: &[&OwnRecord]) -> Self {
        let values = records.iter().map(|record| &record.values).find(|values| !values.is_empty());
        let values = values.filter(|_| experiment.wrong.is_none());
        let names: Vec<&String> = values.into_iter().flatten().map(|(name, _)| name).collect();
        let verdicts: Vec<Verdict> = records.iter().filter_map(|record| Some(fit_of(record)?.verdict)).collect();
        let ended = |verdict| verdicts.iter().filter(|it| **it == verdict).count();
        let refusals: Vec<&String> = records.iter().filter_map(|record| record.fit.as_ref()?.as_ref().err()).collect();
        let rejected = ended(Verdict::Doubtful) + ended(Verdict::OutsideScatter) + refusals.len();
        let bounds = || records.iter().filter_map(|record| record.bound.as_ref());
        let pair = |(a, b): (usize, usize)| {
            let of = |it: &WaveformBound| it.expected[a][b] / (it.expected[a][a] * it.expected[b][b]).sqrt();
            Some((names[a].clone(), names[b].clone(), middle(bounds().map(of))?))
        };
        Self {
            name: experiment.name.clone(),
            wrong: experiment.wrong.clone(),
            records: records.len(),
            fits: verdicts.len(),
            rejected,
            rejection: wilson(rejected, verdicts.len() + refusals.len(), Z),
            not_converged: ended(Verdict::NotConverged),
            refused: refusals.len(),
            refusal: refusals.first().map(|text| (*text).clone()),
            cycles: middle(bounds().map(|bound| bound.cycles)),
            parameters: names.iter().enumerate().map(|(d, name)| ParameterCoverage::of(name, d, records)).collect(),
            correlations: (0..names.len()).flat_map(|b| (0..b).map(move |a| (a, b))).filter_map(pair).collect(),
        }
    }
}

/// Distribution function of ascending ranks minus that of a uniform distribution, before and behind every rank.
pub fn deviations(ranks: &[f64]) -> impl Iterator<Item = (f64, f64)> {
    let count = ranks.len() as f64;
    let step = move |(index, rank): (usize, &f64)| [index, index + 1].map(|below| (*rank, below as f64 / count - rank));
    ranks.iter().enumerate().flat_map(step)
}

/// Interval for a probability of which `hits` of `count` trials speak (Wilson 1927), `z` standard deviations wide.
///
/// p = (k + z²/2)/(n + z²) ± z/(n + z²) √(k(n − k)/n + z²/4). Unlike p ± √(p(1 − p)/n) it never leaves 0…1.
///
/// ```
/// use granchain_calibration::design::wilson;
/// // 66 of 80 is the smallest count that a true probability of 0.9 explains at z = 2.576 (99 %).
/// assert!(wilson(66, 80, 2.576).1 > 0.9 && wilson(65, 80, 2.576).1 < 0.9);
/// ```
#[must_use]
pub fn wilson(hits: usize, count: usize, z: f64) -> (f64, f64) {
    if count == 0 {
        return (0.0, 1.0);
    }
    let (k, n) = (hits as f64, count as f64);
    let middle = (k + 0.5 * z * z) / (n + z * z);
    let half = z / (n + z * z) * (k * (n - k) / n + 0.25 * z * z).sqrt();
    ((middle - half).max(0.0), (middle + half).min(1.0))
}

fn fit_of(record: &OwnRecord) -> Option<&OwnFit> {
    record.fit.as_ref()?.as_ref().ok()
}

/// Median; `None` of nothing.
fn middle(values: impl Iterator<Item = f64>) -> Option<f64> {
    Some(median(values)).filter(|median| median.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fits of a true value of 1, whose medians are e^error with intervals of ±0.1 in ln.
    fn counted(errors: &[f64]) -> ParameterCoverage {
        let made = |error: &f64| {
            let [low, median, high] = [-0.1, 0.0, 0.1].map(|by| (error + by).exp());
            let (name, unit) = ("alpha".to_owned(), "1".to_owned());
            let estimate =
                Estimate { name, unit, value: median, median, low, high, at_bound: false, unidentified: false };
            let ranks = vec![0.5 - error];
            let fit = OwnFit { verdict: Verdict::WithinScatter, p_value: 0.5, estimates: vec![estimate], ranks };
            OwnRecord { experiment: 0, number: 0, values: vec![("alpha".into(), 1.0)], bound: None, fit: Some(Ok(fit)) }
        };
        let records: Vec<OwnRecord> = errors.iter().map(made).collect();
        ParameterCoverage::of("alpha", 0, &records.iter().collect::<Vec<_>>())
    }

    #[test]
    fn intervals_that_miss_are_widened_to_what_nine_in_ten_need_and_others_left_as_they_are() {
        let count = counted(&(0..19).map(|i| 0.02 * f64::from(i)).collect::<Vec<_>>());
        // 0, 0.02 … 0.08 lie within ±0.1, and the 18th of 19 needs 0.34.
        assert!((5..=6).contains(&count.covered) && count.coverage.1 < LEVEL, "{count:?}");
        assert!((count.widen.unwrap() - 3.4).abs() < 1e-9 && (count.fitted_width.unwrap() - 0.2).abs() < 1e-12);
        let count = counted(&(0..20).map(|i| 0.005 * (f64::from(i) + 0.5) - 0.05).collect::<Vec<_>>());
        assert_eq!((count.covered, count.widen), (20, None));
        // Ranks lie from 0.45 to 0.55.
        assert!((count.ecdf_distance - 0.45).abs() < 0.01 && count.ecdf_distance > count.ecdf_band, "{count:?}");
    }
}
