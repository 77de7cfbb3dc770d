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
        ("chunks.h5", &plain, 1e-3, -1e-5, 4e-11),
        ("infiniium.h5", &channel("Waveforms.Channel 2.Channel 2 Data"), -0.1, -1e-5, 1.01e-6),
        ("columns.h5", &columns, 100.0, -1e-5, 1e-12),
        ("matrix-7.3.mat", &channel("1"), 0.1, 0.0, 0.0),
        ("matrix-7.3.mat", &channel("rec.volts_V:2"), -0.1, 0.0, 0.0),
        ("clock.npz", &plain, 1.0, -1e-5, 1e-15),
        ("version-4.mat", &options(), 0.1, -1e-5, 4e-9),
        ("rows.npz", &channel("scope_V:2"), -0.1, -1e-5, 1e-15),
        ("scaled.tdms", &options(), 0.1, -1e-5, 1.01e-6),
        ("scaled.tdms", &channel("horn"), -0.1, -1e-5, 1.01e-6),
        ("segments.tdms", &channel("vibrometer"), 0.1, -1e-5, 0.0),
        ("segments.tdms", &channel("horn"), 0.2, -1e-5, 0.0),
        ("full-scale.wav", &channel("1"), 0.1, 0.0, 1e-8),
        ("full-scale.wav", &channel("2"), -0.1, 0.0, 1e-8),
        ("beside.mat", &options(), 0.1, -1e-5, 1e-15),
        ("units.mat", &options(), 0.1, -1e-5, 1e-15),
        ("units.npz", &options(), 0.1, -1e-5, 1e-15),
        ("doubles.wav", &channel("2"), -0.1, 0.0, 0.0),
        ("long.wav", &channel("1"), 0.1, 0.0, 1.6e-6),
        ("curve-text.isf", &options(), 0.1, -1e-5, 5.1e-7),
        // Half a code: 0.1 V and 0.01 V · 10 a division, of 25 and 7680 codes.
        ("siglent-2.bin", &channel("CH2"), 0.1, -1e-5, 2.01e-4),
        ("siglent-2.bin", &channel("CH4"), -0.1, -1e-5, 2.01e-4),
        ("siglent-4.bin", &options(), 0.1, -1e-5, 6.6e-7),
        ("averaged.trc", &options(), 0.1, -1e-5, 1e-6),
        ("curve.isf", &options(), 0.1, -1e-5, 5.1e-7),
        ("two-channels.bin", &channel("1"), 0.1, -1e-5, 4e-9),
        ("two-channels.bin", &channel("2"), 0.2, -1e-5, 4e-9),
        ("pair.bin", &channel("CH1"), 0.1, -1e-5, 4e-9),
        ("pair.Wfm.bin", &channel("CH3"), -0.1, -1e-5, 4e-9),
        ("tektronix-1.wfm", &options(), 0.1, -1e-5, 5.1e-7),
        // Of one byte: half a step.
        ("tektronix-3.wfm", &options(), 0.1, -1e-5, 1.26e-4),
        ("rigol-e.wfm", &channel("CH2"), 0.1, -1e-5, 2.01e-4),
        ("rigol-b.wfm", &channel("CH2"), 0.1, -1e-5, 2.51e-4),
        ("rigol-b.wfm", &channel("CH4"), -0.1, -1e-5, 2.51e-4),
        ("rigol-2000.wfm", &options(), 0.1, -1e-5, 2.01e-4),
        ("rigol-4000.wfm", &channel("CH1"), 0.1, -1e-5, 2.51e-4),
        ("rigol-4000.wfm", &channel("CH3"), -0.1, -1e-5, 2.51e-4),
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
    assert_eq!(read("pair.bin", &channel("CH1")).averages, 8);
    assert_eq!(read("rigol-2000.wfm", &options()).averages, 32);
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

#[test]
fn a_broken_hdf5_file_is_refused_with_three_lines_of_python() {
    for head in [&b"MATLAB 7.3 MAT-file, Platform: GLNXA64"[..], b"\x89HDF\r\n\x1a\n"] {
        let refused = read_record_bytes(Path::new("a/shot 1.mat"), head, Some(RecordKind::Vibrometer), &options());
        let message = refused.unwrap_err().to_string();
        let lines: Vec<&str> = message.lines().skip(1).map(str::trim).collect();
        assert_eq!(lines.len(), 3, "{message}");
        assert_eq!(lines[1], "file = h5py.File(\"shot 1.mat\")");
        assert!(lines[2].starts_with("numpy.savez(\"shot 1.npz\", **{"), "{message}");
        assert_eq!(message.contains("save(NAME, '-v7')"), head.starts_with(b"MATLAB"), "{message}");
    }
}

