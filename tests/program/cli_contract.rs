//! What scripts depend on: exit codes, what goes to which stream, names of files, columns and keys, equal bytes.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;

use crate::harness::{self, code, stderr, stdout};

fn granchain() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command
}

fn run(arguments: &[&str]) -> Output {
    granchain().args(arguments).output().unwrap()
}

fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Every file but the one that holds times.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    entries(folder)
        .into_iter()
        .filter(|name| name != "timing.json")
        .map(|name| (name.clone(), fs::read(folder.join(name)).unwrap()))
        .collect()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn json(path: PathBuf) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn help_and_version_go_to_stdout_and_end_with_0() {
    for arguments in [&["--version"][..], &["--help"], &["replay", "--help"], &["sweep", "--help"]] {
        let output = run(arguments);
        assert_eq!(code(&output), 0, "{arguments:?}");
        assert!(!output.stdout.is_empty() && output.stderr.is_empty(), "{arguments:?}");
    }
}

#[test]
fn usage_errors_end_with_2_and_say_so_on_stderr() {
    for arguments in [
        &[][..],
        &["no-such-command"],
        &["replay"],
        &["replay", "--scene", "rigid", "--no-such-flag"],
        &["replay", "--scene", "rigid", "--drive-frequency", "73"],
        &["replay", "--scene", "rigid", "--drive-frequency", "73um"],
        &["replay", "--scene", "rigid", "--alpha", "-1"],
        &["replay", "--scene", "rigid", "--set", "alpha"],
        &["replay", "--scene", "rigid", "--threads", "0"],
        &["replay", "--scene", "rigid", "--threads", "100000"],
        &["replay", "--scene", "rigid", "--model", "magic"],
        &["sweep", "--scene", "rigid"],
        &["sweep", "--scene", "rigid", "--vary", "alpha=1:2"],
        &["sweep", "--scene", "rigid", "--vary", "alpha=1,2", "--resume"],
    ] {
        let output = run(arguments);
        assert_eq!(code(&output), 2, "{arguments:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{arguments:?}");
    }
}

#[test]
fn a_number_without_unit_is_refused_with_the_unit_it_needs() {
    let output = run(&["replay", "--scene", "rigid", "--drive-frequency", "73"]);
    assert!(stderr(&output).contains("73") && stderr(&output).contains("Hz"), "{}", stderr(&output));
}

#[test]
fn failures_end_with_1_name_what_is_wrong_and_leave_no_folder() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("deep/out");
    let cases: [(&[&str], &str); 9] = [
        (&["replay", "--scene", "rigged"], "rigid"),
        (&["replay", "--scene", "water", "--set", "disc.thickness=2mm"], "disc.thickness"),
        (&["replay", "--scene", "rigid", "--set", "chain.raduis=1mm"], "chain.radius"),
        (&["replay", "--scene", "rigid", "--set", "chain.radius=-1mm"], "chain.radius"),
        (&["replay", "--scene", "rigid", "--set", "chain.beads=0"], "chain.beads"),
        (&["replay", "--scene", "rigid", "--model", "fea", "--set", "piston.contact=half-space"], "half-space"),
        (&["replay", "--scene", "rigid", "--drive", "nowhere.csv"], "nowhere.csv"),
        (&["replay", "--scene", "rigid", "--calibration", "nowhere"], "nowhere"),
        (&["sweep", "--scene", "rigid", "--vary", "no.such.key=1,2"], "no.such.key"),
    ];
    for (arguments, expected) in cases {
        let output = run(&[arguments, &["--out", text(&out)]].concat());
        assert_eq!(code(&output), 1, "{arguments:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert!(stderr(&output).starts_with("error: "), "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(expected), "{arguments:?}: {}", stderr(&output));
        assert_eq!(entries(place.path()), [""; 0], "{arguments:?}");
    }
}

