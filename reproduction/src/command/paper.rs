//! `granchain-reproduction paper`: the source paper's experiment, whole.

use std::{fmt::Write as _, path::Path};

use anyhow::Context;
use serde_json::{Value, json};

use super::{Arguments, DEFAULT_MODEL, Head, Shown, estimate};
use crate::{
    page::paper::{PaperReport, Reconstruction},
    paper::{Judgement, LAWS, PaperOutcome, PaperPlan, Study, Verdict, judge},
};
use granchain::cli::{arguments::Session, forecast::rough_time};
use granchain_calibration::predict::{Bodies, observation};
use granchain_model::scene::{ModelKind, Scene};
use granchain_record::{ReadOptions, RecordKind, read_record_bytes};
use granchain_report::page::Files;
use granchain_signal::feature::{amplitude_spectrum, line_amplitude};

/// The reconstruction that comes with the program.
const RECONSTRUCTION: &[u8] = include_bytes!("../../../measurements/annulus-73khz/vib.csv");

/// Read the study that flags ask for.
///
/// # Errors
/// Whatever is wrong with the scenes.
pub(super) fn read(arguments: &Arguments) -> anyhow::Result<Study> {
    let seed = arguments.session.seed();
    let mut plan = if arguments.quick { PaperPlan::quick(seed) } else { PaperPlan::whole(seed) };
    plan.replicates = arguments.replicates(plan.replicates);
    Ok(Study::new(plan, &arguments.overrides(DEFAULT_MODEL), Bodies::new(arguments.session.cache()))?)
}

impl Shown for Study {
    const NAME: &str = "paper";

    fn foretell(&self, session: &Session) -> anyhow::Result<()> {
        let (own, on_chain) = self.plan().runs();
        let scene = &self.scenes()[0];
        let mut time = estimate(self.bodies(), scene, own).context("the scene with linear dampers cannot be run")?;
        if on_chain > 0 {
            let mut chain = scene.clone();
            chain.model.kind = ModelKind::Chain;
            time += estimate(self.bodies(), &chain, on_chain)
                .context("the scene with linear dampers cannot be run on the chain")?;
        }
        let runs = own + on_chain;
        session.note(format_args!("{runs} runs, {own} on model `{}`: about {}", self.model().name(), rough_time(time)));
        Ok(())
    }

    fn text(&self, outcome: &PaperOutcome) -> String {
        text(&judge(outcome), (outcome.model, outcome.readings_model))
    }

    fn json(&self, outcome: &PaperOutcome) -> Value {
        json!({ "model": outcome.model, "judgements": judge(outcome) })
    }

    fn files(&self, outcome: PaperOutcome, head: Head) -> anyhow::Result<Files> {
        let Head { program, command_line } = head;
        let scene = &self.scenes()[0];
        let report = PaperReport {
            program,
            judgements: judge(&outcome),
            outcome,
            reconstruction: reconstruction(scene)?,
            drive_frequency: scene.drive.frequency,
            command_line,
        };
        let mut files = report.files()?;
        for (law, scene) in LAWS.iter().zip(self.scenes()) {
            files.push((format!("{}.toml", law.kind).into(), scene.to_toml().into_bytes()));
        }
        Ok(files)
    }
}

/// The shipped reconstruction with its spectrum in the window where the scene's drive is on: both count from the start of the burst.
fn reconstruction(scene: &Scene) -> anyhow::Result<Reconstruction> {
    let name = Path::new("measurements/annulus-73khz/vib.csv");
    let record = read_record_bytes(name, RECONSTRUCTION, Some(RecordKind::Vibrometer), &ReadOptions::default())?;
    let velocity = record.series;
    let settings = observation::settings(scene)?;
    let window = settings.window.context("the drive has no window")?;
    Ok(Reconstruction {
        spectrum: amplitude_spectrum(&velocity, window)?,
        drive_line: line_amplitude(&velocity, window.on(&velocity)?, scene.drive.frequency),
        velocity,
    })
}

fn text(judgements: &[Judgement], (model, of_readings): (&str, &str)) -> String {
    let mut text = format!("model {model}; the readings of what the paper leaves open: {of_readings}\n");
    for judgement in judgements {
        let verdict = match judgement.verdict {
            Verdict::Agrees => "agrees",
            Verdict::Differs => "differs",
            Verdict::NotTested => "not tested",
        };
        // Writing to a string cannot fail.
        let _ = write!(text, "{verdict:<11}{:<30}{}", judgement.statement.key, judgement.statement.said);
        let _ = match &judgement.ours {
            Some(ours) => writeln!(
                text,
                "; ours {:+.0} mm/s, scatter {:.1}, {:+.1} per +1 % drive: {}",
                1e3 * ours.mean,
                1e3 * ours.scatter,
                1e3 * ours.sensitivity,
                judgement.found
            ),
            None => writeln!(text, ": {}", judgement.found),
        };
    }
    text
}
