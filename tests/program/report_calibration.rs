//! The page of a calibration: complete, self-contained, escaped, the same bytes twice, honest about what it shows.

use std::{collections::BTreeMap, f64::consts::TAU, path::PathBuf};

use granchain::{
    calibration::outcome::{
        CalibrationOutcome, FidelityOutcome, FitOutcome, FittedFeature, FittedParameter, InputDigest, MaskedStretch,
        OutcomeFeature, OutcomeLobe,
    },
    feature::{Measurand, Window},
    report::{
        calibration::{
            BenchReport, BenchRow, CalibrationReport, DensityMap, DrawnSupport, LawReport, RecordReport, RunPoint,
            Verdict,
        },
        page::ReportError,
    },
    response::EnergyBalance,
    signal::Series,
};

const F0: f64 = 73e3;

fn burst(step: f64, value: impl Fn(f64) -> f64) -> Series {
    Series::new(-50e-6, step, (0..(800e-6 / step) as usize).map(|i| value(i as f64 * step - 50e-6)).collect())
}

fn ring_up(t: f64) -> f64 {
    if t < 0.0 {
        0.0
    } else {
        (1.0 - (-t / 100e-6).exp()) * if t > 548e-6 { (-(t - 548e-6) / 100e-6).exp() } else { 1.0 }
    }
}

/// Impulses every third period over a 73 kHz oscillation, as in the laboratory's traces.
fn velocity(phase: f64, gain: f64) -> Series {
    burst(0.2e-6, |t| {
        let wave = |ratio: f64, a: f64, shift: f64| a * (TAU * F0 * ratio * t + shift + phase).sin();
        gain * ring_up(t)
            * (wave(1.0, 0.13, 0.0)
                + wave(1.0 / 3.0, 0.07, 0.4)
                + wave(2.0 / 3.0, 0.05, 1.1)
                + wave(2.0, 0.02, 0.3)
                + wave(5.0 / 3.0, 0.012, 0.9))
    })
}

/// What is drawn of a law.
fn drawn() -> LawReport {
    let scatter = |i: u64, k: u64| ((i * k) % 601) as f64 / 601.0;
    let runs: Vec<RunPoint> = (0..600_u64)
        .map(|i| {
            let pull = if i < 160 { 1.0 } else { 0.12 };
            let alpha = 0.5 * (pull * 1.4 * (scatter(i, 233) - 0.55)).exp();
            let damping = 0.3 * (pull * 2.2 * (scatter(i, 377) - 0.5)).exp();
            let (a, d) = ((alpha / 0.5_f64).ln(), (damping / 0.3_f64).ln());
            let misfit = 0.7 + 40.0 * (a + 0.2 * d).powi(2) + 1.5 * d * d + 0.3 * scatter(i, 89);
            RunPoint { parameters: vec![alpha, damping], misfit: (i != 77).then_some(misfit) }
        })
        .collect();
    let grid = |centre: f64, half: f64| {
        (0..48).map(|i| centre * (half * (f64::from(i) / 23.5 - 1.0)).exp()).collect::<Vec<f64>>()
    };
    let (x, y) = (grid(0.503, 0.08), grid(0.304, 0.35));
    let density = y
        .iter()
        .flat_map(|d| {
            x.iter().map(move |a| {
                let (a, d) = ((a / 0.503_f64).ln() / 0.02, (d / 0.304_f64).ln() / 0.08);
                (-0.5 * (a * a + d * d + 0.9 * a * d)).exp()
            })
        })
        .collect();
    LawReport {
        parameters: vec!["alpha".into(), "damping".into()],
        map: Some(DensityMap { x, y, density, accepted_level: 0.1 }),
        runs,
        ..LawReport::default()
    }
}

