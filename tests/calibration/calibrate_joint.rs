//! Records fitted together: one set of parameters, each with its own drive; what is refused, and what the outcome says of each.

use std::fs;

use crate::{
    calibrate_bench::{ALPHA, Bench, DAMPING, table},
    harness::{code, stderr},
};
use granchain::{model, scene};
use serde_json::Value;

/// The bench with a second record at half the drive level, and the override that says so.
fn two_levels() -> (Bench, String) {
    let bench = Bench::new();
    let full = scene::load(bench.path("bench.toml").to_str().unwrap(), &[]).unwrap();
    let mut half = full.clone();
    half.drive.amplitude *= 0.5;
    let response = model::run(&half, &mut |_| true).unwrap();
    fs::create_dir(bench.path("half")).unwrap();
    bench.write("half/vib.csv", table("velocity_mm_per_s", &response.pole_velocity, 1e3, 3.0));
    (bench, format!("drive.amplitude={}", half.drive.amplitude))
}

/// A fit definition of the full level and of `record`, whose scene differs by `set`.
fn plan(bench: &Bench, record: &str, set: &str) {
    let text = format!(
        "scene = \"bench.toml\"\nevaluations = 600\n\n[[record]]\nmeasured = \"lab/vib.csv\"\n\n[[record]]\nmeasured = \"{record}\"\nset = \
         [\"{set}\"]\n"
    );
    bench.write("joint.toml", text);
}

fn width(parameter: &Value) -> f64 {
    (parameter["high"].as_f64().unwrap() / parameter["low"].as_f64().unwrap()).ln()
}

