//! Result of a problem: every candidate fitted on all its fidelity levels.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use super::{
    agreement::DOUBTFUL,
    candidate::Candidate,
    correction::{LevelDifference, most_pairs},
    diagnosis::{Case, Diagnosis, Listener},
    drive::{Input, RecordedDrive},
    fidelity::{Bodies, FidelityLevel, chain_below},
    fingerprints,
    fit::{Fit, FitError, Verdict},
    forward::{Forward, Watch},
    ladder::{FitRuns, FittedLevels, SavedFit, fit_levels},
    outcome::{
        self, CalibrationOutcome, FidelityFeature, FidelityOutcome, FitOutcome, FittedFeature, InputDigest,
        RecordOutcome, WaveformOutcome,
    },
    plan::Likelihood,
    problem::{Problem, program},
    recorded_run::RecordedRun,
    refusal::Refusal,
    statement, waveform,
};
use granchain_model::{
    Estimate,
    scene::{ModelKind, Scene},
};
use granchain_record::RecordKind;

/// Chain runs that cost as much as one run of the reduced model, for the estimate of the remaining time.
const REDUCED_COST: u64 = 64;

/// Unknowns × steps of a finite element run that cost as much as one chain run.
const FEA_WORK: f64 = 1e5;

/// A candidate with its answer.
#[derive(Clone)]
pub struct FittedCandidate {
    /// Law and mount, with their scenes.
    pub candidate: Candidate,
    /// Fit of the top fidelity level.
    pub fit: Fit,
    /// Chain runs of the first record.
    pub forward: Forward,
    /// The top fidelity level, if it is above the chain.
    pub upper: Option<FidelityLevel>,
    /// Time of the search on the chain, and of each fidelity level above it, lowest first.
    pub took: Vec<Duration>,
}

pub struct Fitted {
    /// Candidates with an answer, in the requested order.
    pub candidates: Vec<FittedCandidate>,
    /// Mounts without a run that can be compared with the record, and why.
    pub excluded: Vec<(Candidate, String)>,
    /// All runs of all candidates, also of those without an answer.
    pub made: Vec<FitRuns>,
    /// Time of the searches on the chain.
    pub searching: Duration,
    /// Time of the corrections on each fidelity level above the chain, lowest first.
    pub correcting: Vec<Duration>,
    pub warnings: Vec<String>,
}

/// Options of a fit; by default it starts from scratch, without progress reports, and prepares its bodies.
pub struct Schedule<'a> {
    /// Bodies from [`Problem::bodies`], if already prepared.
    pub bodies: Option<&'a Bodies>,
    /// Saved states of an earlier run, one a candidate.
    pub saved: Vec<SavedFit>,
    /// Receives the work done, out of [`Problem::work`]; returning `false` ends the fit after the current batch.
    pub watch: Arc<Watch>,
}

impl Default for Schedule<'_> {
    fn default() -> Self {
        Self { bodies: None, saved: Vec::new(), watch: Arc::new(|_| true) }
    }
}

impl Problem {
    /// Work in units of chain runs; a correction with a global search does more.
    pub fn work(&self) -> u64 {
        self.candidates.len() as u64 * (self.evaluations as u64 + self.work_above().iter().sum::<u64>())
    }

    /// Work of one candidate on each fidelity level above the chain.
    pub(super) fn work_above(&self) -> Vec<u64> {
        let most = self.candidates.iter().map(|candidate| candidate.parameters.len()).max().unwrap_or(0);
        let runs = if self.begins_with_waveform() { waveform::USUAL_RUNS } else { most_pairs(most) as u64 };
        self.above.iter().map(|kind| runs * self.cost(*kind)).collect()
    }

    /// Whether the one model above the chain is run where the chain's waveform lies, and for the amplitudes only if that says nothing.
    pub(super) fn begins_with_waveform(&self) -> bool {
        self.likelihood == Likelihood::Waveform && self.above.len() == 1
    }

    /// Cost of one run of a model, in chain runs.
    pub(super) fn cost(&self, kind: ModelKind) -> u64 {
        match kind {
            ModelKind::Fea => (Estimate::of(self.candidates[0].scene()).work / FEA_WORK).max(1.0) as u64,
            ModelKind::Chain | ModelKind::Reduced => REDUCED_COST,
        }
    }

