//! The chain with the law of finite bodies: its fits, its coupling, its motion beside the finite element analysis.

use std::f64::consts::PI;

use super::continuous::Continuous;
use granchain::{
    model::{
        self,
        chain::{
            ChainModel, FiniteBodyLaws, InitialState,
            ensemble::{Ensemble, Variation},
        },
        contact_law::{ElasticLaw, FiniteBody, FiniteHertz, Law},
    },
    response::Response,
    scene::{self, Material, Scene},
    signal::Series,
};

fn load(name: &str, overrides: &[&str]) -> Scene {
    let overrides = [&["model.kind=chain", "contact.law=finite-body"], overrides].concat();
    scene::load(name, &overrides.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>()).unwrap()
}

fn fitted(laws: &FiniteBodyLaws, contact: usize) -> FiniteHertz {
    match laws.fits[laws.contacts[contact]].law {
        Law::FiniteHertz(law) => law,
        other => panic!("{other:?}"),
    }
}

/// B of δ = (F/k)^(2/3) − B F, m/N.
fn stiffening(law: &FiniteHertz) -> f64 {
    law.first / (1.5 * law.stiffness)
}

fn run(scene: &Scene, laws: &FiniteBodyLaws) -> Response {
    let motion = scene.drive.motion(scene.amplitude_scale);
    let still = InitialState::at_rest(scene.chain.beads.len());
    ChainModel.run_with_laws(scene, Some(laws), motion.as_ref(), &still, &mut |_| true).unwrap()
}

/// Without piston and support, thrown.
fn thrown(scene: &mut Scene, velocities: Vec<f64>, duration: f64) -> Continuous {
    let last = scene.chain.beads.len();
    (scene.chain.gaps[0], scene.chain.gaps[last]) = (f64::INFINITY, f64::INFINITY);
    scene.amplitude_scale = 0.0;
    scene.duration = duration;
    Continuous::run(scene, velocities, 1e-7)
}

#[test]
fn steel_beads_are_stiffer_than_hertz_by_the_converged_excess() {
    let scene = load("rigid", &[]);
    let laws = FiniteBodyLaws::fit(&scene).unwrap();
    let (flat, pair) = (fitted(&laws, 0), fitted(&laws, 1));
    // c₁ and c₂ trade against each other with the range fitted over (here 0.2 to 2.8 and 0.4 to 5.6 µm): 0.0004 and 0.0004 of the force at
    // 1 µm. Their sum, the excess itself, is known to the mesh's own error.
    for (law, first, second, converged) in
        [(flat, 0.0359, 0.0042, FiniteBody::FlatColliding), (pair, 0.0249, 0.0024, FiniteBody::BeadsColliding)]
    {
        assert!((law.first * 1e-3 - first).abs() < 5e-4, "c₁ = {}", law.first * 1e-3);
        assert!((law.second * 1e-6 - second).abs() < 5e-4, "c₂ = {}", law.second * 1e-6);
        for overlap in [0.3e-6, 1e-6, 2.5e-6] {
            let excess = law.force(overlap) / (law.stiffness * overlap.powf(1.5)) - 1.0;
            assert!((excess - converged.excess(overlap, 0.5e-3)).abs() < 5e-4, "{overlap}: {excess}");
        }
    }
    for fit in &laws.fits {
        let quality = fit.quality.unwrap();
        // The issue of contact edges between nodes at density 12: 0.26 % at the smallest force, 0.07 % rms.
        assert!(quality.largest_error < 4e-3 && quality.rms_error < 1e-3, "{}: {quality:?}", fit.between);
        assert!(quality.largest_error > 1e-4, "an error that small was not measured");
    }
}

#[test]
fn what_two_different_bodies_give_way_to_a_force_adds() {
    let mut scene = load("rigid", &["chain.beads=2"]);
    scene.chain.beads[1].radius = 0.35e-3;
    scene.chain.beads[1].material.youngs_modulus = 100e9;
    let laws = FiniteBodyLaws::fit(&scene).unwrap();
    let (first, pair, second) = (fitted(&laws, 0), fitted(&laws, 1), fitted(&laws, 2));
    let sum = stiffening(&first) + stiffening(&second);
    // The pressures differ at the same force, and c₁ takes a little of the next order: 2 %.
    assert!((stiffening(&pair) / sum - 1.0).abs() < 0.02, "{:e} {sum:e}", stiffening(&pair));
    assert!(stiffening(&second) > 1.5 * stiffening(&first));
}

