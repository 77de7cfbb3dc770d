//! Simulation of traces for a search: the chain alone, eight runs side by side, or the chain with a disc, one by one.

use std::sync::Arc;

use super::parameter::varied;
use granchain_model::{
    self as model, ModelError, Prepared,
    chain::{
        FiniteBodyLaws,
        ensemble::{Ensemble, Variation},
    },
    response::Response,
    scene::{Integrator, Scene, Support},
};
use granchain_signal::{Series, feature::Measurand};

/// Steps a drive period: accurate to about 1e-3 of the peak for regular, soft motion, and 1e-2 at a rigid wall with
/// linear dashpots.
pub(super) const STEPS_PER_CYCLE: usize = 160;

/// A prepared scene with [`STEPS_PER_CYCLE`] samples a drive period, to be run under variations.
#[derive(Clone)]
pub(super) enum Engine {
    /// The ensemble, and the number of its steps per output sample.
    Chain(Box<Ensemble>, usize),
    /// The prepared disc; each run starts from a copy at rest.
    OnDisc { prepared: Arc<Prepared>, scene: Arc<Scene>, measurand: Measurand },
}

/// The scene with `STEPS_PER_CYCLE` output samples a drive period and, with a disc, the longest step that divides the
/// sample interval and does not exceed the scene's own.
pub(crate) fn sampled_scene(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.output_step = 1.0 / (scene.drive.frequency * STEPS_PER_CYCLE as f64);
    if let (Support::Disc { .. }, Integrator::OnDisc { step }) = (&scene.support, &mut scene.model.integrator) {
        *step = scene.output_step / (scene.output_step / *step - 1e-9).ceil().max(1.0);
    }
    scene
}

/// Trace of a measurand: the velocity at the vibrometer's spot, or the pressure at the scene's first field point.
pub fn trace(response: Response, measurand: Measurand) -> Result<Series, ModelError> {
    match measurand {
        Measurand::Velocity => Ok(response.observed_velocity().clone()),
        Measurand::Pressure => {
            let pressure = response.disc.and_then(|disc| disc.pressure.into_iter().next());
            pressure.ok_or_else(|| ModelError::Unsupported {
                model: "chain",
                reason: "the scene has no water; take `scene = \"water\"` or set `support.kind = \"disc\"`".into(),
            })
        }
    }
}

/// The trace of a measurand in every scene, by [`Prepared::traces`] where that has it.
pub(crate) fn traces(
    prepared: &Prepared,
    scenes: &[Scene],
    measurand: Measurand,
    go_on: &dyn Fn() -> bool,
) -> Vec<Result<Series, ModelError>> {
    let single = |scene: &Scene| trace(prepared.run(scene, &mut |_| go_on())?, measurand);
    match measurand {
        Measurand::Velocity => prepared.traces(scenes, go_on),
        Measurand::Pressure => scenes.iter().map(single).collect(),
    }
}

/// Refinement factor of the chain's step.
const REFINEMENT: usize = 4;

fn ensemble(scene: &Scene, laws: Option<&FiniteBodyLaws>, refinement: usize) -> Result<Ensemble, ModelError> {
    let steps = (STEPS_PER_CYCLE * refinement) as u32;
    match laws {
        Some(laws) => Ensemble::with_laws(scene, laws, steps),
        None => Ensemble::new(scene, steps),
    }
}

impl Engine {
    /// Prepares a scene, with the contact laws `laws` if given.
    pub(super) fn new(scene: &Scene, laws: Option<&FiniteBodyLaws>, measurand: Measurand) -> Result<Self, ModelError> {
        if matches!(scene.support, Support::Disc { .. }) {
            let scene = Arc::new(sampled_scene(scene));
            let prepared = Arc::new(model::prepare(&scene)?);
            return Ok(Self::OnDisc { prepared, scene, measurand });
        }
        if measurand == Measurand::Pressure {
            return Err(ModelError::Unsupported {
                model: "chain",
                reason: "a scene without a disc makes no sound in water; set `support.kind = \"disc\"`".into(),
            });
        }
        Ok(Self::Chain(Box::new(ensemble(scene, laws, 1)?), 1))
    }

