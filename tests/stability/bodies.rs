//! Bodies far from one another, and from what a mesh is made for.

use super::{
    FidelityLevel, Limit,
    impact::{Hit, Throw, elastic, ringing, thrown},
    room::{Balance, Room, difference},
    steps::Slope,
};
use granchain_model::{contact_law::bead_pair_stiffness, scene::Bead};

/// Speed of the hits, m/s.
const SPEED: f64 = 0.5;
/// Free flight and rebound of a bead of that speed, and the end.
const FLIGHT: [&str; 3] = ["chain.gaps.contact2=30 um", "chain.gaps.contact3=30 um", "duration=100 us"];

fn is_meshed(room: &Room<'_>) -> bool {
    matches!(room.fidelity, FidelityLevel::Reduced | FidelityLevel::Fea)
}

/// A bead 10⁴ times as heavy as its neighbours.
pub(super) fn heavy(room: &mut Room<'_>) {
    let of = |bead: u32| {
        let bead = format!("chain.override=[{{bead={bead}, material=\"heavy\"}}]");
        let material = ["youngs_modulus=201 GPa", "poissons_ratio=0.3", "density=78330000 kg/m^3"];
        let material = material.map(|text| format!("materials.heavy.{text}"));
        [&material[..], &[bead]].concat()
    };
    let which = "a bead thrown at it";
    let sets = of(2);
    let flight = ["chain.gaps.contact2=6 um", "chain.gaps.contact3=6 um", "duration=100 us"];
    let sets: Vec<&str> = flight.into_iter().chain(sets.iter().map(String::as_str)).collect();
    match thrown(room, &Throw::at(0.1), &sets) {
        Ok(hit) => {
            room.sound(which, &hit.ran, Balance::UNDAMPED);
            rebound(room, which, &hit);
        }
        Err(reason) => room.failed(which, reason),
    }
    let sets = of(3);
    let sets: Vec<&str> = std::iter::once("duration=40 us").chain(sets.iter().map(String::as_str)).collect();
    match room.scene("rigid", &sets).and_then(|scene| room.run(&scene)) {
        Ok(ran) => room.sound("third of six", &ran, Balance::UNDAMPED),
        Err(reason) => room.failed("third of six", reason),
    }
}

/// Velocities after an elastic hit: (m − M)/(m + M) v and 2m/(m + M) v.
fn rebound(room: &mut Room<'_>, which: &str, hit: &Hit) {
    let [light, heavy] = [0, 1].map(|bead: usize| &hit.scene.chain.beads[bead]);
    let [mass, other] = [light.mass(), heavy.mass()];
    let expected = [(mass - other) / (mass + other), 2.0 * mass / (mass + other)];
    // The heavy one is a half-space to so short a hit and radiates; Hunter (1957), J. Mech. Phys. Solids 5, 162: of the energy 1.04 (v/c)^(3/5) between
    // like materials, and as 1/(ρ c³) of the half-space. Half of that of the speed.
    let speed = |bead: &Bead| (bead.material.youngs_modulus / bead.material.density).sqrt();
    let hardness = |bead: &Bead| bead.material.density * speed(bead).powi(3);
    let radiated = 0.52 * (hit.before / speed(light)).powf(0.6) * hardness(light) / hardness(heavy);
    let radiated = if is_meshed(room) { radiated } else { 0.0 };
    let name = format!("{which}: rebound over (M − m)/(M + m), less 1");
    let most = ringing(room) + radiated;
    room.check(name, (hit.after[0] / hit.before / expected[0] - 1.0).abs(), Limit::AtMost(most), "1");
    if !is_meshed(room) {
        // Of meshed bodies there is the velocity of the centre only, where waves pass.
        let name = format!("{which}: velocity of the heavy one over 2m/(m + M), less 1");
        room.check(name, (hit.after[1] / hit.before / expected[1] - 1.0).abs(), Limit::AtMost(most), "1");
    }
}

/// Beads of different moduli.
const BEADS: u32 = 4;

