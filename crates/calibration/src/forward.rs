//! Forward model: a point of the parameter box → one simulated run with freshly drawn nuisances → fingerprint.

use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use super::nuisance::Uncertainty;
use super::{
    comparison::Comparison,
    drive::HornNoise,
    engine::{Engine, STEPS_PER_CYCLE},
    observation::{Fall, Passband, clip},
    parameter::{Parameter, Target},
    posterior::Posterior,
};
use granchain_model::{
    ModelError,
    chain::{FiniteBodyLaws, ensemble::Variation},
    scene::{Scene, Support},
};
use granchain_signal::{FlickerSource, LowPass, Series, feature::fingerprint::SAMPLES_PER_CYCLE, spline::cubic};

/// Runs integrated side by side.
pub(super) const LANES: usize = 8;

/// One simulated run: its position in the box and its result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    pub position: Vec<f64>,
    /// Fingerprint z, or the reason of the failure.
    pub outcome: Result<Vec<f64>, String>,
}

impl Run {
    /// The fingerprint of a finished run.
    pub fn features(&self) -> Option<&[f64]> {
        self.outcome.as_deref().ok()
    }
}

/// Number of the first predictive run: above those of any search.
const PREDICTED: u64 = 1 << 32;

/// Numbers of the first generators that blocks of runs share: of the stiffness over mass, and of the support.
const SHARED: u64 = 1 << 48;
const SUPPORT: u64 = 1 << 49;

/// A run with its onset time, s; `None` if there is none, or if onsets are not used.
pub(crate) type TimedRun = (Run, Option<f64>);

/// Called repeatedly with the number of finished runs; once it returns `false`, it must keep doing so: the search
/// stops and drops the current batch.
pub type Watch = dyn Fn(u64) -> bool + Send + Sync;

/// What is kept of a run: of its point in unit coordinates, its trace and its random numbers.
pub(super) type Show<'a, T> = &'a (dyn Fn(&Forward, &[f64], Series, &mut ChaCha8Rng) -> T + Sync);

/// The trace of a run; none where it was stopped.
type Traced = Option<Result<Series, ModelError>>;

/// A point of the box with nuisances drawn.
pub(super) struct DrawnRun {
    pub variation: Variation,
    /// Scale of its gaps, m, and each gap over that scale.
    pub roughness: f64,
    pub gaps: Vec<f64>,
}

/// A series at `count` samples from `start` on, by cubic interpolation.
fn on_grid(series: &Series, start: f64, count: usize) -> Series {
    let offset = (start - series.start) / series.step;
    if offset.abs() < 1e-9 {
        return series.clone();
    }
    let last = series.len() as isize - 1;
    let value = |i: usize| {
        let place = i as f64 + offset;
        let whole = place.floor();
        let at = |k: isize| series.values[(whole as isize + k).clamp(0, last) as usize];
        cubic([at(-1), at(0), at(1), at(2)], place - whole)
    };
    Series::new(start, series.step, (0..count).map(value).collect())
}

/// Bandwidth over the highest compared frequency, above which even a slow filter takes less than 5 %.
const UNFELT: f64 = 4.0;

/// Correlation of a bead's 1/mass with its stiffness over mass, by SDs of 0.35 % of radius, 0.5 % of density and 0.7 % of Young's modulus.
const OF_MASS: f64 = 0.82;

/// The scene, prepared for runs at any point of the box and compared with one record.
/// A point of the box in unit coordinates, and a factor on the stiffness over mass.
pub(super) type Point = (Vec<f64>, f64);

#[derive(Clone)]
pub struct Forward {
    pub parameters: Vec<Parameter>,
    pub comparison: Comparison,
    base: Variation,
    scene: Scene,
    uncertainty: Uncertainty,
    seed: u64,
    pub(super) engine: Engine,
    /// Contact laws of its runs, if they are not the scene's own.
    pub(super) laws: Option<FiniteBodyLaws>,
    low_pass: LowPass,
    noise_rms: f64,
    /// Runs of a block, which share one draw of the stiffness.
    block: u64,
    watch: Arc<Watch>,
}

