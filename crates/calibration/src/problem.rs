//! A calibration problem: data, scenes and parameters, read and checked before any run.
//!
//! ```text
//! Plan, benches, records ─► Problem ─ fit ─► Fitted ─ outcome ─► CalibrationOutcome
//! ```

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::RangeInclusive,
    path::Path,
};

use super::{
    bench::Bench,
    candidate::{Candidate, candidates},
    comparison::Comparison,
    drive::RecordedDrive,
    fidelity::Bodies,
    fingerprints::Names,
    fit::Fit,
    ladder::SavedFit,
    likelihood::misfit,
    measured::Measured,
    multi_record::{TESTED_TOGETHER, at_one_frequency},
    parameter::{Parameter, ParameterError},
    plan::{Likelihood, Plan, ReadAs, ReadRequest, RecordPlan},
    recorded_run::{RecordedRun, RecordedRunPlan, Source, labels, refuse_twice},
    refusal::{Contradiction, Refusal},
    run_store::RunFile,
    search::EVALUATION_RANGE,
    search::Search,
    uncertainty::{StatedUncertainty, in_words},
};
use granchain_model::{
    Estimate, ModelError,
    reduced::Cache,
    scene::{ModelKind, Scene, Support},
};
use granchain_record::sha256;
use granchain_signal::feature::{Measurand, fingerprint::FeatureSet};

/// Default scene.
/// Most parameters of a fit whose intervals were tested.
const MOST_TESTED: usize = 4;
const SCENE: &str = "annulus";
const SCENE_WITH_WATER: &str = "water";

const FITTED: [&str; 2] = ["alpha", "damping"];

/// Factors on intervals that a correction of their coverage may need.
const WIDEN_RANGE: RangeInclusive<f64> = 1.0..=100.0;

/// Seed where none is given.
pub const DEFAULT_SEED: u64 = 1;

/// Name and version of this program.
pub fn program() -> String {
    format!("granchain {}", env!("CARGO_PKG_VERSION"))
}

#[derive(Debug, Clone)]
pub struct Problem {
    pub quantity: Measurand,
    /// The records, at least one; the first one leads.
    pub recorded_runs: Vec<RecordedRun>,
    pub candidates: Vec<Candidate>,
    /// Models above the chain, in order; the last one answers.
    pub above: Vec<ModelKind>,
    /// Compared part of the records.
    pub likelihood: Likelihood,
    pub evaluations: usize,
    pub seed: u64,
    /// Factor on every 90 % interval of the answer.
    pub widen: Option<f64>,
    /// Weights of features by name, already applied to the comparisons.
    pub weights: BTreeMap<String, f64>,
    /// Assumptions made while reading, as text.
    pub assumptions: Vec<String>,
}

impl Plan {
    /// The records it names, unchecked.
    pub fn records(&self) -> Result<Vec<RecordPlan>, Contradiction> {
        match (&self.measured, self.record.as_slice()) {
            (Some(measured), []) => {
                let drive = self.drive.clone();
                Ok(vec![RecordPlan { measured: measured.clone(), drive, ..RecordPlan::default() }])
            }
            (None, []) => Err(Contradiction::NoRecord),
            (None, records) if self.drive.as_ref().is_none_or(|drive| drive.file.is_none()) => Ok(records.to_vec()),
            (_, records) => Err(Contradiction::OneAndSeveral { records: records.len() }),
        }
    }

