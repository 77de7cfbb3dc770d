//! What the studies of one number along the chain share on the command line.

use anyhow::Context;
use serde::Serialize;
use serde_json::{Value, json};

use super::{Arguments, DEFAULT_MODEL, Head, Shown, estimate};
use crate::{
    divided::Divided,
    trend::{Study, TrendPlan, Varied},
};
use granchain::cli::{arguments::Session, forecast::rough_time, summary};
use granchain_calibration::predict::Bodies;
use granchain_report::page::Files;

/// A law along one varied quantity, as it is shown.
pub(super) trait Law: Varied + Serialize {
    const NAME: &str;

    /// The page and its files.
    fn files(head: Head, study: &Study<Self>, laws: Vec<Self>) -> anyhow::Result<Files>;

    fn text(laws: &[Self]) -> String;
}

/// Read the study that flags ask for.
///
/// # Errors
/// Whatever is wrong with the scenes.
pub(super) fn read<L: Law>(arguments: &Arguments) -> anyhow::Result<Study<L>> {
    let replicates = arguments.replicates(if arguments.quick { 2 } else { 8 });
    let plan = TrendPlan { replicates, seed: arguments.session.seed() };
    Ok(Study::new(plan, &arguments.overrides(DEFAULT_MODEL), Bodies::new(arguments.session.cache()))?)
}

impl<L: Law> Shown for Study<L> {
    const NAME: &str = L::NAME;

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
