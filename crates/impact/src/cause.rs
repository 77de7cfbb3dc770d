//! Likely causes where the model does not explain the hits: each is assumed in turn and fitted.

use std::cmp::Ordering;

use granchain_model::scene::{DampingKind, Material, Plate, Scene, Sensor, Support};
use granchain_signal::number::significant;

use granchain_calibration::agreement::DOUBTFUL;
use serde::{Deserialize, Serialize};

use crate::{Experiment, ImpactFit, Parameter, hit::INCIDENT_WIDTH, outcome::shown};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// Modulus or loss of the foundation.
    Support,
    /// A plate on the foundation.
    Plate,
    /// Velocity of the striker.
    Velocity,
    /// Losses in the contacts of the beads.
    ContactLoss,
    Beads,
    /// What the force sensor in a bead reads.
    Sensor,
    /// The time between the samples.
    Clock,
}

/// A cause under which the model explains the hits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    pub cause: Cause,
    pub p_value: f64,
    /// What differs, and what is fitted then.
    pub text: String,
    /// Whether the hits cannot distinguish it from the most likely cause.
    pub equivalent: bool,
}

/// Runs of a fit for one cause.
const RUNS: usize = 240;

/// Share of the best cause's p above which another explains the hits as well.
const AS_WELL: f64 = 0.3;

const NAMED: usize = 4;

/// Factor on the range of a modulus or velocity that is tried.
const ANY_MODULUS: f64 = 16.0;
const ANY_VELOCITY: f64 = 2.5;

/// Standard deviations by which the incident impulse is too wide or too narrow where the clock is suspected.
const SUSPECT: f64 = 2.0;

/// Readings of a sensor that are tried, as shares of the contact before its bead, and how far from the stated one they are at least.
const READINGS: [(f64, &str); 3] = [
    (0.5, "the sensor reads the mean of both contacts of its bead (chain.sensor_share = 0.5)"),
    (0.0, "the sensor reads the contact behind its bead (chain.sensor_share = 0)"),
    (1.0, "the sensor reads the contact before its bead (chain.sensor_share = 1)"),
];
const OTHER_READING: f64 = 0.25;

/// A bench on which a cause holds: what differs, in words, and what is fitted besides.
struct Assumed {
    cause: Cause,
    what: String,
    experiment: Experiment,
    further: Vec<Parameter>,
}

impl Experiment {
    /// The causes that explain the hits that a fit does not, most likely first; a cause on which no fit can be made is none.
    pub fn causes(&self, unexplained: &ImpactFit) -> Vec<Finding> {
        let mut found = Vec::new();
        for assumed in self.assumed().into_iter().chain(self.other_clock(unexplained)) {
            let Assumed { cause, what, experiment, further } = assumed;
            let names: Vec<String> = further.iter().map(|parameter| parameter.name.clone()).collect();
            let own = self.parameters.iter().filter(|parameter| !names.contains(&parameter.name)).cloned();
            let parameters = own.chain(further).collect();
            let experiment = Self { parameters, evaluations: RUNS, ..experiment };
            let Ok(fit) = experiment.fit() else { continue };
            let is_law_valid = cause != Cause::Plate || fit.has_thin_plate(&experiment.scene);
            if fit.p_value >= DOUBTFUL && is_law_valid {
                found.push(Finding { cause, p_value: fit.p_value, text: text(&what, &names, &fit), equivalent: false });
            }
        }
        // Of causes that explain the hits about equally well the first assumed comes first.
        let best = found.iter().map(|finding| finding.p_value).fold(0.0, f64::max);
        let as_well = |finding: &Finding| finding.p_value >= AS_WELL * best;
        found.sort_by(|a, b| if as_well(a) && as_well(b) { Ordering::Equal } else { b.p_value.total_cmp(&a.p_value) });
        found.iter_mut().skip(1).for_each(|finding| finding.equivalent = as_well(finding));
        found.truncate(NAMED);
        found
    }

