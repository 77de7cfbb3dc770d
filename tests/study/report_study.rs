//! Figures and pages of replays, sweeps and twins, from real runs where a run is cheap.

use std::{collections::BTreeMap, path::PathBuf};

use granchain::{
    feature::measure,
    model, report,
    report::twins::{TwinFit, TwinInterval, TwinsReport},
    scene,
    study::observation,
};

fn figures(overrides: &[&str]) -> Vec<(&'static str, report::figure::Figure)> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let scene = scene::load("annulus", &overrides).unwrap();
    let response = model::run(&scene, &mut |_| true).unwrap();
    let features = measure(&response.pole_velocity, &observation::settings(&scene).unwrap()).unwrap();
    report::replay::figures(&response, &response.pole_velocity, &features).unwrap()
}

fn twins(count: u64, covered: impl Fn(u64) -> bool) -> TwinsReport {
    let groups = ["annulus, linear", "rigid, linear", "annulus, Kuwabara–Kono", "rigid, Kuwabara–Kono"];
    let fit = |index: u64, scale: f64| {
        let spread = scale * (1.0 + (index * 7 % 11) as f64);
        let miss = if covered(index) { 0.6 * ((index * 5 % 9) as f64 / 4.0 - 1.0) } else { 1.4 };
        let value = 0.5 * (miss * spread).exp();
        TwinInterval { truth: 0.5, value, low: value * (-spread).exp(), high: value * spread.exp() }
    };
    TwinsReport {
        description: "Twins over the whole box, noise 0 to 3 %.".into(),
        level: 0.9,
        parameters: vec!["amplitude scale α".into(), "damping".into()],
        twins: (0..count)
            .map(|index| TwinFit {
                index,
                group: groups[(index % 4) as usize].into(),
                intervals: vec![fit(index, 0.006), fit(index, 0.015)],
            })
            .collect(),
        statements: vec!["The right law was named in 24 of 24.".into()],
        version: "granchain".into(),
        seed: 1,
        command_line: "granchain twins --count 80".into(),
    }
}

fn files(report: &TwinsReport) -> BTreeMap<PathBuf, Vec<u8>> {
    report.files().unwrap().into_iter().collect()
}

fn page(report: &TwinsReport) -> String {
    String::from_utf8(files(report).remove(&PathBuf::from("report.html")).unwrap()).unwrap()
}

#[test]
fn a_replay_shows_piston_pole_beads_contacts_and_spectrum() {
    let figures = figures(&["duration=300us"]);
    let names: Vec<_> = figures.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["response", "chain", "spectrum"]);
    for (name, figure) in figures {
        let svg = figure.to_svg().unwrap();
        roxmltree::Document::parse(&svg).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(svg.len() < 200_000, "{name}: {} bytes", svg.len());
    }
}

#[test]
fn coverage_is_judged_against_what_the_intervals_claim() {
    assert!(page(&twins(80, |index| index % 10 != 3)).contains("intervals as claimed"));
    assert!(page(&twins(80, |index| index % 3 != 0)).contains("intervals too narrow"));
    assert!(page(&twins(80, |_| true)).contains("intervals wider than claimed"));
    assert!(page(&twins(80, |index| index % 10 != 3)).contains("amplitude scale α: 72 of 80"));
}

#[test]
fn the_report_of_twins_is_the_same_twice_and_refuses_void_intervals() {
    let report = twins(20, |index| index != 3);
    assert!(files(&report) == files(&report));
    for broken in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
        let mut report = report.clone();
        report.twins[5].intervals[1].low = broken;
        assert!(report.files().unwrap_err().to_string().contains("damping of twin 5"));
    }
}

#[test]
#[ignore = "only renders target/tmp/study to look at"]
fn render_the_samples() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("study");
    std::fs::create_dir_all(&folder).unwrap();
    for (name, figure) in figures(&[]) {
        std::fs::write(folder.join(format!("{name}.png")), figure.to_png().unwrap()).unwrap();
        std::fs::write(folder.join(format!("{name}.svg")), figure.to_svg().unwrap()).unwrap();
    }
    for (path, bytes) in files(&twins(80, |index| index % 10 != 3)) {
        let path = folder.join("twins").join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
}
