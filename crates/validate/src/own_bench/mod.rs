//! Coverage on the user's own bench: records made at values that the user's fit allows, fitted by the calls that fitted the user's record.
//!
//! ```text
//! plan, record ─ fit ─ posterior ─► truth ─ accurate run ─► files ─ reader ─► Problem ─ bound, fit ─► OwnCount
//! ```
//!
//! Truths are drawn from the posterior, and what the laboratory does not control as the plan's `[uncertainty]` says. The horn moves as it was measured
//! to move, times its level. No integrator of a fit makes a truth: the chain is integrated adaptively with located contacts, elastic bodies on a finer
//! mesh at half the step.

mod count;
mod experiment;
mod record;

pub(crate) use count::deviations;
pub use count::{ExperimentCount, OwnCount, ParameterCoverage};
pub use experiment::{Experiment, OwnPlan};

use std::{ops::Range, path::Path, sync::Arc};

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
    comparison::Comparison,
    drive::RecordedDrive,
    fidelity::{Bodies, chain_below},
    fit::{Estimate, Verdict},
    forward::{Forward, Uncertainty},
    measured::Measured,
    parameter::{Parameter, Target},
    predict::{
        self, EnsemblePlan,
        predicted::{predict_measured, with_causes},
        prediction::PredictionError,
        replicates::Unwatched,
    },
    recorded_run::{RecordedRunPlan, Source},
    refusal::Refusal,
    waveform::{QUANTILE, WaveformBound},
};
use granchain_model::scene::{Drive, DriveKind, ModelKind, Scene};
use granchain_record::{Record, RecordKind, read_record, read_record_bytes};
use granchain_signal::{Series, feature::Measurand};

/// Most shots simulated for a record that is a mean, and their jitter, s.
const SHOTS: (usize, f64) = (16, 0.2e-6);

/// Distance of the seeds of two fits.
const APART: u64 = 1000;

