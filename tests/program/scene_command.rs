//! `granchain scene …` as a person runs it.

use crate::harness::granchain;

#[test]
fn list_names_every_built_in_scene() {
    let folder = tempfile::tempdir().unwrap();
    let (code, out, err) = granchain(folder.path(), &["scene", "list"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let names: Vec<_> = out.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(names, ["rigid", "annulus", "chain", "water", "impact"]);
    assert!(out.lines().all(|line| line.contains("steel beads")), "{out}");
}

#[test]
fn show_prints_every_key_with_value_unit_and_meaning() {
    let folder = tempfile::tempdir().unwrap();
    let (code, out, _) = granchain(folder.path(), &["scene", "show", "annulus", "--set", "chain.radius=0.495mm"]);
    assert_eq!(code, 0);
    let row = |key: &str| out.lines().find(|line| line.starts_with(key)).unwrap_or_else(|| panic!("{key}: {out}"));
    let words = |key: &str| row(key).split("  ").map(str::trim).filter(|word| !word.is_empty()).collect::<Vec<_>>();
    assert_eq!(words("chain.radius"), ["chain.radius", "495 µm", "m", "radius of a bead"]);
    assert_eq!(words("damping.coefficient")[..3], ["damping.coefficient", "0.3 N·s/m", "N·s/m"]);
    // As JSON the values are SI.
    let (_, out, _) = granchain(folder.path(), &["scene", "show", "annulus", "--json"]);
    let rows: Vec<serde_json::Value> = serde_json::from_str(&out).unwrap();
    let radius = rows.iter().find(|row| row["key"] == "chain.radius").unwrap();
    assert_eq!((radius["value"].as_f64(), radius["unit"].as_str()), (Some(0.5e-3), Some("m")));
}

/// What `scene keys` says is taken where a key is not given is what `scene show` finds where it is not.
#[test]
fn keys_says_of_each_key_what_is_taken_where_it_is_not_given() {
    let folder = tempfile::tempdir().unwrap();
    let (_, out, _) = granchain(folder.path(), &["scene", "keys", "--json"]);
    let keys: Vec<serde_json::Value> = serde_json::from_str(&out).unwrap();
    let lean = "duration = 1e-4\n[chain]\nbeads = 6\nradius = 5e-4\nmaterial = \"chrome-steel\"\n[damping]\nkind = \"linear\"\n\
                [drive]\nkind = \"sine\"\namplitude = 1e-6\nfrequency = 73e3\ncycles = 5\n[support]\nkind = ";
    let mut compared = 0;
    for support in ["annulus", "disc"] {
        let scene = format!("{lean}\"{support}\"\n[model]\nkind = \"reduced\"\n");
        std::fs::write(folder.path().join("lean.toml"), scene).unwrap();
        let (_, out, err) = granchain(folder.path(), &["scene", "show", "lean.toml", "--json"]);
        let rows: Vec<serde_json::Value> = serde_json::from_str(&out).unwrap_or_else(|_| panic!("{err}"));
        for row in &rows {
            let key = keys.iter().find(|key| key["key"] == row["key"]);
            let Some(default) = key.and_then(|key| key["default"].as_str()) else { continue };
            let plain = default.split_whitespace().next().is_some_and(|word| word.parse::<f64>().is_ok());
            if plain && !default.contains([',', ';']) && !default.contains(" of ") {
                assert_eq!(row["text"], default, "{}", row["key"]);
                compared += 1;
            }
        }
    }
    assert!(compared > 12, "only {compared} defaults were compared");
}

#[test]
fn show_as_toml_is_a_scene_file_of_the_same_scene() {
    let folder = tempfile::tempdir().unwrap();
    let (_, first, _) = granchain(folder.path(), &["scene", "show", "annulus", "--toml", "--set", "alpha=0.7"]);
    std::fs::write(folder.path().join("own.toml"), &first).unwrap();
    let (code, second, _) = granchain(folder.path(), &["scene", "show", "own.toml", "--toml"]);
    assert_eq!((code, second), (0, first));
}

#[test]
fn check_prints_what_follows_from_a_scene_and_notes_what_was_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let (code, out, err) =
        granchain(folder.path(), &["scene", "check", "annulus", "--set", "damping.kind=kuwabara-kono"]);
    assert_eq!(code, 0);
    assert!(out.contains("mass of a bead                  4.10135 mg"), "{out}");
    assert!(out.contains("Hertz stiffness, beads 1 and 2  2.32827e9 N·m^(-3/2)"), "{out}");
    assert!(out.contains("Kuwabara–Kono dampers          γ = 3660 N·s·m^(-3/2)"), "{out}");
    assert!(err.starts_with("note: `damping.coefficient` is not given"), "{err}");
    let (_, _, err) =
        granchain(folder.path(), &["scene", "check", "annulus", "--set", "damping.kind=kuwabara-kono", "--quiet"]);
    assert_eq!(err, "");
}

#[test]
fn check_of_a_broken_scene_ends_with_1_and_the_place_of_the_fault() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("own.toml"), "extends = \"annulus\"\n[chain]\nradius = \"-0.5 mm\"\n").unwrap();
    let (code, out, err) = granchain(folder.path(), &["scene", "check", "own.toml"]);
    assert_eq!((code, out.as_str()), (1, ""));
    assert_eq!(err, "error: own.toml:3:10: `chain.radius`: expected a positive, finite value, found -0.5 mm\n");
    std::fs::write(
        folder.path().join("own.toml"),
        "extends = \"annulus\"\ndrive.kind = \"record\"\ndrive.file = \"x.csv\"",
    )
    .unwrap();
    let (code, out, err) = granchain(folder.path(), &["scene", "check", "own.toml"]);
    assert_eq!(code, 1);
    assert!(out.contains("left out: margins: the drive record is not found"), "{out}");
    assert_eq!(err, "error: `drive.file`: there is no file x.csv; the path is relative to the scene file's folder\n");
}

