//! `granchain study water`: the scene before water under every reading of its mount, baffle and dampers.

use std::{fmt::Write as _, time::Instant};

use anyhow::Context;
use clap::Args;
use serde_json::json;

use super::{NOTHING_WRITTEN, StudyArguments, write};
use crate::{
    cli::{
        Outcome,
        arguments::{ModelChoice, OutputArguments, Session, usage},
        forecast::rough_time,
        interrupt::Interrupted,
        output::{OutputFolder, page_results},
        progress, summary,
        timing::Timing,
    },
    report::water::WaterReport,
    scene::ModelKind,
    study::{
        Bodies,
        failure::StudyError,
        water::{Study, WaterOutcome, WaterPlan},
    },
};

/// Arguments of `granchain study water`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// What all studies share.
    #[command(flatten)]
    pub study: StudyArguments,
    /// Runs of each combination at each drive, evenly over ±2 % of it [default: 5, 3 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(3..), help_heading = "Study")]
    pub members: Option<u32>,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
}

/// Run it.
///
/// # Errors
/// Whatever is wrong with the scene; a drawn run that failed; a folder that cannot be written; Ctrl-C.
pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let mut timing = Timing::start();
    let Arguments { study: shared, members, output } = arguments;
    let model = shared.model.unwrap_or(ModelChoice::Chain);
    if model != ModelChoice::Chain {
        return Err(usage(format!(
            "study water runs on the chain, not on model `{}`; leave --model away",
            model.name()
        )));
    }
    let mut plan = if shared.quick { WaterPlan::quick() } else { WaterPlan::whole() };
    plan.members = members.map_or(plan.members, |members| members as usize);
    let overrides: Vec<String> =
        std::iter::once(format!("model.kind={}", model.name())).chain(shared.set.iter().cloned()).collect();
    let study = Study::new(plan, &overrides, Bodies::new(session.cache()))?;
    let folder = output
        .out
        .as_deref()
        .map(|out| OutputFolder::stage(out, &page_results("water.json"), output.force))
        .transpose()?;
    timing.stage("read");
    let runs = study.plan().runs();
    // Bodies are made by the first run and not counted; so are those of the soft baffle, whose elements are stepped once for each mount.
    study.first().context("the scene before water cannot be run")?;
    let started = Instant::now();
    study.first()?;
    let each = u32::try_from(runs.div_ceil(rayon::current_num_threads())).unwrap_or(u32::MAX);
    session.note(format_args!(
        "{runs} runs: about {}, and as long as the soft baffle's elements take",
        rough_time(started.elapsed() * each)
    ));
    timing.stage("estimate");

    let bar = progress::Bar(progress::bar(session, runs as u64, "runs"));
    let outcome = study.run(&bar);
    bar.0.finish_and_clear();
    let outcome = match outcome {
        Err(StudyError::Stopped) => return Err(Interrupted.into()),
        outcome => outcome?,
    };
    timing.stage("run");
    let mut text = text(&outcome);
    let combinations = outcome.combinations.clone();
    match folder {
        Some(folder) => {
            let command_line = shared.command_line("water", members, session);
            let report =
                WaterReport { program: summary::program(), model: ModelKind::Chain.name(), outcome, command_line };
            write(folder, report.files().context("the report cannot be made")?, timing, session)?;
        }
        None => text.push_str(NOTHING_WRITTEN),
    }
    session.result(text, &json!({ "model": ModelKind::Chain.name(), "combinations": combinations }))?;
    Ok(Outcome::Done)
}

/// One line a combination: where it passes the printed pressure, and what the printed drive gives.
fn text(outcome: &WaterOutcome) -> String {
    let mut text = String::from("model chain\nrim        baffle  dampers  14 kPa at  level there  at 3.96 um\n");
    for own in &outcome.combinations {
        let combination = &own.combination;
        // Writing to a string cannot fail.
        let _ = write!(text, "{:<11}{:<8}{:<9}", combination.rim, combination.baffle, combination.placement);
        let _ = match own.crossing {
            Some(crossing) => {
                write!(
                    text,
                    "{:<11}{:<13}",
                    format!("{:.2} um", 1e6 * crossing.drive_m),
                    format!("{:.0} dB", crossing.level_db)
                )
            }
            None => write!(text, "{:<11}{:<13}", if own.begins_above() { "below all" } else { "never" }, "-"),
        };
        let _ = match own.printed().and_then(|cell| cell.pressure_pa) {
            Some(found) => writeln!(text, "{:.0} kPa", 1e-3 * found.median),
            None => writeln!(text, "-"),
        };
    }
    text
}
