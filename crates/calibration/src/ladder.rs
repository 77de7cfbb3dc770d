//! One candidate on all its fidelity levels: searched on the chain, then corrected level by level.

use std::{sync::Arc, time::Duration};

use web_time::Instant;

use super::{
    agreement::DOUBTFUL,
    candidate::Candidate,
    correction::Correction,
    drive::RecordedDrive,
    fidelity::{Bodies, FidelityLevel, chain_below},
    fingerprints::CandidateRuns,
    fit::{Fit, FitError, answer, corrected, corrected_by, to_end},
    forward::{Forward, Run, Watch},
    likelihood::TrainingRuns,
    multi_record::MultiRecord,
    parameter::Parameter,
    plan::Likelihood,
    problem::Problem,
    recorded_run::RecordedRun,
    refusal::Refusal,
    run_store::RunFile,
    search::Search,
    waveform::{self, Compared, Purpose, QUANTILE, WaveformBound},
};
use granchain_model::scene::Scene;

/// Where the runs of the highest fidelity level of one candidate are stored, if they are slow.
#[derive(Default)]
pub struct SavedFit(pub(crate) Option<RunFile>);

/// The runs of one candidate, and the models that make them.
pub struct FitRuns {
    pub runs: CandidateRuns,
    /// Forward models of the search.
    pub joint: MultiRecord,
    /// Fidelity levels of the corrections, lowest first.
    pub fidelities: Vec<FidelityLevel>,
}

/// Least standard deviation, ln, about the chain's answer within which that of the model above is looked for.
const LEVELS_APART: f64 = 0.02;

/// Most times that a box is widened.
const WIDEST: usize = 3;

/// A search that explains nothing, while a wider box is searched.
struct Narrow {
    joint: MultiRecord,
    fit: Fit,
    search: Search,
    batches: Vec<Vec<Run>>,
    parameters: Vec<Parameter>,
}

pub(super) struct FittedLevels {
    pub(super) made: FitRuns,
    /// Fit of its top fidelity level, or why there is none.
    pub(super) fit: Result<Fit, FitError>,
    pub(super) searching: Duration,
    pub(super) correcting: Vec<Duration>,
    pub(super) warnings: Vec<String>,
}

