//! Regimes over a grid: every point is run under a steady drive and looked at once its transient is over.
//!
//! Chains run eight side by side at a fixed step; other models run one by one, as in any sweep. The result of a point depends neither on its neighbours
//! nor on the number of threads.

use std::{
    error::Error as StdError,
    sync::{Arc, Mutex, PoisonError},
};

use thiserror::Error;

use super::{
    bodies::Bodies,
    observation::{self, Observation},
    steady::SteadyMotion,
    sweep::{Run, residual_share},
};
use granchain_model::{
    ModelError,
    chain::ensemble::{Ensemble, Variation},
    response::Response,
    scene::{DriveKind, ModelKind, Scene, Support},
};
use granchain_signal::{
    Series,
    feature::{FeatureSettings, Window},
};

/// Drive periods left for the transient, and looked at behind it.
const TRANSIENT: f64 = 60.0;
const LOOKED_AT: f64 = 100.0;

/// Fixed steps of a chain a drive period: of 160, a dashpot's force that jumps as beads touch makes a period of its own.
const STEPS_PER_PERIOD: u32 = 320;

/// Runs integrated side by side.
pub(super) const LANES: usize = 8;
/// Most benches held: points that differ by α, damping and precompression share one.
const MOST_HELD: usize = 16;

/// A drive that is not steady for long enough.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "a regime needs a steady drive of {} periods, {TRANSIENT} of them for the transient; found {found:.1}. Set drive.cycles={} and duration={:.4}ms, \
     for a Gaussian burst and a striker also drive.kind=sine; where a horn record drives, pass --drive none first",
    TRANSIENT + LOOKED_AT, TRANSIENT + LOOKED_AT, 1e3 * duration
)]
pub struct Unsteady {
    /// Periods of steady drive.
    found: f64,
    /// What would do, s.
    duration: f64,
}

/// Where the motion of a scene is looked at: the last `LOOKED_AT` periods of its drive.
pub fn window(scene: &Scene) -> Result<Window, Unsteady> {
    let (frequency, needed) = (scene.drive.frequency, TRANSIENT + LOOKED_AT);
    let steady = match scene.drive.kind {
        DriveKind::GaussianBurst { .. } | DriveKind::Striker { .. } => (0.0, 0.0),
        _ => scene.drive.burst(),
    };
    let to = steady.1.min(scene.duration);
    let found = (to - steady.0) * frequency;
    // A duration is written with a few digits.
    if found < needed * (1.0 - 1e-3) {
        return Err(Unsteady { found, duration: needed / frequency });
    }
    Ok(Window::new(to - LOOKED_AT / frequency, to))
}

/// Benches prepared for runs side by side.
#[derive(Debug)]
pub struct Lanes {
    held: Mutex<Vec<Arc<Bench>>>,
    keeps_section: bool,
}

#[derive(Debug)]
struct Bench {
    scene: Scene,
    ensemble: Ensemble,
}

/// A scene and its place among those asked for.
type Placed<'a> = (usize, &'a Scene);

impl Lanes {
    /// None yet; `keeps_section` where the section of every run is wanted, a hundred numbers each.
    pub fn new(keeps_section: bool) -> Self {
        Self { held: Mutex::default(), keeps_section }
    }

    /// The runs of some scenes, in their order; none of those left when stopped.
    pub(super) fn run(
        &self,
        scenes: &[Result<Scene, String>],
        bodies: &Bodies,
        going_on: &(dyn Fn() -> bool + Sync),
    ) -> Vec<Option<Run>> {
        let mut runs = vec![None; scenes.len()];
        let mut groups: Vec<(Arc<Bench>, Vec<Placed<'_>>)> = Vec::new();
        for (index, scene) in scenes.iter().enumerate().filter(|_| going_on()) {
            let bench = scene.as_ref().map_err(String::clone).and_then(|scene| Ok((scene, self.bench(scene)?)));
            match bench {
                Err(reason) => runs[index] = Some(Run::Failed { reason }),
                Ok((scene, None)) => {
                    let response = bodies.prepared(scene).and_then(|ready| ready.run(scene, &mut |_| going_on()));
                    let residual = |response: &Response| Some(residual_share(&response.energy));
                    runs[index] = match response {
                        Err(ModelError::Stopped { .. }) => None,
                        Err(error) => Some(Run::Failed { reason: error.to_string() }),
                        Ok(response) => Some(self.seen(scene, response.observed_velocity(), residual(&response))),
                    };
                }
                Ok((scene, Some(bench))) => match groups.iter_mut().find(|(known, _)| Arc::ptr_eq(known, &bench)) {
                    Some((_, group)) => group.push((index, scene)),
                    None => groups.push((bench, vec![(index, scene)])),
                },
            }
        }
        for (bench, group) in groups {
            let variations: Vec<Variation> = group.iter().map(|(_, scene)| Variation::of(scene)).collect();
            for ((index, scene), trace) in group.into_iter().zip(bench.ensemble.run(&variations)) {
                let failed = |error: ModelError| Run::Failed { reason: error.to_string() };
                runs[index] = Some(trace.map_or_else(failed, |trace| self.seen(scene, &trace, None)));
            }
        }
        runs
    }

    /// The bench of a chain: of it, the scene differs by its variation alone. None of what does not run side by side.
    fn bench(&self, scene: &Scene) -> Result<Option<Arc<Bench>>, String> {
        if scene.model.kind != ModelKind::Chain || matches!(scene.support, Support::Disc { .. }) {
            return Ok(None);
        }
        let variation = Variation::of(scene);
        let held = || self.held.lock().unwrap_or_else(PoisonError::into_inner);
        let fits = |bench: &&Arc<Bench>| variation.written_into(&bench.scene, |gap| gap) == *scene;
        if let Some(found) = held().iter().find(fits) {
            return Ok(Some(Arc::clone(found)));
        }
        let ensemble = Ensemble::new(scene, STEPS_PER_PERIOD).map_err(|error| error.to_string())?;
        let bench = Arc::new(Bench { scene: scene.clone(), ensemble });
        let mut held = held();
        if held.len() == MOST_HELD {
            held.remove(0);
        }
        held.push(Arc::clone(&bench));
        Ok(Some(bench))
    }

    /// What is seen of a velocity (m/s) where the motion is steady.
    fn seen(&self, scene: &Scene, velocity: &Series, energy_residual: Option<f64>) -> Run {
        let look = || -> Result<Run, Box<dyn StdError>> {
            let (window, frequency) = (window(scene)?, scene.drive.frequency);
            let mut motion = SteadyMotion::of(velocity, window, frequency)?;
            if !self.keeps_section {
                motion.section.clear();
            }
            // Features of a long window take as long as the run.
            let measured = Window::new(window.to - MEASURED / frequency, window.to);
            let late = observation::seen(scene, &velocity.window(measured.from - MARGIN / frequency, window.to));
            let observation = Observation::measure(&late, &FeatureSettings::velocity(frequency, measured))?;
            Ok(Run::Finished {
                observation,
                pressure_metrics: None,
                energy_residual,
                ensemble: None,
                motion: Some(motion),
            })
        };
        look().unwrap_or_else(|error| Run::Failed { reason: error.to_string() })
    }
}

/// Drive periods whose features are measured, and those before that the vibrometer's filter sees.
const MEASURED: f64 = 24.0;
const MARGIN: f64 = 4.0;
