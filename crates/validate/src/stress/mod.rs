//! Hard cases: what the models must survive, each with a criterion and a number.
//!
//! Every case runs on every fidelity level of the ladder it applies to. A check that does not hold is reported as such; a run that fails, or that is
//! refused where it should work, is a check that does not hold.

mod chains;
mod chaos;
mod dampers;
mod effects;
mod fits;
mod frequencies;
mod impact;
mod record;
mod ring;
mod room;
mod similarity;
mod steps;
mod vacuum;
mod water;

use rayon::prelude::*;
use serde::Serialize;

use granchain_calibration::predict::{Bodies, replicates::Watch};
use room::Room;

/// A fidelity level of the fidelity ladder, and the law of its contacts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FidelityLevel {
    /// The chain with Hertz contacts.
    Hertz,
    /// The chain with contacts fitted to the finite bodies.
    FiniteBody,
    Reduced,
    /// The contact finite element analysis.
    Fea,
}

impl FidelityLevel {
    /// All of them, the cheapest first.
    pub const ALL: [Self; 4] = [Self::Hertz, Self::FiniteBody, Self::Reduced, Self::Fea];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Hertz => "chain",
            Self::FiniteBody => "chain, finite-body",
            Self::Reduced => "reduced",
            Self::Fea => "fea",
        }
    }
}

/// What a number is held against.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// It may be no larger.
    AtMost(f64),
    /// It may be no smaller.
    AtLeast(f64),
}

impl Limit {
    /// Whether a number keeps to it; one that is not finite never does.
    #[must_use]
    pub fn holds(self, measured: f64) -> bool {
        measured.is_finite()
            && match self {
                Self::AtMost(most) => measured <= most,
                Self::AtLeast(least) => measured >= least,
            }
    }
}

/// A criterion, and what was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    pub case: u32,
    pub name: &'static str,
    #[serde(rename = "rung")]
    pub fidelity: FidelityLevel,
    /// Which of the case's runs, and what was measured.
    pub criterion: String,
    /// What was measured, SI or 1; none where the run did not end.
    pub measured: Option<f64>,
    /// What it is held against.
    pub limit: Limit,
    pub unit: &'static str,
    /// Whether it keeps to the limit.
    pub holds: bool,
    /// Why there is no number, or what else is to be known.
    pub note: Option<String>,
}

/// A line of a case's figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve {
    pub case: u32,
    pub label: String,
    /// Its points, both coordinates positive.
    pub points: Vec<(f64, f64)>,
}

