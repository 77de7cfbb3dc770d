//! Collisions, dashpots, precompression and unlike beads: the contact finite element analysis against closed forms and the chain.

use crate::fea_bench::{finish, mean_velocities, run, scene, still, thrown};
use granchain::{
    model::{
        analytical::Collision,
        chain::ChainModel,
        contact_law::{Dashpot, bead_pair_stiffness},
        fea::{Control, Simulation},
    },
    scene::{DampingTerm, ModelKind, Scene},
    signal::Series,
};

/// Two beads far from piston and support.
fn pair(overrides: &[&str]) -> Scene {
    let own = ["chain.beads=2", "chain.gaps={contact1=\"50 um\", contact3=\"50 um\"}", "duration=8 us"];
    scene("rigid", &[&own[..], overrides].concat())
}

/// A collision of masses m_r under F = k δ^1.5 (1 + c₁ √δ + c₂ δ), δ in m: (duration, largest force).
fn corrected_collision(collision: &Collision, (c1, c2): (f64, f64)) -> (f64, f64) {
    let Collision { reduced_mass: mass, hertz_stiffness: k, speed } = *collision;
    let energy = |d: f64| k * d.powf(2.5) * (1.0 / 2.5 + c1 * d.sqrt() / 3.0 + c2 * d / 3.5);
    let kinetic = 0.5 * mass * speed * speed;
    let (mut low, mut high) = (0.0, 2.0 * collision.largest_overlap());
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        *(if energy(middle) < kinetic { &mut low } else { &mut high }) = middle;
    }
    let largest = 0.5 * (low + high);
    // T = 2 ∫ dδ/√(v² − 2U/m), with δ = δ_max (1 − s²) to take the root out of the end.
    let n = 20_000;
    let sum: f64 = (0..n)
        .map(|i| {
            let s = (f64::from(i) + 0.5) / f64::from(n);
            let d = largest * (1.0 - s * s);
            2.0 * largest * s / (speed * speed - 2.0 * energy(d) / mass).sqrt()
        })
        .sum();
    (2.0 * sum / f64::from(n), k * largest.powf(1.5) * (1.0 + c1 * largest.sqrt() + c2 * largest))
}

/// Time between the first and the last sample with a force, s, and the largest force, N.
fn contact(force: &Series) -> (f64, f64) {
    let first = force.values.iter().position(|&f| f > 0.0).unwrap();
    let last = force.values.iter().rposition(|&f| f > 0.0).unwrap();
    ((last - first + 1) as f64 * force.step, force.peak())
}

/// One-sided with inertia relief, F/F_H − 1 = 0.0249 √(δ/µm) + 0.0024 δ/µm: c₁ in m^-½, c₂ in 1/m.
const FINITE_BODY: (f64, f64) = (0.0249e3, 0.0024e6);

#[test]
fn two_spheres_collide_as_hertz_says_with_the_correction_for_finite_bodies() {
    // Force: 0.4 % of a mesh of density 12 above 0.3 µm of overlap, 0.8 % below. It is 0.04 % at density 16.
    for (speed, force_error) in [(0.1, 8e-3), (0.4, 4e-3)] {
        let scene = pair(&["output_step=0.01 us", "model.step=0.01 us", "duration=6 us"]);
        let mut simulation = thrown(&scene, 1, speed);
        let response = finish(&mut simulation).unwrap();
        let (duration, force) = contact(&response.contact_force[1]);
        let beads = &scene.chain.beads;
        let reduced_mass = 0.5 * beads[0].mass();
        let hertz = Collision { reduced_mass, hertz_stiffness: bead_pair_stiffness(&beads[0], &beads[1]), speed };
        let (expected_duration, expected_force) = corrected_collision(&hertz, FINITE_BODY);
        assert!((force / expected_force - 1.0).abs() < force_error, "{speed}: {force} {expected_force}");
        // A sample at either end.
        assert!((duration - expected_duration).abs() < 0.02e-6, "{speed}: {duration:e} {expected_duration:e}");
        // And it is not the collision of Hertz: 0.7 to 1.3 % harder.
        let harder = expected_force / hertz.largest_force() - 1.0;
        assert!((0.004..0.02).contains(&harder) && force > hertz.largest_force(), "{speed}: {harder}");
        // Equal masses swap their velocities.
        let velocities = mean_velocities(&simulation);
        assert!(velocities[0].abs() < 1e-4 * speed && (velocities[1] / speed - 1.0).abs() < 1e-4, "{velocities:?}");
    }
}

