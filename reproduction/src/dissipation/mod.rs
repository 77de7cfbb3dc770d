//! Which law or mixture of effects brings the two printed peaks of the measurement, and what thirds it has there.
//!
//! The paper prints two numbers of its measurement, says of its lines that the thirds stand out more than in its own simulation, and names what it left out.
//! Here each of the paper's dashpots (and none) stands alone, with each effect over a range of its strength, and with each pair of effects, over α. Every point of
//! the grid is a handful of perturbed runs; the candidates are ranked by the [`evidence`] of the two peaks, whose variance at a point is
//!
//! ```text
//! σ² = s² (1 + 1/n) + S² + h² + r²
//! ```
//!
//! s is the scatter of the n runs, S the change for 1 % of drive (from the neighbours along α) and h half the last printed digit: what
//! [`paper`](crate::paper) allows a printed number to be off. r is by how much the mean misses the line between its neighbours along α: the response jumps
//! between regimes, and what lies between two points is not known better than that. Where a candidate is likeliest it is run again.

mod candidate;
mod evidence;
mod outcome;

use std::{ops::Range, sync::OnceLock};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::published::{MEASURED, Peaks};
use crate::{
    decoder::Decoder,
    instrument::{Instrument, spreads},
    portrait::{Portrait, PortraitMoments, Trait},
};
use crate::{
    divided::Divided,
    failure::{StudyError, enough, reasons},
    paper::{
        LAWS,
        statements::{PEAK_HALF_DIGIT, SWEPT_ALPHAS},
    },
};
use granchain_calibration::predict::{
    Bodies,
    ensemble::{EnsemblePlan, Moments, Spread},
    observation,
    replicates::Watch,
};
use granchain_model::scene::Scene;
use granchain_signal::feature::{FeatureSettings, Ratio};

pub use candidate::{BASES, Base, Candidate, EFFECTS, Effect, candidates};
pub use evidence::{Evidence, TwoPeaks, evidence};
pub use outcome::{CandidateOutcome, DissipationOutcome, Found, GridPoint};

/// Differences of ln evidence below this mean nothing.
pub const NOTHING: f64 = 1.0;
/// Differences below this are weak: what `calibrate` asks for before it names a law.
pub const WEAK: f64 = 3.0;
/// α at which the paper finds A(f0/3)/A(f0) largest with linear dampers.
pub const PRINTED_ALPHA: f64 = 0.5;
/// The lines that are more pronounced in the measurement than in the paper's simulation.
pub const THIRDS: [Ratio; 2] = [Ratio::new(1, 3), Ratio::new(2, 3)];
/// The two numbers and the two ratios that are looked at.
pub const WATCHED: [Trait; 4] =
    [Trait::PositivePeak, Trait::NegativePeak, Trait::Level(THIRDS[0]), Trait::Level(THIRDS[1])];

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DissipationPlan {
    /// Amplitude scales, ascending, ≥ 2.
    pub alphas: Vec<f64>,
    /// Strengths of an effect that stands alone, 2, 3 or 5.
    pub alone: usize,
    /// Strengths of each effect of a pair, 2, 3 or 5.
    pub paired: usize,
    /// Perturbed runs at each point, ≥ 3.
    #[serde(rename = "members")]
    pub replicates: usize,
    /// Perturbed runs where a candidate is likeliest, at each of three levels of the drive.
    pub confirming: usize,
    pub seed: u64,
    /// The peaks to be explained.
    pub printed: Peaks,
    pub effects: Vec<Effect>,
}

/// Portraits of every run at each level of the drive; one that failed leaves its reason.
type Levels = Vec<Vec<Result<Portrait, String>>>;

impl DissipationPlan {
    #[must_use]
    pub fn whole(seed: u64) -> Self {
        let effects = EFFECTS.to_vec();
        let alphas = alphas(2);
        Self { alphas, alone: 5, paired: 3, replicates: 3, confirming: 8, seed, printed: MEASURED, effects }
    }

