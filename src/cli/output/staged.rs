//! What is in the making: a signal that ends the process leaves nothing of it but states that can be resumed.

use std::{
    fmt::Write,
    path::PathBuf,
    sync::{Mutex, MutexGuard, PoisonError},
};

use super::{
    folder::is_saved,
    work::{STATE, remove_all, remove_empty},
};

/// A file or folder in the making.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Entry {
    path: PathBuf,
    /// Parents created on the way, outermost first.
    created: Vec<PathBuf>,
    /// Whether a state in it outlives the process.
    resumable: bool,
}

static STAGED: Mutex<Vec<Entry>> = Mutex::new(Vec::new());

/// Held while results go to their place; whether they stand there.
static PUBLISHED: Mutex<bool> = Mutex::new(false);

/// Tries to remove a folder into which a thread still writes.
const TRIES: usize = 5;

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Registers what is in the making until it is dropped.
#[derive(Debug)]
pub struct Staged(Entry);

impl Staged {
    /// Make something and register it, with no signal in between. `named`: where it is, the parents created for it, and whether a state in
    /// it outlives the process.
    pub fn made<T, E>(
        make: impl FnOnce() -> Result<T, E>,
        named: impl FnOnce(&T) -> (PathBuf, Vec<PathBuf>, bool),
    ) -> Result<(T, Self), E> {
        let mut staged = locked(&STAGED);
        let made = make()?;
        let (path, created, resumable) = named(&made);
        let entry = Entry { path, created, resumable };
        staged.push(entry.clone());
        Ok((made, Self(entry)))
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        locked(&STAGED).retain(|entry| *entry != self.0);
    }
}

/// Put results in their place, with no signal in between.
pub fn publishing<T, E>(publish: impl FnOnce() -> Result<T, E>) -> Result<T, E> {
    let mut published = locked(&PUBLISHED);
    let done = publish()?;
    *published = true;
    Ok(done)
}

/// Remove what is in the making, for a process that ends now: what makes more of it waits from here on. Returns what to say of the rest, or nothing
/// and leaves all as it is where results stand already and are `respected`.
pub fn abandon(respected: bool) -> Option<String> {
    let published = locked(&PUBLISHED);
    if *published && respected {
        return None;
    }
    let staged = locked(&STAGED);
    let mut kept = String::new();
    for Entry { path, created, resumable } in staged.iter() {
        if *resumable && is_saved(&path.join(STATE)).unwrap_or(true) {
            // Writing to a String cannot fail.
            let _ = writeln!(
                kept,
                "what is finished is kept in {}; continue with the same command and --resume",
                path.display()
            );
        } else if (0..TRIES).any(|_| remove_all(path).is_ok()) {
            remove_empty(created);
        }
    }
    // The process ends with both held.
    std::mem::forget((published, staged));
    Some(kept)
}
