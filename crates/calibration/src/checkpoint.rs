//! State of a search on disk, so that a killed fit can continue.

use std::{
    fs,
    io::Write,
    path::{Path, PathBuf},
};

use argmin::core::{
    Error,
    checkpointing::{Checkpoint, CheckpointingFrequency},
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use thiserror::Error as ThisError;

use super::search::SearchState;
use granchain_record::{
    read_back::{LARGE, read_back},
    seal::{BrokenSeal, sealed, unsealed},
};

/// Why a saved state cannot be used.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum CheckpointError {
    #[error("{path}: the saved search cannot be read; pass --force without --resume to start again", path = path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error("{path}: the saved search is damaged; pass --force without --resume to start again", path = path.display())]
    Damaged { path: PathBuf, source: serde_json::Error },
    #[error("{path}: the saved search is not used: {source}; pass --force without --resume to start again", path = path.display())]
    Broken { path: PathBuf, source: BrokenSeal },
    #[error(
        "{path}: the saved search is inconsistent; pass --force without --resume to start again",
        path = path.display()
    )]
    Impossible { path: PathBuf },
    #[error(
        "{path}: the saved search belongs to another fit (other record, drive, scene, bounds, seed or version); repeat \
         the command that began it, give another --out, or pass --force without --resume to start again", path = path.display()
    )]
    OtherFit { path: PathBuf },
}

/// A file that always holds the last complete batch; it is written under a temporary name, then renamed.
#[derive(Debug, Clone)]
pub struct SearchCheckpoint {
    path: PathBuf,
    key: String,
}

#[derive(Serialize, Deserialize)]
struct Saved<S> {
    key: String,
    search: S,
}

impl SearchCheckpoint {
    /// A checkpoint at `path`; `key` is the digest of the inputs and settings of the fit.
    pub fn new(path: &Path, key: &str) -> Self {
        Self { path: path.to_owned(), key: key.to_owned() }
    }

    /// The checkpoint of a further search of the same fit; number 0 is this one.
    #[must_use]
    pub(crate) fn numbered(&self, number: usize) -> Self {
        let mut numbered = self.clone();
        if number > 0 {
            numbered.path.set_extension(format!("{number}.json"));
        }
        numbered
    }

    /// Error for a saved state that no search can have.
    pub(crate) fn impossible(&self) -> CheckpointError {
        CheckpointError::Impossible { path: self.path.clone() }
    }

    /// The saved search, if there is one.
    pub fn restore<S: DeserializeOwned>(&self) -> Result<Option<S>, CheckpointError> {
        let path = self.path.clone();
        let bytes = match read_back(&path, LARGE) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(CheckpointError::Unreadable { path, source }),
        };
        let body = unsealed(&bytes).map_err(|source| CheckpointError::Broken { path: path.clone(), source })?;
        let saved: Saved<S> = match serde_json::from_slice(body) {
            Ok(saved) => saved,
            Err(source) => return Err(CheckpointError::Damaged { path, source }),
        };
        if saved.key == self.key { Ok(Some(saved.search)) } else { Err(CheckpointError::OtherFit { path }) }
    }
}

impl<S: Serialize + Clone> Checkpoint<S, SearchState> for SearchCheckpoint {
    fn save(&self, solver: &S, _state: &SearchState) -> Result<(), Error> {
        let folder = self.path.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder)?;
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        let body = serde_json::to_vec(&Saved { key: self.key.clone(), search: solver.clone() })?;
        file.write_all(&sealed(&body))?;
        file.as_file().sync_all()?;
        file.persist(&self.path)?;
        Ok(())
    }

    /// Restoring is done before the executor is made, where it can fail with a message of its own.
    fn load(&self) -> Result<Option<(S, SearchState)>, Error> {
        Ok(None)
    }

    fn frequency(&self) -> CheckpointingFrequency {
        CheckpointingFrequency::Always
    }
}
