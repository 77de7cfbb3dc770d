//! `granchain calibrate` on hits of a striker: what it finds, what it rejects, what it refuses.

use std::{fmt::Write as _, fs, path::Path};

use serde_json::Value;

use crate::harness::granchain;

/// Hits on a column of the impact bench at a modulus of 120 MPa and a loss of 50 µs, one for each velocity (m/s), unless `sets` say otherwise: time (s)
/// and force (N) every 19 µs, behind an AC coupling of such a corner (Hz).
fn struck(folder: &Path, corner: f64, velocities: &[f64], sets: &[&str]) -> Vec<Vec<[f64; 2]>> {
    let of = |velocity: &f64| {
        let velocity_set = format!("drive.velocity={velocity} m/s");
        let usual = ["support.youngs_modulus=120 MPa", "support.loss_time=50 us", &velocity_set];
        let mut all = vec!["replay", "--quiet", "--force", "--out", "run", "--scene", "impact"];
        usual.iter().chain(sets).for_each(|set| all.extend(["--set", set]));
        let (code, _, err) = granchain(folder, &all);
        assert_eq!(code, 0, "{err}");
        let response = fs::read_to_string(folder.join("run/response.csv")).unwrap();
        let sensor = response.lines().next().unwrap().split(',').position(|name| name == "sensor_force_n").unwrap();
        // Another phase of the sampling in every hit.
        let first = (1e4 * velocity) as usize % 19;
        let (mut before, mut passed) = (None, 0.0);
        let row = |line: &str| {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            let (time, force) = (cells[0], cells[sensor]);
            let (since, last) = before.replace((time, force)).unwrap_or((time, force));
            passed = (passed + force - last) * (-std::f64::consts::TAU * corner * (time - since)).exp();
            [time, passed]
        };
        response.lines().skip(1).map(row).skip(first).step_by(19).collect()
    };
    velocities.iter().map(of).collect()
}

/// The files of some hits, as a sensor of some gain records them.
fn written(folder: &Path, name: &str, gain: f64, hits: &[Vec<[f64; 2]>]) -> Vec<String> {
    let of = |(number, rows): (usize, &Vec<[f64; 2]>)| {
        let mut text = "time_s,sensor_V\n".to_owned();
        rows.iter().for_each(|[time, force]| writeln!(text, "{time:.7},{:e}", 0.3 + gain * force).unwrap());
        let name = format!("{name}-{number}.csv");
        fs::write(folder.join(&name), text).unwrap();
        name
    };
    hits.iter().enumerate().map(of).collect()
}

fn hits(folder: &Path, gain: f64, velocities: &[f64]) -> Vec<String> {
    written(folder, "hit", gain, &struck(folder, 0.0, velocities, &[]))
}

/// Noise of a deviation (N), the same in every run.
fn noise(deviation: f64) -> impl FnMut() -> f64 {
    let mut state = 1u64;
    move || {
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        // Twelve uniform numbers have a variance of 1.
        deviation * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0)
    }
}

fn words(outcome: &Value, pointer: &str) -> String {
    outcome.pointer(pointer).map_or_else(String::new, ToString::to_string)
}

/// Value and ends of the modulus, MPa.
fn modulus(outcome: &Value) -> [f64; 3] {
    ["value", "low", "high"].map(|key| 1e-6 * number(outcome, &format!("/parameters/support_modulus/{key}")))
}

