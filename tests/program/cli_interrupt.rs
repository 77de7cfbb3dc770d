//! Stopping in the middle: kill −9, Ctrl-C, a closed pipe.

#![cfg(unix)]

use std::{
    fs,
    io::Read,
    os::unix::process::ExitStatusExt,
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

const POINTS: &str = "alpha=0.3:1.5:0.04";

fn sweep(out: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command.args(["sweep", "--scene", "annulus", "--set", "model.mesh_density=8", "--vary", POINTS]);
    command.args(["--out", out.to_str().unwrap()]);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// Wait until some runs are kept, but by far not all of the 31.
fn wait_for_runs(log: &Path, child: &mut Child) {
    let patience = Instant::now() + Duration::from_secs(60);
    while fs::read_to_string(log).unwrap_or_default().lines().count() < 3 {
        assert!(child.try_wait().unwrap().is_none(), "the sweep ended before it could be stopped");
        assert!(Instant::now() < patience, "no run was kept");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn results(out: &Path) -> Vec<Vec<u8>> {
    ["sweep.csv", "sweep.json", "sweep.svg", "sweep.png", ".granchain"]
        .map(|name| fs::read(out.join(name)).unwrap())
        .to_vec()
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

#[test]
fn a_killed_sweep_resumes_to_the_same_bytes() {
    let place = tempfile::tempdir().unwrap();
    let (whole, broken) = (place.path().join("whole"), place.path().join("broken"));
    assert!(sweep(&whole).status().unwrap().success());

    let state = place.path().join(".broken.unfinished/state");
    let mut child = sweep(&broken).spawn().unwrap();
    wait_for_runs(&state.join("runs.jsonl"), &mut child);
    child.kill().unwrap();
    assert_eq!(child.wait().unwrap().signal(), Some(9));
    assert!(!broken.exists());

    let refused = sweep(&broken).output().unwrap();
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--resume"));

    let other = sweep(&broken).args(["--resume", "--set", "damping.coefficient=0.4"]).output().unwrap();
    assert_eq!(other.status.code(), Some(1));

    let resumed = sweep(&broken).args(["--resume", "--threads", "1"]).output().unwrap();
    assert!(resumed.status.success(), "{}", String::from_utf8_lossy(&resumed.stderr));
    assert!(results(&whole) == results(&broken));
    assert!(!state.exists());
}

#[test]
fn whoever_stops_a_sweep_the_finished_runs_are_kept_it_says_so_and_ends_with_128_and_the_signal() {
    for (signal, name, code) in [("-INT", "Ctrl-C", 130), ("-TERM", "SIGTERM", 143), ("-HUP", "SIGHUP", 129)] {
        if name == "SIGHUP" && hangups_are_ignored() {
            continue;
        }
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("out");
        let log = place.path().join(".out.unfinished/state/runs.jsonl");
        let mut child = sweep(&out).spawn().unwrap();
        wait_for_runs(&log, &mut child);
        send(signal, &child);
        let mut said = String::new();
        child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(code), "{said}");
        assert!(said.contains("--resume") && said.contains(name), "{said}");
        assert!(log.exists() && !out.exists());
        assert!(sweep(&out).arg("--resume").status().unwrap().success());
        assert!(out.join("sweep.json").exists());
    }
}

/// Whether these tests run where SIGHUP is ignored, as under `nohup`: what they start inherits it.
fn hangups_are_ignored() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask & 1 == 1)
}

/// `nohup` has SIGHUP ignored, and its sweep goes on.
#[cfg(target_os = "linux")]
#[test]
fn a_hang_up_that_is_to_be_ignored_stops_nothing() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let kept = sweep(&out);
    let mut nohup = Command::new("nohup");
    nohup.arg(kept.get_program()).args(kept.get_args()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = nohup.spawn().unwrap();
    wait_for_runs(&place.path().join(".out.unfinished/state/runs.jsonl"), &mut child);
    send("-HUP", &child);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(out.join("sweep.json").exists());
}

/// A path in Latin-1 is a path.
#[cfg(target_os = "linux")]
#[test]
fn arguments_that_are_no_text_do_not_end_in_a_panic() {
    use std::os::unix::ffi::OsStringExt;
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join(std::ffi::OsString::from_vec(b"r\xe9sultats".to_vec()));
    let replay = Command::new(env!("CARGO_BIN_EXE_granchain"))
        .env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"))
        .args(["replay", "--scene", "rigid", "--set", "duration=60us", "--quiet", "--out"])
        .arg(&out)
        .output()
        .unwrap();
    assert_eq!(replay.status.code(), Some(0), "{}", String::from_utf8_lossy(&replay.stderr));
    assert!(out.is_dir());
    let calibrate = Command::new(env!("CARGO_BIN_EXE_granchain"))
        .args(["calibrate", "--measured"])
        .arg(out.join(std::ffi::OsString::from_vec(b"v\xefb.csv".to_vec())))
        .output()
        .unwrap();
    assert_eq!(calibrate.status.code(), Some(1), "{}", String::from_utf8_lossy(&calibrate.stderr));
}

#[test]
fn ctrl_c_in_a_replay_leaves_nothing() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let mut child = Command::new(env!("CARGO_BIN_EXE_granchain"))
        .env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"))
        .args(["replay", "--scene", "rigid", "--set", "duration=1 s", "--set", "drive.cycles=60000"])
        .args(["--out", out.to_str().unwrap()])
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let patience = Instant::now() + Duration::from_secs(60);
    while fs::read_dir(place.path()).unwrap().count() == 0 {
        assert!(Instant::now() < patience && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(2));
    }
    send("-INT", &child);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
}

/// Longest time from a signal to the end of the process: 0.2 s are promised, the rest is for a busy machine.
const PROMPT: Duration = Duration::from_millis(500);

/// Send SIGTERM after `delay`; how long the command then took to end, if it had not ended before.
fn heard(place: &Path, arguments: &[&str], delay: Duration) -> Option<Duration> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.args(arguments).args(["--cache", "none"]).current_dir(place).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    std::thread::sleep(delay);
    if child.try_wait().unwrap().is_some() {
        return None;
    }
    let sent = Instant::now();
    send("-TERM", &child);
    let ended = child.wait_with_output().unwrap();
    let took = sent.elapsed();
    let said = String::from_utf8_lossy(&ended.stderr);
    match ended.status.code() {
        Some(143) => assert!(said.contains("stopped by SIGTERM"), "{arguments:?}: {said}"),
        // It was done, and only had to say so.
        code => assert!(code == Some(0) && took < PROMPT, "{arguments:?}: {code:?}: {said}"),
    }
    Some(took)
}

