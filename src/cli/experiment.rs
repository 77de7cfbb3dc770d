//! From the scene flags to a scene: built-in or file, an earlier calibration's parameters, the flags, a recorded drive.
//!
//! Later wins: scene, then a plan's `set`, then `--calibration`, then `--drive-frequency`, `--alpha`, `--model`, then `--set`, then the values
//! of a sweep.

use super::{
    accuracy,
    arguments::{SceneArguments, usage},
    calibrated::{Calibrated, CalibratedDrive},
    calibrated_drive,
    reading::{DriveUnread, ReadArguments},
};
use crate::{
    calibration::{
        bench::{Bench, BenchError, sets},
        drive::RecordedDrive,
    },
    measurement::{Baseline, ReadOptions, Reading, RecordKind},
    scene::{ModelKind, Scene, SceneError},
    study::Grid,
};

/// Read what the flags name; fails before anything is run. A scene that names no model is computed by `preferred`.
pub fn read(
    arguments: &SceneArguments,
    reading: &ReadArguments,
    calibration: Option<&Calibrated>,
    preferred: ModelKind,
) -> anyhow::Result<Bench> {
    if arguments.drive.len() > 1 {
        return Err(usage(format!("--drive: expected one horn-tip record, found {}", arguments.drive.len())));
    }
    let options = reading.options_of(RecordKind::HornTip, arguments.drive_frequency)?;
    assemble(arguments, options, calibration, preferred, false)
}

/// The same for a fit, whose horn tip is read at its plateau. A scene that names no model is fitted by the ladder up to the reduced one, or,
/// with several records together, on the chain. The horn tip is read by `options`.
pub fn for_fit(arguments: &SceneArguments, options: &ReadOptions, together: bool) -> anyhow::Result<Bench> {
    let preferred = if together { ModelKind::Chain } else { ModelKind::Reduced };
    assemble(arguments, options.clone(), None, preferred, true)
}

/// The drive of the calibration where it drives this run too: no other scene and no other file is named.
fn drive_of<'a>(calibration: Option<&'a Calibrated>, arguments: &SceneArguments) -> Option<&'a CalibratedDrive> {
    let drive = calibration.and_then(|calibration| calibration.drive.as_ref())?;
    match arguments.drive.first() {
        Some(file) => (*file == drive.input.path).then_some(drive),
        None => arguments.scene.is_none().then_some(drive),
    }
}