/// Restitution of a collision m_r δ̈ = −F with the corrected law and a dashpot (c + γ √δ) δ̇ that pulls or not.
fn restitution(collision: &Collision, (c1, c2): (f64, f64), dashpot: Dashpot, tension: bool) -> f64 {
    let Collision { reduced_mass: mass, hertz_stiffness: k, speed } = *collision;
    let acceleration = |d: f64, v: f64| {
        let elastic = k * d.max(0.0).powf(1.5) * (1.0 + c1 * d.max(0.0).sqrt() + c2 * d.max(0.0));
        let force = elastic + dashpot.force(d, v);
        -(if tension { force } else { force.max(0.0) }) / mass
    };
    let h = collision.duration() / 20_000.0;
    let (mut d, mut v) = (0.0, speed);
    loop {
        let (d1, v1) = (v, acceleration(d, v));
        let (d2, v2) = (v + 0.5 * h * v1, acceleration(d + 0.5 * h * d1, v + 0.5 * h * v1));
        let (d3, v3) = (v + 0.5 * h * v2, acceleration(d + 0.5 * h * d2, v + 0.5 * h * v2));
        let (d4, v4) = (v + h * v3, acceleration(d + h * d3, v + h * v3));
        d += h / 6.0 * (d1 + 2.0 * (d2 + d3) + d4);
        v += h / 6.0 * (v1 + 2.0 * (v2 + v3) + v4);
        if d <= 0.0 {
            return -v / speed;
        }
    }
}

#[test]
fn dashpots_brake_a_collision_of_two_beads_as_their_equation_says() {
    // c, γ, tension and the restitution of Hertz beads at 0.1, 0.4586725274 and 1 m/s.
    let table = [
        (0.3, 0.0, false, [0.6992526840, 0.7647016513, 0.7935398759]),
        (0.3, 0.0, true, [0.6614454782, 0.7404949014, 0.7743911587]),
        (0.0, 3660.0, false, [0.3815329023, 0.2964321838, 0.2563474919]),
    ];
    for (linear, kuwabara_kono, tension, hertzian) in table {
        for (speed, hertzian) in [0.1, 0.4586725274, 1.0].into_iter().zip(hertzian) {
            let kind = if linear > 0.0 { "linear" } else { "kuwabara-kono" };
            let kind =
                format!("damping={{kind=\"{kind}\", coefficient={}, tension={tension}}}", linear + kuwabara_kono);
            let scene = pair(&["model.mesh_density=6", "model.step=0.02 us", "duration=9 us", &kind]);
            let mut simulation = thrown(&scene, 1, speed);
            finish(&mut simulation).unwrap();
            let velocities = mean_velocities(&simulation);
            let found = (velocities[1] - velocities[0]) / speed;

            let beads = &scene.chain.beads;
            let reduced_mass = 0.5 * beads[0].mass();
            let hertz = Collision { reduced_mass, hertz_stiffness: bead_pair_stiffness(&beads[0], &beads[1]), speed };
            let terms = [(DampingTerm::Linear, linear), (DampingTerm::KuwabaraKono, kuwabara_kono)];
            let dashpot = Dashpot { coefficients: terms.into() };
            let check = restitution(&hertz, (0.0, 0.0), dashpot, tension);
            assert!((check - hertzian).abs() < 1e-5, "{check} {hertzian}");
            let expected = restitution(&hertz, FINITE_BODY, dashpot, tension);
            // 0.1 to 0.2 % at this coarse mesh; without the correction it is 0.3 to 0.8 %.
            assert!((found - expected).abs() < 2.5e-3, "{kind} {speed}: {found} {expected}");
        }
    }
}

#[test]
fn a_precompressed_chain_stays_at_rest_under_its_force() {
    for (name, more) in
        [("rigid", "support.kind=rigid"), ("annulus", "alpha=1"), ("rigid", "support={kind=\"spring\", stiffness=1e6}")]
    {
        let scene = scene(name, &["model.mesh_density=4", "duration=20 us", "chain.precompression=0.5 N", more]);
        let mut simulation = Simulation::with_motion(&scene, still(), Control::default()).unwrap();
        let response = finish(&mut simulation).unwrap();
        let v = response.bead_velocity.iter().map(Series::peak).fold(0.0, f64::max);
        let f = response.contact_force.iter().flat_map(|s| &s.values).fold(0.0, |m: f64, f| m.max((f - 0.5).abs()));
        // Rounding of the equilibrium's own iteration, 1e-13 of 0.5 N, and the velocity it gives in a step.
        assert!(v < 1e-12 && f < 1e-11, "{name} {more}: {v:e} {f:e}");
        assert!(response.energy.stored_j > 4e-7 && response.energy.kinetic_j < 1e-30);
    }
}

