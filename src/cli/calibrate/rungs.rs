//! The fits of every damping law, rung by rung, with their states on disk.

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use anyhow::{Context, anyhow, bail};
use sha2::{Digest, Sha256};

use super::{Candidate, Job, SearchChoice, fitted_scene, page::law_report};
use crate::{
    calibration::{
        checkpoint::{CheckpointError, SearchCheckpoint},
        comparison::Comparison,
        correction::{Correction, most_pairs},
        engine::trace,
        fingerprints::{self, CandidateRuns, Names},
        fit::{Fit, FitError, answer, corrected, paired, searched},
        forward::{Forward, Run},
        joint::Joint,
        outcome::{self, RungFeature, RungOutcome},
        rung::{Bodies, Pair, Rung, chain_below, rung_scene},
        search::{Search, Strategy},
    },
    cli::{
        arguments::{Session, usage},
        interrupt,
        output::OutputFolder,
        progress, summary,
        timing::Timing,
    },
    model,
    report::calibration::{RungReport, RungRow, RungsReport},
    scene::{ModelKind, Rim, Scene, Support},
};

/// Runs of the chain that cost as much as one above it, for the time left.
const UPPER_COST: u64 = 150;

/// A fitted damping law.
pub struct FittedLaw {
    /// The law.
    pub kind: String,
    /// The mount of the disc, where mounts are compared.
    pub mount: Option<Rim>,
    /// Its scene on the top rung.
    pub scene: Scene,
    /// The scenes of the further records.
    pub companions: Vec<Scene>,
    /// The answer of the top rung.
    pub fit: Fit,
    /// The runs of the chain.
    pub forward: Forward,
    /// The rung above the chain, where there is one.
    pub upper: Option<Rung>,
}

/// What came of all candidates.
pub struct Fitted {
    /// Those with an answer.
    pub laws: Vec<FittedLaw>,
    /// Mounts of which no run could be compared with the record, and why.
    pub excluded: Vec<(Candidate, String)>,
    /// Every run of every candidate, of those without an answer too.
    pub made: Vec<Made>,
}

/// The runs of one candidate, and what can make them again.
pub struct Made {
    /// The runs.
    pub runs: CandidateRuns,
    joint: Joint,
    upper: Option<Rung>,
}

impl Made {
    /// Runs of the search made again, each number counted from 0.
    pub fn searched_again(&self, number: usize) -> Option<(&Run, Run)> {
        let stored = self.runs.search.iter().flatten().nth(number)?;
        let again = self.joint.run(number as u64, std::slice::from_ref(&stored.position)).pop()?;
        Some((stored, again))
    }

    /// A pair of the correction made again, by its number from 0.
    pub fn paired_again(&self, number: usize) -> Option<(&Pair, Pair)> {
        let stored = self.runs.correction.iter().flatten().nth(number)?;
        let first = self.runs.search.iter().map(Vec::len).sum::<usize>() + number;
        let position = std::slice::from_ref(&stored.upper.position);
        let again = self.upper.as_ref()?.pairs(first as u64, position).ok()?.pop()?;
        Some((stored, again))
    }
}

/// What the columns of `fingerprints.csv` are called.
pub fn names(job: &Job) -> Names {
    let of = |comparison: &Comparison| comparison.names().iter().map(ToString::to_string).collect();
    let parameters = job.candidates.first().map_or_else(Vec::new, |candidate| {
        candidate.parameters.iter().map(|parameter| parameter.name.clone()).collect()
    });
    let companions = job.companions.iter().map(|companion| of(&companion.comparison));
    Names {
        parameters,
        features: std::iter::once(of(&job.comparison)).chain(companions).collect(),
        lower: ModelKind::Chain.name().into(),
        upper: job.model().into(),
    }
}

/// The model above the chain, where the scene has one.
///
/// # Errors
/// A usage error for the finite element analysis, which is far too slow to be fitted, and for what is not corrected before a disc.
pub fn upper(scene: &Scene) -> anyhow::Result<Option<ModelKind>> {
    match scene.model.kind {
        ModelKind::Reduced if matches!(scene.support, Support::Disc { .. }) => Err(usage(
            "model `reduced` corrects no calibration in front of a disc: a run takes twenty times the chain's, and its weak hits differ by the \
             nodes of a contact patch, not by physics (docs/water.md); use --model chain, and replay --model reduced at the answer",
        )),
        ModelKind::Chain => Ok(None),
        ModelKind::Reduced => Ok(Some(ModelKind::Reduced)),
        ModelKind::Fea => Err(usage(
            "a calibration makes hundreds of runs, too many for model `fea`; use --model reduced, with --confirm fea for one run at \
             the answer",
        )),
    }
}

