//! `batch`: chunks that any worker may do. With a real cluster: `tests/cluster/run`.

use std::{collections::BTreeMap, fs, path::Path, process::Command};

use super::harness::{code, granchain, stderr, stdout};

const SWEEP: [&str; 8] = ["sweep", "--scene", "annulus", "--model", "chain", "--vary", "alpha=0.3:0.9:0.1", "--quiet"];

/// `batch plan scan.batch --chunk 3 -- sweep … --out far`.
fn planned(folder: &Path, more: &[&str]) {
    let plan = [&["batch", "plan", "scan.batch", "--chunk", "3", "--"][..], &SWEEP, more, &["--out", "far"]].concat();
    let (code, told, error) = granchain(folder, &plan);
    assert_eq!(code, 0, "{error}");
    assert!(told.contains("7 points in 3 chunks, 0 to 2"), "{told}");
}

fn run_chunks(folder: &Path, chunks: &[&str]) {
    for chunk in chunks {
        let (code, _, error) = granchain(folder, &["batch", "run-chunk", "scan.batch", chunk, "--quiet"]);
        assert_eq!(code, 0, "{error}");
    }
}

/// Every file of a folder but the times.
fn bytes(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
    let kept = entries.filter(|path| path.is_file() && !["timing.json", ".granchain"].contains(&name(path).as_str()));
    kept.map(|path| (name(&path), fs::read(&path).unwrap())).collect()
}

fn refused(folder: &Path, arguments: &[&str], expected: &[&str]) {
    let (code, _, error) = granchain(folder, arguments);
    assert_eq!(code, 1, "{arguments:?}: {error}");
    for text in expected {
        assert!(error.contains(text), "{arguments:?}: expected `{text}` in\n{error}");
    }
}

#[test]
fn chunks_done_in_any_order_and_twice_give_the_bytes_of_one_run_here() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let (code, here, _) = granchain(folder, &[&SWEEP[..], &["--out", "here"]].concat());
    assert_eq!(code, 0);
    planned(folder, &[]);
    run_chunks(folder, &["2", "0"]);
    let kept = fs::read(folder.join("scan.batch/chunks/0.json")).unwrap();
    let (_, told, _) = granchain(folder, &["batch", "status", "scan.batch"]);
    assert!(told.contains("2 of 3 chunks are done") && told.contains("1 is not"), "{told}");
    run_chunks(folder, &["0", "1"]);
    assert_eq!(fs::read(folder.join("scan.batch/chunks/0.json")).unwrap(), kept);
    let (code, far, error) = granchain(folder, &["batch", "collect", "scan.batch", "--quiet"]);
    assert_eq!(code, 0, "{error}");
    assert_eq!(far, here);
    assert_eq!(bytes(&folder.join("far")), bytes(&folder.join("here")));
    assert!(!folder.join("scan.batch").exists(), "the results stand");
}

#[test]
fn a_worker_may_begin_in_another_folder() {
    let place = tempfile::tempdir().unwrap();
    planned(place.path(), &[]);
    let batch = place.path().join("scan.batch");
    let elsewhere = tempfile::tempdir().unwrap();
    let (code, _, error) = granchain(elsewhere.path(), &["batch", "run-chunk", batch.to_str().unwrap(), "1"]);
    assert_eq!(code, 0, "{error}");
    assert!(batch.join("chunks/1.json").exists());
}

#[test]
fn what_is_missing_altered_or_planned_for_other_files_is_not_collected() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let drive = super::harness::PROJECT.to_owned() + "/measurements/twin-annulus/horn_tip.csv";
    let drive = fs::read_to_string(drive).unwrap();
    fs::write(folder.join("horn.csv"), &drive).unwrap();
    planned(folder, &["--drive", "horn.csv"]);
    refused(folder, &["batch", "run-chunk", "scan.batch", "3"], &["a chunk from 0 to 2", "found 3"]);
    run_chunks(folder, &["0", "1"]);
    refused(folder, &["batch", "collect", "scan.batch"], &["1 of 3 chunks have no result (2)", "run-chunk"]);
    run_chunks(folder, &["2"]);
    let chunk = folder.join("scan.batch/chunks/1.json");
    let whole = fs::read(&chunk).unwrap();
    let altered = String::from_utf8(whole.clone()).unwrap().replacen("\"value\":1", "\"value\":2", 1);
    let altered = if altered.as_bytes() == whole { altered.replacen('7', "8", 1) } else { altered };
    fs::write(&chunk, altered).unwrap();
    refused(folder, &["batch", "collect", "scan.batch"], &["1.json", "altered", "delete it"]);
    fs::copy(folder.join("scan.batch/chunks/0.json"), &chunk).unwrap();
    refused(folder, &["batch", "collect", "scan.batch"], &["other points than chunk 1"]);
    fs::write(&chunk, &whole).unwrap();
    fs::write(folder.join("horn.csv"), drive.replacen("0.0", "0.1", 1) + "\n").unwrap();
    refused(folder, &["batch", "run-chunk", "scan.batch", "1"], &["changed since"]);
    refused(folder, &["batch", "collect", "scan.batch"], &["changed since"]);
    assert!(!folder.join("far").exists());
}

