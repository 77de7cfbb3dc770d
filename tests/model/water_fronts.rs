//! Meshed beads in front of the disc on water: both ways, reduced and finite elements, the chain's law, energy, refusals.

use granchain::{
    model::{self, ModelError},
    response::Response,
    scene,
};

/// The water scene with dashpots between beads, a coarse mesh of the beads, and more.
fn run(overrides: &[&str]) -> Result<Response, ModelError> {
    let base = ["damping.at=beads", "output_step=50 ns"];
    let all: Vec<String> = base.iter().chain(overrides).map(|text| (*text).to_owned()).collect();
    model::run(&scene::load("water", &all).unwrap(), &mut |_| true)
}

/// Rms of the difference over rms.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let square: f64 = b.iter().map(|b| b * b).sum();
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / square).sqrt()
}

fn disc_force(response: &Response) -> &[f64] {
    &response.contact_force.last().unwrap().values
}

fn back_velocity(response: &Response) -> &[f64] {
    &response.disc.as_ref().unwrap().velocity.values
}

fn pressure(response: &Response) -> &[f64] {
    &response.disc.as_ref().unwrap().pressure[0].values
}

/// Energy unaccounted for over the piston's work; disc and water are entries of their own.
fn imbalance(response: &Response) -> f64 {
    let energy = &response.energy;
    let (disc, water) = (energy.disc_j.unwrap(), energy.water_j.unwrap());
    let held = energy.kinetic_j + energy.stored_j + energy.dissipated_j + disc + water;
    assert!(disc > 0.0 && water > 0.0);
    assert!((energy.piston_work_j - held - energy.residual_j).abs() < 1e-9 * energy.piston_work_j);
    energy.residual_j / energy.piston_work_j
}

#[test]
fn both_ways_and_finite_elements_agree_behind_the_same_beads() {
    let coarse = ["drive.amplitude=3.96um", "duration=60 us", "model.mesh_density=6"];
    let with = |more: &[&str]| run(&[&coarse[..], more].concat()).unwrap();
    let reduced = with(&["model.kind=reduced"]);
    let meshed = with(&["model.kind=reduced", "water.method=elements"]);
    // The water's mesh and the disc's left-out inertia: measured 1e-5 of force.
    assert!(difference(disc_force(&meshed), disc_force(&reduced)) < 1e-3);
    // What rings above 3 MHz, where neither resolves, is in the back's velocity too.
    assert!(difference(back_velocity(&meshed), back_velocity(&reduced)) < 0.05);
    let full = with(&["model.kind=fea", "water.method=rayleigh", "duration=30 us"]);
    let short = disc_force(&full).len();
    assert!(difference(disc_force(&full), &disc_force(&reduced)[..short]) < 0.01);
    assert!(difference(back_velocity(&full), &back_velocity(&reduced)[..short]) < 0.02);
    for response in [&reduced, &meshed, &full] {
        assert!(imbalance(response).abs() < 0.01, "{:e}", imbalance(response));
    }
}

#[test]
fn the_contact_on_the_disc_is_the_chains_law_within_its_finite_bodies() {
    // Hertz and c_r against meshes of both: 1–3 % of force up to 100 µs, the finite-body deviation of the beads' own contacts among it.
    let strong = ["drive.amplitude=3.96um", "duration=90 us"];
    let chain = run(&strong).unwrap();
    let reduced = run(&[&strong[..], &["model.kind=reduced"]].concat()).unwrap();
    let error = difference(disc_force(&chain), disc_force(&reduced));
    assert!(error < 0.05, "{error}");
    let largest = |trace: &[f64]| trace.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let ratio = largest(pressure(&reduced)) / largest(pressure(&chain));
    assert!((0.7..1.4).contains(&ratio), "{ratio}");
}

#[test]
fn a_disc_in_a_vacuum_is_one_body_more() {
    let dry = ["drive.amplitude=3.96um", "duration=25 us", "model.mesh_density=5", "water.medium=none"];
    let with = |kind: &'static str| run(&[&dry[..], &[kind]].concat()).unwrap();
    let (reduced, full) = (with("model.kind=reduced"), with("model.kind=fea"));
    assert!(reduced.disc.as_ref().is_none_or(|disc| disc.pressure.is_empty()) && reduced.energy.water_j.is_none());
    assert!(difference(disc_force(&full), disc_force(&reduced)) < 0.01);
}

