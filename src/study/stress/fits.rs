//! Calibrations that have no answer, or only half a one.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{Limit, room::Room};
use crate::{
    calibration::{
        fit::{Fit, Verdict, fit},
        forward::{Forward, Uncertainty},
        observation::{Observation, Recording},
        parameter::Parameter,
        search::{Search, Strategy},
        twin::{Flaw, twin},
    },
    feature::{Measurand, fingerprint::FeatureSet},
    model,
    scene::Scene,
    signal::Series,
};

pub(super) fn examine(room: &mut Room<'_>) {
    if let Err(reason) = empty_half(room) {
        room.failed("half the box fails", reason);
    }
    noise(room);
    if let Err(reason) = redundant(room) {
        room.failed("two parameters, one of them without effect", reason);
    }
}

fn scene(room: &Room<'_>) -> Result<Scene, String> {
    room.scene("annulus", &["damping.kind=kuwabara-kono"])
}

fn record(scene: &Scene, parameters: &[Parameter], seed: u64) -> Result<(Recording, Vec<f64>), String> {
    let run = |scene: &Scene| model::run(scene, &mut |_| true);
    let made = twin(scene, parameters, &Uncertainty::default(), Flaw::None, 2, seed, &run);
    made.map(|made| (made.recording, made.truth.values)).map_err(|error| error.to_string())
}

fn fitted(scene: &Scene, parameters: Vec<Parameter>, recording: &Recording, seed: u64) -> Result<Fit, String> {
    let observation = Observation::new(recording, &scene.drive, FeatureSet::Full).map_err(|error| error.to_string())?;
    let watch = Arc::new(|_| true);
    let forward = Forward::new(scene, parameters, observation, Uncertainty::default(), seed, watch)
        .map_err(|error| error.to_string())?;
    let search = Search::new(&forward, 600, seed, Strategy::Likelihood);
    fit(&forward, search, None).map_err(|error| error.to_string())
}

/// 1 where a fit ends as a false answer: said to explain the record, its interval of 90 % without the truth.
fn false_answer(fit: &Fit, truth: &[f64]) -> f64 {
    let misses =
        |(estimate, truth): (&crate::calibration::fit::Estimate, &f64)| !(estimate.low..=estimate.high).contains(truth);
    let missed = fit.estimates.iter().zip(truth).any(misses);
    f64::from(u8::from(missed && fit.verdict == Verdict::WithinScatter))
}

/// α down to where the drive does not move the last bead.
fn empty_half(room: &mut Room<'_>) -> Result<(), String> {
    let which = "half the box fails";
    let scene = scene(room)?;
    let damping = Parameter::damping(scene.damping.kind).ok_or("the scene has no damping to fit")?;
    let usual = vec![Parameter::alpha(), damping.clone()];
    let (recording, truth) = record(&scene, &usual, room.plan.seed)?;
    // As many decades of nothing as the box has of something.
    let alpha = Parameter::alpha();
    let wide = Parameter { low: alpha.low * alpha.low / alpha.high, ..alpha };
    let fit = fitted(&scene, vec![wide, damping], &recording, room.plan.seed)?;
    room.check(format!("{which}: a false answer"), false_answer(&fit, &truth), Limit::AtMost(0.0), "1");
    let failed = fit.failed() as f64 / fit.runs.len() as f64;
    room.check(format!("{which}: share of runs without an answer"), failed, Limit::AtLeast(0.05), "1");
    Ok(())
}

/// A vibrometer that looks past the bead.
fn noise(room: &mut Room<'_>) {
    let which = "pure noise";
    let scene = match scene(room) {
        Ok(scene) => scene,
        Err(reason) => return room.failed(which, reason),
    };
    let mut random = ChaCha8Rng::seed_from_u64(room.plan.seed);
    let step = 4e-7;
    let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
    let values = (0..2000).map(|_| 0.02 * draw()).collect();
    let recording = Recording {
        measurand: Measurand::Velocity,
        signal: Series::new(-3e-5, step, values),
        noise_rms: 0.02,
        bandwidth: None,
        quiet: 0,
        clipped: [None; 2],
        begins_late: false,
    };
    let parameters = Parameter::damping(scene.damping.kind).map(|damping| vec![Parameter::alpha(), damping]);
    match parameters.ok_or("the scene has no damping to fit".to_owned()).and_then(|parameters| {
        let fit = fitted(&scene, parameters, &recording, room.plan.seed)?;
        Ok(fit.verdict)
    }) {
        Ok(verdict) => {
            let explained = f64::from(u8::from(verdict == Verdict::WithinScatter));
            room.check(format!("{which}: said to be explained"), explained, Limit::AtMost(0.0), "1");
        }
        Err(reason) => room.refused(which, reason, "noise"),
    }
}

/// Records of a parameter without effect: chance draws runs together along it, so one alone says little.
const REDUNDANT: u64 = 5;

/// A parameter that has no effect beside one that has: the interval of the first says nothing, that of the second holds.
fn redundant(room: &mut Room<'_>) -> Result<(), String> {
    let which = "two parameters, one of them without effect";
    let mut scene = scene(room)?;
    scene.damping.kuwabara_kono = 3660.0;
    let alpha = Parameter::alpha();
    // Of two values for α the scene takes the second.
    let twice = vec![Parameter { name: "without effect".into(), ..alpha.clone() }, alpha];
    let mut shares: Vec<f64> = Vec::new();
    let (mut widest, mut false_answers): (f64, f64) = (0.0, 0.0);
    for seed in (0..REDUNDANT).map(|number| room.plan.seed.wrapping_add(number)) {
        let (recording, truth) = record(&scene, &twice, seed)?;
        let fit = fitted(&scene, twice.clone(), &recording, seed)?;
        let share = |index: usize| {
            let (estimate, parameter) = (&fit.estimates[index], &fit.parameters[index]);
            (estimate.high / estimate.low).ln() / parameter.span()
        };
        shares.push(share(0));
        widest = widest.max(share(1));
        false_answers += false_answer(&fit, &[fit.estimates[0].value, truth[1]]);
    }
    shares.sort_by(f64::total_cmp);
    let name = format!("{which}: its interval over the box, median of five");
    // 0.9 were exact; half a decade of ignorance deceives nobody. A single one is anything from 0.03 to 0.8.
    room.check(name, shares[shares.len() / 2], Limit::AtLeast(0.5), "1");
    let name = format!("{which}: interval of the other over the box, widest of five");
    room.check(name, widest, Limit::AtMost(0.2), "1");
    room.check(format!("{which}: false answers of five"), false_answers, Limit::AtMost(0.0), "1");
    Ok(())
}
