//! What could the records behind the published numbers have looked like?
//!
//! Writes `measurements/annulus-73khz/horn_tip.csv` and `vib.csv`: a *reconstruction*, synthesised from the few printed
//! values (73 kHz, 1 µm horn tip, pole velocity +289 and −247 mm/s, lines at 1/3 and 2/3 of the drive and their
//! ultraharmonics). It is no measurement, and no chain model was used: a model fitted to its own output would prove
//! nothing. The pulse train is drawn by hand as smooth pulses that repeat every third drive period. Every number that is
//! not printed is listed as invented in the files' headers.
//!
//! ```text
//! cargo run --release --example reconstruct_annulus [FOLDER]
//! ```
//!
//! The result is the same bytes every time (`tests/record/reader_shipped.rs` compares).

use std::{f64::consts::PI, fmt::Write as _, fs, path::PathBuf};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Printed: drive frequency, Hz.
const DRIVE_FREQUENCY: f64 = 73e3;
/// Printed: peak displacement of the horn tip, µm.
const HORN_PEAK_UM: f64 = 1.0;
/// Printed: largest and smallest velocity of the last bead's pole, mm/s.
const POLE_PEAKS_MM_PER_S: (f64, f64) = (289.0, -247.0);

/// Invented: burst length, drive cycles.
const CYCLES: f64 = 40.0;
/// Invented: time constant of the horn, s.
const RING_UP: f64 = 100e-6;
/// Invented: sampling of both channels, s.
const STEP: f64 = 0.2e-6;
/// Invented: samples before the trigger and in all.
const PRETRIGGER: usize = 250;
const SAMPLES: usize = 4500;
/// Invented: noise of the horn channel (rms) and its resolution, µm.
const HORN_NOISE_UM: f64 = 0.5e-3;
const HORN_RESOLUTION_UM: f64 = 0.5e-3;
/// Invented: noise of the velocity vibrometer (rms), its resolution, mm/s; its bandwidth, Hz; its delay, s.
const POLE_NOISE_MM_PER_S: f64 = 1.0;
const POLE_RESOLUTION_MM_PER_S: f64 = 0.25;
const BANDWIDTH: f64 = 1.5e6;
const DELAY: f64 = 3.0e-6;
/// Invented: time from the start of the burst to the first motion of the last bead, s.
const TRAVEL: f64 = 32e-6;
/// Invented: seed of all noise and jitter.
const SEED: u64 = 73_000;

/// Invented: the pulses of one three-period cycle: instant (drive periods), height (1), width (standard deviation, s).
const PULSES: [(f64, f64, f64); 7] = [
    (0.00, 1.00, 1.7e-6),
    (0.42, -0.62, 2.6e-6),
    (0.86, 0.40, 2.2e-6),
    (1.30, -0.95, 2.4e-6),
    (1.80, 0.62, 1.9e-6),
    (2.22, -0.45, 2.8e-6),
    (2.58, 0.18, 2.4e-6),
];

fn main() -> std::io::Result<()> {
    let folder = std::env::args_os().nth(1).map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/measurements/annulus-73khz")),
        PathBuf::from,
    );
    fs::create_dir_all(&folder)?;
    fs::write(folder.join("horn_tip.csv"), horn_tip())?;
    fs::write(folder.join("vib.csv"), vibrometer())?;
    println!("wrote horn_tip.csv and vib.csv to {}", folder.display());
    Ok(())
}

/// Time of sample `i`, s; 0 is the trigger.
fn time(i: usize) -> f64 {
    (i as f64 - PRETRIGGER as f64) * STEP
}

/// 1 − exp(−t/τ) up to the end of the burst, normalised to 1 there, then exp(−(t − T)/τ).
fn envelope(t: f64) -> f64 {
    let end = CYCLES / DRIVE_FREQUENCY;
    if t <= 0.0 {
        0.0
    } else if t <= end {
        (1.0 - libm::exp(-t / RING_UP)) / (1.0 - libm::exp(-end / RING_UP))
    } else {
        libm::exp(-(t - end) / RING_UP)
    }
}

