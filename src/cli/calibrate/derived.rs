//! From runs to everything that a calibration leaves behind: what `calibrate` writes, and what `report verify` holds a folder against.

use std::collections::BTreeMap;

use anyhow::anyhow;

use super::{
    Candidate, ConfirmChoice, Job, companion_page, fitted_scene, manifest,
    measured::Instrument,
    page,
    rungs::{self, Fitted, FittedLaw, SavedFit, fit_candidates},
};
use crate::{
    calibration::{
        fingerprints,
        fit::Fit,
        outcome::{self, CalibrationOutcome, InputDigest, LawOutcome, OutcomeFeature, RungOutcome},
        rung::Bodies,
        statement,
    },
    cli::{arguments::Session, interrupt, summary, timing::Timing},
    report::page::Files,
    study::{self, EnsemblePlan, confirmation::Confirmation},
};

/// Perturbed runs of the chain at each of three drive levels behind the feature table.
const CONFIRMATION_MEMBERS: usize = 24;

/// The same of a rung above.
const UPPER_MEMBERS: usize = 8;

/// Everything but the times.
pub struct Derived {
    /// What `calibration.json` says.
    pub outcome: CalibrationOutcome,
    /// Every file, the manifest last.
    pub files: Files,
}

/// Fit every candidate from where it was saved.
///
/// # Errors
/// Bodies that cannot be made ready; as [`fit_candidates`].
pub fn fitted(job: &Job, saved: Vec<SavedFit>, session: &Session, timing: &mut Timing) -> anyhow::Result<Fitted> {
    let bodies = job.upper.map(|_| Bodies::new(&job.candidates[0].scene, session.cache().as_ref())).transpose()?;
    if let Some(warning) = bodies.as_ref().and_then(|bodies| bodies.prepared.warning()) {
        session.note(format_args!("warning: {warning}"));
    }
    timing.stage("prepare");
    fit_candidates(job, saved, bodies.as_ref(), session, timing)
}

/// Run the answer with the accurate integrator, hold it against the records, and make every file.
///
/// # Errors
/// Ctrl-C; a run of `--confirm` that fails; a report that cannot be drawn.
pub fn derive(job: &Job, fitted: &Fitted, session: &Session, timing: &mut Timing) -> anyhow::Result<Derived> {
    let (laws, best) = (&fitted.laws, best_law(&fitted.laws));
    let calibrated = fitted_scene(&laws[best]);
    let upper = laws[best].upper.as_ref().map(|rung| rung.prepared().clone());
    let members = if upper.is_some() { UPPER_MEMBERS } else { CONFIRMATION_MEMBERS };
    let shared = study::Bodies::new(session.cache());
    let shared = upper.into_iter().fold(shared, study::Bodies::holding);
    let plan = EnsemblePlan::new(members, session.seed());
    let seen_by = Instrument::of(&laws[best].fit);
    let confirmation = job.measured.confirm(&calibrated, &shared, &plan, seen_by);
    let (confirmation, mut unconfirmed) = match confirmation {
        Ok(confirmation) => (Some(confirmation), vec![]),
        Err(error) => (None, vec![format!("{:#}", anyhow!(error))]),
    };
    let mut further = Vec::new();
    for (number, companion) in job.companions.iter().enumerate() {
        let scene = companion_page::fitted_companion(&laws[best], number);
        match companion.measured.confirm(&scene, &shared, &plan, seen_by) {
            Ok(confirmation) => further.push(Some(confirmation)),
            Err(error) => {
                unconfirmed.push(format!("{}: {:#}", companion.measured.path().display(), anyhow!(error)));
                further.push(None);
            }
        }
    }
    let confirmed = (confirmation.as_ref(), further.as_slice());
    interrupt::check()?;
    timing.stage("confirm");
    let fea =
        job.definition.confirm.map(|ConfirmChoice::Fea| rungs::confirm_by_fea(&laws[best], session)).transpose()?;
    if fea.is_some() {
        timing.stage("fea");
    }
    let rungs = rungs::outcome(job, &laws[best], fea.as_deref());
    let outcome = outcome_of(job, fitted, best, confirmed, unconfirmed, rungs, session.seed());
    let report = page::report(job, laws, best, confirmed, &outcome, fea.as_deref())?;
    let mut files: Files = vec![("calibration.json".into(), summary::json(&outcome)?)];
    files.extend(report.files()?);
    let runs: Vec<_> = fitted.made.iter().map(|made| made.runs.clone()).collect();
    files.push((fingerprints::FILE.into(), fingerprints::to_csv(&rungs::names(job), &runs)?));
    let manifest = manifest::Manifest::of(job, &files)?;
    files.push((manifest::FILE.into(), summary::json(&manifest)?));
    timing.stage("report");
    Ok(Derived { outcome, files })
}

