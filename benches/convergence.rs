//! Self-convergence of the contact finite element analysis on the rigid scene: errors against a refined run, observed orders, cost.
//!
//! `cargo bench --bench convergence` (two minutes). Watched is the velocity of the last bead's centre through a moving average of 0.4 µs, which
//! removes the undamped vibration that coarse samples alias.

use granchain::{
    model, scene,
    signal::{
        Series,
        convergence::{error, moving_average, observed_order},
    },
};

/// Windows of time, s.
const WINDOWS: [(f64, f64); 3] = [(0.0, 30e-6), (30e-6, 60e-6), (60e-6, 70e-6)];
const DENSITIES: [u32; 3] = [8, 12, 16];
const STEPS: [f64; 3] = [1e-7, 5e-8, 2e-8];

/// Filtered velocity, and what the run cost: unknowns and steps.
fn run(density: u32, step: f64) -> (Series, [u64; 2]) {
    let mut scene = scene::load("rigid", &["model.kind=fea".into()]).expect("a built-in scene");
    (scene.model.fea.density, scene.model.fea.step, scene.output_step) = (density, step, step);
    scene.duration = 70.4e-6;
    let response = model::run(&scene, &mut |_| true).expect("the run ends");
    let velocity = response.bead_velocity.last().expect("the chain has beads");
    let work = &response.work;
    (moving_average(velocity, 4e-7), [work.unknowns, work.steps])
}

fn main() {
    let (reference, _) = run(16, 1e-8);
    println!("density  step µs  unknowns  steps  error in each window");
    let mut runs = Vec::new();
    for density in DENSITIES {
        for step in STEPS {
            let (velocity, [unknowns, steps]) = run(density, step);
            let errors = WINDOWS.map(|window| format!("{:.4}", error(&velocity, &reference, window)));
            println!("{density:>7}{:>9.3}{unknowns:>10}{steps:>7}  {}", 1e6 * step, errors.join("  "));
            runs.push((density, step, velocity));
        }
    }
    let order = |family: Vec<&(u32, f64, Series)>, sizes: [f64; 3]| {
        let distance = |index: usize| error(&family[index].2, &family[2].2, WINDOWS[0]);
        observed_order(sizes, [distance(0), distance(1)])
    };
    let in_step = order(runs.iter().filter(|run| run.0 == DENSITIES[2]).collect(), STEPS);
    let in_mesh =
        order(runs.iter().filter(|run| run.1 == STEPS[2]).collect(), DENSITIES.map(|density| 1.0 / f64::from(density)));
    println!("observed order in the first window: step {in_step:?}, mesh {in_mesh:?}");
}