fn assemble(
    arguments: &SceneArguments,
    mut options: ReadOptions,
    calibration: Option<&Calibrated>,
    preferred: ModelKind,
    fitted: bool,
) -> anyhow::Result<Bench> {
    let mut assumptions = Vec::new();
    let source = match (&arguments.scene, calibration.and_then(|calibration| calibration.scene.as_ref())) {
        (Some(scene), _) => scene.clone(),
        (None, Some(scene)) => {
            assumptions.push(format!("scene `{scene}`, for which the calibration was made"));
            scene.clone()
        }
        (None, None) => {
            return Err(usage("--scene NAME|FILE is needed; `granchain scene list` names the built-in ones"));
        }
    };
    let mut overrides = arguments.planned.clone();
    let drive_of_fit = drive_of(calibration, arguments);
    if let Some(drive) = drive_of_fit {
        // The record is read as it was for the fit, where no flag states another reading.
        options = Reading::of(&drive.options).below(options)?;
        options.force_frequency |= options.drive_frequency.is_none() && drive.options.force_frequency;
        options.drive_frequency = options.drive_frequency.or(drive.options.drive_frequency);
        assumptions.push(format!("drive {}, for which the calibration was made", drive.input.path.display()));
    }
    if let Some(calibration) = calibration {
        // Another scene takes over what was fitted, not the settings of the first one's bench.
        if arguments.scene.is_none() {
            overrides.extend(calibration.own_overrides.iter().cloned());
        } else {
            let fitted = |given: &&String| sets(given, "alpha") || given.starts_with("damping.");
            overrides.extend(calibration.own_overrides.iter().filter(fitted).cloned());
        }
        assumptions.push(format!("{} from {}", calibration.overrides.join(", "), calibration.input.path.display()));
        if calibration.verdict != "within scatter" {
            assumptions.push(format!("that calibration ended `{}`: do not lean on it", calibration.verdict));
        }
        overrides.extend(calibration.overrides.iter().cloned());
    }
    let drive = arguments
        .drive
        .first()
        .map(std::path::PathBuf::as_path)
        // The scene's own drive.
        .filter(|file| file.as_os_str() != "none")
        .or(drive_of_fit.map(|drive| drive.input.path.as_path()));
    if drive.is_none() {
        overrides.extend(arguments.drive_frequency.map(|frequency| format!("drive.frequency={frequency}")));
    }
    overrides.extend(arguments.alpha.map(|alpha| format!("alpha={alpha}")));
    overrides.extend(arguments.model.map(|model| format!("model.kind={}", model.name())));
    let before = overrides.clone();
    overrides.extend(arguments.set.iter().cloned());
    if let Some(calibration) = calibration {
        calibrated_drive::check(calibration, arguments, (&overrides, preferred))?;
    }
    // The drive of a calibration is read as it was for the fit: another baseline is another first gap.
    let plateau = (fitted || drive_of_fit.is_some()) && options.baseline == Baseline::Auto;
    let read = if plateau { RecordedDrive::read_at_plateau } else { RecordedDrive::read };
    let mut bench =
        Bench::read(&source, overrides, preferred, drive, (read, &options)).map_err(|error| match error {
            // Beside a record of its own the horn has flags of its own.
            BenchError::Drive(error) if fitted => anyhow::Error::new(DriveUnread(error)),
            BenchError::Drive(error) => error.into(),
            error => error.into(),
        })?;
    if fitted {
        refuse_hits(&bench.text.load(&bench.overrides, preferred)?.scene)?;
    }
    if let Some(level) = arguments.accuracy {
        // A fit runs the chain and the reduced model; single runs take any.
        let models: &[ModelKind] = if fitted {
            &[ModelKind::Chain, ModelKind::Reduced]
        } else {
            &[ModelKind::Chain, ModelKind::Reduced, ModelKind::Fea]
        };
        let choice = accuracy::choose(&bench.scene_with(&[])?, level, models, &arguments.session)?;
        let computed =
            |set: &String| set.trim_start().starts_with("model.") || set.trim_start().starts_with("contact.law");
        bench.overrides = before.into_iter().filter(|set| !computed(set)).collect();
        bench.overrides.extend(choice.sets.into_iter().chain(arguments.set.iter().cloned()));
        assumptions.push(choice.note);
    }
    if let (Some(calibrated), Some(drive)) = (calibration.and_then(|it| it.drive.as_ref()), &bench.drive)
        && drive.input.sha256 != calibrated.input.sha256
    {
        let (found, calibrated) = (drive.input.path.display(), calibrated.input.path.display());
        assumptions.push(if drive_of_fit.is_some() {
            format!("{found} was changed since the calibration: alpha may not belong to it")
        } else {
            format!("{found} is not the horn record of the calibration, {calibrated}: alpha need not hold for it")
        });
    }
    assumptions.append(&mut bench.assumptions);
    bench.assumptions = assumptions;
    if drive.is_some() {
        refuse_drive_keys(&bench, arguments.overridden())?;
    }
    Ok(bench)
}

/// Take the chain at all of `points` (overrides each) if one of them needs it and the scene names no model: one study, one model.
pub fn agree_on_model(bench: &mut Bench, points: impl Iterator<Item = Vec<String>>) {
    let kind = |overrides: &[String]| bench.scene_with(overrides).ok().map(|scene| scene.model.kind);
    let own = kind(&[]);
    let needs_chain = |point: &Vec<String>| {
        own != Some(ModelKind::Chain)
            && !point.iter().any(|set| sets(set, "model.kind"))
            && kind(point) == Some(ModelKind::Chain)
    };
    if let Some(point) = points.into_iter().find(needs_chain) {
        bench.preferred = ModelKind::Chain;
        let point = point.join(", ");
        bench.assumptions.push(format!("`model.kind` is not given; taken as chain everywhere, since {point} needs it"));
    }
}

