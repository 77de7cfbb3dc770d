//! A scene as written, read once.

use std::path::{Path, PathBuf};

use super::{
    BuiltIn, Loaded, ModelKind, SceneError, builtin,
    document::{Document, read_text},
    file::{assemble, parse},
    source::Author,
};

/// The text of a scene: of a file as it was when it was read, or a built-in one. Whatever becomes of the file, all scenes loaded from it are of these
/// bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneText(Origin);

#[derive(Debug, Clone, PartialEq, Eq)]
enum Origin {
    BuiltIn(&'static BuiltIn),
    File { path: PathBuf, text: String },
}

impl SceneText {
    /// Of a built-in scene by name or a file by path; a name that is both is the built-in scene.
    ///
    /// # Errors
    /// [`SceneError`] where there is neither, or the file cannot be read.
    pub fn read(name_or_path: &str) -> Result<Self, SceneError> {
        let path = Path::new(name_or_path);
        let looks_like_path = name_or_path.contains(['/', '\\', '.']) || path.exists();
        match builtin::find(name_or_path, None) {
            Err(SceneError::UnknownScene { .. }) if looks_like_path => {
                Ok(Self(Origin::File { path: path.into(), text: read_text(path)? }))
            }
            found => Ok(Self(Origin::BuiltIn(found?))),
        }
    }

    pub fn of_file(path: &Path, text: String) -> Self {
        Self(Origin::File { path: path.into(), text })
    }

    pub fn load(&self, overrides: &[String], preferred: ModelKind) -> Result<Loaded, SceneError> {
        match &self.0 {
            Origin::BuiltIn(scene) => {
                let document = Document::parse(scene.toml, Author::BuiltIn(scene.name))?;
                assemble(document, overrides, &format!("built-in scene `{}`", scene.name), scene.name, preferred)
            }
            Origin::File { path, text } => parse(text, path, overrides, preferred),
        }
    }

    /// The file and its text; none of a built-in scene.
    pub fn file(&self) -> Option<(&Path, &str)> {
        match &self.0 {
            Origin::BuiltIn(_) => None,
            Origin::File { path, text } => Some((path, text)),
        }
    }
}
