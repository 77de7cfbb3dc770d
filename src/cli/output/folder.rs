//! A folder of results, staged.

use std::{
    convert::Infallible,
    fs, io,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, PoisonError},
};

use super::{
    OutputError,
    list::{LIST, List, Standing, digest, digest_of_file, entries, files_below, is_plain},
    staged::{Staged, publishing},
    sync_folder,
    work::{
        BOTH, DROPPED, PART, RESULTS, STATE, beside, instant, lock, partial, put_back, random, refuse_links, remove,
        remove_all, remove_empty, rename, replace, sweep,
    },
    write_atomically, written_atomically,
};
use crate::{
    cli::interrupt,
    measurement::read_back::{LARGE, SMALL, read_back},
    report::page::Files,
};

/// Longest name of a target, bytes: of `.NAME.partial-RANDOM` file systems take 255.
const LONGEST_NAME: usize = 230;

/// Name of the file in a state that says which command it is of.
const COMMAND: &str = "command";

/// Name of the file in a state that says what decides its results.
pub const PLAN: &str = "plan.json";

/// What to say where a state to resume holds nothing yet.
pub const NOTHING_SAVED: &str = "nothing was saved before the run was stopped; it starts again";

/// A folder of results in the making: [`write`](Self::write) into it, then [`finish`](Self::finish).
///
/// Dropped unfinished, a staged folder is removed with any parent it had to create; a resumable one is kept.
#[derive(Debug)]
pub struct OutputFolder {
    target: PathBuf,
    work: PathBuf,
    force: bool,
    /// Whether it survives the process.
    resumable: bool,
    /// Whether it holds what an earlier run saved.
    resumed: bool,
    kept: bool,
    /// Parents created on the way, outermost first.
    created: Vec<PathBuf>,
    /// The files written so far; `None` before the first.
    written: Mutex<Option<List>>,
    /// Held while the folder is in the making.
    lock: fs::File,
    /// Registered until it is dropped.
    _staged: Staged,
}

impl OutputFolder {
    /// Stage `target`: nothing is left of it unless it is finished. `names` are files known to be written.
    ///
    /// # Errors
    /// When `target` is a file, holds foreign files (unless `force`) or one by such a name, or files of ours that were changed since; when it
    /// cannot be written.
    pub fn stage(target: &Path, names: &[&str], force: bool) -> Result<Self, OutputError> {
        let (target, _) = admitted(target, names, force)?;
        let created = create_parents(&target)?;
        sweep(&target);
        let made = Staged::made(|| partial(&target), |(work, _)| (work.clone(), created.clone(), false));
        let ((work, lock), staged) = made.inspect_err(|_| remove_empty(&created))?;
        let (resumable, resumed, kept, written) = (false, false, false, Mutex::new(None));
        Ok(Self { target, work, force, resumable, resumed, kept, created, written, lock, _staged: staged })
    }

    /// Make `target` in a folder `.NAME.unfinished` beside it that survives Ctrl-C and kill −9.
    ///
    /// With `resume` the state that the same `command` saved there is taken up; without, finding one is an error unless `force` drops it. Work
    /// files that are not results go to [`state_path`](Self::state_path), which `finish` removes once the results stand. A refusal leaves
    /// everything as it was.
    ///
    /// # Errors
    /// As [`stage`](Self::stage), and when there is something to resume but no `resume`, or the other way round, or that of another command;
    /// a symbolic link at the folder or anywhere in it.
    pub fn resumable(
        target: &Path,
        names: &[&str],
        command: &'static str,
        resume: bool,
        force: bool,
    ) -> Result<Self, OutputError> {
        let (target, standing) = admitted(target, names, force)?;
        let work = beside(&target, "unfinished");
        refuse_links(&work)?;
        if resume && !work.exists() {
            let stands = if standing.ours.is_empty() { None } else { Some(relative(&target)) };
            return Err(OutputError::NothingToResume { path: work, stands });
        }
        let state = work.join(STATE);
        let refuse = || match is_saved(&state)? {
            true if resume => same_command(&state, command),
            true if !force => Err(OutputError::Unfinished { path: work.clone() }),
            _ => Ok(()),
        };
        refuse()?;
        let created = create_parents(&target)?;
        fs::create_dir_all(&work).map_err(OutputError::io("create the folder", &work))?;
        let Some(lock) = lock(&work)? else { return Err(OutputError::InUse { path: work }) };
        // Another run may have worked there until now.
        refuse_links(&work)?;
        refuse()?;
        sweep(&target);
        put_back(&work, &target)?;
        let resumed = resume && is_saved(&state)?;
        if !resumed {
            begin_state(&work, command)?;
        }
        let Ok::<_, Infallible>((_, _staged)) = Staged::made(|| Ok(()), |()| (work.clone(), created.clone(), true));
        let written = Mutex::new(None);
        Ok(Self { target, work, force, resumable: true, resumed, kept: true, created, written, lock, _staged })
    }

