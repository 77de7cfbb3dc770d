//! The proof of the intervals: records made with known truth, fitted as any record.
//!
//! Synthetic records made on the reduced model can be fitted by the whole ladder, or by the chain alone: the second shows what the chain leaves out.

mod levels;
pub(crate) mod product;
mod water;

pub use levels::{LevelOutcome, LevelProof, LevelWidths, level_proof, level_synthetic};
pub use water::{MountFit, water_synthetic};

use std::ops::Range;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use granchain_calibration::{
    fidelity::{Bodies, chain_below},
    fit::{Estimate, Fit, Verdict},
    forward::Uncertainty,
    parameter::{Parameter, ParameterError},
    statement::preferred_of,
    synthetic::{Flaw, Truth, scene_of, synthetic, with_law, with_other_law},
};
use granchain_model::{
    self as model, ModelError,
    response::Response,
    scene::{DampingKind, ModelKind, Scene, Support},
};
use granchain_signal::feature::Measurand;

/// One synthetic record in this many is fitted with both damping laws.
const BOTH_LAWS_EVERY: u64 = 4;

/// What is to be made and fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SyntheticPlan {
    /// Synthetic records whose model is right.
    pub count: u64,
    /// Synthetic records of each kind of wrong model.
    pub wrong: u64,
    /// Runs of the chain's search, a fit.
    pub evaluations: usize,
    pub seed: u64,
    /// What fits: the chain alone, or the chain corrected on the model that made the synthetic records.
    pub fit: FittedBy,
    pub parameters: Vec<String>,
    /// What is drawn into every truth, and by the fit into every run.
    pub uncertainty: Uncertainty,
    /// Damping law of all synthetic records; without one they alternate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<DampingKind>,
}

impl Default for SyntheticPlan {
    /// Eighty right models of α and one damping coefficient, 600 runs a fit.
    fn default() -> Self {
        Self {
            count: 80,
            wrong: 0,
            evaluations: 600,
            seed: 1,
            fit: FittedBy::Chain,
            parameters: ["alpha", "damping"].map(String::from).to_vec(),
            uncertainty: Uncertainty::default(),
            law: None,
        }
    }
}

/// What a synthetic record is fitted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FittedBy {
    /// The search on the chain with Hertz contacts.
    Chain,
    /// The search on the chain with contacts as the synthetic records' bodies have them at rest.
    FiniteBody,
    /// That search, corrected on the model that made the synthetic records.
    Ladder,
}

/// Result of one synthetic record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SyntheticOutcome {
    /// How the truth differs from the fitted model.
    pub flaw: Flaw,
    /// What it was made with; absent when it could not even be made.
    pub truth: Option<Truth>,
    /// The fit, or why there is none.
    pub fit: Result<SyntheticFit, String>,
    /// Which law was named when both were fitted: `Some(None)` is undecided.
    pub named_law: Option<Option<String>>,
    /// Which mount was named when all were fitted: `Some(None)` is undecided.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub named_mount: Option<Option<String>>,
    /// What each mount made of the record, where mounts were fitted.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mounts: Vec<MountFit>,
}

impl SyntheticOutcome {
    fn of(
        flaw: Flaw,
        truth: Option<Truth>,
        fit: Result<SyntheticFit, String>,
        named_law: Option<Option<String>>,
    ) -> Self {
        Self { flaw, truth, fit, named_law, named_mount: None, mounts: vec![] }
    }
}

/// The fit of one synthetic record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SyntheticFit {
    pub estimates: Vec<Estimate>,
    pub verdict: Verdict,
    pub misfit: f64,
    /// Connected parts of the 90 % region.
    pub lobes: usize,
    pub correlation: f64,
    pub failed_runs: usize,
    /// Result of the chain alone, if another model gives the answer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before: Option<Vec<Estimate>>,
}

impl From<&Fit> for SyntheticFit {
    fn from(fit: &Fit) -> Self {
        Self {
            estimates: fit.estimates.clone(),
            verdict: fit.verdict,
            misfit: fit.misfit,
            lobes: fit.lobes.len(),
            correlation: fit.correlation,
            failed_runs: fit.failed(),
            before: fit.below.as_ref().map(|below| below.fit.estimates.clone()),
        }
    }
}

impl SyntheticPlan {
    /// Number of synthetic records in all.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.count + 3 * self.wrong
    }

    /// The parameters of a scene that are fitted.
    fn parameters(&self, scene: &Scene) -> Result<Vec<Parameter>, ParameterError> {
        let named = self.parameters.iter().map(|name| Parameter::named(name, scene));
        Ok(named.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }

    /// The scene of synthetic record `number`; all stand on the annulus where its stiffness is fitted or drawn, for the rigid wall has none.
    fn scene(&self, base: &Scene, number: u64) -> Scene {
        let stiff =
            self.uncertainty.support_stiffness > 0.0 || self.parameters.iter().any(|name| name == "support_stiffness");
        let scene = scene_of(base, if stiff { number & !1 } else { number });
        self.law.map_or_else(|| scene.clone(), |law| with_law(&scene, law))
    }
}

