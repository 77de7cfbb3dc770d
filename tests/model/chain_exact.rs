//! Exact numbers of the discrete chain: steel beads of 1 mm against closed forms and independently computed tables.

use std::f64::consts::PI;

use super::continuous::Continuous;
use granchain::{
    model::{
        analytical::{Collision, DISCRETE_SPEED_FACTOR, cutoff_frequency, mode_frequency, solitary_wave_speed},
        contact_law::bead_pair_stiffness,
    },
    scene::{
        Bead, Chain, ContactLaw, Damping, DampingCoefficients, DampingKind, DampingPlacement, DampingTerm, Drive,
        DriveKind, FlatContact, Integrator, Material, MaterialLoss, ModelSettings, Scene, Support,
    },
};

fn bead() -> Bead {
    Bead::sphere(0.5e-3, Material::chrome_steel())
}

fn undamped() -> Damping {
    Damping {
        kind: DampingKind::None,
        coefficients: DampingCoefficients::default(),
        placement: DampingPlacement::All,
        tension: false,
    }
}

/// Six beads between rigid flats, five cycles of 73 kHz, 1 µm, 120 µs.
fn rigid(tolerance: f64) -> Scene {
    Scene {
        name: "rigid".into(),
        description: String::new(),
        chain: Chain { beads: vec![bead(); 6], gaps: vec![0.0; 7], precompression: 0.0, gravity: 0.0, sensor: None },
        piston: FlatContact::Rigid,
        piston_material: None,
        drive: Drive { kind: DriveKind::SineCycles { cycles: 5.0 }, amplitude: 1e-6, frequency: 73e3 },
        amplitude_scale: 1.0,
        support: Support::Flat(FlatContact::Rigid),
        water: None,
        damping: undamped(),
        contact_law: ContactLaw::Hertz,
        yield_strength: None,
        horn: None,
        holder: None,
        loss: MaterialLoss::default(),
        duration: 120e-6,
        output_step: 1e-7,
        vibrometer_bandwidth: 1.5e6,
        model: ModelSettings::chain(Integrator::DormandPrince853 { tolerance }),
    }
}

/// Touching beads in free space: no piston, no support.
fn free(beads: usize, damping: Damping, duration: f64) -> Scene {
    let mut scene = rigid(1e-12);
    scene.chain.beads = vec![bead(); beads];
    scene.chain.gaps = vec![0.0; beads + 1];
    scene.chain.gaps[0] = f64::INFINITY;
    scene.chain.gaps[beads] = f64::INFINITY;
    scene.damping = damping;
    scene.amplitude_scale = 0.0;
    scene.duration = duration;
    scene
}

/// Relative speed after over before a head-on collision of two beads.
fn restitution(damping: Damping, speed: f64) -> f64 {
    let scene = free(2, damping, 40e-6);
    let after = Continuous::run(&scene, vec![speed, 0.0], 1e-7);
    (after.velocity(1, scene.duration) - after.velocity(0, scene.duration)) / speed
}

fn assert_relative(found: f64, expected: f64, tolerance: f64, what: &str) {
    let error = (found / expected - 1.0).abs();
    assert!(error < tolerance, "{what}: found {found:.12e}, expected {expected:.12e}, relative error {error:.1e}");
}

#[test]
fn the_rigid_scene_has_the_tabulated_extremes_and_samples() {
    let run = Continuous::run(&rigid(1e-12), vec![0.0; 6], 1e-8);
    // The table ends at 70 µs, where waveforms of the undamped chain are still reproducible; 1e-8 m/s is its tolerance.
    let (time, value) = run.extreme_velocity(5, 1.0, 70e-6);
    assert!((value - 0.683_176_961).abs() < 1e-8 && (time - 63.580_54e-6).abs() < 1e-10, "{value:.9} at {time:e}");
    let (time, value) = run.extreme_velocity(5, -1.0, 70e-6);
    assert!((value + 0.705_301_767).abs() < 1e-8 && (time - 65.660_61e-6).abs() < 1e-10, "{value:.9} at {time:e}");
    for (time, expected) in [(10e-6, 0.336_428_016_202), (40e-6, -0.061_424_596_604), (68e-6, 0.026_901_201_869)] {
        let value = run.velocity(5, time);
        assert!((value - expected).abs() < 1e-8, "{value:.12} at {time:e}, expected {expected}");
    }
}

#[test]
fn an_undamped_collision_lasts_presses_and_pushes_as_hertz_says() {
    let speed = 0.1;
    let scene = free(2, undamped(), 10e-6);
    let collision =
        Collision { reduced_mass: bead().mass() / 2.0, hertz_stiffness: bead_pair_stiffness(&bead(), &bead()), speed };
    let collided = Continuous::run(&scene, vec![speed, 0.0], 1e-9);
    let overlap = |time: f64| collided.displacement(0, time) - collided.displacement(1, time);
    // Largest overlap at half the duration, by symmetry; separation at the duration: the overlap changes sign there.
    let duration = collision.duration();
    assert_relative(duration, 4.847_749_96e-6, 1e-8, "duration, closed form");
    assert_relative(overlap(duration / 2.0), 0.164_705_97e-6, 1e-6, "largest overlap");
    assert_relative(overlap(duration / 2.0), collision.largest_overlap(), 1e-10, "largest overlap, closed form");
    assert!(overlap(duration * (1.0 - 1e-6)) > 0.0 && overlap(duration * (1.0 + 1e-6)) < 0.0, "duration");
    let force = collision.hertz_stiffness * overlap(duration / 2.0).powf(1.5);
    assert_relative(force, 0.155_631_472, 1e-6, "largest force");
    // Equal beads exchange their velocities.
    assert!(collided.velocity(0, 10e-6).abs() < 1e-10 * speed);
    assert_relative(collided.velocity(1, 10e-6), speed, 1e-10, "velocity handed over");
}