#[test]
fn similar_bodies_have_similar_laws() {
    let of_radius = |radius: &str| FiniteBodyLaws::fit(&load("rigid", &[&format!("chain.radius={radius}")])).unwrap();
    let (small, large) = (of_radius("0.5 mm"), of_radius("1 mm"));
    for contact in [0, 1] {
        let (small, large) = (fitted(&small, contact), fitted(&large, contact));
        // Rounding: the meshes are similar.
        assert!((large.first * 2f64.sqrt() / small.first - 1.0).abs() < 1e-6);
        assert!((large.second * 2.0 / small.second - 1.0).abs() < 1e-6);
    }
    assert!((large.couplings[2] * 2.0 / small.couplings[2] - 1.0).abs() < 1e-6);
}

/// s of a solid sphere, m/N: how far a point force F on one pole, balanced by inertia, draws the other pole towards the mass mean, over F.
///
/// The sphere's displacements under the normal traction −Σ pₙ Pₙ, pₙ = (2n + 1) F/(4πR²), degree by degree (Lurie 1964, *Three-Dimensional
/// Problems of the Theory of Elasticity*, ch. 6); degree 1 is the resultant with its inertia. At the far pole the degrees alternate; averaging
/// neighbouring partial sums converges fast.
fn pole_coupling(radius: f64, material: &Material) -> f64 {
    let nu = material.poissons_ratio;
    let shear = material.youngs_modulus / (2.0 * (1.0 + nu));
    let lame = 2.0 * shear * nu / (1.0 - 2.0 * nu);
    let area = 4.0 * PI * radius * radius;
    let resultant = -0.6 * 3.0 / area / (radius * (3.0 * lame + 2.0 * shear)) * radius * radius;
    let mut sums = Vec::new();
    let mut sum = resultant;
    for degree in (0..60).filter(|degree| *degree != 1) {
        let n = f64::from(degree);
        let traction = (2.0 * n + 1.0) / area / (2.0 * shear);
        // u_r = [(n + 1)(n − 2 + 4ν) a + n b] R Pₙ; σ_r/2μ and τ/2μ at R.
        let stress = [(n + 1.0) * (n * n - n - 2.0 - 2.0 * nu), n * (n - 1.0)];
        let shearing = [n * n + 2.0 * n - 1.0 + 2.0 * nu, n - 1.0];
        let (a, b) = if degree == 0 {
            (-traction / stress[0], 0.0)
        } else {
            let determinant = stress[0] * shearing[1] - stress[1] * shearing[0];
            (-traction * shearing[1] / determinant, traction * shearing[0] / determinant)
        };
        let outward = ((n + 1.0) * (n - 2.0 + 4.0 * nu) * a + n * b) * radius;
        sum -= if degree % 2 == 0 { outward } else { -outward };
        sums.push(sum);
    }
    for _ in 0..12 {
        sums = sums.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    }
    sums[sums.len() - 1]
}

#[test]
fn a_force_at_one_pole_draws_the_other_in_as_in_the_analytic_sphere() {
    let laws = FiniteBodyLaws::fit(&load("rigid", &[])).unwrap();
    let steel = pole_coupling(0.5e-3, &Material::chrome_steel());
    assert!((steel / 1.66e-9 - 1.0).abs() < 2e-3, "{steel:e}");
    for coupled in &laws.couplings {
        // The mesh and the width of the contacts: 0.03 %.
        assert!((coupled / steel - 1.0).abs() < 1e-3, "{coupled:e} {steel:e}");
    }
    // Another material, so that Poisson's ratio counts.
    let mut scene = load("rigid", &[]);
    for bead in &mut scene.chain.beads {
        bead.material.poissons_ratio = 0.1;
    }
    let laws = FiniteBodyLaws::fit(&scene).unwrap();
    let other = pole_coupling(0.5e-3, &scene.chain.beads[0].material);
    assert!((laws.couplings[0] / other - 1.0).abs() < 1e-3 && (other / steel - 1.0).abs() > 0.02, "{other:e}");
}

/// Rms difference over 0 to 70 µs over the rms there, both as moving means over 0.4 µs.
fn difference(one: &Series, other: &Series) -> f64 {
    let half = (0.2e-6 / one.step).round() as usize;
    let samples = (70e-6 / one.step).round() as usize;
    let mean =
        |series: &Series, i: usize| series.values[i - half..=i + half].iter().sum::<f64>() / (2 * half + 1) as f64;
    let sum = |value: &dyn Fn(usize) -> f64| (half..samples - half).map(|i| value(i).powi(2)).sum::<f64>();
    (sum(&|i| mean(one, i) - mean(other, i)) / sum(&|i| mean(other, i))).sqrt()
}

