//! A horn, a bead guide and contacts that yield, where each is hardest.

use super::{
    FidelityLevel, Limit,
    room::{Balance, Ran, Room},
};

/// Friction: beads that come to rest, stick and turn, thousands of times.
pub(super) fn friction(room: &mut Room<'_>) {
    for (which, force) in
        [("weak friction", "1 uN"), ("friction", "20 mN"), ("friction as large as the contacts\u{2019} forces", "2 N")]
    {
        let force = format!("holder.friction_force={force}");
        if let Some(ran) = run(room, which, &[&force, "duration=300 us", "damping.kind=none"]) {
            let lost = ran.response.energy.channels.map_or(0.0, |channels| channels.friction_j);
            room.lost(which, lost, &ran);
        }
    }
    let oblique = ["holder.clearance=40 um", "holder.friction_coefficient=0.5", "duration=200 us", "damping.kind=none"];
    run(room, "beads that rub with what the contacts push them aside", &oblique);
}

/// Contacts that yield, chatter and yield again.
pub(super) fn yielding(room: &mut Room<'_>) {
    // Wax keeps 1 % of the work that it is given: its energy balance closes on the scale of what it keeps at a tenth of the default tolerance.
    for (which, strength, tolerance) in [
        ("hard", "3 GPa", "1e-10"),
        ("soft", "100 MPa", "1e-10"),
        ("as soft as wax, tolerance 1e-11", "1 MPa", "1e-11"),
    ] {
        let strength = format!("contact.yield_strength={strength}");
        let tolerance = format!("model.tolerance={tolerance}");
        if let Some(ran) = run(room, which, &[&strength, &tolerance, "duration=300 us", "damping.kind=none", "alpha=2"])
        {
            let lost = ran.response.energy.channels.map_or(0.0, |channels| channels.yielding_j);
            room.lost(which, lost, &ran);
        }
    }
}

/// A horn of high Q, of hardly a mass, and of so much that nothing moves it.
pub(super) fn horn(room: &mut Room<'_>) {
    for (which, mass, quality) in [
        ("Q of 1000", "1 mg", "1000"),
        ("a tip of a tenth of a bead", "0.4 mg", "30"),
        ("hardly a resonance", "10 mg", "0.6"),
    ] {
        let (mass, quality) = (format!("horn.mass={mass}"), format!("horn.quality={quality}"));
        if let Some(ran) = run(room, which, &[&mass, &quality, "duration=300 us"]) {
            let energy = ran.response.energy;
            let open = energy.channels.map_or(f64::NAN, |channels| channels.horn_residual(energy.piston_work_j));
            let scale = energy.largest_j.max(energy.piston_work_j.abs());
            let most = if room.fidelity == FidelityLevel::Hertz { 1e-5 } else { 2e-2 };
            room.check(
                format!("{which}: energy balance of the horn over the largest energy"),
                (open / scale).abs(),
                Limit::AtMost(most),
                "1",
            );
        }
    }
}

fn run(room: &mut Room<'_>, which: &str, sets: &[&str]) -> Option<Ran> {
    match room.scene("annulus", sets).and_then(|scene| room.run(&scene)) {
        Ok(ran) => {
            room.sound(which, &ran, Balance::DAMPED);
            Some(ran)
        }
        Err(reason) => {
            room.failed(which, reason);
            None
        }
    }
}
