//! Whatever bytes a file holds, the reader returns, within bounds of memory: a record, or a refusal.
//! `PROPTEST_CASES=100000000` for a long run; `tests/fuzz/` follows the branches taken.

#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod allocator;
mod harm;

use std::{
    path::{Path, PathBuf},
    sync::LazyLock,
};

use granchain::{
    measurement::{Baseline, DecimalSign, Delimiter, Missing, ReadOptions, RecordKind, Sensitivity, read_record_bytes},
    signal::Quantity,
};
use harm::{cases, harm, harmed};
use proptest::prelude::*;

/// Every file in `tests/dialects` and `tests/instruments` with its path, for some have another beside them; with `GRANCHAIN_FUZZ_ONLY=rigol` those whose names begin so.
static FILES: LazyLock<Vec<(PathBuf, Vec<u8>)>> = LazyLock::new(|| {
    let folders = ["tests/dialects", "tests/instruments"].map(|name| Path::new(env!("CARGO_MANIFEST_DIR")).join(name));
    let entries = folders.iter().flat_map(|folder| std::fs::read_dir(folder).unwrap());
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    names.retain(|path| path.extension().is_some_and(|extension| extension != "py" && extension != "gitattributes"));
    names.sort();
    let only = std::env::var("GRANCHAIN_FUZZ_ONLY").unwrap_or_default();
    names.retain(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(&only)));
    names.iter().map(|path| (path.clone(), std::fs::read(path).unwrap())).collect()
});

/// Signs that mean something in some form of file.
fn words() -> Vec<Vec<u8>> {
    ["\n", "\r", "\0", ",", ";", "\t", "\"", "#", " ", "  ", "=", "-1", "    -1\n", "e999", "nan", "1e308", "58b", "-"]
        .iter()
        .map(|word| word.as_bytes().to_vec())
        .chain([vec![0xff; 9], vec![0xb5], b"99999999999999999999".to_vec()])
        .collect()
}

fn options() -> impl Strategy<Value = ReadOptions> {
    let flags =
        (any::<[bool; 4]>(), prop::option::of(0usize..4), prop::option::of(prop_oneof![Just(2e6), Just(1e-300)]));
    let signs = (
        prop::option::of(prop::sample::select(vec![Delimiter::Comma, Delimiter::Semicolon, Delimiter::Tab])),
        prop::option::of(prop::sample::select(vec![DecimalSign::Point, DecimalSign::Comma])),
    );
    let column = prop::option::of(prop::sample::select(vec!["1", "2", "CH1", "CH3"]));
    (flags, signs, column).prop_map(
        |(([scaled, resample, bridged, named], dataset, sample_rate), (delimiter, decimal), column)| ReadOptions {
            scale: scaled.then(|| Sensitivity::parse("100 mm/s/V").unwrap()),
            range: scaled.then(|| Quantity::parse("10 V").unwrap()),
            unit: named.then(|| "mm/s".to_owned()),
            time_unit: named.then(|| "us".to_owned()),
            baseline: if bridged { Baseline::Mean } else { Baseline::Auto },
            missing: if bridged { Missing::Interpolate } else { Missing::Refuse },
            delimiter,
            decimal,
            sample_rate,
            resample,
            dataset,
            column: column.map(Into::into),
            ..ReadOptions::default()
        },
    )
}

/// A type of HDF5 may announce 65,535 members, for which the library reserves memory.
const OF_HDF5: usize = 8 << 20;

fn is_hdf5(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "h5") || path.ends_with("matrix-7.3.mat")
}

/// Read as any kind; a refusal names the file.
fn try_all(path: &Path, bytes: &[u8], options: &ReadOptions) -> usize {
    let kinds = [None, Some(RecordKind::HornTip), Some(RecordKind::Vibrometer)];
    let read = kinds.map(|kind| {
        let (read, peak) = allocator::peak_of(|| read_record_bytes(path, bytes, kind, options));
        let of_form = if is_hdf5(path) { OF_HDF5 } else { 0 };
        assert!(
            peak <= allocator::FILES * bytes.len() + allocator::ANY_FILE + of_form,
            "{peak} bytes of memory for {} of file",
            bytes.len()
        );
        read
    });
    for refused in read.iter().filter_map(|read| read.as_ref().err()) {
        assert!(refused.to_string().starts_with(&*path.to_string_lossy()), "{refused}");
    }
    for record in read.iter().filter_map(|read| read.as_ref().ok()) {
        assert!(record.series.len() >= 8 && record.series.step > 0.0);
        assert!(record.raw.values.iter().all(|value| value.is_finite()), "{:?}", record.raw.values);
    }
    read.iter().filter(|read| read.is_ok()).count()
}

#[test]
fn the_files_are_there_and_are_read_as_they_are() {
    if std::env::var_os("GRANCHAIN_FUZZ_ONLY").is_some() {
        return;
    }
    assert!(FILES.len() > 20);
    let scaled = ReadOptions { scale: Some(Sensitivity::parse("100 mm/s/V").unwrap()), ..ReadOptions::default() };
    let read = FILES
        .iter()
        .filter(|(path, bytes)| try_all(path, bytes, &ReadOptions::default()) + try_all(path, bytes, &scaled) > 0);
    // All but those that need a segment, a function, a channel, a time column or a sample rate named, counts, clocks that contradict each other, complex samples, and keys whose
    // values stand in another file.
    assert_eq!(read.count(), FILES.len() - 22);
}

proptest! {
    #![proptest_config(cases(50_000))]

    #[test]
    fn harmed_files_are_read_or_refused(
        file in any::<prop::sample::Index>(),
        harms in prop::collection::vec(harm(words()), 1..6),
        options in options(),
    ) {
        let (path, bytes) = &FILES[file.index(FILES.len())];
        try_all(path, &harmed(bytes, &harms), &options);
    }

    #[test]
    fn arbitrary_bytes_are_read_or_refused(
        start in prop::sample::select(vec![
            &b""[..], b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff", b"    -1\n    58\n", b"    -1\n    58b     1     2          11",
            b"    -1\n   164\n", b"LECROY,1,Waveform\n", b"Revision:,0\n", b"Record Length,", b"Source File Name:\t", b"#Digilent WaveForms",
            b"X,CH1,Start,Increment,\nSequence,Volt,", b"Record Length,Analog:", b"#timebase=", b"Memory Length,9,\nWaveform Data,\n",
            b"LabVIEW Measurement\t\nX_Columns\tNo\nX_Value\tA\n", b"\"TraceName\",\"CH1\"\n\"HResolution\",1e-6\n",
            b"TDSm\x0e\0\0\0", b"\x93NUMPY\x01\0v\0{'descr': '<f8', 'shape': (", b"RIFF", b"AG10", b"RG03", b"MATLAB 5.0",
            b"WAVEDESC\0\0\0\0\0\0\0\0LECROY_2_3", b"\xa5\xa5\0\0", b"\xa5\xa5\xa4\x01DS", b"\xa5\xa5\x38\0DS2", b"\xa5\xa5\x38\0DS4", b"\x0f\x0f:WFM#003", b"\xf0\xf0:WFM#001", b":WFMPRE:BYT_NR 2;XINCR 1e-6;YMULT 1;:CURVE #3", b"PK\x03\x04",
        ]),
        bytes in prop_oneof![
            prop::collection::vec(any::<u8>(), 0..400),
            prop::collection::vec(prop::sample::select(b"0123456789.,;\t\n\r -+eE\"#[]msVu:/".to_vec()), 0..400),
        ],
        options in options(),
    ) {
        try_all(Path::new("a.csv"), &[start, &bytes].concat(), &options);
    }
}
