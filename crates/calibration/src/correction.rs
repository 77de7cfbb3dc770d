//! The correction: where to run the fidelity level above the chain, as an argmin solver.
//!
//! Rounds of pairs ([`Pair`]), each a run of the chain and one of the fidelity level above under the same nuisances. The first round is drawn from
//! what the chain's search left, widened by what the fidelity levels may differ; every further one from the answer of the rounds before, widened
//! anew while that answer moves or leans on the edge of what the runs cover. It ends when the answer stands still, or after
//! [`MOST_ROUNDS`].
//!
//! Where most upper runs of a round fail, or none comes near the record, the place is empty: the record's own parameters make runs that
//! finish and resemble it. The correction then looks for itself, once, as the search does on the chain: a round scattered over the whole
//! box, three around the best runs found, and from there on as above.
//!
//! The answer is read from the runs of the upper fidelity level alone, by the regression of [`super::likelihood`]: the chain decides where they
//! are made, never what comes out.

use argmin::core::{Error, KV, Problem, Solver, State, TerminationReason, TerminationStatus};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::{
    estimate::drift,
    fidelity::{FidelityLevel, Pair, Unmade},
    forward::Run,
    likelihood::{TrainingRuns, neighbours},
    parameter::{Parameter, reflect},
    posterior::Posterior,
    search::{SearchState, around_elite, framed, ranking, scattered},
};

/// Pairs of the first round of one or two parameters.
const FIRST_ROUND: usize = 48;

/// Pairs of a further round of one or two parameters: a multiple of the runs that go side by side.
const FURTHER_ROUND: usize = 16;

/// The same where the answer leans on the edge of what the runs cover, or the box is looked through anew: there it is not known where it lies.
const LEANING_ROUND: usize = 32;

/// Fewest rounds: two would leave the answer to runs that were drawn before anything of the upper fidelity level was known.
const FEWEST_ROUNDS: usize = 3;

/// Most rounds, not counting those of a restart.
pub const MOST_ROUNDS: usize = 5;

/// Share of a round's upper runs that have to finish: around the record's own parameters nearly all do.
const FINISHING: f64 = 0.5;

/// Misfit of the best upper run above which nothing made so far comes near the record: three scatters in every feature. 25 is the most.
const FAR: f64 = 9.0;

/// Pairs of the round that is scattered over the whole box.
const SCATTERED_ROUND: usize = 96;

/// Sizes of the elites of the rounds that follow it.
const ELITES: [usize; 3] = [16, 12, 10];

/// Runs that FIT is the median misfit of: about as large a share as the ten best of a search's 600.
pub const BEST: usize = 3;

/// Most pairs where the chain points to the right place.
#[must_use]
pub(crate) fn most_pairs(dimension: usize) -> usize {
    sized(FIRST_ROUND, dimension) + (MOST_ROUNDS - 1) * sized(FURTHER_ROUND, dimension)
}

/// A round for so many parameters: as many runs more as the regression has neighbours more.
fn sized(round: usize, dimension: usize) -> usize {
    round * neighbours(dimension) / neighbours(2)
}

/// By how much the fidelity levels may differ in the logarithm of a parameter: the standard deviation that widens a round.
const WIDENING: f64 = 0.06;

/// The same once the answer of the upper fidelity level is roughly known.
const FINER_WIDENING: f64 = 0.01;

/// Move of a median over a round, in half-widths of its interval, below which the answer stands still.
const STILL: f64 = 0.5;

/// The same, above which the next round is widened as the first was.
const MOVING: f64 = 1.0;

/// Share of its extent by which the region covered by runs is trusted beyond them.
const MARGIN: f64 = 0.25;

/// Share of its extent within which an interval leans on the edge of that region.
const EDGE: f64 = 0.02;

/// The correction with everything it has found: all that a checkpoint needs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Correction {
    /// Every pair so far, in order.
    pub pairs: Vec<Pair>,
    /// Number of pairs in each round made.
    pub rounds: Vec<usize>,
    /// The answer of all pairs, where it is at hand: what a checkpoint has brought back finds it again.
    #[serde(skip)]
    latest: Option<Posterior>,
    /// How far the last round moved the answer, and whether the answer leans on the edge of what the runs cover.
    motion: Motion,
    /// Rounds made when the box was to be looked through anew.
    restarted: Option<usize>,
    seed: u64,
    /// Runs made on the fidelity levels below, behind which its own are numbered.
    before: usize,
    searched: Vec<Run>,
    spans: Vec<f64>,
    observed: Vec<f64>,
    nuggets: Vec<f64>,
    weights: Vec<f64>,
    power: f64,
    /// Of one record what is not known of its instrument, and how features answer.
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
    /// Standard error of `difference`.
    pub standard_error: f64,
}

/// What is taken from the features of both fidelity levels of a pair, lower first.
type Features<'a> = &'a dyn Fn(&[f64], &[f64]) -> Vec<f64>;

