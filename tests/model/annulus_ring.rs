//! Rings other than the paper's: geometry against closed forms, forces against similarity, modulus and finer meshes, and the chain's law of
//! them against the bodies.

use granchain::{
    model::{
        self,
        chain::{
            FiniteBodyLaws,
            ensemble::{Ensemble, Variation},
        },
        contact_law::{Annulus, ElasticLaw, Law},
        fea::{
            mesh::{AnnulusMesh, HalfTorus, annulus, quality},
            statics::{Curve, Loading, Touching},
        },
        reduced::Cache,
    },
    scene::{self, AnnulusShape, Scene},
    signal::Series,
};

fn load(overrides: &[&str]) -> Scene {
    scene::load("annulus", &overrides.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>()).unwrap()
}

/// Static forces (N) at approaches (m) by finite elements.
fn forces(overrides: &[&str], approaches: &[f64]) -> Vec<f64> {
    let scene = load(&[&["model.kind=fea"], overrides].concat());
    let curve = Curve::new(&scene, Touching::BeadAnnulus, Loading::OneSided).unwrap();
    approaches.iter().map(|approach| curve.at(*approach).unwrap().force).collect()
}

/// The chain's law of a ring.
fn law(overrides: &[&str]) -> Annulus {
    let laws = FiniteBodyLaws::fit(&load(overrides)).unwrap();
    match laws.fits.last().map(|fit| fit.law) {
        Some(Law::Annulus(law)) => law,
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_bead_touches_where_the_triangle_of_centres_says() {
    for (ring, section, bead) in [(0.55e-3, 0.25e-3, 0.5e-3), (2e-3, 0.4e-3, 2.2e-3), (0.3e-3, 0.28e-3, 0.1e-3)] {
        let shape = AnnulusShape { ring_radius: ring, section_radius: section };
        let torus = HalfTorus::under(&shape, bead);
        let ([r, z], centre) = (torus.contact_point(), torus.bead_centre());
        // On the bead's surface, on the section's, and on the line of both centres.
        assert!(
            (r.hypot(z - centre) / bead - 1.0).abs() < 1e-12 && ((r - ring).hypot(z) / section - 1.0).abs() < 1e-12
        );
        assert!((centre.hypot(ring) / (bead + section) - 1.0).abs() < 1e-12);
        assert!((r / bead - shape.contact_angle(bead).sin()).abs() < 1e-12);
    }
}

#[test]
fn rings_of_any_shape_that_a_scene_may_have_are_meshed_at_every_density() {
    for angle in [25.0f64, 45.0, 80.0] {
        for slender in [0.05, 0.45, 0.9] {
            let ring_radius = 1e-3;
            let section_radius = slender * ring_radius;
            let bead_radius = ring_radius / angle.to_radians().sin() - section_radius;
            let torus = HalfTorus { ring_radius, section_radius, bead_radius };
            for density in [2, 3, 4, 8, 12, 24] {
                let mesh = annulus(&torus, &AnnulusMesh::on(&torus, density)).unwrap();
                let error = quality(&mesh).volume_error(torus.volume()).abs();
                let most = if density < 8 { 1e-2 } else { 1e-4 };
                assert!(error < most, "{angle}° {slender} at {density}: {error:e}");
            }
        }
    }
}

#[test]
fn forces_scale_with_the_square_of_all_lengths() {
    let unit = forces(&[], &[0.5e-6, 1e-6]);
    for scale in [0.5, 3.0] {
        let sets = [("support.ring_radius", 0.55e-3), ("support.section_radius", 0.25e-3), ("chain.radius", 0.5e-3)];
        let sets = sets.map(|(key, length)| format!("{key}={}", scale * length));
        let sets = sets.each_ref().map(String::as_str);
        let scaled = forces(&sets, &[0.5e-6 * scale, 1e-6 * scale]);
        for (scaled, unit) in scaled.iter().zip(&unit) {
            // The patch grows with the root of the size, so that the meshes differ.
            assert!((scaled / (scale * scale * unit) - 1.0).abs() < 3e-3, "{scale}: {scaled} {unit}");
        }
        let (law, unit) = (law(&sets), Annulus::new(1.0));
        for approach in [0.3e-6, 1e-6, 1.5e-6] {
            let ratio = law.force(scale * approach) / (scale * scale * unit.force(approach));
            // The five points of the paper's law carry three digits, and it fits them to 0.12 %; this one its statics to 0.7 %.
            assert!((ratio - 1.0).abs() < 8e-3, "{scale} {approach:e}: {ratio}");
        }
    }
}

#[test]
fn under_a_rigid_bead_forces_are_proportional_to_the_rings_modulus() {
    let rigid =
        ["materials.hard.youngs_modulus=1e15", "materials.hard.poissons_ratio=0.3", "materials.hard.density=7833"];
    let of = |modulus: &str| {
        let modulus = format!("materials.resin.youngs_modulus={modulus}");
        forces(&[&rigid[..], &["chain.material=hard", &modulus]].concat(), &[0.3e-6, 2e-6])
    };
    let (soft, hard) = (of("0.5 GPa"), of("5 GPa"));
    for (soft, hard) in soft.iter().zip(&hard) {
        assert!((hard / (10.0 * soft) - 1.0).abs() < 1e-4, "{soft} {hard}");
    }
}

#[test]
fn the_law_of_a_ring_beside_the_papers_is_the_papers() {
    let (beside, papers) = (law(&["support.ring_radius=0.5501 mm"]), Annulus::new(1.0));
    for approach in [0.1e-6, 0.5e-6, 1e-6, 2e-6, 5e-6] {
        let ratio = beside.force(approach) / papers.force(approach);
        assert!((ratio - 1.0).abs() < 6e-3, "{approach:e}: {ratio}");
    }
}

/// A large soft ring under large beads, and a thin one under small beads.
const RINGS: [[&str; 4]; 2] = [
    ["support.ring_radius=4 mm", "support.section_radius=1.5 mm", "chain.radius=5 mm", "support.material=acrylic"],
    [
        "support.ring_radius=0.4 mm",
        "support.section_radius=0.1 mm",
        "chain.radius=0.4 mm",
        "support.stiffness_factor=0.8",
    ],
];

#[test]
fn the_law_follows_finer_statics_of_its_ring() {
    for ring in RINGS {
        let (law, approaches) = (law(&ring), [0.2e-6, 1e-6, 4e-6]);
        let factor = if ring[3].contains("0.8") { 0.8 } else { 1.0 };
        let fine = forces(&[&ring[..], &["model.mesh_density=24"]].concat(), &approaches);
        for (approach, fine) in approaches.into_iter().zip(fine) {
            let ratio = factor * law.force(approach) / fine;
            assert!((ratio - 1.0).abs() < 8e-3, "{ring:?} {approach:e}: {ratio}");
        }
    }
}

/// Rms difference over the rms of the other, as moving means over 0.4 µs.
fn difference(one: &Series, other: &Series) -> f64 {
    let half = (0.2e-6 / one.step).round() as usize;
    let mean =
        |series: &Series, i: usize| series.values[i - half..=i + half].iter().sum::<f64>() / (2 * half + 1) as f64;
    let samples = one.len().min(other.len());
    let sum = |value: &dyn Fn(usize) -> f64| (half..samples - half).map(|i| value(i).powi(2)).sum::<f64>();
    (sum(&|i| mean(one, i) - mean(other, i)) / sum(&|i| mean(other, i))).sqrt()
}

#[test]
fn chain_and_meshed_bodies_agree_on_another_ring() {
    let ring = ["support.ring_radius=0.7 mm", "support.section_radius=0.3 mm", "chain.radius=0.6 mm", "duration=70 us"];
    let run = |of_model: &[&str]| {
        let scene = load(&[&ring[..], of_model, &["output_step=50 ns"]].concat());
        model::run(&scene, &mut |_| true).unwrap().observed_velocity().clone()
    };
    let [reduced, fea] = ["reduced", "fea"].map(|kind| run(&[&format!("model.kind={kind}"), "model.mesh_density=12"]));
    let chain = run(&["model.kind=chain"]);
    let (of_chain, of_reduced) = (difference(&chain, &fea), difference(&reduced, &fea));
    println!("chain {of_chain:.2e}, reduced {of_reduced:.2e}");
    // Before the paper's ring the chain is 2.0 % off by this measure: half-spaces in place of finite bodies, a ring without mass.
    assert!(of_chain < 4e-2 && of_reduced < 2e-3, "{of_chain:e} {of_reduced:e}");
    // And the paper's ring is another bench.
    let scene = load(&["chain.radius=0.5 mm", "duration=70 us", "model.kind=chain", "output_step=50 ns"]);
    let papers = model::run(&scene, &mut |_| true).unwrap();
    assert!(difference(papers.observed_velocity(), &fea) > 0.1);
}

#[test]
fn the_law_of_a_ring_is_kept_and_runs_read_it_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path());
    let scene = load(&["support.ring_radius=0.6 mm", "model.kind=chain", "duration=30 us"]);
    let run = || {
        let prepared = model::prepare_with(&scene, Some(&cache)).unwrap();
        (prepared.work().fitted_laws, prepared.run(&scene, &mut |_| true).unwrap().pole_velocity)
    };
    let (first, second) = (run(), run());
    assert_eq!((first.0, second.0), (1, 0));
    assert_eq!(first.1, second.1);
    assert_eq!(first.1, model::run(&scene, &mut |_| true).unwrap().pole_velocity);
}

