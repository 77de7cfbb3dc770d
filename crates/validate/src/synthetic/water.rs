//! Synthetic hydrophone records: three mounts of the disc, each record fitted with every one of them.

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{SyntheticFit, SyntheticOutcome, SyntheticPlan, product};
use granchain_calibration::{
    Plan,
    fit::{Fit, Verdict},
    statement::preferred_of,
    synthetic::{Flaw, synthetic, with_law},
};
use granchain_model::{
    self as model,
    scene::{DampingKind, Integrator, Rim, Scene, Support},
};
use granchain_signal::feature::Measurand;

/// The mounts of synthetic records 0, 1, 2 and so on.
const MOUNTS: [Rim; 3] = [Rim::Clamped, Rim::Supported, Rim::Free];

/// A truth's step, s: half of that a fit has, so that the two are no copies of each other.
const TRUTH_STEP: f64 = 1.25e-8;

/// Fit of one mount to a synthetic record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MountFit {
    pub mount: String,
    /// How its fit ended; absent where there is none.
    pub verdict: Option<Verdict>,
    pub misfit: Option<f64>,
    pub log_evidence: Option<f64>,
}

/// Make and fit the synthetic records `part` of the `plan.count` of `base`, six beads before a disc on water: mounts alternate, damping laws a third as fast.
///
/// `finished` is called after each synthetic record; once `stop` says so no further synthetic record is begun, and the result is `None`.
#[must_use]
pub fn water_synthetic(
    base: &Scene,
    plan: &SyntheticPlan,
    part: Range<u64>,
    finished: &(dyn Fn() + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<SyntheticOutcome>> {
    part.into_par_iter()
        .map(|number| {
            if stop() {
                return None;
            }
            let outcome = outcome(base, plan, number);
            finished();
            Some(outcome)
        })
        .collect()
}

/// The scene on a mount.
fn mounted(scene: &Scene, mount: Rim) -> Scene {
    let mut scene = scene.clone();
    if let Support::Disc { shape, .. } = &mut scene.support {
        shape.rim = mount;
    }
    scene
}

fn outcome(base: &Scene, plan: &SyntheticPlan, number: u64) -> SyntheticOutcome {
    let own = MOUNTS[(number % 3) as usize];
    let kind = if (number / 3).is_multiple_of(2) { DampingKind::Linear } else { DampingKind::KuwabaraKono };
    let scene = mounted(&with_law(base, kind), own);
    let without = |reason: String| SyntheticOutcome {
        flaw: Flaw::None,
        truth: None,
        fit: Err(reason),
        named_law: None,
        named_mount: None,
        mounts: vec![],
    };
    let parameters = match plan.parameters(&scene) {
        Ok(parameters) => parameters,
        Err(error) => return without(error.to_string()),
    };
    let run = |scene: &Scene| {
        let mut scene = scene.clone();
        scene.model.integrator = Integrator::OnDisc { step: TRUTH_STEP };
        scene.output_step = 2.0 * TRUTH_STEP;
        model::run(&scene, &mut |_| true)
    };
    let made = match synthetic(&scene, &parameters, &plan.uncertainty, Flaw::None, number, plan.seed, &run) {
        Ok(made) => made,
        Err(error) => {
            return without(std::error::Error::source(&error).map_or_else(|| error.to_string(), ToString::to_string));
        }
    };
    let seed = plan.seed.wrapping_add(1000 * (number + 1));
    // Mount by mount, so that one without an answer leaves the others theirs.
    let definition =
        |mount: Rim| Plan { mount: Some(vec![mount.name().into()]), ..plan.definition(Measurand::Pressure, seed) };
    let fits: Vec<(Rim, Result<Fit, String>)> = MOUNTS
        .into_iter()
        .map(|mount| (mount, product::fit(&definition(mount), &mounted(&scene, mount), &made.csv, None)))
        .collect();
    let fitted: Vec<(String, &Fit)> =
        fits.iter().filter_map(|(mount, fit)| Some((mount.name().to_owned(), fit.as_ref().ok()?))).collect();
    let excluded: Vec<String> =
        fits.iter().filter(|(_, fit)| fit.is_err()).map(|(mount, _)| mount.name().to_owned()).collect();
    let mounts = fits.iter().map(|(mount, fit)| {
        let fit = fit.as_ref().ok();
        MountFit {
            mount: mount.name().into(),
            verdict: fit.map(|fit| fit.verdict),
            misfit: fit.map(|fit| fit.misfit),
            log_evidence: fit.map(|fit| fit.log_evidence),
        }
    });
    let at_truth = fits.iter().find(|(mount, _)| *mount == own).map(|(_, fit)| fit);
    SyntheticOutcome {
        flaw: Flaw::None,
        truth: Some(made.truth),
        fit: match at_truth {
            Some(fit) => fit.as_ref().map(SyntheticFit::from).map_err(Clone::clone),
            None => Err("the synthetic record's mount was not fitted".into()),
        },
        named_law: None,
        named_mount: Some(preferred_of(&fitted, &excluded)),
        mounts: mounts.collect(),
    }
}
