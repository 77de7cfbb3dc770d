//! Hard cases: what the models must survive, each with a criterion, a number and a limit.
//!
//! Every case runs on every model it applies to. A run that fails, or that is refused where it should work, is a check that does not hold. What is
//! measured stands in `docs/stability.md`; after a change that is meant to move it, write it again: `STABILITY=write cargo test --release --test
//! stability -- --include-ignored`.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod bodies;
mod chains;
mod chaos;
mod dampers;
mod effects;
mod fits;
mod frequencies;
mod gaps;
mod impact;
mod page;
mod record;
mod ring;
mod room;
mod similarity;
mod slivers;
mod steps;
mod vacuum;
mod water;
#[path = "../harness/record.rs"]
mod written;

use granchain::study::Bodies;
use rayon::prelude::*;
use room::Room;

/// A fidelity level of the fidelity ladder, and the law of its contacts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// It may be no larger.
    AtMost(f64),
    /// It may be no smaller.
    AtLeast(f64),
}

impl Limit {
    /// Whether a number keeps to it; one that is not finite never does.
    pub fn holds(self, measured: f64) -> bool {
        measured.is_finite()
            && match self {
                Self::AtMost(most) => measured <= most,
                Self::AtLeast(least) => measured >= least,
            }
    }
}

/// A criterion, and what was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
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
        number: 5,
        name: "support",
        what: "A support a thousand times softer and stiffer than the resin annulus.",
        fidelities: &FidelityLevel::ALL,
        examine: ring::stiffness,
    },
    Case {
        number: 6,
        name: "nearly incompressible resin",
        what: "ν = 0.4999: the annulus neither locks nor softens; two meshes agree.",
        fidelities: &[FidelityLevel::Reduced, FidelityLevel::Fea],
        examine: ring::incompressible,
    },
    Case {
        number: 7,
        name: "unequal and many beads",
        what: "One bead a thousand times as heavy, one of a tenth of the radius; two beads, forty, a thousand.",
        fidelities: &FidelityLevel::ALL,
        examine: chains::examine,
    },
    Case {
        number: 8,
        name: "overdamped",
        what: "Both dashpots up to a thousand times the paper’s coefficient, √δ at first touch included: no energy is made, no force pulls.",
        fidelities: &FidelityLevel::ALL,
        examine: dampers::examine,
    },
    Case {
        number: 9,
        name: "bad drive record",
        what: "A horn-tip record with noise, dropouts, clipping, a step in its baseline, at 1 and 25 MHz: read with its flaw named or \
               refused; what is read drives the chain as the clean record does, within what the flaw explains.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::Reduced],
        examine: record::examine,
    },
    Case {
        number: 10,
        name: "other units, mirrored",
        what: "A bench of twice the size has the same velocities in twice the time; units in the scene do not matter; a mirrored chain \
               mirrors its motion: all to rounding.",
        fidelities: &FidelityLevel::ALL,
        examine: similarity::examine,
    },
    Case {
        number: 11,
        name: "water",
        what: "A disc a hundred times softer and stiffer, with and without a dashpot there, an overdamped one, a static force; half the water \
               in front of its absorbing boundary, 10 ms of an undamped chain: no energy beyond the piston’s work, no echo.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::Reduced, FidelityLevel::Fea],
        examine: water::examine,
    },
    Case {
        number: 12,
        name: "calibration without an answer",
        what: "Half the parameter box fails; the record is pure noise; a parameter has no effect: the verdict or the width of the interval says \
               so, never a wrong number with confidence.",
        fidelities: &[FidelityLevel::Hertz],
        examine: fits::examine,
    },
    Case {
        number: 13,
        name: "chaotic and regular",
        what: "The scatter under perturbations no laboratory controls tells a chaotic regime from a regular one.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::Reduced],
        examine: chaos::examine,
    },
    Case {
        number: 14,
        name: "friction with reversal at rest",
        what: "Beads rub on their guide, from weakly to more than the contacts push, straight and oblique: they stick, slip and reverse, and the \
               energy balance closes.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::FiniteBody, FidelityLevel::Reduced],
        examine: effects::friction,
    },
    Case {
        number: 15,
        name: "yielding contacts that chatter",
        what: "Contacts yield, open, close and yield again, hard as bearing steel and soft as wax; loading and unloading meet their curves exactly.",
        fidelities: &[FidelityLevel::Hertz],
        examine: effects::yielding,
    },
    Case {
        number: 16,
        name: "a compliant horn",
        what: "A resonator of Q 1000 at the drive, a tip lighter than a bead, one with hardly a resonance: horn and chain have a common energy balance.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::Reduced],
        examine: effects::horn,
    },
    Case {
        number: 17,
        name: "a bead of ten thousand times the mass",
        what: "A bead thrown at it comes back as from a wall, by the laws of an elastic hit; as third of six it closes the balance of energy.",
        fidelities: &FidelityLevel::ALL,
        examine: bodies::heavy,
    },
    Case {
        number: 18,
        name: "from rubber to beyond diamond",
        what: "E of four beads falls from 1 TPa to 1 MPa. Pressed slowly to twice the static approach, every contact carries 2^(3/2) times the static \
               force.",
        fidelities: &FidelityLevel::ALL,
        examine: bodies::moduli,
    },
    Case {
        number: 19,
        name: "an inelastic hit",
        what: "With γ of a thousand times the paper’s two beads go on together: momentum stays, half of the energy is lost.",
        fidelities: &FidelityLevel::ALL,
        examine: dampers::inelastic,
    },
    Case {
        number: 20,
        name: "gaps of a millimetre and of a picometre",
        what: "A bead flies 1 mm, is pressed not before and not after it, and hits one that stands 1 pm before a third, which is as good as touching.",
        fidelities: &FidelityLevel::ALL,
        examine: gaps::examine,
    },
    Case {
        number: 21,
        name: "ten million steps",
        what: "An undamped, unpressed chain after ten million steps: finite, its energy balanced.",
        fidelities: &[FidelityLevel::Hertz],
        examine: steps::ten_million,
    },
    Case {
        number: 22,
        name: "chatter at a closing gap",
        what: "A bead bounces ever faster between a wall and a piston that comes near; the action ∮p dq of its motion is an adiabatic invariant.",
        fidelities: &FidelityLevel::ALL,
        examine: gaps::chatter,
    },
    Case {
        number: 23,
        name: "α of a thousandth",
        what: "A pressed chain answers half of it by half; Hertz’ chain without pressing is a scaled copy of that at α = 1.",
        fidelities: &FidelityLevel::ALL,
        examine: similarity::alpha,
    },
    Case {
        number: 24,
        name: "nearly incompressible beads",
        what: "ν = 0.4999: beads hit one another by Hertz’ law, neither locked nor softened; two meshes agree.",
        fidelities: &FidelityLevel::ALL,
        examine: bodies::incompressible,
    },
    Case {
        number: 25,
        name: "slender elements",
        what: "A patch of 5 µm at the pole of a bead, its sides up to 4000 times the shortest; an annulus of 1 µm. The mesher makes no worse elements.",
        fidelities: &[FidelityLevel::Reduced, FidelityLevel::Fea],
        examine: slivers::examine,
    },
    Case {
        number: 26,
        name: "a step fifty times too long",
        what: "It is refused, or the balance of energy warns.",
        fidelities: &[FidelityLevel::Hertz, FidelityLevel::Reduced, FidelityLevel::Fea],
        examine: steps::too_large,
    },
];

