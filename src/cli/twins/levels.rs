//! `granchain twins --levels N`: what further drive levels narrow.

use std::fmt::Write;

use serde::Serialize;

use super::{OVERRIDES, shown_name};
use crate::{
    cli::{
        Outcome,
        arguments::{OutputArguments, Session},
        interrupt,
        output::{OutputFolder, page_results},
        progress, summary,
        timing::{self, Timing},
    },
    report::{
        number::significant,
        twins::{TwinFit as PageFit, TwinInterval, TwinsReport},
    },
    scene,
    study::twins::{LevelOutcome, LevelProof, LevelWidths, TwinPlan, level_proof, level_twins},
};

/// `twins.json`.
#[derive(Debug, Serialize)]
struct LevelsSummary<'a> {
    program: String,
    plan: TwinPlan,
    levels: &'a [f64],
    proof: &'a LevelProof,
    twins: &'a [LevelOutcome],
}

/// Make, fit, count.
///
/// # Errors
/// A folder that cannot be written; Ctrl-C.
pub fn execute(
    plan: TwinPlan,
    levels: u32,
    output: &OutputArguments,
    session: &Session,
    mut timing: Timing,
) -> anyhow::Result<Outcome> {
    let mut overrides = OVERRIDES.map(String::from).to_vec();
    overrides.push("model.kind=chain".into());
    let base = scene::load("annulus", &overrides)?;
    let levels: Vec<f64> = (0..levels as i32).map(|number| 0.5_f64.powi(number)).collect();
    let folder = output
        .out
        .as_deref()
        .map(|out| OutputFolder::stage(out, &page_results("twins.json"), output.force))
        .transpose()?;
    let bar = progress::bar(session, plan.count, "twins");
    let outcomes = level_twins(&base, &plan, &levels, &|| bar.inc(1), &interrupt::requested);
    bar.finish_and_clear();
    let outcomes = outcomes.ok_or(interrupt::Interrupted)?;
    timing.stage("twins");
    let proof = level_proof(&outcomes, &levels);
    let said = statements(&proof, &outcomes);
    let summary = LevelsSummary {
        program: summary::program(),
        plan: plan.clone(),
        levels: &levels,
        proof: &proof,
        twins: &outcomes,
    };
    if let Some(folder) = folder {
        folder.write("twins.json", summary::json(&summary)?)?;
        for (name, bytes) in page(&outcomes, &plan, &levels, said.clone()).files()? {
            folder.write(name, bytes)?;
        }
        timing.stage("write");
        folder.write(timing::FILE, timing.to_json())?;
        let place = folder.finish()?;
        session.note(format_args!("written to {}", place.display()));
    }
    let mut text = "twins of model chain, fitted by the chain\n".to_owned();
    for statement in said {
        let _ = writeln!(text, "{statement}");
    }
    session.result(text, &summary)?;
    Ok(Outcome::Done)
}

fn statements(proof: &LevelProof, outcomes: &[LevelOutcome]) -> Vec<String> {
    let mut said: Vec<String> = proof
        .widths
        .iter()
        .map(|row| {
            let from = match row.levels.as_str() {
                "all" => "all levels together".to_owned(),
                level => format!("drive level {level} alone"),
            };
            format!(
                "{}, {from}: {} of {} intervals hold the truth; median width {}, median error {} in ln",
                row.name,
                row.covered,
                row.count,
                significant(row.median_width, 2),
                significant(row.median_error, 2)
            )
        })
        .collect();
    let of_all = proof.widths.iter().filter(|row| row.levels == "all");
    for (LevelWidths { name, .. }, ratio) in of_all.zip(&proof.median_ratio) {
        said.push(format!(
            "{name}: the joint interval is {} times as wide as that of the first level alone, in the median over twins",
            significant(*ratio, 2)
        ));
    }
    said.push(format!("of {} twins {} gave no joint fit", outcomes.len(), proof.without_fit));
    said
}

fn page(outcomes: &[LevelOutcome], plan: &TwinPlan, levels: &[f64], statements: Vec<String>) -> TwinsReport {
    let fitted = outcomes.iter().filter_map(|outcome| {
        let (truth, fit) = (outcome.shots.first()?, outcome.joint.as_ref().ok()?);
        let interval = |(estimate, truth): (&crate::calibration::fit::Estimate, &f64)| TwinInterval {
            truth: *truth,
            value: estimate.median,
            low: estimate.low,
            high: estimate.high,
        };
        Some(PageFit {
            index: outcome.index,
            group: format!("{}, {}", truth.support, truth.damping_kind),
            intervals: fit.estimates.iter().zip(&truth.values).map(interval).collect(),
        })
    });
    TwinsReport {
        description: format!(
            "{} twins made with known parameters by the chain's accurate integrator (six beads, annulus and rigid wall, linear and \
             Kuwabara–Kono damping), each recorded at {} drive levels, every one half the level before, with 0–3 % noise, 1.25–10 MHz \
             sampling, unknown trigger and baseline of its own, and fitted together at {} points; intervals are those of the joint fits",
            plan.count,
            levels.len(),
            plan.evaluations
        ),
        level: 0.9,
        parameters: outcomes
            .iter()
            .find_map(|it| it.joint.as_ref().ok())
            .map_or_else(Vec::new, |fit| fit.estimates.iter().map(|it| shown_name(&it.name)).collect()),
        twins: fitted.collect(),
        statements,
        version: env!("CARGO_PKG_VERSION").into(),
        seed: plan.seed,
        command_line: format!(
            "granchain twins --levels {} --count {} --evaluations {} --seed {}",
            levels.len(),
            plan.count,
            plan.evaluations,
            plan.seed
        ),
    }
}
