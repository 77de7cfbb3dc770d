//! The source paper's experiment, whole: its chain before the rigid wall, its two damping laws on the annulus, its sweep of the
//! amplitude scale, every printed statement beside ours, and how much each reading of what is not printed matters.
//!
//! A study falls into points ([`PaperPoint`]) in four stages; [`judge`] holds the outcome against
//! [`STATEMENTS`](statements::STATEMENTS).

mod judgement;
mod reading;
mod rigid;
pub mod statements;

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::{
    decoder::Decoder,
    instrument::{Instrument, spreads},
    portrait::{Portrait, PortraitMoments, Trait},
};
use crate::{
    divided::Divided,
    failure::{StudyError, enough, reasons},
};
use granchain_calibration::predict::{
    Bodies,
    ensemble::{EnsemblePlan, Moments, Spread},
    observation,
    replicates::Watch,
};
use granchain_model::{
    ModelError,
    scene::{self, DampingKind, ModelKind, Scene, SceneError},
};
use granchain_signal::{
    Series,
    feature::{AmplitudeSpectrum, FeatureSettings, Ratio, amplitude_spectrum},
};

use self::statements::SWEPT_ALPHAS;
pub use judgement::{Judgement, Verdict, allowance, chose_the_readings, judge};
pub use reading::{Change, READINGS, Reading, ReadingOutcome, ReadingRuns};
pub use rigid::{RigidOutcome, RigidRun};

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PaperPlan {
    /// Amplitude scales of the sweep, 1.
    pub alphas: Vec<f64>,
    /// Perturbed runs of each law at its own α and at α ± 1 %, ≥ 2.
    #[serde(rename = "members")]
    pub replicates: usize,
    /// Perturbed runs at each α of the sweep, ≥ 2.
    #[serde(rename = "sweep_members")]
    pub sweep_replicates: usize,
    /// Perturbed runs of each reading, ≥ 2.
    #[serde(rename = "reading_members")]
    pub reading_replicates: usize,
    pub seed: u64,
    /// Rms of the noise added to the velocity before it is measured, m/s.
    pub noise_rms_m_per_s: f64,
    /// Bandwidth through which velocity and noise pass, Hz.
    pub bandwidth_hz: f64,
    /// Whether the rigid scene is also run by finite elements.
    pub fea: bool,
    /// Whether the readings are varied on the chain, where runs are cheap, rather than on the model of the rest.
    pub readings_on_chain: bool,
}

impl PaperPlan {
    /// Every α of the paper, as many runs as a scatter needs.
    #[must_use]
    pub fn whole(seed: u64) -> Self {
        let (first, last, step) = SWEPT_ALPHAS;
        let count = ((last - first) / step).round() as u32;
        let decoder = Decoder::of_reconstruction(seed);
        Self {
            // Of whole hundredths, so that 0.5 is the paper's 0.5 and not the next number to it.
            alphas: (0..=count).map(|index| ((first + step * f64::from(index)) * 100.0).round() / 100.0).collect(),
            replicates: 16,
            sweep_replicates: 4,
            reading_replicates: 6,
            seed,
            noise_rms_m_per_s: decoder.noise_rms,
            bandwidth_hz: decoder.bandwidth,
            fea: true,
            readings_on_chain: false,
        }
    }

    /// Every α of the paper with few runs each, the readings on the chain.
    #[must_use]
    pub fn quick(seed: u64) -> Self {
        let whole = Self::whole(seed);
        Self { replicates: 4, sweep_replicates: 2, reading_replicates: 8, fea: false, readings_on_chain: true, ..whole }
    }

    /// Perturbed runs of the annulus scene on the model of the study, and those of the readings on the chain.
    #[must_use]
    pub fn runs(&self) -> (usize, usize) {
        let own = LAWS.len() * (3 * self.replicates + self.sweep_runs());
        let readings =
            LAWS.len() * (self.reading_replicates * reading::ensembles() + self.sweep_runs() * READINGS.len());
        if self.readings_on_chain { (own, readings) } else { (own + readings, 0) }
    }

    /// Perturbed runs of a sweep of α.
    fn sweep_runs(&self) -> usize {
        self.sweep_replicates * self.alphas.len()
    }
}

/// A damping law of the paper with its coefficient and the α it is compared at.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Law {
    pub name: &'static str,
    pub kind: &'static str,
    pub coefficient: f64,
    /// α of the comparison, 1.
    pub alpha: f64,
    /// The line the paper finds beside the drive line.
    pub own_line: Ratio,
}