#[test]
fn unlike_processors_are_named_and_refused_by_choice() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    planned(folder, &[]);
    run_chunks(folder, &["0", "1", "2"]);
    let chunk = folder.join("scan.batch/chunks/1.json");
    let body = fs::read(&chunk).unwrap();
    let body = String::from_utf8(granchain::measurement::seal::unsealed(&body).unwrap().to_vec()).unwrap();
    let other = body.replacen(&granchain::model::vector_unit(), "another processor", 1);
    assert_ne!(other, body);
    fs::write(&chunk, granchain::measurement::seal::sealed(other.as_bytes())).unwrap();
    refused(folder, &["batch", "collect", "scan.batch", "--same-processor"], &["another processor"]);
    let (code, _, error) = granchain(folder, &["batch", "collect", "scan.batch"]);
    assert!(code == 0 && error.contains("warning") && error.contains("another processor"), "{error}");
}

#[test]
fn a_batch_of_another_version_is_left_alone() {
    let place = tempfile::tempdir().unwrap();
    planned(place.path(), &[]);
    let plan = place.path().join("scan.batch/batch.json");
    let text = fs::read_to_string(&plan).unwrap();
    let program = granchain::calibration::problem::program();
    fs::write(&plan, text.replacen(&program, "granchain 0.0.9", 1)).unwrap();
    for action in ["status", "collect"] {
        refused(place.path(), &["batch", action, "scan.batch"], &["planned by granchain 0.0.9", &program]);
    }
}

#[test]
fn a_folder_that_stands_and_a_command_without_points_are_refused() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    planned(folder, &[]);
    let again = [&["batch", "plan", "scan.batch", "--chunk", "3", "--"][..], &SWEEP, &["--out", "far"]].concat();
    refused(folder, &again, &["expected a new folder", "scan.batch"]);
    let (code, _, error) = granchain(folder, &["batch", "plan", "other", "--", "replay", "--scene", "rigid"]);
    assert!(code == 2 && error.contains("sweep, twins or study, found `replay`"), "{error}");
    let (code, _, error) = granchain(folder, &[&["batch", "plan", "other", "--"][..], &SWEEP].concat());
    assert!(code == 2 && error.contains("--out"), "{error}");
    refused(folder, &["batch", "status", "nothing-here"], &["expected the folder of a batch"]);
    refused(folder, &["batch", "retry", "scan.batch"], &["nothing was submitted yet"]);
}

#[test]
fn without_slurm_on_this_machine_that_is_said_and_the_batch_is_kept() {
    let place = tempfile::tempdir().unwrap();
    let empty = place.path().join("no-programs");
    fs::create_dir(&empty).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.args(SWEEP).args(["--out", "far", "--on", "slurm", "--chunk", "3"]).env("PATH", &empty);
    let output = command.current_dir(place.path()).output().unwrap();
    let error = stderr(&output);
    assert!(code(&output) == 1 && error.contains("needs Slurm's commands on this machine"), "{error}");
    assert!(place.path().join("far.batch/batch.json").exists());
    assert!(!place.path().join("far").exists());
}

#[test]
#[cfg(unix)]
fn a_chunk_that_finds_no_room_leaves_no_file_and_says_so() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    planned(folder, &[]);
    let chunks = folder.join("scan.batch/chunks");
    // Files of at most 512 bytes: a write fails where a full disk makes it fail.
    let line = "trap '' XFSZ; ulimit -f 1; exec \"$0\" batch run-chunk scan.batch 1 --cache none";
    let mut limited = Command::new("sh");
    let output = limited.args(["-c", line, env!("CARGO_BIN_EXE_granchain")]).current_dir(folder).output().unwrap();
    let error = stderr(&output);
    assert!(code(&output) == 1 && error.contains("chunks/1.json: cannot write"), "{error}");
    assert_eq!(fs::read_dir(&chunks).unwrap().count(), 0, "nothing is left");
    run_chunks(folder, &["0", "1", "2"]);
    let (code, ..) = granchain(folder, &["batch", "collect", "scan.batch", "--quiet"]);
    assert_eq!(code, 0);
}

