//! Where results go: standard output that may close, and folders that appear whole or not at all.
//!
//! An [`OutputFolder`] is written beside its target under a temporary name and renamed at the end. Every finished folder
//! holds a `.granchain` list of the files granchain wrote there, so that a later run knows what it may replace: a folder
//! with other files in it is refused unless forced, and then those files are kept.

mod folder;

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

pub use folder::{OutputFolder, remove_staged};

/// Why output could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The folder holds something that is not ours.
    #[error(
        "{}: the folder holds files that granchain did not write (`{found}`); name another --out, or pass --force to \
         write beside them",
        folder.display()
    )]
    Foreign {
        /// The folder.
        folder: PathBuf,
        /// One of the files.
        found: String,
    },
    /// The target is a file.
    #[error("{}: expected a folder, found a file; name another --out", path.display())]
    NotAFolder {
        /// The path.
        path: PathBuf,
    },
    /// An unfinished run is in the way.
    #[error(
        "{}: an unfinished run is kept there; pass --resume to continue it, or --force to drop it and start anew",
        path.display()
    )]
    Unfinished {
        /// Where its state is.
        path: PathBuf,
    },
    /// There is nothing to resume.
    #[error("{}: --resume found no unfinished run there; start it without --resume", path.display())]
    NothingToResume {
        /// Where its state should be.
        path: PathBuf,
    },
    /// Another process works there.
    #[error("{}: another run is writing there; wait for it, or name another --out", path.display())]
    InUse {
        /// Where it writes.
        path: PathBuf,
    },
    /// The file system refused.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// Where.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

impl OutputError {
    pub(crate) fn io<'a>(action: &'static str, path: &'a Path) -> impl FnOnce(io::Error) -> Self + use<'a> {
        move |source| Self::Io { action, path: path.into(), source }
    }
}

/// Write `bytes` to `path` so that a reader sees the old file or the new one, never a part: temporary file, fsync,
/// rename.
///
/// # Errors
/// [`OutputError::Io`].
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".granchain-");
    #[cfg(unix)]
    {
        // rw-rw-rw- less the umask: results are for colleagues too.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder).map_err(OutputError::io("create a file", folder))?;
    file.write_all(bytes).map_err(OutputError::io("write", path))?;
    file.as_file().sync_all().map_err(OutputError::io("write", path))?;
    file.persist(path).map_err(|error| OutputError::Io {
        action: "rename to",
        path: path.into(),
        source: error.error,
    })?;
    sync_folder(folder);
    Ok(())
}

/// Make a rename survive a power cut; file systems that cannot sync a folder are left alone.
fn sync_folder(folder: &Path) {
    if let Ok(handle) = fs::File::open(folder) {
        let _ = handle.sync_all();
    }
}

/// Write to standard output.
///
/// # Errors
/// When it is closed or full; the frame ends quietly on a closed pipe.
pub fn print(text: impl std::fmt::Display) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    write!(out, "{text}")?;
    out.flush()?;
    Ok(())
}

/// Whether the error is a closed pipe (`granchain … | head`).
#[must_use]
pub fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .any(|cause| cause.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe))
}
