//! `granchain twins`: make records with known truth, fit them, count.

use std::{fmt::Write, path::Path};

use clap::Args;
use serde::Serialize;

use super::{
    Outcome,
    arguments::{OutputArguments, Session},
    interrupt,
    output::OutputFolder,
    progress, summary,
    timing::{self, Timing},
};
use crate::{
    calibration::twin::Flaw,
    report::{
        number::significant,
        twins::{TwinFit as PageFit, TwinInterval, TwinsReport},
    },
    scene,
    study::twins::{TwinOutcome, TwinPlan, TwinProof, proof, twins},
};

/// Overrides of the built-in annulus from which twins are made: long enough for the burst, a slow onset and the decay.
const OVERRIDES: [&str; 1] = ["duration=900us"];

/// Arguments of `granchain twins`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Twins whose model is right: both supports, both damping laws, 0–3 % noise, five sample rates
    #[arg(long, value_name = "N", default_value_t = 80, help_heading = "Study")]
    pub count: u64,
    /// Twins of each kind of wrong model: support 30 % softer, other damping law, a missing bead
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Study")]
    pub wrong: u64,
    /// Runs a fit
    #[arg(long, value_name = "N", default_value_t = 600,
          value_parser = clap::value_parser!(u32).range(200..=100_000), help_heading = "Study")]
    pub evaluations: u32,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

/// `twins.json`.
#[derive(Debug, Serialize)]
struct TwinsSummary<'a> {
    program: String,
    plan: TwinPlan,
    proof: &'a TwinProof,
    twins: &'a [TwinOutcome],
}

/// Run it.
///
/// # Errors
/// A folder that cannot be written; Ctrl-C.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let Arguments { count, wrong, evaluations, output, session } = arguments;
    let mut timing = Timing::start();
    let base = scene::load("annulus", &OVERRIDES.map(String::from))?;
    let plan = TwinPlan { count, wrong, evaluations: evaluations as usize, seed: session.seed() };
    let folder = output.out.as_deref().map(|out| OutputFolder::stage(out, output.force)).transpose()?;
    let bar = progress::bar(&session, plan.total(), "twins");
    let outcomes = twins(&base, &plan, &|| bar.inc(1), &interrupt::requested);
    bar.finish_and_clear();
    let outcomes = outcomes.ok_or(interrupt::Interrupted)?;
    timing.stage("twins");
    let proof = proof(&outcomes);
    let summary = TwinsSummary { program: summary::program(), plan, proof: &proof, twins: &outcomes };
    if let Some(folder) = folder {
        folder.write("twins.json", summary::json(&summary)?)?;
        for (name, bytes) in page(&outcomes, &proof, &plan).files()? {
            folder.write(name, bytes)?;
        }
        timing.stage("write");
        folder.write(timing::FILE, timing.to_json())?;
        let place = folder.finish()?;
        session.note(format_args!("written to {}", place.display()));
    }
    session.result(text(&proof, output.out.as_deref()), &summary)?;
    Ok(Outcome::Done)
}

fn statements(proof: &TwinProof) -> Vec<String> {
    let count = proof.parameters.first().map_or(0, |parameter| parameter.count);
    let mut said: Vec<String> = proof
        .parameters
        .iter()
        .map(|parameter| {
            format!(
                "{}: {} of {} intervals hold the truth ({:.1} ± {:.1} %; 90 % is claimed); median width {} and median error {} \
                 in ln",
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
    said.push(format!(
        "of {count} right models {} were called outside scatter, {} not converged, {} gave no fit at all",
        proof.false_alarms, proof.unconverged, proof.without_fit
    ));
    if proof.law_tests > 0 {
        said.push(format!(
            "of {} twins fitted with both damping laws the right one was named in {}, {} were left undecided",
            proof.law_tests, proof.right_law, proof.undecided_law
        ));
    }
    for (flaw, unmasked, count) in &proof.unmasked {
        let kind = match flaw {
            Flaw::None => continue,
            Flaw::SofterSupport => "support 30 % softer than the model's",
            Flaw::OtherLaw => "other damping law than the model's",
            Flaw::MissingBead => "one bead fewer than the model",
        };
        said.push(format!("wrong model, {kind}: {unmasked} of {count} did not end within scatter"));
    }
    said
}

fn text(proof: &TwinProof, out: Option<&Path>) -> String {
    let mut text = String::new();
    for statement in statements(proof) {
        let _ = writeln!(text, "{statement}");
    }
    if out.is_none() {
        text.push_str("Nothing was written; pass --out DIR for the figure and the table of all twins.\n");
    }
    text
}

fn page(outcomes: &[TwinOutcome], proof: &TwinProof, plan: &TwinPlan) -> TwinsReport {
    let fitted = outcomes.iter().filter(|outcome| outcome.flaw == Flaw::None).filter_map(|outcome| {
        let (truth, fit) = (outcome.truth.as_ref()?, outcome.fit.as_ref().ok()?);
        let interval = |(estimate, truth): (&crate::calibration::fit::Estimate, &f64)| TwinInterval {
            truth: *truth,
            value: estimate.median,
            low: estimate.low,
            high: estimate.high,
        };
        Some(PageFit {
            index: truth.index,
            group: format!("{}, {}", truth.support, truth.damping_kind),
            intervals: fit.estimates.iter().zip(&truth.values).map(interval).collect(),
        })
    });
    TwinsReport {
        description: format!(
            "{} records made with known parameters by the accurate integrator (six beads, annulus and rigid wall, linear and \
             Kuwabara–Kono damping, 0–3 % noise, 1.25–10 MHz sampling, unknown trigger and baseline), each fitted with {} runs",
            plan.count, plan.evaluations
        ),
        level: 0.9,
        parameters: vec!["amplitude scale α".into(), "damping coefficient".into()],
        twins: fitted.collect(),
        statements: statements(proof),
        version: env!("CARGO_PKG_VERSION").into(),
        seed: plan.seed,
        command_line: format!(
            "granchain twins --count {} --wrong {} --evaluations {} --seed {}",
            plan.count, plan.wrong, plan.evaluations, plan.seed
        ),
    }
}
