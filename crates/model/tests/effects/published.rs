//! Published chains of beads under a striker. Tolerances were set before the runs; each row names its source.

use super::impact::{crest, row, run};
use granchain_model::{
    analytical::{
        DISCRETE_SPEED_FACTOR, NESTERENKO_SPEED_FACTOR, nesterenko_speed_at_force, nesterenko_width,
        solitary_wave_speed,
    },
    chain::{ChainModel, InitialState},
    contact_law::bead_pair_stiffness,
    response::Response,
    scene::{DriveKind, FlatContact, Scene, Support},
};

/// Beads of a published chain: N, diameter (mm), E (GPa), ν, ρ (kg/m³), velocity of an equal striker (m/s).
fn beads(count: usize, diameter: f64, [modulus, ratio, density]: [f64; 3], velocity: f64) -> Scene {
    let sets = [
        format!("chain.beads={count}"),
        format!("chain.radius={} mm", 0.5 * diameter),
        format!("materials.bearing-steel.youngs_modulus={modulus} GPa"),
        format!("materials.bearing-steel.poissons_ratio={ratio}"),
        format!("materials.bearing-steel.density={density}"),
        format!("drive.velocity={velocity}"),
        "output_step=0.1 us".into(),
        "chain.sensor=1".into(),
    ];
    let mut all: Vec<&str> = sets.iter().map(String::as_str).collect();
    all.push("duration=1 ms");
    row(&all)
}

/// Steel of Lazaridi and Nesterenko, and the stainless steel of Daraio and others.
const STEEL: [f64; 3] = [200.0, 0.29, 7800.0];
const STAINLESS: [f64; 3] = [193.0, 0.3, 8000.0];

/// Speed of the pulse between two beads (m/s), the largest velocity of the second (m/s), and the largest force of the contact behind it (N).
fn pulse(scene: &Scene, response: &Response, [from, to]: [usize; 2]) -> (f64, f64, f64) {
    let at = |bead: usize| crest(&response.bead_velocity[bead - 1]);
    let distance = (to - from) as f64 * 2.0 * scene.chain.beads[0].radius;
    (distance / (at(to).0 - at(from).0), at(to).1, crest(&response.contact_force[to]).1)
}

fn constants(scene: &Scene) -> (f64, f64, f64) {
    let bead = &scene.chain.beads[0];
    (bead.radius, bead.mass(), bead_pair_stiffness(bead, bead))
}

/// Lazaridi and Nesterenko (1985), *J. Appl. Mech. Tech. Phys.* 26, 405: twenty steel balls of 4.75 mm, struck at 0.5 m/s. Held against the closed form
/// that their experiment confirms, V = 2a (4/5)^(2/5) (k/m)^(2/5) v^(1/5): within 2 %, the long-wave limit for a wave of five diameters.
#[test]
fn lazaridi_and_nesterenko_s_row_has_nesterenko_s_speed_and_width() {
    let scene = beads(20, 4.75, STEEL, 0.5);
    let response = run(&scene);
    let (speed, velocity, _) = pulse(&scene, &response, [10, 16]);
    let (radius, mass, stiffness) = constants(&scene);
    let of = |factor| solitary_wave_speed(factor, radius, mass, stiffness, velocity);
    assert!((speed / of(NESTERENKO_SPEED_FACTOR) - 1.0).abs() < 0.02, "{speed} {}", of(NESTERENKO_SPEED_FACTOR));
    // The discrete wave itself, formed to a thousandth after ten beads.
    assert!((speed / of(DISCRETE_SPEED_FACTOR) - 1.0).abs() < 1e-3, "{speed} {}", of(DISCRETE_SPEED_FACTOR));
    // Five diameters from foot to foot: above a thousandth of the crest within a diameter of that.
    let force = &response.contact_force[13];
    let above = force.values.iter().filter(|value| **value > 1e-3 * force.peak()).count() as f64;
    let width = above * force.step * speed / (2.0 * radius);
    assert!((width - nesterenko_width(0.5)).abs() < 1.0, "{width}");
}

