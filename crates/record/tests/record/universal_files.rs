//! Universal files: what is written comes back, what pyuff writes is read, broken files are mended or refused.

use std::path::{Path, PathBuf};

use granchain_record::{
    ByteOrder, MeasurementError, Precision, ReadOptions, Record, RecordKind, RecordedQuantity, Samples, Sensitivity,
    TimeResponse, UniversalError, UniversalForm, read_record, read_record_bytes,
};
use granchain_signal::Series;
use proptest::prelude::*;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/dialects").join(name)
}

fn plain() -> Record {
    read_record(&file("plain.csv"), RecordKind::Vibrometer, &ReadOptions::default()).unwrap()
}

fn bytes_of(name: &str) -> Vec<u8> {
    std::fs::read(file(name)).unwrap()
}

fn read(bytes: &[u8], options: &ReadOptions) -> Result<Record, MeasurementError> {
    read_record_bytes(Path::new("a.uff"), bytes, Some(RecordKind::Vibrometer), options)
}

fn read_plainly(bytes: &[u8]) -> Record {
    read(bytes, &ReadOptions::default()).unwrap()
}

fn refused(bytes: &[u8]) -> String {
    read(bytes, &ReadOptions::default()).expect_err("must be refused").to_string()
}

fn replaced(bytes: &[u8], from: &[u8], to: &[u8]) -> Vec<u8> {
    let at = bytes.windows(from.len()).position(|window| window == from).expect("what is replaced must be there");
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}

const FORMS: [UniversalForm; 6] = {
    const fn form(precision: Precision, binary: Option<ByteOrder>) -> UniversalForm {
        UniversalForm { precision, binary }
    }
    [
        form(Precision::Double, Some(ByteOrder::Little)),
        form(Precision::Double, Some(ByteOrder::Big)),
        form(Precision::Single, Some(ByteOrder::Little)),
        form(Precision::Single, Some(ByteOrder::Big)),
        form(Precision::Double, None),
        form(Precision::Single, None),
    ]
};

/// Relative rounding of a value in this form.
fn rounding(form: UniversalForm) -> f64 {
    match (form.precision, form.binary) {
        (Precision::Double, Some(_)) => 0.0,
        (Precision::Single, Some(_)) => f64::from(f32::EPSILON) / 2.0,
        (Precision::Double, None) => 0.5e-12,
        (Precision::Single, None) => 0.5e-5,
    }
}

#[test]
fn what_pyuff_writes_is_the_plain_file_s_series() {
    let plain = plain();
    for (name, form) in [
        ("pyuff-58.uff", "universal file, 58, double, even"),
        ("pyuff-58-single.uff", "universal file, 58, single, even"),
        ("pyuff-58-uneven.uff", "universal file, 58, double, uneven"),
        ("pyuff-58b.uff", "universal file, 58b, double, little-endian, even"),
        ("pyuff-58b-uneven.uff", "universal file, 58b, double, little-endian, uneven"),
    ] {
        let record = read_record(&file(name), RecordKind::Vibrometer, &ReadOptions::default()).unwrap();
        // The label says mm/s and the digits are those of the plain file.
        assert_eq!(record.raw.values, plain.raw.values, "{name}");
        assert!(!record.assumptions.iter().any(|text| text.contains("fill the last lines")), "{name}");
        assert!((record.raw.start - plain.raw.start).abs() < 1e-18, "{name}");
        assert!((record.raw.step / plain.raw.step - 1.0).abs() < 1e-12, "{name}");
        assert_eq!(record.form, form, "{name}");
        assert!(record.warnings.is_empty(), "{name}: {:?}", record.warnings);
    }
    let record = read_record(&file("pyuff-58.uff"), RecordKind::Vibrometer, &ReadOptions::default()).unwrap();
    assert!(
        record
            .assumptions
            .iter()
            .any(|text| text.contains("with 6 digits: the last instant is known to 5e-11 s, 1.0e-4")),
        "{:?}",
        record.assumptions
    );
}