/// Hits of a striker are fitted by a program of their own.
pub fn refuse_hits(scene: &Scene) -> anyhow::Result<()> {
    match scene.drive.kind.striker() {
        Some(_) => Err(usage(format!(
            "scene `{}` is hit by a striker: fit its hits with `granchain-impact fit FILES --scene SCENE` (docs/impact.md)",
            scene.name
        ))),
        None => Ok(()),
    }
}

/// A recorded drive takes the place of the scene's own, so its keys would silently do nothing.
pub fn refuse_drive_keys<'a>(bench: &Bench, mut keys: impl Iterator<Item = &'a str>) -> anyhow::Result<()> {
    match keys.find(|key| bench.drive.is_some() && key.trim().starts_with("drive.")) {
        Some(key) => Err(usage(format!(
            "`{key}` has no effect: the horn record replaces the scene's drive; pass --drive none for the scene's, or scale the record with alpha"
        ))),
        None => Ok(()),
    }
}

/// Refuses a key that is varied in a unit of another dimension.
pub fn refuse_wrong_units(bench: &Bench, grid: &Grid) -> anyhow::Result<()> {
    for text in grid.with_units() {
        if let Err(error @ SceneError::Quantity { .. }) = bench.scene_with(&[text]) {
            anyhow::bail!(as_varied(&error, grid));
        }
    }
    Ok(())
}

/// An error with the keys of a grid as they were typed.
pub fn as_varied(error: &impl ToString, grid: &Grid) -> String {
    grid.axes.iter().fold(error.to_string(), |message, axis| {
        message.replace(&format!("--set {}=", axis.key), &format!("--vary {}=", axis.key))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::arguments::preferred_model;

    #[test]
    fn flags_win_over_what_a_plan_sets() {
        let planned = ["alpha=0.9", "model.kind=reduced", "drive.frequency=70000", "chain.beads=5"];
        let arguments = SceneArguments {
            scene: Some("annulus".into()),
            model: Some(ModelKind::Chain),
            drive_frequency: Some(73e3),
            alpha: Some(0.5),
            planned: planned.map(str::to_owned).to_vec(),
            ..SceneArguments::default()
        };
        let scene = for_fit(&arguments, &ReadOptions::default(), false).unwrap().scene_with(&[]).unwrap();
        let found = (scene.amplitude_scale, scene.model.kind, scene.drive.frequency, scene.chain.beads.len());
        assert_eq!(found, (0.5, ModelKind::Chain, 73e3, 5));
    }

    #[test]
    fn a_calibration_is_taken_up_on_the_model_that_answered() {
        let place = tempfile::tempdir().unwrap();
        for (model, scene) in [
            (ModelKind::Chain, None),
            (ModelKind::Reduced, None),
            (ModelKind::Fea, None),
            (ModelKind::Chain, Some("annulus")),
            (ModelKind::Reduced, Some("annulus")),
            (ModelKind::Fea, Some("annulus")),
        ] {
            let json = serde_json::json!({
                "parameters": {"alpha": {"value": 0.5, "unit": "1"}}, "damping_kind": "linear", "verdict": "within scatter",
                "scene": "annulus", "model": model.name(),
            });
            std::fs::write(place.path().join("calibration.json"), json.to_string()).unwrap();
            let calibrated = Calibrated::read(place.path()).unwrap();
            let arguments = SceneArguments { scene: scene.map(str::to_owned), ..SceneArguments::default() };
            for ensemble in [None, Some(2)] {
                let preferred = preferred_model(Some(&calibrated), ensemble);
                let bench = read(&arguments, &ReadArguments::default(), Some(&calibrated), preferred).unwrap();
                assert_eq!(bench.scene_with(&[]).unwrap().model.kind, model, "{scene:?}");
            }
            let stated = SceneArguments { set: vec!["model.kind=chain".into()], ..arguments };
            let bench = read(&stated, &ReadArguments::default(), Some(&calibrated), model).unwrap();
            assert_eq!(bench.scene_with(&[]).unwrap().model.kind, ModelKind::Chain);
        }
    }
}
