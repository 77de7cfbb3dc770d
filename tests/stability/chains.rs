//! Unequal beads, few beads, many beads.

use super::{
    FidelityLevel,
    room::{Balance, Room},
};

pub(super) fn examine(room: &mut Room<'_>) {
    let heavy = [
        "materials.heavy.youngs_modulus=201 GPa",
        "materials.heavy.poissons_ratio=0.3",
        "materials.heavy.density=7833000 kg/m^3",
        "chain.override=[{bead=3, material=\"heavy\"}]",
    ];
    let light = [
        "materials.light.youngs_modulus=201 GPa",
        "materials.light.poissons_ratio=0.3",
        "materials.light.density=7.833 kg/m^3",
        "chain.override=[{bead=3, material=\"light\"}]",
    ];
    run(room, "one bead of a thousand times the mass", &heavy);
    // A thirtieth of the time of a hit: a step of 0.05 µs would pass over it, and is refused when it does.
    let step: &[&str] =
        if matches!(room.fidelity, FidelityLevel::Reduced | FidelityLevel::Fea) { &["model.step=5 ns"] } else { &[] };
    run(room, "one bead of a thousandth of the mass", &[&light[..], step].concat());
    // Pressed by its large neighbours, and as light as the one before.
    let small = ["chain.override=[{bead=3, radius=\"0.05 mm\"}]"];
    let patch: &[&str] = if step.is_empty() { &[] } else { &["model.contact_patch=0.4"] };
    run(room, "one bead of a tenth of the radius", &[&small[..], step, patch].concat());
    let most = match room.fidelity {
        FidelityLevel::Hertz => 1000,
        FidelityLevel::FiniteBody => 200,
        FidelityLevel::Reduced | FidelityLevel::Fea => 40,
    };
    for beads in [2, most] {
        run(room, &format!("{beads} beads"), &[&format!("chain.beads={beads}")]);
    }
}

fn run(room: &mut Room<'_>, which: &str, sets: &[&str]) {
    match room.scene("rigid", sets).and_then(|scene| room.run(&scene)) {
        Ok(ran) => room.sound(which, &ran, Balance::UNDAMPED),
        Err(reason) => room.failed(which, reason),
    }
}
