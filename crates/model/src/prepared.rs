//! Bodies made ready once, for any number of runs.

use super::{
    ModelError, Progress,
    chain::{ChainModel, FiniteBodyLaws, InitialState},
    estimate::refuse_excess,
    fea::{self, loss::refuse_losses, yielding},
    reduced::{self, Cache, Origin, Reduction},
    tally,
    water::DiscSupport,
};
use crate::{
    response::{Preparation, Response},
    scene::{
        Bead, ContactLaw, FlatContact, Integrator, Material, Meshing, ModelKind, PistonMotion, ReducedSettings, Scene,
        Support, WaterSettings,
    },
};
use granchain_signal::Series;

/// A scene's bodies made ready once, to be run any number of times with another drive, α, damping, gaps, precompression, stiffness of
/// the support or duration.
///
/// ```
/// use granchain_model::{self as model, scene};
///
/// let mut scene = scene::load("rigid", &["duration=10 us".into()])?;
/// let prepared = model::prepare(&scene)?;
/// for alpha in [0.5, 1.0] {
///     scene.amplitude_scale = alpha;
///     let response = prepared.run(&scene, &mut |_| true)?;
///     assert_eq!(response.bead_velocity.len(), 6);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Prepared {
    bodies: Bodies,
    model: PreparedModel,
    work: Preparation,
}

#[derive(Debug)]
enum PreparedModel {
    Chain(Option<FiniteBodyLaws>),
    /// The chain in front of a disc.
    OnDisc(Box<DiscSupport>),
    Reduced {
        reduction: Box<Reduction>,
        origin: Origin,
    },
    Fea,
}

pub fn prepare(scene: &Scene) -> Result<Prepared, ModelError> {
    prepare_with(scene, None)
}

/// As [`prepare`], with reduced bodies read from a cache that holds them, and kept there where it does not. Results are the same to the bit.
pub fn prepare_with(scene: &Scene, cache: Option<&Cache>) -> Result<Prepared, ModelError> {
    let (model, work) = tally::during(|| model(scene, cache));
    Ok(Prepared { bodies: Bodies::of(scene), model: model?, work })
}

fn model(scene: &Scene, cache: Option<&Cache>) -> Result<PreparedModel, ModelError> {
    refuse_excess(scene)?;
    scene.refuse_free_end()?;
    scene.refuse_beyond_model()?;
    let scene = &*scene.with_striker();
    Ok(match scene.model.kind {
        ModelKind::Chain if scene.support.disc().is_some() => {
            super::need_drive(scene, "chain")?;
            PreparedModel::OnDisc(Box::new(DiscSupport::new(scene)?))
        }
        ModelKind::Chain if scene.has_fitted_laws() => PreparedModel::Chain(Some(match cache {
            Some(cache) if scene.has_own_ring() => cache.contact_laws(scene)?,
            _ => FiniteBodyLaws::fit(scene)?,
        })),
        ModelKind::Chain => PreparedModel::Chain(None),
        ModelKind::Reduced => {
            let (reduction, origin) = match cache {
                // A disc on water is made again: its modes and the water's answer are not kept.
                Some(cache) if scene.water.is_none() => cache.reduction(scene)?,
                _ => (Reduction::new(scene)?, Origin::Made { not_kept: None }),
            };
            PreparedModel::Reduced { reduction: Box::new(reduction), origin }
        }
        ModelKind::Fea => PreparedModel::Fea,
    })
}

impl Prepared {
    /// Run a scene with these bodies from rest (or precompressed equilibrium) to its duration.
    ///
    /// # Errors
    /// [`ModelError::OtherBodies`] for a scene with other bodies, else as [`super::chain::ChainModel::run`].
    pub fn run(&self, scene: &Scene, progress: Progress<'_>) -> Result<Response, ModelError> {
        self.run_with(scene, scene.drive.motion(scene.amplitude_scale).as_ref(), progress)
    }

