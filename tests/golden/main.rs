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

use harness::{PROJECT, granchain};
use serde_json::Value;

/// Relative difference allowed on the processor type that wrote the numbers; rounding of sums whose order may change.
const SAME_PROCESSOR: f64 = 1e-9;

/// The same on any other processor: other vector units round otherwise.
const OTHER_PROCESSOR: f64 = 1e-6;

/// Absolute difference allowed, as a share of the relative one: what is left of two equal sums, such as an energy residual, has no relative accuracy.
const REMAINDER: f64 = 1e-6;

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
    let found: Value = serde_json::from_slice(&fs::read(out.join(result)).unwrap()).unwrap();
    let (file, processor) = (stored().join(format!("{name}.json")), stored().join("processor.txt"));
    if std::env::var("GOLDEN").is_ok_and(|mode| mode == "write") {
        fs::write(file, format!("{found:#}\n")).unwrap();
        fs::write(processor, format!("{}\n", self::processor())).unwrap();
        return;
    }
    let expected: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    let same = fs::read_to_string(processor).unwrap().trim() == self::processor();
    let mut differences = Vec::new();
    gather("", &expected, &found, if same { SAME_PROCESSOR } else { OTHER_PROCESSOR }, &mut differences);
    assert!(
        differences.is_empty(),
        "{name}: {} values differ from tests/golden/{name}.json; if that is intended, write them again: GOLDEN=write cargo test --release --test golden\n{}",
        differences.len(),
        differences.iter().take(20).cloned().collect::<Vec<_>>().join("\n")
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

/// Every place at which two values differ by more than a relative tolerance.
fn gather(place: &str, expected: &Value, found: &Value, tolerance: f64, differences: &mut Vec<String>) {
    match (expected, found) {
        (Value::Object(of_expected), Value::Object(of_found)) => {
            for (key, value) in of_expected {
                gather(
                    &format!("{place}/{key}"),
                    value,
                    of_found.get(key).unwrap_or(&Value::Null),
                    tolerance,
                    differences,
                );
            }
            for key in of_found.keys().filter(|key| !of_expected.contains_key(*key)) {
                differences.push(format!("{place}/{key}: not stored"));
            }
        }
        (Value::Array(of_expected), Value::Array(of_found)) if of_expected.len() == of_found.len() => {
            for (index, (expected, found)) in of_expected.iter().zip(of_found).enumerate() {
                gather(&format!("{place}/{index}"), expected, found, tolerance, differences);
            }
        }
        (Value::Number(of_expected), Value::Number(of_found)) => {
            let (a, b) = (of_expected.as_f64().unwrap(), of_found.as_f64().unwrap());
            if (a - b).abs() > tolerance * a.abs().max(b.abs()) + REMAINDER * tolerance {
                differences.push(format!("{place}: expected {expected}, found {found}"));
            }
        }
        _ if expected == found => {}
        _ => differences.push(format!("{place}: expected {expected}, found {found}")),
    }
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

#[test]
fn a_value_off_by_more_than_the_tolerance_is_found() {
    let (expected, found) = (serde_json::json!({"a": [1.0, "x"]}), serde_json::json!({"a": [1.0 + 1e-8, "x"], "b": 1}));
    let differences = |tolerance| {
        let mut differences = Vec::new();
        gather("", &expected, &found, tolerance, &mut differences);
        differences
    };
    assert_eq!(differences(1e-9), ["/a/0: expected 1.0, found 1.00000001", "/b: not stored"]);
    assert_eq!(differences(1e-6), ["/b: not stored"]);
}
