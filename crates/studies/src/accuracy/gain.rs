//! What calibration gains: how wide the interval of a fitted parameter is, and whether it holds the truth, for the seconds spent on each rung.
//!
//! The bench is the scene itself: its α and its damping are the truth. Its record is made by the reference that total errors are measured
//! against, finer than every rung that is fitted, with gaps, trigger, offset and sample rate drawn as [`crate::twins`] draws them and
//! 1 % of noise; a few such records differ in what was drawn. Each is fitted
//!
//! - by a **search** with every run on the rung, for several numbers of runs;
//! - by the search on the chain of finite bodies **corrected** on the reduced model, as `calibrate` does it.
//!
//! A search steps the chain as every search does, 160 times a drive period, and bodies with the longest step that divides such a sample and is
//! not above the one named.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use serde::{Deserialize, Serialize};

use super::{
    AccuracyError, failed,
    ladder::{Ladder, Rung as Model, Setting, Varied},
    on_one_thread,
    run::{Clock, Source, processor},
    stored::kept,
    watch::Watched,
};
use crate::{confirmed::with_causes, members::Watch};
use granchain_calibration::{
    correction::Correction,
    fit::{Fit, FitError, Verdict, correct, fit},
    forward::{Forward, Uncertainty},
    observation::Observation,
    parameter::Parameter,
    rung::{Bodies, Rung, chain_below},
    search::{Search, Strategy},
    twin::{Lab, twin_at},
};
use granchain_model::{
    self as model, ModelError,
    chain::FiniteBodyLaws,
    scene::{Scene, Support},
};
use granchain_signal::feature::fingerprint::FeatureSet;

/// Records that are fitted.
pub const TWINS: u64 = 3;
/// σ of their noise relative to the peak.
pub const NOISE: f64 = 0.01;
/// Runs that the seconds of one are the mean of.
const TIMED_RUNS: usize = 16;
/// Runs of a search on the chain; the last number but one is what `calibrate` makes by itself.
const CHEAP: [usize; 5] = [75, 150, 300, 600, 1200];
/// The same where a run takes longer.
const DEAR: [usize; 4] = [75, 150, 300, 600];
/// The same where it takes longest.
const DEAREST: [usize; 2] = [75, 150];
/// The search on the chain that a correction begins with.
const BELOW: [usize; 1] = [600];
/// Pairs of a correction that are reckoned with.
const PAIRS: f64 = 130.0;
/// Between two looks at whether to stop.
const LOOK: Duration = Duration::from_millis(20);

/// How a record is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Way {
    /// Every run on the rung.
    Search,
    /// A search on the chain of finite bodies, corrected on the rung.
    Correction,
}

/// A value that the records were made with.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Name of the parameter.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value, SI.
    pub value: f64,
}

/// All of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gain {
    /// What the records were made with.
    pub truth: Vec<Truth>,
    /// How they were computed.
    pub made_by: Setting,
    /// Their number.
    pub twins: u64,
    /// σ of their noise relative to the peak, 1.
    pub noise: f64,
    /// Seed of everything drawn.
    pub seed: u64,
    /// The processor that the seconds are of.
    pub processor: String,
    /// The rungs.
    pub lines: Vec<GainLine>,
}

/// One rung.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GainLine {
    /// How its runs are computed.
    pub setting: Setting,
    /// How they are used.
    pub way: Way,
    /// Processor time of one thread for what is made once for all fits, s.
    pub setup_s: f64,
    /// The same of one run, s.
    pub run_s: f64,
    /// Fits by the number of runs.
    pub points: Vec<GainPoint>,
}

/// The fits of all records with one number of runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GainPoint {
    /// Runs of the search.
    pub evaluations: usize,
    /// The records in order.
    pub fits: Vec<GainFit>,
}

/// One fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GainFit {
    /// What came out, or why nothing did.
    pub outcome: Result<Fitted, String>,
    /// Processor time of one thread, what is made once left out, s.
    pub fit_s: f64,
}

/// What a fit says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fitted {
    /// 90 % intervals, in the order of the parameters, whatever the verdict.
    pub intervals: Vec<Interval>,
    /// How it ended.
    pub verdict: Verdict,
    /// FIT.
    pub misfit: f64,
    /// Runs made, of the rungs below too.
    pub runs: usize,
    /// Of them, on the rung itself.
    pub own_runs: usize,
    /// Of all, failed.
    pub failed: usize,
}

