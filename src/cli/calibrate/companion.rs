//! Several records with one set of parameters: which they are, how each is driven, and the same checks for all.
//!
//! The first record leads: model, candidates and the report are its own. Every further one is a companion with its own drive, its own
//! overrides of the scene and its own reading.

use std::path::{Path, PathBuf};

use anyhow::bail;

use super::{
    Arguments,
    definition::Definition,
    measured::{Measured, is_published},
};
use crate::{
    calibration::{
        comparison::Comparison,
        forward::Uncertainty,
        joint::{StatedFrequency, at_one_frequency},
        plan::{Plan, RecordPlan},
    },
    cli::{
        arguments::{SceneArguments, usage},
        experiment::Experiment,
    },
    measurement::drive_frequency_line,
    scene::{ModelKind, Scene},
};

/// The file name that a drive record beside a record is looked for under.
const DRIVE_BESIDE: &str = "horn_tip.csv";

/// Stems of records that are told apart by their folder.
const STEMS: [&str; 2] = ["vib", "hydrophone"];

/// One record of a fit and how it is simulated.
pub struct RecordDefinition {
    /// The record, or the published features.
    pub measured: PathBuf,
    /// Scene flags with the plan's merged in.
    pub scene: SceneArguments,
    /// Plan and line that name it, where a plan does.
    pub origin: Option<(PathBuf, usize)>,
}

/// A further record, read and checked.
pub struct Companion {
    /// How it is simulated.
    pub experiment: Experiment,
    /// As read.
    pub measured: Measured,
    /// What its runs are compared with.
    pub comparison: Comparison,
    /// What is drawn into its runs.
    pub uncertainty: Uncertainty,
}

/// The records that flags and plan name, with the drive of each; flags win. `usual` is the scene where none is named.
///
/// # Errors
/// A usage error without a record, or with flags that do not fit the number of records.
pub fn records(
    arguments: &Arguments,
    plan: &Plan,
    usual: &str,
    assumptions: &mut Vec<String>,
) -> anyhow::Result<Vec<RecordDefinition>> {
    let named = named(arguments, plan)?;
    if !arguments.input.is_empty() && arguments.input.len() != named.len() {
        return Err(usage(format!(
            "--input: expected a horn-tip record for each of the records, found {} for {}; name them in the order of --measured, or one for all \
             with --drive",
            arguments.input.len(),
            named.len()
        )));
    }
    let own_sets = own_sets(&arguments.record_set, named.len())?;
    if arguments.scene.scene.is_none() && plan.scene.is_none() && named.iter().any(|record| record.scene.is_none()) {
        assumptions.push(format!("scene `{usual}`; name another with --scene"));
    }
    let several = named.len() > 1;
    let mut records = Vec::new();
    for (number, record) in named.into_iter().enumerate() {
        let mut scene = arguments.scene.clone();
        let named_scene = record.scene.or_else(|| plan.scene.clone());
        scene.scene = scene.scene.or_else(|| Some(named_scene.unwrap_or_else(|| usual.into())));
        let of_record = own_sets.iter().filter(|(of, _)| *of == number).map(|(_, set)| set.clone());
        scene.set = plan.set.iter().cloned().chain(record.set).chain(scene.set).chain(of_record).collect();
        if let Some(input) = arguments.input.get(number) {
            scene.drive = Some(input.clone());
        } else if scene.drive.is_none() && !arguments.scene_drive {
            let planned = record.drive.is_some();
            let beside =
                if several { format!("beside {}", record.measured.display()) } else { "beside the record".into() };
            scene.drive = record.drive.or_else(|| drive_beside(&record.measured));
            match &scene.drive {
                Some(drive) if planned => assumptions.push(format!("drive {}, named in the plan", drive.display())),
                Some(drive) => assumptions.push(format!("drive {}, {beside}", drive.display())),
                None => assumptions.push(format!("the scene's own drive: no {DRIVE_BESIDE} lies {beside}")),
            }
        }
        let origin = arguments.plan.clone().filter(|_| record.line > 0).map(|plan| (plan, record.line));
        records.push(RecordDefinition { measured: record.measured, scene, origin });
    }
    Ok(records)
}

