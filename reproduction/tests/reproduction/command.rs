//! `granchain-reproduction`: folders, times, refusals.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

fn study(flags: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_granchain-reproduction")).args(flags).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_study_says_how_long_it_takes_and_writes_one_folder() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("precompression");
    let output = study(&[
        "precompression",
        "--model",
        "chain",
        "--quick",
        "--set",
        "chain.beads=3",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("44 runs on model `chain`, about"), "{}", said(&output));
    for name in ["report.html", "report.md", "precompression.json", "precompression.csv", "figures/precompression.svg"]
    {
        assert!(out.join(name).is_file(), "{name}");
    }
    let stages = &json(&out.join("timing.json"))["stages"];
    assert!(stages["run_s"].as_f64().unwrap() > 0.0);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("granchain-reproduction precompression --model chain --set chain.beads=3 --quick"));
    // 11 forces of 2 laws below the head.
    assert_eq!(fs::read_to_string(out.join("precompression.csv")).unwrap().lines().count(), 23);
}

#[test]
fn the_study_of_the_paper_judges_every_statement() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("paper");
    let flags = ["paper", "--model", "chain", "--quick", "--replicates", "2", "--out", out.to_str().unwrap()];
    let output = study(&flags);
    assert!(output.status.success(), "{}", said(&output));
    let judgements = json(&out.join("paper.json"))["judgements"].as_array().unwrap().len();
    assert_eq!(judgements, granchain_reproduction::paper::statements::STATEMENTS.len());
    assert!(String::from_utf8_lossy(&output.stdout).contains("linear.best-alpha"));
    // The page names the command that made it.
    assert!(fs::read_to_string(out.join("report.html")).unwrap().contains("--quick --replicates 2"));
}

#[test]
fn a_wrong_key_is_refused_before_anything_runs_and_leaves_nothing() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    for name in ["paper", "chain-length", "precompression", "dissipation"] {
        let output = study(&[name, "--set", "chain.bead=3", "--out", out.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains("chain.beads"), "{}", said(&output));
        assert!(!out.exists());
    }
}
