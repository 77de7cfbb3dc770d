//! `granchain spectrum` run as a command: table, JSON contract, files, refusals.

use std::{fmt::Write as _, fs, path::Path};

use assert_cmd::Command;
use serde_json::Value;

const F0: f64 = 73e3;
const TAU: f64 = std::f64::consts::TAU;

/// 40 cycles under a 100 µs ring-up that starts at the trigger, 60 µs of quiet before.
fn envelope(t: f64) -> f64 {
    let (tau, end) = (100e-6, 40.0 / F0);
    match t {
        t if t < 0.0 => 0.0,
        t if t <= end => (1.0 - (-t / tau).exp()) / (1.0 - (-end / tau).exp()),
        t => (-(t - end) / tau).exp(),
    }
}

fn write(path: &Path, header: &str, step: f64, value: impl Fn(f64) -> f64) {
    let mut text = format!("{header}\n");
    for i in 0..(760e-6 / step) as usize {
        let t = -60e-6 + i as f64 * step;
        writeln!(text, "{:.10e},{:.10e}", t, value(t)).unwrap();
    }
    fs::write(path, text).unwrap();
}

/// A folder with vib.csv (lines at thirds, mm/s) and horn_tip.csv beside it, the drive at `frequency`.
fn bench(frequency: f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("horn_tip.csv"), "time_s,displacement_um", 2e-7, |t| {
        envelope(t) * (TAU * frequency * t).sin()
    });
    write(&folder.path().join("vib.csv"), "time_s,velocity_mm_per_s", 4e-7, |t| {
        let line = |ratio: f64, amplitude: f64| amplitude * (TAU * ratio * frequency * t).cos();
        f64::from(envelope(t) > 0.0)
            * (line(1.0, 100.0) + line(1.0 / 3.0, 50.0) + line(2.0 / 3.0, 20.0) + line(2.0, 30.0))
    });
    folder
}

fn granchain(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("granchain").unwrap();
    command.current_dir(folder).arg("spectrum").args(arguments);
    command
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = granchain(folder, arguments).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn line<'a>(summary: &'a Value, ratio: &str) -> &'a Value {
    summary["lines"].as_array().unwrap().iter().find(|line| line["ratio"] == ratio).unwrap()
}

#[test]
fn the_json_keeps_its_contract_and_refines_the_frequency_from_the_horn_beside_it() {
    let folder = bench(73_041.5);
    let summary = json(folder.path(), &["vib.csv"]);
    let frequency = summary["drive_frequency_hz"].as_f64().unwrap();
    // Printed to 1e-10 of the time axis, sampled at 0.2 µs.
    assert!((frequency / 73_041.5 - 1.0).abs() < 1e-6, "{frequency}");
    assert_eq!(summary["drive_frequency_from"], "refined from horn_tip.csv beside it");
    assert_eq!(summary["unit"], "m/s");
    for (ratio, expected) in [("1", 0.1), ("1/3", 0.05), ("2/3", 0.02), ("2", 0.03)] {
        let line = line(&summary, ratio);
        // Side lobes of the neighbours, 1e-4 of the largest line.
        assert!((line["amplitude"].as_f64().unwrap() - expected).abs() < 2e-5, "{line}");
        assert!((line["relative"].as_f64().unwrap() - expected / 0.1).abs() < 2e-4, "{line}");
        assert!((line["db"].as_f64().unwrap() - 20.0 * (expected / 0.1).log10()).abs() < 0.02, "{line}");
    }
    assert!((line(&summary, "1/3")["frequency_hz"].as_f64().unwrap() - frequency / 3.0).abs() < 1e-6);
    // The sum 100 cos 3x + 50 cos x + 20 cos 2x + 30 cos 6x is largest at x = 0.
    assert!((summary["peaks"]["positive"].as_f64().unwrap() - 0.2).abs() < 1e-4, "{}", summary["peaks"]);
    assert!(summary["peaks"]["negative"].as_f64().unwrap() < -0.1);
    // 30/√(100² + 50² + 20² + 30²)
    assert!((summary["thd"].as_f64().unwrap() - 30.0 / 13_800.0_f64.sqrt()).abs() < 1e-3);
    assert!(summary["bandwidth_hz"].as_f64().unwrap() > F0);
    // Up to 8 f0 = 584 kHz of 1 MHz all is there; a quarter has 10 periods.
    assert_eq!(summary["absent"], Value::Array(vec![]));
}

