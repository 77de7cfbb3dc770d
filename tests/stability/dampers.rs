//! Dashpots from weak to far beyond critical.

use super::{
    FidelityLevel, Limit,
    impact::{Throw, ringing, thrown},
    room::{Balance, Room},
};
use granchain_model::contact_law::bead_pair_stiffness;

pub(super) fn examine(room: &mut Room<'_>) {
    for (kind, coefficient) in [("linear", 0.3), ("kuwabara-kono", 3660.0)] {
        for factor in [1.0, 10.0, 100.0, 1000.0] {
            let which = format!("{kind} × {factor}");
            let sets = [
                format!("damping.kind={kind}"),
                format!("damping.coefficient={}", coefficient * factor),
                "damping.at=all".to_owned(),
                "duration=70 us".to_owned(),
            ];
            let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
            match room.scene("rigid", &sets).and_then(|scene| room.run(&scene)) {
                Ok(ran) => {
                    room.sound(&which, &ran, Balance::DAMPED);
                    room.lost(&which, ran.response.energy.dissipated_j, &ran);
                }
                Err(reason) => room.failed(&which, reason),
            }
        }
    }
}

/// A hit that γ of a thousand times the paper's makes inelastic: both beads go on together, with half the speed and half the energy.
pub(super) fn inelastic(room: &mut Room<'_>) {
    let which = "γ × 1000";
    let (speed, coefficient) = (0.5, 3.66e6);
    let damping = format!("damping.coefficient={coefficient}");
    let plain = [
        "damping.kind=kuwabara-kono",
        &damping,
        "damping.at=beads",
        "chain.gaps.contact2=20 um",
        "chain.gaps.contact3=30 um",
        "duration=75 us",
    ];
    // In the step in which the beads meet the dashpot is γ √(v h), and a step follows it up to 2 m_r over that: at 25 ns and more they would part again.
    let step: &[&str] = match room.fidelity {
        FidelityLevel::Hertz | FidelityLevel::FiniteBody => &[],
        FidelityLevel::Reduced | FidelityLevel::Fea => &["model.step=10 ns"],
    };
    let sets = [&plain[..], step].concat();
    let hit = match thrown(room, &Throw::at(speed), &sets) {
        Ok(hit) => hit,
        Err(reason) => return room.failed(which, reason),
    };
    room.sound(which, &hit.ran, Balance::DAMPED);
    let [first, second] = hit.after;
    let bead = &hit.scene.chain.beads[0];
    // The dashpot alone stops them at δ = (3 m_r v/2γ)^(2/3); then k δ^(3/2) = −γ √δ δ̇ parts them at k δ/γ. Twice that for the steps.
    let overlap = (0.75 * bead.mass() * hit.before / coefficient).powf(2.0 / 3.0);
    let parting = 2.0 * bead_pair_stiffness(bead, bead) * overlap / coefficient / hit.before;
    let ringing = ringing(room);
    let name = format!("{which}: parting speed over that of the hit");
    room.check(name, (first - second).abs() / hit.before, Limit::AtMost(parting + ringing), "1");
    let name = format!("{which}: sum of the velocities over that before, less 1");
    room.check(name, ((first + second) / hit.before - 1.0).abs(), Limit::AtMost(ringing), "1");
    let lost = hit.ran.response.energy.dissipated_j / (0.25 * bead.mass() * hit.before * hit.before);
    // Ringing takes the square of its share of the speed, and what is measured of that goes in twice.
    room.check(
        format!("{which}: energy lost over m v²/4, less 1"),
        (lost - 1.0).abs(),
        Limit::AtMost(2.0 * (ringing + parting)),
        "1",
    );
}
