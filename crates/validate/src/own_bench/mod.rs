//! Coverage on the user's own bench: records made at values that the user's fit allows, fitted by the calls that fitted the user's record.
//!
//! ```text
//! plan, record ─ fit ─ posterior ─► truth ─ accurate run ─► files ─ reader ─► Problem ─ fit, bound ─► OwnCount
//! ```
//!
//! Truths are drawn from the posterior, and what the laboratory does not control as the plan's `[uncertainty]` says. The horn moves as it was measured
//! to move, times its level. No run of a fit makes a truth: the chain is integrated adaptively with located contacts, elastic bodies on a finer mesh
//! at half the step.

mod count;
mod record;
mod wrong;

pub use count::{ExperimentCount, OwnCount, ParameterCoverage, Power};
pub use wrong::WrongBench;

use std::{fs, io, ops::Range, path::Path, sync::Arc};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::record::Instrument;
use crate::laboratory::{
    FINER, NAMES,
    record::{FINE, MARGIN, shots},
};
use granchain_calibration::{
    FittedCandidate, Plan, Problem, Schedule,
    bench::Bench,
    drive::RecordedDrive,
    fidelity::Bodies,
    fit::{Estimate, Verdict},
    forward::Uncertainty,
    measured::Measured,
    parameter::Target,
    predict::{
        self,
        predicted::with_causes,
        prediction::{PredictionError, placed},
    },
    recorded_run::{RecordedRunPlan, Source},
    refusal::Refusal,
    waveform::{QUANTILE, WaveformBound},
};
use granchain_model::{
    ModelError,
    chain::ensemble::Variation,
    scene::{DriveKind, ModelKind, Scene, SceneError},
};
use granchain_record::{MeasurementError, RecordKind, read_record};
use granchain_signal::{Series, feature::Measurand};

/// Most shots simulated for a record that is a mean, and their jitter, s.
const SHOTS: (usize, f64) = (16, 0.2e-6);

/// Distance of the seeds of two fits.
const APART: u64 = 1000;

/// An experiment to be planned: the user's bench, or another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Experiment {
    pub name: String,
    /// Factor on the horn's motion.
    pub level: f64,
    /// Overrides of the scene, of truth and fit alike.
    pub set: Vec<String>,
}

/// What is to be made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnPlan {
    pub experiments: Vec<Experiment>,
    /// Records of each experiment, and of each kind of wrong bench.
    pub count: u64,
    pub seed: u64,
    /// Whether records of wrong benches are made too.
    pub wrong: bool,
    /// Whether every record is fitted; else widths are those of the bound.
    pub fits: bool,
}

impl OwnPlan {
    /// Experiment, kind of bench and number of each record.
    fn points(&self) -> Vec<(usize, Option<WrongBench>, u64)> {
        let wrong = WrongBench::ALL.into_iter().filter(|_| self.wrong).map(Some);
        let kinds: Vec<Option<WrongBench>> = std::iter::once(None).chain(wrong).collect();
        let of = |experiment: usize| {
            let kinds = kinds.clone().into_iter();
            kinds.flat_map(move |kind| (0..self.count).map(move |number| (experiment, kind, number)))
        };
        (0..self.experiments.len()).flat_map(of).collect()
    }

    #[must_use]
    pub fn total(&self) -> usize {
        self.points().len()
    }
}

/// One record made on the user's bench.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnRecord {
    /// Index of the experiment.
    pub experiment: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wrong: Option<WrongBench>,
    pub number: u64,
    /// True values of the fitted parameters, SI, by name.
    pub values: Vec<(String, f64)>,
    /// What the waveform could say at these values; absent where it cannot be compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bound: Option<WaveformBound>,
    /// The fit, or why there is none; absent where only the bound was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<Result<OwnFit, String>>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnFit {
    pub verdict: Verdict,
    pub p_value: f64,
    pub estimates: Vec<Estimate>,
    /// Posterior probability below each true value.
    pub ranks: Vec<f64>,
}