#[test]
fn one_of_several_functions_is_chosen_or_all_are_listed() {
    let bytes = bytes_of("pyuff-several.uff");
    let message = refused(&bytes);
    assert!(
        message.starts_with("a.uff: expected one function to read, found 3; choose one with --read dataset=N:"),
        "{message}"
    );
    for part in [
        "1: frequency response at 12+Z, in mm/s, 4 values, line 1, `six beads`",
        "2: time response at 12+Z, in mm/s, 10 values, line 17, `ten samples`",
        "3: time response at 12+Z, in mm/s, 100 values, line 31, `Häufigkeit`",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
    let choose = |number| read(&bytes, &ReadOptions { dataset: Some(number), ..ReadOptions::default() });
    assert_eq!(choose(3).unwrap().raw.values, plain().raw.values);
    assert_eq!(choose(2).unwrap().raw.values, plain().raw.values[..10]);
    assert!(choose(3).unwrap().assumptions[0].starts_with("function 3 of 3 (dataset): 3: time response"));
    let spectrum = choose(1).unwrap_err().to_string();
    let expected = "a.uff:1: expected a real time response, found a function of type 4 (frequency response); export the time \
                    data, or choose another with --read dataset=N";
    assert_eq!(spectrum, expected);
    assert!(choose(4).unwrap_err().to_string().contains("found 3 and no number 4"));
}

#[test]
fn files_that_were_hurt_on_their_way_are_mended_and_it_is_said() {
    let plain = plain().raw.values;
    let (ascii, binary) = (bytes_of("pyuff-58.uff"), bytes_of("pyuff-58b.uff"));
    let marked = |end: &[u8]| binary.clone().split_last_mark(end);
    let text = String::from_utf8(ascii.clone()).unwrap();
    let odd: Vec<u8> = {
        // 99 values: the last line is ragged, or filled up.
        let values: Vec<f64> = plain[..99].to_vec();
        let series = Series::new(-1e-5, 5e-7, values);
        let form = UniversalForm { precision: Precision::Single, binary: Some(ByteOrder::Big) };
        response(&series).to_bytes(form)
    };
    for (name, bytes, expected, note) in [
        ("CR LF", text.replace('\n', "\r\n").into_bytes(), &plain[..], None),
        ("CR CR LF", text.replace('\n', "\r\r\n").into_bytes(), &plain, None),
        ("D exponents", text.replace("e-0", "D-0").replace("e+0", "D+0").into_bytes(), &plain, None),
        ("small d", text.replace("e-0", "d-0").into_bytes(), &plain, None),
        ("ragged lines", text.replace("e-01    ", "e-01\n    ").into_bytes(), &plain, None),
        (
            "no last mark",
            text.trim_end().trim_end_matches("-1").as_bytes().to_vec(),
            &plain,
            Some("the `-1` at the end is missing"),
        ),
        (
            "filled last line",
            ascii.clone().split_last_mark(b" 0.0 0.0\n    -1\n"),
            &plain,
            Some("2 numbers behind the 100 announced"),
        ),
        ("Windows-1252 title", replaced(&ascii, b"six beads", b"Messung \xb5\xfc"), &plain, None),
        ("UTF-8 title", replaced(&ascii, b"six beads", "Kügelchen µ".as_bytes()), &plain, None),
        ("CR LF before the mark", marked(b"\r\n    -1\r\n"), &plain, None),
        ("LF before the mark", marked(b"\n    -1\n"), &plain, None),
        ("zeros before the mark", marked(b"\0\0\0\0    -1\n"), &plain, None),
        ("no mark", marked(b""), &plain, Some("the `-1` at the end is missing")),
        ("odd count", odd.clone(), &[], None),
        ("odd count, filled", odd.clone().split_last_mark(b"\0\0\0\0    -1\n"), &[], None),
    ] {
        let record = read(&bytes, &ReadOptions::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
        if expected.is_empty() {
            assert_eq!(record.raw.len(), 99, "{name}");
        } else {
            assert_eq!(record.raw.values, expected, "{name}");
        }
        let notes = [record.assumptions, record.warnings.clone()].concat();
        match note {
            Some(note) => assert!(notes.iter().any(|text| text.contains(note)), "{name}: {notes:?}"),
            None => assert!(record.warnings.is_empty(), "{name}: {:?}", record.warnings),
        }
    }
}

fn response(series: &Series) -> TimeResponse<'_> {
    TimeResponse { title: "made", quantity: RecordedQuantity::Velocity, samples: Samples::Even(series) }
}

trait LastMark {
    /// The file with its last mark replaced.
    fn split_last_mark(self, end: &[u8]) -> Vec<u8>;
}

impl LastMark for Vec<u8> {
    fn split_last_mark(mut self, end: &[u8]) -> Vec<u8> {
        if self.ends_with(b"    -1\n") && self.len() > 12 {
            self.truncate(self.len() - 7);
        }
        self.extend_from_slice(end);
        self
    }
}

#[test]
fn a_binary_file_sent_as_text_is_mended() {
    // Values whose bytes hold many line feeds.
    let values: Vec<f64> = (0..50).map(|i| f64::from_le_bytes([10, i, 10, 13, 9, 10, 0x20 + i % 5, 0x3f])).collect();
    let series = Series::new(0.0, 5e-7, values);
    for form in &FORMS[..2] {
        let good = response(&series).to_bytes(*form);
        assert_eq!(read_plainly(&good).raw.values, series.values);
        let mut sent = Vec::new();
        for byte in &good {
            if *byte == b'\n' {
                sent.push(b'\r');
            }
            sent.push(*byte);
        }
        assert!(sent.len() > good.len() + 100);
        let record = read_plainly(&sent);
        assert_eq!(record.raw.values, series.values);
        assert!(record.warnings[0].contains("CR before every LF"), "{:?}", record.warnings);
        // With the CRs of the values taken away nothing can be mended.
        let stripped: Vec<u8> = good.iter().copied().filter(|byte| *byte != b'\r').collect();
        assert!(refused(&stripped).contains("expected"), "{}", refused(&stripped));
    }
}

#[test]
fn truncated_and_malformed_files_are_refused_with_line_and_remedy() {
    let (ascii, binary) = (bytes_of("pyuff-58.uff"), bytes_of("pyuff-58b.uff"));
    assert_eq!(
        refused(&ascii[..2000]),
        "a.uff:27: expected 100 values as record 7 announces, found 53 before the end of the file; the file was cut short: copy \
         or export it again"
    );
    assert_eq!(
        refused(&binary[..1000]),
        "a.uff:14: expected 800 bytes of values as record 7 announces, found 85 before the end of the file; the file was cut \
         short: copy or export it again"
    );
    assert_eq!(
        refused(&ascii[..400]),
        "a.uff:6: expected eleven lines of header and values behind them, found `the end of the file`; export the file again"
    );
    let long = replaced(&ascii, b"       100         1", b"       104         1");
    assert!(
        refused(&long).contains("a.uff:39: expected 104 values as record 7 announces, found 100 before -1"),
        "{}",
        refused(&long)
    );
    for (from, to, expected) in [
        (
            &b"         4       100"[..],
            &b"         3       100"[..],
            "a.uff:9: expected an ordinate type of 2, 4, 5 or 6, found `3",
        ),
        (b"  5.00000e-07", b" -5.00000e-07", "a.uff:9: expected a positive step of the abscissa"),
        (
            b"       100         1",
            b"       xxx         1",
            "a.uff:9: expected ordinate type, number of values, spacing",
        ),
        (b"-2.50000000000e-01", b"               NaN", "a.uff:14: expected a finite number, found `NaN`; export"),
        (
            b"        17    0",
            b"        18    0",
            "a.uff:1: expected a real time response, found an abscissa of quantity 18",
        ),
        (
            b"    1         0    0",
            b"   12         0    0",
            "found a function of type 12 (spectrum); export the time data",
        ),
        (
            b"         0    0    0    0 NONE",
            b"        13    0    0    0 NONE",
            "a ratio with a denominator of quantity 13",
        ),
    ] {
        let message = refused(&replaced(&ascii, from, to));
        assert!(message.contains(expected), "{expected}: {message}");
    }
    let message = refused(&replaced(&binary, b"58b     1     2", b"58b     1     1"));
    assert!(message.starts_with("a.uff:2: expected IEEE 754 numbers in a known byte order"), "{message}");
    let message = refused(b"    -1\n   151\nmodel\n    -1\n");
    assert!(message.contains("expected a function (data set 58), found the data sets 151; export"), "{message}");
}

#[test]
fn units_stated_twice_must_agree() {
    let ascii = bytes_of("pyuff-58.uff");
    let label = b"mm/s                ";
    let with = |text: &str| replaced(&ascii, label, format!("{text:<20}").as_bytes());
    let units = |code: u32, factor: f64| {
        let line = format!("{factor:25.16e}").replace('e', "D");
        [
            format!("    -1\n   164\n{code:>10}{:<20}{:>10}\n{line}{line}{line}\n{line}\n    -1\n", "units", 1)
                .as_bytes(),
            &ascii,
        ]
        .concat()
    };
    // A label of another quantity, an unknown label, none.
    assert!(refused(&with("mm")).contains("expected one unit, found the label `mm` and quantity 11 (velocity); say"));
    assert!(refused(&with("furlong")).contains("unknown unit `furlong`"));
    let given = ReadOptions { unit: Some("mm/s".into()), ..ReadOptions::default() };
    for label in ["mm", "furlong", "NONE"] {
        assert_eq!(read(&with(label), &given).unwrap().raw.values, plain().raw.values, "{label}");
    }
    let record = read_plainly(&with("NONE"));
    assert_eq!(record.raw.values[21], plain().raw.values[21] * 1e3);
    assert!(
        record.assumptions.iter().any(|text| text.contains("quantity 11 (velocity) in m/s (SI, as nothing else")),
        "{:?}",
        record.assumptions
    );
    // Data set 164 says millimetres as the label does, or contradicts it.
    assert_eq!(read_plainly(&units(5, 1e3)).raw.values, plain().raw.values);
    assert!(refused(&units(1, 1.0)).contains("found the label `mm/s` and lengths of 1 m (data set 164)"));
    let unlabelled = replaced(&units(5, 1e3), label, format!("{:<20}", "NONE").as_bytes());
    assert_eq!(read_plainly(&unlabelled).raw.values, plain().raw.values);
    // Exponents of a general quantity say no unit; volts need their sensitivity.
    let general = replaced(&with("NONE"), b"        11    0    0    0", b"         1    1    0    0");
    let error = read(&general, &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, MeasurementError::NoUnit { .. }), "{error}");
    let record = read(&general, &given).unwrap();
    assert!(
        record.assumptions.iter().any(|text| text.contains("exponents 1 of length, 0 of force")),
        "{:?}",
        record.assumptions
    );
    let volts = replaced(&with("V"), b"        11    0", b"         0    0");
    assert!(refused(&volts).contains("--scale '<VALUE> mm/s/V'"));
    let scaled = ReadOptions { scale: Some(Sensitivity::parse("1 mm/s/V").unwrap()), ..ReadOptions::default() };
    assert_eq!(read(&volts, &scaled).unwrap().raw.values, plain().raw.values);
}

