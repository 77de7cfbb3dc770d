//! Static contacts of the finite element analysis against Hertz, the finite body's own laws and the annulus' forces.

use std::f64::consts::PI;

use granchain::{
    model::{
        contact_law::{Annulus, ElasticLaw, FiniteBody, Hertz, bead_pair_stiffness},
        fea::statics::{Curve, Loading, StaticState, Touching},
    },
    scene,
};

fn curve(touching: Touching, loading: Loading, overrides: &[&str]) -> Curve {
    let all: Vec<String> = ["model.kind=fea"].iter().chain(overrides).map(|text| (*text).to_owned()).collect();
    Curve::new(&scene::load("annulus", &all).unwrap(), touching, loading).unwrap()
}

/// `count` approaches from 0.3 to 3 µm, evenly spaced in the logarithm, m.
fn approaches(count: usize) -> Vec<f64> {
    (0..count).map(|i| 0.3e-6 * 10_f64.powf(i as f64 / (count - 1) as f64)).collect()
}

/// F/F_H at the given approaches.
fn over_hertz(curve: &Curve, approaches: &[f64]) -> Vec<f64> {
    approaches.iter().map(|&d| curve.at(d).unwrap().force / curve.hertz_force(d).unwrap()).collect()
}

/// Contact radius √(R δ) of Hertz' law at the approach δ, m, with R = a/2 for a pair of beads and a for a flat.
fn hertz_radius(touching: Touching, approach: f64) -> f64 {
    let effective = if touching == Touching::BeadBead { 0.25e-3 } else { 0.5e-3 };
    (effective * approach).sqrt()
}

/// Pressure of Hertz' law at the distance r (m) from the middle, p₀ √(1 − r²/a²) with p₀ = 3F/(2πa²), Pa.
fn hertz_pressure(curve: &Curve, touching: Touching, approach: f64, distance: f64) -> f64 {
    let (force, radius) = (curve.hertz_force(approach).unwrap(), hertz_radius(touching, approach));
    1.5 * force / (PI * radius * radius) * (1.0 - (distance / radius).powi(2)).max(0.0).sqrt()
}

/// 1 + a √(δ/µm) + b δ/µm.
fn law((a, b): (f64, f64), approach: f64) -> f64 {
    let microns = 1e6 * approach;
    1.0 + a * microns.sqrt() + b * microns
}

#[test]
fn bead_forces_follow_the_laws_of_the_finite_body_within_four_per_mille() {
    // The laws are mesh-converged fits of a prototype; 4e-3 is what a mesh of density 12 is asked to keep, 4.0e-3 and 1.7e-3 measured.
    let cases = [
        (Touching::BeadBead, Loading::OneSided, (0.0249, 0.0024), 40),
        (Touching::BeadFlat, Loading::OneSided, (0.0359, 0.0042), 40),
        (Touching::BeadBead, Loading::BothPoles, (0.0126, 0.0023), 8),
    ];
    for (touching, loading, coefficients, count) in cases {
        let approaches = approaches(count);
        let found = over_hertz(&curve(touching, loading, &[]), &approaches);
        for (found, &approach) in found.iter().zip(&approaches) {
            let wanted = law(coefficients, approach);
            assert!((found / wanted - 1.0).abs() < 4e-3, "{touching:?} {loading:?} {approach:e}: {found} {wanted}");
        }
    }
}

#[test]
fn the_force_converges_with_the_square_of_the_element_size() {
    let approaches = approaches(40);
    let at = |density: &str| over_hertz(&curve(Touching::BeadBead, Loading::OneSided, &[density]), &approaches);
    let fine = at("model.mesh_density=48");
    let error = |density: &str| {
        let square: f64 = at(density).iter().zip(&fine).map(|(a, b)| (a / b - 1.0).powi(2)).sum();
        (square / approaches.len() as f64).sqrt()
    };
    // The edge of the contact falls anywhere in an element, so single errors jump; their mean over a decade falls with slope 2. Measured
    // 1.9 between these two.
    let slope = (error("model.mesh_density=5") / error("model.mesh_density=20")).log(4.0);
    assert!((1.7..2.3).contains(&slope), "{slope}");
}

