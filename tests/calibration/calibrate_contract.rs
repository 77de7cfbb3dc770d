//! What scripts depend on in `calibrate`: names of keys and files, streams, exit codes, defaults, equal bytes.

use std::{fs, path::Path, process::Command};

use crate::{
    calibrate_bench::{ALPHA, Bench, DAMPING},
    harness::{code, stderr, stdout},
};
use granchain::calibration::plan::Plan;
use serde_json::Value;

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap().keys().map(String::as_str).collect()
}

fn is_sha256(value: &Value) -> bool {
    value.as_str().is_some_and(|text| text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit()))
}

#[test]
fn calibrate_is_granchain_calibrate_and_threads_change_no_byte_but_in_timing() {
    let bench = Bench::new();
    let first = Command::new(env!("CARGO_BIN_EXE_calibrate"))
        .current_dir(bench.path("."))
        .args(["--scene", "bench.toml", "--measured", "lab/vib.csv", "--evaluations", "200", "--threads", "1"])
        .args(["--out", "one"])
        .output()
        .unwrap();
    assert_eq!(code(&first), 0, "{}", stderr(&first));
    let second = bench.calibrate(&["--threads", "2", "--out", "two", "--json", "--quiet"]);
    assert_eq!(code(&second), 0, "{}", stderr(&second));
    let (one, two) = (bench.contents("one"), bench.contents("two"));
    for (name, bytes) in &one {
        assert!(two.get(name) == Some(bytes), "{name} differs");
    }
    assert_eq!(one.len(), two.len());

    // No record of a drive lies beside: that is said, and what comes out goes to stdout.
    assert!(stderr(&first).contains("the scene's own drive"), "{}", stderr(&first));
    assert!(stdout(&first).starts_with("within scatter: "), "{}", stdout(&first));
    assert!(stdout(&first).contains("one/report.html"), "{}", stdout(&first));
    // --json: nothing but the summary; --quiet: nothing beside it.
    assert_eq!(serde_json::from_slice::<Value>(&second.stdout).unwrap(), bench.outcome("two"));
    assert_eq!(stderr(&second), "");

    keys_are_those_of_the_contract(&bench.outcome("one"));
    the_report_needs_no_network(&bench);
    replay_and_sweep_take_it_up(&bench);
    a_further_fit_replaces_it_and_leaves_a_strangers_file_alone(&bench);
}

fn keys_are_those_of_the_contract(outcome: &Value) {
    assert_eq!(keys(&outcome["parameters"]), ["alpha", "damping"]);
    for (name, unit, truth) in [("alpha", "1", ALPHA), ("damping", "N s/m", DAMPING)] {
        let parameter = &outcome["parameters"][name];
        let number = |key: &str| parameter[key].as_f64().unwrap();
        assert!(number("low") < number("value") && number("value") < number("high"), "{parameter}");
        // The 90 % interval of this one record; three half-widths leave room for the other tenth.
        let half = 0.5 * (number("high") - number("low"));
        assert!((number("value") - truth).abs() < 3.0 * half && half < 0.2 * truth, "{parameter}");
        assert_eq!((parameter["unit"].as_str(), parameter["at_bound"].as_bool()), (Some(unit), Some(false)));
    }
    for name in ["positive_peak", "negative_peak", "line_1", "ratio_1/3", "ratio_2/3", "thd"] {
        let feature = &outcome["features"][name];
        for key in ["measured", "simulated", "scatter"] {
            assert!(feature[key].is_f64(), "{name}.{key}: {feature}");
        }
        assert!(feature["unit"] == "m/s" || feature["unit"] == "1", "{name}: {feature}");
    }
    let peak = outcome["features"]["positive_peak"]["measured"].as_f64().unwrap();
    // Two beads at α = 0.6: 0.61 m/s, the noise of 3 mm/s moves it by less than 2 %.
    assert!((peak - 0.61).abs() < 0.02, "{peak}");
    assert_eq!(outcome["verdict"], "within scatter");
    assert_eq!((&outcome["model"], &outcome["damping_kind"]), (&"chain".into(), &"linear".into()));
    assert!(outcome["correlation"].as_f64().unwrap().abs() <= 1.0);
    assert_eq!((outcome["evaluations"].as_u64(), outcome["seed"].as_u64()), (Some(200), Some(1)));
    assert!(outcome["failed_runs"].is_u64());
    assert_eq!(keys(&outcome["inputs"]), ["measured"]);
    assert!(is_sha256(&outcome["inputs"]["measured"]["sha256"]));
    assert!(outcome.get("preferred_law").is_none());
}

