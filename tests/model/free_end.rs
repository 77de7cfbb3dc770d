//! A chain whose last bead is free: momentum, energy, and that all models throw it alike.

use granchain::{
    model::{
        self, ModelError,
        chain::{
            ChainModel, InitialState,
            ensemble::{Ensemble, Variation},
        },
    },
    response::Response,
    scene::{self, Scene, Support},
};

fn load(overrides: &[&str]) -> Scene {
    let base = ["support.kind=free", "drive.cycles=1", "output_step=20 ns", "duration=60 us"];
    let all: Vec<String> = base.iter().chain(overrides).map(|text| (*text).to_owned()).collect();
    scene::load("rigid", &all).unwrap()
}

fn run(scene: &Scene) -> Response {
    model::run(scene, &mut |_| true).unwrap()
}

#[test]
fn beads_that_collide_freely_end_as_in_the_exact_cradle() {
    let mut scene = load(&["model.kind=chain", "chain.beads=3", "model.tolerance=1e-12", "duration=100 us"]);
    scene.amplitude_scale = 0.0;
    // No piston either.
    scene.chain.gaps[0] = f64::INFINITY;
    let mut initial = InitialState::at_rest(3);
    initial.velocities[0] = 0.1;
    let response = ChainModel.run_from(&scene, &initial, &mut |_| true).unwrap();
    for (bead, exact) in response.bead_velocity.iter().zip([-0.070_952_354, 0.076_403_039, 0.994_549_315]) {
        let end = bead.values.last().unwrap() / 0.1;
        assert!((end - exact).abs() < 1e-7, "{end} {exact}");
    }
}

#[test]
fn what_the_piston_gives_is_the_momentum_of_the_beads_on_every_model() {
    let mut thrown = Vec::new();
    for kind in ["chain", "reduced", "fea"] {
        let kind = format!("model.kind={kind}");
        let scene = load(&[&kind]);
        let response = run(&scene);
        let mass = scene.chain.beads[0].mass();
        let momentum = |at: usize| mass * response.bead_velocity.iter().map(|bead| bead.values[at]).sum::<f64>();
        let last = response.pole_velocity.len() - 1;
        let pushed = &response.contact_force[0].values;
        let given = 20e-9 * pushed.iter().sum::<f64>();
        assert!((momentum(last) / given - 1.0).abs() < 2e-3, "{kind}: {} {given}", momentum(last));
        // Nothing holds the far end, at no time.
        assert!(response.contact_force[6].values.iter().all(|force| *force == 0.0));
        // Once the piston is out of reach the momentum stays to rounding.
        let apart = pushed.iter().rposition(|force| *force > 0.0).unwrap() + 1;
        assert!(apart < last - 100, "{kind}");
        let change = momentum(apart) / momentum(last) - 1.0;
        assert!(change.abs() < 1e-9, "{kind}: {change:e}");
        let energy = &response.energy;
        assert!((energy.residual_j / energy.largest_j).abs() < 2e-2, "{kind}: {:e}", energy.residual_j);
        thrown.push(response.bead_velocity[5].values[last]);
    }
    println!("{thrown:?}");
    assert!((thrown[0] / thrown[2] - 1.0).abs() < 0.03 && (thrown[1] / thrown[2] - 1.0).abs() < 0.02, "{thrown:?}");
}

#[test]
fn an_ensemble_of_free_chains_follows_the_single_run() {
    for law in ["contact.law=hertz", "contact.law=finite-body"] {
        let scene = load(&["model.kind=chain", law]);
        let ensemble = Ensemble::new(&scene, 2560).unwrap();
        let run = ensemble.run(&[Variation::of(&scene)]).remove(0).unwrap();
        let step = format!("output_step={:e}", ensemble.step());
        let single = self::run(&load(&["model.kind=chain", law, &step]));
        let (one, other) = (run.values.last().unwrap(), single.pole_velocity.values.last().unwrap());
        assert!(one.is_finite() && (one / other - 1.0).abs() < 2e-3, "{law}: {one} {other}");
    }
}

#[test]
fn a_static_force_before_a_free_end_is_refused() {
    let mut scene = load(&["model.kind=chain"]);
    assert_eq!((&scene.support, scene.support.stiffness()), (&Support::Free, None));
    scene.chain.precompression = 0.1;
    for kind in [scene::ModelKind::Chain, scene::ModelKind::Reduced, scene::ModelKind::Fea] {
        scene.model.kind = kind;
        let refused = model::run(&scene, &mut |_| true).unwrap_err();
        assert!(matches!(refused, ModelError::Unphysical { .. }), "{kind:?}: {refused}");
    }
}