/// Make and fit the synthetic records `part` of the plan's of `base` (six beads, a burst) on the model it asks for, right models first, then the wrong ones.
///
/// `finished` is called after each synthetic record; once `stop` says so no further synthetic record is begun, and the result is `None`.
///
/// # Errors
/// When the bodies of a scene cannot be made ready.
pub fn synthetics(
    base: &Scene,
    plan: &SyntheticPlan,
    part: Range<u64>,
    finished: &(dyn Fn() + Sync),
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Option<Vec<SyntheticOutcome>>, ModelError> {
    let workshop = Workshop::new(base)?;
    let outcomes = part
        .into_par_iter()
        .map(|number| {
            if stop() {
                return None;
            }
            let outcome = outcome(&workshop, base, plan, number);
            finished();
            Some(outcome)
        })
        .collect();
    Ok(outcomes)
}

/// The bodies of both supports, made ready once for all synthetic records.
struct Workshop {
    bodies: [Bodies; 2],
}

impl Workshop {
    fn new(base: &Scene) -> Result<Self, ModelError> {
        let [annulus, rigid] = [0, 1].map(|index| Bodies::new(&scene_of(base, index), None));
        Ok(Self { bodies: [annulus?, rigid?] })
    }

    fn bodies(&self, scene: &Scene) -> &Bodies {
        &self.bodies[usize::from(!matches!(scene.support, Support::Annulus { .. }))]
    }

    /// A flawed truth has bodies of its own.
    fn run(&self, scene: &Scene, flaw: Flaw) -> Result<Response, ModelError> {
        match flaw {
            Flaw::None | Flaw::OtherLaw => self.bodies(scene).prepared.run(scene, &mut |_| true),
            Flaw::SofterSupport | Flaw::MissingBead => model::run(scene, &mut |_| true),
        }
    }
}

fn outcome(workshop: &Workshop, base: &Scene, plan: &SyntheticPlan, number: u64) -> SyntheticOutcome {
    // Wrong models are numbered by themselves, so that they are the same whatever the count of right ones.
    let (flaw, scene, number) = if number < plan.count {
        (Flaw::None, plan.scene(base, number), number)
    } else {
        let wrong = number - plan.count;
        let flaws = [Flaw::SofterSupport, Flaw::OtherLaw, Flaw::MissingBead];
        (flaws[(wrong / plan.wrong) as usize], scene_of(base, 4 * wrong), wrong)
    };
    let parameters = match plan.parameters(&scene) {
        Ok(parameters) => parameters,
        Err(error) => return SyntheticOutcome::of(flaw, None, Err(error.to_string()), None),
    };
    let run = |scene: &Scene| workshop.run(scene, flaw);
    let made = match synthetic(&scene, &parameters, &plan.uncertainty, flaw, number, plan.seed, &run) {
        Ok(made) => made,
        Err(error) => {
            let reason = std::error::Error::source(&error).map_or_else(|| error.to_string(), ToString::to_string);
            return SyntheticOutcome::of(flaw, None, Err(reason), None);
        }
    };
    let fit_to = |scene: &Scene| {
        let seed = plan.seed.wrapping_add(1000 * (number + 1));
        fit_one(workshop, scene, &made.csv, plan, seed)
    };
    let fitted = fit_to(&scene);
    let mut named_law = None;
    // Every fourth synthetic record of each of the four kinds of scene.
    if flaw == Flaw::None
        && plan.law.is_none()
        && (number / 4).is_multiple_of(BOTH_LAWS_EVERY)
        && let Ok(own) = &fitted
    {
        let other_scene = with_other_law(&scene);
        named_law = Some(match &fit_to(&other_scene).ok() {
            Some(other) => {
                let [own_law, other_law] = [&scene, &other_scene].map(|scene| scene.damping.kind.name().to_owned());
                preferred_of(&[(own_law, own), (other_law, other)], &[])
            }
            None => Some(scene.damping.kind.name().to_owned()),
        });
    }
    SyntheticOutcome::of(
        flaw,
        Some(made.truth),
        fitted.as_ref().map(SyntheticFit::from).map_err(Clone::clone),
        named_law,
    )
}

/// Fits a synthetic record through the calls that `calibrate` makes.
fn fit_one(workshop: &Workshop, scene: &Scene, csv: &[u8], plan: &SyntheticPlan, seed: u64) -> Result<Fit, String> {
    let mut fitted_by = match plan.fit {
        FittedBy::FiniteBody => chain_below(scene),
        FittedBy::Chain | FittedBy::Ladder => scene.clone(),
    };
    if plan.fit != FittedBy::Ladder {
        fitted_by.model.kind = ModelKind::Chain;
    }
    product::fit(&plan.definition(Measurand::Velocity, seed), &fitted_by, csv, Some(workshop.bodies(scene)))
}

/// Coverage and widths of one parameter over all synthetic records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterProof {
    pub name: String,
    /// Intervals that hold the truth.
    pub covered: usize,
    pub count: usize,
    /// Binomial standard error of the covered share, √(p(1 − p)/n) at p = 0.9.
    pub binomial_error: f64,
    /// Median width of the interval in ln.
    pub median_width: f64,
    /// Median |ln(median/truth)|.
    pub median_error: f64,
    /// Median ln(median/truth): what does not average out.
    pub median_bias: f64,
}

