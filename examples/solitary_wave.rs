//! How fast does a pulse travel along an uncompressed chain, and how does that depend on its amplitude?
//!
//! The first of 50 steel beads is struck at five speeds; behind the transient the pulse is a solitary wave. Its speed, from
//! the instants at which the velocities of beads 20 and 40 peak, is held against the closed form
//! V = 2a κ (k/m)^(2/5) v_m^(1/5) with κ of the discrete chain and of Nesterenko's continuum, v_m being the peak velocity
//! of a bead. There is no speed of sound: each tenfold amplitude makes the pulse 10^(1/5) = 1.585 times as fast.
//!
//! ```text
//! cargo run --release --example solitary_wave
//! ```

use std::error::Error;

use granchain::{
    model::{
        analytical::{DISCRETE_SPEED_FACTOR, NESTERENKO_SPEED_FACTOR, solitary_wave_speed},
        chain::{ChainModel, InitialState},
        contact_law::bead_pair_stiffness,
    },
    scene,
};

const BEADS: usize = 50;
/// Beads (from 1) between which the speed is measured: far from both ends.
const STATIONS: (usize, usize) = (20, 40);

fn main() -> Result<(), Box<dyn Error>> {
    println!("striker m/s   peak m/s   speed m/s   discrete   Nesterenko   difference to discrete");
    let mut first: Option<(f64, f64)> = None;
    let mut last = (0.0, 0.0);
    for striker in [0.01, 0.03, 0.1, 0.3, 1.0] {
        let (peak, speed, closed_form) = pulse(striker)?;
        println!(
            "{striker:>11} {peak:>10.5} {speed:>11.4} {:>10.4} {:>12.4} {:>24.1e}",
            closed_form(DISCRETE_SPEED_FACTOR),
            closed_form(NESTERENKO_SPEED_FACTOR),
            speed / closed_form(DISCRETE_SPEED_FACTOR) - 1.0
        );
        first.get_or_insert((peak, speed));
        last = (peak, speed);
    }
    if let Some(first) = first {
        let exponent = (last.1 / first.1).ln() / (last.0 / first.0).ln();
        println!("speed ∝ peak velocity to the power {exponent:.6}; theory 0.2");
    }
    Ok(())
}

/// Peak velocity (m/s) and speed (m/s) of the pulse behind a striker, and the closed form as a function of κ.
#[allow(clippy::type_complexity)] // one example: naming the tuple would hide what it holds
fn pulse(striker: f64) -> Result<(f64, f64, impl Fn(f64) -> f64), Box<dyn Error>> {
    let mut scene = scene::load("chain", &[format!("chain.beads={BEADS}")])?;
    let bead = scene.chain.beads[0].clone();
    let (radius, mass, stiffness) = (bead.radius, bead.mass(), bead_pair_stiffness(&bead, &bead));
    let closed_form = move |factor, peak| solitary_wave_speed(factor, radius, mass, stiffness, peak);
    // No piston: a gap without end in front of the first bead.
    scene.chain.gaps[0] = f64::INFINITY;
    // Time enough to pass the second station, not to come back from the wall.
    scene.duration = 2.0 * radius * (STATIONS.1 + 4) as f64 / closed_form(DISCRETE_SPEED_FACTOR, 0.6 * striker);
    let mut initial = InitialState::at_rest(BEADS);
    initial.velocities[0] = striker;
    let motion = scene.drive.motion(0.0);
    let run = ChainModel.trajectory(&scene, motion.as_ref(), &initial, &mut |_| true)?;
    let (start, _) = run.maximum_velocity(STATIONS.0 - 1, 0.0, run.end());
    let (end, peak) = run.maximum_velocity(STATIONS.1 - 1, 0.0, run.end());
    let speed = 2.0 * radius * (STATIONS.1 - STATIONS.0) as f64 / (end - start);
    Ok((peak, speed, move |factor| closed_form(factor, peak)))
}
