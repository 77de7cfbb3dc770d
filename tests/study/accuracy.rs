//! What accuracy costs: observed orders, references that have converged, levels that keep their promise.

use std::process::{Command, Output};

use granchain::{
    calibration::synthetic::vibrometer_csv,
    model,
    scene::{self, Limits, ModelKind},
    study::replicates::{Unwatched, Watch},
    validate::accuracy::{
        AccuracyError, AccuracyPlan, Study, Watched,
        ladder::{FidelityLevel, Ladder},
        relative_error,
        stored::{BEST, OwnErrors, Stored},
    },
};

const KEPT: [&str; 3] = ["rigid", "annulus", "water"];

fn plan(scene: &str, full: bool) -> AccuracyPlan {
    let (sets, program) = (Vec::new(), "granchain".to_owned());
    AccuracyPlan { scene: scene.into(), sets, full, replicates: 2, seed: 1, limits: Limits::default(), program }
}

fn line(scene: &str, key: &str) -> OwnErrors {
    Study::new(plan(scene, true)).unwrap().line(key, &Unwatched).unwrap().unwrap()
}

fn granchain(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.env("XDG_CACHE_HOME", env!("CARGO_TARGET_TMPDIR")).args(arguments).output().unwrap()
}

#[test]
fn the_order_in_the_step_is_two_and_what_is_kept_is_what_is_found() {
    let kept = Stored::of("rigid").unwrap();
    let key = "reduced-step";
    let own = line("rigid", key);
    let order = own.order.unwrap();
    // The reduced model at its default density has 2.106 over steps from 100 to 6.25 ns.
    assert!((order - 2.0).abs() < 0.15, "{key}: {order}");
    let same = kept.own.iter().find(|kept| kept.key == key).unwrap();
    for (now, then) in own.points.iter().zip(&same.points) {
        // The last digits depend on the processor's vector unit.
        assert!((now.error / then.error - 1.0).abs() < 1e-2, "{key}: {now:?} {then:?}");
    }
}

#[test]
fn the_force_of_a_contact_is_of_second_order_in_the_element_size() {
    let own = line("rigid", "contact-force");
    let order = own.order.unwrap();
    assert!((order - 2.0).abs() < 0.3, "{own:?}");
    assert!(own.points.windows(2).all(|pair| pair[1].error < pair[0].error), "{own:?}");
}

#[test]
fn every_reference_has_converged_to_a_tenth_of_what_is_quoted() {
    for scene in KEPT {
        let stored = Stored::of(scene).unwrap();
        let ladder = Ladder::of(&scene::load(scene, &[]).unwrap());
        assert_eq!(stored.references[0].key, BEST);
        for own in stored.own.iter().filter(|own| own.key != "contact-force") {
            let reference = stored.reference(&own.key).unwrap();
            for point in own.points.iter().filter(|point| point.quoted) {
                assert!(reference.change <= 0.1 * point.error, "{scene}, {}: {point:?}", own.key);
            }
            // What the mesh leaves in two fitted constants need not exceed ten times what their limit is known to.
            let may_be_small = own.key == "finite-body-mesh";
            assert!(
                may_be_small || own.points.iter().any(|point| point.quoted),
                "{scene}: nothing is quoted of {}",
                own.key
            );
        }
        let measured: Vec<_> = stored.measured.iter().map(|measured| measured.setting.clone()).collect();
        assert_eq!(measured, ladder.settings(), "{scene}");
        assert!(stored.measured.iter().any(|measured| measured.error > stored.least_quotable()));
    }
}

#[test]
fn a_model_that_leaves_physics_out_ends_at_a_floor() {
    let stored = Stored::of("rigid").unwrap();
    let least = |fidelity: FidelityLevel| {
        let of = stored.measured.iter().filter(|measured| measured.setting.fidelity == fidelity);
        of.map(|measured| measured.error).fold(f64::INFINITY, f64::min)
    };
    // Hertz' half-spaces are a quarter off however small the step; finite bodies are not.
    assert!(
        least(FidelityLevel::Chain) > 0.2
            && least(FidelityLevel::FiniteBody) < 0.02
            && least(FidelityLevel::Reduced) < 0.005
    );
}

