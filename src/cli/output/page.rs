//! Folders that hold a page: its files, the times, and the command line that makes it again.

use super::OutputFolder;
use crate::{
    cli::{
        arguments::Session,
        interrupt,
        timing::{self, Timing},
    },
    measurement::shell_word,
    report::page::Files,
};

/// Overrides as one types them.
#[must_use]
pub fn set_flags(sets: &[String]) -> String {
    sets.iter().map(|set| format!(" --set {}", shell_word(set))).collect()
}

/// Keep the files of a page and the time it took.
///
/// # Errors
/// A folder that cannot be written; Ctrl-C.
pub fn publish(folder: OutputFolder, files: Files, mut timing: Timing, session: &Session) -> anyhow::Result<()> {
    for (name, bytes) in files {
        folder.write(name, bytes)?;
        interrupt::check()?;
    }
    timing.stage("write");
    folder.write(timing::FILE, timing.to_json())?;
    session.note(format_args!("written to {}", folder.finish()?.display()));
    Ok(())
}
