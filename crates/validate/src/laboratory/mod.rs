//! The proof of the product on records as laboratories store them: files are written, read, fitted and judged by the calls that `calibrate` makes.
//!
//! ```text
//! Setting ─ truth ─► Files ─ reader, Bench ─► Problem ─ fit ─► verdict, intervals, diagnosis ─► LaboratoryCount
//! ```
//!
//! The truth comes from a path that no fit shares: an analytic drive instead of a record, the chain's adaptive integrator with located events
//! instead of a fixed step; above the chain a mesh and a step that are finer than the fit's, and than the ones by which a fit measures its own error.

mod condition;
mod count;
mod instrument;
pub(crate) mod record;

pub use condition::{Condition, Expected, Setting};
pub use count::{LaboratoryCount, ParameterCount, Tally, WrongTally};
pub use granchain_calibration::design::NAMES;
pub use instrument::{CausalFilter, Laboratory};
pub use record::{Files, Regime};

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    ops::Range,
    path::Path,
    sync::Arc,
};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use granchain_calibration::predict::predicted::with_causes;
use granchain_calibration::{
    Plan, Problem, Schedule,
    bench::Bench,
    design::FINER,
    diagnosis::Finding,
    drive::RecordedDrive,
    fidelity::Bodies,
    fit::{Estimate, Verdict},
    plan::{Likelihood, Number},
    recorded_run::{RecordedRunPlan, Source},
    refusal::Refusal,
};
use granchain_model::{
    self as model, ModelError, Prepared,
    scene::{self, ModelKind, Scene},
};
use granchain_record::ReadOptions;

/// The scene of every bench.
const SCENE: &str = "annulus";

/// What is to be made and fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaboratoryPlan {
    pub conditions: Vec<Condition>,
    pub count: u64,
    pub seed: u64,
    /// Runs of the chain's search, a fit.
    pub evaluations: usize,
    /// Model that answers, and makes the synthetic records: `chain` or `reduced`.
    pub model: String,
    /// What of a record is compared.
    #[serde(default)]
    pub likelihood: Likelihood,
    /// Mesh density of the fit's bodies, where it is not the model's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh_density: Option<u32>,
}

/// Result of one synthetic record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaboratoryRecord {
    /// What it was made with.
    pub setting: Setting,
    /// How its truth moves; absent where it could not be made.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub regime: Option<Regime>,
    /// The fit, or the refusal.
    pub fit: Result<LaboratoryFit, String>,
}

/// Messages that a user would have seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaboratoryFit {
    pub verdict: Verdict,
    /// Share of right records that are as far from the model.
    pub p_value: f64,
    pub misfit: f64,
    pub estimates: Vec<Estimate>,
    /// Whether their intervals are given out.
    pub quoted: bool,
    /// What stands beside the verdict.
    pub warnings: Vec<String>,
    /// What would explain a wrong record.
    pub diagnosis: Vec<Finding>,
}

impl LaboratoryPlan {
    #[must_use]
    pub fn total(&self) -> usize {
        self.conditions.len() * self.count as usize
    }
}

/// Make and fit the synthetic records `part`.
///
/// `finished` is given each with its files; once `stop` says so the fits in hand end, and the result is `None`.
///
/// # Errors
/// When the bodies of a bench cannot be made ready.
pub fn laboratory(
    plan: &LaboratoryPlan,
    part: Range<usize>,
    finished: &(dyn Fn(&LaboratoryRecord, Option<&Files>) + Sync),
    stop: &'static (dyn Fn() -> bool + Sync),
) -> Result<Option<Vec<LaboratoryRecord>>, ModelError> {
    let all: Vec<(Condition, u64)> =
        plan.conditions.iter().flat_map(|condition| (0..plan.count).map(|number| (*condition, number))).collect();
    let all = all[part].to_vec();
    let workshop = Workshop::of(plan, &all)?;
    let synthetics = all
        .into_par_iter()
        .map(|(condition, number)| {
            if stop() {
                return None;
            }
            let (synthetic, files) = synthetic(plan, &workshop, (condition, number), stop);
            // A fit that was stopped in hand is none.
            if stop() {
                return None;
            }
            finished(&synthetic, files.as_ref());
            Some(synthetic)
        })
        .collect();
    Ok(synthetics)
}