fn law(kind: &str, verdict: Verdict) -> FitOutcome {
    let quoted = verdict == Verdict::WithinScatter;
    let parameter = |value: f64, low: f64, high: f64, unit: &str, bounds| FittedParameter {
        value,
        low: quoted.then_some(low),
        high: quoted.then_some(high),
        median: value,
        unit: unit.into(),
        at_bound: false,
        unidentified: false,
        bounds,
    };
    let parameters = BTreeMap::from([
        ("alpha".to_owned(), parameter(0.5032, 0.4881, 0.5192, "1", [0.2, 2.0])),
        ("damping".to_owned(), parameter(0.3041, 0.2702, 0.3410, "N s/m", [0.02, 3.0])),
    ]);
    let compared = |deviation, widened: Option<f64>| FittedFeature {
        measured: Some(0.289),
        deviation: Some(deviation),
        expected: Some(0.291),
        scatter: Some(0.02),
        widened,
        model_error: None,
        unit: "m/s".into(),
    };
    let extent = BTreeMap::from([("alpha".to_owned(), [0.4881, 0.5192]), ("damping".to_owned(), [0.2702, 0.3410])]);
    FitOutcome {
        damping_kind: kind.into(),
        verdict,
        p_value: if quoted { 0.62 } else { 0.002 },
        fitted_features: BTreeMap::from([
            ("positive_peak".to_owned(), compared(0.4, None)),
            ("band_1/3".to_owned(), compared(if quoted { -1.2 } else { 5.3 }, (!quoted).then_some(2.4))),
        ]),
        waveform: None,
        misfit: 0.83,
        fidelities: vec![FidelityOutcome {
            model: "chain".into(),
            runs: 600,
            failed_runs: 1,
            verdict: Some(verdict),
            parameters: parameters.clone(),
            features: BTreeMap::new(),
        }],
        parameters,
        correlation: -0.41,
        lobes: vec![OutcomeLobe { mass: 0.9, extent }],
        log_evidence: -12.3,
        evaluations: 600,
        failed_runs: 1,
        failures: BTreeMap::from([("step size fell below 1e-15 s at 3.1e-4 s".to_owned(), 1)]),
        ..FitOutcome::default()
    }
}

fn feature(unit: &str, measured: f64) -> OutcomeFeature {
    OutcomeFeature {
        measured: Some(measured),
        simulated: Some(1.03 * measured),
        scatter: Some(0.05 * measured.abs()),
        sensitivity: Some(0.01 * measured),
        unit: unit.into(),
    }
}

