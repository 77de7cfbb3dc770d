//! Chunks as job arrays of Slurm.

use std::{fmt::Write as _, path::Path, process::Command};

use anyhow::bail;
use serde::{Deserialize, Serialize};

use super::{
    engine::{Engine, Options, answer, quoted, started, with_usual},
    job::{Job, Submission},
};
use crate::cli::output::write_atomically;

/// Tasks in an array where the cluster does not say how many it takes.
const USUAL_ARRAY: usize = 1000;

/// A cluster run by Slurm, and options of `sbatch` for it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Slurm {
    pub(super) options: Options,
}

/// Whose commands are needed.
const NEEDED: &str = "--on slurm needs Slurm's commands";

impl Slurm {
    /// What a task of an array runs: the chunk on its line of the list of submission `number`.
    pub(super) fn script(&self, folder: &Path, number: usize) -> String {
        let mut script = String::from("#!/bin/sh\n#SBATCH --output=/dev/null\n");
        for (key, value) in with_usual(&self.options, &[("job-name", "granchain"), ("cpus-per-task", "1")]) {
            let _ = writeln!(script, "#SBATCH --{key}={value}");
        }
        let program = std::env::current_exe().unwrap_or_else(|_| "granchain".into());
        let (list, logs) = (folder.join(list(number)), folder.join("logs"));
        let [program, folder, list, logs] = [&program, folder, &list, &logs].map(quoted);
        let _ = write!(
            script,
            "chunk=$(sed -n \"$((GRANCHAIN_FIRST + SLURM_ARRAY_TASK_ID + 1))p\" {list})\n\
             exec {program} batch run-chunk {folder} \"$chunk\" --threads \"${{SLURM_CPUS_PER_TASK:-1}}\" >{logs}/\"$chunk\".log 2>&1\n"
        );
        script
    }

    /// Submit these chunks, in as many arrays as the cluster's limit asks for; their names.
    pub(super) fn submit(&self, job: &Job, chunks: &[usize]) -> anyhow::Result<Vec<String>> {
        let number = job.submissions()?.len() + 1;
        let script = job.folder().join(format!("slurm-{number}.sh"));
        write_atomically(&script, self.script(job.folder(), number).as_bytes())?;
        let lines: String = chunks.iter().map(|chunk| format!("{chunk}\n")).collect();
        write_atomically(&job.folder().join(list(number)), lines.as_bytes())?;
        let most = largest_array();
        let mut ids = Vec::new();
        for first in (0..chunks.len()).step_by(most) {
            let last = most.min(chunks.len() - first) - 1;
            let mut command = Command::new("sbatch");
            command.args([
                "--parsable",
                &format!("--array=0-{last}"),
                &format!("--export=ALL,GRANCHAIN_FIRST={first}"),
            ]);
            let answer = answer(command.arg(&script), NEEDED)?;
            ids.push(answer.trim().split(';').next().unwrap_or_default().to_owned());
            // Noted at once: what runs must not go unseen when the next array is refused.
            job.submitted(
                number,
                Submission { engine: Engine::Slurm(self.clone()), ids: ids.clone(), chunks: chunks.len() },
            )?;
        }
        Ok(ids)
    }

    /// Whether any of these is still queued or running.
    pub(super) fn is_alive(&self, ids: &[String]) -> anyhow::Result<bool> {
        let mut command = Command::new("squeue");
        let output =
            started(command.args(["--noheader", "--format=%i", &format!("--jobs={}", ids.join(","))]), NEEDED)?;
        let told = String::from_utf8_lossy(&output.stderr);
        // A cluster forgets what has ended.
        if !output.status.success() && !told.contains("Invalid job id") {
            bail!("squeue: {}", told.trim());
        }
        Ok(!output.stdout.trim_ascii().is_empty())
    }
}

/// Name of the list of chunks of a submission.
fn list(number: usize) -> String {
    format!("slurm-{number}.chunks")
}

/// Tasks that an array may have on this cluster.
fn largest_array() -> usize {
    let config = answer(Command::new("scontrol").args(["show", "config"]), NEEDED).unwrap_or_default();
    let line = config.lines().find_map(|line| line.trim().strip_prefix("MaxArraySize"));
    let size = line.and_then(|line| line.trim_start_matches([' ', '=']).trim().parse().ok());
    size.filter(|size| *size > 0).unwrap_or(USUAL_ARRAY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_become_lines_of_the_script() {
        let Ok(Engine::Slurm(slurm)) = Engine::parse("slurm:partition=short,time=02:00:00,cpus-per-task=4") else {
            panic!("no slurm");
        };
        let script = slurm.script(Path::new("/data/it's here/scan.batch"), 3);
        for line in ["#SBATCH --partition=short", "#SBATCH --time=02:00:00", "#SBATCH --cpus-per-task=4"] {
            assert!(script.lines().any(|found| found == line), "{script}");
        }
        assert!(!script.contains("--cpus-per-task=1"), "{script}");
        assert!(script.contains(r"run-chunk '/data/it'\''s here/scan.batch'"), "{script}");
        assert!(script.contains("slurm-3.chunks"), "{script}");
    }
}
