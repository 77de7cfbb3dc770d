//! Scene files, built-in scenes and overrides: what they become and how they are refused.

use std::path::{Path, PathBuf};

use granchain::{
    scene::{
        self, BUILT_IN, Bead, Damping, DampingKind, DampingPlacement, DampingTerm, Drive, DriveKind, FlatContact,
        Material, Scene, SceneError, Support, load, load_text, load_with_notes,
    },
    signal::Series,
};

fn overridden(scene: &str, overrides: &[&str]) -> Result<Scene, SceneError> {
    load(scene, &overrides.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>())
}

/// The message that refuses these overrides of the scene `rigid`.
fn refusal(overrides: &[&str]) -> String {
    overridden("rigid", overrides).unwrap_err().to_string()
}

/// The message that refuses this text as the file `bench/own.toml`.
fn file_refusal(text: &str) -> String {
    load_text(text, Path::new("bench/own.toml"), &[]).unwrap_err().to_string()
}

fn file(text: &str) -> Scene {
    load_text(text, Path::new("bench/own.toml"), &[]).unwrap_or_else(|error| panic!("{error}")).scene
}

#[test]
fn rigid_is_the_validation_case_of_the_paper() {
    let scene = overridden("rigid", &[]).unwrap();
    assert_eq!(scene.chain.beads.len(), 6);
    // numerics: exact mass of the bead.
    assert!((scene.chain.beads[5].mass() / 4.101349209e-6 - 1.0).abs() < 1e-9);
    assert_eq!(scene.chain.gaps, [0.0; 7]);
    assert_eq!(scene.chain.precompression, 0.0);
    assert_eq!(scene.drive, Drive { kind: DriveKind::SineCycles { cycles: 5.0 }, amplitude: 1e-6, frequency: 73e3 });
    assert_eq!((scene.amplitude_scale, scene.duration, scene.output_step), (1.0, 120e-6, 1e-7));
    assert_eq!((scene.piston, scene.support), (FlatContact::Rigid, Support::Flat(FlatContact::Rigid)));
    assert_eq!(scene.damping.kind, DampingKind::None);
}

#[test]
fn annulus_is_the_linear_case_of_the_paper_and_its_other_law_is_two_overrides_away() {
    let scene = overridden("annulus", &[]).unwrap();
    assert_eq!(scene.drive.kind, DriveKind::ToneBurst { cycles: 40.0, ring_up: 1e-4 });
    assert_eq!(scene.support, Support::resin_annulus(1.0));
    assert_eq!((scene.amplitude_scale, scene.duration), (0.5, 700e-6));
    let linear = Damping {
        kind: DampingKind::Linear,
        coefficients: [(DampingTerm::Linear, 0.3)].into(),
        placement: DampingPlacement::All,
        tension: false,
    };
    assert_eq!(scene.damping, linear);
    let other = overridden("annulus", &["damping.kind=kuwabara-kono", "alpha=1.5"]).unwrap();
    let law = Damping {
        kind: DampingKind::KuwabaraKono,
        coefficients: [(DampingTerm::KuwabaraKono, 3660.0)].into(),
        ..linear
    };
    assert_eq!((other.damping, other.amplitude_scale), (law, 1.5));
}

#[test]
fn every_built_in_scene_is_complete_and_says_what_it_is() {
    for built_in in BUILT_IN {
        let loaded = load_with_notes(built_in.name, &[]).unwrap();
        assert_eq!(loaded.scene.name, built_in.name);
        assert!(!loaded.scene.description.is_empty());
        assert!(loaded.notes.is_empty(), "{:?}", loaded.notes);
    }
}

