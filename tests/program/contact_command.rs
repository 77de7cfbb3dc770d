//! `granchain contact`: tables, figures, refusals.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use granchain::report::contact::{ContactReport, ContactState};

fn contact(flags: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_granchain")).arg("contact").args(flags).output().unwrap()
}

fn report(pair: &str, approaches: &str) -> ContactReport {
    let output = contact(&["--pair", pair, "--approaches", approaches, "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn states(report: &ContactReport) -> Vec<&ContactState> {
    report.loadings.iter().flat_map(|loading| &loading.states).collect()
}

#[test]
fn beads_follow_hertz_and_the_finite_body_law_of_their_loading() {
    let report = report("bead-bead", "0.3um,1um,3um");
    assert_eq!(report.loadings.len(), 2);
    for state in states(&report) {
        // The law is a fit of mesh-converged forces; the default mesh is within 0.4 % of it.
        let over = state.force_n / state.finite_body_force_n.unwrap() - 1.0;
        assert!(over.abs() < 4e-3, "{over:e} at {:e}", state.approach_m);
        // Half the distance of two contact points; 2 % of p₀ as the mesh resolves it.
        assert!((state.radius_m - state.law_radius_m.unwrap()).abs() < 1e-6);
        assert!((state.peak_pressure_pa / state.law_peak_pressure_pa.unwrap() - 1.0).abs() < 0.02);
    }
    let [squeezed, one_sided] = [0, 1].map(|index| report.loadings[index].states[1].force_n);
    // §9: 1.5 and 2.7 % over Hertz at 1 µm: the loadings differ by 1.2 %.
    assert!((one_sided / squeezed - 1.012).abs() < 2e-3, "{}", one_sided / squeezed);
}

#[test]
fn the_annulus_follows_the_law_of_the_chain() {
    let report = report("bead-annulus", "0.1um,1um,5um");
    for state in states(&report) {
        assert!(state.deviation().abs() < 0.01, "{} at {:e}", state.deviation(), state.approach_m);
        assert!(state.finite_body_force_n.is_none() && state.law_radius_m.is_none());
    }
}

#[test]
fn a_folder_holds_page_figures_tables_and_the_scene() {
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let flags = ["--pair", "bead-flat", "--set", "model.mesh_density=6", "--out", out.to_str().unwrap()];
    let output = contact(&flags);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| fs::read_to_string(out.join(name)).unwrap();
    let table = read("contact.csv");
    assert!(table.starts_with("loading,approach_m,force_n,radius_m,peak_pressure_pa,law_force_n,finite_body_force_n,"));
    // Eleven approaches up to 3 µm, two loadings, one header.
    assert_eq!(table.lines().count(), 23);
    assert!(read("pressure.csv").starts_with("loading,approach_m,place_m,pressure_pa,law_pressure_pa\n"));
    assert!(read("scene.toml").contains("mesh_density = 6"));
    let page = read("report.html");
    assert!(page.contains("Static contact, bead on rigid flat") && !page.contains("NaN"));
    for figure in ["force", "deviation", "radius", "pressure-1", "pressure-2"] {
        assert!(read(&format!("figures/{figure}.svg")).contains("<svg"));
        assert!(out.join(format!("figures/{figure}.png")).exists());
    }
    let report: ContactReport = serde_json::from_str(&read("contact.json")).unwrap();
    assert_eq!(states(&report).len(), 22);
    // The opposite pole makes the bead softer, at every approach.
    for (squeezed, one_sided) in report.loadings[0].states.iter().zip(&report.loadings[1].states) {
        assert!(squeezed.force_n < one_sided.force_n);
    }
}

#[test]
fn an_approach_beyond_the_fine_mesh_is_left_out_and_said_or_refused_where_nothing_is_left() {
    let output = contact(&["--pair", "bead-flat", "--approaches", "1um,20um"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("warning: squeezed at both poles, 20.0 µm"), "{said}");
    let place = tempfile::tempdir().unwrap();
    let out = place.path().join("out");
    let output = contact(&["--pair", "bead-flat", "--approaches", "20um", "--out", out.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no approach can be computed"));
    assert_eq!(fs::read_dir(Path::new(place.path())).unwrap().count(), 0);
}

#[test]
fn approaches_need_a_unit_and_a_pair_is_needed() {
    for (flags, what) in [
        (&["--pair", "bead-bead", "--approaches", "1"][..], "unit"),
        (&["--pair", "bead-bead", "--approaches=-1um"], "positive"),
        (&["--approaches", "1um"], "--pair"),
        (&["--pair", "bead-water"], "bead-annulus"),
    ] {
        let output = contact(flags);
        assert_eq!(output.status.code(), Some(2));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.contains(what), "{said}");
    }
}
