//! Other units, a bench of twice the size, a mirror.

use super::{
    FidelityLevel, Limit,
    impact::copy,
    room::{Balance, Ran, Room, difference},
};
use granchain_model::{
    chain::{ChainModel, InitialState},
    contact_law::bead_pair_stiffness,
    scene::Scene,
};

pub(super) fn examine(room: &mut Room<'_>) {
    units(room);
    twice(room);
    if room.fidelity == FidelityLevel::Hertz {
        mirrored(room);
    }
}

/// The same numbers written in other units.
fn units(room: &mut Room<'_>) {
    let which = "other units";
    let run = |sets: &[&str]| room.scene("rigid", sets).and_then(|scene| room.run(&scene));
    let si = ["duration=4e-5", "drive.amplitude=1e-6", "drive.frequency=73000", "chain.radius=5e-4"];
    let named = ["duration=40 us", "drive.amplitude=1000 nm", "drive.frequency=0.073 MHz", "chain.radius=500 um"];
    match run(&si).and_then(|plain| Ok((plain, run(&named)?))) {
        Ok((plain, other)) => {
            let apart = difference(other.last(), plain.last());
            room.check(format!("{which}: difference, rms"), apart, Limit::AtMost(1e-10), "1");
        }
        Err(reason) => room.failed(which, reason),
    }
}

/// Elasticity and contact know no length: velocities stay, times double, forces grow fourfold. Powers of two leave every bit.
fn twice(room: &mut Room<'_>) {
    let which = "twice the size";
    let run = |factor: f64| {
        let mut sets = vec![
            format!("chain.radius={}", 5e-4 * factor),
            format!("drive.amplitude={}", 1e-6 * factor),
            format!("drive.frequency={}", 73e3 / factor),
            format!("duration={}", 6e-5 * factor),
            format!("output_step={}", 1e-7 * factor),
        ];
        match room.fidelity {
            FidelityLevel::Reduced => sets.push(format!("model.step={}", 5e-8 * factor)),
            FidelityLevel::Fea => sets.push(format!("model.step={}", 1e-7 * factor)),
            FidelityLevel::Hertz | FidelityLevel::FiniteBody => {}
        }
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        room.scene("rigid", &sets).and_then(|scene| room.run(&scene))
    };
    match run(1.0).and_then(|plain| Ok((plain, run(2.0)?))) {
        Ok((plain, large)) => {
            let apart = difference(large.last(), plain.last());
            // Decimal numbers of the scene are rounded once, bodies of other lengths are solved with other roundings (1e-13), and the
            // undamped chain magnifies both a thousandfold in 60 µs.
            room.check(format!("{which}: difference of velocities, rms"), apart, Limit::AtMost(1e-8), "1");
            let peak = |ran: &Ran| ran.response.contact_force[0].peak();
            let quadruple = (peak(&large) / peak(&plain) - 4.0).abs();
            room.check(
                format!("{which}: largest force over four times the other, less 1"),
                quadruple,
                Limit::AtMost(1e-8),
                "1",
            );
        }
        Err(reason) => room.failed(which, reason),
    }
}

/// A bead thrown from the left and one from the right, nothing else moving.
fn mirrored(room: &mut Room<'_>) {
    let which = "mirrored";
    let sets = ["drive.amplitude=1e-300", "duration=60 us"];
    let scene = match room.scene("rigid", &sets) {
        Ok(scene) => scene,
        Err(reason) => return room.failed(which, reason),
    };
    let beads = scene.chain.beads.len();
    let thrown = |bead: usize, speed: f64| {
        let mut initial = InitialState::at_rest(beads);
        initial.velocities[bead] = speed;
        ChainModel.run_from(&scene, &initial, &mut |_| true).map_err(|error| error.to_string())
    };
    match thrown(0, 0.1).and_then(|left| Ok((left, thrown(beads - 1, -0.1)?))) {
        Ok((left, right)) => {
            let turned: Vec<f64> = right.bead_velocity[1].values.iter().map(|v| -v).collect();
            let apart = difference(&turned, &left.bead_velocity[beads - 2].values);
            room.check(format!("{which}: difference of velocities, rms"), apart, Limit::AtMost(1e-6), "1");
        }
        Err(reason) => room.failed(which, reason.to_string()),
    }
}

/// α of 10⁻³: half of it halves a pressed chain's answer, and without pressing Hertz' chain is a scaled copy.
pub(super) fn alpha(room: &mut Room<'_>) {
    if room.fidelity == FidelityLevel::Hertz {
        copy(room, "α = 0.001", 1e-6, 1e-3);
    }
    let which = "pressed by 10 N";
    let run = |alpha: f64| -> Result<(Ran, Scene), String> {
        let alpha = format!("alpha={alpha}");
        let scene = room.scene("rigid", &["chain.precompression=10 N", "duration=60 us", &alpha])?;
        Ok((room.run(&scene)?, scene))
    };
    match run(1e-3).and_then(|whole| Ok((whole, run(5e-4)?))) {
        Ok(((whole, scene), (half, _))) => {
            room.sound(which, &whole, Balance::UNDAMPED);
            let doubled: Vec<f64> = half.last().iter().map(|v| 2.0 * v).collect();
            let apart = difference(&doubled, whole.last());
            // Hertz' force is linear but for a quarter of the motion over the static overlap; beads swing by up to ten times the drive.
            let bead = &scene.chain.beads[0];
            let overlap = (scene.chain.precompression / bead_pair_stiffness(bead, bead)).powf(2.0 / 3.0);
            let most = 10.0 * 0.25 * scene.amplitude_scale * scene.drive.amplitude / overlap;
            room.check(
                format!("{which}: twice the answer to α = 0.0005 against α = 0.001, rms"),
                apart,
                Limit::AtMost(most),
                "1",
            );
        }
        Err(reason) => room.failed(which, reason),
    }
}