fn report() -> CalibrationReport {
    let laws = vec![
        law("linear", Verdict::WithinScatter),
        FitOutcome { log_evidence: -31.0, misfit: 1.9, ..law("kuwabara-kono", Verdict::OutsideScatter) },
    ];
    let features = [
        ("positive_peak", feature("m/s", 0.289)),
        ("negative_peak", feature("m/s", -0.247)),
        ("line_1/3", feature("m/s", 0.0701)),
        ("ratio_1/3", feature("1", 0.538)),
    ];
    let file = "measurements/annulus-73khz/vib.csv";
    let outcome = CalibrationOutcome {
        program: "granchain 0.1.0".into(),
        scene: "annulus".into(),
        overrides: vec![],
        model: "chain".into(),
        quantity: Measurand::Velocity,
        best: FitOutcome { features: features.map(|(name, it)| (name.to_owned(), it)).into(), ..laws[0].clone() },
        seed: 1,
        inputs: BTreeMap::from([(
            "measured".to_owned(),
            InputDigest { path: file.into(), sha256: "ab".repeat(32), ..InputDigest::default() },
        )]),
        statements: vec![
            "α and damping remain correlated (−0.41): a second record at another drive level would tell them apart."
                .into(),
        ],
        laws,
        preferred_law: Some("linear".into()),
        preferred_mount: None,
        widened: None,
        excluded: BTreeMap::new(),
        diagnosis: vec![],
        masked: vec![MaskedStretch {
            file: file.into(),
            from_s: Some(120e-6),
            to_s: Some(122e-6),
            samples: 9,
            reason: "drop-out".into(),
        }],
        warnings: vec![],
        assumptions: vec![
            "Sampling is even to 1e-6 of the interval; tolerance 1e-3.".into(),
            "Baseline: mean of 250 pre-trigger samples removed.".into(),
        ],
    };
    let record = RecordReport {
        label: String::new(),
        title: file.into(),
        record_label: "reconstruction".into(),
        record_notes: vec!["The record is a reconstruction from printed values, not a measurement: peaks, drive frequency and the presence of lines are printed, everything else is invented (PROVENANCE.md).".into()],
        drive: burst(0.2e-6, |t| 1e-6 * ring_up(t) * (TAU * F0 * t).sin()),
        drive_origin: "measurements/annulus-73khz/horn_tip.csv".into(),
        recorded: velocity(0.0, 1.0),
        simulated: Some(velocity(0.12, 0.97)),
        residual: (0..100).map(|i| (100e-6 + 1e-6 * f64::from(i), 2e-3, 3e-3)).collect(),
        alignment: "onset at 9.8 µs in both".into(),
        masked: vec![(120e-6, 122e-6)],
        observed: Default::default(),
        instrument: vec!["The record is the mean of 16 shots.".into()],
        window: Some(Window::new(100e-6, 540e-6)),
        compared: vec!["positive_peak".into(), "band_1/3".into()],
    };
    CalibrationReport {
        outcome,
        scene: "annulus".into(),
        scene_description: "six chrome-steel beads of 1 mm between a piston and a resin annulus".into(),
        drive_frequency: F0,
        bench: BenchReport {
            rows: vec![BenchRow {
                part: "beads".into(), value: "6 of radius 500 µm".into(), origin: "default".into()
            }],
            radii: vec![0.5e-3; 6],
            support: DrawnSupport::Ring { ring_radius: 0.55e-3, section_radius: 0.25e-3 },
            texts: vec![("plan plan.toml".into(), "scene = \"annulus\" # <mine>".into())],
        },
        records: vec![record],
        laws: vec![drawn(), drawn()],
        energy: Some(EnergyBalance {
            initial_j: 0.0,
            piston_work_j: 4.31e-7,
            kinetic_j: 1.2e-9,
            stored_j: 3e-10,
            disc_j: None,
            channels: None,
            water_j: None,
            dissipated_j: 4.2946e-7,
            residual_j: 4e-14,
            largest_j: 2.2e-7,
        }),
        settings: vec![("runs".into(), "600".into())],
        command_line: "calibrate --measured measurements/annulus-73khz/vib.csv".into(),
    }
}

fn files(report: &CalibrationReport) -> BTreeMap<PathBuf, Vec<u8>> {
    report.files().unwrap().into_iter().collect()
}

fn text(files: &BTreeMap<PathBuf, Vec<u8>>, name: &str) -> String {
    String::from_utf8(files[&PathBuf::from(name)].clone()).unwrap()
}

#[test]
fn the_page_needs_nothing_but_itself() {
    let page = text(&files(&report()), "report.html");
    // uPlot names its home in a comment.
    let outside =
        page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "").replace("/*! https://github.com/leeoniya/uPlot", "");
    let anchors = outside.matches("href=\"#s").count();
    for forbidden in [
        "http:",
        "https:",
        "<link",
        "<img",
        "<iframe",
        "@import",
        "src=",
        "fetch(",
        "XMLHttpRequest",
        "import(",
        "WebSocket",
    ] {
        assert!(!outside.contains(forbidden), "{forbidden}");
    }
    assert_eq!(outside.matches("href=").count(), anchors, "only within the page");
    assert_eq!(outside.matches("url(").count(), outside.matches("url(data:").count());
    assert!(page.len() < 2_000_000, "{} bytes", page.len());
}

#[test]
fn the_page_says_everything_a_reader_asks_for_in_his_order() {
    let page = text(&files(&report()), "report.html");
    let order = [
        "within scatter",
        "not a measurement",
        "the whole record",
        "What decided",
        "prefers linear",
        "What the data cannot separate",
        "Drive</h2>",
        "Velocity of the last bead",
        "Spectra",
        "Features",
        "Search",
        "Energy",
        "Assumed on reading",
        "Provenance",
        &"ab".repeat(32),
        "calibrate --measured",
    ];
    let mut rest = page.as_str();
    for wanted in order {
        let place = rest.find(wanted).unwrap_or_else(|| panic!("`{wanted}` missing or out of order"));
        rest = &rest[place..];
    }
    assert!(page.contains("α = 0.503 (0.488 to 0.519) and c = 0.304 N·s/m (0.270 to 0.341)"));
}