    /// Searches every candidate on the chain and corrects it on the fidelity levels above. A mount without any
    /// comparable run is left out with its reason, if others have one.
    pub fn fit(&self, schedule: Schedule<'_>) -> Result<Fitted, Refusal> {
        let own = if schedule.bodies.is_none() { self.bodies(None)? } else { None };
        let bodies = schedule.bodies.or(own.as_ref()).filter(|_| !self.above.is_empty());
        let each = self.evaluations as u64 + self.work_above().iter().sum::<u64>();
        let (mut candidates, mut excluded, mut made) = (Vec::new(), Vec::new(), Vec::new());
        let (mut searching, mut correcting) = (Duration::ZERO, vec![Duration::ZERO; self.above.len()]);
        let mut warnings = Vec::new();
        // What a fidelity level takes for its own errors is not reckoned with, and goes no step back.
        let furthest = Arc::new(AtomicU64::new(0));
        let mut saved = schedule.saved.into_iter();
        for (number, candidate) in self.candidates.iter().enumerate() {
            let done = number as u64 * each;
            let (watched, furthest) = (Arc::clone(&schedule.watch), Arc::clone(&furthest));
            let watch: Arc<Watch> = Arc::new(move |work| {
                let before = furthest.fetch_max(done + work, Ordering::Relaxed);
                watched(before.max(done + work))
            });
            let levels = fit_levels(self, candidate, bodies, saved.next().unwrap_or_default(), &watch)?;
            let FittedLevels { made: runs, fit, searching: took, correcting: fidelities, warnings: further } = levels;
            searching += took;
            correcting.iter_mut().zip(&fidelities).for_each(|(all, took)| *all += *took);
            let took: Vec<Duration> = std::iter::once(took).chain(fidelities).collect();
            warnings.extend(further);
            match fit {
                Ok(fit) => {
                    let fit = fit.with_wider_intervals(self.widen);
                    let (forward, upper) = (runs.joint.first().clone(), runs.fidelities.last().cloned());
                    candidates.push(FittedCandidate { candidate: candidate.clone(), fit, forward, upper, took });
                }
                Err(error @ FitError::TooFewRuns { .. }) if candidate.mount.is_some() && self.candidates.len() > 1 => {
                    excluded.push((candidate.clone(), error.to_string()));
                }
                Err(source) => {
                    let (path, candidate) = (self.lead().measured.path().into(), candidate.name());
                    return Err(Refusal::Fit { path, candidate, source });
                }
            }
            made.push(runs);
            let _ = (schedule.watch)(done + each);
        }
        if candidates.is_empty() {
            let reasons: Vec<String> =
                excluded.iter().map(|(candidate, why)| format!("{}: {why}", candidate.name())).collect();
            let path = self.lead().measured.path().into();
            return Err(Refusal::NoFit { path, reasons: reasons.join("; ") });
        }
        Ok(Fitted { candidates, excluded, made, searching, correcting, warnings })
    }
}

impl FittedCandidate {
    /// The scene of a record (from 0) with the fitted values.
    pub fn scene(&self, number: usize) -> Scene {
        let mut scene = self.candidate.scenes[number].clone();
        for (parameter, value) in self.fit.parameters.iter().zip(self.fit.values()) {
            parameter.set(&mut scene, value);
        }
        scene
    }

    /// Summary of its fit; makes no run.
    pub(crate) fn outcome(&self, problem: &Problem) -> FitOutcome {
        let fit = &self.fit;
        let names = problem.lead().comparison.names();
        let differences = fit.below.iter().flat_map(|below| names.iter().zip(&below.differences));
        let difference = |(name, fidelity): (&std::borrow::Cow<'static, str>, &LevelDifference)| {
            (name.to_string(), [fidelity.difference, fidelity.standard_error])
        };
        FitOutcome {
            damping_kind: self.candidate.law.clone(),
            mount: self.mount(),
            verdict: fit.verdict,
            parameters: outcome::fitted_parameters(fit),
            correlation: fit.correlation,
            correlations: outcome::correlations(fit),
            p_value: fit.agreement.p,
            waveform: WaveformOutcome::of(fit),
            misfit: fit.misfit,
            log_evidence: fit.log_evidence,
            features: BTreeMap::new(),
            fitted_features: fitted_features(problem.lead(), fit, 0),
            records: records(problem, fit),
            lobes: outcome::lobes(fit),
            fidelities: self.fidelities(problem),
            fidelity_differences: differences.map(difference).collect(),
            evaluations: fit.total_runs() as u64,
            failed_runs: fit.total_failed() as u64,
            failures: outcome::failures(fit),
        }
    }

