//! How far can the chain be trusted? The rigid scene by finite elements, by the chain, and by a chain of stiffer contacts.
//!
//! `cargo run --release --example chain_or_finite_elements`
//!
//! Prints the velocity of the last bead and its distance from the finite elements in three windows. The chain of Hertz contacts lags, for a
//! sphere is stiffer than the half-space that Hertz takes it for; with that one factor on all contacts it follows longer.

use std::error::Error;

use granchain::{
    model::{self, contact_law::FiniteBody},
    scene::{self, ModelKind, Scene},
    signal::{Series, convergence::moving_average},
};

const WINDOWS: [(f64, f64); 3] = [(0.0, 20e-6), (20e-6, 40e-6), (40e-6, 50e-6)];

/// Velocity of the last bead's centre through a moving average of 0.4 µs.
fn velocity(scene: &Scene) -> Result<Series, Box<dyn Error>> {
    let response = model::run(scene, &mut |_| true)?;
    Ok(moving_average(response.bead_velocity.last().ok_or("the scene has no beads")?, 4e-7))
}

/// rms of the difference over the rms of the reference, in a window.
fn distance(found: &Series, reference: &Series, (from, to): (f64, f64)) -> f64 {
    let (found, reference) = (found.window(from, to), reference.window(from, to));
    let sum: f64 = found.values.iter().zip(&reference.values).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / reference.values.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

fn main() -> Result<(), Box<dyn Error>> {
    let overrides = ["model.kind=fea", "model.mesh_density=8", "model.step=0.05 us", "duration=51 us"];
    let finite_elements = scene::load("rigid", &overrides.map(String::from))?;
    let mut chain = finite_elements.clone();
    chain.model.kind = ModelKind::Chain;
    let mut stiffer = chain.clone();
    // Overlaps in the pulse reach 0.75 µm.
    let excess = FiniteBody::BeadsColliding.excess(0.75e-6, chain.chain.beads[0].radius);
    for bead in &mut stiffer.chain.beads {
        bead.material.youngs_modulus *= 1.0 + excess;
    }

    let reference = velocity(&finite_elements)?;
    let fidelities =
        [("chain".to_owned(), velocity(&chain)?), (format!("{:.1} % stiffer", 100.0 * excess), velocity(&stiffer)?)];
    println!("velocity of the last bead, m/s");
    println!("{:>8}{:>18}{:>10}{:>16}", "us", "finite elements", fidelities[0].0, fidelities[1].0);
    for index in (60..500).step_by(20) {
        let time = reference.time(index);
        let [chain, stiffer] = [&fidelities[0].1, &fidelities[1].1].map(|series| series.values[index]);
        println!("{:8.1}{:18.4}{chain:10.4}{stiffer:16.4}", 1e6 * time, reference.values[index]);
    }
    for (name, series) in &fidelities {
        let distances = WINDOWS.map(|window| {
            let (from, to) = window;
            format!("{:.1} % in {:.0}-{:.0} us", 100.0 * distance(series, &reference, window), 1e6 * from, 1e6 * to)
        });
        println!("{name}, distance from the finite elements: {}", distances.join(", "));
    }
    Ok(())
}
