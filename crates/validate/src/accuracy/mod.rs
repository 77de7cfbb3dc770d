//! What accuracy costs: the ladder of a scene — model, mesh, modes, step or tolerance, integrator — with the error of every setting and the
//! time it takes.
//!
//! Two errors are distinguished, both e = √(Σ (v − v̂)²/Σ v̂²) over the window in which a waveform can be compared at all:
//!
//! - **total**: v̂ is the scene's best reference, of the finest bodies and steps. A model that leaves physics out ends at a floor.
//! - **own**: v̂ is the limit of the same model when the one number that a line varies goes to its end. This one has an order.
//!
//! Each reference is computed once more on the next level, and no error below ten times that change is quoted. Below the **chaos floor**, the
//! change by gaps jittered by 0.3 nm and a drive jittered by 10⁻⁴, accuracy buys nothing.

mod force;
pub mod front;
pub mod ladder;
mod run;
pub mod stored;
mod watch;

use rayon::prelude::*;
use thiserror::Error;

pub use run::{Cost, Seconds, is_processor_time, processor};
pub use watch::{Feature, Watched, observed_slope, relative_error};

use self::{
    ladder::{FidelityLevel, Ladder, Line, Setting, Varied},
    run::Source,
    stored::{BEST, Chaos, FeatureSpread, Measured, OwnErrors, OwnPoint, Reference, Stored, kept},
};
use granchain_calibration::predict::{
    EnsemblePlan,
    ensemble::Moments,
    replicates::{Watch, perturbations, varied},
};
use granchain_model::{
    ModelError,
    response::SolverWork,
    scene::{self, Limits, Scene, SceneError},
};
use granchain_signal::feature::FeatureError;

/// What is to be done.
#[derive(Debug, Clone, PartialEq)]
pub struct AccuracyPlan {
    /// Built-in scene or scene file.
    pub scene: String,
    pub sets: Vec<String>,
    /// Compute the references again and measure every setting, instead of those that take little time against the stored references.
    pub full: bool,
    /// Perturbed copies for the chaos floor.
    pub replicates: usize,
    pub seed: u64,
    /// What a run may ask for.
    pub limits: Limits,
    pub program: String,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Accuracy {
    /// References and every setting measured, its seconds those of this machine; in the quick form the dearest settings keep what is stored.
    pub found: Stored,
    /// Whether each of them was measured now.
    pub fresh: Vec<bool>,
}

#[derive(Debug, Error)]
#[non_exhaustive]
pub enum AccuracyError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error("{reason}; pass --full to compute the references")]
    NotStored { reason: String },
    #[error("{setting}: {source}")]
    Run { setting: String, source: Box<ModelError> },
    #[error("{setting}: {source}")]
    Feature { setting: String, source: FeatureError },
    #[error("stopped")]
    Stopped,
}

/// Above this a waveform is another one and its error no longer falls as a power.
const LARGEST_OF_AN_ORDER: f64 = 0.3;
/// Below this many times what the limit may be off, an error says nothing about an order.
const LEAST_OF_AN_ORDER: f64 = 4.0;
/// Units of the bar a second that is expected.
const UNITS_PER_SECOND: f64 = 1000.0;

/// A scene's ladder, ready to be measured.
#[derive(Debug)]
pub struct Study {
    plan: AccuracyPlan,
    ladder: Ladder,
    watched: Watched,
    scene: Scene,
    stored: Option<Stored>,
}

impl Study {
    /// Read the scene and what is stored of it.
    ///
    /// # Errors
    /// [`AccuracyError::Scene`]; [`AccuracyError::NotStored`] for the quick form of a scene that is not a built-in one as it is.
    pub fn new(plan: AccuracyPlan) -> Result<Self, AccuracyError> {
        let scene = scene::load(&plan.scene, &plan.sets)?.with_limits(plan.limits);
        let stored = if plan.full {
            None
        } else if plan.sets.is_empty() {
            Some(Stored::of(&plan.scene).map_err(|reason| AccuracyError::NotStored { reason })?)
        } else {
            let reason = format!("scene `{}` with {}: nothing is stored of it", plan.scene, plan.sets.join(", "));
            return Err(AccuracyError::NotStored { reason });
        };
        let (ladder, watched) = (Ladder::of(&scene), Watched::of(&scene));
        Ok(Self { plan, ladder, watched, scene, stored })
    }

