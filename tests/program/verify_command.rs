//! `granchain verify`: a folder as written passes, an altered number does not and is named, and so is an altered page or input.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Output},
};

use granchain::measurement::sha256;

use crate::{
    calibrate_bench::Bench,
    harness::{code, stderr, stdout},
};
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
    bench.granchain(&[&["verify", "--quiet", "--cache", "none"], more].concat()).output().unwrap()
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

#[test]
fn a_fresh_calibration_passes_and_an_altered_number_page_or_input_is_named() {
    let bench = Bench::new();
    bench.add_horn_tip();
    let output = bench.calibrate(&["--out", "fresh", "--quiet", "--bounds", "alpha=0.2:2"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let before = bench.tree();
    let output = verify(&bench, &["fresh"]);
    assert_eq!(code(&output), 0, "{}{}", stdout(&output), stderr(&output));
    assert!(stdout(&output).contains("Verified: ") && stdout(&output).contains("within 1e-9"), "{}", stdout(&output));
    let output = verify(&bench, &["fresh", "--json"]);
    let outcome: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&outcome["verified"], &outcome["missing"]), (&true.into(), &Value::Array(vec![])));
    assert!(outcome["numbers"].as_u64().unwrap() > 5000, "{}", outcome["numbers"]);
    assert_eq!(bench.tree(), before, "nothing is written");

    let mut written = bench.contents("fresh");
    written.remove(".granchain");
    let mut whole = bench.contents("fresh");
    whole.insert("timing.json".into(), fs::read(bench.path("fresh/timing.json")).unwrap());
    a_folder_and_its_list_are_held_against_each_other(&bench, &whole);
    altered_files_are_named(&bench, &written);
    another_processor_may_round(&bench, &written);
    the_manifest_is_checked(&bench, &written);
    the_inputs_are_checked(&bench);
    a_colleague_finds_the_inputs_under_other_names(&bench);
    what_is_not_there_is_said(&bench, &written);
}

/// One byte of the list, in its form, a digest or a name.
fn a_folder_and_its_list_are_held_against_each_other(bench: &Bench, written: &BTreeMap<String, Vec<u8>>) {
    let list = String::from_utf8(written[".granchain"].clone()).unwrap();
    let at = |text: &str| list.find(text).unwrap();
    let page = at("  report.html");
    for (name, at) in
        [(".granchain", 3), (".granchain", page - 1), (".granchain", page + 4), (".granchain", at("varies"))]
    {
        let mut altered = written.clone();
        altered.get_mut(name).unwrap()[at] ^= 1;
        lay(&altered, &bench.path("listed"));
        let output = verify(bench, &["listed"]);
        assert_eq!(code(&output), 1, "{name}:{at}: {}", stdout(&output));
        assert!(stdout(&output).lines().any(|line| line.trim_end() == name), "{name}:{at}: {}", stdout(&output));
    }
    let mut part = written.clone();
    part.remove("report.html");
    lay(&part, &bench.path("part"));
    assert_eq!(code(&verify(bench, &["part"])), 0, "what is not there is no fault of the list");
}

