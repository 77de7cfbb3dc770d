//! Likelihood of the waveform: every sample is compared from the onset until runs with different nuisances diverge.
//!
//! ```text
//! search ─ rounds of runs near the answer ─ regression of every sample on the parameters ─ covariance ─ answer, p
//! ```
//!
//! Method, formulas and counts: `docs/method.md`.

mod columns;
mod difference;
mod ensemble;
mod minimum;
mod origin;
mod p_value;
mod record;
mod regression;
mod residual;
mod rounds;
mod source;
mod start;

use std::sync::Arc;

use argmin::core::Executor;
use serde::{Deserialize, Serialize};

pub(crate) use self::difference::Difference;
pub(crate) use self::source::{USUAL_RUNS, pairs_before};
pub(crate) use self::{
    columns::{CLOCK, Nuisances},
    ensemble::inverse,
    start::Start,
};
pub use self::{
    origin::Origin,
    residual::{Clock, Residual},
};
use self::{
    record::RecordTrace,
    rounds::{Answer, LOST, Rounds},
    source::{Source, Sources},
    start::{QUICK, WHOLE},
};
use crate::{
    agreement::DOUBTFUL,
    discrepancy::Discrepancy,
    drive::HornNoise,
    estimate::Estimate,
    fidelity::{FidelityLevel, Pair},
    forward::{Forward, Uncertainty},
    parameter::Parameter,
    posterior::Posterior,
};
use granchain_model::scene::Support;
use granchain_signal::{
    Series,
    feature::{Measurand, fingerprint::SAMPLES_PER_CYCLE},
};

/// Difference of two clocks from which it is no longer usual.
const OTHER_CLOCK: f64 = 5.0 * CLOCK;

/// Result of the waveform comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WaveformFit {
    /// The answer, unit coordinates; α at the true drive level.
    pub at: Vec<f64>,
    /// Covariance of the logarithms of the fitted parameters, including the uncertainty of the drive level.
    pub covariance: Vec<Vec<f64>>,
    /// ln of α times the drive level, over α, and its standard deviation: a record determines only that product.
    /// `None` for several records, or if α is not fitted.
    pub product: Option<[f64; 2]>,
    /// ln of stiffness over mass, relative to the scene's, and its standard deviation; `None` if it is not a nuisance.
    pub modulus: Option<[f64; 2]>,
    pub p: f64,
    /// T over the number of samples.
    pub reduced: f64,
    /// Predictable cycles after the onset; the largest of all records.
    pub cycles: f64,
    /// Whether every record ends within these cycles.
    pub whole: bool,
    pub rounds: usize,
    pub runs: u64,
    /// Number of samples left out: drop-outs, masked or detected by the runs. Amplitudes use a bridge there.
    #[serde(default)]
    pub left_out: usize,
    /// Whether the answer had converged.
    pub settled: bool,
    /// What the model above the chain that answers changes of its runs.
    #[serde(skip)]
    pub(crate) difference: Option<Arc<Difference>>,
    /// What is left of every record.
    #[serde(skip)]
    pub residuals: Vec<Residual>,
    /// Variance of ln of every fitted parameter by where it comes from.
    #[serde(skip)]
    pub origins: Vec<(Origin, Vec<f64>)>,
    /// Pairs of the model above the chain, of every turn, and what a finer mesh changes of the features.
    #[serde(skip)]
    pub(crate) pairs: Vec<Vec<Pair>>,
    #[serde(skip)]
    pub(crate) mesh: Option<Discrepancy>,
}

/// A record with its forward model.
pub(crate) struct Compared<'a> {
    pub forward: &'a Forward,
    pub noise: Option<HornNoise>,
    pub trace: &'a Series,
    /// What the model above the chain changes of its runs, where that is known.
    pub difference: Option<Arc<Difference>>,
    /// Standard deviation of the ratio of the two clocks.
    pub clock: f64,
}

/// Fewest predictable cycles after the onset for the waveform to decide.
pub(crate) const FEWEST_CYCLES: f64 = 6.0;

/// Standard deviation in ln above which a normal distribution does not describe the answer.
const WIDEST: f64 = 0.15;