    /// Where the work lies until it is finished.
    pub fn path(&self) -> &Path {
        &self.work
    }

    /// Where the results will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Folder of work files that are no results.
    pub fn state_path(&self) -> PathBuf {
        self.work.join(STATE)
    }

    /// Whether there is something that an earlier run saved.
    pub fn is_resumed(&self) -> bool {
        self.resumed
    }

    /// Write one file, whole, in a subfolder if its name has one; returns where it is now.
    ///
    /// # Errors
    /// [`OutputError::Io`].
    pub fn write(&self, name: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> Result<PathBuf, OutputError> {
        let bytes = bytes.as_ref();
        self.put(name.as_ref(), |name, path| {
            write_atomically(path, bytes)?;
            Ok(digest(name, bytes))
        })
    }

    /// Write the files of a page, until Ctrl-C.
    pub fn write_all(&self, files: Files) -> anyhow::Result<()> {
        for (name, bytes) in files {
            self.write(name, bytes)?;
            interrupt::check()?;
        }
        Ok(())
    }

    /// Write one file as it comes, whole, as of [`write`](Self::write).
    ///
    /// # Errors
    /// [`OutputError::Io`]; those of `make`.
    pub fn write_as_it_comes(
        &self,
        name: impl AsRef<Path>,
        make: impl FnOnce(&mut dyn io::Write) -> anyhow::Result<()>,
    ) -> anyhow::Result<PathBuf> {
        self.put(name.as_ref(), |name, path| {
            // Only a failure to write gets the path; other errors of `make` name their own place.
            let failed = |error: anyhow::Error| match error.downcast::<io::Error>() {
                Ok(error) => OutputError::io("write", path)(error).into(),
                Err(error) => error,
            };
            written_atomically(path, |file| make(file).map_err(failed))?;
            Ok(digest_of_file(name, path)?)
        })
    }

    fn put<E: From<OutputError>>(
        &self,
        name: &Path,
        make: impl FnOnce(&str, &Path) -> Result<String, E>,
    ) -> Result<PathBuf, E> {
        let path = self.work.join(RESULTS).join(name);
        let Some(name) = name.to_str().filter(|name| is_plain(name)) else {
            return Err(OutputError::io("write", &path)(io::ErrorKind::InvalidFilename.into()).into());
        };
        let mut written = self.written()?;
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).map_err(OutputError::io("create the folder", parent))?;
        }
        let digest = make(name, &path)?;
        if let Some(list) = written.as_mut() {
            list.add(name.into(), digest);
        }
        Ok(path)
    }

    /// The list of the files written; before the first, what a stopped run was writing is dropped.
    fn written(&self) -> Result<MutexGuard<'_, Option<List>>, OutputError> {
        let mut written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        if written.is_none() {
            let results = self.work.join(RESULTS);
            remove_all(&results)?;
            fs::create_dir(&results).map_err(OutputError::io("create the folder", &results))?;
            *written = Some(List::default());
        }
        Ok(written)
    }

    /// Whether the state holds anything that a later run could take up.
    pub fn is_saved(&self) -> bool {
        is_saved(&self.state_path()).unwrap_or(true)
    }

    /// Drop a resumable folder that failed for good instead of keeping it; one that was taken up is kept in any case.
    pub fn discard(mut self) {
        self.kept = self.resumed;
    }

    /// Move the results to their place, then drop the state, and return the place, relative to the current folder where it lies below.
    ///
    /// # Errors
    /// [`OutputError::Unpublished`]: the earlier results are then still there, and the new ones are kept beside them.
    pub fn finish(mut self) -> Result<PathBuf, OutputError> {
        if let Err(source) = publishing(|| self.seal().and_then(|list| self.publish(&list))) {
            let place = self.keep_results();
            return Err(OutputError::Unpublished { place, source: Box::new(source) });
        }
        if let Some(parent) = self.target.parent() {
            sync_folder(parent);
        }
        self.kept = false;
        // The results stand: parents stay, and what is left of the work is not worth an error.
        self.created.clear();
        Ok(relative(&self.target))
    }

    /// Leave nothing but the files written, and their list.
    fn seal(&self) -> Result<List, OutputError> {
        let list = self.written()?.clone().unwrap_or_default();
        let results = self.work.join(RESULTS);
        let found = files_below(&results)?;
        if let Some(gone) = list.names().find(|name| found.binary_search_by(|other| other.as_str().cmp(name)).is_err())
        {
            return Err(OutputError::Vanished { path: results.join(gone) });
        }
        for stray in found.iter().filter(|name| !list.contains(name)) {
            remove_all(&results.join(stray))?;
        }
        instant();
        write_atomically(&results.join(LIST), list.text().as_bytes())?;
        Ok(list)
    }

    fn publish(&self, list: &List) -> Result<(), OutputError> {
        let results = self.work.join(RESULTS);
        let standing = Standing::of(&self.target)?;
        standing.refuse(&self.target, self.force, list.names())?;
        let inside = std::env::current_dir().is_ok_and(|here| here.starts_with(&self.target));
        if !self.target.exists() {
            rename(&results, &self.target)
        } else if inside || standing.foreign.is_some() {
            self.move_in(list, &standing)
        } else {
            replace(&self.work, &results, &self.target)
        }
    }

    /// Move the results into a folder that keeps its other files; what an earlier run wrote there goes.
    ///
    /// Meanwhile the list holds the old files and the new ones, so that at any instant each of them is known to be ours.
    fn move_in(&self, list: &List, standing: &Standing) -> Result<(), OutputError> {
        let (both, results) = (self.work.join(BOTH), self.work.join(RESULTS));
        let mut union = standing.list.clone();
        union.extend(list);
        write_atomically(&both, union.text().as_bytes())?;
        rename(&both, &self.target.join(LIST))?;
        for gone in standing.ours.iter().filter(|name| !list.contains(name)) {
            remove_all(&self.target.join(gone))?;
        }
        for name in list.names().chain([LIST]) {
            let to = self.target.join(name);
            if let Some(parent) = to.parent() {
                fs::create_dir_all(parent).map_err(OutputError::io("create the folder", parent))?;
            }
            rename(&results.join(name), &to)?;
        }
        sync_folder(&self.target);
        Ok(())
    }

    /// Keep finished results that could not be put in their place; returns where they are.
    fn keep_results(&mut self) -> PathBuf {
        let results = self.work.join(RESULTS);
        if !self.resumable {
            // Out of a folder that is swept.
            match random(&self.target, "kept").and_then(|kept| rename(&results, &kept).map(|()| kept)) {
                Ok(kept) => return kept,
                Err(_) => self.kept = true,
            }
        }
        results
    }

    /// Leave no unfinished folder behind.
    fn clear(&mut self) {
        if self.kept {
            return;
        }
        // A state goes at once or not at all: under a name that nobody resumes.
        if self.resumable {
            match random(&self.target, "partial").and_then(|away| rename(&self.work, &away).map(|()| away)) {
                Ok(away) => self.work = away,
                Err(_) => return,
            }
        }
        let _ = remove(&self.work);
        remove_empty(&self.created);
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        self.clear();
        // A process that another thread is just starting may share the open file: closing ours alone would leave the lock to it.
        let _ = self.lock.unlock();
    }
}

