//! The commonest slips of the command line, and what hostile names do to what is printed.

#![cfg(unix)]

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use crate::harness::{PROJECT, code, granchain, stderr, stdout};

fn bench() -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    for name in ["vib.csv", "horn_tip.csv"] {
        fs::copy(Path::new(PROJECT).join("measurements/twin-annulus").join(name), place.path().join(name)).unwrap();
    }
    place
}

/// Standard error of a refusal, its lines joined.
fn refusal(place: &Path, arguments: &[&str], expected: i32) -> String {
    let (code, out, error) = granchain(place, arguments);
    assert_eq!(code, expected, "{arguments:?}: {out}{error}");
    error.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn a_slip_is_answered_with_what_to_type() {
    let place = bench();
    let told = |arguments: &[&str], part: &str| {
        let said = refusal(place.path(), arguments, 2);
        assert!(said.contains(part), "{arguments:?}: expected `{part}` in: {said}");
    };
    let quotes =
        |arguments: &[&str], meant: &str| told(arguments, &format!("a quantity with a blank needs quotes: {meant}"));
    let fit = |more: &[&'static str]| [&["calibrate", "--measured", "vib.csv"], more].concat();
    quotes(&fit(&["--scale", "125", "mm/s/V"]), "--scale '125 mm/s/V'");
    quotes(&fit(&["--drive-read", "scale=2", "um/V"]), "--drive-read 'scale=2 um/V'");
    quotes(&["start", "vib.csv", "--scale=125", "mm/s/V"], "'--scale=125 mm/s/V'");
    quotes(&["replay", "--scene", "annulus", "--drive-frequency", "73", "kHz"], "--drive-frequency '73 kHz'");
    quotes(
        &["sweep", "--scene", "annulus", "--set", "duration=1", "ms", "--vary", "alpha=1,2"],
        "--set 'duration=1 ms'",
    );
    told(&["calibrate", "vib.csv", "horn_tip.csv"], "type --measured vib.csv (and the horn's with --drive FILE)");
    told(&["calibrate", "plan.toml"], "type --plan plan.toml");
    told(&["replay", "annulus"], "type --scene annulus");
    told(&["sweep", "bench.toml", "--vary", "alpha=1,2"], "type --scene bench.toml");
    let said = refusal(place.path(), &["plot", "vib.csv"], 2);
    assert!(!said.contains("completions"), "{said}");
    assert!(refusal(place.path(), &["calibrat"], 2).contains("calibrate"));
}

#[test]
fn what_a_plan_states_is_refused_in_the_plan() {
    let place = bench();
    let write = |text: &str| fs::write(place.path().join("p.toml"), text).unwrap();
    let told = |text: &str, part: &str| {
        write(text);
        let said = refusal(place.path(), &["calibrate", "--plan", "p.toml", "--dry-run"], 1);
        assert!(said.contains(part) && !said.contains("--set"), "expected `{part}` in: {said}");
    };
    told("", "p.toml: key `measured` is missing");
    told("measured = 'vib.csv'\nset = ['chain.beads=six']\n", "p.toml:2: `set`, chain.beads=six: `chain.beads`");
    told("[[record]]\nmeasured = 'vib.csv'\nset = ['chain.radius=1kg']\n", "p.toml:3: `set`, chain.radius=1kg");
    told("measured = 'vib.csv'\nscene = ''\n", "p.toml:2: `` is neither a built-in scene");
    // A flag is the command line's.
    write("measured = 'vib.csv'\n");
    let flag = ["calibrate", "--plan", "p.toml", "--dry-run", "--set", "chain.beads=six"];
    assert!(refusal(place.path(), &flag, 1).contains("--set chain.beads=six"));
    fs::write(place.path().join("benck.toml"), "extends = 'annulus'\n").unwrap();
    let said = refusal(place.path(), &["scene", "check", "bench.toml"], 1);
    assert!(said.contains("did you mean `benck.toml`?") && said.contains("granchain scene init"), "{said}");
}

#[test]
fn a_wrong_unit_swapped_files_and_unused_materials_are_warned_of() {
    let place = bench();
    let text = fs::read_to_string(place.path().join("vib.csv")).unwrap();
    fs::write(place.path().join("small.csv"), text.replace("mm_per_s", "um_per_s")).unwrap();
    let dry = ["calibrate", "--measured", "small.csv", "--model", "chain", "--dry-run", "--out", "look"];
    let (code, out, error) = granchain(place.path(), &dry);
    assert!(code == 0 && error.contains("below 1 mm/s") && !out.contains("record +0 "), "{out}{error}");

    // Both channels in volts, each read as the other.
    let volts = |name: &str| -> Vec<f64> {
        let text = fs::read_to_string(place.path().join(name)).unwrap();
        text.lines().filter_map(|line| line.split_once(',')?.1.parse().ok()).collect()
    };
    let rows = volts("vib.csv").into_iter().zip(volts("horn_tip.csv")).enumerate();
    let rows: String = rows.map(|(i, (bead, horn))| format!("{:.1},{bead},{horn}\n", 0.2 * i as f64)).collect();
    fs::write(place.path().join("scope.csv"), format!("Time (us),CH1 (V),CH2 (V)\n{rows}")).unwrap();
    let start = |bead: &str, horn: &str, out: &str| {
        let (bead, horn) = (format!("--channel={bead}"), format!("--drive-read=channel={horn}"));
        let scales = ["--scale=1 mm/s/V", "--drive-read=scale=1 nm/V"];
        granchain(place.path(), &["start", "scope.csv", &bead, &horn, scales[0], scales[1], "--out", out])
    };
    let (_, _, right) = start("CH1", "CH2", "right.toml");
    let (code, _, swapped) = start("CH2", "CH1", "swapped.toml");
    assert!(code == 0 && swapped.contains("as a horn's is"), "{swapped}");
    assert!(!right.contains("as a horn's is"), "{right}");

    fs::write(
        place.path().join("b.toml"),
        "extends = 'annulus'\n[chain]\nmaterial = 'glass'\n[materials.chrome-steel]\ndensity = 7900\n",
    )
    .unwrap();
    let (_, out, error) = granchain(place.path(), &["scene", "check", "b.toml"]);
    assert!(
        error.contains("no body is of `chrome-steel`") && out.contains("glass: E ") && out.contains("ρ "),
        "{out}{error}"
    );
    let (_, keys, _) = granchain(place.path(), &["scene", "keys"]);
    let takes = keys.split_once("chain.material: ").unwrap().1.lines().nth(1).unwrap();
    assert!(takes.contains("`chrome-steel`") && takes.contains("`vitreous-carbon`"), "{takes}");
}

#[test]
fn a_replay_says_where_its_peaks_depend_on_the_tolerance() {
    let replay = |alpha: &str, model: &str| {
        granchain(PROJECT, &["replay", "--scene", "annulus", "--model", model, "--alpha", alpha]).2
    };
    assert!(replay("5", "chain").contains("times finer (model.tolerance) a peak changes by"));
    assert!(!replay("0.7", "chain").contains("times finer"));
}

/// A program of this name that writes down what it was called with.
const STUB: &str = "#!/bin/sh\nprintf '%s\\n' \"$@\" >> \"$CALLED\"\n";

/// The commands of this program in what it printed.
fn commands(printed: &str) -> Vec<String> {
    let quoted = printed.split('`').skip(1).step_by(2).filter(|text| text.starts_with("granchain ")).map(str::to_owned);
    let lines = printed.lines().filter(|line| !line.contains("`granchain "));
    let whole = lines.filter_map(|line| Some(line[line.find("granchain ")?..].to_owned()));
    quoted.chain(whole.filter(|line| line.contains("x;touch"))).collect()
}

#[test]
fn no_printed_command_does_what_a_folder_is_named() {
    const EVIL: &str = "x;touch pwned;";
    let place = tempfile::tempdir().unwrap();
    let evil = place.path().join(EVIL);
    fs::create_dir(&evil).unwrap();
    for name in ["vib.csv", "horn_tip.csv"] {
        fs::copy(Path::new(PROJECT).join("measurements/twin-annulus").join(name), evil.join(name)).unwrap();
    }
    let file = |name: &str| format!("{EVIL}/{name}");
    fs::write(evil.join("p.toml"), "measured = 'vib.csv'\n").unwrap();
    fs::write(evil.join("s.toml"), "extends = 'annulus'\n").unwrap();
    fs::write(evil.join("b.toml"), "[vibrometer]\nchannel = 'CH1'\n").unwrap();
    fs::write(evil.join("bare.csv"), "time_us,a\n0,1\n1,2\n2,1\n3,2\n").unwrap();
    let runs: [Vec<String>; 9] = [
        vec!["start".into(), file("vib.csv"), file("horn_tip.csv"), "--out".into(), file("begun.toml")],
        vec!["inspect".into(), file("p.toml")],
        vec!["inspect".into(), file("s.toml")],
        vec!["inspect".into(), file("b.toml")],
        vec!["inspect".into(), file("bare.csv")],
        vec!["replay".into(), "--calibration".into(), file("none")],
        vec!["scene".into(), "init".into(), file("own.toml")],
        vec!["calibrate".into(), file("vib.csv")],
        vec!["calibrate".into(), "--measured".into(), file("bare.csv")],
    ];
    let bin = place.path().join("bin");
    fs::create_dir(&bin).unwrap();
    fs::write(bin.join("granchain"), STUB).unwrap();
    assert!(Command::new("chmod").arg("+x").arg(bin.join("granchain")).status().unwrap().success());
    let mut typed = 0;
    for arguments in &runs {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let (_, out, error) = granchain(place.path(), &arguments);
        let text = fs::read_to_string(evil.join("begun.toml")).unwrap_or_default();
        for command in commands(&format!("{out}{error}{text}")) {
            let called = place.path().join("called");
            let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap());
            let mut shell = Command::new("sh");
            shell.args(["-c", &command]).current_dir(place.path()).env("PATH", path).env("CALLED", &called);
            shell.output().unwrap();
            assert!(!place.path().join("pwned").exists(), "{command}");
            let words = fs::read_to_string(&called).unwrap_or_else(|_| panic!("not called: {command}"));
            fs::remove_file(&called).unwrap();
            typed += usize::from(words.lines().any(|word| word.contains(EVIL)));
        }
    }
    assert!(typed >= 7, "{typed}");
}

/// A line in a shell that finds the program.
fn shell(place: &Path, line: &str) -> Output {
    let path = format!(
        "{}:{}",
        Path::new(env!("CARGO_BIN_EXE_granchain")).parent().unwrap().display(),
        std::env::var("PATH").unwrap()
    );
    Command::new("sh").args(["-c", line]).current_dir(place).env("PATH", path).output().unwrap()
}

#[test]
fn nothing_raw_or_unwritten_leaves_the_command_line() {
    let place = bench();
    for line in ["granchain --help", "granchain calibrate --help", "granchain --version", "granchain scene list"] {
        let output = shell(place.path(), &format!("{line} > /dev/full"));
        assert_eq!(code(&output), 1, "{line}: {}", stderr(&output));
        assert_eq!(code(&shell(place.path(), line)), 0, "{line}");
    }
    for word in ["x\u{202e}y", "--a\u{2028}b", "\u{9b}2J"] {
        let said = granchain(place.path(), &[word]).2;
        assert!(said.contains("\\u{") && !said.contains(['\u{202e}', '\u{2028}', '\u{9b}']), "{said:?}");
    }
}

#[test]
fn start_and_convert_write_all_of_it_or_nothing() {
    let place = bench();
    // A largest size of files stands for a full disk.
    let full = |line: &str| shell(place.path(), &format!("trap '' XFSZ; ulimit -f 4; {line}"));
    for line in ["granchain start vib.csv horn_tip.csv", "granchain convert vib.csv vib.uff"] {
        let output = full(line);
        assert_eq!(code(&output), 1, "{line}: {}{}", stdout(&output), stderr(&output));
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 2, "{line}");
    }
    std::os::unix::fs::symlink("nowhere.csv", place.path().join("link.csv")).unwrap();
    let said = refusal(place.path(), &["convert", "vib.csv", "link.csv"], 1);
    assert!(said.contains("the file exists"), "{said}");
    assert!(place.path().join("link.csv").is_symlink() && !place.path().join("nowhere.csv").exists());
}
