//! Striker, gravity, foundation and sensor bead, against closed forms.

use granchain_model::{
    self as model, ModelError,
    analytical::{Collision, DiscretePulse},
    chain::{
        ChainModel, InitialState,
        ensemble::{Ensemble, Variation},
    },
    contact_law::{Hertz, bead_flat_stiffness, bead_pair_stiffness, plate_on_half_space},
    response::Response,
    scene::{self, FlatContact, Plate, Scene, Support},
};
use granchain_signal::Series;

/// The built-in column, changed.
pub fn column(overrides: &[&str]) -> Scene {
    let all: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    scene::load("impact", &all).unwrap()
}

/// A level row of equal steel beads in nothing but one another's way.
pub fn row(overrides: &[&str]) -> Scene {
    column(
        &[&["chain.gravity=0", "support.kind=free", "chain.override=[]", "model.tolerance=1e-12"], overrides].concat(),
    )
}

/// A run whose energy balance closes to the integrator's tolerance.
pub fn run(scene: &Scene) -> Response {
    let response = model::run(scene, &mut |_| true).unwrap();
    let energy = &response.energy;
    assert!(energy.residual_j.abs() <= 1e-7 * energy.largest_j, "{energy:?}");
    response
}

/// Rate of change at the last two samples.
fn last_rate(series: &Series) -> f64 {
    let [.., before, last] = series.values[..] else { panic!("two samples") };
    (last - before) / series.step
}

/// Largest value and its instant, by a parabola through three samples.
pub fn crest(series: &Series) -> (f64, f64) {
    let top = (0..series.len()).max_by(|a, b| series.values[*a].total_cmp(&series.values[*b])).unwrap();
    let [before, here, after] = [top - 1, top, top + 1].map(|index| series.values[index]);
    let shift = 0.5 * (before - after) / (before - 2.0 * here + after);
    (series.time(top) + shift * series.step, here - 0.25 * (before - after) * shift)
}

#[test]
fn a_striker_on_one_bead_is_hertz_s_collision() {
    let sets = ["chain.beads=1", "chain.sensor=1", "drive.radius=6 mm", "drive.material=glass", "drive.mass=5 g"];
    let scene = row(&[&sets[..], &["duration=200 us", "output_step=50 ns"]].concat());
    let (striker, velocity) = scene.drive.kind.striker().unwrap();
    let (bead, response) = (&scene.chain.beads[0], run(&scene));
    // The mass that was asked for, to rounding.
    assert!((striker.mass() / 5e-3 - 1.0).abs() < 1e-14 && velocity == 0.26);
    let reduced_mass = striker.mass() * bead.mass() / (striker.mass() + bead.mass());
    let collision = Collision { reduced_mass, hertz_stiffness: bead_pair_stiffness(striker, bead), speed: velocity };
    assert!((scene.drive.frequency * collision.duration() - 1.0).abs() < 1e-12);
    let (time, force) = crest(&response.contact_force[0]);
    // The parabola through samples a thousandth of the contact apart.
    assert!((force / collision.largest_force() - 1.0).abs() < 1e-6, "{force}");
    assert!((2.0 * time / collision.duration() - 1.0).abs() < 1e-6, "{time}");
    // Tolerance of the integrator.
    let after = 2.0 * striker.mass() * velocity / (striker.mass() + bead.mass());
    assert!((response.bead_velocity[0].values.last().unwrap() / after - 1.0).abs() < 1e-8);
    let back = velocity * (striker.mass() - bead.mass()) / (striker.mass() + bead.mass());
    assert!((last_rate(&response.piston_displacement) / back - 1.0).abs() < 1e-7);
    // Nothing is behind the bead, so the sensor reads half the one contact.
    assert_eq!(response.sensor_force.unwrap().values[900], 0.5 * response.contact_force[0].values[900]);
}

#[test]
fn a_row_keeps_the_momentum_and_the_energy_of_its_striker() {
    for mass in ["10 g", "28 g", "90 g"] {
        let scene = row(&["chain.override=[{ bead = 4, mass = \"30 g\" }]", &format!("drive.mass={mass}")]);
        let (striker, velocity) = scene.drive.kind.striker().unwrap();
        let response = run(&scene);
        let beads = scene.chain.beads.iter().zip(&response.bead_velocity);
        let after = beads.map(|(bead, v)| bead.mass() * v.values.last().unwrap()).sum::<f64>()
            + striker.mass() * last_rate(&response.piston_displacement);
        assert!((after / (striker.mass() * velocity) - 1.0).abs() < 1e-8, "{mass}: {after}");
        let brought = 0.5 * striker.mass() * velocity * velocity;
        assert!((response.energy.initial_j / brought - 1.0).abs() < 1e-14);
        assert!((response.energy.kinetic_j + response.energy.stored_j) / brought - 1.0 < 1e-8);
        assert_eq!((response.energy.channels, response.work.gravity_evaluations), (None, 0));
        assert_eq!(response.bead_velocity.len() + 1, response.contact_force.len());
    }
}

