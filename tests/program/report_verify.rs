//! `granchain report verify`: a folder as written passes, one altered digit anywhere does not and is named.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Output},
};

use crate::{
    calibrate_bench::Bench,
    harness::{code, stderr, stdout},
};
use granchain::measurement::sha256;
use serde_json::Value;

/// Put the files of an outcome at a place of their own.
fn lay(files: &BTreeMap<String, Vec<u8>>, folder: &Path) {
    for (name, bytes) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
}

fn verify(bench: &Bench, more: &[&str]) -> Output {
    bench.granchain(&[&["report", "verify", "--quiet", "--cache", "none"], more].concat()).output().unwrap()
}

/// Bytes where a number stands in a file, every `stride`-th digit of them.
fn digits(bytes: &[u8], stride: usize) -> Vec<usize> {
    let all = bytes.iter().enumerate().filter(|(_, byte)| byte.is_ascii_digit()).map(|(at, _)| at);
    all.step_by(stride).collect()
}

fn with_another_digit(bytes: &[u8], at: usize) -> Vec<u8> {
    let mut altered = bytes.to_vec();
    altered[at] = if altered[at] == b'7' { b'3' } else { b'7' };
    altered
}

/// The word around a byte, as long as it may be cut in what is printed.
fn word(bytes: &[u8], at: usize) -> String {
    let text = std::str::from_utf8(bytes).unwrap();
    let part = |letter: char| letter.is_alphanumeric() || matches!(letter, '.' | '_' | '+' | '-' | '−');
    let begin = text[..at].char_indices().rev().find(|(_, letter)| !part(*letter));
    let begin = begin.map_or(0, |(before, letter)| before + letter.len_utf8());
    let end = text[at..].find(|letter| !part(letter)).map_or(text.len(), |end| at + end);
    text[begin..end].to_owned()
}