    /// The scene of a record that names none.
    pub fn usual_scene(&self) -> &'static str {
        if self.quantity == Some(Measurand::Pressure) { SCENE_WITH_WATER } else { SCENE }
    }

    /// Names of the parameters that are fitted, each once.
    pub fn fitted(&self) -> Vec<String> {
        let mut fitted = self.fit.clone().unwrap_or_else(|| FITTED.map(String::from).to_vec());
        let mut seen = BTreeSet::new();
        fitted.retain(|name| seen.insert(name.clone()));
        fitted
    }

    /// Checks that need no record.
    fn check(&self, planned: &[RecordedRunPlan]) -> Result<(), Refusal> {
        if planned.is_empty() {
            return Err(Contradiction::NoRecord.into());
        }
        let pressure = self.quantity == Some(Measurand::Pressure);
        let published = |path: &&Path| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
        let fitted = self.fitted();
        let unknown = |name: &&String| !Parameter::names().contains(&name.as_str());
        let fits = |name: &str| fitted.iter().any(|fitted| fitted == name);
        let wrong = if let Some(path) = planned.iter().map(|recorded_run| recorded_run.source.path()).find(published) {
            Some(Contradiction::Published { path: path.into() })
        } else if planned.len() > 1 && pressure {
            Some(Contradiction::SeveralPressures)
        } else if pressure && self.features == Some(FeatureSet::Paper) {
            Some(Contradiction::PaperPressure)
        } else if let Some(found) = self.widen.filter(|factor| !WIDEN_RANGE.contains(factor)) {
            Some(Contradiction::Widen { found })
        } else if let Some(name) = fitted.iter().find(unknown) {
            Some(Contradiction::Parameter { name: name.clone() })
        } else if fits("gap") && fits("precompression") {
            Some(Contradiction::Parameters(ParameterError::ClosedGap))
        } else {
            fitted.is_empty().then_some(Contradiction::NothingFitted)
        };
        if let Some(wrong) = wrong {
            return Err(wrong.into());
        }
        if let Some(name) = self.parameters.keys().find(unknown) {
            return Err(Refusal::UnknownBounds { name: name.clone() });
        }
        match self.evaluations.filter(|found| !EVALUATION_RANGE.contains(found)) {
            Some(found) => Err(Refusal::Evaluations { found }),
            None => Ok(()),
        }
    }
}

impl Problem {
    /// Reads the scenes and records that a plan names, and the drive of each.
    pub fn read(plan: &Plan) -> Result<Self, Refusal> {
        let records = plan.records()?;
        let preferred = if records.len() > 1 { ModelKind::Chain } else { ModelKind::Reduced };
        let recorded_run = |record: RecordPlan| {
            let scene = record.scene.as_deref().or(plan.scene.as_deref()).unwrap_or(plan.usual_scene());
            let set = plan.set.iter().chain(&record.set).cloned().collect();
            let ReadAs { measured, drive } = plan.read_as(&record, ReadRequest::default())?;
            let (drive, options) = drive.map_or_else(Default::default, |(file, options, _)| (Some(file), options));
            let how = (RecordedDrive::read_at_plateau as _, &options);
            let bench = Bench::read(scene, set, preferred, drive.as_deref(), how)?;
            Ok(RecordedRunPlan { source: Source::File(record.measured, Box::new(measured)), bench, origin: None })
        };
        Self::of(plan, records.into_iter().map(recorded_run).collect::<Result<_, Refusal>>()?)
    }

