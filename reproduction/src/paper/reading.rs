//! What the paper leaves open, varied one at a time, and ranked by how much the answer moves.
//!
//! Per reading and law: the changes of the positive peak (over its own value), of the negative peak (likewise) and of the ratio of the
//! law's own line to the drive line (1/3 for linear dampers, 1/2 for Kuwabara–Kono; a plain difference of ratios). Their rms is the
//! **shift** by which readings are ranked, in per cent when shown:
//!
//! ```text
//! shift = √( ((ΔP₊/P₊)² + (ΔP₋/P₋)² + Δr²)/3 )
//! ```
//!
//! and the same with each change in units of its scatter √(s² + s₀²) is the **significance**.

use serde::{Deserialize, Serialize};

use super::{Law, PaperPlan, Study, SweepPoint, largest, moment};
use crate::failure::{StudyError, enough};
use crate::{
    instrument::Instrument,
    portrait::{PortraitMoments, Trait},
};
use granchain_calibration::predict::{ensemble::EnsemblePlan, observation, replicates::Watch};
use granchain_model::scene::ModelKind;

/// One way to read what the paper leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Reading {
    /// For people: what is other than in the default scene.
    pub name: &'static str,
    /// The overrides that make it so.
    pub overrides: &'static [&'static str],
    /// Only the chain can run it: both sides of the comparison are then the chain's.
    pub chain_only: bool,
    /// The bodies differ from those of the default scene.
    pub other_bodies: bool,
}

const fn reading(name: &'static str, overrides: &'static [&'static str]) -> Reading {
    Reading { name, overrides, chain_only: false, other_bodies: false }
}

/// The readings that are varied, in groups.
pub const READINGS: &[Reading] = &[
    reading("dampers between beads only", &["damping.at=beads"]),
    reading("dampers may pull", &["damping.tension=true"]),
    reading("ring-up τ 20 µs", &["drive.ring_up=20us"]),
    reading("ring-up τ 50 µs", &["drive.ring_up=50us"]),
    reading("ring-up τ 200 µs", &["drive.ring_up=200us"]),
    reading("ring-up τ 400 µs", &["drive.ring_up=400us"]),
    reading("rectangular burst", &["drive.ring_up=0s"]),
    reading("all gaps 1 nm", &["chain.gaps=1nm"]),
    reading("all gaps 5 nm", &["chain.gaps=5nm"]),
    reading("all gaps 20 nm", &["chain.gaps=20nm"]),
    reading("precompression 1 mN", &["chain.precompression=1mN"]),
    reading("precompression 3 mN", &["chain.precompression=3mN"]),
    reading("precompression 6 mN", &["chain.precompression=6mN"]),
    reading("precompression 10 mN", &["chain.precompression=10mN"]),
    reading("precompression 15 mN", &["chain.precompression=15mN"]),
    Reading {
        name: "steel half-space piston",
        overrides: &["piston.contact=half-space"],
        chain_only: true,
        other_bodies: false,
    },
    Reading {
        name: "support 30 % softer",
        overrides: &["support.stiffness_factor=0.7"],
        chain_only: false,
        other_bodies: true,
    },
    Reading {
        name: "support 30 % stiffer",
        overrides: &["support.stiffness_factor=1.3"],
        chain_only: false,
        other_bodies: true,
    },
];

/// Ensembles a law needs: the default, the default on the chain, and each reading.
pub(super) fn ensembles() -> usize {
    READINGS.len() + 2
}

/// One number with and without the reading.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Change {
    pub mean: f64,
    pub scatter: f64,
    /// Its change over the default's own value for a peak, the plain change for a ratio, 1.
    pub change: f64,
    /// The change over the scatter of both, 1.
    pub significance: f64,
}

/// What a reading does to a law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadingOutcome {
    pub reading: Reading,
    /// Positive peak, negative peak, ratio of the law's own line; none where it cannot be run.
    pub changes: Option<[Change; 3]>,
    /// Why it could not be run.
    pub failure: Option<String>,
    /// Where the law's own line is largest over the drive line in a sweep of α.
    pub largest_at: Option<f64>,
    /// Rms of the three changes, 1.
    pub shift: f64,
    /// Rms of the three significances, 1.
    pub significance: f64,
}

