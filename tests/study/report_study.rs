//! Figures and pages of replays and sweeps, from real runs where a run is cheap.

use std::path::PathBuf;

use granchain::{feature::measure, model, report, scene, study::observation};

fn figures(overrides: &[&str]) -> Vec<(&'static str, report::figure::Figure)> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    let scene = scene::load("annulus", &overrides).unwrap();
    let response = model::run(&scene, &mut |_| true).unwrap();
    let features = measure(&response.pole_velocity, &observation::settings(&scene).unwrap()).unwrap();
    report::replay::figures(&response, &response.pole_velocity, &features).unwrap()
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
#[ignore = "only renders target/tmp/study to look at"]
fn render_the_samples() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("study");
    std::fs::create_dir_all(&folder).unwrap();
    for (name, figure) in figures(&[]) {
        std::fs::write(folder.join(format!("{name}.png")), figure.to_png().unwrap()).unwrap();
        std::fs::write(folder.join(format!("{name}.svg")), figure.to_svg().unwrap()).unwrap();
    }
}
