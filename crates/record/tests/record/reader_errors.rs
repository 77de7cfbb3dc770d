//! Every broken input is refused with file, line, column, what was expected, what was found, and what to do.

use std::{fs, path::PathBuf};

use granchain_record::{Baseline, Missing, ReadOptions, RecordKind, read_record};
use proptest::prelude::*;

/// A record of `rows` rows of a 73 kHz tone every 1 µs, as text.
fn rows(count: usize) -> Vec<String> {
    (0..count)
        .map(|i| {
            let t = i as f64 * 1e-6;
            format!("{:.6},{:.6}", t * 1e3, 100.0 * (2.0 * std::f64::consts::PI * 73e3 * t).sin())
        })
        .collect()
}

fn file(header: &str, rows: &[String]) -> String {
    format!("# a comment\n{header}\n{}\n", rows.join("\n"))
}

const HEADER: &str = "time_ms,velocity_mm_per_s";

struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The message for these bytes, with the folder left out.
    fn refused_as(&self, bytes: &[u8], kind: RecordKind, options: &ReadOptions) -> String {
        fs::write(self.path("vib.csv"), bytes).unwrap();
        self.message("vib.csv", kind, options)
    }

    fn message(&self, name: &str, kind: RecordKind, options: &ReadOptions) -> String {
        let error = read_record(&self.path(name), kind, options).expect_err("must be refused");
        error.to_string().replace(&format!("{}/", self.folder.path().display()), "")
    }
}

fn refused(text: &str) -> String {
    Bench::new().refused_as(text.as_bytes(), RecordKind::Vibrometer, &ReadOptions::default())
}

/// The good file with one row replaced; the first row is line 3.
fn with_row(at: usize, row: &str) -> String {
    let mut rows = rows(100);
    rows[at] = row.into();
    file(HEADER, &rows)
}

#[test]
fn the_unbroken_file_is_read() {
    let bench = Bench::new();
    fs::write(bench.path("vib.csv"), file(HEADER, &rows(100))).unwrap();
    let record = read_record(&bench.path("vib.csv"), RecordKind::Vibrometer, &ReadOptions::default()).unwrap();
    assert_eq!(record.series.len(), 100);
}

#[test]
fn empty_file() {
    let expected = "vib.csv: expected a header line and rows of numbers, found an empty file; export it again";
    for text in ["", "\n\n", "  \n", "\u{feff}", "# only\n# comments\n"] {
        assert_eq!(refused(text), expected);
    }
}

#[test]
fn header_only() {
    let expected = "expected rows of numbers below the header, found none; export the record again";
    assert_eq!(refused("time_s,velocity_m_per_s\n"), format!("vib.csv:1: {expected}"));
    assert_eq!(refused("# c\n\nTime,Velocity\n(s),(m/s)\n"), format!("vib.csv:4: {expected}"));
}

#[test]
fn no_header() {
    assert_eq!(
        refused("0,1\n1,2\n"),
        "vib.csv:1: expected a header that names the columns with their units, found `0,1`; add one such as \
         `time_s,velocity_mm_per_s`, or pass --read time_unit=UNIT --unit UNIT"
    );
}

#[test]
fn text_in_a_number_column() {
    assert_eq!(
        refused(&with_row(40, "0.040,overload")),
        "vib.csv:43: column `velocity_mm_per_s`: expected a number, found `overload`; correct the cell or delete the row"
    );
    assert_eq!(
        refused(&with_row(40, "\"0,040\",1")),
        "vib.csv:43: column `time_ms`: expected a number, found `0,040`; write decimal points, not commas, or \
         pass --read decimal=comma"
    );
}

#[test]
fn missing_values_and_nan() {
    for cell in ["n/a", "NaN", "nan", "", "--"] {
        assert_eq!(
            refused(&with_row(40, &format!("0.040,{cell}"))),
            format!(
                "vib.csv:43: column `velocity_mm_per_s`: expected a finite number, found `{cell}`; drop the row or pass \
                 --read missing=interpolate"
            )
        );
    }
}