#[test]
fn it_follows_the_finite_element_analysis_where_hertz_does_not() {
    let common = ["duration=72 us", "output_step=20 ns"];
    let of = |more: &[&str]| {
        let overrides: Vec<String> = common.iter().chain(more).map(|text| (*text).to_owned()).collect();
        scene::load("rigid", &overrides).unwrap()
    };
    let analysis = ["model.kind=fea", "model.mesh_density=16", "model.step=20 ns"];
    let bodies = model::run(&of(&analysis), &mut |_| true).unwrap();
    let hertz = model::run(&of(&["model.kind=chain"]), &mut |_| true).unwrap();
    let scene = load("rigid", &common);
    let laws = FiniteBodyLaws::fit(&scene).unwrap();
    let (whole, apart) = (run(&scene, &laws), run(&scene, &laws.clone().without_coupling()));
    let last = |response: &Response| response.bead_velocity[5].clone();
    let [hertz, whole, apart] = [hertz, whole, apart].map(|response| difference(&last(&response), &last(&bodies)));
    println!(
        "from the finite element analysis: Hertz {hertz:.4}, without coupling {apart:.4}, finite bodies {whole:.4}"
    );
    // The laws are fitted at density 12; an analysis at that density is itself 2 % from one at 16.
    assert!(whole < 0.02, "{whole}");
    assert!(apart > 0.1 && hertz > 0.2, "{apart} {hertz}");
}

#[test]
fn energy_is_balanced_and_momentum_kept_whatever_the_dampers() {
    for (dampers, precompression) in [
        ("damping.kind=none", "0 N"),
        ("damping.kind=none", "1 N"),
        ("damping.kind=linear", "0 N"),
        ("damping.kind=kuwabara-kono", "0 N"),
        ("damping.kind=linear+kuwabara-kono", "0.1 N"),
    ] {
        for name in ["rigid", "annulus"] {
            let force = format!("chain.precompression={precompression}");
            let scene = load(name, &[dampers, &force, "duration=100 us", "model.tolerance=1e-10"]);
            let response = model::run(&scene, &mut |_| true).unwrap();
            let balance = response.energy.residual_j.abs() / response.energy.largest_j;
            // A thousand times the tolerance a step: hundreds of steps, and dashpots that cut elastic forces short.
            assert!(balance < 1e-7, "{name} {dampers} {precompression}: {balance:e}");
            assert!(response.energy.stored_j + response.energy.dissipated_j > 0.0);
        }
    }
    let mut scene = load("rigid", &["chain.override=[{bead=2, radius=\"0.4 mm\"}]", "model.tolerance=1e-12"]);
    let masses: Vec<f64> = scene.chain.beads.iter().map(|bead| bead.mass()).collect();
    let motion = thrown(&mut scene, vec![0.3, 0.0, 0.0, 0.0, 0.0, -0.2], 40e-6);
    let momentum = |time: f64| (0..6).map(|bead| masses[bead] * motion.velocity(bead, time)).sum::<f64>();
    let scale = masses[0] * 0.3;
    for time in [1e-6, 7e-6, 40e-6] {
        assert!((momentum(time) - momentum(0.0)).abs() < 1e-13 * scale, "{:e}", momentum(time) - momentum(0.0));
    }
    assert!(motion.energy.residual_j.abs() < 1e-10 * motion.energy.largest_j);
}

#[test]
fn a_mirrored_collision_is_the_mirror_image() {
    let radii = |radii: [f64; 4]| {
        let mut scene = load("rigid", &["chain.beads=4", "model.tolerance=1e-12"]);
        for (bead, radius) in scene.chain.beads.iter_mut().zip(radii) {
            bead.radius = radius;
        }
        scene
    };
    let forth = thrown(&mut radii([0.5e-3, 0.4e-3, 0.6e-3, 0.5e-3]), vec![0.2, 0.0, 0.0, 0.0], 30e-6);
    let back = thrown(&mut radii([0.5e-3, 0.6e-3, 0.4e-3, 0.5e-3]), vec![0.0, 0.0, 0.0, -0.2], 30e-6);
    for bead in 0..4 {
        let (here, there) = (forth.velocity(bead, 30e-6), -back.velocity(3 - bead, 30e-6));
        // Meshes of front and back mirror each other to rounding; so do the runs to their tolerance.
        assert!((here - there).abs() < 1e-8 * 0.2, "{here} {there}");
    }
}