    /// α by 0.2, two strengths of each effect of a pair.
    #[must_use]
    pub fn quick(seed: u64) -> Self {
        Self { alphas: alphas(4), alone: 3, paired: 2, confirming: 4, ..Self::whole(seed) }
    }

    /// Strengths of each effect of a candidate.
    fn axes(&self, candidate: &Candidate) -> Vec<Vec<f64>> {
        let count = if candidate.effects.len() == 1 { self.alone } else { self.paired };
        candidate.effects.iter().map(|effect| effect.spread(count)).collect()
    }

    fn runs(&self, candidate: &Candidate) -> usize {
        let settings: usize = self.axes(candidate).iter().map(Vec::len).product();
        settings * self.alphas.len() * self.replicates + 3 * self.confirming
    }
}

/// Every so many of the paper's steps over its range of α.
fn alphas(every: u32) -> Vec<f64> {
    let (first, last, step) = SWEPT_ALPHAS;
    let count = ((last - first) / step).round() as u32;
    // Of whole hundredths, so that 0.5 is the paper's 0.5 and not the next number to it.
    (0..=count / every).map(|index| ((first + step * f64::from(index * every)) * 100.0).round() / 100.0).collect()
}

/// Scenes and bodies made ready.
#[derive(Debug)]
pub struct Study {
    plan: DissipationPlan,
    overrides: Vec<String>,
    scene: Scene,
    settings: FeatureSettings,
    bodies: Bodies,
    candidates: Vec<Candidate>,
    /// For each of them that has at most one effect, once it was tried: why it cannot be run, if it cannot.
    tried: Vec<OnceLock<Option<String>>>,
}

/// What is kept of a point.
#[derive(Debug, Serialize, Deserialize)]
pub enum DissipationPoint {
    /// Of linear dampers at the paper's α, [`WATCHED`].
    Reference([Option<Spread>; 4]),
    /// Of a candidate, with its grid; why nothing, where it could not be run.
    Candidate(Result<(Box<Found>, Vec<GridPoint>), String>),
}

impl Study {
    /// Check plan and scene; `overrides` apply to all runs, before a candidate's own.
    ///
    /// # Errors
    /// [`StudyError`].
    pub fn new(plan: DissipationPlan, overrides: &[String], bodies: Bodies) -> Result<Self, StudyError> {
        let least = [
            ("members", plan.replicates, 3),
            ("confirming runs", plan.confirming, 2),
            ("alphas", plan.alphas.len(), 2),
            ("strengths", plan.alone.min(plan.paired), 2),
        ];
        if let Some((what, found, least)) = least.into_iter().find(|(_, found, least)| found < least) {
            return Err(StudyError::TooFew { what, least, found });
        }
        let scene = LAWS[0].scene(overrides)?;
        let settings =
            observation::settings(&scene).map_err(|source| StudyError::Feature { what: "the drive".into(), source })?;
        let candidates = candidates(&plan.effects);
        let tried = candidates.iter().map(|_| OnceLock::new()).collect();
        Ok(Self { plan, overrides: overrides.to_vec(), scene, settings, bodies, candidates, tried })
    }

    #[must_use]
    pub fn plan(&self) -> &DissipationPlan {
        &self.plan
    }

    #[must_use]
    pub fn bodies(&self) -> &Bodies {
        &self.bodies
    }

    /// The scene with linear dampers.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Run each candidate of one effect once: what the model refuses is known then, of the pairs too, before anything is run; how many runs were made.
    ///
    /// # Errors
    /// [`StudyError::Stopped`].
    pub fn probe(&self, watch: &dyn Watch) -> Result<usize, StudyError> {
        self.probe_for(&self.candidates, watch)
    }

