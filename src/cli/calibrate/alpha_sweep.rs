//! Watched numbers against α around the fitted value, on the chain.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::files::Stop;
use crate::{
    calibration::outcome::OutcomeFeature,
    feature::Measurand,
    report::sweep::{SweepCurve, SweepPoint, SweepReport},
    scene::{ModelKind, Scene},
    signal::Series,
    study::{
        Bodies, EnsemblePlan,
        ensemble::Moments,
        observation::{Observation, Watched, settings, watched_of},
        replicates::{self, perturbations},
    },
};

const POINTS: usize = 21;

/// Perturbed runs a point, of the chain alone (as many as run side by side) and in front of a disc, where a run takes ten times as long.
const REPLICATES: usize = 8;
const REPLICATES_ON_DISC: usize = 2;

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

/// Perturbed runs from half to one and a half times the fitted α.
pub struct AlphaSweep {
    measurand: Measurand,
    /// The model the fit is of.
    model: ModelKind,
    centre: f64,
    watched: Vec<Watched>,
    /// α and what each run showed there.
    points: Vec<(f64, Vec<Observation>)>,
}

impl AlphaSweep {
    /// Run `scene`, the fitted values in it, on the chain; what is left once `stop` says so is not run.
    pub fn of(scene: &Scene, measurand: Measurand, seed: u64, stop: &Stop) -> Self {
        let centre = scene.amplitude_scale;
        let plan = EnsemblePlan::new(if scene.water.is_some() { REPLICATES_ON_DISC } else { REPLICATES }, seed);
        let bodies = Bodies::new(None);
        let seen = |scene: &Scene| -> Option<Vec<Observation>> {
            let settings = settings(scene).ok()?;
            let see = |_, trace: &Series| Observation::of_trace(measurand, trace, &settings);
            let variations = perturbations(scene, &plan);
            let runs = replicates::run(&bodies, scene, &variations, STEPS_PER_PERIOD, measurand, stop, see);
            Some(runs.ok()?.into_iter().filter_map(Result::ok).collect())
        };
        let points = (0..POINTS)
            .into_par_iter()
            .map(|index| {
                let mut scene = scene.clone();
                scene.model.kind = ModelKind::Chain;
                scene.amplitude_scale = centre * (0.5 + index as f64 / (POINTS - 1) as f64);
                (scene.amplitude_scale, seen(&scene).unwrap_or_default())
            })
            .collect();
        let watched = watched_of(measurand, scene.drive.frequency);
        Self { measurand, model: scene.model.kind, centre, watched, points }
    }

    /// Mean and scatter beside the recorded `features`; `reference` names what these are.
    pub fn report(&self, features: &BTreeMap<String, OutcomeFeature>, reference: &str) -> SweepReport {
        let shown = match self.measurand {
            Measurand::Velocity => &VELOCITY,
            Measurand::Pressure => &PRESSURE,
        };
        let curves = shown.iter().filter_map(|(key, group, name)| {
            let index = self.watched.iter().position(|watched| watched.key == *key)?;
            let at = |(alpha, runs): &(f64, Vec<Observation>)| {
                let moments = Moments::of(runs.iter().map(|run| run.0[index]))?;
                Some(SweepPoint { at: *alpha, value: moments.mean, scatter: Some(moments.deviation) })
            };
            let unit = self.watched[index].unit;
            Some(SweepCurve {
                group: (*group).into(),
                name: (*name).into(),
                unit: if unit.is_empty() { "1".into() } else { unit.into() },
                points: self.points.iter().filter_map(at).collect(),
                reference: features.get(*key).and_then(|feature| feature.measured),
            })
        });
        let name =
            if self.model == ModelKind::Chain { "Amplitude scale α" } else { "Amplitude scale α on the chain" };
        SweepReport {
            name: name.into(),
            unit: "1".into(),
            curves: curves.collect(),
            reference_name: reference.into(),
            marked: Some((self.centre, "fitted".into())),
        }
    }
}
