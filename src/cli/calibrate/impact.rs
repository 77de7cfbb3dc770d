//! The same of records of a force sensor in a column that a striker hits: chosen by the scene's drive.
//!
//! plan and flags → scene and hits → one fit → causes where it does not explain them → report.

use std::{fmt::Write as _, path::Path};

use super::{
    Arguments, COMMAND, InMemory, RESULTS,
    definition::{merge, named, refused},
    free_target,
    manifest::{self, Manifest},
};
use crate::{
    calibration::{
        bench::Bench,
        drive::Input,
        impact::{EVALUATIONS, Experiment, ImpactError, ImpactFit, ImpactOutcome, likelihood::SET_UP, run::Unknown},
        outcome::InputDigest,
        plan::{Plan, ReadRequest},
        problem::DEFAULT_SEED,
        uncertainty::striker,
    },
    cli::{Outcome, arguments::usage, experiment, interrupt, output::OutputFolder, summary, timing::Timing},
    feature::Measurand,
    measurement::{ReadOptions, RecordKind, read_sensor, read_sensor_bytes},
    report::{
        impact::{ImpactReport, shown},
        number::engineering,
        page::Files,
    },
};

/// What impulses are fitted for where nothing is named.
const FITTED: [&str; 2] = ["support_modulus", "support_loss"];

/// Hits, the bench they are held against, and what the command line says besides.
pub struct Job {
    pub experiment: Experiment,
    bench: Bench,
    arguments: Vec<String>,
    pub program: String,
    plan: Option<Input>,
    assumptions: Vec<String>,
}

/// Read and check what the arguments name, if their scene has a striker; else `None`, and nothing but the scene was read.
pub fn prepare(arguments: &Arguments, typed: &[String], in_memory: &InMemory) -> anyhow::Result<Option<Job>> {
    let mut plan = arguments.plan.as_deref().map(Plan::read).transpose()?.unwrap_or_default();
    let of_record = |plan: &Plan| plan.record.first().and_then(|record| record.scene.clone());
    let Some(source) = arguments.scene.scene.clone().or(plan.scene.clone()).or_else(|| of_record(&plan)) else {
        return Ok(None);
    };
    let mut scene = arguments.scene.clone();
    scene.scene = Some(source);
    scene.planned.clone_from(&plan.set);
    scene.drive.clear();
    // An error of a scene names the path that it belongs to.
    let Ok(bench) = experiment::for_fit(&scene, &ReadOptions::default(), true) else { return Ok(None) };
    let Ok(scene) = bench.scene_with(&[]) else { return Ok(None) };
    if scene.drive.kind.striker().is_none() {
        return Ok(None);
    }
    refuse_idle(arguments, &plan)?;
    merge(arguments, &mut plan)?;
    if plan.fit.is_none() {
        plan.fit = Some(FITTED.map(String::from).to_vec());
    }
    let mut assumptions = vec![format!(
        "scene `{}` has a striker: the records are of its force sensor, times an unknown gain",
        bench.source
    )];
    assumptions.extend(bench.assumptions.iter().cloned());
    let mut records = Vec::new();
    for (number, record) in named(arguments, &plan)?.into_iter().enumerate() {
        let request = ReadRequest { measured: arguments.reading.options(None), ..ReadRequest::default() };
        let options = plan.read_as(&record, request)?.measured;
        let read = match in_memory.measured.get(number).and_then(Option::as_deref) {
            Some(bytes) => read_sensor_bytes(&record.measured, bytes, &options)?,
            None => read_sensor(&record.measured, &options)?,
        };
        records.extend(read.into_iter().map(|hit| (hit, record.set_up.clone())));
    }
    for (record, _) in &records {
        for text in &record.assumptions {
            // What holds for all hits is printed once.
            let of_all = records.iter().all(|(hit, _)| hit.assumptions.contains(text));
            let text = if of_all { text.clone() } else { format!("{}: {text}", record.path.display()) };
            if !assumptions.contains(&text) {
                assumptions.push(text);
            }
        }
    }
    let unknown = striker(&plan.uncertainty).map_err(refused)?;
    assumptions.push(in_words(unknown));
    let stated = scene.duration;
    let parameters = crate::calibration::candidate::parameters(&plan, &scene).map_err(refused)?;
    let (evaluations, seed) = (plan.evaluations.unwrap_or(EVALUATIONS), plan.seed.unwrap_or(DEFAULT_SEED));
    let mut experiment = Experiment::of(records, scene, parameters)?;
    (experiment.unknown, experiment.evaluations, experiment.seed) = (unknown, evaluations, seed);
    let lasting = experiment.scene.duration;
    if lasting > stated {
        let [lasting, stated] = [lasting, stated].map(|time| engineering(time, "s", 2));
        assumptions.push(format!("runs last {lasting}, not {stated} (`duration`): the hits return late"));
    }
    let read = arguments.plan.clone().map(|path| Input { path, sha256: plan.sha256.clone() });
    Ok(Some(Job { experiment, bench, arguments: typed.to_vec(), program: summary::program(), plan: read, assumptions }))
}

