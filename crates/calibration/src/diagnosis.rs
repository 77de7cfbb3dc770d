//! Why a record is not explained, by cause: each cause that a laboratory knows is taken for true, and asked whether the record then stands where
//! a right one would.
//!
//! Two need no further run, for the runs of the fit are judged anew: the other sign, and a factor on all amplitudes (a sensitivity).
//! The others are searched on the chain with a few hundred runs each: powers of ten (a unit), one bead more or fewer, other beads, another support, an open first gap,
//! the other damping law. What explains the record is named, most likely first; nothing is named that does not.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{
    agreement::{Agreement, DOUBTFUL},
    comparison::{Comparison, Reduction},
    fit::{Fit, standing},
    forward::{Forward, Run, Uncertainty, Watch},
    likelihood::{Cloud, neighbours},
    parameter::Parameter,
    posterior::Posterior,
    search::{Search, Strategy},
    twin::with_law,
};
use granchain_model::{
    self as model,
    chain::FiniteBodyLaws,
    scene::{DampingKind, Scene},
};
use granchain_signal::Series;

/// p from which a cause leaves nothing to look for.
const EXPLAINED: f64 = 0.3;

/// Factors of a unit or a range that was mistaken.
const DECADES: [f64; 4] = [10.0, 0.1, 1e3, 1e-3];

/// Most causes that are named.
const NAMED: usize = 3;

/// Runs of a search for one cause.
const RUNS: usize = 300;

/// Times that p has to grow for a cause to be named that leaves the agreement doubtful.
const BETTER: f64 = 30.0;

/// Least p of a cause that is named.
const LEAST: f64 = 0.01;

/// Standard deviation of ln of a factor that nobody knows.
const ANY_FACTOR: f64 = 3.0;

/// Least |ln| of a factor that is worth a word: no vibrometer is a tenth off.
const FACTOR: f64 = 0.1;

/// Change of the beads' radius that is tried, both ways.
const RADIUS: f64 = 0.1;

/// A cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cause {
    /// The sign of the record.
    Sign,
    /// A factor on all its amplitudes.
    Scale,
    /// The number of beads.
    Beads,
    /// Their radius.
    Radius,
    /// The stiffness of the support.
    Support,
    /// The gap before the first bead.
    Gap,
    /// The damping law.
    DampingLaw,
    /// What the reader warned of: overload, drift, noise, a record that was cut.
    Record,
}

/// A cause that explains a record which the fit does not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Which.
    pub cause: Cause,
    /// Share of right records that are as far from the model once it is mended; absent where that was not tried.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p_value: Option<f64>,
    /// What was found and what to do, in words.
    pub text: String,
}

/// What is to be explained: the first record, as fitted.
pub struct Case<'a> {
    /// The scene on the chain, with the law that was fitted.
    pub scene: &'a Scene,
    /// The contact laws of its bodies, where they are known already.
    pub laws: Option<&'a FiniteBodyLaws>,
    /// What its runs are compared with.
    pub comparison: &'a Comparison,
    /// The record at the comparison's samples; absent of published features.
    pub trace: Option<&'a Series>,
    /// What is fitted.
    pub parameters: &'a [Parameter],
    /// What is drawn.
    pub uncertainty: Uncertainty,
    /// Seed.
    pub seed: u64,
    /// What the fit found on whatever rung answered.
    pub fit: &'a Fit,
    /// Told of every search; stops them.
    pub watch: Arc<Watch>,
}