#[test]
fn a_damped_pair_rebounds_as_its_law_integrated_by_hand() {
    let mut scene = load("rigid", &["chain.beads=2", "damping.kind=linear", "damping.coefficient=0.3 N s/m"]);
    let speed = 0.4;
    let laws = FiniteBodyLaws::fit(&scene).unwrap();
    let (law, mass) = (fitted(&laws, 1), scene.chain.beads[0].mass() / 2.0);
    let motion = thrown(&mut scene, vec![speed, 0.0], 10e-6);
    let found = (motion.velocity(1, 10e-6) - motion.velocity(0, 10e-6)) / speed;
    let force = |overlap: f64, rate: f64| (law.force(overlap) + 0.3 * rate).max(0.0);
    let (mut overlap, mut rate, step) = (0.0f64, speed, 1e-11);
    // Middle point rule, until the force is clipped for good.
    while rate > 0.0 || force(overlap, rate) > 0.0 {
        let middle = (overlap + 0.5 * step * rate, rate - 0.5 * step * force(overlap, rate) / mass);
        overlap += step * middle.1;
        rate -= step * force(middle.0, middle.1) / mass;
    }
    // Second order in 1e-11 s of 3 µs.
    assert!((found + rate / speed).abs() < 1e-6, "{found} {}", -rate / speed);
    assert!((0.5..0.9).contains(&found));
}

#[test]
fn small_motions_of_the_precompressed_chain_have_the_frequencies_of_its_dispersion() {
    let mut scene = load("rigid", &["chain.precompression=1 N", "model.tolerance=1e-10", "duration=300 us"]);
    scene.amplitude_scale = 0.0;
    let laws = FiniteBodyLaws::fit(&scene).unwrap();
    let (pair, coupled, mass) = (fitted(&laws, 1), laws.couplings[0], scene.chain.beads[0].mass());
    let tangent = pair.tangent_stiffness(pair.overlap(1.0));
    for mode in 1..=6usize {
        // A rigid flat mirrors the chain, so its modes are waves of q = jπ/N: (1/K + 2 s cos q) F = 2 sin(q/2) u, m ω² u = 2 sin(q/2) F.
        let q = mode as f64 * PI / 6.0;
        let squared = 4.0 * (q / 2.0).sin().powi(2) / mass / (1.0 / tangent + 2.0 * coupled * q.cos());
        let expected = squared.sqrt() / (2.0 * PI);
        let shape: Vec<f64> = (0..6).map(|bead| ((f64::from(bead) + 0.5) * q).sin()).collect();
        let run = Continuous::run(&scene, shape.iter().map(|value| 1e-5 * value).collect(), 1e-7);
        let found = run.frequency(&shape, expected, 300e-6);
        // The flats' law is fitted apart from the pairs': they are mirror images to 3e-4 of the force.
        assert!((found / expected - 1.0).abs() < 2e-4, "mode {mode}: {found} {expected}");
        let uncoupled = (2.0 * (q / 2.0).sin() * (tangent / mass).sqrt()) / (2.0 * PI);
        assert!(mode == 3 || (expected / uncoupled - 1.0).abs() > 1e-3, "the coupling shows");
    }
}

#[test]
fn an_ensemble_follows_the_accurate_integrator_and_takes_prepared_laws() {
    // Largest error over the peak: as with the law of Hertz, of the steps across closings; without them that of the fourth order.
    for (name, dampers, precompression, bound) in [
        ("rigid", "damping.kind=none", "0 N", 1e-3),
        ("rigid", "damping.kind=kuwabara-kono", "0 N", 2e-3),
        ("annulus", "damping.kind=none", "0.5 N", 1e-5),
        ("annulus", "damping.kind=linear", "0.5 N", 2e-6),
        ("annulus", "damping.kind=kuwabara-kono", "0 N", 1e-3),
        ("spring", "damping.kind=linear", "0.5 N", 1e-3),
        ("spring", "damping.kind=kuwabara-kono", "0 N", 2e-3),
    ] {
        let on_spring = ["support.kind=spring", "support.stiffness=10 N/um"];
        let (bench, support) = if name == "spring" { ("rigid", &on_spring[..]) } else { (name, &[][..]) };
        let force = format!("chain.precompression={precompression}");
        let mut scene = load(bench, &[&[dampers, &force, "duration=70 us"], support].concat());
        let prepared = model::prepare(&scene).unwrap();
        let laws = prepared.contact_laws().unwrap();
        let ensemble = Ensemble::with_laws(&scene, laws, 160).unwrap();
        scene.output_step = ensemble.step();
        let accurate = prepared.run(&scene, &mut |_| true).unwrap().pole_velocity;
        let variation = Variation::of(&scene);
        let found = ensemble.run(&[variation.clone(), variation.clone()]).remove(0).unwrap();
        let peak = accurate.values.iter().fold(0.0, |peak: f64, v| peak.max(v.abs()));
        let pairs = found.values.iter().zip(&accurate.values);
        let error = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / peak;
        assert!(error < bound, "{name} {dampers} {precompression}: {error:e}");
        let fresh = Ensemble::new(&scene, 160).unwrap().run(&[variation]).remove(0).unwrap();
        assert_eq!(fresh.values, found.values, "fitted again");
    }
}

