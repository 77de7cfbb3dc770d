//! `granchain convergence` from the command line.

use std::{fs, path::Path};

use assert_cmd::Command;

const SMALL: [&str; 10] = [
    "--densities",
    "4",
    "--steps",
    "0.1us,0.05us",
    "--reference-density",
    "4",
    "--reference-step",
    "0.02us",
    "--windows",
    "0us:10us,10us:20us",
];

fn granchain(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("granchain").unwrap();
    command.arg("convergence").args(arguments);
    command
}

fn read(folder: &Path, file: &str) -> String {
    fs::read_to_string(folder.join(file)).unwrap()
}

#[test]
fn a_study_writes_page_tables_and_figures_that_do_not_depend_on_the_threads() {
    let place = tempfile::tempdir().unwrap();
    let folders = ["1", "2"].map(|threads| {
        let folder = place.path().join(threads);
        granchain(&SMALL).args(["--threads", threads, "--quiet", "--out"]).arg(&folder).assert().success();
        folder
    });
    for file in ["report.html", "convergence.json", "errors.csv", "velocity.csv", "figures/work-precision.svg"] {
        let [one, two] = folders.clone().map(|folder| read(&folder, file));
        assert!(one == two && !one.is_empty(), "{file}");
    }
    let value: serde_json::Value = serde_json::from_str(&read(&folders[0], "convergence.json")).unwrap();
    let runs = value["convergence"]["runs"].as_array().unwrap();
    let errors: Vec<f64> = runs.iter().map(|run| run["errors"][0].as_f64().unwrap()).collect();
    assert!(errors.len() == 2 && errors[1] < 0.5 * errors[0] && errors[0] < 0.02, "{errors:?}");
    // The finite elements lead the chain by 0.05 to 0.15 us, and so does a chain of stiffer contacts.
    for key in ["fea_s", "stiffened_s"] {
        let lead = value["convergence"]["lead"][key].as_f64().unwrap();
        assert!((0.05e-6..0.15e-6).contains(&lead), "{key} {lead:e}");
    }
    assert!(read(&folders[0], "report.html").contains("Hertz takes each body for a half-space"));
    assert!(read(&folders[0], "timing.json").contains("run_s"));
}

#[test]
fn plans_that_show_nothing_are_refused_before_anything_is_run() {
    let refused = |arguments: &[&str], code: i32, said: &str| {
        let output = granchain(arguments).assert().failure().code(code).get_output().clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(message.contains(said), "{arguments:?}: {message}");
    };
    refused(&["--reference-step", "0.1us"], 2, "lower --reference-step");
    refused(&["--reference-density", "8"], 2, "raise --reference-density");
    refused(&["--windows", "3us"], 2, "expected FROM:TO");
    refused(&["--windows", "3us:1us"], 2, "window 1");
    refused(&["--densities", "1"], 1, "model.mesh_density");
    refused(&["--steps", "5us"], 1, "a twentieth of a drive period");
    refused(&["--scene", "nowhere"], 1, "nowhere");
}