#[test]
fn a_level_keeps_what_it_promises() {
    let stored = Stored::of("rigid").unwrap();
    let chosen = stored.cheapest_within(0.01, |fidelity| fidelity.model() != ModelKind::Fea).unwrap();
    let sets: Vec<String> = chosen.setting.sets.iter().cloned().chain(["output_step=100 ns".to_owned()]).collect();
    let response = model::run(&scene::load("rigid", &sets).unwrap(), &mut |_| true).unwrap();
    let values = Watched::Velocity.values(&response, stored.window_s);
    let error = relative_error(&values, &stored.reference(BEST).unwrap().values);
    assert!(error <= 0.01 && (error / chosen.error - 1.0).abs() < 0.05, "{error} {}", chosen.error);
}

#[test]
fn replay_takes_a_level_and_says_what_to_expect() {
    let run = granchain(&["replay", "--scene", "rigid", "--accuracy", "1%", "--set", "duration=20 us", "--json"]);
    let said = String::from_utf8(run.stderr).unwrap();
    assert!(run.status.success(), "{said}");
    for part in ["by --accuracy 1.0 %", "expected error", "was not measured", "expected to take"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let summary: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    let chosen = Stored::of("rigid").unwrap();
    let chosen = chosen.cheapest_within(0.01, |_| true).unwrap().setting.fidelity.model().name();
    assert_eq!(summary["settings"]["model"], chosen, "{}", summary["settings"]);
}

/// The setting that a command without finite elements takes of `rigid` within 5 %: its scene keys, and what is to be said of it.
fn within_five_percent() -> (Vec<String>, Vec<String>) {
    let stored = Stored::of("rigid").unwrap();
    let chosen = stored.cheapest_within(0.05, |fidelity| fidelity.model() != ModelKind::Fea).unwrap();
    let said = [chosen.setting.fidelity.name(), &chosen.setting.to_string(), "by --accuracy 5.0 %", "expected error"];
    (chosen.setting.sets.clone(), said.map(str::to_owned).to_vec())
}

fn assert_says(run: &Output, code: i32, parts: &[String]) {
    let said = String::from_utf8(run.stderr.clone()).unwrap();
    assert_eq!(run.status.code(), Some(code), "{said}");
    parts.iter().for_each(|part| assert!(said.contains(part.as_str()), "{part}: {said}"));
}

#[test]
fn sweep_takes_a_level_and_runs_what_it_says() {
    let (sets, parts) = within_five_percent();
    let place = tempfile::tempdir().unwrap();
    let sweep = |out: &str, more: &[String]| {
        let out = place.path().join(out);
        let mut arguments = vec!["sweep", "--scene", "rigid", "--vary", "alpha=0.5,1", "--set", "duration=20 us"];
        arguments.extend(["--out", out.to_str().unwrap()].into_iter().chain(more.iter().map(String::as_str)));
        (granchain(&arguments), out.join("sweep.csv"))
    };
    let (run, chosen) = sweep("chosen", &["--accuracy".to_owned(), "5%".to_owned()]);
    assert_says(&run, 0, &parts);
    // The very table of the same overrides, and another one than that of the chain of Hertz contacts.
    let overrides: Vec<String> = sets.iter().flat_map(|set| ["--set".to_owned(), set.clone()]).collect();
    let (_, named) = sweep("named", &overrides);
    let (_, hertz) = sweep("hertz", &["--model".to_owned(), "chain".to_owned()]);
    let table = |path: &std::path::Path| std::fs::read_to_string(path).unwrap();
    assert_eq!(table(&chosen), table(&named));
    assert_ne!(table(&chosen), table(&hertz));
    let (refused, _) = sweep("refused", &["--accuracy", "5%", "--model", "chain"].map(str::to_owned));
    assert_says(&refused, 2, &["cannot be used with".to_owned()]);
}

#[test]
fn calibrate_takes_a_level_and_fits_with_what_it_says() {
    let (sets, parts) = within_five_percent();
    let place = tempfile::tempdir().unwrap();
    let damped = ["damping.kind=linear", "damping.coefficient=0.3 N s/m"];
    let overrides: Vec<String> = sets.iter().cloned().chain(damped.map(str::to_owned)).collect();
    let response = model::run(&scene::load("rigid", &overrides).unwrap(), &mut |_| true).unwrap();
    let record = place.path().join("vib.csv");
    std::fs::write(&record, vibrometer_csv(&response.pole_velocity, &[])).unwrap();
    let calibrate = |more: &[&str]| {
        let out = place.path().join("fit");
        let fixed = ["calibrate", "--scene", "rigid", "--fit", "alpha", "--evaluations", "200", "--json"];
        let places = ["--measured", record.to_str().unwrap(), "--out", out.to_str().unwrap()];
        let bench = ["--set", damped[0], "--set", damped[1]];
        granchain(&[&fixed[..], &bench, &places, more].concat())
    };
    let run = calibrate(&["--accuracy", "5%"]);
    assert_says(&run, 0, &parts);
    let outcome: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
    let applied = outcome["overrides"].to_string();
    assert!(sets.iter().all(|set| applied.contains(set.as_str())), "{applied}");
    let alpha = &outcome["parameters"]["alpha"];
    let number = |key: &str| alpha[key].as_f64().unwrap();
    // The record is its own model's, so that its α of 1 lies within a few half-widths of the interval.
    assert!((number("value") - 1.0).abs() < 3.0 * 0.5 * (number("high") - number("low")), "{alpha}");
    assert_says(&calibrate(&["--accuracy", "5%", "--model", "reduced"]), 2, &["cannot be used with".to_owned()]);
}

#[test]
fn a_level_that_nothing_reaches_is_refused_with_what_is_reached() {
    let refused = |arguments: &[&str], code: i32, parts: &[&str]| {
        let run = granchain(arguments);
        let said = String::from_utf8(run.stderr).unwrap();
        assert_eq!(run.status.code(), Some(code), "{said}");
        assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    };
    refused(&["replay", "--scene", "rigid", "--accuracy", "0.001%"], 1, &["most accurate", "chaos floor"]);
    refused(&["replay", "--scene", "chain", "--accuracy", "1%"], 2, &["nothing is stored", "rigid"]);
    refused(&["replay", "--scene", "rigid", "--accuracy", "1%", "--model", "chain"], 2, &["cannot be used with"]);
    refused(&["replay", "--scene", "rigid", "--accuracy", "150%"], 2, &["below 100 %"]);
    refused(&["accuracy", "--scene", "chain"], 1, &["--full"]);
    refused(&["accuracy", "--set", "alpha=0.5"], 2, &["--full"]);
}

#[test]
fn what_is_stored_is_drawn_without_a_run() {
    for scene in KEPT {
        let place = tempfile::tempdir().unwrap();
        let out = place.path().join("page");
        let run = granchain(&["accuracy", "--scene", scene, "--stored", "--out", out.to_str().unwrap(), "--json"]);
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        let found: serde_json::Value = serde_json::from_slice(&run.stdout).unwrap();
        let (stored, settings) = (Stored::of(scene).unwrap(), found["settings"].as_array().unwrap());
        assert_eq!(settings.len(), stored.measured.len(), "{scene}");
        for (setting, measured) in settings.iter().zip(&stored.measured) {
            assert_eq!(
                (&setting["measured_now"], &setting["error"]),
                (&false.into(), &measured.error.into()),
                "{scene}"
            );
        }
        let page = std::fs::read_to_string(out.join("report.html")).unwrap();
        assert!(page.contains("Nothing was run now") && page.contains(&stored.processor), "{scene}");
    }
    let run = granchain(&["accuracy", "--scene", "rigid", "--stored", "--full"]);
    assert_eq!(run.status.code(), Some(2));
}

#[test]
fn a_stopped_study_has_no_outcome() {
    struct Impatient;
    impl Watch for Impatient {
        fn advance(&self, _: u64) {}
        fn stop(&self) -> bool {
            true
        }
    }
    let stopped = Study::new(plan("rigid", false)).unwrap().measure(&Impatient);
    assert!(matches!(stopped, Err(AccuracyError::Stopped)));
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_it_with_130_and_leaves_nothing() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("accuracy");
    let mut command = Command::new(env!("CARGO_BIN_EXE_granchain"));
    command.args(["accuracy", "--scene", "rigid", "--quiet", "--out", out.to_str().unwrap()]);
    let mut child = command.spawn().unwrap();
    // The folder is staged once the study is under way.
    while std::fs::read_dir(place.path()).unwrap().next().is_none() {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it could be stopped");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let left: Vec<_> = std::fs::read_dir(place.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(left.is_empty(), "{left:?}");
}