/// F/F_H of contacts between beads at the given overlap (m). A bead on a flat has the same factor under the same force.
fn finite_body(overlap: f64) -> f64 {
    1.0 + FINITE_BODY.0 * overlap.sqrt() + FINITE_BODY.1 * overlap
}

/// Velocities of the chain with all contacts stiffer by a factor.
fn chain(scene: &Scene, factor: f64) -> Vec<Series> {
    let mut scene = scene.clone();
    scene.model.kind = ModelKind::Chain;
    for bead in &mut scene.chain.beads {
        bead.material.youngs_modulus *= factor;
    }
    ChainModel.run(&scene, &mut |_| true).unwrap().bead_velocity
}

/// Moving average over 0.4 µs.
fn smooth(series: &Series) -> Vec<f64> {
    let half = (0.2e-6 / series.step).round() as usize;
    (0..series.len())
        .map(|i| {
            let window = &series.values[i.saturating_sub(half)..(i + half + 1).min(series.len())];
            window.iter().sum::<f64>() / window.len() as f64
        })
        .collect()
}

/// Largest error of any bead's velocity (rms over that of the chain's, both filtered), and that of bead 1.
fn errors(scene: &Scene, found: &[Series], factor: f64) -> (f64, f64) {
    let errors: Vec<f64> = found
        .iter()
        .zip(&chain(scene, factor))
        .map(|(a, b)| {
            let (a, b) = (smooth(a), smooth(b));
            let power: f64 = b.iter().map(|b| b * b).sum();
            (a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / power).sqrt()
        })
        .collect();
    (errors.iter().copied().fold(0.0, f64::max), errors[0])
}

#[test]
fn equal_and_unlike_beads_move_as_in_a_chain_of_finite_bodies() {
    let cases: [(&[&str], usize, f64); 3] = [
        (&["chain.beads=6"], 1, 0.04),
        // One factor for all contacts is a coarser guess where the overlaps differ from bead to bead.
        (&["chain.override=[{bead=3, radius=\"0.6 mm\"}]"], 2, 0.08),
        (
            &[
                "chain.override=[{bead=3, material=\"aluminium\"}]",
                "materials.aluminium={youngs_modulus=\"70 GPa\", poissons_ratio=0.33, density=\"2700 kg/m^3\"}",
            ],
            2,
            0.09,
        ),
    ];
    for (case, kinds, tolerance) in cases {
        let scene = scene("rigid", &[&["model.mesh_density=8", "model.step=0.05 us", "duration=30 us"], case].concat());
        let (simulation, response) = run(&scene);
        assert_eq!(simulation.arrangement().kinds.len(), kinds);
        let (worst, _) = errors(&scene, &response.bead_velocity, finite_body(0.5e-6));
        assert!(worst < tolerance, "{case:?}: {worst}");
        if kinds == 1 {
            // What the factor explains: the first bead of the plain chain is 17 % off.
            let (_, plain) = errors(&scene, &response.bead_velocity, 1.0);
            assert!(plain > 0.1, "{plain}");
        }
    }
}

#[test]
fn a_bead_on_a_soft_spring_swings_for_half_a_period() {
    let (stiffness, speed): (f64, f64) = (1e4, 0.1);
    let overrides = [
        "chain.beads=1",
        "chain.gaps={contact1=\"10 um\"}",
        "support={kind=\"spring\", stiffness=\"1e4 N/m\"}",
        "model.mesh_density=4",
        "duration=80 us",
    ];
    let mut simulation = thrown(&scene("rigid", &overrides), 1, speed);
    let mass = simulation.arrangement().kinds[0].total_mass();
    let response = finish(&mut simulation).unwrap();
    let (duration, force) = contact(&response.contact_force[1]);
    // π √(m/K) and v √(m K); the contact in series gives way by 1 % as much as the spring.
    let expected = std::f64::consts::PI * (mass / stiffness).sqrt();
    assert!(duration > expected && duration < 1.015 * expected, "{duration:e} {expected:e}");
    let expected = speed * (mass * stiffness).sqrt();
    assert!(force < expected && force > 0.985 * expected, "{force} {expected}");
    assert!(simulation.balance().balance() < 1e-4, "{:e}", simulation.balance().balance());
}
