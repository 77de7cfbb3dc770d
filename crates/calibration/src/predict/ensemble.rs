//! Statistics of a chaotic chain: mean and standard deviation of each feature under small perturbations, and its
//! change with the drive.
//!
//! - **scatter**: standard deviation over runs whose gaps are jittered by N(0, 0.3 nm) and whose drive by a factor 1 +
//!   U(−1e-4, 1e-4). Smaller differences are not significant.
//! - **sensitivity**: half the difference of the means at drive × 1.01 and × 0.99, i.e. the change for +1 % drive (or
//!   +1 % α). If its standard error is as large, no trend is visible.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{
    bodies::Bodies,
    observation::{self, Observation},
    replicates::{self, Unwatched, Watch, perturbations},
};
use granchain_model::{
    Estimate, ModelError,
    chain::ensemble::Variation,
    scene::{ModelKind, Scene, Support},
};
use granchain_signal::{
    Series,
    feature::{FeatureError, Measurand},
};

/// Fixed steps of the chain a drive period. In a regular regime 160 leave 7 % of error in a sensitivity, 640 leave 0.5 %.
pub const STEPS_PER_PERIOD: u32 = 640;

/// Kind and number of perturbations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EnsemblePlan {
    /// Runs at each of the three drive levels, ≥ 2.
    #[serde(rename = "members")]
    pub replicates: usize,
    pub seed: u64,
    /// Standard deviation of each gap, m.
    pub gap_jitter_m: f64,
    /// Half-width of the uniform relative jitter of the drive, 1.
    pub drive_jitter: f64,
    /// Relative change of the drive for the sensitivity, 1.
    pub drive_change: f64,
}

impl EnsemblePlan {
    /// Gaps jittered by 0.3 nm, the drive by 1e-4, sensitivity to ±1 % of the drive.
    pub fn new(replicates: usize, seed: u64) -> Self {
        Self { replicates, seed, gap_jitter_m: 3e-10, drive_jitter: 1e-4, drive_change: 0.01 }
    }

    /// Factors on the drive: the scene's own, then those of the sensitivity.
    pub fn levels(&self) -> [f64; 3] {
        [1.0, 1.0 + self.drive_change, 1.0 - self.drive_change]
    }

    /// Cost of all its runs of a scene.
    pub fn estimate(&self, scene: &Scene) -> Estimate {
        let (replicates, beads) = (self.replicates as f64, scene.chain.beads.len() as f64);
        let mut one = Estimate::of(scene);
        if scene.model.kind == ModelKind::Chain && !matches!(scene.support, Support::Disc { .. }) {
            one.work = beads * scene.duration * scene.drive.frequency * f64::from(STEPS_PER_PERIOD);
        }
        // A variation with its gaps, and what was watched of its run.
        one.times(3.0 * replicates, 8.0 * (beads + 32.0))
    }
}

/// One feature over the ensemble.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Mean at the scene's own drive.
    pub mean: f64,
    /// Standard deviation at the scene's own drive.
    pub scatter: f64,
    /// Change for +1 % drive: half the difference of the means at ±1 %.
    pub sensitivity: f64,
    pub sensitivity_error: f64,
}

/// All features over the ensemble.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EnsembleOutcome {
    pub plan: EnsemblePlan,
    /// In the order of [`observation::watched`]; `None` if fewer than two runs have a value.
    pub spreads: Vec<Option<Spread>>,
    pub runs: usize,
    /// Reasons of failed runs, one per run.
    pub failures: Vec<String>,
}

/// Why there is no ensemble at all.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum EnsembleError {
    #[error("an ensemble needs at least 2 runs, found {found}; pass --ensemble 32")]
    TooFew { found: usize },
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error("the drive cannot be measured: {0}")]
    Feature(#[from] FeatureError),
    #[error("{failed} of {runs} runs of the ensemble failed, the first because: {first}")]
    Failed { runs: usize, failed: usize, first: String },
}

