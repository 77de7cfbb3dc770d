//! Flags and plan file merged into one plan, its scenes and drives read; flags win.

use std::path::PathBuf;

use super::Arguments;
use crate::{
    calibration::{
        bench::{Bench, BenchError},
        drive::{BESIDE, Input, RecordedDrive},
        plan::{Bounds, NamedBy, Number, Plan, ReadAs, ReadRequest, RecordPlan},
        problem::Problem,
        recorded_run::{RecordedRunPlan, Source},
        refusal::{Contradiction, Refusal},
    },
    cli::{
        arguments::{SceneArguments, usage},
        experiment,
        reading::DriveUnread,
    },
    feature::Measurand,
    measurement::{BenchReadings, ReadOptions, RecordKind, read_record_bytes},
    scene::SceneError,
};

/// The bytes of records that are in memory, record by record, in place of the files that stand in their place in the arguments.
#[derive(Debug, Clone, Default)]
pub struct InMemory {
    pub measured: Vec<Option<Vec<u8>>>,
    pub drives: Vec<Option<Vec<u8>>>,
}

/// A problem, the plan that flags and file make, and the files of the plan by role.
pub type Defined = (Problem, Plan, Vec<(&'static str, Input)>);

/// Read and check everything that the arguments name; the plan file too, where there is one.
pub fn problem(arguments: &Arguments, in_memory: &InMemory) -> anyhow::Result<Defined> {
    let mut plan = arguments.plan.as_deref().map(Plan::read).transpose()?.unwrap_or_default();
    let read = arguments.plan.clone().map(|path| Input { path, sha256: plan.sha256.clone() });
    if let Some(bench) = &arguments.reading.bench {
        plan.readings = Some(BenchReadings::read(bench)?);
    }
    let bench = plan.readings.as_ref().map(|bench| Input { path: bench.path.clone(), sha256: bench.sha256.clone() });
    merge(arguments, &mut plan)?;
    let mut assumptions = Vec::new();
    let recorded_runs = records(arguments, &plan, in_memory, &mut assumptions)?;
    let mut fitted = plan.fitted();
    if let Some(alpha) = arguments.scene.alpha
        && fitted.iter().any(|name| name == "alpha")
    {
        fitted.retain(|name| name != "alpha");
        assumptions.push(format!("alpha fixed at {alpha} by --alpha; fitted: {}", fitted.join(", ")));
        plan.fit = Some(fitted);
    }
    let mut problem =
        Problem::of(&plan, recorded_runs).map_err(|error| in_plan(placed(error, arguments), arguments, &plan))?;
    assumptions.append(&mut problem.assumptions);
    Ok((
        Problem { assumptions, ..problem },
        plan,
        read.into_iter().map(|plan| ("plan", plan)).chain(bench.map(|it| ("bench", it))).collect(),
    ))
}

/// A refusal with the flag or the line of the plan that states what is refused.
fn placed(error: Refusal, arguments: &Arguments) -> anyhow::Error {
    let Some((table, name)) = error.stated() else { return refused(error) };
    let (flag, given) = match table {
        "parameters" => ("--bounds", &arguments.bounds),
        _ => ("--uncertainty", &arguments.uncertainty),
    };
    let message = error.to_string();
    if let Some(typed) = given.iter().rev().find(|typed| typed.split('=').next().map(str::trim) == Some(name)) {
        // The table is none of what was typed.
        let message = message.split_once(": ").map_or(message.as_str(), |(_, message)| message);
        return usage(format!("{flag} {typed}: {message}"));
    }
    let Some(path) = &arguments.plan else { return refused(error) };
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let (own, whole, dotted) = (format!("[{table}.{name}]"), format!("[{table}]"), format!("{table}.{name}"));
    let mut inside = false;
    let line = text.lines().map(str::trim).position(|line| {
        inside = if line.starts_with('[') { line == whole } else { inside };
        line == own || line.starts_with(&dotted) || inside && line.starts_with(name)
    });
    anyhow::anyhow!("{}:{}: {message}", path.display(), line.map_or(1, |line| line + 1))
}

/// What a plan states of its scene is wrong: the line of the plan, and why.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct SceneOfPlan(String);

/// An error in what a plan states of its scene, with the line of the plan.
fn in_plan(error: anyhow::Error, arguments: &Arguments, plan: &Plan) -> anyhow::Error {
    let Some(path) = &arguments.plan else { return error };
    let message = error.to_string();
    let sets = plan.set.iter().chain(plan.record.iter().flat_map(|record| &record.set));
    let set =
        sets.filter(|set| !arguments.scene.set.contains(set)).find(|set| message.starts_with(&format!("--set {set}")));
    let is_scene = || {
        arguments.scene.scene.is_none()
            && matches!(
                error.downcast_ref(),
                Some(BenchError::Scene(SceneError::UnknownScene { place: None, .. } | SceneError::NotThere { .. }))
            )
    };
    let (stated, message) = match set {
        Some(set) => (set.as_str(), message.replacen("--set ", "`set`, ", 1)),
        None if is_scene() => ("scene", message),
        None => return error,
    };
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let line = text.lines().position(|line| line.contains(stated) && !line.trim_start().starts_with('#'));
    SceneOfPlan(format!("{}:{}: {message}", path.display(), line.map_or(1, |line| line + 1))).into()
}

/// What contradicts itself is the command line's fault.
pub fn refused(error: Refusal) -> anyhow::Error {
    match error {
        Refusal::Contradiction(contradiction) => usage(contradiction.to_string()),
        Refusal::Measurement(error) => error.into(),
        error => error.into(),
    }
}

/// Flags in place of what the plan says.
pub(super) fn merge(arguments: &Arguments, plan: &mut Plan) -> anyhow::Result<()> {
    let named = |names: &[String]| (!names.is_empty()).then(|| names.to_vec());
    plan.quantity = arguments.quantity.or(plan.quantity);
    plan.fit = named(&arguments.fit).or(plan.fit.take());
    plan.damping = named(&arguments.damping).or(plan.damping.take());
    plan.evaluations = arguments.evaluations.map(|runs| runs as usize).or(plan.evaluations);
    plan.seed = arguments.session.seed.or(plan.seed);
    plan.widen = arguments.widen.or(plan.widen);
    for text in &arguments.bounds {
        let parts = text.split_once('=').and_then(|(name, range)| Some((name, range.split_once(':')?)));
        let Some((name, (low, high))) = parts else {
            return Err(usage(format!("--bounds {text}: expected NAME=LOW:HIGH such as alpha=0.3:1.5")));
        };
        let [low, high] = [low, high].map(|text| Number::Text(text.trim().into()));
        plan.parameters.insert(name.trim().into(), Bounds { low, high });
    }
    for (name, number) in uncertainties(&arguments.uncertainty)? {
        plan.uncertainty.insert(name, number);
    }
    Ok(())
}

pub fn uncertainties(flags: &[String]) -> anyhow::Result<Vec<(String, Number)>> {
    let parsed = flags.iter().map(|text| match text.split_once('=') {
        Some((name, value)) => Ok((name.trim().into(), Number::Text(value.trim().into()))),
        None => Err(usage(format!("--uncertainty {text}: expected NAME=VALUE such as \"gap=0.5 nm\""))),
    });
    parsed.collect()
}

/// The records that flags and plan name, with the drive of each; flags win.
fn records(
    arguments: &Arguments,
    plan: &Plan,
    in_memory: &InMemory,
    assumptions: &mut Vec<String>,
) -> anyhow::Result<Vec<RecordedRunPlan>> {
    let (named, usual) = (named(arguments, plan)?, plan.usual_scene());
    let drives = &arguments.scene.drive;
    if drives.len() > 1 && drives.len() != named.len() {
        return Err(usage(format!(
            "--drive: expected one horn-tip record for all, or one for each of the {} records in their order, found {}",
            named.len(),
            drives.len()
        )));
    }
    // `--drive none`: the scene's own drive, whatever lies beside the record.
    let own_drive = drives.first().is_some_and(|drive| drive.as_os_str() == "none");
    if arguments.scene.scene.is_none() && plan.scene.is_none() && named.iter().any(|record| record.scene.is_none()) {
        assumptions.push(format!("scene `{usual}`; name another with --scene"));
    }
    if named.iter().any(|record| record.set_up.is_some()) {
        return Err(usage("set_up of a [[record]] is of hits of a striker; leave it out"));
    }
    let several = named.len() > 1;
    let mut records = Vec::new();
    for (number, record) in named.into_iter().enumerate() {
        let mut scene = SceneArguments { session: arguments.session.clone(), ..arguments.scene.clone() };
        let named_scene = record.scene.clone().or_else(|| plan.scene.clone());
        scene.scene = scene.scene.or_else(|| Some(named_scene.unwrap_or_else(|| usual.into())));
        scene.planned = plan.set.iter().chain(&record.set).cloned().collect();
        let request = ReadRequest {
            measured: arguments.reading.options(None),
            drive: ReadOptions {
                force_frequency: arguments.forces_frequency(),
                ..arguments.drive_reading.options(arguments.scene.drive_frequency)
            },
            drive_file: drives.get(number).or(drives.first()).filter(|_| !own_drive).cloned(),
        };
        let ReadAs { measured, drive } = plan.read_as(&record, request)?;
        let drive = drive.filter(|_| !own_drive);
        let beside = if several { format!("beside {}", record.measured.display()) } else { "beside the record".into() };
        match &drive {
            _ if own_drive => {}
            Some((.., NamedBy::Flag)) => {}
            Some((drive, _, NamedBy::Plan)) => {
                assumptions.push(format!("drive {}, named in the plan", drive.display()));
            }
            Some((drive, _, NamedBy::Folder)) => assumptions.push(format!("drive {}, {beside}", drive.display())),
            Some((drive, how, NamedBy::Channel)) => assumptions.push(format!(
                "drive: channel `{}` of {}",
                how.column.as_deref().unwrap_or_default(),
                drive.display()
            )),
            None => assumptions.push(format!("the scene's own drive: no {BESIDE} lies {beside}")),
        }
        let (drive, drive_options) = drive.map_or_else(Default::default, |(file, how, _)| (Some(file), how));
        scene.drive = drive.into_iter().collect();
        let origin = arguments.plan.clone().filter(|_| record.line > 0).map(|plan| (plan, record.line));
        let source = Source::File(record.measured, Box::new(measured));
        records.push((source, scene, drive_options, origin));
    }
    let kind = if plan.quantity == Some(Measurand::Pressure) { RecordKind::Hydrophone } else { RecordKind::Vibrometer };
    let of = |(number, (source, scene, drive_options, origin))| {
        let bench = in_memory.bench(number, scene, &drive_options, several);
        let mut bench = bench.map_err(|error| in_plan(error, arguments, plan))?;
        bench.limits = arguments.session.limits();
        let source = in_memory.source(number, source, kind, &bench)?;
        Ok(RecordedRunPlan { source, bench, origin })
    };
    records.into_iter().enumerate().map(of).collect()
}

impl InMemory {
    /// The bench of a record, whose drive may be in memory.
    fn bench(
        &self,
        number: usize,
        mut scene: SceneArguments,
        options: &ReadOptions,
        several: bool,
    ) -> anyhow::Result<Bench> {
        let Some((path, bytes)) = scene.drive.first().cloned().zip(self.drives.get(number).and_then(Option::as_deref))
        else {
            return experiment::for_fit(&scene, options, several);
        };
        scene.drive.clear();
        let mut bench = experiment::for_fit(&scene, options, several)?;
        let drive = RecordedDrive::of_bytes_at_plateau(&path, bytes, options).map_err(DriveUnread)?;
        bench.assumptions.extend(drive.assumptions.iter().cloned());
        bench.drive = Some(drive);
        experiment::refuse_drive_keys(&bench, scene.overridden())?;
        Ok(bench)
    }

    /// What is fitted to, read now where it is in memory.
    fn source(&self, number: usize, source: Source, kind: RecordKind, bench: &Bench) -> anyhow::Result<Source> {
        match (source, self.measured.get(number).and_then(Option::as_deref)) {
            (Source::File(path, options), Some(bytes)) => {
                let drive_frequency = Some(bench.scene_with(&[])?.drive.frequency);
                let read_with = ReadOptions { drive_frequency, ..(*options).clone() };
                Ok(Source::Record(Box::new(read_record_bytes(&path, bytes, Some(kind), &read_with)?), options))
            }
            (source, _) => Ok(source),
        }
    }
}

/// The records as named, none of them checked.
pub(super) fn named(arguments: &Arguments, plan: &Plan) -> anyhow::Result<Vec<RecordPlan>> {
    let of = |measured: &PathBuf| RecordPlan {
        measured: measured.clone(),
        drive: plan.drive.clone(),
        ..RecordPlan::default()
    };
    if arguments.measured.is_empty() {
        return plan.records().map_err(|error| match (&arguments.plan, error) {
            (Some(plan), Contradiction::NoRecord) => anyhow::anyhow!(
                "{}: key `measured` is missing: the record to be fitted, such as measured = \"vib.csv\" (or pass --measured)",
                plan.display()
            ),
            (_, error) => usage(error.to_string()),
        });
    }
    Ok(arguments.measured.iter().map(of).collect())
}
