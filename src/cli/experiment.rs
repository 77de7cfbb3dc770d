//! From the scene flags to a scene: built-in or file, an earlier calibration's parameters, the flags, a recorded drive.
//!
//! Later wins: scene, then `--calibration`, then `--drive-frequency`, `--alpha`, `--model`, then `--set`, then the values
//! of a sweep.

use super::{
    arguments::{SceneArguments, usage},
    calibrated::Calibrated,
    level,
    reading::{DriveUnread, ReadArguments},
};
use crate::{
    calibration::{
        bench::{Bench, BenchError, sets},
        drive::RecordedDrive,
    },
    measurement::{Baseline, ReadOptions, RecordKind},
    scene::ModelKind,
};

/// Read what the flags name; fails before anything is run. A scene that names no model is computed by `preferred`.
///
/// # Errors
/// A usage error without a scene; whatever is wrong with the scene or the record.
pub fn read(
    arguments: &SceneArguments,
    reading: &ReadArguments,
    calibration: Option<&Calibrated>,
    preferred: ModelKind,
) -> anyhow::Result<Bench> {
    let options = reading.options_of(RecordKind::HornTip, arguments.drive_frequency)?;
    assemble(arguments, &options, calibration, preferred, false)
}

/// The same for a fit, whose horn tip is read at its plateau. A scene that names no model is fitted by the ladder up to the reduced one, or,
/// with several records together, on the chain. The horn tip is read by `options`.
///
/// # Errors
/// As [`read`].
pub fn for_fit(arguments: &SceneArguments, options: &ReadOptions, together: bool) -> anyhow::Result<Bench> {
    let preferred = if together { ModelKind::Chain } else { ModelKind::Reduced };
    assemble(arguments, options, None, preferred, true)
}

fn assemble(
    arguments: &SceneArguments,
    options: &ReadOptions,
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
    let mut overrides = Vec::new();
    let mut calibrated_drive = None;
    if let Some(calibration) = calibration {
        // Another scene takes over what was fitted, not what was said of the first one's bench.
        if arguments.scene.is_none() {
            overrides.extend(calibration.told.iter().cloned());
            calibrated_drive = calibration.drive.clone().filter(|_| arguments.drive.is_none());
        } else {
            let fitted = |told: &&String| sets(told, "alpha") || told.starts_with("damping.");
            overrides.extend(calibration.told.iter().filter(fitted).cloned());
        }
        if let Some(drive) = &calibrated_drive {
            assumptions.push(format!("drive {}, for which the calibration was made", drive.display()));
        }
        assumptions.push(format!("{} from {}", calibration.overrides.join(", "), calibration.input.path.display()));
        if calibration.verdict != "within scatter" {
            assumptions.push(format!("that calibration ended `{}`: do not lean on it", calibration.verdict));
        }
        overrides.extend(calibration.overrides.iter().cloned());
    }
    if arguments.drive.is_none() && calibrated_drive.is_none() {
        overrides.extend(arguments.drive_frequency.map(|frequency| format!("drive.frequency={frequency}")));
    }
    overrides.extend(arguments.alpha.map(|alpha| format!("alpha={alpha}")));
    overrides.extend(arguments.model.map(|model| format!("model.kind={}", model.name())));
    if let Some(level) = arguments.accuracy {
        // A fit runs the chain and the reduced model; single runs take any.
        let models: &[ModelKind] = if fitted {
            &[ModelKind::Chain, ModelKind::Reduced]
        } else {
            &[ModelKind::Chain, ModelKind::Reduced, ModelKind::Fea]
        };
        let changed = !overrides.is_empty() || !arguments.set.is_empty() || arguments.drive.is_some();
        let choice = level::choose(&source, level, models, changed)?;
        overrides.extend(choice.sets);
        assumptions.push(choice.said);
    }
    overrides.extend(arguments.set.iter().cloned());
    // The drive of a calibration is read as it was for the fit: another baseline is another first gap.
    let plateau = (fitted || calibrated_drive.is_some()) && options.baseline == Baseline::Auto;
    let read = if plateau { RecordedDrive::read_at_plateau } else { RecordedDrive::read };
    let drive = arguments.drive.as_deref().or(calibrated_drive.as_deref());
    let mut bench =
        Bench::read(&source, overrides, preferred, drive, (read, options)).map_err(|error| match error {
            // Beside a record of its own the horn has flags of its own.
            BenchError::Drive(error) if fitted => anyhow::Error::new(DriveUnread(error)),
            BenchError::Drive(error) => error.into(),
            error => error.into(),
        })?;
    assumptions.append(&mut bench.assumptions);
    bench.assumptions = assumptions;
    if drive.is_some() {
        refuse_drive_keys(&bench, arguments.set.iter().map(String::as_str))?;
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

/// A recorded drive takes the place of the scene's own, so its keys would silently do nothing.
///
/// # Errors
/// A usage error for the first of `keys` (or `KEY=VALUE`) that belongs to the drive.
pub fn refuse_drive_keys<'a>(bench: &Bench, mut keys: impl Iterator<Item = &'a str>) -> anyhow::Result<()> {
    match keys.find(|key| bench.drive.is_some() && key.trim().starts_with("drive.")) {
        Some(key) => Err(usage(format!(
            "`{key}` would do nothing: a record takes the place of the scene's drive; scale it with alpha"
        ))),
        None => Ok(()),
    }
}
