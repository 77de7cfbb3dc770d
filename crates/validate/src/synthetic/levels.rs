//! Synthetic records recorded at several drive levels and fitted together, beside the fit of each level by itself.
//!
//! Record 0 of each set is the record of the single-level study, and has the same fit: what is gained by the further levels is
//! read record by record.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{SyntheticFit, SyntheticPlan, median, product};
use granchain_calibration::{
    fit::Estimate,
    synthetic::{Synthetic, Truth, at_level, synthetic_at_level},
};
use granchain_model::{self as model, scene::Scene};
use granchain_signal::feature::Measurand;

/// Result of one set of synthetic records at several levels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LevelOutcome {
    pub index: u64,
    /// Truth of each record, level by level; empty if one could not be made.
    #[serde(rename = "shots")]
    pub recorded_runs: Vec<Truth>,
    /// The fit of each level by itself, with as many runs as the joint one has points.
    pub single: Vec<Result<SyntheticFit, String>>,
    /// The fit of all levels together, or why there is none.
    pub joint: Result<SyntheticFit, String>,
    /// What each level alone says by the joint fit's own runs.
    pub shares: Vec<Vec<Estimate>>,
}

/// Make and fit the synthetic records `part` of the `plan.count` of `base` at the drive `levels` (factors on its amplitude, the first of them 1) on the chain.
///
/// `finished` is called after each synthetic record; once `stop` says so no further synthetic record is begun, and the result is `None`.
#[must_use]
pub fn level_synthetic(
    base: &Scene,
    plan: &SyntheticPlan,
    levels: &[f64],
    part: Range<u64>,
    finished: &(dyn Fn() + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<LevelOutcome>> {
    part.into_par_iter()
        .map(|index| {
            if stop() {
                return None;
            }
            let outcome = outcome(base, plan, levels, index);
            finished();
            Some(outcome)
        })
        .collect()
}

fn outcome(base: &Scene, plan: &SyntheticPlan, levels: &[f64], index: u64) -> LevelOutcome {
    let scene = plan.scene(base, index);
    let nothing = |recorded_runs: Vec<Truth>, reason: String| LevelOutcome {
        index,
        recorded_runs,
        single: vec![],
        joint: Err(reason),
        shares: vec![],
    };
    let parameters = match plan.parameters(&scene) {
        Ok(parameters) => parameters,
        Err(error) => return nothing(vec![], error.to_string()),
    };
    let run = |scene: &Scene| model::run(scene, &mut |_| true);
    let uncertainty = plan.uncertainty;
    let recorded_runs: Result<Vec<Synthetic>, _> = (0..)
        .zip(levels)
        .map(|(number, level)| {
            synthetic_at_level(&scene, &parameters, &uncertainty, *level, (index, number), plan.seed, &run)
        })
        .collect();
    let recorded_runs = match recorded_runs {
        Ok(recorded_runs) => recorded_runs,
        Err(error) => {
            let reason = std::error::Error::source(&error).map_or_else(|| error.to_string(), ToString::to_string);
            return nothing(vec![], reason);
        }
    };
    let truths: Vec<Truth> = recorded_runs.iter().map(|recorded_run| recorded_run.truth.clone()).collect();
    let seed = plan.seed.wrapping_add(1000 * (index + 1));
    let records: Vec<(Scene, &[u8])> = recorded_runs
        .iter()
        .zip(levels)
        .map(|(recorded_run, level)| (at_level(&scene, *level), recorded_run.csv.as_slice()))
        .collect();
    let definition = plan.definition(Measurand::Velocity, seed);
    let single = records
        .iter()
        .map(|(scene, csv)| {
            product::fit(&definition, scene, csv, None).as_ref().map(SyntheticFit::from).map_err(Clone::clone)
        })
        .collect();
    let joint = product::fitted(&definition, &records, None).map(|fitted| fitted.best().fit.clone());
    let shares = joint
        .as_ref()
        .map_or_else(|_| vec![], |joint| joint.shares.iter().map(|share| share.estimates.clone()).collect());
    LevelOutcome {
        index,
        recorded_runs: truths,
        single,
        joint: joint.as_ref().map(SyntheticFit::from).map_err(Clone::clone),
        shares,
    }
}

/// Widths and coverage of one parameter from some of the records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LevelWidths {
    pub name: String,
    pub levels: String,
    /// Intervals that hold the truth.
    pub covered: usize,
    pub count: usize,
    /// Median width of the interval in ln.
    pub median_width: f64,
    /// Median |ln(median/truth)|.
    pub median_error: f64,
}

/// Summary over all synthetic records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LevelProof {
    /// Each parameter from each level by itself, then from all together.
    pub widths: Vec<LevelWidths>,
    /// Median over synthetic records of joint width over width of the first level, parameter by parameter.
    pub median_ratio: Vec<f64>,
    /// Synthetic records without a joint fit.
    pub without_fit: usize,
}

#[must_use]
pub fn level_proof(outcomes: &[LevelOutcome], levels: &[f64]) -> LevelProof {
    let truth =
        |outcome: &LevelOutcome, d: usize| outcome.recorded_runs.first().map(|recorded_run| recorded_run.values[d]);
    let width = |estimate: &Estimate| (estimate.high / estimate.low).ln();
    let of = |fit: &Result<SyntheticFit, String>, d: usize| fit.as_ref().ok().map(|fit| fit.estimates[d].clone());
    let joint = |outcome: &LevelOutcome, d: usize| of(&outcome.joint, d);
    let single = |outcome: &LevelOutcome, level: usize, d: usize| of(outcome.single.get(level)?, d);
    let fits = outcomes.iter().find_map(|outcome| outcome.joint.as_ref().ok());
    let names: Vec<String> = fits.map_or_else(Vec::new, |fit| fit.estimates.iter().map(|it| it.name.clone()).collect());
    let mut widths = Vec::new();
    let mut median_ratio = Vec::new();
    for (d, name) in names.iter().enumerate() {
        let summary = |levels: String, estimate: &dyn Fn(&LevelOutcome) -> Option<Estimate>| {
            let fitted: Vec<(f64, Estimate)> =
                outcomes.iter().filter_map(|outcome| Some((truth(outcome, d)?, estimate(outcome)?))).collect();
            let holds = |(truth, estimate): &&(f64, Estimate)| (estimate.low..=estimate.high).contains(truth);
            LevelWidths {
                name: name.clone(),
                levels,
                covered: fitted.iter().filter(holds).count(),
                count: fitted.len(),
                median_width: median(fitted.iter().map(|(_, estimate)| width(estimate))),
                median_error: median(fitted.iter().map(|(truth, estimate)| (estimate.median / truth).ln().abs())),
            }
        };
        for (number, level) in levels.iter().enumerate() {
            widths.push(summary(level.to_string(), &|outcome| single(outcome, number, d)));
        }
        widths.push(summary("all".into(), &|outcome| joint(outcome, d)));
        median_ratio.push(median(
            outcomes.iter().filter_map(|outcome| Some(width(&joint(outcome, d)?) / width(&single(outcome, 0, d)?))),
        ));
    }
    LevelProof { widths, median_ratio, without_fit: outcomes.iter().filter(|outcome| outcome.joint.is_err()).count() }
}
