//! `granchain-reproduction water`: the scene before water under every reading of its mount, baffle and dampers.

use std::{fmt::Write as _, time::Instant};

use anyhow::Context;
use serde_json::{Value, json};

use super::{Arguments, Head, Shown};
use crate::{
    divided::Divided,
    page::water::WaterReport,
    water::{Study, WaterOutcome, WaterPlan},
};
use granchain::cli::{arguments::Session, forecast::rough_time};
use granchain_calibration::predict::Bodies;
use granchain_model::scene::ModelKind;
use granchain_report::page::Files;

/// Read the study that flags ask for.
///
/// # Errors
/// Whatever is wrong with the scene.
pub(super) fn read(arguments: &Arguments) -> anyhow::Result<Study> {
    let model = arguments.model.unwrap_or(ModelKind::Chain);
    if model != ModelKind::Chain {
        anyhow::bail!("water runs on the chain, not on model `{}`; leave --model away", model.name());
    }
    let mut plan = if arguments.quick { WaterPlan::quick() } else { WaterPlan::whole() };
    plan.replicates = arguments.replicates(plan.replicates);
    Ok(Study::new(plan, &arguments.overrides(model), Bodies::new(arguments.session.cache()))?)
}

impl Shown for Study {
    const NAME: &str = "water";

    fn foretell(&self, session: &Session) -> anyhow::Result<()> {
        let runs = self.runs();
        // Bodies are made by the first run and not counted; so are those of the soft baffle, whose elements are stepped once for each mount.
        self.first().context("the scene before water cannot be run")?;
        let started = Instant::now();
        self.first()?;
        let each = u32::try_from(runs.div_ceil(rayon::current_num_threads())).unwrap_or(u32::MAX);
        session.note(format_args!(
            "{runs} runs: about {}, and as long as the soft baffle's elements take",
            rough_time(started.elapsed() * each)
        ));
        Ok(())
    }

    fn text(&self, outcome: &WaterOutcome) -> String {
        text(outcome)
    }

    fn json(&self, outcome: &WaterOutcome) -> Value {
        json!({ "model": ModelKind::Chain.name(), "combinations": outcome.combinations })
    }

    fn files(&self, outcome: WaterOutcome, head: Head) -> anyhow::Result<Files> {
        let Head { program, command_line } = head;
        Ok(WaterReport { program, model: ModelKind::Chain.name(), outcome, command_line }.files()?)
    }
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
