//! A finite element analysis taken up from a saved state ends in the same bits, whatever was going on when it was saved.

use granchain::{
    model::fea::{Control, Simulation, Snapshot},
    scene::{self, Scene},
};

fn scene(name: &str, overrides: &[&str]) -> Scene {
    let small = ["model.kind=fea", "model.mesh_density=3", "duration=30us"];
    let overrides: Vec<String> = small.iter().chain(overrides).map(|text| (*text).to_owned()).collect();
    scene::load(name, &overrides).unwrap()
}

/// Run to the end; save and take up in a new analysis after each of `stops` steps.
fn run(scene: &Scene, control: Control, stops: &[usize]) -> Simulation<'static> {
    let mut simulation = Simulation::new(scene, control).unwrap();
    let mut taken = 0;
    while !simulation.is_done() {
        simulation.advance().unwrap();
        taken += 1;
        if stops.contains(&taken) {
            let saved = serde_json::to_vec(&simulation.snapshot("test")).unwrap();
            let snapshot: Snapshot = serde_json::from_slice(&saved).unwrap();
            simulation = Simulation::new(scene, control).unwrap();
            simulation.restore(snapshot, "test").unwrap();
        }
    }
    simulation
}

fn assert_same(scene: &Scene, control: Control) -> Simulation<'static> {
    let whole = run(scene, control, &[]);
    let broken = run(scene, control, &[1, 97, 150, 251]);
    assert!(whole.response() == broken.response(), "{}", scene.to_toml());
    assert_eq!(whole.cuts(), broken.cuts());
    assert_eq!(whole.complementarity(), broken.complementarity());
    assert_eq!(whole.warnings(), broken.warnings());
    whole
}

#[test]
fn any_scheme_and_support_goes_on_to_the_same_bits() {
    let control = Control::default();
    assert_same(&scene("rigid", &["chain.precompression=0.5N", "damping.kind=linear"]), control);
    assert_same(&scene("rigid", &["model.integrator=hht", "model.numerical_dissipation=0.1"]), control);
    assert_same(&scene("annulus", &["alpha=1.5"]), control);
}

#[test]
fn a_run_whose_steps_were_cut_goes_on_with_its_factors_counted_once() {
    let strict = Control { contact_energy: 1e-4, ..Control::default() };
    let whole = assert_same(&scene("rigid", &[]), strict);
    // Steps were cut before and after the stops, or this says nothing.
    assert!(whole.cuts().iter().any(|cut| cut.time_s < 9e-6) && whole.cuts().iter().any(|cut| cut.time_s > 26e-6));
    assert!(whole.response().work.factorisations > 1);
}
