//! One candidate on all its rungs: searched on the chain, answered there or, after a correction, on the rung above.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use super::{
    candidate::Candidate,
    checkpoint::{CheckpointError, SearchCheckpoint},
    correction::Correction,
    fingerprints::CandidateRuns,
    fit::{Fit, FitError, answer, corrected, paired, searched},
    forward::{Forward, Run, Watch},
    joint::Joint,
    problem::Problem,
    refusal::Refusal,
    rung::{Bodies, Pair, Rung, chain_below},
    search::Search,
};

/// What an earlier run left of one candidate.
#[derive(Default)]
pub struct SavedFit {
    search: (Option<SearchCheckpoint>, Option<Search>),
    correction: (Option<SearchCheckpoint>, Option<Correction>),
    /// All its runs: nothing is to be run anew.
    ended: Option<CandidateRuns>,
}

impl SavedFit {
    /// A fit that has all its runs.
    #[must_use]
    pub fn ended(runs: CandidateRuns) -> Self {
        Self { ended: Some(runs), ..Self::default() }
    }

    /// What lies where search and correction are kept from batch to batch.
    ///
    /// # Errors
    /// A state that is damaged or belongs to another fit.
    pub fn restore(search: SearchCheckpoint, correction: SearchCheckpoint) -> Result<Self, CheckpointError> {
        let (found, paired) = (search.restore()?, correction.restore()?);
        Ok(Self { search: (Some(search), found), correction: (Some(correction), paired), ended: None })
    }
}

/// The runs of one candidate, and what can make them again.
pub struct Made {
    /// The runs.
    pub runs: CandidateRuns,
    /// What makes those of the search.
    pub joint: Joint,
    /// What makes the pairs of the correction, where there is one.
    pub upper: Option<Rung>,
}

impl Made {
    /// A run of the search made again, its number counted from 0, at a point that is `aside` widths of the box from the stored one.
    #[must_use]
    pub fn searched_again(&self, number: usize, aside: f64) -> Option<(&Run, Run)> {
        let stored = self.runs.search.iter().flatten().nth(number)?;
        let again = self.joint.run(number as u64, &[beside(&stored.position, aside)]).pop()?;
        Some((stored, again))
    }

    /// A pair of the correction made again, by its number from 0, `aside` as of [`searched_again`](Self::searched_again).
    #[must_use]
    pub fn paired_again(&self, number: usize, aside: f64) -> Option<(&Pair, Pair)> {
        let stored = self.runs.correction.iter().flatten().nth(number)?;
        let first = self.runs.search.iter().map(Vec::len).sum::<usize>() + number;
        let again = self.upper.as_ref()?.pairs(first as u64, &[beside(&stored.upper.position, aside)]).ok()?.pop()?;
        Some((stored, again))
    }
}

/// A point of the box `aside` widths of it along its first parameter, towards the middle.
fn beside(position: &[f64], aside: f64) -> Vec<f64> {
    let mut point = position.to_vec();
    if let Some(first) = point.first_mut() {
        *first += if *first > 0.5 { -aside } else { aside };
    }
    point
}

/// Times that a box is widened at most.
const WIDEST: usize = 3;

/// What came of one candidate.
pub(super) struct Climbed {
    pub(super) made: Made,
    /// The answer of its top rung, or why the search has none.
    pub(super) fit: Result<Fit, FitError>,
    pub(super) searching: Duration,
    pub(super) correcting: Duration,
}