#[test]
fn damping_coefficients_follow_the_law_and_the_choice_is_said() {
    let loaded = load_with_notes("annulus", &["damping.kind=kuwabara-kono".into()]).unwrap();
    assert_eq!(
        loaded.notes,
        [
            "`damping.coefficient` is not given for `damping.kind = \"kuwabara-kono\"`; taken as the paper's 3660 N·s·m^(-3/2)"
        ]
    );
    // In whatever order they are given.
    let given = ["damping.coefficient=3000 N s/m^1.5".into(), "damping.kind=kuwabara-kono".into()];
    let loaded = load_with_notes("annulus", &given).unwrap();
    assert_eq!((loaded.scene.damping.coefficients[DampingTerm::KuwabaraKono], loaded.notes.len()), (3000.0, 0));
    let both = overridden(
        "annulus",
        &[
            "damping.kind=linear+kuwabara-kono",
            "damping.linear_coefficient=0.1",
            "damping.kuwabara_kono_coefficient=2e3",
        ],
    )
    .unwrap();
    assert_eq!(
        (both.damping.coefficients[DampingTerm::Linear], both.damping.coefficients[DampingTerm::KuwabaraKono]),
        (0.1, 2000.0)
    );
    // The same law again keeps the scene's own coefficient.
    let again = overridden("annulus", &["damping.kind=linear"]).unwrap();
    assert_eq!(again.damping.coefficients[DampingTerm::Linear], 0.3);
}

#[test]
fn overrides_take_si_numbers_quantities_words_and_lists() {
    let scene = overridden(
        "annulus",
        &[
            "damping.coefficient=0.4",
            "drive.amplitude=0.396um",
            "drive.frequency = 75 kHz",
            "piston.contact=half-space",
            "damping.tension=true",
            "support.kind=spring",
            "support.stiffness=\"0.7 MN/m\"",
            "chain.beads=2",
            "chain.gaps=[1nm, 0, \"2 nm\"]",
            "name=my bench",
        ],
    )
    .unwrap();
    assert_eq!((scene.damping.coefficients[DampingTerm::Linear], scene.damping.tension), (0.4, true));
    assert_eq!((scene.drive.amplitude, scene.drive.frequency), (0.396e-6, 75e3));
    assert_eq!((scene.piston, scene.support), (FlatContact::HalfSpace, Support::Spring { stiffness: 0.7e6 }));
    assert_eq!(scene.chain.gaps, [1e-9, 0.0, 2e-9]);
    assert_eq!(scene.name, "my bench");
    // Of two the later counts.
    assert_eq!(overridden("rigid", &["alpha=2", "alpha=3"]).unwrap().amplitude_scale, 3.0);
    // A table stands for its keys, and one contact may be set alone.
    let gaps = overridden("rigid", &["chain.gaps={all = \"1 nm\", contact7 = 0}"]).unwrap().chain.gaps;
    assert_eq!(gaps, [1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 0.0]);
    assert_eq!(overridden("rigid", &["chain.gaps.contact1=5nm"]).unwrap().chain.gaps[..2], [5e-9, 0.0]);
}

#[test]
fn a_changed_kind_drops_what_only_the_old_kind_used() {
    let scene = overridden("annulus", &["drive.kind=sine", "support.kind=half-space", "damping.kind=none"]).unwrap();
    assert_eq!(scene.drive.kind, DriveKind::SineCycles { cycles: 40.0 });
    assert_eq!(scene.support, Support::Flat(FlatContact::HalfSpace));
}

#[test]
fn a_file_extends_a_built_in_scene_and_may_change_single_beads() {
    let scene = file(
        r#"
        extends = "annulus"
        [chain]
        beads = 3
        gaps = { contact2 = "1 nm" }
        [[chain.override]]
        bead = 2
        radius = "0.51 mm"
        material = "brass"
        [materials.brass]
        youngs_modulus = "100 GPa"
        poissons_ratio = 0.34
        density = 8500
        [materials.chrome-steel]
        youngs_modulus = "200 GPa"
        "#,
    );
    assert_eq!((scene.name.as_str(), scene.description.as_str()), ("own", ""));
    let brass = Material { name: "brass".into(), youngs_modulus: 100e9, poissons_ratio: 0.34, density: 8500.0 };
    assert_eq!(scene.chain.beads[1], Bead::sphere(0.51e-3, brass));
    assert_eq!(scene.chain.beads[2].material, Material { youngs_modulus: 200e9, ..Material::chrome_steel() });
    assert_eq!(scene.chain.gaps, [0.0, 1e-9, 0.0, 0.0]);
    assert_eq!(scene.damping.coefficients[DampingTerm::Linear], 0.3);
}