#[test]
fn absurd_work_is_refused_before_the_run_with_its_estimate_and_the_flag_that_lifts_it() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let nested = format!("duration=100 {}us", "(".repeat(100_000));
    let cases: [(&[&str], &[&str]); 11] = [
        (&["--model", "fea", "--set", "model.step=1e-15"], &["unknowns × steps", "1e11", "--no-limits"]),
        (&["--model", "reduced", "--set", "model.step=1e-15"], &["unknowns × steps", "1e11", "--no-limits"]),
        (&["--ensemble", "1000000000"], &["unknowns × steps", "--no-limits"]),
        (&["--model", "reduced", "--ensemble", "1000000000"], &["unknowns × steps", "--no-limits"]),
        (&["--model", "chain", "--set", "chain.beads=1000", "--set", "duration=1"], &["GiB", "8.0 GiB", "--no-limits"]),
        (
            &["--model", "chain", "--set", "damping.kind=linear", "--set", "damping.coefficient=1e6"],
            &["1.0e6", "--no-limits"],
        ),
        (&["--model", "chain", "--set", "damping.kind=linear", "--set", "damping.coefficient=1e15"], &["--no-limits"]),
        (&["--set", "materials.chrome-steel.youngs_modulus=1e30"], &["youngs_modulus", "1e15 Pa"]),
        (&["--set", "materials.chrome-steel.density=1e300"], &["density", "1e9 kg/m^3"]),
        (&["--set", "chain.radius=1e308"], &["chain.radius", "1 km"]),
        (&["--set", &nested], &["duration", "32 parentheses"]),
    ];
    for (arguments, phrases) in cases {
        let output = run(&[&["replay", "--scene", "rigid", "--quiet", "--out", text(&out)], arguments].concat());
        let said = stderr(&output);
        assert_eq!(code(&output), 1, "{arguments:?}: {said}");
        assert!(phrases.iter().all(|phrases| said.contains(phrases)), "{arguments:?}: {said}");
        assert!(said.len() < 200_000 + 1000 && entries(place.path()).is_empty(), "{arguments:?}");
    }
    let sweep = ["sweep", "--scene", "rigid", "--vary", "alpha=0.5,1", "--ensemble", "1000000000"];
    let output = run(&sweep);
    assert!(code(&output) == 1 && stderr(&output).contains("--no-limits"), "{}", stderr(&output));

    let stiff = ["--model", "chain", "--set", "damping.kind=kuwabara-kono", "--set", "damping.coefficient=2e9"];
    let base = ["replay", "--scene", "rigid", "--quiet"];
    assert_eq!(code(&run(&[&base[..], &stiff].concat())), 1);
    let lifted = run(&[&base[..], &stiff, &["--no-limits"]].concat());
    assert_eq!(code(&lifted), 0, "{}", stderr(&lifted));
}

#[test]
fn broken_drive_records_end_with_1_name_the_file_and_leave_no_folder() {
    let place = tempfile::tempdir().unwrap();
    let good = |rows: usize, step: f64| -> String {
        let row = |index: usize| {
            let time = index as f64 * step;
            format!("{time:e},{:e}\n", 1e-6 * (std::f64::consts::TAU * 73e3 * time).sin())
        };
        "time_s,displacement_m\n".to_owned() + &(0..rows).map(row).collect::<String>()
    };
    let whole = good(1000, 2e-7);
    let broken: [(&str, Vec<u8>); 17] = [
        ("empty", vec![]),
        ("header_only", b"time_s,displacement_m\n".to_vec()),
        ("text", whole.replacen("4e-7,", "4e-7,hello", 1).into_bytes()),
        ("nan", (whole.clone() + "2e-4,NaN\n").into_bytes()),
        ("infinity", (whole.clone() + "2e-4,inf\n").into_bytes()),
        ("missing_column", whole.replace("displacement_m", "colour").into_bytes()),
        ("ragged", (whole.clone() + "2e-4,0,0\n").into_bytes()),
        ("unknown_unit", whole.replace("displacement_m", "displacement_furlong").into_bytes()),
        ("volts", whole.replace("displacement_m", "signal_v").into_bytes()),
        ("repeated_time", (whole.clone() + "1.998e-4,0\n").into_bytes()),
        ("decreasing_time", (whole.clone() + "1e-4,0\n").into_bytes()),
        ("uneven", (whole.clone() + "3e-4,0\n").into_bytes()),
        ("truncated", (whole.clone() + "2e-4").into_bytes()),
        ("binary", vec![0x7f, b'E', b'L', b'F', 0, 1, 2, 3, 0xff, 0xfe]),
        ("short", good(100, 2e-7).into_bytes()),
        ("coarse", good(200, 5e-6).into_bytes()),
        ("folder", vec![]),
    ];
    for (name, bytes) in broken {
        let path = place.path().join(format!("{name}.csv"));
        if name == "folder" {
            fs::create_dir(&path).unwrap();
        } else {
            fs::write(&path, bytes).unwrap();
        }
        let out = place.path().join("out");
        let output = run(&[
            "replay",
            "--scene",
            "annulus",
            "--drive",
            text(&path),
            "--drive-frequency",
            "73kHz",
            "--out",
            text(&out),
        ]);
        assert_eq!(code(&output), 1, "{name}: {}", stderr(&output));
        assert!(output.stdout.is_empty(), "{name}");
        assert!(stderr(&output).contains(&format!("{name}.csv")), "{name}: {}", stderr(&output));
        assert!(!out.exists() && entries(place.path()).iter().all(|entry| entry.ends_with(".csv")), "{name}");
    }
}

