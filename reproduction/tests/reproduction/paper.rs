//! The study of the source paper: whole, deterministic, and judging what it says it judges.

use std::{collections::BTreeMap, path::PathBuf, sync::LazyLock};

use granchain::feature::{AmplitudeSpectrum, Ratio};
use granchain::signal::Series;
use granchain_calibration::predict::Bodies;
use granchain_calibration::predict::ensemble::Moments;
use granchain_calibration::predict::replicates::Unwatched;
use granchain_reproduction::divided::Divided;
use granchain_reproduction::page::paper::{PaperReport, Reconstruction};
use granchain_reproduction::paper::statements::{Claim, STATEMENTS};
use granchain_reproduction::paper::{Judgement, LAWS, PaperOutcome, PaperPlan, READINGS, Study, Verdict, judge};
use granchain_reproduction::portrait::{PortraitMoments, Trait};
use granchain_reproduction::published::MEASURED;

fn outcome_on(threads: usize) -> PaperOutcome {
    let plan =
        PaperPlan { alphas: vec![0.3, 0.5, 1.0, 1.5], replicates: 3, reading_replicates: 2, ..PaperPlan::quick(1) };
    let study = Study::new(plan, &["model.kind=chain".into()], Bodies::new(None)).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| study.run(&Unwatched).unwrap())
}

static OUTCOME: LazyLock<PaperOutcome> = LazyLock::new(|| outcome_on(2));

fn report(outcome: &PaperOutcome) -> BTreeMap<PathBuf, Vec<u8>> {
    let spectrum = AmplitudeSpectrum { step_hz: 1e3, resolution_hz: 1e3, amplitudes: vec![0.01; 400] };
    let velocity = Series::new(0.0, 1e-6, (0..700).map(|i| 0.1 * f64::from(i % 7)).collect());
    let report = PaperReport {
        program: "granchain".into(),
        judgements: judge(outcome),
        outcome: outcome.clone(),
        reconstruction: Reconstruction { velocity, spectrum, drive_line: 0.01 },
        drive_frequency: 73e3,
        command_line: "granchain-reproduction paper".into(),
    };
    report.files().unwrap().into_iter().collect()
}

fn judgement(outcome: &PaperOutcome, key: &str) -> Judgement {
    judge(outcome).into_iter().find(|judgement| judgement.statement.key == key).unwrap()
}

#[test]
fn every_printed_statement_has_its_row_and_every_reading_its_rank() {
    let judgements = judge(&OUTCOME);
    let keys: Vec<_> = judgements.iter().map(|judgement| judgement.statement.key).collect();
    assert_eq!(keys, STATEMENTS.iter().map(|statement| statement.key).collect::<Vec<_>>());
    for judgement in &judgements {
        let number = matches!(judgement.statement.claim, Claim::PositivePeak(_) | Claim::NegativePeak(_));
        assert_eq!(judgement.ours.is_some(), number, "{}", judgement.statement.key);
        let untested = matches!(judgement.statement.claim, Claim::NotTested(_));
        assert_eq!(judgement.verdict == Verdict::NotTested, untested, "{}", judgement.statement.key);
    }
    for readings in &OUTCOME.readings {
        assert_eq!(readings.len(), READINGS.len());
        assert!(readings.iter().all(|reading| reading.failure.is_none()), "{readings:?}");
        assert!(readings.is_sorted_by(|a, b| a.shift >= b.shift));
        assert!(readings.iter().all(|reading| reading.largest_at.is_some()), "{readings:?}");
    }
    // A static force moves the drive at which the thirds are largest, as an independent integrator found: from 0.3 to 0.5 and above.
    let largest =
        |name: &str| OUTCOME.readings[0].iter().find(|it| it.reading.name == name).unwrap().largest_at.unwrap();
    assert!(largest("precompression 1 mN") < largest("precompression 15 mN"));
    let files = report(&OUTCOME);
    let csv = String::from_utf8(files[&PathBuf::from("statements.csv")].clone()).unwrap();
    assert_eq!(csv.lines().count(), 1 + STATEMENTS.len());
    let page = String::from_utf8(files[&PathBuf::from("report.html")].clone()).unwrap();
    for statement in STATEMENTS {
        assert!(page.contains(&statement.said.replace(" %", "\u{a0}%")), "{}", statement.said);
    }
    assert!(page.contains("of them blind") && page.contains("agrees (chosen)"));
    assert!(!page.contains("(a) measured") && page.contains("reconstruction"));
}

#[test]
fn one_thread_and_two_make_the_same_files() {
    assert!(report(&outcome_on(1)) == report(&OUTCOME));
}

