//! `calibrate` with a rung above the chain: what is written, and that a fit broken off on the upper rung ends in the same bytes.
#![cfg(unix)]

use std::{
    fs,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use crate::{
    calibrate_bench::Bench,
    harness::{code, stderr},
};
use serde_json::Value;

const LADDER: [&str; 4] = ["--model", "reduced", "--set", "model.mesh_density=6"];

#[test]
#[ignore = "slow, run by .ci/full"]
fn the_answer_of_the_upper_rung_stands_beside_the_chains_and_survives_ctrl_c() {
    let bench = Bench::new();
    let output = bench.calibrate(&[&LADDER[..], &["--out", "whole", "--threads", "1"]].concat());
    assert!([0, 3].contains(&code(&output)), "{}", stderr(&output));
    let outcome = bench.outcome("whole");
    assert_eq!(outcome["model"], "reduced");
    let rungs = outcome["rungs"].as_array().unwrap();
    let models: Vec<&Value> = rungs.iter().map(|rung| &rung["model"]).collect();
    assert_eq!(models, ["chain", "reduced"]);
    assert_eq!(rungs[0]["runs"], 200);
    let corrected = rungs[1]["runs"].as_u64().unwrap();
    assert!((112..=176).contains(&corrected), "{corrected}");
    assert_eq!(outcome["evaluations"], 200 + corrected);
    assert_eq!(rungs[1]["parameters"], outcome["parameters"]);
    assert_ne!(rungs[0]["parameters"]["alpha"]["value"], outcome["parameters"]["alpha"]["value"]);
    // Two beads at the chain's α: both rungs expect a peak of about 0.6 m/s, and not the same.
    let peak = |rung: &Value| rung["features"]["positive_peak"]["value"].as_f64().unwrap();
    assert!((peak(&rungs[0]) - 0.61).abs() < 0.06 && peak(&rungs[0]) != peak(&rungs[1]), "{rungs:?}");

    let page = fs::read_to_string(bench.path("whole/report.html")).unwrap();
    assert!(page.contains("How far the rungs differ") && page.contains("before and after the correction"));
    assert!(bench.path("whole/figures/rungs-linear.svg").is_file(), "{:?}", bench.tree());
    assert_eq!(fs::read_to_string(bench.path("whole/runs-linear-chain.csv")).unwrap().lines().count(), 201);
    let timing: Value = serde_json::from_slice(&fs::read(bench.path("whole/timing.json")).unwrap()).unwrap();
    for rung in ["chain_s", "reduced_s"] {
        assert!(timing["breakdown"]["fit"][rung].as_f64().unwrap() > 0.0, "{timing}");
    }

    let state = bench.path(".broken.unfinished/state/linear-reduced.json");
    let told = [&LADDER[..], &["--out", "broken"]].concat();
    let mut child = bench.command(&told).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let patience = Instant::now() + Duration::from_secs(300);
    while !state.exists() {
        assert!(child.try_wait().unwrap().is_none(), "the fit ended before it could be stopped");
        assert!(Instant::now() < patience, "no round was saved");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(code(&output), 130, "{}", stderr(&output));
    assert!(stderr(&output).contains("--resume") && state.exists(), "{}", stderr(&output));
    let output = bench.calibrate(&[&told[..], &["--resume", "--threads", "2"]].concat());
    assert!([0, 3].contains(&code(&output)), "{}", stderr(&output));
    let (whole, broken) = (bench.contents("whole"), bench.contents("broken"));
    assert!(whole.keys().eq(broken.keys()), "{:?} {:?}", whole.keys(), broken.keys());
    for (name, bytes) in &whole {
        assert!(broken[name] == *bytes, "{name} differs");
    }
}

#[test]
fn the_finite_element_analysis_confirms_but_is_not_fitted() {
    let bench = Bench::new();
    let output = bench.calibrate(&["--model", "fea", "--out", "out"]);
    assert_eq!(code(&output), 2);
    assert!(stderr(&output).contains("--confirm fea"), "{}", stderr(&output));
}
