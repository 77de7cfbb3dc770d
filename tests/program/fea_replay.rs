//! `granchain replay --model fea`: what it writes, what it refuses.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

/// A mesh and a duration that take a tenth of a second.
const SMALL: [&str; 8] =
    ["--scene", "rigid", "--model", "fea", "--set", "model.mesh_density=3", "--set", "duration=40us"];

fn replay(flags: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.arg("replay").args(flags);
    command
}

fn small(out: &Path, more: &[&str]) -> Command {
    let mut command = replay(&SMALL);
    command.args(["--out", out.to_str().unwrap()]).args(more);
    command
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn header(folder: &Path) -> String {
    fs::read_to_string(folder.join("response.csv")).unwrap().lines().next().unwrap().to_owned()
}

#[test]
fn an_analysis_writes_the_contract_of_a_replay_with_radii_behind_it() {
    let place = tempfile::tempdir().unwrap();
    let (chain, fea) = (place.path().join("chain"), place.path().join("fea"));
    let flags = ["--scene", "rigid", "--model", "chain", "--set", "duration=40us", "--out", chain.to_str().unwrap()];
    let chained = replay(&flags);
    assert!({ chained }.status().unwrap().success());
    let output = small(&fea, &[]).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let radii: String = (1..=7).map(|contact| format!(",contact{contact}_radius_m")).collect();
    assert_eq!(header(&fea), header(&chain) + &radii);

    let summary: serde_json::Value = serde_json::from_slice(&fs::read(fea.join("summary.json")).unwrap()).unwrap();
    let settings = &summary["settings"];
    assert_eq!((&settings["model"], &settings["integrator"]), (&"fea".into(), &"trapezoid".into()));
    assert_eq!(settings["mesh_density"], 3);
    let analysis = &summary["analysis"];
    assert_eq!(analysis["complementarity"]["violations"], 0);
    assert_eq!(analysis["contact_points"].as_array().unwrap().len(), 7);
    assert!(summary["work"]["unknowns"].as_u64().unwrap() > 1000);
    assert_eq!(summary["work"]["factorisations"], 1);
    assert!(!fea.join("fields").exists());
    // What the chain does not do is not in its summary.
    let plain: serde_json::Value = serde_json::from_slice(&fs::read(chain.join("summary.json")).unwrap()).unwrap();
    assert!(plain.get("analysis").is_none() && plain["work"].get("factorisations").is_none());
    // The last bead's velocity, roughly: a coarse mesh and 3 % of step error, over the first pulse.
    let peak = |folder: &Path| {
        let text = fs::read_to_string(folder.join("response.csv")).unwrap();
        let column = header(folder).split(',').position(|name| name == "bead6_velocity_m_per_s").unwrap();
        text.lines()
            .skip(1)
            .map(|line| line.split(',').nth(column).unwrap().parse::<f64>().unwrap())
            .fold(0.0, |largest: f64, value| largest.max(value.abs()))
    };
    assert!((peak(&fea) / peak(&chain) - 1.0).abs() < 0.1, "{} {}", peak(&fea), peak(&chain));
}

#[test]
fn frames_are_at_their_times_and_listed_once() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let output = small(&out, &["--fields", "10us"]).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    // What they take on disk is told with the first of them.
    let notice = said(&output).lines().find(|line| line.starts_with("--fields: 5 frames of ")).map(str::to_owned);
    assert!(notice.is_some_and(|notice| notice.ends_with(" MB in all")), "{}", said(&output));
    let list = fs::read_to_string(out.join("fields/fields.pvd")).unwrap();
    let document = roxmltree::Document::parse(&list).unwrap();
    let frames: Vec<(f64, String)> = document
        .descendants()
        .filter(|node| node.has_tag_name("DataSet"))
        .map(|node| (node.attribute("timestep").unwrap().parse().unwrap(), node.attribute("file").unwrap().to_owned()))
        .collect();
    assert_eq!(frames.len(), 5);
    for (number, (time, file)) in frames.iter().enumerate() {
        // One rounding of the product.
        assert!((time - 1e-5 * number as f64).abs() < 1e-20);
        assert!(fs::read_to_string(out.join("fields").join(file)).unwrap().contains("von_mises"));
    }
    assert_eq!(fs::read_dir(out.join("fields")).unwrap().count(), 6);
    let summary = fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("\"field_frames\": 5"));
}

#[test]
fn flags_that_a_run_does_not_use_and_intervals_between_steps_are_usage_errors() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let refused = |command: &mut Command, what: &str| {
        let output = command.output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains(what), "{}", said(&output));
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
    };
    let chain = ["--scene", "rigid", "--out", out.to_str().unwrap()];
    refused(replay(&chain).args(["--fields", "5us"]), "--fields belongs to --model fea");
    refused(replay(&chain).args(["--checkpoint", "5us"]), "a replay that is stopped begins again");
    refused(replay(&SMALL).args(["--fields", "5us"]), "--out");
    refused(&mut small(&out, &["--fields", "1.05us"]), "expected a whole number of steps of 100");
    refused(&mut small(&out, &["--fields", "5"]), "unit");
}

#[test]
fn a_run_that_cannot_be_made_leaves_nothing_behind() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let output = small(&out, &["--set", "piston.contact=half-space"]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(said(&output).contains("piston.contact"), "{}", said(&output));
    let output = small(&out, &["--set", "model.step=1us"]).output().unwrap();
    assert!(said(&output).contains("a twentieth of a drive period"), "{}", said(&output));
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
}
