//! What a run will take, from its scene alone, and whether that is too much.

use super::ModelError;
use crate::scene::{Limits, ModelKind, Scene};

/// Unknowns of a meshed body over the square of the mesh density: 10,700 at 12, 168,000 at 48.
const UNKNOWNS_A_SQUARE: f64 = 73.0;
/// Memory of a meshed body with its factor, bytes an unknown: 585 MB at a density of 48, six beads stepped.
const BYTES_AN_UNKNOWN: f64 = 3600.0;
/// What disc and water count for in every step, in unknowns: their modes, kernels and points.
const UNKNOWNS_OF_DISC: f64 = 1000.0;
/// Series of a response a bead: displacement, velocity, force.
const SERIES: f64 = 3.0;
const NUMBER: f64 = 8.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    pub work: f64,
    /// Largest memory, bytes.
    pub memory: f64,
}

impl Estimate {
    /// Of one run of a scene: work = unknowns × `duration` / step; memory of the samples kept, and of meshed bodies with their factors.
    ///
    /// - unknowns: one a bead of the chain; the modes and 2 of a bead of the reduced model; 73 n² of a body of mesh density n of `fea`;
    ///   1000 of a disc and its water
    /// - the adaptive integrator of the chain chooses its steps: one an output sample is counted here, and how many its contacts need when they are
    ///   known
    ///
    /// ```
    /// use granchain_model::{Estimate, scene};
    ///
    /// let fine = scene::load("rigid", &["model.kind=fea".into(), "model.step=1e-15".into()])?;
    /// assert!(Estimate::of(&fine).check(&fine.model.limits).is_err());
    /// assert!(Estimate::of(&fine).check(&scene::Limits::NONE).is_ok());
    /// # Ok::<(), granchain_model::scene::SceneError>(())
    /// ```
    pub fn of(scene: &Scene) -> Self {
        let model = &scene.model;
        let (beads, samples) = (scene.chain.beads.len() as f64, scene.duration / scene.output_step);
        let meshed = UNKNOWNS_A_SQUARE * f64::from(model.meshing().density).powi(2);
        let unknowns = match model.kind {
            ModelKind::Chain => beads,
            ModelKind::Reduced => beads * f64::from(2 + model.reduced.modes),
            ModelKind::Fea => beads * meshed,
        };
        let step = model.step().unwrap_or(scene.output_step);
        let disc = if scene.support.disc().is_some() { UNKNOWNS_OF_DISC } else { 0.0 };
        let bodies = if model.kind.is_meshed() { kinds(scene) * meshed * BYTES_AN_UNKNOWN } else { 0.0 };
        Self {
            work: (unknowns + disc) * scene.duration / step,
            memory: samples * (SERIES * beads + 3.0) * NUMBER + bodies,
        }
    }

    pub fn of_bodies(scene: &Scene) -> Self {
        Self { work: 0.0, ..Self::of(scene) }
    }

    /// Of `runs` runs one after another, of which `kept` bytes each are kept.
    #[must_use]
    pub fn times(self, runs: f64, kept: f64) -> Self {
        Self { work: runs * self.work, memory: self.memory + runs * kept }
    }

    pub fn check(&self, limits: &Limits) -> Result<(), ModelError> {
        let Self { work, memory } = *self;
        if work > limits.work {
            return Err(ModelError::TooMuchWork { work, limit: limits.work });
        }
        if memory > limits.memory {
            return Err(ModelError::TooMuchMemory { memory, limit: limits.memory });
        }
        Ok(())
    }
}

pub(super) fn refuse_excess(scene: &Scene) -> Result<(), ModelError> {
    Estimate::of(scene).check(&scene.model.limits)
}

fn kinds(scene: &Scene) -> f64 {
    let beads = &scene.chain.beads;
    let different = beads.iter().enumerate().filter(|(i, bead)| !beads[..*i].contains(bead)).count();
    (different + usize::from(scene.support.is_meshed())) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        self as model,
        scene::{self, BUILT_IN},
    };

    fn scene(name: &str, kind: &str, more: &[&str]) -> Scene {
        let kind = format!("model.kind={kind}");
        let sets: Vec<String> = std::iter::once(kind.as_str()).chain(more.iter().copied()).map(String::from).collect();
        scene::load(name, &sets).unwrap()
    }

    #[test]
    fn shipped_scenes_lie_far_below_the_limits_and_their_unknowns_are_as_estimated() {
        for built_in in BUILT_IN {
            for kind in ["chain", "reduced", "fea"] {
                let scene = scene(built_in.name, kind, &[]);
                if scene.beyond_model().is_some() {
                    continue;
                }
                let (found, most) = (Estimate::of(&scene), Limits::default());
                let name = built_in.name;
                assert!(
                    50.0 * found.work < most.work && 10.0 * found.memory < most.memory,
                    "{name}, {kind}: {found:?}"
                );
            }
        }
        let scene = scene("rigid", "fea", &["model.mesh_density=4", "duration=1us"]);
        let unknowns = model::run(&scene, &mut |_| true).unwrap().work.unknowns as f64;
        let estimated = Estimate::of(&scene).work / (scene.duration / scene.model.fea.step);
        assert!((0.5..2.0).contains(&(estimated / unknowns)), "{estimated} {unknowns}");
    }

    #[test]
    fn absurd_runs_are_refused_before_they_begin_unless_the_limits_are_lifted() {
        let damped = |kind: &'static str, coefficient: &'static str| scene("rigid", "chain", &[kind, coefficient]);
        let (work, memory, stiff) = ("unknowns × steps", "GiB", "times as fast as the contact");
        let cases = [
            (scene("rigid", "fea", &["model.step=1e-15"]), work),
            (scene("rigid", "reduced", &["model.step=1e-15"]), work),
            (scene("water", "chain", &["model.step=1e-12"]), work),
            (scene("rigid", "chain", &["chain.beads=1000", "duration=1s"]), memory),
            (scene("annulus", "reduced", &["model.mesh_density=128", "chain.beads=1000", "duration=20ms"]), memory),
            (damped("damping.kind=linear", "damping.coefficient=1e6"), stiff),
            (damped("damping.kind=linear", "damping.coefficient=1e15"), stiff),
            (damped("damping.kind=kuwabara-kono", "damping.coefficient=1e10"), stiff),
        ];
        for (scene, expected) in cases {
            let error = model::run(&scene, &mut |_| panic!("it runs")).unwrap_err().to_string();
            assert!(error.contains(expected) && error.contains("--no-limits"), "{expected}: {error}");
            // Stopped at its first report, so it was begun.
            let lifted = scene.with_limits(Limits::NONE);
            if expected == stiff {
                let stopped = model::run(&lifted, &mut |_| false).unwrap_err();
                assert!(matches!(stopped, ModelError::Stopped { .. }), "{stopped}");
            }
            assert_eq!(refuse_excess(&lifted), Ok(()));
        }
        // A material that no scene file may have.
        let mut hard = scene("rigid", "chain", &[]);
        hard.chain.beads.iter_mut().for_each(|bead| bead.material.youngs_modulus = 1e31);
        let error = model::run(&hard, &mut |_| panic!("it runs")).unwrap_err();
        assert!(matches!(error, ModelError::TooMuchWork { .. }), "{error}");
    }
}
