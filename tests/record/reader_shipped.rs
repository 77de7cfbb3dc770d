//! The records in `measurements/` are what their example makes, and say what their provenance says.

use std::{path::Path, process::Command};

use granchain::measurement::{ReadOptions, Record, RecordKind, read_record};

fn folder() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("measurements/annulus-73khz")
}

fn horn() -> Record {
    read_record(&folder().join("horn_tip.csv"), RecordKind::HornTip, &ReadOptions::default()).unwrap()
}

fn vib() -> Record {
    read_record(&folder().join("vib.csv"), RecordKind::Vibrometer, &ReadOptions::default()).unwrap()
}

/// Amplitude of a line over whole cycles of three drive periods in the plateau, Hann-weighted.
fn line(record: &Record, frequency: f64) -> f64 {
    let window = record.series.window(200e-6, 200e-6 + 24.0 / 73e3);
    let (mut re, mut im, mut sum) = (0.0, 0.0, 0.0);
    for (i, x) in window.values.iter().enumerate() {
        let weight = 1.0 - (2.0 * std::f64::consts::PI * i as f64 / window.len() as f64).cos();
        let phase = 2.0 * std::f64::consts::PI * frequency * window.time(i);
        re += weight * x * phase.cos();
        im += weight * x * phase.sin();
        sum += weight;
    }
    2.0 * re.hypot(im) / sum
}

#[test]
fn the_example_makes_the_shipped_bytes_again() {
    let here = tempfile::tempdir().unwrap();
    // Examples are built beside the test's own binary.
    let mut example = std::env::current_exe().unwrap();
    example.pop();
    example.pop();
    example.push("examples/reconstruct_annulus");
    let made = if example.exists() {
        Command::new(example).arg(here.path()).output().unwrap()
    } else {
        let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
        Command::new(cargo)
            .args(["run", "--quiet", "--release", "--example", "reconstruct_annulus", "--"])
            .arg(here.path())
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .output()
            .unwrap()
    };
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    for name in ["horn_tip.csv", "vib.csv"] {
        let (shipped, again) =
            (std::fs::read(folder().join(name)).unwrap(), std::fs::read(here.path().join(name)).unwrap());
        assert!(shipped == again, "{name} differs from what its example makes");
    }
}

#[test]
fn the_raw_extremes_of_the_velocity_are_the_printed_ones() {
    let raw = vib().raw.values;
    let largest = raw.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = raw.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((largest - 0.289).abs() < 1e-12 && (smallest + 0.247).abs() < 1e-12, "{largest} {smallest}");
}

#[test]
fn lines_at_thirds_stand_well_above_lines_at_quarters_and_the_half() {
    let vib = vib();
    let at = |ratio: f64| line(&vib, ratio * 73e3);
    for ratio in [1.0 / 3.0, 2.0 / 3.0, 1.0, 4.0 / 3.0, 5.0 / 3.0, 2.0] {
        for other in [0.5, 1.5] {
            assert!(at(ratio) > 5.0 * at(other), "{ratio}: {} {other}: {}", at(ratio), at(other));
        }
    }
}

#[test]
fn the_bead_goes_nowhere_in_the_long_run() {
    let series = vib().series;
    let displacement = granchain::signal::integral(&series);
    // The running mean velocity is zero but for the noise: a walk of 1 mm/s √(0.2 µs · 900 µs) = 13 nm, and the baseline's own
    // error, 1 mm/s/√250 over 900 µs = 60 nm. One drive period moves the bead by some 300 nm.
    assert!(displacement.values.last().unwrap().abs() < 200e-9, "{:?}", displacement.values.last());
}

#[test]
fn the_horn_reaches_a_micrometre_at_73_khz() {
    let horn = horn();
    assert!((horn.series.peak() - 1e-6).abs() < 3e-9, "{}", horn.series.peak()); // noise 0.5 nm
    let found = horn.strongest_line().unwrap();
    assert!((found - 73e3).abs() < 5.0, "{found}"); // 0.5 % of a bin of the 750 µs burst
    assert_eq!(horn.pretrigger, 250);
    assert!((horn.noise_rms / 0.53e-9 - 1.0).abs() < 0.1, "{}", horn.noise_rms); // 0.5 nm and the resolution's 0.14 nm
    assert!(horn.warnings.is_empty() && vib().warnings.is_empty());
}

#[test]
fn the_horn_drives_from_rest_to_rest() {
    let horn = horn();
    let drive = horn.to_drive().unwrap();
    assert_eq!(drive.origin, 0.0);
    assert!(drive.warnings().is_empty(), "{:?}", drive.warnings());
    let drive = drive.displacement;
    assert_eq!((drive.values[0], *drive.values.last().unwrap()), (0.0, 0.0));
    // The burst begins at t = 0 and is not eased in before it.
    assert!(drive.start.abs() < 1e-12, "{}", drive.start);
    // In the burst the drive is the record within the noise that is taken off.
    let record = horn.series.window(20e-6, 800e-6);
    let inside = drive.window(20e-6, 800e-6);
    for (a, b) in record.values.iter().zip(&inside.values) {
        assert!((a - b).abs() < 5.0 * 0.53e-9, "{a} {b}");
    }
}

#[test]
fn delay_and_bandwidth_of_the_header_are_taken() {
    let vib = vib();
    assert_eq!((vib.delay, vib.bandwidth), (3e-6, Some(1.5e6)));
    assert!((vib.series.start + 53e-6).abs() < 1e-12);
    assert_eq!(vib.drive_frequency(), Some(73e3));
}