/// Factor on the p of a waveform that does not decide, in the verdict.
const FIRST_CYCLES: f64 = 10.0;

/// p below which the rounds are repeated from the amplitudes' answer, and then after further searches: of a waveform that decides, and of another, whose
/// runs diverge so early that a search may miss the record.
const AGAIN: f64 = 0.01;
const SEARCHES: [u64; 2] = [2, 4];

/// Further tries above the chain where none has p above that, and the T/N above which there are none: of thirty of these no try came near the record.
const TRIES: u64 = 2;
const FAR_OFF: f64 = 15.0;

/// p of a model above the chain below which other pairs are tried once: where two answers fit the start of a record, the worse one leaves more.
const DOUBTED: f64 = 0.2;

/// Most times that pairs are made about an answer; largest distance of the next answer from their middle, in their spread, that ends it; and the
/// step between the numbers of their runs.
const TURNS: u64 = 4;
const NEAR: f64 = 1.5;
const BETWEEN: u64 = 1 << 20;

/// 95 % quantile of the standard normal distribution.
pub const QUANTILE: f64 = 1.644_853_627;

/// Smallest p at which crosstalk can be distinguished from a wrong model.
const FITS: f64 = 0.01;

/// Crosstalk over the peak, and over its standard deviation, that is named.
const NAMED: (f64, f64) = (2e-3, 4.0);

impl WaveformFit {
    /// Whether the waveform decides: enough cycles are predictable, and the answer is narrow enough for a normal
    /// distribution.
    #[must_use]
    pub fn decides(&self) -> bool {
        let narrow = (0..self.at.len()).all(|d| self.covariance[d][d].sqrt() < WIDEST);
        narrow && (self.whole || self.cycles >= FEWEST_CYCLES)
    }

    /// The crosstalk of the drive in record `number`, over its peak, and its standard deviation, where it is beyond doubt: the waveform decides, has
    /// settled and fits (p ≥ 0.01), and the share is above 0.2 % and 4 standard deviations.
    #[must_use]
    pub fn crosstalk(&self, number: usize) -> Option<[f64; 2]> {
        let found = self.residuals.get(number)?.crosstalk;
        (self.decides() && self.settled && self.p >= FITS && found[0] > f64::max(NAMED.0, NAMED.1 * found[1]))
            .then_some(found)
    }

    /// Another clock of a record, where it is certain, and differs by more than clocks do.
    pub(crate) fn clock_seen(&self, number: usize) -> Option<Clock> {
        let seen = self.residuals.get(number)?.clock;
        (self.decides() && seen.differs_by(OTHER_CLOCK)).then_some(seen)
    }

    /// The same, unless it is a small part of what a wrong model leaves.
    pub(crate) fn other_clock(&self, number: usize) -> Option<Clock> {
        self.clock_seen(number).filter(|seen| self.p >= FITS || seen.explains_much())
    }

    /// p of the verdict: twice the smaller of waveform and amplitudes, or the waveform's own if the record has
    /// drop-outs. Of a waveform that does not decide ten times its p counts, so that it rejects one right record in a thousand.
    pub(crate) fn with_amplitudes(&self, p: f64) -> f64 {
        match self.left_out {
            _ if !self.decides() => p.min(FIRST_CYCLES * self.p),
            0 => (2.0 * p.min(self.p)).min(1.0),
            _ => self.p,
        }
    }

    /// The posterior of the parameters: a normal distribution of their logarithms.
    pub(crate) fn posterior(&self, parameters: &[Parameter]) -> Posterior {
        let spans: Vec<f64> = parameters.iter().map(Parameter::span).collect();
        let unit = |a: usize, b: usize| self.covariance[a][b] / (spans[a] * spans[b]);
        let covariance: Vec<Vec<f64>> =
            (0..spans.len()).map(|a| (0..spans.len()).map(|b| unit(a, b)).collect()).collect();
        Posterior::normal(&self.at, &covariance)
    }

