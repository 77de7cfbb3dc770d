//! `granchain-reproduction dissipation`: which law or mixture of effects brings the printed peaks and thirds.

use std::{
    fmt::Write as _,
    time::{Duration, Instant},
};

use anyhow::Context;
use serde_json::{Value, json};

use super::{Arguments, DEFAULT_MODEL, Head, Shown, stopped};
use crate::{
    dissipation::{DissipationOutcome, DissipationPlan, NOTHING, Study, WEAK},
    divided::Divided,
    page::dissipation::DissipationReport,
};
use granchain::cli::{arguments::Session, forecast::rough_time, progress, summary};
use granchain_calibration::predict::Bodies;
use granchain_report::page::Files;

/// Read the study that flags ask for.
///
/// # Errors
/// Whatever is wrong with the scene.
pub(super) fn read(arguments: &Arguments) -> anyhow::Result<Study> {
    let seed = arguments.session.seed();
    let mut plan = if arguments.quick { DissipationPlan::quick(seed) } else { DissipationPlan::whole(seed) };
    plan.replicates = arguments.replicates(plan.replicates);
    Ok(Study::new(plan, &arguments.overrides(DEFAULT_MODEL), Bodies::new(arguments.session.cache()))?)
}

impl Shown for Study {
    const NAME: &str = "dissipation";

    fn foretell(&self, session: &Session) -> anyhow::Result<()> {
        // Bodies are made once and not counted.
        let prepared = self.bodies().prepared(self.scene()).context("the scene with linear dampers cannot be run")?;
        // Those tried here run alone.
        let share = if prepared.together() > 1 { SIDE_BY_SIDE } else { 1.0 };
        let started = Instant::now();
        let probed = stopped(self.probe(&progress::Bar(indicatif::ProgressBar::hidden())))?;
        let (time, runs) = (share * started.elapsed().as_secs_f64() / probed.max(1) as f64, self.runs());
        let model = self.scene().model.kind.name();
        session.note(format_args!(
            "{runs} runs on model `{model}`, about {}",
            rough_time(Duration::from_secs_f64(time * runs as f64))
        ));
        Ok(())
    }

    fn text(&self, outcome: &DissipationOutcome) -> String {
        format!("model {}\n{}", summary::model(self.scene()), text(outcome))
    }

    fn json(&self, outcome: &DissipationOutcome) -> Value {
        json!({ "model": outcome.model, "candidates": outcome.candidates })
    }

    fn files(&self, outcome: DissipationOutcome, head: Head) -> anyhow::Result<Files> {
        let Head { program, command_line } = head;
        Ok(DissipationReport { program, outcome, command_line }.files()?)
    }
}

/// Time of a run of several side by side over that of one alone.
const SIDE_BY_SIDE: f64 = 0.35;
/// Candidates that the terminal lists.
const LISTED: usize = 12;

/// The first of the rank, and what was refused.
fn text(outcome: &DissipationOutcome) -> String {
    let mut text = String::from("ln Z     alpha  peaks there, mm/s  thirds  candidate\n");
    for (candidate, found, behind) in outcome.ranked().take(LISTED) {
        let peak =
            |index: usize| found.there[index].map_or_else(|| "-".into(), |own| format!("{:+.0}", 1e3 * own.mean));
        let third = found.thirds_over(&outcome.reference)[0].map_or_else(|| "-".into(), |own| format!("x {own:.2}"));
        let peaks =
            format!("{} {}{}", peak(0), peak(1), if found.agrees(outcome.plan.printed) { " agree" } else { "" });
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{behind:<9.1}{:<7.2}{peaks:<19}{third:<8}{}", found.alpha, candidate.name());
    }
    let ran = outcome.ranked().count();
    let _ = writeln!(text, "{ran} candidates ran, {} could not", outcome.candidates.len() - ran);
    let _ = writeln!(text, "ln Z less that of the best: below {NOTHING} nothing, below {WEAK} weak");
    text
}
