//! What the studies of one number along the chain share on the command line.

use anyhow::Context;
use clap::Args;
use serde::Serialize;
use serde_json::{Value, json};

use super::{
    DEFAULT_MODEL, StudyArguments, estimate,
    whole::{Head, Shown, Whole},
};
use crate::{
    cli::{
        arguments::{OutputArguments, Session},
        forecast::rough_time,
        summary,
        timing::Timing,
    },
    report::page::Files,
    scene::Scene,
    study::{
        Bodies, Divided,
        trend::{Study, TrendPlan, Varied},
    },
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

/// A law along one varied quantity, as it is shown.
pub(super) trait Law: Varied + Serialize {
    /// Name of the command.
    const NAME: &str;

    /// The page and its files.
    fn files(head: Head, study: &Study<Self>, laws: Vec<Self>) -> anyhow::Result<Files>;

    /// What the terminal shows.
    fn text(laws: &[Self]) -> String;
}

/// Read the study that flags ask for.
///
/// # Errors
/// Whatever is wrong with the scenes.
pub(super) fn read<L: Law>(arguments: Arguments, session: Session) -> anyhow::Result<Whole<Study<L>>> {
    let timing = Timing::start();
    let Arguments { study: shared, members, output } = arguments;
    let members = members.unwrap_or(if shared.quick { 2 } else { 8 });
    let plan = TrendPlan { members: members as usize, seed: session.seed() };
    let study = Study::new(plan, &shared.overrides(DEFAULT_MODEL), Bodies::new(session.cache()))?;
    let members = Some(members).filter(|_| !shared.quick);
    Ok(Whole { study, shared, members, output, session, timing })
}

impl<L: Law> Shown for Study<L> {
    const NAME: &str = L::NAME;

    fn scene(&self) -> &Scene {
        self.scene()
    }

    fn plan(&self) -> impl Serialize + '_ {
        self.plan()
    }

    fn foretell(&self, session: &Session) -> anyhow::Result<()> {
        let (runs, model) = (self.runs(), self.scene().model.kind.name());
        let time = estimate(self.bodies(), self.scene(), runs);
        let time = time.context("the scene with linear dampers cannot be run")?;
        session.note(format_args!("{runs} runs on model `{model}`, about {}", rough_time(time)));
        Ok(())
    }

    fn text(&self, laws: &Vec<L>) -> String {
        format!("model {}\n{}", summary::model(self.scene()), L::text(laws))
    }

    fn json(&self, laws: &Vec<L>) -> Value {
        json!({ "model": self.scene().model.kind.name(), "laws": laws })
    }

    fn files(&self, laws: Vec<L>, head: Head) -> anyhow::Result<Files> {
        L::files(head, self, laws)
    }
}
