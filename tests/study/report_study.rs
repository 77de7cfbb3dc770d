//! The page of a replay, from a real run.

use granchain::{feature::measure, model, report::replay::ReplayReport, scene, study::observation};

#[test]
fn a_replay_shows_piston_pole_beads_contacts_and_spectrum() {
    let scene = scene::load("annulus", &["duration=300us".into()]).unwrap();
    let response = model::run(&scene, &mut |_| true).unwrap();
    let features = measure(&response.pole_velocity, &observation::settings(&scene).unwrap()).unwrap();
    let report = ReplayReport {
        scene: ("annulus", ""),
        facts: Vec::new(),
        bead_diameter: 2.0 * scene.chain.beads[0].radius,
        has_support: true,
        response: &response,
        seen: &response.pole_velocity,
        features: Some(&features),
        drive_frequency: scene.drive.frequency,
        others: Vec::new(),
        ensemble: None,
        assumptions: Vec::new(),
    };
    let files = report.files().unwrap();
    for name in ["response.svg", "chain.svg", "spectrum.svg"] {
        let (_, svg) = files.iter().find(|(path, _)| path.ends_with(name)).unwrap_or_else(|| panic!("{name}"));
        let svg = std::str::from_utf8(svg).unwrap();
        roxmltree::Document::parse(svg).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(svg.len() < 200_000, "{name}: {} bytes", svg.len());
    }
}
