//! Multi-fidelity correction: where to run the fidelity level above the chain, as an argmin solver.
//!
//! The correction makes rounds of pairs ([`Pair`]): a run of the chain and one of the level above, with the same
//! nuisances. The first round is drawn from the chain's posterior, widened by the expected difference between the
//! levels. Each further round is drawn from the posterior so far. It is widened again while the answer still moves, or
//! while it lies at the edge of the region covered by runs. The correction ends when the answer is stable, or after
//! `MOST_ROUNDS`.
//!
//! If most upper runs of a round fail, or none comes near the record, the region is wrong: runs at the true parameters
//! finish and resemble the record. A separate global search is then made once: a round scattered over the whole box,
//! three around the best runs found, and rounds as above.
//!
//! The answer is read from the runs of the upper level only, by the regression of [`super::likelihood`]. The chain
//! decides where runs are made and does not enter the result.

use argmin::core::{Error, KV, Problem, Solver, State, TerminationReason, TerminationStatus};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::{
    estimate::drift,
    fidelity::{FidelityLevel, Incomplete, Pair},
    forward::Run,
    likelihood::{TrainingRuns, neighbours},
    parameter::{Parameter, reflect},
    posterior::Posterior,
    search::{SearchState, around_elite, framed, ranking, scattered},
};

/// Pairs of the first round of one or two parameters.
const FIRST_ROUND: usize = 48;

/// Pairs of a further round for one or two parameters: a multiple of the number of parallel runs.
const FURTHER_ROUND: usize = 16;

/// The same if the answer lies at the edge of the covered region, or in a global search.
const LEANING_ROUND: usize = 32;

/// Fewest rounds: with two, most runs would have been drawn before anything was known of the upper level.
const FEWEST_ROUNDS: usize = 3;

/// Most rounds, not counting those of a restart.
pub(crate) const MOST_ROUNDS: usize = 5;

/// Least share of a round's upper runs that must finish; near the true parameters nearly all do.
const FINISHING: f64 = 0.5;

/// Misfit of the best upper run above which no run is near the record: three standard deviations in every feature. The
/// maximum is 25.
const FAR: f64 = 9.0;

/// Pairs of the round scattered over the whole box.
const SCATTERED_ROUND: usize = 96;

/// Sizes of the elites of the rounds after it.
const ELITES: [usize; 3] = [16, 12, 10];

/// Number of best runs whose median misfit is reported: about the same share as the ten best of a search's 600.
pub(crate) const BEST: usize = 3;

/// Most pairs without a global search.
pub(crate) fn most_pairs(dimension: usize) -> usize {
    sized(FIRST_ROUND, dimension) + (MOST_ROUNDS - 1) * sized(FURTHER_ROUND, dimension)
}

/// Round size for `dimension` parameters: grows in proportion to the neighbours of the regression.
fn sized(round: usize, dimension: usize) -> usize {
    round * neighbours(dimension) / neighbours(2)
}

/// Expected difference between the levels in the logarithm of a parameter: standard deviation by which a round is
/// widened.
const WIDENING: f64 = 0.06;

/// The same once the upper level's answer is roughly known.
const FINER_WIDENING: f64 = 0.01;

/// Move of a median in a round, in half-widths of its interval, below which the answer is stable.
const STILL: f64 = 0.5;

/// Move above which the next round is widened as much as the first.
const MOVING: f64 = 1.0;

/// Margin around the region covered by runs within which the regression is used, as a share of the region's extent.
const MARGIN: f64 = 0.25;

/// Distance from the edge of that region, as a share of its extent, below which an interval counts as touching it.
const EDGE: f64 = 0.02;

/// State of the correction.
#[derive(Debug, Clone)]
pub struct Correction {
    /// Every pair so far, in order.
    pub pairs: Vec<Pair>,
    /// Number of pairs in each round made.
    pub rounds: Vec<usize>,
    /// Posterior of all pairs, if already computed.
    latest: Option<Posterior>,
    /// Change of the answer in the last round.
    motion: Motion,
    /// Number of rounds before the global search, if one was made because the chain's region was wrong.
    pub restarted: Option<usize>,
    pub(super) seed: u64,
    /// Runs made on the levels below; the numbers of this level follow them.
    before: usize,
    searched: Vec<Run>,
    spans: Vec<f64>,
    observed: Vec<f64>,
    nuggets: Vec<f64>,
    weights: Vec<f64>,
    power: f64,
    /// For one record: uncertainty of the sensitivity factor (ln) and response of each feature to it.
    sensitivity: (f64, Vec<f64>),
}