#[test]
fn radius_and_peak_pressure_are_hertzian() {
    for touching in [Touching::BeadBead, Touching::BeadFlat] {
        let curve = curve(touching, Loading::OneSided, &[]);
        for approach in approaches(8) {
            let StaticState { force, radius, pressure, .. } = curve.at(approach).unwrap();
            // Hertz' contact of the same force: radius and pressure go as its third root.
            let root = (force / curve.hertz_force(approach).unwrap()).cbrt();
            let hertz = root * hertz_radius(touching, approach);
            let place = pressure.iter().position(|&(r, _)| r > hertz).unwrap();
            // Points are vertices and middles: one element is two points.
            let element = pressure[place + 1].0 - pressure[place - 1].0;
            assert!((radius - hertz).abs() < element, "{radius:e} {hertz:e} {element:e}");
            let (r, peak) = pressure[0];
            let wanted = root * hertz_pressure(&curve, touching, approach, r);
            // 2 % asked; half a per cent is left of a pressure held at nodes.
            assert!((peak / wanted - 1.0).abs() < 0.01, "{touching:?} {approach:e}: {peak:e} {wanted:e}");
        }
    }
}

#[test]
fn the_annulus_carries_the_prototypes_forces() {
    let curve = curve(Touching::BeadAnnulus, Loading::OneSided, &[]);
    for (approach, force) in [(0.1, 0.0498), (0.5, 0.298), (1.0, 0.653), (2.0, 1.444), (5.0, 4.198)] {
        let found = curve.at(1e-6 * approach).unwrap().force;
        // 1 % asked; 0.5 % measured at the smallest approach, where the prototype's mesh is as coarse as ours.
        assert!((found / force - 1.0).abs() < 0.01, "{approach} µm: {found} {force}");
    }
}

#[test]
fn an_approach_beyond_the_patch_is_refused() {
    let message = curve(Touching::BeadFlat, Loading::OneSided, &[]).at(2e-5).unwrap_err().to_string();
    assert!(message.contains("finely meshed patch"), "{message}");
}

/// Force, contact radius and peak pressure at an approach, m.
fn pressed(scene: &str, touching: Touching, loading: Loading, approaches: &[f64]) -> Vec<[f64; 3]> {
    let scene = scene::load(scene, &["model.kind=fea".into()]).unwrap();
    let curve = Curve::new(&scene, touching, loading).unwrap();
    let state = |approach: &f64| {
        let state = curve.at(*approach).unwrap();
        [state.force, state.radius, state.pressure.iter().map(|(_, pressure)| *pressure).fold(0.0, f64::max)]
    };
    approaches.iter().map(state).collect()
}

#[test]
fn beads_follow_hertz_and_the_finite_body_law_of_their_loading() {
    let approaches = [0.3e-6, 1e-6, 3e-6];
    let scene = scene::load("rigid", &["model.kind=fea".into()]).unwrap();
    let bead = &scene.chain.beads[0];
    let hertz = Hertz { stiffness: bead_pair_stiffness(bead, bead) };
    let mut at_one = Vec::new();
    for (loading, law) in
        [(Loading::BothPoles, FiniteBody::BeadsSqueezed), (Loading::OneSided, FiniteBody::BeadsColliding)]
    {
        let curve = Curve::new(&scene, Touching::BeadBead, loading).unwrap();
        let states = pressed("rigid", Touching::BeadBead, loading, &approaches);
        for (approach, [force, radius, peak]) in approaches.into_iter().zip(&states) {
            // The law is a fit of mesh-converged forces; the default mesh is within 0.4 % of it.
            let expected = hertz.force(approach) * (1.0 + law.excess(approach, bead.radius));
            assert!((force / expected - 1.0).abs() < 4e-3, "{force:e} at {approach:e}");
            // Half the distance of two contact points; 2 % of p₀ as the mesh resolves it.
            let overlap = hertz.overlap(*force);
            assert!((radius - hertz_radius(Touching::BeadBead, overlap)).abs() < 1e-6);
            assert!((peak / hertz_pressure(&curve, Touching::BeadBead, overlap, 0.0) - 1.0).abs() < 0.02);
        }
        at_one.push(states[1][0]);
    }
    // 1.5 and 2.7 % over Hertz at 1 µm: the loadings differ by 1.2 %.
    assert!((at_one[1] / at_one[0] - 1.012).abs() < 2e-3, "{at_one:?}");
}

#[test]
fn the_annulus_follows_the_law_of_the_chain_and_the_opposite_pole_softens_the_bead() {
    for loading in [Loading::BothPoles, Loading::OneSided] {
        let approaches = [0.1e-6, 1e-6, 5e-6];
        for (approach, [force, ..]) in
            approaches.into_iter().zip(pressed("annulus", Touching::BeadAnnulus, loading, &approaches))
        {
            let deviation = force / Annulus::new(1.0).force(approach) - 1.0;
            assert!(deviation.abs() < 0.01, "{deviation} at {approach:e}");
        }
    }
    let [squeezed, one_sided] = [Loading::BothPoles, Loading::OneSided]
        .map(|loading| pressed("rigid", Touching::BeadFlat, loading, &[0.1e-6, 1e-6, 3e-6]));
    assert!(squeezed.iter().zip(&one_sided).all(|(both, one)| both[0] < one[0]));
}