    /// Name of its mount, if mounts are compared.
    pub(crate) fn mount(&self) -> Option<String> {
        self.candidate.mount.map(|mount| mount.name().to_owned())
    }

    /// Result of each fidelity level, lowest first, with its expected features at the answer.
    pub(crate) fn fidelities(&self, problem: &Problem) -> Vec<FidelityOutcome> {
        let comparison = &problem.lead().comparison;
        let names = comparison.names();
        let features = |z: &dyn Fn(usize) -> Option<(f64, Option<f64>)>| -> BTreeMap<String, FidelityFeature> {
            let feature = |(index, name): (usize, &std::borrow::Cow<'static, str>)| {
                let (z, scatter) = z(index)?;
                let unit = comparison.unit(index).to_owned();
                Some((name.to_string(), FidelityFeature { value: comparison.amplitude(index, z), scatter, unit }))
            };
            names.iter().enumerate().filter_map(feature).collect()
        };
        let mut fidelities = Vec::new();
        if let Some(below) = &self.fit.below {
            let of_upper = |index: usize| {
                let fidelity = below.differences.get(index)?;
                Some((fidelity.upper, Some(fidelity.upper_scatter)))
            };
            fidelities.push(FidelityOutcome::of(problem.model(), &self.fit, features(&of_upper)));
            let models = problem.above.iter().rev().skip(1).chain([&ModelKind::Chain]);
            let fits = std::iter::successors(self.fit.below.as_ref(), |below| below.fit.below.as_ref());
            for (kind, below) in models.zip(fits) {
                let of_lower = |index: usize| {
                    let fidelity = below.differences.get(index)?;
                    Some((fidelity.lower, Some(fidelity.lower_scatter)))
                };
                fidelities.push(FidelityOutcome::of(kind.name(), &below.fit, features(&of_lower)));
            }
            fidelities.reverse();
        } else {
            let expected = |index: usize| {
                let scatter = *self.fit.scatter.get(index)?;
                Some((comparison.features.get(index)? + self.fit.deviations.get(index)? * scatter, Some(scatter)))
            };
            fidelities.push(FidelityOutcome::of(problem.model(), &self.fit, features(&expected)));
        }
        fidelities
    }
}

impl Fitted {
    /// Number of the leading candidate: those that explain the record first, then by evidence.
    pub(crate) fn best_index(&self) -> usize {
        let fit = |number: usize| &self.candidates[number].fit;
        (0..self.candidates.len()).max_by(|&a, &b| fit(a).by_standing(fit(b))).unwrap_or(0)
    }

    pub fn best(&self) -> &FittedCandidate {
        &self.candidates[self.best_index()]
    }

    /// Its runs and their models.
    pub(crate) fn best_made(&self) -> &FitRuns {
        let key = self.best().candidate.key();
        let of_best = self.made.iter().position(|made| made.runs.candidate == key);
        &self.made[of_best.unwrap_or(0)]
    }

    /// Whether causes are to be looked for: the best candidate does not explain the first record.
    pub fn is_in_doubt(&self) -> bool {
        let fit = &self.best().fit;
        fit.verdict != Verdict::WithinScatter && (fit.verdict != Verdict::NotConverged || fit.agreement.p < DOUBTFUL)
    }