#[test]
fn replay_of_the_rigid_scene_writes_the_contract() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let output = run(&["replay", "--scene", "rigid", "--out", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(entries(place.path()), ["out"]);
    let table = fs::read_to_string(out.join("response.csv")).unwrap();
    let mut expected = vec!["time_s".to_owned(), "piston_displacement_m".to_owned()];
    expected.extend((1..=6).map(|bead| format!("bead{bead}_velocity_m_per_s")));
    expected.push("pole_velocity_m_per_s".into());
    expected.extend((1..=7).map(|contact| format!("contact{contact}_force_n")));
    expected.extend((1..=7).map(|contact| format!("contact{contact}_radius_m")));
    assert_eq!(table.lines().next().unwrap(), expected.join(","));
    // 120 µs at 0.1 µs, both ends.
    assert_eq!(table.lines().count() - 1, 1201);
    let last: f64 = table.lines().last().unwrap().split(',').next().unwrap().parse().unwrap();
    // Sample instants are start + i·step, one rounding each.
    assert!((last - 120e-6).abs() < 1e-15);

    let summary = json(out.join("summary.json"));
    for key in ["features", "energy", "work", "settings"] {
        assert!(summary[key].is_object(), "{key}");
    }
    for key in ["unknowns", "steps", "rejected_steps", "evaluations", "events"] {
        assert!(summary["work"][key].is_u64(), "{key}");
    }
    assert!(json(out.join("timing.json"))["total_s"].is_f64());
    for figure in ["response", "spectrum"] {
        assert!(fs::read_to_string(out.join(format!("{figure}.svg"))).unwrap().starts_with("<svg"));
        assert!(fs::read(out.join(format!("{figure}.png"))).unwrap().starts_with(b"\x89PNG"));
    }
}

#[test]
fn json_puts_the_summary_and_nothing_else_on_stdout() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let output = run(&["replay", "--scene", "rigid", "--json", "--out", text(&out)]);
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(printed, json(out.join("summary.json")));
    let quiet = run(&["replay", "--scene", "rigid", "--json", "--quiet"]);
    assert!(quiet.stderr.is_empty());
    assert_eq!(quiet.stdout, output.stdout);
}

#[test]
fn no_file_but_timing_depends_on_the_number_of_threads() {
    let place = tempfile::tempdir().unwrap();
    let folders = ["1", "2"].map(|threads| {
        let out = place.path().join(threads);
        let replay = out.join("replay");
        let output =
            run(&["replay", "--scene", "rigid", "--threads", threads, "--ensemble", "4", "--out", text(&replay)]);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        let sweep = out.join("sweep");
        let output = run(&[
            "sweep",
            "--scene",
            "rigid",
            "--vary",
            "alpha=0.4:1:0.2",
            "--vary",
            "damping.kind=none,linear",
            "--ensemble",
            "4",
            "--threads",
            threads,
            "--out",
            text(&sweep),
        ]);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        (contents(&replay), contents(&sweep))
    });
    assert!(folders[0] == folders[1]);
    assert_eq!(folders[0].1["sweep.csv"].iter().filter(|byte| **byte == b'\n').count(), 9);
}

