//! One fit: search, regression, point estimate, interval, verdict.

use std::cmp::Ordering;

use argmin::core::{Error, Executor, Solver, State, TerminationReason, TerminationStatus};
use serde::{Deserialize, Serialize};
use thiserror::Error;

pub use super::estimate::Estimate;
use super::{
    agreement::{self, Agreement},
    correction::{self, Correction, LevelDifference},
    discrepancy::Discrepancy,
    estimate::{drift, estimates_of},
    fidelity::{FidelityLevel, Incomplete},
    forward::Run,
    likelihood::TrainingRuns,
    multi_record::{MultiRecord, Share, shares},
    parameter::{Parameter, widened},
    posterior::{Lobe, Posterior},
    search::{Search, SearchState, ranking},
    waveform::WaveformFit,
};
use granchain_record::run_log::RunLogError;

/// Number of best runs whose median misfit is reported.
const BEST: usize = 10;

/// Ratio of misfits below which the answer of a wider box is preferred although neither explains the record.
const BETTER: f64 = 0.7;

/// Iterations of the feature weights; more change no quoted value.
const REWEIGHINGS: usize = 2;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Verdict {
    /// The model explains the record within the scatter of a single run.
    #[serde(rename = "within scatter")]
    WithinScatter,
    /// p from 1 to 5 %: a correct model has this result for one record in twenty-five.
    #[serde(rename = "doubtful")]
    Doubtful,
    /// p < 1 %: a correct model has this result once in a hundred records. Intervals are not quoted.
    #[serde(rename = "outside scatter")]
    OutsideScatter,
    /// The answer was still moving, or too few runs finished.
    #[default]
    #[serde(rename = "not converged")]
    NotConverged,
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::WithinScatter => "within scatter",
            Self::Doubtful => "doubtful",
            Self::OutsideScatter => "outside scatter",
            Self::NotConverged => "not converged",
        })
    }
}

impl Verdict {
    /// Of p, of whether the answer still moves, and of whether a value, or the record's clock, is unusual.
    pub fn of(p: f64, moves: bool, unusual: bool) -> Self {
        if p < agreement::OUTSIDE {
            Self::OutsideScatter
        } else if moves {
            Self::NotConverged
        } else if p < agreement::DOUBTFUL || unusual {
            Self::Doubtful
        } else {
            Self::WithinScatter
        }
    }

    pub fn explains(self) -> bool {
        self != Self::OutsideScatter
    }
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Fit {
    /// Fitted parameters with their bounds.
    pub parameters: Vec<Parameter>,
    /// Estimates, in the same order.
    pub estimates: Vec<Estimate>,
    /// The jointly most likely point, unit coordinates.
    pub most_likely: Vec<f64>,
    /// The posterior on its grid.
    pub posterior: Posterior,
    /// Connected parts of its 90 % region.
    pub lobes: Vec<Lobe>,
    /// Correlation of the logarithms of the first two parameters.
    pub correlation: f64,
    /// Misfit: median over the ten best runs of a search (three of a correction) of the mean squared deviation per
    /// feature, in units of the local scatter; for several records, the largest.
    pub misfit: f64,
    /// Posterior predictive p-value of the record.
    pub agreement: Agreement,
    /// γ² of each feature: added variance relative to its own; 0 where the model agrees.
    pub inflation: Vec<f64>,
    /// Discretisation error of the model.
    pub discrepancy: Discrepancy,
    /// Expected deviation z − z₀ of each feature at the most likely point, in units of its scatter.
    pub deviations: Vec<f64>,
    /// Run-to-run standard deviation of each feature, in ln, at the best run.
    pub scatter: Vec<f64>,
    /// Largest change of a median in the last batch, in half-widths of its interval.
    pub drift: f64,
    /// ln of the evidence of this damping law, without reduced weights.
    pub log_evidence: f64,
    pub verdict: Verdict,
    pub runs: Vec<Run>,
    /// Result of the fidelity level below, if this level is above the chain.
    pub below: Option<Box<Below>>,
    /// Result of the waveform, if it was compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waveform: Option<WaveformFit>,
    /// Result of each record alone, if several are fitted together.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shares: Vec<Share>,
}

/// The fidelity level below an answer.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Below {
    /// Its own fit, before the correction.
    pub fit: Fit,
    /// Difference between the levels at the answer, for each feature.
    pub differences: Vec<LevelDifference>,
}

