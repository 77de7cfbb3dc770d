//! Rounds of runs that converge to the answer, as an argmin solver.

use argmin::core::{Error, KV, Problem, Solver, TerminationReason, TerminationStatus};
use faer::Mat;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, Normal};

use super::{
    ensemble::{Ensemble, Known, Placed, Solution, add, as_columns, solved},
    origin::Origin,
    residual::Residual,
    source::{LEFT_STEADY, Sources},
    start::Start,
};
use crate::search::SearchState;
use granchain_signal::feature::fingerprint::SAMPLES_PER_CYCLE;

/// Runs of the first round, and of every further one.
const FIRST: usize = 256;
const FURTHER: usize = 200;

/// Spread of a round's runs in posterior standard deviations: of the second, and of all others.
const EARLY_SPREAD: f64 = 4.0;
const SPREAD: f64 = 2.0;

/// Least spread of a parameter, ln.
const NARROWEST: f64 = 2e-4;

/// Fewest and most rounds; two final ones, with the whole window and nothing widened, give the answer.
const FEWEST: usize = 3;
const MOST: usize = 8;
const CLOSING: usize = 2;

/// Most rounds, and hopeless ones, of a cause among several.
const HURRIED: (usize, usize) = (5, 2);
pub(super) const HURRIED_RUNS: usize = FIRST + (HURRIED.0 + CLOSING - 1) * FURTHER;

/// T/N above which a round is widened, and the largest factor.
const MISFIT: f64 = 1.0;
const WIDEST: f64 = 30.0;

/// Most searches for undetected drop-outs in a round.
const SEARCHED: usize = 4;

/// T/N above which a round's mean trace is not usable, the number of such rounds after which the search gives up, and
/// the runs whose spread the next round takes.
pub(super) const LOST: f64 = 4.0;
const HOPELESS: usize = 4;
const BEST: usize = 12;

/// Criteria that end the rounds: T/N, the change of the answer in standard deviations, and the spread over its target.
const FITTING: f64 = 2.0;
const STILL: f64 = 0.7;
const WIDE: f64 = 1.3;

/// Length of a round's runs: factor on the predictable cycles, plus cycles.
const LENGTH: (f64, f64) = (1.4, 3.0);

/// Standard deviations within which runs of several rounds are pooled; doubled while fewer than so many lie within, as about a model that does not fit.
const TOGETHER: f64 = 6.0;
const FEWEST_TOGETHER: usize = 40;

const MOST_TOGETHER: usize = 500;

/// Most runs pooled for a solution.
const MOST_POOLED: usize = 320;

const SEED: u64 = 0x0AEF_0123;

pub(super) struct Round {
    points: Vec<Vec<f64>>,
    traces: Vec<Mat<f64>>,
}

pub(super) struct Rounds {
    pub sources: Sources,
    seed: u64,
    /// Whether they only say where the answer lies: without the final rounds.
    scouting: bool,
    /// Most rounds, and those of a mean trace that is not usable after which it gives up.
    patience: (usize, usize),
    /// Centre and spread of the next round, ln, and the largest allowed spread.
    centre: Vec<f64>,
    lower: Vec<Vec<f64>>,
    widest: Vec<f64>,
    /// Length of the next round's runs, cycles; `None`: full length.
    cycles: Option<f64>,
    shifts: Vec<f64>,
    made: Vec<Round>,
    pub runs: u64,
    pub rounds: usize,
    closing: usize,
    lost: usize,
    pub settled: bool,
    latest: Option<Solution>,
    failed: bool,
}

/// Joint result of the last rounds.
pub(super) struct Answer {
    pub solution: Solution,
    pub p: f64,
    pub residuals: Vec<Residual>,
    /// Variance of ln of every parameter by its origin.
    pub origins: Vec<(Origin, Vec<f64>)>,
}

impl Rounds {
    /// Starts at a point with a box around it.
    pub(crate) fn about(sources: Sources, Start { centre, half, shifts }: Start, seed: u64) -> Self {
        let widest: Vec<f64> = half.iter().map(|half| 0.5 * half).collect();
        let lower = diagonal(&widest);
        Self {
            sources,
            seed: seed ^ SEED,
            scouting: false,
            patience: (MOST, HOPELESS),
            centre,
            lower,
            widest,
            cycles: None,
            shifts,
            made: Vec::new(),
            runs: 0,
            rounds: 0,
            closing: 0,
            lost: 0,
            settled: false,
            latest: None,
            failed: false,
        }
    }

    pub(crate) fn scouting(self) -> Self {
        Self { scouting: true, ..self }
    }

    pub(crate) fn hurried(self) -> Self {
        Self { patience: HURRIED, ..self }
    }

