//! What is not ours stays as it is, and what is done is not lost: hostile lists, files of the same name, states of other commands, runs ended in
//! the middle.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Output},
};

use tempfile::TempDir;

use crate::harness::{self, PROJECT};

const REPLAY: [&str; 5] = ["replay", "--scene", "rigid", "--set", "duration=100us"];
const SWEEP: [&str; 7] = ["sweep", "--scene", "rigid", "--set", "duration=100us", "--vary", "alpha=0.5,0.7"];
const ANALYSIS: [&str; 9] =
    ["replay", "--scene", "rigid", "--model", "fea", "--set", "model.mesh_density=3", "--set", "duration=40us"];

/// Run in `place` with `--out out`.
fn granchain(place: &Path, arguments: &[&[&str]]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.current_dir(place).env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR")).args(arguments.concat());
    if !arguments.concat().contains(&"--out") {
        command.args(["--out", "out"]);
    }
    command.output().unwrap()
}

fn done(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn refused(output: &Output, phrases: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(phrases.iter().all(|expected| said.contains(expected)), "{phrases:?}: {said}");
}

/// Every file below a folder, but for locks.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let (mut found, mut open) = (BTreeMap::new(), vec![folder.to_path_buf()]);
    while let Some(place) = open.pop() {
        for path in fs::read_dir(place).unwrap().map(|entry| entry.unwrap().path()) {
            let name = path.strip_prefix(folder).unwrap().display().to_string();
            if path.is_dir() {
                open.push(path);
            } else if !name.ends_with("lock") {
                found.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// The results but for the times.
fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = contents(folder);
    found.remove("timing.json").unwrap();
    found
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_list_from_elsewhere_removes_nothing_outside_its_folder_and_nothing_in_it() {
    let outer = tempfile::tempdir().unwrap();
    let place = outer.path().join("work");
    fs::create_dir(&place).unwrap();
    let (victim, here) = (outer.path().join("victim.txt"), place.join("thesis.tex"));
    for list in ["../victim.txt", "../../victim.txt", victim.to_str().unwrap(), "thesis.tex"] {
        for (out, force) in [(".", false), (".", true), ("out", true)] {
            let folder = place.join(out);
            fs::create_dir_all(&folder).unwrap();
            fs::write(&victim, "x").unwrap();
            fs::write(folder.join("thesis.tex"), "years of work").unwrap();
            fs::write(folder.join(".granchain"), format!("{list}\n")).unwrap();
            let force: &[&str] = if force { &["--force"] } else { &[] };
            refused(&granchain(&place, &[&REPLAY, &["--out", out], force]), &["granchain", "--out"]);
            assert!(victim.exists() && folder.join("thesis.tex").exists(), "{list} {out}");
            let _ = fs::remove_file(place.join(".granchain"));
            let _ = fs::remove_file(&here);
            let _ = fs::remove_dir_all(place.join("out"));
        }
    }
}

#[test]
fn a_strangers_file_of_the_name_of_a_result_is_refused_before_the_run() {
    let place = tempfile::tempdir().unwrap();
    for (command, name) in [(&REPLAY[..], "response.csv"), (&SWEEP, "sweep.csv"), (&ANALYSIS, "summary.json")] {
        let out = place.path().join("out");
        fs::create_dir(&out).unwrap();
        fs::write(out.join(name), "mine").unwrap();
        let before = contents(place.path());
        refused(&granchain(place.path(), &[command]), &[name, "--force"]);
        refused(&granchain(place.path(), &[command, &["--force"]]), &[name, "in the way"]);
        assert_eq!((contents(place.path()), names(place.path())), (before, vec!["out".to_owned()]));
        fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn a_strangers_file_that_only_the_end_of_the_run_meets_is_kept_and_so_are_the_results() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    fs::create_dir(&out).unwrap();
    done(&granchain(place.path(), &[&REPLAY, &["--out", "plain"]]));
    let taken = names(&place.path().join("plain")).into_iter().find(|name| name.ends_with(".svg")).unwrap();
    fs::write(out.join(&taken), "mine").unwrap();
    let output = granchain(place.path(), &[&REPLAY, &["--force"]]);
    refused(&output, &[&taken, "the finished results are kept", ".out.kept-"]);
    assert_eq!(contents(&out), BTreeMap::from([(taken, b"mine".to_vec())]));
    let kept = names(place.path()).into_iter().find(|name| name.starts_with(".out.kept-")).unwrap();
    assert_eq!(results(&place.path().join(kept)), results(&place.path().join("plain")));
}

#[test]
fn a_result_that_was_edited_is_kept() {
    let place = tempfile::tempdir().unwrap();
    done(&granchain(place.path(), &[&REPLAY]));
    done(&granchain(place.path(), &[&REPLAY]));
    let path = place.path().join("out/scene.toml");
    fs::write(&path, "edited").unwrap();
    for force in [&[][..], &["--force"]] {
        refused(&granchain(place.path(), &[&REPLAY, force]), &["scene.toml", "was changed since"]);
    }
    assert_eq!(fs::read(&path).unwrap(), b"edited");
}

/// A run that has everything but its place: folders of a stranger stand where its figures would.
fn unfinished(command: &[&str]) -> TempDir {
    let place = tempfile::tempdir().unwrap();
    for figure in ["sweep.svg", "spectrum.svg"] {
        fs::create_dir_all(place.path().join("out").join(figure)).unwrap();
        fs::write(place.path().join("out").join(figure).join("mine"), "").unwrap();
    }
    refused(&granchain(place.path(), &[command, &["--force"]]), &["the finished results are kept", ".out.unfinished"]);
    fs::remove_dir_all(place.path().join("out")).unwrap();
    place
}

#[test]
fn the_state_of_another_command_is_refused_and_not_a_byte_of_it_touched() {
    let calibrate = ["calibrate", "--evaluations", "200", "--measured", "measurements/annulus-73khz/vib.csv"];
    let record = Path::new(env!("CARGO_MANIFEST_DIR")).join(calibrate[4]);
    let calibrate = [&calibrate[..4], &[record.to_str().unwrap()]].concat();
    let place = unfinished(&SWEEP);
    let before = contents(place.path());
    refused(&granchain(place.path(), &[&calibrate, &["--resume"]]), &["expected an unfinished run of", "sweep"]);
    // The right command with other flags.
    refused(&granchain(place.path(), &[&SWEEP, &["--resume", "--alpha", "0.9"]]), &["has another scene"]);
    assert!(before == contents(place.path()));
}

#[test]
#[cfg(unix)]
fn a_link_at_or_in_the_state_of_a_run_is_refused_and_neither_it_nor_its_target_is_touched() {
    use std::os::unix::fs::symlink;

    let record = Path::new(PROJECT).join("measurements/annulus-73khz/vib.csv");
    let calibrate = ["calibrate", "--evaluations", "200", "--measured", record.to_str().unwrap()];
    // Every folder and file that the program opens there; the last is the whole folder.
    let links = [
        "lock",
        "results",
        "state",
        "old",
        "dropped",
        "both",
        "state/command",
        "state/plan.json",
        "state/runs.jsonl",
        "",
    ];
    for (command, name) in [(&SWEEP[..], "sweep"), (&calibrate, "calibrate")] {
        for link in links {
            let place = tempfile::tempdir().unwrap();
            let (work, victim) = (place.path().join(".out.unfinished"), place.path().join("victim"));
            for folder in ["results", "state"] {
                fs::create_dir_all(victim.join(folder)).unwrap();
                fs::write(victim.join(folder).join("thesis.tex"), "years of work").unwrap();
            }
            fs::write(victim.join("state/command"), format!("{name}\n")).unwrap();
            fs::create_dir_all(work.join("state")).unwrap();
            fs::write(work.join("state/runs.jsonl"), "{}\n").unwrap();
            let at = work.join(link);
            if link.is_empty() || link == "state" {
                fs::remove_dir_all(&at).unwrap();
            }
            let _ = fs::remove_file(&at);
            let whole = ["", "results", "state", "old", "dropped"].contains(&link);
            symlink(
                if whole { victim.clone() } else { victim.join("state/thesis.tex") },
                at.components().collect::<std::path::PathBuf>(),
            )
            .unwrap();
            let before = contents(place.path());
            for flag in ["--resume", "--force", "--quiet"] {
                let output = granchain(place.path(), &[command, &[flag]]);
                refused(
                    &output,
                    &[
                        ".out.unfinished",
                        "expected a folder or file that granchain made, found a symbolic link",
                        "remove the link",
                    ],
                );
                assert_eq!(contents(place.path()), before, "{command:?} {link} {flag}");
                assert_eq!(names(place.path()), [".out.unfinished", "victim"]);
            }
        }
    }
}

#[test]
#[cfg(unix)]
fn what_a_dead_run_left_is_not_removed_through_a_link() {
    use std::os::unix::fs::symlink;

    let place = tempfile::tempdir().unwrap();
    let (left, victim) = (place.path().join(".out.partial-abc"), place.path().join("victim"));
    fs::create_dir(&left).unwrap();
    fs::create_dir(&victim).unwrap();
    fs::write(victim.join("lock"), "").unwrap();
    fs::write(victim.join("thesis.tex"), "years of work").unwrap();
    symlink(victim.join("lock"), left.join("lock")).unwrap();
    symlink(&victim, left.join("results")).unwrap();
    symlink(&victim, place.path().join(".out.partial-def")).unwrap();
    done(&granchain(place.path(), &[&REPLAY]));
    assert_eq!(names(place.path()), [".out.partial-abc", ".out.partial-def", "out", "victim"]);
    assert_eq!(
        (names(&left), names(&victim)),
        (vec!["lock".into(), "results".into()], vec!["lock".into(), "thesis.tex".to_owned()])
    );
}

#[test]
fn results_that_could_not_be_put_in_their_place_are_made_again_from_the_state_to_the_same_bytes() {
    let place = unfinished(&SWEEP);
    done(&granchain(place.path(), &[&SWEEP, &["--resume"]]));
    done(&granchain(place.path(), &[&SWEEP, &["--out", "whole"]]));
    assert!(results(&place.path().join("out")) == results(&place.path().join("whole")));
    assert_eq!(names(place.path()), ["out", "whole"]);
    refused(&granchain(place.path(), &[&SWEEP, &["--resume"]]), &["finished results stand in out already"]);
}

#[test]
fn resume_starts_again_and_says_so_if_nothing_was_saved() {
    let place = tempfile::tempdir().unwrap();
    done(&granchain(place.path(), &[&SWEEP, &["--out", "whole"]]));
    let state = place.path().join(".out.unfinished/state");
    // Ended before the state was made, before its command was named, and before the plan was whole.
    for left in 0..3 {
        fs::create_dir_all(if left == 0 { state.parent().unwrap() } else { &state }).unwrap();
        if left == 2 {
            fs::write(state.join("command"), "sweep\n").unwrap();
            fs::write(state.join("plan.json"), "{}").unwrap();
        }
        let output = granchain(place.path(), &[&SWEEP, &["--resume"]]);
        done(&output);
        assert!(String::from_utf8_lossy(&output.stderr).contains("it starts again"), "{left}");
        assert!(results(&place.path().join("out")) == results(&place.path().join("whole")));
        assert_eq!(names(place.path()), ["out", "whole"]);
    }
}

#[test]
fn text_from_files_and_paths_never_steers_the_terminal() {
    let place = tempfile::tempdir().unwrap();
    let steering = "\u{1b}[2J\u{9b}31m\u{7}\r";
    // The reader of records refuses those below U+0020 itself.
    let turning = "\u{9b}31m\u{202e}";
    let row = |i: usize| format!("{:e},{:e}\n", i as f64 * 1e-7, (i as f64 * 0.046).sin());
    let rows: String = (0..2000).map(row).collect();
    let named = format!("{steering}vib.csv");
    let write = |name: &str, text: String| fs::write(place.path().join(name), text).unwrap();
    write("cell.csv", format!("time_s,velocity_m_per_s\n0,1\n1e-7,n/a{turning}\n"));
    write("header.csv", format!("time_s,velocity_m_per_s{turning}\n{rows}"));
    write(&named, format!("time_s,velocity_m_per_s\n{rows}"));
    write("scene.toml", "extends = \"rigid\"\n\"rad\\u001b[2Jius\" = 1\n".into());
    write("name.toml", "extends = \"rigid\"\nname = \"a\\u001b[2J\\u009bb\"\n".into());
    let plain = |arguments: &[&str]| {
        let output = granchain(place.path(), &[arguments, &["--out", "out"]]);
        fs::remove_dir_all(place.path().join("out")).ok();
        let shown = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        for text in &shown {
            let steers = |letter: char| letter.is_control() && !matches!(letter, '\n' | '\t');
            assert!(!text.contains(steers), "{arguments:?}: {text:?}");
        }
        shown.concat()
    };
    for (arguments, shown) in [
        (&["spectrum", "cell.csv", "--drive-frequency", "73kHz"][..], "\\u{9b}31m\\u{202e}"),
        (&["spectrum", "header.csv", "--channel", "2", "--drive-frequency", "73kHz"], "\\u{9b}31m"),
        (&["spectrum", &named, "--drive-frequency", "73kHz"], "\\u{1b}[2J"),
        (&["spectrum", &named, "--drive-frequency", "73kHz", "--json"], "\\u001b[2J\\u009b31m"),
        (&["replay", "--scene", "scene.toml"], "\\u{1b}[2J"),
        (&["replay", "--scene", "name.toml", "--model", "chain", "--set", "duration=60us"], ""),
    ] {
        let found = plain(arguments);
        assert!(found.contains(shown), "{arguments:?}: {found}");
    }
}

#[test]
#[cfg(unix)]
fn a_printed_command_is_read_by_a_shell_as_it_was_typed() {
    let place = tempfile::tempdir().unwrap();
    let folder = "a';touch pwned;'b $(touch pwned) `touch pwned`";
    fs::create_dir(place.path().join(folder)).unwrap();
    let rows: String =
        (0..2000).map(|i| format!("{:e},{:e}\n", f64::from(i) * 1e-7, (f64::from(i) * 0.046).sin())).collect();
    let [scene, volts, record, plan] =
        ["bench.toml", "volts.csv", "vib.csv", "plan.toml"].map(|name| format!("{folder}/{name}"));
    fs::write(place.path().join(&record), format!("time_s,velocity_m_per_s\n{rows}")).unwrap();
    fs::write(place.path().join(&volts), format!("time_s,ch1_V\n{rows}")).unwrap();
    let run = |arguments: &[&str]| {
        let (_, out, error) = harness::granchain(place.path(), arguments);
        out + &error
    };
    let after = |text: String, before: &str| {
        let (_, rest) = text.split_once(before).unwrap_or_else(|| panic!("`{before}` in {text}"));
        rest.lines().next().unwrap().trim().trim_end_matches('`').to_owned()
    };
    let commands = [
        after(run(&["scene", "init", &scene]), "run it with `"),
        after(run(&["spectrum", &volts, "--drive-frequency", "73kHz"]), "by values of your bench): "),
        after(run(&["start", &record, "--out", &plan]), "then fit and report:\n\n"),
    ];
    for command in commands {
        let line = format!("granchain() {{ for word; do printf '%s\\n' \"$word\"; done; }}; {command}");
        let output = Command::new("sh").args(["-c", &line]).current_dir(place.path()).output().unwrap();
        let words = String::from_utf8(output.stdout).unwrap();
        assert!(words.lines().any(|word| word.starts_with(folder)), "{command}: {words}");
        assert!(!place.path().join("pwned").exists(), "{command}");
    }
}

#[test]
fn results_of_another_kind_of_run_are_replaced_only_by_force() {
    let place = tempfile::tempdir().unwrap();
    let sweep = ["sweep", "--scene", "rigid", "--model", "chain", "--vary", "alpha=0.5,1", "--quiet", "--out", "out"];
    let replay = ["replay", "--scene", "rigid", "--model", "chain", "--quiet", "--out", "out"];
    let spectrum = ["spectrum", "vib.csv", "--quiet", "--out", "out"];
    fs::copy(Path::new(PROJECT).join("measurements/twin-annulus/vib.csv"), place.path().join("vib.csv")).unwrap();
    let run = |words: &[&str]| harness::granchain(place.path(), words);
    assert_eq!(run(&sweep).0, 0);
    assert_eq!(run(&sweep).0, 0);
    for other in [&replay[..], &spectrum] {
        let (code, _, err) = run(other);
        assert!(code == 1 && err.contains("which another kind of run wrote") && err.contains("--force"), "{err}");
        assert!(place.path().join("out/sweep.csv").is_file());
    }
    let (code, _, err) = run(&[&replay[..], &["--force"]].concat());
    assert_eq!(code, 0, "{err}");
    assert!(place.path().join("out/response.csv").is_file() && !place.path().join("out/sweep.csv").exists());
}