#[test]
fn infinity() {
    for cell in ["inf", "-Infinity", "1e999"] {
        assert_eq!(
            refused(&with_row(40, &format!("0.040,{cell}"))),
            format!(
                "vib.csv:43: column `velocity_mm_per_s`: expected a finite number, found `{cell}`; the input was overloaded \
                 or the export is wrong: record it again"
            )
        );
    }
}

#[test]
fn a_gap_too_long_to_bridge() {
    let options = ReadOptions { missing: Missing::Interpolate, ..ReadOptions::default() };
    let mut many = rows(100);
    for (i, row) in many.iter_mut().enumerate().skip(20).take(6) {
        *row = format!("{:.6},n/a", i as f64 * 1e-3);
    }
    let message = Bench::new().refused_as(file(HEADER, &many).as_bytes(), RecordKind::Vibrometer, &options);
    assert_eq!(
        message,
        "vib.csv:23: column `velocity_mm_per_s`: expected at most 5 missing cells in a row with a number before and after, \
         found 6; cut the record there"
    );
    let message = Bench::new().refused_as(with_row(99, "0.099,n/a").as_bytes(), RecordKind::Vibrometer, &options);
    assert!(message.starts_with("vib.csv:102: column `velocity_mm_per_s`: expected at most 5"), "{message}");
}

#[test]
fn missing_columns() {
    assert_eq!(
        refused(
            &file("time_ms,force_n", &rows(20)).replace("force_n", "force_N,gain").replace(",0.000000\n", ",0,0\n")
        ),
        "vib.csv:2: a vibrometer record needs a velocity such as `velocity_mm_per_s`; found the columns `time_ms`, `force_N`, \
         `gain`; rename one, or pass --channel and --unit"
    );
    assert_eq!(
        refused(&file("sample,velocity_mm_per_s", &rows(20))),
        "vib.csv:2: expected a column of time such as `time_s`, found the columns `sample`, `velocity_mm_per_s`; rename one, or \
         pass --read time_column=NAME and --read time_unit=UNIT, or --sample-rate if there is no time in the file"
    );
    let options = ReadOptions { column: Some("speed".into()), ..ReadOptions::default() };
    assert_eq!(
        Bench::new().refused_as(file(HEADER, &rows(20)).as_bytes(), RecordKind::Vibrometer, &options),
        "vib.csv:2: --channel names `speed`, which is no column here; the columns are `time_ms`, `velocity_mm_per_s`"
    );
}

#[test]
fn ragged_row() {
    assert_eq!(
        refused(&with_row(40, "0.040,1,2")),
        "vib.csv:43: expected 2 cells as in the header, found 3; complete the row or delete it"
    );
}

#[test]
fn truncated_last_line() {
    let good = file(HEADER, &rows(100));
    let end =
        "the file ends in the middle of this line, so the transfer was cut short: copy it again, or delete the line";
    let cut = good.trim_end().rsplit_once(',').unwrap().0;
    assert_eq!(refused(cut), format!("vib.csv:102: expected 2 cells as in the header, found 1; {end}"));
    assert_eq!(
        refused(&format!("{cut},1.2e")),
        format!("vib.csv:102: column `velocity_mm_per_s`: expected a number, found `1.2e`; {end}")
    );
    let bench = Bench::new();
    fs::write(bench.path("vib.csv"), format!("{cut},1.2")).unwrap();
    let record = read_record(&bench.path("vib.csv"), RecordKind::Vibrometer, &ReadOptions::default()).unwrap();
    assert!(record.warnings[0].starts_with("the last line has no line end"), "{:?}", record.warnings);
}

