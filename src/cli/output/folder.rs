//! A folder of results, staged.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use super::{OutputError, sync_folder, write_atomically};

/// Name of the list of files that granchain wrote into a finished folder.
const LIST: &str = ".granchain";

/// Staged folders that go when the process is stopped by force.
static STAGED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Remove every staged folder of this process; for the second Ctrl-C.
pub fn remove_staged() {
    for path in STAGED.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        let _ = fs::remove_dir_all(path);
    }
}

/// A folder of results in the making: write into [`path`](Self::path), then [`finish`](Self::finish).
///
/// Dropped unfinished, a staged folder is removed with any parent it had to create; a resumable one is kept.
///
/// ```
/// # use granchain::cli::output::OutputFolder;
/// # let place = tempfile::tempdir().unwrap();
/// let target = place.path().join("run1");
/// let folder = OutputFolder::stage(&target, false)?;
/// folder.write("summary.json", b"{}")?;
/// assert!(!target.exists());
/// folder.finish()?;
/// assert!(target.join("summary.json").exists());
/// # Ok::<(), granchain::cli::output::OutputError>(())
/// ```
#[derive(Debug)]
pub struct OutputFolder {
    target: PathBuf,
    staged: PathBuf,
    force: bool,
    kept: bool,
    /// Parents created on the way, outermost first.
    created: Vec<PathBuf>,
    /// Held while the folder is in the making; never read.
    lock: Option<fs::File>,
}

impl OutputFolder {
    /// Stage `target`: nothing is left of it unless it is finished.
    ///
    /// # Errors
    /// When `target` is a file, holds foreign files (unless `force`), or cannot be written.
    pub fn stage(target: &Path, force: bool) -> Result<Self, OutputError> {
        let target = absolute(target)?;
        refuse_foreign(&target, force)?;
        let created = create_parents(&target)?;
        let staged = beside(&target, &format!("partial-{}", std::process::id()));
        let folder = Self { target, staged, force, kept: false, created, lock: None };
        fs::create_dir(&folder.staged).map_err(OutputError::io("create the folder", &folder.staged))?;
        STAGED.lock().unwrap_or_else(PoisonError::into_inner).push(folder.staged.clone());
        Ok(folder)
    }

    /// Make `target` in a folder `.NAME.unfinished` beside it that survives Ctrl-C and kill −9.
    ///
    /// With `resume` the state found there is taken up; without, finding one is an error unless `force` drops it. Work
    /// files that are not results go to [`state_path`](Self::state_path), which `finish` removes.
    ///
    /// # Errors
    /// As [`stage`](Self::stage), and when there is something to resume but no `resume`, or the other way round.
    pub fn resumable(target: &Path, resume: bool, force: bool) -> Result<Self, OutputError> {
        let target = absolute(target)?;
        refuse_foreign(&target, force)?;
        let staged = beside(&target, "unfinished");
        match (staged.exists(), resume) {
            (true, false) if !force => return Err(OutputError::Unfinished { path: staged }),
            (false, true) => return Err(OutputError::NothingToResume { path: staged }),
            _ => {}
        }
        let created = create_parents(&target)?;
        let mut folder = Self { target, staged, force, kept: true, created, lock: None };
        let state = folder.state_path();
        fs::create_dir_all(&state).map_err(OutputError::io("create the folder", &state))?;
        folder.lock = Some(lock(&state.join("lock"), &folder.staged)?);
        folder.clear_results()?;
        if !resume {
            folder.clear_state()?;
        }
        Ok(folder)
    }