#[test]
fn a_drop_height_is_the_velocity_of_its_fall_and_alpha_scales_it() {
    let scene = column(&["drive.height=3.4 mm"]);
    let (_, velocity) = scene.drive.kind.striker().unwrap();
    assert!((velocity - (2.0 * 9.81 * 3.4e-3f64).sqrt()).abs() < 1e-15);
    let peak = |sets: &[&str]| crest(&run(&row(sets)).contact_force[9]).1;
    // The same run, scaled; the integrator's tolerance.
    assert!((peak(&["alpha=2"]) / peak(&["drive.velocity=0.52"]) - 1.0).abs() < 1e-9);
    let text = scene.to_toml();
    assert_eq!(scene::load_text(&text, "/elsewhere/impact.toml".as_ref(), &[]).unwrap().scene, scene);
}

#[test]
fn a_column_begins_in_equilibrium_under_its_weight_and_stays_there() {
    let still = ["drive.kind=sine", "drive.amplitude=0", "drive.frequency=10 kHz", "drive.cycles=1"];
    for support in ["foundation", "rigid", "spring", "half-space"] {
        let kind = format!("support.kind={support}");
        let mut sets = [&still[..], &["chain.precompression=0.2", kind.as_str()]].concat();
        sets.extend((support == "spring").then_some("support.stiffness=1e6"));
        let scene = column(&sets);
        let response = run(&scene);
        let mut weight = 0.2;
        for (contact, force) in response.contact_force.iter().enumerate() {
            // Rounding of a force of some newtons by its overlap, twice 3/2 powers; over 3 ms it does not grow.
            let drift = force.values.iter().map(|value| (value / weight - 1.0).abs()).fold(0.0, f64::max);
            assert!(drift < 1e-9, "{support}, contact {}: {drift:e}", contact + 1);
            weight += 9.81 * scene.chain.beads.get(contact).map_or(0.0, |bead| bead.mass());
        }
        assert!(response.work.gravity_evaluations > 0);
    }
}

#[test]
fn a_striker_that_arrives_weighs_on_nothing() {
    let scene = column(&[]);
    let response = run(&scene);
    let first: Vec<f64> = response.contact_force.iter().map(|force| force.values[0]).collect();
    assert_eq!(first[0], 0.0);
    // Rounding of the overlap.
    assert!((first[1] / (9.81 * scene.chain.beads[0].mass()) - 1.0).abs() < 1e-12, "{}", first[1]);
}

#[test]
fn beads_of_a_column_that_friction_holds_do_not_slip() {
    // Weight above friction: only contacts and weight together leave the bead at rest.
    let still = ["drive.kind=sine", "drive.amplitude=0", "drive.frequency=10 kHz", "drive.cycles=1"];
    let response = run(&column(&[&still[..], &["holder.friction_force=50 mN"]].concat()));
    assert!(response.bead_velocity.iter().all(|velocity| velocity.values.iter().all(|v| *v == 0.0)));
    assert_eq!(response.work.friction_turns, 0);
}

#[test]
fn a_striker_that_left_the_column_falls_back_as_bodies_fall() {
    let response = run(&column(&["duration=20 ms", "model.tolerance=1e-12"]));
    let (force, height) = (&response.contact_force[0].values, &response.piston_displacement.values);
    let away: Vec<usize> = (1..force.len() - 1).filter(|i| force[i - 1..=i + 1].iter().all(|f| *f == 0.0)).collect();
    assert!(away.len() > 10_000, "{}", away.len());
    for i in [away[100], away[5000]] {
        // Second difference over 200 µs of a displacement of some 0.1 mm with sixteen digits.
        let fall = (height[i + 100] - 2.0 * height[i] + height[i - 100]) / 1e-8;
        let flies = force[i - 100..=i + 100].iter().all(|f| *f == 0.0);
        assert!(!flies || (fall / 9.81 - 1.0).abs() < 1e-6, "{fall}");
    }
}

