//! `granchain study chain-length`: two to ten beads.

use std::fmt::Write as _;

use anyhow::Context;
use clap::Args;

use super::{Bar, StudyArguments, estimate, said, write};
use crate::{
    cli::{
        Outcome,
        arguments::{OutputArguments, Session},
        interrupt::Interrupted,
        output::OutputFolder,
        progress, summary,
        timing::Timing,
    },
    report::chain_length::ChainLengthReport,
    study::{
        Bodies,
        chain_length::{ChainLengths, SUBHARMONICS, run, runs},
        failure::StudyError,
        paper::LAWS,
        trend::TrendPlan,
    },
};

/// Arguments of `granchain study chain-length`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// What all studies share.
    #[command(flatten)]
    pub study: StudyArguments,
    /// Perturbed runs at each number of beads [default: 8, 2 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..), help_heading = "Study")]
    pub members: Option<u32>,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
}

/// Run it.
///
/// # Errors
/// Whatever is wrong with the scenes; too many failed runs; a folder that cannot be written; Ctrl-C.
pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let mut timing = Timing::start();
    let Arguments { study, members, output } = arguments;
    let members = members.map_or(if study.quick { 2 } else { 8 }, |members| members as usize);
    let plan = TrendPlan { members, seed: session.seed() };
    let overrides = study.overrides();
    let scene = LAWS[0].scene(&overrides)?;
    let folder = output.out.as_deref().map(|out| OutputFolder::stage(out, output.force)).transpose()?;
    timing.stage("read");
    let bodies = Bodies::new(session.cache());
    let total = runs(&plan);
    let time = estimate(&bodies, &scene, total).context("the scene with linear dampers cannot be run")?;
    session.note(format_args!("{total} runs on model `{}`, about {}", scene.model.kind.name(), said(time)));
    timing.stage("estimate");

    let bar = Bar(progress::bar(session, total as u64, "runs"));
    let outcome = run(&plan, &overrides, &bodies, &bar);
    bar.0.finish_and_clear();
    let laws = match outcome {
        Err(StudyError::Stopped) => return Err(Interrupted.into()),
        outcome => outcome?,
    };
    timing.stage("run");
    let report = ChainLengthReport {
        program: summary::program(),
        model: scene.model.kind.name(),
        plan,
        laws,
        drive_frequency: scene.drive.frequency,
        command_line: study.command_line("chain-length", Some(members as u32).filter(|_| !study.quick), session),
    };
    if let Some(folder) = folder {
        write(folder, report.files().context("the report cannot be made")?, timing, session)?;
    }
    session.result(text(&report.laws, output.out.is_none()), &report.laws)?;
    Ok(Outcome::Done)
}

fn text(laws: &[ChainLengths], nothing_written: bool) -> String {
    let mut text = String::new();
    let list = |beads: Vec<usize>| {
        if beads.is_empty() { "none".into() } else { beads.iter().map(usize::to_string).collect::<Vec<_>>().join(", ") }
    };
    for law in laws {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} dampers, alpha {}", law.law.name, law.law.alpha);
        for line in SUBHARMONICS {
            let _ = writeln!(text, "  line at {line}: N = {}", list(law.with_line(line)));
        }
        let _ = writeln!(text, "  train of impulses: N = {}", list(law.impulsive()));
        let _ = writeln!(text, "  bandwidth with N, rank correlation: {:+.2}", law.bandwidth_correlation);
    }
    if nothing_written {
        text.push_str("Nothing was written; pass --out DIR for the page, the figures and the tables.\n");
    }
    text
}