    pub fn run_with(
        &self,
        scene: &Scene,
        motion: &dyn PistonMotion,
        progress: Progress<'_>,
    ) -> Result<Response, ModelError> {
        self.refuse(scene)?;
        let response = match &self.model {
            PreparedModel::Chain(fitted) => {
                let still = InitialState::at_rest(scene.chain.beads.len());
                ChainModel.run_with_laws(scene, fitted.as_ref(), motion, &still, progress)?
            }
            PreparedModel::OnDisc(disc) => {
                super::need_drive(scene, "chain")?;
                disc.run(scene, motion, progress)?.counted(scene.is_struck(), |forces| scene.chain.reading(forces))
            }
            PreparedModel::Reduced { reduction, .. } => reduction
                .run_with(&scene.with_striker(), motion, progress)?
                .counted(scene.is_struck(), |forces| scene.chain.reading(forces)),
            PreparedModel::Fea => fea::run(scene, motion, progress)?,
        };
        super::check_energy(&response.energy)?;
        Ok(response)
    }

    fn refuse(&self, scene: &Scene) -> Result<(), ModelError> {
        if let Some(part) = self.bodies.difference(scene) {
            return Err(ModelError::OtherBodies { part });
        }
        scene.refuse_free_end()?;
        scene.refuse_beyond_model()?;
        if scene.model.kind.is_meshed() {
            refuse_losses(scene)?;
        }
        refuse_excess(scene)
    }

    pub fn together(&self) -> usize {
        match &self.model {
            PreparedModel::Reduced { .. } if self.bodies.water.is_none() => reduced::MOST_TOGETHER,
            PreparedModel::Reduced { .. } | PreparedModel::Chain(_) | PreparedModel::OnDisc(_) | PreparedModel::Fea => {
                1
            }
        }
    }

    /// Velocity (m/s) of the last bead where a laser sees it ([`Response::observed_velocity`]) in every scene, the same bits as
    /// [`Prepared::run`] gives. Where a model runs scenes side by side that differ in nothing but drive, α, damping, gaps, precompression and
    /// duration, it does: eight of the reduced model take the time of two to three.
    ///
    /// - `go_on`: asked now and then; what is not finished once it says no is [`ModelError::Stopped`]
    pub fn traces(&self, scenes: &[Scene], go_on: &dyn Fn() -> bool) -> Vec<Result<Series, ModelError>> {
        let mut traces = Vec::with_capacity(scenes.len());
        for together in scenes.chunk_by(reduced::can_run_together) {
            match &self.model {
                PreparedModel::Reduced { reduction, .. }
                    if together.len() >= reduced::FEWEST_TOGETHER
                        && together.iter().all(|scene| self.refuse(scene).is_ok()) =>
                {
                    traces.extend(reduction.traces(together, go_on));
                }
                _ => traces.extend(together.iter().map(|scene| {
                    self.run(scene, &mut |_| go_on()).map(|response| response.observed_velocity().clone())
                })),
            }
        }
        traces
    }

    /// What making them ready took: nothing of what a cache held, nothing of what a run makes itself, such as the bodies of `fea`.
    pub fn work(&self) -> Preparation {
        self.work
    }

    /// Frequencies (Hz) of the elastic modes of a scene's bodies, kind by kind, whether a step can follow them or not; none without reduced bodies.
    pub fn mode_frequencies(&self, scene: &Scene) -> Vec<f64> {
        match &self.model {
            PreparedModel::Reduced { reduction, .. } => reduction.mode_frequencies(scene),
            PreparedModel::Chain(_) | PreparedModel::OnDisc(_) | PreparedModel::Fea => Vec::new(),
        }
    }

    /// Why reduced bodies could not be kept for the next time, if they could not.
    pub fn warning(&self) -> Option<&str> {
        match &self.model {
            PreparedModel::Reduced { origin: Origin::Made { not_kept }, .. } => not_kept.as_deref(),
            PreparedModel::Reduced { .. } | PreparedModel::Chain(_) | PreparedModel::OnDisc(_) | PreparedModel::Fea => {
                None
            }
        }
    }

    /// What a reader of a run's results must know besides: limits of the model that it passed.
    pub fn warnings(&self, scene: &Scene, response: &Response) -> Vec<String> {
        let mut warnings = match &self.model {
            PreparedModel::Reduced { reduction, .. } => reduction.warnings(response),
            PreparedModel::OnDisc(disc) => disc.warnings(scene.drive.frequency, response),
            PreparedModel::Chain(_) | PreparedModel::Fea => Vec::new(),
        };
        if scene.model.kind.is_meshed() {
            warnings.extend(yielding::warning(&yielding::yield_forces(scene), &response.contact_force));
        }
        warnings.extend(scene.coarse_ring());
        warnings.extend(response.energy.warning());
        warnings
    }

