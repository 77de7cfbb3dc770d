//! A fit that is killed or stopped and resumed ends in the same bytes as one that was left alone; a state that belongs to
//! another fit, or is damaged, is refused and kept.
#![cfg(unix)]

use std::{
    fs,
    os::unix::process::ExitStatusExt,
    path::Path,
    process::{Child, Command, Output, Stdio},
    time::{Duration, Instant},
};

use crate::{
    calibrate_bench::Bench,
    harness::{code, stderr},
};
use granchain::measurement::seal::unsealed;
use serde_json::Value;

const FIT: [&str; 4] = ["--evaluations", "400", "--damping", "linear,kuwabara-kono"];

fn fit(bench: &Bench, more: &[&str]) -> Command {
    bench.command(&[&FIT, more].concat())
}

fn batches(state: &Path) -> u64 {
    // The file is renamed into place, so it is there whole or not at all.
    fs::read(state)
        .map(|bytes| {
            serde_json::from_slice::<Value>(unsealed(&bytes).unwrap()).unwrap()["search"]["batch"].as_u64().unwrap()
        })
        .unwrap_or(0)
}

/// Start a fit and wait until the state holds this many batches.
fn start(command: &mut Command, state: &Path, wanted: u64) -> Child {
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let patience = Instant::now() + Duration::from_secs(60);
    while batches(state) < wanted {
        assert!(child.try_wait().unwrap().is_none(), "the fit ended before it could be stopped");
        assert!(Instant::now() < patience, "no batch was saved");
        std::thread::sleep(Duration::from_millis(2));
    }
    child
}

fn refused(output: &Output, phrases: &[&str]) {
    assert_eq!(code(output), 1, "{}", stderr(output));
    for expected in phrases {
        assert!(stderr(output).contains(expected), "{expected}: {}", stderr(output));
    }
}

#[test]
fn killed_at_half_and_resumed_gives_the_bytes_of_an_unbroken_fit() {
    let bench = Bench::new();
    assert_eq!(code(&fit(&bench, &["--out", "whole", "--threads", "1"]).output().unwrap()), 0);

    // Half: the first law is fitted, the second has begun.
    let state = bench.path(".broken.unfinished/state");
    let second = state.join("kuwabara-kono.json");
    let mut child = start(&mut fit(&bench, &["--out", "broken"]), &second, 2);
    child.kill().unwrap();
    assert_eq!(child.wait().unwrap().signal(), Some(9));
    assert!(!bench.path("broken").exists());
    assert!((2..8).contains(&batches(&second)));

    let saved = fs::read(&second).unwrap();
    let resumed = |more: &[&str]| fit(&bench, &[&["--out", "broken"], more].concat()).output().unwrap();
    refused(&resumed(&[]), &[".broken.unfinished", "--resume", "--force"]);
    let other = fs::read_to_string(bench.path("lab/vib.csv")).unwrap().replacen("0.0,", "0.0,1", 1);
    bench.write("lab/other.csv", other);
    bench.write("paper.toml", "features = \"paper\"");
    for other in [
        &["--resume", "--seed", "2"][..],
        &["--resume", "--bounds", "alpha=0.3:1.5"],
        &["--resume", "--set", "damping.at=beads"],
        &["--resume", "--plan", "paper.toml"],
    ] {
        refused(&resumed(other), &[".broken.unfinished/state/", "another fit", "seed", "--out"]);
    }
    let mut swapped = bench.granchain(&["calibrate", "--scene", "bench.toml", "--measured", "lab/other.csv"]);
    let swapped = swapped.args(FIT).args(["--out", "broken", "--resume"]).output().unwrap();
    refused(&swapped, &[".broken.unfinished/state/", "record"]);
    fs::write(&second, &saved[..saved.len() / 2]).unwrap();
    refused(&resumed(&["--resume"]), &["kuwabara-kono.json", "damaged", "--force"]);
    // Another number that is read as well as the first.
    let text = String::from_utf8(saved.clone()).unwrap();
    let digit = text.rfind(".1").unwrap() + 1;
    fs::write(&second, format!("{}2{}", &text[..digit], &text[digit + 1..])).unwrap();
    refused(&resumed(&["--resume"]), &["kuwabara-kono.json", "altered", "--force"]);
    fs::write(&second, &saved).unwrap();

    let output = resumed(&["--resume", "--threads", "2"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let (whole, broken) = (bench.contents("whole"), bench.contents("broken"));
    assert!(whole.contains_key("calibration.json") && whole.contains_key("report.json"));
    assert!(whole.keys().eq(broken.keys()), "{:?} {:?}", whole.keys(), broken.keys());
    for (name, bytes) in &whole {
        assert!(broken[name] == *bytes, "{name} differs");
    }
    assert!(!bench.path(".broken.unfinished").exists());
}

#[test]
fn ctrl_c_keeps_the_state_says_so_and_ends_with_130() {
    let bench = Bench::new();
    assert_eq!(code(&bench.calibrate(&["--out", "whole"])), 0);
    let state = bench.path(".broken.unfinished/state/linear.json");
    let child = start(&mut bench.command(&["--out", "broken"]), &state, 1);
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(code(&output), 130, "{}", stderr(&output));
    assert!(stderr(&output).contains("--resume"), "{}", stderr(&output));
    assert!(state.exists() && !bench.path("broken").exists());
    let output = bench.calibrate(&["--out", "broken", "--resume"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(bench.contents("whole") == bench.contents("broken"));
    refused(&bench.calibrate(&["--out", "broken", "--resume"]), &["no unfinished run"]);
}
