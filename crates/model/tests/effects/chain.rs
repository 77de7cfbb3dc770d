//! Effects of the chain beside contacts and dashpots, against closed forms.

use std::f64::consts::PI;

use granchain_model::{
    ModelError,
    chain::{ChainModel, InitialState},
    contact_law::{Annulus, ElasticLaw, Yielding, bead_flat_stiffness, hertz_force},
    response::{Channels, ObservedPoint, Response},
    scene::{self, FlatContact, Holder, Horn, Scene, Support},
};
use granchain_signal::Series;
use nalgebra::Complex;

fn load(base: &str, overrides: &[&str]) -> Scene {
    let all: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    scene::load(base, &all).unwrap()
}

fn at_rest(scene: &Scene) -> Response {
    run(scene, &InitialState::at_rest(scene.chain.beads.len()))
}

fn run(scene: &Scene, initial: &InitialState) -> Response {
    let response = ChainModel.run_from(scene, initial, &mut |_| true).unwrap();
    let energy = &response.energy;
    // Every run of this file closes its books, those of the horn too: the integrator's tolerance, 1e-10 of its velocity scale.
    let scale = energy.largest_j.max(energy.piston_work_j.abs());
    assert!(energy.residual_j.abs() <= 1e-7 * scale, "{energy:?}");
    if let Some(channels) = energy.channels.filter(|_| scene.horn.is_some()) {
        let scale = scale.max(channels.source_work_j.abs()).max(channels.horn_j);
        assert!(channels.horn_residual(energy.piston_work_j).abs() <= 1e-7 * scale, "{energy:?}");
    }
    response
}

fn channels(response: &Response) -> Channels {
    response.energy.channels.unwrap()
}

/// One bead that flies, nothing around it unless a test puts it there.
fn flying(overrides: &[&str]) -> Scene {
    let base = ["support.kind=free", "chain.beads=1", "damping.kind=none", "drive.cycles=1", "model.tolerance=1e-12"];
    let mut scene = load("rigid", &[&base, overrides].concat());
    scene.amplitude_scale = 0.0;
    scene
}

fn thrown(velocity: f64) -> InitialState {
    InitialState { displacements: vec![0.0], velocities: vec![velocity] }
}

/// Value of a series at `time` (s), which is a sample.
fn at(series: &Series, time: f64) -> f64 {
    series.values[(time / series.step).round() as usize]
}

/// Complex amplitude of a series over its last `cycles` cycles of f (Hz).
fn line(series: &Series, f: f64, cycles: f64) -> (f64, f64) {
    let count = (cycles / f / series.step).round() as usize;
    let first = series.values.len() - 1 - count;
    let (mut cosine, mut sine) = (0.0, 0.0);
    let mean = series.values[first..first + count].iter().sum::<f64>() / count as f64;
    for i in first..first + count {
        let phase = 2.0 * PI * f * series.time(i);
        cosine += (series.values[i] - mean) * phase.cos();
        sine += (series.values[i] - mean) * phase.sin();
    }
    // Of Re(A e^{iωt}).
    (2.0 * cosine / count as f64, -2.0 * sine / count as f64)
}