    /// What it is expected to take on one thread, s, to a factor of two.
    #[must_use]
    pub fn expected_seconds(&self) -> f64 {
        let settings = self.ladder.settings();
        let measured = settings.iter().filter(|setting| self.measures(setting));
        let settings: f64 = measured.map(|setting| self.expected(setting)).sum();
        if !self.plan.full {
            return settings;
        }
        let replicates = self.plan.replicates as f64 * self.ladder.chaos.expected_seconds(self.scene.duration);
        let references: f64 = self.references().flatten().map(|setting| self.expected_reference(setting)).sum();
        settings + replicates + references
    }

    #[must_use]
    pub fn cost(&self) -> u64 {
        (UNITS_PER_SECOND * self.expected_seconds()) as u64
    }

    fn measures(&self, setting: &Setting) -> bool {
        self.plan.full || setting.is_quick(self.scene.duration)
    }

    fn expected(&self, setting: &Setting) -> f64 {
        2.5 * setting.expected_seconds(self.scene.duration)
    }

    fn expected_reference(&self, setting: &Setting) -> f64 {
        setting.expected_seconds(self.ladder.window + self.watched.margin())
    }

    fn references(&self) -> impl Iterator<Item = &[Setting; 2]> {
        std::iter::once(&self.ladder.best).chain(self.ladder.lines.iter().map(|line| &line.limit))
    }

    /// Errors of one line against its own limit, computed now: what shows an order.
    ///
    /// # Errors
    /// [`AccuracyError`]; nothing for a line that the ladder does not have.
    pub fn line(&self, key: &str, watch: &dyn Watch) -> Result<Option<OwnErrors>, AccuracyError> {
        if key == force::KEY {
            return Ok(Some(self.force_errors(&self.force_limit()?, watch)?));
        }
        let Some(line) = self.ladder.lines.iter().find(|line| line.key == key) else { return Ok(None) };
        let reference = self.reference(line.key, &line.limit, &|setting| self.waveform(setting, watch))?;
        let of = |(_, setting): &(f64, Setting)| Ok((setting.clone(), self.waveform(setting, watch)?));
        let waveforms: Vec<_> = line.settings.iter().map(of).collect::<Result<_, AccuracyError>>()?;
        Ok(self.own_errors(line, &[reference], &waveforms))
    }

    /// A reference and how far it has converged.
    fn reference(
        &self,
        key: &str,
        [setting, next]: &[Setting; 2],
        waveform: &dyn Fn(&Setting) -> Result<Vec<f64>, AccuracyError>,
    ) -> Result<Reference, AccuracyError> {
        let (values, finer) = (waveform(setting)?, waveform(next)?);
        let change = kept(relative_error(&values, &finer));
        Ok(Reference { key: key.to_owned(), setting: setting.clone(), next: next.clone(), change, values })
    }

