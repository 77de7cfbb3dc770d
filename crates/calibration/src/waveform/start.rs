//! Start of the rounds: a search with short runs, by the misfit to the record's first cycles.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    ensemble::Solution,
    rounds::drawn,
    source::{Sources, misfit},
};
use crate::{parameter::reflect, search::scattered};

/// How much a search looks at.
pub(super) struct Effort {
    /// Most points taken from the amplitudes' search whose runs say how late the record's motion comes, and in all.
    given: usize,
    taken: usize,
    /// Points over the whole box.
    scattered: usize,
    /// In each round, the size of the elite and the number of points around it.
    around: &'static [(usize, usize)],
    /// Further ones, and how many times at most.
    further: (usize, usize, usize),
}

/// Of an answer.
pub(super) const WHOLE: Effort =
    Effort { given: GIVEN, taken: GIVEN, scattered: SCATTERED, around: &AROUND, further: FURTHER };

/// Of a cause among many: its best run says whether it may be one.
pub(super) const QUICK: Effort =
    Effort { given: 8, taken: 40, scattered: 24, around: &[(16, 32), (12, 32), (8, 24)], further: (0, 0, 0) };

impl Effort {
    /// Runs that it makes at most.
    pub(super) const fn runs(&self) -> usize {
        let (mut around, mut round) = (0, 0);
        while round < self.around.len() {
            (around, round) = (around + self.around[round].1, round + 1);
        }
        self.given + self.taken + self.scattered + around + self.further.1 * self.further.2
    }
}

/// Points over the whole box; then, in each round, the size of the elite and the number of points around it.
const SCATTERED: usize = 256;
const AROUND: [(usize, usize); 4] = [(40, 96), (24, 96), (16, 96), (12, 56)];

/// Further ones, and how many times at most.
const FURTHER: (usize, usize, usize) = (12, 64, 6);

/// Misfit that needs no further search, and the ratio of misfits that counts as no progress.
const REACHED: f64 = 5e-4;
const STALLED: f64 = 0.97;

/// Most points taken from the amplitudes' search.
const GIVEN: usize = 40;

/// Runs whose spread sets the width of the first round.
const BEST: usize = 12;

/// Least and most half-width of the first round, ln.
const HALF: (f64, f64) = (0.02, 0.3);

/// Half-width of a first round around the amplitudes' answer, ln.
const AMPLITUDES: f64 = 0.1;

/// Step around the elite, over the distance to its fifth neighbour.
const STEP: f64 = 0.7;
const NEIGHBOUR: usize = 5;

/// Cycles of a run after its onset that the search needs.
const CYCLES: f64 = 10.0;

const SEED: u64 = 0x57A2_7000;

/// Runs among which the one is sought that a record is placed on.
pub(super) const PLACED: usize = 64;

/// Standard deviations of an answer that a start behind it is wide, and what is added, ln.
const BEHIND: (f64, f64) = (6.0, 4e-3);

/// Where the rounds begin, ln.
#[derive(Clone)]
pub(crate) struct Start {
    pub centre: Vec<f64>,
    pub half: Vec<f64>,
    pub shifts: Vec<f64>,
}

impl Start {
    pub(super) fn behind(answer: &Solution) -> Self {
        let half = (0..answer.at.len()).map(|d| BEHIND.0 * answer.covariance[d][d].sqrt() + BEHIND.1);
        Self { centre: answer.at.clone(), half: half.collect(), shifts: answer.shifts() }
    }

    /// Points about its centre, half its half-width a standard deviation.
    pub(super) fn drawn(&self, sources: &Sources, count: usize, seed: u32) -> Vec<Vec<f64>> {
        let moved = |z: Vec<f64>| {
            let each = z.iter().zip(&self.half).zip(&self.centre);
            sources.inside(each.map(|((z, half), x)| x + 0.5 * half * z).collect())
        };
        drawn(count, self.centre.len(), seed).into_iter().map(moved).collect()
    }

    /// The same with the records placed on the run that resembles them most, of several about its centre; `None` where none can be made.
    pub(super) fn placed(self, sources: &Sources, seed: u64) -> Option<Self> {
        let at = self.drawn(sources, PLACED, (seed ^ SEED) as u32);
        let runs = sources.traces(0, &at, None)?;
        let of = |number: usize| {
            let both = sources.records.iter().zip(&runs);
            let each = both.map(|(source, of)| Some(misfit(&source.trace, of[number].as_ref()?)));
            each.collect::<Option<Vec<(f64, f64)>>>()
        };
        let sum = |found: &[(f64, f64)]| found.iter().map(|(misfit, _)| misfit).sum::<f64>();
        let best = (0..at.len()).filter_map(of).min_by(|a, b| sum(a).total_cmp(&sum(b)))?;
        Some(Self { shifts: best.into_iter().map(|(_, shift)| shift).collect(), ..self })
    }
}