/// What an earlier run left on disk of one law.
#[derive(Default)]
pub struct SavedFit {
    search: (Option<SearchCheckpoint>, Option<Search>),
    correction: (Option<SearchCheckpoint>, Option<Correction>),
    /// All its runs: nothing is to be run anew.
    ended: Option<CandidateRuns>,
}

impl SavedFit {
    /// A fit that has all its runs.
    pub fn ended(runs: CandidateRuns) -> Self {
        Self { ended: Some(runs), ..Self::default() }
    }
}

/// The states of all laws.
///
/// # Errors
/// A state that is damaged or belongs to another fit.
pub fn saved_fits(job: &Job, folder: &OutputFolder, seed: u64) -> Result<Vec<SavedFit>, CheckpointError> {
    let saved = job.candidates.iter().map(|candidate| {
        let (kind, key) = (candidate.key(), key(job, candidate, seed));
        let checkpoint = |name: String| SearchCheckpoint::new(&folder.state_path().join(name), &key);
        let search = checkpoint(format!("{kind}.json"));
        let correction = checkpoint(format!("{kind}-{}.json", job.model()));
        let (found, corrected) = (search.restore()?, correction.restore()?);
        Ok(SavedFit { search: (Some(search), found), correction: (Some(correction), corrected), ended: None })
    });
    saved.collect()
}

