//! The rung above the chain: the same runs, with the same draws, on bodies made ready once.
//!
//! A run of the chain costs a millisecond, one on the reduced model a few tenths of a second. So the chain searches
//! ([`super::search`]), and the rung above is run only where the answer lies ([`super::correction`]).

use std::sync::{
    Arc,
    atomic::{AtomicBool, AtomicU64, Ordering},
};

use rayon::prelude::*;

use super::{
    discrepancy,
    engine::{sampled_scene, traces},
    forward::{Forward, Run},
    parameter::varied,
};
use granchain_model::{
    self as model, ModelError, Prepared,
    chain::FiniteBodyLaws,
    reduced::Cache,
    scene::{ContactLaw, ModelKind, Scene},
};

/// Stopped from outside; nothing of the batch in hand is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stopped;

/// A model above the chain, ready to be run at any point of the box and compared with one record.
#[derive(Clone)]
pub struct Rung {
    chain: Forward,
    prepared: Arc<Prepared>,
    scene: Scene,
    /// The same on finer bodies.
    finer: Option<Arc<Self>>,
}

/// A scene as a search runs it above the chain: with as many samples a drive period as the chain has steps.
#[must_use]
pub(crate) fn rung_scene(scene: &Scene) -> Scene {
    sampled_scene(scene)
}

/// The chain below a model with bodies: contacts as the same bodies have them at rest. The chain itself stays as it is.
#[must_use]
pub fn chain_below(scene: &Scene) -> Scene {
    let mut chain = scene.clone();
    if scene.model.kind == ModelKind::Reduced {
        chain.contact_law = ContactLaw::FiniteBody;
        (chain.model.fea.density, chain.model.fea.elements) =
            (scene.model.reduced.density, scene.model.reduced.elements);
    }
    chain.model.kind = ModelKind::Chain;
    chain
}

/// The scene on a mesh 1.5 times as dense, where its model is the reduced one.
fn finer_scene(scene: &Scene) -> Option<Scene> {
    let mut scene = scene.clone();
    let density = &mut scene.model.reduced.density;
    *density = (f64::from(*density) * discrepancy::FINER).round() as u32;
    (scene.model.kind == ModelKind::Reduced).then_some(scene)
}

/// The bodies of a scene made ready for a search: on its own model, and as contact laws of the chain below.
#[derive(Debug)]
pub struct Bodies {
    /// For the scene's own model.
    pub prepared: Arc<Prepared>,
    /// Those of a finer mesh, which tell what the model's own is off by; `None` of a model that is no reduced one.
    pub finer: Option<Arc<Prepared>>,
    /// For the chain below; `None` where that has Hertz contacts.
    pub laws: Option<FiniteBodyLaws>,
}

impl Bodies {
    /// Make the bodies of a scene ready, those of its own model from `cache` where they lie there.
    ///
    /// # Errors
    /// When the scene's model, or the chain below it, cannot be made ready.
    pub fn new(scene: &Scene, cache: Option<&Cache>) -> Result<Self, ModelError> {
        let prepared = Arc::new(model::prepare_with(&rung_scene(scene), cache)?);
        let below = model::prepare_with(&chain_below(scene), cache)?;
        let finer = finer_scene(&rung_scene(scene));
        let finer = finer.map(|scene| model::prepare_with(&scene, cache).map(Arc::new)).transpose()?;
        Ok(Self { prepared, finer, laws: below.contact_laws().cloned() })
    }
}

impl Rung {
    /// The runs of `chain`, on the bodies of `scene`.
    #[must_use]
    pub fn new(chain: &Forward, prepared: Arc<Prepared>, scene: &Scene) -> Self {
        let mut scene = rung_scene(scene);
        scene.duration = chain.comparison.duration(&scene.drive);
        Self { chain: chain.clone(), prepared, scene, finer: None }
    }

    /// The same beside one on finer bodies of the same scene.
    #[must_use]
    pub fn with_finer(mut self, prepared: Option<Arc<Prepared>>) -> Self {
        self.finer = prepared
            .zip(finer_scene(&self.scene))
            .map(|(prepared, scene)| Arc::new(Self { chain: self.chain.clone(), prepared, scene, finer: None }));
        self
    }

