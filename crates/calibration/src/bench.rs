//! The bench on which one record was made: a scene by name, what was changed in it, and the drive recorded there.

use std::path::Path;

use super::drive::{Input, RecordedDrive};
use granchain_model::scene::{Limits, ModelKind, Scene, SceneError, SceneText};
use granchain_record::{MeasurementError, ReadOptions, sha256};

/// A scene under any further overrides.
#[derive(Debug, Clone)]
pub struct Bench {
    /// Built-in scene or scene file, as named.
    pub source: String,
    /// What stood there when it was read.
    pub text: SceneText,
    /// The overrides in force, in order.
    pub overrides: Vec<String>,
    /// Model where the scene names none.
    pub preferred: ModelKind,
    /// What takes the place of the scene's own drive.
    pub drive: Option<RecordedDrive>,
    /// Whether the drive's frequency was stated for all files, whatever they say themselves.
    pub frequency_stated: bool,
    /// What was assumed on reading, for people.
    pub assumptions: Vec<String>,
    /// What a run of it may ask for.
    pub limits: Limits,
}

/// How a horn tip is read.
pub(crate) type ReadDrive = fn(&Path, &ReadOptions) -> Result<RecordedDrive, MeasurementError>;

/// Why there is no bench.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Drive(#[from] MeasurementError),
}

impl Bench {
    /// A scene that is driven by the record `drive`, else by what the scene says; where that is a record too it is read here.
    ///
    /// # Errors
    /// [`BenchError`].
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
    ///
    /// # Errors
    /// [`SceneError`].
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

    /// The scene file and the digest of what was read of it; none of a built-in scene.
    #[must_use]
    pub fn scene_file(&self) -> Option<Input> {
        self.text.file().map(|(path, text)| Input { path: path.into(), sha256: sha256(text.as_bytes()) })
    }

    /// What looks wrong in the record that drives.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        self.drive.as_ref().map_or(&[], |drive| &drive.warnings)
    }

    /// Whether an override names `key`.
    #[must_use]
    pub fn sets(&self, key: &str) -> bool {
        self.overrides.iter().any(|set| sets(set, key))
    }

    /// Which model was taken where neither overrides nor notes name one, in words; `None` where they do.
    ///
    /// # Errors
    /// [`SceneError`].
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
                "model `{}`, as the scene names none: the chain searches, `{}` answers; --model chain stops at the chain",
                kind.name(),
                kind.name()
            ),
        }))
    }
}

/// Whether `KEY=VALUE` is about this key.
#[must_use]
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
