//! Any bytes read as a record: two bytes of options, then the file.

#![no_main]

#[path = "../../allocator/mod.rs"]
mod allocator;

use std::path::Path;

use granchain_record::{
    Baseline, DecimalSign, Delimiter, Missing, ReadOptions, RecordKind, Sensitivity, read_record_bytes,
};
use granchain_signal::Quantity;
use libfuzzer_sys::fuzz_target;

fn options(flags: u8, signs: u8) -> ReadOptions {
    let flag = |bit: u8| flags >> bit & 1 == 1;
    ReadOptions {
        scale: flag(0).then(|| Sensitivity::parse("100 mm/s/V").expect("a sensitivity")),
        range: flag(1).then(|| Quantity::parse("10 V").expect("a voltage")),
        unit: flag(2).then(|| "mm/s".to_owned()),
        time_unit: flag(2).then(|| "us".to_owned()),
        baseline: if flag(3) { Baseline::Mean } else { Baseline::Auto },
        missing: if flag(4) { Missing::Interpolate } else { Missing::Refuse },
        resample: flag(5),
        sample_rate: flag(6).then_some(2e6),
        column: flag(7).then(|| "2".to_owned()),
        delimiter: [None, Some(Delimiter::Comma), Some(Delimiter::Semicolon), Some(Delimiter::Tab)]
            [usize::from(signs & 3)],
        decimal: [None, Some(DecimalSign::Point), Some(DecimalSign::Comma), None][usize::from(signs >> 2 & 3)],
        dataset: (signs >> 4 & 3 > 0).then_some(usize::from(signs >> 4 & 3)),
        ..ReadOptions::default()
    }
}

fuzz_target!(|bytes: &[u8]| {
    let [flags, signs, bytes @ ..] = bytes else { return };
    let options = options(*flags, *signs);
    let kind = [None, Some(RecordKind::HornTip), Some(RecordKind::Vibrometer), None][usize::from(signs >> 6)];
    let (read, peak) = allocator::peak_of(|| read_record_bytes(Path::new("own.csv"), bytes, kind, &options));
    match read {
        Err(refused) => assert!(refused.to_string().starts_with("own.csv"), "{refused}"),
        Ok(record) => {
            assert!(record.series.len() >= 8 && record.series.step > 0.0);
            assert!(record.raw.values.iter().all(|value| value.is_finite()));
        }
    }
    assert!(
        peak <= allocator::FILES * bytes.len() + allocator::ANY_FILE,
        "{peak} bytes of memory for {} of file",
        bytes.len()
    );
});
