//! `granchain accuracy`: what every setting of a scene's ladder is worth, and what it takes.

use anyhow::Context;
use clap::Args;

use super::{
    Outcome,
    arguments::{OutputArguments, Session},
    interrupt::Interrupted,
    output::{page_results, publish, set_flags},
    progress, summary,
    timing::Timing,
};
use crate::{
    measurement::shell_word,
    validate::{
        accuracy::{AccuracyError, AccuracyPlan, Study},
        page::accuracy::{AccuracyReport, text},
    },
};

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain accuracy --scene annulus --stored")]
pub struct Arguments {
    /// Built-in scene: rigid, annulus or water; with --full any scene file
    #[arg(long, value_name = "NAME|FILE", default_value = "rigid", help_heading = "Scene")]
    pub scene: String,
    /// Override one key of the scene, only with --full: a number without unit is SI; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "full", help_heading = "Scene")]
    pub set: Vec<String>,
    /// Compute the references again and also measure the slowest settings
    #[arg(long, help_heading = "Study")]
    pub full: bool,
    /// Do not run anything; show the stored errors, and the run times of the machine on which they were measured
    #[arg(long, conflicts_with = "full", help_heading = "Study")]
    pub stored: bool,
    #[command(flatten)]
    pub output: OutputArguments,
}

/// Perturbed copies for the chaos floor.
const REPLICATES: usize = 24;

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let Arguments { scene, set, full, stored, output } = arguments;
    let mut timing = Timing::start();
    let mut command_line = format!("granchain accuracy --scene {}{}", shell_word(&scene), set_flags(&set));
    if full {
        command_line.push_str(" --full");
    }
    if stored {
        command_line.push_str(" --stored");
    }
    if let Some(seed) = session.seed {
        command_line.push_str(&format!(" --seed {seed}"));
    }
    let program = summary::program();
    let (seed, limits) = (session.seed(), session.limits());
    let plan = AccuracyPlan { scene, sets: set, full, replicates: REPLICATES, seed, limits, program };
    let ready = Study::new(plan)?;
    let folder = output.stage(&page_results("accuracy.json"))?;
    timing.stage("read");
    let outcome = if stored {
        ready.shipped()
    } else {
        session.note(format_args!(
            "about {:.0} s of processor time, to a factor of two; times are measured on one thread",
            ready.expected_seconds().max(1.0)
        ));
        let bar = progress::Bar(progress::work(session, ready.cost(), "settings"));
        let outcome = ready.measure(&bar);
        bar.0.finish_and_clear();
        outcome
    };
    let accuracy = match outcome {
        Err(AccuracyError::Stopped) => return Err(Interrupted.into()),
        outcome => outcome?,
    };
    timing.stage("measure");
    let report = AccuracyReport { program: summary::program(), command_line, store: full, accuracy };
    if let Some(folder) = folder {
        timing.settings(report.timing());
        publish(folder, report.files().context("the report cannot be made")?, timing, session)?;
        session.result(text(&report.accuracy), &report.json())?;
    } else {
        let note = "Nothing was written; pass --out DIR for the page, the figures and the tables.\n";
        session.result(format!("{}{note}", text(&report.accuracy)), &report.json())?;
    }
    Ok(Outcome::Done)
}
