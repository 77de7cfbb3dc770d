//! What calibration gains: intervals hold the truth of the scene they are measured on, and a search above the chain makes the runs of its rung.

use std::sync::Arc;

use granchain::{
    calibration::{
        fit::Verdict,
        forward::{Forward, Uncertainty},
        observation::Observation,
        parameter::Parameter,
        rung::{Bodies, Rung, chain_below},
        twin::{Lab, twin_at},
    },
    feature::fingerprint::FeatureSet,
    model,
    scene::{self, Limits},
    study::{
        accuracy::{
            AccuracyError, AccuracyPlan, Study,
            gain::{Fitted, Gain, Path, Way},
            ladder::{Rung as Model, Setting, Varied},
        },
        members::{Unwatched, Watch},
    },
};

/// Three beads and a short burst: a fit takes a second.
const SMALL: [&str; 3] = ["chain.beads=3", "drive.cycles=20", "duration=420 us"];

fn study(alpha: f64) -> Study {
    let sets = SMALL.map(str::to_owned).into_iter().chain([format!("alpha={alpha}")]).collect();
    let (scene, program) = ("annulus".to_owned(), "granchain".to_owned());
    Study::new(AccuracyPlan {
        scene,
        sets,
        full: true,
        calibration: true,
        members: 2,
        seed: 1,
        limits: Limits::default(),
        program,
    })
    .unwrap()
}

fn path(setting: Setting) -> Path {
    Path { setting, way: Way::Search, budgets: &[200] }
}

fn finite(density: f64) -> Setting {
    Setting::of(Model::FiniteBody, &[(Varied::Density, density)])
}

fn outcomes(gain: &Gain) -> Vec<Fitted> {
    gain.lines[0].points[0].fits.iter().map(|fit| fit.outcome.clone().unwrap()).collect()
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn intervals_hold_the_truth_that_the_scene_has_and_no_other() {
    for alpha in [0.5, 0.7] {
        let gain = study(alpha).fits(&finite(12.0), &[path(finite(8.0))], &Unwatched).unwrap();
        let truth: Vec<(&str, f64)> = gain.truth.iter().map(|truth| (truth.name.as_str(), truth.value)).collect();
        assert_eq!(truth, [("alpha", alpha), ("damping", 0.3)]);
        let fits = outcomes(&gain);
        let holding = |d: usize, value: f64| fits.iter().filter(|fit| fit.intervals[d].holds(value)).count();
        assert!(holding(0, alpha) >= 2 && holding(1, 0.3) >= 2 && holding(0, 1.2 - alpha) == 0, "{fits:?}");
        // A drive known to half a per cent leaves α that wide or wider.
        assert!(fits.iter().all(|fit| (0.005..0.2).contains(&fit.intervals[0].width())), "{fits:?}");
        // Of 200 runs, a third of what is usual, an answer may still move; none is called wrong.
        let agrees = |verdict| matches!(verdict, Verdict::WithinScatter | Verdict::NotConverged);
        assert!(fits.iter().all(|fit| agrees(fit.verdict) && fit.runs == 200), "{fits:?}");
        // Times are those of work that was done.
        let line = &gain.lines[0];
        assert!(line.run_s > 0.0 && line.points[0].fits.iter().all(|fit| fit.fit_s > 100.0 * line.run_s), "{line:?}");
        let again = study(alpha).fits(&finite(12.0), &[path(finite(8.0))], &Unwatched).unwrap();
        assert_eq!(outcomes(&again), fits);
    }
}

#[test]
fn a_search_above_the_chain_makes_the_runs_of_its_rung() {
    let sets = SMALL.iter().map(|set| (*set).to_owned());
    let sets: Vec<String> = sets.chain(Setting::of(Model::Reduced, &[(Varied::Density, 6.0)]).sets).collect();
    let scene = scene::load("annulus", &sets).unwrap();
    let parameters = vec![Parameter::alpha(), Parameter::damping(scene.damping.kind).unwrap()];
    let bodies = Bodies::new(&scene, None).unwrap();
    let uncertainty = Uncertainty::default();
    let lab = |measurand, random: &mut _| Lab { noise: 0.01, ..Lab::draw(measurand, random) };
    let run = |scene: &scene::Scene| model::run(scene, &mut |_| true);
    let twin = twin_at(&scene, &parameters, vec![0.5, 0.3], &uncertainty, (0, 1), &lab, &run).unwrap();
    assert_eq!((twin.truth.noise, twin.truth.values.as_slice()), (0.01, &[0.5, 0.3][..]));
    let observation = Observation::new(&twin.recording, &scene.drive, FeatureSet::Full).unwrap();
    let (below, laws, watch) = (chain_below(&scene), bodies.laws.as_ref(), Arc::new(|_| true));
    let chain = Forward::with_laws(&below, laws, parameters, observation, uncertainty, 7, watch).unwrap();
    let rung = Rung::new(&chain, Arc::clone(&bodies.prepared), &scene);
    let at = [vec![0.4, 0.5], vec![0.35, 0.45]];
    let made = Forward::above(rung.clone()).run(5, &at);
    let upper: Vec<_> = rung.pairs(5, &at).unwrap().into_iter().map(|pair| pair.upper).collect();
    assert_eq!(made, upper);
    assert!(made.iter().all(|run| run.outcome.is_ok()) && made != chain.run(5, &at), "{made:?}");
    // A run depends on its number alone.
    assert_eq!(Forward::above(rung).run(6, &at[1..]), made[1..]);
}

#[test]
fn a_stopped_measurement_has_no_outcome() {
    struct Impatient;
    impl Watch for Impatient {
        fn advance(&self, _: u64) {}
        fn stop(&self) -> bool {
            true
        }
    }
    let stopped = study(0.5).fits(&finite(6.0), &[path(finite(6.0))], &Impatient);
    assert!(matches!(stopped, Err(AccuracyError::Stopped)));
}