/// The same from a batch of two workers as from one run here.
fn same_in_parts(command: &[&str], chunk: &str, chunks: usize) {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let (code, here, error) = granchain(folder, &[command, &["--out", "here", "--quiet"]].concat());
    assert_eq!(code, 0, "{error}");
    let plan = [&["batch", "plan", "parts", "--chunk", chunk, "--"], command, &["--out", "far", "--quiet"]].concat();
    let (code, _, error) = granchain(folder, &plan);
    assert_eq!(code, 0, "{error}");
    for part in (0..chunks).rev() {
        let (code, _, error) = granchain(folder, &["batch", "run-chunk", "parts", &part.to_string(), "--quiet"]);
        assert_eq!(code, 0, "{error}");
    }
    let (code, far, error) = granchain(folder, &["batch", "collect", "parts", "--quiet"]);
    assert_eq!(code, 0, "{error}");
    assert_eq!(far, here);
    assert_eq!(bytes(&folder.join("far")), bytes(&folder.join("here")));
}

#[test]
fn records_of_other_laboratories_are_the_same_in_parts() {
    let twins =
        ["twins", "--laboratory", "pretrigger,eight-bit", "--count", "2", "--evaluations", "200", "--seed", "4"];
    same_in_parts(&twins, "3", 2);
}

#[test]
fn twins_at_several_levels_are_the_same_in_parts() {
    same_in_parts(&["twins", "--levels", "2", "--count", "2", "--evaluations", "200", "--seed", "4"], "1", 2);
}

#[test]
fn a_study_before_water_is_the_same_in_parts() {
    // 12 combinations, the companion's beads, 10 tips.
    let short = ["--set", "drive.cycles=8", "--set", "duration=125us"];
    same_in_parts(&[&["study", "water", "--quick"][..], &short].concat(), "8", 3);
}

#[test]
fn a_study_of_dissipation_is_the_same_in_parts() {
    // The reference and 111 candidates, those that the chain refuses too.
    let short = ["--model", "chain", "--set", "drive.cycles=6", "--set", "duration=140us", "--seed", "3"];
    same_in_parts(&[&["study", "dissipation", "--quick"][..], &short].concat(), "45", 3);
}

#[test]
fn studies_along_the_chain_are_the_same_in_parts() {
    let small = ["--model", "chain", "--quick", "--seed", "3"];
    same_in_parts(&[&["study", "chain-length"], &small[..]].concat(), "7", 3);
    same_in_parts(&[&["study", "precompression", "--set", "chain.beads=3"], &small[..]].concat(), "8", 3);
}

#[test]
fn the_study_of_the_paper_is_the_same_in_parts() {
    // Two models before the rigid wall, two laws, two sweeps, 16 readings of each law.
    let small = ["study", "paper", "--model", "chain", "--quick", "--members", "2", "--seed", "3"];
    same_in_parts(&small, "13", 3);
}

#[test]
#[cfg(unix)]
fn a_study_handed_to_a_cluster_is_collected_to_the_bytes_of_one_run_here() {
    let place = tempfile::tempdir().unwrap();
    let study =
        ["study", "precompression", "--model", "chain", "--quick", "--set", "chain.beads=3", "--quiet", "--out"];
    let run = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
        command.args(study).args(more).current_dir(place.path());
        command
    };
    let here = run(&["here"]).output().unwrap();
    let path = super::hyperqueue::path_with_hq(place.path());
    let far = run(&["far", "--on", "hyperqueue", "--chunk", "9"]).env("PATH", &path).output().unwrap();
    assert_eq!((code(&here), code(&far)), (0, 0), "{}", stderr(&far));
    assert_eq!(far.stdout, here.stdout);
    assert_eq!(bytes(&place.path().join("far")), bytes(&place.path().join("here")));
    assert!(!place.path().join("far.batch").exists());
    // Without a number of points a chunk is as many as take a minute, by one of them.
    let told = run(&["all", "--on", "hyperqueue", "--dry-run"]).output().unwrap();
    assert!(stdout(&told).contains("--array=0 "), "{}", stderr(&told));
}