pub struct Case {
    pub number: u32,
    pub name: &'static str,
    /// What is hard about it, and what is asked.
    pub what: &'static str,
    pub fidelities: &'static [FidelityLevel],
    /// Runs it on one fidelity level.
    examine: fn(&mut Room<'_>),
}

pub const CASES: &[Case] = &[
    Case {
        number: 1,
        name: "sonic vacuum",
        what: "An undamped chain without precompression rings on after its drive; contacts open and close thousands of times. The energy that \
               is unaccounted for stays bounded and does not grow.",
        fidelities: &FidelityLevel::ALL,
        examine: vacuum::examine,
    },
    Case {
        number: 2,
        name: "precompression",
        what: "From 1e-6 N to 10 N small motions have the frequencies of the linear chain; a finite body may differ by what its stiffness \
               exceeds Hertz’.",
        fidelities: &FidelityLevel::ALL,
        examine: frequencies::examine,
    },
    Case {
        number: 3,
        name: "fast, large and tiny",
        what: "A bead hits another at 10 m/s; the horn moves by 10 µm; it moves by 1e-12 m. Hertz’ chain is self-similar: the tiny drive at \
               the frequency that belongs to it gives the same waveform.",
        fidelities: &FidelityLevel::ALL,
        examine: impact::examine,
    },
    Case {
        number: 4,
        name: "step",
        what: "The force of a hit converges as the step falls from 1 µs to 0.001 µs, or the step is refused.",
        fidelities: &[FidelityLevel::Reduced, FidelityLevel::Fea],
        examine: steps::examine,
    },
    Case {
        number: 6,
        name: "support",
        what: "A support a thousand times softer and stiffer than the resin annulus.",
        fidelities: &FidelityLevel::ALL,
        examine: ring::stiffness,
    },
    Case {
        number: 7,
        name: "nearly incompressible resin",
        what: "ν = 0.4999: the annulus neither locks nor softens; two meshes agree.",
        fidelities: &[FidelityLevel::Reduced, FidelityLevel::Fea],
        examine: ring::incompressible,
    },
    Case {
        number: 8,
        name: "unequal and many beads",
        what: "One bead a thousand times as heavy, one of a tenth of the radius; two beads, forty, a thousand.",
        fidelities: &FidelityLevel::ALL,
        examine: chains::examine,
    },
    Case {
        number: 9,
        name: "overdamped",
        what: "Both dashpots up to a thousand times the paper’s coefficient, √δ at first touch included: no energy is made, no force pulls.",
        fidelities: &FidelityLevel::ALL,
        examine: dampers::examine,
    },
    Case {
        number: 10,
        name: "bad drive record",
        what: "A horn-tip record with noise, dropouts, clipping, a step in its baseline, at 1 and 25 MHz: read with its flaw named or \
               refused; what is read drives the chain as the clean record does, within what the flaw explains.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::Reduced],
        examine: record::examine,
    },
    Case {
        number: 11,
        name: "other units, mirrored",
        what: "A bench of twice the size has the same velocities in twice the time; units in the scene do not matter; a mirrored chain \
               mirrors its motion: all to rounding.",
        fidelities: &FidelityLevel::ALL,
        examine: similarity::examine,
    },
    Case {
        number: 12,
        name: "water",
        what: "A disc a hundred times softer and stiffer, with and without a dashpot there, an overdamped one, a static force; half the water \
               in front of its absorbing boundary, 10 ms of an undamped chain: no energy beyond the piston’s work, no echo.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::Reduced, FidelityLevel::Fea],
        examine: water::examine,
    },
    Case {
        number: 13,
        name: "calibration without an answer",
        what: "Half the parameter box fails; the record is pure noise; a parameter has no effect: the verdict or the width of the interval says \
               so, never a wrong number with confidence.",
        fidelities: &[FidelityLevel::Hertz],
        examine: fits::examine,
    },
    Case {
        number: 14,
        name: "chaotic and regular",
        what: "The scatter under perturbations no laboratory controls tells a chaotic regime from a regular one.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::Reduced],
        examine: chaos::examine,
    },
    Case {
        number: 16,
        name: "friction with reversal at rest",
        what: "Beads rub on their guide, from weakly to more than the contacts push, straight and oblique: they stick, slip and reverse, and the \
               energy balance closes.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::FiniteBody, FidelityLevel::Reduced],
        examine: effects::friction,
    },
    Case {
        number: 17,
        name: "yielding contacts that chatter",
        what: "Contacts yield, open, close and yield again, hard as bearing steel and soft as wax; loading and unloading meet their curves exactly.",
        fidelities: &[FidelityLevel::Hertz],
        examine: effects::yielding,
    },
    Case {
        number: 18,
        name: "a compliant horn",
        what: "A resonator of Q 1000 at the drive, a tip lighter than a bead, one with hardly a resonance: horn and chain have a common energy balance.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::Reduced],
        examine: effects::horn,
    },
];

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StressPlan {
    /// Shorter runs and coarser meshes, for a first look and for continuous integration.
    pub quick: bool,
    /// Numbers of the cases; empty is all.
    pub cases: Vec<u32>,
    /// Overrides of every scene that uses their keys.
    pub overrides: Vec<String>,
    pub seed: u64,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct StressOutcome {
    /// In the order of [`CASES`], the cheapest fidelity level first.
    pub checks: Vec<Check>,
    pub curves: Vec<Curve>,
}

impl StressOutcome {
    /// Checks that do not hold.
    pub fn broken(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| !check.holds)
    }
}

/// Case and fidelity level of every examination of a plan.
fn examinations(plan: &StressPlan) -> Vec<(&'static Case, FidelityLevel)> {
    let is_selected = |case: &&Case| plan.cases.is_empty() || plan.cases.contains(&case.number);
    CASES
        .iter()
        .filter(is_selected)
        .flat_map(|case| case.fidelities.iter().map(move |fidelity| (case, *fidelity)))
        .collect()
}

/// How many examinations a plan has: what [`Watch::advance`] counts.
#[must_use]
pub fn count(plan: &StressPlan) -> u64 {
    examinations(plan).len() as u64
}

/// Run the cases. What was found does not depend on the number of threads; once `watch` says stop, the rest is left out.
#[must_use]
pub fn run(plan: &StressPlan, bodies: &Bodies, watch: &dyn Watch) -> StressOutcome {
    let found: Vec<StressOutcome> = examinations(plan)
        .into_par_iter()
        .with_max_len(1)
        .map(|(case, fidelity)| {
            if watch.stop() {
                return StressOutcome::default();
            }
            let mut room = Room::new(plan, case, fidelity, bodies, watch);
            (case.examine)(&mut room);
            watch.advance(1);
            room.found
        })
        .collect();
    found.into_iter().fold(StressOutcome::default(), |mut all, mut part| {
        all.checks.append(&mut part.checks);
        all.curves.append(&mut part.curves);
        all
    })
}
