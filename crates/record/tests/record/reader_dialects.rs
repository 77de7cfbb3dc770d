//! The same record in every dialect gives the plain file's series; what can be read in two ways is refused.

use std::path::{Path, PathBuf};

use granchain_record::{
    DecimalSign, Delimiter, MeasurementError, ReadOptions, Record, RecordKind, Sensitivity, read_record,
    read_record_bytes,
};
use granchain_signal::{Quantity, Series};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/dialects").join(name)
}

fn read(name: &str, options: &ReadOptions) -> Record {
    read_record(&file(name), RecordKind::Vibrometer, options).unwrap()
}

fn plain() -> Record {
    read("plain.csv", &ReadOptions::default())
}

fn scaled() -> ReadOptions {
    ReadOptions { scale: Some(Sensitivity::parse("100 mm/s/V").unwrap()), ..ReadOptions::default() }
}

fn refused(name: &str, text: &str, options: &ReadOptions) -> String {
    let error = read_record_bytes(Path::new(name), text.as_bytes(), Some(RecordKind::Vibrometer), options);
    error.expect_err("must be refused").to_string()
}

/// Equal up to the rounding of instants to nine digits and of a value to `digits` of its own.
fn assert_close(name: &str, a: &Series, b: &Series, rounding: f64) {
    assert_eq!(a.len(), b.len(), "{name}");
    assert!((a.start - b.start).abs() < 1e-13 && (a.step / b.step - 1.0).abs() < 1e-7, "{name}: {a:?}");
    for (x, y) in a.values.iter().zip(&b.values) {
        assert!((x - y).abs() <= rounding, "{name}: {x:e} {y:e}");
    }
}

/// The text that a record's notes must hold.
fn assert_says(name: &str, record: &Record, parts: &[&str]) {
    for part in parts {
        assert!(record.assumptions.iter().any(|text| text.contains(part)), "{name}: {part}: {:?}", record.assumptions);
    }
    assert!(record.warnings.is_empty(), "{name}: {:?}", record.warnings);
}

#[test]
fn a_german_export_is_the_plain_file_bit_for_bit() {
    let plain = plain();
    assert_eq!((plain.series.len(), plain.pretrigger, plain.form.as_str()), (100, 20, "commas, decimal points, UTF-8"));
    assert!(!plain.assumptions.iter().any(|text| text.contains("separated") || text.contains("encoding")));
    for (name, note) in [
        ("german.csv", &["cells separated by semicolons, decimal commas (taken from the first rows)"][..]),
        ("german-windows.csv", &["encoding: Windows-1252, for byte 0xb5 in line 1 is no UTF-8", "semicolons"]),
        ("german-utf16.csv", &["encoding: UTF-16 little-endian", "semicolons"]),
        ("german-utf16-big.csv", &["encoding: UTF-16 big-endian", "semicolons"]),
        ("greek-mu.csv", &["cells separated by semicolons, decimal points"]),
        ("tabs.txt", &["cells separated by tabs, decimal commas"]),
        ("trailing.csv", &["the delimiter at the end of every row separates nothing", "line 2 is a row of units"]),
    ] {
        let record = read(name, &ReadOptions::default());
        assert_eq!(record.series, plain.series, "{name}");
        assert_eq!(record.raw, plain.raw, "{name}");
        assert_eq!((record.baseline, record.noise_rms), (plain.baseline, plain.noise_rms), "{name}");
        assert_says(name, &record, note);
    }
}

