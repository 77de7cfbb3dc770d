//! A hydrophone's record: pressure in any unit, or volts with the sensitivity of flag or header; what is none is refused.

use std::{f64::consts::TAU, path::Path, process::Command};

use granchain::measurement::{ReadOptions, Record, RecordKind, RecordedQuantity, Sensitivity, read_record_bytes};

/// A burst of 20 kPa at 73 kHz behind 40 quiet samples, Pa.
fn pressure(index: usize) -> f64 {
    let time = index as f64 * 0.2e-6;
    if index < 40 { 0.0 } else { 2e4 * (TAU * 73e3 * (time - 8e-6)).sin() }
}

/// The burst under `header`, a value of 1 in the file standing for `unit` Pa.
fn file(comments: &str, header: &str, unit: f64) -> String {
    let rows: Vec<String> = (0..400).map(|i| format!("{:.1},{:.9e}", i as f64 * 0.2, pressure(i) / unit)).collect();
    format!("{comments}time_us,{header}\n{}\n", rows.join("\n"))
}

fn read(text: &str, kind: Option<RecordKind>, options: &ReadOptions) -> Result<Record, String> {
    read_record_bytes(Path::new("record.csv"), text.as_bytes(), kind, options).map_err(|error| error.to_string())
}

fn assert_same(record: &Record) {
    assert_eq!((record.kind, record.recorded), (RecordKind::Hydrophone, RecordedQuantity::Pressure));
    for (i, value) in record.series.values.iter().enumerate() {
        assert!((value - pressure(i)).abs() < 1e-4, "{i}: {value} {}", pressure(i));
    }
}

fn scaled(text: &str) -> ReadOptions {
    ReadOptions { scale: Some(Sensitivity::parse(text).unwrap()), ..ReadOptions::default() }
}

#[test]
fn every_unit_of_pressure_reads_the_same() {
    for (header, unit) in [
        ("pressure_pa", 1.0),
        ("pressure_kpa", 1e3),
        ("Pressure [kPa]", 1e3),
        ("p (MPa)", 1e6),
        ("p / bar", 1e5),
        ("pressure_mbar", 1e2),
    ] {
        let header = header.replace("kpa", "kPa").replace("_pa", "_Pa");
        // Told from the unit alone, and as asked for.
        for kind in [None, Some(RecordKind::Hydrophone)] {
            assert_same(&read(&file("", &header, unit), kind, &ReadOptions::default()).unwrap());
        }
    }
}

#[test]
fn volts_are_a_pressure_by_flag_or_header_and_the_flag_wins() {
    // 250 nV/Pa: 20 kPa are 5 mV.
    let volts = file("", "CH1 (mV)", 4e3);
    for scale in ["250 nV/Pa", "0.25 uV/Pa", "250 mV/MPa", "4 MPa/V", "40 bar/V"] {
        let record = read(&volts, Some(RecordKind::Hydrophone), &scaled(scale)).unwrap();
        assert_same(&record);
        let said = "`CH1 (mV)` in volts × 4 MPa/V (250 nV/Pa) (--scale)";
        assert!(record.assumptions.iter().any(|text| text.contains(said)), "{:?}", record.assumptions);
    }
    let stated = file("# sensitivity: 250 nV/Pa (certificate)\n", "CH1 (mV)", 4e3);
    let record = read(&stated, None, &ReadOptions::default()).unwrap();
    assert_same(&record);
    assert!(record.assumptions.iter().any(|text| text.contains("(the header)")), "{:?}", record.assumptions);
    let other = file("# sensitivity: 500 nV/Pa\n", "CH1 (mV)", 4e3);
    assert_same(&read(&other, Some(RecordKind::Hydrophone), &scaled("250 nV/Pa")).unwrap());
    let half = read(&other, Some(RecordKind::Hydrophone), &ReadOptions::default()).unwrap();
    assert!((half.series.peak() / 1e4 - 1.0).abs() < 0.01);
    // Beside a pressure it is a remark.
    assert_same(&read(&file("# sensitivity: 500 nV/Pa\n", "p (kPa)", 1e3), None, &ReadOptions::default()).unwrap());
}

#[test]
fn what_is_no_hydrophone_s_record_is_refused_with_what_to_do() {
    let hydrophone = Some(RecordKind::Hydrophone);
    let velocity = file("", "velocity_mm_per_s", 1.0);
    let said = read(&velocity, hydrophone, &ReadOptions::default()).unwrap_err();
    assert!(said.contains("expected a pressure") && said.contains("leave out --quantity pressure"), "{said}");
    let named = ReadOptions { column: Some("p (kPa)".into()), ..ReadOptions::default() };
    let said = read(&file("", "p (kPa)", 1e3), Some(RecordKind::Vibrometer), &named).unwrap_err();
    assert!(said.contains("--quantity pressure"), "{said}");
    let volts = file("", "CH1 (mV)", 4e3);
    let said = read(&volts, hydrophone, &ReadOptions::default()).unwrap_err();
    assert!(said.contains("hydrophone's sensitivity") && said.contains("--scale '<VALUE> mV/MPa'"), "{said}");
    let said = read(&volts, hydrophone, &scaled("100 mm/s/V")).unwrap_err();
    assert!(said.contains("a hydrophone record must be a pressure") && said.contains("a velocity"), "{said}");
    let said = read(&volts, Some(RecordKind::Vibrometer), &scaled("250 nV/Pa")).unwrap_err();
    assert!(said.contains("record must be a velocity") && said.contains("--quantity pressure"), "{said}");
}

#[test]
fn a_pressure_that_no_sound_has_is_refused_with_figures() {
    // 20 kPa written as if in GPa; 5 V taken as 5 V at 1 nV/Pa.
    let said = read(&file("", "p (GPa)", 1.0), None, &ReadOptions::default()).unwrap_err();
    assert!(said.contains("20 TPa") || said.contains("2e13 Pa"), "{said}");
    let said = read(&file("", "CH1 (V)", 4e3), Some(RecordKind::Hydrophone), &scaled("1 nV/Pa")).unwrap_err();
    assert!(said.contains("5 GPa") && said.contains("1 GPa/V (1 nV/Pa)"), "{said}");
    assert!(read(&file("", "CH1 (V)", 4e3), Some(RecordKind::Hydrophone), &scaled("1 uV/Pa")).is_ok());
}

#[test]
fn inspect_prints_the_sensitivity_it_took() {
    let place = tempfile::tempdir().unwrap();
    let path = place.path().join("run3.csv");
    std::fs::write(&path, file("# sensitivity: 250 nV/Pa\n", "CH1 (mV)", 4e3)).unwrap();
    let run = |arguments: &[&str]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_granchain")).arg("inspect").arg(&path).args(arguments).output().unwrap();
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let (out, err) = run(&[]);
    assert!(out.contains("a hydrophone record") && out.contains("20 kPa and -20 kPa"), "{out}{err}");
    assert!(out.contains("in volts × 4 MPa/V (250 nV/Pa) (the header)"), "{out}");
    let (_, err) = run(&["--scale", "250 V/Pa"]);
    assert!(err.contains("4 mPa a volt") && err.contains("check the prefixes"), "{err}");
}
