//! `granchain stress`: hard cases, and whether they hold.

use std::fmt::Write as _;

use anyhow::Context;
use clap::Args;

use super::{
    Outcome,
    arguments::{OutputArguments, Session, usage},
    interrupt::{self, Interrupted},
    output::{OutputFolder, page_results},
    progress, study, summary,
    timing::Timing,
};
use crate::{
    report::stress::{StressReport, limit, measured},
    study::{
        Bodies,
        stress::{CASES, StressOutcome, StressPlan, count, run},
    },
};

/// Arguments of `granchain stress`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain stress --quick --out stress")]
pub struct Arguments {
    /// Numbers of the cases to run [default: all]
    #[arg(long, value_name = "N,…", value_delimiter = ',', help_heading = "Cases")]
    pub cases: Vec<u32>,
    /// Shorter runs and coarser meshes: at most two minutes
    #[arg(long, help_heading = "Cases")]
    pub quick: bool,
    /// Override one key of every scene, to see what breaks: a plain number is SI, else with its unit; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = "Cases")]
    pub set: Vec<String>,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

/// Run it.
///
/// # Errors
/// A case that does not exist; a folder that cannot be written; Ctrl-C. Checks that do not hold are an outcome.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let Arguments { cases, quick, set, output, session } = arguments;
    let mut timing = Timing::start();
    if let Some(unknown) = cases.iter().find(|number| CASES.iter().all(|case| case.number != **number)) {
        let known: Vec<String> = CASES.iter().map(|case| case.number.to_string()).collect();
        return Err(usage(format!("--cases {unknown}: there is no such case; cases are {}", known.join(", "))));
    }
    let plan = StressPlan { quick, cases, overrides: set, seed: session.seed() };
    let folder = output
        .out
        .as_deref()
        .map(|out| OutputFolder::stage(out, &page_results("stress.json"), output.force))
        .transpose()?;
    timing.stage("read");
    let bodies = Bodies::new(session.cache());
    let bar = progress::Bar(progress::bar(&session, count(&plan), "cases"));
    let outcome = run(&plan, &bodies, &bar);
    bar.0.finish_and_clear();
    if interrupt::requested() {
        return Err(Interrupted.into());
    }
    timing.stage("run");
    let report =
        StressReport { program: summary::program(), command_line: command_line(&plan, &session), plan, outcome };
    if let Some(folder) = folder {
        study::write(folder, report.files().context("the report cannot be made")?, timing, &session)?;
    }
    session.result(text(&report.outcome), &report.outcome)?;
    Ok(if report.outcome.broken().next().is_none() { Outcome::Done } else { Outcome::Broken })
}

fn command_line(plan: &StressPlan, session: &Session) -> String {
    let mut text = "granchain stress".to_owned();
    if plan.quick {
        text.push_str(" --quick");
    }
    if !plan.cases.is_empty() {
        let numbers: Vec<String> = plan.cases.iter().map(u32::to_string).collect();
        // Writing to a string cannot fail.
        let _ = write!(text, " --cases {}", numbers.join(","));
    }
    text.push_str(&study::set_flags(&plan.overrides));
    if let Some(seed) = session.seed {
        let _ = write!(text, " --seed {seed}");
    }
    text
}

fn text(outcome: &StressOutcome) -> String {
    let mut text = String::new();
    let mut case = 0;
    for check in &outcome.checks {
        if check.case != case {
            case = check.case;
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{case} {}", check.name);
        }
        let verdict = if check.holds { "pass" } else { "FAIL" };
        let (found, asked) = (measured(check), limit(check));
        let _ = writeln!(text, "  {verdict}  {:<19} {}: {found} ({asked})", check.rung.name(), check.criterion);
        if let Some(note) = &check.note {
            let _ = writeln!(text, "        {note}");
        }
    }
    let (broken, all) = (outcome.broken().count(), outcome.checks.len());
    let _ = writeln!(text, "{} of {all} checks hold", all - broken);
    text
}
