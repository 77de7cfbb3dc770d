//! Where results go: standard output that may close, and folders that appear whole or not at all.
//!
//! An [`OutputFolder`] is written beside its target under a temporary name and renamed at the end. Every finished folder
//! holds a `.granchain` list of the files granchain wrote there, with their digests, so that a later run knows what it may replace: a folder
//! with other files in it is refused unless forced, and then those files are kept.

mod columns;
mod folder;
mod list;
mod page;
mod staged;
mod work;

use std::{
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::Context;
use console::Term;

use columns::{broken, columns_of};

use crate::signal::visible;

pub use columns::{WIDEST, aligned};
pub use folder::{NOTHING_SAVED, OutputFolder, PLAN, same_plan};
pub use list::{LIST, digest, files_below, is_altered, list_faults};
pub use page::{publish, set_flags};
use staged::Staged;
pub use staged::{abandon, publishing};

/// Results that commands of several kinds have.
const COMMON: [&str; 6] =
    ["report.html", "report.md", "manifest.json", "summary.json", "scene.toml", super::timing::FILE];

/// Results of a command with a page: those that all of them have, and one that tells it from others.
pub fn page_results(own: &str) -> [&str; 4] {
    ["report.html", "report.md", super::timing::FILE, own]
}

/// Why output could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    #[error("--out {}: expected a folder of its own for the results, found the root of the file system; name one below it", path.display())]
    Root { path: PathBuf },
    #[error(
        "--out {}: expected a name of at most {most} bytes, found {found}: the hidden folder beside it has a longer one; shorten the name",
        path.display()
    )]
    LongName { path: PathBuf, most: usize, found: usize },
    #[error(
        "{}: the folder holds files that granchain did not write (`{found}`); name another --out, or pass --force to \
         write beside them",
        folder.display()
    )]
    Foreign { folder: PathBuf, found: String },
    #[error(
        "{}: `{found}` is in the way of a result of that name, and granchain did not write it; move or rename it, or name another --out: \
         --force never replaces it",
        folder.display()
    )]
    Taken { folder: PathBuf, found: String },
    #[error(
        "{}: holds `{found}`, which another kind of run wrote; name another --out, or pass --force to put the new results in the place of \
         the old ones",
        folder.display()
    )]
    OtherKind { folder: PathBuf, found: String },
    #[error(
        "{}: `{found}` was changed since granchain wrote it, so it is kept, with --force too; move it elsewhere or rename it, or name \
         another --out",
        folder.display()
    )]
    Altered { folder: PathBuf, found: String },
    #[error(
        "{}:{line}: `{found}`: not a list that granchain wrote; nothing was changed; name another --out",
        path.display()
    )]
    DamagedList { path: PathBuf, line: usize, found: String },
    #[error("{}: expected a folder, found a file; name another --out", path.display())]
    NotAFolder { path: PathBuf },
    #[error(
        "{}: an unfinished run is kept there; pass --resume to continue it, or --force to drop it and start again",
        path.display()
    )]
    Unfinished { path: PathBuf },
    #[error(
        "{}: --resume found no unfinished run there; {}start it without --resume", path.display(),
        stands.as_ref().map(|place| format!("finished results stand in {} already; to make them again, ", place.display())).unwrap_or_default()
    )]
    NothingToResume { path: PathBuf, stands: Option<PathBuf> },
    #[error(
        "{}: expected an unfinished run of `{expected}`, found one of `{found}`; resume it with that command, name another --out, or pass \
         --force without --resume to drop it",
        path.display()
    )]
    OtherCommand { path: PathBuf, expected: &'static str, found: String },
    #[error("{}: another run is writing there; wait for it, or name another --out", path.display())]
    InUse { path: PathBuf },
    #[error(
        "{}: expected a folder or file that granchain made, found a symbolic link; nothing was touched: remove the link, or name another --out",
        path.display()
    )]
    Link { path: PathBuf },
    #[error("{}: the file was written and then removed by another program; run again", path.display())]
    Vanished { path: PathBuf },
    #[error("{}: the finished results are kept there; they could not be moved to the --out folder", place.display())]
    Unpublished { place: PathBuf, source: Box<OutputError> },
    #[error("{}: cannot {action}: {source}", path.display())]
    Io { action: &'static str, path: PathBuf, source: io::Error },
}

