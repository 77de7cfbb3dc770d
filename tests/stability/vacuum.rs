//! An undamped, unpressed chain long after its drive.

use super::{
    FidelityLevel, Limit,
    room::{Balance, Room},
};

pub(super) fn examine(room: &mut Room<'_>) {
    let duration: f64 = if room.fidelity == FidelityLevel::Fea { 1e-3 } else { 1e-2 };
    let which = format!("{} ms", 1e3 * duration);
    let sets = [format!("duration={duration}"), "output_step=1 us".to_owned()];
    let missing = match room.scene("rigid", &[&sets[0], &sets[1]]).and_then(|scene| room.run(&scene)) {
        Ok(ran) => {
            room.sound(&which, &ran, LONG);
            let openings: usize = ran.response.contact_force.iter().map(|force| openings(&force.values)).sum();
            // Of seven contacts, each a few times a period of the drive; seen on the output's grid.
            let least = (2e5 * duration).floor();
            room.check(format!("{which}: openings of contacts"), openings as f64, Limit::AtLeast(least), "1");
            ran.response.energy.residual_share()
        }
        Err(reason) => return room.failed(&which, reason),
    };
    match room.fidelity {
        FidelityLevel::Fea => long(room),
        FidelityLevel::Reduced => without_drift(room, &sets, missing),
        FidelityLevel::Hertz | FidelityLevel::FiniteBody => {}
    }
}

/// At the reduced model's fixed step each of the openings leaves an error of either sign. Over 10 ms they add up to 0.17 % of the energy (SD of runs whose
/// drives differ by 1e-9 to 1e-4; 0.07 % at half the step).
const LONG: Balance = Balance { reduced: 8e-3, ..Balance::UNDAMPED };

/// The mean of such runs, of which the first is made: what drifts stays, what is random falls.
fn without_drift(room: &mut Room<'_>, sets: &[String; 2], first: f64) {
    let drives = ["alpha=1.000000001", "alpha=1.00001", "alpha=1.0001"];
    let missing = |drive: &str| -> Result<f64, String> {
        Ok(room.run(&room.scene("rigid", &[&sets[0], &sets[1], drive])?)?.response.energy.residual_share())
    };
    match drives.into_iter().map(missing).sum::<Result<f64, String>>() {
        Ok(others) => room.check(
            "10 ms: mean energy unaccounted for of four drives over the largest",
            ((first + others) / (1.0 + drives.len() as f64)).abs(),
            Limit::AtMost(Balance::UNDAMPED.reduced),
            "1",
        ),
        Err(reason) => room.failed("10 ms, four drives", reason),
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

pub(super) fn openings(force: &[f64]) -> usize {
    force.windows(2).filter(|pair| pair[0] > 0.0 && pair[1] == 0.0).count()
}
