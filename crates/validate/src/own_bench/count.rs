//! Summary over the records of a user's bench: coverage, calibration of the posterior, widths against the bound, power to reject a wrong bench.

use serde::{Deserialize, Serialize};

use super::{OwnFit, OwnPlan, OwnRecord, WrongBench};
use crate::{laboratory::wilson, synthetic::median};
use granchain_calibration::{
    fit::{Estimate, Verdict},
    waveform::{QUANTILE, WaveformBound},
};

/// Probability that an interval states.
pub(crate) const LEVEL: f64 = 0.9;

/// Quantile of the intervals for counted shares, 95 %.
const Z: f64 = 1.96;

/// One parameter of one experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterCoverage {
    pub name: String,
    /// Intervals that hold the truth, whatever the verdict.
    pub covered: usize,
    pub count: usize,
    /// 95 % interval of the share covered (Wilson 1927).
    pub coverage: (f64, f64),
    /// Median ln(high/low) of the fits; absent without fits.
    pub median_width: Option<f64>,
    /// The same as the bound lets expect it of fits, and median ratio of the fits' widths to the Cramér–Rao bound.
    pub expected_width: Option<f64>,
    pub width_over_bound: Option<f64>,
    /// Posterior probability below each truth, ascending.
    pub ranks: Vec<f64>,
    /// Largest distance of their distribution function from that of a uniform distribution, and the distance that is exceeded by chance in 5 % of
    /// studies, √(ln 40/(2n)) (Dvoretzky, Kiefer and Wolfowitz 1956, Massart 1990).
    pub ecdf_distance: f64,
    pub ecdf_band: f64,
    /// Factor on the half-widths with which 90 % of the intervals hold the truth: the ⌈0.9 (n + 1)⌉-th smallest that an interval needs. Only where the
    /// coverage lies below 90 % beyond chance.
    pub widen: Option<f64>,
}

/// Records of one kind of wrong bench.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Power {
    pub wrong: WrongBench,
    pub count: usize,
    /// Not `within scatter`, or refused.
    pub rejected: usize,
    /// 95 % interval of the chance to be rejected (Wilson 1927).
    pub chance: (f64, f64),
}

/// One experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExperimentCount {
    pub name: String,
    pub records: usize,
    pub fits: usize,
    pub parameters: Vec<ParameterCoverage>,
    /// Expected correlation of the logarithms of each pair of parameters, median.
    pub correlations: Vec<(String, String, f64)>,
    /// Median of the cycles that runs predict.
    pub cycles: Option<f64>,
    /// Right benches called `outside scatter`.
    pub outside: usize,
    pub not_converged: usize,
    pub refused: usize,
    /// Why, of the first of them.
    pub refusal: Option<String>,
    pub power: Vec<Power>,
}

/// All experiments.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnCount(pub Vec<ExperimentCount>);

impl OwnCount {
    #[must_use]
    pub fn of(plan: &OwnPlan, records: &[OwnRecord]) -> Self {
        let of = |(index, experiment): (usize, &super::Experiment)| {
            let own: Vec<&OwnRecord> = records.iter().filter(|record| record.experiment == index).collect();
            ExperimentCount::of(experiment.name.clone(), &own)
        };
        Self(plan.experiments.iter().enumerate().map(of).collect())
    }

    /// The experiment with the narrowest expected interval of a parameter; `None` for one alone.
    #[must_use]
    pub fn best(&self, parameter: usize) -> Option<&ExperimentCount> {
        let width = |it: &&ExperimentCount| it.parameters.get(parameter).and_then(ParameterCoverage::width);
        let known = self.0.iter().filter(|it| width(it).is_some());
        known
            .min_by(|a, b| width(a).unwrap_or(f64::INFINITY).total_cmp(&width(b).unwrap_or(f64::INFINITY)))
            .filter(|_| self.0.len() > 1)
    }
}

impl ParameterCoverage {
    /// Median width of the fits, else the expected one.
    #[must_use]
    pub fn width(&self) -> Option<f64> {
        self.median_width.or(self.expected_width)
    }