    /// Where to write now.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.staged
    }

    /// Where the results will be.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Folder of work files that are no results.
    #[must_use]
    pub fn state_path(&self) -> PathBuf {
        self.staged.join("state")
    }

    /// Write one file, whole, in a subfolder if its name has one; returns where it is now.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn write(&self, name: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> Result<PathBuf, OutputError> {
        let path = self.staged.join(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(OutputError::io("create the folder", parent))?;
        }
        write_atomically(&path, bytes.as_ref())?;
        Ok(path)
    }

    /// Drop a resumable folder that failed for good instead of keeping it.
    pub fn discard(mut self) {
        self.kept = false;
    }

    /// Move the results to their place and return it, relative to the current folder where it lies below.
    ///
    /// # Errors
    /// [`OutputError::Io`]; the earlier results are then still there.
    pub fn finish(self) -> Result<PathBuf, OutputError> {
        let state = self.state_path();
        if state.exists() {
            fs::remove_dir_all(&state).map_err(OutputError::io("remove", &state))?;
        }
        let mut files = files_below(&self.staged)?;
        files.retain(|file| file != LIST);
        write_atomically(&self.staged.join(LIST), format!("{}\n", files.join("\n")).as_bytes())?;
        refuse_foreign(&self.target, self.force)?;
        let stays = foreign(&self.target)?.is_some() || std::env::current_dir().is_ok_and(|here| here == self.target);
        if !self.target.exists() {
            fs::rename(&self.staged, &self.target).map_err(OutputError::io("rename to", &self.target))?;
        } else if stays {
            self.move_in(files)?;
        } else {
            self.swap()?;
        }
        if let Some(parent) = self.target.parent() {
            sync_folder(parent);
        }
        Ok(relative(&self.target))
    }

    /// Replace an earlier output of ours as a whole.
    fn swap(&self) -> Result<(), OutputError> {
        let old = beside(&self.target, &format!("old-{}", std::process::id()));
        fs::rename(&self.target, &old).map_err(OutputError::io("move away", &self.target))?;
        if let Err(source) = fs::rename(&self.staged, &self.target) {
            let _ = fs::rename(&old, &self.target);
            return Err(OutputError::Io { action: "rename to", path: self.target.clone(), source });
        }
        fs::remove_dir_all(&old).map_err(OutputError::io("remove", &old))
    }

    /// Move the results into a folder that keeps its other files; what an earlier run wrote there goes.
    fn move_in(&self, files: Vec<String>) -> Result<(), OutputError> {
        for file in listed(&self.target).into_iter().filter(|file| !files.contains(file)) {
            let path = self.target.join(file);
            if path.is_file() {
                fs::remove_file(&path).map_err(OutputError::io("remove", &path))?;
            }
        }
        for file in files.iter().map(String::as_str).chain([LIST]) {
            let (from, to) = (self.staged.join(file), self.target.join(file));
            if let Some(parent) = to.parent() {
                fs::create_dir_all(parent).map_err(OutputError::io("create the folder", parent))?;
            }
            fs::rename(&from, &to).map_err(OutputError::io("rename to", &to))?;
        }
        fs::remove_dir_all(&self.staged).map_err(OutputError::io("remove", &self.staged))
    }

    /// Drop the results a run was writing when it was stopped: the next may write others.
    fn clear_results(&self) -> Result<(), OutputError> {
        let state = self.state_path();
        for entry in entries(&self.staged)?.into_iter().filter(|path| *path != state) {
            remove(&entry)?;
        }
        Ok(())
    }

    /// Drop what an earlier run saved, but for the lock.
    fn clear_state(&self) -> Result<(), OutputError> {
        let state = self.state_path();
        for entry in entries(&state)?.into_iter().filter(|path| *path != state.join("lock")) {
            remove(&entry)?;
        }
        Ok(())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        STAGED.lock().unwrap_or_else(PoisonError::into_inner).retain(|path| *path != self.staged);
        if self.kept || self.target.exists() && !self.staged.exists() {
            return;
        }
        let _ = fs::remove_dir_all(&self.staged);
        for parent in self.created.iter().rev() {
            // Only an empty one goes.
            let _ = fs::remove_dir(parent);
        }
    }
}

/// An exclusive lock that the system releases when the process ends, however it ends.
fn lock(path: &Path, folder: &Path) -> Result<fs::File, OutputError> {
    let file = fs::File::create(path).map_err(OutputError::io("create", path))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(fs::TryLockError::WouldBlock) => Err(OutputError::InUse { path: folder.into() }),
        Err(fs::TryLockError::Error(source)) => Err(OutputError::Io { action: "lock", path: path.into(), source }),
    }
}

/// A path as a person would give it: relative where it lies below the current folder.
fn relative(path: &Path) -> PathBuf {
    let here = std::env::current_dir().ok();
    let below = here.and_then(|here| path.strip_prefix(here).ok().map(Path::to_path_buf));
    below.filter(|path| !path.as_os_str().is_empty()).unwrap_or_else(|| path.to_path_buf())
}

/// `target` from the root, without `.` or `..` at its end.
fn absolute(target: &Path) -> Result<PathBuf, OutputError> {
    if target.exists() { fs::canonicalize(target) } else { std::path::absolute(target) }
        .map_err(OutputError::io("find", target))
}

/// `.NAME.suffix` in the folder of `target`.
fn beside(target: &Path, suffix: &str) -> PathBuf {
    let name = target.file_name().map_or_else(|| "output".into(), |name| name.to_string_lossy().into_owned());
    target.with_file_name(format!(".{name}.{suffix}"))
}