impl Forward {
    /// Prepares `scene` for runs long enough for the comparison with a record (an
    /// [`Observation`](super::observation::Observation)) or another [`Comparison`], with contact laws fitted to finite bodies beforehand; `None` keeps
    /// the scene's own.
    pub fn new(
        scene: &Scene,
        laws: Option<&FiniteBodyLaws>,
        parameters: Vec<Parameter>,
        comparison: impl Into<Comparison>,
        uncertainty: Uncertainty,
        seed: u64,
        watch: Arc<Watch>,
    ) -> Result<Self, ModelError> {
        let period = 1.0 / scene.drive.frequency;
        let mut scene = scene.clone();
        let mut comparison = comparison.into();
        comparison.power *= uncertainty.discount();
        comparison.sensitivity = uncertainty.sensitivity * uncertainty.shared();
        scene.duration = comparison.duration(&scene.drive);
        let engine = Engine::new(&scene, laws, comparison.measurand())?;
        let step = period / STEPS_PER_CYCLE as f64;
        let len = engine.samples();
        let low_pass = LowPass::new(step, len, comparison.cutoff);
        let noise_rms = (comparison.noise_density * 0.5 / step).sqrt();
        let base = Variation::of(&scene);
        Ok(Self {
            parameters,
            comparison,
            base,
            scene,
            uncertainty,
            seed,
            engine,
            laws: laws.cloned(),
            low_pass,
            noise_rms,
            block: 1,
            watch,
        })
    }

    /// The same with one draw of the stiffness for every eight runs: meshed bodies go side by side only with one support, whose stiffness relative to
    /// theirs this draw changes.
    pub(super) fn in_blocks(self) -> Self {
        Self { block: LANES as u64, ..self }
    }

    /// Block of run `number`.
    pub(super) fn block(&self, number: u64) -> u64 {
        number / self.block
    }

    /// The same runs with the same draws and a finer step; `None` if there is none.
    pub(crate) fn refined(&self) -> Option<Self> {
        let engine = self.engine.refined(&self.scene, self.laws.as_ref()).ok()?;
        Some(Self { engine, ..self.clone() })
    }

    /// The same runs, of another duration (s).
    pub(super) fn lasting(&self, duration: f64) -> Result<Self, ModelError> {
        let mut scene = self.scene.clone();
        scene.duration = duration;
        let engine = Engine::new(&scene, self.laws.as_ref(), self.comparison.measurand())?;
        let step = 1.0 / (scene.drive.frequency * STEPS_PER_CYCLE as f64);
        let low_pass = LowPass::new(step, engine.samples(), self.comparison.cutoff);
        Ok(Self { scene, engine, low_pass, ..self.clone() })
    }

    pub(super) fn uncertainty(&self) -> Uncertainty {
        self.uncertainty
    }

    /// The scene with the duration of the runs.
    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Whether stiffness over mass of the beads is drawn, and may be fitted instead.
    pub(super) fn draws_modulus(&self) -> bool {
        // A disc is no Hertz contact: it has its own constants.
        let varies = self.uncertainty.modulus > 0.0 && !matches!(self.scene.support, Support::Disc { .. });
        varies && !self.fits(Target::Modulus)
    }

    /// How an annulus, spring or foundation follows an unknown mass of the beads, since runs have the stated one: exponent of the beads' stiffness over
    /// mass, and SD of what is left, ln.
    fn support_follows(&self) -> (f64, f64) {
        let Uncertainty { mass, modulus, .. } = self.uncertainty;
        if mass > 0.0 && self.scene.support.stiffness().is_some() && !self.fits(Target::SupportStiffness) {
            (OF_MASS * mass / modulus.max(mass), (1.0 - OF_MASS * OF_MASS).sqrt() * mass)
        } else {
            (0.0, 0.0)
        }
    }

    fn fits(&self, target: Target) -> bool {
        self.parameters.iter().any(|parameter| parameter.target == target)
    }

    /// Draws of run `random` at a point, except the drive level (fixed if α is fitted) and stiffness over mass, which
    /// is `stiffness` times the scene's; the horn's noise is that of lane `lane`.
    pub(super) fn held(&self, at: &[f64], stiffness: f64, lane: usize, random: &mut ChaCha8Rng) -> Variation {
        self.hold(self.variation(at, random), (at, stiffness), lane)
    }

