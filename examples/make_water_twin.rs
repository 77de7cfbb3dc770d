//! How do I make a horn-tip and a hydrophone record whose truth I know, to try the calibration on a pressure?
//!
//! Writes `measurements/twin-water/`: a horn-tip record of a 30-cycle burst, and the pressure on the axis 1 mm behind a disc that six beads
//! push at α = 0.45, c = 0.4 N·s/m and a supported rim, in millivolts of a hydrophone of 250 nV/Pa, both with noise and offsets. The beads
//! are driven by the *recorded* horn motion, noise and all, because that is what a calibration replays, and the run has half the step.
//!
//! `cargo run --release --example make_water_twin [-- DIR]`

use std::{error::Error, fs, path::PathBuf};

use granchain::{
    calibration::{
        engine::trace,
        synthetic::{horn_tip_csv, hydrophone_csv},
    },
    feature::Measurand,
    measurement::{Baseline, ReadOptions, RecordKind, read_record},
    model, scene,
    signal::{Conditioning, Series},
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const ALPHA: f64 = 0.45;
const DAMPING: f64 = 0.4;
const MOUNT: &str = "supported";
const SAMPLE_STEP: f64 = 0.2e-6;
const PRE_TRIGGER: f64 = 30e-6;
const HORN_NOISE: f64 = 0.3e-9;
const HORN_OFFSET: f64 = 25e-9;
const PRESSURE_NOISE: f64 = 0.01;
const PRESSURE_OFFSET: f64 = 300.0;
const TRIGGER_LATE: f64 = 2.3e-6;
const LARGEST_GAP: f64 = 0.3e-9;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("measurements/twin-water"), PathBuf::from);
    fs::create_dir_all(&folder)?;
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut normal = move || -> f64 { StandardNormal.sample(&mut random) };
    let settings = [&format!("disc.rim={MOUNT}"), "model.step=12.5ns", "output_step=25ns"].map(String::from);
    let scene = scene::load("water", &settings)?;

    let motion = scene.drive.motion(1.0);
    let samples = ((PRE_TRIGGER + scene.duration) / SAMPLE_STEP).round() as usize;
    let mut horn = Series::new(-PRE_TRIGGER, SAMPLE_STEP, vec![0.0; samples + 1]);
    for index in 0..=samples {
        horn.values[index] = motion.at(horn.time(index)).0 + HORN_OFFSET + HORN_NOISE * normal();
    }
    let comments = [
        "granchain twin: horn-tip displacement, the scene water's own burst with noise and offset".to_owned(),
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
    let pressure_metrics = trace(model::run(&truth, &mut |_| true)?, Measurand::Pressure)?;
    let lab = Conditioning {
        bandwidth: Some(2e6),
        delay: TRIGGER_LATE,
        invert: false,
        start: -PRE_TRIGGER,
        step: SAMPLE_STEP,
        count: samples + 1,
    };
    let mut pressure = lab.apply(&pressure_metrics);
    let noise = PRESSURE_NOISE * pressure.peak();
    for value in &mut pressure.values {
        *value += PRESSURE_OFFSET + noise * normal();
    }
    let comments = [
        "granchain twin: pressure on the axis 1 mm behind the disc, simulated with known truth (truth.toml)".to_owned(),
        "NOT A MEASUREMENT: made by the model it is meant to test".to_owned(),
        "made by: cargo run --release --example make_water_twin".to_owned(),
        "drive frequency: 73 kHz".to_owned(),
        "bandwidth: 2 MHz".to_owned(),
    ];
    fs::write(folder.join("hydrophone.csv"), hydrophone_csv(&pressure, &comments))?;
    let given = format!(
        "# What the twin was made with; a calibration of hydrophone.csv must find it again.\n\
         scene = \"water\"\nalpha = {ALPHA}\ndamping = \"{DAMPING} N s/m\"\nmount = \"{MOUNT}\"\nnoise_relative = {PRESSURE_NOISE}\n\
         pressure_offset = \"{} Pa\"\nhorn_offset = \"{:.0} nm\"\ntrigger_late = \"{:.1} us\"\n",
        PRESSURE_OFFSET,
        HORN_OFFSET * 1e9,
        TRIGGER_LATE * 1e6,
    );
    fs::write(folder.join("truth.toml"), given)?;
    println!("written to {}", folder.display());
    Ok(())
}