#[test]
fn an_earlier_output_is_replaced_and_a_strangers_folder_is_not() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let replay = |more: &[&str]| run(&[&["replay", "--scene", "rigid", "--out", text(&out)], more].concat());
    assert_eq!(code(&replay(&[])), 0);
    assert_eq!(code(&replay(&[])), 0);
    fs::write(out.join("thesis.tex"), "years of work").unwrap();
    let refused = replay(&[]);
    assert_eq!(code(&refused), 1);
    assert!(stderr(&refused).contains("thesis.tex") && stderr(&refused).contains("--force"));
    assert_eq!(code(&replay(&["--force"])), 0);
    assert_eq!(fs::read_to_string(out.join("thesis.tex")).unwrap(), "years of work");
    assert_eq!(entries(place.path()), ["out"]);
}

#[test]
fn replay_takes_up_a_calibration() {
    let place = tempfile::tempdir().unwrap();
    fs::write(
        place.path().join("calibration.json"),
        r#"{"parameters": {"alpha": {"value": 0.7, "low": 0.6, "high": 0.8, "unit": "1", "at_bound": false},
            "damping": {"value": 0.45, "low": 0.4, "high": 0.5, "unit": "N s/m", "at_bound": false}},
            "damping_kind": "linear", "scene": "annulus", "verdict": "within scatter"}"#,
    )
    .unwrap();
    let output = run(&["replay", "--calibration", text(place.path()), "--json", "--set", "duration=100us"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["settings"]["alpha"], 0.7);
    assert_eq!(summary["settings"]["linear_damping_n_s_per_m"], 0.45);
    assert!(summary["inputs"]["calibration"]["sha256"].is_string());
}

#[test]
fn a_failed_point_of_a_sweep_is_kept_and_counted() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let output = run(&["sweep", "--scene", "rigid", "--vary", "chain.radius=0.5mm,-1mm", "--out", text(&out)]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let summary = json(out.join("sweep.json"));
    assert_eq!((summary["runs"].as_u64(), summary["failed_runs"].as_u64()), (Some(2), Some(1)));
    assert_eq!(summary["points"][1]["status"], "failed");
    let table = fs::read_to_string(out.join("sweep.csv")).unwrap();
    assert!(table.starts_with("chain.radius_m,status,positive_peak_m_per_s,"), "{table}");
    assert!(table.lines().nth(2).unwrap().contains("failed"), "{table}");
}

#[test]
fn calibrate_is_the_subcommand_of_the_same_name() {
    let own = Command::new(env!("CARGO_BIN_EXE_calibrate")).arg("--help").output().unwrap();
    assert_eq!(code(&own), 0);
    assert_eq!(stdout(&own), stdout(&run(&["calibrate", "--help"])));
}

#[test]
fn values_that_make_no_sense_are_refused_for_what_they_are() {
    let refused = |arguments: &[&str]| {
        let output = run(&[&["replay", "--scene", "rigid", "--model", "chain"], arguments].concat());
        (code(&output), stderr(&output))
    };
    let (exit, said) = refused(&["--alpha", "-1"]);
    assert!(exit == 2 && said.contains("expected a positive number, found `-1`"), "{said}");
    for threads in ["0", "two", "-3"] {
        let (exit, said) = refused(&[&format!("--threads={threads}")]);
        assert!(exit == 2 && said.contains("expected a whole number of threads from 1 up"), "{said}");
    }
    let (exit, said) = refused(&["--out", "/"]);
    assert!(exit == 1 && said.contains("found the root of the file system"), "{said}");
}