    fn source(&self) -> Source<'_> {
        Source { name: &self.plan.scene, sets: &self.plan.sets, limits: self.plan.limits }
    }

    /// What is stored, nothing of it measured now.
    ///
    /// # Errors
    /// [`AccuracyError::NotStored`] for the full form.
    pub fn shipped(&self) -> Result<Accuracy, AccuracyError> {
        let none =
            || AccuracyError::NotStored { reason: format!("scene `{}`: the full form reads nothing", self.plan.scene) };
        let found = self.stored.clone().ok_or_else(none)?;
        let fresh = vec![false; found.measured.len()];
        Ok(Accuracy { found, fresh })
    }

    /// Measure.
    ///
    /// # Errors
    /// [`AccuracyError`].
    pub fn measure(&self, watch: &dyn Watch) -> Result<Accuracy, AccuracyError> {
        let settings = self.ladder.settings();
        // Cheapest first: memory that large bodies leave behind does not count for small ones.
        let mut order: Vec<usize> = (0..settings.len()).filter(|place| self.measures(&settings[*place])).collect();
        let expected = |place: usize| settings[place].expected_seconds(self.scene.duration);
        order.sort_by(|a, b| expected(*a).total_cmp(&expected(*b)));
        let mut runs: Vec<(Setting, Run)> = Vec::new();
        for place in order {
            if watch.stop() {
                return Err(AccuracyError::Stopped);
            }
            let setting = &settings[place];
            runs.push((setting.clone(), self.run(setting, watch)?));
            watch.advance((UNITS_PER_SECOND * self.expected(setting)) as u64);
        }
        let (references, chaos) = match &self.stored {
            Some(stored) => (stored.references.clone(), stored.chaos.clone()),
            None => (self.compute_references(watch)?, self.chaos(watch)?),
        };
        let best = &references[0].values;
        let (mut measured, mut fresh) = (Vec::new(), Vec::new());
        for setting in &settings {
            let run = runs.iter().find(|(ran, _)| ran == setting).map(|(setting, run)| run.against(setting, best));
            let old = || self.stored.as_ref()?.measured.iter().find(|old| old.setting == *setting).cloned();
            fresh.extend(run.is_some().then_some(true).or_else(|| old().map(|_| false)));
            measured.extend(run.or_else(old));
        }
        let waveforms: Vec<(Setting, Vec<f64>)> =
            runs.into_iter().map(|(setting, run)| (setting, run.values)).collect();
        let lines = self.ladder.lines.iter().filter_map(|line| self.own_errors(line, &references, &waveforms));
        let mut own: Vec<OwnErrors> = lines.collect();
        own.extend(self.line(force::KEY, watch)?);
        let found = Stored {
            program: self.plan.program.clone(),
            scene: self.plan.scene.clone(),
            // A scene that is changed is no built-in one.
            scene_sha256: stored::digest(&self.plan.scene).filter(|_| self.plan.sets.is_empty()).unwrap_or_default(),
            watched: self.watched.name().to_owned(),
            window_s: self.ladder.window,
            interval_s: self.watched.interval(),
            processor: processor(),
            references,
            chaos,
            own,
            measured,
        };
        Ok(Accuracy { found, fresh })
    }

    /// Errors of a line against its limit; of settings that were not run now, what is stored.
    fn own_errors(
        &self,
        line: &Line,
        references: &[Reference],
        waveforms: &[(Setting, Vec<f64>)],
    ) -> Option<OwnErrors> {
        let limit = references.iter().find(|reference| reference.key == line.key)?;
        let stored = self.stored.as_ref().and_then(|stored| stored.own.iter().find(|own| own.key == line.key));
        let point = |(value, setting): &(f64, Setting)| {
            let old = || stored?.points.iter().find(|point| point.value == *value).copied();
            let fresh = waveforms.iter().find(|(measured, _)| measured == setting);
            fresh.map_or_else(old, |(_, values)| {
                let error = kept(relative_error(values, &limit.values));
                Some(OwnPoint { value: *value, error, quoted: error >= limit.least_quotable() })
            })
        };
        let points: Vec<OwnPoint> = line.settings.iter().filter_map(point).collect();
        Some(with_order(line.key, line.fidelity, line.varied, points, limit.change))
    }

    /// One setting over the whole scene, several times.
    fn run(&self, setting: &Setting, watch: &dyn Watch) -> Result<Run, AccuracyError> {
        let scene = self.source().scene(setting, &[self.watched.output_step(setting.step())])?;
        let (response, cost) =
            on_one_thread(|| run::repeated(&scene, watch)).map_err(|error| failed(setting, error))?;
        let features = self.watched.features(&scene, &response);
        let features = features.map_err(|source| AccuracyError::Feature { setting: setting.to_string(), source })?;
        Ok(Run {
            values: self.watched.values(&response, self.ladder.window),
            energy: kept(response.energy.residual_j.abs() / response.energy.largest_j),
            work: response.work,
            features: features.into_iter().map(|feature| feature.value.map(kept)).collect(),
            cost,
        })
    }

    /// A waveform over the window alone.
    fn waveform(&self, setting: &Setting, watch: &dyn Watch) -> Result<Vec<f64>, AccuracyError> {
        // A whole number of output steps.
        let duration = (self.ladder.window + self.watched.margin()).min(self.scene.duration);
        let more = [self.watched.output_step(setting.step()), format!("duration={} ns", (1e9 * duration).round())];
        let scene = self.source().scene(setting, &more)?;
        let (response, ..) = run::once(&scene, watch).map_err(|error| failed(setting, error))?;
        watch.advance((UNITS_PER_SECOND * self.expected_reference(setting)) as u64);
        Ok(self.watched.values(&response, self.ladder.window).into_iter().map(kept).collect())
    }

    /// All references and how far each has converged; runs that several need are made once.
    fn compute_references(&self, watch: &dyn Watch) -> Result<Vec<Reference>, AccuracyError> {
        let mut needed: Vec<&Setting> = Vec::new();
        for setting in self.references().flatten() {
            if !needed.contains(&setting) {
                needed.push(setting);
            }
        }
        let waveforms: Vec<Vec<f64>> = needed
            .par_iter()
            .with_max_len(1)
            .map(|setting| if watch.stop() { Err(AccuracyError::Stopped) } else { self.waveform(setting, watch) })
            .collect::<Result<_, _>>()?;
        let made = |setting: &Setting| {
            let place = needed.iter().position(|needed| *needed == setting).unwrap_or(0);
            Ok(waveforms[place].clone())
        };
        let keys = std::iter::once(BEST).chain(self.ladder.lines.iter().map(|line| line.key));
        keys.zip(self.references()).map(|(key, pair)| self.reference(key, pair, &made)).collect()
    }

    fn force_limit(&self) -> Result<Reference, AccuracyError> {
        let rounded = |setting: &Setting| Ok(force::forces(&self.source(), setting)?.into_iter().map(kept).collect());
        self.reference(force::KEY, &force::limit(), &rounded)
    }

    /// Static force of two beads over the mesh.
    fn force_errors(&self, limit: &Reference, watch: &dyn Watch) -> Result<OwnErrors, AccuracyError> {
        let point = |density: &f64| {
            if watch.stop() {
                return Err(AccuracyError::Stopped);
            }
            let forces = force::forces(&self.source(), &force::setting(*density))?;
            let error = kept(relative_error(&forces, &limit.values));
            Ok(OwnPoint { value: *density, error, quoted: error >= limit.least_quotable() })
        };
        let points = force::DENSITIES.iter().map(point).collect::<Result<_, _>>()?;
        Ok(with_order(force::KEY, FidelityLevel::Fea, Varied::Density, points, limit.change))
    }

    /// What jitters do to the waveform over the window and to the features of the whole run.
    fn chaos(&self, watch: &dyn Watch) -> Result<Chaos, AccuracyError> {
        let setting = &self.ladder.chaos;
        let scene = self.source().scene(setting, &[self.watched.output_step(setting.step())])?;
        let variations = perturbations(&scene, &EnsemblePlan::new(self.plan.replicates, self.plan.seed));
        let prepared = granchain_model::prepare(&scene).map_err(|error| failed(setting, error))?;
        let see = |scene: &scene::Scene| {
            let response = prepared.run(scene, &mut |_| !watch.stop()).map_err(|error| failed(setting, error))?;
            watch.advance((UNITS_PER_SECOND * setting.expected_seconds(self.scene.duration)) as u64);
            let features = self.watched.features(scene, &response);
            let features =
                features.map_err(|source| AccuracyError::Feature { setting: setting.to_string(), source })?;
            Ok((self.watched.values(&response, self.ladder.window), features))
        };
        let (undisturbed, names) = see(&scene)?;
        let copies: Vec<(Vec<f64>, Vec<Feature>)> = variations
            .par_iter()
            .with_max_len(1)
            .map(|variation| see(&varied(&scene, variation)))
            .collect::<Result<_, AccuracyError>>()?;
        let squares: f64 = copies.iter().map(|(values, _)| relative_error(values, &undisturbed).powi(2)).sum();
        let spread = |(index, feature): (usize, Feature)| {
            let moments = Moments::of(copies.iter().map(|(_, features)| features[index].value));
            FeatureSpread {
                key: feature.key,
                unit: feature.unit.to_owned(),
                mean: moments.map(|moments| kept(moments.mean)),
                scatter: moments.map(|moments| kept(moments.deviation)),
            }
        };
        Ok(Chaos {
            setting: setting.clone(),
            replicates: copies.len(),
            seed: self.plan.seed,
            floor: kept((squares / copies.len() as f64).sqrt()),
            features: names.into_iter().enumerate().map(spread).collect(),
        })
    }
}

