//! Likely causes if the model does not explain a record: each cause is assumed in turn, and its p-value is computed.
//!
//! 1. Without a new run: a wrong sign, a factor on all amplitudes, the clock (seen in what the fit leaves of the waveform).
//! 2. Every other cause is looked for by its features: powers of ten (a unit), the horn's sign, one bead more or fewer, beads of another radius,
//!    modulus or material, faces of other materials, another support, an open first gap, friction in the guide, other damping laws.
//! 3. Where the fit saw the waveform too, short runs about these answers tell which come near the record's first cycles, and the nearest are fitted, two
//!    at a time, until one explains the record and the next are farther off, or the budget of runs is spent.
//!
//! Causes that explain the record are named, most likely first; no others are. Causes that explain it about equally well are marked as equivalent.

mod suspect;

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::suspect::Suspect;
use super::{
    agreement::{Agreement, DOUBTFUL},
    comparison::Comparison,
    drive::HornNoise,
    fit::{Fit, Standing, standing},
    forward::{Forward, Uncertainty, Watch},
    likelihood::{TrainingRuns, neighbours},
    parameter::{Parameter, Target},
    posterior::Posterior,
    search::Search,
    statement::p_value,
    waveform::{self, CLOCK, Clock, Compared, QUANTILE, Start, WaveformFit},
};
use granchain_model::{
    self as model,
    chain::FiniteBodyLaws,
    scene::{DampingKind, Scene},
};
use granchain_signal::{
    Series,
    number::{engineering, significant},
    spline::{Ends, Spline},
};

/// p above which the search for causes stops, and the misfit of the next one over that of the best so far from which it cannot be as good.
const EXPLAINED: (f64, f64) = (0.3, 2.0);

/// Most runs of a search for causes, short ones and long ones.
const BUDGET: usize = 16_000;

/// Most causes, by their features, that short runs are made for.
const SHORT: usize = 16;

const NAMED: usize = 3;

/// Most causes named if all explain the record equally well.
const EQUIVALENT: usize = 6;

/// Share of the best cause's p above which another cause is equivalent.
const AS_WELL: f64 = 0.3;

/// Runs of a search for one cause by features, and where its waveform is compared after that; half as many again with a third parameter.
const RUNS: usize = 200;
const RUNS_BEFORE: usize = 130;

/// Causes, the best by their features, whose waveform is compared however badly these fit.
const AT_LEAST: usize = 4;

/// Share of the misfit that the nearest cause leaves at most, where none explains the record.
const NEAREST: f64 = 0.1;

/// Least difference of two clocks that is looked for.
const LEAST_CLOCK: f64 = 2e-4;

/// Standard deviation of a clock that was corrected already.
const CLOCK_LEFT: f64 = 10.0 * CLOCK;

/// Predictable cycles from which an average of several shots is that of one.
const STEADY: f64 = 20.0;

/// Factor by which p must grow for a cause that leaves the verdict doubtful.
const BETTER: f64 = 30.0;

/// Least p of a named cause.
const LEAST: f64 = 0.01;

/// Standard deviation of ln of a free factor.
const ANY_FACTOR: f64 = 3.0;

/// Least |ln| of a factor that is reported: larger than the calibration error of any vibrometer.
const FACTOR: f64 = 0.1;

/// Assumed number of shots of an unstated average.
const SHOTS: usize = 8;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// Sign of the record.
    Sign,
    /// Sign of the horn record.
    HornSign,
    /// A factor on all amplitudes.
    Scale,
    Beads,
    Radius,
    /// Young's modulus or density of the beads.
    Modulus,
    Material,
    /// The faces of piston or support, rigid or of the beads' material.
    Ends,
    /// The face of the horn, of another material than the beads.
    HornFace,
    /// The stiffness of the support.
    Support,
    /// The gap before the first bead, or rough contacts.
    Gap,
    /// Friction in the bead guide.
    Friction,
    DampingLaw,
    /// The clock of the vibrometer against the horn's.
    Clock,
    /// The record is an average of several shots.
    Averages,
    /// A warning of the reader: overload, drift, noise, a truncated record.
    Record,
}

