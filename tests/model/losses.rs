//! Drag, friction, material loss and relaxation: closed forms, limits, one model against another, books.

use std::f64::consts::PI;

use super::scenes::{Knock, channels, load, run};
use granchain::{
    model::{
        self, ModelError,
        fea::{Control, FeaError, Simulation},
    },
    response::Response,
    scene::{Holder, MaterialLoss, PistonMotion, Relaxation, Scene},
    signal::Series,
};

fn run_with(scene: &Scene, motion: &dyn PistonMotion) -> Response {
    model::prepare(scene).unwrap().run_with(scene, motion, &mut |_| true).unwrap_or_else(|error| panic!("{error}"))
}

fn difference(one: &Series, other: &Series) -> f64 {
    let smooth =
        |series: &Series| -> Vec<f64> { series.values.windows(9).map(|w| w.iter().sum::<f64>() / 9.0).collect() };
    let (one, other) = (smooth(one), smooth(other));
    let error: f64 = one.iter().zip(&other).map(|(a, b)| (a - b).powi(2)).sum();
    (error / other.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// One bead that flies freely after the knock.
fn flight(kind: &str, duration: &str, keys: &[&str]) -> Scene {
    let duration = format!("duration={duration}");
    let free: &[&str] = if kind == "chain" {
        &["water.medium=none", "chain.gaps.contact2=60 um", "model.step=50 ns"]
    } else {
        &["support.kind=free", "model.step=50 ns"]
    };
    let all = [&[&duration[..], "chain.beads=1", "output_step=0.5 us"], free, keys].concat();
    load(if kind == "chain" { "water" } else { "rigid" }, kind, &all)
}

const KNOCK: Knock = Knock { speed: 0.4, until: 3e-6 };

#[test]
fn a_free_bead_in_drag_slows_exponentially() {
    for kind in ["chain", "reduced", "fea"] {
        let mut scene = flight(kind, "50 us", &["loss.beads=0.05"][..if kind == "chain" { 0 } else { 1 }]);
        let b = 0.05;
        scene.holder = Some(Holder { drag: b, ..Holder::default() });
        let response = run_with(&scene, &KNOCK);
        let u = &response.bead_displacement[0].values;
        // 20 steps of 0.5 µs apart.
        let ratio = (u[90] - u[70]) / (u[50] - u[30]);
        let expected = (-b * 20e-6 / scene.chain.beads[0].mass()).exp();
        // The mesh's mass, 3e-4 of b t/m = 0.24; and the trapezoid's (b h/m)²/12.
        assert!((ratio / expected - 1.0).abs() < 2e-4, "{kind}: {ratio} {expected}");
        let own = channels(&response);
        assert!(own.drag_j > 0.0 && own.friction_j == 0.0, "{own:?}");
        let balance = response.energy;
        assert!(balance.residual_j.abs() < 2e-3 * balance.largest_j, "{kind} {balance:?}");
    }
}

#[test]
fn a_sliding_bead_is_braked_evenly_and_stops_where_the_closed_form_says() {
    for kind in ["chain", "reduced", "fea"] {
        let mut scene = flight(kind, "100 us", &["loss.beads=0.05"][..if kind == "chain" { 0 } else { 1 }]);
        let (force, mass) = (0.03, scene.chain.beads[0].mass());
        scene.holder = Some(Holder { friction_force: force, slip_velocity: 1e-4, ..Holder::default() });
        let response = run_with(&scene, &KNOCK);
        let u = &response.bead_displacement[0].values;
        let h = 0.5e-6;
        let braking = (u[20] - 2.0 * u[30] + u[40]) / f64::powi(10.0 * h, 2);
        assert!((-braking * mass / force - 1.0).abs() < 1e-3, "{kind}: {braking}");
        let speed = (u[40] - u[20]) / (20.0 * h);
        let way = mass * speed * speed / (2.0 * force);
        // v_s over v of it.
        assert!(((u[200] - u[30]) / way - 1.0).abs() < 2e-3, "{kind}: {} {way}", u[200] - u[30]);
        let own = channels(&response);
        let balance = response.energy;
        let all = own.friction_j + own.material_j + balance.dissipated_j;
        assert!(
            own.friction_j > 0.8 * balance.piston_work_j
                && (all / balance.piston_work_j - 1.0).abs() < 2e-3
                && balance.residual_j.abs() < 2e-3 * balance.largest_j,
            "{kind} {own:?} {balance:?}"
        );
    }
}

/// Rate at which an oscillation decays, 1/s, by prediction of every sample of its difference from the two before.
fn decay(series: &Series, from: usize, to: usize) -> (f64, f64) {
    let y: Vec<f64> = series.values[from..to].windows(2).map(|w| w[1] - w[0]).collect();
    let (mut aa, mut ab, mut bb, mut ay, mut by) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for w in y.windows(3) {
        let [b, a, y] = [w[0], w[1], w[2]];
        (aa, ab, bb, ay, by) = (aa + a * a, ab + a * b, bb + b * b, ay + a * y, by + b * y);
    }
    let determinant = aa * bb - ab * ab;
    let (first, second) = ((ay * bb - by * ab) / determinant, (by * aa - ay * ab) / determinant);
    let rate = -(-second).ln() / (2.0 * series.step);
    let angle = (0.5 * first / (-second).sqrt()).acos();
    (rate, angle / series.step / (2.0 * PI))
}

#[test]
fn the_lowest_mode_of_a_free_bead_decays_by_pi_times_its_loss_factor() {
    let eta = 0.02;
    for (kind, keys, from, to, tolerance) in [
        ("reduced", &["model.step=20 ns", "model.modes=1"][..], 200, 600, 1e-3),
        // Other modes die faster: 3.5 MHz is e^−5 of what it was after 15 µs.
        ("fea", &["model.step=20 ns"][..], 800, 1100, 2e-2),
    ] {
        let all = [&["duration=24 us", "chain.beads=1", "support.kind=free", "output_step=20 ns"], keys].concat();
        let mut scene = load("rigid", kind, &all);
        scene.loss.beads = eta;
        let response = run_with(&scene, &Knock { speed: 0.4, until: 0.4e-6 });
        let (rate, frequency) = decay(&response.pole_velocity, from, to);
        let own = eta * frequency / 1e6;
        println!("{kind}: {frequency:.0} Hz, decrement {} of pi eta(f) = {}", rate / frequency, PI * own);
        assert!((frequency / 2.646e6 - 1.0).abs() < 1e-2, "{kind} {frequency}");
        assert!((rate / frequency / (PI * own) - 1.0).abs() < tolerance, "{kind}: {} {}", rate / frequency, PI * own);
    }
}

/// Two beads in a collision, the first kicked across a gap.
fn collision(kind: &str, step: &str) -> Scene {
    let step = format!("model.step={step}");
    load(
        "rigid",
        kind,
        &[
            "chain.beads=2",
            "duration=25 us",
            "output_step=0.1 us",
            "chain.gaps.contact2=1 um",
            "support.kind=free",
            &step,
        ],
    )
}

#[test]
fn a_collision_loses_the_same_in_both_models() {
    for eta in [0.02, 0.3] {
        let mut found = Vec::new();
        for kind in ["reduced", "fea"] {
            let mut scene = collision(kind, "50 ns");
            scene.loss.beads = eta;
            let response = run_with(&scene, &Knock { speed: 0.8, until: 4e-6 });
            let balance = response.energy;
            assert!(balance.residual_j.abs() < 2e-3 * balance.largest_j, "{kind} {balance:?}");
            found.push(response);
        }
        let [fast, full] = [&found[0], &found[1]];
        let waveform =
            fast.bead_velocity.iter().zip(&full.bead_velocity).map(|(a, b)| difference(a, b)).fold(0.0, f64::max);
        let lost = channels(fast).material_j / channels(full).material_j;
        let share = channels(full).material_j / full.energy.piston_work_j;
        println!("eta {eta}: waveform {waveform:.5}, loss {lost:.5}, of the work {share:.5}");
        assert!(waveform < 5e-3 && (lost - 1.0).abs() < 0.03, "{eta}: {waveform} {lost} {share}");
    }
}

#[test]
fn relaxation_that_never_comes_is_a_stiffer_support_and_one_at_once_is_none() {
    let g = 0.6;
    for (kind, step) in [("reduced", "50 ns"), ("fea", "100 ns")] {
        let keys =
            ["chain.beads=2", "duration=40 us", "output_step=0.1 us", "alpha=1.5", &format!("model.step={step}")];
        let plain = load("annulus", kind, &keys);
        let relaxing = |time: f64| {
            let mut scene = plain.clone();
            scene.loss.relaxation = Some(Relaxation { strength: g, time });
            run(&scene)
        };
        let mut stiff = plain.clone();
        *stiff.support.stiffness_mut().unwrap() = 1.0 + g;
        let worst = |one: &Response, other: &Response| {
            one.bead_velocity.iter().zip(&other.bead_velocity).map(|(a, b)| difference(a, b)).fold(0.0, f64::max)
        };
        let (slow, fast) = (worst(&relaxing(1e3), &run(&stiff)), worst(&relaxing(1e-13), &run(&plain)));
        println!("{kind}: frozen {slow:.2e}, at once {fast:.2e}");
        // The modes of the ring that a step follows are chosen by the stiffer one in both.
        assert!(slow < 1e-6 && fast < 1e-4, "{kind}: {slow:e} {fast:e}");
        let between = relaxing(5e-6);
        assert!(worst(&between, &run(&plain)) > 1e-2 && worst(&between, &run(&stiff)) > 1e-2);
        let (own, balance) = (channels(&between), between.energy);
        assert!(
            own.material_j > 0.0 && balance.residual_j.abs() < 5e-3 * balance.largest_j,
            "{kind} {own:?} {balance:?}"
        );
    }
}

/// A small sine that begins gently.
struct Sine {
    amplitude: f64,
    angular: f64,
}

impl PistonMotion for Sine {
    fn breaks(&self) -> &[f64] {
        &[]
    }

    fn on_piece(&self, _: usize, time: f64) -> (f64, f64) {
        // Over four periods: what else rings stays below a thousandth.
        let ramp = (self.angular * time / (8.0 * PI)).min(1.0);
        let (envelope, slope) = if ramp < 1.0 {
            (0.5 - 0.5 * (PI * ramp).cos(), 0.0625 * self.angular * (PI * ramp).sin())
        } else {
            (1.0, 0.0)
        };
        let (sine, cosine) = (self.angular * time).sin_cos();
        (self.amplitude * envelope * sine, self.amplitude * (envelope * self.angular * cosine + slope * sine))
    }
}

/// Amplitude and phase of a series against a sine, over its last two periods.
fn line(series: &Series, angular: f64) -> [f64; 2] {
    let count = (4.0 * PI / angular / series.step).round() as usize;
    let from = series.values.len() - count;
    let mean = series.values[from..].iter().sum::<f64>() / count as f64;
    let (mut real, mut imaginary) = (0.0, 0.0);
    for i in from..series.values.len() {
        let phase = angular * i as f64 * series.step;
        real += (series.values[i] - mean) * phase.sin();
        imaginary += (series.values[i] - mean) * phase.cos();
    }
    [2.0 * real / count as f64, 2.0 * imaginary / count as f64]
}

#[test]
fn a_slow_sinusoidal_indentation_sees_the_modulus_of_the_standard_linear_solid() {
    let frequency = 20e3;
    let angular = 2.0 * PI * frequency;
    for (kind, step) in [("reduced", "50 ns"), ("fea", "100 ns")] {
        let keys = [
            "chain.beads=1",
            "duration=300 us",
            "output_step=0.1 us",
            "chain.precompression=0.3 N",
            "damping.kind=none",
            &format!("model.step={step}"),
        ];
        let plain = load("annulus", kind, &keys);
        let stiffness = |scene: &Scene| {
            let response = run_with(scene, &Sine { amplitude: 10e-9, angular });
            let [fr, fi] = line(&response.contact_force[1], angular);
            let [wr, wi] = line(&response.bead_displacement[0], angular);
            let square = wr * wr + wi * wi;
            [(fr * wr + fi * wi) / square, (fi * wr - fr * wi) / square]
        };
        let [elastic, none] = stiffness(&plain);
        assert!(none.abs() < 1e-3 * elastic, "{kind} {none} {elastic}");
        for (strength, time) in [(0.5, 1.0 / angular), (1.0, 3e-6), (0.3, 40e-6)] {
            let mut scene = plain.clone();
            scene.loss.relaxation = Some(Relaxation { strength, time });
            let [storage, loss] = stiffness(&scene).map(|part| part / elastic);
            let x = angular * time;
            let expected = [1.0 + strength * x * x / (1.0 + x * x), strength * x / (1.0 + x * x)];
            println!("{kind} g {strength} wt {x:.2}: {storage:.4} {loss:.4}, closed form {expected:.4?}");
            // The steel of the bead, 1/140 of the resin's compliance, does not relax; the edge of the contact moves.
            assert!(
                (storage / expected[0] - 1.0).abs() < 2e-3 && (loss / expected[1] - 1.0).abs() < 9e-3,
                "{kind} {storage} {loss} {expected:?}"
            );
        }
    }
}

#[test]
fn loss_of_the_beads_takes_the_ringing_out_of_raw_velocities() {
    let ringing = [0.0, 0.001, 0.01, 0.03].map(|eta| {
        let keys = ["duration=120 us", "output_step=50 ns", "model.step=50 ns", "damping.kind=none"];
        let mut scene = load("rigid", "reduced", &keys);
        scene.loss.beads = eta;
        let last = run(&scene).bead_velocity.pop().unwrap();
        let late = &last.values[last.values.len() / 2..];
        let count = late.len() as f64;
        // Of the late half under a Hann window, what lies from 2.4 MHz to 8 MHz.
        let line = |frequency: f64| {
            let (mut real, mut imaginary) = (0.0, 0.0);
            for (i, v) in late.iter().enumerate() {
                let window = 0.5 - 0.5 * (2.0 * PI * i as f64 / count).cos();
                let (sine, cosine) = (2.0 * PI * frequency * i as f64 * last.step).sin_cos();
                (real, imaginary) = (real + window * v * cosine, imaginary + window * v * sine);
            }
            real * real + imaginary * imaginary
        };
        let bin = 1.0 / (count * last.step);
        let band = |from: f64, to: f64| {
            ((from / bin) as u32..(to / bin) as u32).map(|k| line(f64::from(k) * bin)).sum::<f64>()
        };
        let share = (band(2.4e6, 8e6) / band(0.0, 2.4e6)).sqrt();
        println!("eta {eta}: {share:.5} of the rms lies above 2.4 MHz");
        share
    });
    assert!(ringing[3] < 0.6 * ringing[0] && ringing[2] < ringing[0], "{ringing:?}");
}

#[test]
fn dashpots_push_a_dragged_bead_by_as_much_as_its_contacts_reckon_with() {
    let keys =
        ["duration=15 us", "output_step=0.1 us", "chain.beads=3", "damping.kind=linear", "damping.coefficient=3"];
    let scene = load("rigid", "fea", &[&keys[..], &["holder.drag=2 N s/m", "alpha=2"]].concat());
    let mut simulation = Simulation::new(&scene, Control::default()).unwrap();
    while !simulation.is_done() {
        simulation.advance().unwrap();
    }
    // Were the push another, the gaps measured again would miss their conditions.
    assert!(simulation.complementarity().violations == 0, "{:?}", simulation.complementarity());
    let response = simulation.response();
    assert!(response.work.dashpot_evaluations > 0 && channels(&response).drag_j > 0.1 * response.energy.piston_work_j);
}

#[test]
fn oblique_contacts_rub_on_the_wall_alike_in_both_models() {
    let friction = |kind: &str, step: &str| {
        let keys = ["duration=30 us", "output_step=0.1 us", "chain.beads=4", &format!("model.step={step}")];
        let mut scene = load("rigid", kind, &keys);
        scene.holder =
            Some(Holder { friction_coefficient: 0.5, clearance: 50e-6, slip_velocity: 1e-3, ..Holder::default() });
        let response = run(&scene);
        assert!(response.energy.residual_j.abs() < 1e-2 * response.energy.largest_j, "{:?}", response.energy);
        (channels(&response).friction_j, response.energy.piston_work_j)
    };
    let (fast, work) = friction("reduced", "50 ns");
    let (full, _) = friction("fea", "50 ns");
    println!("friction {fast:.3e} {full:.3e} of {work:.3e}");
    assert!(fast > 1e-3 * work && (fast / full - 1.0).abs() < 0.02, "{fast:e} {full:e} {work:e}");
}

#[test]
fn what_a_model_does_not_have_is_refused_by_its_key() {
    let loss = |own: MaterialLoss, scene: &Scene| Scene { loss: own, ..scene.clone() };
    let support = MaterialLoss { support: 0.01, ..MaterialLoss::default() };
    let beads = MaterialLoss { beads: 0.01, ..MaterialLoss::default() };
    for kind in ["reduced", "fea"] {
        for scene in
            [load("rigid", kind, &["duration=1 us"]), load("water", kind, &["duration=1 us", "damping.at=beads"])]
        {
            let refused = model::run(&loss(support, &scene), &mut |_| true).unwrap_err();
            let expected = ModelError::from(FeaError::LossWithoutBody { key: "loss.support" });
            assert_eq!(refused, expected, "{kind}");
        }
    }
    let disc = load("water", "chain", &["duration=1 us", "water.medium=none"]);
    let yielding = Scene { yield_strength: Some(2e9), ..disc.clone() };
    for (scene, key) in [
        (loss(support, &disc), "loss.support"),
        (loss(beads, &disc), "loss.beads"),
        (yielding, "contact.yield_strength"),
    ] {
        let refused = model::run(&scene, &mut |_| true).unwrap_err();
        assert!(
            matches!(&refused, ModelError::Unsupported { model: "chain", reason } if reason.contains(key)),
            "{refused}"
        );
    }
}

#[test]
fn contacts_past_their_yield_cause_a_warning() {
    let warned = |kind: &str, amplitude: &str| {
        let scene = load("rigid", kind, &["duration=12 us", "chain.beads=1", amplitude]);
        let prepared = model::prepare(&scene).unwrap();
        let response = prepared.run(&scene, &mut |_| true).unwrap();
        let most = response.contact_force[0].values.iter().fold(0.0, |most: f64, force| most.max(*force));
        let warnings = prepared.warnings(&scene, &response);
        (most, warnings.iter().any(|warning| warning.contains("yields from")))
    };
    // R* = a on a rigid flat: F_y = (1.6 π Y)³ a²/(6 E*²) = 0.91 N of steel.
    for kind in ["reduced", "fea"] {
        let ((soft, quiet), (hard, loud)) = (warned(kind, "alpha=0.2"), warned(kind, "alpha=3"));
        assert!(soft < 0.9 && !quiet && hard > 0.92 && loud, "{kind}: {soft} {quiet} {hard} {loud}");
    }
}
