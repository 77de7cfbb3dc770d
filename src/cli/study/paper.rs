//! `granchain study paper`: the source paper's experiment, whole.

use std::{fmt::Write as _, path::Path};

use anyhow::Context;
use clap::Args;

use super::{NOTHING_WRITTEN, StudyArguments, estimate, write};
use crate::{
    cli::{
        Outcome,
        arguments::{OutputArguments, Session},
        forecast::rough_time,
        interrupt::{self, Interrupted},
        output::{OutputFolder, page_results},
        progress, summary,
        timing::Timing,
    },
    feature::{amplitude_spectrum, line_amplitude},
    measurement::{ReadOptions, RecordKind, read_record_bytes},
    report::paper::{PaperReport, Reconstruction},
    scene::{ModelKind, Scene},
    study::{
        Bodies,
        failure::StudyError,
        observation,
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

/// Run it.
///
/// # Errors
/// Whatever is wrong with the scenes; a run that everything rests on; a folder that cannot be written; Ctrl-C.
pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let mut timing = Timing::start();
    let mut plan =
        if arguments.study.quick { PaperPlan::quick(session.seed()) } else { PaperPlan::whole(session.seed()) };
    plan.members = arguments.members.map_or(plan.members, |members| members as usize);
    let study = Study::new(plan, &arguments.study.overrides(), Bodies::new(session.cache()))?;
    let reconstruction = reconstruction(&study.scenes()[0])?;
    let output = &arguments.output;
    let folder = output
        .out
        .as_deref()
        .map(|out| OutputFolder::stage(out, &page_results("paper.json"), output.force))
        .transpose()?;
    timing.stage("read");
    let (own, on_chain) = study.plan().runs();
    let scene = &study.scenes()[0];
    let mut time = estimate(study.bodies(), scene, own).context("the scene with linear dampers cannot be run")?;
    if on_chain > 0 {
        let mut chain = scene.clone();
        chain.model.kind = ModelKind::Chain;
        time += estimate(study.bodies(), &chain, on_chain)
            .context("the scene with linear dampers cannot be run on the chain")?;
    }
    let runs = own + on_chain;
    session.note(format_args!("{runs} runs, {own} on model `{}`: about {}", study.model().name(), rough_time(time)));
    timing.stage("estimate");

    let bar = progress::Bar(progress::bar(session, runs as u64, "runs"));
    let outcome = run(&study, &bar, &mut timing);
    bar.0.finish_and_clear();
    let outcome = match outcome {
        Err(StudyError::Stopped) => return Err(Interrupted.into()),
        outcome => outcome?,
    };
    let report = PaperReport {
        program: summary::program(),
        judgements: judge(&outcome),
        outcome,
        reconstruction,
        drive_frequency: study.scenes()[0].drive.frequency,
        command_line: arguments.study.command_line("paper", arguments.members, session),
    };
    interrupt::check()?;
    if let Some(folder) = folder {
        let mut files = report.files().context("the report cannot be made")?;
        for (law, scene) in LAWS.iter().zip(study.scenes()) {
            files.push((format!("{}.toml", law.kind).into(), scene.to_toml().into_bytes()));
        }
        write(folder, files, timing, session)?;
    }
    let summary = serde_json::json!({ "model": report.outcome.model, "judgements": report.judgements });
    let models = (report.outcome.model, report.outcome.readings_model);
    session.result(text(&report.judgements, models, output.out.is_none()), &summary)?;
    Ok(Outcome::Done)
}

fn run(study: &Study, bar: &progress::Bar, timing: &mut Timing) -> Result<PaperOutcome, StudyError> {
    let rigid = study.rigid(bar)?;
    timing.stage("rigid");
    let laws = study.ensembles(bar)?;
    timing.stage("ensembles");
    let started = std::time::Instant::now();
    let sweeps = study.sweeps(bar)?;
    let seconds = started.elapsed().as_secs_f64();
    timing.stage("sweep");
    let runs = LAWS.len() * study.plan().alphas.len() * study.plan().sweep_members;
    timing.breakdown("sweep", &[("50 runs", seconds * 50.0 / runs as f64)]);
    let readings = study.readings(bar)?;
    timing.stage("readings");
    let (model, readings_model) = (study.model().name(), study.readings_model().name());
    Ok(PaperOutcome { plan: study.plan().clone(), model, readings_model, rigid, laws, sweeps, readings })
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

fn text(judgements: &[Judgement], (model, of_readings): (&str, &str), nothing_written: bool) -> String {
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
    if nothing_written {
        text.push_str(NOTHING_WRITTEN);
    }
    text
}