/// A cause that explains a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    pub cause: Cause,
    /// p-value under this cause; absent if it was not computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// Finding and remedy, as text.
    pub text: String,
    /// Whether the record cannot distinguish it from the most likely cause.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub equivalent: bool,
}

impl Finding {
    pub(crate) fn new(cause: Cause, p_value: Option<f64>, text: String) -> Self {
        Self { cause, p_value, text, equivalent: false }
    }
}

/// The first record, as fitted.
pub(crate) struct Case<'a> {
    /// The scene on the chain, with the fitted law.
    pub scene: &'a Scene,
    /// Contact laws of its bodies, if known.
    pub laws: Option<&'a FiniteBodyLaws>,
    /// What its runs are compared with.
    pub comparison: &'a Comparison,
    /// The record at the comparison's samples.
    pub trace: &'a Series,
    /// Residual noise of the horn's motion.
    pub(crate) noise: Option<HornNoise>,
    pub parameters: &'a [Parameter],
    pub uncertainty: Uncertainty,
    pub seed: u64,
    /// Fit of the top fidelity level.
    pub fit: &'a Fit,
    /// Receives the progress of every search and can stop it.
    pub watch: Arc<Watch>,
}

/// What a search for causes found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Diagnosis {
    /// Likely causes, most likely first.
    pub findings: Vec<Finding>,
    /// Whether the search was stopped: then it names none.
    pub stopped: bool,
    /// Runs that it made.
    pub runs: usize,
}

/// Hears what is looked for next.
pub type Listener<'a> = &'a dyn Fn(&str);

/// A suspect with what makes its runs, and the answer of its features.
struct Looked {
    suspect: Suspect,
    forward: Forward,
    standing: Standing,
}

/// The same with where a fit of its waveform begins, and the misfit there.
struct Raced {
    looked: Looked,
    start: Start,
    misfit: f64,
}

