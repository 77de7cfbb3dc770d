//! Supports at the edge of what they may be.

use super::{
    Limit,
    room::{Balance, Ran, Room, difference},
};

pub(super) fn stiffness(room: &mut Room<'_>) {
    for factor in ["0.001", "1000"] {
        let which = format!("stiffness × {factor}");
        let sets = [format!("support.stiffness_factor={factor}"), "duration=150 us".to_owned()];
        match room.scene("annulus", &[&sets[0], &sets[1]]).and_then(|scene| room.run(&scene)) {
            Ok(ran) => room.sound(&which, &ran, Balance::DAMPED),
            Err(reason) => room.failed(&which, reason),
        }
    }
}

pub(super) fn incompressible(room: &mut Room<'_>) {
    let run = |ratio: &str, density: &str| {
        let sets = [
            format!("materials.resin.poissons_ratio={ratio}"),
            format!("model.mesh_density={density}"),
            "duration=60 us".to_owned(),
        ];
        room.scene("annulus", &[&sets[0], &sets[1], &sets[2]]).and_then(|scene| room.run(&scene))
    };
    let all = || -> Result<[Ran; 5], String> {
        Ok([run("0.35", "8")?, run("0.35", "12")?, run("0.4999", "8")?, run("0.4999", "12")?, run("0.499", "8")?])
    };
    match all() {
        Ok([coarser, finer, coarse, fine, less]) => {
            room.sound("ν = 0.4999", &coarse, Balance::DAMPED);
            let pole = |ran: &Ran| ran.response.pole_velocity.values.clone();
            // What is left of the mesh at ν = 0.35 is the beads'.
            let usual = difference(&pole(&coarser), &pole(&finer));
            let meshes = difference(&pole(&coarse), &pole(&fine)) / usual;
            let name = "difference between mesh densities 8 and 12, over that at ν = 0.35";
            room.check(name, meshes, Limit::AtMost(1.5), "1");
            let locking = difference(&pole(&less), &pole(&coarse));
            room.check("pole velocity at ν = 0.499 and 0.4999, rms difference", locking, Limit::AtMost(0.01), "1");
        }
        Err(reason) => room.failed("ν = 0.4999", reason),
    }
}
