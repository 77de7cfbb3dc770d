//! Public files of laboratories with the values they hold, where they are at hand (`GRANCHAIN_LABS` names the folder).

use std::{
    fs,
    path::{Path, PathBuf},
};

use granchain_record::{Baseline, Masking, MeasurementError, ReadOptions, RecordKind, Sensitivity, read_record};

/// A file that was cut in mid-row, and one whose `X` has no unit.
const CUT: &str = "evanmoring__SDS00001_cut.csv";
const WITHOUT_UNIT: &str = "scottprahl__tests__files__wfm__DS1102D-A.csv";

#[test]
fn public_files_of_laboratories_hold_what_a_parser_by_hand_reads() {
    let folder = std::env::var_os("GRANCHAIN_LABS")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/real-files"), PathBuf::from);
    let Ok(text) = fs::read_to_string(folder.join("expected.json")) else {
        println!("skipped: no {}; name the folder in GRANCHAIN_LABS", folder.display());
        return;
    };
    let expected: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
    let mut right = 0;
    for row in &expected {
        let name = row["file"].as_str().unwrap();
        let path = folder.join("files").join(name);
        let read = |column: Option<&String>| {
            let options = ReadOptions {
                scale: Sensitivity::parse("1 m/s/V").ok(),
                baseline: Baseline::None,
                mask: Masking::None,
                column: column.cloned(),
                time_column: (name == WITHOUT_UNIT).then(|| "X".into()),
                time_unit: (name == WITHOUT_UNIT).then(|| "s".into()),
                ..ReadOptions::default()
            };
            read_record(&path, RecordKind::Vibrometer, &options)
        };
        let records = match read(None) {
            Err(MeasurementError::Ambiguous { candidates, .. }) => {
                candidates.iter().filter_map(|column| read(Some(column)).ok()).collect()
            }
            Err(error) => {
                assert!(name == CUT && error.to_string().contains("cut short"), "{name}: {error}");
                continue;
            }
            Ok(record) => vec![record],
        };
        let number = |key: &str| row[key].as_f64().unwrap();
        let agrees = records.iter().any(|record| {
            let values = &record.raw.values;
            let largest = values.iter().copied().fold(f64::MIN, f64::max);
            let smallest = values.iter().copied().fold(f64::MAX, f64::min);
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * number("max").abs().max(number("min").abs());
            // By hand the step is that of the first and the last instant, which may be rounded to three digits.
            values.len() as f64 == number("n")
                && (record.raw.step / number("dt") - 1.0).abs() < 2e-3
                && near(largest, number("max"))
                && near(smallest, number("min"))
        });
        assert!(agrees, "{name}: {row}");
        right += 1;
    }
    println!("{right} of {} right", expected.len());
    assert_eq!(right + 1, expected.len());
}
