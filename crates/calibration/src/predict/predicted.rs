//! Posterior predictive run of a calibration, compared with every record, and the resulting `calibration.json`.

use std::{collections::BTreeMap, sync::Arc};

use rayon::prelude::*;

use super::{
    bodies::Bodies,
    ensemble::EnsemblePlan,
    prediction::{Predicted, PredictedFeature, PredictionError, PredictiveRun, predict},
    replicates,
};
use crate::{
    Fitted, FittedCandidate, Problem,
    diagnosis::Diagnosis,
    fidelity::reduced_below,
    forward::{Forward, Watch},
    measured::Measured,
    observation::{MIDDLE, Passband},
    outcome::{CalibrationOutcome, OutcomeFeature},
    recorded_run::RecordedRun,
};
use granchain_model::{reduced::Cache, scene::Scene};

/// Perturbed chain runs at each of three drive levels for the feature table.
const REPLICATES: usize = 24;

/// The same on a fidelity level above.
const UPPER_REPLICATES: usize = 8;

/// Compares `scene` with the measurement, on the scene's own model; runs without a predicted passband are filtered by
/// `passband`, or as their record states.
pub fn predict_measured(
    measured: &Measured,
    scene: &Scene,
    bodies: &Bodies,
    how: (&EnsemblePlan, Option<&Predicted>),
    passband: Option<Passband>,
    watch: &dyn replicates::Watch,
) -> Result<PredictiveRun, PredictionError> {
    let passband = passband.or_else(|| measured.recording.passband());
    predict(scene, bodies, &measured.recording, &measured.observation, how, passband, watch)
}

/// The answer compared with every record.
#[derive(Debug, Clone)]
pub struct Predictions {
    /// One per record; `None` if the run failed or cannot be compared.
    pub predictions: Vec<Option<PredictiveRun>>,
    pub failures: Vec<String>,
    /// Likely causes if the fit does not explain the first record, most likely first.
    pub diagnosis: Diagnosis,
}

impl Predictions {
    /// Runs the best candidate's answer, with bodies from `cache` if present; `watch` can stop it. Causes are looked for apart
    /// ([`Fitted::diagnose`]).
    pub fn of(problem: &Problem, fitted: &Fitted, cache: Option<Cache>, watch: Arc<Watch>) -> Self {
        let best: &FittedCandidate = fitted.best();
        let fidelities = &fitted.best_made().fidelities;
        let replicates = if fidelities.is_empty() { REPLICATES } else { UPPER_REPLICATES };
        let plan = EnsemblePlan::new(replicates, problem.seed);
        let forwards = &fitted.best_made().joint.records;
        let drawn = |forward: &Forward| match fidelities.is_empty() {
            true => forward.predicted(&best.fit.posterior, replicates),
            false => forward.clone().in_blocks().predicted(&best.fit.posterior, replicates),
        };
        let ready = fidelities.iter().map(|fidelity| Arc::clone(fidelity.prepared()));
        let bodies = ready.fold(Bodies::new(cache), Bodies::holding);
        let recorded_runs = problem.recorded_runs.par_iter().enumerate();
        let predict = |(number, recorded_run): (usize, &RecordedRun)| {
            let (variations, passbands) = drawn(&forwards[number]).into_iter().unzip();
            let scene = &best.candidate.scenes[number];
            // How runs scatter, the reduced model tells as well as finite elements do.
            let scene = reduced_below(scene).unwrap_or_else(|| scene.clone());
            let predicted = Predicted { scene, variations, passbands };
            let passband = forwards[number].passband(&best.fit.position(), || MIDDLE);
            let how = (&plan, Some(&predicted));
            predict_measured(&recorded_run.measured, &best.scene(number), &bodies, how, passband, &|| !watch(0))
                .map_err(|error| {
                    let place = if number == 0 {
                        String::new()
                    } else {
                        format!("{}: ", recorded_run.measured.path().display())
                    };
                    place + &with_causes(&error)
                })
        };
        let predicted: Vec<Result<PredictiveRun, String>> = recorded_runs.map(predict).collect();
        let failures = predicted.iter().filter_map(|it| it.as_ref().err().cloned()).collect();
        let predictions = predicted.into_iter().map(Result::ok).collect();
        Self { predictions, failures, diagnosis: Diagnosis::default() }
    }

    pub fn outcome(&self, problem: &Problem, fitted: &Fitted) -> CalibrationOutcome {
        let mut outcome = fitted.outcome(problem);
        let mut features =
            self.predictions.iter().map(|predicted| predicted.as_ref().map(features).unwrap_or_default());
        for (record, features) in outcome.best.records.iter_mut().zip(features.clone()) {
            record.features = features;
        }
        outcome.best.features = features.next().unwrap_or_default();
        outcome.statements.extend(self.failures.iter().cloned());
        outcome.diagnosis.clone_from(&self.diagnosis.findings);
        if self.diagnosis.stopped {
            outcome.statements.push(
                "The causes were not searched to the end: the search was stopped, and none is named. The same command finds them.".into(),
            );
        }
        outcome.best.fidelities = fitted.best().fidelities(problem);
        outcome.laws[0].fidelities.clone_from(&outcome.best.fidelities);
        outcome
    }
}

/// An error with its causes.
pub fn with_causes(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(error.source(), |cause| cause.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}

fn features(prediction: &PredictiveRun) -> BTreeMap<String, OutcomeFeature> {
    let entry = |feature: &PredictedFeature| {
        let simulated = feature.simulated.as_ref();
        let row = OutcomeFeature {
            measured: feature.measured,
            simulated: simulated.map(|spread| spread.mean),
            scatter: simulated.map(|spread| spread.scatter),
            sensitivity: simulated.map(|spread| spread.sensitivity),
            unit: feature.unit.clone(),
        };
        (feature.key.clone(), row)
    };
    prediction.features.iter().map(entry).collect()
}
