//! Dashpots from weak to far beyond critical.

use super::room::{Balance, Room};

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