#[test]
fn a_record_is_named_relative_to_its_scene_file_and_filled_in_by_the_caller() {
    let scene = file("extends = \"annulus\"\ndrive.kind = \"record\"\ndrive.file = \"horn_tip.csv\"");
    assert_eq!(scene.pending_record(), Some(Path::new("bench/horn_tip.csv")));
    assert_eq!(scene.drive.frequency, 73e3);
    let series = Series::new(0.0, 1e-6, vec![0.0; 8]);
    let filled = scene.with_drive_record(series.clone(), 73.1e3, None);
    assert_eq!(filled.pending_record(), None);
    let kind = DriveKind::Record {
        recorded_until: series.end(),
        displacement: series,
        shakes: vec![],
        file: Some(PathBuf::from("bench/horn_tip.csv")),
    };
    assert_eq!(filled.drive, Drive { kind, amplitude: 1.0, frequency: 73.1e3 });
}

#[test]
fn no_model_runs_a_record_that_has_not_been_read() {
    let scene = file("extends = \"annulus\"\ndrive.kind = \"record\"\ndrive.file = \"horn_tip.csv\"");
    assert_eq!(
        granchain::model::run(&scene, &mut |_| true).unwrap_err().to_string(),
        "model `chain`: the drive record bench/horn_tip.csv has not been read; hand it over with `with_drive_record`"
    );
}

#[test]
fn unknown_scenes_are_refused_with_the_nearest_name() {
    assert_eq!(
        overridden("anulus", &[]).unwrap_err().to_string(),
        "`anulus` is neither a built-in scene (rigid, annulus, chain, water, impact) nor a scene file; did you mean `annulus`?"
    );
    assert_eq!(
        file_refusal("extends = \"ridgid\""),
        "bench/own.toml:1:11: `ridgid` is neither a built-in scene (rigid, annulus, chain, water, impact) nor a scene file; \
         did you mean `rigid`?"
    );
    assert_eq!(
        file_refusal("extends = 3"),
        "bench/own.toml:1:11: `extends`: expected the name of a built-in scene, in quotes, found the number 3"
    );
}

#[test]
fn places_count_letters_wherever_they_stand() {
    for before in [0, 100, 255, 256, 257, 1000] {
        let text = format!("description = \"{}\"\n# µ\n\"µµ\".x = 1", "µ".repeat(before));
        assert!(file_refusal(&text).starts_with("bench/own.toml:3:1: unknown key `µµ.x`"), "{}", file_refusal(&text));
        let text = format!("drive = {{ kind = \"{}\", amplitude = ? }}", "µ".repeat(before));
        let column = before + 34;
        assert!(file_refusal(&text).starts_with(&format!("bench/own.toml:1:{column}: ")), "{}", file_refusal(&text));
    }
    // A message repeats the beginning of a long override.
    let message = refusal(&[&format!("chain.gaps=[{}]", "0,".repeat(2000))]);
    assert!(message.starts_with("--set chain.gaps=[0,0,") && message.contains('…') && message.len() < 300, "{message}");
}

