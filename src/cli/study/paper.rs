//! `granchain study paper`: the source paper's experiment, whole.

use std::{fmt::Write as _, path::Path};

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
        timing::Timing,
    },
    feature::{amplitude_spectrum, line_amplitude},
    measurement::{ReadOptions, RecordKind, read_record_bytes},
    report::{
        page::Files,
        paper::{PaperReport, Reconstruction},
    },
    scene::{ModelKind, Scene},
    study::{
        Bodies, observation,
        paper::{Judgement, LAWS, PaperOutcome, PaperPlan, Study, Verdict, judge},
    },
};

/// The reconstruction that comes with the program.
const RECONSTRUCTION: &[u8] = include_bytes!("../../../measurements/annulus-73khz/vib.csv");

/// Arguments of `granchain study paper`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// What all studies share.
    #[command(flatten)]
    pub study: StudyArguments,
    /// Perturbed runs of each law at each of its three drive levels [default: 16, 4 with --quick]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..), help_heading = "Study")]
    pub members: Option<u32>,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
}

/// Read the study that flags ask for.
///
/// # Errors
/// Whatever is wrong with the scenes.
pub(super) fn read(arguments: Arguments, session: Session) -> anyhow::Result<Whole<Study>> {
    let timing = Timing::start();
    let Arguments { study: shared, members, output } = arguments;
    let seed = session.seed();
    let mut plan = if shared.quick { PaperPlan::quick(seed) } else { PaperPlan::whole(seed) };
    plan.members = members.map_or(plan.members, |members| members as usize);
    let study = Study::new(plan, &shared.overrides(DEFAULT_MODEL), Bodies::new(session.cache()))?;
    Ok(Whole { study, shared, members, output, session, timing })
}

impl Shown for Study {
    const NAME: &str = "paper";

    fn scene(&self) -> &Scene {
        &self.scenes()[0]
    }

    fn plan(&self) -> impl Serialize + '_ {
        self.plan()
    }

    fn foretell(&self, session: &Session) -> anyhow::Result<()> {
        let (own, on_chain) = self.plan().runs();
        let scene = Shown::scene(self);
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

    fn breakdown(&self, stage: &str, seconds: f64) -> Option<(&'static str, f64)> {
        let runs = LAWS.len() * self.plan().alphas.len() * self.plan().sweep_members;
        (stage == "sweep").then_some(("50 runs", seconds * 50.0 / runs as f64))
    }

    fn text(&self, outcome: &PaperOutcome) -> String {
        text(&judge(outcome), (outcome.model, outcome.readings_model))
    }

    fn json(&self, outcome: &PaperOutcome) -> Value {
        json!({ "model": outcome.model, "judgements": judge(outcome) })
    }

    fn files(&self, outcome: PaperOutcome, head: Head) -> anyhow::Result<Files> {
        let Head { program, command_line } = head;
        let scene = Shown::scene(self);
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