/// Bodies of the benches that several synthetic records share, made ready once; none on the chain.
struct Workshop(BTreeMap<String, (Bodies, Prepared)>);

impl Workshop {
    fn of(plan: &LaboratoryPlan, synthetics: &[(Condition, u64)]) -> Result<Self, ModelError> {
        let mut made = BTreeMap::new();
        if plan.model == ModelKind::Chain.name() {
            return Ok(Self(made));
        }
        let (mut once, mut shared) = (BTreeSet::new(), BTreeSet::new());
        for (condition, number) in synthetics {
            let setting = Setting::draw(*condition, *number, plan.seed).0;
            let key = plan.bodies_key(&setting);
            if !once.insert(key.clone()) && shared.insert(key.clone()) {
                // Scenes that cannot be read are refused one record at a time.
                let (Ok(given), Ok(truth)) = (plan.stated_scene(&setting), plan.truth(&setting)) else { continue };
                made.insert(key, (Bodies::new(&given, None)?, model::prepare(&truth)?));
            }
        }
        Ok(Self(made))
    }
}

impl LaboratoryPlan {
    /// What is the same of all benches with the same bodies.
    fn bodies_key(&self, setting: &Setting) -> String {
        let of_bodies = |set: &&String| ["chain.", "support.", "materials."].iter().any(|of| set.starts_with(of));
        setting.given.iter().chain(&setting.truth).filter(of_bodies).cloned().collect::<Vec<_>>().join(" ")
    }

    /// The overrides given to a fit.
    fn overrides(&self, setting: &Setting) -> Vec<String> {
        let mut overrides = setting.given.clone();
        overrides.push(format!("model.kind={}", self.model));
        overrides.extend(self.mesh_density.map(|density| format!("model.mesh_density={density}")));
        overrides
    }

    fn stated_scene(&self, setting: &Setting) -> Result<Scene, scene::SceneError> {
        scene::load(SCENE, &self.overrides(setting))
    }

    /// The plan given to its fit, beside the two files.
    #[must_use]
    pub fn definition(&self, setting: &Setting) -> Plan {
        let [horn, vibrometer] = NAMES.map(std::path::PathBuf::from);
        Plan {
            measured: Some(vibrometer),
            drive: Some(horn.into()),
            scene: Some(SCENE.into()),
            set: self.overrides(setting),
            likelihood: Some(self.likelihood).filter(|it| *it != Likelihood::default()),
            evaluations: Some(self.evaluations),
            seed: Some(self.seed.wrapping_add(1000 * (setting.number + 1))),
            uncertainty: setting
                .uncertainty
                .iter()
                .map(|(name, value)| (name.clone(), Number::Plain(*value)))
                .collect(),
            ..Plan::default()
        }
    }

    /// The truth, on a finer mesh where it has one.
    fn truth(&self, setting: &Setting) -> Result<Scene, scene::SceneError> {
        let mut overrides = self.overrides(setting);
        overrides.extend(setting.truth.iter().cloned());
        let mut scene = scene::load(SCENE, &overrides)?;
        let density = &mut scene.model.reduced.density;
        *density = (f64::from(*density) * FINER).round() as u32;
        Ok(record::truth_scene(scene, setting))
    }
}