fn in_words(unknown: Unknown) -> String {
    let [velocity, modulus] = [unknown.velocity, unknown.modulus].map(|deviation| 100.0 * deviation);
    format!(
        "not known, and the same in all hits: the striker's velocity ±{velocity} %, the beads' stiffness over their mass ±{modulus} %, the corner of the \
         sensor's AC coupling (0.25 to 2.5 kHz), where in its bead it reads, how the column stands and what its sensor passes (±{} % of return time, ±{} % of the ratio of peaks, \
         ±{} % of that of widths, ±{} % of the incident width)",
        100.0 * SET_UP[0],
        100.0 * SET_UP[1],
        100.0 * SET_UP[2],
        100.0 * SET_UP[3]
    )
}

/// Refuses what a fit of impulses would pass over.
fn refuse_idle(arguments: &Arguments, plan: &Plan) -> anyhow::Result<()> {
    let drive = !arguments.scene.drive.is_empty() && arguments.scene.drive[0].as_os_str() != "none";
    let pressure = arguments.quantity == Some(Measurand::Pressure);
    let separate = plan.record.iter().any(|record| record.scene.is_some() || !record.set.is_empty());
    let idle = [
        ("--drive", drive || plan.drive.is_some(), "a striker drives the chain"),
        ("--quantity pressure", pressure, "the sensor reads a force"),
        (
            "--damping",
            !arguments.damping.is_empty() || plan.damping.is_some(),
            "set damping.kind in the scene, and fit `damping`",
        ),
        ("mount", plan.mount.is_some(), "there is no disc"),
        ("features", plan.features.is_some(), "impulses have features of their own"),
        ("--widen", plan.widen.is_some(), "its intervals are those that were tested"),
        ("--coverage", arguments.coverage.is_some(), "it counts records of a driven bench"),
        ("likelihood", plan.likelihood.is_some(), "impulses are compared by their features"),
        ("[weights]", !plan.weights.is_empty(), "impulses have features of their own"),
        ("scene or set of a [[record]]", separate, "all hits are of one bench"),
        ("--dry-run", arguments.dry_run, "nothing is read that `inspect` does not show"),
        ("--resume", arguments.resume, "the fit takes seconds"),
    ];
    match idle.into_iter().find(|(_, given, _)| *given) {
        Some((what, _, why)) => Err(usage(format!("{what} would do nothing with a striker: {why}; leave it out"))),
        None => Ok(()),
    }
}

pub fn execute(job: &Job, arguments: &Arguments, mut timing: Timing) -> anyhow::Result<Outcome> {
    let (session, output) = (&arguments.session, &arguments.output);
    session.assumed(&job.assumptions);
    timing.stage("read");
    let read: Vec<(&Path, &str)> =
        job.experiment.files().map(|record| (record.path.as_path(), record.sha256.as_str())).collect();
    let target = output.out.clone().unwrap_or_else(|| free_target(&read));
    let folder = OutputFolder::resumable(&target, &RESULTS, COMMAND, false, output.force)?;
    let (outcome, files) = match made(job, &interrupt::requested, &mut timing) {
        Ok(made) => made,
        Err(error) => {
            folder.discard();
            return Err(error);
        }
    };
    session.warn(&outcome.warnings);
    let place = folder.finish_with(files, timing)?;
    session.result(text(&outcome, &place), &outcome)?;
    Ok(Outcome::of(outcome.verdict, arguments.strict))
}

