//! A fit that is killed or stopped leaves nothing that hinders the next one, which ends in the bytes of one that was left alone. Finite element runs
//! that are kept: `calibrate_ladder.rs`.
#![cfg(unix)]

use std::{
    process::{Command, Stdio},
    time::Duration,
};

use crate::{
    calibrate_bench::Bench,
    harness::{code, stderr},
};

const FIT: [&str; 4] = ["--evaluations", "400", "--damping", "linear,kuwabara-kono"];

#[test]
fn a_fit_after_one_that_was_killed_or_stopped_gives_the_bytes_of_an_unbroken_fit() {
    let bench = Bench::new();
    let fit = |more: &[&str]| bench.command(&[&FIT, more].concat());
    assert_eq!(code(&fit(&["--out", "whole", "--threads", "1"]).output().unwrap()), 0);
    let work = bench.path(".broken.unfinished");
    for signal in ["-KILL", "-INT"] {
        let child = fit(&["--out", "broken"]).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(400));
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        assert!(!output.status.success() && !bench.path("broken").exists(), "{}", stderr(&output));
        if signal == "-INT" {
            assert_eq!(code(&output), 130, "{}", stderr(&output));
            assert!(!work.exists() && !stderr(&output).contains("--resume"), "{}", stderr(&output));
        }
    }
    let output = fit(&["--out", "broken", "--threads", "2"]).output().unwrap();
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let (whole, broken) = (bench.contents("whole"), bench.contents("broken"));
    assert!(whole.contains_key("calibration.json") && whole.contains_key("report.json"));
    assert!(whole.keys().eq(broken.keys()), "{:?} {:?}", whole.keys(), broken.keys());
    for (name, bytes) in &whole {
        assert!(broken[name] == *bytes, "{name} differs");
    }
    assert!(!work.exists());
    let output = bench.calibrate(&["--out", "broken", "--resume"]);
    assert!(code(&output) == 1 && stderr(&output).contains("no unfinished run"), "{}", stderr(&output));
}