/// What the last round did to the answer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Motion {
    /// Largest move of a median, in half-widths of its interval; absent where there is no answer before it.
    drift: Option<f64>,
    /// Whether an interval ends at the edge of what the runs cover.
    leans: bool,
}

impl Correction {
    /// A correction of what `searched` found on the chain.
    #[must_use]
    pub fn new(fidelity: &FidelityLevel, searched: &[Run], seed: u64) -> Self {
        Self::above(fidelity, searched, searched.len(), seed)
    }

    /// A correction of what the runs of the fidelity level below found, the last of the `before` runs of all fidelity levels below.
    #[must_use]
    pub(crate) fn above(fidelity: &FidelityLevel, searched: &[Run], before: usize, seed: u64) -> Self {
        let chain = fidelity.chain();
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

    /// Whether this, read back, may be what the correction `fresh` became.
    pub(crate) fn may_follow(&self, fresh: &Self) -> bool {
        let lengths = |it: &Self| {
            let of_features = [it.observed.len(), it.nuggets.len(), it.weights.len(), it.sensitivity.1.len()];
            (of_features, it.spans.len(), it.searched.len(), it.before)
        };
        let (dimension, features) = (fresh.spans.len(), fresh.observed.len());
        let made = self.rounds.iter().try_fold(0_usize, |all, round| all.checked_add(*round));
        lengths(self) == lengths(fresh)
            && made == Some(self.pairs.len())
            && self.searched.iter().all(|run| run.is_of(dimension, features))
            && self.pairs.iter().flat_map(|pair| [&pair.lower, &pair.upper]).all(|run| run.is_of(dimension, features))
    }

    /// Take up a round that was made: what it moved, and whether it shows an empty place. Returns misfit and position of the best run.
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

    #[must_use]
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Whether no further round is needed, or allowed.
    #[must_use]
    pub(crate) fn is_finished(&self) -> bool {
        let settled = !self.motion.leans && self.motion.drift.is_some_and(|drift| drift < STILL);
        let rounds = match self.restarted {
            Some(before) => self.rounds.len().saturating_sub(before + 1 + ELITES.len()),
            None => self.rounds.len(),
        };
        rounds >= MOST_ROUNDS || (rounds >= FEWEST_ROUNDS && settled)
    }

    /// Whether the chain pointed to an empty place, so that the box was looked through anew.
    #[must_use]
    pub fn restarted(&self) -> bool {
        self.restarted.is_some()
    }

    /// Whether the answer leans on the edge of what the runs cover: it may lie beyond.
    #[must_use]
    pub fn leans(&self) -> bool {
        self.motion.leans
    }

    /// The answer of all pairs.
    #[must_use]
    pub(crate) fn answer(&self) -> Option<Posterior> {
        self.latest.clone().or_else(|| self.posterior(self.pairs.len()))
    }

    /// The upper fidelity level's runs of the first `count` pairs as the regression sees them.
    #[must_use]
    pub(crate) fn training(&self, count: usize) -> TrainingRuns {
        self.cloud_within(self.pairs.iter().take(count).map(|pair| &pair.upper))
    }

    /// Runs of a correction, which cover a part of the box, as the regression sees them.
    fn cloud_within<'a>(&self, runs: impl Iterator<Item = &'a Run> + Clone) -> TrainingRuns {
        let finished = runs.clone().filter(|run| run.outcome.is_ok()).count();
        let (low, high) = reach(runs.clone().map(|run| run.position.as_slice()), self.spans.len());
        let training = self.cloud_of(runs, neighbours(self.spans.len()).min(finished.saturating_sub(1)));
        framed(training, self.spans.len()).within(low, high)
    }

    /// How far the fidelity levels differ at a point: both fidelity levels' expected features, and the mean and scatter of the differences of pairs, all by
    /// local regression. Empty where that is impossible.
    #[must_use]
    pub fn differences(&self, at: &[f64]) -> Vec<LevelDifference> {
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

    fn cloud_of<'a>(&self, runs: impl Iterator<Item = &'a Run>, neighbours: usize) -> TrainingRuns {
        let finished = runs.filter_map(|run| Some((run.position.as_slice(), run.features()?)));
        let (sensitivity, answers) = self.sensitivity.clone();
        let training = TrainingRuns::new(finished, &self.observed, &self.nuggets, &self.weights, neighbours);
        training.tempered(self.power).scaled(sensitivity, answers)
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

    /// A round from the answer so far, or from the chain's, widened.
    fn drawn(&self, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        let dimension = self.spans.len();
        let made = self.pairs.len();
        let corrected = if made == 0 { None } else { self.answer() };
        let posterior = corrected.or_else(|| {
            let below = self.searched.iter();
            let is_search = self.before == self.searched.len();
            let training =
                if is_search { self.cloud_of(below, neighbours(dimension)) } else { self.cloud_within(below) };
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

/// The corners of the region that positions cover, with a margin, inside the unit box.
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
        "correction on the rung above"
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
            Err(Unmade::Stopped) => return Ok((state.terminate_with(TerminationReason::Interrupt), None)),
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