    /// Goes on about the same answer with sources whose difference from the chain is another; its runs are kept.
    pub(crate) fn on(mut self, sources: Sources) -> Self {
        for round in &mut self.made {
            for ((traces, before), after) in round.traces.iter_mut().zip(&self.sources.records).zip(&sources.records) {
                let each = traces.col_iter().zip(&round.points).map(|(column, at)| {
                    let mut run = column.iter().copied().collect();
                    after.raise_anew(before, &mut run, at);
                    run
                });
                *traces = as_columns(&each.collect::<Vec<Vec<f64>>>());
            }
        }
        let rounds = self.rounds.min(FEWEST - 1);
        Self { sources, scouting: false, settled: false, rounds, closing: 0, lost: 0, ..self }
    }

    /// Make a round; the runs that finished.
    fn make(&mut self) -> Option<Ensemble> {
        let count = if self.rounds == 0 { FIRST } else { FURTHER };
        let mut ensemble = Ensemble {
            centre: self.centre.clone(),
            lower: self.lower.clone(),
            points: drawn(count, self.centre.len(), (self.seed as u32).wrapping_add(self.rounds as u32 * 7919)),
            traces: Vec::new(),
        };
        let at: Vec<Vec<f64>> = ensemble.points.iter().map(|z| self.sources.inside(ensemble.at(z))).collect();
        // What lay outside the box has been turned about its bounds.
        for (z, at) in ensemble.points.iter_mut().zip(&at) {
            *z = solved(&self.lower, &apart(at, &self.centre))?;
        }
        let made = self.sources.traces(self.runs, &at, self.cycles)?;
        self.runs += count as u64;
        let finished: Vec<usize> = (0..count).filter(|run| made.iter().all(|of| of[*run].is_some())).collect();
        ensemble.points = finished.iter().map(|run| ensemble.points[*run].clone()).collect();
        let matrix = |of: &Vec<Option<Vec<f64>>>| {
            let traces: Vec<&Vec<f64>> = finished.iter().filter_map(|run| of[*run].as_ref()).collect();
            as_columns(&traces)
        };
        ensemble.traces = made.iter().map(matrix).collect();
        let absolute = finished.iter().map(|run| at[*run].clone()).collect();
        self.made.push(Round { points: absolute, traces: ensemble.traces.clone() });
        Some(ensemble)
    }

    /// Chooses the next round from this solution.
    fn aim(&mut self, solution: &Solution, closing: bool) {
        let spread = if self.rounds < 2 { EARLY_SPREAD } else { SPREAD };
        let widened = if closing { 1.0 } else { (solution.reduced() / MISFIT).clamp(1.0, WIDEST) };
        let dimension = self.centre.len();
        let factor = spread * widened.sqrt();
        let mut wanted =
            nalgebra::DMatrix::from_fn(dimension, dimension, |a, b| factor * factor * solution.covariance[a][b]);
        let scale: Vec<f64> =
            (0..dimension).map(|d| (self.widest[d] / wanted[(d, d)].sqrt().max(1e-12)).min(1.0)).collect();
        for a in 0..dimension {
            for b in 0..dimension {
                wanted[(a, b)] *= scale[a] * scale[b];
            }
            wanted[(a, a)] += NARROWEST * NARROWEST;
        }
        if let Some(factor) = wanted.cholesky() {
            let lower = factor.l();
            self.lower = (0..dimension).map(|a| (0..dimension).map(|b| lower[(a, b)]).collect()).collect();
        }
        self.centre = self.sources.inside(solution.at.clone());
        self.shifts = solution.shifts();
        let predictable = solution
            .placed
            .iter()
            .map(|placed| placed.predictable as f64 / SAMPLES_PER_CYCLE as f64)
            .fold(0.0, f64::max);
        // The answer sees all that is compared.
        self.cycles = (!closing).then_some(LENGTH.0 * predictable + LENGTH.1);
    }

    /// Chooses the next round around the runs most similar to the records, since no mean trace describes this round.
    fn search_on(&mut self, ensemble: &Ensemble, solution: &Solution) {
        let best: Vec<Vec<f64>> =
            ensemble.ranked(&self.known(), &solution.placed).into_iter().take(BEST).map(|z| ensemble.at(z)).collect();
        let Some(first) = best.first() else { return };
        let count = best.len() as f64;
        let deviation = |d: usize| {
            let mean = best.iter().map(|at| at[d]).sum::<f64>() / count;
            (best.iter().map(|at| (at[d] - mean).powi(2)).sum::<f64>() / count).sqrt()
        };
        self.centre.clone_from(first);
        self.lower = (0..first.len())
            .map(|a| {
                (0..first.len())
                    .map(|b| if a == b { deviation(a).max(1e-3).min(self.widest[a]) } else { 0.0 })
                    .collect()
            })
            .collect();
        self.shifts = solution.shifts();
        self.cycles = None;
    }

