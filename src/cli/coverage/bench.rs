//! Coverage on the usual benches instead of in measurement scenarios: of a hydrophone's records, of several drive levels fitted together, of other
//! parameters than α and damping.

use serde::Serialize;
use serde_json::{Value, json};

use super::{Arguments, COUNT, SUMMARY};
use crate::{
    calibration::{multi_record::TESTED_TOGETHER, parameter::Parameter, search::Search},
    cli::{
        Outcome,
        arguments::{Session, usage},
        interrupt::{self, Interrupted},
        output::page_results,
        progress, summary,
    },
    feature::Measurand,
    report::number::significant,
    scene::{self, ModelKind, Scene},
    validate::synthetic::{
        FittedBy, LevelProof, SyntheticCoverage, SyntheticPlan, level_proof, level_synthetic, proof, synthetics,
        water_synthetic,
    },
};

/// Long enough for the burst, a slow onset and the decay; in water until the sound of the burst has passed.
const DURATIONS: [&str; 2] = ["duration=900us", "duration=480us"];

/// Make, fit and count the records.
pub fn execute(arguments: &Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let Arguments { quantity, records, fit, count, evaluations, model, output, part, .. } = arguments;
    let (count, model) = (&count.unwrap_or(COUNT), &model.unwrap_or(ModelKind::Chain));
    let pressure = *quantity == Some(Measurand::Pressure);
    if let Some(unknown) = fit.iter().find(|name| !Parameter::names().contains(&name.as_str())) {
        return Err(usage(format!("--fit {unknown}: expected {}", Parameter::names().join(", "))));
    }
    if part.part.is_some() || (pressure || *records > 1) && *model == ModelKind::Reduced || pressure && *records > 1 {
        return Err(usage(
            "--quantity, --records and --fit take no --part; --quantity and --records take only --model chain, one at a time",
        ));
    }
    let usual = SyntheticPlan::default();
    let parameters = if fit.is_empty() { usual.parameters.clone() } else { fit.clone() };
    let tested = if *records > 1 { TESTED_TOGETHER } else { Search::tested(parameters.len()) };
    let plan = SyntheticPlan {
        count: *count,
        evaluations: evaluations.map_or(tested, |runs| runs as usize),
        seed: session.seed(),
        fit: if *model == ModelKind::Reduced { FittedBy::Ladder } else { FittedBy::Chain },
        parameters,
        ..usual
    };
    let folder = output.stage(&page_results(SUMMARY))?;
    let name = if pressure { "water" } else { "annulus" };
    let kind = format!("model.kind={}", model.name());
    let base = scene::load(name, &[DURATIONS[usize::from(pressure)].into(), kind])?;
    let bar = progress::bar(session, *count, "records");
    let made = made(&base, &plan, pressure, *records, &|| bar.inc(1));
    bar.finish_and_clear();
    let (statements, counted) = made?;
    let summary = json!({"program": summary::program(), "model": model.name(), "plan": plan, "count": counted});
    if let Some(folder) = folder {
        folder.write(SUMMARY, summary::json(&summary)?)?;
        session.note(format_args!("written to {}", folder.finish()?.display()));
    }
    session.result(statements.join("\n") + "\n", &summary)?;
    Ok(Outcome::Done)
}

/// Description of the records, and everything counted of them.
fn made(
    base: &Scene,
    plan: &SyntheticPlan,
    pressure: bool,
    records: u32,
    finished: &(dyn Fn() + Sync),
) -> anyhow::Result<(Vec<String>, Value)> {
    let stop = &interrupt::requested;
    let all = 0..plan.count;
    if records > 1 {
        let levels: Vec<f64> = (0..records).map(|level| 0.5_f64.powi(level as i32)).collect();
        let outcomes = level_synthetic(base, plan, &levels, all, finished, stop).ok_or(Interrupted)?;
        let proof = level_proof(&outcomes, &levels);
        return Ok((of_levels(&proof), value(&proof, &outcomes)));
    }
    let outcomes = match pressure {
        true => water_synthetic(base, plan, all, finished, stop),
        false => synthetics(base, plan, all, finished, stop)?,
    };
    let outcomes = outcomes.ok_or(Interrupted)?;
    let proof = proof(&outcomes);
    Ok((of_records(&proof), value(&proof, &outcomes)))
}

fn value(proof: &impl Serialize, outcomes: &impl Serialize) -> Value {
    json!({"proof": proof, "records": outcomes})
}

fn of_records(proof: &SyntheticCoverage) -> Vec<String> {
    let count = proof.parameters.first().map_or(0, |parameter| parameter.count);
    let mut statements: Vec<String> = proof
        .parameters
        .iter()
        .map(|parameter| {
            format!(
                "{}: {} of {} intervals hold the truth ({:.1} ± {:.1} %; 90 % is claimed); median width {}, median error {} in ln",
                parameter.name,
                parameter.covered,
                parameter.count,
                100.0 * parameter.covered as f64 / parameter.count.max(1) as f64,
                100.0 * parameter.binomial_error,
                significant(parameter.median_width, 2),
                significant(parameter.median_error, 2),
            )
        })
        .collect();
    statements.push(format!(
        "of {count} right models {} were called outside scatter, {} not converged, {} gave no fit at all",
        proof.false_alarms, proof.unconverged, proof.without_fit
    ));
    for (what, tests, right, undecided) in [
        ("both damping laws", proof.law_tests, proof.right_law, proof.undecided_law),
        ("every mount", proof.mount_tests, proof.right_mount, proof.undecided_mount),
    ] {
        if tests > 0 {
            statements.push(format!(
                "of {tests} records fitted with {what} the right one was named in {right}, {undecided} were left undecided"
            ));
        }
    }
    statements
}

fn of_levels(proof: &LevelProof) -> Vec<String> {
    let row = |row: &crate::validate::synthetic::LevelWidths| {
        let from = if row.levels == "all" { "all levels".into() } else { format!("drive level {} alone", row.levels) };
        format!(
            "{}, {from}: {} of {} intervals hold the truth; median width {}, median error {} in ln",
            row.name,
            row.covered,
            row.count,
            significant(row.median_width, 2),
            significant(row.median_error, 2)
        )
    };
    let mut statements: Vec<String> = proof.widths.iter().map(row).collect();
    let of_all = proof.widths.iter().filter(|row| row.levels == "all");
    statements.extend(of_all.zip(&proof.median_ratio).map(|(row, ratio)| {
        let ratio = significant(*ratio, 2);
        format!(
            "{}: the joint interval is {ratio} times as wide as that of the first level alone, in the median",
            row.name
        )
    }));
    statements.push(format!("{} gave no joint fit", proof.without_fit));
    statements
}