/// Searches a candidate on the chain and corrects it on the fidelity levels above, with its `bodies`; `watch` receives
/// the number of runs.
pub(super) fn fit_levels(
    problem: &Problem,
    candidate: &Candidate,
    bodies: Option<&Bodies>,
    saved: SavedFit,
    watch: &Arc<Watch>,
) -> Result<FittedLevels, Refusal> {
    let failed = |source| match source {
        FitError::Stopped { .. } => Refusal::Stopped,
        source => {
            let (path, candidate) = (problem.lead().measured.path().into(), candidate.name());
            Refusal::Fit { path, candidate, source }
        }
    };
    let (seed, budget) = (problem.seed, problem.evaluations);
    let started = Instant::now();
    let mut candidate = candidate.clone();
    let mut runs = CandidateRuns { candidate: candidate.key(), ..CandidateRuns::default() };
    // The box is widened while the best runs press on a bound that nobody chose, each time with a search of its own. What explains nothing is
    // looked for in a box that is wider on every side before the record is called inconsistent.
    let (mut beyond, mut kept) = (false, None);
    let (joint, fit, search) = loop {
        let joint = joint(problem, &candidate, bodies, watch)?;
        let search = Search::new(joint.clone(), budget, seed);
        let made = to_end(joint.clone(), search, |search| search.runs.len()).map_err(failed)?;
        let batches = parted(&made.runs, &made.batches);
        let fit = answer(&joint, &made);
        if let Some(narrow) = kept.take() {
            let Narrow { joint: of_narrow, fit: narrow, search, batches: narrower, parameters } = narrow;
            if fit.as_ref().is_ok_and(|fit| fit.improves_on(&narrow)) {
                runs.narrow.push(narrower);
            } else {
                (runs.search, runs.wide, candidate.parameters) = (narrower, batches, parameters);
                break (of_narrow, Ok(narrow), search);
            }
        }
        let pressed = fit.as_ref().ok().and_then(Fit::widened).filter(|_| runs.narrow.len() < WIDEST);
        let unexplained = |fit: &&Fit| !fit.verdict.explains() && !beyond;
        match (pressed, fit) {
            (Some(widened), _) => {
                candidate.parameters = widened;
                runs.narrow.push(batches);
            }
            (None, fit) => match fit.as_ref().ok().filter(unexplained).and_then(Fit::widened_all_round) {
                Some(widened) => {
                    let parameters = std::mem::replace(&mut candidate.parameters, widened);
                    let Ok(fit) = fit else { continue };
                    (beyond, kept) = (true, Some(Narrow { joint, fit, search: made, batches, parameters }));
                }
                None => {
                    runs.search = batches;
                    break (joint, fit, made);
                }
            },
        }
        if !watch(0) {
            return Err(Refusal::Stopped);
        }
    };
    let fidelities = bodies.map_or_else(Vec::new, |bodies| bodies.fidelities(joint.first(), candidate.scene()));
    let mut made = FitRuns { runs, joint, fidelities };
    let searching = started.elapsed();
    let (mut correcting, mut warnings) = (Vec::new(), Vec::new());
    let mut fit = match fit {
        Ok(fit) if !made.fidelities.is_empty() => fit,
        fit => {
            let fit = match problem.likelihood {
                Likelihood::Waveform => {
                    fit.map(|fit| with_waveform(problem, &made.joint, &search, fit, Purpose::Answer))
                }
                Likelihood::Amplitudes => fit,
            };
            if !watch(0) {
                return Err(Refusal::Stopped);
            }
            return Ok(FittedLevels { made, fit, searching: started.elapsed(), correcting, warnings });
        }
    };
    if let Some((kept, top)) = saved.0.and_then(|kept| Some((kept, made.fidelities.pop()?))) {
        let [own, finer] = [kept.open(), kept.finer().open()].map(|kept| kept.map(Arc::new));
        let (own, finer) = (own.map_err(Refusal::Kept)?, finer.map_err(Refusal::Kept)?);
        warnings.extend(own.damage().into_iter().chain(finer.damage()));
        made.fidelities.push(top.keeping(own, finer));
    }
    let (mut corrections, reckoned) = (Vec::<Correction>::new(), problem.work_above());
    let mut decided = false;
    for (number, fidelity) in made.fidelities.iter().enumerate() {
        let before = made.runs.before(number);
        let done = budget as u64 + reckoned[..number].iter().sum::<u64>();
        if !watch(done) {
            return Err(Refusal::Stopped);
        }
        let (report, cost, most) = (Arc::clone(watch), problem.cost(problem.above[number]), reckoned[number]);
        // A correction that had to look for itself makes more pairs than were reckoned with.
        let fidelity = &fidelity.watched(Arc::new(move |runs| {
            let pairs = waveform::pairs_before(runs).unwrap_or_else(|| runs.saturating_sub(before as u64));
            report(done + (pairs * cost).min(most))
        }));
        let started = Instant::now();
        let fresh = || Correction::new(fidelity, &fit.runs, before, seed);
        let found = if problem.begins_with_waveform() {
            by_waveform(problem, &made.joint, &search, fidelity, &fit, fresh)
        } else {
            None
        };
        // What was stopped says nothing.
        if !watch(done) {
            return Err(Refusal::Stopped);
        }
        let correction = match found {
            Some((whole, correction)) => {
                (fit, decided) = (whole, true);
                correction
            }
            None => {
                let correction = to_end(fidelity.clone(), fresh(), |it| it.pairs.len()).map_err(failed)?;
                fit = corrected(fidelity, fit, &correction).map_err(failed)?;
                correction
            }
        };
        made.runs.corrections.push(parted(&correction.pairs, &correction.rounds));
        corrections.push(correction);
        correcting.push(started.elapsed());
    }
    if let (Likelihood::Waveform, Some(top), Some(pairs), false) =
        (problem.likelihood, made.fidelities.last(), corrections.last(), decided)
    {
        let started = Instant::now();
        fit = with_waveform_above(problem, made.joint.first(), top, &pairs.training(pairs.pairs.len()), fit);
        correcting.iter_mut().last().into_iter().for_each(|last| *last += started.elapsed());
        if !watch(0) {
            return Err(Refusal::Stopped);
        }
    }
    // What each level expects is stated at the answer of the highest.
    let (at, mut upper) = (fit.most_likely.clone(), fit.below.as_deref_mut());
    corrections.pop();
    while let (Some(fidelity), Some(correction)) = (upper, corrections.pop()) {
        upper = fidelity.fit.below.as_deref_mut();
        if let Some(below) = &mut upper {
            below.differences = correction.differences(&at);
        }
    }
    Ok(FittedLevels { made, fit: Ok(fit), searching, correcting, warnings })
}