#[test]
fn every_layout_of_an_oscilloscope_gives_the_plain_series() {
    let plain = plain();
    let channel = |name: &str| ReadOptions { column: Some(name.into()), ..scaled() };
    for (name, options, note) in [
        ("rigol.csv", scaled(), "instants from the header: -10 µs and every 0.5 µs"),
        ("rigol-no-x.csv", scaled(), "instants from the header"),
        ("rigol-inline.csv", scaled(), "instants from the header"),
        ("rigol-old.csv", scaled(), "line 2 is a row of units"),
        ("rigol-old-names.csv", scaled(), "line 2 is a row of units"),
        ("rigol-ultrascope.csv", scaled(), "lines 1 to 3 above the header are passed over"),
        ("siglent.csv", scaled(), "is rounded: one sample every 0.5 µs by the preamble's interval"),
        ("siglent-value.csv", scaled(), "CH1 (V)"),
        ("keysight-blank.csv", scaled(), "3 rows without a value at the ends are left out"),
        ("tektronix-few-digits.csv", scaled(), "is rounded: one sample every 0.5 µs by the preamble's interval"),
        ("tektronix-two.csv", channel("CH2"), "written by Tektronix"),
        ("rohde-schwarz-hmo.csv", scaled(), ""),
        ("hantek.csv", scaled(), "time taken in s, amplitude in mV"),
        ("gwinstek.csv", scaled(), "(GW Instek)"),
        ("labview.lvm", scaled(), "instants from X0 and Delta_X"),
        ("labview-times.lvm", scaled(), "(LabVIEW)"),
        ("yokogawa.csv", scaled(), "instants from HOffset and HResolution"),
        ("rto.Wfm.csv", scaled(), "rto.csv: -10 µs and every 0.5 µs"),
        ("picoscope.csv", scaled(), "line 2 is a row of units"),
        ("blanks.txt", scaled(), "cells separated by blanks"),
        ("carriage-returns.csv", scaled(), ""),
        ("frames.csv", ReadOptions { dataset: Some(2), sample_rate: Some(2e6), ..scaled() }, "segment 2 of 2"),
    ] {
        let record = read_record(&file(name), RecordKind::Vibrometer, &options)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let (start, raw) = (plain.raw.start, &record.raw);
        // Frames have no instants, and those of few digits begin anywhere within half a digit.
        let start = if name == "frames.csv" { 0.0 } else { start };
        assert!((raw.start - start).abs() < 5.1e-7 && (raw.step / 5e-7 - 1.0).abs() < 1e-7, "{name}: {raw:?}");
        assert_eq!(raw.len(), plain.raw.len(), "{name}");
        for (a, b) in raw.values.iter().zip(&plain.raw.values) {
            assert!((a - b).abs() < 1e-9, "{name}: {a:e} {b:e}");
        }
        assert_says(name, &record, if note.is_empty() { &[] } else { std::slice::from_ref(&note) });
    }
    let refused = |name| read_record(&file(name), RecordKind::Vibrometer, &scaled()).unwrap_err().to_string();
    assert!(refused("gwinstek-fast.csv").contains("volts are counts × 5.0E-02 / 25"));
    assert!(refused("rto.csv").contains("rto.Wfm.csv: name that file"));
    assert!(refused("tektronix-two.csv").contains("`CH1 (V)`, `CH2 (V)`; choose one with --channel"));
}

#[test]
fn every_instrument_gives_the_plain_series() {
    let plain = plain();
    let second = ReadOptions { dataset: Some(2), ..scaled() };
    for (name, options, note) in [
        ("keysight.csv", scaled(), &["written by Keysight InfiniiVision", "line 2 is a row of units"][..]),
        ("infiniium.csv", scaled(), &["lines 1 to 18 are", "(Keysight Infiniium)", "instants from XOrg and XInc"]),
        ("infiniium-xy.csv", scaled(), &["lines 1 to 18 are", "(Keysight Infiniium)"]),
        ("lecroy.csv", scaled(), &["lines 1 to 4 are", "LeCroy writes no units: time taken in s, amplitude in V"]),
        ("lecroy-segments.csv", second, &["segment 2 of 2 (dataset)"]),
        ("tektronix.csv", scaled(), &["lines 1 to 20 are the preamble of an instrument (Tektronix)"]),
        ("tektronix-commented.csv", scaled(), &["(Tektronix)"]),
        ("tektronix-beside.csv", scaled(), &["written by Tektronix"]),
        ("rohde-schwarz.csv", scaled(), &["in volts × 0.1 m/s/V (--scale)"]),
        ("digilent.csv", scaled(), &["written by Digilent WaveForms"]),
        ("volts.csv", scaled(), &["`CH1 (V)` in volts × 0.1 m/s/V (--scale); volts of the file × 1"]),
        ("millivolts.csv", scaled(), &["volts of the file × 0.001"]),
        ("polytec.txt", ReadOptions::default(), &["(Polytec)", "cells separated by tabs"]),
    ] {
        let record = read(name, &options);
        let expected = match name {
            "lecroy-segments.csv" => Series::new(plain.raw.start, plain.raw.step, plain.raw.values[..60].to_vec()),
            _ => plain.raw.clone(),
        };
        // The files hold the plain file's digits: what is left is a few roundings of the last bit.
        assert_close(name, &record.raw, &expected, 4.0 * f64::EPSILON * expected.peak());
        assert_says(name, &record, note);
    }
}

