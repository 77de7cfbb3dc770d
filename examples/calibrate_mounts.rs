//! How is my disc held? Three mounts compete for one hydrophone's record.
//!
//! The record is the shipped synthetic record of a supported disc (α = 0.45, c = 0.4 N·s/m, `measurements/twin-water`), read here by the program itself, as
//! one would read a record that does not come from a file.
//!
//! `cargo run --release --example calibrate_mounts`

use std::{error::Error, fs, path::Path};

use granchain::{
    calibration::{
        Plan, Problem, Schedule,
        bench::Bench,
        drive::RecordedDrive,
        recorded_run::{RecordedRunPlan, Source},
    },
    feature::Measurand,
    measurement::{ReadOptions, RecordKind, read_record_bytes},
    scene::ModelKind,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("measurements/twin-water");
    let options = ReadOptions::default();

    // 1. The bench: a scene by name, driven by the horn tip as it was recorded.
    let (horn, how) = (folder.join("horn_tip.csv"), (RecordedDrive::read_at_plateau as _, &options));
    let bench = Bench::read("water", vec![], ModelKind::Chain, Some(&horn), how)?;

    // 2. The record.
    let path = folder.join("hydrophone.csv");
    let record = read_record_bytes(&path, &fs::read(&path)?, Some(RecordKind::Hydrophone), &options)?;
    let recorded_run =
        RecordedRunPlan { source: Source::Record(Box::new(record), Box::default()), bench, origin: None };

    // 3. Clamped, supported and free, each fitted with few runs.
    let mounts = ["clamped", "supported", "free"].map(String::from).to_vec();
    let plan =
        Plan { quantity: Some(Measurand::Pressure), mount: Some(mounts), evaluations: Some(200), ..Plan::default() };
    let problem = Problem::of(&plan, vec![recorded_run])?;
    let fitted = problem.fit(Schedule::default())?;
    for other in &fitted.candidates {
        let (name, fit) = (other.candidate.name(), &other.fit);
        println!("{name}: {}, misfit {:.2}, ln evidence {:.1}", fit.verdict, fit.misfit, fit.log_evidence);
    }
    for (candidate, reason) in &fitted.excluded {
        println!("{}: {reason}", candidate.name());
    }
    println!("preferred: {}", fitted.preferred_mount().unwrap_or_default());
    for estimate in &fitted.best().fit.estimates {
        println!("  {:<8} {:.3}, 90 % {:.3} … {:.3}", estimate.name, estimate.value, estimate.low, estimate.high);
    }
    Ok(())
}