/// Search a candidate on the chain and correct it on the rung above, with its `bodies`; `watch` is told the number of its runs.
///
/// # Errors
/// When it is stopped, cannot be run, or its correction has no answer.
pub(super) fn climb(
    problem: &Problem,
    candidate: &Candidate,
    bodies: Option<&Bodies>,
    saved: SavedFit,
    watch: &Arc<Watch>,
) -> Result<Climbed, Refusal> {
    let failed = |source| match source {
        FitError::Stopped { .. } => Refusal::Stopped,
        source => {
            let (path, candidate) = (problem.lead().measured.path().into(), candidate.name());
            Refusal::Fit { path, candidate, source }
        }
    };
    let other_runs = |found| Refusal::OtherRuns { candidate: candidate.name(), found };
    let (seed, budget) = (problem.seed, problem.evaluations);
    let started = Instant::now();
    let (checkpoint, mut search) = saved.search;
    let mut candidate = candidate.clone();
    let mut runs = CandidateRuns { candidate: candidate.key(), ..CandidateRuns::default() };
    // The box is widened while the best runs press on a bound that nobody chose, each time with a search of its own.
    let (joint, fit) = loop {
        let joint = joint(problem, &candidate, bodies, watch)?;
        let fresh = || Search::new(&joint, budget, seed, problem.strategy);
        let wider = runs.narrow.len();
        let stored = saved.ended.as_ref().map(|stored| stored.narrow.get(wider).unwrap_or(&stored.search));
        let made = match stored {
            Some(stored) => {
                let runs = stored.concat();
                let found = runs.len();
                fresh().ended_with(runs).ok_or_else(|| other_runs(found))?
            }
            None => {
                let checkpoint = checkpoint.as_ref().map(|checkpoint| checkpoint.numbered(wider));
                let found = match (&checkpoint, wider) {
                    (_, 0) => search.take(),
                    (Some(checkpoint), _) => checkpoint.restore().map_err(Refusal::Checkpoint)?,
                    (None, _) => None,
                };
                searched(joint.clone(), found.unwrap_or_else(fresh), checkpoint).map_err(failed)?
            }
        };
        let batches = parted(&made.runs, &made.batches);
        let fit = answer(&joint, made);
        match fit.as_ref().ok().and_then(Fit::widened).filter(|_| wider < WIDEST) {
            Some(widened) => {
                candidate.parameters = widened;
                runs.narrow.push(batches);
            }
            None => {
                runs.search = batches;
                break (joint, fit);
            }
        }
        if !watch(0) {
            return Err(Refusal::Stopped);
        }
    };
    let upper = bodies.map(|bodies| {
        Rung::new(joint.first(), bodies.prepared.clone(), candidate.scene()).with_finer(bodies.finer.clone())
    });
    let mut made = Made { runs, joint, upper };
    let searching = started.elapsed();
    let (chain, rung) = match (fit, &made.upper) {
        (Ok(chain), Some(rung)) => (chain, rung),
        (fit, _) => return Ok(Climbed { made, fit, searching, correcting: Duration::ZERO }),
    };
    if !watch(budget as u64) {
        return Err(Refusal::Stopped);
    }
    let started = Instant::now();
    let (checkpoint, correction) = saved.correction;
    let fresh = || Correction::new(rung, &chain.runs, seed);
    let correction = match saved.ended {
        Some(stored) => {
            let found = stored.len();
            fresh().ended_with(stored.correction).ok_or_else(|| other_runs(found))?
        }
        None => paired(rung, correction.unwrap_or_else(fresh), checkpoint).map_err(failed)?,
    };
    let fit = corrected(rung, chain, &correction).map_err(failed)?;
    made.runs.correction = parted(&correction.pairs, &correction.rounds);
    Ok(Climbed { made, fit: Ok(fit), searching, correcting: started.elapsed() })
}

/// The runs of a candidate on the chain, every record under its own drive.
fn joint(
    problem: &Problem,
    candidate: &Candidate,
    bodies: Option<&Bodies>,
    watch: &Arc<Watch>,
) -> Result<Joint, Refusal> {
    let laws = bodies.and_then(|bodies| bodies.laws.as_ref());
    let mut joint: Option<Joint> = None;
    for (shot, scene) in problem.shots.iter().zip(&candidate.scenes) {
        let (parameters, comparison) = (candidate.parameters.clone(), shot.comparison.clone());
        // The first record tells of the runs of all.
        let watch = if joint.is_none() { Arc::clone(watch) } else { Arc::new(|_| true) };
        let scene = chain_below(scene);
        let forward = Forward::with_laws(&scene, laws, parameters, comparison, shot.uncertainty, problem.seed, watch)?;
        joint = Some(match joint {
            None => forward.into(),
            Some(joint) => joint.and(forward),
        });
    }
    joint.ok_or_else(|| super::refusal::Contradiction::NoRecord.into())
}

/// Runs batch by batch.
fn parted<T: Clone>(runs: &[T], sizes: &[usize]) -> Vec<Vec<T>> {
    let mut rest = runs.iter().cloned();
    sizes.iter().map(|size| rest.by_ref().take(*size).collect()).collect()
}
