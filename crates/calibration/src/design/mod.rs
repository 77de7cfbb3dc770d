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
pub mod record;
pub mod variations;

pub use count::{ExperimentCount, OwnCount, ParameterCoverage, deviations, wilson};
pub use experiment::{Experiment, OwnPlan};

use std::{ops::Range, path::Path, sync::Arc};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::record::{FINE, Instrument, MARGIN, shots};
use crate::{
    FittedCandidate, Plan, Problem, Schedule,
    bench::Bench,
    candidate::Candidate,
    comparison::Comparison,
    drive::RecordedDrive,
    engine::trace,
    fidelity::{Bodies, chain_below},
    fit::{Estimate, Verdict},
    forward::{Forward, Uncertainty},
    parameter::{Parameter, Target},
    predict::{
        self, EnsemblePlan,
        predicted::{predict_measured, with_causes},
        prediction::PredictionError,
        replicates::Unwatched,
    },
    recorded_run::{RecordedRun, RecordedRunPlan, Source},
    refusal::Refusal,
    waveform::{QUANTILE, WaveformBound},
};
use granchain_model::scene::{Drive, DriveKind, Integrator, ModelKind, Scene};
use granchain_record::{RecordKind, read_record, read_record_bytes};
use granchain_signal::{Series, feature::Measurand};

/// The files of a record: the horn's and the vibrometer's.
pub const NAMES: [&str; 2] = ["horn_tip.csv", "vib.csv"];

/// Mesh of a truth over that of its fit; a fit measures its own error on one 1.5 times as dense. One of 1.75 is no truth: its error moves α by 1 %.
pub const FINER: f64 = 2.5;

/// Most shots simulated for a record that is a mean, and their jitter, s.
const SHOTS: (usize, f64) = (16, 0.2e-6);

/// Step of a truth before water, s: half of that of a fit.
const WATER_STEP: f64 = 1.25e-8;

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
        "the plan: expected records of benches or drive levels of their own, fitted by the chain or the reduced model, found {found}; take another plan, \
         or --model reduced"
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
    measurand: Measurand,
    recorded: Vec<Recorded>,
    fitted: FittedCandidate,
    /// Accurate bodies of the truths.
    accurate: predict::Bodies,
    stop: Stop,
}

/// One record of the plan: its bench, and what recorded it.
struct Recorded {
    bench: Bench,
    comparison: Comparison,
    uncertainty: Uncertainty,
    /// Record time minus model time, s.
    offset: f64,
    instrument: Instrument,
    horn: Option<Instrument>,
}

/// Asked now and then whether to stop.
pub type Stop = Arc<dyn Fn() -> bool + Send + Sync>;

/// An experiment, and the bodies of its fit above the chain.
type On<'a> = (&'a Experiment, Option<&'a Bodies>);

/// What all records of one experiment have in common: values (unit coordinates), factors on mass and stiffness.
type Common = Option<(Vec<f64>, f64, f64)>;

impl OwnBench {
    /// Fit the user's plan as `calibrate` does. `None` once `stop` says so.
    ///
    /// # Errors
    /// A plan that cannot be fitted, one whose records cannot be made again, or one whose fit does not explain its record.
    pub fn fit(plan: Plan, problem: &Problem, stop: Stop) -> Result<Option<Self>, OwnBenchError> {
        let found = match problem.above.last() {
            // What such shots share beside their bench is not drawn here.
            _ if problem.lead().uncertainty.repeats > 1 => Some("several shots of one experiment"),
            Some(ModelKind::Fea) => Some("finite elements"),
            _ => None,
        };
        if let Some(found) = found {
            return Err(OwnBenchError::Unsuitable { found: found.into() });
        }
        let stopping = stop.clone();
        match problem.fit(Schedule { watch: Arc::new(move |_| !stopping()), ..Schedule::default() }) {
            Err(Refusal::Stopped) => Ok(None),
            fitted => Self::of(plan, problem, fitted?.best(), stop).map(Some),
        }
    }