/// A 90 % interval, SI.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// 5 % quantile.
    pub low: f64,
    /// Median.
    pub median: f64,
    /// 95 % quantile.
    pub high: f64,
}

impl Interval {
    /// ln(high/low).
    #[must_use]
    pub fn width(&self) -> f64 {
        (self.high / self.low).ln()
    }

    /// ln(median/truth).
    #[must_use]
    pub fn error(&self, truth: f64) -> f64 {
        (self.median / truth).ln()
    }

    /// Whether it holds the truth.
    #[must_use]
    pub fn holds(&self, truth: f64) -> bool {
        (self.low..=self.high).contains(&truth)
    }
}

/// A rung to be fitted, and with how many runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// How its runs are computed.
    pub setting: Setting,
    /// How they are used.
    pub way: Way,
    /// Runs of the search, of one fit after the other.
    pub budgets: &'static [usize],
}

/// The rungs of a scene that a calibration can use, cheapest first.
pub(super) fn paths(scene: &Scene) -> Vec<Path> {
    let path = |setting, way, budgets| Path { setting, way, budgets };
    if matches!(scene.support, Support::Disc { .. }) {
        // Before a disc `calibrate` corrects nothing.
        let fixed = |step, budgets| path(Setting::of(Model::ChainFixed, &[(Varied::Step, step)]), Way::Search, budgets);
        return vec![fixed(5e-8, &DEAR[..]), fixed(2.5e-8, &DEAR[..3]), fixed(1.25e-8, &DEAREST[..])];
    }
    let finite = |density| Setting::of(Model::FiniteBody, &[(Varied::Density, density)]);
    let reduced = |density, step, modes| {
        Setting::of(Model::Reduced, &[(Varied::Density, density), (Varied::Step, step), (Varied::Modes, modes)])
    };
    let bodies = [reduced(8.0, 1e-7, 0.0), reduced(12.0, 5e-8, 8.0), reduced(16.0, 2.5e-8, 8.0)];
    let [coarse, common, fine] = bodies.clone();
    let mut all = vec![
        path(Setting::of(Model::Chain, &[]), Way::Search, &CHEAP[..]),
        path(finite(6.0), Way::Search, &CHEAP[..]),
        path(finite(16.0), Way::Search, &CHEAP[..]),
        path(coarse, Way::Search, &DEAR[..]),
        path(common, Way::Search, &DEAR[..3]),
        path(fine, Way::Search, &DEAREST[..]),
    ];
    all.extend(bodies.map(|setting| path(setting, Way::Correction, &BELOW[..])));
    all
}

impl Path {
    /// What all fits of one record are expected to take, s, to a factor of two.
    fn expected_seconds(&self, duration: f64) -> f64 {
        // The laws of the ladder's seconds have a part for the bodies and one for the run; a search runs the chain eight lanes at a time.
        let own = self.setting.expected_seconds(duration) - self.setting.expected_seconds(0.0);
        let run = if matches!(self.setting.rung, Model::Chain | Model::FiniteBody) { 1e-3 } else { own };
        let runs: usize = self.budgets.iter().sum();
        match self.way {
            Way::Search => run * runs as f64,
            Way::Correction => 1e-3 * runs as f64 + run * PAIRS,
        }
    }
}

/// What the measurement is expected to take, s, to a factor of two.
pub(super) fn expected_seconds(scene: &Scene, ladder: &Ladder) -> f64 {
    let paths = paths(scene);
    let bodies: f64 = paths.iter().map(|path| path.setting.expected_seconds(0.0)).sum();
    let fits: f64 = paths.iter().map(|path| path.expected_seconds(scene.duration)).sum();
    bodies + TWINS as f64 * (fits + ladder.best[0].expected_seconds(scene.duration))
}

/// The parameters of a scene that are fitted: α, and the damping where it has one coefficient.
fn parameters(scene: &Scene) -> Vec<Parameter> {
    std::iter::once(Parameter::alpha()).chain(Parameter::damping(scene.damping.kind)).collect()
}

/// What a rung's fits begin with.
enum Ready {
    /// Contact laws, where there are any.
    Chain(Option<FiniteBodyLaws>),
    /// Bodies, and the laws of the chain below.
    Bodies(Bodies),
}

/// Everything that all fits share.
struct Bench<'a> {
    source: &'a Source<'a>,
    parameters: Vec<Parameter>,
    truth: Vec<f64>,
    records: Vec<Observation>,
    seed: u64,
    stopped: Arc<AtomicBool>,
}