    /// The same of the effects that some candidates have, but for those that were run before.
    fn probe_for(&self, some: &[Candidate], watch: &dyn Watch) -> Result<usize, StudyError> {
        let plan = EnsemblePlan::new(1, self.plan.seed);
        let probed = |candidate: &Candidate| {
            let middle: Vec<f64> = candidate.effects.iter().map(|effect| effect.strengths[2]).collect();
            let run = |scene: Scene| self.seen().at(&scene, &[1.0], &plan, watch);
            let outcome = candidate.scene(&self.overrides, &middle).map_err(StudyError::from).and_then(run);
            match outcome {
                Ok(runs) => Ok(runs.concat().into_iter().find_map(Result::err)),
                Err(StudyError::Stopped) => Err(StudyError::Stopped),
                Err(StudyError::Run { source, .. }) => Ok(Some(source.to_string())),
                Err(error) => Ok(Some(error.to_string())),
            }
        };
        let few = self.candidates.iter().zip(&self.tried).filter(|(own, tried)| {
            own.effects.len() < 2 && tried.get().is_none() && some.iter().any(|other| own.is_part_of(other))
        });
        let few: Vec<_> = few.collect();
        let reasons = few.par_iter().map(|(own, _)| probed(own)).collect::<Result<Vec<_>, StudyError>>()?;
        for ((_, tried), reason) in few.iter().zip(reasons) {
            tried.get_or_init(|| reason);
        }
        Ok(few.len())
    }

    /// Why a candidate cannot be run, as far as its effects were tried.
    fn refused(&self, candidate: &Candidate) -> Option<&String> {
        let parts = self.candidates.iter().zip(&self.tried).filter(|(part, _)| part.is_part_of(candidate));
        parts.filter_map(|(_, tried)| tried.get()?.as_ref()).next()
    }

    fn tried_out(&self, candidate: &Candidate, watch: &dyn Watch) -> Result<DissipationPoint, StudyError> {
        let found = match self.refused(candidate) {
            Some(reason) => Err(reason.clone()),
            None => match self.candidate(candidate, watch) {
                Ok(mut found) => {
                    let points = std::mem::take(&mut found.points);
                    Ok((Box::new(found), points))
                }
                Err(StudyError::Stopped) => return Err(StudyError::Stopped),
                Err(error) => Err(error.to_string()),
            },
        };
        Ok(DissipationPoint::Candidate(found))
    }

