//! Fidelity level above the chain: the same runs with the same draws, on prepared bodies.
//!
//! A run of the chain costs a millisecond, one on the reduced model a few tenths of a second, one by finite elements ten seconds. So the chain
//! searches ([`super::search`]), and each fidelity level above is run only where the answer of the fidelity level below it lies ([`super::correction`]).

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use rayon::prelude::*;
use thiserror::Error;

use super::{
    drive::HornNoise,
    engine::{sampled_scene, traces},
    forward::{Forward, Point, Run, Show, TimedRun, Watch},
    run_store::RunStore,
};
use granchain_model::{
    self as model, ModelError, Prepared,
    chain::{FiniteBodyLaws, ensemble::Variation},
    reduced::Cache,
    scene::{ContactLaw, DriveKind, ModelKind, Scene},
};
use granchain_record::run_log::RunLogError;
use granchain_signal::Series;

/// Factor on the mesh density of the finer bodies, and on the number of their steps.
pub(crate) const FINER: f64 = 1.5;

/// Why a batch of runs is incomplete.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Incomplete {
    /// Stopped by the caller; the current batch is dropped except for runs stored one by one.
    #[error("stopped")]
    Stopped,
    /// A finished run could not be stored.
    #[error(transparent)]
    NotStored(#[from] RunLogError),
}

/// A run to be made.
#[derive(Debug, Clone)]
struct PlannedRun {
    /// Its number, which determines its draws.
    number: u64,
    position: Vec<f64>,
    /// Simulated time, s; if it proves too short, the run is repeated at full length.
    duration: f64,
}

/// A model above the chain, prepared for runs at any point of the box and compared with one record.
#[derive(Clone)]
pub struct FidelityLevel {
    pub(super) chain: Forward,
    prepared: Arc<Prepared>,
    scene: Scene,
    /// The fidelity level between it and the chain.
    below: Option<Arc<Self>>,
    /// The same on finer bodies.
    finer: Option<Arc<Self>>,
    kept: Option<Arc<RunStore>>,
}

/// The chain for a model with bodies, with contact laws fitted to the same bodies at rest. A chain scene is returned
/// unchanged.
pub fn chain_below(scene: &Scene) -> Scene {
    let mut chain = scene.clone();
    if scene.model.kind.is_meshed() {
        chain.contact_law = ContactLaw::FiniteBody;
    }
    if scene.model.kind == ModelKind::Reduced {
        chain.model.fea.density = scene.model.reduced.density;
    }
    chain.model.kind = ModelKind::Chain;
    chain
}

/// The reduced model between chain and finite elements, with the same mesh; `None` for other models.
pub(crate) fn reduced_below(scene: &Scene) -> Option<Scene> {
    let mut reduced = scene.clone();
    reduced.model.reduced.density = scene.model.fea.density;
    reduced.model.reduced.contact_patch = scene.model.fea.contact_patch;
    reduced.model.kind = ModelKind::Reduced;
    (scene.model.kind == ModelKind::Fea).then_some(reduced)
}

/// The scene with a mesh 1.5 times as dense and a step 1.5 times as short, or the next shorter that divides the output step, if its model has a mesh.
fn finer_scene(scene: &Scene) -> Option<Scene> {
    let mut scene = scene.clone();
    let (density, step) = match scene.model.kind {
        ModelKind::Chain => return None,
        ModelKind::Reduced => (&mut scene.model.reduced.density, &mut scene.model.reduced.step),
        ModelKind::Fea => (&mut scene.model.fea.density, &mut scene.model.fea.step),
    };
    *density = (f64::from(*density) * FINER).round() as u32;
    let steps = (scene.output_step / *step).round().max(1.0);
    *step = scene.output_step / (FINER * steps).ceil();
    Some(scene)
}

/// Prepared bodies of a scene: for its own model, and as contact laws of the chain.
#[derive(Debug)]
pub struct Bodies {
    /// For the scene's own model.
    pub prepared: Arc<Prepared>,
    /// On a finer mesh, to estimate the mesh error; `None` for the chain.
    pub finer: Option<Arc<Prepared>>,
    /// Scene and bodies of the fidelity level between this one and the chain.
    pub below: Option<Box<(Scene, Self)>>,
    /// Contact laws for the chain; `None` if it has Hertz contacts.
    pub laws: Option<FiniteBodyLaws>,
}

