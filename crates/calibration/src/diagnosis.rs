//! Likely causes if the model does not explain a record: each cause is assumed in turn, and its p-value is computed.
//!
//! Two causes need no further run, since the existing runs are judged again: a wrong sign, and a factor on all
//! amplitudes (sensitivity). The others take a few hundred runs of the chain each: powers of ten (a unit), the horn's
//! sign, one bead more or fewer, beads of another radius, modulus or material, other end faces, another support, an
//! open first gap, the other damping law. Causes that explain the record are named, most likely first; no others are.
//! Causes that explain it about equally well are marked as equivalent.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{
    agreement::{Agreement, DOUBTFUL},
    comparison::{Comparison, Reduction},
    drive::HornNoise,
    fit::{Fit, Standing, standing},
    forward::{Forward, Run, Uncertainty, Watch},
    likelihood::{TrainingRuns, neighbours},
    parameter::Parameter,
    posterior::Posterior,
    search::Search,
    statement::p_value,
    synthetic::with_law,
    waveform::{self, Compared, Purpose, WaveformFit},
};
use granchain_model::{
    self as model,
    chain::FiniteBodyLaws,
    scene::{DampingKind, DriveKind, FlatContact, Material, Scene, Support},
};
use granchain_signal::{Series, number::engineering};

/// p above which the search for causes stops.
const EXPLAINED: f64 = 0.3;

/// Factors of a wrong unit or range.
const DECADES: [f64; 4] = [10.0, 0.1, 1e3, 1e-3];

const NAMED: usize = 3;

/// Most causes named if all explain the record equally well.
const EQUIVALENT: usize = 6;

/// Share of the best cause's p above which another cause is equivalent.
const AS_WELL: f64 = 0.3;

/// Runs of a search for one cause.
const RUNS: usize = 300;

/// Factor by which p must grow for a cause that leaves the verdict doubtful.
const BETTER: f64 = 30.0;

/// Least p of a named cause.
const LEAST: f64 = 0.01;

/// Standard deviation of ln of a free factor.
const ANY_FACTOR: f64 = 3.0;

/// Least |ln| of a factor that is reported: larger than the calibration error of any vibrometer.
const FACTOR: f64 = 0.1;

/// Assumed number of shots of an unstated average.
const SHOTS: usize = 16;

/// Relative change of the bead radius that is tried, both ways.
const RADIUS: f64 = 0.1;

fn materials() -> [(&'static str, Material); 6] {
    let other = |name: &'static str, youngs_modulus, poissons_ratio, density| {
        (name, Material { name: name.into(), youngs_modulus, poissons_ratio, density })
    };
    [
        ("chrome steel", Material::chrome_steel()),
        ("aluminium", Material::aluminium()),
        other("brass", 103e9, 0.34, 8500.0),
        ("soda-lime glass", Material::glass()),
        other("zirconia", 205e9, 0.31, 6050.0),
        other("tungsten carbide", 600e9, 0.22, 14_900.0),
    ]
}

/// Relative difference of constants below which two materials count as the same.
const ALIKE: f64 = 0.08;

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
    /// The faces of piston or support.
    Ends,
    /// The stiffness of the support; of a column that is struck, modulus or loss of its foundation.
    Support,
    /// A plate on the foundation.
    Plate,
    /// Velocity of the striker.
    Velocity,
    /// What the force sensor in a bead reads.
    Sensor,
    /// The time between the samples of a record.
    Clock,
    /// Losses in the contacts of the beads.
    ContactLoss,
    /// The gap before the first bead.
    Gap,
    DampingLaw,
    /// The record is an average of several shots.
    Averages,
    /// A warning of the reader: overload, drift, noise, a truncated record.
    Record,
}

/// A cause that explains a record, or hits of a striker.
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
    /// The record at the comparison's samples; absent for published features.
    pub trace: Option<&'a Series>,
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

