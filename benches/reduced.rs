//! Cost of the reduced model at its default setting, one thread, in CPU seconds.
//!
//! - `cargo bench --bench reduced`: bodies made and read from a cache, the built-in scenes `rigid` (120 µs) and `annulus` (700 µs), alone and
//!   side by side; the
//!   finite element analysis on the same meshes with the same step for a tenth of `rigid`; exit code 1 where the ratio falls below 50

use std::{process::ExitCode, time::Instant};

use granchain::{
    model::{
        self,
        fea::{Control, Simulation},
        reduced::Cache,
    },
    scene::{self, DampingTerm, ModelKind, Scene},
};

/// Required ratio of the finite element analysis' time a step to the reduced model's, on the same mesh with the same step.
const REQUIRED: f64 = 50.0;
/// Rounds of each timing.
const ROUNDS: usize = 5;
/// Bodies read from the cache in one timing.
const READS: u32 = 50;

/// Time this thread spent on a processor, s: other programs on the machine do not count. Only Linux tells; elsewhere the clock on the wall.
fn processor_time(start: Instant) -> f64 {
    let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|line| line.split_whitespace().next().and_then(|word| word.parse::<f64>().ok()));
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |nanoseconds| 1e-9 * nanoseconds)
}

/// Least time of several rounds, s, and the last result.
fn fastest<T>(mut work: impl FnMut() -> T) -> (f64, T) {
    let clock = Instant::now();
    let mut timed = || {
        let start = processor_time(clock);
        let result = work();
        (processor_time(clock) - start, result)
    };
    let (mut least, mut result) = timed();
    for _ in 1..ROUNDS {
        let (time, next) = timed();
        (least, result) = (least.min(time), next);
    }
    (least, result)
}

fn load(name: &str) -> Scene {
    scene::load(name, &["model.kind=reduced".into()]).expect("the built-in scene loads")
}

/// Sixteen runs as a calibration makes them: drive, damping and gaps about those of the scene.
fn varied(scene: &Scene) -> Vec<Scene> {
    let copy = |index: usize| {
        let (mut scene, share) = (scene.clone(), index as f64 / 16.0);
        scene.amplitude_scale *= 0.95 + 0.1 * share;
        scene.damping.coefficients[DampingTerm::Linear] *= 0.9 + 0.2 * ((7 * index) % 16) as f64 / 16.0;
        for (contact, gap) in scene.chain.gaps.iter_mut().enumerate() {
            *gap = 3e-10 * ((contact + 3 * index) % 5) as f64 / 5.0;
        }
        scene
    };
    (0..16).map(copy).collect()
}

fn main() -> ExitCode {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let cache = Cache::new(folder.path());
    println!("reduced model, default setting, one thread, fastest of {ROUNDS}, CPU time");
    println!("scene     steps   bodies made   from cache       run   us/step   side by side, a run   wanted");
    let mut per_step = 0.0;
    for (name, wanted) in [("rigid", "60 ms"), ("annulus", "500 ms")] {
        let scene = load(name);
        let (cold, prepared) = fastest(|| model::prepare(&scene).expect("the bodies are made"));
        model::prepare_with(&scene, Some(&cache)).expect("the bodies are kept");
        // Many at once: a processor's time is told in ticks of milliseconds.
        let (warm, ()) = fastest(|| {
            for _ in 0..READS {
                model::prepare_with(&scene, Some(&cache)).expect("the bodies are read");
            }
        });
        let warm = warm / f64::from(READS);
        let (run, response) = fastest(|| prepared.run(&scene, &mut |_| true).expect("the scene runs"));
        let copies = varied(&scene);
        let (together, _) = fastest(|| prepared.traces(&copies, &|| true));
        let together = together / copies.len() as f64;
        let steps = response.work.steps;
        let each = run / steps as f64;
        if name == "rigid" {
            per_step = each;
        }
        println!(
            "{name:8} {steps:6} {:10.0} ms {:9.1} ms {:6.0} ms {:9.2} {:15.1} ms   at most {wanted}",
            1e3 * cold,
            1e3 * warm,
            1e3 * run,
            1e6 * each,
            1e3 * together
        );
    }
    let mut full = load("rigid");
    full.model.kind = ModelKind::Fea;
    full.model.fea.density = full.model.reduced.density;
    full.model.fea.step = full.model.reduced.step;
    full.duration *= 0.1;
    let mut simulation = Simulation::new(&full, Control::default()).expect("the scene is meshed and factored");
    let clock = Instant::now();
    let start = processor_time(clock);
    let mut steps = 0_u32;
    while !simulation.is_done() {
        simulation.advance().expect("the scene runs");
        steps += 1;
    }
    let each = (processor_time(clock) - start) / f64::from(steps);
    let ratio = each / per_step;
    println!(
        "finite element analysis, same mesh and step: {:.2} ms a step, {ratio:.0} times as long; required {REQUIRED}",
        1e3 * each
    );
    if ratio >= REQUIRED { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
