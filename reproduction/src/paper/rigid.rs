//! Fig. 5: the chain before the rigid wall on several models.

use serde::Serialize;

use crate::failure::StudyError;
use granchain_calibration::predict::{Bodies, replicates::Watch};
use granchain_model::{
    ModelError,
    scene::{self, ModelKind, SceneError},
};
use granchain_signal::{
    Series,
    convergence::{error, moving_average},
};

/// Length of the moving average through which the last bead's velocity passes on all models, s: finite bodies ring.
pub(crate) const FILTER: f64 = 4e-7;

/// Windows in which two models are compared, s.
pub const WINDOWS: [(f64, f64); 3] = [(0.0, 30e-6), (30e-6, 60e-6), (60e-6, 70e-6)];

/// The last bead on one model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RigidRun {
    pub model: &'static str,
    /// Largest velocity in the last window's span from the start, m/s.
    pub positive_peak_m_per_s: f64,
    pub negative_peak_m_per_s: f64,
    /// Rms difference from the first model over its rms, in each of the windows of the study, 1.
    pub differences: Vec<f64>,
    /// Filtered velocity of the last bead's centre, m/s; not written.
    #[serde(skip)]
    pub velocity: Series,
}

/// The runs; the first is the finest model run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RigidOutcome {
    /// Windows in which models are compared, s.
    pub windows_s: Vec<(f64, f64)>,
    /// The runs, finest model first.
    pub runs: Vec<RigidRun>,
}

/// The models, finest first, the finite elements only where asked for.
pub(super) fn models(fea: bool) -> impl Iterator<Item = ModelKind> {
    let kinds = [ModelKind::Fea, ModelKind::Reduced, ModelKind::Chain];
    kinds.into_iter().filter(move |kind| fea || *kind != ModelKind::Fea)
}

/// What the velocities on the models say.
pub(super) fn outcome(fea: bool, velocities: Vec<Series>) -> RigidOutcome {
    let mut runs: Vec<RigidRun> = Vec::new();
    for (kind, velocity) in models(fea).zip(velocities) {
        let end = WINDOWS[WINDOWS.len() - 1].1;
        let seen = velocity.window(0.0, end);
        let extreme = |pick: fn(f64, f64) -> f64| seen.values.iter().copied().fold(0.0, pick);
        let (positive_peak_m_per_s, negative_peak_m_per_s) = (extreme(f64::max), extreme(f64::min));
        let reference = runs.first().map_or(&velocity, |first| &first.velocity);
        let differences = WINDOWS.iter().map(|window| error(&velocity, reference, *window)).collect();
        let model = kind.name();
        runs.push(RigidRun { model, positive_peak_m_per_s, negative_peak_m_per_s, differences, velocity });
    }
    RigidOutcome { windows_s: WINDOWS.to_vec(), runs }
}

/// The last bead on a model; those of `overrides` that concern the beads apply.
pub(super) fn simulate(
    kind: ModelKind,
    overrides: &[String],
    bodies: &Bodies,
    watch: &dyn Watch,
) -> Result<Series, StudyError> {
    let build = || -> Result<_, SceneError> {
        let own = overrides.iter().filter(|set| set.trim_start().starts_with("chain.")).cloned();
        let all: Vec<String> = std::iter::once(format!("model.kind={}", kind.name())).chain(own).collect();
        scene::load("rigid", &all)
    };
    let scene = build()?;
    let what = format!("the rigid scene on model `{}`", kind.name());
    let failed = |source| match source {
        ModelError::Stopped { .. } => StudyError::Stopped,
        source => StudyError::Run { what: what.clone(), source },
    };
    let prepared = bodies.prepared(&scene).map_err(failed)?;
    let response = prepared.run(&scene, &mut |_| !watch.stop()).map_err(failed)?;
    Ok(moving_average(response.observed_velocity(), FILTER))
}