/// E of four beads from 1 TPa to 1 MPa.
pub(super) fn moduli(room: &mut Room<'_>) {
    let modulus = |bead: u32| 1e12 * 1e-6_f64.powf(f64::from(bead - 1) / 3.0);
    let materials = (1..=BEADS).flat_map(|bead| {
        let own = [format!("youngs_modulus={:e}", modulus(bead)), "poissons_ratio=0.3".into(), "density=7833".into()];
        own.map(|text| format!("materials.of-bead-{bead}.{text}"))
    });
    let beads: Vec<String> = (1..=BEADS).map(|bead| format!("{{bead={bead}, material=\"of-bead-{bead}\"}}")).collect();
    let sets: Vec<String> =
        materials.chain([format!("chain.beads={BEADS}"), format!("chain.override=[{}]", beads.join(", "))]).collect();
    let with = |more: &[&str]| -> Vec<String> {
        sets.iter().cloned().chain(more.iter().map(|set| (*set).to_owned())).collect()
    };
    let scene = |room: &Room<'_>, more: &[&str]| {
        let sets = with(more);
        room.scene("rigid", &sets.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let which = "driven at the hard end";
    match scene(room, &["duration=60 us", "alpha=0.1"]).and_then(|scene| room.run(&scene)) {
        Ok(ran) => room.sound(which, &ran, Balance::UNDAMPED),
        Err(reason) => room.failed(which, reason),
    }
    if is_meshed(room) {
        // The force that the softest bead bears presses no mesh of the hardest.
        return;
    }
    let which = "pressed slowly";
    let force = 1e-4;
    let pressed = [format!("chain.precompression={force}"), "duration=60 ms".into(), "output_step=10 us".into()];
    let pressed: Vec<&str> = pressed.iter().map(String::as_str).collect();
    let ran = scene(room, &pressed).and_then(|scene| {
        // Twice the static approach: a chain of Hertz contacts, whatever their stiffnesses, then carries 2^(3/2) times the force.
        let beads = &scene.chain.beads;
        let rigid = std::f64::consts::SQRT_2 * 2.0;
        let ends = [(&beads[0], rigid), (&beads[beads.len() - 1], rigid)]
            .map(|(bead, more)| more * bead_pair_stiffness(bead, bead));
        let pairs = beads.windows(2).map(|pair| bead_pair_stiffness(&pair[0], &pair[1]));
        let approach: f64 = pairs.chain(ends).map(|stiffness| (force / stiffness).powf(2.0 / 3.0)).sum();
        room.run_with(&scene, &Slope { distance: approach, time: 20e-3 })
    });
    match ran {
        Ok(ran) => {
            room.sound(which, &ran, Balance::UNDAMPED);
            // The softest beads swing through in 4 ms: a fifth of the slope, and the last 40 ms hold ten swings.
            let most = if room.fidelity == FidelityLevel::Hertz { 0.02 } else { 0.05 };
            let expected = 2.0_f64.powf(1.5) * force;
            for (contact, series) in ran.response.contact_force.iter().enumerate() {
                let last = &series.values[series.len() / 3..];
                let mean = last.iter().sum::<f64>() / last.len() as f64;
                let name =
                    format!("{which}, contact {}: mean force over 2^(3/2) times the static, less 1", contact + 1);
                room.check(name, (mean / expected - 1.0).abs(), Limit::AtMost(most), "1");
            }
        }
        Err(reason) => room.failed(which, reason),
    }
}

/// ν = 0.4999 of the beads.
pub(super) fn incompressible(room: &mut Room<'_>) {
    let run = |room: &Room<'_>, ratio: &str, density: Option<&str>| {
        let ratio = format!("materials.chrome-steel.poissons_ratio={ratio}");
        let density = density.map(|density| format!("model.mesh_density={density}"));
        let sets: Vec<&str> = FLIGHT.into_iter().chain([ratio.as_str()]).chain(density.as_deref()).collect();
        thrown(room, &Throw::at(SPEED), &sets)
    };
    let which = "ν = 0.4999";
    match run(room, "0.4999", None) {
        Ok(hit) => {
            room.sound(which, &hit.ran, Balance::UNDAMPED);
            elastic(room, which, &hit);
        }
        Err(reason) => return room.failed(which, reason),
    }
    if !is_meshed(room) {
        return;
    }
    let meshes = |ratio: &str| -> Result<f64, String> {
        let force = |density| Ok(run(room, ratio, Some(density))?.ran.response.contact_force.remove(1).values);
        let (coarse, fine): (Result<Vec<f64>, String>, Result<Vec<f64>, String>) = (force("8"), force("12"));
        Ok(difference(&coarse?, &fine?))
    };
    match meshes("0.4999").and_then(|own| Ok(own / meshes("0.3")?)) {
        Ok(ratio) => {
            let name = "difference between mesh densities 8 and 12, over that at ν = 0.3";
            room.check(name, ratio, Limit::AtMost(1.5), "1");
        }
        Err(reason) => room.failed(which, reason),
    }
}
