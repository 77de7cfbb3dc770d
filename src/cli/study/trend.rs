//! What the studies of one number along the chain share on the command line.

use anyhow::Context;
use clap::Args;
use serde::Serialize;
use serde_json::json;

use super::{NOTHING_WRITTEN, StudyArguments, estimate, write};
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
    report::page::{Files, ReportError},
    scene::Scene,
    study::{Bodies, failure::StudyError, members::Watch, paper::LAWS, trend::TrendPlan},
};

/// Arguments of `granchain study chain-length` and `precompression`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// What all studies share.
    #[command(flatten)]
    pub study: StudyArguments,
    /// Perturbed runs at each value [default: 8, 2 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..), help_heading = "Study")]
    pub members: Option<u32>,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
}

/// What is known of a study before its outcome.
pub(super) struct Head {
    /// Program and version.
    pub program: String,
    /// The first law's scene.
    pub scene: Scene,
    /// What was run.
    pub plan: TrendPlan,
    /// Command line that makes the same page.
    pub command_line: String,
}

/// A study of one number along the chain, both damping laws.
pub(super) trait Study {
    /// Name of the command.
    const NAME: &str;
    /// Outcome of one law.
    type Law: Serialize;

    /// The overrides of every scene, where `given` are those of the command line.
    ///
    /// # Errors
    /// Overrides that make no scene.
    fn overrides(given: Vec<String>) -> Result<Vec<String>, StudyError> {
        Ok(given)
    }

    /// Runs the plan takes.
    fn runs(plan: &TrendPlan) -> usize;

    /// All of them.
    fn run(
        plan: &TrendPlan,
        overrides: &[String],
        bodies: &Bodies,
        watch: &dyn Watch,
    ) -> Result<Vec<Self::Law>, StudyError>;

    /// The page and its files.
    fn files(head: Head, laws: &[Self::Law]) -> Result<Files, ReportError>;

    /// What the terminal shows.
    fn text(laws: &[Self::Law]) -> String;
}

/// Run it.
///
/// # Errors
/// Whatever is wrong with the scenes; too many failed runs; a folder that cannot be written; Ctrl-C.
pub(super) fn execute<S: Study>(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let mut timing = Timing::start();
    let Arguments { study, members, output } = arguments;
    let members = members.map_or(if study.quick { 2 } else { 8 }, |members| members as usize);
    let plan = TrendPlan { members, seed: session.seed() };
    let overrides = S::overrides(study.overrides())?;
    let scene = LAWS[0].scene(&overrides)?;
    let main = format!("{}.json", S::NAME);
    let folder =
        output.out.as_deref().map(|out| OutputFolder::stage(out, &page_results(&main), output.force)).transpose()?;
    timing.stage("read");
    let bodies = Bodies::new(session.cache());
    let total = S::runs(&plan);
    let time = estimate(&bodies, &scene, total).context("the scene with linear dampers cannot be run")?;
    session.note(format_args!("{total} runs on model `{}`, about {}", scene.model.kind.name(), rough_time(time)));
    timing.stage("estimate");

    let bar = progress::Bar(progress::bar(session, total as u64, "runs"));
    let outcome = S::run(&plan, &overrides, &bodies, &bar);
    bar.0.finish_and_clear();
    let laws = match outcome {
        Err(StudyError::Stopped) => return Err(Interrupted.into()),
        outcome => outcome?,
    };
    timing.stage("run");
    let model = scene.model.kind.name();
    let mut text = format!("model {}\n{}", summary::model(&scene), S::text(&laws));
    match folder {
        Some(folder) => {
            let command_line = study.command_line(S::NAME, Some(members as u32).filter(|_| !study.quick), session);
            let head = Head { program: summary::program(), scene, plan, command_line };
            write(folder, S::files(head, &laws).context("the report cannot be made")?, timing, session)?;
        }
        None => text.push_str(NOTHING_WRITTEN),
    }
    session.result(text, &json!({ "model": model, "laws": laws }))?;
    Ok(Outcome::Done)
}
