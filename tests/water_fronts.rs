//! Meshed beads in front of the disc on water: both ways, reduced and finite elements, the chain's law, energy, refusals.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

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
fn what_the_meshed_fronts_do_not_have_is_refused_by_its_key() {
    for kind in ["model.kind=reduced", "model.kind=fea"] {
        let refused =
            |more: &[&str]| run(&[&["duration=1 us", "model.mesh_density=4", kind], more].concat()).unwrap_err();
        assert!(refused(&["damping.at=all"]).to_string().contains("damping.at"));
        assert!(refused(&["chain.precompression=0.1 N"]).to_string().contains("chain.precompression"));
    }
}
