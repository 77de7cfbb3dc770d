//! Small motions of a precompressed chain.

use std::f64::consts::{PI, TAU};

use super::{
    FidelityLevel, Limit,
    room::{Ran, Room},
    steps::Slope,
};
use granchain_model::{
    analytical::{cutoff_frequency, mode_frequency},
    contact_law::bead_pair_stiffness,
    fea::arrangement::bead_mesh,
};

/// Forces along the chain, N.
const FORCES: [f64; 4] = [1e-6, 1e-2, 1.0, 10.0];

pub(super) fn examine(room: &mut Room<'_>) {
    for force in FORCES {
        let which = format!("{force} N");
        match excess(room, force) {
            Ok((worst, overlap)) => {
                // Hertz' chain moves by a thousandth of its overlap. A finite sphere exceeds Hertz' force by 2.5 % of √(δ/µm) and
                // more (numbers of the finite-body law), half of that in a frequency; elements add a half per cent of their own.
                let most = match room.fidelity {
                    FidelityLevel::Hertz => 1e-4,
                    FidelityLevel::FiniteBody => 0.02 * (overlap / 1e-6).sqrt() + 5e-3,
                    FidelityLevel::Reduced | FidelityLevel::Fea => {
                        0.02 * (overlap / 1e-6).sqrt() + 5e-3 + frozen(room, overlap)
                    }
                };
                let name = format!("{which}: largest deviation of six frequencies from the linear chain’s");
                room.check(name, worst, Limit::AtMost(most), "1");
            }
            Err(reason) if reason.contains("model.mesh_density") => {
                room.refused(&which, reason, "model.mesh_density");
            }
            Err(reason) => room.failed(&which, reason),
        }
    }
}

/// Relative error of a frequency from the edge of a contact that lies between two nodes and does not move with a small vibration: a quarter of
/// their distance over the contact's radius, since the tangent stiffness goes as the radius and the radius is off by half the distance.
fn frozen(room: &Room<'_>, overlap: f64) -> f64 {
    let Ok(scene) = room.scene("rigid", &[]) else { return 0.0 };
    let bead = &scene.chain.beads[0];
    let Ok(mesh) = bead_mesh(bead, &scene) else { return 0.0 };
    let edge = (0.5 * bead.radius * overlap).sqrt();
    let radii: Vec<f64> = mesh
        .boundary("front")
        .map_or(Vec::new(), |front| front.nodes.iter().map(|node| mesh.nodes[*node as usize][0]).collect());
    let around = radii.windows(2).find(|pair| pair[0] <= edge && edge < pair[1]);
    around.map_or(0.0, |pair| 0.25 * (pair[1] - pair[0]) / edge)
}

/// Largest relative deviation of the six frequencies from the linear chain's, and the static overlap of two beads, m.
fn excess(room: &Room<'_>, force: f64) -> Result<(f64, f64), String> {
    let plain = room.scene("rigid", &[])?;
    let bead = &plain.chain.beads[0];
    let stiffness = bead_pair_stiffness(bead, bead);
    let overlap = (force / stiffness).powf(2.0 / 3.0);
    let cutoff = cutoff_frequency(bead.mass(), stiffness, force);
    let beads = plain.chain.beads.len();
    // Twelve periods of the lowest mode: a Hann window tells its neighbours apart, and a parabola its peak to 1e-5.
    let duration = 12.0 / mode_frequency(cutoff, 1, beads);
    let step = plain.model.reduced.step;
    let output = ((1.0 / (16.0 * cutoff)) / (2.0 * step)).floor().max(1.0) * 2.0 * step;
    let sets = [
        format!("chain.precompression={force}"),
        format!("duration={}", (duration / output).ceil() * output),
        format!("output_step={output}"),
    ];
    let scene = room.scene("rigid", &[&sets[0], &sets[1], &sets[2]])?;
    let nudge = Slope { distance: 1e-3 * overlap, time: 0.5 / cutoff };
    let ran = room.run_with(&scene, &nudge)?;
    let deviation = |mode: usize| {
        let hertz = mode_frequency(cutoff, mode, beads);
        (ringing(&ran, mode, hertz, nudge.time) / hertz - 1.0).abs()
    };
    Ok(((1..=beads).map(deviation).fold(0.0, f64::max), overlap))
}

/// Frequency of one mode, Hz: the peak of the spectrum of the beads' velocities on its shape, within 6 % of a guess.
fn ringing(ran: &Ran, mode: usize, guess: f64, after: f64) -> f64 {
    let velocities = &ran.response.bead_velocity;
    let step = velocities[0].step;
    let first = (after / step).ceil() as usize;
    let length = velocities[0].values.len() - first;
    let beads = velocities.len() as f64;
    let shape = |bead: usize| (mode as f64 * PI * (bead as f64 + 0.5) / beads).sin();
    let shape: Vec<f64> = (0..velocities.len()).map(shape).collect();
    let projected: Vec<f64> = (0..length)
        .map(|k| {
            let window = 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / length as f64).cos();
            window * velocities.iter().zip(&shape).map(|(v, weight)| weight * v.values[first + k]).sum::<f64>()
        })
        .collect();
    let level = |frequency: f64| {
        let (mut re, mut im) = (0.0, 0.0);
        for (k, value) in projected.iter().enumerate() {
            let (sin, cos) = (TAU * frequency * step * k as f64).sin_cos();
            (re, im) = (re + value * cos, im + value * sin);
        }
        re.hypot(im).ln()
    };
    let (spread, points) = (0.06, 120);
    let at = |k: i32| guess * (1.0 + spread * f64::from(k) / f64::from(points));
    let best = (-points..=points).max_by(|a, b| level(at(*a)).total_cmp(&level(at(*b)))).unwrap_or(0);
    let [left, middle, right] = [best - 1, best, best + 1].map(|k| level(at(k)));
    let shift = 0.5 * (left - right) / (left - 2.0 * middle + right);
    at(best) + shift * guess * spread / f64::from(points)
}
