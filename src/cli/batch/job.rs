//! The folder of a batch.

use std::{
    collections::BTreeSet,
    fs,
    ops::Range,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Divisible, engine::Engine};
use crate::{
    cli::{output::write_atomically, summary},
    measurement::{
        seal::{sealed, unsealed},
        sha256,
    },
    model::vector_unit,
};

/// Names in the folder.
const PLAN: &str = "batch.json";
const SUBMISSIONS: &str = "submissions.json";
const CHUNKS: &str = "chunks";
const LOGS: &str = "logs";

/// `batch.json`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JobPlan {
    /// Program and version that planned it; no other runs its chunks.
    pub program: String,
    /// Command and arguments.
    pub command: Vec<String>,
    /// Folder that its paths are relative to.
    pub folder: PathBuf,
    /// Points in all.
    pub points: usize,
    /// Points in a chunk.
    pub chunk: usize,
    /// Digest of everything that decides what the runs are.
    pub plan_sha256: String,
    /// What decides the runs that the command does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub besides: Option<Value>,
}

/// A chunk that is done: `chunks/K.json`, sealed.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Chunk {
    /// What did the arithmetic.
    processor: String,
    plan_sha256: String,
    /// Its first point.
    first: usize,
    pub runs: Vec<Value>,
}

/// Chunks that were handed to an engine.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Submission {
    pub engine: Engine,
    /// The engine's names of it.
    pub ids: Vec<String>,
    /// How many chunks.
    pub chunks: usize,
}

/// A batch on disk.
#[derive(Debug)]
pub(super) struct Job {
    folder: PathBuf,
    pub plan: JobPlan,
}

impl Job {
    /// Write the folder of a batch that does not stand yet; `batch.json` comes last and makes it one.
    pub fn create(folder: &Path, command: Vec<String>, study: &dyn Divisible, chunk: usize) -> anyhow::Result<Self> {
        let folder = absolute(folder)?;
        if folder.exists() {
            bail!(
                "{}: expected a new folder for the batch, found one there; go on with it (`batch status`, `batch collect`, or --resume with \
                 --on), or delete it",
                folder.display()
            );
        }
        for name in [CHUNKS, LOGS] {
            let part = folder.join(name);
            fs::create_dir_all(&part).with_context(|| format!("{}: cannot create the folder", part.display()))?;
        }
        let plan = JobPlan {
            program: summary::program(),
            command,
            folder: absolute(Path::new("."))?,
            points: study.points(),
            chunk,
            plan_sha256: sha256(&study.plan()?),
            besides: study.besides()?,
        };
        write_atomically(&folder.join(PLAN), &summary::json(&plan)?)?;
        Ok(Self { folder, plan })
    }