/// Summary over all synthetic records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SyntheticCoverage {
    /// Each parameter. Intervals count whatever the verdict: one may not hide a miss behind `outside scatter`.
    pub parameters: Vec<ParameterProof>,
    /// Right models that ended outside their scatter: false alarms.
    pub false_alarms: usize,
    /// Right models that ended unconverged.
    pub unconverged: usize,
    pub without_fit: usize,
    /// Synthetic records fitted with both laws.
    pub law_tests: usize,
    /// Of them: the right law named.
    pub right_law: usize,
    pub undecided_law: usize,
    /// Synthetic records fitted on every mount.
    #[serde(default)]
    pub mount_tests: usize,
    /// Of them: the right mount named.
    #[serde(default)]
    pub right_mount: usize,
    #[serde(default)]
    pub undecided_mount: usize,
    /// Wrong models: those that did not end `within scatter`, of how many, by flaw.
    pub unmasked: Vec<(Flaw, usize, usize)>,
}

#[must_use]
pub fn proof(outcomes: &[SyntheticOutcome]) -> SyntheticCoverage {
    let right: Vec<&SyntheticOutcome> = outcomes.iter().filter(|outcome| outcome.flaw == Flaw::None).collect();
    let fitted: Vec<(&Truth, &SyntheticFit)> =
        right.iter().filter_map(|o| Some((o.truth.as_ref()?, o.fit.as_ref().ok()?))).collect();
    let names = fitted.first().map_or(&[][..], |(_, fit)| &fit.estimates[..]).iter().map(|estimate| &estimate.name);
    let parameters = names
        .enumerate()
        .map(|(d, name)| {
            let covered = |(truth, fit): &&(&Truth, &SyntheticFit)| {
                (fit.estimates[d].low..=fit.estimates[d].high).contains(&truth.values[d])
            };
            let count = fitted.len();
            let errors: Vec<f64> =
                fitted.iter().map(|(truth, fit)| (fit.estimates[d].median / truth.values[d]).ln()).collect();
            ParameterProof {
                name: name.clone(),
                covered: fitted.iter().filter(covered).count(),
                count,
                binomial_error: (0.9 * 0.1 / count.max(1) as f64).sqrt(),
                median_width: median(fitted.iter().map(|(_, fit)| (fit.estimates[d].high / fit.estimates[d].low).ln())),
                median_error: median(errors.iter().map(|error| error.abs())),
                median_bias: median(errors.iter().copied()),
            }
        })
        .collect();
    let ended = |verdict| fitted.iter().filter(|(_, fit)| fit.verdict == verdict).count();
    let tested: Vec<(&String, &Option<String>)> =
        right.iter().filter_map(|o| Some((&o.truth.as_ref()?.damping_kind, o.named_law.as_ref()?))).collect();
    let mounts: Vec<(&String, &Option<String>)> =
        right.iter().filter_map(|o| Some((&o.truth.as_ref()?.support, o.named_mount.as_ref()?))).collect();
    let unmasked = [Flaw::SofterSupport, Flaw::OtherLaw, Flaw::MissingBead]
        .into_iter()
        .map(|flaw| {
            let of_kind: Vec<_> = outcomes.iter().filter(|outcome| outcome.flaw == flaw).collect();
            let within = |o: &&&SyntheticOutcome| o.fit.as_ref().is_ok_and(|fit| fit.verdict == Verdict::WithinScatter);
            (flaw, of_kind.len() - of_kind.iter().filter(within).count(), of_kind.len())
        })
        .filter(|(_, _, count)| *count > 0)
        .collect();
    SyntheticCoverage {
        parameters,
        false_alarms: ended(Verdict::OutsideScatter),
        unconverged: ended(Verdict::NotConverged),
        without_fit: right.len() - fitted.len(),
        law_tests: tested.len(),
        right_law: tested.iter().filter(|(law, named)| named.as_ref() == Some(law)).count(),
        undecided_law: tested.iter().filter(|(_, named)| named.is_none()).count(),
        mount_tests: mounts.len(),
        right_mount: mounts.iter().filter(|(mount, named)| named.as_ref() == Some(mount)).count(),
        undecided_mount: mounts.iter().filter(|(_, named)| named.is_none()).count(),
        unmasked,
    }
}

pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n => 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
    }
}
