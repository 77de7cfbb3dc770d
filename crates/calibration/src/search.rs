//! The search: where to run next, as an argmin solver.
//!
//! 1. 160 Sobol points over the box.
//! 2. Five batches around an elite: the m best runs (m = 24, 20, 16, 12, 10), each new point a normal step of 0.7 times
//!    the distance to the elite's fifth neighbour, reflected at the box.
//! 3. Two batches drawn from the likelihood surface itself, flattened to exp(½ SL).
//!
//! In chaotic regimes the misfit is a noisy draw, so its minimum is the luckiest run, not the truest: the answer is read
//! from a regression over all runs ([`super::likelihood`]), and every run made helps it.

use argmin::core::{Error, IterState, KV, Problem, Solver, State, TerminationReason, TerminationStatus};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    comparison::Comparison,
    forward::Run,
    frame::Frame,
    likelihood::{TrainingRuns, neighbours},
    multi_record::MultiRecord,
    parameter::reflect,
    posterior::Posterior,
};

/// Allowed numbers of runs: fewer do not allow a regression.
pub(crate) const EVALUATION_RANGE: std::ops::RangeInclusive<usize> = 200..=100_000;

/// State that argmin's executor carries: the best position and its misfit.
pub(crate) type SearchState = IterState<Vec<f64>, (), (), (), (), f64>;

/// Sizes of the elites, one a batch of stage 2.
const ELITES: [usize; 5] = [24, 20, 16, 12, 10];

/// Batches an elite of each size, for so many parameters and records.
const fn rounds(dimension: usize, records: usize) -> usize {
    if dimension > 2 || records > 1 { 3 } else { 1 }
}

/// Step around an elite, in distances to its fifth neighbour.
const ELITE_STEP: f64 = 0.7;

/// Standard deviation added to a step along an elite, unit coordinates, so that no direction degenerates.
const BLUR: f64 = 2e-3;

/// Power on the likelihood from which stage 3 draws.
const DRAW_POWER: f64 = 0.5;

/// State of the search.
#[derive(Debug, Clone)]
pub struct Search {
    /// Every run so far, in order.
    pub runs: Vec<Run>,
    /// Number of runs in each batch.
    pub batches: Vec<usize>,
    /// Number of batches made.
    pub(super) batch: usize,
    pub(super) seed: u64,
    dimension: usize,
    observed: Vec<f64>,
    nuggets: Vec<f64>,
    weights: Vec<f64>,
    /// Number of features of each record.
    parts: Vec<usize>,
    power: f64,
    /// For one record: uncertainty of the sensitivity factor (ln) and response of each feature to it.
    sensitivity: (f64, Vec<f64>),
}

impl Search {
    /// A search of `budget` runs (see [`Search::tested`]) for the record or records of `problem`.
    pub fn new(problem: impl Into<MultiRecord>, budget: usize, seed: u64) -> Self {
        let joint = problem.into();
        let of_all = |values: fn(&Comparison) -> &Vec<f64>| {
            joint.records.iter().flat_map(|record| values(&record.comparison)).copied().collect()
        };
        let share = |fraction: f64| ((budget as f64 * fraction).round() as usize).max(1);
        let dimension = joint.first().parameters.len();
        let elites = ELITES.len() * rounds(dimension, joint.records.len());
        let (elite, drawn) = (share(290.0 / 600.0 / elites as f64), share(75.0 / 600.0));
        let first = budget.saturating_sub(elites * elite + 2 * drawn).max(1);
        let mut batches = vec![first];
        batches.extend(vec![elite; elites]);
        batches.extend([drawn; 2]);
        Self {
            runs: vec![],
            batches,
            batch: 0,
            seed,
            dimension,
            observed: of_all(|comparison| &comparison.features),
            nuggets: of_all(|comparison| &comparison.nuggets),
            weights: of_all(|comparison| &comparison.weights),
            parts: joint.records.iter().map(|record| record.comparison.features.len()).collect(),
            power: joint.first().comparison.power,
            sensitivity: (
                joint.first().comparison.sensitivity,
                joint.records.iter().flat_map(|record| record.comparison.answers()).collect(),
            ),
        }
    }

    /// Runs of a search with which intervals were tested, for this number of parameters.
    pub const fn tested(parameters: usize) -> usize {
        if parameters > 2 { 1800 } else { 600 }
    }

    /// The finished runs among the first `count`, for the regression.
    pub(crate) fn training(&self, count: usize) -> TrainingRuns {
        let finished = self.runs.iter().take(count).filter_map(|run| Some((run.position.as_slice(), run.features()?)));
        let training =
            TrainingRuns::new(finished, &self.observed, &self.nuggets, &self.weights, neighbours(self.dimension));
        let lost = self.runs.iter().take(count).filter(|run| run.outcome.is_err()).map(|run| run.position.as_slice());
        let training = training.losing(lost);
        let (sensitivity, answers) = self.sensitivity.clone();
        framed(training.parted(&self.parts).tempered(self.power).scaled(sensitivity, answers), self.dimension)
    }