    fn of(plan: Plan, problem: &Problem, fitted: &FittedCandidate, stop: Stop) -> Result<Self, OwnBenchError> {
        if !fitted.fit.verdict.explains() {
            return Err(OwnBenchError::Unexplained { verdict: fitted.fit.verdict });
        }
        let (accurate, few) = (predict::Bodies::default(), EnsemblePlan::new(2, problem.seed));
        let recorded = |(number, of): (usize, &RecordedRun)| {
            let run = predict_measured(&of.measured, &fitted.scene(number), &accurate, (&few, None), None, &Unwatched)?;
            let horn = of.bench.drive.as_ref().map(|drive| {
                let record = read_record(&drive.input.path, RecordKind::HornTip, &drive.options)?;
                Ok::<_, Refusal>(Instrument::of(record, None))
            });
            Ok::<_, OwnBenchError>(Recorded {
                bench: of.bench.clone(),
                comparison: of.comparison.clone(),
                uncertainty: of.uncertainty,
                offset: run.offset,
                instrument: Instrument::of(of.measured.record.clone(), Some(of.comparison.noise_density)),
                horn: horn.transpose()?,
            })
        };
        let recorded = problem.recorded_runs.iter().enumerate().map(recorded).collect::<Result<_, _>>()?;
        Ok(Self { plan, measurand: problem.quantity, recorded, fitted: fitted.clone(), accurate, stop })
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
                let scene = self.bench_of(0, experiment).scene_with(&experiment.misstated)?;
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

    /// The true bench of record `number` of an experiment, with the fitted law and mount.
    fn bench_of(&self, number: usize, experiment: &Experiment) -> Bench {
        let (mut bench, candidate) = (self.recorded[number].bench.clone(), &self.fitted.candidate);
        bench.overrides.push(format!("damping.kind={}", candidate.law));
        bench.overrides.extend(candidate.mount.map(|mount| format!("disc.rim={}", mount.name())));
        bench.overrides.extend(experiment.set.iter().cloned());
        if bench.drive.is_none() && experiment.level != 1.0 {
            let amplitude = experiment.level * candidate.scenes[number].drive.amplitude;
            bench.overrides.push(format!("drive.amplitude={amplitude}"));
        }
        bench
    }

    /// A truth of an experiment, drawn from the posterior with everything that is not controlled: values of the parameters, the horn's motion, and the
    /// accurate velocity or pressure as its instrument sees it, from the model's t = 0.
    fn truth(
        &self,
        number: usize,
        experiment: &Experiment,
        random: &mut ChaCha8Rng,
        common: &mut Common,
    ) -> Result<(Vec<f64>, Drive, Series), Refusal> {
        let Recorded { comparison, uncertainty, offset, instrument, .. } = &self.recorded[number];
        let drawn = self.fitted.fit.posterior.draw(1.0, random);
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let [mass, gain] = [uncertainty.mass, uncertainty.sensitivity].map(|sigma| (sigma * normal()).exp());
        let (drawn, mass, stiffness) = match common.take() {
            Some((at, mass, stiffness)) => (at, mass, Some(stiffness)),
            None => (drawn, mass, None),
        };
        let mut scene = self.bench_of(number, experiment).scene_with(&[])?;
        if let DriveKind::Record { displacement, .. } = &mut scene.drive.kind {
            displacement.values.iter_mut().for_each(|x| *x *= experiment.level);
        }
        let parameters = &self.fitted.fit.parameters;
        let values: Vec<f64> = parameters.iter().zip(&drawn).map(|(it, u)| it.value(*u)).collect();
        // A record determines forces over the mass of the beads.
        let over = |it: &Parameter| if it.target.is_force() { mass } else { 1.0 };
        let at: Vec<f64> = parameters.iter().zip(&values).map(|(it, value)| it.coordinate(value / over(it))).collect();
        let mut unknown = *uncertainty;
        if !self.plan.uncertainty.contains_key("baseline") {
            // The noise of the horn's record moves its rest.
            unknown.baseline = 0.0;
        }
        let (chain, watch) = (chain_below(&scene), Arc::new(|_| true));
        let forward = Forward::new(&chain, None, parameters.clone(), comparison.clone(), unknown, 0, watch)?;
        let mut variation = forward.variation(&at, random);
        variation.shaken.clear();
        variation.modulus_factor = stiffness.unwrap_or(variation.modulus_factor);
        *common = Some((drawn, mass, variation.modulus_factor));
        scene.output_step = 1.0 / (scene.drive.frequency * FINE as f64);
        if self.measurand == Measurand::Pressure {
            scene.model.integrator = Integrator::OnDisc { step: WATER_STEP };
            scene.output_step = 2.0 * WATER_STEP;
        }
        let end = instrument.record.series.end() - offset + MARGIN;
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
            Ok(variation.on_the_record(trace(response, self.measurand)?, scene.samples()))
        };
        let averages = Some(instrument.record.averages).filter(|count| *count > 1);
        let scale = if varied.chain.precompression > 0.0 { 0.0 } else { uncertainty.gap };
        let averages = averages.map(|count| (count.min(SHOTS.0), SHOTS.1));
        let seen = shots(&varied, (averages, scale), random, &run)?.map(|v| gain * v);
        Ok((values, scene.drive, seen))
    }

