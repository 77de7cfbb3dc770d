//! The reduced model on the command line: where it is the default, and its cache.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

use crate::harness::stderr;

fn run(arguments: &[&str], cache: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.args(arguments).args(["--set", "duration=30 us"]).env("XDG_CACHE_HOME", cache).output().unwrap()
}

/// Every file but the one that holds times.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let name = |path: &Path| path.file_name().unwrap().to_str().unwrap().to_owned();
    files.filter(|path| name(path) != "timing.json").map(|path| (name(&path), fs::read(&path).unwrap())).collect()
}

#[test]
fn results_are_the_same_bytes_made_kept_read_and_without_a_cache() {
    let place = tempfile::tempdir().unwrap();
    let home = place.path().join("home");
    let kept = place.path().join("kept");
    let mut results = Vec::new();
    let flags: [&[&str]; 4] =
        [&["--cache", "none"], &["--cache", kept.to_str().unwrap()], &["--cache", kept.to_str().unwrap()], &[]];
    for (number, flags) in flags.into_iter().enumerate() {
        let out = place.path().join(number.to_string());
        let arguments = [&["replay", "--scene", "annulus", "--out", out.to_str().unwrap()], flags].concat();
        let output = run(&arguments, &home);
        assert!(output.status.success(), "{}", stderr(&output));
        results.push(contents(&out));
        // Nothing is kept unasked, and only where asked.
        assert_eq!((kept.exists(), home.exists()), (number > 0, number == 3));
    }
    assert!(results.iter().all(|result| *result == results[0]));
    assert_eq!(fs::read_dir(&kept).unwrap().count(), 1);
    assert_eq!(fs::read_dir(home.join("granchain")).unwrap().count(), 1);
}

#[test]
fn a_cache_that_cannot_be_written_is_a_warning() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("file");
    fs::write(&file, "").unwrap();
    let output = run(&["replay", "--scene", "rigid", "--cache", file.join("below").to_str().unwrap()], place.path());
    assert!(output.status.success());
    assert_eq!(stderr(&output).matches("cannot be kept").count(), 1, "{}", stderr(&output));
}

#[test]
fn scenes_without_a_model_run_reduced_and_half_spaces_on_the_chain_with_a_note() {
    let place = tempfile::tempdir().unwrap();
    let model = |arguments: &[&str]| {
        let output = run(&[&["replay", "--json"], arguments].concat(), place.path());
        assert!(output.status.success(), "{}", stderr(&output));
        let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
        (summary["settings"]["model"].as_str().unwrap().to_owned(), stderr(&output).contains("taken as chain"))
    };
    assert_eq!(model(&["--scene", "rigid"]), ("reduced".into(), false));
    assert_eq!(model(&["--scene", "chain"]), ("chain".into(), false));
    assert_eq!(model(&["--scene", "rigid", "--model", "chain"]), ("chain".into(), false));
    assert_eq!(model(&["--scene", "rigid", "--set", "support.kind=half-space"]), ("chain".into(), true));
    assert_eq!(model(&["--scene", "rigid", "--set", "model.tolerance=1e-9"]), ("chain".into(), true));
    assert_eq!(model(&["--scene", "rigid", "--ensemble", "2"]), ("chain".into(), false));
}

#[test]
fn one_sweep_is_of_one_model() {
    let place = tempfile::tempdir().unwrap();
    let sweep = |values: &str| {
        let output = run(&["sweep", "--scene", "rigid", "--vary", values, "--json"], place.path());
        assert!(output.status.success(), "{}", stderr(&output));
        let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
        (summary["settings"]["model"].as_str().unwrap().to_owned(), stderr(&output))
    };
    let (model, _) = sweep("alpha=0.5,1");
    assert_eq!(model, "reduced");
    let (model, said) = sweep("support.kind=rigid,steel");
    assert_eq!(model, "chain");
    assert!(said.contains("taken as chain everywhere"), "{said}");
}
