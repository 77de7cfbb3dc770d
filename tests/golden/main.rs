//! Golden outcomes: four calibrations and four replays, run by the program and compared number by number with the stored ones.
//!
//! The stored numbers agree to 1e-9 on the processor type that wrote them and to 1e-6 on any other. After a change that is meant to move them,
//! write them again and look at the difference: `GOLDEN=write cargo test --release --test golden`.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

#[path = "../harness/mod.rs"]
mod harness;

use std::{
    fs,
    path::{Path, PathBuf},
};

use ::granchain::cli::verify::comparison::Comparison;
use harness::{PROJECT, granchain};
use serde_json::Value;

/// Where the stored numbers are.
fn stored() -> PathBuf {
    Path::new(PROJECT).join("tests/golden")
}

/// Run a command in the project's folder and compare the file `result` of its folder with `NAME.json`.
fn compare(name: &str, result: &str, command: &str) {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join(name);
    let words = shell_words::split(command).unwrap();
    let mut arguments: Vec<&str> = words.iter().map(String::as_str).collect();
    arguments.extend(["--quiet", "--out", out.to_str().unwrap()]);
    let (code, _, errors) = granchain(PROJECT, &arguments);
    assert_eq!(code, 0, "granchain {command}\n{errors}");
    let found = fs::read(out.join(result)).unwrap();
    let (file, processor) = (stored().join(format!("{name}.json")), stored().join("processor.txt"));
    if std::env::var("GOLDEN").is_ok_and(|mode| mode == "write") {
        let found: Value = serde_json::from_slice(&found).unwrap();
        fs::write(file, format!("{found:#}\n")).unwrap();
        fs::write(processor, format!("{}\n", self::processor())).unwrap();
        return;
    }
    let mut comparison = Comparison::new(fs::read_to_string(processor).unwrap().trim() == self::processor());
    comparison.documents(name, &fs::read(&file).unwrap(), &found);
    let differences = comparison.differences;
    assert!(
        differences.is_empty(),
        "{name}: {} values differ from tests/golden/{name}.json; if that is intended, write them again: GOLDEN=write cargo test --release --test golden\n{}",
        differences.len(),
        differences.iter().take(20).map(|it| format!("{it:?}")).collect::<Vec<_>>().join("\n")
    );
}

/// Architecture and widest vector unit, which decide the last digits.
fn processor() -> String {
    #[cfg(target_arch = "x86_64")]
    let vector =
        if std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma") { "avx2+fma" } else { "sse2" };
    #[cfg(not(target_arch = "x86_64"))]
    let vector = "default";
    format!("{} {vector}", std::env::consts::ARCH)
}

#[test]
fn calibration_of_a_synthetic_record_on_the_chain() {
    compare("calibrate-annulus-chain", "calibration.json", "calibrate --plan calibrations/twin-annulus.toml");
}

#[test]
fn joint_calibration_of_three_drive_levels() {
    compare("calibrate-levels", "calibration.json", "calibrate --plan calibrations/twin-levels.toml");
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn calibration_on_the_reduced_model() {
    let command = "calibrate --plan calibrations/annulus-73khz.toml --damping linear --evaluations 200";
    compare("calibrate-annulus-reduced", "calibration.json", command);
}

#[test]
fn calibration_to_a_pressure_in_water() {
    let command = "calibrate --plan tests/golden/water.toml --evaluations 200";
    compare("calibrate-water", "calibration.json", command);
}

#[test]
fn replay_of_the_rigid_chain() {
    compare("replay-rigid", "summary.json", "replay --scene rigid");
}

#[test]
fn replay_of_the_annulus_on_the_reduced_model() {
    compare("replay-annulus", "summary.json", "replay --scene annulus --set duration=400us");
}

#[test]
fn replay_of_two_beads_by_finite_elements() {
    let command = "replay --scene rigid --model fea --set chain.beads=2 --set model.mesh_density=8 --set duration=60us";
    compare("replay-fea", "summary.json", command);
}

#[test]
fn replay_of_the_disc_in_water() {
    compare("replay-water", "summary.json", "replay --scene water --set duration=200us");
}
