//! Chunks as job arrays of Slurm.

use std::{
    fmt::Write as _,
    path::Path,
    process::{Command, Output},
};

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

use super::job::{Job, Submission};
use crate::cli::output::write_atomically;

/// Tasks in an array where the cluster does not say how many it takes.
const USUAL_ARRAY: usize = 1000;

/// A cluster run by Slurm, and options of `sbatch` for it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Slurm {
    options: Vec<(String, String)>,
}

/// Why an engine is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected `slurm`, or `slurm:OPTION=VALUE,…` such as `slurm:partition=short,time=02:00:00`, found `{found}`")]
pub struct NoEngine {
    found: String,
}

impl Slurm {
    /// Value parser of `--on`.
    ///
    /// # Errors
    /// [`NoEngine`].
    pub fn parse(text: &str) -> Result<Self, NoEngine> {
        let refused = || NoEngine { found: text.into() };
        let (name, options) = text.split_once(':').unwrap_or((text, ""));
        let word = |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
        let value = |value: &str| !value.is_empty() && !value.chars().any(|c| c.is_whitespace() || c.is_control());
        let options = options.split(',').filter(|option| !option.is_empty()).map(|option| {
            let (key, given) = option.split_once('=').ok_or_else(refused)?;
            if word(key) && value(given) { Ok((key.to_owned(), given.to_owned())) } else { Err(refused()) }
        });
        if name == "slurm" { Ok(Self { options: options.collect::<Result<_, _>>()? }) } else { Err(refused()) }
    }

    /// What a task of an array runs: the chunk on its line of the list of submission `number`.
    pub(super) fn script(&self, folder: &Path, number: usize) -> String {
        let own = |key: &str| self.options.iter().any(|(known, _)| known == key);
        let usual = [("job-name", "granchain"), ("cpus-per-task", "1")];
        let mut script = String::from("#!/bin/sh\n#SBATCH --output=/dev/null\n");
        let usual = usual.into_iter().filter(|(key, _)| !own(key));
        for (key, value) in usual.chain(self.options.iter().map(|(key, value)| (key.as_str(), value.as_str()))) {
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
            let answer = answer(command.arg(&script))?;
            ids.push(answer.trim().split(';').next().unwrap_or_default().to_owned());
            // Noted at once: what runs must not go unseen when the next array is refused.
            job.submitted(number, Submission { engine: self.clone(), ids: ids.clone(), chunks: chunks.len() })?;
        }
        Ok(ids)
    }

    /// Whether any of these is still queued or running.
    pub(super) fn is_alive(&self, ids: &[String]) -> anyhow::Result<bool> {
        let mut command = Command::new("squeue");
        let output = started(command.args(["--noheader", "--format=%i", &format!("--jobs={}", ids.join(","))]))?;
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
    let config = answer(Command::new("scontrol").args(["show", "config"])).unwrap_or_default();
    let line = config.lines().find_map(|line| line.trim().strip_prefix("MaxArraySize"));
    let size = line.and_then(|line| line.trim_start_matches([' ', '=']).trim().parse().ok());
    size.filter(|size| *size > 0).unwrap_or(USUAL_ARRAY)
}

fn started(command: &mut Command) -> anyhow::Result<Output> {
    let name = command.get_program().to_string_lossy().into_owned();
    command
        .output()
        .with_context(|| format!("`{name}` could not be started: --on slurm needs Slurm's commands on this machine"))
}

/// What a command prints.
fn answer(command: &mut Command) -> anyhow::Result<String> {
    let output = started(command)?;
    if !output.status.success() {
        let name = command.get_program().to_string_lossy();
        bail!("{name} refused: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// A path as a shell takes it whole.
fn quoted(path: &(impl AsRef<Path> + ?Sized)) -> String {
    format!("'{}'", path.as_ref().display().to_string().replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_become_lines_of_the_script() {
        let slurm = Slurm::parse("slurm:partition=short,time=02:00:00,cpus-per-task=4").unwrap();
        let script = slurm.script(Path::new("/data/it's here/scan.batch"), 3);
        for line in ["#SBATCH --partition=short", "#SBATCH --time=02:00:00", "#SBATCH --cpus-per-task=4"] {
            assert!(script.lines().any(|found| found == line), "{script}");
        }
        assert!(!script.contains("--cpus-per-task=1"), "{script}");
        assert!(script.contains(r"run-chunk '/data/it'\''s here/scan.batch'"), "{script}");
        assert!(script.contains("slurm-3.chunks"), "{script}");
    }

    #[test]
    fn what_is_no_engine_or_no_option_is_refused() {
        for text in ["pbs", "slurm:partition", "slurm:=x", "slurm:time=", "slurm:a b=c", "slurm:time=1\n#SBATCH"] {
            assert_eq!(Slurm::parse(text), Err(NoEngine { found: text.into() }));
        }
        assert_eq!(Slurm::parse("slurm"), Slurm::parse("slurm:"));
    }
}
