//! Calibrations that have no answer, or only half a one.

use std::{collections::BTreeMap, fs};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{Limit, room::Room, written};
use granchain_calibration::{
    Plan, Problem, Schedule,
    bench::Bench,
    drive::RecordedDrive,
    fit::{Estimate, Fit, Verdict},
    parameter::Parameter,
    plan::{Bounds, Number},
    predict::predicted::with_causes,
    recorded_run::RecordedRunPlan,
    synthetic::vibrometer_csv,
};
use granchain_model::scene::{DampingTerm, ModelKind, Scene};
use granchain_record::ReadOptions;
use granchain_signal::Series;

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

/// Parameters by name, between bounds (SI) where some are given.
type Fitted<'a> = [(&'a str, Option<[f64; 2]>)];

fn parameters(scene: &Scene, fitted: &Fitted<'_>) -> Result<Vec<Parameter>, String> {
    let named = |(name, bounds): &(&str, Option<[f64; 2]>)| {
        let named = Parameter::named(name, scene).map_err(|error| error.to_string())?;
        Ok(named.into_iter().map(|it| bounds.map_or(it.clone(), |[low, high]| it.between(low, high))).collect())
    };
    fitted.iter().map(named).collect::<Result<Vec<Vec<_>>, String>>().map(|named| named.concat())
}

/// A record's file and its true values.
fn record(scene: &Scene, fitted: &Fitted<'_>, seed: u64) -> Result<(Vec<u8>, Vec<f64>), String> {
    written::record(scene, &parameters(scene, fitted)?, 2, seed)
}

/// As `calibrate` makes it of the record's file.
fn fitted(scene: &Scene, fitted: &Fitted<'_>, csv: &[u8], seed: u64) -> Result<Fit, String> {
    let bounds = |(name, bounds): &(&str, Option<[f64; 2]>)| {
        let [low, high] = (*bounds)?.map(Number::Plain);
        Some(((*name).to_owned(), Bounds { low, high }))
    };
    let definition = Plan {
        fit: Some(fitted.iter().map(|(name, _)| (*name).to_owned()).collect()),
        parameters: fitted.iter().filter_map(bounds).collect::<BTreeMap<_, _>>(),
        evaluations: Some(600),
        seed: Some(seed),
        ..Plan::default()
    };
    let folder = tempfile::tempdir().unwrap();
    let (file, bench) = (folder.path().join("vib.csv"), folder.path().join("scene.toml"));
    fs::write(&file, csv).unwrap();
    fs::write(&bench, scene.to_toml()).unwrap();
    let how = (RecordedDrive::read_at_plateau as _, &ReadOptions::default());
    let bench = Bench::read(&bench.display().to_string(), vec![], ModelKind::Chain, None, how);
    let bench = bench.map_err(|error| with_causes(&error))?;
    let problem = Problem::of(&definition, vec![RecordedRunPlan::of(&file, bench)]);
    let fitted = problem.and_then(|problem| problem.fit(Schedule::default())).map_err(|error| with_causes(&error))?;
    Ok(fitted.best().fit.clone())
}

/// 1 if a fit ends as a false answer: the verdict is that it explains the record, but the 90 % interval misses the true value.
fn false_answer(fit: &Fit, truth: &[f64]) -> f64 {
    let misses = |(estimate, truth): (&Estimate, &f64)| !(estimate.low..=estimate.high).contains(truth);
    let missed = fit.estimates.iter().zip(truth).any(misses);
    f64::from(u8::from(missed && fit.verdict == Verdict::WithinScatter))
}

/// α down to where the drive does not move the last bead.
fn empty_half(room: &mut Room<'_>) -> Result<(), String> {
    let which = "half the box fails";
    let scene = scene(room)?;
    let (csv, truth) = record(&scene, &[("alpha", None), ("damping", None)], 1)?;
    // As many decades of nothing as the box has of something.
    let alpha = Parameter::alpha();
    let wide = [alpha.low * alpha.low / alpha.high, alpha.high];
    let fit = fitted(&scene, &[("alpha", Some(wide)), ("damping", None)], &csv, 1)?;
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
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let step = 4e-7;
    let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
    let values = (0..2000).map(|_| 0.02 * draw()).collect();
    let csv = vibrometer_csv(&Series::new(-3e-5, step, values), &[]);
    match fitted(&scene, &[("alpha", None), ("damping", None)], &csv, 1).map(|fit| fit.verdict) {
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
    scene.damping.coefficients[DampingTerm::KuwabaraKono] = 3660.0;
    // Far below the roughness that every run draws.
    let both = [("gap", Some([1e-14, 1e-12])), ("alpha", Some([0.2, 2.0]))];
    let mut shares: Vec<f64> = Vec::new();
    let (mut widest, mut false_answers): (f64, f64) = (0.0, 0.0);
    for seed in 1..=REDUNDANT {
        let (csv, truth) = record(&scene, &both, seed)?;
        let fit = fitted(&scene, &both, &csv, seed)?;
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