    /// Quoted estimates of the parameters.
    pub(crate) fn estimates(&self, parameters: &[Parameter]) -> Vec<Estimate> {
        let estimate = |(d, parameter): (usize, &Parameter)| {
            let half = QUANTILE * self.covariance[d][d].sqrt() / parameter.span();
            let [low, middle, high] = [-half, 0.0, half].map(|by| (self.at[d] + by).clamp(0.0, 1.0));
            Estimate::between(parameter, middle, [low, middle, high])
        };
        parameters.iter().enumerate().map(estimate).collect()
    }
}

/// Whether a waveform that does not decide misses even the few cycles that are compared, so that the features alone cannot vouch for the model.
pub(crate) fn contradicts(decides: bool, p: f64) -> bool {
    !decides && FIRST_CYCLES * p < DOUBTFUL
}

/// Mean and standard deviation of ln of the drive level: uniform within ± `drive`, minus the possible loss in the
/// vibrometer's filter, up to `droop`.
fn level(Uncertainty { drive, droop, .. }: Uncertainty) -> (f64, f64) {
    const POINTS: usize = 400;
    let taken = (0..POINTS).map(|i| -(1.0 - droop * (i as f64 + 0.5) / POINTS as f64).ln());
    let (sum, square) = taken.fold((0.0, 0.0), |(sum, square), x| (sum + x, square + x * x));
    let mean = sum / POINTS as f64;
    let variance = square / POINTS as f64 - mean * mean;
    (mean, (drive * drive / 3.0 + variance.max(0.0)).sqrt())
}

/// What the fit of a waveform on the chain is for.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Purpose {
    /// The start of a fit above the chain: without the final rounds and the correction for a finer step.
    Start,
    /// The answer.
    Answer,
}

/// The fit of the waveforms of all records on the chain, whose search on amplitudes knows `known` (unit coordinates, the best first). `None` where a
/// record has no waveform that can be compared, or nothing comes of it.
pub(crate) fn fit(records: Vec<Compared>, known: &[Vec<f64>], seed: u64, purpose: Purpose) -> Option<WaveformFit> {
    let source = |compared| source(compared, None);
    let sources = Sources::new(records.into_iter().map(source).collect::<Option<Vec<_>>>()?);
    let about = |start, seed| {
        let rounds = Rounds::about(sources.clone(), start, seed);
        result_of(&run(if purpose == Purpose::Start { rounds.scouting() } else { rounds })?)
    };
    let mut best: Option<WaveformFit> = None;
    for number in 0..if purpose == Purpose::Answer { SEARCHES[1] } else { 1 } {
        if number == SEARCHES[0] && best.as_ref().is_none_or(WaveformFit::decides) {
            break;
        }
        let seed = seed.wrapping_add(number);
        for start in start::search(&sources, known, seed, &WHOLE)?.0 {
            best = better(best, about(start, seed));
            let fits = |fit: &WaveformFit| fit.p >= AGAIN && (purpose != Purpose::Answer || fit.reduced <= LOST);
            if best.as_ref().is_some_and(fits) || !sources.goes_on() {
                return best;
            }
        }
    }
    best
}

/// Where a quick search with short runs begins a fit, from points of another (unit coordinates), and its misfit to the first cycles over the record's
/// mean square. `None` as for [`fit`].
pub(crate) fn quick(compared: Compared, known: &[Vec<f64>], seed: u64) -> Option<(Start, f64)> {
    let sources = Sources::new(vec![source(compared, None)?]);
    let ([start, _], misfit) = start::search(&sources, known, seed, &QUICK)?;
    Some((start, misfit))
}

/// The fit of one record on the chain with few rounds, from such a start or about a point (unit coordinates) that is known to so many deviations (ln).
pub(crate) fn hurried(compared: Compared, from: Result<Start, (&[f64], &[f64])>, seed: u64) -> Option<WaveformFit> {
    let sources = Sources::new(vec![source(compared, None)?]);
    let start = match from {
        Ok(start) => start,
        Err((at, deviations)) => start::about(&sources, at, deviations).placed(&sources, seed)?,
    };
    result_of(&run(Rounds::about(sources, start, seed).hurried())?)
}

/// Runs of a quick search, and of the start of a fit about a point.
pub(crate) const QUICK_RUNS: usize = QUICK.runs();
pub(crate) const PLACED_RUNS: usize = start::PLACED;