#[test]
fn init_writes_a_commented_scene_that_checks_and_never_replaces_a_file() {
    let folder = tempfile::tempdir().unwrap();
    for (file, from) in [("a.toml", "annulus"), ("b.toml", "rigid"), ("c.toml", "chain"), ("w.toml", "water")] {
        let (code, _, err) = granchain(folder.path(), &["scene", "init", file, "--from", from]);
        assert_eq!((code, err.as_str()), (0, ""));
        let (code, out, _) = granchain(folder.path(), &["scene", "check", file]);
        assert_eq!(code, 0);
        assert!(out.starts_with(&format!("{file}: scene `{}` is valid", &file[..1])), "{out}");
    }
    let before = std::fs::read_to_string(folder.path().join("a.toml")).unwrap();
    assert!(before.contains("# Reading: "));
    let (code, _, err) = granchain(folder.path(), &["scene", "init", "a.toml", "--from", "rigid"]);
    assert_eq!((code, err.as_str()), (1, "error: a.toml: the file exists; name another, or delete it first\n"));
    assert_eq!(std::fs::read_to_string(folder.path().join("a.toml")).unwrap(), before);
    let (code, _, err) = granchain(folder.path(), &["scene", "init", "d.toml", "--from", "wader"]);
    assert_eq!(code, 1);
    assert!(err.contains("did you mean `water`?"), "{err}");
    assert!(!folder.path().join("d.toml").exists());
}

#[test]
fn every_bench_that_init_writes_checks_and_runs_on_its_default_model() {
    let folder = tempfile::tempdir().unwrap();
    for (bench, model) in
        [("wall", "reduced"), ("ring", "reduced"), ("spring", "reduced"), ("disc", "chain"), ("free", "reduced")]
    {
        let file = format!("{bench}.toml");
        let (code, _, err) = granchain(folder.path(), &["scene", "init", &file, "--bench", bench]);
        assert_eq!((code, err.as_str()), (0, ""));
        let (code, out, err) = granchain(folder.path(), &["scene", "check", &file]);
        assert_eq!(code, 0, "{bench}: {err}");
        assert!(out.starts_with(&format!("{file}: scene `{bench}` is valid")), "{out}");
        let set = ["--set", "duration=20 us", "--cache", "none", "--json"];
        let (code, out, err) = granchain(folder.path(), &[&["replay", "--scene", &file][..], &set].concat());
        assert_eq!(code, 0, "{bench}: {err}");
        let summary: serde_json::Value = serde_json::from_str(&out).unwrap();
        assert_eq!(summary["settings"]["model"], model, "{bench}");
        let (_, out, _) = granchain(folder.path(), &["scene", "show", &file, "--json"]);
        let rows: Vec<serde_json::Value> = serde_json::from_str(&out).unwrap();
        let kind = rows.iter().find(|row| row["key"] == "support.kind").unwrap();
        let word = match bench {
            "wall" => "rigid",
            "ring" => "annulus",
            same => same,
        };
        assert_eq!(kind["value"], word);
    }
    let both = ["scene", "init", "x.toml", "--bench", "ring", "--from", "rigid"];
    assert_eq!(granchain(folder.path(), &both).0, 2);
}

