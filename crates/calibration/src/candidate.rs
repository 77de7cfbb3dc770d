//! Candidates that one calibration compares: damping laws and, with a disc, its mounts.

use super::{
    bench::Bench,
    parameter::Parameter,
    plan::Plan,
    refusal::{Contradiction, Refusal},
};
use granchain_model::scene::{DampingKind, Rim, Scene, Support};
use granchain_signal::feature::Measurand;

const MOUNTS: [Rim; 3] = [Rim::Clamped, Rim::Supported, Rim::Free];

/// One damping law with one mount.
#[derive(Debug, Clone)]
pub struct Candidate {
    pub law: String,
    /// The mount, if mounts are compared.
    pub mount: Option<Rim>,
    /// The scene of every record, with this law and mount.
    pub scenes: Vec<Scene>,
    pub parameters: Vec<Parameter>,
}

impl Candidate {
    /// Its name in files: `linear`, `linear-clamped`.
    pub(crate) fn key(&self) -> String {
        match self.mount {
            Some(mount) => format!("{}-{}", self.law, mount.name()),
            None => self.law.clone(),
        }
    }

    pub fn name(&self) -> String {
        match self.mount {
            Some(mount) => format!("damping law `{}` with the mount `{}`", self.law, mount.name()),
            None => format!("damping law `{}`", self.law),
        }
    }

    /// The scene of the first record, used above the chain.
    pub fn scene(&self) -> &Scene {
        &self.scenes[0]
    }
}

/// Every law with every mount, on the bench of every record; assumptions are added to `assumptions`.
pub(crate) fn candidates(
    plan: &Plan,
    benches: &[&Bench],
    assumptions: &mut Vec<String>,
) -> Result<Vec<Candidate>, Refusal> {
    let Some(lead) = benches.first() else { return Err(Contradiction::NoRecord.into()) };
    let scene = lead.scene_with(&[])?;
    let mounts = mounts(plan, lead, &scene, assumptions)?;
    let mut candidates: Vec<Candidate> = Vec::new();
    let named = plan.damping.clone().filter(|laws| !laws.is_empty());
    for law in named.unwrap_or_else(|| vec![scene.damping.kind.name().into()]) {
        if DampingKind::named(&law).is_none() {
            return Err(Contradiction::Damping { name: law }.into());
        }
        if candidates.iter().any(|candidate| candidate.law == law) {
            continue;
        }
        for &mount in &mounts {
            let rim = mount.map(|mount| format!("disc.rim={}", mount.name()));
            let more: Vec<String> = std::iter::once(format!("damping.kind={law}")).chain(rim).collect();
            let scenes: Vec<Scene> = benches.iter().map(|bench| bench.scene_with(&more)).collect::<Result<_, _>>()?;
            let parameters = parameters(plan, &scenes[0])?;
            candidates.push(Candidate { law: law.clone(), mount, scenes, parameters });
        }
    }
    Ok(candidates)
}

fn mounts(
    plan: &Plan,
    bench: &Bench,
    scene: &Scene,
    assumptions: &mut Vec<String>,
) -> Result<Vec<Option<Rim>>, Contradiction> {
    let requested = plan.mount.as_deref().unwrap_or_default();
    let Support::Disc { shape, .. } = &scene.support else {
        return if requested.is_empty() {
            Ok(vec![None])
        } else {
            Err(Contradiction::NoDisc { scene: scene.name.clone() })
        };
    };
    let pressed = scene.chain.precompression > 0.0 || plan.fitted().iter().any(|name| name == "precompression");
    let mut mounts = Vec::new();
    for name in requested {
        let Some(mount) = MOUNTS.into_iter().find(|mount| mount.name() == name) else {
            return Err(Contradiction::Mount { name: name.clone() });
        };
        if mount == Rim::Free && pressed {
            return Err(Contradiction::PressedFree);
        }
        if !mounts.contains(&Some(mount)) {
            mounts.push(Some(mount));
        }
    }
    if !mounts.is_empty() {
        return Ok(mounts);
    }
    let own = Some(shape.rim);
    if plan.quantity.unwrap_or_default() == Measurand::Velocity {
        return Ok(vec![own]);
    }
    if bench.sets("disc.rim") {
        assumptions.push(format!(
            "mount `{}` alone, as `disc.rim` is set; compare several with `mount` of a plan",
            shape.rim.name()
        ));
        return Ok(vec![own]);
    }
    let possible: Vec<Rim> = MOUNTS.into_iter().filter(|mount| *mount != Rim::Free || !pressed).collect();
    let names: Vec<&str> = possible.iter().map(|mount| mount.name()).collect();
    let left_out = if possible.len() < MOUNTS.len() { "; `free` cannot be under a precompression" } else { "" };
    assumptions.push(format!("mounts compared: {}{left_out}; name some with `mount` of a plan", names.join(", ")));
    Ok(possible.into_iter().map(Some).collect())
}

/// The parameters of a scene that are fitted, with their bounds.
pub fn parameters(plan: &Plan, scene: &Scene) -> Result<Vec<Parameter>, Refusal> {
    let mut parameters = Vec::new();
    for name in plan.fitted() {
        parameters.extend(Parameter::named(&name, scene)?);
    }
    for parameter in &mut parameters {
        let Some(bounds) = plan.parameters.get(&parameter.name) else { continue };
        let (name, unit) = (parameter.name.clone(), &parameter.unit);
        let not_si = |which: &str| {
            let (what, name) = (format!("[parameters.{name}] {which}"), name.clone());
            move |source| Refusal::NotSi { what, name, source }
        };
        let low = bounds.low.in_si(unit).map_err(not_si("low"))?;
        let high = bounds.high.in_si(unit).map_err(not_si("high"))?;
        if !(low > 0.0 && low < high && high.is_finite()) {
            return Err(Refusal::Bounds { name, low, high });
        }
        *parameter = parameter.clone().between(low, high);
    }
    Ok(parameters)
}