#[test]
fn a_dashpot_at_the_disc_is_one_in_both_waters_and_all_models() {
    let coarse = ["damping.at=all", "drive.amplitude=3.96um", "duration=60 us", "model.mesh_density=6"];
    let with = |more: &[&str]| run(&[&coarse[..], more].concat()).unwrap();
    let reduced = with(&["model.kind=reduced"]);
    let meshed = with(&["model.kind=reduced", "water.method=elements"]);
    assert!(difference(disc_force(&meshed), disc_force(&reduced)) < 1e-3);
    let full = with(&["model.kind=fea", "water.method=rayleigh", "duration=30 us"]);
    let short = disc_force(&full).len();
    assert!(difference(disc_force(&full), &disc_force(&reduced)[..short]) < 0.01);
    for response in [&reduced, &meshed, &full] {
        assert!(imbalance(response).abs() < 1e-3, "{:e}", imbalance(response));
    }
    // The dashpot is felt, and as the chain has it: whole beads deviate from Hertz by 1 to 3 %.
    let without = with(&["model.kind=reduced", "damping.at=beads"]);
    assert!(difference(disc_force(&without), disc_force(&reduced)) > 0.05);
    let strong = ["damping.at=all", "drive.amplitude=3.96um", "duration=90 us"];
    let chain = run(&strong).unwrap();
    let fine = run(&[&strong[..], &["model.kind=reduced"]].concat()).unwrap();
    let error = difference(disc_force(&chain), disc_force(&fine));
    assert!(error < 0.05, "{error}");
}

#[test]
fn a_pressed_chain_rests_on_the_disc_and_swings_about_it_as_the_chains_law_does() {
    let swing = |response: &Response| -> Vec<f64> {
        let force = disc_force(response);
        force.iter().map(|value| value - force[0]).collect()
    };
    let pressed = ["chain.precompression=0.1 N", "duration=40 us"];
    for at in ["damping.at=beads", "damping.at=all"] {
        let with = |more: &[&str]| run(&[&pressed[..], &[at], more].concat()).unwrap();
        let chain = with(&["drive.amplitude=0.5um"]);
        for model in [
            &["model.kind=reduced"][..],
            &["model.kind=reduced", "water.method=elements"],
            &["model.kind=fea", "duration=20 us"],
        ] {
            let driven = with(&[model, &["drive.amplitude=0.5um"]].concat());
            assert!((disc_force(&driven)[0] / 0.1 - 1.0).abs() < 1e-9);
            let own = swing(&driven);
            let error = difference(&own, &swing(&chain)[..own.len()]);
            assert!(error < 0.04, "{at} {model:?}: {error}");
            let held = driven.energy.residual_j / driven.energy.piston_work_j;
            assert!(held.abs() < 1e-3, "{at} {model:?}: {held:e}");
        }
        // A billionth of the drive moves it by a billionth: it stood still.
        let still = with(&["model.kind=reduced", "alpha=1e-9"]);
        assert!(swing(&still).iter().all(|value| value.abs() < 1e-8), "{at}");
    }
}

#[test]
fn overdamped_dashpots_settle_and_keep_the_energy_balance_in_every_model() {
    // A hundred times the scene's: a dashpot stops a bead in three steps, and rounds with its velocity while forces are nothing yet.
    for at in ["damping.at=beads", "damping.at=all"] {
        let with = |model: &str| run(&[at, "damping.coefficient=30 N s/m", "duration=60 us", model]).unwrap();
        let (chain, reduced) = (with("model.kind=chain"), with("model.kind=reduced"));
        for response in [&chain, &reduced] {
            assert!(imbalance(response).abs() < 1e-3, "{at}: {:e}", imbalance(response));
        }
        // Whole beads against Hertz, as without damping.
        let error = difference(disc_force(&chain), disc_force(&reduced));
        assert!(error < 0.05, "{at}: {error}");
    }
}

#[test]
fn a_static_force_on_a_disc_that_nothing_holds_is_refused() {
    for kind in ["model.kind=reduced", "model.kind=fea"] {
        let free = ["duration=1 us", "model.mesh_density=4", "disc.rim=free", "chain.precompression=0.1 N", kind];
        assert!(run(&free).unwrap_err().to_string().contains("disc.rim"));
    }
}
