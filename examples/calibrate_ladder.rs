//! How do I fit the reduced model to my record from a program, and see what it changes against the chain alone?
//!
//! The chain searches, the reduced model answers: both fits come out, and the numbers of `calibration.json`. The record is the shipped synthetic record of
//! known truth (α = 0.7, c = 0.6 N·s/m), made by the chain, so the reduced model, on a coarse mesh here, need not agree with it.
//!
//! `cargo run --release --example calibrate_ladder`

use std::{error::Error, path::Path};

use granchain::{
    calibration::{Plan, Problem, Schedule, fit::Fit},
    study::predicted::Predictions,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("measurements/twin-annulus");

    // 1. What is fitted to what. The horn-tip record beside the record drives it; a scene that names no model is fitted by the ladder.
    let plan = Plan {
        measured: Some(folder.join("vib.csv")),
        scene: Some("annulus".into()),
        set: ["model.kind=reduced", "model.mesh_density=3", "model.modes=0", "model.step=0.2us"]
            .map(String::from)
            .to_vec(),
        evaluations: Some(200),
        ..Plan::default()
    };
    let problem = Problem::read(&plan)?;
    for assumption in &problem.assumptions {
        println!("assumed: {assumption}");
    }

    // 2. Two hundred runs of the chain, some hundred pairs with the reduced model.
    let fitted = problem.fit(Schedule::default())?;
    let best = fitted.best();
    if let Some(below) = &best.fit.below {
        show("chain", &below.fit);
    }
    show(problem.model(), &best.fit);

    // 3. The answer run accurately and held against the record.
    let outcome = Predictions::of(&problem, &fitted, None, std::sync::Arc::new(|_| true)).outcome(&problem, &fitted);
    let peak = &outcome.best.features["positive_peak"];
    println!("positive peak: record {:?}, model {:?} ± {:?} m/s", peak.measured, peak.simulated, peak.scatter);
    for statement in &outcome.statements {
        println!("{statement}");
    }
    Ok(())
}

fn show(model: &str, fit: &Fit) {
    println!("{model}: {} after {} runs, misfit {:.2}", fit.verdict, fit.runs.len(), fit.misfit);
    for estimate in &fit.estimates {
        println!("  {:<8} {:.3}, 90 % {:.3} … {:.3}", estimate.name, estimate.value, estimate.low, estimate.high);
    }
}
