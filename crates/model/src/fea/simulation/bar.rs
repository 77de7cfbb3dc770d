//! An elastic bar and a rigid wall: the textbook case of contact dynamics, seen from the bar (Doyen, Ern, Piperno 2011).

use std::f64::consts::PI;

use super::*;
use crate::{
    fea::{
        body::Body,
        contact::pair::{Pair, Pole, Profile as Surface},
        mesh::{Boundary, Mesh},
    },
    scene::load,
};

const LENGTH: f64 = 10e-3;
const RADIUS: f64 = 0.5e-3;
/// Speed of the wall, m/s.
const SPEED: f64 = 0.1;
/// Elements along the bar.
const ELEMENTS: u32 = 100;

struct Push;

impl PistonMotion for Push {
    fn on_piece(&self, _: usize, t: f64) -> (f64, f64) {
        (SPEED * t.max(0.0), SPEED)
    }

    fn breaks(&self) -> &[f64] {
        &[0.0]
    }
}

/// Two elements across, its front at z = 0.
fn bar() -> Mesh {
    const ROW: u32 = 5;
    // All half-steps; the middles of elements belong to none.
    let nodes = (0..=2 * ELEMENTS)
        .flat_map(|j| (0..ROW).map(move |i| (i, j)))
        .map(|(i, j)| [0.25 * RADIUS * f64::from(i), LENGTH * f64::from(j) / f64::from(2 * ELEMENTS)]);
    let node = |i: u32, j: u32| j * ROW + i;
    let element = |i: u32, j: u32| {
        let at = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)];
        at.map(|(a, b)| node(i + a, j + b))
    };
    let side = |name: &str, j| Boundary { name: name.into(), nodes: (0..ROW).map(|i| node(i, j)).collect() };
    let (nodes, mut used) = (nodes.collect::<Vec<_>>(), Vec::new());
    let mut mesh = Mesh {
        elements: (0..ELEMENTS).flat_map(|j| [element(0, 2 * j), element(2, 2 * j)]).collect(),
        boundaries: vec![side("front", 0), side("back", 2 * ELEMENTS)],
        nodes: Vec::new(),
    };
    let mut number = |old: u32| {
        used.iter().position(|known| *known == old).unwrap_or_else(|| {
            used.push(old);
            used.len() - 1
        }) as u32
    };
    mesh.elements.iter_mut().flatten().for_each(|node| *node = number(*node));
    mesh.boundaries.iter_mut().flat_map(|side| &mut side.nodes).for_each(|node| *node = number(*node));
    mesh.nodes = used.iter().map(|old| nodes[*old as usize]).collect();
    mesh
}

#[test]
fn a_bar_leaves_the_wall_after_two_transits_under_the_force_of_its_impedance() {
    let sets = [
        "model.kind=fea",
        "chain.beads=1",
        "chain.gaps.contact1=0 m",
        "chain.gaps.contact2=400 um",
        // No Poisson effect: a rod, exactly one-dimensional.
        "materials.chrome-steel.poissons_ratio=0",
        "damping.kind=none",
        "duration=7 us",
        "output_step=0.01 us",
        "model.step=0.01 us",
    ];
    let scene = load("rigid", &sets.map(String::from)).unwrap();
    let material = scene.chain.beads[0].material.clone();
    let body = Body::new(bar(), &material, &[], &["front", "back"]).unwrap();
    let pole = |boundary, normal| Pole { name: "the bar", body: &body, boundary, normal, profile: Surface::Meshed };
    let pairs =
        vec![Pair::on_flat(pole("front", -1.0), true).unwrap(), Pair::on_flat(pole("back", 1.0), false).unwrap()];
    let arrangement = Arrangement { kinds: vec![body], pairs, origins: vec![0.0], ..Arrangement::new(&scene).unwrap() };
    let lap = Profile::default().start();
    let mut simulation = Simulation::of(arrangement, &scene, Box::new(Push), Control::default(), lap).unwrap();
    while !simulation.is_done() {
        simulation.advance().unwrap();
    }
    let force = &simulation.response().contact_force[0];
    let celerity = (material.youngs_modulus / material.density).sqrt();
    let area = PI * RADIUS * RADIUS;
    let (lasts, carries) = (2.0 * LENGTH / celerity, material.density * celerity * SPEED * area);
    let pressed = force.values.iter().filter(|force| **force > 0.0).count() as f64 * force.step;
    assert!((pressed / lasts - 1.0).abs() < 0.02, "{pressed}");
    // Away from the two fronts, which the step smears.
    let inside = |(index, _): &(usize, &f64)| (0.1..0.9).contains(&(*index as f64 * force.step / lasts));
    let plateau: Vec<f64> = force.values.iter().enumerate().filter(inside).map(|(_, force)| force / carries).collect();
    let mean = plateau.iter().sum::<f64>() / plateau.len() as f64;
    assert!((mean - 1.0).abs() < 0.01, "{mean}");
    assert!(plateau.iter().all(|force| (force - 1.0).abs() < 0.1), "{plateau:?}");
    let impulse: f64 = force.values.iter().sum::<f64>() * force.step;
    let leaves = impulse / (material.density * area * LENGTH);
    assert!((leaves / (2.0 * SPEED) - 1.0).abs() < 0.01, "{leaves}");
    assert!(force.values[(1.1 * lasts / force.step) as usize..].iter().all(|force| *force == 0.0));
}
