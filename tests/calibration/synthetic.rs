//! The calibration's own proof, in its quick form: synthetic records with known truth, wrong models, the shipped synthetic record.
//!
//! The long form is `granchain coverage --count 80`; its figures stand in `docs/validation.md`.

use assert_cmd::Command;
use granchain::{
    calibration::{fit::Verdict, multi_record::TESTED_TOGETHER},
    scene,
    validate::synthetic::{SyntheticPlan, level_proof, level_synthetic, proof, synthetics},
};

fn study(plan: &SyntheticPlan) -> Vec<granchain::validate::synthetic::SyntheticOutcome> {
    let base = scene::load("annulus", &["duration=900us".into()]).unwrap();
    synthetics(&base, plan, 0..plan.total(), &|| {}, &|| false).unwrap().unwrap()
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn ninety_per_cent_intervals_cover_the_truth_of_twenty_records() {
    let proof = proof(&study(&SyntheticPlan { count: 20, ..SyntheticPlan::default() }));
    assert_eq!(proof.without_fit, 0);
    for (parameter, widest) in proof.parameters.iter().zip([0.10, 0.23]) {
        // With a true coverage of 0.9, fewer than 15 of 20 happen in 1 % of all seeds. The widths are those of the issue's
        // 80 synthetic records; the medians over 80 are a third of them.
        assert!(parameter.covered >= 15, "{parameter:?}");
        assert!(parameter.median_width <= widest, "{parameter:?}");
        assert!(parameter.median_error <= 0.02, "{parameter:?}");
    }
    assert!(proof.law_tests >= 4, "{proof:?}");
    // A wrong law named is worse than none: at most one of twenty, so none of these few.
    assert_eq!(proof.right_law + proof.undecided_law, proof.law_tests, "{proof:?}");
    assert!(proof.right_law * 2 > proof.law_tests, "{proof:?}");
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn a_wrong_model_does_not_end_within_scatter() {
    let outcomes = study(&SyntheticPlan { count: 0, wrong: 1, ..SyntheticPlan::default() });
    assert_eq!(outcomes.len(), 3);
    for outcome in outcomes {
        let fit = outcome.fit.as_ref().unwrap();
        assert_ne!(fit.verdict, Verdict::WithinScatter, "{:?}: {:?}", outcome.flaw, outcome);
    }
}

#[test]
#[ignore = "slow, run by .ci/full"]
fn three_drive_levels_together_narrow_the_interval_of_the_damping_and_keep_its_coverage() {
    let base = scene::load("annulus", &["duration=900us".into()]).unwrap();
    let levels = [1.0, 0.5, 0.25];
    let plan = SyntheticPlan { count: 6, evaluations: TESTED_TOGETHER, ..SyntheticPlan::default() };
    let outcomes = level_synthetic(&base, &plan, &levels, 0..plan.count, &|| {}, &|| false).unwrap();
    let proof = level_proof(&outcomes, &levels);
    assert_eq!(proof.without_fit, 0);
    let of = |name: &str, levels: &str| {
        proof.widths.iter().find(|row| row.name == name && row.levels == levels).unwrap().clone()
    };
    let (single, joint) = (of("damping", "1"), of("damping", "all"));
    // Of 24 synthetic records 0.44; the first six are mostly regular, where one record already tells the damping.
    assert!(joint.median_width <= 0.8 * single.median_width, "{single:?} {joint:?}");
    for name in ["alpha", "damping"] {
        // With a true coverage of 0.9, fewer than 4 of 6 happen in 1.6 per cent of all seeds.
        assert!(of(name, "all").covered >= 4, "{:?}", of(name, "all"));
    }
    // The first record is that of the single-level study, and its fit the same.
    let alone = study(&SyntheticPlan { count: 1, ..plan });
    assert_eq!(alone[0].fit, outcomes[0].single[0]);
}

#[test]
fn the_shipped_synthetic_record_is_recovered() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("twin");
    Command::cargo_bin("calibrate")
        .unwrap()
        .args(["--measured", "measurements/twin-annulus/vib.csv", "--model", "chain", "--quiet", "--out"])
        .arg(&out)
        .assert()
        .success();
    let text = std::fs::read_to_string(out.join("calibration.json")).unwrap();
    let outcome: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(outcome["verdict"], "within scatter");
    // measurements/twin-annulus/truth.toml
    for (name, truth) in [("alpha", 0.7), ("damping", 0.6)] {
        let fitted = &outcome["parameters"][name];
        let (low, high) = (fitted["low"].as_f64().unwrap(), fitted["high"].as_f64().unwrap());
        assert!(low <= truth && truth <= high && high / low < 1.1, "{name}: {fitted}");
    }
}
