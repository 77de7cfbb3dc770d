//! `granchain study dissipation`: which law or mixture of effects brings the printed peaks and thirds.

use std::{fmt::Write as _, time::Instant};

use anyhow::Context;
use clap::Args;
use serde_json::json;

use super::{NOTHING_WRITTEN, StudyArguments, write};
use crate::{
    cli::{
        Outcome,
        arguments::{OutputArguments, Session},
        forecast::rough_time,
        interrupt::Interrupted,
        output::{OutputFolder, page_results},
        progress, summary,
        timing::Timing,
    },
    report::dissipation::DissipationReport,
    study::{
        Bodies,
        dissipation::{DissipationOutcome, DissipationPlan, NOTHING, Study, WEAK},
        failure::StudyError,
    },
};

/// Arguments of `granchain study dissipation`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// What all studies share.
    #[command(flatten)]
    pub study: StudyArguments,
    /// Perturbed runs at each point of a grid [default: 3]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(3..), help_heading = "Study")]
    pub members: Option<u32>,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
}

/// Run it.
///
/// # Errors
/// Whatever is wrong with the scene; linear dampers that cannot be run; a folder that cannot be written; Ctrl-C.
pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let mut timing = Timing::start();
    let Arguments { study: shared, members, output } = arguments;
    let seed = session.seed();
    let mut plan = if shared.quick { DissipationPlan::quick(seed) } else { DissipationPlan::whole(seed) };
    plan.members = members.map_or(plan.members, |members| members as usize);
    let mut study = Study::new(plan, &shared.overrides(), Bodies::new(session.cache()))?;
    let folder = output
        .out
        .as_deref()
        .map(|out| OutputFolder::stage(out, &page_results("dissipation.json"), output.force))
        .transpose()?;
    timing.stage("read");
    // Bodies are made once and not counted.
    study.bodies().prepared(study.scene()).context("the scene with linear dampers cannot be run")?;
    let started = Instant::now();
    let probed = stopped(study.probe(&progress::Bar(indicatif::ProgressBar::hidden())))?;
    let (time, runs) = (started.elapsed().div_f64(probed as f64), study.runs());
    let model = study.scene().model.kind.name();
    session.note(format_args!("{runs} runs on model `{model}`, about {}", rough_time(time.mul_f64(runs as f64))));
    timing.stage("estimate");

    let bar = progress::Bar(progress::bar(session, runs as u64, "runs"));
    let outcome = study.run(&bar);
    bar.0.finish_and_clear();
    let outcome = stopped(outcome)?;
    timing.stage("run");
    let mut text = format!("model {}\n{}", summary::model(study.scene()), text(&outcome));
    let json = json!({ "model": model, "candidates": outcome.candidates });
    match folder {
        Some(folder) => {
            let command_line = shared.command_line("dissipation", members, session);
            let report = DissipationReport { program: summary::program(), outcome, command_line };
            write(folder, report.files().context("the report cannot be made")?, timing, session)?;
        }
        None => text.push_str(NOTHING_WRITTEN),
    }
    session.result(text, &json)?;
    Ok(Outcome::Done)
}

fn stopped<T>(outcome: Result<T, StudyError>) -> anyhow::Result<T> {
    match outcome {
        Err(StudyError::Stopped) => Err(Interrupted.into()),
        outcome => Ok(outcome?),
    }
}

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