/// The law a report leads with: one that explains the record before one that does not, then by evidence.
fn best_law(laws: &[FittedLaw]) -> usize {
    let rank = |law: &FittedLaw| (law.fit.verdict.explains(), law.fit.log_evidence);
    (0..laws.len())
        .max_by(|&a, &b| {
            let (a, b) = (rank(&laws[a]), rank(&laws[b]));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        })
        .unwrap_or(0)
}

fn outcome_of(
    job: &Job,
    fitted: &Fitted,
    best: usize,
    (confirmation, further): (Option<&Confirmation>, &[Option<Confirmation>]),
    unconfirmed: Vec<String>,
    rungs: Vec<RungOutcome>,
    seed: u64,
) -> CalibrationOutcome {
    let laws = &fitted.laws;
    let law = &laws[best];
    let fit = &law.fit;
    let mut statements = statement::statements(fit);
    statements.extend(statement::together(fit, &job.labels()));
    statements
        .extend(job.measured.features().into_iter().flat_map(|features| statement::printed(fit, &features.printed)));
    statements.extend(unconfirmed);
    let names = job.comparison.names();
    let fitted_features = names.iter().enumerate().filter(|(index, _)| job.comparison.weights[*index] > 0.0);
    let mut inputs = BTreeMap::from([(
        "measured".to_owned(),
        InputDigest { path: job.measured.path().display().to_string(), sha256: job.measured.sha256().into() },
    )]);
    if let Some(drive) = job.experiment.drive_input() {
        let digest = InputDigest { path: drive.path.display().to_string(), sha256: drive.sha256.clone() };
        inputs.insert("drive".into(), digest);
    }
    inputs.extend(companion_page::digests(job));
    let by_law: Vec<(String, &Fit)> = laws.iter().map(|law| (law.kind.clone(), &law.fit)).collect();
    let mount = |law: &FittedLaw| law.mount.map(|mount| mount.name().to_owned());
    let by_mount: Vec<(String, &Fit)> = laws.iter().filter_map(|law| Some((mount(law)?, &law.fit))).collect();
    let several = |value: fn(&Candidate) -> String| {
        job.candidates.iter().any(|candidate| value(candidate) != value(&job.candidates[0]))
    };
    let without_fit: Vec<String> = fitted
        .excluded
        .iter()
        .filter_map(|(candidate, _)| candidate.mount)
        .map(|mount| mount.name().to_owned())
        .filter(|name| by_mount.iter().all(|(fitted, _)| fitted != name))
        .collect();
    let decision = |named: Option<String>| named.unwrap_or_else(|| "undecided".into());
    let mut ranked: Vec<&FittedLaw> = laws.iter().collect();
    ranked.sort_by_key(|other| !std::ptr::eq(*other, law));
    CalibrationOutcome {
        program: job.program.clone(),
        scene: job.experiment.source().into(),
        overrides: job.experiment.overrides().to_vec(),
        model: job.model().into(),
        rungs,
        quantity: job.definition.quantity,
        damping_kind: law.kind.clone(),
        mount: mount(law),
        verdict: fit.verdict,
        parameters: outcome::fitted_parameters(fit),
        correlation: fit.correlation,
        correlations: outcome::correlations(fit),
        p_value: fit.agreement.p,
        misfit: fit.misfit,
        features: confirmation.map_or_else(BTreeMap::new, outcome_features),
        fitted_features: fitted_features
            .map(|(index, name)| {
                let (measured, unit) = (job.comparison.measured(index), job.comparison.unit(index));
                (name.to_string(), outcome::fitted_feature(fit, index, measured, unit))
            })
            .collect(),
        records: companion_page::outcomes(job, fit, confirmation, further),
        lobes: outcome::lobes(fit),
        evaluations: fit.total_runs() as u64,
        failed_runs: fit.total_failed() as u64,
        failures: outcome::failures(fit),
        seed,
        inputs,
        statements,
        laws: ranked
            .into_iter()
            .map(|law| LawOutcome {
                damping_kind: law.kind.clone(),
                mount: mount(law),
                verdict: law.fit.verdict,
                p_value: law.fit.agreement.p,
                misfit: law.fit.misfit,
                log_evidence: law.fit.log_evidence,
                parameters: outcome::fitted_parameters(&law.fit),
            })
            .collect(),
        preferred_law: several(|candidate| candidate.law.clone())
            .then(|| decision(statement::preferred_of(&by_law, &[]))),
        preferred_mount: several(|candidate| format!("{:?}", candidate.mount))
            .then(|| decision(statement::preferred_of(&by_mount, &without_fit))),
        excluded: fitted.excluded.iter().map(|(candidate, reason)| (candidate.key(), reason.clone())).collect(),
        assumptions: job.assumptions.clone(),
    }
}

pub(super) fn outcome_features(confirmation: &Confirmation) -> BTreeMap<String, OutcomeFeature> {
    let entry = |feature: &crate::study::confirmation::ConfirmedFeature| {
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
    confirmation.features.iter().map(entry).collect()
}