fn create_parents(target: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let mut missing: Vec<PathBuf> =
        target.ancestors().skip(1).take_while(|path| !path.exists()).map(Path::to_path_buf).collect();
    missing.reverse();
    if let Some(parent) = target.parent() {
        fs::create_dir_all(parent).map_err(OutputError::io("create the folder", parent))?;
    }
    Ok(missing)
}

fn refuse_foreign(target: &Path, force: bool) -> Result<(), OutputError> {
    if target.exists() && !target.is_dir() {
        return Err(OutputError::NotAFolder { path: target.into() });
    }
    match foreign(target)? {
        Some(found) if !force => Err(OutputError::Foreign { folder: target.into(), found }),
        _ => Ok(()),
    }
}

/// The first file below `target` that no earlier run of ours listed.
fn foreign(target: &Path) -> Result<Option<String>, OutputError> {
    if !target.exists() {
        return Ok(None);
    }
    let ours = listed(target);
    Ok(files_below(target)?.into_iter().find(|file| file != LIST && !ours.contains(file)))
}

fn listed(target: &Path) -> Vec<String> {
    fs::read_to_string(target.join(LIST)).map(|text| text.lines().map(str::to_owned).collect()).unwrap_or_default()
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let mut paths = fs::read_dir(folder)
        .and_then(|entries| entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>())
        .map_err(OutputError::io("read the folder", folder))?;
    paths.sort();
    Ok(paths)
}

fn remove(path: &Path) -> Result<(), OutputError> {
    if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) }
        .map_err(OutputError::io("remove", path))
}

/// Every file below `folder`, relative, with `/`, sorted.
fn files_below(folder: &Path) -> Result<Vec<String>, OutputError> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(place) = open.pop() {
        for path in entries(&place)? {
            if path.is_dir() && !path.is_symlink() {
                open.push(path);
            } else if let Ok(relative) = path.strip_prefix(folder) {
                let parts: Vec<_> = relative.iter().map(|part| part.to_string_lossy()).collect();
                found.push(parts.join("/"));
            }
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failed_run_leaves_nothing_behind_not_even_new_parents() {
        let place = tempfile::tempdir().unwrap();
        let folder = OutputFolder::stage(&place.path().join("a/b/run"), false).unwrap();
        folder.write("x.csv", b"1").unwrap();
        drop(folder);
        assert!(names(place.path()).is_empty());
    }

    #[test]
    fn an_earlier_output_is_replaced_whole() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("run");
        for file in ["old.csv", "new.csv"] {
            let folder = OutputFolder::stage(&target, false).unwrap();
            folder.write(file, b"1").unwrap();
            folder.finish().unwrap();
        }
        assert_eq!(names(&target), [".granchain", "new.csv"]);
        assert_eq!(names(place.path()), ["run"]);
    }

    #[test]
    fn foreign_files_are_refused_and_survive_force() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("run");
        fs::create_dir(&target).unwrap();
        fs::write(target.join("thesis.tex"), "years of work").unwrap();
        assert!(matches!(OutputFolder::stage(&target, false), Err(OutputError::Foreign { .. })));
        let folder = OutputFolder::stage(&target, true).unwrap();
        folder.write("x.csv", b"1").unwrap();
        folder.finish().unwrap();
        assert_eq!(names(&target), [".granchain", "thesis.tex", "x.csv"]);
        assert_eq!(names(place.path()), ["run"]);
    }

    #[test]
    fn a_resumable_folder_is_kept_found_again_and_guarded() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("run");
        assert!(matches!(OutputFolder::resumable(&target, true, false), Err(OutputError::NothingToResume { .. })));
        let folder = OutputFolder::resumable(&target, false, false).unwrap();
        fs::write(folder.state_path().join("runs.jsonl"), "{}\n").unwrap();
        assert!(matches!(OutputFolder::resumable(&target, true, false), Err(OutputError::InUse { .. })));
        drop(folder);
        assert!(matches!(OutputFolder::resumable(&target, false, false), Err(OutputError::Unfinished { .. })));
        let folder = OutputFolder::resumable(&target, true, false).unwrap();
        assert!(folder.state_path().join("runs.jsonl").exists());
        folder.write("x.csv", b"1").unwrap();
        folder.finish().unwrap();
        assert_eq!(names(&target), [".granchain", "x.csv"]);
        assert_eq!(names(place.path()), ["run"]);
    }

    #[test]
    fn a_file_is_no_folder() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("run");
        fs::write(&target, "x").unwrap();
        assert!(matches!(OutputFolder::stage(&target, true), Err(OutputError::NotAFolder { .. })));
    }
}