/// Fit records that `made_by` makes on every path; `advance` is told of the seconds that were expected of what is done.
///
/// # Errors
/// [`AccuracyError`].
pub(super) fn measure(
    source: &Source<'_>,
    made_by: &Setting,
    paths: &[Path],
    seed: u64,
    watch: &dyn Watch,
    advance: &dyn Fn(f64),
) -> Result<Gain, AccuracyError> {
    let (stopped, done) = (Arc::new(AtomicBool::new(false)), AtomicBool::new(false));
    std::thread::scope(|scope| {
        // A fit asks what outlives this call; whoever watches need not.
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                if watch.stop() {
                    stopped.store(true, Ordering::Relaxed);
                }
                std::thread::sleep(LOOK);
            }
        });
        let found = Bench::new(source, made_by, seed, Arc::clone(&stopped)).and_then(|bench| {
            let duration = source.scene(made_by, &[])?.duration;
            advance(TWINS as f64 * made_by.expected_seconds(duration));
            let line = |path: &Path| {
                let line = bench.line(path)?;
                advance(TWINS as f64 * path.expected_seconds(duration));
                Ok(line)
            };
            let lines = paths.iter().map(line).collect::<Result<_, AccuracyError>>()?;
            Ok(bench.outcome(made_by.clone(), lines))
        });
        done.store(true, Ordering::Relaxed);
        if stopped.load(Ordering::Relaxed) || watch.stop() { Err(AccuracyError::Stopped) } else { found }
    })
}

impl<'a> Bench<'a> {
    /// Make the records.
    fn new(
        source: &'a Source<'a>,
        setting: &Setting,
        seed: u64,
        stopped: Arc<AtomicBool>,
    ) -> Result<Self, AccuracyError> {
        let watched = Watched::of(&source.scene(setting, &[])?);
        let scene = source.scene(setting, &[watched.output_step(setting.step())])?;
        let parameters = parameters(&scene);
        let truth: Vec<f64> = parameters.iter().filter_map(|parameter| parameter.get(&scene)).collect();
        let outside = parameters.iter().zip(&truth).find(|(parameter, value)| {
            let inside = parameter.low..=parameter.high;
            !inside.contains(*value)
        });
        if let Some((parameter, value)) = outside {
            let Parameter { name, low, high, unit, .. } = parameter;
            let reason = format!("its {name} of {value} {unit} is outside what is searched, {low} to {high} {unit}");
            return Err(AccuracyError::NoGain { reason });
        }
        let prepared = model::prepare(&scene).map_err(|error| failed(setting, error))?;
        let run = |scene: &Scene| prepared.run(scene, &mut |_| !stopped.load(Ordering::Relaxed));
        let record = |index: u64| {
            let lab = |measurand, random: &mut _| Lab { noise: NOISE, ..Lab::draw(measurand, random) };
            let (values, uncertainty) = (truth.clone(), Uncertainty::default());
            let twin = twin_at(&scene, &parameters, values, &uncertainty, (index, seed), &lab, &run);
            let said = |error: &dyn std::error::Error| AccuracyError::NoGain { reason: with_causes(error) };
            let twin = twin.map_err(|error| said(&error))?;
            Observation::new(&twin.recording, &scene.drive, FeatureSet::Full).map_err(|error| said(&error))
        };
        let records = (0..TWINS).map(record).collect::<Result<_, AccuracyError>>()?;
        Ok(Self { source, parameters, truth, records, seed, stopped })
    }

    fn outcome(&self, made_by: Setting, lines: Vec<GainLine>) -> Gain {
        let truth = |(parameter, value): (&Parameter, &f64)| Truth {
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            value: *value,
        };
        Gain {
            truth: self.parameters.iter().zip(&self.truth).map(truth).collect(),
            made_by,
            twins: self.records.len() as u64,
            noise: NOISE,
            seed: self.seed,
            processor: processor(),
            lines,
        }
    }