pub const LAWS: [Law; 2] = [
    Law { name: "linear", kind: "linear", coefficient: 0.3, alpha: 0.5, own_line: Ratio::new(1, 3) },
    Law {
        name: "Kuwabara–Kono",
        kind: DampingKind::KuwabaraKono.name(),
        coefficient: 3660.0,
        alpha: 1.5,
        own_line: Ratio::new(1, 2),
    },
];

impl Law {
    /// Its scene on the annulus; `more` overrides come last.
    ///
    /// # Errors
    /// [`SceneError`] for an override that no scene may have.
    pub fn scene(&self, more: &[String]) -> Result<Scene, SceneError> {
        let mut overrides = vec![
            format!("damping.kind={}", self.kind),
            format!("damping.coefficient={}", self.coefficient),
            format!("alpha={}", self.alpha),
        ];
        overrides.extend(more.iter().cloned());
        scene::load("annulus", &overrides)
    }
}

/// One point of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepPoint {
    pub alpha: f64,
    /// Mean and scatter, in the order of [`Trait::all`].
    pub moments: PortraitMoments,
}

impl SweepPoint {
    fn of(alpha: f64, replicates: &[Result<Portrait, String>]) -> Self {
        Self { alpha, moments: PortraitMoments::of(replicates) }
    }
}

/// Where a number is largest over α: there, and its mean and scatter.
#[must_use]
pub fn largest(sweep: &[SweepPoint], what: Trait) -> Option<(f64, f64, f64)> {
    let points = sweep.iter().filter_map(|point| {
        let own = point.moments.get(what)?;
        Some((point.alpha, own.mean, own.deviation))
    });
    points.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// A law at its own α.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawOutcome {
    pub law: Law,
    /// The numbers of the unperturbed, noise-free run.
    pub single: Portrait,
    /// Mean, scatter and sensitivity of every number, in the order of [`Trait::all`].
    pub spreads: Vec<Option<Spread>>,
    /// Mean and scatter at the law's own α.
    pub moments: PortraitMoments,
    /// Perturbed runs that failed, with their reasons.
    pub failures: Vec<String>,
    /// Largest energy residual of the unperturbed run over its largest energy, 1.
    pub energy_balance: f64,
    /// Velocity of the pole in the unperturbed run within the bandwidth, m/s; not written.
    #[serde(skip)]
    pub velocity: Series,
    /// Its spectrum in the window where the drive is on; not written.
    #[serde(skip)]
    pub spectrum: AmplitudeSpectrum,
}