/// Why records of a bench cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OwnBenchError {
    #[error(
        "{}: expected one velocity record, found {found}; name one vibrometer record in the plan (`measured = …`), coverage of others: --quantity, --records", path.display()
    )]
    NotOneVelocity { path: std::path::PathBuf, found: String },
    #[error("the plan's model is `{model}`: expected chain or reduced; take --model reduced")]
    Model { model: &'static str },
    #[error(
        "the plan's own fit is `{verdict}`: expected one that explains the record, for records are made with its values; correct the bench first \
         (granchain calibrate --plan …)"
    )]
    Unexplained { verdict: Verdict },
    #[error(transparent)]
    Refused(#[from] Refusal),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Model_(#[from] ModelError),
    #[error("the record cannot be aligned with its own fit")]
    Placed(#[from] PredictionError),
    #[error(transparent)]
    Horn(#[from] MeasurementError),
    #[error("the files of a record cannot be written")]
    Files(#[from] io::Error),
    #[error("not on this bench")]
    Inapplicable,
}

/// The user's bench with its fit, ready to make records.
pub struct OwnBench {
    plan: Plan,
    bench: Bench,
    fitted: FittedCandidate,
    /// Standard deviations of its parameters, ln.
    deviations: Vec<f64>,
    uncertainty: Uncertainty,
    /// Record time minus model time, s.
    offset: f64,
    vibrometer: Instrument,
    horn: Option<Instrument>,
    /// Accurate bodies of the truths.
    accurate: predict::Bodies,
}

/// What one record is made of.
struct Truth {
    scene: Scene,
    values: Vec<f64>,
    /// What differs from `scene` on bodies that are made ready once.
    variation: Variation,
    gain: f64,
    scale: f64,
}

impl OwnBench {
    /// Fit the user's plan as `calibrate` does. `None` once `stop` says so.
    ///
    /// # Errors
    /// A plan of other records, one that cannot be fitted, or one whose fit does not explain its record.
    pub fn fit(
        plan: Plan,
        problem: &Problem,
        stop: &'static (dyn Fn() -> bool + Sync),
    ) -> Result<Option<Self>, OwnBenchError> {
        let lead = problem.lead();
        let not_one = |found: String| OwnBenchError::NotOneVelocity { path: lead.measured.path().into(), found };
        if problem.recorded_runs.len() > 1 {
            return Err(not_one(format!("{} records", problem.recorded_runs.len())));
        }
        let Measured::Record(measured) = &lead.measured else { return Err(not_one("published values".into())) };
        if problem.quantity != Measurand::Velocity {
            return Err(not_one("a pressure".into()));
        }
        if let Some(model @ ModelKind::Fea) = problem.above.last() {
            return Err(OwnBenchError::Model { model: model.name() });
        }
        let mut fitted = match problem.fit(Schedule { watch: Arc::new(move |_| !stop()), ..Schedule::default() }) {
            Err(Refusal::Stopped) => return Ok(None),
            fitted => fitted?,
        };
        let best = fitted.candidates.iter().position(|it| std::ptr::eq(it, fitted.best())).unwrap_or(0);
        let fitted = fitted.candidates.swap_remove(best);
        if !fitted.fit.verdict.explains() {
            return Err(OwnBenchError::Unexplained { verdict: fitted.fit.verdict });
        }
        let deviation = |it: &Estimate| 0.5 * (it.high / it.low).ln() / QUANTILE;
        let horn = lead.bench.drive.as_ref().map(|drive| {
            let record = read_record(&drive.input.path, RecordKind::HornTip, &drive.options)?;
            Ok::<_, MeasurementError>(Instrument::of(record, None))
        });
        let mut own = Self {
            plan,
            bench: lead.bench.clone(),
            deviations: fitted.fit.estimates.iter().map(deviation).collect(),
            fitted,
            uncertainty: lead.uncertainty,
            offset: 0.0,
            vibrometer: Instrument::of(measured.record.clone(), Some(measured.observation.noise_density)),
            horn: horn.transpose()?,
            accurate: predict::Bodies::default(),
        };
        let truth = own.fine(own.fitted.scene(0));
        let made = own.accurate.prepared(&truth)?.run(&truth, &mut |_| !stop());
        if stop() {
            return Ok(None);
        }
        let aligned = (&measured.recording, &measured.observation);
        (own.offset, _) = placed(&truth, aligned, made?.observed_velocity())?;
        Ok(Some(own))
    }

    /// Make the records `part` of a plan; fit them or bound what they say. `None` once `stop` says so.
    ///
    /// # Errors
    /// When the bodies of an experiment cannot be made ready.
    pub fn records(
        &self,
        plan: &OwnPlan,
        part: Range<usize>,
        finished: &(dyn Fn() + Sync),
        stop: &'static (dyn Fn() -> bool + Sync),
    ) -> Result<Option<Vec<OwnRecord>>, OwnBenchError> {
        let points = plan.points()[part].to_vec();
        let benches: Vec<Bench> = plan.experiments.iter().map(|experiment| self.bench_of(experiment)).collect();
        let asked = |index: usize| points.iter().any(|(experiment, ..)| *experiment == index);
        let above = self.fitted.candidate.scene().model.kind != ModelKind::Chain;
        let bodies = |(index, bench): (usize, &Bench)| {
            let scene = bench.scene_with(&[self.law()])?;
            Ok((above && asked(index)).then(|| Bodies::new(&scene, None)).transpose()?)
        };
        let bodies = benches.iter().enumerate().map(bodies).collect::<Result<Vec<_>, OwnBenchError>>()?;
        let make = |(experiment, wrong, number): (usize, Option<WrongBench>, u64)| {
            let on = (plan, &plan.experiments[experiment], &benches[experiment], bodies[experiment].as_ref());
            let made = (!stop()).then(|| self.record(on, experiment, (wrong, number), stop));
            let made = made.filter(|_| !stop());
            finished();
            made
        };
        Ok(points.into_par_iter().map(make).collect())
    }

    fn law(&self) -> String {
        format!("damping.kind={}", self.fitted.candidate.law)
    }

    /// The bench of an experiment as its fit is told.
    fn bench_of(&self, experiment: &Experiment) -> Bench {
        let mut bench = self.bench.clone();
        bench.overrides.extend(experiment.set.iter().cloned());
        if bench.drive.is_none() && experiment.level != 1.0 {
            let amplitude = experiment.level * self.fitted.candidate.scene().drive.amplitude;
            bench.overrides.push(format!("drive.amplitude={amplitude}"));
        }
        bench
    }

    /// A scene as truths are run: as long as the record, sampled finely, on finer bodies.
    fn fine(&self, mut scene: Scene) -> Scene {
        scene.output_step = 1.0 / (scene.drive.frequency * FINE as f64);
        let end = self.vibrometer.record().series.end() - self.offset + MARGIN;
        scene.duration = (end.max(MARGIN) / scene.output_step).ceil() * scene.output_step;
        if scene.model.kind == ModelKind::Reduced {
            scene.model.reduced.step = 0.5 * scene.output_step;
            let density = &mut scene.model.reduced.density;
            *density = (f64::from(*density) * FINER).round() as u32;
        }
        scene
    }

    /// A truth on `bench` under `level` times the horn's motion: from the posterior, with everything that is not controlled.
    fn truth(
        &self,
        (bench, level): (&Bench, f64),
        wrong: Option<WrongBench>,
        random: &mut ChaCha8Rng,
    ) -> Result<Truth, OwnBenchError> {
        let parameters = &self.fitted.fit.parameters;
        let unknown = self.uncertainty;
        let at = self.fitted.fit.posterior.draw(1.0, random);
        let values: Vec<f64> = parameters.iter().zip(&at).map(|(parameter, u)| parameter.value(*u)).collect();
        let uniform: [f64; 2] = [random.random_range(-1.0..1.0), random.random()];
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let [mass, modulus, gain] =
            [unknown.mass, unknown.modulus, unknown.sensitivity].map(|sigma| (sigma * normal()).exp());
        let [support, rough] = [unknown.support_stiffness, unknown.gap_scale].map(|sigma| (sigma * normal()).exp());
        let (pressed, rest) = (unknown.precompression * normal(), normal());
        let mut scene = bench.scene_with(&[self.law()])?;
        if let Some(wrong) = wrong {
            let overrides = [vec![self.law()], wrong.overrides(&scene)].concat();
            scene = bench.scene_with(&overrides).map_err(|_| OwnBenchError::Inapplicable)?;
        }
        for (parameter, value) in parameters.iter().zip(&values) {
            // A record determines forces over the mass of the beads.
            let over = if parameter.target.is_force() { mass } else { 1.0 };
            parameter.set(&mut scene, value / over);
        }
        let fits = |target| parameters.iter().any(|parameter| parameter.target == target);
        if wrong.is_some_and(|wrong| !wrong.write_into(&mut scene, parameters)) {
            return Err(OwnBenchError::Inapplicable);
        }
        if let DriveKind::Record { displacement, .. } = &mut scene.drive.kind {
            displacement.values.iter_mut().for_each(|x| *x *= level);
        }
        let mut variation = Variation::of(&scene);
        variation.amplitude_scale *= (1.0 + unknown.drive * uniform[0]) / (1.0 - unknown.droop * uniform[1]);
        let scale = unknown.gap * rough;
        for offset in &mut variation.gap_offsets {
            let normal: f64 = StandardNormal.sample(random);
            *offset = scale * normal.abs();
        }
        if self.plan.uncertainty.contains_key("baseline") && !fits(Target::Gap) {
            // Otherwise the horn's own noise moves its rest.
            variation.gap_offsets[0] += unknown.baseline * rest;
        }
        if !fits(Target::Precompression) {
            variation.precompression = (variation.precompression + pressed).abs();
        }
        if !fits(Target::SupportStiffness) {
            variation.support_stiffness_factor = support;
        }
        variation.modulus_factor = modulus;
        Ok(Truth { scene: self.fine(scene), values, variation, gain, scale })
    }

    /// The accurate velocity of a truth, from the model's t = 0.
    fn velocity(
        &self,
        truth: &Truth,
        stop: &'static (dyn Fn() -> bool + Sync),
        random: &mut ChaCha8Rng,
    ) -> Result<Series, ModelError> {
        let count = truth.scene.samples();
        let scene = truth.variation.written_over(&truth.scene, f64::abs);
        let prepared = self.accurate.prepared(&scene)?;
        let run = |scene: &Scene| {
            let trace = prepared.run(scene, &mut |_| !stop())?.observed_velocity().clone();
            Ok(truth.variation.on_the_record(trace, count))
        };
        let averages = self.vibrometer.record().averages;
        let averages = (averages > 1).then_some((averages.min(SHOTS.0), SHOTS.1));
        shots(&scene, (averages, if truth.variation.precompression > 0.0 { 0.0 } else { truth.scale }), random, &run)
    }

    fn record(
        &self,
        on: (&OwnPlan, &Experiment, &Bench, Option<&Bodies>),
        experiment: usize,
        (wrong, number): (Option<WrongBench>, u64),
        stop: &'static (dyn Fn() -> bool + Sync),
    ) -> OwnRecord {
        // The same truths, noise and seeds in every experiment: differences between them are those of the experiments.
        let mut random = ChaCha8Rng::seed_from_u64(on.0.seed);
        random.set_stream(number + 1);
        let mut made = OwnRecord { experiment, wrong, number, values: vec![], bound: None, fit: None };
        let folder = tempfile::tempdir();
        let place = folder.as_ref().map(|folder| format!("{}/", folder.path().display())).unwrap_or_default();
        let outcome = match &folder {
            Ok(folder) => self.fitted_record(on, (&mut made, folder.path()), &mut random, stop),
            Err(error) => Err(io::Error::new(error.kind(), error.to_string()).into()),
        };
        if let Err(error) = outcome {
            made.fit = Some(Err(with_causes(&error).replace(&place, "")));
        }
        made
    }

    /// Write the files of a record, read them, bound what they say and fit them.
    fn fitted_record(
        &self,
        (plan, experiment, bench, bodies): (&OwnPlan, &Experiment, &Bench, Option<&Bodies>),
        (made, folder): (&mut OwnRecord, &Path),
        random: &mut ChaCha8Rng,
        stop: &'static (dyn Fn() -> bool + Sync),
    ) -> Result<(), OwnBenchError> {
        let truth = self.truth((bench, experiment.level), made.wrong, random)?;
        let parameters = &self.fitted.fit.parameters;
        made.values = parameters.iter().zip(&truth.values).map(|(it, value)| (it.name.clone(), *value)).collect();
        let velocity = self.velocity(&truth, stop, random)?;
        let (drive, step) = (&truth.scene.drive, velocity.step);
        let bandwidth = parameters.iter().zip(&truth.values).find(|(it, _)| it.target == Target::Bandwidth);
        let lead = |series: &Series, origin: f64| {
            let samples = (((origin - series.start).max(0.0) + MARGIN) / step).ceil();
            -samples * step
        };
        let start = lead(&self.vibrometer.record().series, self.offset);
        let rest = (-start / step).round() as usize;
        let values = std::iter::repeat_n(0.0, rest).chain(velocity.values.iter().map(|v| truth.gain * v)).collect();
        let seen = Series::new(start, step, values);
        let seen = self.vibrometer.filtered(&seen, (drive.frequency, bandwidth.map(|(_, value)| *value)), random);
        // Where between two samples the trigger falls.
        let trigger = self.offset + random.random_range(-0.5..0.5) * self.vibrometer.record().series.step;
        let [horn_file, file] = NAMES.map(|name| folder.join(name));
        let (bytes, options) = self.vibrometer.file(&seen, trigger, random);
        fs::write(&file, bytes)?;
        let mut bench = bench.clone();
        if let (Some(horn), Some(recorded)) = (&self.horn, &self.bench.drive) {
            let (motion, series) = (drive.motion(1.0), &horn.record().series);
            let start = lead(series, recorded.motion.origin);
            let count = ((series.end() - recorded.motion.origin + MARGIN - start) / step).ceil() as usize;
            let at = |index: usize| {
                let (displacement, velocity) = motion.at(start + index as f64 * step);
                if horn.sees_velocity() { velocity } else { displacement }
            };
            let motion = Series::new(start, step, (0..count).map(at).collect());
            let (bytes, options) = horn.file(&motion, recorded.motion.origin, random);
            fs::write(&horn_file, bytes)?;
            bench.drive = Some(RecordedDrive::read_at_plateau(&horn_file, &options)?);
        }
        let seed = self.plan.seed.unwrap_or_default().wrapping_add(APART * (made.number + 1));
        let definition = Plan { seed: Some(seed), ..self.plan.clone() };
        let source = Source::File(file, Box::new(options));
        let problem = Problem::of(&definition, vec![RecordedRunPlan { source, bench, origin: None }])?;
        let law = &self.fitted.candidate.law;
        let candidate =
            problem.candidates.iter().find(|candidate| candidate.law == *law).unwrap_or(&problem.candidates[0]);
        if made.wrong.is_none() {
            made.bound = problem.bound(candidate, bodies, (&truth.values, &self.deviations));
        }
        // Where the waveform does not decide, the bound says nothing of a fit.
        if !plan.fits && made.bound.as_ref().is_some_and(|bound| bound.decides) {
            return Ok(());
        }
        let fitted = problem.fit(Schedule { bodies, watch: Arc::new(move |_| !stop()), ..Schedule::default() })?;
        let (best, own) = (fitted.best(), fitted.candidates.iter().find(|fitted| fitted.candidate.law == *law));
        let fit = &own.unwrap_or(best).fit;
        let rank = |(d, value): (usize, &f64)| fit.posterior.rank(d, fit.parameters[d].coordinate(*value));
        made.fit = Some(Ok(OwnFit {
            verdict: best.fit.verdict,
            p_value: best.fit.agreement.p,
            estimates: fit.estimates.clone(),
            ranks: truth.values.iter().enumerate().map(rank).collect(),
        }));
        Ok(())
    }
}
