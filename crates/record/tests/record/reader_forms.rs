//! The same record in every form that is understood gives the same numbers.

use std::path::Path;

use granchain_record::{Baseline, MeasurementError, Missing, ReadOptions, Record, RecordKind, read_record_bytes};
use proptest::prelude::*;

const F0: f64 = 73e3;

/// 60 µs of nothing, then a tone burst with a short ring-up: (s, m/s).
fn motion() -> Vec<(f64, f64)> {
    (0..1500)
        .map(|i| {
            let t = (f64::from(i) - 120.0) * 0.5e-6;
            let envelope = if t > 0.0 { 1.0 - (-t / 50e-6).exp() } else { 0.0 };
            (t, 0.2 * envelope * (2.0 * std::f64::consts::PI * F0 * t).sin())
        })
        .collect()
}

fn read(text: &str, kind: RecordKind, options: &ReadOptions) -> Result<Record, MeasurementError> {
    read_record_bytes(Path::new("vib.csv"), text.as_bytes(), Some(kind), options)
}

fn table(header: &str, time: f64, value: f64) -> String {
    let rows: Vec<_> = motion().iter().map(|(t, v)| format!("{},{}", t / time, v / value)).collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

fn assert_same(record: &Record) {
    let motion = motion();
    assert_eq!(record.series.len(), motion.len());
    assert!((record.series.start - motion[0].0).abs() < 1e-12);
    assert!((record.series.step - 0.5e-6).abs() < 1e-15);
    for (value, (_, expected)) in record.series.values.iter().zip(&motion) {
        assert!((value - expected).abs() < 1e-14, "{value} {expected}");
    }
}

#[test]
fn every_form_of_header_gives_the_same_record() {
    for (header, time, value) in [
        ("time_s,velocity_m_per_s", 1.0, 1.0),
        ("time_us,velocity_mm_per_s", 1e-6, 1e-3),
        ("Time (us),Velocity [mm/s]", 1e-6, 1e-3),
        ("Time [µs],Velocity (mm/s)", 1e-6, 1e-3),
        ("Time [μs],Velocity (µm/s)", 1e-6, 1e-6),
        ("t / ms,v / mm/s", 1e-3, 1e-3),
        ("Time,Velocity\nus,mm/s", 1e-6, 1e-3),
        ("Time,Velocity\n(us),(mm/s)", 1e-6, 1e-3),
        ("Time,CH1\ns,m/s", 1.0, 1.0),
        ("# first\n# second\n\"time_s\",\"velocity_m_per_s\"", 1.0, 1.0),
    ] {
        assert_same(&read(&table(header, time, value), RecordKind::Vibrometer, &ReadOptions::default()).unwrap());
    }
}

#[test]
fn byte_order_mark_line_ends_and_blank_lines_do_not_matter() {
    let text = table("time_us,velocity_mm_per_s", 1e-6, 1e-3);
    for text in [
        format!("\u{feff}{text}"),
        text.replace('\n', "\r\n"),
        text.trim_end().to_owned(),
        format!("# a\n\n{text}\n\n"),
        text.replacen("\n", "\n# between\n", 3),
    ] {
        assert_same(&read(&text, RecordKind::Vibrometer, &ReadOptions::default()).unwrap());
    }
}

#[test]
fn lines_are_counted_through_comments_blank_lines_and_carriage_returns() {
    for end in ["\n", "\r\n"] {
        let lines = ["# one", "", "time_us,velocity_mm_per_s", "# four", "0,1", "", "1,2", "# eight", "2,oops", "3,4"];
        let message = read(&lines.join(end), RecordKind::Vibrometer, &ReadOptions::default()).unwrap_err().to_string();
        assert!(message.starts_with("vib.csv:9: column `velocity_mm_per_s`"), "{message}");
    }
}

#[test]
fn flags_give_units_and_columns() {
    let flags = |time: &str, value: &str| ReadOptions {
        time_unit: Some(time.into()),
        unit: Some(value.into()),
        ..ReadOptions::default()
    };
    assert_same(&read(&table("a,b", 1e-6, 1e-3), RecordKind::Vibrometer, &flags("us", "mm/s")).unwrap());
    assert_same(&read(&table("time,velocity", 1e-6, 1e-3), RecordKind::Vibrometer, &flags("us", "mm/s")).unwrap());
    // No header at all.
    let bare = table("", 1e-6, 1e-3);
    assert_same(&read(bare.trim_start(), RecordKind::Vibrometer, &flags("us", "mm/s")).unwrap());
    // A chosen column among several, by header, by name and by number.
    let rows: Vec<_> = motion().iter().map(|(t, v)| format!("{t},9,{v}")).collect();
    let three = format!("time_s,left_m_per_s,right_m_per_s\n{}\n", rows.join("\n"));
    for column in ["right_m_per_s", "RIGHT", "3"] {
        let options = ReadOptions { column: Some(column.into()), ..ReadOptions::default() };
        assert_same(&read(&three, RecordKind::Vibrometer, &options).unwrap());
    }
}

#[test]
fn sign_baseline_delay_and_trigger_are_undone() {
    // The lab's axis starts at 0, the head looks the other way, the vibrometer is 4 µs late and has an offset.
    let rows: Vec<_> = motion().iter().map(|(t, v)| format!("{},{}", t + 60e-6 + 4e-6, 0.013 - v)).collect();
    let text = format!("time_s,velocity_m_per_s\n{}\n", rows.join("\n"));
    let options = ReadOptions {
        invert: true,
        delay: Some(4e-6),
        trigger: Some(60e-6),
        drive_frequency: Some(F0),
        ..ReadOptions::default()
    };
    let record = read(&text, RecordKind::Vibrometer, &options).unwrap();
    assert_same(&record);
    assert!((record.baseline - 0.013).abs() < 1e-15);
    assert_eq!(record.noise_rms, 0.0);
    // Told in the header instead.
    let stated = text.replacen("time_s", "# delay: 4 us\n# trigger: 60 us\ntime_s", 1);
    let options = ReadOptions { invert: true, ..ReadOptions::default() };
    assert_same(&read(&stated, RecordKind::Vibrometer, &options).unwrap());
    // None is removed on demand.
    let options = ReadOptions { baseline: Baseline::None, ..options };
    let record = read(&stated, RecordKind::Vibrometer, &options).unwrap();
    assert!((record.series.values[0] + 0.013).abs() < 1e-15);
}

#[test]
fn noise_is_estimated_from_the_pretrigger() {
    let rows: Vec<_> = motion()
        .iter()
        .enumerate()
        .map(|(i, (t, v))| format!("{t},{}", v + if i % 2 == 0 { 0.002 } else { -0.002 }))
        .collect();
    let text = format!("time_s,velocity_m_per_s\n{}\n", rows.join("\n"));
    let record = read(&text, RecordKind::Vibrometer, &ReadOptions::default()).unwrap();
    assert_eq!(record.pretrigger, 120);
    assert!((record.noise_rms - 0.002).abs() < 1e-12 && record.baseline.abs() < 1e-12);
}

#[test]
fn missing_cells_are_bridged_on_demand() {
    let text = table("time_s,velocity_m_per_s", 1.0, 1.0);
    let holed: Vec<_> = text
        .lines()
        .enumerate()
        .map(|(i, line)| match i {
            50 | 51 | 900 => format!("{},n/a", line.split_once(',').unwrap().0),
            _ => line.to_owned(),
        })
        .collect();
    let options = ReadOptions { missing: Missing::Interpolate, ..ReadOptions::default() };
    let record = read(&holed.join("\n"), RecordKind::Vibrometer, &options).unwrap();
    assert_eq!(record.interpolated, 3);
    let (before, at, after) = (record.series.values[898], record.series.values[899], record.series.values[900]);
    assert!((at - 0.5 * (before + after)).abs() < 1e-15);
}

#[test]
fn a_horn_s_velocity_is_integrated_with_its_drift_removed() {
    let omega = 2.0 * std::f64::consts::PI * F0;
    // A burst of displacement with its exact velocity, on an offset of 1 mm/s that would drift by 0.9 µm.
    let burst = |t: f64| {
        let (tau, end) = (60e-6, 500e-6);
        let (e, slope) = if t < 0.0 {
            (0.0, 0.0)
        } else if t < end {
            (1.0 - (-t / tau).exp(), (-t / tau).exp() / tau)
        } else {
            let top = 1.0 - f64::exp(-end / tau);
            (top * (-(t - end) / tau).exp(), -top / tau * (-(t - end) / tau).exp())
        };
        let (s, c) = (omega * t).sin_cos();
        (1e-6 * e * s, 1e-6 * (slope * s + omega * e * c))
    };
    let times: Vec<f64> = (0..4500).map(|i| f64::from(i) * 0.2e-6 - 50e-6).collect();
    let rows: Vec<_> = times.iter().map(|&t| format!("{:.1},{:.9}", t * 1e6, burst(t).1 * 1e3 + 1.0)).collect();
    let text = format!("time_us,velocity_mm_per_s\n{}\n", rows.join("\n"));
    for baseline in [Baseline::Auto, Baseline::None, Baseline::Plateau] {
        let options = ReadOptions { baseline, ..ReadOptions::default() };
        let record = read(&text, RecordKind::HornTip, &options).unwrap();
        assert!((record.drive_frequency().unwrap() - F0).abs() < 20.0);
        // Up to four periods from the end, where it is still ringing: 1e-3 of the peak, of the burst's abrupt end.
        for (i, value) in record.series.values.iter().enumerate().take(4200) {
            let expected = burst(record.series.time(i)).0;
            assert!((value - expected).abs() < 1.5e-9, "{baseline:?} {i}: {value:e} {expected:e}");
        }
    }
}

#[test]
fn clipping_is_suspected() {
    let rows: Vec<_> = motion().iter().map(|(t, v)| format!("{t},{:.4}", v.clamp(-0.15, 0.15))).collect();
    let text = format!("time_s,velocity_m_per_s\n{}\n", rows.join("\n"));
    let record = read(&text, RecordKind::Vibrometer, &ReadOptions::default()).unwrap();
    assert_eq!(record.warnings.len(), 2, "{:?}", record.warnings);
    assert!(record.warnings[0].starts_with("the largest value occurs in"), "{:?}", record.warnings);
}

proptest! {
    /// What is written in full precision comes back as it was.
    #[test]
    fn a_written_record_is_read_back(
        values in proptest::collection::vec(-1e3..1e3f64, 8..200),
        start in -1e3..1e3f64,
    ) {
        let rows: Vec<_> = values.iter().enumerate().map(|(i, v)| format!("{:e},{v:e}", start + i as f64 * 0.25)).collect();
        let text = format!("time_s,velocity_m_per_s\n{}\n", rows.join("\n"));
        let options = ReadOptions { baseline: Baseline::None, ..ReadOptions::default() };
        let record = read(&text, RecordKind::Vibrometer, &options).unwrap();
        prop_assert_eq!(&record.series.values, &values);
        prop_assert!((record.series.step - 0.25).abs() < 1e-9);
    }
}