#[test]
fn other_versions_of_siglent_are_named_by_their_content() {
    let put = |bytes: &mut Vec<u8>, at: usize, part: &[u8]| bytes[at..at + part.len()].copy_from_slice(part);
    for (version, switches, scale, wide) in [(1u32, 0x00, 0x10, true), (0, 0x100, 0xbc, false)] {
        let mut bytes = vec![0; 6000];
        put(&mut bytes, 0, &version.to_le_bytes());
        put(&mut bytes, switches, &1u32.to_le_bytes());
        let refused = |bytes: &[u8]| {
            read_record_bytes(Path::new("a.bin"), bytes, Some(RecordKind::Vibrometer), &options())
                .unwrap_err()
                .to_string()
        };
        // A channel that is on without a scale is no such file.
        assert!(!refused(&bytes).contains("Siglent"), "{version}");
        if wide {
            put(&mut bytes, scale, &0.5f64.to_le_bytes());
        } else {
            put(&mut bytes, scale, &500f32.to_le_bytes());
        }
        let message = refused(&bytes);
        assert!(message.contains("Siglent file (.bin)") && message.contains("its CSV is read"), "{version}: {message}");
    }
}

#[test]
fn two_clocks_that_contradict_each_other_are_named_and_a_stated_rate_decides() {
    let read = |options: &ReadOptions| read_record(&file("contradiction.npz"), RecordKind::Vibrometer, options);
    let message = read(&options()).unwrap_err().to_string();
    for part in ["`fs`", "`dt`", "0.2 µs", "200 µs", "--sample-rate RATE"] {
        assert!(message.contains(part), "{part}: {message}");
    }
    let attributes =
        read_record(&file("contradiction.h5"), RecordKind::Vibrometer, &options()).unwrap_err().to_string();
    assert!(attributes.contains("`fs`") && attributes.contains("`dt`"), "{attributes}");
    let raw = read(&ReadOptions { sample_rate: Some(5e6), ..options() }).unwrap().raw;
    assert!(raw.len() == 400 && (raw.step / 2e-7 - 1.0).abs() < 1e-12);
}

#[test]
fn samples_that_are_of_another_type_than_their_header_says_are_refused() {
    // Counts where the header says floats: 8 and 16 bits read as 32 make 3e38, or 1e-39.
    let bytes = fs::read(file("two-channels.bin")).unwrap();
    let data = bytes.len() - 1600;
    for count in [0x76u8, 0x80, 0x7e, 0x00] {
        let mut bytes = bytes.clone();
        bytes[data..].iter_mut().enumerate().for_each(|(i, byte)| *byte = count.wrapping_add((i % 2) as u8));
        let refused = read_record_bytes(Path::new("a.bin"), &bytes, Some(RecordKind::Vibrometer), &channel("2"));
        let message = refused.unwrap_err().to_string();
        assert!(
            message.contains("numbers below 9.9e37") || message.contains("at an input between"),
            "{count}: {message}"
        );
    }
}

#[test]
fn complex_samples_of_tektronix_are_refused() {
    let meta = b"\0\0\0\x0d\0\0\0IQ_windowType\x01\x0b\0\0\0Blackharris";
    let bytes = [&fs::read(file("tektronix-3.wfm")).unwrap()[..], meta].concat();
    let refused = read_record_bytes(Path::new("a.wfm"), &bytes, Some(RecordKind::Vibrometer), &options());
    let message = refused.unwrap_err().to_string();
    assert!(message.contains("complex") && message.contains("save the channel itself"), "{message}");
}

#[test]
fn histograms_and_extrema_are_no_records() {
    let of = |name: &str, at: usize, value: u8| {
        let mut bytes = fs::read(file(name)).unwrap();
        bytes[at] = value;
        read_record_bytes(Path::new("a.bin"), &bytes, Some(RecordKind::Vibrometer), &channel("1"))
            .unwrap_err()
            .to_string()
    };
    for (name, at, value, named) in [
        ("averaged.trc", 11 + 316, 5, "complex"),
        ("averaged.trc", 11 + 316, 6, "extrema"),
        ("two-channels.bin", 12 + 4, 4, "histogram"),
    ] {
        let message = of(name, at, value);
        assert!(message.contains(named), "{name}: {message}");
    }
}