#[test]
fn files_that_are_no_scenes_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.toml");
    let message = overridden(missing.to_str().unwrap(), &[]).unwrap_err().to_string();
    assert!(message.starts_with(&format!("{}: expected a scene file, found none", missing.display())), "{message}");
    let message = overridden(folder.path().to_str().unwrap(), &[]).unwrap_err().to_string();
    assert!(message.contains("is a folder; give the scene file in it"), "{message}");
    let binary = folder.path().join("binary.toml");
    std::fs::write(&binary, b"name = \"\xff\"").unwrap();
    let message = overridden(binary.to_str().unwrap(), &[]).unwrap_err().to_string();
    assert!(message.contains("is not a text file (byte 8 is no UTF-8)"), "{message}");
    let record = folder.path().join("record.csv");
    std::fs::write(&record, "0.1,2.5\n".repeat(200_000)).unwrap();
    let message = overridden(record.to_str().unwrap(), &[]).unwrap_err().to_string();
    assert!(
        message.contains("record.csv` has more than 1048576 bytes, no scene has; a record belongs to `--measured`"),
        "{message}"
    );
    let message = file_refusal("[chain]\nbeads = six\n");
    assert!(message.starts_with("bench/own.toml:2:9: not readable as TOML: "), "{message}");
    assert!(message.ends_with("expected lines such as `radius = \"0.5 mm\"` under `[chain]`"), "{message}");
}

#[test]
fn unknown_and_misspelt_keys_are_refused_with_line_column_and_the_nearest_key() {
    for (text, expected) in [
        (
            "extends = \"rigid\"\n[chain]\n  raduis = 1",
            "bench/own.toml:3:3: unknown key `chain.raduis`; did you mean `chain.radius`?",
        ),
        (
            "[dampng]\ncoefficient = 1",
            "bench/own.toml:1:2: unknown key `dampng.coefficient`; did you mean `damping.coefficient`?",
        ),
        ("coefficient = 1", "bench/own.toml:1:1: unknown key `coefficient`; did you mean `damping.coefficient`?"),
        ("ring_up = 1", "bench/own.toml:1:1: unknown key `ring_up`; did you mean `drive.ring_up`?"),
        ("damping = \"linear\"", "bench/own.toml:1:1: unknown key `damping`; did you mean `damping.kind`?"),
        (
            "[model]\ncolour = 1",
            "bench/own.toml:2:1: unknown key `model.colour`; `granchain scene keys` lists all keys",
        ),
        (
            "[materials.tin]\nyoung_modulus = 1",
            "bench/own.toml:2:1: unknown key `materials.tin.young_modulus`; did you mean `materials.tin.youngs_modulus`?",
        ),
        (
            "extends = \"rigid\"\n[[chain.override]]\nbead = 1\nradios = 1",
            "bench/own.toml:4:1: unknown key `chain.override.radios`; did you mean `chain.override.radius`?",
        ),
    ] {
        assert_eq!(file_refusal(text), expected);
    }
    assert_eq!(refusal(&["chain.bead=3"]), "--set chain.bead=3: unknown key `chain.bead`; did you mean `chain.beads`?");
    // The first in the file, not in the alphabet.
    assert!(file_refusal("zzz = 1\naaa = 2").starts_with("bench/own.toml:1:1: unknown key `zzz`"));
}

#[test]
fn overrides_that_are_no_assignments_are_refused() {
    let expected = "expected KEY=VALUE such as `damping.coefficient=0.4` or `chain.radius=0.5mm`";
    for text in ["damping.coefficient", "=3", "alpha="] {
        assert_eq!(refusal(&[text]), format!("--set {text}: {expected}"));
    }
    assert_eq!(
        refusal(&["extends=chain"]),
        "--set extends=chain: `extends`: expected this key in scene files only, found an override; use --scene NAME"
    );
}