impl OutputError {
    pub(crate) fn io<'a>(action: &'static str, path: &'a Path) -> impl FnOnce(io::Error) -> Self + use<'a> {
        move |source| Self::Io { action, path: path.into(), source }
    }
}

/// Write `bytes` to `path` so that a reader sees the old file or the new one, never a part: temporary file, fsync,
/// rename.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    written_atomically(path, |file| file.write_all(bytes).map_err(OutputError::io("write", path)))
}

/// Bytes gathered before they go to a file.
const BUFFER: usize = 1 << 16;

/// The same of what `make` writes.
pub fn written_atomically<E: From<OutputError>>(
    path: &Path,
    make: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<(), E> {
    written(path, true, make)
}

/// The same, or an error instead of it where there is such a file and it is not to be replaced.
fn written<E: From<OutputError>>(
    path: &Path,
    replace: bool,
    make: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<(), E> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(work::PART);
    #[cfg(unix)]
    {
        // rw-rw-rw- less the umask: results are for colleagues too.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let made = Staged::made(|| builder.tempfile_in(folder), |file| (file.path().into(), Vec::new(), false));
    let (mut file, _staged) = made.map_err(OutputError::io("create a file", folder))?;
    let mut buffered = io::BufWriter::with_capacity(BUFFER, &mut file);
    make(&mut buffered)?;
    buffered.flush().map_err(OutputError::io("write", path))?;
    drop(buffered);
    file.as_file().sync_all().map_err(OutputError::io("write", path))?;
    let persisted = match replace {
        true => file.persist(path),
        // A file system may have no way to rename unless there is such a file.
        false => file.persist_noclobber(path).or_else(|failed| match failed.error.kind() {
            io::ErrorKind::AlreadyExists => Err(failed),
            _ => failed.file.persist(path),
        }),
    };
    persisted.map_err(|error| OutputError::Io { action: "rename to", path: path.into(), source: error.error })?;
    sync_folder(folder);
    Ok(())
}

/// A folder for files that nobody keeps.
pub fn scratch() -> io::Result<Scratch> {
    let (folder, staged) = Staged::made(tempfile::tempdir, |folder| (folder.path().into(), Vec::new(), false))?;
    Ok(Scratch { folder, _staged: staged })
}

/// A folder that goes with the value.
pub struct Scratch {
    folder: tempfile::TempDir,
    _staged: Staged,
}

impl Scratch {
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

/// Refuse to write a file that is there, or a link that leads nowhere; `how` another is named, such as ` with --out`.
pub fn refuse_existing(path: &Path, how: &str) -> anyhow::Result<()> {
    if path.symlink_metadata().is_ok() { Err(existing(path, how)) } else { Ok(()) }
}

fn existing(path: &Path, how: &str) -> anyhow::Error {
    anyhow::anyhow!("{}: the file exists; name another{how}, or delete it first", path.display())
}

/// Write a file that is not there yet, whole or not at all; `what` it is, such as `the scene file `.
pub fn write_new(path: &Path, bytes: &[u8], what: &str, how: &str) -> anyhow::Result<()> {
    refuse_existing(path, how)?;
    match written(path, false, |file| file.write_all(bytes).map_err(OutputError::io("write", path))) {
        Err(OutputError::Io { source, .. }) if source.kind() == io::ErrorKind::AlreadyExists => {
            Err(existing(path, how))
        }
        Err(OutputError::Io { source, .. }) => {
            Err(source).with_context(|| format!("{}: {what}cannot be written", path.display()))
        }
        written => Ok(written?),
    }
}

/// Make a rename survive a power cut; file systems that cannot sync a folder are left alone.
fn sync_folder(folder: &Path) {
    if let Ok(handle) = fs::File::open(folder) {
        let _ = handle.sync_all();
    }
}

/// Text for people as this stream shows it.
pub fn shown_on(stream: &Term, text: &str) -> String {
    let text = visible(text);
    columns_of(stream).map_or_else(|| text.clone().into_owned(), |columns| broken(&text, columns, &super::program()))
}

/// What clears the line of a progress bar, on a terminal.
pub fn line_cleared() -> &'static str {
    if Term::stderr().is_term() { "\r\x1b[K" } else { "" }
}

/// Write to standard output, as it is.
pub fn print(text: impl std::fmt::Display) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    write!(out, "{text}")?;
    out.flush()?;
    Ok(())
}

/// Whether the error is a closed pipe (`granchain … | head`).
pub fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .any(|cause| cause.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe))
}