#[test]
fn displacement_makes_a_horn_tip_record() {
    let series = Series::new(-2e-5, 5e-7, plain().raw.values.iter().map(|x| 1e-5 * x).collect());
    let response = TimeResponse { quantity: RecordedQuantity::Displacement, ..response(&series) };
    let bytes = response.to_bytes(FORMS[0]);
    let options = ReadOptions { drive_frequency: Some(73e3), ..ReadOptions::default() };
    let record = read_record_bytes(Path::new("a.uff"), &bytes, None, &options).unwrap();
    assert_eq!((record.kind, record.recorded), (RecordKind::HornTip, RecordedQuantity::Displacement));
    assert_eq!(record.raw.values, series.values);
    let error = read(&bytes, &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, MeasurementError::WrongQuantity { .. }), "{error}");
    let several = [&bytes[..], &bytes].concat();
    assert!(matches!(
        read(&several, &ReadOptions::default()),
        Err(MeasurementError::Universal(UniversalError::Several { .. }))
    ));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn what_is_written_comes_back(
        values in proptest::collection::vec(prop_oneof![-1e3..1e3f64, -1e-30..1e-30f64, Just(0.0)], 8..80),
        start in -1000i32..1000,
        step in 1u32..1000,
        jitter in proptest::collection::vec(-0.02..0.02f64, 80),
    ) {
        // Instants and step have at most six digits.
        let decimal = |number: i64, decade: i32| format!("{number}e{decade}").parse::<f64>().unwrap();
        let series = Series::new(decimal(start.into(), -6), decimal(step.into(), -8), values.clone());
        let times: Vec<f64> = (0..values.len()).map(|i| (i as f64 + jitter[i]) * 1e-6).collect();
        for form in FORMS {
            let relative = rounding(form);
            let close = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= relative * b.abs());
            let record = read_plainly(&response(&series).to_bytes(form));
            prop_assert!(close(&record.raw.values, &values), "{form:?}: {:?} {values:?}", record.raw.values);
            prop_assert_eq!((record.raw.start, record.raw.step), (series.start, series.step));
            let uneven = TimeResponse { samples: Samples::Uneven { times: &times, values: &values }, ..response(&series) };
            let record = read_plainly(&uneven.to_bytes(form));
            prop_assert!(close(&record.raw.values, &values), "{form:?} uneven");
            prop_assert!((record.raw.start - times[0]).abs() <= 1e-5 * times[0].abs());
        }
    }
}