#[test]
fn a_reconstruction_is_never_called_recorded_or_measured() {
    let page = text(&files(&report()), "report.html");
    let without_disclaimer = page.replace("not a measurement", "").replace("measurements/", "");
    for word in ["recorded", "measured", "measurement"] {
        let hits: Vec<_> = without_disclaimer
            .match_indices(word)
            .map(|(at, _)| &without_disclaimer[at.saturating_sub(30)..at + 30])
            .filter(|around| !around.contains("--measured"))
            .collect();
        assert!(hits.is_empty(), "{hits:?}");
    }
}

#[test]
fn no_interval_is_quoted_outside_scatter() {
    let mut report = report();
    report.outcome.laws = vec![law("linear", Verdict::OutsideScatter)];
    report.laws.truncate(1);
    let files = files(&report);
    let page = text(&files, "report.html");
    assert!(page.contains("does not explain") && page.contains("No interval is quoted"));
    assert!(!page.contains("0.488 to 0.519"));
}

#[test]
fn the_same_report_gives_the_same_bytes_and_survives_its_own_json() {
    let once = files(&report());
    assert!(once == files(&report()));
    let again: CalibrationReport = serde_json::from_slice(&once[&PathBuf::from("report.json")]).unwrap();
    assert_eq!(again, report());
    assert!(files(&again) == once);
}

#[test]
fn what_was_typed_by_others_cannot_become_markup() {
    let mut report = report();
    let nasty = "<script>alert(1)</script>\"'&|`*_\n# x";
    let feature = report.outcome.best.features.get_mut("line_1/3").unwrap();
    let (law, record) = (&mut report.outcome.laws[0], &mut report.records[0]);
    law.failures = BTreeMap::from([(nasty.to_owned(), 1)]);
    for field in [
        &mut record.title,
        &mut record.record_label,
        &mut record.drive_origin,
        &mut record.alignment,
        &mut record.record_notes[0],
        &mut report.scene,
        &mut report.scene_description,
        &mut report.command_line,
        &mut report.outcome.model,
        &mut law.damping_kind,
        &mut report.outcome.inputs.get_mut("measured").unwrap().path,
        &mut report.outcome.statements[0],
        &mut feature.unit,
    ] {
        *field = nasty.into();
    }
    let files = files(&report);
    let page = text(&files, "report.html");
    assert!(!page.contains("<script>alert") && page.contains("\\u003cscript>alert"));
    // The page's own scripts and their data: tables, curves, uPlot, explore.
    assert_eq!(page.matches("<script").count(), 4);
    assert_eq!(page.matches("</script>").count(), 4);
    let markdown = text(&files, "report.md");
    assert!(!markdown.split("```").step_by(2).any(|part| part.replace("\\<", "").contains("<script")));
    for (path, bytes) in files.iter().filter(|(path, _)| path.extension().is_some_and(|e| e == "svg")) {
        roxmltree::Document::parse(std::str::from_utf8(bytes).unwrap())
            .unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    }
    // A name with a comma, a quote or a line break stays one cell.
    let features = text(&files, "features.csv");
    let mut reader = csv::Reader::from_reader(features.as_bytes());
    assert!(reader.records().any(|row| row.unwrap().get(1) == Some(nasty)));
}

#[test]
fn a_number_that_is_not_finite_is_refused_by_name() {
    let mut bad = report();
    bad.outcome.best.features.get_mut("line_1/3").unwrap().scatter = Some(f64::NAN);
    assert!(matches!(bad.files(), Err(ReportError::NotFinite { field, .. }) if field == "feature line_1/3"));
    let mut bad = report();
    bad.records[0].recorded.values[17] = f64::INFINITY;
    assert!(matches!(bad.files(), Err(ReportError::NotFinite { field, .. }) if field == "recorded sample 17"));
    let mut bad = report();
    bad.laws.clear();
    assert!(matches!(bad.files(), Err(ReportError::Missing { field: "laws" })));
}

#[test]
#[ignore = "only renders target/tmp/calibration to look at"]
fn render_the_sample() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("calibration");
    for (path, bytes) in files(&report()) {
        let path = folder.join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
}
