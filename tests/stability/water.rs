//! Soft and stiff discs, a dashpot and a static force at the disc, half the water, a long ringing.

use super::{
    FidelityLevel, Limit,
    room::{Balance, Ran, Room, difference},
};

pub(super) fn examine(room: &mut Room<'_>) {
    let duration = if room.fidelity == FidelityLevel::Fea { "duration=50 us" } else { "duration=150 us" };
    let of = |modulus: &str| format!("materials.vitreous-carbon.youngs_modulus={modulus}");
    let (soft, stiff) = (of("0.35 GPa"), of("3500 GPa"));
    for (which, sets) in [
        ("disc a hundred times softer", [soft.as_str(), "damping.at=beads"]),
        ("disc a hundred times stiffer", [stiff.as_str(), "damping.at=beads"]),
        ("disc a hundred times softer, dashpot there", [soft.as_str(), "damping.at=all"]),
        ("disc a hundred times stiffer, dashpot there", [stiff.as_str(), "damping.at=all"]),
        ("overdamped dashpot at the disc", ["damping.at=all", "damping.coefficient=30 N s/m"]),
        ("pressed by 1 N", ["damping.at=all", "chain.precompression=1 N"]),
    ] {
        match room.scene("water", &[&sets[..], &[duration]].concat()).and_then(|scene| room.run(&scene)) {
            Ok(ran) => room.sound(which, &ran, Balance::WATER),
            Err(reason) => room.failed(which, reason),
        }
    }
    // A whole drive of elements, and 400,000 steps: the chain's.
    if room.fidelity == FidelityLevel::Hertz {
        half(room);
        long(room);
    }
}

fn pressure(ran: &Ran) -> &[f64] {
    ran.response.disc.as_ref().and_then(|disc| disc.pressure.first()).map_or(&[], |pressure| &pressure.values)
}

/// A hemisphere of half the radius: its boundary is visible in the pressure if it reflects.
fn half(room: &mut Room<'_>) {
    let which = "half the water";
    let run = |radius: &str| {
        let radius = format!("water.mesh_radius={radius}");
        let sets =
            ["water.method=elements", "drive.amplitude=0.5 um", "damping.at=beads", "duration=120 us", radius.as_str()];
        room.scene("water", &sets).and_then(|scene| room.run(&scene))
    };
    match run("2.5 mm").and_then(|whole| Ok((whole, run("1.25 mm")?))) {
        Ok((whole, half)) => {
            room.sound(which, &half, Balance::WATER);
            let apart = difference(pressure(&half), pressure(&whole));
            room.check(format!("{which}: difference of the pressure, rms"), apart, Limit::AtMost(0.02), "1");
        }
        Err(reason) => room.failed(which, reason),
    }
}

/// Undamped beads on a clamped disc: the water is the only loss.
fn long(room: &mut Room<'_>) {
    let which = "10 ms, undamped beads";
    let sets = ["damping.kind=none", "drive.amplitude=0.5 um", "duration=10 ms", "output_step=1 us"];
    match room.scene("water", &sets).and_then(|scene| room.run(&scene)) {
        Ok(ran) => {
            room.sound(which, &ran, Balance::WATER);
            let energy = ran.response.energy;
            let held = (energy.kinetic_j + energy.stored_j + energy.disc_j.unwrap_or(0.0)) / energy.piston_work_j;
            room.check(format!("{which}: energy left over the piston’s work"), held, Limit::AtMost(1.0), "1");
            let ratio = energy.water_j.unwrap_or(0.0) / energy.piston_work_j;
            room.check(format!("{which}: radiated over the piston’s work"), ratio, Limit::AtLeast(0.1), "1");
        }
        Err(reason) => room.failed(which, reason),
    }
}