/// One record made on the user's bench.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnRecord {
    /// Index of the experiment.
    pub experiment: usize,
    pub number: u64,
    /// True values of the fitted parameters, SI, by name.
    pub values: Vec<(String, f64)>,
    /// What the waveform could say at these values; absent where it cannot be compared.
    pub bound: Option<WaveformBound>,
    /// The fit, or why there is none; absent if only the bound was requested.
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
        "the plan: expected one velocity record, fitted by the chain or the reduced model, found {found}; take another plan, or --model reduced"
    )]
    Unsuitable { found: String },
    #[error(
        "the plan's own fit is `{verdict}`: expected one that explains the record, since its values are the true ones of all further records; correct \
         the bench first (granchain calibrate --plan FILE)"
    )]
    Unexplained { verdict: Verdict },
    #[error(transparent)]
    Refused(#[from] Refusal),
    #[error("the record cannot be aligned with its own fit")]
    Placed(#[from] PredictionError),
}

/// The user's bench with its fit, ready to make records.
pub struct OwnBench {
    plan: Plan,
    bench: Bench,
    comparison: Comparison,
    uncertainty: Uncertainty,
    fitted: FittedCandidate,
    /// Record time minus model time, s.
    offset: f64,
    vibrometer: Instrument,
    horn: Option<Instrument>,
    /// Accurate bodies of the truths.
    accurate: predict::Bodies,
    stop: Stop,
}

/// Asked now and then whether to stop.
pub type Stop = Arc<dyn Fn() -> bool + Send + Sync>;

/// An experiment, and the bodies of its fit above the chain.
type On<'a> = (&'a Experiment, Option<&'a Bodies>);

/// What two records of one bench have in common: values (unit coordinates), factors on mass and stiffness.
type Common = Option<(Vec<f64>, f64, f64)>;

/// The record of a problem whose bench can be made again.
///
/// # Errors
/// [`OwnBenchError::Unsuitable`].
pub fn record_of(problem: &Problem) -> Result<&Record, OwnBenchError> {
    let found = match (&problem.lead().measured, problem.above.last()) {
        _ if problem.recorded_runs.len() > 1 => format!("{} records", problem.recorded_runs.len()),
        _ if problem.quantity != Measurand::Velocity => "a pressure".into(),
        (_, Some(ModelKind::Fea)) => "finite elements".into(),
        (Measured::Published(_), _) => "published values".into(),
        (Measured::Record(measured), _) => return Ok(&measured.record),
    };
    Err(OwnBenchError::Unsuitable { found })
}

impl OwnBench {
    /// Fit the user's plan as `calibrate` does. `None` once `stop` says so.
    ///
    /// # Errors
    /// A plan of other records, one that cannot be fitted, or one whose fit does not explain its record.
    pub fn fit(plan: Plan, problem: &Problem, stop: Stop) -> Result<Option<Self>, OwnBenchError> {
        record_of(problem)?;
        let stopping = stop.clone();
        match problem.fit(Schedule { watch: Arc::new(move |_| !stopping()), ..Schedule::default() }) {
            Err(Refusal::Stopped) => Ok(None),
            fitted => Self::of(plan, problem, fitted?.best(), stop).map(Some),
        }
    }

    /// The same of a fit that is made.
    ///
    /// # Errors
    /// As [`OwnBench::fit`].
    pub fn of(plan: Plan, problem: &Problem, fitted: &FittedCandidate, stop: Stop) -> Result<Self, OwnBenchError> {
        let (lead, record) = (problem.lead(), record_of(problem)?);
        if !fitted.fit.verdict.explains() {
            return Err(OwnBenchError::Unexplained { verdict: fitted.fit.verdict });
        }
        let (accurate, few) = (predict::Bodies::default(), EnsemblePlan::new(2, problem.seed));
        let run = predict_measured(&lead.measured, &fitted.scene(0), &accurate, (&few, None), None, &Unwatched)?;
        let horn = lead.bench.drive.as_ref().map(|drive| {
            let record = read_record(&drive.input.path, RecordKind::HornTip, &drive.options)?;
            Ok::<_, Refusal>(Instrument::of(record, None))
        });
        Ok(Self {
            plan,
            bench: lead.bench.clone(),
            comparison: lead.comparison.clone(),
            uncertainty: lead.uncertainty,
            fitted: fitted.clone(),
            offset: run.offset,
            vibrometer: Instrument::of(record.clone(), Some(lead.comparison.noise_density)),
            horn: horn.transpose()?,
            accurate,
            stop,
        })
    }

    /// Make the records `part` of a plan; bound what they say, or fit them. `None` once it is stopped.
    ///
    /// # Errors
    /// When the bodies of an experiment cannot be made ready.
    pub fn records(
        &self,
        plan: &OwnPlan,
        part: Range<usize>,
        finished: &(dyn Fn() + Sync),
    ) -> Result<Option<Vec<OwnRecord>>, Refusal> {
        let above = self.fitted.candidate.scene().model.kind != ModelKind::Chain;
        let mut prepared: Vec<(&Experiment, Bodies)> = Vec::new();
        let alike = |a: &Experiment, b: &Experiment| a.set == b.set && a.misstated == b.misstated;
        for experiment in part.clone().map(|point| plan.experiment(point).1).filter(|_| above) {
            if prepared.iter().all(|(other, _)| !alike(other, experiment)) {
                let scene = self.bench_of(experiment).scene_with(&experiment.misstated)?;
                prepared.push((experiment, Bodies::new(&scene, None)?));
            }
        }
        let make = |point: usize| {
            let (index, experiment, number) = plan.experiment(point);
            let bodies = prepared.iter().find(|(other, _)| alike(other, experiment)).map(|(_, bodies)| bodies);
            let mut made = OwnRecord { experiment: index, number, values: vec![], bound: None, fit: None };
            if !(self.stop)() {
                if let Err(error) = self.record((experiment, bodies), plan, &mut made) {
                    made.fit = Some(Err(with_causes(&error)));
                }
                finished();
            }
            (!(self.stop)()).then_some(made)
        };
        Ok(part.into_par_iter().map(make).collect())
    }

    /// The true bench of an experiment, with the fitted law.
    fn bench_of(&self, experiment: &Experiment) -> Bench {
        let mut bench = self.bench.clone();
        bench.overrides.push(format!("damping.kind={}", self.fitted.candidate.law));
        bench.overrides.extend(experiment.set.iter().cloned());
        if bench.drive.is_none() && experiment.level != 1.0 {
            let amplitude = experiment.level * self.fitted.candidate.scene().drive.amplitude;
            bench.overrides.push(format!("drive.amplitude={amplitude}"));
        }
        bench
    }

    /// A truth of an experiment, drawn from the posterior with everything that is not controlled: values of the parameters, the horn's motion, and the
    /// accurate velocity as the vibrometer sees it, from the model's t = 0.
    fn truth(
        &self,
        experiment: &Experiment,
        random: &mut ChaCha8Rng,
        common: &mut Common,
    ) -> Result<(Vec<f64>, Drive, Series), Refusal> {
        let drawn = self.fitted.fit.posterior.draw(1.0, random);
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let [mass, gain] = [self.uncertainty.mass, self.uncertainty.sensitivity].map(|sigma| (sigma * normal()).exp());
        let (drawn, mass, stiffness) = match common.take() {
            Some((at, mass, stiffness)) => (at, mass, Some(stiffness)),
            None => (drawn, mass, None),
        };
        let mut scene = self.bench_of(experiment).scene_with(&[])?;
        if let DriveKind::Record { displacement, .. } = &mut scene.drive.kind {
            displacement.values.iter_mut().for_each(|x| *x *= experiment.level);
        }
        let parameters = &self.fitted.fit.parameters;
        let values: Vec<f64> = parameters.iter().zip(&drawn).map(|(it, u)| it.value(*u)).collect();
        // A record determines forces over the mass of the beads.
        let over = |it: &Parameter| if it.target.is_force() { mass } else { 1.0 };
        let at: Vec<f64> = parameters.iter().zip(&values).map(|(it, value)| it.coordinate(value / over(it))).collect();
        let mut unknown = self.uncertainty;
        if !self.plan.uncertainty.contains_key("baseline") {
            // The noise of the horn's record moves its rest.
            unknown.baseline = 0.0;
        }
        let (chain, watch) = (chain_below(&scene), Arc::new(|_| true));
        let forward = Forward::new(&chain, None, parameters.clone(), self.comparison.clone(), unknown, 0, watch)?;
        let mut variation = forward.variation(&at, random);
        variation.shaken.clear();
        variation.modulus_factor = stiffness.unwrap_or(variation.modulus_factor);
        *common = Some((drawn, mass, variation.modulus_factor));
        scene.output_step = 1.0 / (scene.drive.frequency * FINE as f64);
        let end = self.vibrometer.record.series.end() - self.offset + MARGIN;
        scene.duration = (end.max(MARGIN) / scene.output_step).ceil() * scene.output_step;
        if scene.model.kind == ModelKind::Reduced {
            scene.model.reduced.step = 0.5 * scene.output_step;
            let density = &mut scene.model.reduced.density;
            *density = (f64::from(*density) * FINER).round() as u32;
        }
        let varied = variation.written_over(&scene, f64::abs);
        let prepared = self.accurate.prepared(&varied)?;
        let run = |varied: &Scene| {
            let response = prepared.run(varied, &mut |_| !(self.stop)())?;
            Ok(variation.on_the_record(response.observed_velocity().clone(), scene.samples()))
        };
        let averages = Some(self.vibrometer.record.averages).filter(|count| *count > 1);
        let scale = if varied.chain.precompression > 0.0 { 0.0 } else { self.uncertainty.gap };
        let averages = averages.map(|count| (count.min(SHOTS.0), SHOTS.1));
        let velocity = shots(&varied, (averages, scale), random, &run)?.map(|v| gain * v);
        Ok((values, scene.drive, velocity))
    }

    /// The files of an experiment, read, with the true values behind them.
    fn recorded(
        &self,
        experiment: &Experiment,
        random: &mut ChaCha8Rng,
        common: &mut Common,
    ) -> Result<(Vec<f64>, RecordedRunPlan), Refusal> {
        let (values, drive, velocity) = self.truth(experiment, random, common)?;
        let parameters = &self.fitted.fit.parameters;
        let bandwidth = parameters.iter().zip(&values).find(|(it, _)| it.target == Target::Bandwidth);
        let seen = self.vibrometer.at_rest_before(&velocity, self.offset);
        let seen = self.vibrometer.filtered(&seen, (drive.frequency, bandwidth.map(|(_, value)| *value)), random);
        // Where between two samples the trigger falls.
        let trigger = self.offset + random.random_range(-0.5..0.5) * self.vibrometer.record.series.step;
        let (bytes, mut options) = self.vibrometer.file(&seen, trigger, random);
        options.drive_frequency = options.drive_frequency.or(Some(drive.frequency));
        let [horn_name, name] = NAMES.map(Path::new);
        let record = read_record_bytes(name, &bytes, Some(RecordKind::Vibrometer), &options)?;
        let mut bench = self.bench_of(experiment);
        bench.overrides.extend(experiment.misstated.iter().cloned());
        if let (Some(horn), Some(recorded)) = (&self.horn, &self.bench.drive) {
            let (motion, origin) = (drive.motion(1.0), recorded.motion.origin);
            let count = ((horn.record.series.end() - origin + MARGIN) / velocity.step).ceil() as usize;
            let at = |index: usize| motion.at(index as f64 * velocity.step);
            let seen = (0..count).map(|index| if horn.sees_velocity() { at(index).1 } else { at(index).0 }).collect();
            let motion = horn.at_rest_before(&Series::new(0.0, velocity.step, seen), origin);
            let (bytes, options) = horn.file(&motion, origin, random);
            bench.drive = Some(RecordedDrive::of_bytes_at_plateau(horn_name, &bytes, &options)?);
        }
        let source = Source::Record(Box::new(record), Box::new(options));
        Ok((values, RecordedRunPlan { source, bench, origin: None }))
    }

    /// Make one record, or one besides that of the bench as it was recorded: what is bound by it, its fit.
    fn record(&self, (experiment, bodies): On, plan: &OwnPlan, made: &mut OwnRecord) -> Result<(), Refusal> {
        // The same truths, noise and seeds in every experiment: what differs between them is due to the experiments.
        let random = &mut ChaCha8Rng::seed_from_u64(plan.seed);
        random.set_stream(made.number + 1);
        let (mut common, mut recorded) = (None, Vec::new());
        if experiment.added {
            recorded.push(self.recorded(&Experiment::as_recorded(), random, &mut common)?.1);
        }
        let (values, latest) = self.recorded(experiment, random, &mut common)?;
        recorded.push(latest);
        let parameters = &self.fitted.fit.parameters;
        made.values = parameters.iter().zip(&values).map(|(it, value)| (it.name.clone(), *value)).collect();
        let seed = self.plan.seed.unwrap_or_default().wrapping_add(APART * (made.number + 1));
        let damping = self.plan.damping.clone().filter(|_| experiment.wrong.is_none());
        let definition = Plan { seed: Some(seed), damping, ..self.plan.clone() };
        let problem = Problem::of(&definition, recorded)?;
        let law = &self.fitted.candidate.law;
        let candidate = problem.candidates.iter().find(|it| it.law == *law).unwrap_or(&problem.candidates[0]);
        if experiment.wrong.is_none() {
            let deviation = |it: &Estimate| 0.5 * (it.high / it.low).ln() / QUANTILE;
            let deviations: Vec<f64> = self.fitted.fit.estimates.iter().map(deviation).collect();
            made.bound = problem.bound(candidate, bodies, (&values, &deviations));
        }
        // Where the waveform does not decide, the bound says nothing of a fit.
        if !plan.fits && made.bound.as_ref().is_some_and(|bound| bound.decides) {
            return Ok(());
        }
        let stop = self.stop.clone();
        let fitted = problem.fit(Schedule { bodies, watch: Arc::new(move |_| !stop()), ..Schedule::default() })?;
        let (best, own) = (fitted.best(), fitted.candidates.iter().find(|it| it.candidate.law == *law));
        let fit = &own.unwrap_or(best).fit;
        let rank = |(d, value): (usize, &f64)| fit.posterior.rank(d, fit.parameters[d].coordinate(*value));
        made.fit = Some(Ok(OwnFit {
            verdict: best.fit.verdict,
            p_value: best.fit.agreement.p,
            estimates: fit.estimates.clone(),
            ranks: values.iter().enumerate().filter(|_| experiment.wrong.is_none()).map(rank).collect(),
        }));
        Ok(())
    }
}
