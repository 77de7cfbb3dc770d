//! How do I make a pair of records whose truth I know, to try the calibration on?
//!
//! Writes `measurements/twin-annulus/`: a horn-tip record and the velocity of the last bead that six beads on the annulus
//! answer with at α = 0.7 and c = 0.6 N·s/m, both with noise and offsets, as a lab would store them. The velocity is driven
//! by the *recorded* horn motion, noise and all, because that is what a calibration replays.
//!
//! `cargo run --release --example make_twin [-- DIR [MODEL]]`, MODEL one of chain, reduced, fea

use std::{error::Error, fs, path::PathBuf};

use granchain::{
    calibration::synthetic::{horn_tip_csv, vibrometer_csv},
    measurement::{Baseline, ReadOptions, RecordKind, read_record},
    model, scene,
    signal::{Conditioning, Series},
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const ALPHA: f64 = 0.7;
const DAMPING: f64 = 0.6;
const SAMPLE_STEP: f64 = 0.2e-6;
const PRE_TRIGGER: f64 = 50e-6;
const HORN_NOISE: f64 = 0.3e-9;
const HORN_OFFSET: f64 = 25e-9;
const VELOCITY_NOISE: f64 = 0.01;
const VELOCITY_OFFSET: f64 = -4e-3;
const TRIGGER_LATE: f64 = 3.7e-6;
const LARGEST_GAP: f64 = 0.3e-9;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("measurements/twin-annulus"), PathBuf::from);
    fs::create_dir_all(&folder)?;
    let mut random = ChaCha8Rng::seed_from_u64(73);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut random) };
    let model = std::env::args().nth(2).unwrap_or_else(|| "chain".into());
    let scene = scene::load("annulus", &["duration=800us".into(), format!("model.kind={model}")])?;

    let motion = scene.drive.motion(1.0);
    let samples = ((PRE_TRIGGER + scene.duration) / SAMPLE_STEP).round() as usize;
    let mut horn = Series::new(-PRE_TRIGGER, SAMPLE_STEP, vec![0.0; samples + 1]);
    for index in 0..=samples {
        horn.values[index] = motion.at(horn.time(index)).0 + HORN_OFFSET + HORN_NOISE * normal();
    }
    let comments = [
        "granchain twin: horn-tip displacement, the scene annulus's own tone burst with noise and offset".to_owned(),
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
    let lab = Conditioning {
        bandwidth: Some(1.5e6),
        delay: TRIGGER_LATE,
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
        "granchain twin: velocity of the far pole of the last bead, simulated with known truth (truth.toml)".to_owned(),
        "NOT A MEASUREMENT: made by the model it is meant to test".to_owned(),
        "made by: cargo run --release --example make_twin".to_owned(),
        "drive frequency: 73 kHz".to_owned(),
        "bandwidth: 1.5 MHz".to_owned(),
    ];
    fs::write(folder.join("vib.csv"), vibrometer_csv(&velocity, &comments))?;
    let given = format!(
        "# What the twin was made with; a calibration of vib.csv must find it again.\n\
         scene = \"annulus\"\nalpha = {ALPHA}\ndamping = \"{DAMPING} N s/m\"\nnoise_relative = {VELOCITY_NOISE}\n\
         velocity_offset = \"{} mm/s\"\nhorn_offset = \"{:.0} nm\"\ntrigger_late = \"{:.1} us\"\n",
        VELOCITY_OFFSET * 1e3,
        HORN_OFFSET * 1e9,
        TRIGGER_LATE * 1e6,
    );
    fs::write(folder.join("truth.toml"), given)?;
    println!("written to {}", folder.display());
    Ok(())
}