impl Case<'_> {
    /// Up to three causes, most likely first; `warned` lists the reader's warnings, `listener` hears what is looked for.
    pub(crate) fn diagnose(&self, warned: &[String], listener: Listener) -> Diagnosis {
        listener("sign, factors and clock, from the runs of the fit");
        let (mut findings, mut suspects) = (Vec::new(), Vec::new());
        for (suspect, p) in [self.sign(), self.scale()].into_iter().flatten() {
            if self.sees_waveform() { suspects.push(suspect) } else { findings.push(self.finding(&suspect, p, &[])) }
        }
        let mut runs = 0;
        if let Some((finding, made)) = self.clock() {
            findings.extend(finding);
            runs += made;
        }
        // A record that is explained, but for its clock, has no other cause.
        if self.fit.agreement.p < DOUBTFUL {
            suspects.extend(self.suspects());
        }
        listener(&format!("{} others, by features", suspects.len()));
        let mut looked: Vec<Looked> =
            two_at_a_time(suspects, |suspect| self.looked(suspect)).into_iter().flatten().collect();
        runs += looked.iter().map(|looked| self.features_runs(&looked.forward)).sum::<usize>();
        looked.sort_by(|a, b| b.standing.p.total_cmp(&a.standing.p));
        let count = looked.iter().filter(|looked| self.worth(looked.standing.p)).count();
        if self.sees_waveform() {
            looked.truncate(count.clamp(AT_LEAST, SHORT));
            listener(&format!("{} of them, by short runs", looked.len()));
            runs += looked.len() * waveform::QUICK_RUNS;
            let mut raced: Vec<Raced> =
                two_at_a_time(looked, |looked| self.raced(looked)).into_iter().flatten().collect();
            raced.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
            runs = self.fitted(raced, runs, listener, &mut findings);
        } else {
            let named = looked.iter().take(count);
            named.for_each(|it| add(&mut findings, self.finding(&it.suspect, it.standing.p, &it.standing.values)));
        }
        let explained = self.fit.agreement.p >= DOUBTFUL || findings.iter().any(explains);
        if !explained && runs + SHOTS * 3 * RUNS / 2 <= BUDGET && (self.watch)(0) {
            listener("a mean of several shots");
            let (finding, made) = self.averaged();
            findings.extend(finding);
            runs += made;
        }
        if !(self.watch)(0) {
            return Diagnosis { findings: Vec::new(), stopped: true, runs };
        }
        findings.sort_by(|a, b| b.p_value.unwrap_or(0.0).total_cmp(&a.p_value.unwrap_or(0.0)));
        let best = findings.first().and_then(|finding| finding.p_value).unwrap_or(0.0);
        for finding in findings.iter_mut().skip(1) {
            finding.equivalent = finding.p_value.is_some_and(|p| p >= DOUBTFUL && p >= AS_WELL * best);
        }
        let equivalent = findings.iter().filter(|finding| finding.equivalent).count();
        let record = warned.iter().map(|text| Finding::new(Cause::Record, None, text.clone()));
        // What is seen in a record comes before what would mend the model, which may only make up for it.
        let mut all: Vec<Finding> = record.take(NAMED - usize::from(!findings.is_empty())).collect();
        findings.truncate(NAMED.max(1 + equivalent).saturating_sub(all.len()).clamp(1, EQUIVALENT));
        all.extend(findings);
        Diagnosis { findings: all, stopped: false, runs }
    }

    /// Fits the waveforms of causes, the nearest first, as far as the budget goes; the runs made so far.
    fn fitted(&self, raced: Vec<Raced>, mut runs: usize, listener: Listener, findings: &mut Vec<Finding>) -> usize {
        // A clock that is seen and explains all needs no model that makes up for it.
        let mut best = findings.iter().find_map(|finding| Some((finding.p_value.filter(|p| *p >= EXPLAINED.0)?, 0.0)));
        let mut rough = None;
        let own = self.fit.waveform.as_ref().filter(|own| own.decides());
        let mut nearest: Option<(f64, Finding)> = None;
        let mut rest = raced.into_iter().peekable();
        while let Some(next) = rest.peek() {
            let cannot = best.is_some_and(|(p, misfit)| p >= EXPLAINED.0 && next.misfit > EXPLAINED.1 * misfit);
            if cannot || runs + 2 * waveform::HURRIED_RUNS > BUDGET || !(self.watch)(0) {
                break;
            }
            let pair: Vec<Raced> = rest.by_ref().take(2).collect();
            let named: Vec<&str> = pair.iter().map(|raced| raced.looked.suspect.cause.words()).collect();
            listener(&named.join(" and "));
            let tried = two_at_a_time(pair, |raced| {
                let found = self.waveform(&raced);
                (raced, found)
            });
            for (Raced { looked, misfit, .. }, found) in tried {
                let Some(found) = found else {
                    // What the waveform cannot be fitted with is no cause.
                    runs += waveform::HURRIED_RUNS;
                    continue;
                };
                runs += found.runs as usize;
                let p = found.with_amplitudes(looked.standing.p);
                if looked.suspect.gaps.is_none() {
                    best = best.filter(|(best, _)| *best >= p).or(Some((p, misfit)));
                }
                let at = looked.forward.parameters.iter().zip(&found.at);
                let at: Vec<f64> = at.map(|(parameter, u)| parameter.value(*u)).collect();
                let values = if found.decides() { &at } else { &looked.standing.values };
                if self.worth(p) && looked.suspect.gaps.is_some() {
                    rough = Some(self.finding(&looked.suspect, p, values));
                } else if self.worth(p) {
                    add(findings, self.finding(&looked.suspect, p, values));
                } else if let Some(own) = own.filter(|own| found.decides() && found.cycles >= own.cycles - 1.0)
                    && found.reduced < nearest.as_ref().map_or(NEAREST * own.reduced, |(least, _)| *least)
                {
                    let text = format!(
                        "nearest, though not all of it: {}. It leaves {} times the noise's mean square, instead of {} times",
                        (looked.suspect.describe)(values),
                        significant(found.reduced, 3),
                        significant(own.reduced, 3)
                    );
                    nearest = Some((found.reduced, Finding::new(looked.suspect.cause, None, text)));
                }
            }
        }
        // Wide gaps make room for other faults too: they are named where nothing else explains the record.
        if !findings.iter().any(explains) {
            rough.into_iter().for_each(|finding| add(findings, finding));
        }
        if findings.is_empty() {
            findings.extend(nearest.map(|(_, finding)| finding));
        }
        runs
    }

    fn finding(&self, suspect: &Suspect, p: f64, values: &[f64]) -> Finding {
        let [with, without] = [p, self.fit.agreement.p].map(p_value);
        let text = format!("{}: with it p is {with}, without {without}", (suspect.describe)(values));
        Finding::new(suspect.cause, Some(p), text)
    }

    /// A record of the other sign, with p by the runs of the fit.
    fn sign(&self) -> Option<(Suspect, f64)> {
        let turned = self.comparison.fingerprint.measure(&self.trace.map(|value| -value)).ok()?;
        let p = self.judged(&turned, 0.0)?.p;
        let [low, high] = self.comparison.clipped;
        let clipped = [high.map(|limit| -limit), low.map(|limit| -limit)];
        let comparison = Comparison { features: turned, clipped, ..self.comparison.clone() };
        let text = "the record's sign (invert=true); velocities are positive from piston to support";
        let suspect = Suspect::said(Cause::Sign, self.scene.clone(), text);
        self.worth(p).then_some((Suspect { compared: Some((comparison, -1.0)), ..suspect }, p))
    }

    fn scale(&self) -> Option<(Suspect, f64)> {
        let Judgement { p, factor } = self.judged(&self.comparison.features, ANY_FACTOR)?;
        let factor = factor.filter(|factor| factor.ln().abs() > FACTOR && self.worth(p))?;
        let text = format!(
            "a factor of {factor:.3} on all amplitudes (the peak is {}); check the unit of the column and the sensitivity (--unit, --scale)",
            self.peak()
        );
        let compared = Some((self.comparison.scaled(1.0 / factor), 1.0 / factor));
        Some((Suspect { compared, ..Suspect::said(Cause::Scale, self.scene.clone(), text) }, p))
    }

    /// The record's peak with its unit.
    fn peak(&self) -> String {
        let comparison = self.comparison;
        let peak = comparison.features.first().map_or(0.0, |z| comparison.amplitude(0, *z));
        engineering(peak, comparison.unit(0), 3)
    }

    /// Another clock of the record, where what the fit leaves of its waveform looks like it, and the runs about the same answer that make sure.
    fn clock(&self) -> Option<(Option<Finding>, usize)> {
        let fit = self.fit.waveform.as_ref().filter(|_| self.sees_waveform())?;
        let seen = fit.residuals.first()?.clock;
        let is_one = seen.explains_much() && seen.differs_by(LEAST_CLOCK);
        let other = fit.clock_seen(0).is_some();
        if !is_one && !other {
            return None;
        }
        let forward = self.forward(self.scene, self.parameters.to_vec(), self.comparison.clone(), None)?;
        let trace = on_other_clock(self.trace, seen.late);
        let compared = Compared { clock: CLOCK_LEFT, ..self.compared(&forward, &trace) };
        let of = |estimate: &super::estimate::Estimate| 0.5 * (estimate.high / estimate.low).ln() / QUANTILE;
        let deviations: Vec<f64> = self.fit.estimates.iter().map(of).collect();
        let found = waveform::hurried(compared, Err((&self.fit.most_likely, &deviations)), self.seed);
        let Some(found) = found else { return Some((None, waveform::PLACED_RUNS)) };
        let p = found.with_amplitudes(self.judged(&self.comparison.features, 0.0)?.p);
        let late = seen.late + found.residuals.first().map_or(0.0, |residual| residual.clock.late);
        let text = format!(
            "the clock of the vibrometer, {:.3} % {} against the horn's (check the sample rates and time columns of both files)",
            100.0 * late.abs(),
            Clock { late, ..seen }.direction()
        );
        let suspect = Suspect::said(Cause::Clock, self.scene.clone(), text);
        let finding = (self.worth(p) || other && p >= DOUBTFUL).then(|| self.finding(&suspect, p, &[]));
        Some((finding, waveform::PLACED_RUNS + found.runs as usize))
    }

    /// An average of several shots, which weakens and smooths whatever differs from shot to shot; nothing where that is little.
    fn averaged(&self) -> (Option<Finding>, usize) {
        let steady = self.fit.waveform.as_ref().is_some_and(|waveform| waveform.cycles > STEADY);
        if self.comparison.averages > 1 || steady {
            return (None, 0);
        }
        let text = format!("a mean of several shots (averages=N), here of {SHOTS}");
        let suspect = Suspect::said(Cause::Averages, self.scene.clone(), text);
        let comparison = Comparison { averages: SHOTS, ..self.comparison.clone() };
        let forward =
            self.parameters(self.scene).and_then(|parameters| self.forward(self.scene, parameters, comparison, None));
        let Some(forward) = forward else { return (None, 0) };
        let found = self.by_features(&forward).filter(|found| self.worth(found.p));
        (found.map(|found| self.finding(&suspect, found.p, &[])), SHOTS * self.features_runs(&forward))
    }

    /// Whether a waveform was compared, and what the model that answers changes of the chain is known.
    fn sees_waveform(&self) -> bool {
        let known = |waveform: &WaveformFit| self.fit.below.is_none() || waveform.difference.is_some();
        self.fit.waveform.as_ref().is_some_and(known)
    }

    /// Runs of a scene on the chain; `None` where it cannot be run, or the search was stopped.
    fn forward(
        &self,
        scene: &Scene,
        parameters: Vec<Parameter>,
        comparison: Comparison,
        gaps: Option<f64>,
    ) -> Option<Forward> {
        if !(self.watch)(0) {
            return None;
        }
        let own = self.scene;
        let ends = |of: &Scene| (of.piston, of.piston_material.clone(), of.support.clone());
        let laws = match self.laws {
            _ if !scene.has_fitted_laws() => None,
            // Other beads and other ends are other bodies.
            Some(laws) if scene.chain.beads == own.chain.beads && ends(scene) == ends(own) => Some(laws.clone()),
            _ => model::prepare(scene).ok()?.contact_laws().cloned(),
        };
        let watch = Arc::clone(&self.watch);
        let uncertainty = Uncertainty { gap: gaps.unwrap_or(self.uncertainty.gap), ..self.uncertainty };
        Forward::new(scene, laws.as_ref(), parameters, comparison, uncertainty, self.seed, watch).ok()
    }

    /// The record's waveform `trace` against these runs.
    fn compared<'a>(&self, forward: &'a Forward, trace: &'a Series) -> Compared<'a> {
        let above = self.fit.waveform.as_ref().and_then(|waveform| waveform.difference.as_ref());
        let difference = above.map(|difference| Arc::new(difference.altered()));
        Compared { forward, noise: self.noise.clone(), trace, difference, clock: CLOCK }
    }

    /// The parameters of the fit in another scene; any damping is that of its law.
    fn parameters(&self, scene: &Scene) -> Option<Vec<Parameter>> {
        let mut names: Vec<&str> = Vec::new();
        for parameter in self.parameters {
            let damping = matches!(parameter.target, Target::Damping(_) | Target::DampingBeside(_));
            let of_law = damping && scene.damping.kind != self.scene.damping.kind;
            let name = if of_law { "damping" } else { parameter.name.as_str() };
            names.extend(Some(name).filter(|name| !names.contains(name)));
        }
        if self.scene.damping.kind == DampingKind::None && scene.damping.kind != DampingKind::None {
            names.push("damping");
        }
        names
            .into_iter()
            .map(|name| Parameter::named(name, scene).ok())
            .collect::<Option<Vec<_>>>()
            .map(|all| all.concat())
    }

    /// A suspect after a search by its features.
    fn looked(&self, suspect: Suspect) -> Option<Looked> {
        let mut parameters = self.parameters(&suspect.scene)?;
        parameters.extend(suspect.further.clone());
        let comparison = suspect.compared.as_ref().map_or(self.comparison, |(comparison, _)| comparison);
        let forward = self.forward(&suspect.scene, parameters, comparison.clone(), suspect.gaps)?;
        let standing = self.by_features(&forward)?;
        Some(Looked { suspect, forward, standing })
    }

    /// The same after short runs about that answer; `None` if stopped.
    fn raced(&self, looked: Looked) -> Option<Raced> {
        let trace = looked.suspect.trace(self.trace);
        let compared = self.compared(&looked.forward, &trace);
        let (start, misfit) = waveform::quick(compared, &looked.standing.elite, self.seed)?;
        Some(Raced { looked, start, misfit })
    }

    fn waveform(&self, raced: &Raced) -> Option<WaveformFit> {
        let trace = raced.looked.suspect.trace(self.trace);
        waveform::hurried(self.compared(&raced.looked.forward, &trace), Ok(raced.start.clone()), self.seed)
    }

    /// Answer of the features by a search of its own.
    fn by_features(&self, forward: &Forward) -> Option<Standing> {
        standing(forward, Search::new(forward, self.features_runs(forward), self.seed)).ok()
    }

    /// Runs of a search by features.
    fn features_runs(&self, forward: &Forward) -> usize {
        let runs = if self.sees_waveform() { RUNS_BEFORE } else { RUNS };
        if forward.parameters.len() > 2 { 3 * runs / 2 } else { runs }
    }

    /// Whether p is high enough for the cause to be named.
    fn worth(&self, p: f64) -> bool {
        p >= LEAST && (p >= DOUBTFUL || p > BETTER * self.fit.agreement.p) && p > 2.0 * self.fit.agreement.p
    }

    /// The runs of the fit, for a record with these features.
    fn training(&self, features: &[f64]) -> TrainingRuns {
        let (dimension, comparison) = (self.parameters.len(), self.comparison);
        let finished = self.fit.runs.iter().filter_map(|run| Some((run.position.as_slice(), run.features()?)));
        TrainingRuns::new(finished, features, &comparison.nuggets, &comparison.weights, neighbours(dimension))
            .tempered(comparison.power)
    }

    /// p-value of a record with these features by the runs of the fit, with a free factor on all amplitudes (`factor`: standard deviation in ln).
    fn judged(&self, features: &[f64], factor: f64) -> Option<Judgement> {
        let comparison = self.comparison;
        let scaled = self.training(features).scaled(factor.max(comparison.sensitivity), comparison.answers());
        let posterior = Posterior::of(&scaled, self.parameters.len())?;
        let at = posterior.centre(posterior.densest());
        let p = Agreement::of(&scaled, &at, self.seed)?.p;
        let factor = self.training(features).regress(&at).and_then(|local| local.factor(&comparison.answers()));
        Some(Judgement { p, factor })
    }
}