/// Fit, look for causes, and make every file, until `stop` says so.
pub fn made(
    job: &Job,
    stop: &(dyn Fn() -> bool + Sync),
    timing: &mut Timing,
) -> anyhow::Result<(ImpactOutcome, Files)> {
    let experiment = &job.experiment;
    let fit = experiment.fit(stop).map_err(ended)?;
    timing.stage("fit");
    let explained = fit.p_value >= crate::calibration::agreement::DOUBTFUL;
    let causes = if explained { Vec::new() } else { experiment.causes(&fit, stop).map_err(ended)? };
    timing.stage("causes");
    let mut outcome = ImpactOutcome::of(experiment, &fit, causes);
    outcome.program.clone_from(&job.program);
    (outcome.scene, outcome.overrides) = (job.bench.source.clone(), job.bench.overrides.clone());
    outcome.assumptions.clone_from(&job.assumptions);
    outcome.inputs = inputs(job);
    let report = ImpactReport {
        outcome: &outcome,
        description: summary::in_words(&experiment.scene),
        traces: experiment.hits.iter().map(|hit| shown(&hit.record.series)).collect(),
        simulated: experiment.simulated(&fit).ok().map(|force| shown(&force)),
        command_line: manifest::command_line(&job.arguments),
    };
    let mut files: Files = vec![("calibration.json".into(), summary::json(&outcome)?)];
    files.extend(report.files()?);
    files.push(("runs.csv".into(), runs(&fit)));
    let manifest = Manifest::new(&job.program, &job.arguments, inputs(job), &files);
    files.push((manifest::FILE.into(), summary::json(&manifest)?));
    timing.stage("report");
    Ok((outcome, files))
}

fn ended(error: ImpactError) -> anyhow::Error {
    match error {
        ImpactError::Stopped => interrupt::Interrupted.into(),
        error => error.into(),
    }
}

/// Every file that was read, by role.
fn inputs(job: &Job) -> std::collections::BTreeMap<String, InputDigest> {
    let of = |input: &Input| InputDigest {
        path: input.path.display().to_string(),
        sha256: input.sha256.clone(),
        ..InputDigest::default()
    };
    let plan = job.plan.iter().map(|plan| ("plan".to_owned(), of(plan)));
    let scene = job.bench.scene_file().map(|scene| ("scene".to_owned(), of(&scene)));
    let hits = job.experiment.files().enumerate().map(|(number, record)| {
        let role = if number == 0 { "measured".to_owned() } else { format!("measured-{}", number + 1) };
        (role, InputDigest::read_with(&record.path, &record.sha256, RecordKind::Vibrometer, &record.options))
    });
    plan.chain(scene).chain(hits).collect()
}

/// Every run: where it lies in the bounds, the shared unknowns in standard deviations, the features' logarithms, or why there are none.
fn runs(fit: &ImpactFit) -> Vec<u8> {
    let names = fit.parameters.iter().map(|parameter| format!("u_{}", parameter.name));
    let unknown = ["velocity", "modulus", "corner", "position"].map(|name| format!("n_{name}"));
    let features = crate::calibration::impact::hit::NAMES.map(|name| format!("z_{name}"));
    let empty = features.each_ref().map(|_| String::new());
    let head: Vec<String> = names.chain(unknown).chain(features).chain(["failure".into()]).collect();
    let mut text = head.join(",") + "\n";
    for run in &fit.runs {
        let mut cells: Vec<String> = run.at.iter().chain(run.nuisance.iter()).map(ToString::to_string).collect();
        match &run.features {
            Ok(features) => cells.extend(features.iter().map(ToString::to_string).chain([String::new()])),
            Err(reason) => {
                cells.extend(empty.clone());
                cells.push(format!("\"{}\"", reason.replace('"', "'")));
            }
        }
        let _ = writeln!(text, "{}", cells.join(","));
    }
    text.into_bytes()
}

fn text(outcome: &ImpactOutcome, place: &Path) -> String {
    let hits = outcome.hits.len();
    let s = if hits == 1 { "" } else { "s" };
    let mut text = format!("{}: {}, {hits} hit{s} of a striker\n", outcome.verdict, outcome.scene);
    text += &crate::report::impact::lines(outcome);
    let (runs, failed, page) = (outcome.evaluations, outcome.failed_runs, place.join("report.html"));
    let _ = writeln!(text, "{runs} runs, {failed} not usable. Report: {}", page.display());
    text
}