/// Hinch and Saint-Jean (1999), *Proc. R. Soc. Lond. A* 455, 3201: struck by one equal ball of velocity V, the wave has a largest velocity of 0.682 V. Printed
/// to three digits: within half a unit of the last.
#[test]
fn hinch_and_saint_jean_s_pulse_has_their_velocity() {
    let scene = beads(60, 4.75, STEEL, 0.5);
    let (_, velocity, _) = pulse(&scene, &run(&scene), [30, 40]);
    assert!((velocity / 0.5 - 0.682).abs() < 5e-4, "{}", velocity / 0.5);
}

/// Daraio, Nesterenko, Herbold and Jin (2005), *Phys. Rev. E* 72, 016603: stainless steel beads of 4.76 mm. Held against their formula
/// V = 0.6802 (2E/(d ρ^(3/2) (1 − ν²)))^(1/3) F^(1/6), the printed constant within 2 % (long-wave limit), at peak forces from 1 to 100 N.
#[test]
fn daraio_s_speeds_belong_to_their_peak_forces() {
    let mut last: Option<(f64, f64)> = None;
    for velocity in [0.03, 0.2, 1.2] {
        let scene = beads(30, 4.76, STAINLESS, velocity);
        let (speed, _, force) = pulse(&scene, &run(&scene), [15, 22]);
        let [modulus, ratio, density] = STAINLESS;
        let bracket = 2e9 * modulus / (4.76e-3 * density.powf(1.5) * (1.0 - ratio * ratio));
        let printed = 0.6802 * bracket.cbrt() * force.powf(1.0 / 6.0);
        assert!((speed / printed - 1.0).abs() < 0.02, "{force} N: {speed} {printed}");
        let (radius, mass, stiffness) = constants(&scene);
        // The printed constant has four digits.
        assert!((nesterenko_speed_at_force(radius, mass, stiffness, force, 0.0) / printed - 1.0).abs() < 1e-4);
        if let Some((slower, weaker)) = last {
            // Similarity: no tolerance but the integrator's and the parabola's.
            let power = (speed / slower).ln() / (force / weaker).ln();
            assert!((power - 1.0 / 6.0).abs() < 1e-4, "{power}");
        }
        last = Some((speed, force));
    }
}

/// Coste, Falcon and Fauve (1997), *Phys. Rev. E* 56, 6104: speed against peak force, without and with a static force. Held against the closed form that
/// their measurements confirm (long-wave limit, within 2 %), for peak forces of 1.6, 8 and 34 times the static one. Beads of steel; their own modulus is not used.
#[test]
fn coste_s_compressed_chain_has_the_speed_of_its_peak_force() {
    for (velocity, ratio, duration) in [(0.05, 1.6, 2.0e-3), (0.2, 8.0, 1.7e-3), (0.6, 33.0, 1.4e-3)] {
        let mut scene = beads(120, 8.0, STEEL, 1.0);
        // A pressed row has no striker: a rigid piston that rests, and a first bead that is thrown.
        scene.drive.kind = DriveKind::SineCycles { cycles: 1.0 };
        (scene.amplitude_scale, scene.support, scene.piston) =
            (0.0, Support::Flat(FlatContact::Rigid), FlatContact::Rigid);
        (scene.chain.precompression, scene.chain.sensor, scene.duration) = (2.0, None, duration);
        let mut thrown = InitialState::at_rest(120);
        thrown.velocities[0] = velocity;
        let response = ChainModel.run_from(&scene, &thrown, &mut |_| true).unwrap();
        let (speed, _, force) = pulse(&scene, &response, [70, 90]);
        let (radius, mass, stiffness) = constants(&scene);
        let expected = nesterenko_speed_at_force(radius, mass, stiffness, force, 2.0);
        assert!(force / 2.0 > ratio, "{force}");
        assert!((speed / expected - 1.0).abs() < 0.02, "{} F₀: {speed} {expected}", force / 2.0);
    }
}

