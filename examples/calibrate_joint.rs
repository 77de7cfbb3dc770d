//! How do I fit one α and one damping coefficient to records at several drive levels, and see what each of them adds?
//!
//! Three shipped synthetic records of one bench at the full drive level, half of it and a quarter (α = 0.8, c = 0.25 N·s/m, `measurements/twin-levels`).
//!
//! `cargo run --release --example calibrate_joint`

use std::{error::Error, path::Path, sync::Arc};

use granchain::calibration::{Plan, Problem, Schedule, fit::Estimate, plan::RecordPlan};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("measurements/twin-levels");

    // 1. Every record has the horn tip beside it for a drive.
    let record = |level: &str| RecordPlan { measured: folder.join(level).join("vib.csv"), ..RecordPlan::default() };
    let plan = Plan {
        record: ["full", "half", "quarter"].map(record).to_vec(),
        scene: Some("annulus".into()),
        evaluations: Some(300),
        ..Plan::default()
    };
    let problem = Problem::read(&plan)?;

    // 2. Whoever watches is told of the work done and may end it.
    let work = problem.work();
    let watch = Arc::new(move |done| {
        eprint!("\r{done} of {work} runs ");
        true
    });
    let fitted = problem.fit(Schedule { watch, ..Schedule::default() })?;
    eprintln!();

    // 3. All records together, then what each says by itself, from the same runs.
    let fit = &fitted.best().fit;
    println!("together: {}, misfit {:.2}", fit.verdict, fit.misfit);
    show(&fit.estimates);
    for (label, share) in problem.labels().iter().zip(&fit.shares) {
        println!("{label} alone: misfit {:.2}, correlation {:+.2}", share.misfit, share.correlation);
        show(&share.estimates);
    }
    for statement in fitted.outcome(&problem).statements {
        println!("{statement}");
    }
    Ok(())
}

fn show(estimates: &[Estimate]) {
    for estimate in estimates {
        println!("  {:<8} {:.3}, 90 % {:.3} … {:.3}", estimate.name, estimate.value, estimate.low, estimate.high);
    }
}