impl Fit {
    pub fn failed(&self) -> usize {
        self.runs.iter().filter(|run| run.outcome.is_err()).count()
    }

    /// Runs made on this fidelity level and those below.
    pub(crate) fn total_runs(&self) -> usize {
        self.runs.len() + self.below.as_ref().map_or(0, |below| below.fit.total_runs())
    }

    /// Runs that failed on this fidelity level and those below.
    pub(crate) fn total_failed(&self) -> usize {
        self.failed() + self.below.as_ref().map_or(0, |below| below.fit.total_failed())
    }

    /// The parameters in a box widened beyond the bounds that the answer presses on; `None` if there is no such bound
    /// that may be moved. A parameter that presses on both ends is not identified, in a wider box neither.
    pub(crate) fn widened(&self) -> Option<Vec<Parameter>> {
        widened(&self.parameters, |d| {
            let [low, high] = [0.05, 0.95].map(|probability| self.posterior.quantile(d, probability));
            match Parameter::pressed(low, self.most_likely[d], high) {
                (true, true) => (false, false),
                one => one,
            }
        })
    }

    /// The parameters in a box four times wider on every side without a user-given bound; `None` if there is no such
    /// side.
    pub(crate) fn widened_all_round(&self) -> Option<Vec<Parameter>> {
        widened(&self.parameters, |_| (true, true))
    }

    /// Start points (unit coordinates) of the waveform's search.
    pub(crate) fn elite(&self, training: &TrainingRuns) -> Vec<Vec<f64>> {
        elite(self.most_likely.clone(), training)
    }

    /// The same combined with the waveform's result. If the waveform decides, the answer is its own; amplitudes still
    /// enter p, as the waveform does if it does not decide.
    #[must_use]
    pub(crate) fn with_waveform(mut self, waveform: WaveformFit, training: &TrainingRuns, seed: u64) -> Self {
        let mut moves = self.verdict == Verdict::NotConverged;
        if waveform.decides() {
            moves = !waveform.settled;
            let training = training.clone().corrected(&self.discrepancy.shift, &self.discrepancy.nuggets);
            self.posterior = waveform.posterior(&self.parameters);
            self.most_likely.clone_from(&waveform.at);
            self.estimates = waveform.estimates(&self.parameters);
            self.lobes = self.posterior.lobes();
            self.correlation = self.posterior.first_correlation();
            self.inflation.iter_mut().for_each(|more| *more = 0.0);
            if let Some(agreement) = Agreement::of(&training, &self.most_likely, seed) {
                self.agreement = agreement;
            }
            if let Some(local) = training.regress(&self.most_likely) {
                let each = local.deviation.iter().zip(&local.scatter);
                self.deviations = each.map(|(deviation, scatter)| deviation / scatter).collect();
            }
        }
        self.agreement.p = waveform.with_amplitudes(self.agreement.p);
        let is_other_clock = (0..waveform.residuals.len()).any(|number| waveform.other_clock(number).is_some());
        let unusual = is_other_clock || is_unusual(&self.estimates, &self.parameters);
        self.verdict = Verdict::of(self.agreement.p, moves, unusual);
        self.waveform = Some(waveform);
        self
    }