/// The records as named, none of them checked.
fn named(arguments: &Arguments, plan: &Plan) -> anyhow::Result<Vec<RecordPlan>> {
    let of = |measured: &PathBuf| RecordPlan {
        measured: measured.clone(),
        drive: plan.drive.clone(),
        ..RecordPlan::default()
    };
    if !arguments.measured.is_empty() {
        return Ok(arguments.measured.iter().map(of).collect());
    }
    match (&plan.measured, plan.record.as_slice()) {
        (Some(measured), []) => Ok(vec![of(measured)]),
        (None, []) => Err(usage(
            "--measured FILE is needed: a vibrometer record, such as measurements/annulus-73khz/vib.csv, or with --quantity pressure a \
             hydrophone's",
        )),
        (None, records) if plan.drive.is_none() => Ok(records.to_vec()),
        (_, records) => Err(usage(format!(
            "the plan names `measured` or `drive` and {} of [[record]]; write `measured` and `drive` into each [[record]]",
            records.len()
        ))),
    }
}

/// `N:KEY=VALUE`: number from 0 and override.
fn own_sets(told: &[String], count: usize) -> anyhow::Result<Vec<(usize, String)>> {
    let parsed = told.iter().map(|text| {
        let (number, set) = text.split_once(':')?;
        let number: usize = number.trim().parse().ok()?;
        ((1..=count).contains(&number) && set.contains('=')).then(|| (number - 1, set.trim().to_owned()))
    });
    match parsed.clone().position(|parsed| parsed.is_none()) {
        None => Ok(parsed.flatten().collect()),
        Some(index) => Err(usage(format!(
            "--record-set {}: expected N:KEY=VALUE with N from 1 to {count}, such as 2:chain.beads=7",
            told[index]
        ))),
    }
}

/// The horn-tip record in the folder of a record.
fn drive_beside(measured: &Path) -> Option<PathBuf> {
    let beside = measured.with_file_name(DRIVE_BESIDE);
    (beside.is_file() && beside != measured).then_some(beside)
}

/// What records are called side by side: the folder of a `vib.csv`, else the file's own name; numbered where that is not enough.
pub fn labels(paths: &[&Path]) -> Vec<String> {
    let name = |path: &&Path| {
        let text = |part: Option<&std::ffi::OsStr>| part.map(|part| part.to_string_lossy().into_owned());
        let stem = text(path.file_stem()).unwrap_or_else(|| "record".into());
        let folder = text(path.parent().and_then(Path::file_name));
        folder.filter(|_| STEMS.contains(&stem.as_str())).unwrap_or(stem)
    };
    let names: Vec<String> = paths.iter().map(name).collect();
    let unique = |name: &String| names.iter().filter(|other| *other == name).count() == 1;
    let numbered = |(index, name): (usize, &String)| {
        if unique(name) { name.clone() } else { format!("{name} {}", index + 1) }
    };
    names.iter().enumerate().map(numbered).collect()
}

/// Read the further records of a definition, whose first is simulated by `lead`; what was assumed goes to `assumptions`.
///
/// # Errors
/// Whatever is wrong with a scene or a record, another drive frequency, or a model that corrects one record at a time.
pub fn companions(
    definition: &Definition,
    lead: (&Experiment, &Scene),
    assumptions: &mut Vec<String>,
) -> anyhow::Result<Vec<Companion>> {
    let mut stated = vec![drive_stated(lead.0, definition.origin.as_ref(), &definition.measured, lead.1)];
    let told_apart = definition.scene.drive_frequency.is_none();
    stated.extend(record_stated(&definition.measured).filter(|_| told_apart));
    let mut experiments = Vec::new();
    for record in &definition.companions {
        let experiment = Experiment::for_joint_fit(&record.scene)?;
        let scene = experiment.scene_with(&[])?;
        refuse_upper(&scene)?;
        stated.extend(record_stated(&record.measured).filter(|_| told_apart));
        stated.push(drive_stated(&experiment, record.origin.as_ref(), &record.measured, &scene));
        for said in &experiment.assumptions {
            if !assumptions.contains(said) {
                assumptions.push(said.clone());
            }
        }
        experiments.push((experiment, scene));
    }
    at_one_frequency(&stated)?;
    let read = definition.companions.iter().zip(experiments).map(|(record, (experiment, scene))| {
        let measured = Measured::read(&record.measured, definition, &scene, assumptions)?;
        let comparison = measured.comparison().weighted(&definition.weights)?;
        let uncertainty = definition.uncertainty.of(&scene, experiment.baseline_error())?;
        Ok(Companion { experiment, measured, comparison, uncertainty })
    });
    read.collect()
}

