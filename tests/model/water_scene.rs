//! Scenes with a disc, run whole: pressures, books, what is made ready once, what a disc that lets go or a coarse mesh is told.

use granchain::{
    model::{self, ModelError},
    response::{Response, write_csv},
    scene::{DampingPlacement, Integrator, Rim, Scene, Support, load},
};
use realfft::RealFftPlanner;

fn scene(overrides: &[&str]) -> Scene {
    load("water", &overrides.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>())
        .unwrap_or_else(|error| panic!("{error}"))
}

fn run(scene: &Scene) -> Response {
    model::run(scene, &mut |_| true).unwrap_or_else(|error| panic!("{error}"))
}

fn pressure(response: &Response) -> &[f64] {
    &response.disc.as_ref().unwrap().pressure[0].values
}

fn peak(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |peak, value| f64::max(peak, value.abs()))
}

/// Energy unaccounted for over the piston's work.
fn imbalance(response: &Response) -> f64 {
    response.energy.residual_j / response.energy.piston_work_j
}

/// Root of the mean square of a trace on that step (s) within a band (Hz), Hann window.
fn band(values: &[f64], step: f64, from: f64, to: f64) -> f64 {
    let length = values.len();
    let mut planner = RealFftPlanner::<f64>::new();
    let plan = planner.plan_fft_forward(length);
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / length as f64;
    let mut input: Vec<f64> = values.iter().enumerate().map(|(i, v)| v * (1.0 - angle(i).cos())).collect();
    let mut spectrum = plan.make_output_vec();
    plan.process(&mut input, &mut spectrum).unwrap();
    let power = spectrum.iter().enumerate().filter(|(bin, _)| {
        let frequency = *bin as f64 / (length as f64 * step);
        frequency >= from && frequency < to
    });
    (power.map(|(_, value)| value.norm_sqr()).sum::<f64>() * 2.0 / 1.5).sqrt() / length as f64
}

#[test]
fn the_scene_of_the_paper_runs_and_its_energy_balance_closes() {
    for placement in ["all", "beads"] {
        for rim in ["clamped", "supported", "free"] {
            let scene = scene(&[&format!("damping.at={placement}"), &format!("disc.rim={rim}")]);
            let response = run(&scene);
            let disc = response.disc.as_ref().unwrap();
            assert_eq!((disc.pressure.len(), disc.velocity.len()), (1, 4501));
            // Velocity Verlet at 25 ns.
            assert!(imbalance(&response).abs() < 0.01, "{placement} {rim}: {:e}", imbalance(&response));
            let (in_disc, in_water) = (response.energy.disc_j.unwrap(), response.energy.water_j.unwrap());
            assert!(in_water > 0.0 && in_disc >= 0.0 && response.energy.dissipated_j > 0.0);
            // Sound needs its time from the nearest place of the face; a sample may lie between.
            let force = &response.contact_force[6].values;
            let touched = force.iter().position(|force| *force > 0.0).unwrap();
            let arrival = pressure(&response).iter().position(|p| *p != 0.0).unwrap();
            let travel = 1e-3 / 1500.0 / scene.output_step;
            assert!((arrival - touched) as f64 > travel - 1.5, "{touched} {arrival} {travel}");
        }
    }
}

#[test]
fn scenes_without_a_disc_have_no_column_no_unknown_and_no_energy_of_it() {
    for name in ["rigid", "annulus", "chain"] {
        let scene = load(name, &["duration=5us".into(), "model.kind=chain".into()]).unwrap();
        let response = run(&scene);
        assert_eq!((response.disc.is_none(), response.work.unknowns), (true, 12), "{name}");
        assert_eq!((response.energy.disc_j, response.energy.water_j), (None, None));
        let mut table = Vec::new();
        write_csv(&response, &mut table).unwrap();
        let header = String::from_utf8(table).unwrap().lines().next().unwrap().to_owned();
        assert!(!header.contains("pressure") && !header.contains("disc"), "{header}");
        let json = serde_json::to_string(&response).unwrap();
        assert!(!json.contains("disc") && !json.contains("water"), "{name}");
    }
}

