//! `granchain twins --levels N`: what further drive levels narrow.

use std::{fmt::Write, ops::Range, path::Path};

use serde::Serialize;
use serde_json::{Value, json};

use super::{OVERRIDES, shown_name, staged};
use crate::{
    cli::{
        Outcome,
        arguments::{OutputArguments, Session},
        interrupt,
        output::OutputFolder,
        parts::{self, Divisible, Parts},
        progress, summary,
        timing::{self, Timing},
    },
    report::{
        number::significant,
        twins::{TwinFit as PageFit, TwinInterval, TwinsReport},
    },
    scene::{self, Scene},
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

/// Twins at several drive levels, with the bench they are made on.
pub struct Study {
    base: Scene,
    plan: TwinPlan,
    levels: Vec<f64>,
    output: OutputArguments,
    session: Session,
    timing: Timing,
}

impl Study {
    /// Read the bench.
    ///
    /// # Errors
    /// A bench that cannot be read.
    pub fn new(plan: TwinPlan, levels: u32, output: OutputArguments, session: Session) -> anyhow::Result<Self> {
        let timing = Timing::start();
        let mut overrides = OVERRIDES.map(String::from).to_vec();
        overrides.push("model.kind=chain".into());
        let base = scene::load("annulus", &overrides)?;
        let levels = (0..levels as i32).map(|number| 0.5_f64.powi(number)).collect();
        Ok(Self { base, plan, levels, output, session, timing })
    }

    fn outcomes(&self, part: Range<u64>) -> anyhow::Result<Vec<LevelOutcome>> {
        let bar = progress::bar(&self.session, part.end - part.start, "twins");
        let outcomes = level_twins(&self.base, &self.plan, &self.levels, part, &|| bar.inc(1), &interrupt::requested);
        bar.finish_and_clear();
        Ok(outcomes.ok_or(interrupt::Interrupted)?)
    }

    /// Make, fit, count.
    ///
    /// # Errors
    /// A folder that cannot be written; Ctrl-C.
    pub fn run_here(mut self) -> anyhow::Result<Outcome> {
        let folder = staged(&self.output, "twins.json")?;
        let outcomes = self.outcomes(0..self.plan.count)?;
        self.timing.stage("twins");
        self.conclude(&outcomes, folder)
    }

    fn conclude(mut self, outcomes: &[LevelOutcome], folder: Option<OutputFolder>) -> anyhow::Result<Outcome> {
        let Self { plan, levels, session, timing, .. } = &mut self;
        let proof = level_proof(outcomes, levels);
        let said = statements(&proof, outcomes);
        let summary =
            LevelsSummary { program: summary::program(), plan: plan.clone(), levels, proof: &proof, twins: outcomes };
        if let Some(folder) = folder {
            folder.write("twins.json", summary::json(&summary)?)?;
            for (name, bytes) in page(outcomes, plan, levels, said.clone()).files()? {
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
}

impl Divisible for Study {
    fn points(&self) -> usize {
        self.plan.count as usize
    }

    fn out(&self) -> Option<&Path> {
        self.output.out.as_deref()
    }

    fn plan(&self) -> anyhow::Result<Vec<u8>> {
        let scene = summary::scene_digest(&self.base);
        let (program, levels) = (summary::program(), &self.levels);
        let plan = json!({ "program": program, "scene_sha256": scene, "twins": self.plan, "levels": levels });
        summary::json(&plan)
    }

    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>> {
        parts::values(&self.outcomes(part.start as u64..part.end as u64)?)
    }

    fn finish(self: Box<Self>, parts: &Parts) -> anyhow::Result<Outcome> {
        let folder = staged(&self.output, "twins.json")?;
        self.conclude(&parts.all()?, folder)
    }
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
