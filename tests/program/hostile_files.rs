//! Files that the program reads back, made by a stranger: without end, of any size, with runs that cannot be.

#![cfg(unix)]

use std::{
    fs,
    os::unix::fs::symlink,
    path::Path,
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use crate::{
    calibrate_bench::Bench,
    harness::{code, granchain, stderr},
};

const SWEEP: [&str; 7] = ["sweep", "--scene", "rigid", "--set", "duration=100us", "--vary", "alpha=0.5,0.7"];
/// Run to the end, which must come within a minute.
fn ended(mut command: Command) -> Output {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let patience = Instant::now() + Duration::from_secs(60);
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > patience {
            child.kill().unwrap();
            panic!("{command:?} did not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.current_dir(folder).env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR")).args(arguments);
    ended(command)
}

fn refused(output: &Output, expected: &[&str]) {
    let error = stderr(output);
    assert_eq!(code(output), 1, "{error}");
    assert!(expected.iter().all(|text| error.contains(text)), "{expected:?}: {error}");
}

/// A file of 1 TiB that takes no room.
fn endless(path: &Path) {
    fs::File::options().create(true).truncate(false).write(true).open(path).unwrap().set_len(1 << 40).unwrap();
}

#[test]
fn files_of_a_calibration_without_end_are_refused_before_they_are_read() {
    let bench = Bench::new();
    bench.add_horn_tip();
    let output = bench.calibrate(&["--out", "fresh", "--quiet"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let files = [
        "calibration.json",
        "manifest.json",
        "fingerprints.csv",
        "report.md",
        "report.html",
        "timing.json",
        ".granchain",
    ];
    for name in files {
        let path = bench.path("fresh").join(name);
        let whole = fs::read(&path).unwrap();
        for link in [true, false] {
            if link {
                fs::remove_file(&path).unwrap();
                symlink("/dev/zero", &path).unwrap();
            } else {
                endless(&path);
            }
            // The list of the folder says nothing of numbers: it is not read.
            if name != ".granchain" {
                refused(&ended(bench.granchain(&["verify", "fresh", "--cache", "none"])), &[name]);
            }
            if name == "calibration.json" {
                let replay = ["replay", "--calibration", "fresh", "--scene", "rigid", "--set", "duration=60us"];
                refused(&ended(bench.granchain(&replay)), &[name, "expected a plain file of at most"]);
            }
            // A later calibration looks whose folder it is, and at what stands there.
            refused(&ended(bench.command(&["--out", "fresh", "--quiet"])), &[name]);
            fs::remove_file(&path).unwrap();
            fs::write(&path, &whole).unwrap();
        }
    }
}

/// A run that has everything but its place, which a stranger's folders take.
fn unfinished(command: &[&str]) -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    for figure in ["sweep.svg", "spectrum.svg"] {
        fs::create_dir_all(place.path().join("out").join(figure)).unwrap();
        fs::write(place.path().join("out").join(figure).join("mine"), "").unwrap();
    }
    let output = run(place.path(), &[command, &["--out", "out", "--force"]].concat());
    refused(&output, &["the finished results are kept", ".out.unfinished"]);
    fs::remove_dir_all(place.path().join("out")).unwrap();
    place
}

fn resumed(place: &Path, command: &[&str]) -> Output {
    run(place, &[command, &["--out", "out", "--resume"]].concat())
}

#[test]
fn states_without_end_are_refused_before_they_are_read() {
    let place = unfinished(&SWEEP);
    let state = place.path().join(".out.unfinished/state");
    for name in ["command", "plan.json"] {
        let whole = fs::read(state.join(name)).unwrap();
        endless(&state.join(name));
        refused(&resumed(place.path(), &SWEEP), &[".out.unfinished"]);
        fs::write(state.join(name), &whole).unwrap();
    }
    endless(&state.join("runs.jsonl"));
    let output = resumed(place.path(), &SWEEP);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}

#[test]
fn runs_with_too_few_numbers_are_run_again() {
    let command = [&SWEEP[..], &["--ensemble", "2"]].concat();
    let place = unfinished(&command);
    let whole = run(place.path(), &[&command[..], &["--out", "whole"]].concat());
    assert_eq!(code(&whole), 0, "{}", stderr(&whole));
    let log = place.path().join(".out.unfinished/state/runs.jsonl");
    let before = fs::read(&log).unwrap();
    let forged: Vec<u8> = before
        .split(|byte| *byte == b'\n')
        .filter(|line| !line.is_empty())
        .enumerate()
        .flat_map(|(number, line)| {
            let mut value: Value = serde_json::from_slice(line).unwrap();
            let finished = &mut value["run"]["finished"];
            if number == 0 {
                finished["observation"] = json!([]);
            } else {
                finished["ensemble"]["spreads"] = json!([]);
            }
            [serde_json::to_vec(&value).unwrap(), vec![b'\n']].concat()
        })
        .collect();
    fs::write(&log, forged).unwrap();
    let output = resumed(place.path(), &command);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stderr(&output).contains("runs.jsonl:1, 2: damaged"), "{}", stderr(&output));
    for name in ["sweep.csv", "sweep.json", "report.html"] {
        assert!(
            fs::read(place.path().join("out").join(name)).unwrap()
                == fs::read(place.path().join("whole").join(name)).unwrap()
        );
    }
    // The same in a part.
    let part = [&SWEEP[..], &["--part", "1/1", "--out", "1.part"]].concat();
    assert_eq!(granchain(place.path(), &part).0, 0);
    let path = place.path().join("1.part");
    let mut file: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    file["runs"][0]["finished"]["observation"] = json!([]);
    fs::write(&path, serde_json::to_vec(&file).unwrap()).unwrap();
    let merged = run(place.path(), &["merge", "1.part", "--out", "merged"]);
    refused(&merged, &["1.part: expected runs of its command", "watched numbers, found 0"]);
}