impl Bodies {
    /// Prepares the bodies of a scene; those of its own model are read from `cache` if present.
    pub fn new(scene: &Scene, cache: Option<&Cache>) -> Result<Self, ModelError> {
        let prepared = Arc::new(model::prepare_with(&sampled_scene(scene), cache)?);
        let below = model::prepare_with(&chain_below(scene), cache)?;
        let finer = finer_scene(&sampled_scene(scene));
        let finer = finer.map(|scene| model::prepare_with(&scene, cache).map(Arc::new)).transpose()?;
        let laws = below.contact_laws().cloned();
        let below = reduced_below(scene).map(|scene| Self::new(&scene, cache).map(|bodies| Box::new((scene, bodies))));
        Ok(Self { prepared, finer, below: below.transpose()?, laws })
    }

    /// The fidelity levels of a scene on these bodies, lowest first, above the runs of `chain`.
    pub(crate) fn fidelities(&self, chain: &Forward, scene: &Scene) -> Vec<FidelityLevel> {
        let own = FidelityLevel::new(chain, Arc::clone(&self.prepared), scene).with_finer(self.finer.clone());
        let Some((below, scene_below)) = self.below.as_deref().map(|(_, bodies)| bodies).zip(reduced_below(scene))
        else {
            return vec![own];
        };
        let mut fidelities = below.fidelities(chain, &scene_below);
        let lower = fidelities.last().cloned();
        fidelities
            .push(FidelityLevel { below: lower.map(|fidelity| Arc::new(fidelity.watched(Arc::new(|_| true)))), ..own });
        fidelities
    }
}

impl FidelityLevel {
    /// The runs of `chain`, on the bodies of `scene`.
    pub fn new(chain: &Forward, prepared: Arc<Prepared>, scene: &Scene) -> Self {
        let mut scene = sampled_scene(scene);
        scene.duration = chain.comparison.duration(&scene.drive);
        Self { chain: chain.clone().in_blocks(), prepared, scene, below: None, finer: None, kept: None }
    }

    /// The same with finer bodies of the same scene.
    #[must_use]
    pub(crate) fn with_finer(mut self, prepared: Option<Arc<Prepared>>) -> Self {
        self.finer = prepared
            .zip(finer_scene(&self.scene))
            .map(|(prepared, scene)| Arc::new(Self { prepared, scene, ..self.clone() }));
        self
    }

    /// The same with stores for its runs and those on finer bodies.
    #[must_use]
    pub(crate) fn keeping(mut self, own: Arc<RunStore>, finer: Arc<RunStore>) -> Self {
        self.kept = Some(own);
        self.finer = self.finer.map(|fidelity| Arc::new(Self { kept: Some(finer), ..Self::clone(&fidelity) }));
        self
    }

    /// The same with another watch.
    pub(super) fn watched(&self, watch: Arc<Watch>) -> Self {
        let finer = self.finer.as_ref().map(|finer| Arc::new(finer.watched(Arc::clone(&watch))));
        Self { chain: self.chain.clone().watched(watch), finer, ..self.clone() }
    }

    /// This level on finer bodies, if there are any.
    pub(crate) fn finer(&self) -> Option<&Self> {
        self.finer.as_deref()
    }

    pub(crate) fn prepared(&self) -> &Arc<Prepared> {
        &self.prepared
    }

    /// Run number `first` and those after it: first on the level below, then on this level with the same nuisances.
    ///
    /// The chain's onset says how long a run has to be simulated; one that proves too short is made again at full length. The chain's
    /// watch is called after every run.
    pub fn pairs(&self, first: u64, positions: &[Vec<f64>]) -> Result<Vec<Pair>, Incomplete> {
        let chain = self.chain.timed(first, positions);
        let lower = match &self.below {
            Some(below) => below.own(first, &chain)?,
            None => chain.iter().map(|(run, _)| run.clone()).collect(),
        };
        let upper = self.own(first, &chain)?;
        Ok(lower.into_iter().zip(upper).map(|(lower, upper)| Pair { lower, upper }).collect())
    }

