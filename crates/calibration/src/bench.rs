//! Bench of one record: a scene with its changes, and the recorded drive.

use std::path::Path;

use super::drive::{Input, RecordedDrive};
use granchain_model::scene::{Limits, ModelKind, Scene, SceneError, SceneText};
use granchain_record::{MeasurementError, ReadOptions, sha256};

/// A scene to which further overrides can be applied.
#[derive(Debug, Clone)]
pub struct Bench {
    /// Built-in scene or scene file, as named.
    pub source: String,
    /// Text of the scene when it was read.
    pub text: SceneText,
    /// The overrides in force, in order.
    pub overrides: Vec<String>,
    /// Model used if the scene names none.
    pub preferred: ModelKind,
    /// Recorded drive, which replaces the scene's own.
    pub drive: Option<RecordedDrive>,
    /// Whether the drive frequency was stated for all files, overriding their own.
    pub frequency_stated: bool,
    /// Assumptions made while reading, as text.
    pub assumptions: Vec<String>,
    /// Limits on time and memory of a run.
    pub limits: Limits,
}

/// Function that reads a horn-tip record.
pub(crate) type ReadDrive = fn(&Path, &ReadOptions) -> Result<RecordedDrive, MeasurementError>;

/// Why a bench cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Drive(#[from] MeasurementError),
}

impl Bench {
    /// Reads a scene driven by the record `drive`, or else as the scene states; a record named by the scene is read
    /// here.
    pub fn read(
        source: &str,
        overrides: Vec<String>,
        preferred: ModelKind,
        drive: Option<&Path>,
        (read, options): (ReadDrive, &ReadOptions),
    ) -> Result<Self, BenchError> {
        let text = SceneText::read(source)?;
        let loaded = text.load(&overrides, preferred)?;
        let drive = drive.or_else(|| loaded.scene.pending_record()).map(|path| read(path, options)).transpose()?;
        let mut assumptions = loaded.notes;
        if let Some(drive) = drive.as_ref().filter(|_| loaded.lacks_frequency) {
            let (found, path) = (1e-3 * drive.motion.drive_frequency, drive.input.path.display());
            assumptions.push(format!("`drive.frequency` is not given; taken as that of {path}, {found:.4} kHz"));
        }
        assumptions.extend(drive.iter().flat_map(|drive| drive.assumptions.iter().cloned()));
        let frequency_stated = options.drive_frequency.is_some();
        let limits = Limits::default();
        Ok(Self { source: source.into(), text, overrides, preferred, drive, frequency_stated, assumptions, limits })
    }

    /// The scene, with `more` overrides on top.
    pub fn scene_with(&self, more: &[String]) -> Result<Scene, SceneError> {
        let mut overrides: Vec<String> = self.overrides.iter().chain(more).cloned().collect();
        let mut loaded = self.text.load(&overrides, self.preferred)?;
        if let Some(drive) = self.drive.as_ref().filter(|_| loaded.lacks_frequency) {
            // What follows from the frequency, such as the vibrometer's bandwidth, follows from that of the record.
            overrides.push(format!("drive.frequency={}", drive.motion.drive_frequency));
            loaded = self.text.load(&overrides, self.preferred)?;
        }
        let scene = loaded.scene.with_limits(self.limits);
        let Some(drive) = &self.drive else { return Ok(scene) };
        Ok(drive.drive(scene, overrides.iter().any(|set| sets(set, "duration"))))
    }

    /// The scene file and its digest; `None` for a built-in scene.
    pub fn scene_file(&self) -> Option<Input> {
        self.text.file().map(|(path, text)| Input { path: path.into(), sha256: sha256(text.as_bytes()) })
    }

    /// Warnings about the drive record.
    pub fn warnings(&self) -> &[String] {
        self.drive.as_ref().map_or(&[], |drive| &drive.warnings)
    }

    /// Whether an override names `key`.
    pub(crate) fn sets(&self, key: &str) -> bool {
        self.overrides.iter().any(|set| sets(set, key))
    }

    /// Which model was chosen, as text, if neither overrides nor notes name one.
    pub fn model_taken(&self) -> Result<Option<String>, SceneError> {
        if self.sets("model.kind") || self.assumptions.iter().any(|text| text.starts_with("`model.kind`")) {
            return Ok(None);
        }
        let kind = |preferred| Ok(self.text.load(&self.overrides, preferred)?.scene.model.kind);
        // Keys of finite elements mean nothing to the chain: then it is no choice.
        let (taken, otherwise) = (kind(self.preferred)?, kind(ModelKind::Chain).ok());
        Ok(Some(match (Some(taken) == otherwise, taken) {
            (true, kind) => format!("model `{}`, which the scene `{}` names", kind.name(), self.source),
            (false, kind) => format!(
                "model `{}`, the default: search on the chain, values from `{}`; --model chain takes both from the chain",
                kind.name(),
                kind.name()
            ),
        }))
    }
}

/// Whether the assignment `KEY=VALUE` sets `key`.
pub fn sets(assignment: &str, key: &str) -> bool {
    assignment.split('=').next().is_some_and(|name| name.trim() == key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_file_that_is_edited_meanwhile_changes_neither_scenes_nor_their_digest() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("bench.toml");
        let before = "extends = \"rigid\"\nalpha = 0.5\n";
        std::fs::write(&file, before).unwrap();
        let options = ReadOptions::default();
        let how = (RecordedDrive::read as ReadDrive, &options);
        let bench = Bench::read(&file.display().to_string(), vec![], ModelKind::Chain, None, how).unwrap();
        std::fs::write(&file, before.replace("0.5", "0.6")).unwrap();
        assert_eq!(bench.scene_with(&[]).unwrap().amplitude_scale, 0.5);
        assert_eq!(bench.scene_file(), Some(Input { path: file, sha256: sha256(before.as_bytes()) }));
        let built_in = Bench::read("rigid", vec![], ModelKind::Chain, None, how).unwrap();
        assert_eq!(built_in.scene_file(), None);
    }
}