    fn seen(&self) -> Instrument<'_> {
        let decoder = Decoder::of_reconstruction(self.plan.seed);
        Instrument { bodies: &self.bodies, decoder, settings: &self.settings, every: 4 }
    }

    /// Runs of a scene at the drive's three levels, and [`WATCHED`] of them.
    fn closely(
        &self,
        scene: &Scene,
        factor: f64,
        watch: &dyn Watch,
    ) -> Result<([Option<Spread>; 4], Levels), StudyError> {
        let plan = EnsemblePlan::new(self.plan.confirming, self.plan.seed);
        let levels = self.seen().at(scene, &plan.levels().map(|level| level * factor), &plan, watch)?;
        let all = spreads(&levels);
        let of = |what: Trait| Trait::all().iter().position(|other| *other == what).and_then(|index| all[index]);
        Ok((WATCHED.map(of), levels))
    }

    fn candidate(&self, candidate: &Candidate, watch: &dyn Watch) -> Result<Found, StudyError> {
        let DissipationPlan { alphas, replicates, printed, .. } = &self.plan;
        let strengths = self.plan.axes(candidate);
        let settings = product(&strengths);
        let plan = EnsemblePlan::new(*replicates, self.plan.seed);
        let runs = settings
            .par_iter()
            .map(|setting| {
                let scene = candidate.scene(&self.overrides, setting)?;
                let factors: Vec<f64> = alphas.iter().map(|alpha| alpha / scene.amplitude_scale).collect();
                self.seen().at(&scene, &factors, &plan, watch)
            })
            .collect::<Result<Vec<_>, StudyError>>()?;
        let peaks: Vec<Vec<Vec<Option<[f64; 2]>>>> = runs
            .iter()
            .map(|setting| setting.iter().map(|point| point.iter().map(peaks).collect()).collect())
            .collect();
        let weighed = |left_out| weigh(&strengths, alphas, &peaks, left_out, *printed);
        let Some((log_evidence, at)) = weighed(None) else {
            let failures = reasons(&runs.concat().concat());
            let (runs, failed) = (self.plan.runs(candidate) - 3 * self.plan.confirming, failures.len());
            let first = failures.into_iter().next().unwrap_or_default();
            return Err(StudyError::Failed { what: candidate.name(), runs, failed, first });
        };
        let jackknife: Option<Vec<f64>> =
            (0..*replicates).map(|left_out| weighed(Some(left_out)).map(|(log, _)| log)).collect();
        let (chosen, alpha) = at.split_at(strengths.len());
        let distance = |setting: &Vec<f64>| -> f64 {
            setting.iter().zip(chosen).map(|(own, chosen)| (own / chosen).ln().powi(2)).sum()
        };
        let nearest =
            (0..settings.len()).min_by(|a, b| distance(&settings[*a]).total_cmp(&distance(&settings[*b]))).unwrap_or(0);
        let points: Vec<GridPoint> = settings
            .iter()
            .zip(&runs)
            .flat_map(|(setting, runs)| {
                alphas.iter().zip(runs).map(|(alpha, replicates)| {
                    let moments = PortraitMoments::of(replicates);
                    let failed = reasons(replicates).len();
                    let moments = WATCHED.map(|what| moments.get(what));
                    GridPoint { strengths: setting.clone(), alpha: *alpha, moments, failed }
                })
            })
            .collect();
        let along = &points[nearest * alphas.len()..(nearest + 1) * alphas.len()];
        let third_over_alpha: Vec<(f64, Option<Moments>)> =
            along.iter().map(|point| (point.alpha, point.moments[2])).collect();
        let scene = candidate.scene(&self.overrides, chosen)?;
        let (there, confirming) = self.closely(&scene, alpha[0] / scene.amplitude_scale, watch)?;
        let all: Vec<Result<Portrait, String>> = runs.concat().into_iter().chain(confirming).flatten().collect();
        let failures = reasons(&all);
        Ok(Found {
            log_evidence,
            log_evidence_error: jackknife.map(|logs| jackknife_error(&logs)),
            alpha: alpha[0],
            strengths: chosen.to_vec(),
            there,
            largest_third_at: largest(&third_over_alpha),
            third_over_alpha,
            points,
            runs: (all.len(), failures.len()),
            failure: failures.into_iter().next(),
        })
    }
}

/// Linear dampers at the paper's α, then the candidates. What makes the runs with linear dampers impossible is an error; other failed runs are counted, and a
/// candidate none of whose runs can be made says why.
impl Divided for Study {
    type Point = DissipationPoint;
    type Outcome = DissipationOutcome;

    fn points(&self) -> usize {
        1 + self.candidates.len()
    }

    fn runs_of(&self, point: usize) -> usize {
        match point.checked_sub(1).map(|own| &self.candidates[own]) {
            None => 3 * self.plan.confirming,
            Some(candidate) if self.refused(candidate).is_some() => 0,
            Some(candidate) => self.plan.runs(candidate),
        }
    }

    fn part(&self, part: Range<usize>, watch: &dyn Watch) -> Result<Vec<DissipationPoint>, StudyError> {
        let mut reference = Vec::new();
        if part.contains(&0) {
            let what = || format!("linear dampers at α = {}", LAWS[0].alpha);
            let (spreads, levels) = self.closely(&self.scene, 1.0, watch)?;
            enough(PortraitMoments::of(&levels[0]), &levels[0], what)?;
            reference.push(DissipationPoint::Reference(spreads));
        }
        let candidates = &self.candidates[part.start.max(1) - 1..part.end.max(1) - 1];
        self.probe_for(candidates, watch)?;
        let tried = candidates.par_iter().map(|candidate| self.tried_out(candidate, watch));
        Ok(reference.into_iter().chain(tried.collect::<Result<Vec<_>, StudyError>>()?).collect())
    }