/// Every file at once with another digit: numbers are named by their place, pages and pictures by their digest.
fn altered_files_are_named(bench: &Bench, written: &BTreeMap<String, Vec<u8>>) {
    let mut altered = written.clone();
    for (name, bytes) in altered.iter_mut().filter(|(name, _)| *name != "manifest.json") {
        let at = if name.ends_with(".png") {
            bytes.len() / 2
        } else {
            // The leading digit of a number with a point, far from the head; a figure may have whole numbers alone.
            let text = String::from_utf8_lossy(bytes).into_owned();
            let point = text.match_indices('.').map(|(at, _)| at).filter(|at| *at > text.len() / 3).find(|at| {
                let around = [text.as_bytes()[at - 1], *text.as_bytes().get(at + 1).unwrap_or(&b' ')];
                around.iter().all(u8::is_ascii_digit)
            });
            let digit = || (text.len() / 3..).find(|at| text.as_bytes()[*at].is_ascii_digit());
            point.map(|at| at - 1).or_else(digit).unwrap()
        };
        *bytes = with_another_digit(bytes, at);
    }
    lay(&altered, &bench.path("altered"));
    let output = verify(bench, &["altered", "--json"]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    let outcome: Value = serde_json::from_slice(&output.stdout).unwrap();
    let places: Vec<&str> =
        outcome["differences"].as_array().unwrap().iter().map(|it| it["place"].as_str().unwrap()).collect();
    for name in altered.keys().filter(|name| *name != "manifest.json") {
        let by_digest = !name.ends_with(".csv") && !name.ends_with(".json");
        let expected = if by_digest { format!("{name}: SHA-256") } else { format!("{name}:") };
        assert!(places.iter().any(|place| place.starts_with(&expected)), "{name}: {places:?}");
    }
    assert!(places.iter().any(|place| place.starts_with("features.csv:") && place.contains("column `")), "{places:?}");
}

/// A folder of another processor: its last digits are others.
fn another_processor_may_round(bench: &Bench, written: &BTreeMap<String, Vec<u8>>) {
    let others = |change: f64| {
        let mut folder = written.clone();
        let text = String::from_utf8(written["calibration.json"].clone()).unwrap();
        let is_long = |word: &&str| word.len() > 15 && word.contains('.') && word.parse::<f64>().is_ok();
        let number = text.split([',', ' ', '\n']).find(is_long).unwrap();
        let other = number.parse::<f64>().unwrap() * (1.0 + change);
        let digests = [&text, &text.replacen(number, &format!("{other}"), 1)].map(|text| sha256(text.as_bytes()));
        folder.insert("calibration.json".into(), text.replacen(number, &format!("{other}"), 1).into_bytes());
        let manifest = String::from_utf8(folder.remove("manifest.json").unwrap()).unwrap();
        let manifest = manifest.replace(&digests[0], &digests[1]);
        let (before, rest) = manifest.split_once("\"processor\": \"").unwrap();
        let manifest = format!("{before}\"processor\": \"aarch64\"{}", rest.split_once('"').unwrap().1);
        folder.insert("manifest.json".into(), manifest.into_bytes());
        folder
    };
    for (change, expected) in [(1e-8, 0), (1e-4, 1)] {
        lay(&others(change), &bench.path("altered"));
        let output = verify(bench, &["altered"]);
        assert_eq!(code(&output), expected, "{}", stdout(&output));
        assert!(stdout(&output).contains("1e-6"), "{}", stdout(&output));
    }
}

/// An altered digest of a table, and an altered name of a page.
fn the_manifest_is_checked(bench: &Bench, written: &BTreeMap<String, Vec<u8>>) {
    let text = String::from_utf8_lossy(&written["manifest.json"]).into_owned();
    let manifest: Value = serde_json::from_str(&text).unwrap();
    let digest = manifest["files"]["features.csv"].as_str().unwrap();
    let digit = with_another_digit(digest.as_bytes(), digest.find(|c: char| c.is_ascii_digit()).unwrap());
    let altered = text.replace(digest, &String::from_utf8(digit).unwrap()).replace("\"report.html", "\"page.html");
    let mut folder = written.clone();
    folder.insert("manifest.json".into(), altered.into_bytes());
    lay(&folder, &bench.path("forged"));
    let output = verify(bench, &["forged"]);
    assert_eq!(code(&output), 1, "{}", stdout(&output));
    for place in ["features.csv: SHA-256", "manifest.json: files.page.html", "manifest.json: files.report.html"] {
        assert!(stdout(&output).contains(place), "{place}: {}", stdout(&output));
    }
}

fn the_inputs_are_checked(bench: &Bench) {
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
        command.current_dir(mail.path()).args(["verify", "calibration", "--quiet"]).args(more).output().unwrap()
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
    some.retain(|name, _| !name.ends_with(".png") && !name.ends_with(".svg") && name != "report.md");
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

#[cfg(unix)]
#[test]
fn a_folder_without_a_manifest_is_refused_before_anything_in_it_is_read() {
    let place = tempfile::tempdir().unwrap();
    // Reading it fails.
    std::os::unix::fs::symlink("nowhere", place.path().join("a.bin")).unwrap();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_granchain"));
    let output = command.args(["verify"]).arg(place.path()).output().unwrap();
    assert_eq!(code(&output), 1);
    assert!(stderr(&output).contains("found no manifest.json"), "{}", stderr(&output));
}