#[test]
fn a_calibration_is_no_batch_of_its_own() {
    let place = tempfile::tempdir().unwrap();
    let record = super::harness::PROJECT.to_owned() + "/measurements/twin-annulus/vib.csv";
    let calibrate = ["calibrate", "--measured", &record, "--scene", "annulus", "--out", "far"];
    let (code, _, error) = granchain(place.path(), &[&["batch", "plan", "parts", "--"][..], &calibrate].concat());
    assert!(code == 2 && error.contains("rests on those before") && error.contains("calibrate --on ENGINE"), "{error}");
    let (code, _, error) = granchain(place.path(), &[&calibrate[..], &["--model", "chain", "--on", "slurm"]].concat());
    assert!(code == 2 && error.contains("--on would do nothing"), "{error}");
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
}

#[test]
fn files_of_records_are_not_left_to_chunks() {
    let place = tempfile::tempdir().unwrap();
    let twins = ["twins", "--laboratory", "pretrigger", "--records", "--out", "far"];
    let (code, _, error) = granchain(place.path(), &[&["batch", "plan", "parts", "--"][..], &twins].concat());
    assert!(code == 2 && error.contains("--records keeps files"), "{error}");
}

/// Largest memory of a process, kB.
#[cfg(target_os = "linux")]
fn peak_kb(folder: &Path, arguments: &[&str]) -> u64 {
    let mut child = Command::new(env!("CARGO_BIN_EXE_granchain"));
    let mut child = child.args(arguments).current_dir(folder).stdout(std::process::Stdio::null()).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    while child.try_wait().unwrap().is_none() {
        let told = fs::read_to_string(&status).unwrap_or_default();
        let line = told.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak =
            line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok()).map_or(peak, |kb: u64| peak.max(kb));
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert!(child.wait().unwrap().success());
    peak
}

#[test]
#[cfg(target_os = "linux")]
fn ten_times_the_points_take_hardly_more_memory() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let bench = [
        "sweep",
        "--scene",
        "annulus",
        "--model",
        "chain",
        "--set",
        "duration=2us",
        "--set",
        "chain.beads=1",
        "--quiet",
    ];
    let sweep = |damping: &str, out: &str| {
        let grid = ["--vary", "alpha=0.2:1.19:0.01", "--vary", damping, "--out", out].map(String::from);
        bench.map(String::from).into_iter().chain(grid).collect::<Vec<_>>()
    };
    let peak = |arguments: &[String]| peak_kb(folder, &arguments.iter().map(String::as_str).collect::<Vec<_>>());
    let few = peak(&sweep("damping.coefficient=0.1:0.29:0.01", "few"));
    let many = sweep("damping.coefficient=0.1:0.299:0.001", "many");
    let here = peak(&many);
    // 20,000 points in place of 2,000 take some 75 bytes each, most of it their places; as much is shown of either. All runs in memory take 600 bytes
    // each, 11 MB more.
    assert!(here < few + 6_000, "{few} {here}");
    let plan = ["batch", "plan", "parts", "--chunk", "2000", "--"].map(String::from);
    let mut told: Vec<String> = plan.into_iter().chain(many).collect();
    *told.last_mut().unwrap() = "far".into();
    peak(&told);
    for chunk in 0..10 {
        peak(&["batch", "run-chunk", "parts", &chunk.to_string(), "--quiet"].map(String::from));
    }
    let collected = peak(&["batch", "collect", "parts", "--quiet"].map(String::from));
    assert!(collected < few + 12_000, "{few} {collected}");
    assert_eq!(bytes(&folder.join("far")), bytes(&folder.join("many")));
}

#[test]
fn a_dry_run_for_hyperqueue_prints_the_submission() {
    let place = tempfile::tempdir().unwrap();
    let dry = ["--out", "far", "--on", "hyperqueue:cpus=2", "--chunk", "3", "--dry-run"];
    let (code, line, error) = granchain(place.path(), &[&SWEEP[..], &dry].concat());
    assert_eq!(code, 0, "{error}");
    assert!(line.starts_with("hq --output-mode=quiet submit --array=0-2 --name=granchain --cpus=2 "), "{line}");
    assert!(line.contains("batch run-chunk") && line.contains("HQ_TASK_ID"), "{line}");
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
}

#[test]
fn a_dry_run_prints_the_script_and_writes_nothing() {
    let place = tempfile::tempdir().unwrap();
    let dry = ["--out", "far", "--on", "slurm:partition=short,time=01:00:00", "--chunk", "3", "--dry-run"];
    let (code, script, error) = granchain(place.path(), &[&SWEEP[..], &dry].concat());
    assert_eq!(code, 0, "{error}");
    assert!(script.starts_with("#!/bin/sh\n") && script.contains("#SBATCH --time=01:00:00\n"), "{script}");
    assert!(script.contains("batch run-chunk"), "{script}");
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
}