    fn outcome(&self, points: Vec<DissipationPoint>) -> Result<DissipationOutcome, StudyError> {
        let (mut reference, mut outcomes) = ([None; 4], Vec::new());
        let mut candidates = self.candidates.iter();
        for point in points {
            match point {
                DissipationPoint::Reference(spreads) => reference = spreads,
                DissipationPoint::Candidate(found) => {
                    let found = found.map(|(found, points)| Found { points, ..*found });
                    let (found, refused) =
                        found.map_or_else(|reason| (None, Some(reason)), |found| (Some(found), None));
                    let candidate = candidates.next().cloned();
                    outcomes.extend(candidate.map(|candidate| CandidateOutcome { candidate, found, refused }));
                }
            }
        }
        rank(&mut outcomes);
        let model = self.scene.model.kind.name();
        Ok(DissipationOutcome { plan: self.plan.clone(), model, reference, candidates: outcomes })
    }
}

/// Both peaks of a run, m/s.
fn peaks(run: &Result<Portrait, String>) -> Option<[f64; 2]> {
    let portrait = run.as_ref().ok()?;
    Some([portrait.get(Trait::PositivePeak)?, portrait.get(Trait::NegativePeak)?])
}

/// ln evidence of a grid of runs, and where on it (each strength, then α) the printed peaks are likeliest.
///
/// - `peaks`: of every run at every α of every setting (last strength fastest), m/s; none where it failed
/// - `left_out`: number of a perturbation that is not counted
fn weigh(
    strengths: &[Vec<f64>],
    alphas: &[f64],
    peaks: &[Vec<Vec<Option<[f64; 2]>>>],
    left_out: Option<usize>,
    printed: Peaks,
) -> Option<(f64, Vec<f64>)> {
    let logarithms = |axis: &[f64]| axis.iter().map(|value| value.ln()).collect::<Vec<f64>>();
    let axes: Vec<Vec<f64>> = strengths.iter().map(Vec::as_slice).chain([alphas]).map(logarithms).collect();
    let points: Vec<Option<TwoPeaks>> =
        peaks.iter().flat_map(|setting| likely(setting, &axes[strengths.len()], left_out)).collect();
    let Evidence { log, at } = evidence(&axes, &points, [printed.positive_m_per_s, printed.negative_m_per_s])?;
    Some((log, at.into_iter().map(f64::exp).collect()))
}

/// What the runs along ln α say of the peaks of a single one.
fn likely(runs: &[Vec<Option<[f64; 2]>>], log_alphas: &[f64], left_out: Option<usize>) -> Vec<Option<TwoPeaks>> {
    let moments: Vec<Option<[Moments; 2]>> = runs
        .iter()
        .map(|replicates| {
            let counted = replicates.iter().enumerate().filter(|(index, _)| Some(*index) != left_out);
            let finished: Vec<[f64; 2]> = counted.filter_map(|(_, peaks)| *peaks).collect();
            let of = |peak: usize| Moments::of(finished.iter().map(|peaks| Some(peaks[peak])));
            Some([of(0)?, of(1)?])
        })
        .collect();
    let neighbours = |index: usize| {
        let below = index.checked_sub(1).and_then(|below| Some((log_alphas[below], moments[below]?)));
        let above = moments.get(index + 1).and_then(|own| Some((log_alphas[index + 1], (*own)?)));
        (below, above)
    };
    // By how much a mean misses the line between its neighbours, m/s; at an end as at the point beside it.
    let misses = |index: usize, peak: usize| {
        let (Some(own), (Some(below), Some(above))) = (moments[index], neighbours(index)) else { return None };
        let share = (log_alphas[index] - below.0) / (above.0 - below.0);
        Some(own[peak].mean - below.1[peak].mean - share * (above.1[peak].mean - below.1[peak].mean))
    };
    let roughness = |index: usize, peak: usize| {
        let beside = || [index.checked_sub(1), Some(index + 1).filter(|next| *next < moments.len())];
        let found = misses(index, peak).or_else(|| beside().into_iter().flatten().find_map(|next| misses(next, peak)));
        found.unwrap_or(0.0)
    };
    let at = |index: usize| -> Option<TwoPeaks> {
        let own = moments[index]?;
        let (below, above) = neighbours(index);
        let (below, above) = (below.unwrap_or((log_alphas[index], own)), above.unwrap_or((log_alphas[index], own)));
        let variance = |peak: usize| {
            let span = above.0 - below.0;
            let slope = if span > 0.0 { (above.1[peak].mean - below.1[peak].mean) / span } else { 0.0 };
            let scatter = own[peak].deviation.powi(2) + own[peak].error().powi(2);
            scatter + (DRIVE_CHANGE * slope).powi(2) + roughness(index, peak).powi(2) + PEAK_HALF_DIGIT.powi(2)
        };
        Some(TwoPeaks { mean: own.map(|peak| peak.mean), variance: [variance(0), variance(1)] })
    };
    (0..runs.len()).map(at).collect()
}

