//! Sweep: every point of a grid is run once with the accurate integrator, measured and stored.
//!
//! Points are independent and run in parallel. The result depends neither on the number of threads nor on an earlier
//! interruption.

use std::{
    error::Error as StdError,
    ops::Range,
    path::Path,
    sync::atomic::{AtomicUsize, Ordering},
};

use rayon::prelude::*;
use serde::{Deserialize, Deserializer, Serialize, de::Error as _};
use thiserror::Error;

use super::{
    bodies::Bodies,
    ensemble::{self, EnsembleOutcome, EnsemblePlan},
    grid::Grid,
    observation::{self, Observation, PressureMetrics, watched},
    regime::{LANES, Lanes},
    steady::SteadyMotion,
};
use granchain_model::{ModelError, response::EnergyBalance, scene::Scene};
use granchain_record::run_log::{RunIndex, RunLog, RunLogError};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Run {
    Finished {
        /// Features of the accurate run.
        #[serde(deserialize_with = "whole_observation")]
        observation: Observation,
        /// Pressure metrics, if there is water.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        #[serde(rename = "heard")]
        pressure_metrics: Option<PressureMetrics>,
        /// Residual of the energy balance over the largest energy, 1; none of runs side by side.
        energy_residual: Option<f64>,
        /// Mean, standard deviation and sensitivity, on request.
        #[serde(deserialize_with = "whole_ensemble")]
        ensemble: Option<EnsembleOutcome>,
        /// How it moves once its transient is over, on request.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        motion: Option<SteadyMotion>,
    },
    Failed {
        reason: String,
    },
}

/// Reads features back and checks their number.
fn whole_observation<'de, D: Deserializer<'de>>(source: D) -> Result<Observation, D::Error> {
    let observation = Observation::deserialize(source)?;
    let [found, expected] = [observation.0.len(), watched().len()];
    if found == expected {
        Ok(observation)
    } else {
        Err(D::Error::custom(format!("expected {expected} watched numbers, found {found}")))
    }
}

/// Reads spreads back and checks their number.
fn whole_ensemble<'de, D: Deserializer<'de>>(source: D) -> Result<Option<EnsembleOutcome>, D::Error> {
    let ensemble = Option::<EnsembleOutcome>::deserialize(source)?;
    let (found, expected) = (ensemble.as_ref().map(|ensemble| ensemble.spreads.len()), watched().len());
    match found {
        Some(found) if found != expected => {
            Err(D::Error::custom(format!("expected {expected} spreads, found {found}")))
        }
        _ => Ok(ensemble),
    }
}

#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SweepError {
    #[error("none of the {points} points of the grid is a valid scene; the first: {source}")]
    NoValidPoint { points: usize, source: Box<dyn StdError + Send + Sync> },
    #[error("stopped with {finished} of {points} runs finished and kept")]
    Stopped { finished: usize, points: usize },
    #[error(transparent)]
    Log(#[from] RunLogError),
    #[error("the kept runs belong to another sweep: run {index} of a grid of {points} points")]
    OtherGrid { index: usize, points: usize },
}

/// What is reported of each point of a sweep beside the features of one run.
#[derive(Debug)]
pub enum Study {
    /// Nothing.
    Single,
    /// Scatter and sensitivity.
    Ensemble(EnsemblePlan),
    /// The regime; the features are those of the steady motion too.
    Regime(Lanes),
}

/// Progress of a sweep, reported to its caller.
pub trait Watch: Sync {
    /// `points` are finished, stored ones included.
    fn finished(&self, points: usize);
    fn stop(&self) -> bool;
    /// A warning for the user.
    fn warn(&self, _text: &str) {}
}

/// Runs every point of `grid` that `log_path` does not hold yet.
///
/// - `build`: the scene of a point from its overrides
/// - `bodies`: where bodies made ready are shared
/// - `study`: what is reported of each point besides
///
/// Returns where the runs lie, so that they need not be in memory together.
///
/// # Errors
/// [`SweepError`]; a failed run is no error but a [`Run::Failed`].
pub fn sweep<E: StdError + Send + Sync + 'static>(
    grid: &Grid,
    build: &(dyn Fn(&[String]) -> Result<Scene, E> + Sync),
    bodies: &Bodies,
    study: &Study,
    log_path: &Path,
    watch: &dyn Watch,
) -> Result<RunIndex, SweepError> {
    let points = grid.len();
    refuse_hopeless(grid, build)?;
    let (log, runs) = RunLog::index::<Run>(log_path)?;
    if let Some(damage) = log.damage() {
        watch.warn(&damage);
    }
    if let Some(index) = runs.last().filter(|index| *index >= points) {
        return Err(SweepError::OtherGrid { index, points });
    }
    let finished = AtomicUsize::new(runs.len());
    watch.finished(runs.len());
    let missing: Vec<usize> = (0..points).filter(|index| !runs.contains(*index)).collect();
    missing.par_chunks(study.together()).try_for_each(|chunk| {
        for (index, run) in chunk.iter().zip(run_points(grid, chunk, build, bodies, study, watch)) {
            let Some(run) = run else { continue };
            log.keep(*index, &run)?;
            watch.finished(finished.fetch_add(1, Ordering::Relaxed) + 1);
        }
        Ok::<_, RunLogError>(())
    })?;
    let (_, runs) = RunLog::index::<Run>(log_path)?;
    if runs.len() < points {
        return Err(SweepError::Stopped { finished: runs.len(), points });
    }
    Ok(runs)
}