    /// The same for draws that have been made.
    pub(super) fn hold(&self, mut variation: Variation, (at, stiffness): (&[f64], f64), lane: usize) -> Variation {
        let mut parameters = self.parameters.iter().zip(at);
        if let Some((alpha, u)) = parameters.find(|(parameter, _)| parameter.target == Target::Alpha) {
            variation.amplitude_scale = alpha.value(*u);
        }
        if self.draws_modulus() {
            let drawn = std::mem::replace(&mut variation.modulus_factor, stiffness);
            variation.support_stiffness_factor *= (stiffness / drawn).powf(self.support_follows().0);
        }
        variation.shaken = vec![0.0; LANES];
        variation.shaken[lane % LANES] = 1.0;
        variation
    }

    /// Runs at the given points and stiffness factors, each with its own nuisances, as `show` makes them of their traces; `None` for a failed run.
    /// Numbered from `first`.
    pub(super) fn waveforms<T: Send>(
        &self,
        first: u64,
        points: &[Point],
        noise: Option<&HornNoise>,
        show: Show<T>,
    ) -> Vec<Option<T>> {
        let draw = |(at, stiffness): &Point, lane: usize, random: &mut ChaCha8Rng| {
            let drawn = self.drawn(at, random);
            DrawnRun { variation: self.hold(drawn.variation, (at, *stiffness), lane), ..drawn }
        };
        let see = |(at, _): &Point, trace: Traced, random: &mut ChaCha8Rng| Some(show(self, at, trace?.ok()?, random));
        self.traced((first, 0), points, noise, &draw, &see)
    }

    /// Traces of runs at some points, numbered from `first`, as `draw` draws them for their lane and `see` makes something of them; without a trace where
    /// the watch, asked with `done`, says stop.
    fn traced<P: Sync, T: Send>(
        &self,
        (first, done): (u64, u64),
        points: &[P],
        noise: Option<&HornNoise>,
        draw: &(dyn Fn(&P, usize, &mut ChaCha8Rng) -> DrawnRun + Sync),
        see: &(dyn Fn(&P, Traced, &mut ChaCha8Rng) -> T + Sync),
    ) -> Vec<T> {
        let chunk = |(chunk, points): (usize, &[P])| {
            let number = first + (chunk * LANES) as u64;
            let mut generators: Vec<ChaCha8Rng> =
                (0..points.len()).map(|lane| self.generator(number + lane as u64)).collect();
            if !self.report(done) {
                let lanes = points.iter().zip(&mut generators);
                return lanes.map(|(point, random)| see(point, None, random)).collect();
            }
            let shakes: Vec<Series> = noise
                .map_or_else(Vec::new, |noise| generators.iter_mut().map(|random| noise.realisation(random)).collect());
            let shaken = (!shakes.is_empty()).then(|| self.engine.with_shakes(&shakes));
            let engine = shaken.as_ref().unwrap_or(&self.engine);
            let lanes = points.iter().zip(&mut generators).enumerate();
            let drawn: Vec<DrawnRun> = lanes.map(|(lane, (point, random))| draw(point, lane, random)).collect();
            let traces = if self.comparison.averages > 1 {
                let lanes = drawn.iter().zip(&mut generators);
                lanes.map(|(drawn, random)| self.mean_of_shots(engine, drawn, random)).collect()
            } else {
                engine.run(&drawn.into_iter().map(|drawn| drawn.variation).collect::<Vec<_>>())
            };
            let traces = points.iter().zip(traces).zip(&mut generators);
            traces.map(|((point, trace), random)| see(point, Some(trace), random)).collect::<Vec<_>>()
        };
        points.par_chunks(LANES).enumerate().flat_map_iter(chunk).collect()
    }

    /// A trace as the waveform is compared, and the features of the run.
    pub(super) fn shown_with_features(&self, at: &[f64], trace: Series, random: &mut ChaCha8Rng) -> (Vec<f64>, Run) {
        let (run, _) = self.finish(at, Ok(trace.clone()), &mut random.clone());
        (self.shown(at, trace, random), run)
    }

    /// A trace conditioned by a noise-free instrument.
    pub(super) fn shown(&self, position: &[f64], mut trace: Series, random: &mut ChaCha8Rng) -> Vec<f64> {
        if let Some(passband) = self.passband(position, || random.random()) {
            // What is causal sets the clock back by its delay.
            let (start, passed) = (trace.start, passband.pass(&trace));
            trace = on_grid(&passed, start, trace.len());
        }
        clip(&mut trace.values, self.comparison.clipped);
        self.filtered(&trace).values
    }

    pub(super) fn watched(self, watch: Arc<Watch>) -> Self {
        Self { watch, ..self }
    }