#[test]
fn values_of_the_wrong_type_or_unit_are_refused_with_what_belongs_there() {
    for (text, expected) in [
        ("chain.radius=true", "`chain.radius`: expected a length such as `0.5 mm`, found `true`"),
        ("chain.radius=[1]", "`chain.radius`: expected a length such as `0.5 mm`, found a list of 1"),
        ("chain.beads=six", "`chain.beads`: expected a whole number, found the text `six`"),
        ("name=7", "`name`: expected a text in quotes, found the number 7"),
        ("piston.contact=7", "`piston.contact`: expected one of `rigid`, `half-space`, found the number 7"),
        (
            "piston.contact=half-spac",
            "`piston.contact`: expected one of `rigid`, `half-space`, found `half-spac`; did you mean `half-space`?",
        ),
        ("chain.radius=0.5 s", "`chain.radius`: expected a length such as `0.5 mm`, found `0.5 s`, which is a time"),
        (
            "chain.radius=\"0.5\"",
            "`chain.radius`: expected a length such as `0.5 mm`, found `0.5` without a unit; add it, or write a plain number in SI",
        ),
        ("drive.frequency=73khz", "`drive.frequency`: unknown unit `khz` in `73khz`; did you mean `kHz`?"),
        (
            "chain.override=3",
            "`chain.override`: expected a list of tables such as `[[chain.override]]` with `bead = 3` and `radius = \"0.51 mm\"`, found the number 3",
        ),
        (
            "chain.override=[{radius=1}]",
            "`chain.override`: expected `bead`, the number of the bead counted from the piston, in every table, found a table",
        ),
    ] {
        assert_eq!(refusal(&[text]), format!("--set {text}: {expected}"));
    }
    let tension = overridden("annulus", &["damping.tension=maybe"]).unwrap_err().to_string();
    assert_eq!(
        tension,
        "--set damping.tension=maybe: `damping.tension`: expected `true` or `false`, found the text `maybe`"
    );
    let unit = overridden("annulus", &["damping.coefficient=3660 N s/m^1.5"]).unwrap_err().to_string();
    assert!(unit.ends_with("found `3660 N s/m^1.5`, which is a Kuwabara–Kono damping coefficient"), "{unit}");
}

#[test]
fn unphysical_values_are_refused() {
    for (text, expected) in [
        ("chain.radius=-1mm", "`chain.radius`: expected a positive, finite value, found -1 mm"),
        ("chain.radius=0", "`chain.radius`: expected a positive, finite value, found 0 m"),
        ("chain.beads=0", "`chain.beads`: expected a whole number of beads from 1 to 1000, found 0"),
        ("chain.beads=1001", "`chain.beads`: expected a whole number of beads from 1 to 1000, found 1001"),
        ("chain.beads=2.5", "`chain.beads`: expected a whole number of beads from 1 to 1000, found 2.5"),
        ("alpha=-1", "`alpha`: expected a finite value of 0 or more, found -1"),
        ("alpha=nan", "`alpha`: expected a finite value of 0 or more, found NaN"),
        ("duration=0s", "`duration`: expected a positive, finite value, found 0 s"),
        (
            "vibrometer.bandwidth=50kHz",
            "`vibrometer.bandwidth`: expected above the drive frequency 73 kHz, found 50 kHz",
        ),
        ("output_step=1ms", "`output_step`: expected at most the duration 120 µs, found 1 ms"),
        ("output_step=1e-15", "`output_step`: expected at most 20000000 samples in 120 µs, found 1e-9 µs"),
        ("drive.frequency=0Hz", "`drive.frequency`: expected a positive, finite value, found 0 Hz"),
        ("drive.amplitude=1mm", "`drive.amplitude`: expected α × amplitude below the bead radius 0.5 mm, found 1 mm"),
        (
            "drive.cycles=4.3",
            "`drive.cycles`: expected a whole or half number of cycles, where the sine passes zero; else the piston would jump, found 4.3",
        ),
        ("model.tolerance=1", "`model.tolerance`: expected a value between 1e-14 and 1e-2, found 1"),
        ("chain.precompression=-1N", "`chain.precompression`: expected a finite value of 0 or more, found -1 N"),
        (
            "chain.precompression=1kN",
            "`chain.precompression`: expected at most 502 N (E a²/100), where contacts are still small, found 1 kN",
        ),
        ("chain.gaps=1mm", "`chain.gaps`: expected gaps below the bead radius 0.5 mm, found 1 mm"),
        (
            "materials.chrome-steel.poissons_ratio=0.6",
            "`materials.chrome-steel.poissons_ratio`: expected Poisson's ratio above −1 and below 0.5, found 0.6",
        ),
        (
            "materials.chrome-steel.density=-1",
            "`materials.chrome-steel.density`: expected a positive, finite value, found -1 kg/m³",
        ),
    ] {
        assert_eq!(refusal(&[text]), format!("--set {text}: {expected}"));
    }
    let damping = overridden("annulus", &["damping.coefficient=-0.1"]).unwrap_err().to_string();
    assert!(
        damping.ends_with("`damping.coefficient`: expected a finite value of 0 or more, found -0.1 N·s/m"),
        "{damping}"
    );
    // The duration itself may be what makes the default step too long.
    assert!(file_refusal("extends = \"rigid\"\nduration = \"1 ns\"").contains("expected at most the duration 1 ns"));
}

