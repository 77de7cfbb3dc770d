//! Scatter and sensitivity of an ensemble, held against what they claim to be.

use granchain::{
    model,
    scene::{self, Scene},
    study::{
        EnsemblePlan, Observation, ensemble,
        observation::{settings, watched},
    },
};

fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    scene::load("annulus", &overrides).unwrap()
}

/// Strongly damped and weakly driven: no chaos.
fn regular() -> Scene {
    scene(&["damping.kind=kuwabara-kono", "damping.coefficient=3660", "alpha=0.5", "duration=400us", "drive.cycles=20"])
}

fn accurate(scene: &Scene) -> Observation {
    let response = model::run(scene, &mut |_| true).unwrap();
    Observation::measure(&response.pole_velocity, &settings(scene).unwrap()).unwrap()
}

fn index(key: &str) -> usize {
    watched().iter().position(|watched| watched.key == key).unwrap()
}

#[test]
fn in_a_regular_regime_the_mean_is_the_accurate_run_and_the_sensitivity_its_slope() {
    let scene = regular();
    let outcome = ensemble::run(&scene, &EnsemblePlan::new(6, 1)).unwrap();
    assert!(outcome.failures.is_empty());
    let own = accurate(&scene);
    let at = |factor: f64| accurate(&Scene { amplitude_scale: factor * scene.amplitude_scale, ..scene.clone() });
    let (above, below) = (at(1.01), at(0.99));
    for key in ["positive_peak", "negative_peak", "line_1"] {
        let spread = outcome.spreads[index(key)].unwrap();
        let value = own.get(key).unwrap();
        // 1/160 of a period at 4th order is good to 4e-3 of the peak; a gap jitter of 0.3 nm is 1e-3 of the overlap.
        assert!((spread.mean - value).abs() < 1e-2 * value.abs(), "{key}: {spread:?} against {value}");
        assert!(spread.scatter < 1e-2 * value.abs(), "{key}: {spread:?}");
        let slope = 0.5 * (above.get(key).unwrap() - below.get(key).unwrap());
        // Both are differences of 1 % of the value; 5e-4 of the value is 5 % of them.
        assert!((spread.sensitivity - slope).abs() < 1e-3 * value.abs(), "{key}: {spread:?} against {slope}");
    }
}

#[test]
fn a_chaotic_regime_scatters_more_than_a_regular_one() {
    let chaotic = ensemble::run(&scene(&["alpha=1"]), &EnsemblePlan::new(8, 1)).unwrap();
    let regular = ensemble::run(&regular(), &EnsemblePlan::new(8, 1)).unwrap();
    let relative = |outcome: &granchain::study::EnsembleOutcome| {
        let spread = outcome.spreads[index("line_1/3")].unwrap();
        spread.scatter / spread.mean
    };
    // numerics: 7–40 % of subharmonic lines against near zero.
    assert!(relative(&chaotic) > 0.05, "{}", relative(&chaotic));
    assert!(relative(&regular) < 0.2 * relative(&chaotic), "{} {}", relative(&regular), relative(&chaotic));
}

#[test]
fn the_seed_decides_the_ensemble() {
    let scene = scene(&["duration=300us", "drive.cycles=15"]);
    let run = |seed: u64| ensemble::run(&scene, &EnsemblePlan::new(4, seed)).unwrap().spreads;
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
}

#[test]
fn one_run_is_no_ensemble() {
    let refused = ensemble::run(&regular(), &EnsemblePlan::new(1, 1));
    assert!(matches!(refused, Err(ensemble::EnsembleError::TooFew { found: 1 })));
}
