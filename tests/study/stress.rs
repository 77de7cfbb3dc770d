//! The suite of hard cases: complete, deterministic, and red where a model is broken.

use granchain::study::{
    Bodies,
    replicates::{Unwatched, Watch},
};
use granchain::validate::stress::{CASES, FidelityLevel, Limit, StressOutcome, StressPlan, run};

fn plan(cases: &[u32], overrides: &[&str]) -> StressPlan {
    let overrides = overrides.iter().map(|text| (*text).to_owned()).collect();
    StressPlan { quick: true, cases: cases.to_vec(), overrides, seed: 1 }
}

fn examined(cases: &[u32], overrides: &[&str]) -> StressOutcome {
    run(&plan(cases, overrides), &Bodies::new(None), &Unwatched)
}

#[test]
fn every_case_has_a_number_a_sentence_and_a_model() {
    let numbers: Vec<u32> = CASES.iter().map(|case| case.number).collect();
    assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]), "{numbers:?}");
    assert!(CASES.iter().all(|case| case.what.ends_with('.') && !case.fidelities.is_empty()));
}

#[test]
fn checks_come_in_order_and_are_the_same_every_time() {
    let (once, again) = (examined(&[11], &[]), examined(&[11], &[]));
    assert_eq!(once, again);
    assert_eq!(once.broken().collect::<Vec<_>>(), Vec::<&granchain::validate::stress::Check>::new());
    let places: Vec<usize> = once
        .checks
        .iter()
        .map(|check| FidelityLevel::ALL.iter().position(|fidelity| *fidelity == check.fidelity).unwrap())
        .collect();
    assert!(places.is_sorted() && places[0] == 0 && *places.last().unwrap() == 3);
}

#[test]
fn what_cannot_run_is_a_check_that_does_not_hold() {
    let outcome = examined(&[6], &["chain.gaps=1 m"]);
    assert!(!outcome.checks.is_empty() && outcome.broken().count() == outcome.checks.len());
    assert!(outcome.checks.iter().all(|check| check.measured.is_none() && check.note.is_some()));
}

#[test]
fn a_number_that_is_not_finite_keeps_to_no_limit() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(!Limit::AtMost(1.0).holds(value) && !Limit::AtLeast(-1.0).holds(value));
    }
    assert!(Limit::AtMost(1.0).holds(1.0) && Limit::AtLeast(1.0).holds(1.0) && !Limit::AtLeast(1.0).holds(0.9));
}

struct Stopped;

impl Watch for Stopped {
    fn advance(&self, _runs: u64) {
        panic!("nothing may run");
    }

    fn stop(&self) -> bool {
        true
    }
}

#[test]
fn once_stopped_nothing_runs() {
    assert_eq!(run(&plan(&[], &[]), &Bodies::new(None), &Stopped), StressOutcome::default());
}