#[test]
fn a_last_bead_that_does_not_move_has_a_response_and_no_features() {
    for (scene, set) in [("rigid", "chain.gaps=10um"), ("annulus", "holder.friction_force=30mN")] {
        let place = tempfile::tempdir().unwrap();
        let replay =
            ["replay", "--scene", scene, "--model", "chain", "--set", set, "--set", "duration=100us", "--out", "out"];
        let (code, out, error) = harness::granchain(place.path(), &replay);
        assert_eq!(code, 0, "{error}");
        assert!(error.contains("the last bead does not move") && out.contains("peaks      none"), "{error}{out}");
        let summary = fs::read_to_string(place.path().join("out/summary.json")).unwrap();
        let summary: Value = serde_json::from_str(&summary).unwrap();
        assert!(summary.get("features").is_none() && summary.get("energy").is_some());
        let response = fs::read_to_string(place.path().join("out/response.csv")).unwrap();
        assert_eq!(response.lines().count(), 1002);
        let page = fs::read_to_string(place.path().join("out/report.html")).unwrap();
        assert!(page.contains("the last bead does not move"));
    }
}

#[test]
fn energy_unaccounted_for_is_a_warning_above_1_percent_and_an_error_above_10_on_every_model() {
    let place = tempfile::tempdir().unwrap();
    let stiff = "extends = \"rigid\"\n[materials.stiff]\nyoungs_modulus = \"100 TPa\"\npoissons_ratio = 0.3\ndensity = \"7833 kg/m^3\"\n\
                 [chain]\nmaterial = \"stiff\"\n";
    fs::write(place.path().join("stiff.toml"), stiff).unwrap();
    let replay = |scene: &str, model: &str, sets: &[&str]| {
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        let words: Vec<&str> = ["replay", "--scene", scene, "--model", model].into_iter().chain(sets).collect();
        harness::granchain(place.path(), &words)
    };
    let coarse = "model.mesh_density=4";
    for (scene, model, sets) in [
        ("annulus", "chain", &["model.tolerance=1e-2"][..]),
        ("stiff.toml", "reduced", &[coarse, "model.step=50ns"]),
        ("stiff.toml", "fea", &[coarse, "model.step=50ns"]),
    ] {
        let (code, _, error) = replay(scene, model, sets);
        assert!(code == 0 && error.contains("% of the largest energy"), "{model}: {error}");
        assert!(error.contains("expected at most 1 %") && error.contains("shorten `model.step`"), "{model}: {error}");
    }
    let (code, _, error) = replay("stiff.toml", "fea", &[coarse, "model.step=0.1us"]);
    assert!(code == 1 && error.contains("energy balance: expected at most 10 % of the largest energy"), "{error}");
    let (code, _, error) = replay("rigid", "chain", &[]);
    assert!(code == 0 && !error.contains("% of the largest energy"), "{error}");
    let sweep =
        ["sweep", "--scene", "annulus", "--model", "chain", "--vary", "model.tolerance=1e-2,1e-10", "--out", "out"];
    let (code, _, error) = harness::granchain(place.path(), &sweep);
    assert!(code == 0 && error.contains("1 of 2 runs leave more than 1 % of their largest energy"), "{error}");
}

#[test]
fn names_and_numbers_beyond_what_can_be_are_refused_with_their_limit() {
    let place = tempfile::tempdir().unwrap();
    let replay = |length: usize| {
        let name = "n".repeat(length);
        harness::granchain(
            place.path(),
            &["replay", "--scene", "rigid", "--set", "duration=60us", "--quiet", "--out", &name],
        )
    };
    for length in [231, 240, 255, 300] {
        let (code, _, error) = replay(length);
        let limit = format!("expected a name of at most 230 bytes, found {length}");
        assert!(code == 1 && error.contains(&limit), "{length}: {error}");
    }
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0);
    assert_eq!(replay(230).0, 0);
    for flags in [["--count", "1000000000"], ["--count", "18446744073709551615"]] {
        let (code, _, error) =
            harness::granchain(place.path(), &[&["coverage", "--plan", "plan.toml"], &flags[..]].concat());
        assert!(code == 2 && error.contains("1000000"), "{error}");
    }
}
