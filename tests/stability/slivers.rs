//! Meshes at the edge of what the mesher makes.

use super::{
    Limit,
    impact::{Throw, largest_force, ringing, thrown},
    room::{Balance, Room, difference},
};
use granchain_model::fea::{
    arrangement::{bead_mesh, torus},
    mesh::{AnnulusMesh, annulus, quality},
};

pub(super) fn examine(room: &mut Room<'_>) {
    patch(room);
    thin(room);
}

/// A patch of 5 µm at the pole of a bead, in which a contact of 1.6 µm is Hertz'.
fn patch(room: &mut Room<'_>) {
    let which = "patch of a hundredth of the bead’s radius";
    // An overlap of 10 nm.
    let throw = Throw { speed: 3e-3, ramp: 30e-6 };
    let sets =
        ["model.contact_patch=0.01", "chain.gaps.contact2=150 nm", "chain.gaps.contact3=150 nm", "duration=100 us"];
    match thrown(room, &throw, &sets) {
        Ok(hit) => {
            room.sound(which, &hit.ran, Balance::UNDAMPED);
            let mesh = bead_mesh(&hit.scene.chain.beads[0], &hit.scene).map(|mesh| quality(&mesh));
            let sides = mesh.map_or(f64::NAN, |mesh| mesh.longest_side / mesh.shortest_side);
            room.check(format!("{which}: longest over shortest side"), sides, Limit::AtLeast(1e3), "1");
            let hertz = largest_force(&hit.scene, hit.before);
            // Half a per cent of a frequency for the elements is one of the force; a body of 500 µm is infinite here.
            let name = format!("{which}: largest force against Hertz’");
            room.check(name, (hit.force / hertz - 1.0).abs(), Limit::AtMost(0.02), "1");
            let restitution = (hit.after[1] - hit.after[0]) / hit.before;
            let most = ringing(room);
            room.check(format!("{which}: restitution, lost"), (1.0 - restitution).abs(), Limit::AtMost(most), "1");
        }
        Err(reason) => room.failed(which, reason),
    }
}

/// A ring of a micrometre, the bead on it 450 times as large: its mesh is as good as the published ring's, and two meshes agree as well.
fn thin(room: &mut Room<'_>) {
    let which = "annulus of 1 µm";
    let run = |room: &Room<'_>, ring: &[&str], density: &str| {
        let density = format!("model.mesh_density={density}");
        let tiny = ["chain.beads=2", "alpha=0.01", "model.contact_patch=0.02", "duration=40 us", &density];
        let scene = room.scene("annulus", &[&tiny[..], ring].concat())?;
        Ok::<_, String>((room.run(&scene)?, scene))
    };
    let thin = ["support.ring_radius=0.45 mm", "support.section_radius=1 um"];
    let all = || {
        let pole =
            |ring: &[&str], density: &str| Ok::<_, String>(run(room, ring, density)?.0.response.pole_velocity.values);
        let usual = difference(&pole(&[], "8")?, &pole(&[], "12")?);
        let (coarse, scene) = run(room, &thin, "8")?;
        let apart = difference(&coarse.response.pole_velocity.values, &pole(&thin, "12")?);
        let shape = torus(&scene).ok_or("no ring")?;
        let mesh = annulus(&shape, &AnnulusMesh::on(&shape, 8)).map_err(|error| error.to_string())?;
        Ok::<_, String>((coarse, apart / usual, quality(&mesh).volume_error(shape.volume())))
    };
    match all() {
        Ok((ran, ratio, volume)) => {
            room.sound(which, &ran, Balance::DAMPED);
            let name = format!("{which}: difference between mesh densities 8 and 12, over that of the published ring");
            room.check(name, ratio, Limit::AtMost(1.5), "1");
            // Sides are parabolas: of 8 elements about a half circle each leaves (π/16)⁴/90 of the area.
            room.check(format!("{which}: volume against Pappus’"), volume.abs(), Limit::AtMost(1e-4), "1");
        }
        Err(reason) => room.failed(which, reason),
    }
}
