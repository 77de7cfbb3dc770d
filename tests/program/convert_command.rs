//! `granchain convert` writes what it reads.

use std::path::Path;

use crate::harness::{PROJECT, granchain};
use granchain::measurement::{Masking, ReadOptions, RecordKind, read_record};

fn convert(arguments: &[&str]) -> (i32, String, String) {
    granchain(PROJECT, &[&["convert"], arguments].concat())
}

#[test]
fn a_record_goes_through_table_and_universal_file_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let plain = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dialects/plain.csv");
    let plain = read_record(&plain, RecordKind::Vibrometer, &ReadOptions::default()).unwrap();
    for (name, more, rounding) in [("a.csv", &[][..], 0.0), ("b.uff", &[], 0.0), ("c.unv", &["--text"], 0.5e-12)] {
        let out = folder.path().join(name);
        let arguments = ["tests/dialects/german.csv", out.to_str().unwrap(), "--kind", "vibrometer"];
        let (code, said, err) = convert(&[&arguments, more].concat());
        assert_eq!((err.as_str(), code), ("", 0), "{name}");
        assert!(said.contains("100 samples of tests/dialects/german.csv (semicolons, decimal commas, UTF-8"), "{said}");
        let again = read_record(&out, RecordKind::Vibrometer, &ReadOptions::default()).unwrap();
        let pairs = again.raw.values.iter().zip(&plain.raw.values);
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() <= rounding * b.abs()), "{name}");
        assert_eq!(again.raw.len(), plain.raw.len(), "{name}");
        assert!((again.raw.start - plain.raw.start).abs() < 1e-17 && (again.raw.step - plain.raw.step).abs() < 1e-17);
    }
}

/// A spike is no motion, and a fit bridges it; a copy of the file keeps it, and says so.
#[test]
fn a_copy_keeps_what_a_calibration_would_mask() {
    let folder = tempfile::tempdir().unwrap();
    let tone = |i: u32| if i == 450 { 9.5 } else { (std::f64::consts::TAU * 73e3 * 2e-7 * f64::from(i)).sin() };
    let mut text = String::from("# drive frequency: 73 kHz\ntime_us,velocity_mm_per_s\n");
    text.extend((0..900).map(|i| format!("{:.1},{:.6}\n", 0.2 * f64::from(i), tone(i))));
    let file = folder.path().join("vib.csv");
    std::fs::write(&file, text).unwrap();
    for name in ["a.csv", "b.uff"] {
        let out = folder.path().join(name);
        let (code, said, err) = convert(&[file.to_str().unwrap(), out.to_str().unwrap()]);
        assert_eq!((err.as_str(), code), ("", 0), "{name}");
        assert!(said.contains("written as in the file; a calibration would mask 1 spike at "), "{said}");
        let options = ReadOptions { mask: Masking::None, ..ReadOptions::default() };
        let [from, to] = [&file, &out].map(|path| read_record(path, RecordKind::Vibrometer, &options).unwrap().raw);
        assert!(from.values == to.values && to.peak() == 9.5e-3, "{name}");
    }
}

#[test]
fn what_is_there_is_not_overwritten_and_other_names_are_refused() {
    let (code, _, err) = convert(&["tests/dialects/german.csv", "tests/dialects/plain.csv"]);
    assert_eq!(code, 1);
    assert!(err.contains("the file exists; name another, or delete it first"), "{err}");
    let (code, _, err) = convert(&["tests/dialects/german.csv", "a.xlsx"]);
    assert_eq!(code, 2);
    assert!(err.contains("expected a name that ends in .uff, .unv or .csv"), "{err}");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a.uff");
    let (code, _, err) = convert(&["tests/dialects/volts.csv", out.to_str().unwrap()]);
    assert_eq!(code, 1);
    assert!(err.contains("--scale '<VALUE> mm/s/V'") && !out.exists(), "{err}");
}