impl LawOutcome {
    /// Mean, scatter and sensitivity of one number.
    #[must_use]
    pub fn spread(&self, what: Trait) -> Option<Spread> {
        let index = Trait::all().iter().position(|other| *other == what)?;
        self.spreads.get(index).copied().flatten()
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PaperOutcome {
    pub plan: PaperPlan,
    /// The model of the annulus scenes.
    pub model: &'static str,
    /// The model on which the readings were varied.
    pub readings_model: &'static str,
    /// The chain before the rigid wall.
    pub rigid: RigidOutcome,
    /// Both laws at their own α.
    pub laws: Vec<LawOutcome>,
    pub sweeps: Vec<Vec<SweepPoint>>,
    /// Both laws under each reading, by rank.
    pub readings: Vec<Vec<ReadingOutcome>>,
}

/// Scenes and bodies made ready.
#[derive(Debug)]
pub struct Study {
    plan: PaperPlan,
    overrides: Vec<String>,
    scenes: Vec<Scene>,
    settings: FeatureSettings,
    bodies: Bodies,
    decoder: Decoder,
}

impl Study {
    /// Make the paper's scenes ready; `overrides` apply to all of them, such as `model.kind=chain`.
    ///
    /// # Errors
    /// [`StudyError`].
    pub fn new(plan: PaperPlan, overrides: &[String], bodies: Bodies) -> Result<Self, StudyError> {
        let least = [
            ("members", plan.replicates, 2),
            ("sweep members", plan.sweep_replicates, 2),
            ("reading members", plan.reading_replicates, 2),
            ("alphas", plan.alphas.len(), 1),
        ];
        if let Some((what, found, least)) = least.into_iter().find(|(_, found, least)| found < least) {
            return Err(StudyError::TooFew { what, least, found });
        }
        let scenes = LAWS.iter().map(|law| law.scene(overrides)).collect::<Result<Vec<_>, _>>()?;
        let decoder = Decoder { noise_rms: plan.noise_rms_m_per_s, bandwidth: plan.bandwidth_hz, seed: plan.seed };
        let clean = observation::settings(&scenes[0])
            .map_err(|source| StudyError::Feature { what: "the drive".into(), source })?;
        Ok(Self { plan, overrides: overrides.to_vec(), scenes, settings: clean, bodies, decoder })
    }

    /// The scenes of both laws.
    #[must_use]
    pub fn scenes(&self) -> &[Scene] {
        &self.scenes
    }

    #[must_use]
    pub fn bodies(&self) -> &Bodies {
        &self.bodies
    }

    #[must_use]
    pub fn plan(&self) -> &PaperPlan {
        &self.plan
    }

    /// The model of the annulus scenes.
    #[must_use]
    pub fn model(&self) -> ModelKind {
        self.scenes[0].model.kind
    }

    /// The model on which the readings are varied.
    #[must_use]
    pub fn readings_model(&self) -> ModelKind {
        if self.plan.readings_on_chain { ModelKind::Chain } else { self.model() }
    }

    /// A law at its own α: once as it is, then perturbed at α and α ± 1 %.
    fn law(&self, law: &Law, scene: &Scene, watch: &dyn Watch) -> Result<LawRuns, StudyError> {
        let what = || format!("{} dampers at α = {}", law.name, law.alpha);
        let prepared = self.bodies.prepared(scene).map_err(|source| StudyError::Run { what: what(), source })?;
        let response = prepared.run(scene, &mut |_| !watch.stop()).map_err(|source| match source {
            ModelError::Stopped { .. } => StudyError::Stopped,
            source => StudyError::Run { what: what(), source },
        })?;
        let velocity = self.decoder.passes(response.observed_velocity());
        let plan = EnsemblePlan::new(self.plan.replicates, self.plan.seed);
        let levels = self.seen().at(scene, &plan.levels(), &plan, watch)?;
        let energy = response.energy;
        let energy_balance = if energy.largest_j > 0.0 { energy.residual_j.abs() / energy.largest_j } else { 0.0 };
        Ok(LawRuns { velocity, levels, energy_balance })
    }

    fn law_outcome(&self, law: &Law, runs: LawRuns) -> Result<LawOutcome, StudyError> {
        let what = || format!("{} dampers at α = {}", law.name, law.alpha);
        let LawRuns { velocity, levels, energy_balance } = runs;
        let unmeasured = |source| StudyError::Feature { what: what(), source };
        let single = Portrait::of(&velocity, &self.settings).map_err(unmeasured)?;
        let window = self.settings.window.unwrap_or_else(|| granchain_signal::feature::Window::whole(&velocity));
        let spectrum = amplitude_spectrum(&velocity, window).map_err(unmeasured)?;
        let failures = levels.iter().flat_map(|replicates| reasons(replicates)).collect();
        let own = enough(PortraitMoments::of(&levels[0]), &levels[0], what)?;
        let spreads = spreads(&levels);
        Ok(LawOutcome { law: *law, single, spreads, moments: own, failures, energy_balance, velocity, spectrum })
    }

    /// A law over the plan's α.
    fn sweep(
        &self,
        law: &Law,
        scene: &Scene,
        instrument: Instrument<'_>,
        watch: &dyn Watch,
    ) -> Result<Replicates, StudyError> {
        let plan = EnsemblePlan::new(self.plan.sweep_replicates, self.plan.seed);
        let factors: Vec<f64> = self.plan.alphas.iter().map(|alpha| alpha / law.alpha).collect();
        instrument.at(scene, &factors, &plan, watch)
    }

    fn sweep_outcome(&self, law: &Law, seen: &Replicates) -> Result<Vec<SweepPoint>, StudyError> {
        let points = self.plan.alphas.iter().zip(seen).map(|(&alpha, replicates)| {
            let what = || format!("{} dampers at α = {alpha}", law.name);
            let point = SweepPoint::of(alpha, replicates);
            Ok(SweepPoint { moments: enough(point.moments, replicates, what)?, ..point })
        });
        points.collect()
    }

    fn seen(&self) -> Instrument<'_> {
        Instrument { bodies: &self.bodies, decoder: self.decoder, settings: &self.settings, every: 1 }
    }
}

/// Portraits of perturbed runs at each of several levels of the drive; one that failed leaves its reason.
type Replicates = Vec<Vec<Result<Portrait, String>>>;

/// What is kept of a point.
#[derive(Debug, Serialize, Deserialize)]
pub enum PaperPoint {
    /// The last bead before the rigid wall on one model, filtered, m/s.
    Rigid(Series),
    /// A law at its own α.
    Law(LawRuns),
    Sweep(Replicates),
    /// A law under a reading, or as it is for comparison; why not, where it could not be run.
    Reading(Result<ReadingRuns, String>),
}

/// Runs of a law at its own α.
#[derive(Debug, Serialize, Deserialize)]
pub struct LawRuns {
    /// Velocity of the pole in the unperturbed run within the bandwidth, m/s.
    velocity: Series,
    /// The perturbed ones at each level.
    levels: Replicates,
    /// Largest energy residual of the unperturbed run over its largest energy, 1.
    energy_balance: f64,
}

/// What is run at a point.
#[derive(Debug, Clone, Copy)]
enum Work {
    /// A model before the rigid wall.
    Rigid(ModelKind),
    /// A law, by its place, at its own α.
    Law(usize),
    Sweep(usize),
    /// A law under a reading.
    Reading(usize, reading::Point),
}

impl Study {
    /// All of it, stage by stage.
    fn stages_of_work(&self) -> [(&'static str, Vec<Work>); 4] {
        let laws = || 0..LAWS.len();
        let readings = |law| reading::Point::all(self).into_iter().map(move |point| Work::Reading(law, point));
        [
            ("rigid", rigid::models(self.plan.fea).map(Work::Rigid).collect()),
            ("ensembles", laws().map(Work::Law).collect()),
            ("sweep", laws().map(Work::Sweep).collect()),
            ("readings", laws().flat_map(readings).collect()),
        ]
    }

    fn work(&self) -> Vec<Work> {
        self.stages_of_work().into_iter().flat_map(|(_, work)| work).collect()
    }

    /// Runs of it; the few without perturbations are not counted.
    fn runs_in(&self, work: Work) -> usize {
        match work {
            Work::Rigid(_) => 0,
            Work::Law(_) => 3 * self.plan.replicates,
            Work::Sweep(_) => self.plan.sweep_runs(),
            Work::Reading(_, point) => point.runs(&self.plan),
        }
    }

    fn point(&self, work: Work, watch: &dyn Watch) -> Result<PaperPoint, StudyError> {
        let own = |law: usize| (&LAWS[law], &self.scenes[law]);
        match work {
            Work::Rigid(kind) => rigid::simulate(kind, &self.overrides, &self.bodies, watch).map(PaperPoint::Rigid),
            Work::Law(law) => self.law(own(law).0, own(law).1, watch).map(PaperPoint::Law),
            Work::Sweep(law) => self.sweep(own(law).0, own(law).1, self.seen(), watch).map(PaperPoint::Sweep),
            Work::Reading(law, reading) => reading.run(self, &LAWS[law], watch).map(PaperPoint::Reading),
        }
    }
}

impl Divided for Study {
    type Point = PaperPoint;
    type Outcome = PaperOutcome;

