//! From a fit to everything that a calibration leaves behind: what `calibrate` writes, and what `verify` compares a folder with.

use std::sync::Arc;

use super::{Job, ended, manifest, page};
use crate::{
    calibration::{Fitted, Schedule, fingerprints, ladder::SavedFit, outcome::CalibrationOutcome},
    cli::{arguments::Session, forecast::Forecast, interrupt, progress, summary, timing::Timing},
    report::{self, calibration::CalibrationReport},
    scene::ModelKind,
    study::predicted::Predictions,
};

/// Asked now and then whether to stop.
#[derive(Clone)]
pub struct Stop(pub Arc<dyn Fn() -> bool + Send + Sync>);

impl Stop {
    /// Once the process was asked to.
    pub fn on_interrupt() -> Self {
        Self(Arc::new(interrupt::requested))
    }

    fn check(&self) -> Result<(), interrupt::Interrupted> {
        if (self.0)() { Err(interrupt::Interrupted) } else { Ok(()) }
    }
}

pub struct Files {
    pub outcome: CalibrationOutcome,
    /// Every file, the manifest last.
    pub files: report::page::Files,
}

/// Fit every candidate from where it was saved.
pub fn fitted(job: &Job, saved: Vec<SavedFit>, session: &Session, timing: &mut Timing) -> anyhow::Result<Fitted> {
    let problem = &job.problem;
    let bodies = problem.bodies(session.cache().as_ref())?;
    session.warn(bodies.as_ref().and_then(|bodies| bodies.prepared.warning()));
    timing.stage("prepare");
    let bar = progress::work(session, problem.work(), "runs");
    let (shown, forecast, work) = (bar.clone(), Forecast::new(session, "the fit"), problem.work() as f64);
    let watch = Arc::new(move |done| {
        shown.set_position(done);
        forecast.at(done as f64 / work);
        !interrupt::requested()
    });
    let fitted = problem.fit(Schedule { bodies: bodies.as_ref(), saved, watch }).map_err(ended)?;
    bar.finish_and_clear();
    session.warn(&fitted.warnings);
    timing.stage("fit");
    if bodies.is_some() {
        let fidelities =
            problem.above.iter().zip(&fitted.correcting).map(|(kind, took)| (kind.name(), took.as_secs_f64()));
        let chain = (ModelKind::Chain.name(), fitted.searching.as_secs_f64());
        timing.breakdown("fit", &std::iter::once(chain).chain(fidelities).collect::<Vec<_>>());
    }
    Ok(fitted)
}

/// The outcome of a fit, and the report on it.
pub struct Reported {
    pub outcome: CalibrationOutcome,
    pub report: CalibrationReport,
}

impl Reported {
    /// Run the answer with the accurate integrator, and hold it against the records.
    pub fn of(job: &Job, fitted: &Fitted, session: &Session, timing: &mut Timing, stop: &Stop) -> anyhow::Result<Self> {
        stop.check()?;
        let problem = &job.problem;
        let stopping = stop.clone();
        let watch = Arc::new(move |_| !(stopping.0)());
        let mut predicted = Predictions::of(problem, fitted, session.cache(), watch.clone());
        stop.check()?;
        timing.stage("confirm");
        if fitted.is_in_doubt() {
            session.note(page::verdict(fitted));
            interrupt::saves_first();
            predicted.diagnosis =
                fitted.diagnose(problem, watch, &|text| session.note(format_args!("  looking for causes: {text}")));
            timing.stage("causes");
            if predicted.diagnosis.stopped && !interrupt::taken_back() {
                stop.check()?;
            }
        }
        let outcome = CalibrationOutcome { program: job.program.clone(), ..predicted.outcome(problem, fitted) };
        let report = page::report(job, fitted, &predicted, &outcome);
        Ok(Self { outcome, report })
    }
}

impl Files {
    /// Every file on a fit.
    pub fn of(job: &Job, fitted: &Fitted, session: &Session, timing: &mut Timing, stop: &Stop) -> anyhow::Result<Self> {
        let Reported { outcome, report } = Reported::of(job, fitted, session, timing, stop)?;
        let mut files: report::page::Files = vec![("calibration.json".into(), summary::json(&outcome)?)];
        files.extend(report.files()?);
        files.push((fingerprints::FILE.into(), fitted.fingerprints(&job.problem)?));
        let manifest = manifest::Manifest::of(job, &files)?;
        files.push((manifest::FILE.into(), summary::json(&manifest)?));
        timing.stage("report");
        Ok(Self { outcome, files })
    }
}