#[test]
fn thirds_belong_to_linear_dampers_and_the_half_to_kuwabara_konos() {
    // The prototype and the paper: thirds at α = 0.5 with linear dampers, the half at 1.5 with Kuwabara–Kono's.
    let [linear, kuwabara_kono] = [&OUTCOME.laws[0].moments, &OUTCOME.laws[1].moments];
    assert!(linear.has_line(Ratio::new(1, 3)) && linear.has_line(Ratio::new(2, 3)));
    assert!(kuwabara_kono.has_line(Ratio::new(1, 2)));
    assert!(!kuwabara_kono.has_line(Ratio::new(1, 3)) && !kuwabara_kono.has_line(Ratio::new(2, 3)));
    for key in ["linear.thirds", "kuwabara-kono.half", "kuwabara-kono.no-thirds"] {
        assert_eq!(judgement(&OUTCOME, key).verdict, Verdict::Agrees, "{key}");
    }
}

#[test]
fn the_sweep_at_the_laws_own_alpha_is_the_ensemble_of_that_alpha() {
    for (law, (own, sweep)) in LAWS.iter().zip(OUTCOME.laws.iter().zip(&OUTCOME.sweeps)) {
        let point = sweep.iter().find(|point| point.alpha == law.alpha).unwrap();
        let (swept, alone) =
            (point.moments.get(Trait::PositivePeak).unwrap(), own.spread(Trait::PositivePeak).unwrap());
        // Two and three replicates of one seed: their means differ by no more than their scatter and the noise allow.
        let allowed = 3.0 * (swept.deviation + alone.scatter) + 2e-3;
        assert!((swept.mean - alone.mean).abs() < allowed, "{} {swept:?} {alone:?}", law.name);
    }
}

/// The outcome with the peaks of a law put where a test wants them.
fn with_peaks(law: usize, positive: f64, negative: f64, scatter: f64) -> PaperOutcome {
    let mut outcome = OUTCOME.clone();
    let all = Trait::all();
    for (what, mean) in [(Trait::PositivePeak, positive), (Trait::NegativePeak, negative)] {
        let place = all.iter().position(|other| *other == what).unwrap();
        let spread = outcome.laws[law].spreads[place].as_mut().unwrap();
        (spread.mean, spread.scatter, spread.sensitivity) = (mean, scatter, 0.002);
    }
    outcome
}

#[test]
fn a_printed_peak_agrees_within_two_scatters_one_per_cent_of_drive_and_half_a_digit() {
    // 2 × 3 + 2 + 0.5 mm/s.
    let verdict = |positive: f64| judgement(&with_peaks(0, positive, -0.2, 0.003), "linear.positive-peak").verdict;
    assert_eq!(verdict(0.296 + 0.0084), Verdict::Agrees);
    assert_eq!(verdict(0.296 - 0.0084), Verdict::Agrees);
    assert_eq!(verdict(0.296 + 0.0086), Verdict::Differs);
    assert_eq!(verdict(0.296 - 0.0086), Verdict::Differs);
}

#[test]
fn both_peaks_show_the_law_closer_to_the_measurement() {
    let near = with_peaks(0, MEASURED.positive_m_per_s, MEASURED.negative_m_per_s, 0.01);
    assert_eq!(judgement(&near, "linear.best-law").verdict, Verdict::Agrees);
    let far = with_peaks(0, 0.9, -0.9, 0.01);
    assert_eq!(judgement(&far, "linear.best-law").verdict, Verdict::Differs);
}

#[test]
fn an_extreme_over_alpha_must_fall_on_the_printed_value_or_a_step_beside_it() {
    let verdict = |largest_at: usize| {
        let mut outcome = OUTCOME.clone();
        let mut sweep = Vec::new();
        for index in 0..25 {
            let mut point = outcome.sweeps[0][0].clone();
            point.alpha = 0.3 + 0.05 * index as f64;
            let mean = 1.0 - 0.01 * (index as f64 - largest_at as f64).abs();
            let of =
                |what| (what == Trait::Level(Ratio::new(1, 3))).then_some(Moments { mean, deviation: 0.0, count: 2 });
            point.moments = PortraitMoments(Trait::all().into_iter().map(of).collect());
            sweep.push(point);
        }
        outcome.sweeps[0] = sweep;
        judgement(&outcome, "linear.best-alpha").verdict
    };
    assert_eq!(
        [2, 3, 4, 5, 6].map(verdict),
        [Verdict::Differs, Verdict::Agrees, Verdict::Agrees, Verdict::Agrees, Verdict::Differs]
    );
}