    /// Up to three likely causes if the best candidate does not explain the first record, most likely first. Makes
    /// further searches on the chain; `listener` hears what is looked for, `watch` can stop it.
    pub fn diagnose(&self, problem: &Problem, watch: Arc<Watch>, listener: Listener) -> Diagnosis {
        let (best, recorded_run) = (self.best(), problem.lead());
        if !self.is_in_doubt() {
            return Diagnosis::default();
        }
        let case = Case {
            scene: &chain_below(best.candidate.scene()),
            laws: best.forward.laws.as_ref(),
            comparison: &recorded_run.comparison,
            trace: &recorded_run.measured.observation.trace,
            noise: recorded_run.bench.drive.as_ref().and_then(RecordedDrive::noise),
            parameters: &best.fit.parameters,
            uncertainty: recorded_run.uncertainty,
            seed: problem.seed,
            fit: &best.fit,
            watch,
        };
        case.diagnose(&problem.warnings(), listener)
    }

    /// The law that the record prefers, or `undecided`; `None` if only one was fitted.
    pub(crate) fn preferred_law(&self) -> Option<String> {
        let fits: Vec<_> = self.candidates.iter().map(|it| (it.candidate.law.clone(), &it.fit)).collect();
        self.several(|candidate| candidate.law.clone()).then(|| decision(statement::preferred_of(&fits, &[])))
    }

    /// The mount that the record prefers, or `undecided`; `None` if only one was fitted.
    pub fn preferred_mount(&self) -> Option<String> {
        let fits: Vec<_> = self.candidates.iter().filter_map(|it| Some((it.mount()?, &it.fit))).collect();
        let excluded = self.excluded.iter().filter_map(|(candidate, _)| candidate.mount);
        let excluded = excluded.map(|mount| mount.name().to_owned());
        let without_fit: Vec<String> = excluded.filter(|name| fits.iter().all(|(fitted, _)| fitted != name)).collect();
        let several = self.several(|candidate| format!("{:?}", candidate.mount));
        several.then(|| decision(statement::preferred_of(&fits, &without_fit)))
    }

    /// Whether candidates differ in a choice.
    fn several(&self, choice: fn(&Candidate) -> String) -> bool {
        let all = self.candidates.iter().map(|fitted| &fitted.candidate);
        let all = all.chain(self.excluded.iter().map(|(candidate, _)| candidate));
        all.map(choice).collect::<BTreeSet<_>>().len() > 1
    }

    /// Every run as a table: `fingerprints.csv`.
    pub fn fingerprints(&self, problem: &Problem) -> Result<Vec<u8>, fingerprints::FingerprintsError> {
        let runs: Vec<_> = self.made.iter().map(|made| made.runs.clone()).collect();
        fingerprints::to_csv(&problem.names(), &runs)
    }

    /// The outcome without the posterior predictive run; makes no run.
    pub fn outcome(&self, problem: &Problem) -> CalibrationOutcome {
        let best = self.best();
        let (fit, lead) = (&best.fit, problem.lead());
        let mut statements = statement::statements(fit);
        if problem.likelihood == Likelihood::Waveform && fit.waveform.is_none() {
            statements.push("No waveform of these records could be compared: amplitudes decide.".into());
        }
        statements.extend(problem.widen.map(|factor| {
            format!("Every 90 % interval is widened {factor} times about its median, as `widen` asks; regions, densities and correlations are not.")
        }));
        statements.extend(statement::together(fit, &problem.labels()));
        statements.extend(statement::crosstalk(fit, &problem.labels()));
        statements.extend(statement::other_clock(fit, &problem.labels()));
        if lead.uncertainty.repeats > 1 {
            let comparisons: Vec<_> =
                problem.recorded_runs.iter().map(|recorded_run| &recorded_run.comparison).collect();
            statements.extend(statement::repeated(fit, &comparisons, &problem.labels()));
        }
        statements.extend(match &lead.bench.drive {
            Some(_) => statement::recorded_drive(fit),
            None => statement::assumed_drive(fit, best.candidate.scene()),
        });
        statements.extend(statement::widened(fit, &self.best_made().runs));
        let laws: Vec<FitOutcome> = self.ranked().into_iter().map(|fitted| fitted.outcome(problem)).collect();
        let mut outcome = CalibrationOutcome {
            best: laws[0].clone(),
            statements,
            laws,
            preferred_law: self.preferred_law(),
            preferred_mount: self.preferred_mount(),
            excluded: self.excluded.iter().map(|(candidate, reason)| (candidate.key(), reason.clone())).collect(),
            ..problem.outcome()
        };
        let open = statement::undecided(&outcome.undecided_laws());
        if open.is_some() && outcome.best.verdict == Verdict::WithinScatter {
            outcome.best.verdict = Verdict::Doubtful;
        }
        outcome.statements.splice(0..0, open);
        outcome
    }

