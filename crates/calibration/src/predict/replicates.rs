//! Perturbed runs of one scene, on any model.
//!
//! The chain runs eight side by side at a fixed step. Other models prepare their bodies once and then run one by one,
//! the reduced model eight side by side. Runs are independent and keep their order, so the result does not depend on
//! the number of threads.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::{bodies::Bodies, ensemble::EnsemblePlan};
use crate::engine::traces;
use granchain_model::{
    ModelError,
    chain::ensemble::{Ensemble, Variation},
    scene::{ModelKind, Scene, Support},
};
use granchain_signal::{
    Series,
    feature::{FeatureError, Measurand},
};

/// Runs of the chain integrated side by side.
const LANES: usize = 8;

/// Progress of a study, reported to its caller.
pub trait Watch: Sync {
    /// `done` more units are finished: runs, cases, or units of cost.
    fn advance(&self, _done: u64) {}
    fn stop(&self) -> bool;
}

/// Stops once the function says so, and counts nothing.
impl<F: Fn() -> bool + Sync> Watch for F {
    fn stop(&self) -> bool {
        self()
    }
}

#[derive(Debug, Clone, Copy, Default)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn stop(&self) -> bool {
        false
    }
}

/// Variations of the scene's gaps and drive as planned, one per run, at the scene's drive level. Deterministic in the
/// seed.
pub fn perturbations(scene: &Scene, plan: &EnsemblePlan) -> Vec<Variation> {
    let base = Variation::of(scene);
    let mut random = ChaCha8Rng::seed_from_u64(plan.seed);
    (0..plan.replicates)
        .map(|_| {
            let mut variation = base.clone();
            for gap in &mut variation.gap_offsets {
                let jitter: f64 = StandardNormal.sample(&mut random);
                *gap += plan.gap_jitter_m * jitter;
            }
            variation.amplitude_scale *= 1.0 + plan.drive_jitter * random.random_range(-1.0..=1.0);
            variation
        })
        .collect()
}

/// Runs every variation of `scene` with its bodies. `see` receives the pole's velocity (m/s), or the pressure (Pa) at
/// the first field point behind a disc, and the number of the variation; its result is kept. A failed run gives its
/// reason.
///
/// - `steps_per_period`: of the chain's fixed step; the other models have their own
///
/// Once `watch` says stop, what is left is [`ModelError::Stopped`] in words and the caller asks `watch` again.
pub fn run<T: Send>(
    bodies: &Bodies,
    scene: &Scene,
    variations: &[Variation],
    steps_per_period: u32,
    measurand: Measurand,
    watch: &dyn Watch,
    see: impl Fn(usize, &Series) -> Result<T, FeatureError> + Sync,
) -> Result<Vec<Result<T, String>>, ModelError> {
    let seen = |index: usize, velocity: Result<Series, ModelError>| {
        let outcome = velocity
            .map_err(|error| error.to_string())
            .and_then(|velocity| see(index, &velocity).map_err(|error| error.to_string()));
        watch.advance(1);
        outcome
    };
    // A disc has a clock of its own.
    if scene.model.kind == ModelKind::Chain && !matches!(scene.support, Support::Disc { .. }) {
        let ensemble = Ensemble::new(scene, steps_per_period)?;
        let run = |(group, chunk): (usize, &[Variation])| {
            let velocities = if watch.stop() {
                chunk.iter().map(|_| Err(ModelError::Stopped { time: 0.0 })).collect()
            } else {
                ensemble.run(chunk)
            };
            let numbered = velocities.into_iter().enumerate();
            numbered.map(|(place, velocity)| seen(group * LANES + place, velocity)).collect::<Vec<_>>()
        };
        return Ok(variations.par_chunks(LANES).enumerate().flat_map_iter(run).collect());
    }
    let prepared = bodies.prepared(scene)?;
    let groups = variations.len().div_ceil(prepared.together()).max(1);
    let size = variations.len().div_ceil(groups).max(1);
    let run = |(group, variations): (usize, &[Variation])| {
        let scenes: Vec<Scene> = variations.iter().map(|variation| varied(scene, variation)).collect();
        let traces = traces(&prepared, &scenes, measurand, &|| !watch.stop()).into_iter().zip(variations);
        let traces =
            traces.map(|(trace, variation)| trace.map(|trace| variation.on_the_record(trace, scene.samples())));
        traces.enumerate().map(|(place, trace)| seen(group * size + place, trace)).collect::<Vec<_>>()
    };
    Ok(variations.par_chunks(size).enumerate().with_max_len(1).flat_map_iter(run).collect())
}

/// The scene with a variation applied.
///
/// Models that know only scenes take no negative gap: an offset that would close a gap further opens it by as much instead.
pub fn varied(scene: &Scene, variation: &Variation) -> Scene {
    variation.written_over(scene, f64::abs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_model::{self as model, scene};

    fn short(overrides: &[&str]) -> Scene {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        scene::load("rigid", &overrides).unwrap()
    }

    #[test]
    fn replicates_of_a_model_that_knows_only_scenes_are_what_it_makes_of_those_scenes() {
        let scene = short(&["model.kind=fea", "model.mesh_density=4", "chain.beads=2", "duration=4us"]);
        let variations = perturbations(&scene, &EnsemblePlan::new(3, 7));
        let peaks = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let bodies = Bodies::new(None);
            let see = |i, v: &Series| Ok((i, v.peak()));
            pool.install(|| run(&bodies, &scene, &variations, 640, Measurand::Velocity, &Unwatched, see)).unwrap()
        };
        let own: Vec<_> = variations
            .iter()
            .enumerate()
            .map(|(i, variation)| {
                let response = model::run(&varied(&scene, variation), &mut |_| true).unwrap();
                Ok((i, response.observed_velocity().peak()))
            })
            .collect();
        assert_eq!(peaks(1), own);
        assert_eq!(peaks(2), own);
        assert!(own[0] != own[1]);
    }

    #[test]
    fn a_jitter_opens_gaps_and_leaves_a_pressed_chain_closed() {
        let scene = short(&[]);
        let mut variation = Variation::of(&scene);
        variation.gap_offsets.fill(-2e-10);
        assert!(varied(&scene, &variation).chain.gaps.iter().all(|gap| *gap == 2e-10));
        variation.precompression = 0.01;
        let pressed = varied(&scene, &variation);
        assert!(pressed.chain.gaps.iter().all(|gap| *gap == 0.0));
        assert_eq!(pressed.chain.precompression, 0.01);
    }

    #[test]
    fn a_stopped_watch_leaves_no_run() {
        let scene = short(&[]);
        let variations = perturbations(&scene, &EnsemblePlan::new(9, 1));
        let outcome =
            run(&Bodies::new(None), &scene, &variations, 160, Measurand::Velocity, &|| true, |_, _| Ok(())).unwrap();
        assert_eq!(outcome.len(), 9);
        assert!(outcome.iter().all(Result::is_err));
    }
}