#[test]
fn beads_that_overlap_and_pressed_chains_with_gaps_are_refused() {
    let cure = "a gap is 0 or more, a chain pressed together is `chain.precompression = \"0.05 N\"`";
    assert_eq!(
        refusal(&["chain.gaps=[0, 0, -5nm, 0, 0, 0, 0]"]),
        format!(
            "--set chain.gaps=[0, 0, -5nm, 0, 0, 0, 0]: `chain.gaps`: gap 3 is -5 nm: bead 2 and bead 3 would overlap \
             at the start; {cure}"
        )
    );
    assert!(refusal(&["chain.gaps.contact1=-5nm"]).contains("gap 1 is -5 nm: the piston and bead 1 would overlap"));
    assert!(refusal(&["chain.gaps.contact7=-5nm"]).contains("gap 7 is -5 nm: bead 6 and the support would overlap"));
    assert_eq!(
        file_refusal("extends = \"rigid\"\nchain.precompression = 0.1\nchain.gaps = { contact4 = 1e-9 }"),
        "bench/own.toml:2:24: `chain.precompression`: 0.1 N cannot press a chain whose contact 4 is open by 1 nm; \
         close the gaps (`chain.gaps = 0`) or set `chain.precompression = 0`"
    );
}

#[test]
fn lists_and_overrides_that_do_not_fit_the_chain_are_refused() {
    assert_eq!(
        refusal(&["chain.gaps=[0, 1nm]"]),
        "--set chain.gaps=[0, 1nm]: `chain.gaps`: expected one value or 7 (one for each contact of 6 beads, from the \
         piston), found 2"
    );
    assert_eq!(
        refusal(&["chain.gaps.contact8=1nm"]),
        "--set chain.gaps.contact8=1nm: `chain.gaps.contact8`: expected `contact1` (piston) to `contact7` (support) or `all`"
    );
    assert_eq!(
        refusal(&["chain.override=[{bead=7}]"]),
        "--set chain.override=[{bead=7}]: `chain.override.bead`: there is no bead 7; the chain has beads 1 to 6"
    );
    assert_eq!(
        refusal(&["chain.override=[{bead=2},{bead=2}]"]),
        "--set chain.override=[{bead=2},{bead=2}]: bead 2 has an override already; put both values into one \
         `[[chain.override]]`"
    );
}

#[test]
fn materials_must_be_known_and_whole() {
    assert_eq!(
        refusal(&["chain.material=chrome_steel"]),
        "--set chain.material=chrome_steel: `chain.material`: unknown material `chrome_steel` (known: acrylic, aluminium, chrome-steel, glass, resin, titanium, tungsten-carbide, vitreous-carbon); \
         did you mean `chrome-steel`?; define it under `[materials.chrome_steel]`"
    );
    assert_eq!(
        refusal(&["materials.brass.density=8500"]),
        "built-in scene `rigid`: material `brass` lacks `youngs_modulus`; add `materials.brass.youngs_modulus`, \
         a pressure or elastic modulus such as `201 GPa`"
    );
}

