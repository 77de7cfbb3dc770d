//! Watched numbers against α around the fitted value, on the chain.

use rayon::prelude::*;

use crate::{
    calibration::outcome::CalibrationOutcome,
    feature::Measurand,
    report::sweep::{SweepCurve, SweepPoint, SweepReport},
    scene::{ModelKind, Scene},
    signal::Series,
    study::{
        Bodies, EnsemblePlan,
        ensemble::Moments,
        members::{self, Unwatched, perturbations},
        observation::{Observation, settings, watched_of},
    },
};

/// Points of the sweep.
const POINTS: usize = 21;

/// Perturbed runs a point, of the chain alone (as many as run side by side) and in front of a disc, where a run takes ten times as long.
const MEMBERS: usize = 8;
const MEMBERS_ON_DISC: usize = 2;

/// Steps of the chain a drive period: a curve and its scatter are drawn, no slope is taken.
const STEPS_PER_PERIOD: u32 = 160;

/// What the sweep shows of a velocity: key, panel, curve.
const VELOCITY: [(&str, &str, &str); 6] = [
    ("positive_peak", "Peak velocity", "positive"),
    ("negative_peak", "Peak velocity", "negative"),
    ("ratio_1/3", "Line ratio to the drive line", "1/3"),
    ("ratio_1/2", "Line ratio to the drive line", "1/2"),
    ("ratio_2/3", "Line ratio to the drive line", "2/3"),
    ("line_1", "Line amplitude", "1"),
];

/// The same of a pressure.
const PRESSURE: [(&str, &str, &str); 6] = [
    ("positive_peak", "Peak pressure", "positive"),
    ("negative_peak", "Peak pressure", "negative"),
    ("line_1", "Amplitude of the harmonics", "1"),
    ("line_2", "Amplitude of the harmonics", "2"),
    ("line_4", "Amplitude of the harmonics", "4"),
    ("line_8", "Amplitude of the harmonics", "8"),
];

/// From half to one and a half times the fitted α, mean and scatter; `reference` names what the recorded values are.
pub fn alpha_sweep(scene: &Scene, outcome: &CalibrationOutcome, reference: &str) -> Option<SweepReport> {
    let measurand = outcome.quantity;
    let centre = scene.amplitude_scale;
    let on_disc = scene.water.is_some();
    let plan = EnsemblePlan::new(if on_disc { MEMBERS_ON_DISC } else { MEMBERS }, outcome.seed);
    let keys = watched_of(measurand, scene.drive.frequency);
    let bodies = Bodies::new(None);
    let seen = |scene: &Scene| -> Option<Vec<Observation>> {
        let settings = settings(scene).ok()?;
        let see = |_, trace: &Series| Observation::of_trace(measurand, trace, &settings);
        let variations = perturbations(scene, &plan);
        let runs = members::run(&bodies, scene, &variations, STEPS_PER_PERIOD, measurand, &Unwatched, see);
        Some(runs.ok()?.into_iter().filter_map(Result::ok).collect())
    };
    let points: Vec<(f64, Vec<Observation>)> = (0..POINTS)
        .into_par_iter()
        .map(|index| {
            let mut scene = scene.clone();
            scene.model.kind = ModelKind::Chain;
            scene.amplitude_scale = centre * (0.5 + index as f64 / (POINTS - 1) as f64);
            (scene.amplitude_scale, seen(&scene).unwrap_or_default())
        })
        .collect();
    let swept = match measurand {
        Measurand::Velocity => &VELOCITY,
        Measurand::Pressure => &PRESSURE,
    };
    let curves = swept.iter().filter_map(|(key, group, name)| {
        let index = keys.iter().position(|watched| watched.key == *key)?;
        let at = |(alpha, runs): &(f64, Vec<Observation>)| {
            let moments = Moments::of(runs.iter().map(|run| run.0[index]))?;
            Some(SweepPoint { at: *alpha, value: moments.mean, scatter: Some(moments.deviation) })
        };
        Some(SweepCurve {
            group: (*group).into(),
            name: (*name).into(),
            unit: if keys[index].unit.is_empty() { "1".into() } else { keys[index].unit.into() },
            points: points.iter().filter_map(at).collect(),
            reference: outcome.best.features.get(*key).and_then(|feature| feature.measured),
        })
    });
    Some(SweepReport {
        name: if scene.model.kind == ModelKind::Chain {
            "Amplitude scale α".into()
        } else {
            "Amplitude scale α on the chain".into()
        },
        unit: "1".into(),
        curves: curves.collect(),
        reference_name: reference.into(),
        marked: Some((centre, "fitted".into())),
    })
}