    fn known(&self) -> Known<'_> {
        self.sources.known()
    }

    /// Whether only final rounds follow.
    fn closes(&self) -> bool {
        self.settled || self.rounds >= self.patience.0 || self.lost >= self.patience.1
    }

    /// Makes and solves one round, and chooses the next. `None` if it has no solution.
    fn advance(&mut self) -> Option<()> {
        let ensemble = self.make()?;
        let closing = self.closes();
        let mut solution = ensemble.solve(&self.known(), &self.shifts, !closing)?;
        if self.rounds >= 1 && solution.reduced() < FITTING {
            // With the runs of the rounds before that lie near.
            let pooled = self.near(&solution, MOST_POOLED, &|_| usize::MAX)?;
            if pooled.points.len() > ensemble.points.len() {
                solution = pooled.solve(&self.known(), &solution.shifts(), !closing)?;
            }
        }
        if !closing {
            solution = self.clean(&ensemble, solution, true)?;
        }
        let moved = self.latest.as_ref().map_or(f64::INFINITY, |before| solution.distance(&before.at));
        let steady = self.latest.as_ref().is_some_and(|before| {
            let apart = |(a, b): (&Placed, &Placed)| a.predictable.abs_diff(b.predictable) <= SAMPLES_PER_CYCLE;
            solution.placed.iter().zip(&before.placed).all(apart)
        });
        let narrow = (0..solution.at.len()).all(|d| {
            let own: f64 = self.lower[d].iter().map(|l| l * l).sum::<f64>().sqrt();
            own <= WIDE * f64::max(SPREAD * solution.covariance[d][d].sqrt(), NARROWEST)
        });
        self.rounds += 1;
        if closing {
            self.closing += 1;
        } else if self.rounds >= FEWEST && solution.reduced() < FITTING && moved < STILL && narrow && steady {
            self.settled = true;
            // One of the whole length gives the answer too.
            self.closing = usize::from(self.cycles.is_none());
            if self.sources.may_leave_out() {
                // Drop-outs in a part that was not compared yet.
                let whole = ensemble.solve(&self.known(), &solution.shifts(), false)?;
                self.clean(&ensemble, whole, false)?;
            }
        }
        if solution.reduced() > LOST {
            self.lost += 1;
        } else if self.lost < self.patience.1 {
            self.lost = 0;
        }
        let closing = self.closes();
        if solution.reduced() > LOST && !closing {
            self.search_on(&ensemble, &solution);
        } else {
            self.aim(&solution, closing);
        }
        self.latest = Some(solution);
        Some(())
    }

    /// The bound of [`Ensemble::bound`] about the point where the rounds begin, with its factor: the spread of the runs follows it.
    pub(crate) fn bound(mut self) -> Option<(Self, Solution, f64)> {
        let (mut bound, _) = self.make()?.bound(&self.known(), &self.shifts)?;
        while self.rounds < FEWEST {
            self.rounds += 1;
            self.aim(&bound, false);
            (bound, _) = self.make()?.bound(&self.known(), &self.shifts)?;
        }
        let (pooled, known) = self.corrected(&bound)?;
        let (bound, factor) = pooled.bound(&known, &self.shifts)?;
        Some((self, bound, factor))
    }

    /// Leaves out undetected drop-outs of records that have drop-outs, and what an overload leaves, as long as this helps; returns the solution
    /// without them.
    fn clean(&mut self, ensemble: &Ensemble, mut solution: Solution, shorten: bool) -> Option<Solution> {
        for _ in 0..SEARCHED {
            if !self.sources.may_leave_out() || solution.reduced() <= self.sources.clean() {
                break;
            }
            let outliers = ensemble.outliers(&self.known(), &solution)?;
            if !self.sources.leave_out(&outliers) {
                break;
            }
            solution = ensemble.solve(&self.known(), &solution.shifts(), shorten)?;
        }
        Some(solution)
    }

    /// Runs of all rounds near a point, last ones first, relative to it; traces no longer than `longest` allows.
    fn near(&self, about: &Solution, most: usize, longest: &dyn Fn(usize) -> usize) -> Option<Ensemble> {
        let dimension = self.centre.len();
        let deviation: Vec<f64> = (0..dimension).map(|d| about.covariance[d][d].sqrt().max(0.5 * NARROWEST)).collect();
        let (mut points, mut used) = (Vec::new(), Vec::new());
        // Shorter ones would shorten what is compared.
        let long = |round: &Round| {
            let last = self.made.last().map_or(&[][..], |last| &last.traces[..]);
            round.traces.iter().zip(last).all(|(own, last)| own.nrows() >= last.nrows())
        };
        let all = || {
            let rounds = self.made.iter().enumerate().rev().filter(|(_, round)| long(round));
            rounds.flat_map(|(number, round)| round.points.iter().enumerate().map(move |(run, at)| ((number, run), at)))
        };
        let near =
            |at: &[f64], within: f64| (0..dimension).all(|d| (at[d] - about.at[d]).abs() < within * deviation[d]);
        let lie = |within: f64| all().filter(|(_, at)| near(at, within)).count();
        let enough = FEWEST_TOGETHER.min(all().count());
        let mut within = TOGETHER;
        while within.is_finite() && lie(within) < enough {
            within *= 2.0;
        }
        for (run, at) in all().filter(|(_, at)| near(at, within)).take(most) {
            points.push(solved(&self.lower, &apart(at, &about.at))?);
            used.push(run);
        }
        let of_record = |record: usize| {
            let made = used.iter().map(|(round, _)| self.made[*round].traces[record].nrows());
            let len = made.min().unwrap_or(0).min(longest(record));
            Mat::from_fn(len, used.len(), |t, i| {
                let (round, run) = used[i];
                self.made[round].traces[record][(t, run)]
            })
        };
        let traces = (0..self.sources.records()).map(of_record).collect();
        Some(Ensemble { centre: about.at.clone(), lower: self.lower.clone(), points, traces })
    }

    /// What the last round found; `None` where one failed.
    pub(crate) fn latest(&self) -> Option<&Solution> {
        self.latest.as_ref().filter(|_| !self.failed)
    }

    /// Runs of all rounds near a point, and what is known with their correction for a finer step.
    fn corrected(&self, about: &Solution) -> Option<(Ensemble, Known<'_>)> {
        let mut known = self.known();
        if !self.scouting {
            known.correction = self.sources.finer(self.runs, &about.at);
        }
        let longest = |record: usize| known.correction.get(record).map_or(usize::MAX, |(mean, _)| mean.len());
        let ensemble = self.near(about, MOST_TOGETHER, &longest)?;
        Some((ensemble, known))
    }

    /// What the last rounds say together, by runs corrected for their step.
    pub(crate) fn answer(&self) -> Option<Answer> {
        let latest = self.latest()?;
        let (ensemble, known) = self.corrected(latest)?;
        let mut solution = ensemble.solve(&known, &self.shifts, false)?;
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(1);
        let p = ensemble.share_beyond(&known, &solution, &mut random)?;
        let shots = self.sources.alpha().filter(|_| self.sources.records() > 1 && self.sources.shares_level());
        let residuals = ensemble.residuals(&known, &solution, shots)?;
        let mut origins = ensemble.origins(&known, &solution)?;
        // An error of the mesh that looks like a change of the parameters is seen by no residual.
        if let Some(by) = ensemble.by_mesh(&self.sources.without_mesh(), &solution) {
            add(&mut solution.covariance, |a, b| LEFT_STEADY * LEFT_STEADY * by[a] * by[b]);
            let of_model = origins.iter_mut().filter(|(origin, _)| *origin == Origin::Model);
            of_model.flat_map(|(_, of)| of.iter_mut().zip(&by)).for_each(|(of, by)| *of += (LEFT_STEADY * by).powi(2));
        }
        Some(Answer { solution, p, residuals, origins })
    }
}