#[test]
fn a_disc_made_ready_once_serves_every_run_to_the_bit() {
    let mut base = scene(&["duration=60us"]);
    let prepared = model::prepare(&base).unwrap();
    for placement in [DampingPlacement::All, DampingPlacement::Beads] {
        for alpha in [0.3, 1.0] {
            (base.damping.placement, base.amplitude_scale) = (placement, alpha);
            let response = prepared.run(&base, &mut |_| true).unwrap();
            assert_eq!(response, prepared.run(&base, &mut |_| true).unwrap());
            assert_eq!(response, run(&base));
        }
    }
    // Longer than the scene it was made for.
    base.duration = 90e-6;
    assert_eq!(prepared.run(&base, &mut |_| true).unwrap(), run(&base));
    let refused = |change: fn(&mut Scene)| {
        let mut other = base.clone();
        change(&mut other);
        match prepared.run(&other, &mut |_| true) {
            Err(ModelError::OtherBodies { part }) => Some(part),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(|other| other.water = None), Some("water"));
    assert_eq!(refused(|other| other.model.integrator = Integrator::OnDisc { step: 50e-9 }), Some("model.step"));
    let soften = |other: &mut Scene| {
        let Support::Disc { shape, .. } = &mut other.support else { panic!("a disc") };
        shape.rim = Rim::Free;
    };
    assert_eq!(refused(soften), Some("support"));
}

#[test]
fn the_recorded_answer_of_the_elements_is_their_stepping() {
    let coarse = ["water.method=elements", "water.mesh_side=0.1mm", "disc.mesh_density=3"];
    for placement in ["damping.at=all", "damping.at=beads"] {
        let long = scene(&[&coarse[..], &[placement, "duration=120us"]].concat());
        let short = Scene { duration: 1e-6, ..long.clone() };
        let by_sum = run(&long);
        let by_steps = model::prepare(&short).unwrap().run(&long, &mut |_| true).unwrap();
        let (sum, steps) = (pressure(&by_sum), pressure(&by_steps));
        let difference: Vec<f64> = sum.iter().zip(steps).map(|(a, b)| a - b).collect();
        // Rounding, magnified by the hits.
        assert!(peak(&difference) < 1e-7 * peak(steps), "{placement}: {:e} of {:e}", peak(&difference), peak(steps));
        assert!(peak(steps) > 100.0 && by_sum.energy.disc_j.is_none());
        assert!(imbalance(&by_sum).abs() < 0.01 && imbalance(&by_steps).abs() < 0.01);
    }
}

#[test]
fn a_dashpot_at_the_disc_makes_no_line_above_what_the_source_sends() {
    for amplitude in ["drive.amplitude=0.5um", "drive.amplitude=3.96um"] {
        let response = run(&scene(&[amplitude, "output_step=25ns"]));
        let pressure = pressure(&response);
        let (sound, above) = (band(pressure, 25e-9, 20e3, 1.2e6), band(pressure, 25e-9, 10e6, 20e6));
        // The force jumps at first touch, so there is a continuum that falls with frequency, 2.6 % here; lines would stand out of it.
        assert!(above < 0.05 * sound, "{amplitude}: {above} Pa above 10 MHz, {sound} Pa to 1.2 MHz");
        // A touch lasts: the force does not chatter.
        let force = &response.contact_force[6].values;
        let touched: Vec<usize> = (1..force.len()).filter(|&i| force[i - 1] == 0.0 && force[i] > 0.0).collect();
        let short = touched.iter().filter(|&&from| force[from..].iter().take(8).any(|force| *force == 0.0));
        assert!(touched.len() > 5 && short.count() == 0, "{amplitude}: {touched:?}");
        assert!(imbalance(&response).abs() < 0.01, "{:e}", imbalance(&response));
    }
}

#[test]
fn a_free_disc_that_drifts_off_is_reported_with_its_time() {
    let warned = |rim: &str| {
        let scene = scene(&[rim, "drive.amplitude=0.5um"]);
        let prepared = model::prepare(&scene).unwrap();
        let response = prepared.run(&scene, &mut |_| true).unwrap();
        prepared.warnings(&scene, &response)
    };
    let free = warned("disc.rim=free");
    assert!(free.len() == 1 && free[0].contains("drifted off") && free[0].contains(" µs of 450 µs"), "{free:?}");
    assert_eq!(warned("disc.rim=clamped"), [""; 0]);
}

#[test]
fn ten_milliseconds_of_an_undamped_chain_hold_no_more_than_the_piston_gave() {
    let scene = scene(&["damping.kind=none", "drive.amplitude=0.5um", "duration=10ms", "output_step=1us"]);
    let response = run(&scene);
    let energy = &response.energy;
    let held = energy.kinetic_j + energy.stored_j + energy.disc_j.unwrap() + energy.water_j.unwrap();
    // What is left is the error of velocity Verlet at contacts that open and close.
    assert!(held <= 1.005 * energy.piston_work_j, "{held:e} of {:e}", energy.piston_work_j);
    assert!(imbalance(&response).abs() < 0.01 && energy.dissipated_j == 0.0, "{:e}", imbalance(&response));
    assert!(pressure(&response).iter().all(|p| p.is_finite()));
}

#[test]
fn a_precompressed_chain_rests_until_it_is_driven() {
    let still = run(&scene(&["chain.precompression=1N", "drive.amplitude=0", "duration=20us"]));
    // Forces balance to rounding of 1 N; a bead of 4 mg then moves by less than 1e-18 m in 20 us.
    assert!(peak(pressure(&still)) < 1e-6 && peak(&still.bead_displacement[5].values) < 1e-16);
    assert!(still.contact_force.iter().all(|force| (force.values[200] - 1.0).abs() < 1e-9));
    let driven = run(&scene(&["chain.precompression=1N", "drive.amplitude=0.1um", "damping.kind=none"]));
    // The piston takes back most of what it gives: the residual is held against the largest energy.
    let residual = driven.energy.residual_j / driven.energy.largest_j;
    assert!(residual.abs() < 1e-3 && peak(pressure(&driven)) > 100.0, "{residual:e}");
    let free = scene(&["chain.precompression=1N", "disc.rim=free"]);
    assert!(model::run(&free, &mut |_| true).unwrap_err().to_string().contains("free disc"));
}

#[test]
fn a_disc_in_vacuum_has_no_pressure_and_keeps_its_energy() {
    let response = run(&scene(&["water.medium=none", "damping.at=beads", "duration=200us"]));
    let disc = response.disc.as_ref().unwrap();
    assert!(disc.pressure.is_empty() && peak(&disc.velocity.values) > 0.0);
    let work = response.energy.piston_work_j;
    assert!(response.energy.water_j.unwrap().abs() < 1e-9 * work && imbalance(&response).abs() < 0.01);
}

#[test]
fn a_coarse_clock_or_mesh_and_a_point_at_a_soft_edge_are_warned_of() {
    let warnings = |overrides: &[&str]| {
        let scene = scene(&[overrides, &["duration=1us", "disc.mesh_density=2"]].concat());
        let prepared = model::prepare(&scene).unwrap();
        let response = prepared.run(&scene, &mut |_| true).unwrap();
        prepared.warnings(&scene, &response)
    };
    assert_eq!(warnings(&[]), [""; 0]);
    let clock = warnings(&["model.step=100ns"]);
    assert!(clock.len() == 1 && clock[0].contains("0.5 MHz") && clock[0].contains("`model.step`"), "{clock:?}");
    let elements = ["water.method=elements", "water.mesh_side=0.2mm"];
    let mesh = warnings(&elements);
    assert!(mesh.len() == 1 && mesh[0].contains("0.5 MHz") && mesh[0].contains("`water.mesh_side`"), "{mesh:?}");
    let edge = ["water.method=elements", "water.baffle=soft", "water.field_points=[{r=1e-3,z=0.1e-3}]"];
    let edge = warnings(&edge);
    assert!(edge.len() == 1 && edge[0].contains("r = 1 mm, z = 0.1 mm"), "{edge:?}");
    let refused = model::prepare(&scene(&["contact.law=finite-body"])).unwrap_err().to_string();
    assert!(refused.contains("contact.law") && refused.contains("hertz"), "{refused}");
}

#[test]
fn losses_take_what_their_law_says_and_nothing_where_there_are_none() {
    let base = ["duration=250us", "damping.at=beads", "water.field_points=[{z=1e-3}]"];
    let lossless = run(&scene(&base));
    // 20 dB/cm at 1 MHz of a first power over 1 mm: e^(−0.230) of what is at 1 MHz, e^(−0.0168) at 73 kHz.
    let lossy = run(&scene(&[&base[..], &["water.absorption=20 dB/cm", "water.absorption_exponent=1"]].concat()));
    let level = |response: &Response, from, to| band(pressure(response), 1e-7, from, to);
    for (from, to) in [(50e3, 100e3), (0.9e6, 1.1e6)] {
        let kept = level(&lossy, from, to) / level(&lossless, from, to);
        let expected = (-2000.0 * std::f64::consts::LN_10 / 20.0 * 1e-3 * 0.5 * (from + to) / 1e6).exp();
        assert!((kept / expected - 1.0).abs() < 0.01, "{from}: {kept} {expected}");
    }
    assert_eq!(lossy.bead_velocity, lossless.bead_velocity);
}

#[test]
fn both_ways_hear_the_same_of_a_chain_with_a_dashpot_at_the_disc() {
    let common = ["duration=100us", "disc.mesh_density=4"];
    let by_integral = run(&scene(&common));
    let by_elements = run(&scene(&[&common[..], &["water.method=elements", "water.mesh_side=0.05mm"]].concat()));
    let difference: Vec<f64> =
        pressure(&by_integral).iter().zip(pressure(&by_elements)).map(|(one, other)| one - other).collect();
    let (level, apart) = (band(pressure(&by_integral), 1e-7, 20e3, 1.2e6), band(&difference, 1e-7, 20e3, 1.2e6));
    // 1.45 % measured: the mesh of the water, and hits that it moves.
    assert!(apart < 0.05 * level, "{apart} of {level} Pa");
}