/// One feature of both fidelity levels at one point of the box, z = ½ ln(f² + floor²).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LevelDifference {
    /// Expected on the fidelity level below.
    pub lower: f64,
    /// Scatter of a single run there.
    pub lower_scatter: f64,
    /// Expected on the fidelity level above.
    pub upper: f64,
    /// Scatter of a single run there.
    pub upper_scatter: f64,
    /// Expected upper − lower under the same nuisances.
    pub difference: f64,
    /// Scatter of that of a single pair.
    pub difference_scatter: f64,
    pub standard_error: f64,
}

/// Selects or combines the features of both levels of a pair, lower first.
type Features<'a> = &'a dyn Fn(&[f64], &[f64]) -> Vec<f64>;

/// Change of the answer in the last round.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Motion {
    /// Largest move of a median, in half-widths of its interval; `None` without an earlier answer.
    drift: Option<f64>,
    /// Whether an interval ends at the edge of the region covered by runs.
    leans: bool,
}

impl Correction {
    /// A correction that starts from the runs of the level below; `before` counts the runs of all levels below.
    pub fn new(fidelity: &FidelityLevel, searched: &[Run], before: usize, seed: u64) -> Self {
        let chain = &fidelity.chain;
        Self {
            pairs: vec![],
            rounds: vec![],
            latest: None,
            motion: Motion { drift: None, leans: true },
            restarted: None,
            seed,
            before,
            searched: searched.to_vec(),
            spans: chain.parameters.iter().map(Parameter::span).collect(),
            observed: chain.comparison.features.clone(),
            nuggets: chain.comparison.nuggets.clone(),
            weights: chain.comparison.weights.clone(),
            power: chain.comparison.power,
            sensitivity: (chain.comparison.sensitivity, chain.comparison.answers()),
        }
    }

    /// The same with rounds of pairs that were made otherwise.
    #[must_use]
    pub(crate) fn with_rounds(mut self, rounds: &[Vec<Pair>]) -> Self {
        rounds.iter().for_each(|round| {
            self.take(round.clone());
        });
        self
    }

    /// Adds a round and updates the state. Returns misfit and position of the best run.
    fn take(&mut self, pairs: Vec<Pair>) -> Option<(f64, Vec<f64>)> {
        self.rounds.push(pairs.len());
        self.pairs.extend(pairs);
        self.motion = self.motion();
        let training = self.training(self.pairs.len());
        let best = ranking(&training).first().copied();
        if self.restarted.is_none() && self.is_empty_place(best.map(|(misfit, _)| misfit)) {
            self.restarted = Some(self.rounds.len());
        }
        best.map(|(misfit, run)| (misfit, training.position(run).to_vec()))
    }

    /// Whether no further round is needed, or allowed.
    pub(crate) fn is_finished(&self) -> bool {
        let settled = !self.motion.leans && self.motion.drift.is_some_and(|drift| drift < STILL);
        let rounds = match self.restarted {
            Some(before) => self.rounds.len().saturating_sub(before + 1 + ELITES.len()),
            None => self.rounds.len(),
        };
        rounds >= MOST_ROUNDS || (rounds >= FEWEST_ROUNDS && settled)
    }

    /// Whether the answer lies at the edge of the region covered by runs, and may lie outside it.
    pub(crate) fn leans(&self) -> bool {
        self.motion.leans
    }

    /// The answer of all pairs.
    pub(crate) fn answer(&self) -> Option<Posterior> {
        self.latest.clone().or_else(|| self.posterior(self.pairs.len()))
    }

    /// The upper level's runs of the first `count` pairs, for the regression.
    pub(crate) fn training(&self, count: usize) -> TrainingRuns {
        self.training_within(self.pairs.iter().take(count).map(|pair| &pair.upper))
    }