#[test]
fn an_ensemble_on_another_ring_follows_the_single_run_and_its_factor() {
    let scene = load(&["support.ring_radius=0.6 mm", "model.kind=chain", "duration=60 us"]);
    let ensemble = Ensemble::new(&scene, 1280).unwrap();
    let plain = Variation::of(&scene);
    let stiff = Variation { support_stiffness_factor: 1.4, ..plain.clone() };
    let single = |overrides: &[&str]| {
        let step = format!("output_step={:e}", ensemble.step());
        let all = ["support.ring_radius=0.6 mm", "model.kind=chain", "duration=60 us", &step];
        model::run(&load(&[&all[..], overrides].concat()), &mut |_| true).unwrap().pole_velocity
    };
    let runs = ensemble.run(&[plain, stiff]);
    let [one, other] = [single(&[]), single(&["support.stiffness_factor=1.4"])];
    let runs: Vec<&Series> = runs.iter().map(|run| run.as_ref().unwrap()).collect();
    assert!(difference(runs[0], &one) < 2e-3 && difference(runs[1], &other) < 2e-3);
    assert!(difference(&one, &other) > 0.02);
}

#[test]
fn a_bead_hardly_harder_than_its_ring_is_warned_of() {
    assert_eq!(load(&[]).coarse_ring(), None);
    assert_eq!(load(&["support.material=acrylic"]).coarse_ring(), None);
    let scene = load(&["support.material=chrome-steel", "model.kind=chain", "duration=1 us"]);
    let said = scene.coarse_ring().unwrap();
    assert!(said.contains("gives way by 50 % of both") && said.contains("18 % too stiff"), "{said}");
    let prepared = model::prepare(&scene).unwrap();
    let response = prepared.run(&scene, &mut |_| true).unwrap();
    assert_eq!(prepared.warnings(&scene, &response), [said]);
    // What it says is what a finer mesh finds.
    let of = |density: &str| forces(&["support.material=chrome-steel", density], &[1e-6])[0];
    let excess = of("model.mesh_density=12") / of("model.mesh_density=64") - 1.0;
    assert!((0.12..0.22).contains(&excess), "{excess}");
}
