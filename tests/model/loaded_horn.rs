//! A compliant horn, in the models of a fixed step: limits, closed forms, books.

use super::scenes::{self, Knock, channels, run};
use granchain::{
    model::{self, fea},
    response::Response,
    scene::{Holder, Horn, PistonMotion, Scene},
};

fn load(name: &str, kind: &str, keys: &[&str]) -> Scene {
    scenes::load(name, kind, &[&["output_step=0.1 us"], keys].concat())
}

fn with(scene: &Scene, horn: Horn) -> Scene {
    Scene { horn: Some(horn), ..scene.clone() }
}

fn velocity(response: &Response) -> &[f64] {
    &response.bead_velocity.last().unwrap().values
}

/// Rms difference over rms.
fn difference(one: &[f64], other: &[f64]) -> f64 {
    let error: f64 = one.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum();
    (error / other.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

const RIGID: &[&str] = &["duration=30 us", "damping.kind=linear", "damping.coefficient=0.3"];

#[test]
fn a_heavy_horn_is_the_prescribed_motion_in_every_model() {
    for (name, kind, keys) in [
        ("rigid", "reduced", RIGID),
        ("rigid", "fea", RIGID),
        ("annulus", "reduced", &["duration=30 us", "chain.precompression=0.05 N"][..]),
        ("water", "chain", &["duration=30 us", "water.medium=none"]),
    ] {
        let plain = load(name, kind, keys);
        let prescribed = run(&plain);
        assert_eq!(prescribed.energy.channels, None);
        assert_eq!(prescribed.work.horn_evaluations, 0);
        // q is below 1 N·(30 µs)²/(2 M) = 4.5e-16 m of motions of a micrometre; what the chain makes of it grows tenfold.
        let heavy = run(&with(&plain, Horn { mass: 1e6, frequency: 73e3, quality: 100.0 }));
        let error = difference(velocity(&heavy), velocity(&prescribed));
        assert!(error < 1e-8, "{name} {kind}: {error:e}");
        assert_eq!(heavy.work.horn_evaluations, heavy.work.steps, "{name} {kind}");
        // The effect goes as 1/M.
        let shift = |mass| {
            let one = run(&with(&plain, Horn { mass, frequency: 73e3, quality: 100.0 }));
            difference(velocity(&one), velocity(&prescribed))
        };
        let (light, heavier) = (shift(10.0), shift(20.0));
        assert!((light / heavier - 2.0).abs() < 0.05, "{name} {kind}: {light:e} {heavier:e}");
    }
}

/// The face's own motion q, m, at every sample.
fn own(response: &Response, motion: &dyn PistonMotion) -> Vec<f64> {
    let series = &response.piston_displacement;
    series.values.iter().enumerate().map(|(i, u)| u - motion.at(i as f64 * series.step).0).collect()
}

#[test]
fn a_knock_leaves_the_horn_ringing_by_its_impulse() {
    let knock = Knock { speed: 0.4, until: 2e-6 };
    for kind in ["reduced", "fea"] {
        let step = if kind == "reduced" { "model.step=20 ns" } else { "model.step=50 ns" };
        let mut plain = load("rigid", kind, &["duration=60 us", "support.kind=free", "chain.beads=1", step]);
        for quality in [1.0, 20.0, 1e6] {
            let horn = Horn { mass: 1e-3, frequency: 20e3, quality };
            plain.horn = Some(horn);
            let response = model::prepare(&plain).unwrap().run_with(&plain, &knock, &mut |_| true).unwrap();
            let force = &response.contact_force[0];
            let impulse = force.values.iter().sum::<f64>() * force.step;
            let mean = force.values.iter().enumerate().map(|(i, f)| i as f64 * force.step * f).sum::<f64>()
                * force.step
                / impulse;
            let q = own(&response, &knock);
            let angular = 2.0 * std::f64::consts::PI * horn.frequency;
            let decay = 0.5 * angular / quality;
            let damped = (angular * angular - decay * decay).sqrt();
            let (mut worst, mut largest): (f64, f64) = (0.0, 0.0);
            for (i, q) in q.iter().enumerate() {
                let since = i as f64 * force.step - mean;
                if since > 8e-6 {
                    let expected = -impulse / (horn.mass * damped) * (-decay * since).exp() * (damped * since).sin();
                    worst = worst.max((q - expected).abs());
                    largest = largest.max(expected.abs());
                }
            }
            // A pulse of 2 µs is not of no length: (ω σ)²/2 with σ = 0.5 µs, 2e-3.
            assert!(worst < 4e-3 * largest, "{kind} {quality}: {worst:e} of {largest:e}");
        }
    }
}

#[test]
fn the_energy_balance_of_the_horn_closes_to_second_order_and_that_of_the_chain_as_without() {
    for (name, kind, keys, steps) in [
        ("rigid", "reduced", RIGID, ["40 ns", "20 ns"]),
        ("rigid", "fea", RIGID, ["100 ns", "50 ns"]),
        ("annulus", "reduced", &["duration=40 us", "chain.precompression=0.05 N"][..], ["40 ns", "20 ns"]),
        ("water", "chain", &["duration=40 us", "water.medium=none"], ["20 ns", "10 ns"]),
    ] {
        let residual = steps.map(|step| {
            let scene = load(name, kind, &[keys, &[&format!("model.step={step}"), "output_step=0.2 us"]].concat());
            let response = run(&with(&scene, Horn { mass: 2e-4, frequency: 73e3, quality: 15.0 }));
            let own = channels(&response);
            assert!(own.horn_j > 0.0 && own.horn_lost_j > 0.0, "{own:?}");
            let balance = response.energy;
            assert!(balance.residual_j.abs() < 3e-2 * balance.largest_j, "{name} {kind}: {balance:?}");
            let scale = own.source_work_j.abs() + own.horn_j + own.horn_lost_j;
            own.horn_residual(balance.piston_work_j).abs() / scale
        });
        println!("{name} {kind} {residual:?}");
        assert!(residual[0] < 2e-4, "{name} {kind}: {residual:?}");
        let fall = residual[0] / residual[1];
        assert!(fall > 2.8 && fall < 6.0, "{name} {kind}: {residual:?}");
    }
}

#[test]
fn at_its_resonance_a_horn_loses_what_the_closed_form_says() {
    // One bead held against the piston by a soft spring, far below its resonance: the bead is a load in step with the spring.
    let scene =
        load("rigid", "reduced", &["duration=30 us", "chain.beads=1", "support.kind=free", "output_step=0.1 us"]);
    let still = Horn { mass: 5e-4, frequency: 73e3, quality: 10.0 };
    let response = run(&with(&scene, still));
    let own = channels(&response);
    // D ∫ q̇² dt from the recorded face.
    let drive = scene.drive.motion(scene.amplitude_scale);
    let q = self::own(&response, drive.as_ref());
    let h = response.piston_displacement.step;
    let lost: f64 = q.windows(2).map(|w| (w[1] - w[0]).powi(2) / h).sum::<f64>() * still.resistance();
    assert!((lost / own.horn_lost_j - 1.0).abs() < 1e-2, "{lost:e} {own:?}");
}

#[test]
fn an_analysis_with_a_horn_and_losses_is_taken_up_to_the_same_bits() {
    let keys = [
        "duration=20 us",
        "alpha=1.5",
        "loss.relaxation=0.5",
        "loss.relaxation_time=2 us",
        "loss.support=0.02",
        "loss.beads=0.01",
        "horn.mass=1 mg",
        "holder.drag=0.01 N s/m",
        "holder.friction_force=5 mN",
    ];
    let scene = load("annulus", "fea", &keys);
    let control = fea::Control::default();
    let finish = |stops: &[usize]| {
        let mut simulation = fea::Simulation::new(&scene, control).unwrap();
        let mut taken = 0;
        while !simulation.is_done() {
            simulation.advance().unwrap();
            taken += 1;
            if stops.contains(&taken) {
                let saved = serde_json::to_vec(&simulation.snapshot("horn")).unwrap();
                simulation = fea::Simulation::new(&scene, control).unwrap();
                simulation.restore(serde_json::from_slice(&saved).unwrap(), "horn").unwrap();
            }
        }
        simulation.response()
    };
    let whole = finish(&[]);
    assert!(whole == finish(&[1, 60, 111]));
    let own = channels(&whole);
    assert!(own.horn_j > 0.0 && own.drag_j > 0.0 && own.friction_j > 0.0 && own.material_j > 0.0, "{own:?}");
    assert!(whole.energy.residual_j.abs() < 2e-2 * whole.energy.largest_j, "{:?}", whole.energy);
    // Another horn is another analysis.
    let state = fea::Simulation::new(&scene, control).unwrap().snapshot("horn");
    let mut other = fea::Simulation::new(&Scene { horn: None, ..scene.clone() }, control).unwrap();
    assert!(other.restore(state, "horn").is_err());
}

#[test]
fn steps_that_are_cut_leave_the_horn_as_it_was() {
    let mut scene = load("rigid", "fea", &["duration=20 us", "horn.mass=0.2 g", "horn.quality=20"]);
    let all = |scene: &Scene, strict: f64| {
        let control = fea::Control { contact_energy: strict, ..fea::Control::default() };
        let mut simulation = fea::Simulation::new(scene, control).unwrap();
        while !simulation.is_done() {
            simulation.advance().unwrap();
        }
        (simulation.cuts().len(), simulation.response())
    };
    let ((whole, plain), (cut, halved)) = (all(&scene, 0.05), all(&scene, 1e-4));
    assert!(cut > whole + 5, "{cut} {whole}");
    let own = |response: &Response| channels(response).horn_residual(response.energy.piston_work_j);
    let scale = channels(&plain).source_work_j;
    assert!(own(&halved).abs() < 2e-4 * scale, "{:e} {:e} {scale:e}", own(&halved), own(&plain));
    let error = difference(velocity(&halved), velocity(&plain));
    scene.horn = None;
    let without = difference(velocity(&all(&scene, 1e-4).1), velocity(&all(&scene, 0.05).1));
    assert!(error < 3.0 * without.max(1e-3), "{error:e} {without:e}");
}

#[test]
fn side_by_side_every_run_has_its_own_horn_and_bead_guide() {
    let scene = load(
        "annulus",
        "reduced",
        &[
            "duration=40 us",
            "horn.mass=0.5 g",
            "holder.drag=0.01 N s/m",
            "holder.friction_force=2 mN",
            "holder.friction_coefficient=0.2",
            "holder.clearance=20 um",
            "loss.beads=0.02",
            "loss.support=0.05",
            "loss.relaxation=0.4",
            "loss.relaxation_time=1 us",
            "damping.kind=linear",
        ],
    );
    let scenes: Vec<Scene> = (0..5)
        .map(|index| {
            let mut own = scene.clone();
            let share = f64::from(index);
            own.horn.as_mut().unwrap().mass *= 1.0 + share;
            own.horn.as_mut().unwrap().quality = 10.0 + share;
            own.holder.as_mut().unwrap().friction_force *= share;
            own.holder.as_mut().unwrap().drag *= share;
            own.amplitude_scale = 0.6 + 0.1 * share;
            own
        })
        .collect();
    let prepared = model::prepare(&scenes[0]).unwrap();
    for (trace, scene) in prepared.traces(&scenes, &|| true).iter().zip(&scenes) {
        let alone = prepared.run(scene, &mut |_| true).unwrap();
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&trace.as_ref().unwrap().values), bits(&alone.observed_velocity().values));
    }
    // One whose holder does nothing among others: as alone.
    let mut idle = scenes.clone();
    idle[1].holder = Some(Holder::default());
    idle[3].holder.as_mut().unwrap().friction_coefficient = 0.0;
    for (trace, scene) in prepared.traces(&idle, &|| true).iter().zip(&idle) {
        assert_eq!(trace.as_ref().unwrap(), prepared.run(scene, &mut |_| true).unwrap().observed_velocity());
    }
    // Some with a horn and some without, one of other losses: each as alone.
    let (mut mixed, mut lossy) = (scenes.clone(), scenes);
    mixed[4].horn = None;
    lossy[4].loss.beads = 0.0;
    for scenes in [mixed, lossy] {
        for (trace, scene) in prepared.traces(&scenes, &|| true).iter().zip(&scenes) {
            assert_eq!(trace.as_ref().unwrap(), prepared.run(scene, &mut |_| true).unwrap().observed_velocity());
        }
    }
}