    /// A problem from a plan and prepared records and benches; files and scenes named by the plan are ignored.
    pub fn of(plan: &Plan, planned: Vec<RecordedRunPlan>) -> Result<Self, Refusal> {
        plan.check(&planned)?;
        let benches: Vec<&Bench> = planned.iter().map(|recorded_run| &recorded_run.bench).collect();
        let scenes: Vec<Scene> = benches.iter().map(|bench| bench.scene_with(&[])).collect::<Result<_, _>>()?;
        scenes.iter().try_for_each(|scene| Estimate::of(scene).check(&scene.model.limits))?;
        let (scene, quantity) = (&scenes[0], plan.quantity.unwrap_or_default());
        refuse_silence(quantity, scene)?;
        if let Some(above) = scenes.iter().find(|it| scenes.len() > 1 && it.model.kind != ModelKind::Chain) {
            return Err(Contradiction::Together { model: above.model.kind.name() }.into());
        }
        let above = above(scene)?;
        // Some fifty more runs of finite elements must be requested.
        let usual = if above.last() == Some(&ModelKind::Fea) { Likelihood::Amplitudes } else { Likelihood::Waveform };
        let likelihood = plan.likelihood.unwrap_or(usual);
        let stated = StatedUncertainty::new(&plan.uncertainty)?;
        let drawn = |(bench, scene): (&&Bench, &Scene)| stated.of(scene, bench.drive.as_ref());
        let mut uncertainties = benches.iter().zip(&scenes).map(drawn).collect::<Result<Vec<_>, _>>()?;
        refuse_frequencies(&planned, &scenes)?;
        let mut assumptions: Vec<String> = Vec::new();
        // One bench under one record of the horn.
        if scenes.len() > 1 && scenes.iter().all(|scene| *scene == scenes[0]) {
            uncertainties.iter_mut().for_each(|drawn| drawn.repeats = scenes.len());
            assumptions.push(format!(
                "{} shots of one experiment (one scene, one drive): what is not known of bench and instruments is the same in all",
                scenes.len()
            ));
        }
        for text in benches.iter().flat_map(|bench| &bench.assumptions) {
            // Several records on one scene assume the same.
            if benches.len() == 1 || !assumptions.contains(text) {
                assumptions.push(text.clone());
            }
        }
        let mut further = Vec::new();
        for (recorded_run, scene) in planned.iter().zip(&scenes).skip(1) {
            further.push(recorded_run.measured(plan, scene, &mut assumptions)?);
        }
        let candidates = candidates(plan, &benches, &mut assumptions)?;
        assumptions.push(in_words(&uncertainties[0], &candidates[0].parameters));
        assumptions.extend(hydrophone(quantity, scene));
        let lead = planned[0].measured(plan, scene, &mut assumptions)?;
        let read: Vec<(Measured, Comparison)> = std::iter::once(lead).chain(further).collect();
        if let (Some(model), Some(averages)) =
            (above.last(), read.iter().map(|(_, comparison)| comparison.averages).find(|averages| *averages > 1))
        {
            return Err(Contradiction::AveragesAbove { averages, model: model.name() }.into());
        }
        refuse_twice(&read.iter().map(|(measured, _)| measured).collect::<Vec<_>>())?;
        let recorded_runs = planned.into_iter().zip(read).zip(uncertainties);
        let recorded_runs: Vec<RecordedRun> = recorded_runs
            .map(|((planned, (measured, comparison)), uncertainty)| RecordedRun {
                options: planned.source.options().clone(),
                bench: planned.bench,
                measured,
                comparison,
                uncertainty,
            })
            .collect();
        let tested = if recorded_runs.len() > 1 { TESTED_TOGETHER } else { Search::tested(plan.fitted().len()) };
        Ok(Self {
            quantity,
            recorded_runs,
            candidates,
            above,
            likelihood,
            evaluations: plan.evaluations.unwrap_or(tested),
            seed: plan.seed.unwrap_or(DEFAULT_SEED),
            widen: plan.widen,
            weights: plan.weights.clone(),
            assumptions,
        })
    }

    pub fn lead(&self) -> &RecordedRun {
        &self.recorded_runs[0]
    }

    /// Warnings about the records and their drives: place, observation, consequence, remedy.
    pub fn warnings(&self) -> Vec<String> {
        let of = |recorded_run: &RecordedRun| {
            let drive = recorded_run.bench.warnings().iter().cloned();
            let place = recorded_run.measured.path().display();
            let record = recorded_run.measured.warnings().into_iter().map(|text| format!("{place}: {text}"));
            record.chain(drive).collect::<Vec<_>>()
        };
        let mut warnings: Vec<String> = Vec::new();
        for text in self.recorded_runs.iter().flat_map(of) {
            // Several records may share a drive.
            if !warnings.contains(&text) {
                warnings.push(text);
            }
        }
        if self.candidates.iter().any(|candidate| candidate.parameters.len() > MOST_TESTED) {
            warnings.push(format!(
                "more than {MOST_TESTED} parameters are fitted: such fits run, but their intervals were never tested"
            ));
        }
        warnings
    }

    /// Misfit of each run of a fit in units of the scatter at its best; `None` for failed runs.
    pub fn misfits(&self, fit: &Fit) -> Vec<Option<f64>> {
        let compared = || self.recorded_runs.iter().map(|recorded_run| &recorded_run.comparison);
        let weights: Vec<f64> = compared().flat_map(|comparison| comparison.weights.clone()).collect();
        let observed: Vec<f64> = compared().flat_map(|comparison| comparison.features.clone()).collect();
        let total: f64 = weights.iter().sum();
        let misfit = |features: &[f64]| {
            misfit(features.iter().zip(&observed).map(|(z, z0)| z - z0), &fit.scatter, &weights, total)
        };
        fit.runs.iter().map(|run| run.features().filter(|_| !fit.scatter.is_empty()).map(misfit)).collect()
    }

    /// Labels of the records, in order.
    pub fn labels(&self) -> Vec<String> {
        labels(&self.recorded_runs.iter().map(|recorded_run| recorded_run.measured.path()).collect::<Vec<_>>())
    }

