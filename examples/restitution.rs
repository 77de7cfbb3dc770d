//! How much of its speed does a bead keep in a collision, and which damper says so?
//!
//! Two steel beads collide freely at relative speeds from 0.01 to 3 m/s. A linear dashpot, F = c δ̇, loses more the *slower*
//! the collision: its force does not vanish with the overlap. A Kuwabara–Kono one, F = γ √δ δ̇, loses more the *faster* it
//! is, as viscoelastic beads do. So a coefficient fitted at one drive level means another restitution at every other.
//! `tension` lets the dashpot pull while the beads part; `clipped` does not.
//!
//! ```text
//! cargo run --release --example restitution
//! ```

use std::error::Error;

use granchain::{
    model::chain::{ChainModel, InitialState},
    scene,
};

/// The source paper's coefficients.
const LINEAR: &str = "damping.coefficient=0.3 N s/m";
const KUWABARA_KONO: &str = "damping.coefficient=3660 N s m^-3/2";

fn main() -> Result<(), Box<dyn Error>> {
    println!("coefficient of restitution, two 1 mm steel beads");
    println!("speed m/s   linear 0.3, clipped   linear 0.3, tension   Kuwabara–Kono 3660, clipped");
    for speed in [0.01, 0.03, 0.1, 0.3, 1.0, 3.0] {
        println!(
            "{speed:>9} {:>21.6} {:>21.6} {:>29.6}",
            restitution(speed, &["damping.kind=linear", LINEAR])?,
            restitution(speed, &["damping.kind=linear", LINEAR, "damping.tension=true"])?,
            restitution(speed, &["damping.kind=kuwabara-kono", KUWABARA_KONO])?,
        );
    }
    Ok(())
}

/// Relative speed after over before a free collision of two beads at `speed` (m/s).
fn restitution(speed: f64, damping: &[&str]) -> Result<f64, Box<dyn Error>> {
    let overrides: Vec<String> = ["chain.beads=2"].iter().chain(damping).map(|text| (*text).to_owned()).collect();
    let mut scene = scene::load("chain", &overrides)?;
    // Neither piston nor wall.
    scene.chain.gaps = vec![f64::INFINITY, 0.0, f64::INFINITY];
    // A collision lasts a few µs at 1 m/s and grows with v^(−1/5); nothing happens after it.
    scene.duration = 100e-6;
    let initial = InitialState { displacements: vec![0.0; 2], velocities: vec![speed, 0.0] };
    let response = ChainModel.run_from(&scene, &initial, &mut |_| true)?;
    let after = |bead: usize| response.bead_velocity[bead].values.last().copied().unwrap_or(f64::NAN);
    Ok((after(1) - after(0)) / speed)
}
