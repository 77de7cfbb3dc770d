//! Causes that a calibration names for records of a bench that is not as stated, and what the search for them costs.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use crate::{
    calibrate_bench::Bench,
    harness::{code, stderr},
};
use granchain::calibration::{Plan, Problem, Schedule};
use serde_json::Value;

/// Causes named for a record of the bench with these keys changed, with their texts.
fn causes(bench: &Bench) -> Vec<(String, String)> {
    let output = bench.calibrate(&["--evaluations", "600", "--out", "out"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    let outcome = bench.outcome("out");
    assert_ne!(outcome["verdict"], "within scatter");
    let text = |finding: &Value, key: &str| finding[key].as_str().unwrap().to_owned();
    let named = outcome["diagnosis"].as_array().unwrap().iter();
    named.map(|finding| (text(finding, "cause"), text(finding, "text"))).collect()
}

fn assert_named(named: &[(String, String)], cause: &str, words: &str) {
    assert!(named.iter().any(|(found, text)| found == cause && text.contains(words)), "{cause}: {named:#?}");
}

#[test]
fn a_clock_three_thousandths_fast_is_named_with_its_ratio() {
    let bench = Bench::new();
    bench.on_clock(1.003);
    let named = causes(&bench);
    let text = &named.iter().find(|(cause, _)| cause == "clock").unwrap_or_else(|| panic!("{named:#?}")).1;
    let ratio: f64 = text.split("vibrometer, ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(text.contains("fast") && (0.27..0.33).contains(&ratio), "{text}");
}

#[test]
fn a_horns_face_of_another_material_is_named() {
    let bench = Bench::of(&["piston.contact=half-space", "piston.material=titanium"]);
    assert_named(&causes(&bench), "horn-face", "titanium");
}

#[test]
fn friction_in_the_guide_is_named() {
    let bench = Bench::of(&["holder.friction_force=4 mN"]);
    assert_named(&causes(&bench), "friction", "--fit alpha,damping,friction");
}

#[test]
fn both_damping_laws_at_once_are_named() {
    let bench = Bench::of(&[
        "damping.kind=linear+kuwabara-kono",
        "damping.linear_coefficient=0.2",
        "damping.kuwabara_kono_coefficient=6000",
    ]);
    assert_named(&causes(&bench), "damping-law", "kuwabara-kono");
}

#[test]
fn an_open_gap_is_called_a_gap_or_roughness() {
    assert_named(&causes(&Bench::of(&["chain.gaps.contact1=40 nm"])), "gap", "gap or roughness");
}

/// A record that nothing explains costs most.
#[test]
fn the_search_for_causes_keeps_to_its_runs() {
    let bench = Bench::of(&["chain.radius=0.62 mm", "holder.friction_force=10 mN", "chain.gaps=40 nm"]);
    let plan = Plan {
        measured: Some(bench.path("lab/vib.csv")),
        scene: Some(bench.path("bench.toml").display().to_string()),
        evaluations: Some(400),
        ..Plan::default()
    };
    let problem = Problem::read(&plan).unwrap();
    let fitted = problem.fit(Schedule::default()).unwrap();
    assert!(fitted.is_in_doubt());
    let asked = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&asked);
    let watch = move |_| {
        counted.fetch_add(1, Ordering::Relaxed);
        true
    };
    let told = std::cell::RefCell::new(Vec::new());
    let diagnosis = fitted.diagnose(&problem, Arc::new(watch), &|what| told.borrow_mut().push(what.to_owned()));
    let told = told.into_inner();
    // The cheapest first: those by the runs of the fit, by short runs, and only then by fits of their own.
    assert!(told[0].contains("from the runs of the fit") && told[1].contains("by features"), "{told:?}");
    assert!(!diagnosis.stopped && (1000..=16_000).contains(&diagnosis.runs), "{}", diagnosis.runs);
    // The watch is asked once for eight runs, and now and then between.
    let asked = asked.load(Ordering::Relaxed);
    assert!(8 * asked < 20_000, "{asked}");
}

/// The search for causes is stopped, not the calibration.
#[cfg(unix)]
#[test]
fn ctrl_c_during_the_search_for_causes_keeps_the_result_without_causes() {
    use std::{io::BufRead, process::Stdio};
    let bench = Bench::of(&["chain.radius=0.62 mm", "chain.gaps=40 nm"]);
    let mut command = bench.command(&["--out", "out", "--threads", "1"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut said = Vec::new();
    for line in std::io::BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok) {
        // The verdict stands before the causes are looked for.
        if line.contains("by features") {
            assert!(said.iter().any(|line: &String| line.starts_with("outside scatter (p = ")), "{said:#?}");
            let sent = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
            assert!(sent.unwrap().success());
            std::thread::sleep(Duration::from_millis(10));
        }
        said.push(line);
    }
    let output = child.wait_with_output().unwrap();
    assert_eq!(code(&output), 0, "{said:#?}");
    let outcome = bench.outcome("out");
    assert_eq!(outcome["verdict"], "outside scatter");
    assert!(outcome.get("diagnosis").is_none_or(|named| named.as_array().unwrap().is_empty()), "{outcome:#}");
    assert!(outcome["statements"].to_string().contains("causes were not searched to the end"), "{outcome:#}");
    assert!(bench.path("out/report.html").exists() && !bench.path(".out.unfinished").exists());
}
