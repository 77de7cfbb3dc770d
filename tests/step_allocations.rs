//! The steps of every model allocate nothing: a run twice as long allocates exactly as often.
//!
//! Records of a run are reserved at its start, so their number does not grow with the steps either.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod allocator;

use granchain::{model, scene};

/// The prepared bodies serve the longer run.
fn compare(name: &str, keys: &[&str], short: f64) {
    let mut scene = scene::load(name, &keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>()).unwrap();
    scene.duration = 2.0 * short;
    let prepared = model::prepare(&scene).unwrap();
    let mut count = |duration: f64| {
        scene.duration = duration;
        let before = allocator::calls();
        let response = prepared.run(&scene, &mut |_| true).unwrap();
        (allocator::calls() - before, response.work.steps)
    };
    // What is made once a thread or once a program is made now.
    count(short);
    let (half, whole) = (count(short), count(2.0 * short));
    assert!(whole.1 > half.1 + half.1 / 3, "{name} {keys:?}: {half:?} {whole:?}");
    assert_eq!(half.0, whole.0, "{name} {keys:?}: allocations and steps {half:?} {whole:?}");
}

#[test]
fn the_chain_adaptive_and_at_a_fixed_step() {
    for keys in [
        &["model.kind=chain"][..],
        &["model.kind=chain", "damping.kind=linear"],
        &["model.kind=chain", "damping.kind=kuwabara-kono"],
        &["model.kind=chain", "contact.law=finite-body", "damping.kind=linear"],
        &["model.kind=chain", "chain.precompression=0.05 N"],
    ] {
        compare("rigid", keys, 40e-6);
    }
    compare("annulus", &["model.kind=chain"], 100e-6);
}

#[test]
fn the_reduced_model() {
    for (name, more) in [("rigid", "alpha=1"), ("annulus", "alpha=2"), ("annulus", "chain.precompression=0.05 N")] {
        compare(name, &["model.kind=reduced", "model.mesh_density=6", more], 30e-6);
    }
    compare("annulus", &[&["model.kind=reduced", "model.mesh_density=6"], EFFECTS].concat(), 30e-6);
}

/// A compliant horn, a bead guide that drags and rubs, material that loses and relaxes.
const EFFECTS: &[&str] = &[
    "horn.mass=1 g",
    "holder.drag=0.01 N s/m",
    "holder.friction_coefficient=0.3",
    "holder.clearance=20 um",
    "loss.beads=0.01",
    "loss.support=0.02",
    "loss.relaxation=0.5",
    "loss.relaxation_time=2 us",
];

#[test]
fn the_finite_element_analysis() {
    for (name, more) in [("rigid", "damping.kind=none"), ("rigid", "damping.kind=linear"), ("annulus", "alpha=2")] {
        compare(name, &["model.kind=fea", "model.mesh_density=4", more], 15e-6);
    }
    compare("annulus", &[&["model.kind=fea", "model.mesh_density=4"], EFFECTS].concat(), 15e-6);
}

#[test]
fn water_by_rayleigh_and_by_elements() {
    let coarse = "water.mesh_side=0.1 mm";
    for keys in [
        &["water.method=rayleigh"][..],
        &["damping.at=beads"],
        &["water.medium=none"],
        &["water.method=elements", coarse],
        &["water.method=elements", coarse, "damping.at=beads"],
    ] {
        compare("water", keys, 40e-6);
    }
}

#[test]
fn water_behind_meshed_beads() {
    let coarse = "water.mesh_side=0.1 mm";
    for keys in [
        &["model.kind=reduced", "model.mesh_density=6"][..],
        &["model.kind=reduced", "model.mesh_density=6", "water.method=elements", coarse],
        &["model.kind=fea", "model.mesh_density=4"],
    ] {
        compare("water", keys, 15e-6);
    }
}