#[test]
fn unknown_missing_and_wrong_units() {
    assert_eq!(
        refused(&file("time_ms,velocity [furlong/s]", &rows(20))),
        "vib.csv:2: column `velocity [furlong/s]`: unknown unit `furlong` in `furlong/s`; examples: mm/s, um, nm, V, kPa; correct the header, or pass --unit"
    );
    assert_eq!(
        refused(&file("time_ms,velocity", &rows(20))),
        "vib.csv:2: column `velocity`: expected a unit, found none; write it in the header as in `velocity_mm_per_s`, or pass \
         --unit"
    );
    assert_eq!(
        refused(&file("time,velocity_mm_per_s", &rows(20))),
        "vib.csv:2: column `time`: expected a unit, found none; write it in the header as in `time_s`, or pass --read time_unit=UNIT"
    );
    assert_eq!(
        refused(&file("time_ms,displacement_um", &rows(20))),
        "vib.csv:2: column `displacement_um`: expected a velocity, found the unit `um` of a length; name another column with \
         --channel, or correct the unit; a horn tip's record is given with --drive: are the two files swapped?"
    );
}

#[test]
fn bare_volts() {
    for header in ["time_ms,CH1 (V)", "time_ms,CH1 [mV]", "time_ms,signal_V"] {
        let message = refused(&file(header, &rows(20)));
        assert!(message.contains("expected a velocity, found volts"), "{message}");
        assert!(message.contains("vibrometer's sensitivity; pass it as --scale '<VALUE> mm/s/V'"), "{message}");
        assert!(message.starts_with("vib.csv:2: column `"), "{message}");
    }
    let message = refused(&format!("Time,CH1\ns,Volt\n{}\n", rows(20).join("\n")));
    assert!(message.starts_with("vib.csv:2: column `CH1`: expected a velocity, found volts (`Volt`)"), "{message}");
}

#[test]
fn repeated_and_decreasing_time() {
    assert_eq!(
        refused(&with_row(40, "0.039,1")),
        "vib.csv:43: column `time_ms`: expected a time later than 39 µs, found 39 µs; the time column needs more digits, or \
         the row is there twice"
    );
    assert_eq!(
        refused(&with_row(40, "0.002,1")),
        "vib.csv:43: column `time_ms`: expected a time later than 39 µs, found 2 µs; the instants fall or jump: \
         keep one sweep only, or correct the sign or the unit of the time column"
    );
}

#[test]
fn a_value_beyond_any_range_is_refused_with_its_cell() {
    let options = ReadOptions { resample: true, ..ReadOptions::default() };
    let text = with_row(40, "0.0401,1e307");
    let message = Bench::new().refused_as(text.as_bytes(), RecordKind::Vibrometer, &options);
    assert!(message.starts_with("vib.csv:43: column `velocity"), "{message}");
    assert!(message.contains("expected a finite number, found `1e307`"), "{message}");
}

#[test]
fn uneven_sampling() {
    let mut lost = rows(100);
    lost.remove(40);
    assert_eq!(
        refused(&file(HEADER, &lost)),
        "vib.csv:43: column `time_ms`: the samples are not evenly spaced: a step of 2 µs at this line, 1 µs elsewhere (5 % allowed); restore the rows that \
         were lost, or pass --read resample=true"
    );
    let message = refused(&with_row(40, "0.0401,1"));
    assert!(message.starts_with("vib.csv:43: column `time_ms`: the samples are not evenly spaced"), "{message}");
    // 4 % of a step of rounding is let pass.
    let bench = Bench::new();
    fs::write(bench.path("vib.csv"), with_row(40, "0.04004,1")).unwrap();
    assert!(read_record(&bench.path("vib.csv"), RecordKind::Vibrometer, &ReadOptions::default()).is_ok());
}

#[test]
fn binary_and_other_files() {
    let bench = Bench::new();
    let options = ReadOptions::default();
    for (bytes, found) in [
        (&b"PK\x03\x04rest"[..], "a zip archive or a spreadsheet (.xlsx)"),
        (b"LLWFM\x00\x01", "a Tektronix file of the TDS 400 to 700 (.wfm)"),
        (b"SPBVDS\x00", "an OWON file (.bin)"),
        (b"MDF     4.10\x00", "an ASAM file (.mf4, .mdf)"),
        (b"PAR1\x15\x04", "a Parquet file"),
        (b"ARROW1\x00\x00", "an Arrow or Feather file"),
        (b"time_s,v\n\x00\x01", "byte 0x00 at offset 9"),
        (b"\xff\xfet\x00\x00", "UTF-16 text with characters cut in half"),
    ] {
        assert_eq!(
            bench.refused_as(bytes, RecordKind::Vibrometer, &options),
            format!("vib.csv: expected text, found {found}; export the record as CSV text")
        );
    }
    assert_eq!(
        bench.refused_as(b"# c\ntime_\x9ds,v\n", RecordKind::Vibrometer, &options),
        "vib.csv:2: expected UTF-8 text, found byte 0x9d; save the file as UTF-8"
    );
}