/// A start about a point (unit coordinates) that is known to so many standard deviations (ln); where the records lie is not known.
pub(super) fn about(sources: &Sources, at: &[f64], deviations: &[f64]) -> Start {
    let half = deviations.iter().map(|deviation| (2.0 * deviation).clamp(HALF.0, HALF.1));
    let half = half.chain(sources.modulus.map(|modulus| 2.0 * modulus)).collect();
    Start { centre: sources.of_unit(at), half, shifts: Vec::new() }
}

/// A run of the search: unit coordinates, misfit, shifts.
type Tried = (Vec<f64>, f64, Vec<f64>);

/// Starts from the search and from the amplitudes, and the misfit of the best run.
pub(super) fn search(sources: &Sources, known: &[Vec<f64>], seed: u64, effort: &Effort) -> Option<([Start; 2], f64)> {
    let dimension = sources.spans().len();
    let best = known.first()?;
    // How late the answer comes: no run that the amplitudes lead to may end before it, be they misled or not.
    let given: Vec<Vec<f64>> = known.iter().take(effort.given).map(|u| sources.of_unit(u)).collect();
    let whole = sources.traces(0, &given, None)?;
    let (mut cycles, mut shifts_given) = (0.0f64, Vec::new());
    for (source, of) in sources.records.iter().zip(&whole) {
        let trace = &source.trace;
        let shifts: Vec<Option<f64>> = of.iter().map(|run| Some(misfit(trace, run.as_ref()?).1)).collect();
        let earliest = shifts.iter().copied().flatten().fold(f64::INFINITY, f64::min);
        let onset = (trace.onset as f64 - earliest) * trace.step * source.forward.scene().drive.frequency;
        cycles = cycles.max(onset + CYCLES);
        shifts_given.push(shifts[0]?);
    }
    let records = sources.records() as f64;
    let mut random = ChaCha8Rng::seed_from_u64(seed ^ SEED);
    let mut made: Vec<Tried> = Vec::new();
    let mut first = given.len() as u64;
    let mut batch: Vec<Vec<f64>> = scattered(0, effort.scattered, dimension, seed ^ SEED);
    batch.extend(known.iter().take(effort.taken).cloned());
    let mut before = f64::INFINITY;
    for round in 0..=effort.around.len() + effort.further.2 {
        let at: Vec<Vec<f64>> = batch.iter().map(|u| sources.of_unit(u)).collect();
        let traces = sources.traces(first, &at, Some(cycles))?;
        first += batch.len() as u64;
        for (number, u) in batch.iter().enumerate() {
            let of = sources
                .records
                .iter()
                .zip(&traces)
                .map(|(source, of)| of[number].as_ref().map(|run| misfit(&source.trace, run)));
            let Some(found) = of.collect::<Option<Vec<(f64, f64)>>>() else { continue };
            let sum = found.iter().map(|(misfit, _)| misfit).sum();
            made.push((u.clone(), sum, found.into_iter().map(|(_, shift)| shift).collect()));
        }
        made.sort_by(|a, b| a.1.total_cmp(&b.1));
        let least = made.first()?.1;
        let (elite, count) = match effort.around.get(round) {
            Some(next) => *next,
            // Further ones while they help and the record is not reached.
            None if round >= effort.around.len() + effort.further.2 => break,
            None if least < REACHED * records || least > STALLED * before => break,
            None => (effort.further.0, effort.further.1),
        };
        if round + 1 >= effort.around.len() {
            before = least;
        }
        batch = around(&made[..elite.min(made.len())], count, &mut random);
    }
    let (at, least, shifts) = made.first()?;
    let spans = sources.spans();
    let elite = &made[..BEST.min(made.len())];
    let half = (0..dimension).map(|d| {
        let mean = elite.iter().map(|run| run.0[d]).sum::<f64>() / elite.len() as f64;
        let square = elite.iter().map(|run| (run.0[d] - mean).powi(2)).sum::<f64>() / elite.len() as f64;
        (2.0 * square.sqrt() * spans[d]).clamp(HALF.0, HALF.1)
    });
    // The stiffness begins at its prior.
    let of_modulus = sources.modulus.map(|modulus| 2.0 * modulus);
    let found = Start { centre: sources.of_unit(at), half: half.chain(of_modulus).collect(), shifts: shifts.clone() };
    let half = spans.iter().map(|_| AMPLITUDES).chain(of_modulus).collect();
    Some(([found, Start { centre: sources.of_unit(best), half, shifts: shifts_given }], *least))
}

fn around(elite: &[Tried], count: usize, random: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let spacing = |of: &Tried| {
        let mut all: Vec<f64> = elite.iter().map(|other| apart(&of.0, &other.0)).collect();
        all.sort_by(f64::total_cmp);
        all.get(NEIGHBOUR).or(all.last()).copied().unwrap_or(0.1)
    };
    let spacings: Vec<f64> = elite.iter().map(spacing).collect();
    (0..count)
        .map(|_| {
            let chosen = random.random_range(0..elite.len());
            let step = |u: &f64| {
                let draw: f64 = StandardNormal.sample(&mut *random);
                reflect(u + STEP * spacings[chosen] * draw)
            };
            elite[chosen].0.iter().map(step).collect()
        })
        .collect()
}