#[test]
fn instants_in_a_column_of_an_array_are_proposed_as_time() {
    let error = read_record(&file("volts.npy"), RecordKind::Vibrometer, &options()).unwrap_err();
    assert_eq!(error.remedy().as_deref(), Some("--read time_column=volts:1 --read time_unit=s"));
    let typed = ReadOptions { time_column: Some("volts:1".into()), time_unit: Some("s".into()), ..options() };
    assert!((read("volts.npy", &typed).raw.step / 2e-7 - 1.0).abs() < 1e-9);
    // The instants are no record.
    let untimed = ReadOptions { sample_rate: Some(5e6), ..channel("1") };
    let message = read_record(&file("volts.npy"), RecordKind::Vibrometer, &untimed).unwrap_err().to_string();
    assert!(message.contains("rise or fall evenly"), "{message}");
}

#[test]
fn a_part_of_full_scale_is_a_pressure_by_the_sensitivity_of_the_whole_recorder() {
    let scale = |text: &str| ReadOptions { scale: Sensitivity::parse(text).ok(), ..channel("1") };
    let read = |name: &str, text: &str| read_record(&file(name), RecordKind::Hydrophone, &scale(text));
    let raw = read("doubles.wav", "-176 dB re 1/uPa").unwrap().raw;
    assert!((raw.values[0] - 0.05 * 630.957_344_480_193).abs() < 1e-9, "{}", raw.values[0]);
    // Volts are no parts of full scale.
    let message = read("two-channels.bin", "-176 dB re 1/uPa").unwrap_err().to_string();
    assert!(message.contains("full scale, found the unit `V`"), "{message}");
}

#[test]
fn series_of_rigol_whose_volts_are_unknown_are_named() {
    for (head, named) in [
        (&b"\xa1\xa5\0\0"[..], "DS1000C"),
        (b"\x01\xff\xff\xff\xa6\xa5\x38\0DS1074Z", "DS1000Z"),
        (b"\xa5\xa5\x38\0DS6A000000001", "found `DS6A000000001`"),
        (b"\x02\0\0\0\x01\x02\x03\x04\x09\x0a\0\0\0\0\0\0\x01\x02\x03\x04\x05\x06\0\0\x0b\0\x11\0\x2f\0\x2f\0\x30\0\0\0", "DHO1000"),
    ] {
        let bytes = [head, &[0; 600]].concat();
        let refused = read_record_bytes(Path::new("a.wfm"), &bytes, Some(RecordKind::Vibrometer), &options());
        let message = refused.unwrap_err().to_string();
        assert!(message.contains(named) && message.contains("save the record as"), "{message}");
    }
}

#[test]
fn frames_and_what_is_no_trace_of_tektronix_are_named() {
    let bytes = fs::read(file("tektronix-3.wfm")).unwrap();
    for (at, value, named) in [(72, 4, "found 5 frames"), (122, 6, "data of kind 6"), (9, b'4', "WFM#004")] {
        let mut bytes = bytes.clone();
        bytes[at] = value;
        let refused = read_record_bytes(Path::new("a.wfm"), &bytes, Some(RecordKind::Vibrometer), &options());
        let message = refused.unwrap_err().to_string();
        assert!(message.contains(named) && message.contains("; save the "), "{message}");
    }
    let axis = bytes.windows(2).rposition(|part| part == b"s\0").unwrap();
    let of_spectrum = [&bytes[..axis], b"Hz", &bytes[axis + 2..]].concat();
    let refused = read_record_bytes(Path::new("a.wfm"), &of_spectrum, Some(RecordKind::Vibrometer), &options());
    assert!(refused.unwrap_err().to_string().contains("an axis in `Hz`"));
}

/// Unit of a number's last digit.
fn last_digit(cell: &str) -> f64 {
    let (mantissa, exponent) = cell.split_once(['e', 'E']).unwrap_or((cell, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, digits)| digits.len() as i32);
    10f64.powi(exponent.parse::<i32>().unwrap() - decimals)
}

fn scopes() -> Option<PathBuf> {
    let folder = std::env::var_os("GRANCHAIN_SCOPES").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/public-data/scope-binary"),
        PathBuf::from,
    );
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no {}; name the folder in GRANCHAIN_SCOPES", folder.display());
    None
}

