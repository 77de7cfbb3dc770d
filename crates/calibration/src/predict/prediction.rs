//! Posterior predictive run compared with the record: one accurate run, its run-to-run standard deviation and its
//! sensitivity.
//!
//! The simulated velocity or pressure passes through the instrument model (bandwidth, sample instants, trigger) and is
//! measured by the same functions, in the same window, as the record. The trigger time drops out, because both traces
//! are aligned by their crossing of one absolute threshold.

use std::borrow::Cow;

use thiserror::Error;

use super::{
    bodies::Bodies,
    ensemble::{self, EnsembleError, EnsembleOutcome, EnsemblePlan, Spread},
    observation::{self, Observation as Watched, watched_of},
    replicates::{Watch, perturbations},
};
use crate::{
    engine::trace,
    observation::{Observation, Passband, Recording, clip},
};
use granchain_model::{ModelError, chain::ensemble::Variation, response::Response, scene::Scene};
use granchain_signal::{
    Conditioning, Resampler, Series, about_running_mean, bridge,
    feature::{
        FeatureError, FeatureSettings, Features, Measurand, Similarity, Window,
        fingerprint::{FingerprintError, MEAN_CYCLES},
        measure, similarity,
    },
    low_pass,
};

/// Periods between the trial offsets of a record with unknown alignment; each comparison searches as far to either
/// side.
const APART: f64 = 5.0;

/// Why the calibrated scene could not be compared with the record.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PredictionError {
    #[error("the accurate run at the fitted parameters failed")]
    Model(#[from] ModelError),
    #[error("the perturbed runs at the fitted parameters failed")]
    Ensemble(#[from] EnsembleError),
    #[error("the fitted response cannot be measured")]
    Feature(#[from] FeatureError),
    #[error("the accurate run at the fitted parameters cannot be aligned with the record")]
    Fingerprint(#[from] FingerprintError),
}

/// One feature of record and calibrated model.
#[derive(Debug, Clone, PartialEq)]
pub struct PredictedFeature {
    pub key: String,
    /// SI unit, `1` for a pure number.
    pub unit: String,
    pub measured: Option<f64>,
    /// Model: mean, standard deviation, sensitivity.
    pub simulated: Option<Spread>,
}

/// The calibrated scene compared with the record.
#[derive(Debug, Clone)]
pub struct PredictiveRun {
    pub response: Response,
    /// Simulated velocity (m/s) or pressure (Pa) after the instrument model, on the record's instants.
    pub simulated: Series,
    /// Record time minus model time, s.
    pub offset: f64,
    /// Window of the features, record time.
    pub window: Window,
    /// Comparison of waveforms.
    pub recorded: RecordedSide,
    /// Features of the accurate run.
    pub simulated_features: Features,
    pub features: Vec<PredictedFeature>,
    pub runs: usize,
    pub failed: usize,
}

/// The record's side of a confirmation.
#[derive(Debug, Clone)]
pub struct RecordedSide {
    pub features: Features,
    pub similarity: Similarity,
}

/// Posterior predictive runs; their scatter is that of a further record.
#[derive(Debug, Clone)]
pub struct Predicted {
    /// The scene before the fit.
    pub scene: Scene,
    /// What each run changes in it.
    pub variations: Vec<Variation>,
    /// Passband of the instrument for each; empty: no filter.
    pub passbands: Vec<Option<Passband>>,
}

/// The scene and its variations: posterior predictive, or with the plan's own jitter.
fn perturbed<'a>(
    scene: &'a Scene,
    plan: &EnsemblePlan,
    predicted: Option<&'a Predicted>,
) -> (&'a Scene, Cow<'a, [Variation]>) {
    match predicted {
        Some(predicted) => (&predicted.scene, Cow::Borrowed(&predicted.variations)),
        None => (scene, Cow::Owned(perturbations(scene, plan))),
    }
}

/// Instrument model of this record.
struct Laboratory<'a> {
    recording: &'a Recording,
    settings: FeatureSettings,
    offset: f64,
}

impl Laboratory<'_> {
    fn sees(&self, trace: &Series, passband: Option<&Passband>) -> Series {
        let passed = passband.map(|passband| passband.pass(trace));
        let onto = Conditioning { delay: self.offset, ..Conditioning::onto(&self.recording.signal) };
        let mut seen = onto.apply(passed.as_ref().unwrap_or(trace));
        clip(&mut seen.values, self.recording.clipped);
        bridge(&mut seen, &self.recording.masked);
        seen
    }

    /// Removes drift and hum as the fit does, so that features do not contain those of the instrument.
    fn settled(&self, trace: &Series) -> Series {
        let width = MEAN_CYCLES as f64 / (self.settings.drive_frequency * trace.step);
        Series::new(trace.start, trace.step, about_running_mean(&trace.values, width.round() as usize))
    }
}

