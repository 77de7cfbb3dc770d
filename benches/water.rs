//! Cost of disc and water under the force of a driven chain, one thread, in CPU seconds.
//!
//! - `cargo bench --bench water`: the water scene (six beads, 3.96 µm, 450 µs, steps of 25 ns) by the Rayleigh integral
//!   and by acoustic elements of sides 0.1, 0.05 and 0.025 mm; exit code 1 where the first takes more than 0.5 s or the
//!   elements at 0.05 mm more than 5 s, setup apart

use std::{process::ExitCode, time::Instant};

use granchain::{
    model::{
        self,
        water::{
            OnWater, Water,
            disc::{Disc, DiscMesh, DiscShape, Rim},
            elements::{Baffle, DiscOnWater, DiscOnWaterSettings, WaterMesh},
            rayleigh::{field::FieldPoint, motion::WetDisc},
        },
    },
    scene::{Material, load},
};

/// Seconds at most: the Rayleigh way, and the elements of 0.05 mm.
const REQUIRED: [f64; 2] = [0.5, 5.0];
const STEP: f64 = 25e-9;
const DURATION: f64 = 450e-6;
const PATCH: f64 = 60e-6;
const AXIS: FieldPoint = FieldPoint { radius: 0.0, distance: 1e-3 };

/// Time this thread spent on a processor, s: other programs on the machine do not count. Only Linux tells; elsewhere the clock on the wall.
fn processor_time(start: Instant) -> f64 {
    let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|line| line.split_whitespace().next().and_then(|word| word.parse::<f64>().ok()));
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |nanoseconds| 1e-9 * nanoseconds)
}

fn disc() -> Disc {
    let shape =
        DiscShape { radius: 1e-3, thickness: 0.25e-3, material: Material::vitreous_carbon(), rim: Rim::Clamped };
    Disc::new(&shape, &DiscMesh::default()).expect("the disc is meshed")
}

/// Force of the last bead on the disc at every step, N.
fn force() -> Vec<f64> {
    let scene = load("water", &["damping.at=beads".into(), "output_step=25 ns".into()]).expect("the scene is built in");
    let mut response = model::run(&scene, &mut |_| true).expect("the scene runs");
    response.contact_force.pop().map_or_else(Vec::new, |force| force.values)
}

/// Seconds of one run.
fn timed(clock: Instant, force: &[f64], on_water: &mut dyn OnWater) -> f64 {
    let start = processor_time(clock);
    for force in &force[1..] {
        on_water.predict();
        on_water.push(*force);
        std::hint::black_box(on_water.pressure(0));
    }
    processor_time(clock) - start
}

fn main() -> ExitCode {
    let (clock, force) = (Instant::now(), force());
    println!("water scene, 450 us at 25 ns (18,000 steps), one thread, CPU time");
    println!("way                unknowns    factor     setup       run   us/step   wanted");
    let line = |way: &str, size: &str, factor: &str, setup: f64, run: f64, wanted: &str| {
        println!(
            "{way:18} {size:>8} {factor:>9} {setup:7.2} s {run:7.2} s {:9.1}   {wanted}",
            run / DURATION * STEP * 1e6
        );
    };
    let start = processor_time(clock);
    let basis = disc().basis(4, PATCH).expect("the disc has modes");
    let mut modal = WetDisc::new(1e-3, &basis, &Water::fresh(), &[AXIS], STEP).expect("the point lies in the water");
    let setup = processor_time(clock) - start;
    let rayleigh = timed(clock, &force, &mut modal);
    line("Rayleigh", "8", "", setup, rayleigh, "at most 0.5 s");
    let mut elements = f64::INFINITY;
    for side in [0.1e-3, 0.05e-3, 0.025e-3] {
        let start = processor_time(clock);
        let settings = DiscOnWaterSettings {
            water: Water::fresh(),
            baffle: Baffle::Rigid,
            mesh: WaterMesh { side, ..WaterMesh::default() },
            points: vec![AXIS],
            patch: PATCH,
            step: STEP,
        };
        let mut meshed = DiscOnWater::new(disc(), &settings).expect("disc and water are factored");
        let setup = processor_time(clock) - start;
        let run = timed(clock, &force, &mut meshed);
        let (solid, fluid, factor) = meshed.size();
        let wanted = if side == 0.05e-3 { "at most 5 s" } else { "" };
        line(&format!("elements {side:.1e} m"), &(solid + fluid).to_string(), &factor.to_string(), setup, run, wanted);
        if side == 0.05e-3 {
            elements = run;
        }
    }
    if rayleigh <= REQUIRED[0] && elements <= REQUIRED[1] { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
