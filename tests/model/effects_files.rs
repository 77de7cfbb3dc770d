//! Off means absent for files too: a replay writes what its scene and flags ask for, and nothing of any other effect.

use std::{collections::BTreeSet, fs, path::Path, process::Command};

/// Files that every replay writes.
const PLAIN: [&str; 12] = [
    ".granchain",
    "chain.png",
    "chain.svg",
    "report.html",
    "response.csv",
    "response.png",
    "response.svg",
    "scene.toml",
    "spectrum.png",
    "spectrum.svg",
    "summary.json",
    "timing.json",
];

/// Files of a replay into `folder`, frames of a field as their folder.
fn written(folder: &Path, arguments: &[&str]) -> BTreeSet<String> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.args(["replay", "--quiet", "--cache", "none", "--out", folder.to_str().unwrap()]).args(arguments);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let names = |folder: &Path| {
        let entries = fs::read_dir(folder).into_iter().flatten();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect::<BTreeSet<String>>()
    };
    names(folder)
}

/// What `flags` add to the files of a plain run of the same scene.
fn added(scene: &[&str], flags: &[&str]) -> Vec<String> {
    let place = tempfile::tempdir().unwrap();
    let plain = written(&place.path().join("plain"), scene);
    let all: Vec<&str> = scene.iter().chain(flags).copied().collect();
    let asked = written(&place.path().join("asked"), &all);
    assert!(plain.is_subset(&asked), "{flags:?} lose {:?}", plain.difference(&asked).collect::<Vec<_>>());
    asked.difference(&plain).cloned().collect()
}

#[test]
fn a_plain_replay_writes_the_files_of_its_model() {
    let place = tempfile::tempdir().unwrap();
    let short = ["--scene", "rigid", "--set", "duration=14 us"];
    let runs: [(&str, &[&str]); 3] =
        [("chain", &[]), ("reduced", &["--set", "model.mesh_density=4"]), ("fea", &["--set", "model.mesh_density=4"])];
    for (model, sets) in runs {
        let arguments: Vec<&str> = short.iter().chain(&["--model", model]).chain(sets).copied().collect();
        let files = written(&place.path().join(model), &arguments);
        let expected: BTreeSet<String> = PLAIN.map(str::to_owned).into();
        assert_eq!(files, expected, "{model}");
    }
}

#[test]
fn each_effect_adds_its_own_files_and_no_other() {
    let fea: [&str; 8] =
        ["--scene", "rigid", "--model", "fea", "--set", "model.mesh_density=4", "--set", "duration=14 us"];
    assert_eq!(added(&fea, &["--fields", "7us"]), ["fields"]);

    let water = |medium: &'static str| {
        let sets = ["--set", "drive.cycles=8", "--set", "duration=125 us", "--set", medium];
        [&["--scene", "water", "--model", "chain"][..], &sets].concat()
    };
    let place = tempfile::tempdir().unwrap();
    let dry = written(&place.path().join("dry"), &water("water.medium=none"));
    let wet = written(&place.path().join("wet"), &water("water.method=rayleigh"));
    assert_eq!(dry, PLAIN.map(str::to_owned).into());
    let of_water: Vec<&String> = wet.difference(&dry).collect();
    assert_eq!(of_water, ["pressure.png", "pressure.svg", "pressure_spectrum.png", "pressure_spectrum.svg"]);
    assert!(dry.is_subset(&wet));
    assert_eq!(added(&water("water.method=rayleigh"), &["--export-interface"]), ["interface"]);
}