/// A setting as it ran.
struct Run {
    values: Vec<f64>,
    energy: f64,
    work: SolverWork,
    features: Vec<Option<f64>>,
    cost: Cost,
}

impl Run {
    fn against(&self, setting: &Setting, best: &[f64]) -> Measured {
        Measured {
            setting: setting.clone(),
            error: kept(relative_error(&self.values, best)),
            energy: self.energy,
            work: self.work,
            features: self.features.clone(),
            cost: self.cost,
        }
    }
}

/// The order that some points show.
fn with_order(key: &str, fidelity: FidelityLevel, varied: Varied, points: Vec<OwnPoint>, change: f64) -> OwnErrors {
    let least = LEAST_OF_AN_ORDER * change;
    let falling = points.iter().filter(|point| (least..=LARGEST_OF_AN_ORDER).contains(&point.error));
    let sized: Vec<(f64, f64)> = falling.filter_map(|point| Some((varied.size(point.value)?, point.error))).collect();
    OwnErrors { key: key.to_owned(), fidelity, varied, order: observed_slope(&sized).map(kept), points, change }
}

fn failed(setting: &Setting, error: ModelError) -> AccuracyError {
    match error {
        ModelError::Stopped { .. } => AccuracyError::Stopped,
        error => {
            AccuracyError::Run { setting: format!("{}, {setting}", setting.fidelity.name()), source: Box::new(error) }
        }
    }
}

/// What is timed runs on one thread, whatever the program was given.
fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}