    /// The same with the seed increased by `by`.
    pub(super) fn reseeded(mut self, by: u64) -> Self {
        self.seed = self.seed.wrapping_add(by);
        self
    }

    /// Run the points, the first of which is run number `first` of the search.
    ///
    /// The draws of a run depend on the seed and its number alone, so neither threads nor batches change a result.
    pub fn run(&self, first: u64, positions: &[Vec<f64>]) -> Vec<Run> {
        self.timed(first, positions).into_iter().map(|(run, _)| run).collect()
    }

    /// As [`Forward::run`], with the onset of every run. After a stop, the remaining runs have no outcome.
    pub(crate) fn timed(&self, first: u64, positions: &[Vec<f64>]) -> Vec<TimedRun> {
        let draw = |at: &Vec<f64>, _: usize, random: &mut ChaCha8Rng| self.drawn(at, random);
        let see = |at: &Vec<f64>, trace: Traced, random: &mut ChaCha8Rng| match trace {
            Some(trace) => self.finish(at, trace, random),
            None => (Run { position: at.clone(), outcome: Err("stopped".into()) }, None),
        };
        self.traced((first, first), positions, None, &draw, &see)
    }

    /// Reports the number of finished runs; returns whether to go on.
    pub(crate) fn report(&self, runs: u64) -> bool {
        (self.watch)(runs)
    }