    fn of(name: &str, d: usize, records: &[&OwnRecord]) -> Self {
        let truth = |record: &OwnRecord| record.values.get(d).map(|(_, value)| *value);
        let fitted: Vec<(f64, &Estimate, f64)> = records
            .iter()
            .filter_map(|record| {
                Some((truth(record)?, fit_of(record)?.estimates.get(d)?, *fit_of(record)?.ranks.get(d)?))
            })
            .collect();
        let deviation = |bound: &WaveformBound| 2.0 * QUANTILE * bound.bound[d][d].sqrt();
        let over = |record: &&&OwnRecord| {
            let estimate = fit_of(record)?.estimates.get(d)?;
            Some((estimate.high / estimate.low).ln() / deviation(record.bound.as_ref()?))
        };
        let expected = |record: &&&OwnRecord| {
            record.bound.as_ref().filter(|it| it.decides).map(|it| 2.0 * QUANTILE * it.expected[d][d].sqrt())
        };
        let covered = fitted.iter().filter(|(truth, it, _)| (it.low..=it.high).contains(truth)).count();
        let count = fitted.len();
        let mut ranks: Vec<f64> = fitted.iter().map(|(.., rank)| *rank).collect();
        ranks.sort_by(f64::total_cmp);
        // Of the half-width on the side where the truth lies.
        let needed = |(truth, it, _): &(f64, &Estimate, f64)| {
            let end = if *truth < it.median { it.low } else { it.high };
            (truth / it.median).ln() / (end / it.median).ln()
        };
        let mut needed: Vec<f64> = fitted.iter().map(needed).collect();
        needed.sort_by(f64::total_cmp);
        let place = (LEVEL * (count + 1) as f64).ceil() as usize;
        let coverage = wilson(covered, count, Z);
        Self {
            name: name.into(),
            covered,
            count,
            coverage,
            median_width: some(fitted.iter().map(|(_, it, _)| (it.high / it.low).ln())),
            expected_width: some(records.iter().filter_map(|it| expected(&it))),
            width_over_bound: some(records.iter().filter_map(|it| over(&it))),
            ecdf_distance: distance(&ranks),
            ecdf_band: (40.0_f64.ln() / (2.0 * count.max(1) as f64)).sqrt(),
            ranks,
            widen: needed.get(place.saturating_sub(1)).copied().filter(|_| coverage.1 < LEVEL),
        }
    }
}

impl ExperimentCount {
    fn of(name: String, records: &[&OwnRecord]) -> Self {
        let (right, wrong): (Vec<&OwnRecord>, Vec<&OwnRecord>) =
            records.iter().copied().partition(|record| record.wrong.is_none());
        let names: Vec<&String> = right
            .iter()
            .map(|record| &record.values)
            .find(|it| !it.is_empty())
            .into_iter()
            .flatten()
            .map(|(name, _)| name)
            .collect();
        let ended =
            |verdict| right.iter().filter_map(|record| fit_of(record)).filter(|fit| fit.verdict == verdict).count();
        let pair = |a: usize, b: usize| {
            let of =
                |bound: &WaveformBound| bound.expected[a][b] / (bound.expected[a][a] * bound.expected[b][b]).sqrt();
            let value = some(right.iter().filter_map(|record| record.bound.as_ref()).map(of))?;
            Some((names[a].clone(), names[b].clone(), value))
        };
        let refusals: Vec<&String> = right.iter().filter_map(|record| record.fit.as_ref()?.as_ref().err()).collect();
        let power = |kind: WrongBench| {
            let of_kind: Vec<&&OwnRecord> =
                wrong.iter().filter(|record| record.wrong == Some(kind) && !record.values.is_empty()).collect();
            let rejected = of_kind
                .iter()
                .filter(|record| fit_of(record).is_none_or(|fit| fit.verdict != Verdict::WithinScatter))
                .count();
            let count = of_kind.len();
            (count > 0).then(|| Power { wrong: kind, count, rejected, chance: wilson(rejected, count, Z) })
        };
        Self {
            name,
            records: right.len(),
            fits: right.iter().filter(|record| fit_of(record).is_some()).count(),
            parameters: names.iter().enumerate().map(|(d, name)| ParameterCoverage::of(name, d, &right)).collect(),
            correlations: (0..names.len())
                .flat_map(|b| (0..b).filter_map(move |a| Some((a, b))))
                .filter_map(|(a, b)| pair(a, b))
                .collect(),
            cycles: some(right.iter().filter_map(|record| Some(record.bound.as_ref()?.cycles))),
            outside: ended(Verdict::OutsideScatter),
            not_converged: ended(Verdict::NotConverged),
            refused: refusals.len(),
            refusal: refusals.first().map(|text| (*text).clone()),
            power: WrongBench::ALL.into_iter().filter_map(power).collect(),
        }
    }
}

fn fit_of(record: &OwnRecord) -> Option<&OwnFit> {
    record.fit.as_ref()?.as_ref().ok()
}

/// Median; `None` of nothing.
fn some(values: impl Iterator<Item = f64>) -> Option<f64> {
    Some(median(values)).filter(|median| median.is_finite())
}

/// Largest distance between the distribution function of ascending numbers from 0 to 1 and the uniform one (Kolmogorov).
fn distance(ascending: &[f64]) -> f64 {
    let count = ascending.len().max(1) as f64;
    let at = |(index, rank): (usize, &f64)| f64::max(rank - index as f64 / count, (index + 1) as f64 / count - rank);
    ascending.iter().enumerate().map(at).fold(0.0, f64::max)
}