/// A normal deviate by Box and Muller, the same on every machine.
fn normal(random: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (1.0 - random.random::<f64>(), random.random());
    libm::sqrt(-2.0 * libm::log(u)) * libm::cos(2.0 * PI * v)
}

fn horn_tip() -> String {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut text = header(
        "horn-tip displacement",
        &[
            "drive frequency: 73 kHz",
            "printed: peak displacement 1 um",
            "invented: burst of 40 cycles, starting at the trigger",
            "invented: envelope 1 - exp(-t/100 us), normalised to 1 at the end of the burst, then exp(-t/100 us)",
            "invented: sample interval 0.2 us, 50 us of pre-trigger",
            "invented: white sensor noise of 0.5 nm rms, resolution 0.5 nm",
        ],
        "displacement_um",
    );
    for i in 0..SAMPLES {
        let t = time(i);
        let clean = HORN_PEAK_UM * envelope(t) * libm::sin(2.0 * PI * DRIVE_FREQUENCY * t);
        let seen = clean + HORN_NOISE_UM * normal(&mut random);
        row(&mut text, i, quantised(seen, HORN_RESOLUTION_UM), 4);
    }
    text
}

fn vibrometer() -> String {
    let (positive, negative) = pulse_trains();
    let noise: Vec<f64> = {
        let mut random = ChaCha8Rng::seed_from_u64(SEED + 1);
        let white: Vec<f64> = (0..SAMPLES).map(|_| normal(&mut random)).collect();
        band_limited(&white, POLE_NOISE_MM_PER_S)
    };
    // The heights of the positive and the negative pulses are chosen so that the extremes of the record, noise and
    // resolution included, are the printed ones.
    let record = |up: f64, down: f64| -> Vec<f64> {
        (0..SAMPLES)
            .map(|i| quantised(up * positive[i] + down * negative[i] + noise[i], POLE_RESOLUTION_MM_PER_S))
            .collect()
    };
    let largest = |record: &[f64]| record.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = |record: &[f64]| record.iter().copied().fold(f64::INFINITY, f64::min);
    let (mut up, mut down) = (POLE_PEAKS_MM_PER_S.0, -POLE_PEAKS_MM_PER_S.1);
    for _ in 0..20 {
        up = bisect(|up| largest(&record(up, down)) < POLE_PEAKS_MM_PER_S.0, 0.0, 2000.0);
        down = bisect(|down| smallest(&record(up, down)) > POLE_PEAKS_MM_PER_S.1, 0.0, 2000.0);
    }
    let record = record(up, down);
    assert_eq!((largest(&record), smallest(&record)), POLE_PEAKS_MM_PER_S, "the printed peaks");

    let mut text = header(
        "velocity of the far pole of the last bead",
        &[
            "drive frequency: 73 kHz",
            "bandwidth: 1.5 MHz (invented)",
            "delay: 3 us (invented)",
            "printed: largest value +289 mm/s, smallest -247 mm/s",
            "printed: lines at 1/3 and 2/3 of the drive frequency and their ultraharmonics are present",
            "invented: every amplitude of a line, the shape, height, width and instant of every pulse, their jitter",
            "invented: sample interval 0.2 us, 50 us of pre-trigger, first motion 32 us after the start of the burst",
            "invented: growth and decay of the pulses, and of the part that repeats every third period",
            "invented: white decoder noise of 1 mm/s rms within the bandwidth, resolution 0.25 mm/s",
        ],
        "velocity_mm_per_s",
    );
    for (i, value) in record.iter().enumerate() {
        row(&mut text, i, *value, 2);
    }
    text
}

/// The smallest value above which `too_low` no longer holds.
fn bisect(too_low: impl Fn(f64) -> bool, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if too_low(middle) { low = middle } else { high = middle }
    }
    high
}