    /// The same with its 90 % intervals widened about their medians, in ln, by a factor, where there is one.
    #[must_use]
    pub(crate) fn with_wider_intervals(mut self, factor: Option<f64>) -> Self {
        let Some(factor) = factor else { return self };
        for (estimate, parameter) in self.estimates.iter_mut().zip(&self.parameters) {
            let [middle, low, high] = [estimate.median, estimate.low, estimate.high].map(|x| parameter.coordinate(x));
            let [low, high] = [low, high].map(|end| (middle + factor * (end - middle)).clamp(0.0, 1.0));
            let wider = Estimate::between(parameter, parameter.coordinate(estimate.value), [low, middle, high]);
            *estimate = Estimate { value: estimate.value, median: estimate.median, ..wider };
        }
        let derived = self.waveform.iter_mut().flat_map(|it| [it.product.as_mut(), it.modulus.as_mut()]);
        derived.flatten().for_each(|[_, deviation]| *deviation *= factor);
        self
    }

    /// Whether this fit of a wider box explains the record while `narrow` does not, or much better.
    pub(crate) fn improves_on(&self, narrow: &Self) -> bool {
        self.verdict.explains() || self.misfit < BETTER * narrow.misfit
    }

    /// Order of two choices (law, mount): what explains the record leads, then the higher evidence.
    pub(crate) fn by_standing(&self, other: &Self) -> Ordering {
        let rank = |fit: &Self| fit.verdict.explains();
        rank(self).cmp(&rank(other)).then(self.log_evidence.total_cmp(&other.log_evidence))
    }

    /// The fitted values, SI, in the order of `parameters`.
    pub(crate) fn values(&self) -> Vec<f64> {
        self.estimates.iter().map(|estimate| estimate.value).collect()
    }

    /// The fitted point in unit coordinates.
    pub(crate) fn position(&self) -> Vec<f64> {
        self.parameters.iter().zip(self.values()).map(|(parameter, value)| parameter.coordinate(value)).collect()
    }
}