    pub fn model(&self) -> &'static str {
        self.above.last().unwrap_or(&ModelKind::Chain).name()
    }

    pub(crate) fn names(&self) -> Names {
        let of = |recorded_run: &RecordedRun| recorded_run.comparison.names().iter().map(ToString::to_string).collect();
        Names {
            parameters: self.candidates[0].parameters.iter().map(|parameter| parameter.name.clone()).collect(),
            features: self.recorded_runs.iter().map(of).collect(),
            models: [ModelKind::Chain].iter().chain(&self.above).map(|kind| kind.name().into()).collect(),
        }
    }

    /// Prepares the bodies of the models above the chain, if there are any, using `cache`.
    pub fn bodies(&self, cache: Option<&Cache>) -> Result<Option<Bodies>, ModelError> {
        let scene = (!self.above.is_empty()).then(|| self.candidates[0].scene());
        scene.map(|scene| Bodies::new(scene, cache)).transpose()
    }

    /// Where the slow runs of every candidate are stored in a folder; those that are there are not made again.
    pub fn saved(&self, folder: &Path) -> Vec<SavedFit> {
        let slow = self.above.last().filter(|kind| **kind == ModelKind::Fea);
        let of = |candidate: &Candidate| {
            let path = |kind: &ModelKind| folder.join(format!("{}-{}.jsonl", candidate.key(), kind.name()));
            SavedFit(slow.map(|kind| RunFile { path: path(kind), key: self.key(candidate) }))
        };
        self.candidates.iter().map(of).collect()
    }

    /// Digest of everything that affects a run; a stored run must have the same one to be used.
    pub fn key(&self, candidate: &Candidate) -> String {
        let drive =
            |recorded_run: &RecordedRun| recorded_run.bench.drive.as_ref().map(|drive| drive.input.sha256.clone());
        let lead = self.lead();
        let mut text = format!(
            "{} {} {} {} {:?} {:?} {:?} {:?}\n{}\n{:?}",
            program(),
            self.seed,
            self.evaluations,
            lead.measured.sha256(),
            drive(lead),
            lead.comparison.features,
            lead.uncertainty,
            candidate.parameters,
            candidate.scene().to_toml(),
            self.weights,
        );
        for (recorded_run, scene) in self.recorded_runs.iter().zip(&candidate.scenes).skip(1) {
            let (measured, features) = (recorded_run.measured.sha256(), &recorded_run.comparison.features);
            text += &format!(
                "\n{measured} {:?} {features:?} {:?}\n{}",
                drive(recorded_run),
                recorded_run.uncertainty,
                scene.to_toml()
            );
        }
        sha256(text.as_bytes())
    }
}

fn refuse_silence(quantity: Measurand, scene: &Scene) -> Result<(), Contradiction> {
    if quantity == Measurand::Velocity || scene.water.is_some() {
        return Ok(());
    }
    let disc = matches!(scene.support, Support::Disc { .. });
    Err(Contradiction::Silent { scene: scene.name.clone(), disc })
}

/// Refuses drives and records of different frequencies, for a single record too.
fn refuse_frequencies(planned: &[RecordedRunPlan], scenes: &[Scene]) -> Result<(), Refusal> {
    let every = !planned[0].bench.frequency_stated;
    let mut stated = Vec::new();
    for (number, (recorded_run, scene)) in planned.iter().zip(scenes).enumerate() {
        let (of_drive, of_record) = (recorded_run.drive_stated(scene), recorded_run.stated().filter(|_| every));
        // The drive decides for the first record; for the others the record itself comes first.
        let (first, second) = if number == 0 { (Some(of_drive), of_record) } else { (of_record, Some(of_drive)) };
        stated.extend(first.into_iter().chain(second));
    }
    Ok(at_one_frequency(&stated)?)
}

/// The models above the chain up to the scene's own; none with a disc.
fn above(scene: &Scene) -> Result<Vec<ModelKind>, Contradiction> {
    let model = scene.model.kind;
    if model.is_meshed() && matches!(scene.support, Support::Disc { .. }) {
        return Err(Contradiction::UpperBeforeDisc { model: model.name() });
    }
    Ok(match model {
        ModelKind::Chain => vec![],
        ModelKind::Reduced => vec![model],
        ModelKind::Fea => vec![ModelKind::Reduced, model],
    })
}

/// Description of the position of the hydrophone.
fn hydrophone(quantity: Measurand, scene: &Scene) -> Option<String> {
    let points = scene.water.as_ref().filter(|_| quantity == Measurand::Pressure).map(|water| &water.field_points)?;
    let others =
        if points.len() > 1 { ", the first of `water.field_points`" } else { "; set water.field_points for another" };
    Some(format!("hydrophone at {}{others}", points.first()?))
}
