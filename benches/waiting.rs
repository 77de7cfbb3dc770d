//! What a user waits for, command by command, with peers beside it: the figures of `docs/accuracy.md`.
//!
//! - `cargo bench --bench waiting`: whole commands in processor seconds of one thread, and what a second thread spares; then the ratios to SciPy's LSODA
//!   and to scikit-fem's script, where their Python is there
//! - `cargo bench --bench waiting -- coverage`: besides, sixty synthetic records on the default model (ten minutes)
//!
//! On a quiet machine; nothing is judged. Linux only: elsewhere nobody tells the processor time of a finished program so simply.

use std::{fs, path::Path, process::Command, time::Instant};

/// Processor time of finished children, s.
fn children() -> f64 {
    let stat = fs::read_to_string("/proc/self/stat").expect("Linux tells the times of a process");
    // Behind the name, which may have spaces; times come in hundredths.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    [13, 14].iter().map(|field| fields[*field].parse::<f64>().expect("ticks are numbers")).sum::<f64>() / 100.0
}

/// A command: processor time and time on the wall, s, and what it wrote of its stages.
struct Waited {
    processor: f64,
    wall: f64,
    timing: serde_json::Value,
}

fn wait(arguments: &[&str], threads: &str, out: &Path) -> Waited {
    let _ = fs::remove_dir_all(out);
    let (before, start) = (children(), Instant::now());
    let status = Command::new(env!("CARGO_BIN_EXE_granchain"))
        .args(arguments)
        .args(["--threads", threads, "--quiet", "--out"])
        .arg(out)
        .stdout(std::process::Stdio::null())
        .status()
        .expect("the program starts");
    let (processor, wall) = (children() - before, start.elapsed().as_secs_f64());
    assert!(status.code().is_some_and(|code| code != 1), "{arguments:?} failed");
    let timing = fs::read_to_string(out.join("timing.json")).expect("a command writes its times");
    Waited { processor, wall, timing: serde_json::from_str(&timing).expect("they are JSON") }
}

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let synthetic = folder.path().join("twin");
    let made = Command::new(env!("CARGO"))
        .args(["run", "--quiet", "--release", "--example", "make_twin", "--"])
        .arg(&synthetic)
        .arg("reduced")
        .status();
    assert!(made.is_ok_and(|status| status.success()), "the twin is made");
    let [vib, horn] = ["vib.csv", "horn_tip.csv"].map(|file| synthetic.join(file).to_string_lossy().into_owned());
    let calibrate = ["calibrate", "--measured", &vib, "--drive", &horn, "--scene", "annulus"];
    let chain = [&calibrate[..], &["--model", "chain"]].concat();
    let replay = |model| ["replay", "--scene", "annulus", "--model", model];
    // Bodies are made once, and kept.
    wait(&calibrate, "2", &out);

    println!("{:<58} {:>9} {:>9}", "command, one thread", "s", "aim");
    let row = |what: &str, time: f64, aim: &str| println!("{what:<58} {time:>9.2} {aim:>9}");
    let whole = |what: &str, arguments: &[&str], aim: &str| {
        let waited = wait(arguments, "1", &out);
        row(what, waited.processor, aim);
        waited
    };
    whole("calibrate --model chain, annulus twin", &chain, "3");
    let alone = whole("calibrate, annulus twin", &calibrate, "8");
    whole("replay --scene annulus --model chain", &replay("chain"), "0.1");
    for (model, aim) in [("reduced", "0.11"), ("fea", "7")] {
        let waited = wait(&replay(model), "1", &out);
        let run = waited.timing["stages"]["run_s"].as_f64().expect("a replay tells the time of its run");
        row(&format!("replay --scene annulus --model {model}: the run, by the clock"), run, aim);
    }
    if std::env::args().any(|argument| argument == "coverage") {
        let coverage = ["coverage", "--scenario", "pretrigger", "--model", "reduced", "--count", "60"];
        whole("coverage --model reduced --count 60", &coverage, "540");
    }
    let together = wait(&calibrate, "2", &out);
    println!("calibrate on two threads: {:.2} times less by the clock (aim 1.9)", alone.wall / together.wall);
    let bytes = together.timing["peak_memory_bytes"].as_f64().expect("a command tells its memory");
    println!("its memory: {:.0} MiB (aim 120)", bytes / f64::from(1 << 20));

    for (what, arguments) in [
        ("a run of the reduced model, alone and of eight side by side", &["--bench", "reduced"][..]),
        ("SciPy's LSODA over the chain (aims 25 and, side by side, 150)", &["--bench", "lsoda_ratio"]),
        ("scikit-fem and SciPy over the finite elements", &["--bench", "fea", "--", "peer"]),
    ] {
        println!("\n{what}: cargo bench {}", arguments.join(" "));
        let status = Command::new(env!("CARGO")).args(["bench", "--quiet"]).args(arguments).status();
        if !status.is_ok_and(|status| status.success()) {
            println!("a peer is missing, or slower than it was: see benches/README.md");
        }
    }
}