    fn points(&self) -> usize {
        self.work().len()
    }

    fn runs_of(&self, point: usize) -> usize {
        self.runs_in(self.work()[point])
    }

    fn stages(&self) -> Vec<(&'static str, usize)> {
        self.stages_of_work().into_iter().map(|(name, work)| (name, work.len())).collect()
    }

    fn part(&self, part: Range<usize>, watch: &dyn Watch) -> Result<Vec<PaperPoint>, StudyError> {
        self.work()[part].iter().map(|work| self.point(*work, watch)).collect()
    }

    fn outcome(&self, points: Vec<PaperPoint>) -> Result<PaperOutcome, StudyError> {
        let (mut velocities, mut laws, mut sweeps, mut readings) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for point in points {
            match point {
                PaperPoint::Rigid(velocity) => velocities.push(velocity),
                PaperPoint::Law(runs) => laws.push(runs),
                PaperPoint::Sweep(seen) => sweeps.push(seen),
                PaperPoint::Reading(found) => readings.push(found),
            }
        }
        let each = readings.len() / LAWS.len();
        Ok(PaperOutcome {
            plan: self.plan.clone(),
            model: self.model().name(),
            readings_model: self.readings_model().name(),
            rigid: rigid::outcome(self.plan.fea, velocities),
            laws: LAWS.iter().zip(laws).map(|(law, runs)| self.law_outcome(law, runs)).collect::<Result<_, _>>()?,
            sweeps: LAWS
                .iter()
                .zip(&sweeps)
                .map(|(law, seen)| self.sweep_outcome(law, seen))
                .collect::<Result<_, _>>()?,
            readings: LAWS
                .iter()
                .zip(readings.chunks(each))
                .map(|(law, own)| reading::ranked(self, law, own))
                .collect(),
        })
    }
}

/// The moments of one number that every run has.
fn moment(moments: &PortraitMoments, what: Trait) -> Moments {
    moments.get(what).unwrap_or(Moments { mean: 0.0, deviation: 0.0, count: 0 })
}