#[test]
fn restitution_of_a_bead_pair_is_as_tabulated() {
    let linear = |tension| Damping {
        kind: DampingKind::Linear,
        coefficients: [(DampingTerm::Linear, 0.3)].into(),
        tension,
        ..undamped()
    };
    let kuwabara_kono = Damping {
        kind: DampingKind::KuwabaraKono,
        coefficients: [(DampingTerm::KuwabaraKono, 3660.0)].into(),
        ..undamped()
    };
    let table = [
        (0.1, 0.699_252_684_0, 0.661_445_478_2, 0.381_532_902_3),
        (0.458_672_527_4, 0.764_701_651_3, 0.740_494_901_4, 0.296_432_183_8),
        (1.0, 0.793_539_875_9, 0.774_391_158_7, 0.256_347_491_9),
    ];
    for (speed, clipped, unclipped, viscoelastic) in table {
        // The table's own tolerance, 1e-6; it carries ten digits.
        assert_relative(restitution(linear(false), speed), clipped, 1e-6, "linear, clipped");
        assert_relative(restitution(linear(true), speed), unclipped, 1e-6, "linear, unclipped");
        assert_relative(restitution(kuwabara_kono, speed), viscoelastic, 1e-6, "Kuwabara–Kono, clipped");
    }
}

#[test]
fn a_cradle_of_three_does_not_simply_hand_over_the_velocity() {
    let cradle = Continuous::run(&free(3, undamped(), 60e-6), vec![0.1, 0.0, 0.0], 1e-7);
    for (bead, expected) in [-0.070_952_354, 0.076_403_039, 0.994_549_315].into_iter().enumerate() {
        let found = cradle.velocity(bead, 60e-6) / 0.1;
        // The table's own tolerance; it carries nine decimals.
        assert!((found - expected).abs() < 1e-8, "bead {}: {found:.10}, expected {expected}", bead + 1);
    }
}

#[test]
fn small_motions_of_the_precompressed_chain_have_the_tabulated_frequencies() {
    let table = [66_034.832_885, 127_569.501_036, 180_410.518_510, 220_956.857_291, 246_445.351_395, 255_139.002_072];
    let cutoff = cutoff_frequency(bead().mass(), bead_pair_stiffness(&bead(), &bead()), 1.0);
    assert_relative(cutoff, 255_139.002_072, 1e-9, "cut-off");
    let mut scene = rigid(1e-10);
    scene.chain.precompression = 1.0;
    scene.amplitude_scale = 0.0;
    scene.duration = 400e-6;
    for (index, expected) in table.into_iter().enumerate() {
        assert_relative(mode_frequency(cutoff, index + 1, 6), expected, 1e-9, "closed form");
        // One mode alone: cosine with antinodes half a spacing outside the end beads, with signs opposite at the two flats' images.
        let shape: Vec<f64> =
            (0..6).map(|bead| ((f64::from(bead) + 0.5) * (index + 1) as f64 * PI / 6.0).sin()).collect();
        let motion = Continuous::run(&scene, shape.iter().map(|value| 1e-5 * value).collect(), 1e-7);
        let found = motion.frequency(&shape, expected, 400e-6);
        // Amplitude: overlap 1e-11 m of 0.57 µm, so the quadratic frequency shift is of order (2e-5)² ≈ 1e-9.
        assert_relative(found, expected, 1e-6, "small-amplitude run");
    }
}

#[test]
fn a_solitary_wave_through_two_hundred_beads_has_the_discrete_speed() {
    let beads = 200;
    let mut scene = free(beads, undamped(), 460e-6);
    scene.model.integrator = Integrator::DormandPrince853 { tolerance: 1e-11 };
    let mut velocities = vec![0.0; beads];
    velocities[0] = 0.1;
    let wave = Continuous::run(&scene, velocities, 5e-8);
    // Far from the struck end the leading pulse has left its followers behind; peaks of two beads give its speed.
    let peak = |bead: usize| wave.extreme_velocity(bead, 1.0, 460e-6);
    let ((from, velocity), (to, later)) = (peak(120), peak(170));
    assert_relative(later, velocity, 1e-8, "the pulse keeps its height");
    let speed = 50.0 * 1e-3 / (to - from);
    let stiffness = bead_pair_stiffness(&bead(), &bead());
    let expected = solitary_wave_speed(DISCRETE_SPEED_FACTOR, 0.5e-3, bead().mass(), stiffness, velocity);
    assert_relative(speed, expected, 1e-6, "solitary-wave speed");
    let tabulated = solitary_wave_speed(DISCRETE_SPEED_FACTOR, 0.5e-3, bead().mass(), stiffness, 0.1);
    assert_relative(tabulated, 456.535_947, 1e-8, "speed at 0.1 m/s");
}

#[test]
fn uncompressed_pulse_speed_scales_as_velocity_to_one_fifth() {
    let speed = |velocity: f64| {
        let mut scene = free(40, undamped(), 90e-6 * (0.1 / velocity).powf(0.2));
        scene.model.integrator = Integrator::DormandPrince853 { tolerance: 1e-10 };
        let mut velocities = vec![0.0; 40];
        velocities[0] = velocity;
        let wave = Continuous::run(&scene, velocities, scene.duration / 2048.0);
        let peak = |bead: usize| wave.extreme_velocity(bead, 1.0, scene.duration).0;
        1.0 / (peak(30) - peak(20))
    };
    // The law is an exact similarity of the equations; what is left is the integrator's error.
    assert!(((speed(3.2) / speed(0.1)).log(32.0) - 0.2).abs() < 1e-7);
}