impl Case<'_> {
    /// Up to three causes, most likely first; `warned` lists the reader's warnings.
    pub(crate) fn diagnose(&self, warned: &[String]) -> Vec<Finding> {
        let mut findings: Vec<Finding> = [self.sign(), self.scale()].into_iter().flatten().collect();
        if !findings.iter().any(|finding| finding.p_value.is_some_and(|p| p >= EXPLAINED)) {
            findings.extend(self.decades());
        }
        findings.extend(self.averaged());
        findings.extend(self.searched());
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
        all
    }

    fn sign(&self) -> Option<Finding> {
        let Reduction::Fingerprint(fingerprint) = &self.comparison.reduction else { return None };
        let turned = fingerprint.measure(&self.trace?.map(|value| -value)).ok()?;
        let p = self.judged(&self.fit.runs, &turned, 0.0)?.p;
        let [low, high] = self.comparison.clipped;
        let clipped = [high.map(|limit| -limit), low.map(|limit| -limit)];
        let comparison = Comparison { features: turned, clipped, ..self.comparison.clone() };
        let p = if self.worth(p) { self.predicted(p, &comparison, -1.0)? } else { p };
        let text = format!(
            "the record's sign: with invert=true p is {}, as read {}; velocities are positive from piston to support",
            p_value(p),
            p_value(self.fit.agreement.p)
        );
        self.worth(p).then(|| Finding::new(Cause::Sign, Some(p), text))
    }

    fn scale(&self) -> Option<Finding> {
        let features = &self.comparison.features;
        let judged = self.judged(&self.fit.runs, features, ANY_FACTOR)?;
        let factor = judged.factor.filter(|factor| factor.ln().abs() > FACTOR)?;
        let p = match self.comparison.scaled(1.0 / factor).filter(|_| self.worth(judged.p)) {
            Some(comparison) => self.predicted(judged.p, &comparison, 1.0 / factor)?,
            None => judged.p,
        };
        let text = format!(
            "a factor of {factor:.3} on all amplitudes (its peak is {}): with it p is {}, without {}; check the unit of the \
             column and the sensitivity (--unit, --scale)",
            self.peak(),
            p_value(p),
            p_value(self.fit.agreement.p)
        );
        self.worth(p).then(|| Finding::new(Cause::Scale, Some(p), text))
    }

    /// The record's peak with its unit.
    fn peak(&self) -> String {
        let comparison = self.comparison;
        let peak = comparison.features.first().and_then(|z| comparison.amplitude(0, *z)).unwrap_or(0.0);
        engineering(peak, comparison.unit(0), 3)
    }

    /// A power of ten in all amplitudes, which is too far for the existing runs, so each is searched.
    fn decades(&self) -> Option<Finding> {
        let tried = two_at_a_time(DECADES.to_vec(), |factor| {
            // A record ten times too large is compared as a tenth of it.
            let comparison = self.comparison.scaled(1.0 / factor)?;
            let (p, _) = self.search(self.scene, None, &comparison, 1.0 / factor)?;
            self.worth(p).then_some((p, factor))
        });
        let (p, factor) = tried.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let text = format!(
            "amplitudes {factor} times as large as they should be (the peak is {}): without that factor p is {}, as read {}; check the \
             unit of the column and the sensitivity (--unit, --scale)",
            self.peak(),
            p_value(p),
            p_value(self.fit.agreement.p)
        );
        Some(Finding::new(Cause::Scale, Some(p), text))
    }

    /// An average of several shots, which weakens and smooths whatever differs from shot to shot.
    fn averaged(&self) -> Option<Finding> {
        if self.comparison.averages > 1 || self.trace.is_none() {
            return None;
        }
        let comparison = Comparison { averages: SHOTS, ..self.comparison.clone() };
        let (p, _) = self.search(self.scene, None, &comparison, 1.0)?;
        let text = format!(
            "a mean of several shots (averages=N): with means of {SHOTS} p is {}, without {}",
            p_value(p),
            p_value(self.fit.agreement.p)
        );
        self.worth(p).then(|| Finding::new(Cause::Averages, Some(p), text))
    }

    /// Causes that need their own runs.
    fn searched(&self) -> Vec<Finding> {
        let searched = two_at_a_time(self.suspects(), |(cause, scene, parameter, describe)| {
            let (p, values) = self.search(&scene, parameter, self.comparison, 1.0)?;
            self.worth(p).then_some((cause, p, values, describe))
        });
        let mut found: Vec<Finding> = Vec::new();
        for (cause, p, values, describe) in searched.into_iter().flatten() {
            let text = format!(
                "{}: with it p is {}, without {}",
                describe(&values),
                p_value(p),
                p_value(self.fit.agreement.p)
            );
            let finding = Finding::new(cause, Some(p), text);
            match found.iter_mut().find(|known| known.cause == cause) {
                Some(known) if known.p_value < finding.p_value => *known = finding,
                Some(_) => {}
                None => found.push(finding),
            }
        }
        found
    }

    /// Scene, further parameter and text of each cause.
    fn suspects(&self) -> Vec<Suspect> {
        let mut suspects = self.other_beads();
        suspects.extend(self.other_ends());
        suspects.extend(self.other_constants());
        suspects
    }

    /// Another number of beads, or beads of another size or material.
    fn other_beads(&self) -> Vec<Suspect> {
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
            let text = format!("{count} beads instead of {beads} (chain.beads={count})");
            suspects.push((Cause::Beads, scene, None, Box::new(move |_| text.clone())));
        }
        for factor in [1.0 - RADIUS, 1.0 + RADIUS] {
            let mut scene = own.clone();
            scene.chain.beads.iter_mut().for_each(|bead| bead.radius *= factor);
            let text = format!("beads of a radius of about {:.3} mm (chain.radius)", scene.chain.beads[0].radius * 1e3);
            suspects.push((Cause::Radius, scene, None, Box::new(move |_| text.clone())));
        }
        let first = own.chain.beads[0].material.clone();
        for (name, material) in materials() {
            let alike = |a: f64, b: f64| (a / b - 1.0).abs() < ALIKE;
            if alike(first.youngs_modulus, material.youngs_modulus) && alike(first.density, material.density) {
                continue;
            }
            let mut scene = own.clone();
            for bead in &mut scene.chain.beads {
                bead.material = Material { name: bead.material.name.clone(), ..material.clone() };
            }
            let text = format!(
                "beads of {name} instead of {} (materials.{}.youngs_modulus, .poissons_ratio, .density)",
                first.name, first.name
            );
            suspects.push((Cause::Material, scene, None, Box::new(move |_| text.clone())));
        }
        let describe = move |values: &[f64]| {
            let factor = values.last().copied().unwrap_or(f64::NAN);
            format!(
                "beads of E = {:.3} GPa instead of {:.3} GPa (materials.{2}.youngs_modulus), or of a density of {3:.0} kg/m^3 \
                 (materials.{2}.density)",
                1e-9 * factor * first.youngs_modulus,
                1e-9 * first.youngs_modulus,
                first.name,
                first.density / factor
            )
        };
        suspects.push((Cause::Modulus, own.clone(), Parameter::modulus(own), Box::new(describe)));
        suspects
    }

    /// A horn of the other sign, other faces of piston and support, another kind of support.
    fn other_ends(&self) -> Vec<Suspect> {
        let own = self.scene;
        let mut suspects: Vec<Suspect> = Vec::new();
        let mut suspect = |cause: Cause, text: &'static str, change: &dyn Fn(&mut Scene)| {
            let mut scene = own.clone();
            change(&mut scene);
            suspects.push((cause, scene, None, Box::new(move |_| text.to_owned())));
        };
        if let DriveKind::Record { .. } = own.drive.kind {
            let text = "the horn's sign: its record with --drive-read invert=true; displacements are positive from piston to support";
            suspect(Cause::HornSign, text, &|scene| {
                if let DriveKind::Record { displacement, .. } = &mut scene.drive.kind {
                    displacement.values.iter_mut().for_each(|value| *value = -*value);
                }
            });
        }
        match own.piston {
            FlatContact::Rigid => {
                suspect(Cause::Ends, "an elastic face of the piston (piston.contact=half-space)", &|scene| {
                    scene.piston = FlatContact::HalfSpace;
                });
            }
            FlatContact::HalfSpace => {
                suspect(Cause::Ends, "a rigid face of the piston (piston.contact=rigid)", &|scene| {
                    scene.piston = FlatContact::Rigid;
                });
            }
        }
        if own.support != Support::Flat(FlatContact::Rigid) {
            suspect(Cause::Support, "a rigid wall as the support (support.kind=rigid)", &|scene| {
                scene.support = Support::Flat(FlatContact::Rigid);
            });
        }
        if own.support != Support::Flat(FlatContact::HalfSpace) {
            suspect(
                Cause::Ends,
                "a half-space of the bead's material as the support (support.kind=half-space)",
                &|scene| {
                    scene.support = Support::Flat(FlatContact::HalfSpace);
                },
            );
            suspect(
                Cause::Ends,
                "half-spaces at both ends (piston.contact=half-space, support.kind=half-space)",
                &|scene| {
                    (scene.piston, scene.support) = (FlatContact::HalfSpace, Support::Flat(FlatContact::HalfSpace));
                },
            );
        }
        if !matches!(own.support, Support::Annulus { .. } | Support::Disc { .. }) {
            suspect(Cause::Support, "a resin annulus as the support (support.kind=annulus)", &|scene| {
                scene.support = Support::resin_annulus(1.0);
            });
        }
        suspects
    }

    /// Another stiffness of the support, a gap, the other damping law.
    fn other_constants(&self) -> Vec<Suspect> {
        let own = self.scene;
        let mut suspects: Vec<Suspect> = Vec::new();
        for (cause, name) in [(Cause::Support, "support_stiffness"), (Cause::Gap, "gap")] {
            let fitted = self.parameters.iter().any(|parameter| parameter.name == name);
            let Some(parameter) =
                Parameter::named(name, own).ok().and_then(|mut named| named.pop()).filter(|_| !fitted)
            else {
                continue;
            };
            let unit = if parameter.unit == "1" { "times the stiffness".to_owned() } else { parameter.unit.clone() };
            let describe = move |values: &[f64]| {
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
            suspects.push((cause, own.clone(), Some(parameter), Box::new(describe)));
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

    /// Combined p of amplitudes and waveform if the waveform decided the fit on the chain: twice the smaller. The
    /// record is multiplied by `factor`.
    fn predicted(&self, p: f64, comparison: &Comparison, factor: f64) -> Option<f64> {
        if self.sees_waveform() { Some(self.search(self.scene, None, comparison, factor)?.0) } else { Some(p) }
    }

    /// Whether the waveform decided, and what the model that answers changes of the chain is known.
    fn sees_waveform(&self) -> bool {
        let known = |waveform: &&WaveformFit| self.fit.below.is_none() || waveform.difference.is_some();
        self.fit.waveform.as_ref().filter(known).is_some_and(WaveformFit::decides)
    }

    /// Fits another scene on the chain, with an optional further parameter, to the record times `factor`; `None` if
    /// stopped.
    fn search(
        &self,
        scene: &Scene,
        further: Option<Parameter>,
        comparison: &Comparison,
        factor: f64,
    ) -> Option<(f64, Vec<f64>)> {
        if !(self.watch)(0) {
            return None;
        }
        let named = self.parameters.iter().map(|parameter| Parameter::named(&parameter.name, scene).ok());
        let mut parameters: Vec<Parameter> = named.collect::<Option<Vec<_>>>()?.concat();
        let runs = if further.is_some() { 2 * RUNS } else { RUNS };
        parameters.extend(further);
        let own = self.scene;
        let laws = match self.laws {
            _ if !scene.has_fitted_laws() => None,
            // Other beads and other ends are other bodies.
            Some(laws)
                if scene.chain.beads == own.chain.beads
                    && (scene.piston, &scene.support) == (own.piston, &own.support) =>
            {
                Some(laws.clone())
            }
            _ => model::prepare(scene).ok()?.contact_laws().cloned(),
        };
        let (watch, comparison) = (Arc::clone(&self.watch), comparison.clone());
        let forward =
            Forward::new(scene, laws.as_ref(), parameters, comparison, self.uncertainty, self.seed, watch).ok()?;
        let Standing { p, values, elite } = standing(&forward, Search::new(&forward, runs, self.seed)).ok()?;
        if !self.sees_waveform() || !self.worth(p) {
            return Some((p, values));
        }
        let trace = self.trace?.map(|value| factor * value);
        let above = self.fit.waveform.as_ref().and_then(|waveform| waveform.difference.as_ref());
        let difference = above.map(|difference| Arc::new(difference.altered()));
        let compared = Compared { forward: &forward, noise: self.noise.clone(), trace: &trace, difference };
        match waveform::fit(vec![compared], &elite, self.seed, Purpose::Cause) {
            // What the waveform cannot be fitted with is no cause.
            None => None,
            // Nor what leaves more of a short window than runs do.
            Some(found) if !found.decides() => Some((found.with_amplitudes(p), values)),
            Some(found) => {
                let parameters = forward.parameters.iter().zip(&found.at);
                let values = parameters.map(|(parameter, u)| parameter.value(*u)).collect();
                Some((found.with_amplitudes(p), values))
            }
        }
    }

    /// Whether p is high enough for the cause to be named.
    fn worth(&self, p: f64) -> bool {
        p >= LEAST && (p >= DOUBTFUL || p > BETTER * self.fit.agreement.p) && p > 2.0 * self.fit.agreement.p
    }

    /// p-value of a record with these features, with a free factor on all amplitudes (`factor`: standard deviation in
    /// ln).
    fn judged(&self, runs: &[Run], features: &[f64], factor: f64) -> Option<Judgement> {
        let dimension = self.parameters.len();
        let comparison = self.comparison;
        let finished = runs.iter().filter_map(|run| Some((run.position.as_slice(), run.features()?)));
        let training = || {
            TrainingRuns::new(
                finished.clone(),
                features,
                &comparison.nuggets,
                &comparison.weights,
                neighbours(dimension),
            )
            .tempered(comparison.power)
        };
        let scaled = training().scaled(factor.max(comparison.sensitivity), comparison.answers());
        let posterior = Posterior::of(&scaled, dimension)?;
        let at = posterior.centre(posterior.densest());
        let p = Agreement::of(&scaled, &at, self.seed)?.p;
        let factor = training().regress(&at).and_then(|local| local.factor(&comparison.answers()));
        Some(Judgement { p, factor })
    }
}

/// Cause, scene, further parameter and text of the finding.
type Suspect = (Cause, Scene, Option<Parameter>, Box<dyn Fn(&[f64]) -> String + Send>);

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