#[test]
fn missing_file_and_folder() {
    let bench = Bench::new();
    fs::write(bench.path("vib.csv"), "").unwrap();
    assert_eq!(
        bench.message("vibb.csv", RecordKind::Vibrometer, &ReadOptions::default()),
        "vibb.csv: expected a record, found no such file; did you mean `vib.csv`?"
    );
    fs::create_dir(bench.path("run1")).unwrap();
    fs::write(bench.path("run1/a.csv"), "").unwrap();
    assert_eq!(
        bench.message("run1", RecordKind::Vibrometer, &ReadOptions::default()),
        "run1: expected a file, found a folder; name a file in it, such as `a.csv`"
    );
}

#[test]
fn drive_shorter_than_two_cycles() {
    let bench = Bench::new();
    let burst = |cycles: f64| {
        let rows: Vec<_> = (0..200)
            .map(|i| {
                let t = i as f64 * 0.5e-6 - 20e-6;
                let on = t >= 0.0 && t < cycles / 73e3;
                let x = if on { (2.0 * std::f64::consts::PI * 73e3 * t).sin() } else { 0.0 };
                format!("{:.1},{x:.6}", t * 1e6)
            })
            .collect();
        file("time_us,displacement_um", &rows)
    };
    let options = ReadOptions { drive_frequency: Some(73e3), ..ReadOptions::default() };
    let message = bench.refused_as(burst(1.5).as_bytes(), RecordKind::HornTip, &options);
    assert_eq!(
        message,
        "vib.csv: expected a drive of at least two cycles, found 1.50 at 73.0000 kHz; record a longer burst, or correct \
         --drive-frequency"
    );
    fs::write(bench.path("horn.csv"), burst(2.5)).unwrap();
    read_record(&bench.path("horn.csv"), RecordKind::HornTip, &options).unwrap().to_drive().unwrap();
    assert!(
        Bench::new()
            .refused_as(burst(1.0).as_bytes(), RecordKind::HornTip, &ReadOptions::default())
            .contains("two cycles")
    );
}

#[test]
fn record_sampled_below_four_times_the_drive() {
    let options = ReadOptions { drive_frequency: Some(300e3), ..ReadOptions::default() };
    let message = Bench::new().refused_as(file(HEADER, &rows(100)).as_bytes(), RecordKind::Vibrometer, &options);
    assert_eq!(
        message,
        "vib.csv: a drive of 0.3 MHz needs a sample rate of at least 1.2 MHz (4 samples per cycle); the record has 1 MHz; check --drive-frequency and the \
         unit of time, or record it faster"
    );
}

#[test]
fn frequencies_that_nothing_has_are_refused_where_they_are_stated() {
    let bench = Bench::new();
    let header = |line: &str| format!("# {line}\n{}", file(HEADER, &rows(400)));
    for kind in [RecordKind::HornTip, RecordKind::Vibrometer] {
        for line in ["drive frequency: 1e15 Hz", "drive frequency: 1e-6 Hz", "f0: -73 kHz"] {
            let found = bench.refused_as(header(line).as_bytes(), kind, &ReadOptions::default());
            assert!(found.starts_with("vib.csv: drive frequency of"), "{line}: {found}");
            assert!(found.contains("(the file's header): expected 1 Hz to 0.1 GHz"), "{line}: {found}");
        }
        let found = bench.refused_as(header("bandwidth: -1.5 MHz").as_bytes(), kind, &ReadOptions::default());
        assert!(found.contains("bandwidth of -1.5 MHz (the file's header): expected a frequency above 0"), "{found}");
        // Within the range, above what the file can hold.
        let found = bench.refused_as(header("drive frequency: 50 MHz").as_bytes(), kind, &ReadOptions::default());
        assert!(found.contains("needs a sample rate of at least 0.2 GHz"), "{found}");
    }
}