    /// The files of record `number` of an experiment, read, with the true values behind them.
    fn recorded(
        &self,
        number: usize,
        experiment: &Experiment,
        random: &mut ChaCha8Rng,
        common: &mut Common,
    ) -> Result<(Vec<f64>, RecordedRunPlan), Refusal> {
        let Recorded { bench: own, offset, instrument, horn, .. } = &self.recorded[number];
        let (values, drive, motion) = self.truth(number, experiment, random, common)?;
        let step = motion.step;
        let parameters = &self.fitted.fit.parameters;
        let bandwidth = parameters.iter().zip(&values).find(|(it, _)| it.target == Target::Bandwidth);
        let seen = instrument.at_rest_before(&motion, *offset);
        let seen = instrument.filtered(&seen, (drive.frequency, bandwidth.map(|(_, value)| *value)), random);
        // Where between two samples the trigger falls.
        let trigger = offset + random.random_range(-0.5..0.5) * instrument.record.series.step;
        let (bytes, mut options) = instrument.file(&seen, trigger, random);
        options.drive_frequency = options.drive_frequency.or(Some(drive.frequency));
        let [horn_name, name] = NAMES.map(Path::new);
        let kind = match self.measurand {
            Measurand::Velocity => RecordKind::Vibrometer,
            Measurand::Pressure => RecordKind::Hydrophone,
        };
        let record = read_record_bytes(name, &bytes, Some(kind), &options)?;
        let mut bench = self.bench_of(number, experiment);
        bench.overrides.extend(experiment.misstated.iter().cloned());
        if let (Some(horn), Some(recorded)) = (horn, &own.drive) {
            let (motion, origin) = (drive.motion(1.0), recorded.motion.origin);
            let count = ((horn.record.series.end() - origin + MARGIN) / step).ceil() as usize;
            let at = |index: usize| motion.at(index as f64 * step);
            let seen = (0..count).map(|index| if horn.sees_velocity() { at(index).1 } else { at(index).0 }).collect();
            let motion = horn.at_rest_before(&Series::new(0.0, step, seen), origin);
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
        let (mut common, mut recorded, mut values) = (None, Vec::new(), Vec::new());
        let as_recorded = experiment.added.then(Experiment::as_recorded);
        for experiment in as_recorded.iter().chain([experiment]) {
            for number in 0..self.recorded.len() {
                let (own, shot) = self.recorded(number, experiment, random, &mut common)?;
                recorded.push(shot);
                values = own;
            }
        }
        let parameters = &self.fitted.fit.parameters;
        made.values = parameters.iter().zip(&values).map(|(it, value)| (it.name.clone(), *value)).collect();
        let seed = self.plan.seed.unwrap_or_default().wrapping_add(APART * (made.number + 1));
        let damping = self.plan.damping.clone().filter(|_| experiment.wrong.is_none());
        let definition = Plan { seed: Some(seed), damping, ..self.plan.clone() };
        let problem = Problem::of(&definition, recorded)?;
        let own = |it: &&Candidate| it.law == self.fitted.candidate.law && it.mount == self.fitted.candidate.mount;
        let candidate = problem.candidates.iter().find(own).unwrap_or(&problem.candidates[0]);
        if experiment.wrong.is_none() && self.measurand == Measurand::Velocity {
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
        let (best, own) = (fitted.best(), fitted.candidates.iter().find(|it| own(&&it.candidate)));
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
