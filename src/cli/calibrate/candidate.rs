//! What one calibration compares: damping laws and, where the far end is a disc, its mounts.

use super::{companion::Companion, definition::Definition};
use crate::{
    calibration::parameter::Parameter,
    cli::{arguments::usage, experiment::Experiment},
    feature::Measurand,
    scene::{Rim, Scene, Support},
};

/// All mounts.
const MOUNTS: [Rim; 3] = [Rim::Clamped, Rim::Supported, Rim::Free];

/// One damping law on one mount.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The law.
    pub law: String,
    /// The mount, where mounts are compared.
    pub mount: Option<Rim>,
    /// The scene with both.
    pub scene: Scene,
    /// The scenes of the further records, with both.
    pub companions: Vec<Scene>,
    /// What is fitted.
    pub parameters: Vec<Parameter>,
}

impl Candidate {
    /// Its name in files: `linear`, `linear-clamped`.
    pub fn key(&self) -> String {
        match self.mount {
            Some(mount) => format!("{}-{}", self.law, mount.name()),
            None => self.law.clone(),
        }
    }

    /// Its name in messages.
    pub fn name(&self) -> String {
        match self.mount {
            Some(mount) => format!("damping law `{}` with the mount `{}`", self.law, mount.name()),
            None => format!("damping law `{}`", self.law),
        }
    }
}

/// Every law on every mount that is compared; what was taken for granted goes to `assumptions`.
///
/// # Errors
/// A usage error for mounts of a scene without a disc, unknown ones, and ones that cannot be; whatever is wrong with a scene or its parameters.
pub fn candidates(
    definition: &Definition,
    experiment: &Experiment,
    companions: &[Companion],
    scene: &Scene,
    assumptions: &mut Vec<String>,
) -> anyhow::Result<Vec<Candidate>> {
    let mounts = mounts(definition, experiment, scene, assumptions)?;
    let mut candidates = Vec::new();
    for law in definition.laws(scene) {
        for &mount in &mounts {
            let rim = mount.map(|mount| format!("disc.rim={}", mount.name()));
            let more: Vec<String> = std::iter::once(format!("damping.kind={law}")).chain(rim).collect();
            let scene = experiment.scene_with(&more)?;
            let parameters = definition.parameters(&scene)?;
            let others = companions.iter().map(|companion| companion.experiment.scene_with(&more));
            let companions = others.collect::<Result<_, _>>()?;
            candidates.push(Candidate { law: law.clone(), mount, scene, companions, parameters });
        }
    }
    Ok(candidates)
}

fn mounts(
    definition: &Definition,
    experiment: &Experiment,
    scene: &Scene,
    assumptions: &mut Vec<String>,
) -> anyhow::Result<Vec<Option<Rim>>> {
    let Support::Disc { shape, .. } = &scene.support else {
        if definition.mounts.is_empty() {
            return Ok(vec![None]);
        }
        return Err(usage(format!(
            "--mount compares mounts of a disc, and the scene `{}` has none; take --scene water, or set support.kind=disc",
            scene.name
        )));
    };
    let pressed = scene.chain.precompression > 0.0 || definition.fits("precompression");
    let mut mounts = Vec::new();
    for name in &definition.mounts {
        let Some(mount) = MOUNTS.into_iter().find(|mount| mount.name() == name) else {
            return Err(usage(format!("--mount {name}: expected clamped, supported or free")));
        };
        if mount == Rim::Free && pressed {
            return Err(usage(
                "--mount free cannot be: a precompression would push a disc away that nothing holds; leave `free` out, or set \
                 chain.precompression=0 and do not fit it",
            ));
        }
        if !mounts.contains(&Some(mount)) {
            mounts.push(Some(mount));
        }
    }
    if !mounts.is_empty() {
        return Ok(mounts);
    }
    let own = Some(shape.rim);
    if definition.quantity == Measurand::Velocity {
        return Ok(vec![own]);
    }
    if experiment.overrides().iter().any(|set| set.split('=').next().is_some_and(|key| key.trim() == "disc.rim")) {
        assumptions
            .push(format!("mount `{}` alone, as `disc.rim` is set; compare several with --mount", shape.rim.name()));
        return Ok(vec![own]);
    }
    let possible: Vec<Rim> = MOUNTS.into_iter().filter(|mount| *mount != Rim::Free || !pressed).collect();
    let names: Vec<&str> = possible.iter().map(|mount| mount.name()).collect();
    let left_out = if possible.len() < MOUNTS.len() { "; `free` cannot be under a precompression" } else { "" };
    assumptions.push(format!("mounts compared: {}{left_out}; name some with --mount", names.join(", ")));
    Ok(possible.into_iter().map(Some).collect())
}