/// What is kept of an ensemble of a law.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ReadingRuns {
    pub moments: PortraitMoments,
    /// See [`ReadingOutcome::largest_at`].
    largest_at: Option<f64>,
}

/// An ensemble of a law: as it is on the model of the readings, as it is on the chain, or under a reading.
#[derive(Debug, Clone, Copy)]
pub(super) enum Point {
    Default,
    OnChain,
    Under(&'static Reading),
}

impl Point {
    /// Those of a law, in order.
    pub(super) fn all(study: &Study) -> Vec<Self> {
        // Where the default is on the chain, it is run once.
        let on_chain = (study.readings_model() != ModelKind::Chain).then_some(Self::OnChain);
        std::iter::once(Self::Default).chain(on_chain).chain(READINGS.iter().map(Self::Under)).collect()
    }

    /// Perturbed runs of it: at the law's own α, under a reading also in the sweep.
    pub(super) fn runs(self, plan: &PaperPlan) -> usize {
        let sweep = if matches!(self, Self::Under(_)) { plan.sweep_runs() } else { 0 };
        plan.reading_replicates + sweep
    }

    /// Run it; only a reading may fail.
    pub(super) fn run(
        self,
        study: &Study,
        law: &Law,
        watch: &dyn Watch,
    ) -> Result<Result<ReadingRuns, String>, StudyError> {
        let model = format!("model.kind={}", study.readings_model().name());
        match self {
            Self::Default => ensemble(study, law, &[&model], false, watch).map(Ok),
            Self::OnChain => ensemble(study, law, &CHAIN, false, watch).map(Ok),
            Self::Under(reading) => {
                let own: &[&str] = if reading.chain_only { &CHAIN } else { &[model.as_str()] };
                match ensemble(study, law, &[own, reading.overrides].concat(), true, watch) {
                    Err(StudyError::Stopped) => Err(StudyError::Stopped),
                    outcome => Ok(outcome.map_err(|error| error.to_string())),
                }
            }
        }
    }
}

const CHAIN: [&str; 1] = ["model.kind=chain"];

/// All readings of a law, largest shift first; those that could not be run last. `found` are its [`Point::all`].
pub(super) fn ranked(study: &Study, law: &Law, found: &[Result<ReadingRuns, String>]) -> Vec<ReadingOutcome> {
    let (mut default, mut on_chain) = (None, None);
    let mut outcomes = Vec::new();
    for (point, found) in Point::all(study).into_iter().zip(found) {
        let reading = match point {
            Point::Default => {
                (default, on_chain) = (found.as_ref().ok(), found.as_ref().ok());
                continue;
            }
            Point::OnChain => {
                on_chain = found.as_ref().ok();
                continue;
            }
            Point::Under(reading) => reading,
        };
        let base = if reading.chain_only { on_chain } else { default };
        outcomes.push(match (base, found) {
            (Some(base), Ok(runs)) => {
                ReadingOutcome { largest_at: runs.largest_at, ..compared(reading, law, &base.moments, &runs.moments) }
            }
            (_, found) => ReadingOutcome {
                reading: *reading,
                changes: None,
                failure: found.as_ref().err().cloned(),
                largest_at: None,
                shift: 0.0,
                significance: 0.0,
            },
        });
    }
    outcomes.sort_by(|a, b| {
        (a.changes.is_none(), b.shift).partial_cmp(&(b.changes.is_none(), a.shift)).unwrap_or(std::cmp::Ordering::Equal)
    });
    outcomes
}

/// `swept`: whether α is swept too.
fn ensemble(
    study: &Study,
    law: &Law,
    overrides: &[&str],
    swept: bool,
    watch: &dyn Watch,
) -> Result<ReadingRuns, StudyError> {
    let what = || format!("{} dampers with {}", law.name, overrides.join(", "));
    let all: Vec<String> =
        study.overrides.iter().cloned().chain(overrides.iter().map(|set| (*set).to_owned())).collect();
    let scene = law.scene(&all)?;
    let settings = observation::settings(&scene).map_err(|source| StudyError::Feature { what: what(), source })?;
    let plan = EnsemblePlan::new(study.plan.reading_replicates, study.plan.seed);
    let instrument = Instrument { settings: &settings, ..study.seen() };
    let portraits = instrument.at(&scene, &[1.0], &plan, watch)?.concat();
    let moments = enough(PortraitMoments::of(&portraits), &portraits, what)?;
    let swept = if swept { study.sweep(law, &scene, instrument, watch)? } else { Vec::new() };
    let points: Vec<SweepPoint> =
        study.plan.alphas.iter().zip(&swept).map(|(alpha, runs)| SweepPoint::of(*alpha, runs)).collect();
    let largest_at = largest(&points, Trait::Level(law.own_line)).map(|(alpha, ..)| alpha);
    Ok(ReadingRuns { moments, largest_at })
}

fn compared(reading: &Reading, law: &Law, base: &PortraitMoments, moved: &PortraitMoments) -> ReadingOutcome {
    let change = |what: Trait| {
        let (before, after) = (moment(base, what), moment(moved, what));
        let difference = after.mean - before.mean;
        let scatter = before.deviation.hypot(after.deviation);
        let relative = matches!(what, Trait::PositivePeak | Trait::NegativePeak);
        Change {
            mean: after.mean,
            scatter: after.deviation,
            change: if relative { difference / before.mean } else { difference },
            significance: if scatter > 0.0 { difference / scatter } else { 0.0 },
        }
    };
    let changes = [Trait::PositivePeak, Trait::NegativePeak, Trait::Level(law.own_line)].map(change);
    let rms = |pick: fn(&Change) -> f64| (changes.iter().map(|change| pick(change).powi(2)).sum::<f64>() / 3.0).sqrt();
    ReadingOutcome {
        reading: *reading,
        changes: Some(changes),
        failure: None,
        largest_at: None,
        shift: rms(|change| change.change),
        significance: rms(|change| change.significance),
    }
}

#[cfg(test)]
mod tests {
    use super::{super::LAWS, *};
    use granchain_calibration::predict::ensemble::Moments;