#[test]
fn keys_without_effect_are_refused_with_the_reason() {
    assert_eq!(
        refusal(&["drive.ring_up=1us"]),
        "--set drive.ring_up=1us: `drive.ring_up` has no effect with `drive.kind = \"sine\"`, which uses \
         `drive.amplitude`, `drive.frequency`, `drive.cycles`; remove it or change `drive.kind` (it belongs to \
         `drive.kind = \"tone-burst\"`)"
    );
    assert!(
        refusal(&["damping.coefficient=0.3"]).contains("with `damping.kind = \"none\"`, which uses no further keys")
    );
    assert!(refusal(&["support.stiffness=1e6"]).contains("it belongs to `support.kind = \"spring\"`"));
    assert!(refusal(&["model.step=10ns"]).contains("it belongs to `model.integrator = \"symplectic\"`"));
}

#[test]
fn missing_keys_are_named_with_a_line_that_provides_them() {
    assert_eq!(
        file_refusal("alpha = 1"),
        "bench/own.toml: `chain.beads` is missing; add `chain.beads = 6`, or begin the file with `extends = \"annulus\"`"
    );
    assert_eq!(
        refusal(&["support.kind=spring"]),
        "built-in scene `rigid`: `support.stiffness` is missing (a support of kind `spring` needs it); add \
         `support.stiffness = \"0.7e6 N/m\"`, or pass it with --set"
    );
    assert!(
        refusal(&["drive.kind=record"])
            .contains("`drive.file` is missing (a drive of kind `record` is read from a file)")
    );
    assert_eq!(
        refusal(&["model.integrator=symplectic"]),
        "--set model.integrator=symplectic: `model.integrator`: expected `dormand-prince-853`, or neither it nor `model.step`: steps are fixed \
         before a disc only, found `symplectic`"
    );
}

#[test]
fn effects_name_what_a_scene_switches_on() {
    let on = |scene: &Scene| -> Vec<&str> {
        scene::effects(scene).iter().filter(|effect| effect.on).map(|effect| effect.name).collect()
    };
    assert_eq!(on(&overridden("rigid", &[]).unwrap()), [""; 0]);
    assert_eq!(
        on(&overridden("annulus", &[]).unwrap()),
        ["linear dampers", "dampers at piston and support", "resin annulus", "ring-up of the drive"]
    );
    let all_else = overridden(
        "annulus",
        &[
            "damping.kind=kuwabara-kono",
            "damping.at=beads",
            "damping.tension=true",
            "chain.precompression=0.1N",
            "piston.contact=half-space",
            "support.kind=spring",
            "support.stiffness=1e6",
            "drive.kind=record",
            "drive.file=x.csv",
            "chain.override=[{bead=2,radius=0.4e-3}]",
        ],
    );
    assert_eq!(
        on(&all_else.unwrap()),
        [
            "Kuwabara–Kono dampers",
            "pulling dampers",
            "precompression",
            "unequal beads",
            "spring support",
            "elastic flats",
            "recorded drive"
        ]
    );
    assert_eq!(on(&overridden("rigid", &["chain.gaps=1nm"]).unwrap()), ["initial gaps"]);
}

#[test]
fn the_old_word_for_a_half_space_is_read_with_a_note() {
    for key in ["piston.contact", "support.kind"] {
        let loaded = granchain::scene::load_with_notes("rigid", &[format!("{key}=steel")]).unwrap();
        let new = granchain::scene::load_with_notes("rigid", &[format!("{key}=half-space")]).unwrap();
        assert_eq!(loaded.scene, new.scene);
        assert!(new.notes.is_empty() && loaded.notes[0].contains("is called \"half-space\" now"), "{:?}", loaded.notes);
    }
}

#[test]
fn a_drive_as_slow_as_a_forgotten_unit_is_remarked_on() {
    let notes =
        |value: &str| granchain::scene::load_with_notes("rigid", &[format!("drive.frequency={value}")]).unwrap().notes;
    assert!(notes("73").iter().any(|note| note.contains("write it with its unit")), "{:?}", notes("73"));
    assert!(notes("73 kHz").is_empty() && notes("2 kHz").is_empty());
}
