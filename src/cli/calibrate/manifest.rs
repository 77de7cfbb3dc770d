//! What went into a calibration and what came out: `manifest.json`, from which `granchain verify` begins.

use std::{collections::BTreeMap, path::PathBuf};

use serde::{Deserialize, Serialize};

use super::Job;
use crate::{
    calibration::{drive::Input, outcome::InputDigest, problem::Problem, recorded_run::RecordedRun},
    cli::{output::digest, without},
    measurement::shell_line,
    model::vector_unit,
    report::page::Files,
};

pub const FILE: &str = "manifest.json";

/// Arguments that cannot change a result and have no value, and those that have one.
const SILENT: [&str; 5] = ["--resume", "--quiet", "--json", "--force", "--strict"];
const SILENT_WITH_VALUE: [&str; 3] = ["--threads", "--out", "--cache"];

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    pub program: String,
    /// What did the arithmetic: last digits depend on it.
    pub processor: String,
    /// The arguments of `granchain calibrate` that can change a result, as typed.
    pub arguments: Vec<String>,
    /// Every file read, by role: `plan`, `bench`, `scene`, `mesh-1`, `measured`, `drive`; of further records `measured-2` and so on.
    pub inputs: BTreeMap<String, InputDigest>,
    /// SHA-256 of every file written, but for this one and `timing.json`; of pages without their times.
    pub files: BTreeMap<String, String>,
}

impl Manifest {
    /// The manifest of what a program made of its arguments and inputs.
    pub fn new(program: &str, arguments: &[String], inputs: BTreeMap<String, InputDigest>, files: &Files) -> Self {
        let named = files.iter().map(|(name, bytes)| (name.display().to_string(), bytes));
        let digests = named.map(|(name, bytes)| (name.clone(), digest(&name, bytes)));
        Self {
            program: program.to_owned(),
            processor: vector_unit(),
            arguments: arguments.to_vec(),
            inputs,
            files: digests.collect(),
        }
    }

    /// The manifest of a job and what it made.
    pub fn of(job: &Job, files: &Files) -> anyhow::Result<Self> {
        Ok(Self::new(&job.program, &job.arguments, inputs(job)?, files))
    }
}

/// The arguments without what cannot change a result: threads, verbosity, cache, resuming, where results go.
pub fn typed(arguments: impl Iterator<Item = String>) -> Vec<String> {
    let mut named = false;
    let kept = without(arguments, &SILENT, &SILENT_WITH_VALUE).into_iter();
    kept.filter(|word| word != "calibrate" || std::mem::replace(&mut named, true)).collect()
}

/// The command line that makes it again, as reports show it.
pub fn command_line(arguments: &[String]) -> String {
    shell_line(["granchain", "calibrate"].into_iter().chain(arguments.iter().map(String::as_str)))
}

fn inputs(job: &Job) -> anyhow::Result<BTreeMap<String, InputDigest>> {
    let mut inputs = BTreeMap::new();
    let mut add = |role: String, path: PathBuf, known: Option<String>| -> anyhow::Result<()> {
        let sha256 = known.map_or_else(|| Ok(Input::digest(path.clone())?.sha256), anyhow::Ok)?;
        inputs.insert(role, InputDigest { path: path.display().to_string(), sha256, ..InputDigest::default() });
        Ok(())
    };
    for (role, Input { path, sha256 }) in &job.plans {
        add((*role).into(), path.clone(), Some(sha256.clone()))?;
    }
    let Problem { recorded_runs, .. } = &job.problem;
    for (number, RecordedRun { bench, measured, .. }) in recorded_runs.iter().enumerate() {
        let of = |role: &str| if number == 0 { role.to_owned() } else { format!("{role}-{}", number + 1) };
        if let Some(Input { path, sha256 }) = bench.scene_file() {
            add(of("scene"), path, Some(sha256))?;
        }
        add(of("measured"), measured.path().into(), Some(measured.sha256().into()))?;
        if let Some(Input { path, sha256 }) = bench.drive.as_ref().map(|drive| &drive.input) {
            add(of("drive"), path.clone(), Some(sha256.clone()))?;
        }
    }
    Ok(inputs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_change_a_result_is_left_out() {
        let typed = "--seed 3 calibrate --out here --measured calibrate --threads=2 --quiet --cache none --set damping.kind=linear";
        let kept = super::typed(typed.split(' ').map(String::from));
        assert_eq!(kept, ["--seed", "3", "--measured", "calibrate", "--set", "damping.kind=linear"]);
        let shown = command_line(&["--bounds".into(), "damping=0.1 N s/m:1 N s/m".into()]);
        assert_eq!(shown, "granchain calibrate --bounds 'damping=0.1 N s/m:1 N s/m'");
    }
}