/// The positive and the negative pulses of the whole record, each of unit height where the envelope is 1.
///
/// Early in the burst all periods are alike (period one); the differences between the three periods of a cycle grow in
/// over 90 µs and go again when the drive fades. Every pulse scatters a little in height and instant.
fn pulse_trains() -> (Vec<f64>, Vec<f64>) {
    let mut random = ChaCha8Rng::seed_from_u64(SEED + 2);
    let period = 1.0 / DRIVE_FREQUENCY;
    let (mut positive, mut negative) = (vec![0.0; SAMPLES], vec![0.0; SAMPLES]);
    let first = TRAVEL + DELAY + 0.25 * period;
    for cycle in 0..24 {
        for (at, height, width) in PULSES {
            let height = height * (1.0 + 0.025 * normal(&mut random));
            let instant = first + (3.0 * f64::from(cycle) + at) * period + 0.12e-6 * normal(&mut random);
            let drive = envelope(instant - TRAVEL - DELAY);
            // How far the state of period three has taken over from that of period one.
            let grown = 1.0 - libm::exp(-(instant - first) / 90e-6);
            let tripled = grown * (1.0 - libm::exp(-6.0 * drive * drive));
            let alike = if height > 0.0 { 0.55 } else { -0.55 };
            let height = libm::pow(drive, 0.8) * (tripled * height + (1.0 - tripled) * alike * drive);
            let target = if height > 0.0 { &mut positive } else { &mut negative };
            for (i, sum) in target.iter_mut().enumerate() {
                let x = (time(i) - instant) / width;
                if x.abs() < 8.0 {
                    *sum += height * libm::exp(-0.5 * x * x);
                }
            }
        }
    }
    (without_mean_motion(&positive), without_mean_motion(&negative))
}

/// A bead that stays in its place has no mean velocity: take off the running mean over six drive periods, Hann-weighted,
/// which holds nothing of the lines at thirds of the drive and above.
fn without_mean_motion(velocity: &[f64]) -> Vec<f64> {
    let half = 3.0 / (DRIVE_FREQUENCY * STEP);
    let reach = half as i32;
    let weights: Vec<f64> = (-reach..=reach).map(|k| 1.0 + libm::cos(PI * f64::from(k) / half)).collect();
    let total: f64 = weights.iter().sum();
    (0..velocity.len() as i32)
        .map(|i| {
            let near = |k: i32| usize::try_from(i + k).ok().and_then(|at| velocity.get(at)).copied().unwrap_or(0.0);
            let mean: f64 = (-reach..=reach).zip(&weights).map(|(k, weight)| weight * near(k)).sum::<f64>() / total;
            velocity[i as usize] - mean
        })
        .collect()
}

/// White noise through the vibrometer's bandwidth, of the given rms.
fn band_limited(white: &[f64], rms: f64) -> Vec<f64> {
    // A sinc under a Hann window, written out so that the bytes do not depend on any other part of the program.
    let half = 40i32;
    let taps: Vec<f64> = (-half..=half)
        .map(|k| {
            let x = 2.0 * BANDWIDTH * STEP * f64::from(k);
            let sinc = if k == 0 { 1.0 } else { libm::sin(PI * x) / (PI * x) };
            sinc * (0.5 + 0.5 * libm::cos(PI * f64::from(k) / f64::from(half + 1)))
        })
        .collect();
    let gain = libm::sqrt(taps.iter().map(|tap| tap * tap).sum());
    let n = white.len() as i32;
    (0..n)
        .map(|i| {
            let sum: f64 = (-half..=half).zip(&taps).map(|(k, tap)| tap * white[(i + k).rem_euclid(n) as usize]).sum();
            rms * sum / gain
        })
        .collect()
}

fn quantised(value: f64, resolution: f64) -> f64 {
    (value / resolution).round() * resolution
}

fn header(what: &str, lines: &[&str], column: &str) -> String {
    let mut text = format!(
        "# granchain reconstruction: {what}, six 1 mm steel beads on a resin annulus\n\
         # NOT A MEASUREMENT: synthesised from printed values, without any chain model; see PROVENANCE.md\n\
         # made by: cargo run --release --example reconstruct_annulus\n"
    );
    for line in lines {
        text.push_str("# ");
        text.push_str(line);
        text.push('\n');
    }
    text.push_str("time_us,");
    text.push_str(column);
    text.push('\n');
    text
}

fn row(text: &mut String, i: usize, value: f64, digits: usize) {
    // Minus zero would print its sign. Writing to a String cannot fail.
    let value = if value == 0.0 { 0.0 } else { value };
    let _ = writeln!(text, "{:.1},{value:.digits$}", time(i) * 1e6);
}
