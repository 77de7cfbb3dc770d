//! `calibrate` with a fidelity level above the chain: what is written, and that a fit broken off on the upper fidelity level ends in the same bytes.
#![cfg(unix)]

use std::{
    fs,
    process::Stdio,
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
fn the_answer_of_the_upper_level_stands_beside_the_chains_and_survives_ctrl_c() {
    let bench = Bench::new();
    let output = bench.calibrate(&[&LADDER[..], &["--out", "whole", "--threads", "1"]].concat());
    assert!([0, 3].contains(&code(&output)), "{}", stderr(&output));
    let outcome = bench.outcome("whole");
    assert_eq!(outcome["model"], "reduced");
    let fidelities = outcome["rungs"].as_array().unwrap();
    let models: Vec<&Value> = fidelities.iter().map(|fidelity| &fidelity["model"]).collect();
    assert_eq!(models, ["chain", "reduced"]);
    assert_eq!(fidelities[0]["runs"], 200);
    let corrected = fidelities[1]["runs"].as_u64().unwrap();
    assert!((80..=176).contains(&corrected), "{corrected}");
    assert_eq!(outcome["evaluations"], 200 + corrected);
    assert_eq!(fidelities[1]["parameters"], outcome["parameters"]);
    assert_ne!(fidelities[0]["parameters"]["alpha"]["value"], outcome["parameters"]["alpha"]["value"]);
    // Two beads at the chain's α: both fidelity levels expect a peak of about 0.6 m/s, and not the same.
    let peak = |fidelity: &Value| fidelity["features"]["positive_peak"]["value"].as_f64().unwrap();
    assert!(
        (peak(&fidelities[0]) - 0.61).abs() < 0.06 && peak(&fidelities[0]) != peak(&fidelities[1]),
        "{fidelities:?}"
    );

    let page = fs::read_to_string(bench.path("whole/report.html")).unwrap();
    assert!(page.contains("How far the models differ") && page.contains("each round of runs was re-centred"));
    let timed =
        page.split("<!-- times -->").nth(1).and_then(|rest| rest.split("<!-- end of times -->").next()).unwrap();
    assert!(page.contains("What accuracy cost") && timed.contains(">chain<") && timed.contains(">reduced<"), "{timed}");
    assert!(bench.path("whole/figures/rungs-linear.svg").is_file(), "{:?}", bench.tree());
    assert_eq!(fs::read_to_string(bench.path("whole/runs-linear-chain.csv")).unwrap().lines().count(), 201);
    let timing: Value = serde_json::from_slice(&fs::read(bench.path("whole/timing.json")).unwrap()).unwrap();
    for fidelity in ["chain_s", "reduced_s"] {
        assert!(timing["breakdown"]["fit"][fidelity].as_f64().unwrap() > 0.0, "{timing}");
    }
}

/// Finite elements coarse enough for a hundred runs in half a minute.
const FINITE: [&str; 6] = ["--model", "fea", "--set", "model.mesh_density=3", "--set", "drive.cycles=12"];

#[test]
#[ignore = "slow, run by .ci/full"]
fn finite_elements_answer_above_the_reduced_model_and_lose_no_finished_run_to_kill_9() {
    let bench = Bench::new();
    let answered = |arguments: &[&str]| {
        let output = bench.calibrate(arguments);
        assert!([0, 3].contains(&code(&output)), "{}", stderr(&output));
        stderr(&output)
    };
    answered(&[&FINITE[..], &["--out", "whole", "--threads", "1"]].concat());
    let outcome = bench.outcome("whole");
    assert_eq!(outcome["model"], "fea");
    let fidelities = outcome["rungs"].as_array().unwrap();
    let models: Vec<&Value> = fidelities.iter().map(|fidelity| &fidelity["model"]).collect();
    assert_eq!(models, ["chain", "reduced", "fea"]);
    let runs: Vec<u64> = fidelities.iter().map(|fidelity| fidelity["runs"].as_u64().unwrap()).collect();
    assert_eq!(runs.iter().sum::<u64>(), outcome["evaluations"].as_u64().unwrap());
    assert!((80..=176).contains(&runs[2]), "{runs:?}");
    assert_eq!(fidelities[2]["parameters"], outcome["parameters"]);
    assert!(
        fidelities.iter().all(|fidelity| fidelity["features"]["positive_peak"]["value"].as_f64().is_some()),
        "{fidelities:?}"
    );
    for file in ["runs-linear-chain.csv", "runs-linear-reduced.csv", "figures/rungs-linear.svg"] {
        assert!(bench.path("whole").join(file).is_file(), "{:?}", bench.tree());
    }

    // What lies below is what the amplitudes of the reduced model answer by themselves.
    bench.write("plan.toml", "likelihood = \"amplitudes\"\n");
    answered(&[&["--plan", "plan.toml", "--model", "reduced"], &FINITE[2..], &["--out", "reduced"]].concat());
    assert_eq!(bench.outcome("reduced")["parameters"], fidelities[1]["parameters"]);
    assert_ne!(fidelities[1]["parameters"], fidelities[2]["parameters"]);

    let kept = bench.path(".broken.unfinished/state/linear-fea.jsonl");
    let lines = || fs::read_to_string(&kept).map_or(0, |text| text.lines().count());
    let arguments = [&FINITE[..], &["--out", "broken"]].concat();
    let mut child = bench.command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let patience = Instant::now() + Duration::from_secs(300);
    while lines() < 5 {
        assert!(child.try_wait().unwrap().is_none(), "the fit ended before it could be killed");
        assert!(Instant::now() < patience, "no run was kept");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    // The last line torn, the first one damaged: one is dropped, the other named, both are run again.
    let before = fs::read_to_string(&kept).unwrap();
    let altered = before.replacen("\"index\":", "\"index\"=", 1);
    fs::write(&kept, &altered[..altered.len() - 9]).unwrap();
    let said = answered(&[&arguments[..], &["--resume", "--threads", "2"]].concat());
    assert!(said.contains("linear-fea.jsonl:1: damaged"), "{said}");
    let (whole, broken) = (bench.contents("whole"), bench.contents("broken"));
    assert!(whole.keys().eq(broken.keys()), "{:?} {:?}", whole.keys(), broken.keys());
    for (name, bytes) in &whole {
        assert!(broken[name] == *bytes, "{name} differs");
    }
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn a_kept_run_of_finite_elements_is_not_made_again() {
    let scene = [&FINITE[..], &["--out", "out"]].concat();
    let bench = Bench::new();
    let kept = bench.path(".out.unfinished/state/linear-fea.jsonl");
    let mut child = bench.command(&scene).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let lines = || fs::read_to_string(&kept).map_or(0, |text| text.lines().count());
    while lines() < 40 {
        assert!(child.try_wait().unwrap().is_none(), "the fit ended before it could be killed");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let before = lines();
    let mut child = bench
        .command(&[&scene[..], &["--resume"]].concat())
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    while lines() == before {
        assert!(child.try_wait().unwrap().is_none(), "the fit ended before it went on");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let numbers: Vec<String> = fs::read_to_string(&kept)
        .unwrap()
        .lines()
        .map(|line| line.split("\"index\":").nth(1).unwrap().split(',').next().unwrap().to_owned())
        .collect();
    let distinct: std::collections::BTreeSet<&String> = numbers.iter().collect();
    assert_eq!(distinct.len(), numbers.len(), "{numbers:?}");
}
