//! The report's side of further records.

use super::page::{alignment, density_map, drive_origin, feature_rows, record_label, shown_estimate, simulated_span};
use crate::{
    calibration::{FittedCandidate, Problem, drive::displacement, joint::Share, shot::Shot},
    report::calibration::{RecordReport, ShareReport},
    study::confirmation::Confirmation,
};

/// Every further record held against the calibrated response, where that could be run.
pub fn records(problem: &Problem, law: &FittedCandidate, confirmations: &[Option<Confirmation>]) -> Vec<RecordReport> {
    let labels = problem.labels();
    let of = |(number, (shot, confirmation)): (usize, (&Shot, &Option<Confirmation>))| {
        let (scene, confirmation) = (law.scene(number), confirmation.as_ref());
        let record = shot.measured.record();
        let label = record.map_or("recorded", record_label);
        RecordReport {
            label: labels[number].clone(),
            title: shot.measured.path().display().to_string(),
            record_label: label.into(),
            record_notes: record.filter(|_| label != "recorded").map_or_else(Vec::new, |it| it.comments.clone()),
            drive: displacement(&scene),
            drive_origin: drive_origin(shot),
            recorded: record.map(|record| record.series.clone()),
            simulated: confirmation.map(simulated_span),
            alignment: confirmation.map_or_else(String::new, alignment),
            window: confirmation.map(|confirmation| confirmation.window),
            features: confirmation
                .map_or_else(Vec::new, |confirmation| feature_rows(shot, problem.quantity, &scene, confirmation)),
        }
    };
    problem.shots.iter().zip(confirmations).enumerate().skip(1).map(of).collect()
}

/// What each record says by itself.
pub fn shares(law: &FittedCandidate, problem: &Problem) -> Vec<ShareReport> {
    let (fit, kind) = (&law.fit, law.candidate.scene().damping.kind);
    let several = fit.parameters.len() > 1;
    let share = |(label, share): (String, &Share)| ShareReport {
        label,
        parameters: share
            .estimates
            .iter()
            .zip(&fit.parameters)
            .map(|(estimate, parameter)| shown_estimate(estimate, parameter, kind))
            .collect(),
        correlation: several.then_some(share.correlation),
        map: density_map(fit, &share.posterior),
        misfit: share.misfit,
    };
    problem.labels().into_iter().zip(&fit.shares).map(share).collect()
}
