//! The chain under the drive made of a record answers as under the motion that was recorded.

use std::{fmt::Write as _, path::Path};

use granchain::{
    measurement::{ReadOptions, RecordKind, read_record_bytes},
    model,
    scene::{self, Scene},
    signal::{Conditioning, Series},
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const F0: f64 = 73e3;

/// The scene whose own drive is the truth.
fn scene(drive: &[&str]) -> Scene {
    let mut sets: Vec<String> = [
        "model.kind=chain",
        "damping.kind=kuwabara-kono",
        "damping.coefficient=3660 N s/m^1.5",
        "duration=120 us",
        "alpha=0.6",
    ]
    .map(String::from)
    .into();
    sets.extend(drive.iter().map(|set| (*set).to_owned()));
    scene::load("rigid", &sets).unwrap()
}

/// Samples of the scene's own drive, `rate` a cycle from `from` cycles on, with noise of σ relative to the peak and bits over 1.25 times the peak.
fn text(scene: &Scene, from: f64, rate: f64, trigger: f64, noise: f64, bits: Option<u32>, velocity: bool) -> String {
    let motion = scene.drive.motion(1.0);
    let peak = scene.drive.amplitude * if velocity { std::f64::consts::TAU * F0 } else { 1.0 };
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut text = format!(
        "# drive frequency: 73 kHz\ntime_ns,{}\n",
        if velocity { "velocity_um_per_s" } else { "displacement_nm" }
    );
    for i in 0..(60.0 * rate) as usize {
        let cycles = from + i as f64 / rate;
        let at = motion.at(cycles / F0);
        let drawn: f64 = StandardNormal.sample(&mut random);
        let mut value = if velocity { at.1 } else { at.0 } / peak + noise * drawn;
        if let Some(bits) = bits {
            let step = 2.5 / f64::from(1u32 << bits);
            value = (value / step).round() * step;
        }
        let unit = if velocity { 1e6 } else { 1e9 };
        writeln!(text, "{:.6},{:.7}", 1e9 * (cycles - trigger) / F0, unit * peak * value).unwrap();
    }
    text
}

/// Largest distance of the poles' velocities over 40 µs after first motion, over the truth's peak there.
fn error(scene: &Scene, text: &str, trigger: f64) -> f64 {
    let truth = model::run(scene, &mut |_| true).unwrap().pole_velocity;
    let record =
        read_record_bytes(Path::new("horn.csv"), text.as_bytes(), Some(RecordKind::HornTip), &ReadOptions::default())
            .unwrap();
    let drive = record.to_drive().unwrap();
    let mut driven = scene.clone();
    // Model time of the truth's 0.
    let shift = -trigger / F0 - drive.origin;
    driven.duration = scene.duration + (shift / scene.output_step).ceil().max(0.0) * scene.output_step;
    let driven = driven.with_continued_record(drive.displacement, drive.recorded_until, vec![], F0, None);
    let found = model::run(&driven, &mut |_| true).unwrap().pole_velocity;
    let count = (40e-6 / truth.step).round() as usize + 1;
    let onto = Conditioning { bandwidth: None, delay: 0.0, invert: false, start: shift, step: truth.step, count };
    let found = onto.apply(&found);
    let window = Series::new(0.0, truth.step, truth.values[..count].to_vec());
    let worst = window.values.iter().zip(&found.values).fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs()));
    worst / window.peak()
}

#[test]
fn the_first_forty_microseconds_are_those_of_the_motion_that_was_recorded() {
    let drives: [(&str, &[&str]); 3] = [
        ("sine", &["drive.kind=sine", "drive.cycles=40"]),
        ("ring-up of 100 µs", &["drive.kind=tone-burst", "drive.cycles=40", "drive.ring_up=100 us"]),
        ("Gaussian", &["drive.kind=gaussian-burst", "drive.cycles=30"]),
    ];
    let rate = 5e6 / F0;
    for (name, sets) in drives {
        let scene = scene(sets);
        for (case, from, rate, trigger, noise, bits, velocity, most) in [
            ("30 us before", -2.2, rate, 0.0, 0.0, None, false, 0.02),
            ("triggered 6.3 cycles late", -2.2, rate, 6.3, 0.0, None, false, 0.02),
            ("begins with the burst", 0.0, rate, 0.0, 0.0, None, false, 0.02),
            ("begins 0.6 of a sample into it", 0.6 / rate, rate, 0.0, 0.0, None, false, 0.02),
            ("16 samples a cycle", -2.21, 16.0, 0.0, 0.0, None, false, 0.02),
            ("200 samples a cycle", -2.21, 200.0, 0.0, 0.0, None, false, 0.02),
            ("velocity", -2.2, rate, 0.0, 0.0, None, true, 0.02),
            ("velocity, 0.3 %", -2.2, rate, 0.0, 3e-3, None, true, 0.3),
            ("12 bits", -2.2, rate, 0.0, 0.0, Some(12), false, 0.05),
            ("8 bits", -2.2, rate, 0.0, 0.0, Some(8), false, 0.3),
            ("0.1 %", -2.2, rate, 0.0, 1e-3, None, false, 0.15),
            ("1 %", -2.2, rate, 0.0, 1e-2, None, false, 1.0),
        ] {
            let found = error(&scene, &text(&scene, from, rate, trigger, noise, bits, velocity), trigger);
            // Of an envelope that begins in the noise the first impulses are as weak as that.
            println!("{name}, {case}: {:.2} %", 100.0 * found);
            assert!(found < most, "{name}, {case}: {found}");
        }
    }
}

#[test]
fn half_a_period_eased_in_would_be_seen() {
    let scene = scene(&["drive.kind=sine", "drive.cycles=40"]);
    let truth = model::run(&scene, &mut |_| true).unwrap().pole_velocity;
    let text = text(&scene, 0.0, 5e6 / F0, 0.0, 0.0, None, false);
    let record =
        read_record_bytes(Path::new("horn.csv"), text.as_bytes(), Some(RecordKind::HornTip), &ReadOptions::default())
            .unwrap();
    let mut drive = record.to_drive().unwrap().displacement;
    for i in 0..drive.len() {
        let part = (2.0 * F0 * drive.time(i)).min(1.0);
        drive.values[i] *= 0.5 - 0.5 * (std::f64::consts::PI * part).cos();
    }
    let found = model::run(&scene.with_drive_record(drive, F0, None), &mut |_| true).unwrap().pole_velocity;
    let count = (40e-6 / truth.step) as usize;
    let peak = truth.values[..count].iter().fold(0.0, |peak, x| f64::max(peak, x.abs()));
    let worst =
        truth.values[..count].iter().zip(&found.values).fold(0.0, |worst, (a, b)| f64::max(worst, (a - b).abs()));
    println!("eased over half a period: {:.0} %", 100.0 * worst / peak);
    assert!(worst > 0.2 * peak, "{}", worst / peak);
}