    /// The runs of this level that belong to those of the chain, numbered from `first`.
    fn own(&self, first: u64, chain: &[TimedRun]) -> Result<Vec<Run>, Incomplete> {
        let longest = self.scene.duration;
        let plan = |(number, (run, onset)): (u64, &TimedRun)| {
            let end = onset.map(|onset| self.chain.comparison.end_of_run(onset, &self.scene.drive));
            let duration = end.map_or(longest, |end| end.min(longest));
            PlannedRun { number, position: run.position.clone(), duration }
        };
        self.made((first..).zip(chain).map(plan).collect())
    }

    /// As [`Forward::waveforms`], of this model.
    pub(super) fn waveforms<T: Send>(
        &self,
        first: u64,
        points: &[Point],
        noise: Option<&HornNoise>,
        show: Show<T>,
    ) -> Vec<Option<T>> {
        let together = self.prepared.together();
        let (count, measurand) = (self.scene.samples(), self.chain.comparison.measurand());
        let goes_on = || self.chain.report(first);
        let chunk = |(chunk, points): (usize, &[Point])| {
            let number = first + (chunk * together) as u64;
            let draw = |(number, (at, stiffness)): (u64, &Point)| {
                let (mut random, mut scene) = (self.chain.generator(number), self.scene.clone());
                if let (DriveKind::Record { shakes, .. }, Some(noise)) = (&mut scene.drive.kind, noise) {
                    *shakes = vec![noise.realisation(&mut random)];
                }
                let variation = self.chain.held(at, *stiffness, 0, &mut random);
                (variation.written_over(&scene, |gap| gap.max(0.0)), (variation, random))
            };
            let (scenes, drawn): (Vec<Scene>, Vec<_>) = (number..).zip(points).map(draw).unzip();
            let made = traces(&self.prepared, &scenes, measurand, &goes_on).into_iter().zip(points).zip(drawn);
            let shown = |((trace, (at, _)), (variation, mut random)): ((_, &Point), (Variation, _))| {
                let trace: Result<Series, ModelError> = trace;
                Some(show(&self.chain, at, variation.on_the_record(trace.ok()?, count), &mut random))
            };
            made.map(shown).collect::<Vec<_>>()
        };
        points.par_chunks(together).with_max_len(1).enumerate().flat_map_iter(chunk).collect()
    }

    /// Make runs of ascending numbers.
    fn made(&self, plans: Vec<PlannedRun>) -> Result<Vec<Run>, Incomplete> {
        let first = plans.first().map_or(0, |plan| plan.number);
        let done = AtomicU64::new(first);
        let goes_on = || self.chain.report(done.load(Ordering::Relaxed));
        let of_block =
            |one: &PlannedRun, other: &PlannedRun| self.chain.block(one.number) == self.chain.block(other.number);
        let groups = plans.chunk_by(of_block).flat_map(|block| block.chunks(self.prepared.together()));
        let made = groups.collect::<Vec<_>>().into_par_iter().with_max_len(1).map(|plans| {
            let runs = self.group(plans, &goes_on)?;
            for (plan, run) in plans.iter().zip(&runs).filter(|(plan, _)| self.found(plan).is_none()) {
                self.kept.iter().try_for_each(|kept| kept.keep(plan.number, run))?;
            }
            done.fetch_add(plans.len() as u64, Ordering::Relaxed);
            goes_on();
            Ok(plans.iter().map(|plan| plan.number).zip(runs).collect())
        });
        let made: Vec<Vec<(u64, Run)>> = made.collect::<Result<_, Incomplete>>()?;
        let mut made: Vec<(u64, Run)> = made.into_iter().flatten().collect();
        made.sort_by_key(|(number, _)| *number);
        Ok(made.into_iter().map(|(_, run)| run).collect())
    }

    fn found(&self, plan: &PlannedRun) -> Option<Run> {
        self.kept.as_ref()?.found(plan.number, &plan.position).cloned()
    }