#[test]
fn a_foundation_of_the_bead_s_own_material_is_the_half_space() {
    let (foundation, half_space) = (
        run(&column(&["support.youngs_modulus=200 GPa", "support.poissons_ratio=0.29"])),
        run(&column(&["support.kind=half-space"])),
    );
    assert_eq!(foundation, half_space);
}

#[test]
fn the_stiffness_of_a_plate_on_a_half_space_is_its_hankel_integral() {
    // w(0) = (1/2π) ∫ dκ/(D κ³ + E′/2), κ = b tan θ with b³ = E′/2D.
    let (bending, modulus) = (7.7f64, 40e6f64);
    let b = libm::cbrt(modulus / (2.0 * bending));
    let panels = 20_000;
    let width = 0.5 * std::f64::consts::PI / f64::from(panels);
    let sum = |i: i32| {
        let (sin, cos) = ((f64::from(i) + 0.5) * width).sin_cos();
        b * cos / (bending * b.powi(3) * (sin.powi(3) + cos.powi(3)))
    };
    let deflection = (0..panels).map(sum).sum::<f64>() * width / (2.0 * std::f64::consts::PI);
    // Midpoint rule: second order in 1e-4.
    assert!((plate_on_half_space(bending, modulus) * deflection - 1.0).abs() < 1e-7);
}

/// Rate (1/s) at which the vibration of one bead dies that is pressed between a rigid piston and a foundation.
fn decay(support: Support) -> f64 {
    let mut scene = column(&["drive.kind=sine", "drive.amplitude=0", "drive.frequency=10 kHz", "drive.cycles=1"]);
    scene.chain.beads.truncate(1);
    (scene.chain.gaps, scene.chain.gravity, scene.chain.sensor) = (vec![0.0; 2], 0.0, None);
    (scene.chain.precompression, scene.support) = (50.0, support);
    (scene.duration, scene.output_step) = (4e-3, 2e-7);
    let kicked = InitialState { displacements: vec![0.0], velocities: vec![1e-6] };
    let velocity = &ChainModel.run_from(&scene, &kicked, &mut |_| true).unwrap().bead_velocity[0];
    let size = |index: usize| velocity.values[index].abs();
    let tops: Vec<usize> =
        (1..velocity.len() - 1).filter(|i| size(*i) > size(i - 1) && size(*i) >= size(i + 1)).take(30).collect();
    let (first, last) = (tops[0], tops[29]);
    (size(first) / size(last)).ln() / (velocity.time(last) - velocity.time(first))
}

#[test]
fn the_loss_of_a_foundation_is_that_of_its_modulus() {
    let (tau, force) = (2e-6, 50.0f64);
    let bead = column(&[]).chain.beads[0].clone();
    let foundation = |plate| Support::Foundation { youngs_modulus: 20e9, poissons_ratio: 0.3, loss_time: tau, plate };
    let plane = 20e9 / (1.0 - 0.3f64.powi(2));
    // Of Hertz' contact K = (3/2) k^(2/3) F^(1/3), E*/E′ of it the half-space's; decay K τ E*/E′/2m.
    let half_space = Hertz { stiffness: bead_flat_stiffness(&bead, FlatContact::Rigid) };
    let own = 1.0 / (4.0 / 3.0 * bead.radius.sqrt() / half_space.stiffness + 1.0 / plane);
    let stiffness = 4.0 / 3.0 * own * bead.radius.sqrt();
    let tangent = 1.5 * stiffness.powf(2.0 / 3.0) * force.cbrt();
    let expected = 0.5 * tangent * tau * own / plane / bead.mass();
    let found = decay(foundation(None));
    // Tops to a sample of a vibration of a hundred, and an overlap that varies by its amplitude.
    assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
    // Beneath a plate K goes as E^(2/3).
    let thickness = 4e-3;
    let material = scene::Material::glass();
    let bending =
        material.youngs_modulus * thickness * thickness * thickness / (12.0 * (1.0 - material.poissons_ratio.powi(2)));
    let expected = plate_on_half_space(bending, plane) * tau / 3.0 / bead.mass();
    let found = decay(foundation(Some(Plate { thickness, material })));
    assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
}

