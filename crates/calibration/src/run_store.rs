//! Store of slow runs (seconds each), written as they finish, so that a killed fit repeats none.

use std::{collections::BTreeMap, path::PathBuf};

use super::forward::Run;
use granchain_record::run_log::{RunLog, RunLogError};

/// Location of the stored runs of one fidelity level of one fit.
#[derive(Debug, Clone)]
pub(crate) struct RunFile {
    pub path: PathBuf,
    /// Digest of the fit's inputs; runs with another digest are ignored.
    pub key: String,
}

/// Stored runs of a fidelity level.
#[derive(Debug)]
pub(crate) struct RunStore {
    log: RunLog,
    key: String,
    runs: BTreeMap<usize, (String, Run)>,
}

impl RunFile {
    /// The file for the finer bodies of the same level.
    #[must_use]
    pub(crate) fn finer(&self) -> Self {
        Self { path: self.path.with_extension("finer.jsonl"), key: self.key.clone() }
    }

    /// Opens or creates the store.
    pub(crate) fn open(&self) -> Result<RunStore, RunLogError> {
        let (log, runs) = RunLog::open(&self.path)?;
        Ok(RunStore { log, key: self.key.clone(), runs })
    }
}

impl RunStore {
    /// The stored run with this number and position, if there is one.
    pub(crate) fn found(&self, number: u64, position: &[f64]) -> Option<&Run> {
        let (key, run) = self.runs.get(&usize::try_from(number).ok()?)?;
        (*key == self.key && run.position == position).then_some(run)
    }

    /// Stores a run; on return it is on disc.
    pub(crate) fn keep(&self, number: u64, run: &Run) -> Result<(), RunLogError> {
        self.log.keep(number as usize, &(&self.key, run))
    }

    pub(crate) fn damage(&self) -> Option<String> {
        self.log.damage()
    }
}