fn the_report_needs_no_network(bench: &Bench) {
    let page = fs::read_to_string(bench.path("one/report.html")).unwrap();
    let names = ["http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink", "/*! https://github.com/leeoniya/uPlot"];
    let outside = names.into_iter().fold(page.clone(), |page, name| page.replace(name, ""));
    for reference in ["http:", "https:", "<link", "@import", "src=", "fetch(", "XMLHttpRequest", "WebSocket"] {
        assert!(!outside.contains(reference), "{reference}");
    }
    // Within a figure, to its own clip paths.
    assert_eq!(page.matches("url(").count(), page.matches("url(#").count() + page.matches("url(data:").count());
    assert!(page.matches("<svg").count() >= 6);
    for word in ["within scatter", "1/3", "sha", "correlation"] {
        assert!(page.to_lowercase().contains(word), "{word}");
    }
    for file in ["report.md", "report.json", "features.csv", "runs-linear.csv", "calibration.json", "timing.json"] {
        assert!(bench.path("one").join(file).is_file(), "{file}");
    }
    assert!(serde_json::from_slice::<Value>(&fs::read(bench.path("one/report.json")).unwrap()).is_ok());
    assert_eq!(fs::read_to_string(bench.path("one/runs-linear.csv")).unwrap().lines().count(), 201);
}

fn replay_and_sweep_take_it_up(bench: &Bench) {
    let outcome = bench.outcome("one");
    let output = bench.granchain(&["replay", "--calibration", "one", "--json", "--quiet"]).output().unwrap();
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["settings"]["alpha"], outcome["parameters"]["alpha"]["value"]);
    assert_eq!(summary["settings"]["linear_damping_n_s_per_m"], outcome["parameters"]["damping"]["value"]);
    let sweep = ["sweep", "--calibration", "one", "--vary", "alpha=0.5,0.6", "--out", "swept", "--json", "--quiet"];
    let output = bench.granchain(&sweep).output().unwrap();
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let damping = format!("damping.coefficient={}", outcome["parameters"]["damping"]["value"]);
    assert!(stdout(&output).contains(&damping), "{damping}: {}", stdout(&output));
}

