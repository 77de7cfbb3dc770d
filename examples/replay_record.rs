//! What does the chain do when my horn-tip record drives it, and what would my vibrometer have shown?
//!
//! The library's pipeline without the command line: read a horn-tip record, let it drive the annulus scene, pass the pole
//! velocity through the laboratory's own vibrometer and sample instants, and measure record and simulation with the same
//! functions over the same window.
//!
//! ```text
//! cargo run --release --example replay_record [FOLDER]
//! ```
//!
//! FOLDER holds `horn_tip.csv` and `vib.csv`; the shipped reconstruction (no measurement) is taken without it.

use std::{error::Error, path::PathBuf};

use granchain::{
    feature::{FeatureSettings, Features, Ratio, Window, measure},
    measurement::{Baseline, ReadOptions, RecordKind, read_record},
    model, scene,
    signal::Conditioning,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/measurements/annulus-73khz")),
        PathBuf::from,
    );

    // 1. What was recorded. An offset of the horn is a gap to the chain, so its baseline comes from the plateau.
    let plateau = ReadOptions { baseline: Baseline::Plateau, ..ReadOptions::default() };
    let horn = read_record(&folder.join("horn_tip.csv"), RecordKind::HornTip, &plateau)?;
    let frequency = horn.drive_frequency().ok_or("the horn-tip record does not tell its drive frequency")?;
    let seen = read_record(&folder.join("vib.csv"), RecordKind::Vibrometer, &ReadOptions::default())?;
    for assumption in horn.assumptions.iter().chain(&seen.assumptions) {
        println!("assumed: {assumption}");
    }

    // 2. The scene, driven by the record in place of its own tone burst.
    let drive = horn.to_drive()?;
    println!("assumed: {}", drive.statement());
    let origin = drive.origin;
    let mut scene = scene::load("annulus", &["alpha=0.5".into()])?;
    scene.duration = drive.recorded_until;
    let scene = scene.with_continued_record(drive.displacement, drive.recorded_until, vec![], frequency, None);

    // 3. One accurate run.
    let response = model::run(&scene, &mut |_| true)?;
    println!("{} steps, {} contact events", response.work.steps, response.work.events);

    // 4. As the laboratory would have seen it: its bandwidth, its instants (the reader has taken out the vibrometer's delay).
    // The model's time 0 is `origin` on the records' axis.
    let conditioning = Conditioning { bandwidth: seen.bandwidth, delay: origin, ..Conditioning::onto(&seen.series) };
    let simulated = conditioning.apply(&response.pole_velocity);

    // 5. The same features of both, where the drive's envelope exceeds half its peak.
    let window = Window::of_drive(&horn.series, frequency)?;
    let settings = FeatureSettings::velocity(frequency, window);
    let noisy = FeatureSettings { noise_rms: seen.noise_rms, noise_bandwidth: seen.bandwidth, ..settings.clone() };
    let (recorded, simulated) = (measure(&seen.series, &noisy)?, measure(&simulated, &settings)?);
    println!("                    record   simulated");
    println!("positive peak {:>7.0} mm/s {:>6.0} mm/s", recorded.peaks.positive * 1e3, simulated.peaks.positive * 1e3);
    println!("negative peak {:>7.0} mm/s {:>6.0} mm/s", recorded.peaks.negative * 1e3, simulated.peaks.negative * 1e3);
    for ratio in ["1/3", "1/2", "2/3"] {
        println!("A({ratio})/A(1)    {:>12} {:>11}", relative(&recorded, ratio)?, relative(&simulated, ratio)?);
    }
    Ok(())
}

/// Amplitude of a line over the drive's, with a sign that it is only an upper bound.
fn relative(features: &Features, ratio: &str) -> Result<String, Box<dyn Error>> {
    let line = features.line(ratio.parse::<Ratio>()?).ok_or("a line beyond the record's band")?;
    Ok(format!("{}{:.3}", if line.below_noise_floor { "< " } else { "" }, line.relative))
}