#[test]
fn too_few_rows_and_two_candidates() {
    assert_eq!(
        refused(&file(HEADER, &rows(3))),
        "vib.csv: expected at least 8 samples, found 3; export the whole record"
    );
    assert_eq!(
        refused("time_s,v1_mm_per_s,v2_mm_per_s\n0,1,2\n"),
        "vib.csv:1: expected one column to read, found 2: `v1_mm_per_s`, `v2_mm_per_s`; choose one with --channel"
    );
}

#[test]
fn baselines_that_cannot_be_had() {
    let text = file(HEADER, &rows(100));
    let options = ReadOptions { baseline: Baseline::Pretrigger, ..ReadOptions::default() };
    assert_eq!(
        Bench::new().refused_as(text.as_bytes(), RecordKind::Vibrometer, &options),
        "vib.csv: baseline=pretrigger needs at least 8 quiet samples before the trigger, found 0; pass --read trigger=TIME with the \
         instant of the trigger, or another baseline"
    );
    let options = ReadOptions { baseline: Baseline::Plateau, drive_frequency: Some(20e3), ..ReadOptions::default() };
    let message = Bench::new().refused_as(text.as_bytes(), RecordKind::Vibrometer, &options);
    assert!(message.contains("baseline=plateau needs a burst with at least 4 drive periods"), "{message}");
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = granchain_record::read_record_bytes("x.csv".as_ref(), &bytes, None, &ReadOptions::default());
    }

    #[test]
    fn arbitrary_tables_never_panic(
        header in "[a-z_ \\[\\]()/µ,\"#;]{0,30}",
        rows in proptest::collection::vec("(-?[0-9]{1,3}(\\.[0-9]{1,3})?|n/a|nan|inf|x|\"|),(-?[0-9]{1,3}(e-?[0-9]{1,3})?|n/a|)", 0..40),
        interpolate in any::<bool>(),
        known in any::<bool>(),
    ) {
        let header = if known { "time_us,velocity_mm_per_s".to_owned() } else { header };
        let text = format!("{header}\n{}", rows.join("\n"));
        let missing = if interpolate { Missing::Interpolate } else { Missing::Refuse };
        let options = ReadOptions { missing, ..ReadOptions::default() };
        for kind in [None, Some(RecordKind::HornTip), Some(RecordKind::Vibrometer)] {
            let _ = granchain_record::read_record_bytes("x.csv".as_ref(), text.as_bytes(), kind, &options);
        }
    }

    #[test]
    fn even_tables_of_any_values_never_panic(
        values in proptest::collection::vec(prop_oneof![-1e3..1e3f64, Just(0.0), Just(1e300), Just(-1e300), Just(5e-324)], 8..60),
        baseline in prop_oneof![Just(Baseline::Auto), Just(Baseline::Mean), Just(Baseline::Plateau), Just(Baseline::None)],
        velocity in any::<bool>(),
        f0 in prop_oneof![Just(None), (1e2..1e6f64).prop_map(Some)],
    ) {
        let header = if velocity { "time_us,velocity_mm_per_s" } else { "time_us,displacement_um" };
        let rows: Vec<_> = values.iter().enumerate().map(|(i, x)| format!("{i},{x:e}")).collect();
        let options = ReadOptions { baseline, drive_frequency: f0, ..ReadOptions::default() };
        let text = format!("{header}\n{}\n", rows.join("\n"));
        for kind in [RecordKind::HornTip, RecordKind::Vibrometer] {
            if let Ok(record) = granchain_record::read_record_bytes("x.csv".as_ref(), text.as_bytes(), Some(kind), &options) {
                let _ = record.to_drive();
            }
        }
    }
}
