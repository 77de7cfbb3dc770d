//! Figures on request, and regimes over a grid.

use std::{fs, path::Path};

use super::harness::granchain;

fn drawn(file: &Path) -> String {
    let svg = fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    roxmltree::Document::parse(&svg).unwrap();
    assert!(svg.len() < 150_000, "{}: {} bytes", file.display(), svg.len());
    svg
}

#[test]
fn a_replay_draws_what_it_is_asked_for_and_no_more() {
    let place = tempfile::tempdir().unwrap();
    let replay = ["replay", "--scene", "annulus", "--model", "chain", "--out", "out"];
    assert_eq!(granchain(&place, &[&replay[..], &["--figure", "waterfall,phase,spectrogram"]].concat()).0, 0);
    let folder = place.path().join("out");
    assert!(drawn(&folder.join("waterfall.svg")).contains("last 24 periods"));
    assert!(drawn(&folder.join("phase.svg")).contains("once a drive period"));
    let spectrogram = drawn(&folder.join("spectrogram.svg"));
    // The largest level is drawn in the lightest colour of viridis, and the colour bar ends in it.
    assert!(spectrogram.matches("#FDE725").count() >= 2);
    assert_eq!(granchain(&place, &replay).0, 0);
    assert!(["waterfall", "phase", "spectrogram"].iter().all(|name| !folder.join(format!("{name}.svg")).exists()));
    let struck = ["replay", "--scene", "impact", "--figure", "phase", "--out", "hit"];
    let (code, _, error) = granchain(&place, &struck);
    assert!(code == 2 && error.contains("striker"), "{error}");
}

const STEADY: [&str; 10] = [
    "sweep",
    "--scene",
    "rigid",
    "--regime",
    "--set",
    "drive.cycles=160",
    "--set",
    "duration=2.2ms",
    "--set",
    "damping.kind=linear",
];

#[test]
fn a_sweep_names_regimes_and_maps_them_with_the_same_bytes_on_any_number_of_threads() {
    let place = tempfile::tempdir().unwrap();
    let grid = ["--vary", "alpha=0.3:1.5:0.3", "--vary", "damping.coefficient=0.4,0.8,1.1"];
    let folders = ["1", "2"].map(|threads| {
        let (code, text, error) =
            granchain(&place, &[&STEADY[..], &grid, &["--threads", threads, "--out", threads]].concat());
        assert_eq!(code, 0, "{error}");
        assert!(text.contains("Runs by regime: period"), "{text}");
        place.path().join(threads)
    });
    for name in ["sweep.csv", "sweep.json", "regime.svg"] {
        assert_eq!(fs::read(folders[0].join(name)).unwrap(), fs::read(folders[1].join(name)).unwrap(), "{name}");
    }
    let map = drawn(&folders[0].join("regime.svg"));
    let table = fs::read_to_string(folders[0].join("sweep.csv")).unwrap();
    let mut rows = table.lines();
    assert!(rows.next().unwrap().starts_with("alpha,damping.coefficient,status,regime,broadband_share,"));
    assert_eq!(rows.clone().count(), 15);
    assert!(
        rows.clone().all(|row| [",period ", ",quasi-periodic,", ",chaotic,"].iter().any(|regime| row.contains(regime)))
    );
    assert_eq!(map.contains("chaotic"), table.contains("chaotic"));
    // One varied number: a bifurcation diagram.
    let line = ["--drive", "none", "--vary", "alpha=0.3:1.5:0.1", "--set", "damping.coefficient=0.6", "--out", "line"];
    assert_eq!(granchain(&place, &[&STEADY[..], &line].concat()).0, 0);
    assert!(drawn(&place.path().join("line/regime.svg")).contains("once a drive period"));
}

#[test]
fn a_drive_too_short_for_a_regime_is_refused_with_what_would_do() {
    let place = tempfile::tempdir().unwrap();
    let (code, _, error) = granchain(&place, &["sweep", "--scene", "rigid", "--regime", "--vary", "alpha=0.5,1"]);
    assert!(code == 1 && error.contains("160 periods") && error.contains("found 5.0"), "{code}: {error}");
    assert!(error.contains("drive.cycles=160") && error.contains("duration=2.19"), "{error}");
}