#[test]
fn a_ring_of_ones_own_is_checked_with_its_geometry_and_without_the_papers_peaks() {
    let folder = tempfile::tempdir().unwrap();
    let own =
        ["--set", "support.ring_radius=0.7mm", "--set", "support.section_radius=0.3mm", "--set", "chain.radius=0.6mm"];
    let (code, out, err) = granchain(folder.path(), &[&["scene", "check", "annulus"][..], &own].concat());
    assert_eq!((code, err.as_str()), (0, ""));
    // sin φ = 0.7/0.9.
    assert!(out.contains("contact normal from the axis    51.06°"), "{out}");
    assert!(out.contains("support.ring_radius = 0.7 mm, support.section_radius = 0.3 mm"), "{out}");
    let run = |more: &[&str]| {
        let replay = ["replay", "--scene", "annulus", "--model", "chain", "--set", "duration=20us", "--cache", "."];
        let (code, out, err) = granchain(folder.path(), &[&replay[..], more].concat());
        assert_eq!(code, 0, "{err}");
        out
    };
    let out = run(&own);
    assert!(out.contains("annulus within"), "{out}");
    let kept = std::fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap());
    assert_eq!(kept.filter(|name| name.starts_with("contact-laws-")).count(), 1);
}

#[test]
fn a_scene_that_a_record_drives_needs_no_frequency_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let mut record = "time_s,displacement_m\n".to_owned();
    for sample in 0..2000 {
        // 40 cycles of 80 kHz after 50 µs of rest.
        let time = 2.5e-7 * f64::from(sample);
        let phase = std::f64::consts::TAU * 80e3 * (time - 50e-6);
        let moved = if (0.0..40.0 * std::f64::consts::TAU).contains(&phase) { 1e-6 * phase.sin() } else { 0.0 };
        record += &format!("{time:.9e},{moved:.9e}\n");
    }
    std::fs::write(folder.path().join("horn.csv"), record).unwrap();
    let bench = "[chain]\nbeads = 2\nradius = \"0.5 mm\"\nmaterial = \"chrome-steel\"\n[support]\nkind = \"rigid\"\n\
                 [damping]\nkind = \"none\"\n[drive]\nkind = \"record\"\nfile = \"horn.csv\"\n";
    std::fs::write(folder.path().join("own.toml"), format!("duration = \"300 us\"\n{bench}")).unwrap();
    let (code, _, err) = granchain(folder.path(), &["scene", "check", "own.toml"]);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("`drive.frequency` is not given"), "{err}");
    let replay = ["replay", "--scene", "own.toml", "--model", "chain", "--json"];
    let (code, out, err) = granchain(folder.path(), &replay);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("`drive.frequency` is not given; taken as that of"), "{err}");
    let summary: serde_json::Value = serde_json::from_str(&out).unwrap();
    let frequency = summary["settings"]["drive_frequency_hz"].as_f64().unwrap_or_else(|| panic!("{summary:.2000}"));
    assert!((frequency / 80e3 - 1.0).abs() < 5e-3, "{frequency}");
    // A formula requires it.
    let formula = format!("duration = \"300 us\"\n{}", bench.replace("record", "sine"));
    std::fs::write(
        folder.path().join("sine.toml"),
        formula.replace("file = \"horn.csv\"\n", "cycles = 3\namplitude = 1e-6\n"),
    )
    .unwrap();
    let (code, _, err) = granchain(folder.path(), &["scene", "check", "sine.toml"]);
    assert_eq!(code, 1);
    assert!(err.contains("`drive.frequency` is missing"), "{err}");
}

#[test]
fn explain_lists_every_effect_at_once_and_measures_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let (code, out, err) = granchain(folder.path(), &["scene", "explain", "annulus"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(out.contains("on   linear dampers") && out.contains("c = 0.3"), "{out}");
    assert!(out.contains("off  absorption in the water") && out.contains("off  fields"), "{out}");
    let (code, _, err) = granchain(folder.path(), &["scene", "explain", "annulus", "--out", "page"]);
    assert!(code == 2 && err.contains("--measure"), "{code} {err}");

    let arguments = ["scene", "explain", "rigid", "--set", "duration=30us", "--set", "model.kind=chain"];
    let measured = [&arguments[..], &["--accuracy", "1%", "--out", "page"]].concat();
    let (code, out, err) = granchain(folder.path(), &measured);
    assert_eq!(code, 0, "{err}");
    let page = folder.path().join("page");
    for file in ["report.html", "report.md", "effects.json", "timing.json"] {
        assert!(page.join(file).is_file(), "{file}");
    }
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(page.join("effects.json")).unwrap()).unwrap();
    assert!(
        json["rows"][0]["name"] == "the scene as it is"
            && json["simulated"].as_str().unwrap().contains("Hertz contacts")
    );
    assert!(out.contains("no effect of this scene costs time"), "{out}");
}