    /// Runs of a correction, which cover only part of the box, for the regression.
    fn training_within<'a>(&self, runs: impl Iterator<Item = &'a Run> + Clone) -> TrainingRuns {
        let finished = runs.clone().filter(|run| run.outcome.is_ok()).count();
        let (low, high) = reach(runs.clone().map(|run| run.position.as_slice()), self.spans.len());
        let training = self.training_of(runs, neighbours(self.spans.len()).min(finished.saturating_sub(1)));
        framed(training, self.spans.len()).within(low, high)
    }

    /// Difference between the levels at a point, by local regression: expected features of both levels, mean and
    /// scatter of the differences of pairs. Empty if a regression is impossible.
    pub(crate) fn differences(&self, at: &[f64]) -> Vec<LevelDifference> {
        let both = || self.pairs.iter().filter_map(|pair| Some((pair, pair.lower.features()?, pair.upper.features()?)));
        let neighbours = neighbours(self.spans.len()).min(both().count().saturating_sub(1));
        let regress = |features: Features<'_>| {
            let all: Vec<(&[f64], Vec<f64>)> =
                both().map(|(pair, lower, upper)| (pair.upper.position.as_slice(), features(lower, upper))).collect();
            let runs = all.iter().map(|(position, z)| (*position, z.as_slice()));
            let zero = vec![0.0; self.observed.len()];
            TrainingRuns::new(runs, &zero, &zero, &self.weights, neighbours).regress(at)
        };
        let lower = regress(&|lower, _| lower.to_vec());
        let upper = regress(&|_, upper| upper.to_vec());
        let apart = regress(&|lower, upper| upper.iter().zip(lower).map(|(upper, lower)| upper - lower).collect());
        let (Some(lower), Some(upper), Some(apart)) = (lower, upper, apart) else { return vec![] };
        (0..self.observed.len())
            .map(|f| LevelDifference {
                lower: lower.deviation[f],
                lower_scatter: lower.scatter[f],
                upper: upper.deviation[f],
                upper_scatter: upper.scatter[f],
                difference: apart.deviation[f],
                difference_scatter: apart.scatter[f],
                standard_error: apart.scatter[f] / apart.effective.sqrt(),
            })
            .collect()
    }

    fn training_of<'a>(&self, runs: impl Iterator<Item = &'a Run> + Clone, neighbours: usize) -> TrainingRuns {
        let lost = runs.clone().filter(|run| run.outcome.is_err()).map(|run| run.position.as_slice());
        let finished = runs.filter_map(|run| Some((run.position.as_slice(), run.features()?)));
        let (sensitivity, answers) = self.sensitivity.clone();
        let training = TrainingRuns::new(finished, &self.observed, &self.nuggets, &self.weights, neighbours);
        training.losing(lost).tempered(self.power).scaled(sensitivity, answers)
    }

    /// Posterior of the first `count` pairs.
    fn posterior(&self, count: usize) -> Option<Posterior> {
        Posterior::of(&self.training(count), self.spans.len())
    }

    fn propose(&self) -> Vec<Vec<f64>> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ 0x00C0_44EC);
        random.set_stream(self.rounds.len() as u64);
        let dimension = self.spans.len();
        let [scattered_round, leaning_round] = [SCATTERED_ROUND, LEANING_ROUND].map(|round| sized(round, dimension));
        match self.restarted.map(|before| self.rounds.len() - before) {
            Some(0) => scattered(0, scattered_round, dimension, self.seed),
            Some(round) if round <= ELITES.len() => {
                let training = self.training(self.pairs.len());
                if training.is_empty() {
                    let made = scattered_round + (round - 1) * leaning_round;
                    return scattered(made, leaning_round, dimension, self.seed);
                }
                around_elite(&training, ELITES[round - 1], leaning_round, &mut random)
            }
            _ => self.drawn(&mut random),
        }
    }

    /// Draws a round from the widened posterior so far, or from the chain's.
    fn drawn(&self, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        let dimension = self.spans.len();
        let made = self.pairs.len();
        let corrected = if made == 0 { None } else { self.answer() };
        let posterior = corrected.or_else(|| {
            let below = self.searched.iter();
            let is_search = self.before == self.searched.len();
            let training =
                if is_search { self.training_of(below, neighbours(dimension)) } else { self.training_within(below) };
            Posterior::of(&training, dimension)
        });
        let moving = self.motion.leans || self.motion.drift.is_none_or(|drift| drift > MOVING);
        let widening = if moving { WIDENING } else { FINER_WIDENING };
        let further = if self.motion.leans { LEANING_ROUND } else { FURTHER_ROUND };
        let count = sized(if made == 0 { FIRST_ROUND } else { further }, dimension);
        (0..count)
            .map(|_| {
                let centre = match &posterior {
                    Some(posterior) => posterior.draw(1.0, random),
                    None => (0..dimension).map(|_| random.random::<f64>()).collect(),
                };
                let widened = centre.iter().zip(&self.spans).map(|(u, span)| {
                    let draw: f64 = StandardNormal.sample(random);
                    reflect(u + widening / span * draw)
                });
                widened.collect()
            })
            .collect()
    }

    /// Whether most upper runs of the last round failed, or the best of all is far from the record.
    fn is_empty_place(&self, best: Option<f64>) -> bool {
        let last = self.rounds.last().copied().unwrap_or(0);
        let round = &self.pairs[self.pairs.len() - last..];
        let finished = round.iter().filter(|pair| pair.upper.outcome.is_ok()).count();
        (finished as f64) < FINISHING * last as f64 || best.is_none_or(|misfit| misfit > FAR)
    }

    fn motion(&mut self) -> Motion {
        let made = self.pairs.len();
        let before = made - self.rounds.last().copied().unwrap_or(made);
        let before = if before == 0 { None } else { self.latest.take().or_else(|| self.posterior(before)) };
        let Some(after) = self.posterior(made) else { return Motion { drift: None, leans: true } };
        let (low, high) = self.training(made).domain(self.spans.len());
        let leans = (0..self.spans.len()).any(|d| {
            let edge = EDGE * (high[d] - low[d]);
            (low[d] > 0.0 && after.quantile(d, 0.05) < low[d] + edge)
                || (high[d] < 1.0 && after.quantile(d, 0.95) > high[d] - edge)
        });
        let motion = Motion { drift: before.map(|before| drift(&before, &after, &self.spans)), leans };
        self.latest = Some(after);
        motion
    }
}

