//! Likely causes where the model does not explain the hits: each is assumed in turn and fitted.

use std::cmp::Ordering;

use granchain_model::scene::{DampingKind, Material, Plate, Scene, Support};
use granchain_signal::number::{engineering, significant};

use super::{Experiment, ImpactError, ImpactFit};
use crate::{
    agreement::DOUBTFUL,
    diagnosis::{Cause, Finding},
    parameter::Parameter,
};

/// Runs of a fit for one cause.
const RUNS: usize = 240;

/// Share of the best cause's p above which another explains the hits as well.
const AS_WELL: f64 = 0.3;

const NAMED: usize = 4;

/// Factor on the range of a modulus or velocity that is tried.
const ANY_MODULUS: f64 = 16.0;
const ANY_VELOCITY: f64 = 2.5;

/// A bench on which a cause holds: what differs, in words, and what is fitted besides.
struct Assumed {
    cause: Cause,
    what: &'static str,
    scene: Scene,
    further: Vec<Parameter>,
}

impl Experiment {
    /// The causes that explain the hits, most likely first.
    ///
    /// # Errors
    /// When stopped; a cause on which no fit can be made is none.
    pub fn causes(&self, stop: &(dyn Fn() -> bool + Sync)) -> Result<Vec<Finding>, ImpactError> {
        let mut found = Vec::new();
        for assumed in self.assumed() {
            let Assumed { cause, what, scene, further } = assumed;
            let names: Vec<String> = further.iter().map(|parameter| parameter.name.clone()).collect();
            let own = self.parameters.iter().filter(|parameter| !names.contains(&parameter.name)).cloned();
            let parameters = own.chain(further).collect();
            let experiment = Self { scene, parameters, evaluations: RUNS, ..self.clone() };
            let fit = match experiment.fit(stop) {
                Ok(fit) => fit,
                Err(ImpactError::Stopped) => return Err(ImpactError::Stopped),
                Err(_) => continue,
            };
            if fit.p_value >= DOUBTFUL {
                found.push((fit.p_value, Finding::new(cause, Some(fit.p_value), text(what, &names, &fit))));
            }
        }
        // Of causes that explain the hits about equally well the first assumed comes first.
        let best = found.iter().map(|(p, _)| *p).fold(0.0, f64::max);
        let as_well = |p: f64| p >= AS_WELL * best;
        found.sort_by(|(a, _), (b, _)| if as_well(*a) && as_well(*b) { Ordering::Equal } else { b.total_cmp(a) });
        found.iter_mut().skip(1).for_each(|(p, finding)| finding.equivalent = as_well(*p));
        Ok(found.into_iter().map(|(_, finding)| finding).take(NAMED).collect())
    }

    fn assumed(&self) -> Vec<Assumed> {
        let scene = &self.scene;
        let fitted = |name: &str| self.parameters.iter().any(|parameter| parameter.name == name);
        let named = |name: &str, scene: &Scene| Parameter::named(name, scene).map(|mut found| found.remove(0)).ok();
        let modulus = named("support_modulus", scene).zip(scene.support.stiffness());
        let modulus = modulus.map(|(parameter, own)| parameter.between(own / ANY_MODULUS, own * ANY_MODULUS));
        let loss = named("support_loss", scene);
        let mut assumed = Vec::new();
        let mut add = |cause, what, scene: Scene, further: Vec<Option<Parameter>>| {
            if let Some(further) = further.into_iter().collect::<Option<Vec<_>>>() {
                assumed.push(Assumed { cause, what, scene, further });
            }
        };
        let (has_modulus, has_loss) = (fitted("support_modulus"), fitted("support_loss"));
        if !has_modulus {
            add(Cause::Support, "the support has another modulus", scene.clone(), vec![modulus.clone()]);
        }
        if !has_loss {
            add(Cause::Support, "the support loses energy", scene.clone(), vec![loss.clone()]);
        }
        if !has_modulus && !has_loss {
            add(
                Cause::Support,
                "the support has another modulus and loses energy",
                scene.clone(),
                vec![modulus, loss.clone()],
            );
        }
        if let Some(plated) = with_plate(scene) {
            let thickness = || Parameter::plate(&plated);
            add(Cause::Plate, "a plate lies between the last bead and the support", plated.clone(), vec![thickness()]);
            if !has_loss {
                let what = "a plate lies between the last bead and the support, which loses energy";
                add(Cause::Plate, what, plated.clone(), vec![thickness(), loss]);
            }
        }
        if !fitted("alpha") {
            let alpha =
                Parameter::alpha().between(scene.amplitude_scale / ANY_VELOCITY, scene.amplitude_scale * ANY_VELOCITY);
            add(Cause::Velocity, "the striker is faster or slower (alpha, a factor)", scene.clone(), vec![Some(alpha)]);
        }
        if scene.damping.kind == DampingKind::None {
            let mut lossy = scene.clone();
            lossy.damping.kind = DampingKind::KuwabaraKono;
            let damping = named("damping", &lossy);
            add(Cause::ContactLoss, "the contacts of the beads lose energy (Kuwabara-Kono)", lossy, vec![damping]);
        }
        let beads = [(false, "one bead fewer stands on the support"), (true, "one bead more stands on the support")];
        for (more, what) in beads {
            let changed = with_beads(scene, more);
            changed.into_iter().for_each(|scene| add(Cause::Beads, what, scene, vec![]));
        }
        assumed
    }
}

/// A plate of resin on the foundation, if there is none.
fn with_plate(scene: &Scene) -> Option<Scene> {
    let mut scene = scene.clone();
    let Support::Foundation { plate: plate @ None, .. } = &mut scene.support else { return None };
    *plate = Some(Plate { thickness: 1e-3, material: Material::resin() });
    Some(scene)
}

/// One bead more or fewer next to the support.
fn with_beads(scene: &Scene, more: bool) -> Option<Scene> {
    let mut scene = scene.clone();
    let chain = &mut scene.chain;
    if more {
        chain.beads.push(chain.beads.last()?.clone());
        chain.gaps.push(0.0);
    } else {
        chain.beads.pop()?;
        chain.gaps.pop()?;
    }
    chain.sensor.filter(|sensor| *sensor < chain.beads.len())?;
    Some(scene)
}

fn text(what: &str, names: &[String], fit: &ImpactFit) -> String {
    let of = |name: &String| {
        let found = fit.estimates.iter().find(|estimate| estimate.name == *name)?;
        let unit = &found.unit;
        let shown = |value: f64| if unit == "1" { significant(value, 3) } else { engineering(value, unit, 3) };
        Some(format!("{name} {} ({} to {})", shown(found.median), shown(found.low), shown(found.high)))
    };
    let values: Vec<String> = names.iter().filter_map(of).collect();
    let values = if values.is_empty() { String::new() } else { format!(": {}", values.join(", ")) };
    format!("{what}{values}")
}