    pub fn fits(&self, scene: &Scene) -> bool {
        self.bodies.difference(scene).is_none()
    }

    /// The contact laws fitted to the bodies, where the model is the chain and they are not Hertz' and the paper's: what
    /// [`super::chain::ensemble::Ensemble::with_laws`] takes.
    pub fn contact_laws(&self) -> Option<&FiniteBodyLaws> {
        match &self.model {
            PreparedModel::Chain(fitted) => fitted.as_ref(),
            PreparedModel::Reduced { .. } | PreparedModel::OnDisc(_) | PreparedModel::Fea => None,
        }
    }
}

/// What bodies are made from: the parts of a scene that may not differ from run to run.
#[derive(Debug, Clone, PartialEq)]
struct Bodies {
    kind: ModelKind,
    contact_law: ContactLaw,
    beads: Vec<Bead>,
    piston: (FlatContact, Option<Material>),
    support: Support,
    water: Option<WaterSettings>,
    /// The clock of a disc, s.
    clock: Option<f64>,
    meshing: Meshing,
    reduced: ReducedSettings,
}

impl Bodies {
    fn of(scene: &Scene) -> Self {
        let mut support = scene.support.clone();
        // Factors on a compliance, which a run applies itself.
        if let Some(own) = support.stiffness_mut() {
            *own = 1.0;
        }
        Self {
            kind: scene.model.kind,
            contact_law: scene.contact_law,
            beads: scene.with_striker().chain.beads.clone(),
            piston: (scene.piston, scene.piston_material.clone()),
            water: scene.water.clone(),
            clock: match scene.model.integrator {
                Integrator::OnDisc { step } if support.disc().is_some() => Some(step),
                _ => None,
            },
            meshing: scene.model.meshing(),
            // A run takes its own step; that of a disc and its water is part of them.
            reduced: match support.disc() {
                Some(_) => scene.model.reduced,
                None => ReducedSettings { step: 0.0, ..scene.model.reduced },
            },
            support,
        }
    }

    fn difference(&self, scene: &Scene) -> Option<&'static str> {
        let other = Self::of(scene);
        [
            (self.kind == other.kind, "model.kind"),
            (self.contact_law == other.contact_law, "contact.law"),
            (self.beads == other.beads, "chain.beads"),
            (self.piston == other.piston, "piston.contact"),
            (self.support == other.support, "support"),
            (self.water == other.water, "water"),
            (self.clock == other.clock, "model.step"),
            (self.meshing == other.meshing, "model.mesh_density"),
            (self.kind != ModelKind::Reduced || self.reduced == other.reduced, "model.modes"),
        ]
        .into_iter()
        .find_map(|(is_same, part)| (!is_same).then_some(part))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    #[test]
    fn a_scene_with_other_bodies_is_refused_by_name() {
        let scene = scene::load("rigid", &["duration=1 us".into()]).unwrap();
        let prepared = prepare(&scene).unwrap();
        let refused = |change: fn(&mut Scene)| {
            let mut other = scene.clone();
            change(&mut other);
            match prepared.run(&other, &mut |_| true) {
                Err(ModelError::OtherBodies { part }) => Some(part),
                Ok(_) => None,
                Err(error) => panic!("{error}"),
            }
        };
        assert_eq!(refused(|other| other.chain.beads[2].radius *= 1.001), Some("chain.beads"));
        assert_eq!(refused(|other| other.piston = FlatContact::HalfSpace), Some("piston.contact"));
        assert_eq!(refused(|other| other.support = Support::Spring { stiffness: 1e6 }), Some("support"));
        assert_eq!(refused(|other| other.model.kind = ModelKind::Fea), Some("model.kind"));
        assert_eq!(refused(|other| other.model.fea.density += 1), Some("model.mesh_density"));
        assert_eq!(refused(|other| other.amplitude_scale = 0.3), None);
        assert_eq!(refused(|other| other.chain.gaps[1] = 1e-9), None);
        assert_eq!(refused(|other| other.damping.coefficients[scene::DampingTerm::Linear] = 0.1), None);
    }
}