#[test]
fn a_stated_frequency_is_taken_as_stated_and_a_different_drive_is_warned_of() {
    let folder = bench(73_500.0);
    let output = granchain(folder.path(), &["vib.csv", "--drive-frequency", "73kHz", "--json"]).output().unwrap();
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["drive_frequency_hz"], 73_000.0);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("73.5000 kHz"), "{said}");
}

#[test]
fn without_a_drive_the_strongest_line_is_assumed_aloud() {
    let folder = bench(F0);
    fs::remove_file(folder.path().join("horn_tip.csv")).unwrap();
    let output = granchain(folder.path(), &["vib.csv"]).output().unwrap();
    assert!(output.status.success());
    let (table, said) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(table.contains("assumed: the record's strongest line"), "{table}");
    assert!(said.contains("a subharmonic may be stronger"), "{said}");
    let third = table.lines().find(|line| line.trim_start().starts_with("1/3")).unwrap();
    let cells: Vec<&str> = third.split_whitespace().collect();
    assert!((cells[2].parse::<f64>().unwrap() - 50.0).abs() < 0.5, "{third}");
}

#[test]
fn the_window_can_be_overridden_and_lines_it_cannot_resolve_are_absent_with_the_reason() {
    let folder = bench(F0);
    let summary = json(folder.path(), &["vib.csv", "--from", "100us", "--to", "0.2ms"]);
    assert_eq!(summary["window"]["from_s"], 100e-6);
    assert_eq!(summary["window"]["to_s"], 200e-6);
    let absent = summary["absent"].as_array().unwrap();
    let third = absent.iter().find(|line| line["ratio"] == "1/3").unwrap();
    assert!(third["reason"].as_str().unwrap().contains("window holds 2.4 of its periods"), "{third}");
    let refused = granchain(folder.path(), &["vib.csv", "--from", "2ms", "--to", "3ms"]).output().unwrap();
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8(refused.stderr).unwrap().contains("set --from before --to, both inside it"));
    let reversed = granchain(folder.path(), &["vib.csv", "--from", "3us", "--to", "2us"]).output().unwrap();
    assert_eq!(reversed.status.code(), Some(2));
}

