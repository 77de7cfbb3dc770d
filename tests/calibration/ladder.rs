//! The ladder: a search on the chain, corrected on a fidelity level above.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use granchain::{
    calibration::{
        correction::Correction,
        fidelity::{Bodies, FidelityLevel},
        fit::{Estimate, Fit, FitError, answer, corrected, to_end},
        forward::{Forward, Uncertainty, Watch},
        multi_record::MultiRecord,
        observation::{Observation, Recording},
        parameter::Parameter,
        search::Search,
    },
    feature::fingerprint::FeatureSet,
    measurement::{ReadOptions, RecordKind, read_record_bytes},
    model::{ModelError, Prepared},
    scene::{self, DampingKind, Scene},
    study::{
        self, EnsemblePlan,
        prediction::{PredictionError, predict},
        replicates,
    },
};

use crate::record::record as made;

const SEED: u64 = 5;

/// Two beads on the annulus under a short burst: a run costs a hundredth of a second on the reduced model.
fn bench(model: &[&str]) -> Scene {
    let overrides =
        ["chain.beads=2", "drive.cycles=20", "duration=420us", "damping.kind=linear", "damping.coefficient=0.4"];
    let overrides: Vec<String> = overrides.iter().chain(model).map(|text| (*text).to_owned()).collect();
    scene::load("annulus", &overrides).unwrap()
}

fn bodies(scene: &Scene) -> Arc<Prepared> {
    Bodies::new(scene, None).unwrap().prepared
}

fn parameters() -> Vec<Parameter> {
    vec![Parameter::alpha().between(0.2, 2.0), Parameter::damping(DampingKind::Linear).unwrap()]
}

/// A record of `scene` by its own model, with the truth behind it: synthetic record 1 has α = 0.30 and c = 0.16 N·s/m.
fn record(scene: &Scene) -> (Recording, Vec<f64>) {
    let (csv, values) = made(scene, &parameters(), 1, SEED).unwrap();
    let options = ReadOptions { drive_frequency: Some(scene.drive.frequency), ..ReadOptions::default() };
    let record = read_record_bytes("vib.csv".as_ref(), &csv, Some(RecordKind::Vibrometer), &options).unwrap();
    (Recording::of(&record, false), values)
}

fn forward(scene: &Scene, recording: &Recording, watch: Arc<Watch>) -> Forward {
    let observation = Observation::new(recording, &scene.drive, FeatureSet::Full).unwrap();
    Forward::new(scene, None, parameters(), observation, Uncertainty::default(), SEED, watch).unwrap()
}

fn fit(forward: &Forward, search: Search) -> Result<Fit, FitError> {
    let joint = MultiRecord::from(forward);
    answer(&joint, &to_end(joint.clone(), search, |search| search.runs.len())?)
}

/// The answer of a correction run to its end, and that correction.
fn correct(fidelity: &FidelityLevel, chain: Fit, correction: Correction) -> Result<(Fit, Correction), FitError> {
    let correction = to_end(fidelity.clone(), correction, |correction| correction.pairs.len())?;
    Ok((corrected(fidelity, chain, &correction)?, correction))
}

fn searched(forward: &Forward) -> Fit {
    fit(forward, Search::new(forward, 600, SEED)).unwrap()
}

fn holds(estimate: &Estimate, truth: f64) -> bool {
    (estimate.low..=estimate.high).contains(&truth)
}

#[test]
fn both_runs_of_a_pair_are_made_under_the_same_nuisances() {
    // The fidelity level above is here the chain's own accurate integrator: all that may differ is the fixed step.
    let scene = bench(&[]);
    let (recording, truth) = record(&scene);
    let forward = forward(&scene, &recording, Arc::new(|_| true));
    let fidelity = FidelityLevel::new(&forward, bodies(&scene), &scene);
    let at: Vec<f64> = parameters().iter().zip(&truth).map(|(parameter, value)| parameter.coordinate(*value)).collect();
    let pairs = fidelity.pairs(7, &vec![at; 6]).unwrap();
    let largest = |apart: &dyn Fn(usize) -> Vec<f64>| {
        (0..pairs.len()).flat_map(apart).fold(0.0, |most: f64, d| most.max(d.abs()))
    };
    let apart = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a - b).collect() };
    let within =
        largest(&|index| apart(pairs[index].lower.features().unwrap(), pairs[index].upper.features().unwrap()));
    let across = largest(&|index| {
        let other = &pairs[(index + 1) % pairs.len()];
        apart(pairs[index].lower.features().unwrap(), other.upper.features().unwrap())
    });
    // A fixed step of T0/160 is good to 4e-3 of the peak; a band 20 dB below it moves by ten times that in ln.
    assert!(within < 0.04, "{within}");
    assert!(across > 2.0 * within, "{across} {within}");
}