/// Why a fit has no answer.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FitError {
    #[error(
        "{failed} of {made} runs failed, too few are left for a regression (the last said: {reason}); widen the bounds, \
         or check the record's unit and the drive with --dry-run"
    )]
    TooFewRuns { made: usize, failed: usize, reason: String },
    #[error("stopped after {runs} runs")]
    Stopped { runs: usize },
    #[error("a finished run cannot be kept; what was kept before is used by the same command with --resume")]
    NotStored(#[source] RunLogError),
    #[error("the search failed")]
    Search(#[source] Error),
}

/// Runs a search or a correction to its end, from its current state; `made` counts its runs.
pub fn to_end<P, S: Solver<P, SearchState>>(problem: P, solver: S, made: fn(&S) -> usize) -> Result<S, FitError> {
    let result = Executor::new(problem, solver).ctrlc(false).timer(false).run().map_err(FitError::Search)?;
    match result.state.get_termination_status() {
        TerminationStatus::Terminated(TerminationReason::Interrupt) => {
            Err(FitError::Stopped { runs: made(&result.solver) })
        }
        _ => Ok(result.solver),
    }
}

/// Answer of the amplitudes alone.
pub(crate) struct Standing {
    pub p: f64,
    pub values: Vec<f64>,
    /// Start points (unit coordinates) of the waveform's search.
    pub elite: Vec<Vec<f64>>,
}

/// Answer and p-value of the amplitudes for a search that has ended.
pub(crate) fn standing(problem: impl Into<MultiRecord>, search: Search) -> Result<Standing, FitError> {
    let joint = problem.into();
    let search = to_end(joint.clone(), search, |search| search.runs.len())?;
    let training = search.training(search.runs.len());
    let judged = Posterior::of(&training, joint.first().parameters.len()).and_then(|posterior| {
        let at = posterior.centre(posterior.densest());
        let values = joint.first().parameters.iter().zip(&at).map(|(parameter, u)| parameter.value(*u)).collect();
        let p = Agreement::of(&training, &at, search.seed)?.p;
        Some(Standing { p, values, elite: elite(at, &training) })
    });
    judged.ok_or_else(|| too_few(&search.runs))
}

/// A point, then the training runs, best first, in unit coordinates.
fn elite(at: Vec<f64>, training: &TrainingRuns) -> Vec<Vec<f64>> {
    let best = ranking(training).into_iter().map(|(_, run)| training.position(run).to_vec());
    std::iter::once(at).chain(best).collect()
}

/// Reads the answer from all runs of a search that has ended, then again with the step error found there.
pub fn answer(joint: &MultiRecord, search: &Search) -> Result<Fit, FitError> {
    let made = search.runs.len();
    let last_batch = search.batches.last().copied().unwrap_or(0);
    let before = search.training(made - last_batch.min(made));
    let all = search.training(made);
    let reading = Reading {
        parameters: &joint.first().parameters,
        training: &all,
        before: &before,
        best: BEST,
        seed: search.seed,
    };
    let first = reading.place(Discrepancy::none(&all), None).ok_or_else(|| too_few(&search.runs))?;
    let found = Discrepancy::of_search(joint, &first.most_likely, made as u64).filter(Discrepancy::is_felt);
    let answer = reading.judge(found.and_then(|found| reading.place(found, None)).unwrap_or(first));
    Ok(Fit { runs: search.runs.clone(), ..answer })
}

/// Reads the answer from the upper level's runs of a correction that has ended, then again with the mesh error found
/// there; `chain` is the fit it started from.
pub fn corrected(fidelity: &FidelityLevel, chain: Fit, correction: &Correction) -> Result<Fit, FitError> {
    corrected_by(fidelity, chain, correction, None)
}

/// The same with the mesh error of the features, where it is known.
pub(crate) fn corrected_by(
    fidelity: &FidelityLevel,
    chain: Fit,
    correction: &Correction,
    known: Option<Discrepancy>,
) -> Result<Fit, FitError> {
    let made = correction.pairs.len();
    let last_round = correction.rounds.last().copied().unwrap_or(0);
    let runs: Vec<Run> = correction.pairs.iter().map(|pair| pair.upper.clone()).collect();
    let before = correction.training(made - last_round.min(made));
    let parameters = &fidelity.chain.parameters;
    let all = correction.training(made);
    let reading =
        Reading { parameters, training: &all, before: &before, best: correction::BEST, seed: correction.seed };
    let first = reading.place(Discrepancy::none(&all), correction.answer()).ok_or_else(|| too_few(&runs))?;
    let found = match (known, fidelity.finer()) {
        (None, Some(finer)) => {
            Discrepancy::of_level(fidelity, finer, &first.most_likely, made as u64).map_err(|unmade| match unmade {
                Incomplete::Stopped => FitError::Stopped { runs: made },
                Incomplete::NotStored(source) => FitError::NotStored(source),
            })?
        }
        (known, _) => known,
    };
    let answer = reading.judge(found.and_then(|found| reading.place(found, None)).unwrap_or(first));
    let mut fit = Fit { runs, ..answer };
    if correction.leans() && fit.verdict.explains() {
        fit.verdict = Verdict::NotConverged;
    }
    let differences = correction.differences(&fit.most_likely);
    fit.below = Some(Box::new(Below { fit: chain, differences }));
    Ok(fit)
}

fn too_few(runs: &[Run]) -> FitError {
    let failures: Vec<&String> = runs.iter().filter_map(|run| run.outcome.as_ref().err()).collect();
    FitError::TooFewRuns {
        made: runs.len(),
        failed: failures.len(),
        reason: failures.last().map_or_else(|| "nothing".into(), |reason| (*reason).clone()),
    }
}

/// Inputs from which an answer is read.
struct Reading<'a> {
    parameters: &'a [Parameter],
    training: &'a TrainingRuns,
    /// The runs without the last batch.
    before: &'a TrainingRuns,
    /// Number of best runs for the misfit.
    best: usize,
    seed: u64,
}

/// The answer under a known discretisation error.
struct Place {
    discrepancy: Discrepancy,
    /// All runs with that error corrected and equal weights.
    plain: TrainingRuns,
    training: TrainingRuns,
    posterior: Posterior,
    log_evidence: f64,
    estimates: Vec<Estimate>,
    most_likely: Vec<f64>,
    agreement: Agreement,
    inflation: Vec<f64>,
}

