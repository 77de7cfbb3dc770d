//! The classifier of regimes held against what two nearby trajectories do.
//!
//! Label of a run, from the adaptive integrator and the whole state at the drive's phase 0, and so apart from the classifier's velocity, fixed step and spectrum:
//! period n where the state recurs after n periods, else chaotic or quasi-periodic by the largest Lyapunov exponent (Benettin et al., *Meccanica* 15 (1980)
//! 9: the distance of two trajectories, set back to 1e-6 of the motion after every period).

use std::collections::BTreeMap;

use granchain::{
    model::chain::{ChainModel, InitialState},
    scene::{self, Integrator, Scene},
    study::{
        Axis, Bodies, Grid,
        regime::Lanes,
        steady::Regime,
        sweep::{Run, Study, Watch, sweep_part},
    },
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

struct Quiet;

#[rustfmt::skip]
impl Watch for Quiet {
    fn finished(&self, _points: usize) {}
    fn stop(&self) -> bool { false }
}

const BENCH: [&str; 5] =
    ["model.kind=chain", "drive.kind=sine", "drive.cycles=160", "duration=2.2ms", "damping.kind=linear"];

fn bench(overrides: &[String]) -> Scene {
    let all: Vec<String> = BENCH.iter().map(|text| (*text).to_owned()).chain(overrides.iter().cloned()).collect();
    scene::load("annulus", &all).unwrap()
}

/// Exponent (per drive period) below which two trajectories stay together: what 200 periods tell from 0.
const DIVERGED: f64 = 0.02;
/// Distance of two states that are one, over the motion.
const RECURRED: f64 = 0.1;

fn label(mut scene: Scene) -> Regime {
    let period = 1.0 / scene.drive.frequency;
    (scene.duration, scene.output_step) = (period, period / 8.0);
    scene.model.integrator = Integrator::DormandPrince853 { tolerance: 1e-9 };
    let beads = scene.chain.beads.len();
    let reach = scene.drive.amplitude * scene.amplitude_scale;
    let speed = std::f64::consts::TAU * scene.drive.frequency * reach;
    // A drive of whole periods goes on where it began.
    let next = |state: &InitialState| {
        let response = ChainModel.run_from(&scene, state, &mut |_| true).unwrap();
        let last = |of: &[granchain::signal::Series]| of.iter().map(|series| *series.values.last().unwrap()).collect();
        InitialState { displacements: last(&response.bead_displacement), velocities: last(&response.bead_velocity) }
    };
    let apart = |a: &InitialState, b: &InitialState| {
        let part =
            |a: &[f64], b: &[f64], scale: f64| a.iter().zip(b).map(|(a, b)| ((a - b) / scale).powi(2)).sum::<f64>();
        (part(&a.displacements, &b.displacements, reach) + part(&a.velocities, &b.velocities, speed)).sqrt()
    };
    let mut state = InitialState::at_rest(beads);
    for _ in 0..150 {
        state = next(&state);
    }
    let near = 1e-6;
    let mut other = state.clone();
    other.displacements.iter_mut().for_each(|x| *x += near * reach / (beads as f64).sqrt());
    let (mut growth, mut section) = (Vec::new(), Vec::new());
    for _ in 0..200 {
        (state, other) = (next(&state), next(&other));
        let distance = apart(&state, &other).max(f64::MIN_POSITIVE);
        growth.push((distance / near).ln());
        let back =
            |x: &mut [f64], y: &[f64]| x.iter_mut().zip(y).for_each(|(x, y)| *x = y + (*x - y) * near / distance);
        back(&mut other.displacements, &state.displacements);
        back(&mut other.velocities, &state.velocities);
        section.push(state.clone());
    }
    let late = &section[100..];
    let recurs = |after: &usize| late.iter().zip(&late[*after..]).all(|(a, b)| apart(a, b) < RECURRED);
    // The first periods turn the difference to where it grows most.
    let exponent = growth[20..].iter().sum::<f64>() / (growth.len() - 20) as f64;
    match (1..=12).find(recurs) {
        Some(after) => Regime::Period(after as u32),
        None if exponent > DIVERGED => Regime::Chaotic,
        None => Regime::QuasiPeriodic,
    }
}

/// Shares of random points over α and damping whose label is the regime found, and is chaotic where that is.
fn compare(count: usize, seed: u64) -> [f64; 2] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut value = |low: f64, high: f64| format!("{:.5}", random.random_range(low..high));
    let points: Vec<[String; 2]> = (0..count)
        .map(|_| [format!("alpha={}", value(0.1, 1.6)), format!("damping.coefficient={}", value(0.2, 1.2))])
        .collect();
    // The grid counts; the scenes are those of the points.
    let grid = Grid::new(vec![Axis::parse(&format!("chain.beads=1:{count}:1")).unwrap()]).unwrap();
    let build = |overrides: &[String]| -> Result<Scene, scene::SceneError> {
        let number: f64 = overrides[0].split_once('=').unwrap().1.parse().unwrap();
        Ok(bench(&points[number as usize - 1]))
    };
    let study = Study::Regime(Lanes::new(false));
    let runs = sweep_part(&grid, 0..count, &build, &Bodies::new(None), &study, &Quiet).unwrap();
    let labels: Vec<Regime> = points.par_iter().map(|point| label(bench(point))).collect();
    let mut confusion: BTreeMap<(Regime, Regime), usize> = BTreeMap::new();
    for (run, label) in runs.iter().zip(&labels) {
        let Run::Finished { motion: Some(motion), .. } = run else { panic!("{run:?}") };
        *confusion.entry((*label, motion.regime)).or_default() += 1;
    }
    for ((label, found), number) in &confusion {
        println!("label {label}, found {found}: {number}");
    }
    let chaotic = |regime: &Regime| *regime == Regime::Chaotic;
    let share = |alike: &dyn Fn(&Regime, &Regime) -> bool| {
        let agree: usize =
            confusion.iter().filter(|((label, found), _)| alike(label, found)).map(|(_, number)| number).sum();
        agree as f64 / count as f64
    };
    [share(&|label, found| label == found), share(&|label, found| chaotic(label) == chaotic(found))]
}

#[test]
fn the_regime_is_what_two_nearby_trajectories_say() {
    let [same, chaos] = compare(20, 1);
    assert!(same >= 0.9 && chaos >= 0.9, "{same} {chaos}");
}

/// Measured with this seed: 0.935 and 0.985. What differs is mostly a weak subharmonic: the fixed step moves the limit between periods 1, 2, 3 and 6.
#[test]
#[ignore = "a minute: 200 runs, with two trajectories each"]
fn the_regime_of_200_runs_is_what_two_nearby_trajectories_say() {
    let [same, chaos] = compare(200, 3);
    assert!(same >= 0.9 && chaos >= 0.95, "{same} {chaos}");
}