/// Run the scene 3 × `replicates` times on the model it asks for and summarise each watched number. The chain takes a fixed step of
/// T0/[`STEPS_PER_PERIOD`].
///
/// The same perturbations are used at the three drive levels, so that in regular regimes they drop out of the
/// sensitivity. Deterministic in the seed.
///
/// # Errors
/// [`EnsembleError`]; single failed runs are counted in the outcome instead.
pub fn run_on(bodies: &Bodies, scene: &Scene, plan: &EnsemblePlan) -> Result<EnsembleOutcome, EnsembleError> {
    if plan.replicates < 2 {
        return Err(EnsembleError::TooFew { found: plan.replicates });
    }
    plan.estimate(scene).check(&scene.model.limits)?;
    let settings = observation::settings(scene)?;
    let perturbed = perturbations(scene, plan);
    run_perturbed(bodies, scene, Measurand::Velocity, plan, &perturbed, &Unwatched, |_, velocity| {
        Observation::measure(&observation::seen(scene, velocity), &settings)
    })
}

/// As [`run_on`] for any measurand and the variations of `perturbed`, until `watch` requests a stop; `see` receives the number of every run and its trace
/// (m/s or Pa), and measures it.
///
/// # Errors
/// As [`run_on`]; [`EnsembleError::Failed`] where it was stopped.
pub(crate) fn run_perturbed(
    bodies: &Bodies,
    scene: &Scene,
    measurand: Measurand,
    plan: &EnsemblePlan,
    perturbed: &[Variation],
    watch: &dyn Watch,
    see: impl Fn(usize, &Series) -> Result<Observation, FeatureError> + Sync,
) -> Result<EnsembleOutcome, EnsembleError> {
    let replicates = perturbed.len();
    if replicates < 2 {
        return Err(EnsembleError::TooFew { found: replicates });
    }
    let variations: Vec<Variation> = plan
        .levels()
        .iter()
        .flat_map(|level| {
            perturbed.iter().map(move |variation| Variation {
                amplitude_scale: variation.amplitude_scale * level,
                ..variation.clone()
            })
        })
        .collect();
    let see = |run: usize, trace: &Series| see(run % replicates, trace);
    let watched: Vec<Result<Observation, String>> =
        replicates::run(bodies, scene, &variations, STEPS_PER_PERIOD, measurand, watch, see)?;
    let failures: Vec<String> = watched.iter().filter_map(|outcome| outcome.as_ref().err().cloned()).collect();
    let observations: Vec<Option<Observation>> = watched.into_iter().map(Result::ok).collect();
    let [at_scene, above, below] = [0, 1, 2]
        .map(|level| observations[level * replicates..(level + 1) * replicates].iter().flatten().collect::<Vec<_>>());
    if at_scene.len() < 2 {
        let first = failures.first().cloned().unwrap_or_default();
        return Err(EnsembleError::Failed { runs: variations.len(), failed: failures.len(), first });
    }
    let spreads = (0..observation::watched_of(measurand, scene.drive.frequency).len())
        .map(|index| {
            let level = |level: &[&Observation]| Moments::of(level.iter().map(|observation| observation.0[index]));
            let [own, above, below] = [&at_scene, &above, &below].map(|runs| level(runs));
            Some(Spread::between(&own?, &above?, &below?))
        })
        .collect();
    Ok(EnsembleOutcome { plan: *plan, spreads, runs: variations.len(), failures })
}

impl Spread {
    /// From the moments at the scene's own drive and at drive × 1.01 and × 0.99.
    pub fn between(own: &Moments, above: &Moments, below: &Moments) -> Self {
        Self {
            mean: own.mean,
            scatter: own.deviation,
            sensitivity: 0.5 * (above.mean - below.mean),
            sensitivity_error: 0.5 * above.error().hypot(below.error()),
        }
    }
}

/// Mean and standard deviation of a number over runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    pub mean: f64,
    /// Standard deviation (of n − 1 degrees of freedom).
    pub deviation: f64,
    /// Number of runs, ≥ 2.
    pub count: usize,
}

impl Moments {
    /// `None` if a run has no value, or if there are fewer than two runs.
    pub fn of(values: impl Iterator<Item = Option<f64>>) -> Option<Self> {
        let values: Vec<f64> = values.collect::<Option<_>>()?;
        if values.len() < 2 {
            return None;
        }
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
        Some(Self { mean, deviation: variance.sqrt(), count: values.len() })
    }

    /// Standard error of the mean.
    pub fn error(&self) -> f64 {
        self.deviation / (self.count as f64).sqrt()
    }
}
