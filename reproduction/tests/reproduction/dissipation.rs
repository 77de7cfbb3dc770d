//! The study of dissipation, small, on the chain: what it recovers, what it writes, what it refuses.

use std::{fs, process::Command};

use granchain_calibration::predict::Bodies;
use granchain_calibration::predict::observation;
use granchain_calibration::predict::replicates::Unwatched;
use granchain_reproduction::dissipation::{
    BASES, Candidate, DissipationOutcome, DissipationPlan, EFFECTS, Effect, NOTHING, Study,
};
use granchain_reproduction::divided::Divided;
use granchain_reproduction::page::dissipation::DissipationReport;
use granchain_reproduction::published::Peaks;

fn by_key(key: &str) -> Effect {
    *EFFECTS.iter().find(|effect| effect.key == key).unwrap()
}

/// Friction and drag, a short burst.
fn plan(printed: Peaks) -> DissipationPlan {
    let effects = vec![by_key("holder.friction_force"), by_key("holder.drag")];
    let alphas = vec![0.4, 0.5, 0.6, 0.7, 0.8];
    DissipationPlan { alphas, alone: 5, paired: 2, confirming: 4, printed, effects, ..DissipationPlan::quick(1) }
}

fn overrides() -> Vec<String> {
    ["model.kind=chain", "drive.cycles=12", "duration=250us"].map(str::to_owned).to_vec()
}

fn run(printed: Peaks, threads: usize) -> DissipationOutcome {
    let study = Study::new(plan(printed), &overrides(), Bodies::default()).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        study.probe(&Unwatched).unwrap();
        study.run(&Unwatched).unwrap()
    })
}

/// Peaks of the chain with linear dampers and this drag (N·s/m) at α.
fn made(drag: f64, alpha: f64) -> Peaks {
    let candidate = Candidate { base: BASES[0], effects: vec![by_key("holder.drag")] };
    let mut all = overrides();
    all.push(format!("alpha={alpha}"));
    let mut scene = candidate.scene(&all, &[drag]).unwrap();
    scene.amplitude_scale = alpha;
    let response = granchain::model::run(&scene, &mut |_| true).unwrap();
    let settings = observation::settings(&scene).unwrap();
    let features = observation::measure_response(&scene, &response, &settings).unwrap();
    Peaks { positive_m_per_s: features.peaks.positive, negative_m_per_s: features.peaks.negative }
}

#[test]
fn an_effect_that_made_the_peaks_is_found_with_its_strength_on_any_number_of_threads() {
    let printed = made(0.05, 0.6);
    let outcome = run(printed, 2);
    for (candidate, found, behind) in outcome.ranked().take(8) {
        println!(
            "{behind:.2} ± {:?} {} α {:.3} {:?}",
            found.log_evidence_error,
            candidate.name(),
            found.alpha,
            found.strengths
        );
    }
    let own = |candidate: &Candidate| candidate.base == BASES[0] && candidate.effects == [by_key("holder.drag")];
    let (_, found, behind) = outcome.ranked().find(|(candidate, ..)| own(candidate)).unwrap();
    assert!(behind > -NOTHING && found.agrees(printed), "{behind} {found:?}");
    assert!((found.alpha / 0.6 - 1.0).abs() < 0.1 && (found.strengths[0] / 0.05).ln().abs() < 0.7, "{found:?}");
    assert_eq!(outcome.candidates.len(), 12);
    assert!(outcome == run(printed, 1));

    let report = DissipationReport {
        program: "granchain".into(),
        outcome,
        command_line: "granchain-reproduction dissipation".into(),
    };
    let files = report.files().unwrap();
    let named = |name: &str| {
        let found = files.iter().find(|(path, _)| path.to_str() == Some(name));
        String::from_utf8(found.unwrap_or_else(|| panic!("{name}")).1.clone()).unwrap()
    };
    assert_eq!(named("dissipation.csv").lines().count(), 1 + 12);
    // Alone, five strengths of two effects, four of the pair, at five α with each of three dampers.
    assert_eq!(named("points.csv").lines().count(), 1 + 3 * 5 * (1 + 5 + 5 + 4));
    for word in ["invented", "two printed numbers", "drag"] {
        assert!(named("report.md").to_lowercase().contains(word), "{word}");
    }
}

#[test]
fn the_study_writes_its_folder_and_says_what_the_model_has_not() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("dissipation");
    let output = Command::new(env!("CARGO_BIN_EXE_granchain-reproduction"))
        .args(["dissipation", "--quick", "--model", "chain", "--set", "drive.cycles=6", "--set", "duration=140us"])
        .args(["--out", out.to_str().unwrap()])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("runs on model `chain`, about"), "{said}");
    for name in ["report.html", "report.md", "dissipation.json", "dissipation.csv", "points.csv", "timing.json"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    let page = fs::read_to_string(out.join("report.md")).unwrap();
    // Eight candidates a law: alone with it, and in seven pairs.
    assert!(page.contains("loss.support") && page.contains("24"), "{page}");
    assert!(page.contains("--quick") && page.contains("invented"));
}