/// Corners of the region that positions cover, with a margin, inside the unit box.
fn reach<'a>(positions: impl Iterator<Item = &'a [f64]>, dimension: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut low, mut high) = (vec![f64::INFINITY; dimension], vec![f64::NEG_INFINITY; dimension]);
    for position in positions {
        for (d, u) in position.iter().enumerate() {
            low[d] = low[d].min(*u);
            high[d] = high[d].max(*u);
        }
    }
    let margins: Vec<f64> = low.iter().zip(&high).map(|(low, high)| MARGIN * (high - low)).collect();
    low.iter_mut().zip(&margins).for_each(|(low, margin)| *low = (*low - margin).max(0.0));
    high.iter_mut().zip(&margins).for_each(|(high, margin)| *high = (*high + margin).min(1.0));
    (low, high)
}

impl Solver<FidelityLevel, SearchState> for Correction {
    fn name(&self) -> &'static str {
        "correction on the fidelity level above"
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<FidelityLevel>,
        state: SearchState,
    ) -> Result<(SearchState, Option<KV>), Error> {
        let first = (self.before + self.pairs.len()) as u64;
        let positions = self.propose();
        let made =
            problem.bulk_problem("cost_count", positions.len(), |fidelity| Ok(fidelity.pairs(first, &positions)))?;
        let pairs = match made {
            Ok(pairs) => pairs,
            Err(Incomplete::Stopped) => return Ok((state.terminate_with(TerminationReason::Interrupt), None)),
            Err(error) => return Err(error.into()),
        };
        let state = match self.take(pairs) {
            Some((misfit, position)) => state.param(position).cost(misfit),
            None => state,
        };
        Ok((state, None))
    }

    fn terminate(&mut self, _state: &SearchState) -> TerminationStatus {
        if self.is_finished() {
            TerminationStatus::Terminated(TerminationReason::SolverConverged)
        } else {
            TerminationStatus::NotTerminated
        }
    }
}
