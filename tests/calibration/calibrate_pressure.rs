//! Calibration on a hydrophone's record: the shipped synthetic record is found again with its mount, and what cannot be is refused with help.

use std::{fs, path::Path, process::Command};

use crate::harness::{PROJECT, granchain};
use serde_json::Value;

const RECORD: &str = "measurements/twin-water/hydrophone.csv";

fn calibrate(arguments: &[&str]) -> (i32, String, String) {
    granchain(PROJECT, &[&["calibrate"], arguments].concat())
}

fn refused(arguments: &[&str]) -> String {
    let (code, _, said) = calibrate(arguments);
    assert_ne!(code, 0, "{arguments:?} was not refused");
    said
}

fn outcome(folder: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join("calibration.json")).unwrap()).unwrap()
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn the_shipped_synthetic_record_is_recovered_with_its_mount() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("water");
    let shipped = fs::read_to_string("calibrations/twin-water.toml").unwrap().replace(", \"free\"", "");
    let plan = place.path().join("plan.toml");
    fs::write(&plan, shipped.replace("..", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let (code, text, said) =
        calibrate(&["--plan", plan.to_str().unwrap(), "--evaluations", "600", "--out", out.to_str().unwrap()]);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("hydrophone at r = 0 m, z = 1 mm"), "{said}");
    assert!(said.contains("model `chain`, which the scene `water` names"), "{said}");
    assert!(said.contains("volts × 4 MPa/V (250 nV/Pa) (the header)"), "{said}");
    let outcome = outcome(&out);
    // measurements/twin-water/truth.toml
    assert_eq!((&outcome["quantity"], &outcome["mount"]), (&"pressure".into(), &"supported".into()), "{text}");
    assert_eq!(outcome["preferred_mount"], "supported", "{text}");
    assert_eq!(outcome["verdict"], "within scatter", "{text}");
    for (name, truth) in [("alpha", 0.45), ("damping", 0.4)] {
        let fitted = &outcome["parameters"][name];
        let (low, high) = (fitted["low"].as_f64().unwrap(), fitted["high"].as_f64().unwrap());
        assert!(low <= truth && truth <= high && high / low < 1.35, "{name}: {fitted}");
    }
    let other = outcome["laws"].as_array().unwrap().iter().find(|law| law["mount"] == "clamped").unwrap();
    assert_eq!(other["verdict"], "outside scatter", "{text}");
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("Pressure in the water") && page.contains("the supported disc"), "no word of the mount");
    let pressure = fs::read_to_string(out.join("simulated_pressure.csv")).unwrap();
    assert!(pressure.starts_with("time_s,pressure_pa\n"));
    // What was fitted comes back with its mount.
    let replay = Command::new(env!("CARGO_BIN_EXE_granchain"))
        .args(["replay", "--quiet", "--json", "--calibration"])
        .args([out.as_os_str(), "--out".as_ref(), place.path().join("replay").as_os_str()])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(replay.status.success(), "{}", String::from_utf8_lossy(&replay.stderr));
    assert!(String::from_utf8_lossy(&replay.stdout).contains("disc.rim=supported"));
}

#[test]
fn what_cannot_be_is_refused_with_what_to_do() {
    let quantity = ["--quantity", "pressure", "--measured", RECORD];
    let with = |more: &[&'static str]| refused(&[&quantity, more].concat());
    let said = with(&["--scene", "annulus"]);
    assert!(said.contains("no disc with water behind it") && said.contains("--scene water"), "{said}");
    let said = with(&["--set", "water.medium=none"]);
    assert!(said.contains("a vacuum behind its disc"), "{said}");
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("plan.toml").display().to_string();
    let planned = |text: &str, more: &[&str]| {
        fs::write(&path, text).unwrap();
        refused(&[&quantity[..], &["--plan", &path], more].concat())
    };
    let said = planned("mount = [\"glued\"]", &[]);
    assert!(said.contains("expected clamped, supported or free"), "{said}");
    let said = planned("mount = [\"clamped\", \"free\"]", &["--set", "chain.precompression=0.1N"]);
    assert!(said.contains("`free` cannot be") && said.contains("chain.precompression=0"), "{said}");
    let said = planned("features = \"paper\"", &[]);
    assert!(said.contains("leave `features` of the plan out"), "{said}");
    let said = with(&["--model", "reduced", "--set", "damping.at=beads"]);
    assert!(said.contains("--model chain"), "{said}");
    let said = with(&["--scale", "250 V/Pa"]);
    assert!(said.contains("4 mPa a volt"), "{said}");
    let said = refused(&["--measured", RECORD, "--scene", "annulus", "--drive", "none"]);
    assert!(said.contains("--quantity pressure"), "{said}");
    let velocity = "measurements/twin-annulus/vib.csv";
    let said = refused(&["--quantity", "pressure", "--measured", velocity, "--drive", "none"]);
    assert!(said.contains("expected a pressure") && said.contains("leave out --quantity pressure"), "{said}");
    fs::write(&path, "mount = [\"clamped\"]").unwrap();
    let said = refused(&["--measured", velocity, "--plan", &path]);
    assert!(said.contains("mounts of a disc") && said.contains("has none"), "{said}");
}

#[test]
fn a_velocity_s_terminal_says_which_model_was_taken() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("look");
    let velocity = "measurements/twin-annulus/vib.csv";
    // A key of the answering model alone is no error of the searching one.
    let finer = ["--set", "model.mesh_density=24"];
    let (code, _, said) =
        calibrate(&[&["--measured", velocity, "--dry-run", "--out", out.to_str().unwrap()], &finer[..]].concat());
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("model `reduced`, the default: search on the chain"), "{said}");
    let (_, _, said) = calibrate(&[
        "--measured",
        velocity,
        "--model",
        "chain",
        "--dry-run",
        "--force",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(!said.contains("assumed: model"), "{said}");
}
