//! How do I make records of one bench at several drive levels, to see what fitting them together gains?
//!
//! Writes `measurements/twin-levels/{full,half,quarter}/`: at each level a horn-tip record and the velocity of the last bead that six
//! beads on the annulus answer with, at one α and one c for all, every shot with gaps, noise, offset and trigger of its own. As in
//! `make_synthetic` the velocity is driven by the *recorded* horn motion, because that is what a calibration replays.
//!
//! `cargo run --release --example make_level_twins [-- DIR]`

use std::{error::Error, fmt::Write, fs, path::PathBuf};

use granchain::{
    calibration::synthetic::{horn_tip_csv, vibrometer_csv},
    measurement::{Baseline, ReadOptions, RecordKind, read_record},
    model, scene,
    signal::{Conditioning, Series},
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const ALPHA: f64 = 0.8;
const DAMPING: f64 = 0.25;
const LEVELS: [(&str, f64); 3] = [("full", 1.0), ("half", 0.5), ("quarter", 0.25)];
const SAMPLE_STEP: f64 = 0.4e-6;
const PRE_TRIGGER: f64 = 50e-6;
const HORN_NOISE: f64 = 0.3e-9;
const HORN_OFFSET: f64 = 25e-9;
const VELOCITY_NOISE: f64 = 0.01;
const VELOCITY_OFFSET: f64 = -4e-3;
const LARGEST_DELAY: f64 = 3e-6;
const LARGEST_GAP: f64 = 0.3e-9;

fn main() -> Result<(), Box<dyn Error>> {
    let root = std::env::args().nth(1).map_or_else(|| PathBuf::from("measurements/twin-levels"), PathBuf::from);
    let bench = scene::load("annulus", &["duration=800us".into()])?;
    let samples = ((PRE_TRIGGER + bench.duration) / SAMPLE_STEP).round() as usize;
    let mut given = format!(
        "# What the twins were made with; a calibration of all three records must find it again.\n\
         scene = \"annulus\"\nalpha = {ALPHA}\ndamping = \"{DAMPING} N s/m\"\nnoise_relative = {VELOCITY_NOISE}\n\
         velocity_offset = \"{} mm/s\"\nhorn_offset = \"{:.0} nm\"\n",
        VELOCITY_OFFSET * 1e3,
        HORN_OFFSET * 1e9,
    );
    for (number, (name, level)) in LEVELS.into_iter().enumerate() {
        let folder = root.join(name);
        fs::create_dir_all(&folder)?;
        let mut random = ChaCha8Rng::seed_from_u64(73);
        random.set_stream(number as u64);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut random) };
        let mut scene = bench.clone();
        scene.drive.amplitude *= level;

        let motion = scene.drive.motion(1.0);
        let mut horn = Series::new(-PRE_TRIGGER, SAMPLE_STEP, vec![0.0; samples + 1]);
        for index in 0..=samples {
            horn.values[index] = motion.at(horn.time(index)).0 + HORN_OFFSET + HORN_NOISE * normal();
        }
        let comments = [
            format!(
                "granchain twin: horn-tip displacement, the scene annulus's own tone burst at {level} of its amplitude, with noise and offset"
            ),
            "drive frequency: 73 kHz".to_owned(),
        ];
        let horn_file = folder.join("horn_tip.csv");
        fs::write(&horn_file, horn_tip_csv(&horn, &comments))?;

        let options = ReadOptions { baseline: Baseline::Plateau, ..ReadOptions::default() };
        let drive = read_record(&horn_file, RecordKind::HornTip, &options)?.to_drive()?.displacement;
        let mut truth = scene.clone().with_drive_record(drive, scene.drive.frequency, Some(horn_file));
        truth.amplitude_scale = ALPHA;
        truth.damping.coefficients[scene::DampingTerm::Linear] = DAMPING;
        for gap in &mut truth.chain.gaps {
            *gap = LARGEST_GAP * normal().abs();
        }
        let response = model::run(&truth, &mut |_| true)?;
        let late = LARGEST_DELAY * normal().tanh();
        let lab = Conditioning {
            bandwidth: Some(1e6),
            delay: late,
            invert: false,
            start: -PRE_TRIGGER,
            step: SAMPLE_STEP,
            count: samples + 1,
        };
        let mut velocity = lab.apply(&response.pole_velocity);
        let noise = VELOCITY_NOISE * velocity.peak();
        for value in &mut velocity.values {
            *value += VELOCITY_OFFSET + noise * normal();
        }
        let comments = [
            format!(
                "granchain twin: velocity of the far pole of the last bead at {level} of the drive level, simulated with known truth (truth.toml)"
            ),
            "NOT A MEASUREMENT: made by the model it is meant to test".to_owned(),
            "made by: cargo run --release --example make_level_twins".to_owned(),
            "drive frequency: 73 kHz".to_owned(),
            "bandwidth: 1 MHz".to_owned(),
        ];
        fs::write(folder.join("vib.csv"), vibrometer_csv(&velocity, &comments))?;
        write!(given, "\n[{name}]\ndrive_level = {level}\ntrigger_late = \"{:.2} us\"\n", late * 1e6)?;
    }
    fs::write(root.join("truth.toml"), given)?;
    println!("written to {}", root.display());
    Ok(())
}
