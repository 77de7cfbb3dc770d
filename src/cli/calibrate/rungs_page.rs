//! The report's side of the rungs.

use super::page::law_report;
use crate::{
    calibration::{FittedCandidate, Problem},
    report::calibration::{RungReport, RungRow, RungsReport},
};

/// The rungs side by side, where there is more than the chain.
pub fn rungs(problem: &Problem, law: &FittedCandidate, fea: Option<&[f64]>) -> Option<RungsReport> {
    let below = law.fit.below.as_ref()?;
    let outcomes = law.rungs(problem, fea);
    let fits = [Some(&below.fit), Some(&law.fit)].into_iter().chain(std::iter::repeat(None));
    let rungs = outcomes.iter().zip(fits).map(|(rung, fit)| RungReport {
        model: rung.model.clone(),
        parameters: fit.map_or_else(Vec::new, |fit| law_report(law, fit, problem).parameters),
        verdict: rung.verdict,
        runs: rung.runs,
        failed_runs: rung.failed_runs,
    });
    let comparison = &problem.lead().comparison;
    let names = comparison.names();
    let features = names.iter().enumerate().zip(&below.differences).map(|((index, name), between)| RungRow {
        name: name.replace('_', " "),
        unit: comparison.unit(index).into(),
        recorded: comparison.measured(index),
        expected: outcomes.iter().map(|rung| Some(rung.features.get(name.as_ref())?.value)).collect(),
        scatter: outcomes.iter().map(|rung| rung.features.get(name.as_ref())?.scatter).collect(),
        difference: between.difference,
        standard_error: between.standard_error,
    });
    Some(RungsReport {
        rungs: rungs.collect(),
        below: Box::new(law_report(law, &below.fit, problem)),
        features: features.collect(),
    })
}