    /// Random generator of run `number`.
    pub(super) fn generator(&self, number: u64) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(number + 1);
        random
    }

    /// A point of the box with nuisances drawn from `random`.
    pub fn variation(&self, at: &[f64], random: &mut ChaCha8Rng) -> Variation {
        self.drawn(at, random).variation
    }

    /// The same with what its gaps were drawn from.
    pub(super) fn drawn(&self, at: &[f64], random: &mut ChaCha8Rng) -> DrawnRun {
        let mut variation = self.base.clone();
        for (parameter, &u) in self.parameters.iter().zip(at) {
            parameter.vary(&self.scene, &mut variation, parameter.value(u));
        }
        let Uncertainty { gap, gap_scale, baseline, drive, precompression, support_stiffness, modulus, droop, .. } =
            self.uncertainty;
        let shared = self.uncertainty.shared();
        variation.amplitude_scale *= 1.0 + shared * drive * random.random_range(-1.0..1.0);
        let rougher: f64 = StandardNormal.sample(random);
        let roughness = gap * (gap_scale * rougher).exp();
        let mut gaps = Vec::with_capacity(variation.gap_offsets.len());
        for offset in &mut variation.gap_offsets {
            let draw: f64 = StandardNormal.sample(random);
            *offset += roughness * draw.abs();
            gaps.push(draw.abs());
        }
        let number = random.get_stream().saturating_sub(1);
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let of_block = |first: u64, own: f64| -> f64 {
            if self.block > 1 { StandardNormal.sample(&mut self.generator(first + self.block(number))) } else { own }
        };
        // What is fitted is not drawn; an error of the baseline is a gap.
        let draw = normal();
        if !self.fits(Target::Gap) {
            variation.gap_offsets[0] += shared * baseline * draw;
        }
        if precompression > 0.0 && !self.fits(Target::Precompression) {
            variation.precompression = (variation.precompression + shared * precompression * normal()).abs();
        }
        let (follows, left) = self.support_follows();
        let over_mass = support_stiffness.hypot(left);
        if over_mass > 0.0 && !self.fits(Target::SupportStiffness) {
            let own = normal();
            // A stated one is of every run: such runs do not go side by side.
            let draw = if support_stiffness > 0.0 { own } else { of_block(SUPPORT, own) };
            variation.support_stiffness_factor *= (shared * over_mass * draw).exp();
        }
        if self.draws_modulus() {
            let factor = (shared * modulus * of_block(SHARED, normal())).exp();
            variation.modulus_factor *= factor;
            variation.support_stiffness_factor *= factor.powf(follows);
        }
        let shakes = self.scene.drive.shakes().len();
        variation.shaken = (0..shakes).map(|_| normal() / (shakes as f64).sqrt()).collect();
        if droop > 0.0 {
            variation.amplitude_scale /= 1.0 - droop * random.random::<f64>();
        }
        DrawnRun { variation, roughness, gaps }
    }

    /// Posterior predictive runs: `count` points drawn from a posterior with fresh nuisances, and the instrument's
    /// passband for each.
    pub(crate) fn predicted(&self, posterior: &Posterior, count: usize) -> Vec<(Variation, Option<Passband>)> {
        let draw = |number: usize| {
            let mut random = self.generator(PREDICTED + number as u64);
            let at = posterior.draw(1.0, &mut random);
            let variation = self.variation(&at, &mut random);
            (variation, self.passband(&at, || random.random()))
        };
        (0..count).map(draw).collect()
    }

    /// A conditioned run `filtered`, with the record's gaps bridged before the filter; unchanged if the record has
    /// none.
    fn bridged(&self, mut trace: Series, mut filtered: Series, within: impl FnOnce() -> f64) -> Series {
        if self.comparison.masked.is_empty() {
            return filtered;
        }
        if filtered.start > trace.start {
            // A run that begins somewhere in its answer was cut behind the filter.
            let whole = filtered.clone();
            self.comparison.bridge(&mut filtered, &whole, within());
            return filtered;
        }
        self.comparison.bridge(&mut trace, &filtered, within());
        self.filtered(&trace)
    }

    /// Adds the record's noise, low-passes, resamples to 40 samples a period, and measures the features.
    pub(super) fn finish(
        &self,
        position: &[f64],
        trace: Result<Series, ModelError>,
        random: &mut ChaCha8Rng,
    ) -> TimedRun {
        let conditioned = trace.map_err(|error| error.to_string()).map(|trace| self.condition(position, trace, random));
        let onset = conditioned.as_ref().ok().and_then(|trace| self.comparison.onset(trace));
        let outcome = conditioned.and_then(|trace| self.comparison.reduce(&trace));
        (Run { position: position.to_vec(), outcome }, onset)
    }

    /// Applies the instrument's bandwidth, the record's noise and the cutoff.
    fn condition(&self, position: &[f64], mut trace: Series, random: &mut ChaCha8Rng) -> Series {
        if let Some(passband) = self.passband(position, || random.random()) {
            trace = passband.pass(&trace);
        }
        let grows = (self.comparison.speckle * 0.5 / trace.step).sqrt();
        if self.noise_rms > 0.0 || grows > 0.0 {
            for value in &mut trace.values {
                let draw: f64 = StandardNormal.sample(random);
                let deviation = if grows > 0.0 { self.noise_rms.hypot(grows * *value) } else { self.noise_rms };
                *value += deviation * draw;
            }
        }
        if self.comparison.flicker > 0.0 {
            let lowest = 0.5 / (trace.step * trace.len() as f64);
            let mut draw = || -> f64 { StandardNormal.sample(random) };
            let mut source = FlickerSource::new(self.comparison.flicker, trace.step, lowest, &mut draw);
            trace.values.iter_mut().for_each(|value| *value += source.next(&mut draw));
        }
        clip(&mut trace.values, self.comparison.clipped);
        let begun = self.comparison.begun(self.filtered(&trace), &self.scene.drive, random);
        self.bridged(trace, begun, || random.random_range(-0.5..0.5))
    }

    /// Passband of the instrument for a run at `position`, if it matters for the comparison. A fitted bandwidth has
    /// the roll-off of a digital filter. If only the bandwidth is stated, any of [`Passband::stated`] is possible, and
    /// `which` selects one.
    pub fn passband(&self, position: &[f64], which: impl FnOnce() -> f64) -> Option<Passband> {
        let mut parameters = self.parameters.iter().zip(position);
        if let Some((fitted, &u)) = parameters.find(|(parameter, _)| parameter.target == Target::Bandwidth) {
            return Some(Passband { bandwidth: fitted.value(u), fall: Fall::Steepness(1.0) });
        }
        if let Some(known) = &self.comparison.passband {
            return Some(known.clone());
        }
        let stated = self.comparison.bandwidth.filter(|stated| *stated < UNFELT * self.comparison.cutoff)?;
        Some(Passband::stated(stated, which()))
    }

    fn filtered(&self, trace: &Series) -> Series {
        let filtered = if trace.len() == self.engine.samples() {
            self.low_pass.apply(&trace.values)
        } else {
            LowPass::new(trace.step, trace.len(), self.comparison.cutoff).apply(&trace.values)
        };
        let stride = STEPS_PER_CYCLE / SAMPLES_PER_CYCLE;
        let values = filtered.into_iter().step_by(stride).collect();
        Series::new(trace.start, trace.step * stride as f64, values)
    }
}