fn a_further_fit_replaces_it_and_leaves_a_strangers_file_alone(bench: &Bench) {
    bench.write("one/thesis.tex", "years of work");
    let refused = bench.calibrate(&["--out", "one"]);
    assert_eq!(code(&refused), 1);
    assert!(stderr(&refused).contains("thesis.tex") && stderr(&refused).contains("--force"), "{}", stderr(&refused));
    let output = bench.calibrate(&["--out", "one", "--force", "--seed", "3", "--quiet"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(fs::read_to_string(bench.path("one/thesis.tex")).unwrap(), "years of work");
    assert_eq!(bench.outcome("one")["seed"], 3);
}

#[test]
fn the_horn_tip_record_beside_drives_and_outcomes_go_to_calibrations() {
    let bench = Bench::new();
    bench.add_horn_tip();
    let output = bench.calibrate(&["--alpha", "0.6", "--set", "damping.at=all"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stderr(&output).contains("lab/horn_tip.csv, beside"), "{}", stderr(&output));
    assert!(stderr(&output).contains("alpha fixed at 0.6"), "{}", stderr(&output));
    let outcome = bench.outcome("calibrations/lab");
    assert_eq!(keys(&outcome["parameters"]), ["damping"]);
    assert_eq!(keys(&outcome["inputs"]), ["drive", "measured"]);
    assert!(is_sha256(&outcome["inputs"]["drive"]["sha256"]));
    let damping = outcome["parameters"]["damping"]["value"].as_f64().unwrap();
    // With α known, c comes out within a few per cent; the horn's record is band-limited at its ends.
    assert!((damping - DAMPING).abs() < 0.1 * DAMPING, "{damping}");

    // What was said of the bench and the drive belong to the calibration: replay takes them up too.
    let replay = ["replay", "--calibration", "calibrations/lab", "--json", "--quiet"];
    let output = bench.granchain(&replay).output().unwrap();
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["settings"]["alpha"], 0.6);
    assert_eq!(summary["inputs"]["drive"]["sha256"], outcome["inputs"]["drive"]["sha256"]);

    // --drive none leaves the horn's record alone, --drive names another; nothing is fitted by a dry run.
    let output = bench.calibrate(&["--drive", "none", "--dry-run"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(!stderr(&output).contains("horn_tip.csv, beside"), "{}", stderr(&output));
    assert!(stdout(&output).contains("Nothing was fitted"), "{}", stdout(&output));
    let drawn: Vec<String> = bench.contents("calibrations/lab-dry-run").into_keys().collect();
    assert!(drawn.iter().any(|name| name.ends_with(".svg")), "{drawn:?}");
    assert!(!drawn.iter().any(|name| name.ends_with("calibration.json")), "{drawn:?}");
    let mut left: Vec<String> = bench.tree().into_iter().filter(|path| path.starts_with("calibrations/")).collect();
    left.retain(|path| path.matches('/').count() == 1);
    assert_eq!(left, ["calibrations/lab", "calibrations/lab-dry-run"]);
    // A folder that is named is the one written, unless a fit is in it.
    let output = bench.calibrate(&["--dry-run", "--out", "dry"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(bench.path("dry").is_dir() && !bench.path("dry-dry-run").exists());
    let output = bench.calibrate(&["--dry-run", "--out", "calibrations/lab"]);
    assert_eq!(code(&output), 1);
    assert!(stderr(&output).contains("holds a calibration, which a dry run does not replace"), "{}", stderr(&output));
}

#[test]
fn another_record_of_the_same_name_finds_a_folder_of_its_own() {
    let bench = Bench::new();
    let fit = ["--alpha", "0.6", "--evaluations", "200", "--quiet"];
    assert!([0, 3].contains(&code(&bench.calibrate(&fit))));
    let first = bench.contents("calibrations/lab");
    // The same record again takes its own place.
    assert!([0, 3].contains(&code(&bench.calibrate(&fit))));
    assert_eq!(bench.contents("calibrations/lab").len(), first.len());
    let record = fs::read_to_string(bench.path("lab/vib.csv")).unwrap();
    bench.write("lab/vib.csv", record + "# of another day\n");
    assert!([0, 3].contains(&code(&bench.calibrate(&fit))));
    let digest = |folder: &str| bench.outcome(folder)["inputs"]["measured"]["sha256"].clone();
    assert_ne!(digest("calibrations/lab"), digest("calibrations/lab-2"));
}

#[test]
fn both_laws_are_fitted_and_the_right_one_is_named() {
    let bench = Bench::new();
    let output = bench.calibrate(&["--damping", "kuwabara-kono,linear", "--out", "out"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let outcome = bench.outcome("out");
    assert_eq!((&outcome["damping_kind"], &outcome["preferred_law"]), (&"linear".into(), &"linear".into()));
    let laws: Vec<&Value> = outcome["laws"].as_array().unwrap().iter().map(|law| &law["damping_kind"]).collect();
    assert_eq!(laws, ["linear", "kuwabara-kono"]);
    assert_eq!(outcome["laws"][1]["parameters"]["damping"]["unit"], "N s m^-3/2");
    for law in ["linear", "kuwabara-kono"] {
        assert!(bench.path("out").join(format!("runs-{law}.csv")).is_file(), "{law}");
    }
}

#[test]
fn fewer_features_can_be_asked_for() {
    let bench = Bench::new();
    bench.write("paper.toml", "features = \"paper\"");
    let output = bench.calibrate(&["--plan", "paper.toml", "--out", "out", "--quiet"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let paper = ["negative_peak", "positive_peak", "ratio_1/3", "ratio_2/3"];
    assert_eq!(keys(&bench.outcome("out")["fitted_features"]), paper);
    assert_eq!(bench.outcome("out")["evaluations"], 200);
    let output = bench.calibrate(&["--out", "out", "--quiet"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(keys(&bench.outcome("out")["fitted_features"]).len() > 15);
}

#[test]
fn a_plan_says_it_all_and_flags_win() {
    let bench = Bench::new();
    fs::create_dir(bench.path("plans")).unwrap();
    let plan = |evaluations: &str| {
        format!(
            "measured = \"../lab/vib.csv\"\nscene = \"../bench.toml\"\n\
             set = [\"damping.coefficient=0.5\", \"model.kind=reduced\"]\n\
             damping = [\"linear\"]\n{evaluations}\nseed = 7\n\n[parameters.alpha]\nlow = 0.3\nhigh = \"1.5\"\n\n\
             [parameters.damping]\nlow = \"100 N s/km\"\nhigh = 2\n\n[weights]\n\"band_2/3\" = 0\n"
        )
    };
    bench.write("plans/fit.toml", plan("evaluations = 300"));
    let planned = |more: &[&str]| {
        let plan = ["calibrate", "--plan", "plans/fit.toml", "--quiet", "--out", "out"];
        bench.granchain(&plan).args(more).output().unwrap()
    };
    let output = planned(&["--evaluations", "200", "--model", "chain"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let outcome = bench.outcome("out");
    assert_eq!(outcome["model"], "chain");
    assert_eq!((outcome["seed"].as_u64(), outcome["evaluations"].as_u64()), (Some(7), Some(200)));
    assert_eq!(outcome["parameters"]["alpha"]["bounds"], serde_json::json!([0.3, 1.5]));
    assert_eq!(outcome["parameters"]["damping"]["bounds"], serde_json::json!([0.1, 2.0]));
    assert!(outcome["fitted_features"].get("band_1/3").is_some());
    assert!(outcome["fitted_features"].get("band_2/3").is_none());

    let before = bench.tree();
    for (text, message) in [
        (plan("evaluations = 20"), "expected 200 to 100000, found 20"),
        (plan("evaluation = 300"), "fit.toml:5"),
        (plan("").replace("1.5", "0.1"), "must be positive and smaller than"),
        (plan("").replace("N s/km", "Hz"), "damping"),
        (plan("").replace("band_2/3", "band_7"), "band_7"),
        (plan("").replace("[parameters.alpha]", "[parameters.beta]"), "beta"),
        (plan("").replace("lab/vib", "lab/vab"), "vib.csv"),
    ] {
        bench.write("plans/fit.toml", text);
        let output = planned(&[]);
        assert_eq!(code(&output), 1, "{message}: {}", stderr(&output));
        assert!(stderr(&output).contains(message), "{message}: {}", stderr(&output));
        assert_eq!(bench.tree(), before, "{message}");
    }
}

#[test]
fn usage_errors_end_with_2_and_leave_nothing() {
    let bench = Bench::new();
    bench.add_horn_tip();
    let before = bench.tree();
    let record = ["--measured", "lab/vib.csv"];
    for arguments in [
        &[][..],
        &["--measured"],
        &[&record[..], &["--features", "paper"]].concat(),
        &[&record[..], &["--evaluations", "20"]].concat(),
        &[&record[..], &["--fit", "colour"]].concat(),
        &[&record[..], &["--fit", "alpha", "--alpha", "1"]].concat(),
        &[&record[..], &["--alpha", "-1"]].concat(),
        &[&record[..], &["--bounds", "alpha"]].concat(),
        &[&record[..], &["--drive", "lab/horn_tip.csv", "--drive", "none"]].concat(),
        &[&record[..], &["--set", "drive.cycles=3"]].concat(),
        &[&record[..], &["--unit", "furlong"]].concat(),
        &[&record[..], &["--read", "delay=3"]].concat(),
    ] {
        let output = bench.granchain(&[&["calibrate"], arguments].concat()).output().unwrap();
        assert_eq!(code(&output), 2, "{arguments:?}: {}", stderr(&output));
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{arguments:?}");
        assert_eq!(bench.tree(), before, "{arguments:?}");
    }
}

#[test]
fn the_shipped_plan_names_its_files_as_a_user_would_type_them() {
    let plan = Plan::read(Path::new("calibrations/annulus-73khz.toml")).unwrap();
    assert_eq!(plan.measured.unwrap(), Path::new("measurements/annulus-73khz/vib.csv"));
    assert_eq!(plan.drive.unwrap().file.unwrap(), Path::new("measurements/annulus-73khz/horn_tip.csv"));
}
