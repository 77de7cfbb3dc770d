//! From the scene flags to a scene: built-in or file, an earlier calibration's parameters, the flags, a recorded drive.
//!
//! Later wins: scene, then `--calibration`, then `--drive-frequency`, `--alpha`, `--model`, then `--set`, then the values
//! of a sweep.

use std::path::{Path, PathBuf};

use anyhow::Context;
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::{
    arguments::{SceneArguments, usage},
    calibrated::Calibrated,
    level,
    reading::ReadArguments,
};
use crate::{
    measurement::{Baseline, HornDrive, MeasurementError, ReadOptions, RecordKind, read_record},
    scene::{self, ModelKind, Scene, SceneError},
};

/// A file that went into a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Input {
    /// As given.
    pub path: PathBuf,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}

impl Input {
    /// The file as it is now.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn digest(path: PathBuf) -> anyhow::Result<Self> {
        let bytes = std::fs::read(&path).with_context(|| format!("{}: cannot be read", path.display()))?;
        let sha256 = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { path, sha256 })
    }
}

/// What is to be simulated.
#[derive(Debug, Clone)]
pub struct Experiment {
    source: String,
    overrides: Vec<String>,
    /// Model where the scene names none.
    preferred: ModelKind,
    recorded: Option<RecordedDrive>,
    keep_duration: bool,
    /// What was assumed on the way, for people.
    pub assumptions: Vec<String>,
    /// What looks wrong with the horn's record and what it spoils.
    pub warnings: Vec<String>,
}

/// A horn-tip record, ready to drive.
#[derive(Debug, Clone)]
struct RecordedDrive {
    input: Input,
    drive: HornDrive,
    baseline_error: Option<f64>,
}

impl RecordedDrive {
    /// With the baseline of the plateau, or of the first samples where the burst is too short to have one.
    fn read_at_plateau(path: &Path, options: &ReadOptions, said: &mut Said) -> Result<Self, MeasurementError> {
        let at_plateau = ReadOptions { baseline: Baseline::Plateau, ..options.clone() };
        match Self::read(path, &at_plateau, said) {
            Err(MeasurementError::NoPlateau { .. }) => Self::read(path, options, said),
            read => read,
        }
    }

    fn read(path: &Path, options: &ReadOptions, said: &mut Said) -> Result<Self, MeasurementError> {
        let record = read_record(path, RecordKind::HornTip, options)?;
        let drive = record.to_drive()?;
        let baseline_error = record.baseline_error;
        let frequency = format!("drive frequency {:.4} kHz; {}", drive.drive_frequency * 1e-3, drive.statement());
        let place = |text: String| format!("{}: {text}", path.display());
        said.assumptions.extend(record.assumptions.into_iter().chain([frequency]).map(place));
        said.warnings.extend(record.warnings.into_iter().chain(drive.warnings()).map(place));
        Ok(Self { input: Input { path: record.path, sha256: record.sha256 }, drive, baseline_error })
    }
}

/// What is said of a record.
#[derive(Debug, Default)]
struct Said {
    assumptions: Vec<String>,
    warnings: Vec<String>,
}

impl Experiment {
    /// Read what the flags name; fails before anything is run. A scene that names no model is computed by `preferred`.
    ///
    /// # Errors
    /// A usage error without a scene; whatever is wrong with the scene or the record.
    pub fn new(
        arguments: &SceneArguments,
        reading: &ReadArguments,
        calibration: Option<&Calibrated>,
        preferred: ModelKind,
    ) -> anyhow::Result<Self> {
        Self::assemble(arguments, reading, calibration, preferred, false)
    }

    /// The same for a fit. An error in the horn's baseline is a gap to the chain, and the plateau's mean is far better known
    /// than the first samples': it is taken where the burst has one. A scene that names no model is fitted by the ladder up to the reduced
    /// one.
    ///
    /// # Errors
    /// As [`Experiment::new`].
    pub fn for_fit(arguments: &SceneArguments) -> anyhow::Result<Self> {
        Self::assemble(arguments, &ReadArguments::default(), None, ModelKind::Reduced, true)
    }

    /// The same where several records are fitted together: on the chain, unless the scene names another model.
    ///
    /// # Errors
    /// As [`Experiment::new`].
    pub fn for_joint_fit(arguments: &SceneArguments) -> anyhow::Result<Self> {
        Self::assemble(arguments, &ReadArguments::default(), None, ModelKind::Chain, true)
    }

