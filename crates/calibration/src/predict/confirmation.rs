//! The calibrated scene held against the record: the accurate integrator once, its chaos floor, its sensitivity.
//!
//! The simulated velocity, or pressure, passes through the lab's own chain (bandwidth, the lab's instants, its trigger) and is then
//! measured by the same functions, in the same window, as the record. The trigger drops out by the onset: both traces
//! cross one absolute threshold.
//!
//! Where only published numbers exist there is no lab to pass through: the velocity is low-passed as in the fit and
//! measured in the model's own time, and the printed values stand where the record's would.

use std::borrow::Cow;

use thiserror::Error;

use super::{
    bodies::Bodies,
    ensemble::{self, EnsembleError, EnsembleOutcome, EnsemblePlan, STEPS_PER_PERIOD, Spread},
    members::{Watch, perturbations},
    observation::{self, Observation as Watched, watched_of},
};
use crate::{
    engine::trace,
    observation::{Observation, Passband, Recording, clip},
    printed::Printed,
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

/// Periods between the offsets at which a record is laid that may lie anywhere: a likeness looks as far to either side.
const APART: f64 = 5.0;

/// Why a calibrated scene could not be confirmed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ConfirmationError {
    #[error("the accurate run at the fitted parameters failed")]
    Model(#[from] ModelError),
    #[error("the perturbed runs at the fitted parameters failed")]
    Ensemble(#[from] EnsembleError),
    #[error("the fitted response cannot be measured")]
    Feature(#[from] FeatureError),
    #[error("the accurate run at the fitted parameters cannot be laid on the record")]
    Fingerprint(#[from] FingerprintError),
}

/// One watched number: of the record, and of the calibrated model.
#[derive(Debug, Clone, PartialEq)]
pub struct ConfirmedFeature {
    /// Key, such as `line_1/3`.
    pub key: String,
    /// SI unit, `1` for a pure number.
    pub unit: String,
    /// Of the record, or as printed.
    pub measured: Option<f64>,
    /// Of the model: mean, scatter, sensitivity.
    pub simulated: Option<Spread>,
}

/// The calibrated scene held against the record.
#[derive(Debug, Clone)]
pub struct Confirmation {
    pub response: Response,
    /// Its pole velocity (m/s) or its pressure (Pa) as the lab would have recorded it, on the record's instants; low-passed only where there
    /// is no record.
    pub simulated: Series,
    /// Record time minus model time, s; 0 where there is no record.
    pub offset: f64,
    /// Where features were measured, record time.
    pub window: Window,
    /// What only a waveform can be compared by.
    pub recorded: Option<RecordedSide>,
    /// Features of the accurate run.
    pub simulated_features: Features,
    /// Watched numbers side by side.
    pub features: Vec<ConfirmedFeature>,
    pub runs: usize,
    pub failed: usize,
}

/// The record's side of a confirmation.
#[derive(Debug, Clone)]
pub struct RecordedSide {
    pub features: Features,
    /// How alike the waveforms are.
    pub similarity: Similarity,
}

/// Further runs of the bench as a fit leaves them open: their scatter is that of a further record.
#[derive(Debug, Clone)]
pub struct Predicted {
    /// The scene as it was before the fit.
    pub scene: Scene,
    /// What each run changes in it.
    pub variations: Vec<Variation>,
    /// What the instrument lets through of each; none lets all through.
    pub passbands: Vec<Option<Passband>>,
}

/// The scene that is run perturbed, and how: what a fit predicts, else the plan's own jitter.
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

/// The lab as it saw this record: what every simulated trace passes through.
struct Laboratory<'a> {
    recording: &'a Recording,
    settings: FeatureSettings,
    offset: f64,
}

impl Laboratory<'_> {
    fn sees(&self, trace: &Series, passband: Option<Passband>) -> Series {
        let passed = passband.map(|passband| passband.pass(trace));
        let onto = Conditioning { delay: self.offset, ..Conditioning::onto(&self.recording.signal) };
        let mut seen = onto.apply(passed.as_ref().unwrap_or(trace));
        clip(&mut seen.values, self.recording.clipped);
        bridge(&mut seen, &self.recording.masked);
        seen
    }

    /// As the fit's features have it: what is measured of a record must not be its instrument's hum.
    fn settled(&self, trace: &Series) -> Series {
        let width = MEAN_CYCLES as f64 / (self.settings.drive_frequency * trace.step);
        Series::new(trace.start, trace.step, about_running_mean(&trace.values, width.round() as usize))
    }
}

/// Run `scene` (with the fitted values in it) accurately and perturbed, and hold both against the record; on the model
/// it asks for, whose bodies may be ready already. The perturbed runs are `predicted` where there are any, drawn from what a fit leaves open (their
/// scatter is then that of a further record), else the plan's. `passband` is what the instrument lets through of the accurate run, and of runs that
/// are not predicted. It ends soon after `watch` says stop.
///
/// # Errors
/// When the accurate run fails, is stopped or cannot be compared.
pub fn confirm(
    scene: &Scene,
    bodies: &Bodies,
    recording: &Recording,
    observation: &Observation,
    (plan, predicted): (&EnsemblePlan, Option<&Predicted>),
    passband: Option<Passband>,
    watch: &dyn Watch,
) -> Result<Confirmation, ConfirmationError> {
    let response = bodies.prepared(scene)?.run(scene, &mut |_| !watch.stop())?;
    let measurand = recording.measurand;
    let made = &trace(response.clone(), measurand)?;
    let filtered = low_pass(made, observation.cutoff);
    let mut offset = landmark(&observation.trace, observation)? - landmark(&filtered, observation)?;
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
        band: Some(observation.cutoff),
        unit: measurand.unit().into(),
        ..driven
    };
    let noisy =
        FeatureSettings { noise_rms: recording.noise_rms, noise_bandwidth: recording.bandwidth, ..settings.clone() };
    let laboratory = Laboratory { recording, settings, offset };
    let settled = laboratory.settled(record);
    let recorded_features = measure(&settled, &noisy)?;
    let simulated = laboratory.sees(made, passband);
    let simulated_features = measure(&laboratory.settled(&simulated), &laboratory.settings)?;
    let similarity = similarity(record, &simulated, window, scene.drive.frequency)?;

    let (varied, perturbed) = perturbed(scene, plan, predicted);
    let seen_as = (measurand, STEPS_PER_PERIOD);
    let ensemble = ensemble::run_perturbed(bodies, varied, seen_as, plan, &perturbed, watch, |member, trace| {
        let passband = predicted.map_or(passband, |predicted| predicted.passbands[member]);
        Watched::of_trace(measurand, &laboratory.settled(&laboratory.sees(trace, passband)), &laboratory.settings)
    })?;
    let measured = match measurand {
        Measurand::Velocity => Watched::of(&recorded_features),
        Measurand::Pressure => Watched::of_trace(measurand, &settled, &noisy)?,
    };
    let keys = watched_of(measurand, scene.drive.frequency);
    Ok(Confirmation {
        response,
        simulated,
        offset,
        window,
        recorded: Some(RecordedSide { features: recorded_features, similarity }),
        simulated_features,
        features: side_by_side(keys, &measured.0, &ensemble),
        runs: ensemble.runs,
        failed: ensemble.failures.len(),
    })
}

/// Run `scene` (with the fitted values in it) accurately and perturbed, and hold both against published numbers; on
/// the model it asks for, whose bodies may be ready already. `predicted` and `watch` as of [`confirm`].
///
/// # Errors
/// When the accurate run fails or cannot be measured.
pub(crate) fn confirm_printed(
    scene: &Scene,
    bodies: &Bodies,
    printed: &Printed,
    (plan, predicted): (&EnsemblePlan, Option<&Predicted>),
    watch: &dyn Watch,
) -> Result<Confirmation, ConfirmationError> {
    let response = bodies.prepared(scene)?.run(scene, &mut |_| !watch.stop())?;
    let window = printed.window();
    let settings =
        FeatureSettings { band: Some(printed.cutoff()), ..FeatureSettings::velocity(scene.drive.frequency, window) };
    let simulated = low_pass(response.observed_velocity(), printed.cutoff());
    let simulated_features = measure(&simulated, &settings)?;
    let (varied, perturbed) = perturbed(scene, plan, predicted);
    let seen_as = (Measurand::Velocity, STEPS_PER_PERIOD);
    let ensemble = ensemble::run_perturbed(bodies, varied, seen_as, plan, &perturbed, watch, |_, velocity| {
        Watched::measure(&low_pass(velocity, printed.cutoff()), &settings)
    })?;
    let measured: Vec<Option<f64>> = observation::watched().iter().map(|watched| printed.value(&watched.key)).collect();
    Ok(Confirmation {
        response,
        simulated,
        offset: 0.0,
        window,
        recorded: None,
        simulated_features,
        features: side_by_side(observation::watched(), &measured, &ensemble),
        runs: ensemble.runs,
        failed: ensemble.failures.len(),
    })
}

fn side_by_side(
    keys: Vec<observation::Watched>,
    measured: &[Option<f64>],
    ensemble: &EnsembleOutcome,
) -> Vec<ConfirmedFeature> {
    keys.into_iter()
        .zip(measured)
        .zip(&ensemble.spreads)
        .map(|((watched, measured), simulated)| ConfirmedFeature {
            key: watched.key,
            unit: if watched.unit.is_empty() { "1".into() } else { watched.unit.into() },
            measured: *measured,
            simulated: *simulated,
        })
        .collect()
}

/// Instant by which record and runs are laid on each other, s: of an onset interpolated linearly.
fn landmark(trace: &Series, observation: &Observation) -> Result<f64, FingerprintError> {
    let fingerprint = &observation.fingerprint;
    if fingerprint.falls() {
        let (start, step) = (trace.start, observation.trace.step);
        let count = ((trace.end() - start) / step) as usize;
        let seen = Resampler::interpolating(start, trace.step, trace.len(), start, step, count).series(&trace.values);
        return fingerprint.landmark(&seen).map(|index| seen.time(index));
    }
    let (index, threshold) = (fingerprint.landmark(trace)?, fingerprint.threshold());
    let above = trace.values[index].abs();
    let fraction = match index.checked_sub(1).map(|before| trace.values[before].abs()) {
        Some(below) => (above - threshold) / (above - below),
        None => 0.0,
    };
    Ok(trace.time(index) - fraction * trace.step)
}