/// What a saved search must have been made from to be continued: everything that could change a run.
fn key(job: &Job, candidate: &Candidate, seed: u64) -> String {
    let Candidate { scene, parameters, .. } = candidate;
    let drive = job.experiment.drive_input().map(|input| input.sha256.clone());
    let mut told = format!(
        "{} {seed} {} {:?} {} {drive:?} {:?} {parameters:?}\n{}\n{:?}",
        summary::program(),
        job.definition.evaluations,
        job.definition.search,
        job.measured.sha256(),
        job.comparison.features,
        scene.to_toml(),
        job.definition.weights,
    );
    for (companion, scene) in job.companions.iter().zip(&candidate.companions) {
        let drive = companion.experiment.drive_input().map(|input| input.sha256.clone());
        let (measured, features) = (companion.measured.sha256(), &companion.comparison.features);
        told += &format!("\n{measured} {drive:?} {features:?}\n{}", scene.to_toml());
    }
    Sha256::digest(told.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Search every candidate on the chain and correct it on the rung above, with its `bodies`. A mount of which no run can be compared with the
/// record, while others can, is left out with its reason.
///
/// # Errors
/// Ctrl-C; a candidate that cannot be fitted.
pub fn fit_candidates(
    job: &Job,
    saved: Vec<SavedFit>,
    bodies: Option<&Bodies>,
    session: &Session,
    timing: &mut Timing,
) -> anyhow::Result<Fitted> {
    let budget = job.definition.evaluations as u64;
    let most = job.candidates.iter().map(|candidate| candidate.parameters.len()).max().unwrap_or(0);
    let reckoned = if bodies.is_some() { most_pairs(most) as u64 * UPPER_COST } else { 0 };
    let of_law = budget + reckoned;
    let bar = progress::work(session, of_law * job.candidates.len() as u64, "runs");
    let (mut fitted, mut excluded, mut made) = (Vec::new(), Vec::new(), Vec::new());
    let (mut searching, mut correcting) = (Duration::ZERO, Duration::ZERO);
    for (number, (candidate, saved)) in job.candidates.iter().zip(saved).enumerate() {
        let Candidate { law: kind, mount, scene, companions, parameters } = candidate;
        let done = number as u64 * of_law;
        let watched = bar.clone();
        let watch = Arc::new(move |runs: u64| {
            let above = runs.saturating_sub(budget);
            // A correction that had to look for itself makes more pairs than were reckoned with.
            watched.set_position(done + runs - above + (above * UPPER_COST).min(reckoned));
            !interrupt::requested()
        });
        let failed = |error| match error {
            FitError::Stopped { .. } => interrupt::Interrupted.into(),
            error => {
                let measured = job.measured.path().display();
                anyhow!(error).context(format!("{measured}: {} cannot be fitted", candidate.name()))
            }
        };
        let laws = bodies.and_then(|bodies| bodies.laws.as_ref());
        let forward = Forward::with_laws(
            &chain_below(scene),
            laws,
            parameters.clone(),
            job.comparison.clone(),
            job.uncertainty,
            session.seed(),
            watch,
        )?;
        let mut joint = Joint::from(&forward);
        for (companion, scene) in job.companions.iter().zip(companions) {
            let (parameters, comparison) = (parameters.clone(), companion.comparison.clone());
            let (uncertainty, seed) = (companion.uncertainty, session.seed());
            let record = Forward::new(scene, parameters, comparison, uncertainty, seed, Arc::new(|_| true));
            joint = joint.and(record?);
        }
        let strategy = match job.definition.search {
            SearchChoice::Likelihood => Strategy::Likelihood,
            SearchChoice::NelderMead => Strategy::NelderMead,
            SearchChoice::ParticleSwarm => Strategy::ParticleSwarm,
        };
        let started = Instant::now();
        let (checkpoint, search) = saved.search;
        let fresh = || Search::new(&joint, budget as usize, session.seed(), strategy);
        let search = match &saved.ended {
            Some(stored) => {
                let runs = stored.search.concat();
                let found = runs.len();
                fresh().ended_with(runs).ok_or_else(|| other_runs(candidate, found))?
            }
            None => searched(joint.clone(), search.unwrap_or_else(fresh), checkpoint).map_err(failed)?,
        };
        let runs = CandidateRuns {
            candidate: candidate.key(),
            search: parted(&search.runs, &search.batches),
            correction: Vec::new(),
        };
        made.push(Made { runs, joint: joint.clone(), upper: None });
        let mut answer = match answer(&joint, search) {
            Err(error @ FitError::TooFewRuns { .. }) if mount.is_some() && job.candidates.len() > 1 => {
                excluded.push((candidate.clone(), error.to_string()));
                bar.set_position(done + of_law);
                continue;
            }
            answer => answer.map_err(failed)?,
        };
        searching += started.elapsed();
        interrupt::check()?;
        let upper = bodies.map(|bodies| Rung::new(&forward, bodies.prepared.clone(), scene).with_finer(bodies.finer.clone()));
        if let Some(rung) = &upper {
            let started = Instant::now();
            let (checkpoint, correction) = saved.correction;
            let fresh = || Correction::new(rung, &answer.runs, session.seed());
            let correction = match saved.ended {
                Some(stored) => {
                    let found = stored.len();
                    fresh().ended_with(stored.correction).ok_or_else(|| other_runs(candidate, found))?
                }
                None => paired(rung, correction.unwrap_or_else(fresh), checkpoint).map_err(failed)?,
            };
            answer = corrected(rung, answer, &correction).map_err(failed)?;
            if let Some(made) = made.last_mut() {
                made.runs.correction = parted(&correction.pairs, &correction.rounds);
                made.upper = Some(rung.clone());
            }
            correcting += started.elapsed();
        }
        bar.set_position(done + of_law);
        let (kind, companions) = (kind.clone(), companions.clone());
        fitted.push(FittedLaw { kind, mount: *mount, scene: scene.clone(), companions, fit: answer, forward, upper });
    }
    bar.finish_and_clear();
    if fitted.is_empty() {
        let reasons: Vec<String> =
            excluded.iter().map(|(candidate, why)| format!("{}: {why}", candidate.name())).collect();
        bail!("{}: no candidate can be fitted: {}", job.measured.path().display(), reasons.join("; "));
    }
    timing.stage("fit");
    if bodies.is_some() {
        timing.breakdown("fit", &[("chain", searching.as_secs_f64()), (job.model(), correcting.as_secs_f64())]);
    }
    Ok(Fitted { laws: fitted, excluded, made })
}

/// Runs batch by batch.
fn parted<T: Clone>(runs: &[T], sizes: &[usize]) -> Vec<Vec<T>> {
    let mut rest = runs.iter().cloned();
    sizes.iter().map(|size| rest.by_ref().take(*size).collect()).collect()
}

fn other_runs(candidate: &Candidate, found: usize) -> anyhow::Error {
    anyhow!(
        "{}: expected all runs of the {}, found {found} that do not make a whole fit; verify with --whole, or calibrate again",
        fingerprints::FILE,
        candidate.name()
    )
}

/// Features z of one finite element run at the answer, through the same conditioning.
///
/// # Errors
/// When the run fails or Ctrl-C is pressed.
pub fn confirm_by_fea(law: &FittedLaw, session: &Session) -> anyhow::Result<Vec<f64>> {
    let mut scene = rung_scene(&fitted_scene(law));
    scene.model.kind = ModelKind::Fea;
    if law.scene.model.kind == ModelKind::Reduced {
        (scene.model.fea.density, scene.model.fea.elements) =
            (law.scene.model.reduced.density, law.scene.model.reduced.elements);
    }
    scene.duration = law.forward.comparison.duration(&scene.drive);
    let duration = scene.duration;
    let bar = progress::simulated_time(session, "fea");
    let response = model::run(&scene, &mut |time| {
        progress::advance_to(&bar, time, duration);
        !interrupt::requested()
    });
    bar.finish_and_clear();
    interrupt::check()?;
    let response = response.context("--confirm fea: the finite element run at the answer failed")?;
    let reduced = law.forward.features(trace(response, law.forward.comparison.measurand())?);
    reduced.map_err(|reason| anyhow!("--confirm fea: the response at the answer cannot be measured: {reason}"))
}

/// What each rung said, the lowest first, with the features each expects at the answer.
#[must_use]
pub fn outcome(job: &Job, law: &FittedLaw, fea: Option<&[f64]>) -> Vec<RungOutcome> {
    let names = job.comparison.names();
    let features = |z: &dyn Fn(usize) -> Option<(f64, Option<f64>)>| -> BTreeMap<String, RungFeature> {
        let feature = |(index, name): (usize, &std::borrow::Cow<'static, str>)| {
            let (z, scatter) = z(index)?;
            let unit = job.comparison.unit(index).to_owned();
            Some((name.to_string(), RungFeature { value: job.comparison.amplitude(index, z)?, scatter, unit }))
        };
        names.iter().enumerate().filter_map(feature).collect()
    };
    let mut rungs = Vec::new();
    if let Some(below) = &law.fit.below {
        let of_chain =
            |index: usize| Some((below.differences.get(index)?.lower, Some(below.differences[index].lower_scatter)));
        rungs.push(RungOutcome::of(ModelKind::Chain.name(), &below.fit, features(&of_chain)));
        let of_upper =
            |index: usize| Some((below.differences.get(index)?.upper, Some(below.differences[index].upper_scatter)));
        rungs.push(RungOutcome::of(job.model(), &law.fit, features(&of_upper)));
    } else {
        let expected = |index: usize| {
            let scatter = *law.fit.scatter.get(index)?;
            Some((job.comparison.features.get(index)? + law.fit.deviations.get(index)? * scatter, Some(scatter)))
        };
        rungs.push(RungOutcome::of(job.model(), &law.fit, features(&expected)));
    }
    if let Some(z) = fea {
        let single = |index: usize| Some((*z.get(index)?, None));
        rungs.push(RungOutcome::single(ModelKind::Fea.name(), outcome::fitted_parameters(&law.fit), features(&single)));
    }
    rungs
}

/// The rungs side by side, where there is more than the chain.
#[must_use]
pub fn report(job: &Job, law: &FittedLaw, fea: Option<&[f64]>) -> Option<RungsReport> {
    let below = law.fit.below.as_ref()?;
    let outcomes = outcome(job, law, fea);
    let fits = [Some(&below.fit), Some(&law.fit)].into_iter().chain(std::iter::repeat(None));
    let rungs = outcomes.iter().zip(fits).map(|(rung, fit)| RungReport {
        model: rung.model.clone(),
        parameters: fit.map_or_else(Vec::new, |fit| law_report(law, fit, job).parameters),
        verdict: rung.verdict,
        runs: rung.runs,
        failed_runs: rung.failed_runs,
    });
    let names = job.comparison.names();
    let features = names.iter().enumerate().zip(&below.differences).map(|((index, name), between)| RungRow {
        name: name.replace('_', " "),
        unit: job.comparison.unit(index).into(),
        recorded: job.comparison.measured(index),
        expected: outcomes.iter().map(|rung| Some(rung.features.get(name.as_ref())?.value)).collect(),
        scatter: outcomes.iter().map(|rung| rung.features.get(name.as_ref())?.scatter).collect(),
        difference: between.difference,
        standard_error: between.standard_error,
    });
    Some(RungsReport {
        rungs: rungs.collect(),
        below: Box::new(law_report(law, &below.fit, job)),
        features: features.collect(),
    })
}