    fn assemble(
        arguments: &SceneArguments,
        reading: &ReadArguments,
        calibration: Option<&Calibrated>,
        preferred: ModelKind,
        fitted: bool,
    ) -> anyhow::Result<Self> {
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
            assumptions.push(format!("{} from {}", calibration.overrides.join(", "), calibration.path.display()));
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
        let keep_duration = overrides.iter().any(|set| sets(set, "duration"));
        let warnings = Vec::new();
        let mut experiment =
            Self { source, overrides, preferred, recorded: None, keep_duration, assumptions, warnings };

        let loaded = scene::load_preferring(&experiment.source, &experiment.overrides, preferred)?;
        experiment.assumptions.extend(loaded.notes);
        let replaced = arguments.drive.is_some() || calibrated_drive.is_some();
        let options = reading.options(arguments.drive_frequency);
        // The drive of a calibration is read as it was for the fit: another baseline is another first gap.
        let plateau = (fitted || calibrated_drive.is_some()) && options.baseline == Baseline::Auto;
        let record = arguments.drive.clone().or(calibrated_drive);
        if let Some(path) = record.or_else(|| loaded.scene.pending_record().map(Path::to_path_buf)) {
            let read = if plateau { RecordedDrive::read_at_plateau } else { RecordedDrive::read };
            let mut said = Said::default();
            experiment.recorded = Some(read(&path, &options, &mut said)?);
            experiment.assumptions.extend(said.assumptions);
            experiment.warnings.extend(said.warnings);
            if replaced {
                experiment.refuse_drive_keys(arguments.set.iter().map(String::as_str))?;
            }
        }
        Ok(experiment)
    }

    /// Which model was taken where neither flags nor overrides name one, in words; `None` where they do, or where an assumption says it.
    ///
    /// # Errors
    /// [`SceneError`].
    pub fn model_taken(&self) -> Result<Option<String>, SceneError> {
        if self.overrides.iter().any(|set| sets(set, "model.kind"))
            || self.assumptions.iter().any(|text| text.starts_with("`model.kind`"))
        {
            return Ok(None);
        }
        let kind = |preferred| Ok(scene::load_preferring(&self.source, &self.overrides, preferred)?.scene.model.kind);
        let (taken, otherwise) = (kind(self.preferred)?, kind(ModelKind::Chain)?);
        Ok(Some(match (taken == otherwise, taken) {
            (true, kind) => format!("model `{}`, which the scene `{}` names", kind.name(), self.source),
            (false, kind) => format!(
                "model `{}`, as the scene names none: the chain searches, `{}` answers; --model chain stops at the chain",
                kind.name(),
                kind.name()
            ),
        }))
    }

    /// The scene, with `more` overrides on top.
    ///
    /// # Errors
    /// [`SceneError`].
    pub fn scene_with(&self, more: &[String]) -> Result<Scene, SceneError> {
        let overrides: Vec<String> = self.overrides.iter().chain(more).cloned().collect();
        let mut scene = scene::load_preferring(&self.source, &overrides, self.preferred)?.scene;
        if let Some(recorded) = &self.recorded {
            if !(self.keep_duration || more.iter().any(|set| sets(set, "duration"))) {
                scene.duration = (recorded.drive.recorded_until / scene.output_step).floor() * scene.output_step;
            }
            let file = Some(recorded.input.path.clone());
            let HornDrive { displacement, recorded_until, drive_frequency, .. } = &recorded.drive;
            scene = scene.with_continued_record(displacement.clone(), *recorded_until, *drive_frequency, file);
        }
        Ok(scene)
    }

    /// Take the chain at all of `points` (overrides each) if one of them needs it and the scene names no model: one study, one model.
    pub fn agree_on_model(&mut self, points: impl Iterator<Item = Vec<String>>) {
        let kind = |overrides: &[String]| self.scene_with(overrides).ok().map(|scene| scene.model.kind);
        let own = kind(&[]);
        let needs_chain = |point: &Vec<String>| {
            own != Some(ModelKind::Chain)
                && !point.iter().any(|set| sets(set, "model.kind"))
                && kind(point) == Some(ModelKind::Chain)
        };
        if let Some(point) = points.into_iter().find(needs_chain) {
            self.preferred = ModelKind::Chain;
            let point = point.join(", ");
            self.assumptions
                .push(format!("`model.kind` is not given; taken as chain everywhere, since {point} needs it"));
        }
    }

    /// A recorded drive takes the place of the scene's own, so its keys would silently do nothing.
    ///
    /// # Errors
    /// A usage error for the first of `keys` (or `KEY=VALUE`) that belongs to the drive.
    pub fn refuse_drive_keys<'a>(&self, mut keys: impl Iterator<Item = &'a str>) -> anyhow::Result<()> {
        match keys.find(|key| self.recorded.is_some() && key.trim().starts_with("drive.")) {
            Some(key) => Err(usage(format!(
                "`{key}` would do nothing: a record takes the place of the scene's drive; scale it with alpha"
            ))),
            None => Ok(()),
        }
    }

    /// The scene as named on the command line.
    #[must_use]
    pub fn source(&self) -> &str {
        &self.source
    }

    /// The overrides in force, in order.
    #[must_use]
    pub fn overrides(&self) -> &[String] {
        &self.overrides
    }

    /// The drive record, where there is one.
    #[must_use]
    pub fn drive_input(&self) -> Option<&Input> {
        self.recorded.as_ref().map(|recorded| &recorded.input)
    }

    /// The drive that was made of the record, where there is one.
    #[must_use]
    pub fn horn_drive(&self) -> Option<&HornDrive> {
        self.recorded.as_ref().map(|recorded| &recorded.drive)
    }

    /// Standard error of the horn's baseline, m, where a record of it tells.
    pub fn baseline_error(&self) -> Option<f64> {
        self.recorded.as_ref()?.baseline_error
    }
}

fn sets(assignment: &str, key: &str) -> bool {
    assignment.split('=').next().is_some_and(|name| name.trim() == key)
}