/// Most runs of [`hurried`] from a start.
pub(crate) const HURRIED_RUNS: usize = rounds::HURRIED_RUNS;

/// The same on a model above the chain, whose amplitudes say where the answer lies (unit coordinates) and the standard deviations of it (ln).
pub(crate) fn fit_above(
    compared: Compared,
    above: &FidelityLevel,
    at: &[f64],
    deviations: &[f64],
    seed: u64,
) -> Option<WaveformFit> {
    let sources = Sources::new(vec![source(compared, Some(above.clone()))?]);
    let tried = |number: u64| turns(&sources, start::about(&sources, at, deviations), seed.wrapping_add(number));
    let first = tried(0);
    if let Some(fit) = first.as_ref().filter(|fit| fit.p >= AGAIN) {
        let doubted = fit.p < DOUBTED && fit.decides() && sources.goes_on();
        return if doubted { better(first, tried(1)) } else { first };
    }
    let ([found, _], _) = start::search(&sources, &[at.to_vec()], seed, &WHOLE)?;
    // Where the chain is far off, other pairs may lead elsewhere.
    (1..=TRIES).fold(better(first, turns(&sources, found, seed)), |best, number| {
        let over = |fit: &WaveformFit| fit.p >= AGAIN || fit.reduced > FAR_OFF || !fit.decides();
        if best.as_ref().is_none_or(over) || !sources.goes_on() {
            return best;
        }
        better(best, tried(number))
    })
}

/// Rounds, and again with pairs about their answer, until it lies in the middle of its pairs.
fn turns(sources: &Sources, mut start: Start, seed: u64) -> Option<WaveformFit> {
    let (mut pairs, mut before) = (Vec::new(), None::<Rounds>);
    for turn in 0..TURNS {
        let (paired, made) = sources.paired(turn * BETWEEN, &start, seed)?;
        pairs.push(made);
        let rounds = match before {
            Some(rounds) => rounds.on(paired),
            // The chain alone may lie cycles off.
            None => {
                let start = start.placed(&paired, seed)?;
                Rounds::about(paired, start, seed).scouting()
            }
        };
        let rounds = run(rounds)?;
        let latest = rounds.latest()?;
        if turn + 1 == TURNS || turn > 0 && rounds.sources.distance(&latest.at) < NEAR {
            return result_of(&rounds).map(|fit| WaveformFit { pairs, ..fit });
        }
        start = Start::behind(latest);
        before = Some(rounds);
    }
    None
}

/// The fit with the larger p. Far from the record, where runs differ as much from each other, the nearer one.
fn better(first: Option<WaveformFit>, again: Option<WaveformFit>) -> Option<WaveformFit> {
    let rank = |fit: &WaveformFit| if fit.reduced <= LOST { fit.p } else { -fit.reduced };
    match (first, again) {
        (Some(first), Some(again)) => Some(if rank(&first) < rank(&again) { again } else { first }),
        (first, again) => first.or(again),
    }
}

/// What the waveforms of these records can say of the parameters, before any fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WaveformBound {
    /// Cramér–Rao bound: the least covariance of ln of the parameters, with what is not known of drive level and mass.
    pub bound: Vec<Vec<f64>>,
    /// Covariance that a fit is expected to quote.
    pub expected: Vec<Vec<f64>>,
    /// Predictable cycles after the onset.
    pub cycles: f64,
    /// Whether the waveform is expected to decide ([`WaveformFit::decides`]).
    pub decides: bool,
}

/// The bound at a point (unit coordinates), from runs of the chain about it: C = (J' Σ⁻¹ J)⁻¹, J the derivative of the mean trace, Σ the covariance
/// of the likelihood (run-to-run differences, noise, instrument). Of a record only noise, length and position are used. `deviations`: a first guess
/// of the standard deviations, ln.
pub(crate) fn bound(records: Vec<Compared>, at: &[f64], deviations: &[f64], seed: u64) -> Option<WaveformBound> {
    let sources = Sources::new(records.into_iter().map(|compared| source(compared, None)).collect::<Option<Vec<_>>>()?);
    let start = start::about(&sources, at, deviations).placed(&sources, seed)?;
    let (rounds, bound, factor) = Rounds::about(sources, start, seed).bound()?;
    let of = |factor: f64| {
        let mut solution = bound.clone();
        solution.covariance.iter_mut().flatten().for_each(|entry| *entry *= factor * factor);
        fit_of(&rounds, Answer { solution, p: 1.0, residuals: vec![], origins: vec![] })
    };
    let (bound, expected) = (of(1.0).covariance, of(factor));
    Some(WaveformBound { bound, decides: expected.decides(), cycles: expected.cycles, expected: expected.covariance })
}