/// Refuse a record that is given twice: what it says would count twice.
///
/// # Errors
/// With both files.
pub fn refuse_twice(lead: &Measured, companions: &[Companion]) -> anyhow::Result<()> {
    let measured: Vec<&Measured> = std::iter::once(lead).chain(companions.iter().map(|it| &it.measured)).collect();
    for (number, record) in measured.iter().enumerate() {
        if let Some(twice) = measured[..number].iter().find(|known| known.sha256() == record.sha256()) {
            bail!(
                "{}: expected another record than {}, found the same bytes; what one record says would count twice: name it once, or record again",
                record.path().display(),
                twice.path().display()
            );
        }
    }
    Ok(())
}

/// Several records are searched and answered on the chain.
///
/// # Errors
/// A usage error for any other model.
pub fn refuse_upper(scene: &Scene) -> anyhow::Result<()> {
    match scene.model.kind {
        ModelKind::Chain => Ok(()),
        kind => Err(usage(format!(
            "model `{}` corrects one record at a time, and several are fitted together here; use --model chain, or fit the records one by one",
            kind.name()
        ))),
    }
}

/// Who says the frequency of a record's drive: the horn-tip record, else the plan's lines on it, else the record.
fn drive_stated(
    experiment: &Experiment,
    origin: Option<&(PathBuf, usize)>,
    measured: &Path,
    scene: &Scene,
) -> StatedFrequency {
    let frequency = scene.drive.frequency;
    match (experiment.drive_input(), origin) {
        (Some(drive), _) => {
            StatedFrequency { path: drive.path.clone(), line: line_of(&drive.path).map(|(line, _)| line), frequency }
        }
        (None, Some((plan, line))) => StatedFrequency { path: plan.clone(), line: Some(*line), frequency },
        (None, None) => StatedFrequency { path: measured.into(), line: None, frequency },
    }
}

/// What a record says of the frequency it was made at, if anything.
fn record_stated(measured: &Path) -> std::option::IntoIter<StatedFrequency> {
    let stated = line_of(measured).filter(|_| !is_published(measured)).map(|(line, frequency)| StatedFrequency {
        path: measured.into(),
        line: Some(line),
        frequency,
    });
    stated.into_iter()
}

/// The line of a file that states the drive frequency; a file that cannot be read is refused where it is read.
fn line_of(path: &Path) -> Option<(usize, f64)> {
    drive_frequency_line(&String::from_utf8_lossy(&std::fs::read(path).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_called_by_folder_or_name_and_numbered_where_alike() {
        let paths = ["lab/low/vib.csv", "lab/high/vib.csv", "lab/x.csv", "other/x.csv"].map(Path::new);
        assert_eq!(labels(&paths), ["low", "high", "x 3", "x 4"]);
    }

    #[test]
    fn overrides_of_one_record_are_numbered_from_one() {
        let sets = own_sets(&["2:chain.beads=7".into()], 2).unwrap();
        assert_eq!(sets, [(1, "chain.beads=7".to_owned())]);
        for wrong in ["chain.beads=7", "3:chain.beads=7", "0:a=1", "1:beads"] {
            assert!(own_sets(&[wrong.into()], 2).is_err(), "{wrong}");
        }
    }
}
