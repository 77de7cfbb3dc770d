//! A calibration replayed: its own scene, drive, reading of the drive and model; another drive is refused.

use serde_json::{Value, json};

use crate::{
    calibrate_bench::Bench,
    harness::{code, stderr},
};

/// The bench with a horn tip in volts of 2 µm/V, sign turned.
fn in_volts() -> Bench {
    let bench = Bench::new();
    bench.add_horn_tip();
    let text = std::fs::read_to_string(bench.path("lab/horn_tip.csv")).unwrap();
    let rows = text.lines().skip(1).map(|row| {
        let (time, value) = row.split_once(',').unwrap();
        format!("{time},{:.6}\n", value.parse::<f64>().unwrap() / -2.0)
    });
    bench.write("lab/horn_tip.csv", format!("time_us,CH1 (V)\n{}", rows.collect::<String>()));
    bench
}

fn replayed(bench: &Bench, arguments: &[&str]) -> Value {
    let output = bench.granchain(&[&["replay", "--json", "--quiet"], arguments].concat()).output().unwrap();
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn refused(bench: &Bench, arguments: &[&str]) -> String {
    let output = bench.granchain(&[&["replay", "--json", "--quiet"], arguments].concat()).output().unwrap();
    assert_eq!(code(&output), 2, "{}", stderr(&output));
    stderr(&output)
}

#[test]
fn a_fit_to_a_horn_in_volts_replays_to_the_peaks_of_its_record() {
    let bench = in_volts();
    let plan = "measured = \"lab/vib.csv\"\nscene = \"bench.toml\"\nbench = \"channels.toml\"\n[drive.reading]\nscale = \"2 um/V\"\n";
    bench.write("plan.toml", plan);
    bench.write("channels.toml", "[horn-tip]\ninvert = true\n");
    let flags = ["--drive-read", "scale=2 um/V", "--drive-read", "invert=true"];
    for (folder, arguments) in [("flags", &flags[..]), ("planned", &["--plan", "plan.toml"])] {
        let output = bench.calibrate(&[arguments, &["--out", folder, "--quiet"]].concat());
        assert!([0, 3].contains(&code(&output)), "{}", stderr(&output));
        let outcome = bench.outcome(folder);
        assert_eq!(outcome["inputs"]["drive"]["reading"], json!({"scale": "2 um/V", "invert": true}));
        assert!(outcome["inputs"]["measured"].get("reading").is_none());
        let again = replayed(&bench, &["--calibration", folder]);
        let peak = again["features"]["peaks"]["positive"].as_f64().unwrap();
        let own = &outcome["fitted_features"]["positive_peak"];
        let measured = own["measured"].as_f64().unwrap();
        assert!((peak / measured - 1.0).abs() < 0.1, "{folder}: {peak} for {measured}");
    }

    // A flag wins: another sensitivity is another drive.
    let half = replayed(&bench, &["--calibration", "flags", "--scale", "1 um/V"]);
    let whole = replayed(&bench, &["--calibration", "flags"]);
    let peak = |summary: &Value| summary["features"]["peaks"]["positive"].as_f64().unwrap();
    assert!(peak(&half) < 0.8 * peak(&whole), "{} and {}", peak(&half), peak(&whole));

    let err = refused(&bench, &["--calibration", "flags", "--scene", "rigid"]);
    for part in [
        "a sine of 5 cycles at 73 kHz",
        "lab/horn_tip.csv",
        "`granchain replay --calibration flags`",
        "--drive lab/horn_tip.csv",
    ] {
        assert!(err.contains(part), "{part}: {err}");
    }
    replayed(
        &bench,
        &["--calibration", "flags", "--scene", "annulus", "--model", "chain", "--drive", "lab/horn_tip.csv"],
    );
}

#[test]
fn a_scene_under_another_drive_is_refused_and_one_under_the_same_drive_is_not() {
    let bench = Bench::new();
    let output = bench.calibrate(&["--out", "fit", "--quiet"]);
    assert!([0, 3].contains(&code(&output)), "{}", stderr(&output));
    bench.write(
        "longer.toml",
        "extends = \"annulus\"\nduration = \"420 us\"\n[chain]\nbeads = 3\n[drive]\ncycles = 20\n",
    );
    replayed(&bench, &["--calibration", "fit", "--scene", "longer.toml"]);
    bench.write(
        "slower.toml",
        "extends = \"annulus\"\nduration = \"420 us\"\n[drive]\ncycles = 20\nfrequency = \"40 kHz\"\n",
    );
    let err = refused(&bench, &["--calibration", "fit", "--scene", "slower.toml"]);
    assert!(err.contains("at 40 kHz") && err.contains("at 73 kHz"), "{err}");
    assert!(err.contains("`granchain replay --calibration fit`"), "{err}");
    // What a flag says is meant.
    replayed(&bench, &["--calibration", "fit", "--scene", "slower.toml", "--drive-frequency", "50kHz"]);
}