#[test]
fn every_long_command_hears_a_signal_at_once_and_leaves_nothing_half_made() {
    let place = tempfile::tempdir().unwrap();
    let wave = |i: u32| (f64::from(i) * 0.09).sin() * f64::from(i.saturating_sub(2000).min(4000)) / 4.0;
    for (name, unit) in [("vib.csv", "velocity_um_per_s"), ("horn_tip.csv", "displacement_pm")] {
        let rows: String = (0..500_000).map(|i| format!("{:.1},{:.2}\n", f64::from(i) * 0.2, 1e2 * wave(i))).collect();
        fs::write(place.path().join(name), format!("time_us,{unit}\n{rows}")).unwrap();
    }
    for name in ["record.csv", "scene.toml", "plan.toml"] {
        assert!(Command::new("mkfifo").arg(place.path().join(name)).status().unwrap().success());
    }
    let names = || {
        let names = fs::read_dir(place.path()).unwrap().map(|entry| entry.unwrap().file_name());
        names.collect::<std::collections::BTreeSet<_>>()
    };
    let before = names();
    let commands: [&[&str]; 11] = [
        &["mesh", "--scene", "annulus", "--density", "60", "--out", "new/mesh"],
        &["calibrate", "--measured", "vib.csv", "--dry-run", "--out", "new/look"],
        &["start", "vib.csv", "horn_tip.csv", "--out", "begun.toml"],
        &["spectrum", "vib.csv", "--out", "new/spectrum"],
        &["inspect", "vib.csv"],
        &["convert", "vib.csv", "vib.uff"],
        &[
            "sweep",
            "--scene",
            "annulus",
            "--model",
            "chain",
            "--vary",
            "alpha=0.4,0.5",
            "--ensemble",
            "300",
            "--out",
            "new/sweep",
        ],
        &["accuracy", "--scene", "annulus", "--out", "new/accuracy"],
        &["inspect", "record.csv"],
        &["scene", "check", "scene.toml"],
        &["calibrate", "--plan", "plan.toml"],
    ];
    for arguments in commands {
        let delays = [40, 150, 300, 700].map(Duration::from_millis);
        let took: Vec<Duration> = delays
            .into_iter()
            .filter_map(|delay| {
                let took = heard(place.path(), arguments, delay);
                // A state that stays is one to go on from.
                let runs = place.path().join("new/.sweep.unfinished/state/runs.jsonl");
                assert!(!place.path().join("new/.sweep.unfinished").exists() || fs::read(runs).unwrap().len() > 1);
                if names() != before {
                    // What is there was finished.
                    for new in names().difference(&before) {
                        let path = place.path().join(new);
                        assert!(!new.to_string_lossy().starts_with('.'), "{arguments:?} left {new:?}");
                        if path.is_dir() { fs::remove_dir_all(path).unwrap() } else { fs::remove_file(path).unwrap() }
                    }
                }
                took
            })
            .collect();
        assert!(!took.is_empty() && took.iter().all(|took| *took < PROMPT), "{arguments:?}: {took:?}");
    }
}

#[test]
fn a_closed_pipe_ends_quietly() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_granchain"))
        .env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"))
        .args(["sweep", "--scene", "rigid", "--vary", "alpha=0.5,1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!((child.wait().unwrap().code(), said.as_str()), (Some(0), ""));
}