/// The checks of a case, the cheapest model first, with these overrides of every scene.
fn examined(number: u32, overrides: &[&str]) -> Vec<Check> {
    let case = CASES.iter().find(|case| case.number == number).unwrap();
    let (bodies, overrides) = (Bodies::new(None), overrides.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>());
    let of = |fidelity: &FidelityLevel| {
        let mut room = Room::new(&overrides, *fidelity, &bodies);
        (case.examine)(&mut room);
        room.checks
    };
    case.fidelities.par_iter().with_max_len(1).map(of).collect::<Vec<_>>().concat()
}

/// Every check of a case holds, and the page says what is measured.
fn holds(number: u32) {
    let case = CASES.iter().find(|case| case.number == number).unwrap();
    let checks = examined(number, &[]);
    let broken: Vec<&Check> = checks.iter().filter(|check| !check.holds).collect();
    assert!(broken.is_empty(), "{broken:#?}");
    page::compare(case, &checks);
}

macro_rules! cases {
    ($($(#[$slow:meta])? $name:ident $number:literal),* $(,)?) => {
        $(#[test] $(#[$slow])? fn $name() { holds($number) })*
    };
}

cases! {
    #[ignore = "slow, run by .ci/full"]
    sonic_vacuum 1,
    precompression 2,
    fast_large_and_tiny 3,
    step 4,
    support 5,
    nearly_incompressible_resin 6,
    #[ignore = "slow, run by .ci/full"]
    unequal_and_many_beads 7,
    overdamped 8,
    bad_drive_record 9,
    other_units_and_mirrored 10,
    #[ignore = "slow, run by .ci/full"]
    water 11,
    calibration_without_an_answer 12,
    chaotic_and_regular 13,
    friction_with_reversal_at_rest 14,
    yielding_contacts_that_chatter 15,
    compliant_horn 16,
    bead_of_ten_thousand_times_the_mass 17,
    from_rubber_to_beyond_diamond 18,
    inelastic_hit 19,
    gaps_of_a_millimetre_and_of_a_picometre 20,
    #[ignore = "slow, run by .ci/full"]
    ten_million_steps 21,
    chatter_at_a_closing_gap 22,
    alpha_of_a_thousandth 23,
    nearly_incompressible_beads 24,
    slender_elements 25,
    step_fifty_times_too_long 26,
}

#[test]
fn every_case_has_a_number_a_sentence_and_a_model() {
    assert!(CASES.iter().map(|case| case.number).eq(1..=CASES.len() as u32));
    assert!(CASES.iter().all(|case| case.what.ends_with('.') && !case.fidelities.is_empty()));
}

#[test]
fn checks_come_in_order_and_are_the_same_every_time() {
    let (once, again) = (examined(10, &[]), examined(10, &[]));
    assert_eq!(once, again);
    let place = |check: &Check| FidelityLevel::ALL.iter().position(|fidelity| *fidelity == check.fidelity).unwrap();
    let places: Vec<usize> = once.iter().map(place).collect();
    assert!(places.is_sorted() && places[0] == 0 && *places.last().unwrap() == 3);
}

#[test]
fn what_cannot_run_is_a_check_that_does_not_hold() {
    let checks = examined(5, &["chain.gaps=1 m"]);
    assert!(!checks.is_empty());
    assert!(checks.iter().all(|check| !check.holds && check.measured.is_none() && check.note.is_some()));
}

#[test]
fn a_number_that_is_not_finite_keeps_to_no_limit() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(!Limit::AtMost(1.0).holds(value) && !Limit::AtLeast(-1.0).holds(value));
    }
    assert!(Limit::AtMost(1.0).holds(1.0) && Limit::AtLeast(1.0).holds(1.0) && !Limit::AtLeast(1.0).holds(0.9));
}
