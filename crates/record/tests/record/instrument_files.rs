//! Instruments' own files, written by other people's writers (`tests/instruments/make.py`), and public ones where they are at hand.

use std::{
    fs,
    path::{Path, PathBuf},
};

use granchain_record::{ReadOptions, Record, RecordKind, Sensitivity, read_record, read_record_bytes};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/instruments").join(name)
}

fn options() -> ReadOptions {
    ReadOptions { scale: Some(Sensitivity::parse("100 mm/s/V").unwrap()), ..ReadOptions::default() }
}

fn channel(column: &str) -> ReadOptions {
    ReadOptions { column: Some(column.into()), ..options() }
}

fn read(name: &str, options: &ReadOptions) -> Record {
    read_record(&file(name), RecordKind::Vibrometer, options).unwrap()
}

#[test]
fn every_file_gives_the_samples_and_instants_that_were_written() {
    let volts = |i: usize| 0.25 * (0.3 * i as f64).sin() + 0.05;
    let plain = ReadOptions::default();
    let columns = ReadOptions { time_column: Some("1".into()), time_unit: Some("s".into()), ..channel("2") };
    for (name, options, factor, start, rounding) in [
        ("volts.npy", &columns, 0.1, -1e-5, 0.0),
        ("named.npz", &plain, 1.0, -1e-5, 1e-15),
        ("rate.npz", &options(), 0.1, -1e-5, 4e-9),
        ("compressed.mat", &plain, 1.0, -1e-5, 1e-15),
        ("structure.mat", &options(), 0.1, 0.0, 0.0),
        ("segments.tdms", &channel("vibrometer"), 0.1, -1e-5, 0.0),
        ("segments.tdms", &channel("horn"), 0.2, -1e-5, 0.0),
        ("full-scale.wav", &channel("1"), 0.1, 0.0, 1e-8),
        ("full-scale.wav", &channel("2"), -0.1, 0.0, 1e-8),
        ("averaged.trc", &options(), 0.1, -1e-5, 1e-6),
        ("curve.isf", &options(), 0.1, -1e-5, 5.1e-7),
        ("two-channels.bin", &channel("1"), 0.1, -1e-5, 4e-9),
        ("two-channels.bin", &channel("2"), 0.2, -1e-5, 4e-9),
    ] {
        let raw = read(name, options).raw;
        assert_eq!(raw.len(), 400, "{name}");
        // A single-precision interval has seven digits.
        assert!((raw.start - start).abs() < 1e-12 && (raw.step / 2e-7 - 1.0).abs() < 6e-8, "{name}: {raw:?}");
        for (i, value) in raw.values.iter().enumerate() {
            assert!((value - factor * volts(i)).abs() <= rounding + 1e-15, "{name}: {i}: {value}");
        }
    }
    assert_eq!(read("averaged.trc", &options()).averages, 16);
    assert!(read("averaged.trc", &options()).form.contains("LECROYHDO4024"));
}

#[test]
fn what_is_missing_is_asked_for_and_a_file_cut_anywhere_is_refused_or_shorter() {
    let refused = |name: &str, options: &ReadOptions| {
        read_record(&file(name), RecordKind::Vibrometer, options).unwrap_err().to_string()
    };
    let unscaled = refused("averaged.trc", &ReadOptions::default());
    assert!(unscaled.contains("--scale"), "{unscaled}");
    let several = refused("two-channels.bin", &options());
    assert!(several.contains("--channel"), "{several}");
    let untimed = refused("volts.npy", &channel("2"));
    assert!(untimed.contains("time"), "{untimed}");
    for entry in fs::read_dir(file("")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|it| it == "py") {
            continue;
        }
        let bytes = fs::read(&path).unwrap();
        for cut in (0..bytes.len()).step_by(97) {
            // Whatever comes of it, it ends.
            if let Ok(record) = read_record_bytes(&path, &bytes[..cut], Some(RecordKind::Vibrometer), &channel("1")) {
                assert!(record.raw.len() <= 400, "{}: {cut}", path.display());
            }
        }
    }
}

/// Exports of one record as binary and as CSV, and other binaries: repositories that publish them.
#[test]
fn public_exports_agree_with_the_maker_s_own_csv() {
    let folder = std::env::var_os("GRANCHAIN_SCOPES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/public-data/scope-binary"),
        PathBuf::from,
    );
    if !folder.is_dir() {
        println!("skipped: no {}; name the folder in GRANCHAIN_SCOPES", folder.display());
        return;
    }
    let slow = |column: usize| ReadOptions { column: Some(column.to_string()), ..options() };
    for (name, channels, timed) in [("01", 1, false), ("02", 2, false), ("04", 1, true), ("05", 2, true)] {
        let text = fs::read_to_string(folder.join(format!("rs_rs_rtp_{name}.Wfm.csv"))).unwrap();
        for column in 1..=channels {
            let record =
                read_record(&folder.join(format!("rs_rs_rtp_{name}.bin")), RecordKind::Vibrometer, &slow(column))
                    .unwrap();
            assert_eq!(record.raw.len(), text.lines().count(), "{name}");
            for (i, line) in text.lines().enumerate() {
                let cells: Vec<&str> = line.split(',').collect();
                let cell = cells[column - 1 + usize::from(timed)];
                let mantissa: String =
                    cell.split(['e', 'E']).next().unwrap().chars().filter(char::is_ascii_digit).collect();
                let digits = mantissa.trim_start_matches('0').len();
                let written: f64 = cell.parse().unwrap();
                let last = 10f64.powi(written.abs().max(1e-12).log10().floor() as i32 + 1 - digits as i32);
                assert!((10.0 * record.raw.values[i] - written).abs() <= last, "{name}:{}: {cell}", i + 1);
                if timed {
                    let instant: f64 = cells[0].parse().unwrap();
                    assert!((record.raw.time(i) - instant).abs() < 1e-3 * record.raw.step, "{name}:{}", i + 1);
                }
            }
        }
    }
    // The same record as bytes: within half a step of the converter.
    let [floats, bytes] = ["01", "03"].map(|name| {
        read_record(&folder.join(format!("rs_rs_rtp_{name}.bin")), RecordKind::Vibrometer, &slow(1)).unwrap().raw
    });
    assert!(floats.values.iter().zip(&bytes.values).all(|(a, b)| (a - b).abs() < 1e-6), "{:?}", &bytes.values[..4]);
}