    /// All fits of a rung.
    fn line(&self, path: &Path) -> Result<GainLine, AccuracyError> {
        let scene = self.source.scene(&path.setting, &[])?;
        let (ready, setup_s) = timed(|| Self::ready(&scene));
        let ready = ready.map_err(|error| failed(&path.setting, error))?;
        let first = self.forward(&scene, &ready, 0).map_err(|error| failed(&path.setting, error))?;
        let at: Vec<f64> =
            self.parameters.iter().zip(&self.truth).map(|(parameter, value)| parameter.coordinate(*value)).collect();
        let (_, runs_s) = timed(|| first.run(0, &vec![at; TIMED_RUNS]));
        let point = |evaluations: usize| {
            let fit = |number: usize| {
                if self.stopped.load(Ordering::Relaxed) {
                    return Err(AccuracyError::Stopped);
                }
                let (fit, fit_s) = timed(|| self.fit(&scene, &ready, path.way, number, evaluations));
                Ok(GainFit { outcome: fit.map(|fit| fitted(&fit)), fit_s })
            };
            let fits = (0..self.records.len()).map(fit).collect::<Result<_, AccuracyError>>()?;
            Ok(GainPoint { evaluations, fits })
        };
        let points = path.budgets.iter().map(|budget| point(*budget)).collect::<Result<_, AccuracyError>>()?;
        let run_s = runs_s / TIMED_RUNS as f64;
        Ok(GainLine { setting: path.setting.clone(), way: path.way, setup_s, run_s, points })
    }

    fn ready(scene: &Scene) -> Result<Ready, ModelError> {
        if scene.model.kind == granchain_model::scene::ModelKind::Reduced {
            return Ok(Ready::Bodies(Bodies::new(scene, None)?));
        }
        Ok(Ready::Chain(model::prepare(scene)?.contact_laws().cloned()))
    }

    /// What makes the runs of a search for record `number`.
    fn forward(&self, scene: &Scene, ready: &Ready, number: usize) -> Result<Forward, ModelError> {
        let chain = self.chain(scene, ready, number)?;
        Ok(match ready {
            Ready::Chain(_) => chain,
            Ready::Bodies(bodies) => Forward::above(Rung::new(&chain, Arc::clone(&bodies.prepared), scene)),
        })
    }

    /// The same on the chain, or on the chain below.
    fn chain(&self, scene: &Scene, ready: &Ready, number: usize) -> Result<Forward, ModelError> {
        let laws = match ready {
            Ready::Chain(laws) => laws.as_ref(),
            Ready::Bodies(bodies) => bodies.laws.as_ref(),
        };
        let stopped = Arc::clone(&self.stopped);
        Forward::with_laws(
            &chain_below(scene),
            laws,
            self.parameters.clone(),
            self.records[number].clone(),
            Uncertainty::default(),
            self.fit_seed(number),
            Arc::new(move |_| !stopped.load(Ordering::Relaxed)),
        )
    }

    fn fit_seed(&self, number: usize) -> u64 {
        self.seed.wrapping_add(1000 * (number as u64 + 1))
    }

    fn fit(&self, scene: &Scene, ready: &Ready, way: Way, number: usize, evaluations: usize) -> Result<Fit, String> {
        let seed = self.fit_seed(number);
        let said = |error: FitError| with_causes(&error);
        let search = |forward: &Forward| {
            fit(forward, Search::new(forward, evaluations, seed, Strategy::Likelihood), None).map_err(said)
        };
        let broken = |error: ModelError| with_causes(&error);
        match (way, ready) {
            (Way::Correction, Ready::Bodies(bodies)) => {
                let forward = self.chain(scene, ready, number).map_err(broken)?;
                let chain = search(&forward)?;
                let rung = Rung::new(&forward, Arc::clone(&bodies.prepared), scene).with_finer(bodies.finer.clone());
                let correction = Correction::new(&rung, &chain.runs, seed);
                correct(&rung, chain, correction, None).map_err(said)
            }
            _ => search(&self.forward(scene, ready, number).map_err(broken)?),
        }
    }
}

fn fitted(fit: &Fit) -> Fitted {
    let interval = |estimate: &granchain_calibration::fit::Estimate| Interval {
        low: kept(estimate.low),
        median: kept(estimate.median),
        high: kept(estimate.high),
    };
    Fitted {
        intervals: fit.estimates.iter().map(interval).collect(),
        verdict: fit.verdict,
        misfit: kept(fit.misfit),
        runs: fit.total_runs(),
        own_runs: fit.runs.len(),
        failed: fit.total_failed(),
    }
}

/// A result and the processor time of one thread that it took, s.
fn timed<T: Send>(work: impl FnOnce() -> T + Send) -> (T, f64) {
    on_one_thread(|| {
        let clock = Clock::start();
        let begun = clock.seconds();
        let result = work();
        (result, clock.seconds() - begun)
    })
}