    /// Read it.
    pub fn open(folder: &Path) -> anyhow::Result<Self> {
        let folder = absolute(folder)?;
        let path = folder.join(PLAN);
        let bytes = fs::read(&path).with_context(|| {
            format!("{}: expected the folder of a batch, as `batch plan` and --on write it", folder.display())
        })?;
        let plan: JobPlan = serde_json::from_slice(&bytes)
            .with_context(|| format!("{}: not what `batch plan` writes", path.display()))?;
        if plan.chunk == 0 || plan.points == 0 {
            bail!("{}: expected at least one point and one in a chunk; plan the batch anew", path.display());
        }
        if plan.program != summary::program() {
            bail!(
                "{}: planned by {}, and this is {}: one batch is run by one version; use that one, or plan it anew",
                path.display(),
                plan.program,
                summary::program()
            );
        }
        Ok(Self { folder, plan })
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    pub fn chunks(&self) -> usize {
        self.plan.points.div_ceil(self.plan.chunk)
    }

    /// Points of a chunk.
    pub fn range(&self, chunk: usize) -> anyhow::Result<Range<usize>> {
        if chunk >= self.chunks() {
            bail!("{}: expected a chunk from 0 to {}, found {chunk}", self.folder.display(), self.chunks() - 1);
        }
        let first = chunk * self.plan.chunk;
        Ok(first..self.plan.points.min(first + self.plan.chunk))
    }

    /// Refuse a command whose files or flags are no longer those of the plan.
    pub fn agrees(&self, study: &dyn Divisible) -> anyhow::Result<()> {
        if study.points() == self.plan.points && sha256(&study.plan()?) == self.plan.plan_sha256 {
            return Ok(());
        }
        bail!(
            "{}: the batch was planned for another scene, grid, drive record or seed: a file or flag of its command has changed since; \
             undo that, or delete the folder and plan it anew",
            self.folder.display()
        )
    }

    fn chunk_path(&self, chunk: usize) -> PathBuf {
        self.folder.join(CHUNKS).join(format!("{chunk}.json"))
    }

    /// Where what a chunk says goes.
    pub fn logs(&self) -> PathBuf {
        self.folder.join(LOGS)
    }

    /// Keep what came of a chunk: the file appears whole.
    pub fn keep(&self, chunk: usize, runs: Vec<Value>) -> anyhow::Result<()> {
        let first = self.range(chunk)?.start;
        let kept = Chunk { processor: vector_unit(), plan_sha256: self.plan.plan_sha256.clone(), first, runs };
        let body = serde_json::to_vec(&kept).context("a chunk cannot be written as JSON")?;
        Ok(write_atomically(&self.chunk_path(chunk), &sealed(&body))?)
    }

    /// Chunks without a result.
    pub fn missing(&self) -> Vec<usize> {
        (0..self.chunks()).filter(|chunk| self.is_missing(*chunk)).collect()
    }

    pub fn is_missing(&self, chunk: usize) -> bool {
        !self.chunk_path(chunk).exists()
    }

    /// What came of a chunk.
    pub fn read(&self, chunk: usize) -> anyhow::Result<Chunk> {
        let path = self.chunk_path(chunk);
        let again =
            || format!("{}: cannot be used; delete it and run `batch run-chunk` of {chunk} again", path.display());
        let bytes = fs::read(&path).with_context(again)?;
        let body = unsealed(&bytes).with_context(again)?;
        let found: Chunk = serde_json::from_slice(body).with_context(again)?;
        let part = self.range(chunk)?;
        if found.plan_sha256 != self.plan.plan_sha256 || found.first != part.start || found.runs.len() != part.len() {
            bail!("{}: it holds other points than chunk {chunk}; delete it and run that again", path.display());
        }
        Ok(found)
    }

    /// The processors that ran the chunks, each of which can be read.
    pub fn processors(&self) -> anyhow::Result<BTreeSet<String>> {
        (0..self.chunks()).map(|chunk| Ok(self.read(chunk)?.processor)).collect()
    }

    /// The last line that a chunk printed.
    pub fn last_words(&self, chunk: usize) -> Option<String> {
        let log = fs::read(self.logs().join(format!("{chunk}.log"))).ok()?;
        let log = String::from_utf8_lossy(&log);
        log.lines().rev().map(str::trim).find(|line| !line.is_empty()).map(str::to_owned)
    }

    /// What was submitted, first to last.
    pub fn submissions(&self) -> anyhow::Result<Vec<Submission>> {
        let path = self.folder.join(SUBMISSIONS);
        if !path.exists() {
            return Ok(Vec::new());
        }
        let bytes = fs::read(&path).with_context(|| format!("{}: cannot be read", path.display()))?;
        serde_json::from_slice(&bytes).with_context(|| {
            format!("{}: not what granchain writes; delete it, and what runs goes unseen", path.display())
        })
    }

    /// Note the submission of this number, from 1, as it stands.
    pub fn submitted(&self, number: usize, submission: Submission) -> anyhow::Result<()> {
        let mut all = self.submissions()?;
        all.truncate(number - 1);
        all.push(submission);
        Ok(write_atomically(&self.folder.join(SUBMISSIONS), &summary::json(&all)?)?)
    }

    /// The results stand.
    pub fn remove(self) {
        // What is left of the work is not worth an error.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// A path that holds from any folder.
pub(super) fn absolute(path: &Path) -> anyhow::Result<PathBuf> {
    let absolute = std::path::absolute(path).with_context(|| format!("{}: no such place", path.display()))?;
    Ok(absolute.components().collect())
}