    fn propose(&self) -> Vec<Vec<f64>> {
        let count = self.batches[self.batch];
        let training = self.training(self.runs.len());
        if self.batch == 0 || training.len() <= neighbours(self.dimension) {
            return self.scattered(count);
        }
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ 0x005E_A2C4);
        random.set_stream(self.batch as u64);
        match ELITES.get((self.batch - 1) / rounds(self.dimension, self.parts.len())) {
            Some(&size) => {
                around_elite(&training, size * neighbours(self.dimension) / neighbours(2), count, &mut random)
            }
            None => self.drawn(&training, count, &mut random).unwrap_or_else(|| self.scattered(count)),
        }
    }

    fn scattered(&self, count: usize) -> Vec<Vec<f64>> {
        scattered(self.runs.len(), count, self.dimension, self.seed)
    }

    fn drawn(&self, training: &TrainingRuns, count: usize, random: &mut ChaCha8Rng) -> Option<Vec<Vec<f64>>> {
        let posterior = Posterior::of(training, self.dimension)?;
        let points = (0..count).map(|_| posterior.draw(DRAW_POWER / training.power, random));
        Some(points.collect())
    }
}

/// Points `first` to `first + count` of the scrambled Sobol sequence of a seed.
pub(super) fn scattered(first: usize, count: usize, dimension: usize, seed: u64) -> Vec<Vec<f64>> {
    let point = |index: usize| {
        (0..dimension).map(|d| f64::from(sobol_burley::sample(index as u32, d as u32, seed as u32))).collect()
    };
    (first..first + count).map(point).collect()
}

/// The training runs with distances in the frame of the best runs, for more than two parameters or several records.
pub(super) fn framed(training: TrainingRuns, dimension: usize) -> TrainingRuns {
    if (dimension <= 2 && training.records() == 1) || training.len() <= neighbours(dimension) {
        return training;
    }
    let ranked = ranking(&training);
    let best: Vec<&[f64]> = ranked.iter().take(neighbours(dimension)).map(|(_, run)| training.position(*run)).collect();
    match Frame::of(&best) {
        Some(frame) => training.framed(frame),
        None => training,
    }
}

/// `count` points around the `size` best training runs, if there are any.
pub(super) fn around_elite(
    training: &TrainingRuns,
    size: usize,
    count: usize,
    random: &mut ChaCha8Rng,
) -> Vec<Vec<f64>> {
    let elite: Vec<usize> = ranking(training).into_iter().take(size).map(|(_, run)| run).collect();
    if training.frame.is_some() {
        return along_elite(training, &elite, count, random);
    }
    let spacings: Vec<f64> = elite.iter().map(|&run| training.spacing(run, 5)).collect();
    (0..count)
        .map(|_| {
            let chosen = random.random_range(0..elite.len());
            training
                .position(elite[chosen])
                .iter()
                .map(|u| {
                    let draw: f64 = StandardNormal.sample(random);
                    reflect(u + ELITE_STEP * spacings[chosen] * draw)
                })
                .collect()
        })
        .collect()
}

/// `count` points, each one of the elite plus the difference of two others (Storn & Price, J. Global Optim. 11 (1997)
/// 341): with many parameters the steps follow the shape of the good region.
fn along_elite(training: &TrainingRuns, elite: &[usize], count: usize, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    (0..count)
        .map(|_| {
            let [at, from, to] = [0; 3].map(|_| training.position(elite[random.random_range(0..elite.len())]));
            let differences = from.iter().zip(to).map(|(from, to)| to - from);
            let blur = |random: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(random) };
            at.iter().zip(differences).map(|(u, step)| reflect(u + ELITE_STEP * step + BLUR * blur(random))).collect()
        })
        .collect()
}

/// Training runs by misfit, best first, in units of the local scatter around the best.
pub(crate) fn ranking(training: &TrainingRuns) -> Vec<(f64, usize)> {
    let sorted = |scatter: &[f64]| {
        let mut misfits: Vec<(f64, usize)> =
            training.misfits(scatter).into_iter().enumerate().map(|(run, misfit)| (misfit, run)).collect();
        misfits.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        misfits
    };
    let rough = sorted(&training.spread());
    let Some(&(_, best)) = rough.first() else { return rough };
    match training.regress(training.position(best)) {
        Some(local) => sorted(&local.scatter),
        None => rough,
    }
}

impl Solver<MultiRecord, SearchState> for Search {
    fn name(&self) -> &'static str {
        "regression synthetic likelihood"
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<MultiRecord>,
        state: SearchState,
    ) -> Result<(SearchState, Option<KV>), Error> {
        let first = self.runs.len() as u64;
        let positions = self.propose();
        let runs = problem.bulk_problem("cost_count", positions.len(), |joint| Ok(joint.run(first, &positions)))?;
        let done = first + runs.len() as u64;
        if !problem.problem("report_count", |joint| Ok(joint.first().report(done)))? {
            // What of the batch was not run has no outcome: it is made again.
            return Ok((state.terminate_with(TerminationReason::Interrupt), None));
        }
        self.runs.extend(runs);
        self.batch += 1;
        let training = self.training(self.runs.len());
        let state = match ranking(&training).first() {
            Some(&(misfit, run)) => state.param(training.position(run).to_vec()).cost(misfit),
            None => state,
        };
        Ok((state, None))
    }

    fn terminate(&mut self, _state: &SearchState) -> TerminationStatus {
        if self.batch >= self.batches.len() {
            TerminationStatus::Terminated(TerminationReason::SolverConverged)
        } else {
            TerminationStatus::NotTerminated
        }
    }
}