/// Rigol's `.wfm` and the CSV beside it. Where the CSV is the record, every cell agrees to its last digit; where it is what the screen showed later, or
/// another program wrote it with another zero, the difference is known.
#[test]
fn public_rigol_files_agree_with_the_csv_beside_them() {
    let Some(folder) = scopes() else { return };
    // Name, lines above the rows, channels and their columns, samples before the first row, rows that are no samples (bytes of the header, which older
    // converters took for some), steps that the CSV lies higher.
    for (name, above, columns, before, foreign, higher) in [
        ("DS1052E", 16, &[("CH1", 1, 0.04), ("CH2", 2, 0.08)][..], -4, 4, 0.0),
        ("DS1102D-A", 1, &[("CH1", 1, 0.04), ("CH2", 2, 0.08)], -4, 4, 2.0),
        ("DS1204B-F", 2, &[("CH2", 1, 0.4), ("CH4", 2, 0.8)], 0, 0, 0.0),
        ("DS2072A-9", 2, &[("CH2", 1, 0.08)], 0, 0, 0.0),
    ] {
        let text = fs::read_to_string(folder.join(format!("wfm_{name}.csv"))).unwrap();
        let rows: Vec<Vec<&str>> =
            text.lines().skip(above).map(|line| line.split(',').map(str::trim).collect()).collect();
        let rows: Vec<_> = rows.into_iter().filter(|row| !row[0].is_empty()).skip(foreign).collect();
        for &(channel_name, column, step) in columns {
            let record =
                read_record(&folder.join(format!("wfm_{name}.wfm")), RecordKind::Vibrometer, &channel(channel_name));
            let raw = record.unwrap().raw;
            assert!(rows.len() + 4 >= raw.len(), "{name}: {} rows", rows.len());
            for (i, row) in rows.iter().enumerate() {
                let written: f64 = row[column].parse().unwrap();
                let value = 10.0 * raw.values[(i as i64 + before + foreign as i64) as usize] + higher * step;
                assert!(
                    (value - written).abs() <= (0.5001 * last_digit(row[column])).max(1e-12),
                    "{name}:{i}: {value} {written}"
                );
            }
        }
    }
    // Of the screen: some samples beside, other noise.
    for (name, columns, stride, allowed) in [
        ("DS1102E-B", &["CH1"][..], 2, 0.06),
        ("DS1102E-D", &["CH1", "CH2"], 5, 0.02),
        ("DS2072A-5", &["CH1", "CH2"], 10, 0.07),
    ] {
        let text = fs::read_to_string(folder.join(format!("wfm_{name}.csv"))).unwrap();
        for (column, channel_name) in columns.iter().enumerate() {
            let path = folder.join(format!("wfm_{name}.wfm"));
            let raw = read_record(&path, RecordKind::Vibrometer, &channel(channel_name)).unwrap().raw;
            let screen: Vec<f64> = text
                .lines()
                .skip(2)
                .map(|line| line.split(',').nth(column + 1).unwrap().trim().parse().unwrap())
                .collect();
            let first: f64 = match text.lines().nth(2).unwrap().split(',').next().unwrap() {
                // A counter; the start stands above.
                "0" => text.lines().nth(1).unwrap().split(',').nth(1 + columns.len()).unwrap().parse().unwrap(),
                cell => cell.parse().unwrap(),
            };
            let at = ((first - raw.start) / raw.step).round() as i64;
            let (low, high) = screen.iter().fold((f64::MAX, f64::MIN), |(low, high), it| (low.min(*it), high.max(*it)));
            let rms = |shift: i64| {
                let square = |(i, value): (usize, &f64)| {
                    (10.0 * raw.values[(at + shift + (stride * i) as i64).max(0) as usize] - value).powi(2)
                };
                (screen.iter().enumerate().map(square).sum::<f64>() / screen.len() as f64).sqrt()
            };
            let (best, shift) = (-30..=3).map(|shift| (rms(shift), shift)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            println!("{name} {channel_name}: {:.3} of the range, {shift} samples aside", best / (high - low));
            assert!(
                best < allowed * (high - low),
                "{name} {channel_name}: {best} of {low} to {high}, {shift} samples aside"
            );
        }
    }
    // Every other public file of the series is read or named.
    for entry in fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|it| it == "wfm") {
            let outcome = match read_record(&path, RecordKind::Vibrometer, &channel("1")) {
                Ok(record) => {
                    format!("{} samples, every {:e} s from {:e} s", record.raw.len(), record.raw.step, record.raw.start)
                }
                Err(error) => error.to_string(),
            };
            println!("{}: {outcome}", path.file_name().unwrap().display());
            assert!(
                outcome.contains("samples") || outcome.contains("save the record as"),
                "{}: {outcome}",
                path.display()
            );
        }
    }
}

/// Exports of one record as binary and as CSV, and other binaries: repositories that publish them.
#[test]
fn public_exports_agree_with_the_maker_s_own_csv() {
    let Some(folder) = scopes() else { return };
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
                let written: f64 = cell.parse().unwrap();
                assert!((10.0 * record.raw.values[i] - written).abs() <= last_digit(cell), "{name}:{}: {cell}", i + 1);
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