#[test]
fn a_horn_of_a_thousand_tonnes_moves_as_prescribed() {
    for base in ["rigid", "annulus"] {
        let scene = load(base, &["model.kind=chain", "duration=70 us"]);
        let heavy = Scene { horn: Some(Horn { mass: 1e6, frequency: 73e3, quality: 500.0 }), ..scene.clone() };
        let (prescribed, heavy) = (at_rest(&scene), at_rest(&heavy));
        let difference = |a: &Series, b: &Series| {
            a.values.iter().zip(&b.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / b.peak()
        };
        // q is of the order F t²/2M = 1e-15 m; the undamped chain amplifies it.
        let velocity = difference(&heavy.pole_velocity, &prescribed.pole_velocity);
        assert!(velocity < 1e-6, "{base}: {velocity:e}");
        assert!(difference(&heavy.piston_displacement, &prescribed.piston_displacement) < 1e-8);
        assert_eq!(prescribed.energy.channels, None);
        assert_eq!((prescribed.work.horn_evaluations, heavy.work.horn_evaluations > 0), (0, true));
    }
}

#[test]
fn a_bead_that_hits_a_mass_on_a_spring_sets_it_ringing() {
    let (mass, frequency, quality) = (10e-6, 1e3, 20.0);
    let mut scene = flying(&["duration=3 ms", "output_step=1 us"]);
    scene.horn = Some(Horn { mass, frequency, quality });
    scene.chain.gaps[0] = 1e-9;
    let bead = scene.chain.beads[0].mass();
    let response = run(&scene, &thrown(-0.01));
    // Collision of two free masses: the contact takes 6 µs of the horn's millisecond.
    let share = mass / (bead + mass);
    let after = response.bead_velocity[0].values.last().unwrap();
    assert!((after / (0.01 * (mass - bead) / (mass + bead)) - 1.0).abs() < 3e-3, "{after}");
    let kick = -0.01 * 2.0 * (1.0 - share);
    let (omega, decay) = (2.0 * PI * frequency, PI * frequency / quality);
    let damped = (omega * omega - decay * decay).sqrt();
    let collision = response.contact_force[0].values.iter().rposition(|force| *force > 0.0).unwrap() as f64 * 1e-6;
    assert!((3e-6..9e-6).contains(&collision), "{collision}");
    let start = 0.5 * collision;
    for periods in [0.27, 0.8, 1.9, 2.7] {
        let time = (periods * 1e3f64).round() * 1e-6;
        let exact = kick / damped * (-decay * (time - start)).exp() * (damped * (time - start)).sin();
        let found = at(&response.piston_displacement, time);
        assert!((found - exact).abs() < 6e-3 * kick.abs() / damped, "{periods}: {found:e} {exact:e}");
    }
    // What has rung away.
    let struck = 0.5 * mass * kick * kick;
    let books = channels(&response);
    assert!(((books.horn_lost_j + books.horn_j) / struck - 1.0).abs() < 6e-3, "{books:?}");
    assert!((books.horn_j / struck / (-2.0 * decay * 3e-3f64).exp() - 1.0).abs() < 0.06, "{books:?}");
}

/// A precompressed bead between horn and wall, hardly shaken: springs and dashpots in closed form.
#[test]
fn the_power_drawn_from_a_resonator_is_that_of_its_impedance() {
    let (mass, frequency, quality, preload, c) = (2e-5, 73e3, 40.0, 5.0, 1.5);
    let mut scene = load(
        "rigid",
        &[
            "model.kind=chain",
            "chain.beads=1",
            "chain.precompression=5 N",
            "damping.kind=linear",
            "damping.coefficient=1.5 N s/m",
            "drive.kind=tone-burst",
            "drive.amplitude=0.1 nm",
            "drive.cycles=400",
            "drive.ring_up=300 us",
            "duration=4 ms",
            "output_step=0.1 us",
        ],
    );
    scene.horn = Some(Horn { mass, frequency, quality });
    let response = at_rest(&scene);
    let bead = &scene.chain.beads[0];
    let overlap = (preload / bead_flat_stiffness(bead, FlatContact::Rigid)).powf(2.0 / 3.0);
    let tangent = 1.5 * preload / overlap;
    let omega = 2.0 * PI * frequency;
    let contact = Complex::new(tangent, omega * c);
    let inertia = Complex::new(bead.mass() * omega * omega, 0.0);
    // Force over displacement of the first contact, with the bead between two contacts alike.
    let load = contact * (contact - inertia) / (contact + contact - inertia);
    let horn = Horn { mass, frequency, quality };
    let own = Complex::new(horn.stiffness() - mass * omega * omega, omega * horn.resistance());
    let free =
        line(&Series { values: drive(&scene, &response), ..response.piston_displacement.clone() }, frequency, 20.0);
    let tip = Complex::new(free.0, free.1) * own / (own + load);
    let found = line(&response.piston_displacement, frequency, 20.0);
    let error = (Complex::new(found.0, found.1) - tip).norm() / tip.norm();
    // It does give way, and the contact is nearly linear: the amplitude over the overlap is 1e-5.
    assert!(tip.norm() < 0.6 * free.0.hypot(free.1), "{} {free:?}", tip.norm());
    assert!(error < 2e-3, "{error:e}");
    // Mean power into the chain, ½ ω |x|² Im Z, over the last 20 cycles by forces and face velocities.
    let count = (20.0 / frequency / 1e-7f64).round() as usize;
    let end = response.piston_displacement.len() - 1;
    let work: f64 = (end - count..end)
        .map(|i| {
            let force = 0.5 * (response.contact_force[0].values[i] + response.contact_force[0].values[i + 1]);
            let face = &response.piston_displacement.values;
            (force - preload) * (face[i + 1] - face[i])
        })
        .sum();
    let power = 0.5 * omega * tip.norm().powi(2) * load.im;
    assert!((work / (20.0 / frequency) / power - 1.0).abs() < 0.01, "{work:e} {power:e}");
}

/// The horn's free motion at the samples, m.
fn drive(scene: &Scene, response: &Response) -> Vec<f64> {
    let motion = scene.drive.motion(scene.amplitude_scale);
    (0..response.piston_displacement.len()).map(|i| motion.at(response.piston_displacement.time(i)).0).collect()
}

#[test]
fn drag_slows_a_free_bead_exponentially() {
    let mut scene = flying(&["duration=200 us"]);
    scene.chain.gaps[0] = f64::INFINITY;
    scene.holder = Some(Holder { drag: 0.05, ..Holder::default() });
    let mass = scene.chain.beads[0].mass();
    let response = run(&scene, &thrown(0.3));
    for time in [20e-6, 100e-6, 200e-6] {
        let exact = 0.3 * (-0.05 * time / mass).exp();
        assert!((at(&response.bead_velocity[0], time) / exact - 1.0).abs() < 1e-9);
    }
    let lost = 0.5 * mass * 0.09 * (1.0 - (-0.1 * 200e-6 / mass).exp());
    assert!((channels(&response).drag_j / lost - 1.0).abs() < 1e-9);
    assert_eq!(response.work.holder_evaluations, response.work.evaluations);
}

#[test]
fn a_sliding_bead_stops_where_and_when_friction_says_and_stays() {
    let mut scene = flying(&["duration=200 us"]);
    scene.chain.gaps[0] = f64::INFINITY;
    let (mass, force, speed) = (scene.chain.beads[0].mass(), 5e-3, -0.1);
    scene.holder = Some(Holder { friction_force: force, ..Holder::default() });
    let response = run(&scene, &thrown(speed));
    let (time, distance) = (mass * speed.abs() / force, mass * speed * speed / (2.0 * force));
    assert!((50e-6..150e-6).contains(&time));
    for (instant, value) in response.bead_velocity[0].values.iter().enumerate() {
        let exact = speed * (1.0 - instant as f64 * 1e-7 / time).max(0.0);
        assert!((value - exact).abs() < 1e-12, "{instant}: {value} {exact}");
    }
    let stood = response.bead_displacement[0].values.last().unwrap();
    assert!((stood + distance).abs() < 1e-9 * distance, "{stood:e} {distance:e}");
    assert!((channels(&response).friction_j / (force * distance) - 1.0).abs() < 1e-9);
    assert_eq!(response.bead_velocity[0].values.last(), Some(&0.0));
    // Regularised over a hundredth of the speed it goes on creeping: later by v_s/v ln(…), as far to a part in a hundred.
    let holder = Holder { slip_velocity: 1e-3, friction_force: force, ..Holder::default() };
    let creeping = run(&Scene { holder: Some(holder), ..scene.clone() }, &thrown(speed));
    let stood = creeping.bead_displacement[0].values.last().unwrap();
    assert!((stood + distance).abs() < 2e-2 * distance && *creeping.bead_velocity[0].values.last().unwrap() != 0.0);
}

/// A bead on two contact springs, hardly displaced: each half cycle takes 2 F_c/k off its amplitude, until it sticks.
#[test]
fn dry_friction_takes_the_same_off_every_swing() {
    let scene = load(
        "rigid",
        &[
            "model.kind=chain",
            "chain.beads=1",
            "chain.precompression=20 N",
            "damping.kind=none",
            "model.tolerance=1e-12",
            "duration=40 us",
            "output_step=1 ns",
        ],
    );
    let (mut scene, force) = (Scene { amplitude_scale: 0.0, ..scene }, 1e-3);
    scene.holder = Some(Holder { friction_force: force, ..Holder::default() });
    let bead = &scene.chain.beads[0];
    let overlap = (20.0 / bead_flat_stiffness(bead, FlatContact::Rigid)).powf(2.0 / 3.0);
    let stiffness = 2.0 * 1.5 * 20.0 / overlap;
    let start = 7.3 * force / stiffness;
    let response = run(&scene, &InitialState { displacements: vec![start], velocities: vec![0.0] });
    let half = PI * (bead.mass() / stiffness).sqrt();
    // The last swing ends within ±F_c/k, and there it sticks.
    for (swing, amplitude) in [7.3, -5.3, 3.3, -1.3, -0.7].into_iter().enumerate() {
        let found = at(&response.bead_displacement[0], (swing as f64 * half * 1e9).round() * 1e-9);
        // Half a nanosecond beside the turning point, and the contacts' own bend.
        let exact = amplitude * force / stiffness;
        assert!((found - exact).abs() < 2e-3 * start, "{swing}: {found:e} {exact:e}");
    }
    let end = response.bead_displacement[0].values.last().unwrap();
    assert!((end / (force / stiffness) + 0.7).abs() < 0.01, "{end:e}");
    assert_eq!(response.bead_velocity[0].values.last(), Some(&0.0));
    // Let go once, turned at three reversals, stuck once.
    assert_eq!(response.work.friction_turns, 5);
}

#[test]
fn beads_that_are_pushed_less_than_friction_holds_never_move() {
    let mut scene =
        load("rigid", &["model.kind=chain", "chain.precompression=1 N", "drive.amplitude=1 nm", "duration=60 us"]);
    scene.holder = Some(Holder { friction_force: 0.1, ..Holder::default() });
    let response = at_rest(&scene);
    assert!(response.bead_velocity.iter().all(|bead| bead.values.iter().all(|velocity| *velocity == 0.0)));
    // The spring of the first contact alone.
    let law = bead_flat_stiffness(&scene.chain.beads[0], scene.piston);
    let rest = (1.0 / law).powf(2.0 / 3.0);
    let force = &response.contact_force[0];
    let (face, force) = (at(&response.piston_displacement, 3.4e-6), at(force, 3.4e-6));
    let damper = scene.drive.motion(1.0).at(3.4e-6).1;
    let dashpot = scene.damping.coefficients[scene::DampingTerm::Linear] * damper;
    assert!((force - dashpot - hertz_force(law, rest + face)).abs() < 1e-9, "{force}");
    assert_eq!(channels(&response).friction_j, 0.0);
}

/// Every sample of a chain that rubs on its bore obeys Newton with Coulomb's law, the contact forces being those recorded.
#[test]
fn an_oblique_chain_rubs_with_the_transverse_part_of_its_forces() {
    let mut scene = load("rigid", &["model.kind=chain", "duration=80 us", "output_step=5 ns", "damping.kind=linear"]);
    let (coefficient, clearance) = (0.3, 60e-6);
    scene.holder = Some(Holder { friction_coefficient: coefficient, clearance, ..Holder::default() });
    let response = at_rest(&scene);
    let mass = scene.chain.beads[0].mass();
    let sine: f64 = clearance / 1e-3;
    let tangent = sine / (1.0 - sine * sine).sqrt();
    let (mut slid, mut stuck) = (0, 0);
    for bead in 0..6 {
        let velocity = &response.bead_velocity[bead].values;
        for i in 2..velocity.len() - 2 {
            let force = |contact: usize, at: usize| response.contact_force[contact].values[at];
            // Where no contact opens or closes nearby.
            let calm = (bead..bead + 2)
                .all(|contact| (i - 2..i + 3).all(|at| (force(contact, at) > 0.0) == (force(contact, i) > 0.0)));
            let one_way = (i - 2..i + 3).all(|at| velocity[at] * velocity[i] > 0.0);
            let mut across = 0.0;
            if bead > 0 {
                across += force(bead, i);
            }
            if bead < 5 {
                across += force(bead + 1, i);
            }
            let (net, most) = (force(bead, i) - force(bead + 1, i), coefficient * tangent * across);
            if velocity[i] == 0.0 {
                stuck += usize::from(across > 0.0);
                assert!(net.abs() <= most + 1e-9, "{bead} {i}: {net} {most}");
            } else if calm && one_way {
                let slope =
                    (8.0 * (velocity[i + 1] - velocity[i - 1]) - (velocity[i + 2] - velocity[i - 2])) / (12.0 * 5e-9);
                let expected = net - most * velocity[i].signum();
                slid += 1;
                assert!((mass * slope - expected).abs() < 2e-3, "{bead} {i}: {} {expected}", mass * slope);
            }
        }
    }
    assert!(slid > 20_000 && stuck > 20, "{slid} {stuck}");
    let straight = Scene { holder: None, ..scene.clone() };
    assert!(response.pole_velocity.peak() < 0.98 * at_rest(&straight).pole_velocity.peak());
}

/// Two beads that meet with an oblique line of centres: the largest force of Hertz' impact, k cos^(5/2) θ in place of k.
#[test]
fn an_oblique_contact_is_softer_along_the_axis() {
    let peak = |clearance: f64| {
        let mut scene = flying(&["chain.beads=2", "duration=20 us", "output_step=2 ns"]);
        scene.chain.gaps[0] = f64::INFINITY;
        scene.holder = Some(Holder { clearance, ..Holder::default() });
        let initial = InitialState { displacements: vec![0.0; 2], velocities: vec![0.1, 0.0] };
        run(&scene, &initial).contact_force[1].peak()
    };
    let cosine = (1.0 - 0.2f64 * 0.2).sqrt();
    // F ∝ k^(2/5).
    let ratio = peak(0.2e-3) / peak(0.0);
    assert!((ratio / cosine - 1.0).abs() < 1e-5, "{ratio} {cosine}");
}

#[test]
fn a_bead_that_yields_comes_back_with_thornton_s_restitution_and_once_hardened_with_its_whole_speed() {
    for (speed, strength) in [(0.02, 2e9), (0.1, 2e9), (0.5, 2e9), (2.0, 1e9)] {
        let mut scene = flying(&["duration=30 us", "output_step=5 ns"]);
        scene.chain.gaps[0] = 1e-9;
        scene.yield_strength = Some(strength);
        let bead = scene.chain.beads[0].clone();
        let law = Yielding::of(&bead, Err(None), strength);
        let response = run(&scene, &thrown(-speed));
        let expected = law.restitution(bead.mass(), speed);
        let found = response.bead_velocity[0].values.last().unwrap() / speed;
        assert!((found / expected - 1.0).abs() < 1e-8, "{speed}: {found} {expected}");
        let lost = 0.5 * bead.mass() * speed * speed * (1.0 - expected * expected);
        assert!((channels(&response).yielding_j - lost).abs() < 1e-9 * 0.5 * bead.mass() * speed * speed);
        assert_eq!(response.work.yields, u64::from(expected < 1.0));
    }
    // Between piston and wall it yields at both, then runs to and fro without loss.
    let mut scene = flying(&["duration=400 us", "support.kind=rigid", "output_step=10 ns"]);
    scene.chain.gaps = vec![1e-6; 2];
    scene.yield_strength = Some(1e9);
    let response = run(&scene, &thrown(0.5));
    let speeds: Vec<f64> = response.bead_velocity[0].values.iter().map(|v| v.abs()).collect();
    let plateau = |after: usize| {
        let free = (after..speeds.len() - 3).find(|i| speeds[*i] == speeds[i + 3] && speeds[*i] > 0.0).unwrap();
        speeds[free]
    };
    let late = plateau(speeds.len() / 2);
    assert!((plateau(3 * speeds.len() / 4) / late - 1.0).abs() < 1e-9);
    assert_eq!(response.work.yields, 2);
}

#[test]
fn a_precompression_beyond_yield_is_where_the_plastic_law_puts_it() {
    let mut scene = load(
        "rigid",
        &["model.kind=chain", "chain.beads=2", "chain.precompression=30 N", "damping.kind=none", "duration=5 us"],
    );
    scene.yield_strength = Some(2e9);
    scene.amplitude_scale = 0.0;
    let response = at_rest(&scene);
    assert!(response.contact_force.iter().all(|force| force.values.iter().all(|force| (force - 30.0).abs() < 1e-10)));
    assert!(channels(&response).yielding_j.abs() < 1e-15);
}

/// Storage and loss of a standard linear solid: E' = 1 + g (ωτ)²/(1 + (ωτ)²), E'' = g ωτ/(1 + (ωτ)²).
#[test]
fn an_annulus_that_relaxes_has_the_moduli_of_its_solid() {
    let (strength, preload) = (0.6, 2.0);
    for time in [1e-6, 4e-6, 20e-6] {
        let frequency = 20e3;
        let mut scene = load(
            "annulus",
            &[
                "model.kind=chain",
                "chain.beads=1",
                "chain.precompression=2 N",
                "damping.kind=none",
                "drive.kind=tone-burst",
                "drive.frequency=20 kHz",
                "drive.amplitude=2 nm",
                "drive.cycles=60",
                "drive.ring_up=50 us",
                "duration=2.8 ms",
                "output_step=0.5 us",
            ],
        );
        scene.loss.relaxation = Some(scene::Relaxation { strength, time });
        let response = at_rest(&scene);
        let force = line(&response.contact_force[1], frequency, 20.0);
        let bead = line(&response.bead_displacement[0], frequency, 20.0);
        let stiffness = Complex::new(force.0, force.1) / Complex::new(bead.0, bead.1);
        let law = Annulus::new(1.0);
        let tangent = law.tangent_stiffness(law.overlap(preload));
        let phase = 2.0 * PI * frequency * time;
        let storage = 1.0 + strength * phase * phase / (1.0 + phase * phase);
        let loss = strength * phase / (1.0 + phase * phase);
        let found = stiffness / Complex::new(tangent, 0.0);
        assert!(
            (found.re - storage).abs() < 3e-3 && (found.im - loss).abs() < 3e-3,
            "{time:e}: {found} {storage} {loss}"
        );
    }
}

#[test]
fn a_relaxation_that_never_ends_is_a_stiffer_annulus_and_one_that_is_over_at_once_is_none() {
    let scene = load("annulus", &["model.kind=chain", "duration=150 us"]);
    let relaxing = |time: f64| {
        let mut scene = scene.clone();
        scene.loss.relaxation = Some(scene::Relaxation { strength: 0.5, time });
        at_rest(&scene)
    };
    let mut stiffer = scene.clone();
    *stiffer.support.stiffness_mut().unwrap() = 1.5;
    let difference = |a: &Response, b: &Response| {
        let pairs = a.pole_velocity.values.iter().zip(&b.pole_velocity.values);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / b.pole_velocity.peak()
    };
    let lasting = difference(&relaxing(1e3), &at_rest(&stiffer));
    assert!(lasting < 1e-6, "{lasting:e}");
    let brief = [1e-8, 1e-9].map(|time| difference(&relaxing(time), &at_rest(&scene)));
    // The rest is a dashpot of g τ times the stiffness: it falls with τ.
    assert!(brief[1] < 0.02 && brief[1] < 0.2 * brief[0], "{brief:?}");
}

/// All at once, over many scenes: the energy balance closes, nothing hangs, forces never pull.
#[test]
fn everything_together_keeps_its_energy_balance() {
    let mut next = 7_u64;
    let mut random = move |low: f64, high: f64| {
        next = next.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low * (high / low).powf((next >> 11) as f64 / (1_u64 << 53) as f64)
    };
    for case in 0..200 {
        let base = if case % 2 == 0 { "annulus" } else { "rigid" };
        let mut scene = load(base, &["model.kind=chain", "duration=120 us"]);
        scene.amplitude_scale = random(0.1, 4.0);
        scene.chain.precompression = if case % 3 == 0 { random(1e-3, 1.0) } else { 0.0 };
        if case % 5 == 4 {
            scene.chain.gaps.iter_mut().for_each(|gap| *gap = random(1e-10, 1e-6));
            scene.chain.precompression = 0.0;
        }
        scene.horn = Some(Horn { mass: random(1e-6, 1e-2), frequency: random(2e4, 2e5), quality: random(1.0, 1e4) });
        scene.holder = Some(Holder {
            drag: random(1e-4, 0.1),
            friction_force: random(1e-4, 0.3),
            friction_coefficient: random(0.01, 0.5),
            clearance: random(1e-6, 1e-4),
            slip_velocity: if case % 4 == 3 { 1e-3 } else { 0.0 },
        });
        scene.yield_strength = Some(random(0.3e9, 4e9));
        if matches!(scene.support, Support::Annulus { .. }) {
            scene.loss.relaxation = Some(scene::Relaxation { strength: random(0.05, 2.0), time: random(1e-7, 1e-4) });
        }
        let response = at_rest(&scene);
        let lost = channels(&response);
        for part in [lost.drag_j, lost.friction_j, lost.yielding_j, lost.horn_lost_j] {
            assert!(part >= -1e-18, "{case}: {lost:?}");
        }
        assert!(response.contact_force.iter().flat_map(|force| &force.values).all(|force| *force >= 0.0), "{case}");
    }
}

#[test]
fn contacts_of_finite_bodies_go_with_horn_and_bead_guide() {
    let keys = ["model.kind=chain", "contact.law=finite-body", "model.mesh_density=6", "duration=60 us"];
    let mut scene = load("rigid", &keys);
    scene.horn = Some(Horn { mass: 1e-5, frequency: 73e3, quality: 30.0 });
    scene.holder = Some(Holder { friction_force: 0.02, drag: 0.01, ..Holder::default() });
    let response = at_rest(&scene);
    assert!(response.work.friction_turns > 3 && channels(&response).friction_j > 0.0);
}

#[test]
fn what_a_chain_cannot_do_is_refused_by_its_key() {
    let refused = |overrides: &[&str]| {
        let scene = load("annulus", &[&["model.kind=chain"], overrides].concat());
        match ChainModel.run_from(&scene, &InitialState::at_rest(6), &mut |_| true) {
            Err(ModelError::Unsupported { reason, .. }) => reason,
            other => panic!("{other:?}"),
        }
    };
    let finite = "contact.law=finite-body";
    assert!(refused(&[finite, "contact.yield_strength=2 GPa"]).contains("contact.yield_strength"));
    assert!(refused(&[finite, "loss.relaxation=0.1", "loss.relaxation_time=1 us"]).contains("loss.relaxation"));
}

#[test]
fn a_laser_sees_the_centre_of_a_bead_on_a_wall_or_a_spring_in_every_model() {
    let seen = |scene: &str, keys: &[&str]| {
        let keys = [keys, &["duration=10us"]].concat();
        granchain_model::run(&load(scene, &keys), &mut |_| true).unwrap().observed
    };
    let spring = ["support.kind=spring", "support.stiffness=1e6 N/m"];
    for model in ["model.kind=chain", "model.kind=reduced"] {
        assert_eq!(seen("rigid", &[model]), ObservedPoint::Centre, "{model}");
        assert_eq!(seen("annulus", &[&[model], &spring[..]].concat()), ObservedPoint::Centre, "{model}");
        assert_eq!(seen("annulus", &[model]), ObservedPoint::Pole, "{model}");
    }
}
