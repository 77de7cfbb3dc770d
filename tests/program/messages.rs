//! What a refused input is told: the flag or line at fault, and what was probably meant.

use std::{fs, path::Path};

use super::harness::granchain;

const FIT: &[&str] = &["calibrate", "--measured", "vib.csv", "--drive", "horn_tip.csv", "--dry-run"];

fn bench() -> tempfile::TempDir {
    let place = tempfile::tempdir().unwrap();
    for name in ["vib.csv", "horn_tip.csv"] {
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("measurements/annulus-73khz").join(name);
        fs::copy(shipped, place.path().join(name)).unwrap();
    }
    place
}

fn refused(place: &Path, arguments: &[&str], expected: i32, parts: &[&str]) {
    let (code, _, error) = granchain(place, arguments);
    // A message is broken at blanks.
    let said = error.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(code, expected, "{arguments:?}: {error}");
    for part in parts {
        assert!(said.contains(part), "{arguments:?}: expected `{part}` in: {said}");
    }
}

#[test]
fn implausible_uncertainties_are_refused_with_the_unit_that_is_meant() {
    let place = bench();
    let cases: &[(&str, &str)] = &[
        ("gap=0.5", "found 0.5 m; did you mean \"0.5 nm\"?"),
        ("baseline=2", "did you mean \"2 nm\"?"),
        ("drive=5", "did you mean \"5 %\"?"),
        ("sensitivity=2", "did you mean \"2 %\"?"),
        ("modulus=1", "did you mean \"1 %\"?"),
        ("support_stiffness=10", "did you mean \"10 %\"?"),
        ("precompression=20", "did you mean \"20 mN\"?"),
        ("gap_scale=40", "expected at most 3"),
        ("gap=0.3kg", "expected a length such as `0.5 mm`, found `0.3kg`"),
        ("gape=1nm", "choose from: gap"),
    ];
    for (given, said) in cases {
        let flag = format!("--uncertainty {given}:");
        refused(place.path(), &[FIT, &["--uncertainty", given]].concat(), 2, &[&flag, said]);
    }
    let (code, _, error) = granchain(place.path(), &[FIT, &["--uncertainty", "gap=0.5 nm"]].concat());
    assert_eq!(code, 0, "{error}");
}

#[test]
fn the_flag_that_was_typed_is_named() {
    let place = bench();
    let fit = |more: &[&str], parts: &[&str]| refused(place.path(), &[FIT, more].concat(), 2, parts);
    fit(&["--damping", "viscous"], &["--damping viscous: expected one of none, linear"]);
    fit(&["--fit", "alpha,mass"], &["--fit: `mass` is not a parameter; choose from: alpha"]);
    fit(&["--bounds", "alpha=2:1"], &["--bounds alpha=2:1: `low` must be positive and smaller than `high`"]);
    fit(&["--evaluations", "5"], &["expected a whole number from 200 to 100000, found `5`"]);
    fit(&["--read", "delai=5us"], &["unknown key `delai`; did you mean `delay`?"]);
    let sweep = ["sweep", "--scene", "rigid", "--vary"];
    let vary =
        |text: &str, code: i32, part: &str| refused(place.path(), &[&sweep[..], &[text]].concat(), code, &[part]);
    vary("chain.colour=1,2", 1, "--vary chain.colour=1: unknown key");
    vary(
        "alpha=0.1kg",
        1,
        "--vary alpha=0.1 kg: `alpha`: expected a number without unit such as `0.7`, found `0.1 kg`, which is a mass",
    );
    vary(
        "drive.amplitude=1mg,2mg",
        1,
        "`drive.amplitude`: expected a length such as `0.5 mm`, found `1e-6 kg`, which is a mass",
    );
    vary("alpha=1:0:0.1", 2, "with a step of 0.1 the values never reach 0 from 1; write alpha=0:1:0.1");
    refused(place.path(), &["mesh", "--scene", "rigid", "--density", "0"], 2, &["a whole number from 2 to 128"]);
    refused(
        place.path(),
        &["coverage", "--scenario", "pretrigger"],
        2,
        &[
            "`--scenario` is gone; instead of it write `cargo run --release -p granchain-validate -- coverage --scenario NAMES`",
        ],
    );
}