impl Case<'_> {
    /// Up to three causes, the likeliest first; `warned` is what the reader saw in the records.
    #[must_use]
    pub fn diagnose(&self, warned: &[String]) -> Vec<Finding> {
        let mut findings: Vec<Finding> = [self.sign(), self.scale()].into_iter().flatten().collect();
        // A sign or a unit that explains all leaves nothing to look for.
        let explained =
            |findings: &[Finding]| findings.iter().any(|finding| finding.p_value.is_some_and(|p| p >= EXPLAINED));
        if !explained(&findings) {
            findings.extend(self.decades());
        }
        if !explained(&findings) {
            findings.extend(self.searched());
        }
        findings.sort_by(|a, b| b.p_value.unwrap_or(0.0).total_cmp(&a.p_value.unwrap_or(0.0)));
        let record = warned.iter().map(|text| Finding { cause: Cause::Record, p_value: None, text: text.clone() });
        // What is seen in a record comes before what would mend the model, which may only make up for it.
        let mut all: Vec<Finding> = record.take(NAMED - usize::from(!findings.is_empty())).collect();
        all.extend(findings);
        all.truncate(NAMED);
        all
    }

    fn sign(&self) -> Option<Finding> {
        let Reduction::Fingerprint(fingerprint) = &self.comparison.reduction else { return None };
        let turned = fingerprint.measure(&self.trace?.map(|value| -value)).ok()?;
        let p = self.judged(&self.fit.runs, &turned, 0.0)?.p;
        self.worth(p).then(|| Finding {
            cause: Cause::Sign,
            p_value: Some(p),
            text: format!(
                "the record's sign: with --invert p is {}, as read {}; velocities are positive from piston to support",
                shown(p),
                shown(self.fit.agreement.p)
            ),
        })
    }

    fn scale(&self) -> Option<Finding> {
        let features = &self.comparison.features;
        let judged = self.judged(&self.fit.runs, features, ANY_FACTOR)?;
        let factor = judged.factor.filter(|factor| factor.ln().abs() > FACTOR)?;
        self.worth(judged.p).then(|| Finding {
            cause: Cause::Scale,
            p_value: Some(judged.p),
            text: format!(
                "a factor of {factor:.3} on all amplitudes (its peak is {}): with it p is {}, without {}; check the unit of the \
                 column and the sensitivity (--unit, --scale)",
                self.peak(),
                shown(judged.p),
                shown(self.fit.agreement.p)
            ),
        })
    }

    /// The record's peak with its unit.
    fn peak(&self) -> String {
        let comparison = self.comparison;
        let peak = comparison.features.first().and_then(|z| comparison.amplitude(0, *z)).unwrap_or(0.0);
        format!("{peak:.3} {}", comparison.unit(0))
    }

    /// A power of ten in all amplitudes: too far for the runs there are, so each is searched.
    fn decades(&self) -> Option<Finding> {
        let tried = DECADES.iter().filter_map(|factor| {
            // A record ten times too large is compared as a tenth of it.
            let comparison = self.comparison.scaled(1.0 / factor)?;
            let (p, _) = self.search(self.scene, None, &comparison)?;
            self.worth(p).then_some((p, *factor))
        });
        let (p, factor) = tried.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Finding {
            cause: Cause::Scale,
            p_value: Some(p),
            text: format!(
                "amplitudes {factor} times as large as they should be (the peak is {}): without that factor p is {}, as read {}; check the \
                 unit of the column and the sensitivity (--unit, --scale)",
                self.peak(),
                shown(p),
                shown(self.fit.agreement.p)
            ),
        })
    }

    /// Causes that take runs of their own.
    fn searched(&self) -> Vec<Finding> {
        let mut found: Vec<Finding> = Vec::new();
        for (cause, scene, parameter, said) in self.suspects() {
            let Some((p, values)) = self.search(&scene, parameter, self.comparison) else { continue };
            if !self.worth(p) {
                continue;
            }
            let text = format!("{}: with it p is {}, without {}", said(&values), shown(p), shown(self.fit.agreement.p));
            let finding = Finding { cause, p_value: Some(p), text };
            match found.iter_mut().find(|known| known.cause == cause) {
                Some(known) if known.p_value < finding.p_value => *known = finding,
                Some(_) => {}
                None => found.push(finding),
            }
        }
        found
    }

    /// Scene, further parameter and words of each.
    fn suspects(&self) -> Vec<Suspect> {
        let own = self.scene;
        let mut suspects: Vec<Suspect> = Vec::new();
        let beads = own.chain.beads.len();
        for count in [beads.saturating_sub(1), beads + 1] {
            if count == 0 || own.chain.gaps.iter().any(|gap| *gap != own.chain.gaps[0]) {
                continue;
            }
            let mut scene = own.clone();
            let (bead, gap) = (own.chain.beads[beads - 1].clone(), own.chain.gaps[0]);
            scene.chain.beads.resize(count, bead);
            scene.chain.gaps.resize(count + 1, gap);
            suspects.push((
                Cause::Beads,
                scene,
                None,
                Box::new(move |_| format!("{count} beads instead of {beads} (chain.beads={count})")),
            ));
        }
        for factor in [1.0 - RADIUS, 1.0 + RADIUS] {
            let mut scene = own.clone();
            scene.chain.beads.iter_mut().for_each(|bead| bead.radius *= factor);
            let radius = scene.chain.beads[0].radius * 1e3;
            suspects.push((
                Cause::Radius,
                scene,
                None,
                Box::new(move |_| format!("beads of a radius of about {radius:.3} mm (chain.radius)")),
            ));
        }
        for (cause, name) in [(Cause::Support, "support_stiffness"), (Cause::Gap, "gap")] {
            let fitted = self.parameters.iter().any(|parameter| parameter.name == name);
            let Some(parameter) =
                Parameter::named(name, own).ok().and_then(|mut named| named.pop()).filter(|_| !fitted)
            else {
                continue;
            };
            let unit = if parameter.unit == "1" { "times the stiffness".to_owned() } else { parameter.unit.clone() };
            let said = move |values: &[f64]| {
                let value = values.last().copied().unwrap_or(f64::NAN);
                match cause {
                    Cause::Gap => {
                        format!("a gap of about {:.0} nm before the first bead (--fit alpha,damping,gap)", value * 1e9)
                    }
                    _ => format!(
                        "a support of {value:.2} {unit} instead of what the scene has (--fit alpha,damping,support_stiffness)"
                    ),
                }
            };
            suspects.push((cause, own.clone(), Some(parameter), Box::new(said)));
        }
        let other = match own.damping.kind {
            DampingKind::Linear => Some(DampingKind::KuwabaraKono),
            DampingKind::KuwabaraKono => Some(DampingKind::Linear),
            _ => None,
        };
        if let Some(kind) = other {
            suspects.push((
                Cause::DampingLaw,
                with_law(own, kind),
                None,
                Box::new(move |_| format!("the damping law `{0}` (--damping {0})", kind.name())),
            ));
        }
        suspects
    }

    /// The fit of another scene on the chain, with a further parameter where there is one; none once it is stopped.
    fn search(&self, scene: &Scene, further: Option<Parameter>, comparison: &Comparison) -> Option<(f64, Vec<f64>)> {
        if !(self.watch)(0) {
            return None;
        }
        let named = self.parameters.iter().map(|parameter| Parameter::named(&parameter.name, scene).ok());
        let mut parameters: Vec<Parameter> = named.collect::<Option<Vec<_>>>()?.concat();
        let runs = if further.is_some() { 2 * RUNS } else { RUNS };
        parameters.extend(further);
        let laws = match self.laws {
            _ if !scene.has_fitted_laws() => None,
            // Other beads are other bodies.
            Some(laws) if scene.chain.beads == self.scene.chain.beads => Some(laws.clone()),
            _ => model::prepare(scene).ok()?.contact_laws().cloned(),
        };
        let (watch, comparison) = (Arc::clone(&self.watch), comparison.clone());
        let forward =
            Forward::with_laws(scene, laws.as_ref(), parameters, comparison, self.uncertainty, self.seed, watch)
                .ok()?;
        standing(&forward, Search::new(&forward, runs, self.seed, Strategy::Likelihood)).ok()
    }

    /// Whether a p is enough better to be named.
    fn worth(&self, p: f64) -> bool {
        p >= LEAST && (p >= DOUBTFUL || p > BETTER * self.fit.agreement.p) && p > 2.0 * self.fit.agreement.p
    }

    /// Where a record with these features stands among runs, with a factor on all its amplitudes of that standard deviation in ln.
    fn judged(&self, runs: &[Run], features: &[f64], factor: f64) -> Option<Judgement> {
        let dimension = self.parameters.len();
        let comparison = self.comparison;
        let finished = runs.iter().filter_map(|run| Some((run.position.as_slice(), run.features()?)));
        let cloud = || {
            Cloud::new(finished.clone(), features, &comparison.nuggets, &comparison.weights, neighbours(dimension))
                .tempered(comparison.power)
        };
        let scaled = cloud().scaled(factor.max(comparison.sensitivity), comparison.answers());
        let posterior = Posterior::of(&scaled, dimension)?;
        let at = posterior.centre(posterior.densest());
        let p = Agreement::of(&scaled, &at, self.seed)?.p;
        let factor = cloud().regress(&at).and_then(|local| local.factor(&comparison.answers()));
        Some(Judgement { p, factor })
    }
}

/// Cause, scene, a further parameter and what is said of it.
type Suspect = (Cause, Scene, Option<Parameter>, Box<dyn Fn(&[f64]) -> String>);

/// Where a record stands once something is taken for true.
struct Judgement {
    p: f64,
    /// Factor of the record on what runs expect.
    factor: Option<f64>,
}

fn shown(p: f64) -> String {
    if p < 1e-3 { "below 0.001".into() } else { format!("{p:.2}") }
}