#[test]
fn two_levels_share_one_answer_and_say_what_each_narrows() {
    let (bench, half) = two_levels();
    plan(&bench, "half/vib.csv", &half);
    let flags =
        |more: &[&str]| bench.granchain(&[&["calibrate", "--plan", "joint.toml"], more].concat()).output().unwrap();
    let output = flags(&["--out", "joint", "--threads", "1"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert!(stderr(&output).contains("model `chain`: only the chain can fit several records"), "{}", stderr(&output));
    let outcome = bench.outcome("joint");
    assert_eq!(outcome["verdict"], "within scatter", "{}", outcome["statements"]);
    for (name, truth) in [("alpha", ALPHA), ("damping", DAMPING)] {
        let parameter = &outcome["parameters"][name];
        let half_width = 0.5 * (parameter["high"].as_f64().unwrap() - parameter["low"].as_f64().unwrap());
        // As for one record: the 90 % interval of these two records, three half-widths for the other tenth.
        assert!((parameter["value"].as_f64().unwrap() - truth).abs() < 3.0 * half_width, "{parameter}");
    }
    let records = outcome["records"].as_array().unwrap();
    let labels: Vec<&str> = records.iter().map(|record| record["label"].as_str().unwrap()).collect();
    assert_eq!(labels, ["lab", "half"]);
    assert_eq!(records[1]["overrides"].as_array().unwrap().last().unwrap(), half.as_str());
    // Half the drive: the peaks of the second record are its own.
    let peak = |record: &Value| record["features"]["positive_peak"]["measured"].as_f64().unwrap();
    assert!(peak(&records[1]) < 0.8 * peak(&records[0]), "{} {}", peak(&records[1]), peak(&records[0]));
    assert_eq!(records[0]["fitted_features"], outcome["fitted_features"]);
    let alone = |record: &Value| width(&record["alone"]["damping"]);
    let joint = width(&outcome["parameters"]["damping"]);
    assert!(joint < 1.05 * f64::min(alone(&records[0]), alone(&records[1])), "{joint} {records:?}");
    let inputs: Vec<&String> = outcome["inputs"].as_object().unwrap().keys().collect();
    assert_eq!(inputs, ["measured", "measured-2"]);

    let page = fs::read_to_string(bench.path("joint/report.html")).unwrap();
    for phrase in ["What each record narrows", "Record 2: half", "half alone", "all together"] {
        assert!(page.contains(phrase), "{phrase}");
    }
    for figure in ["widths-linear", "regions-linear", "velocity", "velocity-2"] {
        assert!(bench.path("joint/figures").join(format!("{figure}.svg")).is_file(), "{figure}");
    }

    // Threads change nothing.
    let output = flags(&["--quiet", "--threads", "2", "--out", "planned"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let planned = bench.outcome("planned");
    for key in ["parameters", "records", "correlation", "misfit"] {
        assert_eq!(planned[key], outcome[key], "{key}");
    }
}

#[test]
fn another_drive_frequency_is_refused_with_file_line_and_remedy() {
    let (bench, half) = two_levels();
    bench.add_horn_tip();
    let record = fs::read_to_string(bench.path("half/vib.csv")).unwrap();
    let horn = fs::read_to_string(bench.path("lab/horn_tip.csv")).unwrap();
    // The same motion at 80 kHz: every instant comes earlier.
    let sooner =
        |line: &str| match line.split_once(',').and_then(|(time, rest)| Some((time.parse::<f64>().ok()?, rest))) {
            Some((time, rest)) => format!("{:.9},{rest}\n", time * 73.0 / 80.0),
            None => format!("{line}\n"),
        };
    let horn: String = horn.lines().map(sooner).collect();
    plan(&bench, "half/vib.csv", &half);
    let stated = |frequency: &str, text: &str| format!("# a comment\n# drive frequency: {frequency}\n{text}");
    let plan = "scene = \"bench.toml\"\n[[record]]\nmeasured = \"lab/vib.csv\"\n\n[[record]]\nmeasured = \"half/plain.csv\"\n\
                set = [\"drive.frequency=80kHz\"]\n";
    bench.write("half/plain.csv", &record);
    bench.write("fit.toml", plan);

    // The record says so itself.
    bench.write("half/vib.csv", stated("80 kHz", &record));
    let cases: [(&[&str], &str); 3] = [
        (&["--plan", "joint.toml"], "half/vib.csv:2"),
        (
            &[
                "--measured",
                "lab/vib.csv",
                "--measured",
                "half/plain.csv",
                "--drive",
                "lab/horn_tip.csv",
                "--drive",
                "half/horn.csv",
            ],
            "half/horn.csv:2",
        ),
        (&["--plan", "fit.toml"], "fit.toml:5"),
    ];
    bench.write("half/horn.csv", stated("80 kHz", &horn));
    let before = bench.tree();
    for (arguments, place) in cases {
        let scene: &[&str] = if arguments[0] == "--plan" { &[] } else { &["--scene", "bench.toml"] };
        let output = bench.granchain(&[&["calibrate", "--quiet"], scene, arguments].concat()).output().unwrap();
        let said = stderr(&output);
        assert_eq!(code(&output), 1, "{arguments:?}: {said}");
        for phrase in [place, "80.0000 kHz", "73.0000 kHz", "by itself"] {
            assert!(said.contains(phrase), "{arguments:?}: {phrase} is missing in: {said}");
        }
        assert_eq!(bench.tree(), before, "{arguments:?}");
    }
    // The same frequency, stated, is no obstacle: what fails next is the flag.
    bench.write("half/vib.csv", stated("73 kHz", &record));
    let output = bench.granchain(&["calibrate", "--plan", "joint.toml", "--fit", "nothing"]).output().unwrap();
    assert_eq!(code(&output), 2);
}

#[test]
fn what_cannot_be_fitted_together_is_a_usage_error() {
    let (bench, _) = two_levels();
    bench.write("features.toml", "");
    bench.write("both.toml", "measured = \"lab/vib.csv\"\n[[record]]\nmeasured = \"half/vib.csv\"\n");
    let before = bench.tree();
    for (arguments, phrase) in [
        (&["--measured", "half/vib.csv", "--drive", "a.csv", "--drive", "b.csv", "--drive", "c.csv"][..], "found 3"),
        (&["--measured", "half/vib.csv", "--quantity", "pressure"], "one by one"),
        (&["--measured", "features.toml"], "fits to published values are in the reproduction"),
        (&["--measured", "half/vib.csv", "--model", "reduced"], "--model chain"),
    ] {
        let output = bench.calibrate(arguments);
        assert_eq!(code(&output), 2, "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(phrase), "{arguments:?}: {}", stderr(&output));
    }
    // The same record twice is no second record.
    let output = bench.calibrate(&["--measured", "lab/vib.csv"]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    assert!(stderr(&output).contains("lab/vib.csv: expected another record"), "{}", stderr(&output));
    let output = bench.granchain(&["calibrate", "--plan", "both.toml"]).output().unwrap();
    assert_eq!(code(&output), 2, "{}", stderr(&output));
    assert!(stderr(&output).contains("[[record]]"), "{}", stderr(&output));
    assert_eq!(bench.tree(), before);
}

/// Four shots of the bench with gaps of their own, the level of the drive `drift` lower from each to the next.
fn shots(bench: &Bench, drift: f64) {
    fs::create_dir_all(bench.path("shots")).unwrap();
    for (recorded_run, gaps) in
        ["[1e-10, 4e-10, 2e-10]", "[3e-10, 0, 1e-10]", "[2e-10, 1e-10, 5e-10]", "[0, 2e-10, 2e-10]"].iter().enumerate()
    {
        let level = format!("alpha={}", ALPHA * (1.0 - drift * recorded_run as f64));
        let scene =
            scene::load(bench.path("bench.toml").to_str().unwrap(), &[format!("chain.gaps={gaps}"), level]).unwrap();
        let made = model::run(&scene, &mut |_| true).unwrap();
        // The noise of each is another part of one sequence.
        let noise = 3.0 + 1e-3 * recorded_run as f64;
        bench.write(&format!("shots/{recorded_run}.csv"), table("velocity_mm_per_s", &made.pole_velocity, 1e3, noise));
    }
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn shots_of_one_experiment_narrow_what_differs_between_them_and_show_its_drift() {
    let bench = Bench::new();
    let fitted = |records: &[&str], out: &str| {
        let command = [
            "calibrate",
            "--scene",
            "bench.toml",
            "--evaluations",
            "600",
            "--uncertainty",
            "mass=0",
            "--quiet",
            "--out",
            out,
            "--measured",
        ];
        let output = bench.granchain(&[&command[..], records].concat()).output().unwrap();
        assert!([0, 3].contains(&code(&output)), "{}", stderr(&output));
        bench.outcome(out)
    };
    let all = ["shots/0.csv", "shots/1.csv", "shots/2.csv", "shots/3.csv"];
    shots(&bench, 0.0);
    let (one, four) = (fitted(&all[..1], "one"), fitted(&all, "four"));
    assert!(four["assumptions"].to_string().contains("4 shots of one experiment"), "{}", four["assumptions"]);
    let ratio = |name: &str| width(&four["parameters"][name]) / width(&one["parameters"][name]);
    // The level is known to ±0.5 %, evenly, and by four shots no better: 3.29 standard deviations of 0.29 %.
    let (alpha, damping) = (width(&four["parameters"]["alpha"]), ratio("damping"));
    assert!(alpha > 3.29 * 0.00289 && ratio("alpha") < 0.95 && damping < 0.85, "{alpha} {damping}");
    let says = |outcome: &Value, what: &str| outcome["statements"].to_string().contains(what);
    assert!(says(&four, "From shot to shot features vary") && !says(&four, "drifts by"), "{}", four["statements"]);
    shots(&bench, 0.01);
    let drifting = fitted(&all, "drifting");
    assert!(says(&drifting, "The level of the drive drifts by -"), "{}", drifting["statements"]);
}