    /// Makes a group of runs while `goes_on` returns true.
    fn group(&self, plans: &[PlannedRun], goes_on: &dyn Fn() -> bool) -> Result<Vec<Run>, Incomplete> {
        let (longest, measurand) = (self.scene.duration, self.chain.comparison.measurand());
        let mut runs: Vec<Option<Run>> = plans.iter().map(|plan| self.found(plan)).collect();
        let mut left: Vec<(usize, f64)> = plans.iter().map(|plan| plan.duration).enumerate().collect();
        left.retain(|(index, _)| runs[*index].is_none());
        while !left.is_empty() {
            let (mut scenes, mut draws, mut variations) = (Vec::new(), Vec::new(), Vec::new());
            for (index, duration) in &left {
                let PlannedRun { number, position, .. } = &plans[*index];
                let mut random = self.chain.generator(*number);
                let variation = self.chain.variation(position, &mut random);
                let scene = Scene { duration: *duration, ..self.scene.clone() };
                scenes.push(variation.written_over(&scene, |gap| gap.max(0.0)));
                variations.push((variation, scene.samples()));
                draws.push(random);
            }
            let traces = traces(&self.prepared, &scenes, measurand, goes_on).into_iter().zip(variations);
            let traces: Vec<_> = traces
                .map(|(trace, (variation, count))| trace.map(|trace| variation.on_the_record(trace, count)))
                .collect();
            if traces.iter().any(|trace| matches!(trace, Err(ModelError::Stopped { .. }))) {
                return Err(Incomplete::Stopped);
            }
            let finished = traces.into_iter().zip(&mut draws).zip(std::mem::take(&mut left));
            for ((trace, random), (index, duration)) in finished {
                let (run, _) = self.chain.finish(&plans[index].position, trace, random);
                if run.outcome.is_ok() || duration >= longest {
                    runs[index] = Some(run);
                } else {
                    left.push((index, longest));
                }
            }
        }
        Ok(runs.into_iter().flatten().collect())
    }
}

/// One point of the box, run on two fidelity levels with the same nuisances.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Pair {
    /// On the fidelity level below: the chain, or the reduced model below finite elements.
    pub lower: Run,
    pub upper: Run,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        forward::Uncertainty,
        observation::{Observation, Recording},
        parameter::Parameter,
    };
    use granchain_model::scene::{self, Support};
    use granchain_record::{ReadOptions, RecordKind, read_record};
    use granchain_signal::feature::fingerprint::FeatureSet;

    #[test]
    fn the_finer_level_has_one_and_a_half_times_the_elements_and_at_least_as_many_more_steps() {
        let scene = sampled_scene(&scene::load("annulus", &["model.kind=reduced".into()]).unwrap());
        let finer = finer_scene(&scene).unwrap();
        let steps = |scene: &Scene| (scene.output_step / scene.model.reduced.step).round();
        assert_eq!((steps(&scene), steps(&finer)), (2.0, 3.0));
        assert_eq!((scene.model.reduced.density, finer.model.reduced.density), (16, 24));
        assert_eq!(finer.output_step, scene.output_step);
    }

    #[test]
    fn runs_that_can_go_side_by_side_have_one_support_and_others_have_not() {
        let overrides = ["chain.beads=2", "drive.cycles=20", "duration=420us"].map(String::from);
        let scene = scene::load("annulus", &overrides).unwrap();
        let (parameters, uncertainty) = (vec![Parameter::alpha()], Uncertainty::default());
        let shipped = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../measurements/twin-annulus/vib.csv");
        let record = read_record(&shipped, RecordKind::Vibrometer, &ReadOptions::default()).unwrap();
        let recording = Recording::of(&record, false);
        let observation = Observation::new(&recording, &scene.drive, FeatureSet::Full).unwrap();
        let chain = Forward::new(&scene, None, parameters, observation, uncertainty, 5, Arc::new(|_| true)).unwrap();
        let level = FidelityLevel::new(&chain, Bodies::new(&scene, None).unwrap().prepared, &scene);
        let support = |chain: &Forward, number: u64| -> Support {
            chain.variation(&[0.5], &mut chain.generator(number)).written_over(&level.scene, |gap| gap).support
        };
        let same = |chain: &Forward, one: u64, other: u64| support(chain, one) == support(chain, other);
        assert!((17..24).all(|number| same(&level.chain, 16, number)) && !same(&level.chain, 16, 24));
        assert!(!same(&chain, 16, 17));
    }
}