/// Runs the points `part` of `grid` in order and stores nothing, for a worker among many. `finished` of `watch` counts
/// the points of the part.
///
/// Returns `None` when stopped.
pub fn sweep_part<E: StdError + Send + Sync + 'static>(
    grid: &Grid,
    part: Range<usize>,
    build: &(dyn Fn(&[String]) -> Result<Scene, E> + Sync),
    bodies: &Bodies,
    study: &Study,
    watch: &dyn Watch,
) -> Option<Vec<Run>> {
    let finished = AtomicUsize::new(0);
    let points: Vec<usize> = part.collect();
    let run = |chunk: &[usize]| {
        let runs = run_points(grid, chunk, build, bodies, study, watch);
        watch.finished(finished.fetch_add(chunk.len(), Ordering::Relaxed) + chunk.len());
        runs
    };
    points.par_chunks(study.together()).flat_map_iter(run).collect()
}

/// Refuses a grid whose every point is invalid, such as an unknown key or a wrong unit, before anything runs.
pub fn refuse_hopeless<E: StdError + Send + Sync + 'static>(
    grid: &Grid,
    build: &(dyn Fn(&[String]) -> Result<Scene, E> + Sync),
) -> Result<(), SweepError> {
    let mut first = None;
    for index in 0..grid.len() {
        match build(&grid.overrides(index)) {
            Ok(_) => return Ok(()),
            Err(error) => first = first.or(Some(error)),
        }
    }
    match first {
        Some(error) => Err(SweepError::NoValidPoint { points: grid.len(), source: error.into() }),
        None => Ok(()),
    }
}

impl Study {
    pub fn ensemble(&self) -> Option<&EnsemblePlan> {
        if let Self::Ensemble(plan) = self { Some(plan) } else { None }
    }

    pub fn is_regime(&self) -> bool {
        matches!(self, Self::Regime(_))
    }

    /// Points that are run together.
    fn together(&self) -> usize {
        if self.is_regime() { LANES } else { 1 }
    }
}

/// The runs of some points; `None` when stopped.
fn run_points<E: StdError + 'static>(
    grid: &Grid,
    points: &[usize],
    build: &(dyn Fn(&[String]) -> Result<Scene, E> + Sync),
    bodies: &Bodies,
    study: &Study,
    watch: &dyn Watch,
) -> Vec<Option<Run>> {
    if let Study::Regime(lanes) = study {
        let scenes = points.iter().map(|index| build(&grid.overrides(*index)).map_err(|error| error.to_string()));
        return lanes.run(&scenes.collect::<Vec<_>>(), bodies, &|| !watch.stop());
    }
    points.iter().map(|index| run_point(&grid.overrides(*index), build, bodies, study.ensemble(), watch)).collect()
}

/// Energy unaccounted for over the largest energy, 1; 0 where nothing moved.
pub(super) fn residual_share(energy: &EnergyBalance) -> f64 {
    if energy.largest_j > 0.0 { energy.residual_j / energy.largest_j } else { 0.0 }
}

/// `None` when stopped.
fn run_point<E: StdError + 'static>(
    overrides: &[String],
    build: &(dyn Fn(&[String]) -> Result<Scene, E> + Sync),
    bodies: &Bodies,
    ensemble: Option<&EnsemblePlan>,
    watch: &dyn Watch,
) -> Option<Run> {
    if watch.stop() {
        return None;
    }
    let run = || -> Result<Option<Run>, Box<dyn StdError>> {
        let scene = build(overrides)?;
        let settings = observation::settings(&scene)?;
        let run = bodies.prepared(&scene).and_then(|prepared| prepared.run(&scene, &mut |_| !watch.stop()));
        if let Err(ModelError::Stopped { .. }) = run {
            return Ok(None);
        }
        let response = run?;
        let observation = Observation::of(&observation::measure_response(&scene, &response, &settings)?);
        let pressure_metrics = PressureMetrics::measure(&response, &settings)?;
        let ensemble = ensemble.map(|plan| ensemble::run_on(bodies, &scene, plan)).transpose()?;
        let energy_residual = Some(residual_share(&response.energy));
        Ok(Some(Run::Finished { observation, pressure_metrics, energy_residual, ensemble, motion: None }))
    };
    run().unwrap_or_else(|error| Some(Run::Failed { reason: error.to_string() }))
}
