//! Folders that hold a page: its files, the times, and the command line that makes it again.

use std::path::PathBuf;

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

impl OutputFolder {
    /// Write files and the time they took, then finish.
    pub fn finish_with(self, files: Files, mut timing: Timing) -> anyhow::Result<PathBuf> {
        self.write_all(files)?;
        timing.stage("write");
        self.write(timing::FILE, timing.to_json())?;
        Ok(self.finish()?)
    }
}

/// Keep the files of a page and the time it took.
pub fn publish(folder: OutputFolder, files: Files, timing: Timing, session: &Session) -> anyhow::Result<()> {
    session.note(format_args!("written to {}", folder.finish_with(files, timing)?.display()));
    Ok(())
}