/// Runs `scene` (with the fitted values) accurately and with variations, and compares both with the record. The
/// scene's own model is used, with prepared bodies if available. The variations are `predicted` if there are any
/// (posterior predictive, so that their scatter is that of a further record), else the plan's. `passband` is the
/// instrument's filter for the accurate run and for variations without their own. The runs end soon after `watch`
/// requests a stop.
pub fn predict(
    scene: &Scene,
    bodies: &Bodies,
    recording: &Recording,
    observation: &Observation,
    (plan, predicted): (&EnsemblePlan, Option<&Predicted>),
    passband: Option<Passband>,
    watch: &dyn Watch,
) -> Result<PredictiveRun, PredictionError> {
    let response = bodies.prepared(scene)?.run(scene, &mut |_| !watch.stop())?;
    let measurand = recording.measurand;
    let made = &trace(response.clone(), measurand)?;
    let filtered = low_pass(made, observation.comparison.cutoff);
    let mut offset = alignment(&observation.trace, observation)? - alignment(&filtered, observation)?;
    let driven = observation::settings(scene)?;
    let window = driven.window.unwrap_or_else(|| Window::whole(made));
    let record = &recording.signal;
    let seen_at = |offset: f64| Window { from: window.from + offset, to: window.to + offset }.on(record);
    if !observation.fingerprint.by_onset() {
        // A fall tells the offset to a period or two, and nothing tells it of a record that lies somewhere: the waveforms do.
        let period = 1.0 / scene.drive.frequency;
        let (begins, ends) = scene.drive.burst();
        let tries =
            if observation.fingerprint.falls() { 1 } else { ((ends - begins) / (APART * period)).ceil() as u32 };
        let apart = |offset: f64| {
            let laid = Series::new(made.start + offset, made.step, filtered.values.clone());
            let found = similarity(record, &laid, seen_at(offset)?, scene.drive.frequency)?;
            Ok::<_, FeatureError>((found.relative_rms_difference, offset - found.lag_s))
        };
        let found = (0..tries).filter_map(|number| apart(offset - f64::from(number) * APART * period).ok());
        offset = found.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(offset, |(_, offset)| offset);
    }
    let window = seen_at(offset)?;
    let settings = FeatureSettings {
        window: Some(window),
        band: Some(observation.comparison.cutoff),
        unit: measurand.unit().into(),
        ..driven
    };
    let noisy =
        FeatureSettings { noise_rms: recording.noise_rms, noise_bandwidth: recording.bandwidth, ..settings.clone() };
    let laboratory = Laboratory { recording, settings, offset };
    let settled = laboratory.settled(record);
    let recorded_features = measure(&settled, &noisy)?;
    let simulated = laboratory.sees(made, passband.as_ref());
    let simulated_features = measure(&laboratory.settled(&simulated), &laboratory.settings)?;
    let similarity = similarity(record, &simulated, window, scene.drive.frequency)?;

    let (varied, perturbed) = perturbed(scene, plan, predicted);
    let ensemble = ensemble::run_perturbed(bodies, varied, measurand, plan, &perturbed, watch, |replicate, trace| {
        let passband = predicted.map_or(passband.as_ref(), |predicted| predicted.passbands[replicate].as_ref());
        Watched::of_trace(measurand, &laboratory.settled(&laboratory.sees(trace, passband)), &laboratory.settings)
    })?;
    let measured = match measurand {
        Measurand::Velocity => Watched::of(&recorded_features),
        Measurand::Pressure => Watched::of_trace(measurand, &settled, &noisy)?,
    };
    let keys = watched_of(measurand, scene.drive.frequency);
    Ok(PredictiveRun {
        response,
        simulated,
        offset,
        window,
        recorded: RecordedSide { features: recorded_features, similarity },
        simulated_features,
        features: side_by_side(keys, &measured.0, &ensemble),
        runs: ensemble.runs,
        failed: ensemble.failures.len(),
    })
}

fn side_by_side(
    keys: Vec<observation::Watched>,
    measured: &[Option<f64>],
    ensemble: &EnsembleOutcome,
) -> Vec<PredictedFeature> {
    keys.into_iter()
        .zip(measured)
        .zip(&ensemble.spreads)
        .map(|((watched, measured), simulated)| PredictedFeature {
            key: watched.key,
            unit: if watched.unit.is_empty() { "1".into() } else { watched.unit.into() },
            measured: *measured,
            simulated: *simulated,
        })
        .collect()
}

/// Instant by which record and runs are laid on each other, s: of an onset interpolated linearly.
fn alignment(trace: &Series, observation: &Observation) -> Result<f64, FingerprintError> {
    let fingerprint = &observation.fingerprint;
    if fingerprint.falls() {
        let (start, step) = (trace.start, observation.trace.step);
        let count = ((trace.end() - start) / step) as usize;
        let seen = Resampler::interpolating(start, trace.step, trace.len(), start, step, count).series(&trace.values);
        return fingerprint.alignment(&seen).map(|index| seen.time(index));
    }
    let (index, threshold) = (fingerprint.alignment(trace)?, fingerprint.threshold());
    let above = trace.values[index].abs();
    let fraction = match index.checked_sub(1).map(|before| trace.values[before].abs()) {
        Some(below) => (above - threshold) / (above - below),
        None => 0.0,
    };
    Ok(trace.time(index) - fraction * trace.step)
}