/// Whether a state holds anything to go on from: more than the names of its command and plan, empty logs and files that were never finished.
pub(super) fn is_saved(state: &Path) -> Result<bool, OutputError> {
    let passing = |name: &str| [COMMAND, PLAN].contains(&name) || name.starts_with(PART) || name.starts_with(".tmp");
    let is_empty = |path: &Path| path.metadata().is_ok_and(|found| found.is_file() && found.len() == 0);
    let holds =
        |path: &PathBuf| !is_empty(path) && !path.file_name().and_then(|name| name.to_str()).is_some_and(passing);
    Ok(state.exists() && entries(state)?.iter().any(holds))
}

/// Refuse the state of another command.
fn same_command(state: &Path, command: &'static str) -> Result<(), OutputError> {
    let path = state.join(COMMAND);
    let found = match read_back(&path, SMALL) {
        Ok(found) => String::from_utf8_lossy(&found).trim_end().chars().take(80).collect(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => "an unknown command".to_owned(),
        Err(source) => return Err(OutputError::io("read", &path)(source)),
    };
    if found == command {
        return Ok(());
    }
    Err(OutputError::OtherCommand { path: state.into(), expected: command, found: found.escape_debug().to_string() })
}

/// An empty state of `command` in the place of any other.
fn begin_state(work: &Path, command: &str) -> Result<(), OutputError> {
    let (state, dropped) = (work.join(STATE), work.join(DROPPED));
    remove_all(&dropped)?;
    if state.exists() {
        rename(&state, &dropped)?;
    }
    fs::create_dir(&state).map_err(OutputError::io("create the folder", &state))?;
    write_atomically(&state.join(COMMAND), format!("{command}\n").as_bytes())?;
    remove_all(&dropped)
}

/// Refuse to resume a run whose plan, everything that decides what its results are, is not the one kept at `path`.
pub fn same_plan(path: &Path, plan: &[u8], run: &str, decided_by: &str) -> anyhow::Result<()> {
    if read_back(path, LARGE).unwrap_or_default() == plan {
        return Ok(());
    }
    anyhow::bail!(
        "{}: the {run} to resume has another {decided_by} or program version; give the same flags, or start again with --force",
        path.display()
    )
}

/// A path as a person would give it: relative where it lies below the current folder.
fn relative(path: &Path) -> PathBuf {
    let here = std::env::current_dir().ok();
    let below = here.and_then(|here| path.strip_prefix(here).ok().map(Path::to_path_buf));
    below.filter(|path| !path.as_os_str().is_empty()).unwrap_or_else(|| path.to_path_buf())
}

/// `target` from the root and what stands there, if a run that writes `names` may go there.
fn admitted(target: &Path, names: &[&str], force: bool) -> Result<(PathBuf, Standing), OutputError> {
    let target = absolute(target)?;
    let standing = Standing::of(&target)?;
    standing.refuse_other_kind(&target, force, names)?;
    standing.refuse(&target, force, names.iter().copied())?;
    Ok((target, standing))
}

/// `target` from the root, without `.` or `..` at its end.
fn absolute(target: &Path) -> Result<PathBuf, OutputError> {
    let path = if target.exists() { fs::canonicalize(target) } else { std::path::absolute(target) }
        .map_err(OutputError::io("find", target))?;
    match path.file_name().map(|name| name.len()) {
        None => Err(OutputError::Root { path }),
        Some(found) if found > LONGEST_NAME => Err(OutputError::LongName { path, most: LONGEST_NAME, found }),
        Some(_) => Ok(path),
    }
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

#[cfg(test)]
pub(super) mod tests;
