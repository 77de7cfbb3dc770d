//! `granchain study precompression`: a static force along the chain.

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
    report::precompression::PrecompressionReport,
    study::{
        Bodies,
        failure::StudyError,
        paper::LAWS,
        portrait::Trait,
        precompression::{Precompressions, run, runs},
        trend::TrendPlan,
    },
};

/// Arguments of `granchain study precompression`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// What all studies share.
    #[command(flatten)]
    pub study: StudyArguments,
    /// Perturbed runs at each force [default: 8, 2 with --quick]
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
    let report = PrecompressionReport {
        program: summary::program(),
        model: scene.model.kind.name(),
        plan,
        laws,
        command_line: study.command_line("precompression", Some(members as u32).filter(|_| !study.quick), session),
    };
    if let Some(folder) = folder {
        write(folder, report.files().context("the report cannot be made")?, timing, session)?;
    }
    session.result(text(&report.laws, output.out.is_none()), &report.laws)?;
    Ok(Outcome::Done)
}

fn text(laws: &[Precompressions], nothing_written: bool) -> String {
    let mut text = String::new();
    for law in laws {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} dampers, alpha {}", law.law.name, law.law.alpha);
        for point in &law.points {
            let mean = |what| point.moments.get(what).map_or(f64::NAN, |moments| moments.mean);
            let _ = writeln!(
                text,
                "  {:>8} N: crest factor {:.2}, peaks {:+.0} and {:+.0} mm/s, bandwidth {:.0} kHz{}",
                point.value,
                mean(Trait::Crest),
                1e3 * mean(Trait::PositivePeak),
                1e3 * mean(Trait::NegativePeak),
                1e-3 * mean(Trait::Bandwidth),
                if point.moments.is_impulsive() { ", impulses" } else { "" }
            );
        }
    }
    if nothing_written {
        text.push_str("Nothing was written; pass --out DIR for the page, the figures and the tables.\n");
    }
    text
}