/// Why there is no fit.
#[derive(Debug, thiserror::Error)]
enum NoFit {
    #[error(transparent)]
    Refused(#[from] Refusal),
    #[error(transparent)]
    Truth(#[from] ModelError),
    #[error(transparent)]
    Scene(#[from] scene::SceneError),
    #[error("the files cannot be written")]
    Files(#[from] io::Error),
}

fn synthetic(
    plan: &LaboratoryPlan,
    workshop: &Workshop,
    (condition, number): (Condition, u64),
    stop: &'static (dyn Fn() -> bool + Sync),
) -> (LaboratoryRecord, Option<Files>) {
    let (setting, mut random) = Setting::draw(condition, number, plan.seed);
    let made = workshop.0.get(&plan.bodies_key(&setting));
    let run = |scene: &Scene| match made {
        Some((_, prepared)) => prepared.run(scene, &mut |_| !stop()),
        None => model::run(scene, &mut |_| !stop()),
    };
    let files = plan
        .truth(&setting)
        .map_err(NoFit::from)
        .and_then(|truth| Ok(record::files(&truth, &setting, &mut random, &run)?));
    let regime = files.as_ref().ok().map(|files| files.regime);
    let folder = tempfile::tempdir();
    let place = folder.as_ref().map(|folder| format!("{}/", folder.path().display())).unwrap_or_default();
    let (files, fit) = match (files, &folder) {
        (Ok(files), Ok(folder)) => {
            let fit = fit(plan, &setting, &files, made.map(|(bodies, _)| bodies), folder.path(), stop);
            (Some(files), fit)
        }
        (Err(error), _) => (None, Err(error)),
        (_, Err(error)) => (None, Err(io::Error::new(error.kind(), error.to_string()).into())),
    };
    // Where the files lay is of no interest, and another every time.
    let placeless = |text: &str| if place.is_empty() { text.to_owned() } else { text.replace(&place, "") };
    let fit = match fit {
        Ok(mut fit) => {
            fit.warnings.iter_mut().for_each(|text| *text = placeless(text));
            fit.diagnosis.iter_mut().for_each(|finding| finding.text = placeless(&finding.text));
            Ok(fit)
        }
        Err(error) => Err(placeless(&with_causes(&error))),
    };
    (LaboratoryRecord { setting, regime, fit }, files)
}

/// Write the files, and do with them what `calibrate` does.
fn fit(
    plan: &LaboratoryPlan,
    setting: &Setting,
    files: &Files,
    bodies: Option<&Bodies>,
    folder: &Path,
    stop: &'static (dyn Fn() -> bool + Sync),
) -> Result<LaboratoryFit, NoFit> {
    let definition = plan.definition(setting);
    let [horn, vibrometer] = NAMES.map(|name| folder.join(name));
    fs::write(&horn, &files.horn)?;
    fs::write(&vibrometer, &files.vibrometer)?;
    let options = ReadOptions { drive_frequency: Some(setting.given_frequency_hz), ..ReadOptions::default() };
    let how = (RecordedDrive::read_at_plateau as _, &options);
    let bench = Bench::read(SCENE, definition.set.clone(), ModelKind::Reduced, Some(&horn), how);
    let bench = bench.map_err(Refusal::from)?;
    let shot = RecordedRunPlan { source: Source::File(vibrometer, Box::new(options)), bench, origin: None };
    let problem = Problem::of(&definition, vec![shot])?;
    let schedule = Schedule { bodies, watch: Arc::new(move |_| !stop()), ..Schedule::default() };
    let fitted = problem.fit(schedule)?;
    let outcome = fitted.outcome(&problem);
    let wrong = setting.condition.expected().is_some();
    let diagnosis =
        if wrong { fitted.diagnose(&problem, Arc::new(move |_| !stop()), &|_| ()).findings } else { Vec::new() };
    Ok(LaboratoryFit {
        verdict: outcome.best.verdict,
        p_value: outcome.best.p_value,
        misfit: outcome.best.misfit,
        estimates: fitted.best().fit.estimates.clone(),
        quoted: outcome.best.parameters.values().all(|parameter| parameter.low.is_some()),
        warnings: outcome.warnings,
        diagnosis,
    })
}