    /// The same on finer bodies, where there are any.
    #[must_use]
    pub fn finer(&self) -> Option<&Self> {
        self.finer.as_deref()
    }

    /// The chain below.
    #[must_use]
    pub fn chain(&self) -> &Forward {
        &self.chain
    }

    /// The bodies.
    #[must_use]
    pub fn prepared(&self) -> &Arc<Prepared> {
        &self.prepared
    }

    /// Run number `first` and those that follow it, first on the chain, then, under the same nuisances, on this rung.
    ///
    /// The chain's onset says how long a run has to be simulated; one that proves too short is made again at full length. The chain's
    /// watch is told after every run.
    ///
    /// # Errors
    /// [`Stopped`] when whoever watches says so.
    pub fn pairs(&self, first: u64, positions: &[Vec<f64>]) -> Result<Vec<Pair>, Stopped> {
        let lower = self.chain.timed(first, positions);
        let (done, stopped) = (AtomicU64::new(first), AtomicBool::new(false));
        let longest = self.scene.duration;
        let mut plans: Vec<(u64, &[f64], f64)> = (first..)
            .zip(&lower)
            .map(|(number, (run, onset))| {
                let end = onset.and_then(|onset| self.chain.comparison.end_of_run(onset, &self.scene.drive));
                (number, &run.position[..], end.map_or(longest, |end| end.min(longest)))
            })
            .collect();
        // Runs that go together last as long as the longest of them.
        plans.sort_by(|one, other| one.2.total_cmp(&other.2));
        let groups = plans.len().div_ceil(self.prepared.together()).max(1);
        let made = plans.par_chunks(plans.len().div_ceil(groups).max(1)).map(|plans| {
            let runs = self.group(plans, &stopped)?;
            if !self.chain.report(done.fetch_add(plans.len() as u64, Ordering::Relaxed) + plans.len() as u64) {
                stopped.store(true, Ordering::Relaxed);
            }
            Ok(plans.iter().map(|(number, ..)| *number).zip(runs).collect())
        });
        let made: Vec<Vec<(u64, Run)>> = made.collect::<Result<_, _>>()?;
        let mut made: Vec<(u64, Run)> = made.into_iter().flatten().collect();
        made.sort_by_key(|(number, _)| *number);
        Ok(lower.into_iter().zip(made).map(|((lower, _), (_, upper))| Pair { lower, upper }).collect())
    }

    /// The runs of these numbers, at these points, of these durations, s.
    fn group(&self, plans: &[(u64, &[f64], f64)], stopped: &AtomicBool) -> Result<Vec<Run>, Stopped> {
        let (longest, measurand) = (self.scene.duration, self.chain.comparison.measurand());
        let mut runs: Vec<Option<Run>> = vec![None; plans.len()];
        let mut left: Vec<(usize, f64)> = plans.iter().map(|plan| plan.2).enumerate().collect();
        while !left.is_empty() {
            let (mut scenes, mut draws) = (Vec::new(), Vec::new());
            for (index, duration) in &left {
                let (number, at, _) = plans[*index];
                let mut random = self.chain.generator(number);
                let variation = self.chain.variation(at, &mut random);
                scenes.push(Scene { duration: *duration, ..varied(&self.scene, &variation) });
                draws.push(random);
            }
            let traces = traces(&self.prepared, &scenes, measurand, &|| !stopped.load(Ordering::Relaxed));
            if stopped.load(Ordering::Relaxed) {
                return Err(Stopped);
            }
            let finished = traces.into_iter().zip(&mut draws).zip(std::mem::take(&mut left));
            for ((trace, random), (index, duration)) in finished {
                let (run, _) = self.chain.finish(plans[index].1, trace, random);
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

/// One point of the box, run on both rungs under the same nuisances.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Pair {
    /// On the chain.
    pub lower: Run,
    /// On the rung above.
    pub upper: Run,
}