#[test]
fn a_file_without_time_needs_its_sample_rate() {
    let message = match read_record(&file("no-time.csv"), RecordKind::Vibrometer, &ReadOptions::default()) {
        Err(error @ MeasurementError::NoTime { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    assert!(message.contains("or --sample-rate if there is no time in the file"), "{message}");
    let options = ReadOptions { sample_rate: Some(2e6), trigger: Some(10e-6), ..ReadOptions::default() };
    let record = read("no-time.csv", &options);
    let plain = plain();
    assert_eq!(record.series.values, plain.series.values);
    assert_close("no-time.csv", &record.series, &plain.series, 0.0);
    assert_says("no-time.csv", &record, &["no column of time: the first sample is at 0, the others by --sample-rate"]);
    // A rate is taken before a column of time, and where they part a warning says so.
    let same = read("plain.csv", &ReadOptions { sample_rate: Some(2e6), ..ReadOptions::default() });
    assert_close("plain.csv", &same.raw, &plain.raw, 0.0);
    assert_says("plain.csv", &same, &["(--sample-rate); of `time_us` the first instant alone is taken"]);
    let other = read("plain.csv", &ReadOptions { sample_rate: Some(1e6), ..ReadOptions::default() });
    assert_eq!((other.series.len(), other.series.step), (plain.series.len(), 1e-6));
    assert!(
        other.warnings[0].contains("has one sample every 5.0000e-7 s, --sample-rate one every 1.0000e-6 s"),
        "{:?}",
        other.warnings
    );
}

#[test]
fn volts_need_a_sensitivity_and_nothing_else_may_have_one() {
    let bare = read_record(&file("volts.csv"), RecordKind::Vibrometer, &ReadOptions::default()).unwrap_err();
    assert!(bare.to_string().ends_with("pass it as --scale '<VALUE> mm/s/V'"), "{bare}");
    let needless = read_record(&file("plain.csv"), RecordKind::Vibrometer, &scaled()).unwrap_err().to_string();
    assert!(needless.contains("--scale is for a column in volts, found the unit `mm_per_s`"), "{needless}");
    // A displacement vibrometer makes a horn-tip record.
    let options = ReadOptions { scale: Some(Sensitivity::parse("2 um/V").unwrap()), ..ReadOptions::default() };
    let horn = read_record(&file("volts.csv"), RecordKind::HornTip, &options).unwrap();
    let ratio = horn.raw.peak() / read("volts.csv", &scaled()).raw.peak();
    assert!((ratio - 2e-6 / 0.1).abs() < 1e-15, "{ratio}");
    // The peak of the record is 194.44 mm/s, 1.9444 V.
    for (range, expected) in [("1.97 V", "99 % of"), ("0.197 m/s", "99 % of"), ("100 V", "2 % of")] {
        let options = ReadOptions { range: Some(Quantity::parse(range).unwrap()), ..scaled() };
        let record = read("volts.csv", &options);
        assert!(record.warnings.len() == 1 && record.warnings[0].contains(expected), "{range}: {:?}", record.warnings);
    }
    let options = ReadOptions { range: Some(Quantity::parse("10 V").unwrap()), ..scaled() };
    assert_says(
        "volts.csv",
        &read("volts.csv", &options),
        &["the record's peak is 19 % of the instrument's range (1 m/s)"],
    );
    let options = ReadOptions { range: Some(Quantity::parse("1 um").unwrap()), ..scaled() };
    let error = read_record(&file("volts.csv"), RecordKind::Vibrometer, &options).unwrap_err();
    assert!(matches!(error, MeasurementError::WrongRange { .. }), "{error}");
}

#[test]
fn segments_are_chosen_or_refused_with_their_number() {
    for (dataset, expected) in [
        (None, "expected one segment to read, found 2 of 60 samples each; choose one with --read dataset=1…2"),
        (Some(3), "found 2 of 60 samples each and no segment 3; choose"),
    ] {
        let options = ReadOptions { dataset, ..scaled() };
        let error =
            read_record(&file("lecroy-segments.csv"), RecordKind::Vibrometer, &options).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let options = ReadOptions { dataset: Some(2), ..ReadOptions::default() };
    let error = read_record(&file("plain.csv"), RecordKind::Vibrometer, &options).unwrap_err();
    assert!(matches!(error, MeasurementError::NoDatasets { wanted: 2, .. }), "{error}");
}

#[test]
fn wrong_delimiters_mixed_decimals_and_mixed_units_are_refused_with_line_and_remedy() {
    let text = |name: &str| std::fs::read_to_string(file(name)).unwrap();
    let german = text("german.csv");
    let none = ReadOptions::default();
    // Decimal commas between commas.
    let commas = text("plain.csv").replace(',', ";").replace(['.', ';'], ",");
    let message = refused("vib.csv", &commas, &none);
    assert!(message.starts_with("vib.csv:2: expected 2 cells as in the header, found 4; decimal commas"), "{message}");
    let message = refused("vib.csv", &german.replace(';', ","), &none);
    assert!(message.contains("export with semicolons, or with decimal points"), "{message}");
    let wrong = ReadOptions { delimiter: Some(Delimiter::Comma), ..ReadOptions::default() };
    let message = refused("vib.csv", &german, &wrong);
    assert!(
        message.contains("vib.csv:1: expected values separated by commas (delimiter), found semicolons"),
        "{message}"
    );
    // Row 60 with a point, then with a point and a comma.
    for (cell, found) in [("12.5", "12.5"), ("1.234,5", "1.234,5")] {
        let mut lines: Vec<&str> = german.lines().collect();
        let row = format!("19,5;{cell}");
        lines[60] = &row;
        let message = refused("vib.csv", &lines.join("\n"), &none);
        let expected = format!(
            "vib.csv:61: column `Geschwindigkeit [mm/s]`: expected decimal commas as in line 2, found `{found}`; use one decimal sign and no thousands separators"
        );
        assert_eq!(message, expected);
    }
    let mut lines: Vec<&str> = german.lines().collect();
    lines[30] = "4,5;0,12 m/s";
    assert_eq!(
        refused("vib.csv", &lines.join("\n"), &none),
        "vib.csv:31: column `Geschwindigkeit [mm/s]`: expected a plain number, found `0,12 m/s` with a unit; a column has one \
         unit, in its header: convert the cells to it"
    );
    // A second, different row of units.
    let message = refused("vib.csv", &text("plain.csv").replacen('\n', "\nus,m/s\n", 1), &none);
    assert!(
        message.starts_with("vib.csv:2: column `time_us`: expected a plain number, found `us` with a unit"),
        "{message}"
    );
    // Nothing but numbers that may have their thousands set off.
    let rows: Vec<_> = (1..40).map(|i| format!("{i},000;{},234", (i - 1) % 7 + 1)).collect();
    let grouped = format!("Zeit [us];v [mm/s]\n{}\n", rows.join("\n"));
    assert_eq!(
        refused("vib.csv", &grouped, &none),
        "vib.csv:2: `1,000` is a decimal or a thousands separator: pass --read decimal=comma if it is a decimal, else export without thousands \
         separators"
    );
    let given = ReadOptions { decimal: Some(DecimalSign::Comma), ..ReadOptions::default() };
    let record =
        read_record_bytes(Path::new("vib.csv"), grouped.as_bytes(), Some(RecordKind::Vibrometer), &given).unwrap();
    assert_eq!(record.raw.values[0], 1.234e-3);
}

#[test]
fn polytec_s_own_files_are_refused_with_what_to_export() {
    for name in ["Scan.svd", "Punkt.PVD"] {
        let message = refused(name, "anything", &ReadOptions::default());
        assert!(message.contains("export the time data as universal file (UFF 58) or as ASCII"), "{message}");
    }
}

#[test]
fn uneven_samples_are_interpolated_on_demand_only() {
    let text = std::fs::read_to_string(file("plain.csv")).unwrap();
    // A row is lost while the bead moves.
    let lost: String =
        text.lines().enumerate().filter(|(i, _)| *i != 61).map(|(_, line)| format!("{line}\n")).collect();
    assert!(refused("vib.csv", &lost, &ReadOptions::default()).ends_with("or pass --read resample=true"));
    let options = ReadOptions { resample: true, ..ReadOptions::default() };
    let record =
        read_record_bytes(Path::new("vib.csv"), lost.as_bytes(), Some(RecordKind::Vibrometer), &options).unwrap();
    let plain = plain();
    assert_says("lost", &record, &["interpolated by a cubic spline onto one every 5.0000e-7 s (resample)"]);
    // Found by a fuzzer: eight rows that reach over seven median steps.
    let few = "time_us,velocity_mm_per_s\n0,1\n1,2\n2,3\n3,4\n4,3\n5,2\n6,1\n6.5,0\n";
    assert!(refused("vib.csv", few, &options).contains("expected at least 8 samples, found 7"));
    assert_eq!(record.raw.len(), 100);
    for (i, (a, b)) in record.raw.values.iter().zip(&plain.raw.values).enumerate() {
        // 27 samples a cycle, 14 across the gap: 20.3/14⁴ of 0.2 m/s, and the file's noise of ±0.25 mm/s.
        let bound = if i == 60 { 1.2e-3 } else { 1e-12 };
        assert!((a - b).abs() < bound, "{i}: {a} {b}");
    }
    // Ten rows are too many.
    let lost: String =
        text.lines().enumerate().filter(|(i, _)| !(50..60).contains(i)).map(|(_, line)| format!("{line}\n")).collect();
    let message = refused("vib.csv", &lost, &options);
    assert!(message.contains("expected steps of at most 6 times the usual 0.5 µs"), "{message}");
}

#[test]
fn a_record_that_the_instrument_thinned_out_is_suspected() {
    let text = |name: &str| std::fs::read_to_string(file(name)).unwrap();
    let warnings = |text: &str| {
        read_record_bytes(Path::new("vib.csv"), text.as_bytes(), Some(RecordKind::Vibrometer), &scaled())
            .unwrap()
            .warnings
    };
    for (name, stated) in [("digilent.csv", "Sample rate: 2e+06Hz"), ("tektronix.csv", "Sample Interval,5e-07")] {
        let faster = text(name).replace(stated, &stated.replace("2e+06", "2e+08").replace("5e-07", "5e-09"));
        let found = warnings(&faster);
        assert!(found.len() == 1 && found[0].contains("the instrument thinned the record out"), "{name}: {found:?}");
    }
    let found = warnings(&text("tektronix.csv").replace("Record Length,100", "Record Length,1e7"));
    assert!(found.len() == 1 && found[0].contains("announces 10000000 samples, the file holds 100"), "{found:?}");
    // Largest and smallest value of each stretch, one after the other.
    let rows: String = (0..200)
        .map(|i| format!("{i},{}\n", if i % 2 == 0 { 1.0 } else { -1.0 } * (0.2 + 0.01 * f64::from(i))))
        .collect();
    let found = warnings(&format!("time_us,v [V]\n{rows}"));
    assert!(found.iter().any(|text| text.contains("kept the extremes of each stretch")), "{found:?}");
    // Two samples out of three turn in noise.
    let mut state = 1u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    let rows: String = (0..500).map(|i| format!("{i},{}\n", noise())).collect();
    assert_eq!(warnings(&format!("time_us,v [V]\n{rows}")), Vec::<String>::new());
    let found = warnings(&format!("# bandwidth: 1.5 MHz\ntime_us,v [V]\n{rows}"));
    assert!(found.len() == 1 && found[0].contains("the instrument's bandwidth is 1.5 MHz"), "{found:?}");
}
