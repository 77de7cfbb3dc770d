//! Folders that hold a page: its files, the times, and the command line that makes it again.

use super::OutputFolder;
use crate::{
    cli::{
        arguments::Session,
        timing::{self, Timing},
    },
    measurement::shell_word,
    report::page::Files,
};

/// Overrides as one types them.
pub fn set_flags(sets: &[String]) -> String {
    sets.iter().map(|set| format!(" --set {}", shell_word(set))).collect()
}

/// Keep the files of a page and the time it took.
pub fn publish(folder: OutputFolder, files: Files, mut timing: Timing, session: &Session) -> anyhow::Result<()> {
    folder.write_all(files)?;
    timing.stage("write");
    folder.write(timing::FILE, timing.to_json())?;
    session.note(format_args!("written to {}", folder.finish()?.display()));
    Ok(())
}
