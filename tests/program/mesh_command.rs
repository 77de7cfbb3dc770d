//! `granchain mesh`: counts, files, refusals.

use std::{
    fs,
    process::{Command, Output},
};

use serde_json::Value;

fn mesh(flags: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_granchain")).arg("mesh").args(flags).output().unwrap()
}

fn summary(flags: &[&str]) -> Value {
    let output = mesh(&[flags, &["--json"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn the_default_meshes_of_both_scenes_have_the_masses_of_their_bodies() {
    let rigid = summary(&["--scene", "rigid"]);
    let kinds = rigid["kinds"].as_array().unwrap();
    assert_eq!((kinds.len(), rigid["density"].as_u64()), (1, Some(12)));
    assert_eq!(kinds[0]["bodies"], "beads 1 to 6");
    let exact = 4.101_349_209e-6;
    let mass = kinds[0]["mass_kg"].as_f64().unwrap();
    // 3e-4 was asked for; 1e-4 is what curved quadratic sides give with room.
    assert!((mass / exact - 1.0).abs() < 1e-4);
    assert!((kinds[0]["mass_error"].as_f64().unwrap() - (mass / exact - 1.0)).abs() < 1e-9);
    assert_eq!(rigid["unknowns"].as_u64(), Some(6 * kinds[0]["unknowns"].as_u64().unwrap()));

    let annulus = summary(&["--scene", "annulus"]);
    let support = &annulus["kinds"][1];
    assert_eq!((support["bodies"].as_str(), support["contact_nodes"].as_u64()), (Some("support"), Some(49)));
    assert!(support["mass_error"].as_f64().unwrap().abs() < 1e-4);
    assert!(support["worst_jacobian_ratio"].as_f64().unwrap() > 0.3);
}

#[test]
fn a_folder_holds_two_figures_twice_the_table_and_the_mesh() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let flags = ["--scene", "annulus", "--density", "4", "--out", out.to_str().unwrap()];
    let output = mesh(&flags);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for name in ["mesh", "contacts"] {
        let svg = fs::read_to_string(out.join(format!("{name}.svg"))).unwrap();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let texts: Vec<_> = document.descendants().filter_map(|node| node.text()).collect();
        for wanted in ["bead", "support"] {
            assert!(texts.contains(&wanted), "{name}: no {wanted}");
        }
        assert!(texts.iter().filter(|text| text.ends_with("(mm)")).count() >= 2, "{name}: axes without unit");
        assert!(fs::read(out.join(format!("{name}.png"))).unwrap().starts_with(b"\x89PNG"));
    }
    let table: Value = serde_json::from_slice(&fs::read(out.join("mesh.json")).unwrap()).unwrap();
    let vtu = fs::read_to_string(out.join("mesh.vtu")).unwrap();
    let document = roxmltree::Document::parse(&vtu).unwrap();
    let piece = document.descendants().find(|node| node.has_tag_name("Piece")).unwrap();
    assert_eq!(piece.attribute("NumberOfCells"), Some(table["elements"].to_string().as_str()));
}

#[test]
fn what_cannot_be_meshed_is_refused() {
    let failed = |flags: &[&str], code: i32, said: &str| {
        let output = mesh(flags);
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{error}");
        assert!(error.contains(said), "{error}");
    };
    failed(&["--scene", "rigid", "--density", "1"], 2, "--density");
    failed(&["--scene", "rigid", "--density", "8", "--set", "model.mesh_density=9"], 2, "give one of them");
    failed(&["--scene", "nowhere"], 1, "nowhere");
    failed(&["--scene", "rigid", "--set", "piston.contact=half-space"], 1, "piston.contact");
}
