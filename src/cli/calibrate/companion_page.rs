//! The report's and the outcome's side of further records.

use std::collections::BTreeMap;

use super::{
    FittedLaw, Job,
    derived::outcome_features,
    page::{
        alignment, density_map, drive_displacement, feature_rows, horn_tip, record_label, shown_estimate,
        simulated_span,
    },
};
use crate::{
    calibration::{
        fit::Fit,
        outcome::{InputDigest, RecordOutcome, estimates_by_name, fitted_feature},
    },
    report::calibration::{InputFile, RecordReport, ShareReport},
    scene::Scene,
    study::confirmation::Confirmation,
};

/// The scene of further record `number` with the fitted values in it.
pub fn fitted_companion(law: &FittedLaw, number: usize) -> Scene {
    let mut scene = law.companions[number].clone();
    for (parameter, value) in law.fit.parameters.iter().zip(law.fit.values()) {
        parameter.set(&mut scene, value);
    }
    scene
}

/// Every further record held against the calibrated response, where that could be run.
pub fn records(job: &Job, law: &FittedLaw, confirmations: &[Option<Confirmation>]) -> Vec<RecordReport> {
    let labels = job.labels();
    let of = |(number, companion): (usize, &super::Companion)| {
        let scene = fitted_companion(law, number);
        let record = companion.measured.record();
        let label = record.map_or("recorded", record_label);
        let confirmation = confirmations.get(number).and_then(Option::as_ref);
        RecordReport {
            label: labels[number + 1].clone(),
            title: companion.measured.path().display().to_string(),
            record_label: label.into(),
            record_notes: record.filter(|_| label != "recorded").map_or_else(Vec::new, |it| it.comments.clone()),
            drive: drive_displacement(&scene),
            drive_origin: companion
                .experiment
                .drive_input()
                .map_or_else(|| "the scene's own drive".into(), |drive| drive.path.display().to_string()),
            recorded: record.map(|record| record.series.clone()),
            simulated: confirmation.map(simulated_span),
            alignment: confirmation.map_or_else(String::new, alignment),
            window: confirmation.map(|confirmation| confirmation.window),
            features: confirmation.map_or_else(Vec::new, |confirmation| {
                feature_rows(job, (&companion.measured, &companion.comparison), &scene, confirmation)
            }),
        }
    };
    job.companions.iter().enumerate().map(of).collect()
}

/// What each record says by itself.
pub fn shares(law: &FittedLaw, fit: &Fit, job: &Job) -> Vec<ShareReport> {
    let several = fit.parameters.len() > 1;
    let share = |(label, share): (String, &crate::calibration::joint::Share)| ShareReport {
        label,
        parameters: share
            .estimates
            .iter()
            .zip(&fit.parameters)
            .map(|(estimate, parameter)| shown_estimate(estimate, parameter, law.scene.damping.kind))
            .collect(),
        correlation: several.then_some(share.correlation),
        map: density_map(fit, &share.posterior),
        misfit: share.misfit,
    };
    job.labels().into_iter().zip(&fit.shares).map(share).collect()
}

/// The files of further records.
pub fn inputs(job: &Job) -> Vec<InputFile> {
    let of = |companion: &super::Companion| {
        let kind = companion.measured.record().map_or("", |record| record.kind.name());
        let record = InputFile {
            role: format!("{kind} record"),
            path: companion.measured.path().display().to_string(),
            sha256: companion.measured.sha256().into(),
        };
        std::iter::once(record).chain(companion.experiment.drive_input().map(horn_tip)).collect::<Vec<_>>()
    };
    job.companions.iter().flat_map(of).collect()
}

/// The same with their roles in the outcome: `measured-2`, `drive-2` and so on.
pub fn digests(job: &Job) -> BTreeMap<String, InputDigest> {
    let of = |(number, companion): (usize, &super::Companion)| {
        let measured = &companion.measured;
        let record = InputDigest { path: measured.path().display().to_string(), sha256: measured.sha256().into() };
        let drive = companion.experiment.drive_input().map(|drive| {
            let digest = InputDigest { path: drive.path.display().to_string(), sha256: drive.sha256.clone() };
            (format!("drive-{}", number + 2), digest)
        });
        [(format!("measured-{}", number + 2), record)].into_iter().chain(drive)
    };
    job.companions.iter().enumerate().flat_map(of).collect()
}

/// Every record in the outcome, the first one too; empty for one record.
pub fn outcomes(
    job: &Job,
    fit: &Fit,
    lead: Option<&Confirmation>,
    further: &[Option<Confirmation>],
) -> Vec<RecordOutcome> {
    let quoted = fit.verdict.explains();
    let others = job.companions.iter().zip(further);
    let others = others.map(|(it, confirmed)| (&it.measured, &it.comparison, &it.experiment, confirmed.as_ref()));
    let sides = std::iter::once((&job.measured, &job.comparison, &job.experiment, lead)).chain(others);
    let mut first = 0;
    let mut records = Vec::new();
    for ((label, share), side) in job.labels().into_iter().zip(&fit.shares).zip(sides) {
        let (measured, comparison, experiment, confirmation) = side;
        let names = comparison.names();
        let mut fitted_features = BTreeMap::new();
        for (index, name) in names.iter().enumerate().filter(|(index, _)| comparison.weights[*index] > 0.0) {
            let feature = fitted_feature(fit, first + index, comparison.measured(index), comparison.unit(index));
            fitted_features.insert(name.to_string(), feature);
        }
        first += names.len();
        records.push(RecordOutcome {
            label,
            measured: measured.path().display().to_string(),
            overrides: experiment.overrides().to_vec(),
            p_value: share.p,
            misfit: share.misfit,
            correlation: share.correlation,
            alone: estimates_by_name(&share.estimates, &fit.parameters, quoted),
            features: confirmation.map_or_else(BTreeMap::new, outcome_features),
            fitted_features,
        });
    }
    records
}