    #[test]
    fn the_shift_is_the_rms_of_relative_peak_changes_and_the_change_of_the_ratio() {
        let moments = |positive: f64, negative: f64, ratio: f64| {
            let of = |mean| Some(Moments { mean, deviation: 0.003, count: 4 });
            let all = Trait::all().into_iter().map(|what| match what {
                Trait::PositivePeak => of(positive),
                Trait::NegativePeak => of(negative),
                Trait::Level(line) if line == LAWS[0].own_line => of(ratio),
                _ => None,
            });
            PortraitMoments(all.collect())
        };
        let outcome = compared(&READINGS[0], &LAWS[0], &moments(0.3, -0.2, 0.5), &moments(0.33, -0.24, 0.4));
        let expected = ((0.01 + 0.04 + 0.01) / 3.0_f64).sqrt();
        assert!((outcome.shift - expected).abs() < 1e-12, "{}", outcome.shift);
        let changes = outcome.changes.unwrap();
        // A negative peak that grows in size is a positive change of it.
        assert!((changes[1].change - 0.2).abs() < 1e-12);
        assert!((changes[0].significance - 0.03 / (0.003 * 2.0_f64.sqrt())).abs() < 1e-9);
    }

    #[test]
    fn every_reading_is_a_scene_that_loads_and_differs_from_the_default() {
        for law in &LAWS {
            let default = law.scene(&[]).unwrap();
            for reading in READINGS {
                let overrides: Vec<String> = reading.overrides.iter().map(|set| (*set).to_owned()).collect();
                let scene = law.scene(&overrides).unwrap();
                assert_ne!(scene, default, "{}", reading.name);
                assert_eq!(scene.support != default.support, reading.other_bodies, "{}", reading.name);
            }
        }
    }
}