#[test]
fn a_fresh_calibration_passes_and_any_altered_digit_is_named() {
    let bench = Bench::new();
    bench.add_horn_tip();
    let output = bench.calibrate(&["--out", "fresh", "--quiet", "--bounds", "alpha=0.2:2"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let output = verify(&bench, &["fresh"]);
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    let said = stdout(&output);
    for part in [
        "inputs: drive, measured, scene",
        "12 of 200 runs made again",
        "fitted simulation run again",
        "Verified: every",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let before = bench.tree();
    let whole = verify(&bench, &["fresh", "--whole", "--json"]);
    assert_eq!(code(&whole), 0, "{}{}", stdout(&whole), stderr(&whole));
    let told: Value = serde_json::from_slice(&whole.stdout).unwrap();
    assert_eq!(
        (&told["verified"], &told["missing"], &told["unknown"]),
        (&true.into(), &Value::Array(vec![]), &Value::Array(vec![]))
    );
    assert!(told["parts"][1]["how"] == "all 200 runs made again", "{told}");
    assert_eq!(bench.tree(), before, "nothing is written");

    let mut written = bench.contents("fresh");
    written.remove(".granchain");
    every_file_is_held(&bench, &written);
    every_digit_of_the_outcome_is_held(&bench, &written);
    the_runs_the_manifest_and_the_times_are_held(&bench, &written);
    another_processor_is_held_to_rounding(&bench, &written);
    the_list_is_held(&bench);
    the_inputs_are_held(&bench);
    a_colleague_finds_the_inputs_under_other_names(&bench);
    what_is_not_there_is_said(&bench, &written);
}

/// Every file at once, forty words of each with another digit: all are found in one go, each is named with what should stand there.
fn every_file_is_held(bench: &Bench, written: &BTreeMap<String, Vec<u8>>) {
    let mut altered = written.clone();
    // The times of the run are no part of what equal runs share.
    altered.insert("timing.json".into(), fs::read(bench.path("fresh/timing.json")).unwrap());
    let mut expected = Vec::new();
    for (name, bytes) in &mut altered {
        // What everything is derived from is altered apart.
        if name == "manifest.json" || name == "fingerprints.csv" {
            continue;
        }
        let whole = bytes.clone();
        if name.ends_with(".png") {
            *bytes = with_another_digit(&whole, whole.len() / 2);
            expected.push((name.clone(), String::new(), whole.len() / 2));
            continue;
        }
        // The page's command line, too, is one of the things to begin from; it stands last.
        let end = std::str::from_utf8(&whole).unwrap().find("<pre>granchain").unwrap_or(whole.len());
        // So does the program, which the outcome names first.
        let begin = if name == "calibration.json" { whole.iter().position(|byte| *byte == b',').unwrap() } else { 0 };
        let digits: Vec<usize> = digits(&whole[..end], 1).into_iter().filter(|at| *at > begin).collect();
        let mut last = String::new();
        let mut next = 0;
        for at in digits.iter().step_by((digits.len() / 40).max(1)).copied() {
            // One digit a word, and one alone in a file with a digest for all of it.
            if at < next || (name == "timing.json" && !last.is_empty()) {
                continue;
            }
            last = word(&whole, at);
            next = at + last.len();
            *bytes = with_another_digit(bytes, at);
            expected.push((name.clone(), last.clone(), at));
        }
    }
    assert!(expected.len() > 500, "{}", expected.len());
    lay(&altered, &bench.path("altered"));
    let output = verify(bench, &["altered", "--json"]);
    assert_eq!(code(&output), 1, "{}{}", stdout(&output), stderr(&output));
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let differences = told["differences"].as_array().unwrap();
    let mut of_file: BTreeMap<&str, Vec<&Value>> = BTreeMap::new();
    for difference in differences {
        assert_ne!(difference["expected"], difference["found"]);
        of_file.entry(difference["place"].as_str().unwrap().split(':').next().unwrap()).or_default().push(difference);
    }
    for (name, word, at) in &expected {
        let mut found = of_file.get(name.as_str()).unwrap_or_else(|| panic!("{name} is not named")).iter();
        let shows = |it: &&&Value| word.contains(it["expected"].as_str().unwrap().trim_matches('…'));
        let alone = word.is_empty() || name == "timing.json";
        assert!(
            alone || found.any(|it| shows(&it)),
            "{name}, byte {at}: `{word}` is not named: {:#?}",
            of_file[name.as_str()]
        );
    }
    assert_eq!(differences.len(), expected.len());
    fs::remove_file(bench.path("altered/timing.json")).unwrap();
}

/// Every number of `calibration.json`, a digit of each altered at once: as many numbers are named.
fn every_digit_of_the_outcome_is_held(bench: &Bench, written: &BTreeMap<String, Vec<u8>>) {
    let name = "calibration.json";
    let text = std::str::from_utf8(&written[name]).unwrap();
    let mut altered = written.clone();
    let mut words = 0;
    let bytes = altered.get_mut(name).unwrap();
    for (index, line) in text.lines().enumerate() {
        let begin: usize = text.lines().take(index).map(|line| line.len() + 1).sum();
        let Some(value) =
            line.find(": ").map(|at| at + 2).or_else(|| line.trim().starts_with(char::is_numeric).then_some(0))
        else {
            continue;
        };
        // Paths and the program are what other files say, too; here are the numbers.
        if line[value..].trim_start().starts_with('"') {
            continue;
        }
        if let Some(last) = line[value..].rfind(|letter: char| letter.is_ascii_digit()) {
            *bytes = with_another_digit(bytes, begin + value + last);
            words += 1;
        }
    }
    assert!(words > 200, "{words}");
    lay(&altered, &bench.path("altered"));
    let output = verify(bench, &["altered", "--json"]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let differences = told["differences"].as_array().unwrap();
    assert_eq!(differences.len(), words, "{differences:#?}");
    let places: Vec<&str> = differences.iter().map(|it| it["place"].as_str().unwrap()).collect();
    for path in ["parameters.alpha.value", "features.positive_peak.simulated", "lobes[0].mass", "failed_runs", "seed"] {
        assert!(places.iter().any(|place| place.ends_with(&format!(": {path}"))), "{path}: {places:?}");
    }
}

fn the_runs_the_manifest_and_the_times_are_held(bench: &Bench, written: &BTreeMap<String, Vec<u8>>) {
    let runs = &written["fingerprints.csv"];
    let all = digits(runs, 1);
    {
        let at = all[all.len() * 11 / 20];
        let mut altered = written.clone();
        altered.insert("fingerprints.csv".into(), with_another_digit(runs, at));
        lay(&altered, &bench.path("altered"));
        let output = verify(bench, &["altered"]);
        assert_eq!(code(&output), 1, "{}", stderr(&output));
        let line = runs[..at].iter().filter(|byte| **byte == b'\n').count() + 1;
        let said = stdout(&output);
        assert!(said.contains(&format!("fingerprints.csv:{line}: column `")), "byte {at}: {said}");
        assert!(said.contains(&format!("expected {}", word(runs, at))), "byte {at}: {said}");
        // The file's own digest in the manifest is right.
        assert!(said.contains("Not verified: one number"), "{said}");
    }
    // A run made up, with a digest to match: the runs made again find it.
    let mut altered = written.clone();
    let text = std::str::from_utf8(runs).unwrap();
    let first = text.lines().nth(1).unwrap();
    let z = first.split(',').nth(9).unwrap();
    let forged = text.replacen(z, &format!("{}1", &z[..z.len() - 1]), 1);
    let manifest = std::str::from_utf8(&written["manifest.json"]).unwrap();
    altered.insert("manifest.json".into(), manifest.replace(&sha256(runs), &sha256(forged.as_bytes())).into_bytes());
    altered.insert("fingerprints.csv".into(), forged.into_bytes());
    lay(&altered, &bench.path("altered"));
    let output = verify(bench, &["altered"]);
    assert_eq!(code(&output), 1);
    assert!(stdout(&output).contains("fingerprints.csv: run 1 of linear"), "{}", stdout(&output));

    // Digests of files.
    let begin = manifest.find("\"files\"").unwrap();
    let places: Vec<usize> = digits(manifest.as_bytes(), 1).into_iter().filter(|at| *at > begin).collect();
    let bytes = with_another_digit(manifest.as_bytes(), places[places.len() / 3]);
    let bytes = with_another_digit(&bytes, places[2 * places.len() / 3]);
    let mut altered = written.clone();
    altered.insert("manifest.json".into(), bytes);
    lay(&altered, &bench.path("altered"));
    let output = verify(bench, &["altered"]);
    assert_eq!(code(&output), 1);
    let said = stdout(&output);
    assert!(said.contains(": files.") && said.contains(": 2 numbers"), "{said}");
    // What stands there twice, or is the digest of an input: refused before anything is run.
    for (from, to, named) in [
        ("granchain 0.1.0", "granchain 0.1.7", "manifest.json: program, beside calibration.json"),
        ("\"200\"", "\"700\"", "manifest.json: arguments, beside report.html"),
        ("lab/horn_tip.csv", "lab/horn_tip7.csv", "manifest.json: inputs.drive.path"),
        ("\"sha256\": \"", "\"sha256\": \"0", "manifest.json: inputs.drive.sha256"),
    ] {
        let mut altered = written.clone();
        altered.insert("manifest.json".into(), manifest.replacen(from, to, 1).into_bytes());
        lay(&altered, &bench.path("altered"));
        let output = verify(bench, &["altered"]);
        assert_eq!(code(&output), 1);
        let said = stdout(&output) + &stderr(&output);
        assert!(said.contains(named), "{said}");
        assert!(!named.ends_with("sha256") || said.contains("calibration.json knows this file"), "{said}");
    }
}

/// A folder of another processor: its last digits are others, and so are its digests, and the runs made again.
fn another_processor_is_held_to_rounding(bench: &Bench, written: &BTreeMap<String, Vec<u8>>) {
    let texts = ["calibration.json", "features.csv", "fingerprints.csv"];
    let others = |change: f64| {
        let mut folder = written.clone();
        let mut manifest = String::from_utf8(folder.remove("manifest.json").unwrap()).unwrap();
        for name in texts {
            let text = String::from_utf8(written[name].clone()).unwrap();
            // The first number with more digits than a constant of the scene.
            let is_long = |word: &&str| word.len() > 15 && word.contains('.') && word.parse::<f64>().is_ok();
            let number = text.split([',', ' ', '\n']).find(is_long).unwrap();
            let other = number.parse::<f64>().unwrap() * (1.0 + change);
            let text = text.replacen(number, &format!("{other}"), 1).into_bytes();
            manifest = manifest.replace(&sha256(&written[name]), &sha256(&text));
            folder.insert(name.into(), text);
        }
        let (before, rest) = manifest.split_once("\"processor\": \"").unwrap();
        let manifest = format!("{before}\"processor\": \"aarch64\"{}", rest.split_once('"').unwrap().1);
        folder.insert("manifest.json".into(), manifest.into_bytes());
        folder
    };
    lay(&others(1e-10), &bench.path("altered"));
    let output = verify(bench, &["altered"]);
    let said = stdout(&output);
    assert_eq!(code(&output), 0, "{said}{}", stderr(&output));
    for part in [
        "Verified to rounding",
        "aarch64",
        "all the same but for rounding",
        "are not the same to the last digit, the farthest by ",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    lay(&others(1e-4), &bench.path("altered"));
    let output = verify(bench, &["altered", "--json"]);
    assert_eq!(code(&output), 1);
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let places: Vec<&str> =
        told["differences"].as_array().unwrap().iter().map(|it| it["place"].as_str().unwrap()).collect();
    for name in texts {
        assert!(places.iter().any(|place| place.starts_with(name)), "{name}: {places:?}");
    }
    // What was taken out is told of, no more.
    let mut less = others(1e-10);
    less.remove("report.md").unwrap();
    fs::remove_dir_all(bench.path("altered")).unwrap();
    lay(&less, &bench.path("altered"));
    let output = verify(bench, &["altered"]);
    assert_eq!(code(&output), 0, "{}", stdout(&output));
    assert!(stdout(&output).contains("not in the folder, so not verified: report.md"), "{}", stdout(&output));
    // A picture is held by its digest.
    let mut altered = others(1e-10);
    let picture = altered.keys().find(|name| name.ends_with(".png")).unwrap().clone();
    let bytes = &altered[&picture];
    let bytes = with_another_digit(bytes, bytes.len() / 2);
    altered.insert(picture.clone(), bytes);
    lay(&altered, &bench.path("altered"));
    let output = verify(bench, &["altered"]);
    assert_eq!(code(&output), 1);
    assert!(stdout(&output).contains(&picture), "{}", stdout(&output));
}

fn the_inputs_are_held(bench: &Bench) {
    for name in ["lab/vib.csv", "lab/horn_tip.csv", "bench.toml"] {
        let whole = fs::read(bench.path(name)).unwrap();
        let places = digits(&whole, 1);
        bench.write(name, with_another_digit(&whole, places[places.len() / 2]));
        let output = verify(bench, &["fresh"]);
        assert_eq!(code(&output), 1);
        let said = stderr(&output);
        assert!(said.contains("manifest.json: inputs.") && said.contains(name) && said.contains("--inputs"), "{said}");
        bench.write(name, whole);
    }
}

fn a_colleague_finds_the_inputs_under_other_names(bench: &Bench) {
    let mail = tempfile::tempdir().unwrap();
    for (name, sent) in [("lab/vib.csv", "a.csv"), ("lab/horn_tip.csv", "b.csv"), ("bench.toml", "scenes/c.txt")] {
        let target = mail.path().join(sent);
        fs::create_dir_all(target.parent().unwrap()).unwrap();
        fs::copy(bench.path(name), target).unwrap();
    }
    lay(&bench.contents("fresh"), &mail.path().join("calibration"));
    let there = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
        command
            .current_dir(mail.path())
            .args(["report", "verify", "calibration", "--quiet"])
            .args(more)
            .output()
            .unwrap()
    };
    let output = there(&["--inputs", "."]);
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    let output = there(&[]);
    assert_eq!(code(&output), 1);
    assert!(stderr(&output).contains("--inputs"), "{}", stderr(&output));
    fs::remove_file(mail.path().join("b.csv")).unwrap();
    let output = there(&["--inputs", "."]);
    assert_eq!(code(&output), 1);
    assert!(
        stderr(&output).contains("inputs.drive.sha256") && stderr(&output).contains("lab/horn_tip.csv"),
        "{}",
        stderr(&output)
    );
}

/// Every kind of byte of `.granchain`: its form, a digest, a name, an end of line.
fn the_list_is_held(bench: &Bench) {
    let path = bench.path("fresh/.granchain");
    let whole = fs::read(&path).unwrap();
    let digest = whole.iter().position(|byte| *byte == b'\n').unwrap() + 5;
    for at in [3, digest, digest + 65, whole.len() / 2, whole.len() - 1] {
        let mut altered = whole.clone();
        altered[at] ^= 1;
        fs::write(&path, altered).unwrap();
        let output = verify(bench, &["fresh"]);
        assert_eq!(code(&output), 1, "byte {at}: {}", stdout(&output));
        assert!(stdout(&output).contains(".granchain:"), "byte {at}: {}", stdout(&output));
    }
    fs::write(&path, whole).unwrap();
    assert_eq!(code(&verify(bench, &["fresh"])), 0);
}

#[test]
#[cfg(unix)]
fn a_record_whose_name_is_no_text_is_refused_with_what_to_do() {
    use std::os::unix::ffi::OsStrExt;

    let bench = Bench::new();
    let name = std::ffi::OsStr::from_bytes(b"vib-\xff.csv");
    fs::rename(bench.path("lab/vib.csv"), bench.path("lab").join(name)).unwrap();
    let mut calibrate =
        bench.granchain(&["calibrate", "--scene", "bench.toml", "--evaluations", "200", "--out", "fresh"]);
    let output = calibrate.arg("--measured").arg(Path::new("lab").join(name)).output().unwrap();
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let output = verify(&bench, &["fresh"]);
    let remedy =
        "was not UTF-8 text, and the manifest cannot name it; give the file a name in UTF-8 and calibrate again";
    assert!(code(&output) == 1 && stderr(&output).contains(remedy), "{}", stderr(&output));
}

fn what_is_not_there_is_said(bench: &Bench, written: &BTreeMap<String, Vec<u8>>) {
    let mut some = written.clone();
    some.retain(|name, _| !name.ends_with(".png") && name != "report.md");
    some.insert("thesis.tex".into(), b"years of work".to_vec());
    lay(&some, &bench.path("some"));
    let output = verify(bench, &["some"]);
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    let said = stdout(&output);
    assert!(said.contains("not in the folder, so not verified: figures/") && said.contains(" more\n"), "{said}");
    assert!(said.contains("not of the manifest, so not verified: thesis.tex"), "{said}");
    fs::remove_file(bench.path("some/manifest.json")).unwrap();
    let output = verify(bench, &["some"]);
    assert_eq!(code(&output), 1);
    assert!(stderr(&output).contains("found no manifest.json"), "{}", stderr(&output));
}

/// Their last digits are those of a vector unit.
#[test]
#[cfg(target_arch = "x86_64")]
fn the_sample_reports_are_what_follows_from_the_shipped_records() {
    if !(std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma")) {
        return;
    }
    for name in ["annulus-73khz", "twin-annulus", "twin-water"] {
        let folder = format!("reports/{name}");
        let output = Command::new(env!("CARGO_BIN_EXE_granchain"))
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .args(["report", "verify", &folder, "--quiet", "--cache", "none"])
            .output()
            .unwrap();
        assert_eq!(code(&output), 0, "{name}: {}{}", stdout(&output), stderr(&output));
        assert!(stdout(&output).contains("not in the folder, so not verified: figures/"), "{}", stdout(&output));
    }
}

#[cfg(unix)]
#[test]
fn a_folder_without_a_manifest_is_refused_before_anything_in_it_is_read() {
    let place = tempfile::tempdir().unwrap();
    // Reading it fails.
    std::os::unix::fs::symlink("nowhere", place.path().join("a.bin")).unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_granchain"));
    let output = command.args(["report", "verify"]).arg(place.path()).output().unwrap();
    assert_eq!(code(&output), 1);
    assert!(stderr(&output).contains("found no manifest.json"), "{}", stderr(&output));
}