    /// Every candidate, the best first, the others in the requested order.
    pub fn ranked(&self) -> Vec<&FittedCandidate> {
        let mut ranked: Vec<&FittedCandidate> = self.candidates.iter().collect();
        ranked.sort_by_key(|other| !std::ptr::eq(*other, self.best()));
        ranked
    }
}

impl Problem {
    /// The outcome before any fit.
    pub fn outcome(&self) -> CalibrationOutcome {
        let bench = &self.lead().bench;
        CalibrationOutcome {
            program: program(),
            scene: bench.source.clone(),
            overrides: bench.overrides.clone(),
            model: self.model().into(),
            quantity: self.quantity,
            best: FitOutcome::default(),
            seed: self.seed,
            inputs: inputs(self),
            statements: Vec::new(),
            laws: Vec::new(),
            preferred_law: None,
            preferred_mount: None,
            widened: self.widen,
            excluded: BTreeMap::new(),
            diagnosis: Vec::new(),
            masked: self.recorded_runs.iter().flat_map(RecordedRun::masked).collect(),
            warnings: self.warnings(),
            assumptions: self.assumptions.clone(),
        }
    }
}

fn decision(named: Option<String>) -> String {
    named.unwrap_or_else(|| outcome::UNDECIDED.into())
}

/// Compared features of a record; its deviations in `fit` start at number `first`.
fn fitted_features(recorded_run: &RecordedRun, fit: &Fit, first: usize) -> BTreeMap<String, FittedFeature> {
    let comparison = &recorded_run.comparison;
    let names = comparison.names();
    let compared = names.iter().enumerate().filter(|(index, _)| comparison.weights[*index] > 0.0);
    let feature = |(index, name): (usize, &std::borrow::Cow<'static, str>)| {
        (name.to_string(), outcome::fitted_feature(fit, first + index, comparison, index))
    };
    compared.map(feature).collect()
}

/// Every record in the outcome; empty for one record.
fn records(problem: &Problem, fit: &Fit) -> Vec<RecordOutcome> {
    let quoted = fit.verdict.explains();
    let mut first = 0;
    let shares = problem.labels().into_iter().zip(&fit.shares).zip(&problem.recorded_runs);
    let record = |((label, share), recorded_run): ((String, &super::multi_record::Share), &RecordedRun)| {
        let fitted_features = fitted_features(recorded_run, fit, first);
        first += recorded_run.comparison.features.len();
        RecordOutcome {
            label,
            measured: recorded_run.measured.path().display().to_string(),
            overrides: recorded_run.bench.overrides.clone(),
            p_value: share.p,
            misfit: share.misfit,
            correlation: share.correlation,
            alone: outcome::estimates_by_name(&share.estimates, &fit.parameters, quoted),
            features: BTreeMap::new(),
            fitted_features,
        }
    };
    shares.map(record).collect()
}

/// The records and their drives by role: `measured`, `drive`, of a second record `measured-2`, `drive-2` and so on.
fn inputs(problem: &Problem) -> BTreeMap<String, InputDigest> {
    let mut inputs = BTreeMap::new();
    for (number, recorded_run) in problem.recorded_runs.iter().enumerate() {
        let role = |role: &str| if number == 0 { role.to_owned() } else { format!("{role}-{}", number + 1) };
        let (path, sha256) = (recorded_run.measured.path(), recorded_run.measured.sha256());
        let measured = InputDigest::read_with(path, sha256, RecordKind::Vibrometer, &recorded_run.options);
        inputs.insert(role("measured"), measured);
        if let Some(RecordedDrive { input: Input { path, sha256 }, options, .. }) = &recorded_run.bench.drive {
            inputs.insert(role("drive"), InputDigest::read_with(path, sha256, RecordKind::HornTip, options));
        }
    }
    inputs
}
