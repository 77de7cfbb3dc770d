//! The drive of a calibration against that of another scene it is used on: α belongs to the drive it was fitted with.

use std::path::Path;

use anyhow::Context;

use super::{
    arguments::{SceneArguments, usage},
    calibrated::Calibrated,
};
use crate::{
    calibration::{bench::sets, drive::Input},
    measurement::{ReadOptions, shell_word},
    scene::{Drive, DriveKind, ModelKind, SceneText},
    signal::{Dimension, Quantity},
};

/// Relative difference up to which two settings of a drive are the same.
const SAME: f64 = 1e-9;

/// Refuse another scene whose drive is not the one of the calibration. A drive that a flag names is meant: `--drive`, `--drive-frequency`
/// and `--set drive.KEY=VALUE`.
pub fn check(
    calibration: &Calibrated,
    arguments: &SceneArguments,
    (overrides, preferred): (&[String], ModelKind),
) -> anyhow::Result<()> {
    let Some(scene) = arguments.scene.as_ref().filter(|_| arguments.drive.is_empty()) else { return Ok(()) };
    let here = drive(scene, overrides, preferred)?;
    let named = calibration.named.display().to_string();
    let refused = |fitted: &str, also: &str| {
        usage(format!(
            "alpha was calibrated with {fitted}, but --scene {scene} is driven by {}; run `granchain replay --calibration {}`, {also}",
            in_words(&here),
            shell_word(&named)
        ))
    };
    if let Some(fitted) = &calibration.drive {
        let path = fitted.input.path.display().to_string();
        let also = format!("for this scene under that drive add --drive {}", shell_word(&path));
        return if is_record(&here, &fitted.input)? && fitted.options == ReadOptions::default() {
            Ok(())
        } else {
            Err(refused(&format!("the record {path}"), &also))
        };
    }
    // A calibration that names no scene has no drive to compare.
    let Some(own) = &calibration.scene else { return Ok(()) };
    let fitted = drive(own, &calibration.own_overrides, preferred)
        .with_context(|| format!("the scene `{own}`, for which {named} was made, is needed to compare the drives"))?;
    let meant = |key: &str| {
        key == "drive.frequency" && arguments.drive_frequency.is_some()
            || arguments.set.iter().any(|set| sets(set, key))
    };
    if differs(&here, &fitted, meant) {
        let also = "or state the drive that is meant with --set drive.KEY=VALUE";
        return Err(refused(&in_words(&fitted), also));
    }
    Ok(())
}

fn drive(scene: &str, overrides: &[String], preferred: ModelKind) -> anyhow::Result<Drive> {
    Ok(SceneText::read(scene)?.load(overrides, preferred)?.scene.drive)
}

/// Whether a drive is read from the very file of the calibration.
fn is_record(drive: &Drive, file: &Input) -> anyhow::Result<bool> {
    match &drive.kind {
        DriveKind::UnreadRecord { file: own } => Ok(Input::digest(own.clone())?.sha256 == file.sha256),
        _ => Ok(false),
    }
}

/// Name of the waveform, its number of cycles (of a striker its velocity, m/s) and its ring-up, s; of a record its file.
fn shape(kind: &DriveKind) -> (&'static str, f64, f64, Option<&Path>) {
    match kind {
        DriveKind::SineCycles { cycles } => ("sine", *cycles, 0.0, None),
        DriveKind::ToneBurst { cycles, ring_up } => ("tone burst", *cycles, *ring_up, None),
        DriveKind::GaussianBurst { cycles } => ("Gaussian burst", *cycles, 0.0, None),
        DriveKind::Striker { velocity, .. } => ("striker", *velocity, 0.0, None),
        DriveKind::Record { file, .. } => ("record", 0.0, 0.0, file.as_deref()),
        DriveKind::UnreadRecord { file } => ("record", 0.0, 0.0, Some(file)),
    }
}

/// Whether two drives differ in a key that is not `meant` so.
fn differs(here: &Drive, fitted: &Drive, meant: impl Fn(&str) -> bool) -> bool {
    let ((kind, cycles, ring_up, file), (kind_of, cycles_of, ring_up_of, file_of)) =
        (shape(&here.kind), shape(&fitted.kind));
    let other = |a: f64, b: f64| (a - b).abs() > SAME * a.abs().max(b.abs());
    [
        ("drive.kind", kind != kind_of || file != file_of),
        (if kind == "striker" { "drive.velocity" } else { "drive.cycles" }, other(cycles, cycles_of)),
        ("drive.ring_up", other(ring_up, ring_up_of)),
        ("drive.frequency", other(here.frequency, fitted.frequency)),
        ("drive.amplitude", other(here.amplitude, fitted.amplitude)),
    ]
    .into_iter()
    .any(|(key, differs)| differs && !meant(key))
}

/// "a tone burst of 40 cycles at 73 kHz, amplitude 1 µm".
fn in_words(drive: &Drive) -> String {
    let (name, cycles, _, file) = shape(&drive.kind);
    match file {
        Some(file) => format!("the {name} {}", file.display()),
        None if name == "striker" => format!("a striker of {cycles} m/s"),
        None => format!(
            "a {name} of {cycles} cycles at {}, amplitude {}",
            Quantity::new(drive.frequency, Dimension::FREQUENCY),
            Quantity::new(drive.amplitude, Dimension::LENGTH)
        ),
    }
}