/// Job, Melo, Sokolow and Sen (2005), *Phys. Rev. Lett.* 94, 178002: a pulse before a wall. No number is printed here. A rigid wall is held against what it
/// is by symmetry, the head-on collision with an equal pulse; and the softer the wall, the later and the weaker the pulse returns, which they report.
#[test]
fn job_s_wall_returns_a_pulse_as_its_mirror_image_and_a_soft_one_later_and_weaker() {
    let wall = |support: Support| {
        let mut scene = beads(20, 26.0, STEEL, 0.3);
        (scene.support, scene.duration, scene.output_step) = (support, 4e-3, 1e-6);
        run(&scene)
    };
    let rigid = wall(Support::Flat(FlatContact::Rigid));
    // With its image: forty beads, a striker at either end.
    let mut scene = beads(41, 26.0, STEEL, 0.3);
    (scene.support, scene.duration, scene.output_step) = (Support::Free, 4e-3, 1e-6);
    let mut both = InitialState::at_rest(41);
    both.velocities[40] = -0.3;
    let image = ChainModel.run_from(&scene, &both, &mut |_| true).unwrap();
    for (one, other) in rigid.bead_velocity.iter().zip(&image.bead_velocity) {
        let apart = one.values.iter().zip(&other.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Two runs of other steps; separations of beads amplify their difference.
        assert!(apart < 1e-7 * one.peak(), "{apart:e}");
    }
    let returned = |response: &Response| {
        let incident = crest(&response.contact_force[14]);
        let index = ((incident.0 + 0.3e-3) / 1e-6) as usize;
        let mut behind = response.contact_force[14].clone();
        behind.values[..index].fill(0.0);
        (crest(&behind).0 - incident.0, crest(&behind).1 / incident.1)
    };
    let of = |modulus: f64| {
        let support = Support::Foundation { youngs_modulus: modulus, poissons_ratio: 0.3, loss_time: 0.0, plate: None };
        returned(&wall(support))
    };
    let walls = [returned(&rigid), of(200e9), of(20e9), of(2e9)];
    assert!(walls.windows(2).all(|pair| pair[1].0 > 1.02 * pair[0].0), "{walls:?}");
    assert!(walls[3].1 < 0.98 * walls[0].1, "{walls:?}");
}

/// Chung and Ooi (2011), *Granular Matter* 13, 643, tests 1 and 2: two equal spheres that approach at 10 m/s each, and a sphere against a rigid plane at
/// 0.2 m/s, which moves as one of two mirror images. Held against Hertz' solution, written out here: force to 1e-5, duration to 1e-4 (samples).
#[test]
fn chung_and_ooi_s_normal_impacts_have_hertz_s_force_and_duration() {
    // E (GPa), ν, ρ (kg/m³): glass, limestone; aluminium and magnesium alloy. Radius, m, and speed of each sphere, m/s.
    for ([modulus, ratio, density], radius, speed) in [
        ([48.0, 0.2, 2800.0], 0.01, 10.0),
        ([20.0, 0.25, 2500.0], 0.01, 10.0),
        ([70.0, 0.3, 2699.0], 0.1, 0.2),
        ([40.0, 0.35, 1800.0], 0.1, 0.2),
    ] {
        let approach: f64 = 2.0 * speed;
        let mass = 4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius * density;
        // 4/3 E* √R* with E* = E/(2 (1 − ν²)) and R* = R/2; the reduced mass is half of one.
        let stiffness = 2.0 / 3.0 * modulus * 1e9 / (1.0 - ratio * ratio) * (0.5 * radius).sqrt();
        let overlap = (1.25 * 0.5 * mass * approach * approach / stiffness).powf(0.4);
        let (force, duration) = (stiffness * overlap.powf(1.5), 2.943_275 * overlap / approach);
        let mut scene = beads(1, 2e3 * radius, [modulus, ratio, density], approach);
        (scene.duration, scene.output_step) = (1.5 * duration, 1e-4 * duration);
        let response = run(&scene);
        let (_, highest) = crest(&response.contact_force[0]);
        let pressed = response.contact_force[0].values.iter().filter(|value| **value > 0.0).count() as f64;
        assert!((highest / force - 1.0).abs() < 1e-5, "{modulus} GPa: {highest} {force}");
        let lasted = pressed * scene.output_step;
        assert!((lasted / duration - 1.0).abs() < 2e-4, "{modulus} GPa: {lasted} {duration}");
    }
}
