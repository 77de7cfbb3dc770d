//! Supports at the edge of what they may be.

use super::{
    Limit,
    grid_mesh::{Rectangle, Side, graded},
    room::{Balance, Ran, Room, difference},
};

/// Radius of the edge the bead touches, m: that of the toroidal annulus' circle of contact.
const EDGE: f64 = 0.367e-3;

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

pub(super) fn sharp(room: &mut Room<'_>) {
    let three = || -> Result<[Ran; 3], String> { Ok([edged(room, 8e-6)?, edged(room, 4e-6)?, edged(room, 2e-6)?]) };
    match three() {
        Ok([coarse, middle, fine]) => {
            room.sound("edge", &fine, Balance::DAMPED);
            let force = |ran: &Ran| ran.response.contact_force.last().map_or(Vec::new(), |force| force.values.clone());
            let (first, second) =
                (difference(&force(&coarse), &force(&middle)), difference(&force(&middle), &force(&fine)));
            // Under a line load the flexibility of an edge grows with the logarithm of its elements: the force converges as slowly.
            room.check("force on the edge, elements of 4 and 2 µm, rms difference", second, Limit::AtMost(0.2), "1");
            let name = "that difference over the one between 8 and 4 µm";
            room.check(name, second / first, Limit::AtMost(1.0), "1");
        }
        Err(reason) => room.failed("edge", reason),
    }
}

/// A resin ring of square section whose inner edge the last bead touches, with elements of `finest` (m) there.
fn edged(room: &Room<'_>, finest: f64) -> Result<Ran, String> {
    let near = 0.06e-3;
    let depth = graded(0.5e-3, finest, 1.2, 0.05e-3);
    let rectangle = Rectangle {
        r: depth.iter().map(|d| EDGE + d).collect(),
        z: depth.clone(),
        boundaries: &[("contact", &[Side::Inner(near), Side::Bottom(EDGE + near)]), ("clamped", &[Side::Top])],
    };
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let path = rectangle.write(folder.path(), "ring").map_err(|error| error.to_string())?;
    let sets =
        ["support.kind=body".to_owned(), format!("support.mesh=\"{}\"", path.display()), "duration=100 us".to_owned()];
    let scene = room.scene("annulus", &[&sets[0], &sets[1], &sets[2]])?;
    room.run(&scene)
}