/// Of the file of several functions the spectrum, and the record that is the plain file's.
fn parts() -> [Vec<u8>; 2] {
    let bytes = bytes_of("pyuff-several.uff");
    let marks: Vec<usize> = (0..bytes.len() - 6)
        .filter(|&at| bytes[at..].starts_with(b"    -1\n") && (at == 0 || bytes[at - 1] == b'\n'))
        .collect();
    let open = |nth: usize| marks[nth];
    [bytes[..open(2)].to_vec(), bytes[open(marks.len() - 2)..].to_vec()]
}

#[test]
fn files_of_spectra_say_so_and_the_one_record_among_them_is_read() {
    let [spectrum, time] = parts();
    let message = refused(&[&spectrum[..], &spectrum].concat());
    assert!(message.contains("expected a record in time, found 2 functions of which none is one"), "{message}");
    let record = read_plainly(&[&spectrum[..], &time, &spectrum].concat());
    assert_eq!(record.raw.values, plain().raw.values);
    assert!(record.assumptions[0].starts_with("function 2 of 3 (the only one in time)"), "{:?}", record.assumptions);
}

#[test]
fn lines_may_end_with_cr_alone() {
    let text = String::from_utf8(bytes_of("pyuff-58.uff")).unwrap();
    for end in ["\r", "\r\n"] {
        assert_eq!(read_plainly(text.replace('\n', end).as_bytes()).raw.values, plain().raw.values, "{end:?}");
    }
}