impl Reading<'_> {
    /// Finds the answer; `known` is the posterior of the uncorrected runs, if available. `None` if too few runs
    /// finished.
    fn place(&self, discrepancy: Discrepancy, known: Option<Posterior>) -> Option<Place> {
        let Self { parameters, .. } = *self;
        let dimension = parameters.len();
        let plain = self.training.clone().corrected(&discrepancy.shift, &discrepancy.nuggets);
        let mut posterior = known.or_else(|| Posterior::of(&plain, dimension))?;
        // Candidates are compared with every feature weighed alike.
        let log_evidence = posterior.log_evidence;
        let (mut estimates, mut most_likely) = estimates_of(parameters, &plain, &posterior);
        let agreement = Agreement::of(&plain, &most_likely, self.seed)?;
        // Features that no run has are weighed by how far they are off, at the answer that this moves.
        let (mut training, mut inflation) = (plain.clone(), agreement::inflation(&agreement.pulls));
        for _ in 0..REWEIGHINGS {
            if inflation.iter().all(|more| *more == 0.0) {
                break;
            }
            training = plain.clone().inflated(inflation.clone());
            posterior = Posterior::of(&training, dimension)?;
            (estimates, most_likely) = estimates_of(parameters, &training, &posterior);
            let Some(pulls) =
                plain.regress(&most_likely).and_then(|local| Some(local.residue(&local.deviation)?.pulls))
            else {
                break;
            };
            inflation = agreement::inflation(&pulls);
        }
        Some(Place {
            discrepancy,
            plain,
            training,
            posterior,
            log_evidence,
            estimates,
            most_likely,
            agreement,
            inflation,
        })
    }

    /// The fit at that place, without the runs.
    fn judge(&self, place: Place) -> Fit {
        let Self { parameters, before, .. } = *self;
        let Place {
            discrepancy,
            plain,
            training,
            posterior,
            log_evidence,
            estimates,
            most_likely,
            agreement,
            inflation,
        } = place;
        let spans: Vec<f64> = parameters.iter().map(Parameter::span).collect();
        let before = before.clone().corrected(&discrepancy.shift, &discrepancy.nuggets).inflated(inflation.clone());
        let drift =
            Posterior::of(&before, parameters.len()).map_or(f64::INFINITY, |before| drift(&before, &posterior, &spans));
        let ranked = ranking(&plain);
        let best: Vec<(f64, usize)> = ranked.iter().take(self.best).copied().collect();
        let misfit = best.get(best.len() / 2).map_or(f64::INFINITY, |entry| entry.0);
        let deviations = plain.regress(&most_likely).map_or_else(Vec::new, |local| {
            local.deviation.iter().zip(&local.scatter).map(|(deviation, scatter)| deviation / scatter).collect()
        });
        let scatter = ranked
            .first()
            .and_then(|best| plain.regress(plain.position(best.1)))
            .map_or_else(Vec::new, |local| local.scatter);
        let best: Vec<usize> = best.into_iter().map(|entry| entry.1).collect();
        let shares = shares(parameters, &training, &best, &agreement.records, &scatter);
        let misfit = shares.iter().map(|share| share.misfit).fold(misfit, f64::max);
        let verdict = Verdict::of(agreement.p, drift > 1.0, is_unusual(&estimates, parameters));
        Fit {
            parameters: parameters.to_vec(),
            estimates,
            most_likely,
            lobes: posterior.lobes(),
            correlation: posterior.first_correlation(),
            misfit,
            agreement,
            inflation,
            discrepancy,
            deviations,
            scatter,
            drift,
            log_evidence,
            verdict,
            posterior,
            runs: Vec::new(),
            below: None,
            waveform: None,
            shares,
        }
    }
}

/// Whether a value lies far outside what such benches have.
fn is_unusual(estimates: &[Estimate], parameters: &[Parameter]) -> bool {
    estimates.iter().zip(parameters).any(|(estimate, parameter)| parameter.is_unusual(estimate.value))
}