/// Relative change of the drive of a sensitivity.
const DRIVE_CHANGE: f64 = 0.01;

/// Every combination of one value of each axis, the last axis fastest.
fn product(axes: &[Vec<f64>]) -> Vec<Vec<f64>> {
    axes.iter().fold(vec![Vec::new()], |rows, axis| {
        rows.iter().flat_map(|row| axis.iter().map(move |value| [row.as_slice(), &[*value]].concat())).collect()
    })
}

/// α of the largest mean.
fn largest(along: &[(f64, Option<Moments>)]) -> Option<f64> {
    let known = along.iter().filter_map(|(alpha, moments)| Some((*alpha, moments.as_ref()?.mean)));
    known.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(alpha, _)| alpha)
}

/// Standard error of a number of which these are left when one run is left out at a time: √((n − 1)/n Σ (x − x̄)²).
fn jackknife_error(left: &[f64]) -> f64 {
    let count = left.len() as f64;
    let mean = left.iter().sum::<f64>() / count;
    (left.iter().map(|value| (value - mean).powi(2)).sum::<f64>() * (count - 1.0) / count).sqrt()
}

/// Most evidence first, those that could not be run last.
fn rank(candidates: &mut [CandidateOutcome]) {
    let log = |own: &CandidateOutcome| own.found.as_ref().map_or(f64::NEG_INFINITY, |found| found.log_evidence);
    candidates.sort_by(|a, b| log(b).total_cmp(&log(a)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_calibration::predict::replicates::Unwatched;

    /// Peaks (m/s) of a made-up chain: α drives both, an effect that is named `what` weakens the negative one by a law of its own.
    fn made(effects: &[(&str, f64)], alpha: f64) -> [f64; 2] {
        let strength = |name: &str| effects.iter().find(|own| own.0 == name).map_or(0.0, |own| own.1);
        let drag = strength("holder.drag") / 1e-2;
        // Acts over all its range, so that one who may choose it pays for it.
        let friction = strength("holder.friction_force") / 3e-4;
        [0.6 * alpha / (1.0 + 0.3 * friction), -0.3 * alpha * (1.0 + 0.4 * drag.powf(0.7)) / (1.0 + 0.3 * friction)]
    }

    fn weighed(effects: &[Effect], printed: Peaks) -> Option<(f64, Vec<f64>)> {
        let strengths: Vec<Vec<f64>> = effects.iter().map(|effect| effect.spread(3)).collect();
        let alphas = alphas(2);
        let point = |setting: &[f64], alpha: f64| {
            let set: Vec<(&str, f64)> = effects.iter().map(|own| own.key).zip(setting.iter().copied()).collect();
            let [up, down] = made(&set, alpha);
            [-1.0, 0.0, 1.0].map(|shift| Some([up + 2e-3 * shift, down + 2e-3 * shift])).to_vec()
        };
        let runs: Vec<Vec<Vec<Option<[f64; 2]>>>> = product(&strengths)
            .iter()
            .map(|setting| alphas.iter().map(|alpha| point(setting, *alpha)).collect())
            .collect();
        weigh(&strengths, &alphas, &runs, None, printed)
    }

    #[test]
    fn the_effect_that_made_the_numbers_is_ranked_first_and_recovered_and_a_pair_pays_for_its_freedom() {
        let by_key = |key: &str| *EFFECTS.iter().find(|effect| effect.key == key).unwrap();
        let (drag, friction) = (by_key("holder.drag"), by_key("holder.friction_force"));
        let [up, down] = made(&[("holder.drag", 1e-2)], 0.6);
        let printed = Peaks { positive_m_per_s: up, negative_m_per_s: down };
        let sets: [&[Effect]; 4] = [&[], &[drag], &[friction], &[drag, friction]];
        let [alone, own, other, both] = sets.map(|set| weighed(set, printed).unwrap());
        assert!(own.0 > both.0 + NOTHING && both.0 > alone.0 && own.0 > other.0 + WEAK, "{own:?} {both:?} {other:?}");
        // A grid of three strengths over two decades, linear in between.
        assert!((own.1[0] / 1e-2).ln().abs() < 0.2 && (own.1[1] / 0.6 - 1.0).abs() < 0.02, "{own:?}");
    }

    #[test]
    fn a_point_is_as_uncertain_as_its_runs_its_slope_and_its_last_digit() {
        let runs = |mean: f64| vec![Some([mean - 0.01, -0.1]), Some([mean, -0.1]), Some([mean + 0.01, -0.1])];
        let log_alphas = [0.0, 1.0, 3.0];
        let found = likely(&[runs(0.1), runs(0.3), runs(0.5)], &log_alphas, None);
        // Between the neighbours: 0.4 over 3, and the line between them passes 0.1 + 0.4/3 here.
        let expected = 1e-4 * (1.0 + 1.0 / 3.0)
            + (0.01_f64 * 0.4 / 3.0).powi(2)
            + (0.2_f64 - 0.4 / 3.0).powi(2)
            + PEAK_HALF_DIGIT.powi(2);
        let own = found[1].unwrap();
        assert!((own.variance[0] / expected - 1.0).abs() < 1e-9 && (own.mean[0] - 0.3).abs() < 1e-12, "{own:?}");
        assert!((own.variance[1] - PEAK_HALF_DIGIT.powi(2)).abs() < 1e-15);
        // Two runs are left of three, and one is too few.
        let torn = vec![None, Some([0.3, -0.1]), Some([0.31, -0.1])];
        assert!((likely(std::slice::from_ref(&torn), &[0.0], Some(0))[0].unwrap().mean[0] - 0.305).abs() < 1e-12);
        assert_eq!(likely(&[torn], &[0.0], Some(1)), [None]);
    }

    #[test]
    fn the_jackknife_of_a_mean_is_its_standard_error() {
        let values: [f64; 4] = [1.0, 2.0, 4.0, 9.0];
        let sum: f64 = values.iter().sum();
        let left = values.map(|value| (sum - value) / 3.0);
        let expected = Moments::of(values.iter().map(|value| Some(*value))).unwrap().error();
        assert!((jackknife_error(&left) - expected).abs() < 1e-12);
    }

    #[test]
    fn a_plan_steps_over_the_paper_s_alphas_and_counts_what_is_refused() {
        assert_eq!((alphas(2).len(), alphas(4).len()), (13, 7));
        assert!(alphas(2).contains(&PRINTED_ALPHA) && alphas(4).contains(&PRINTED_ALPHA) && alphas(4).contains(&1.5));
        let plan = DissipationPlan { effects: EFFECTS[6..].to_vec(), ..DissipationPlan::quick(1) };
        let overrides = ["model.kind=chain".to_owned()];
        let study = Study::new(plan, &overrides, Bodies::default()).unwrap();
        // None, one (3), one (3), both (4 strengths), 7 α and 3 replicates each, and 12 confirming.
        assert_eq!(study.runs(), 3 * (21 + 63 + 63 + 84 + 4 * 12) + 12);
        assert_eq!(study.probe(&Unwatched).unwrap(), 9);
        assert_eq!(study.runs(), 3 * (21 + 63 + 2 * 12) + 12);
        let refused: Vec<&str> =
            study.candidates.iter().filter_map(|own| study.refused(own).map(String::as_str)).collect();
        assert!(refused.len() == 6 && refused.iter().all(|reason| reason.contains("loss.support")), "{refused:?}");
    }
}