impl Problem {
    /// What the waveforms of its records can say of a candidate's parameters at these values (SI), from some 950 runs of the chain and without a fit;
    /// `None` where they cannot be compared by their waveform. `deviations`: a first guess of the standard deviations, ln.
    pub fn bound(
        &self,
        candidate: &Candidate,
        bodies: Option<&Bodies>,
        (values, deviations): (&[f64], &[f64]),
    ) -> Option<WaveformBound> {
        let watch: Arc<Watch> = Arc::new(|_| true);
        let joint = joint(self, candidate, bodies, &watch).ok()?;
        let each = self.recorded_runs.iter().zip(&joint.records);
        let compared = each.map(|(recorded_run, forward)| compared(recorded_run, forward)).collect();
        let at: Vec<f64> = candidate.parameters.iter().zip(values).map(|(it, value)| it.coordinate(*value)).collect();
        waveform::bound(compared, &at, deviations, self.seed)
    }
}

/// The waveform of a record with what makes its runs.
fn compared<'a>(recorded_run: &'a RecordedRun, forward: &'a Forward) -> Compared<'a> {
    let noise = recorded_run.bench.drive.as_ref().and_then(RecordedDrive::noise);
    let trace = &recorded_run.measured.observation.trace;
    Compared { forward, noise, trace, difference: None, clock: waveform::CLOCK }
}

/// A fit on the chain combined with the waveforms of its records, if all have one.
fn with_waveform(problem: &Problem, joint: &MultiRecord, search: &Search, fit: Fit, purpose: Purpose) -> Fit {
    let compared =
        problem.recorded_runs.iter().zip(&joint.records).map(|(recorded_run, forward)| compared(recorded_run, forward));
    let training = search.training(search.runs.len());
    let known = fit.elite(&training);
    match waveform::fit(compared.collect(), &known, problem.seed, purpose) {
        Some(waveform) => fit.with_waveform(waveform, &training, problem.seed),
        None => fit,
    }
}

/// A fit above the chain by the waveform alone, without rounds of pairs for the amplitudes: the waveform of the chain says where, and the pairs
/// that correct it give the features too. `None` where the waveform does not decide, or does not explain the record.
fn by_waveform(
    problem: &Problem,
    joint: &MultiRecord,
    search: &Search,
    fidelity: &FidelityLevel,
    fit: &Fit,
    fresh: impl Fn() -> Correction,
) -> Option<(Fit, Correction)> {
    let chain = with_waveform(problem, joint, search, fit.clone(), Purpose::Start);
    let found = chain.waveform.as_ref().filter(|waveform| waveform.decides())?;
    let deviation = |d: usize| found.covariance[d][d].sqrt().max(LEVELS_APART);
    let deviations: Vec<f64> = (0..found.at.len()).map(deviation).collect();
    let compared = compared(problem.lead(), joint.first());
    let waveform = waveform::fit_above(compared, fidelity, &found.at, &deviations, problem.seed)?;
    if !waveform.decides() || waveform.p < DOUBTFUL {
        return None;
    }
    let correction = fresh().with_rounds(&waveform.pairs);
    let training = correction.training(correction.pairs.len());
    let amplitudes = corrected_by(fidelity, chain, &correction, waveform.mesh.clone()).ok()?;
    let fit = amplitudes.with_waveform(waveform, &training, problem.seed);
    fit.verdict.explains().then_some((fit, correction))
}

/// The same of a fit on a model above the chain.
fn with_waveform_above(
    problem: &Problem,
    forward: &Forward,
    above: &FidelityLevel,
    training: &TrainingRuns,
    fit: Fit,
) -> Fit {
    let compared = compared(problem.lead(), forward);
    let deviations: Vec<f64> =
        fit.estimates.iter().map(|estimate| 0.5 * (estimate.high / estimate.low).ln() / QUANTILE).collect();
    match waveform::fit_above(compared, above, &fit.most_likely, &deviations, problem.seed) {
        Some(waveform) => fit.with_waveform(waveform, training, problem.seed),
        None => fit,
    }
}

/// The runs of a candidate on the chain, every record under its own drive.
pub(super) fn joint(
    problem: &Problem,
    candidate: &Candidate,
    bodies: Option<&Bodies>,
    watch: &Arc<Watch>,
) -> Result<MultiRecord, Refusal> {
    let laws = bodies.and_then(|bodies| bodies.laws.as_ref());
    let forward = |(recorded_run, scene): (&RecordedRun, &Scene)| {
        let (parameters, comparison) = (candidate.parameters.clone(), recorded_run.comparison.clone());
        let (scene, watch) = (chain_below(scene), Arc::clone(watch));
        Forward::new(&scene, laws, parameters, comparison, recorded_run.uncertainty, problem.seed, watch)
    };
    let records = problem.recorded_runs.iter().zip(&candidate.scenes).map(forward);
    Ok(MultiRecord::of(records.collect::<Result<_, _>>()?))
}

fn parted<T: Clone>(runs: &[T], sizes: &[usize]) -> Vec<Vec<T>> {
    let mut rest = runs.iter().cloned();
    sizes.iter().map(|size| rest.by_ref().take(*size).collect()).collect()
}
