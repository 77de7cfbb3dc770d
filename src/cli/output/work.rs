//! The hidden folder beside a target in which one run works: `results`, and `state` where the work can be continued.
//!
//! Its `lock` is a file lock, which the system drops with the process, however that ends: so the next run for the same target can tell what a
//! dead one left from what a live one is writing, in this container or another, and sweeps it.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use super::{OutputError, list::entries};

/// Names in a work folder.
pub const LOCK: &str = "lock";
pub const RESULTS: &str = "results";
pub const STATE: &str = "state";
/// An earlier output, for the instant in which the new one takes its place where names cannot be exchanged.
pub const OLD: &str = "old";
/// A state that is to be removed.
pub const DROPPED: &str = "dropped";
/// The list that holds while files are moved in.
pub const BOTH: &str = "both";

/// Begin of the name of a file that is being written.
pub const PART: &str = ".granchain-";

/// Tries to make a folder that no sweep of another process takes away.
const TRIES: usize = 16;

/// `.NAME.suffix` in the folder of `target`.
pub fn beside(target: &Path, suffix: &str) -> PathBuf {
    let name = target.file_name().map_or_else(|| "output".into(), |name| name.to_string_lossy().into_owned());
    target.with_file_name(format!(".{name}.{suffix}"))
}

/// A new empty folder `.NAME.KIND-RANDOM`.
pub fn random(target: &Path, kind: &str) -> Result<PathBuf, OutputError> {
    let prefix = beside(target, &format!("{kind}-"));
    let parent = target.parent().unwrap_or(Path::new("."));
    let made = tempfile::Builder::new().prefix(prefix.file_name().unwrap_or_default()).tempdir_in(parent);
    Ok(made.map_err(OutputError::io("create a folder", parent))?.keep())
}

/// A new work folder `.NAME.partial-RANDOM`, locked.
pub fn partial(target: &Path) -> Result<(PathBuf, fs::File), OutputError> {
    for _ in 0..TRIES {
        let work = random(target, "partial")?;
        if let Some(lock) = lock(&work)? {
            return Ok((work, lock));
        }
    }
    Err(OutputError::InUse { path: target.into() })
}

/// Refuse a symbolic link at `path` or anywhere below it: it could lead the run to files that are not ours.
pub fn refuse_links(path: &Path) -> Result<(), OutputError> {
    match fs::symlink_metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(source) => Err(OutputError::io("read", path)(source)),
        Ok(found) if found.is_symlink() => Err(OutputError::Link { path: path.into() }),
        Ok(found) if found.is_dir() => entries(path)?.iter().try_for_each(|path| refuse_links(path)),
        Ok(_) => Ok(()),
    }
}

/// Lock a work folder; `None` where another process has it, or has just taken it away.
pub fn lock(work: &Path) -> Result<Option<fs::File>, OutputError> {
    let path = work.join(LOCK);
    let mut options = fs::File::options();
    options.create(true).truncate(false).write(true);
    #[cfg(any(target_os = "linux", target_vendor = "apple"))]
    {
        use std::os::unix::fs::OpenOptionsExt;
        options.custom_flags(rustix::fs::OFlags::NOFOLLOW.bits().cast_signed());
    }
    let file = match options.open(&path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(OutputError::io("create", &path)(source)),
    };
    match file.try_lock() {
        Ok(()) => Ok(is_at(&file, &path).then_some(file)),
        Err(fs::TryLockError::WouldBlock) => Ok(None),
        Err(fs::TryLockError::Error(source)) => Err(OutputError::io("lock", &path)(source)),
    }
}

/// Whether the open file still is the one of that name.
#[cfg(unix)]
fn is_at(file: &fs::File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |file: &fs::Metadata| (file.dev(), file.ino());
    matches!((file.metadata(), fs::metadata(path)), (Ok(ref open), Ok(ref named)) if identity(open) == identity(named))
}

#[cfg(not(unix))]
fn is_at(_: &fs::File, path: &Path) -> bool {
    path.exists()
}

/// Remove a work folder whose lock is held: the lock last, so that the rest can still be recognised.
pub fn remove(work: &Path) -> Result<(), OutputError> {
    let lock = work.join(LOCK);
    for path in entries(work)?.into_iter().filter(|path| *path != lock) {
        remove_all(&path)?;
    }
    remove_all(&lock)?;
    instant();
    fs::remove_dir(work).map_err(OutputError::io("remove", work))
}

/// Remove what the path names, if it is there; a link, not what it leads to.
pub fn remove_all(path: &Path) -> Result<(), OutputError> {
    instant();
    let removed = match fs::symlink_metadata(path) {
        Ok(found) if found.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(error) => Err(error),
    };
    match removed {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        removed => removed.map_err(OutputError::io("remove", path)),
    }
}

/// Remove parents created on the way, if nothing is in them.
pub fn remove_empty(created: &[PathBuf]) {
    for parent in created.iter().rev() {
        let _ = fs::remove_dir(parent);
    }
}

/// Remove the work folders for `target` that dead processes left. What cannot be removed stays: it does no harm.
pub fn sweep(target: &Path) {
    let prefix = beside(target, "partial-");
    let (Some(parent), Some(prefix)) = (target.parent(), prefix.file_name().and_then(|name| name.to_str())) else {
        return;
    };
    let is_left = |path: &PathBuf| {
        let rest = path.file_name().and_then(|name| name.to_str()?.strip_prefix(prefix));
        rest.is_some_and(|rest| rest.bytes().all(|byte| byte.is_ascii_alphanumeric())) && !path.is_symlink()
    };
    let is_known = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        [LOCK, RESULTS, STATE, OLD, DROPPED, BOTH].contains(&name) || name.starts_with(PART)
    };
    for work in entries(parent).unwrap_or_default().iter().filter(|path| is_left(path)) {
        let Ok(found) = entries(work) else { continue };
        if found.is_empty() {
            // Fails where a run just begins in it.
            let _ = fs::remove_dir(work);
        } else if work.join(LOCK).is_file()
            && found.iter().all(is_known)
            && refuse_links(work).is_ok()
            && let Ok(Some(_held)) = lock(work)
        {
            let _ = put_back(work, target).and_then(|()| remove(work));
        }
    }
}

/// Put an earlier output back that was moved away for a new one which never came.
pub fn put_back(work: &Path, target: &Path) -> Result<(), OutputError> {
    let old = work.join(OLD);
    match old.exists() && !target.exists() {
        true => rename(&old, target),
        false => remove_all(&old),
    }
}

pub fn rename(from: &Path, to: &Path) -> Result<(), OutputError> {
    instant();
    fs::rename(from, to).map_err(OutputError::io("rename to", to))
}

/// Put the folder `new` in the place of the folder `target`, which is left in the work folder: at once where the system can exchange two
/// names, else in two steps between which [`put_back`] helps.
pub fn replace(work: &Path, new: &Path, target: &Path) -> Result<(), OutputError> {
    instant();
    if exchange(new, target).is_ok() {
        return Ok(());
    }
    let old = work.join(OLD);
    rename(target, &old)?;
    rename(new, target).inspect_err(|_| {
        let _ = fs::rename(&old, target);
    })
}

#[cfg(any(target_os = "linux", target_vendor = "apple"))]
fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    #[cfg(test)]
    if std::env::var_os(super::folder::tests::NO_EXCHANGE).is_some() {
        return Err(io::ErrorKind::Unsupported.into());
    }
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_vendor = "apple")))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Between two changes on disk: here tests end the process.
#[cfg(not(test))]
pub fn instant() {}
#[cfg(test)]
pub use super::folder::tests::instant;