#[test]
fn out_holds_figure_curve_and_summary() {
    let folder = bench(F0);
    let output = granchain(folder.path(), &["vib.csv", "--out", "found", "--quiet"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(output.stderr.is_empty());
    let found = folder.path().join("found");
    let svg = fs::read_to_string(found.join("spectrum.svg")).unwrap();
    assert!(svg.contains(">1/3<") && svg.contains("dB"), "fractional lines marked");
    assert!(fs::read(found.join("spectrum.png")).unwrap().starts_with(b"\x89PNG"));
    let curve = fs::read_to_string(found.join("spectrum.csv")).unwrap();
    assert!(curve.starts_with("frequency_hz,amplitude_m_per_s,level_db_re_drive_line\n"));
    let summary: Value = serde_json::from_slice(&fs::read(found.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["unit"], "m/s");
}

#[test]
fn a_horn_tip_record_is_measured_as_a_displacement() {
    let folder = bench(F0);
    let summary = json(folder.path(), &["horn_tip.csv"]);
    assert_eq!((&summary["unit"], &summary["quantity"]), (&"m".into(), &"displacement".into()));
    // The Hann-weighted mean of a ring-up of 1 µm.
    let amplitude = line(&summary, "1")["amplitude"].as_f64().unwrap();
    assert!((0.9e-6..1.0e-6).contains(&amplitude), "{amplitude}");
}

#[test]
fn a_response_of_ours_is_measured_with_its_own_piston_as_the_drive() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from(
        "time_s,piston_displacement_m,bead1_velocity_m_per_s,pole_velocity_m_per_s,contact1_force_n,contact2_force_n\n",
    );
    for i in 0..6000 {
        let t = i as f64 * 1e-7;
        let piston = 1e-6 * envelope(t) * (TAU * F0 * t).sin();
        let pole = 0.2 * (TAU * F0 * t).cos() + 0.1 * (TAU * 0.5 * F0 * t).cos();
        writeln!(text, "{t:.10e},{piston:.10e},9.0,{pole:.10e},0.0,0.0").unwrap();
    }
    fs::write(folder.path().join("response.csv"), text).unwrap();
    let summary = json(folder.path(), &["response.csv"]);
    assert_eq!(summary["drive_frequency_from"], "refined from the response's own piston");
    assert!((summary["drive_frequency_hz"].as_f64().unwrap() / F0 - 1.0).abs() < 1e-6);
    assert!((line(&summary, "1/2")["amplitude"].as_f64().unwrap() - 0.1).abs() < 1e-4);
    assert_eq!(summary["noise_rms"], 0.0);
}

#[test]
fn a_missing_file_is_refused_and_leaves_no_folder() {
    let folder = tempfile::tempdir().unwrap();
    let output = granchain(folder.path(), &["vib.csv", "--out", "found"]).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8(output.stderr).unwrap().contains("vib.csv"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn pressures_are_printed_as_pressures() {
    let folder = tempfile::tempdir().unwrap();
    for (unit, factor, wanted) in [("kPa", 1.0, "kPa"), ("Pa", 1.0, "Pa")] {
        write(&folder.path().join("water.csv"), &format!("time_s,pressure ({unit})"), 4e-7, |t| {
            factor * envelope(t) * 20.0 * (TAU * F0 * t).cos()
        });
        let arguments = ["water.csv", "--drive-frequency", "73kHz"];
        let output = granchain(folder.path(), &arguments).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(!text.contains("mm/s") && text.contains(&format!("Amplitude ({wanted})")), "{text}");
        let drive = text.lines().find(|line| line.trim_start().starts_with("1 ")).unwrap();
        let amplitude: f64 = drive.split_whitespace().nth(2).unwrap().parse().unwrap();
        assert!((amplitude - 17.0).abs() < 3.0, "{text}");
    }
    // What a column without a name for it holds can be said.
    write(&folder.path().join("a.csv"), "time_s,ch (V)", 4e-7, |t| envelope(t) * (TAU * F0 * t).cos());
    let arguments = ["a.csv", "--kind", "hydrophone", "--scale", "20 kPa/V", "--drive-frequency", "73kHz"];
    let text = String::from_utf8(granchain(folder.path(), &arguments).output().unwrap().stdout).unwrap();
    assert!(text.contains("spectrum of the pressure") && text.contains("Amplitude (kPa)"), "{text}");
}

#[test]
fn the_horn_s_channel_of_the_same_file_drives() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "time_s,CH1 (V),CH2 (V)\n".to_owned();
    for i in 0..1900 {
        let t = -60e-6 + f64::from(i) * 4e-7;
        let tone = |ratio: f64| envelope(t) * (TAU * ratio * F0 * t).cos();
        writeln!(text, "{t:.10e},{:.9},{:.9}", 0.5 * tone(1.0), tone(1.0 / 3.0) + 0.3 * tone(1.0)).unwrap();
    }
    fs::write(folder.path().join("scope.csv"), text).unwrap();
    let channels =
        ["--channel", "CH2", "--scale", "100 mm/s/V", "--drive-read", "channel=CH1", "--drive-read", "scale=2 um/V"];
    let summary = json(folder.path(), &[&["scope.csv"], &channels[..]].concat());
    assert!((summary["drive_frequency_hz"].as_f64().unwrap() / F0 - 1.0).abs() < 1e-4, "{summary}");
    assert!(line(&summary, "1/3")["relative"].as_f64().unwrap() > 2.5, "{summary}");
}