#[test]
fn a_stop_is_asked_for_within_a_batch_and_a_prediction() {
    let scene = bench(&[]);
    let (recording, truth) = record(&scene);
    // Says stop when it is asked for the fourth time.
    let asked = Arc::new(AtomicU64::new(0));
    let count = asked.clone();
    let forward = forward(&scene, &recording, Arc::new(move |_| count.fetch_add(1, Ordering::Relaxed) < 3));
    let runs = forward.run(0, &vec![vec![0.5; 2]; 64]);
    let made = runs.iter().filter(|run| run.outcome.as_ref().is_err_and(|reason| reason == "stopped")).count();
    assert_eq!((runs.len() - made, asked.load(Ordering::Relaxed)), (24, 8));
    let searched = fit(&forward, Search::new(&forward, 600, SEED));
    assert!(matches!(searched, Err(FitError::Stopped { runs: 0 })), "{searched:?}");

    struct Stopped(AtomicU64);
    impl replicates::Watch for Stopped {
        fn advance(&self, _: u64) {}
        fn stop(&self) -> bool {
            self.0.fetch_add(1, Ordering::Relaxed) >= 3
        }
    }
    let scene = Scene { amplitude_scale: truth[0], ..scene };
    let observation = Observation::new(&recording, &scene.drive, FeatureSet::Full).unwrap();
    let how = (&EnsemblePlan::new(2, SEED), None);
    let watch = Stopped(AtomicU64::new(0));
    let predicted = predict(&scene, &study::Bodies::new(None), &recording, &observation, how, None, &watch);
    assert!(matches!(predicted, Err(PredictionError::Model(ModelError::Stopped { .. }))), "{predicted:?}");
    assert_eq!(watch.0.load(Ordering::Relaxed), 4);
}

#[test]
fn the_ladder_holds_the_truth_of_a_reduced_record_that_the_chain_alone_misses() {
    let scene = bench(&["model.kind=reduced", "model.mesh_density=6"]);
    let (recording, truth) = record(&scene);
    let forward = forward(&scene, &recording, Arc::new(|_| true));
    let chain = searched(&forward);
    let [alpha, _] = chain.estimates.as_slice() else { panic!("{:?}", chain.estimates) };
    assert!(!holds(alpha, truth[0]), "{alpha:?} {truth:?}");
    let fidelity = FidelityLevel::new(&forward, bodies(&scene), &scene);
    let correction = Correction::new(&fidelity, &chain.runs, chain.runs.len(), SEED);
    let (corrected, _) = correct(&fidelity, chain, correction).unwrap();
    for (estimate, truth) in corrected.estimates.iter().zip(&truth) {
        assert!(holds(estimate, *truth), "{estimate:?} {truth}");
        assert!((estimate.high / estimate.low).ln() < 0.2, "{estimate:?}");
    }
    let below = corrected.below.unwrap();
    assert_eq!(below.differences.len(), forward.comparison.features.len());
    // The fidelity levels differ, by more than the pairs scatter about it.
    assert!(below.differences.iter().any(|feature| feature.difference.abs() > 5.0 * feature.standard_error));
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn a_correction_led_to_an_empty_place_looks_for_itself_and_finds_the_truths_place() {
    let scene = bench(&[]);
    let (recording, truth) = record(&scene);
    let forward = forward(&scene, &recording, Arc::new(|_| true));
    let fidelity = FidelityLevel::new(&forward, bodies(&scene), &scene);
    let chain = searched(&forward);
    let right = Correction::new(&fidelity, &chain.runs, chain.runs.len(), SEED);
    // What the chain found, moved into the corner of weakest drive and strongest damping, where no run resembles the record.
    let mut misled = chain.runs.clone();
    for run in &mut misled {
        run.position = vec![0.05 * run.position[0], 0.95 + 0.05 * run.position[1]];
    }
    let misled = Correction::new(&fidelity, &misled, misled.len(), SEED);
    let mut ended = Vec::new();
    for (name, correction) in [("right", right), ("misled", misled)] {
        let (fit, made) = correct(&fidelity, chain.clone(), correction).unwrap();
        for (estimate, truth) in fit.estimates.iter().zip(&truth) {
            // Without a restart α ends 0.33 off in ln. The place is what is asked for here, not the interval of one draw: the misled
            // damping's, [0.1569, 0.1609], begins 0.9 % above its truth, 0.1556.
            assert!((estimate.median / truth).ln().abs() < 0.05, "{name}: {estimate:?} {truth}");
            assert!((estimate.high / estimate.low).ln() < 0.2, "{name}: {estimate:?}");
        }
        ended.push((made.restarted.is_some(), made.rounds[0], made.rounds.get(1).copied()));
    }
    assert_eq!(ended[0], (false, 48, Some(16)));
    assert_eq!(ended[1], (true, 48, Some(96)));
}