impl Cause {
    /// What it is, in a word or two.
    fn words(self) -> &'static str {
        match self {
            Self::Sign => "the record's sign",
            Self::HornSign => "the horn's sign",
            Self::Scale => "a factor on all amplitudes",
            Self::Beads => "the number of beads",
            Self::Radius => "the radius of the beads",
            Self::Modulus => "the modulus of the beads",
            Self::Material => "the material of the beads",
            Self::Ends => "the faces",
            Self::HornFace => "the horn's face",
            Self::Support => "the support",
            Self::Gap => "a gap or roughness",
            Self::Friction => "friction in the guide",
            Self::DampingLaw => "the damping law",
            Self::Clock => "the clock",
            Self::Averages => "a mean of several shots",
            Self::Record => "the record",
        }
    }
}

/// Whether the record is explained by a cause.
fn explains(finding: &Finding) -> bool {
    finding.p_value.is_some_and(|p| p >= DOUBTFUL)
}

/// Adds a finding, or takes it in place of a worse one of the same cause.
fn add(findings: &mut Vec<Finding>, finding: Finding) {
    match findings.iter_mut().find(|known| known.cause == finding.cause) {
        Some(known) if known.p_value < finding.p_value => *known = finding,
        Some(_) => {}
        None => findings.push(finding),
    }
}

/// A record whose clock takes 1 + `late` for a second, as a right one would show it; its beginning stays.
fn on_other_clock(trace: &Series, late: f64) -> Series {
    let spline = Spline::new(trace, Ends::Natural);
    let at = |index: usize| spline.at(trace.start + (trace.time(index) - trace.start) / (1.0 + late)).0;
    Series::new(trace.start, trace.step, (0..trace.len()).map(at).collect())
}

/// Results of searches in their order. One search alone leaves a second thread idle between its runs; many at a time would take memory.
fn two_at_a_time<T: Send, R: Send>(searches: Vec<T>, search: impl Fn(T) -> R + Send + Sync) -> Vec<R> {
    let half = searches.len().div_ceil(2).max(1);
    searches.into_par_iter().with_min_len(half).map(search).collect()
}

/// Result under an assumed cause.
struct Judgement {
    p: f64,
    /// Factor of the record over the expected amplitudes.
    factor: Option<f64>,
}