#[test]
fn a_clock_stated_too_fast_or_too_slow_is_rejected_and_named() {
    let place = tempfile::tempdir().unwrap();
    let right = struck(place.path(), 800.0, &VELOCITIES, &[]);
    for factor in [0.5, 1.6] {
        let wrong: Vec<Vec<[f64; 2]>> =
            right.iter().map(|hit| hit.iter().map(|[time, force]| [factor * time, *force]).collect()).collect();
        let files = written(place.path(), "clock", 1e-3, &wrong);
        let outcome = calibrated(place.path(), &files, &["--out", "clock", "--force"]);
        assert_eq!(outcome["verdict"], "outside scatter", "{factor}: {outcome:#}");
        assert_eq!(outcome.pointer("/diagnosis/0/cause").unwrap(), "clock", "{factor}: {outcome:#}");
        let text = words(&outcome, "/diagnosis/0/text");
        let named: f64 = text.split("samples are ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((named * factor - 1.0).abs() < 0.1, "{factor}: {text}");
    }
}

#[test]
fn what_the_sensor_reads_is_a_key_and_named_where_it_is_another() {
    let place = tempfile::tempdir().unwrap();
    let behind = struck(place.path(), 800.0, &VELOCITIES, &["chain.sensor_share=0"]);
    let files = written(place.path(), "behind", 1e-3, &behind);
    let outcome = calibrated(place.path(), &files, &["--out", "mean"]);
    assert_ne!(outcome["verdict"], "within scatter", "{outcome:#}");
    assert!(words(&outcome, "/diagnosis").contains("\"sensor\""), "{outcome:#}");
    let outcome = calibrated(place.path(), &files, &["--out", "behind", "--set", "chain.sensor_share=0"]);
    let [_, low, high] = modulus(&outcome);
    assert!(outcome["verdict"] == "within scatter" && low < 120.0 && 120.0 < high, "{outcome:#}");
}

#[test]
fn a_record_of_noise_is_left_out_and_a_wide_scatter_is_warned_of() {
    let place = tempfile::tempdir().unwrap();
    let mut noise = noise(1.0);
    let mut all = struck(place.path(), 800.0, &VELOCITIES, &[]);
    all.iter_mut().flatten().for_each(|row| row[1] += 0.5 * noise());
    let without = calibrated(place.path(), &written(place.path(), "hit", 1e-3, &all), &["--out", "without"]);
    assert!(without["warnings"].as_array().unwrap().is_empty(), "{without:#}");
    let quiet: Vec<[f64; 2]> = all[0].iter().map(|[time, _]| [*time, noise()]).collect();
    all.insert(2, quiet);
    let with = calibrated(place.path(), &written(place.path(), "with", 1e-3, &all), &["--out", "with"]);
    assert_eq!(modulus(&with), modulus(&without));
    assert!(words(&with, "/warnings/0").contains("with-2.csv: left out"), "{with:#}");
    assert!(with["hits"].as_array().unwrap().len() == 4 && with["inputs"].as_object().unwrap().len() == 5, "{with:#}");
    let (code, out, err) = granchain(place.path(), &["verify", "with"]);
    assert!(code == 0 && out.contains("Verified"), "{out}{err}");
    // A hit on another specimen among them is a hit: it is warned of.
    all[2] =
        struck(place.path(), 800.0, &VELOCITIES[..1], &["support.youngs_modulus=15 MPa", "duration=5 ms"]).remove(0);
    let mixed = calibrated(place.path(), &written(place.path(), "mixed", 1e-3, &all), &["--out", "mixed"]);
    assert!(words(&mixed, "/warnings").contains("% in return_time"), "{mixed:#}");
    let [value, low, high] = modulus(&mixed);
    assert!(low.is_nan() || (low..=high).contains(&value), "{low} {value} {high}");
}

#[test]
fn what_comes_before_an_impulse_can_have_returned_is_no_return() {
    let place = tempfile::tempdir().unwrap();
    let clean = struck(place.path(), 800.0, &VELOCITIES, &[]);
    // The striker bounces, or the cable does: a second bump of a third of the height.
    let bounced: Vec<Vec<[f64; 2]>> = clean
        .iter()
        .map(|hit| {
            let bump = |time: f64| {
                let arrival = hit.iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap()[0];
                35.0 * (-((time - arrival - 200e-6) / 30e-6).powi(2)).exp()
            };
            hit.iter().map(|[time, force]| [*time, force + bump(*time)]).collect()
        })
        .collect();
    let of = |name: &str, hits| {
        let outcome = calibrated(place.path(), &written(place.path(), name, 1e-3, hits), &["--out", name]);
        number(&outcome, "/return_time/measured")
    };
    let [clean_time, bounced_time] = [of("clean", &clean), of("bounced", &bounced)];
    assert!((bounced_time / clean_time - 1.0).abs() < 0.01, "{clean_time:e} {bounced_time:e}");
    // Without a later one there is none.
    let cut: Vec<Vec<[f64; 2]>> = bounced.iter().map(|hit| hit[..hit.len() / 3].to_vec()).collect();
    let files = written(place.path(), "cut", 1e-3, &cut);
    let (code, _, err) = granchain(place.path(), &["calibrate", "--scene", "impact", "--measured", &files[0]]);
    assert!(code == 1 && err.contains("found one 2") && err.contains("twice its way to the last bead"), "{code} {err}");
}

#[test]
fn several_set_ups_state_what_a_new_one_changes_and_one_says_that_it_is_one() {
    let place = tempfile::tempdir().unwrap();
    let mut plan = "scene = 'impact'\n".to_owned();
    for (name, modulus) in [("a", 90), ("b", 120), ("c", 160)] {
        let hits = struck(place.path(), 800.0, &VELOCITIES[..2], &[&format!("support.youngs_modulus={modulus} MPa")]);
        for file in written(place.path(), name, 1e-3, &hits) {
            writeln!(plan, "[[record]]\nmeasured = '{file}'\nset_up = '{name}'").unwrap();
        }
    }
    fs::write(place.path().join("plan.toml"), &plan).unwrap();
    let (code, text, err) = granchain(place.path(), &["calibrate", "--json", "--quiet", "--plan", "plan.toml"]);
    assert_eq!(code, 0, "{err}");
    let several: Value = serde_json::from_str(&text).unwrap();
    let said = words(&several, "/set_up");
    assert!(said.contains("3 set-ups: support_modulus") && said.contains("(c): a factor of 1."), "{said}");
    let one = calibrated(place.path(), &["b-0.csv".into(), "b-1.csv".into()], &["--out", "one"]);
    assert!(words(&one, "/set_up").contains("one set-up tells of one set-up"), "{one:#}");
    let [[value, low, high], [_, one_low, one_high]] = [modulus(&several), modulus(&one)];
    assert!((value / 120.0 - 1.0).abs() < 0.15 && low < 120.0 && 120.0 < high, "{low} {value} {high}");
    assert!(high / low > 1.15 * one_high / one_low, "{high} {low}, {one_high} {one_low}");
}

const VELOCITIES: [f64; 4] = [0.251, 0.257, 0.262, 0.268];

fn calibrated(folder: &Path, files: &[String], more: &[&str]) -> Value {
    let mut arguments = vec!["calibrate", "--json", "--quiet", "--scene", "impact", "--measured"];
    arguments.extend(files.iter().map(String::as_str));
    arguments.extend(more);
    let (code, out, err) = granchain(folder, &arguments);
    assert_eq!(code, 0, "{err}");
    serde_json::from_str(&out).unwrap()
}

fn number(outcome: &Value, pointer: &str) -> f64 {
    outcome.pointer(pointer).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

#[test]
fn modulus_is_found_whatever_the_gain_and_the_same_with_any_number_of_threads() {
    let place = tempfile::tempdir().unwrap();
    let files = hits(place.path(), 1e-3, &VELOCITIES);
    let first = calibrated(place.path(), &files, &["--out", "a", "--threads", "1"]);
    assert_eq!(first["verdict"], "within scatter", "{first:#}");
    let [value, low, high] =
        ["value", "low", "high"].map(|key| number(&first, &format!("/parameters/support_modulus/{key}")));
    // A scene of 60 MPa, a truth of 120 MPa: within what a set-up leaves open, and its interval holds it.
    assert!(
        (value / 120e6 - 1.0).abs() < 0.1 && low < 120e6 && 120e6 < high && high < 1.5 * low,
        "{low:e} {value:e} {high:e}"
    );
    assert_eq!(number(&first, "/return_time/within"), 4.0);
    calibrated(place.path(), &files, &["--out", "b", "--threads", "2"]);
    for name in ["calibration.json", "runs.csv", "report.html"] {
        assert!(
            fs::read(place.path().join("a").join(name)).unwrap()
                == fs::read(place.path().join("b").join(name)).unwrap(),
            "{name}"
        );
    }
    let (code, out, err) = granchain(place.path(), &["verify", "a"]);
    assert!(code == 0 && out.contains("Verified"), "{out}{err}");
    // The runs of a fit last as long as the hits ask for.
    let short = calibrated(place.path(), &files, &["--out", "short", "--set", "duration=500 us"]);
    let duration = "not 500 µs (`duration`)";
    assert!(words(&short, "/assumptions").contains(duration) && short["verdict"] == "within scatter", "{short:#}");
    // The gain of another sensor, negative.
    let other = hits(place.path(), -0.7, &VELOCITIES);
    let again = calibrated(place.path(), &other, &["--out", "c"]);
    let same = number(&again, "/parameters/support_modulus/value");
    assert!((same / value - 1.0).abs() < 1e-3, "{same:e} {value:e}");
    assert!(!first.to_string().contains("gain\":"), "no gain is reported");
}

#[test]
fn a_support_of_another_modulus_is_rejected_and_named() {
    let place = tempfile::tempdir().unwrap();
    let files = hits(place.path(), 1e-3, &VELOCITIES);
    let outcome = calibrated(
        place.path(),
        &files,
        &["--fit", "support_loss", "--set", "support.youngs_modulus=70 MPa", "--out", "fit"],
    );
    assert_eq!(outcome["verdict"], "outside scatter", "{outcome:#}");
    assert!(outcome.pointer("/parameters/support_loss/low").unwrap().is_null());
    assert_eq!(outcome.pointer("/diagnosis/0/cause").unwrap(), "support", "{outcome:#}");
    let report = fs::read_to_string(place.path().join("fit/report.html")).unwrap();
    assert!(report.contains("Inconsistent") && report.contains("the support has another modulus"));
}

#[test]
fn what_cannot_be_fitted_is_refused_with_its_place() {
    let place = tempfile::tempdir().unwrap();
    let files = hits(place.path(), 1e-3, &VELOCITIES[..1]);
    let good = files[0].as_str();
    let lines: Vec<String> = fs::read_to_string(place.path().join(good)).unwrap().lines().map(str::to_owned).collect();
    // Cut before the impulse returns; sampled half as often.
    fs::write(place.path().join("short.csv"), lines[..50].join("\n") + "\n").unwrap();
    let half: Vec<&String> = lines[1..].iter().step_by(2).collect();
    fs::write(
        place.path().join("half.csv"),
        format!("{}\n{}\n", lines[0], half.iter().map(|line| line.as_str()).collect::<Vec<_>>().join("\n")),
    )
    .unwrap();
    for (arguments, phrases) in [
        (
            vec!["--measured", "short.csv"],
            vec!["short.csv", "expected an incident and a returned impulse", "record longer"],
        ),
        (vec!["--measured", good, "half.csv"], vec!["half.csv: sampled every 3.8", "sampled alike"]),
        (vec!["--measured", good, "--drive", "horn.csv"], vec!["--drive would do nothing with a striker"]),
        (vec!["--measured", good, "--fit", "precompression"], vec!["--fit precompression", "expected some of alpha"]),
        (
            vec!["--measured", good, "--uncertainty", "gap=1nm"],
            vec!["uncertainty of `gap`", "drive (its velocity), modulus"],
        ),
        (
            vec!["--measured", good, "--set", "support.kind=rigid"],
            vec!["`support_modulus` belongs to an elastic foundation"],
        ),
    ] {
        let mut all = vec!["calibrate", "--scene", "impact", "--out", "fit"];
        all.extend(&arguments);
        let (code, _, err) = granchain(place.path(), &all);
        assert!(code == 1 || code == 2, "{arguments:?}: {code} {err}");
        assert!(phrases.iter().all(|phrase| err.contains(phrase)), "{arguments:?}: {err}");
        assert!(!place.path().join("fit").exists(), "{arguments:?}");
    }
}

/// Counts of `coverage --scenario impact`: records, intervals that contain the true value, wrongly inconsistent, median width of the modulus.
fn counted(folder: &Path, more: &[&str]) -> (u64, [u64; 2], u64, f64) {
    let (code, out, err) =
        granchain(folder, &[&["coverage", "--scenario", "impact", "--json", "--quiet"], more].concat());
    assert_eq!(code, 0, "{err}");
    let summary: Value = serde_json::from_str(&out).unwrap();
    let whole = |pointer: &str| summary.pointer(pointer).and_then(Value::as_u64).unwrap();
    let held = ["/count/held/0", "/count/held/1"].map(whole);
    (whole("/count/count"), held, whole("/count/outside"), number(&summary, "/count/widths/0"))
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn a_few_synthetic_columns_are_fitted_none_is_called_inconsistent_and_parts_are_the_whole() {
    let place = tempfile::tempdir().unwrap();
    let (count, held, outside, _) = counted(place.path(), &["--count", "4", "--seed", "11", "--out", "whole"]);
    assert!(count == 4 && outside == 0 && held.iter().all(|held| *held >= 3), "{held:?}");
    for part in ["1/2", "2/2"] {
        let out = format!("part{}", &part[..1]);
        let all = ["coverage", "--scenario", "impact", "--count", "4", "--seed", "11", "--part", part, "--out", &out];
        assert_eq!(granchain(place.path(), &all).0, 0);
    }
    assert_eq!(granchain(place.path(), &["merge", "part1", "part2", "--out", "merged"]).0, 0);
    let read = |folder: &str| fs::read(place.path().join(folder).join("coverage.json")).unwrap();
    assert!(read("whole") == read("merged"));
    for wrong in [&["--amplitudes"][..], &["--model", "chain"], &["--scenario", "bits"]] {
        let all = [&["coverage", "--scenario", "impact"], wrong].concat();
        let (code, _, err) = granchain(place.path(), &all);
        assert!(code == 2 && err.contains("takes no other scenario"), "{err}");
    }
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn ninety_per_cent_intervals_of_modulus_and_loss_contain_the_true_value() {
    let place = tempfile::tempdir().unwrap();
    // 33 of 40, over three seeds: with a true coverage of 0.9 fewer than 99 of 120 happen in 1 % of all.
    let counts = ["1", "2", "3"].map(|seed| counted(place.path(), &["--count", "40", "--seed", seed]));
    let held = [0, 1].map(|d| counts.iter().map(|count| count.1[d]).sum::<u64>());
    assert!(held.iter().all(|held| *held >= 99), "{counts:?}");
    assert!(
        counts.iter().map(|count| count.2).sum::<u64>() <= 3 && counts.iter().all(|count| count.3 < 0.3),
        "{counts:?}"
    );
}