/// A record that can be compared, with what makes its runs.
fn source(compared: Compared, above: Option<FidelityLevel>) -> Option<Source> {
    let comparison = &compared.forward.comparison;
    let on_disc = matches!(compared.forward.scene().support, Support::Disc { .. });
    if on_disc || comparison.measurand() == Measurand::Pressure {
        return None;
    }
    let trace = RecordTrace::of(compared.trace, comparison)?;
    let mut source = Source::new(compared.forward.clone(), compared.noise, trace, compared.clock);
    (source.above, source.difference) = (above, compared.difference);
    Some(source)
}

fn run(rounds: Rounds) -> Option<Rounds> {
    Some(Executor::new((), rounds).ctrlc(false).timer(false).run().ok()?.solver)
}

/// What rounds that have ended say.
fn result_of(rounds: &Rounds) -> Option<WaveformFit> {
    Some(fit_of(rounds, rounds.answer()?))
}

fn fit_of(rounds: &Rounds, answer: Answer) -> WaveformFit {
    let sources = &rounds.sources;
    let solution = answer.solution;
    let forward = &sources.records[0].forward;
    let dimension = sources.spans().len();
    let mut covariance: Vec<Vec<f64>> =
        solution.covariance[..dimension].iter().map(|row| row[..dimension].to_vec()).collect();
    let mut at = solution.at.clone();
    let mut origins = answer.origins;
    for (_, variance) in &mut origins {
        variance.truncate(dimension);
    }
    let mut further = |origin: Origin, d: usize, variance: f64| {
        let mut of = vec![0.0; dimension];
        of[d] = variance;
        if !origins.is_empty() && variance > 0.0 {
            origins.push((origin, of));
        }
    };
    let product = sources.alpha().filter(|_| sources.shares_level()).map(|alpha| {
        let (mean, deviation) = level(forward.uncertainty());
        let product = covariance[alpha][alpha].sqrt();
        covariance[alpha][alpha] += deviation * deviation;
        further(Origin::HornScale, alpha, deviation * deviation);
        at[alpha] -= mean;
        [mean, product]
    });
    let forces: Vec<usize> = (0..dimension).filter(|d| forward.parameters[*d].target.is_force()).collect();
    for d in &forces {
        further(Origin::Mass, *d, forward.uncertainty().mass.powi(2));
    }
    for (a, b) in forces.iter().flat_map(|a| forces.iter().map(move |b| (*a, *b))) {
        covariance[a][b] += forward.uncertainty().mass.powi(2);
    }
    let modulus = sources.modulus.map(|_| {
        let last = solution.at.len() - 1;
        [solution.at[last], solution.covariance[last][last].sqrt()]
    });
    let cycles = |(placed, source): (&ensemble::Placed, &Source)| {
        let onset = source.trace.onset as f64 - placed.shift;
        (placed.predictable as f64 - onset) / SAMPLES_PER_CYCLE as f64
    };
    let cycles = solution.placed.iter().zip(&sources.records).map(cycles).fold(0.0, f64::max);
    WaveformFit {
        at: sources.unit(&at),
        covariance,
        product,
        modulus,
        p: answer.p,
        reduced: solution.reduced(),
        cycles,
        whole: solution.placed.iter().all(|placed| placed.predictable >= placed.last),
        rounds: rounds.rounds,
        runs: rounds.runs,
        left_out: sources.records.iter().map(|source| source.trace.left_out).sum(),
        settled: rounds.settled,
        difference: sources.records[0].difference.clone(),
        residuals: answer.residuals,
        origins,
        pairs: Vec::new(),
        mesh: sources.records[0].mesh.clone(),
    }
}