    fn assumed(&self) -> Vec<Assumed> {
        let scene = &self.scene;
        let fitted = |name: &str| self.parameters.iter().any(|parameter| parameter.name == name);
        let named = |name: &str, scene: &Scene| Parameter::named(name, scene).map(|mut found| found.remove(0)).ok();
        let modulus = named("support_modulus", scene).zip(scene.support.stiffness());
        let modulus = modulus.map(|(parameter, own)| parameter.between(own / ANY_MODULUS, own * ANY_MODULUS));
        let loss = named("support_loss", scene);
        let mut assumed = Vec::new();
        let mut add = |cause, what: &str, scene: Scene, further: Vec<Option<Parameter>>| {
            if let Some(further) = further.into_iter().collect::<Option<Vec<_>>>() {
                assumed.push(Assumed { cause, what: what.into(), experiment: Self { scene, ..self.clone() }, further });
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
            let thickness = || Some(Parameter::plate());
            add(Cause::Plate, "a plate lies between the last bead and the support", plated.clone(), vec![thickness()]);
            if !has_loss {
                let what = "a plate lies between the last bead and the support, which loses energy";
                add(Cause::Plate, what, plated, vec![thickness(), loss]);
            }
        }
        if !fitted("alpha") {
            let own = scene.amplitude_scale;
            let alpha = named("alpha", scene).map(|alpha| alpha.between(own / ANY_VELOCITY, own * ANY_VELOCITY));
            add(Cause::Velocity, "the striker is faster or slower (alpha, a factor)", scene.clone(), vec![alpha]);
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
        for (share, what) in READINGS {
            let mut read = scene.clone();
            let stated = read.chain.sensor.as_mut().filter(|stated| (stated.share - share).abs() > OTHER_READING);
            if let Some(sensor) = stated {
                *sensor = Sensor { share, ..*sensor };
                add(Cause::Sensor, what, read, vec![]);
            }
        }
        assumed
    }

    /// The clock that gives the incident impulse the width that the beads give it.
    fn other_clock(&self, fit: &ImpactFit) -> Option<Assumed> {
        let measured = self.features().iter().map(|hit| hit[INCIDENT_WIDTH]).sum::<f64>() / self.hits.len() as f64;
        let factor = (fit.expected[INCIDENT_WIDTH] - measured).exp();
        let experiment = self.with_clock(factor).ok().filter(|_| fit.deviations[INCIDENT_WIDTH].abs() > SUSPECT)?;
        let deviation = ((factor.ln()) / fit.deviations[INCIDENT_WIDTH]).abs();
        let what = format!(
            "the clock of the records is wrong: by the width of the incident impulse their samples are {} times the stated interval apart (±{} %)",
            significant(factor, 3),
            significant(100.0 * deviation, 1)
        );
        Some(Assumed { cause: Cause::Clock, what, experiment, further: Vec::new() })
    }
}

impl ImpactFit {
    /// Whether the law of a plate on the foundation, if there is one, holds at the answer: it is thinner than its length scale.
    fn has_thin_plate(&self, scene: &Scene) -> bool {
        let mut scene = scene.clone();
        self.parameters
            .iter()
            .zip(&self.estimates)
            .for_each(|(parameter, found)| parameter.set(&mut scene, found.value));
        scene.support.is_plate_thin()
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
    chain.sensor.filter(|sensor| sensor.bead < chain.beads.len())?;
    Some(scene)
}

fn text(what: &str, names: &[String], fit: &ImpactFit) -> String {
    let of = |name: &String| {
        let found = fit.estimates.iter().find(|estimate| estimate.name == *name)?;
        let shown = |value: f64| shown(value, &found.unit);
        Some(format!("{name} {} ({} to {})", shown(found.median), shown(found.low), shown(found.high)))
    };
    let values: Vec<String> = names.iter().filter_map(of).collect();
    let values = if values.is_empty() { String::new() } else { format!(": {}", values.join(", ")) };
    format!("{what}{values}")
}
