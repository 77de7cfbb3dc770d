//! `granchain inspect` says what was understood and assumed, for people and as JSON.

use std::{fs, path::Path};

use crate::harness::{PROJECT, granchain};
use serde_json::Value;

fn inspect(arguments: &[&str]) -> (i32, String, String) {
    granchain(PROJECT, &[&["inspect"], arguments].concat())
}

fn json(arguments: &[&str]) -> Value {
    let (code, out, err) = inspect(&[arguments, &["--json"]].concat());
    assert_eq!(code, 0, "{err}");
    serde_json::from_str(&out).unwrap()
}

#[test]
fn a_vibrometer_record_is_described() {
    let (code, out, err) = inspect(&["measurements/annulus-73khz/vib.csv"]);
    assert_eq!((err.as_str(), code), ("", 0));
    let digest = out.lines().find(|line| line.contains("sha-256")).unwrap();
    insta::assert_snapshot!(out.replace(digest.trim(), "sha-256           …"), @r#"
    measurements/annulus-73khz/vib.csv: a vibrometer record
      sha-256           …
      form              commas, decimal points, UTF-8
      columns           time_us, velocity_mm_per_s
      time              `time_us` in us
      quantity          `velocity_mm_per_s` in mm_per_s
      samples           4500 at 5 MHz, from -53 µs to 846.8 µs; the trigger is at 0
      peaks             288.9 mm/s and -247.1 mm/s
      rms               89.43 mm/s
      baseline removed  114 µm/s
      pre-trigger       250 quiet samples
      noise floor       1.017 mm/s rms, -49.1 dB re peak
      drive frequency   73.0000 kHz (the file's header)
      strongest line    72.9758 kHz
    first lines
      | time_us,velocity_mm_per_s
      | -50.0,0.50
      | -49.8,-1.00
      | -49.6,-0.50
      | -49.4,0.75
      | -49.2,-0.75
    comments
      # granchain reconstruction: velocity of the far pole of the last bead, six 1 mm steel beads on a resin annulus
      # NOT A MEASUREMENT: synthesised from printed values, without any chain model; see PROVENANCE.md
      # made by: cargo run --release --example reconstruct_annulus
      # drive frequency: 73 kHz
      # bandwidth: 1.5 MHz (invented)
      # delay: 3 us (invented)
      # printed: largest value +289 mm/s, smallest -247 mm/s
      # printed: lines at 1/3 and 2/3 of the drive frequency and their ultraharmonics are present
      # invented: every amplitude of a line, the shape, height, width and instant of every pulse, their jitter
      # invented: sample interval 0.2 us, 50 us of pre-trigger, first motion 32 us after the start of the burst
      # invented: growth and decay of the pulses, and of the part that repeats every third period
      # invented: white decoder noise of 1 mm/s rms within the bandwidth, resolution 0.25 mm/s
    assumed
      - t = 0 of the file's own time axis is the trigger
      - instrument delay removed: 3.000000 µs (the header)
      - instrument bandwidth 1.5 MHz (the header)
      - baseline: mean of 250 quiet samples at the start
      - sign as in the file: positive from piston to support
      - noise: 1.02 mm/s rms (quiet samples)
      - quantised in steps of 250 µm/s
    "#);
}

#[test]
fn a_horn_tip_record_is_recognised_by_its_name() {
    let record = json(&["measurements/annulus-73khz/horn_tip.csv"]);
    assert_eq!(record["kind"], "horn-tip");
    assert_eq!(record["unit"], "m");
    assert_eq!(record["samples"], 4500);
    assert!((record["sample_rate_hz"].as_f64().unwrap() - 5e6).abs() < 1.0);
    assert!((record["positive_peak"].as_f64().unwrap() - 1e-6).abs() < 3e-9);
    assert_eq!(record["pretrigger_samples"], 250);
    assert!((record["strongest_line_hz"].as_f64().unwrap() - 73e3).abs() < 5.0);
}

#[test]
fn the_drive_frequency_is_taken_from_the_horn_beside_or_from_the_flag() {
    let folder = tempfile::tempdir().unwrap();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("measurements/annulus-73khz");
    let silent = |name: &str| -> String {
        let text = fs::read_to_string(shipped.join(name)).unwrap();
        text.lines().filter(|line| !line.starts_with('#')).map(|line| format!("{line}\n")).collect()
    };
    let vib = folder.path().join("vib.csv");
    fs::write(&vib, silent("vib.csv")).unwrap();
    let vib = vib.to_str().unwrap();
    assert_eq!(json(&[vib])["drive_frequency_hz"], Value::Null);
    fs::write(folder.path().join("horn_tip.csv"), silent("horn_tip.csv")).unwrap();
    let record = json(&[vib]);
    assert_eq!(record["drive_frequency_from"], "horn_tip.csv beside it");
    assert!((record["drive_frequency_hz"].as_f64().unwrap() - 73e3).abs() < 5.0);
    let record = json(&[vib, "--drive-frequency", "72.9kHz"]);
    assert_eq!(record["drive_frequency_hz"].as_f64().unwrap(), 72.9e3);
}

#[test]
fn reading_flags_reach_the_reader() {
    let record = json(&[
        "measurements/annulus-73khz/vib.csv",
        "--read",
        "invert=true",
        "--read",
        "delay=-1us",
        "--read",
        "bandwidth=1MHz",
        "--read",
        "baseline=none",
        "--read",
        "trigger=10us",
    ]);
    assert!((record["positive_peak"].as_f64().unwrap() - 0.247).abs() < 1e-12);
    assert!((record["start_s"].as_f64().unwrap() + 59e-6).abs() < 1e-12);
    assert_eq!(record["bandwidth_hz"].as_f64().unwrap(), 1e6);
    assert_eq!(record["baseline_removed"].as_f64().unwrap(), 0.0);
}

#[test]
fn refusals_go_to_standard_error_with_exit_code_1_or_2() {
    let (code, out, err) = inspect(&["measurements/annulus-73khz/vibb.csv"]);
    assert_eq!((out.as_str(), code), ("", 1));
    assert!(
        err.starts_with("error: measurements/annulus-73khz/vibb.csv: expected a record, found no such file"),
        "{err}"
    );
    assert!(err.contains("did you mean `vib.csv`?"), "{err}");
    let (code, _, err) = inspect(&["measurements/annulus-73khz/vib.csv", "--unit", "V"]);
    assert_eq!(code, 1);
    assert!(err.contains("volts (`V`), which need the vibrometer's sensitivity; pass it as --scale"), "{err}");
    let (code, _, err) = inspect(&["measurements/annulus-73khz/vib.csv", "--read", "delay=3"]);
    assert_eq!(code, 2);
    assert!(err.contains("without a unit"), "{err}");
}

#[test]
fn a_folder_is_a_table_of_its_files() {
    let (code, out, err) = inspect(&["tests/dialects"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.starts_with("tests/dialects: "), "{out}");
    let row = |name: &str| out.lines().find(|line| line.trim_start().starts_with(name)).unwrap().to_owned();
    assert!(row("german.csv").contains("semicolons, decimal commas") && row("german.csv").contains("194.4 mm/s"));
    // Once for all: what is missing, and of which files.
    let lacking: Vec<&str> =
        out.split("\n\n").filter(|part| part.contains("missing: --scale '<VALUE> mm/s/V'\n")).collect();
    assert!(lacking.len() == 1 && lacking[0].contains("volts.csv") && lacking[0].contains("keysight.csv"), "{out}");
    assert_eq!(
        out.matches("pass it as --scale '<VALUE> um/V'").count()
            + out.matches("pass it as --scale '<VALUE> mm/s/V'").count(),
        1
    );
    assert!(out.lines().filter(|line| line.len() > 200).count() < 6, "{out}");
    let files = json(&["tests/dialects"]);
    let files = files.as_array().unwrap();
    assert!(files.len() > 25 && files.windows(2).all(|pair| pair[0]["name"].as_str() < pair[1]["name"].as_str()));
    let of = |name: &str| files.iter().find(|file| file["name"] == name).unwrap();
    assert_eq!(of("plain.csv")["samples"], 100);
    assert_eq!(of("volts.csv")["missing"], "--scale '<VALUE> mm/s/V'");
    assert!(of("volts.csv")["refused"].as_str().unwrap().contains("volts"), "{}", of("volts.csv"));
}

#[test]
fn a_bench_file_says_once_how_each_channel_is_read() {
    let place = tempfile::tempdir().unwrap();
    let bench = place.path().join("bench.toml");
    fs::write(&bench, "[vibrometer]\nscale = \"125 mm/s/V\"\ndelay = \"4 us\"\n").unwrap();
    let file = bench.to_str().unwrap();
    let (code, out, err) = inspect(&["tests/dialects/volts.csv", "--kind", "vibrometer", "--bench", file]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("in volts × 125 mm/s/V") && out.contains("instrument delay removed: 4.000000 µs"), "{out}");
    let (code, _, err) = inspect(&["tests/dialects/volts.csv", "--bench", file]);
    assert!(code == 2 && err.contains("--kind"), "{err}");
    fs::write(&bench, "[vibrometer]\nscael = \"125 mm/s/V\"\n").unwrap();
    let (code, _, err) = inspect(&["tests/dialects/volts.csv", "--kind", "vibrometer", "--bench", file]);
    assert!(code == 1 && err.contains("bench.toml:2: unknown key `scael`; did you mean `scale`?"), "{err}");
}