/// The row of a margin, of `scene check --json`.
fn margin(folder: &std::path::Path, arguments: &[&str], name: &str) -> Option<serde_json::Value> {
    let (code, out, err) =
        granchain(folder, &[&["scene", "check"], arguments, &["--cache", "none", "--json"]].concat());
    assert_eq!(code, 0, "{err}");
    let page: serde_json::Value = serde_json::from_str(&out).unwrap();
    let rows = page["margins"]["rows"].as_array().unwrap();
    rows.iter().find(|row| row["name"].as_str().is_some_and(|found| found.starts_with(name))).cloned()
}

#[test]
fn a_step_fifty_times_as_long_is_too_large_in_every_margin_that_it_has() {
    let folder = tempfile::tempdir().unwrap();
    // At 73 kHz so long a step is refused.
    let sets =
        ["drive.frequency=1 kHz", "drive.cycles=2", "duration=400 us", "model.step=2.5 us", "output_step=2.5 us"];
    let long: Vec<&str> = std::iter::once("rigid").chain(sets.iter().flat_map(|set| ["--set", set])).collect();
    for name in ["step over the shortest contact", "step, and the longest"] {
        let word = |arguments: &[&str]| margin(folder.path(), arguments, name).unwrap()["word"].clone();
        assert_eq!(word(&long), "too-large", "{name}");
        assert_ne!(word(&["rigid"]), "too-large", "{name}");
    }
    let strong = ["annulus", "--set", "damping.kind=kuwabara-kono", "--set", "damping.coefficient=3.66e6"];
    let strong = [&strong[..], &["--set", "model.kind=fea"]].concat();
    for (scene, word) in [(&strong[..], "too-large"), (&["annulus", "--set", "model.kind=fea"], "good")] {
        assert_eq!(margin(folder.path(), scene, "dashpot").unwrap()["word"], word);
    }
    let (_, out, _) = granchain(folder.path(), &[&["scene", "check"][..], &long, &["--cache", "none"]].concat());
    let row =
        out.lines().find(|line| line.contains("step over the shortest contact")).unwrap_or_else(|| panic!("{out}"));
    assert!(row.contains("too large"), "{row}");
}

#[test]
fn the_energy_of_a_scene_s_margins_is_that_of_its_replay() {
    let folder = tempfile::tempdir().unwrap();
    for model in ["model.kind=chain", "model.kind=reduced"] {
        let scene = ["annulus", "--set", model, "--set", "duration=200 us", "--set", "model.mesh_density=8"];
        let scene = if model.ends_with("chain") { &scene[..5] } else { &scene[..] };
        for (name, dampers) in
            [("energy unaccounted for", &[][..]), ("the same without", &["--set", "damping.kind=none"])]
        {
            let row = margin(folder.path(), scene, name).unwrap();
            let replay = [&["replay", "--scene"], scene, dampers, &["--cache", "none", "--json"]].concat();
            let (code, out, err) = granchain(folder.path(), &replay);
            assert_eq!(code, 0, "{err}");
            let energy = serde_json::from_str::<serde_json::Value>(&out).unwrap()["energy"].clone();
            let share = energy["residual_j"].as_f64().unwrap().abs() / energy["largest_j"].as_f64().unwrap();
            let found = row["value"].as_f64().unwrap();
            assert!(share > 0.0 && (found / share - 1.0).abs() < 1e-9, "{model}, {name}: {found:e} {share:e}");
            assert_eq!(row["note"], "whole scene, 200 us");
        }
    }
}

#[test]
fn margins_are_of_what_a_scene_has() {
    let folder = tempfile::tempdir().unwrap();
    let chain = ["chain"];
    assert!(margin(folder.path(), &chain, "step").is_none());
    assert_eq!(margin(folder.path(), &chain, "tolerance").unwrap()["value"], 1e-10);
    assert!(margin(folder.path(), &chain, "the same without dampers").is_none());
    let (_, out, _) = granchain(folder.path(), &["scene", "check", "rigid", "--set", "model.kind=fea"]);
    assert!(out.contains("step over the shortest contact") && out.contains("`granchain accuracy --fea`"), "{out}");
}