    /// The same with steps a quarter as long and the same samples; with a disc, half as long.
    pub(super) fn refined(&self, scene: &Scene, laws: Option<&FiniteBodyLaws>) -> Result<Self, ModelError> {
        match self {
            Self::Chain(..) => Ok(Self::Chain(Box::new(ensemble(scene, laws, REFINEMENT)?), REFINEMENT)),
            Self::OnDisc { scene, measurand, .. } => {
                let mut scene = Scene::clone(scene);
                if let Integrator::OnDisc { step } = &mut scene.model.integrator {
                    *step *= 0.5;
                }
                let prepared = Arc::new(model::prepare(&scene)?);
                Ok(Self::OnDisc { prepared, scene: Arc::new(scene), measurand: *measurand })
            }
        }
    }

    /// The same with other realisations of the drive noise; unchanged with a disc, where no waveform is compared.
    pub(super) fn with_shakes(&self, shakes: &[Series]) -> Self {
        match self {
            Self::Chain(ensemble, stride) => Self::Chain(Box::new(ensemble.with_shakes(shakes)), *stride),
            Self::OnDisc { .. } => self.clone(),
        }
    }

    pub(super) fn samples(&self) -> usize {
        match self {
            Self::Chain(ensemble, stride) => (ensemble.samples() - 1) / stride + 1,
            Self::OnDisc { scene, .. } => scene.samples(),
        }
    }

    /// The trace of every variation.
    pub(super) fn run(&self, variations: &[Variation]) -> Vec<Result<Series, ModelError>> {
        match self {
            Self::Chain(ensemble, 1) => ensemble.run(variations),
            Self::Chain(ensemble, stride) => {
                let thinned = |trace: Series| {
                    let values = trace.values.into_iter().step_by(*stride).collect();
                    Series::new(trace.start, trace.step * *stride as f64, values)
                };
                ensemble.run(variations).into_iter().map(|trace| trace.map(thinned)).collect()
            }
            Self::OnDisc { prepared, scene, measurand } => {
                let scenes: Vec<Scene> = variations.iter().map(|variation| varied(scene, variation)).collect();
                traces(prepared, &scenes, *measurand, &|| true)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_model::scene;

    #[test]
    fn the_clock_of_a_disc_divides_the_samples_and_is_no_longer_than_the_scene_s() {
        let scene = sampled_scene(&scene::load("water", &[]).unwrap());
        let Integrator::OnDisc { step } = scene.model.integrator else { panic!("no fixed step") };
        let parts = scene.output_step / step;
        assert!((parts - parts.round()).abs() < 1e-9 && step <= 2.5e-8 && step > 2e-8, "{step:e} {parts}");
        assert!((scene.output_step * 73e3 * STEPS_PER_CYCLE as f64 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_scene_without_water_has_no_pressure() {
        let scene = scene::load("annulus", &[]).unwrap();
        assert!(matches!(Engine::new(&scene, None, Measurand::Pressure), Err(ModelError::Unsupported { .. })));
    }

    #[test]
    fn a_run_before_a_disc_is_the_scene_s_own_run_at_the_same_clock() {
        let mut scene = scene::load("water", &["duration=60us".into(), "damping.at=beads".into()]).unwrap();
        let engine = Engine::new(&scene, None, Measurand::Pressure).unwrap();
        let mut variation = Variation::of(&scene);
        (variation.amplitude_scale, variation.damping[scene::DampingTerm::Linear]) = (0.7, 0.2);
        let made = engine.run(&[variation]).remove(0).unwrap();
        (scene.amplitude_scale, scene.damping.coefficients[scene::DampingTerm::Linear]) = (0.7, 0.2);
        let own = model::run(&sampled_scene(&scene), &mut |_| true).unwrap();
        assert_eq!(made, own.disc.unwrap().pressure[0]);
        assert_eq!(made.len(), engine.samples());
    }
}