#[test]
fn a_sensor_bead_reads_the_mean_of_its_contacts() {
    let scene = row(&["chain.beads=30", "chain.sensor=20", "duration=2 ms", "output_step=0.2 us"]);
    let response = run(&scene);
    let (_, peak) = crest(&response.contact_force[19]);
    let (time, read) = crest(response.sensor_force.as_ref().unwrap());
    // When the bead is fastest both contacts stand half a diameter from the crest: of the discrete pulse, which a short row has formed to 1e-3.
    let expected = DiscretePulse::solve().force(0.5);
    assert!((read / peak / expected - 1.0).abs() < 1e-3, "{} {expected}", read / peak);
    let (fastest, _) = crest(&response.bead_velocity[19]);
    assert!((time / fastest - 1.0).abs() < 1e-3);
    // It is a reader: nothing else changes, and without it there is nothing.
    let mut without = scene;
    without.chain.sensor = None;
    let without = run(&without);
    assert_eq!(without.sensor_force, None);
    assert_eq!(Response { sensor_force: None, ..response }, without);
}

#[test]
fn the_reduced_model_strikes_as_the_chain_does() {
    let sets = ["chain.beads=4", "chain.sensor=2", "duration=400 us", "model.kind=reduced", "model.mesh_density=8"];
    let mut scene = row(&["chain.beads=4", "chain.sensor=2", "duration=400 us"]);
    let chain = run(&scene);
    scene = column(&[&["chain.gravity=0", "support.kind=free", "chain.override=[]"], &sets[..]].concat());
    let reduced = model::run(&scene, &mut |_| true).unwrap();
    assert!(reduced.energy.residual_j.abs() < 1e-3 * reduced.energy.largest_j, "{:?}", reduced.energy);
    let crests = [&chain, &reduced].map(|response| crest(response.sensor_force.as_ref().unwrap()));
    // Bodies are stiffer by their finite size and a mesh of density 8 has its own error: a per cent of each.
    assert!(
        (crests[1].0 / crests[0].0 - 1.0).abs() < 0.01 && (crests[1].1 / crests[0].1 - 1.0).abs() < 0.02,
        "{crests:?}"
    );
    let last = |response: &Response| *response.bead_velocity[3].values.last().unwrap();
    assert!((last(&reduced) / last(&chain) - 1.0).abs() < 0.01, "{} {}", last(&reduced), last(&chain));
}

#[test]
fn what_a_model_or_a_bench_does_not_have_is_refused_by_name() {
    for (sets, part) in [
        (&["model.kind=reduced", "support.kind=rigid"][..], "gravity (`chain.gravity`)"),
        (&["model.kind=reduced", "chain.gravity=0"], "a foundation (`support.kind`)"),
        (&["model.kind=fea"], "a striker (`drive.kind`)"),
        (&["contact.law=finite-body"], "a striker (`drive.kind`)"),
        (&["support.kind=disc", "water.medium=none"], "a striker (`drive.kind`)"),
        (&["support.kind=free"], "0 m/s² before a free end"),
        (&["chain.gaps=1 um"], "0 m under gravity"),
        (&["chain.precompression=1 N"], "0 N where a striker drives"),
    ] {
        let error = model::run(&column(sets), &mut |_| true).unwrap_err();
        assert!(error.to_string().contains(part), "{sets:?}: {error}");
        assert!(!matches!(error, ModelError::Stopped { .. }));
    }
}

#[test]
fn runs_side_by_side_of_a_struck_column_are_those_of_the_chain_alone() {
    let scene = column(&["duration=1 ms"]);
    let ensemble = Ensemble::new(&scene, Ensemble::STEPS_PER_PERIOD).unwrap();
    let mut shaken = Variation::of(&scene);
    // Gravity closes the gaps that a run draws.
    shaken.gap_offsets.fill(1e-9);
    let softer = Variation { support_stiffness_factor: 0.5, ..Variation::of(&scene) };
    let runs: Vec<Series> =
        ensemble.run(&[Variation::of(&scene), shaken, softer]).into_iter().map(Result::unwrap).collect();
    assert_eq!(runs[0], runs[1]);
    let pole = |scene: &Scene| run(scene).pole_velocity;
    let last = |series: &Series, time: f64| series.values[(time / series.step).round() as usize];
    let soft = column(&["duration=1 ms", "support.youngs_modulus=30 MPa"]);
    for (found, alone) in [(&runs[0], pole(&scene)), (&runs[2], pole(&soft))] {
        // Samples half a microsecond apart at most, the velocity by 0.2 m/s in 50 µs.
        let (found, alone) = (last(found, 0.9e-3), last(&alone, 0.9e-3));
        assert!((found - alone).abs() < 2e-3, "{found} {alone}");
    }
}
