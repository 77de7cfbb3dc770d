//! Lanes against the adaptive integrator.

use super::*;
use crate::scene;

/// Largest difference between a run of a lane and one of the adaptive integrator, over its peak.
fn apart(sets: &[&str], change: impl Fn(&mut Variation)) -> f64 {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let scene = scene::load("annulus", &sets).unwrap();
    let ensemble = Ensemble::new(&scene, 640).unwrap();
    let mut variation = Variation::of(&scene);
    change(&mut variation);
    assert!(!ensemble.is_single && ensemble.goes_in_lanes(&variation));
    let (lane, alone) = (ensemble.run(&[variation.clone()]).remove(0).unwrap(), ensemble.single(&variation).unwrap());
    let largest = lane.values.iter().zip(&alone.values).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
    largest / alone.peak()
}

const SHORT: &str = "duration=60us";

#[test]
fn friction_within_steps_is_that_of_the_adaptive_integrator() {
    let guide = ["holder.friction_force=2 mN", "holder.slip_velocity=1 mm/s", SHORT];
    // The continued fraction of tanh, 2e-3 of a force of 2 mN.
    assert!(apart(&guide, |_| ()) < 2e-3);
    let varied = |variation: &mut Variation| variation.effects.friction_force = Some(2e-3);
    let (with, without) = (apart(&guide, varied), ["holder.slip_velocity=1 mm/s", "holder.friction_force=1 uN", SHORT]);
    assert_eq!(with, apart(&guide, |_| ()));
    assert!(apart(&without, varied) < 2e-3);
}

#[test]
fn a_face_of_another_material_keeps_its_modulus_where_the_beads_vary() {
    let face = ["piston.contact=half-space", "piston.material=titanium", SHORT];
    // As far apart as with the beads' own modulus: the fixed step.
    let [own, stiffer] = [1.0, 1.2].map(|factor| apart(&face, |variation| variation.modulus_factor = factor));
    assert!(own < 1e-3 && stiffer < 1e-3, "{own} {stiffer}");
}
