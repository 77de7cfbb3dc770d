//! An undamped, unpressed chain long after its drive.

use super::{
    FidelityLevel, Limit,
    room::{Balance, Room},
};

pub(super) fn examine(room: &mut Room<'_>) {
    let durations: &[f64] = match (room.fidelity, room.plan.quick) {
        (FidelityLevel::Fea, true) => &[1e-4, 2e-4],
        (FidelityLevel::Fea, false) => &[1e-4, 3e-4, 1e-3],
        (FidelityLevel::Reduced, true) => &[1e-4, 3e-4, 1e-3],
        _ => &[1e-4, 3e-4, 1e-3, 3e-3, 1e-2],
    };
    let mut curve = Vec::new();
    for (index, &duration) in durations.iter().enumerate() {
        let which = format!("{} ms", 1e3 * duration);
        let sets = [format!("duration={duration}"), "output_step=1 us".to_owned()];
        let ran = room.scene("rigid", &[&sets[0], &sets[1]]).and_then(|scene| room.run(&scene));
        let ran = match ran {
            Ok(ran) => ran,
            Err(reason) => return room.failed(&which, reason),
        };
        let energy = ran.response.energy;
        curve.push((duration, (energy.residual_j / energy.largest_j).abs().max(1e-16)));
        if index + 1 == durations.len() {
            room.sound(&which, &ran, Balance::UNDAMPED);
            let openings: usize = ran.response.contact_force.iter().map(|force| openings(&force.values)).sum();
            // Of seven contacts, each a few times a period of the drive; seen on the output's grid.
            let least = (2e5 * duration).floor();
            let name = format!("{which}: openings of contacts");
            room.check(name, openings as f64, Limit::AtLeast(least), "1");
        }
    }
    let name = room.fidelity.name();
    room.curve(name, curve);
    if room.fidelity == FidelityLevel::Fea && !room.plan.quick {
        long(room);
    }
}

/// All nodes over 10 ms: by the trapezoid the ringing of the bodies makes energy at the contacts in the end, which must be seen; a little
/// numerical dissipation keeps it down.
fn long(room: &mut Room<'_>) {
    let sets = ["duration=10 ms", "output_step=1 us"];
    let ran = |room: &Room<'_>, more: &[&str]| {
        let all: Vec<&str> = sets.iter().chain(more).copied().collect();
        room.scene("rigid", &all).and_then(|scene| room.run(&scene))
    };
    match ran(room, &[]) {
        Ok(ran) => room.sound("10 ms", &ran, Balance::UNDAMPED),
        Err(reason) => room.refused("10 ms, trapezoid", reason, "model.integrator"),
    }
    match ran(room, &["model.integrator=hht", "model.numerical_dissipation=0.05"]) {
        Ok(ran) => {
            let energy = ran.response.energy;
            let made = (-energy.residual_j).max(0.0) / energy.largest_j;
            room.check("10 ms, HHT 0.05: energy made over the largest", made, Limit::AtMost(1e-2), "1");
            let openings: usize = ran.response.contact_force.iter().map(|force| openings(&force.values)).sum();
            room.check("10 ms, HHT 0.05: openings of contacts", openings as f64, Limit::AtLeast(2000.0), "1");
        }
        Err(reason) => room.failed("10 ms, HHT 0.05", reason),
    }
}

fn openings(force: &[f64]) -> usize {
    force.windows(2).filter(|pair| pair[0] > 0.0 && pair[1] == 0.0).count()
}
