//! What starts chunks on a cluster.

use std::process::{Command, Output};

use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};

use super::{hyperqueue::HyperQueue, job::Job, slurm::Slurm};

/// A cluster, and options of its command of submission.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Engine {
    /// Job arrays of Slurm
    Slurm(Slurm),
    /// Task arrays of HyperQueue
    HyperQueue(HyperQueue),
}

/// Why an engine is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected `slurm` or `hyperqueue`, or with options `slurm:OPTION=VALUE,…` such as `slurm:partition=short,time=02:00:00`, found `{found}`"
)]
pub struct NoEngine {
    found: String,
}

/// Options of a command of submission, without their dashes.
pub(super) type Options = Vec<(String, String)>;

impl Engine {
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
        let options = options.collect::<Result<Options, _>>()?;
        match name {
            "slurm" => Ok(Self::Slurm(Slurm { options })),
            "hyperqueue" => Ok(Self::HyperQueue(HyperQueue { options })),
            _ => Err(refused()),
        }
    }

    /// Its word.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Slurm(_) => "slurm",
            Self::HyperQueue(_) => "hyperqueue",
        }
    }

    /// The command that ends what was submitted.
    pub(super) fn end(&self, ids: &[String]) -> String {
        match self {
            Self::Slurm(_) => format!("scancel {}", ids.join(" ")),
            Self::HyperQueue(_) => format!("hq job cancel {}", ids.join(",")),
        }
    }

    /// What a submission of these chunks hands over, for people.
    pub(super) fn script(&self, folder: &std::path::Path, chunks: &[usize]) -> String {
        match self {
            Self::Slurm(slurm) => slurm.script(folder, 1),
            Self::HyperQueue(queue) => {
                let words = queue.submission(folder, chunks);
                let words: Vec<String> = words.iter().map(quoted_where_needed).collect();
                words.join(" ") + "\n"
            }
        }
    }

    /// Submit these chunks; their names.
    pub(super) fn submit(&self, job: &Job, chunks: &[usize]) -> anyhow::Result<Vec<String>> {
        match self {
            Self::Slurm(slurm) => slurm.submit(job, chunks),
            Self::HyperQueue(queue) => queue.submit(job, chunks),
        }
    }

    /// Whether any of these is still queued or running.
    pub(super) fn is_alive(&self, ids: &[String]) -> anyhow::Result<bool> {
        match self {
            Self::Slurm(slurm) => slurm.is_alive(ids),
            Self::HyperQueue(queue) => queue.is_alive(ids),
        }
    }
}

/// Options as they are asked for, behind the usual ones that they do not name.
pub(super) fn with_usual<'a>(
    asked: &'a Options,
    usual: &[(&'a str, &'a str)],
) -> impl Iterator<Item = (&'a str, &'a str)> {
    let own = |key: &str| asked.iter().any(|(known, _)| known == key);
    let usual: Vec<_> = usual.iter().filter(|(key, _)| !own(key)).copied().collect();
    usual.into_iter().chain(asked.iter().map(|(key, value)| (key.as_str(), value.as_str())))
}

/// What a command that was started has left; `needed` says whose commands are looked for.
pub(super) fn started(command: &mut Command, needed: &str) -> anyhow::Result<Output> {
    let name = command.get_program().to_string_lossy().into_owned();
    command.output().with_context(|| format!("`{name}` could not be started: {needed} on this machine"))
}

/// What a command prints.
pub(super) fn answer(command: &mut Command, needed: &str) -> anyhow::Result<String> {
    let output = started(command, needed)?;
    if !output.status.success() {
        let name = command.get_program().to_string_lossy();
        let told = [output.stderr, output.stdout].map(|told| String::from_utf8_lossy(&told).trim().to_owned());
        bail!("{name} refused: {}", told.join(" ").trim());
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// A word as a shell takes it whole.
pub(super) fn quoted(word: &(impl AsRef<std::path::Path> + ?Sized)) -> String {
    format!("'{}'", word.as_ref().display().to_string().replace('\'', r"'\''"))
}

/// The same, where a shell would not take it whole as it stands.
fn quoted_where_needed(word: &String) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=./,:%+".contains(c);
    if word.chars().all(plain) { word.clone() } else { quoted(word) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_engine_or_no_option_is_refused() {
        for text in ["pbs", "slurm:partition", "slurm:=x", "hyperqueue:cpus=", "slurm:a b=c", "slurm:time=1\n#SBATCH"] {
            assert_eq!(Engine::parse(text), Err(NoEngine { found: text.into() }));
        }
        assert_eq!(Engine::parse("slurm"), Engine::parse("slurm:"));
        assert_ne!(Engine::parse("slurm"), Engine::parse("hyperqueue"));
    }
}