#[test]
fn a_linear_dashpot_costs_the_fixed_step_the_same_order_with_either_law() {
    // The force jumps at touch, which is not located: first order, 3.1e-4 and 2.7e-4 of the peak at 160 steps a period.
    for law in ["hertz", "finite-body"] {
        let overrides = ["damping.kind=linear", &format!("contact.law={law}"), "duration=30 us"];
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        let mut scene = scene::load("rigid", &overrides).unwrap();
        let errors = [160, 320].map(|steps| {
            let ensemble = Ensemble::new(&scene, steps).unwrap();
            scene.output_step = ensemble.step();
            let accurate = model::run(&scene, &mut |_| true).unwrap().pole_velocity;
            let found = ensemble.run(&[Variation::of(&scene)]).remove(0).unwrap();
            let pairs = found.values.iter().zip(&accurate.values);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / accurate.peak()
        });
        // Halved with the step, and as much again for where in its step a touch falls.
        assert!(errors[0] < 1e-3 && (1.4..2.8).contains(&(errors[0] / errors[1])), "{law}: {errors:?}");
    }
}

/// The bead is pressed on the flat that the spring carries: without that contact the chain would be too stiff by a quarter of its force.
#[test]
fn a_chain_on_a_spring_moves_as_its_elastic_bodies_do() {
    let on_spring = ["support.kind=spring", "support.stiffness=10 N/um", "duration=100 us", "damping.kind=linear"];
    let scene = load("rigid", &on_spring);
    let laws = FiniteBodyLaws::fit(&scene).unwrap();
    let (flat, Law::HertzOnSpring(last)) = (fitted(&laws, 0), laws.fits[laws.contacts[6]].law) else {
        panic!("{laws:?}")
    };
    // Meshes of front and back are mirror images: the fits are so to 3e-4 of the force.
    assert!(
        last.spring == 1e7 && (last.contact.force(1e-6) / flat.force(1e-6) - 1.0).abs() < 1e-3,
        "{last:?} {flat:?}"
    );
    let chain = run(&scene, &laws);
    let reduced = [&on_spring[..], &["model.kind=reduced", "model.mesh_density=16"]].concat();
    let reduced = scene::load("rigid", &reduced.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>()).unwrap();
    let reduced = model::run(&reduced, &mut |_| true).unwrap();
    let [of_chain, of_bodies] = [&chain, &reduced].map(Response::observed_velocity);
    let off = of_bodies.values.iter().zip(&of_chain.values).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let rms = (off / of_bodies.values.iter().map(|v| v * v).sum::<f64>()).sqrt();
    assert!(rms < 0.01, "{rms}");
}

#[test]
fn bodies_that_have_no_mesh_keep_their_law_and_a_law_without_meaning_is_refused() {
    let scene = load("rigid", &["piston.contact=half-space", "support.kind=half-space"]);
    let laws = FiniteBodyLaws::fit(&scene).unwrap();
    for contact in [0, 6] {
        let fit = &laws.fits[laws.contacts[contact]];
        assert!(matches!(fit.law, Law::Hertz(_)) && fit.quality.is_none());
    }
    // As plain data, through text and back.
    let text = serde_json::to_string(&laws).unwrap();
    assert_eq!(serde_json::from_str::<FiniteBodyLaws>(&text).unwrap(), laws);
    let other = load("annulus", &[]);
    let motion = other.drive.motion(1.0);
    let still = InitialState::at_rest(6);
    let refused = ChainModel.run_with_laws(&other, Some(&laws), motion.as_ref(), &still, &mut |_| true).unwrap_err();
    assert!(refused.to_string().contains("another support"), "{refused}");
    let refused = scene::load("rigid", &["model.kind=fea".into(), "contact.law=finite-body".into()]).unwrap_err();
    let text = refused.to_string();
    assert!(text.contains("contact.law") && text.contains("model.kind = \"chain\""), "{text}");
    let refused = scene::load("rigid", &["model.kind=chain".into(), "model.mesh_density=8".into()]).unwrap_err();
    assert!(refused.to_string().contains("contact.law = \"finite-body\""), "{refused}");
}
