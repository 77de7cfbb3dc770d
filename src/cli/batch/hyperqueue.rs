//! Chunks as task arrays of HyperQueue.

use std::{path::Path, process::Command};

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{
    engine::{Engine, Options, answer, quoted, with_usual},
    job::{Job, Submission},
};

/// A cluster run by HyperQueue, and options of `hq submit` for it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct HyperQueue {
    pub(super) options: Options,
}

/// Whose commands are needed.
const NEEDED: &str = "--on hyperqueue needs HyperQueue's `hq`";

impl HyperQueue {
    /// The command that submits these chunks, word by word: a task has the number of its chunk.
    pub(super) fn submission(&self, folder: &Path, chunks: &[usize]) -> Vec<String> {
        let options = with_usual(&self.options, &[("name", "granchain"), ("cpus", "1")]);
        let threads = with_usual(&self.options, &[("cpus", "1")]).find(|(key, _)| *key == "cpus");
        let threads = threads.and_then(|(_, cpus)| cpus.parse().ok()).unwrap_or(1_u32);
        let program = std::env::current_exe().unwrap_or_else(|_| "granchain".into());
        let logs = folder.join("logs");
        let [program, folder, logs] = [&program, folder, &logs].map(quoted);
        let run = format!(
            "exec {program} batch run-chunk {folder} \"$HQ_TASK_ID\" --threads {threads} >{logs}/\"$HQ_TASK_ID\".log 2>&1"
        );
        let mut words: Vec<String> = ["hq", "--output-mode=quiet", "submit"].map(String::from).to_vec();
        words.push(format!("--array={}", ranges(chunks)));
        words.extend(options.map(|(key, value)| format!("--{key}={value}")));
        words.extend(["--stdout=none", "--stderr=none", "--", "/bin/sh", "-c", run.as_str()].map(String::from));
        words
    }

    /// Submit these chunks as one job; its name.
    pub(super) fn submit(&self, job: &Job, chunks: &[usize]) -> anyhow::Result<Vec<String>> {
        let number = job.submissions()?.len() + 1;
        let words = self.submission(job.folder(), chunks);
        let Some((program, arguments)) = words.split_first() else { bail!("nothing to submit") };
        let told = answer(Command::new(program).args(arguments), NEEDED)?;
        let id = told.trim().to_owned();
        if id.parse::<u64>().is_err() {
            bail!("hq submit: expected the number of the job, found `{id}`; look with `hq job list`");
        }
        let engine = Engine::HyperQueue(self.clone());
        job.submitted(number, Submission { engine, ids: vec![id.clone()], chunks: chunks.len() })?;
        Ok(vec![id])
    }

    /// Whether any of these is still queued or running.
    pub(super) fn is_alive(&self, ids: &[String]) -> anyhow::Result<bool> {
        let mut command = Command::new("hq");
        let told = answer(command.args(["--output-mode=json", "job", "list", "--filter", "waiting,running"]), NEEDED)?;
        let jobs: Vec<Value> = serde_json::from_str(&told)
            .with_context(|| format!("hq job list: expected a list of jobs as JSON, found `{}`", told.trim()))?;
        Ok(jobs.iter().any(|job| ids.contains(&job["id"].to_string())))
    }
}

/// Ascending numbers as `hq` reads them, such as `0-4,7`.
fn ranges(chunks: &[usize]) -> String {
    let ranges = chunks.chunk_by(|one, next| one + 1 == *next).map(|range| match range {
        [first, .., last] => format!("{first}-{last}"),
        single => single.iter().map(ToString::to_string).collect(),
    });
    ranges.collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_become_one_array_and_options_its_flags() {
        let queue = HyperQueue { options: vec![("cpus".into(), "4".into()), ("time-limit".into(), "1h".into())] };
        let words = queue.submission(Path::new("/data/it's here/scan.batch"), &[0, 1, 2, 5, 7, 8]);
        for word in ["--array=0-2,5,7-8", "--cpus=4", "--time-limit=1h", "--name=granchain", "--stdout=none"] {
            assert!(words.iter().any(|found| found == word), "{words:?}");
        }
        assert!(!words.contains(&"--cpus=1".to_owned()), "{words:?}");
        let run = words.last().unwrap();
        assert!(run.contains(r#"run-chunk '/data/it'\''s here/scan.batch' "$HQ_TASK_ID" --threads 4"#), "{run}");
    }
}
