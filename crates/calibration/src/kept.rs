//! Runs of a fidelity level that take seconds each, kept on disk as they finish: what is killed makes none of them again.

use std::{collections::BTreeMap, path::PathBuf};

use super::forward::Run;
use granchain_record::run_log::{RunLog, RunLogError};

/// Where the runs of one fidelity level of one fit are kept.
#[derive(Debug, Clone)]
pub struct KeptPlace {
    pub path: PathBuf,
    /// Digest of what the fit is made from; runs of another are not taken.
    pub key: String,
}

/// The runs of a fidelity level that are finished.
#[derive(Debug)]
pub struct KeptRuns {
    log: RunLog,
    key: String,
    runs: BTreeMap<usize, (String, Run)>,
}

impl KeptPlace {
    /// The file beside it for the finer bodies of the same fidelity level.
    #[must_use]
    pub fn finer(&self) -> Self {
        Self { path: self.path.with_extension("finer.jsonl"), key: self.key.clone() }
    }

    /// Open it, or begin it.
    ///
    /// # Errors
    /// When the file cannot be read or written.
    pub fn open(&self) -> Result<KeptRuns, RunLogError> {
        let (log, runs) = RunLog::open(&self.path)?;
        Ok(KeptRuns { log, key: self.key.clone(), runs })
    }
}

impl KeptRuns {
    /// The run of this number at this point, where an earlier process finished it.
    #[must_use]
    pub fn found(&self, number: u64, position: &[f64]) -> Option<&Run> {
        let (key, run) = self.runs.get(&usize::try_from(number).ok()?)?;
        (*key == self.key && run.position == position).then_some(run)
    }

    /// Keep one; when this returns, it survives a kill.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn keep(&self, number: u64, run: &Run) -> Result<(), RunLogError> {
        self.log.keep(number as usize, &(&self.key, run))
    }

    /// What is to be said of lines that were altered since they were written.
    #[must_use]
    pub fn damage(&self) -> Option<String> {
        self.log.damage()
    }
}