pub(super) fn diagonal(values: &[f64]) -> Vec<Vec<f64>> {
    (0..values.len()).map(|a| (0..values.len()).map(|b| if a == b { values[a] } else { 0.0 }).collect()).collect()
}

/// z of `count` runs: a normal distribution by a low-discrepancy sequence.
pub(super) fn drawn(count: usize, dimension: usize, seed: u32) -> Vec<Vec<f64>> {
    let normal = Normal::standard();
    let coordinate = |run: usize, d: usize| {
        let uniform = f64::from(sobol_burley::sample(run as u32, d as u32, seed));
        normal.inverse_cdf(uniform.clamp(1e-4, 1.0 - 1e-4))
    };
    (0..count).map(|run| (0..dimension).map(|d| coordinate(run, d)).collect()).collect()
}

/// a − b.
fn apart(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

impl Solver<(), SearchState> for Rounds {
    fn name(&self) -> &'static str {
        "waveform likelihood"
    }

    fn next_iter(
        &mut self,
        _problem: &mut Problem<()>,
        state: SearchState,
    ) -> Result<(SearchState, Option<KV>), Error> {
        if !self.sources.goes_on() || self.advance().is_none() {
            self.failed = true;
        }
        let state = match &self.latest {
            Some(latest) => state.param(latest.at.clone()).cost(latest.reduced()),
            None => state,
        };
        Ok((state, None))
    }

    fn terminate(&mut self, _state: &SearchState) -> TerminationStatus {
        if self.failed || self.closing >= CLOSING || self.scouting && self.closes() {
            TerminationStatus::Terminated(TerminationReason::SolverConverged)
        } else {
            TerminationStatus::NotTerminated
        }
    }
}
