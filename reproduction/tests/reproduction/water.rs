//! The study before water, small: what it runs, what it says, what it writes.

use granchain_calibration::predict::Bodies;
use granchain_calibration::predict::replicates::{Unwatched, Watch};
use granchain_reproduction::divided::Divided;
use granchain_reproduction::failure::StudyError;
use granchain_reproduction::page::water::WaterReport;
use granchain_reproduction::water::{Study, WaterOutcome, WaterPlan, combinations};

/// A burst of 8 cycles and coarse elements: seconds instead of minutes.
fn study(replicates: usize) -> Result<Study, StudyError> {
    let plan = WaterPlan { drives_m: vec![0.4e-6, 1.2e-6], replicates, soft_side_m: 0.2e-3 };
    let overrides = ["drive.cycles=8", "duration=125 us"].map(str::to_owned);
    Study::new(plan, &overrides, Bodies::default())
}

fn outcome() -> WaterOutcome {
    study(3).unwrap().run(&Unwatched).unwrap()
}

#[test]
fn every_combination_has_a_cell_a_drive_and_the_page_holds_them_all() {
    let outcome = outcome();
    assert_eq!(outcome.combinations.len(), combinations().len());
    for own in &outcome.combinations {
        assert_eq!(own.cells.len(), 2);
        for cell in &own.cells {
            assert!(cell.failures.is_empty(), "{:?} {}: {:?}", own.combination, cell.drive_m, cell.failures);
            let found = cell.pressure_pa.unwrap();
            assert!(found.lowest <= found.median && found.median <= found.highest && found.lowest > 0.0);
            // ±2 % of drive moves something.
            assert!(found.highest > found.lowest, "{:?}", own.combination);
        }
        let [low, high] = [0, 1].map(|drive| own.cells[drive].pressure_pa.unwrap().median);
        assert!(own.combination.rim == "free" || high > low, "{:?}: {low} {high}", own.combination);
    }
    // Mounts, baffles and dampers are really other scenes.
    let median = |index: usize| outcome.combinations[index].cells[1].pressure_pa.unwrap().median;
    for (a, b) in [(0, 1), (0, 2), (0, 4), (0, 8)] {
        assert!((median(a) / median(b) - 1.0).abs() > 1e-3, "{a} {b}: {} {}", median(a), median(b));
    }
    assert_eq!(outcome.waveforms.len(), 2);
    assert!(outcome.companion.mount_similarity.iter().all(|(_, value)| (0.0..=1.0).contains(value)));

    let report = WaterReport {
        program: "granchain".into(),
        model: "chain",
        outcome,
        command_line: "granchain-reproduction water".into(),
    };
    let files = report.files().unwrap();
    let named = |name: &str| {
        let found = files.iter().find(|(path, _)| path.to_str() == Some(name));
        String::from_utf8(found.unwrap_or_else(|| panic!("{name}")).1.clone()).unwrap()
    };
    // 12 combinations and the aluminium beads at two drives below the head.
    assert_eq!(named("combinations.csv").lines().count(), 1 + 13 * 2);
    let page = named("report.html");
    for word in ["14 kPa", "aluminium", "soft baffle", "unexplained", "fig"] {
        assert!(page.to_lowercase().contains(&word.to_lowercase()), "{word}");
    }
    let json: serde_json::Value = serde_json::from_str(&named("water.json")).unwrap();
    assert_eq!(json["combinations"].as_array().unwrap().len(), 12);
}

#[test]
fn too_few_runs_are_refused_and_a_stop_is_a_stop() {
    assert!(matches!(study(2), Err(StudyError::TooFew { what: "members", .. })));
    struct Stop;
    impl Watch for Stop {
        fn advance(&self, _runs: u64) {}
        fn stop(&self) -> bool {
            true
        }
    }
    assert!(matches!(study(3).unwrap().run(&Stop), Err(StudyError::Stopped)));
}