#[test]
fn keys_are_suggested_only_when_they_are_near() {
    let place = tempfile::tempdir().unwrap();
    let told = |set: &str, part: &str| refused(place.path(), &["scene", "check", "annulus", "--set", set], 1, &[part]);
    told("a=1", "unknown key `a`; `granchain scene keys` lists all keys");
    told("damping.law=linear", "did you mean `damping.kind`?");
    told("law=linear", "did you mean `damping.kind`?");
    told("damping.xy=1", "`granchain scene keys` lists all keys");
    told("support.kind=ring", "did you mean `annulus`?");
    told("support.kind=wall", "did you mean `rigid`?");
    told("alpha=abc", "`alpha`: expected a number without unit such as `0.7`, found `abc`");
    for bench in ["ring", "annulus", "wall", "rigid"] {
        let file = format!("{bench}.toml");
        let (code, _, error) = granchain(place.path(), &["scene", "init", &file, "--bench", bench]);
        assert_eq!(code, 0, "{error}");
    }
    let text = |name: &str| {
        let text = fs::read_to_string(place.path().join(format!("{name}.toml"))).unwrap();
        text.replace(&format!("name = \"{name}\""), "")
    };
    assert_eq!((text("ring"), text("wall")), (text("annulus"), text("rigid")));
}

#[test]
fn plans_are_refused_by_line_with_what_is_meant() {
    let place = bench();
    let plan = |text: &str, code: i32, parts: &[&str]| {
        fs::write(place.path().join("p.toml"), format!("measured = \"vib.csv\"\n{text}\n")).unwrap();
        refused(place.path(), &["calibrate", "--plan", "p.toml", "--dry-run"], code, parts);
    };
    plan("evaluation = 600", 1, &["p.toml:2: unknown key `evaluation`; did you mean `evaluations`?"]);
    plan(
        "likelihood = \"both\"",
        1,
        &["p.toml:2: `likelihood`: expected one of `amplitudes`, `waveform`, found `both`"],
    );
    plan("[uncertainty]\ngap = \"0.3 kg\"", 1, &["p.toml:3: [uncertainty] gap: expected a length", "which is a mass"]);
    plan("[parameters.alpha]\nlow = 2\nhigh = 1", 1, &["p.toml:2: [parameters.alpha]: `low` must be positive"]);
    plan("[parameters.mass]\nlow = 1\nhigh = 2", 1, &["p.toml:2: [parameters.mass]: `mass` is not a parameter"]);
    refused(
        place.path(),
        &["calibrate", "--plan", "nope.toml"],
        1,
        &["nope.toml: expected a plan, found no such file"],
    );
    let replay = ["replay", "--calibration", "nothere"];
    refused(place.path(), &replay, 1, &["nothere: no such folder; make one with `granchain calibrate --out nothere`"]);
}

#[test]
fn files_that_are_no_records_are_told_apart() {
    let place = bench();
    for (name, text, said) in [
        ("plan.toml", "measured = \"vib.csv\"\n", "this is a plan, not a record; use `granchain calibrate --plan"),
        ("scene.toml", "extends = \"annulus\"\n", "this is a scene file, not a record"),
        ("bench.toml", "[vibrometer]\nchannel = \"CH1\"\n", "this is a bench file, not a record"),
    ] {
        fs::write(place.path().join(name), text).unwrap();
        refused(place.path(), &["inspect", name], 1, &[said]);
    }
    let (code, out, error) = granchain(place.path(), &["inspect", "."]);
    assert!(code == 0 && out.contains("this is a plan"), "{out}{error}");
    let flat: String = (0..4000).map(|i| format!("{:.1},25\n", f64::from(i) * 0.2)).collect();
    fs::write(place.path().join("flat_horn.csv"), format!("time_us,displacement_nm\n{flat}")).unwrap();
    let fit = ["calibrate", "--measured", "vib.csv", "--drive", "flat_horn.csv", "--dry-run"];
    refused(place.path(), &fit, 1, &["flat_horn.csv: the horn's record does not oscillate (all samples are 25 nm)"]);
}

#[test]
fn a_fit_of_five_parameters_is_warned_of() {
    let place = bench();
    let five = ["--fit", "alpha,damping,gap,drag,friction"];
    let (code, _, error) = granchain(place.path(), &[FIT, &five].concat());
    assert_eq!(code, 0, "{error}");
    assert!(error.contains("more than 4 parameters are fitted") && error.contains("never tested"), "{error}");
}
