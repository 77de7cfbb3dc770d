//! Time stepping of the contact finite element analysis: books, contact conditions, schemes, cut steps, saved states.

use crate::fea_bench::{finish, mean_velocities, push, run, scene, still, thrown};
use granchain::{
    model::fea::{
        Control, FeaError, Simulation, Snapshot,
        assembly::{Direction, DofMap},
        control::{Cause, PENETRATION},
    },
    response::Response,
    scene::PistonMotion,
};

fn balance(density: u32, step: &str) -> f64 {
    let scene = scene("rigid", &[&format!("model.mesh_density={density}"), &format!("model.step={step}")]);
    run(&scene).0.balance().balance()
}

#[test]
fn work_in_is_stored_or_kinetic_up_to_an_error_of_second_order_in_the_step() {
    let [coarse, middle, fine] = ["0.1 us", "0.05 us", "0.02 us"].map(|step| balance(8, step));
    assert!(coarse < 4e-3 && middle < coarse && fine < 2e-4, "{coarse:e} {middle:e} {fine:e}");
    // While no point opens or closes, energy is exact; what is made or lost is λ g of points that do within a step, h² in sum. The worst
    // of some hundred contacts scatters by some tens of per cent from one step size to the next: 0.3 in the slope over a factor of 5.
    let slope = (coarse / fine).ln() / 5f64.ln();
    assert!((slope - 2.0).abs() < 0.3, "{slope}");
}

#[test]
fn points_of_every_contact_neither_penetrate_nor_pull_in_any_step() {
    for name in ["rigid", "annulus"] {
        let scene = scene(name, &["model.mesh_density=4", "duration=90 us"]);
        let mut simulation = Simulation::new(&scene, Control::default()).unwrap();
        let body = simulation.arrangement().kinds[0].clone();
        let nodes = |boundary: &str| body.mesh().boundary(boundary).unwrap().nodes.clone();
        let (front, back) = (nodes("front"), nodes("back"));
        let axial = |node: u32| DofMap::dof(node, Direction::Axial);
        let depth = |node: u32| {
            let r = body.mesh().nodes[node as usize][0];
            0.5e-3 - (0.25e-6 - r * r).sqrt()
        };
        let mut pressed = 0;
        while !simulation.is_done() {
            simulation.advance().unwrap();
            let motion = simulation.motion();
            // Gaps again from displacements and the circle, for the piston and the first two beads. The pole itself is no point of the
            // contact: its tributary area is zero, and it may overlap by a fraction of a nanometre.
            for &node in &front[1..] {
                let gap = depth(node) + motion.displacement(1, axial(node)) - simulation.piston();
                assert!(gap > -PENETRATION, "{gap:e}");
            }
            for (&b, &f) in back.iter().zip(&front).skip(1) {
                let gap = depth(b) + depth(f) + motion.displacement(2, axial(f)) - motion.displacement(1, axial(b));
                assert!(gap > -PENETRATION, "{gap:e}");
            }
            for contact in simulation.contacts() {
                assert!(contact.forces.iter().all(|&force| force >= 0.0) && contact.total() >= 0.0);
                pressed += usize::from(contact.pressing > 0.0);
            }
        }
        let found = simulation.complementarity();
        assert!(found.penetration_m < PENETRATION && found.adhesion_n == 0.0 && found.violations == 0, "{found:?}");
        // λ g is rounding: 1 N times the rounding of 1 µm.
        assert!(found.product_j < 1e-20, "{found:?}");
        assert!(pressed > 1000, "{pressed}");
    }
}

/// Force of a piston at 0.1 m/s that hits a bead at rest, every 0.1 µs of the 4.2 µs it lasts: a bead thrown on a rigid flat, seen from it.
fn hit(step: f64) -> Vec<f64> {
    let step = format!("model.step={step} us");
    let overrides =
        ["chain.beads=1", "chain.gaps={contact2=\"10 um\"}", "duration=5 us", "model.mesh_density=4", &step];
    let control = Control { contact_energy: f64::INFINITY, halvings: 0 };
    let mut simulation = Simulation::with_motion(&scene("rigid", &overrides), push(0.1, 1.0), control).unwrap();
    finish(&mut simulation).unwrap().contact_force.remove(0).values
}

#[test]
fn the_error_of_the_force_falls_with_the_step() {
    let reference = hit(0.00125);
    let peak = reference.iter().copied().fold(0.0, f64::max);
    // rms over the whole of the contact over the peak force.
    let error = |step: f64| {
        let force = hit(step);
        let sum: f64 = force.iter().zip(&reference).map(|(a, b)| (a - b).powi(2)).sum();
        (sum / force.len() as f64).sqrt() / peak
    };
    let errors = [0.1, 0.05, 0.02, 0.01, 0.005].map(error);
    // A tenth for the chance of single points.
    assert!(errors.windows(2).all(|pair| pair[1] < 1.1 * pair[0]), "{errors:?}");
    assert!(errors[4] < 0.3 * errors[0], "{errors:?}");
}

#[test]
fn hht_dissipates_little() {
    // Energy that is missing at 80 µs over the piston's work until then.
    let lost = |more: &[&str]| {
        let overrides = [&["model.mesh_density=8", "duration=80 us"], more].concat();
        let energy = run(&scene("rigid", &overrides)).1.energy;
        energy.residual_j / energy.piston_work_j
    };
    let (trapezoid, hht) = (lost(&[]), lost(&["model.integrator=hht", "model.numerical_dissipation=0.1"]));
    // Second order: 0.25 %, most of it the trapezoid's own 0.12 %.
    assert!(hht > 1.5 * trapezoid.abs() && hht < 0.005, "{trapezoid} {hht}");
}

/// A state of a run as one of half the step has it: twice the steps taken, and the far pole followed at each of them.
fn for_half_step(snapshot: &Snapshot) -> Snapshot {
    let mut state = serde_json::to_value(snapshot).unwrap();
    let taken = 2 * state["taken"].as_u64().unwrap();
    state["taken"] = taken.into();
    let trace = &mut state["trace"];
    trace["sampling"]["steps_per_sample"] = (2 * trace["sampling"]["steps_per_sample"].as_u64().unwrap()).into();
    trace["pole"] = (0..=taken as usize).map(|step| trace["pole"][step / 2].clone()).collect();
    serde_json::from_value(state).unwrap()
}

#[test]
fn a_cut_step_ends_where_two_steps_of_half_the_size_end() {
    let overrides = ["model.mesh_density=4", "duration=40 us"];
    let control = Control { contact_energy: 2e-4, halvings: 1 };
    let mut whole = Simulation::new(&scene("rigid", &overrides), control).unwrap();
    let halves = scene("rigid", &[&overrides[..], &["model.step=0.05 us"]].concat());
    let mut halves = Simulation::new(&halves, Control::default()).unwrap();
    let mut compared = 0;
    while !whole.is_done() {
        let (before, cuts) = (whole.snapshot(""), whole.cuts().len());
        whole.advance().unwrap();
        if whole.cuts().len() == cuts {
            continue;
        }
        let cut = whole.cuts()[cuts];
        assert!(
            (cut.time_s - (whole.time() - 1e-7)).abs() < 1e-18
                && cut.step_s == 1e-7
                && cut.cause == Cause::ContactEnergy
        );
        halves.restore(for_half_step(&before), "").unwrap();
        halves.advance().unwrap();
        halves.advance().unwrap();
        compared += 1;
        assert_eq!(halves.contacts(), whole.contacts());
        for slot in 1..=6 {
            let (u, v, _) = whole.motion().columns(slot).unwrap();
            let (u_halves, v_halves, _) = halves.motion().columns(slot).unwrap();
            assert!(u.as_slice() == u_halves.as_slice() && v.as_slice() == v_halves.as_slice());
        }
    }
    assert!(compared >= 3, "{compared}");
}

#[test]
fn a_step_that_cannot_work_is_taken_back_and_says_when_where_and_why() {
    // 20 m/s press a bead several µm into the piston: wider than its fine patch.
    let scene = scene("rigid", &["model.mesh_density=4", "duration=10 us"]);
    let fails = |halvings: u32| {
        let control = Control { halvings, ..Control::default() };
        let mut simulation = Simulation::with_motion(&scene, push(20.0, 1.0), control).unwrap();
        loop {
            let before = simulation.snapshot("");
            if let Err(failure) = simulation.advance() {
                return (failure, before, simulation);
            }
        }
    };
    let (failure, before, simulation) = fails(0);
    let FeaError::StepGivenUp { time, step, contact, cause } = failure else { panic!("{failure}") };
    assert_eq!((time, step, contact, cause), (simulation.time(), 1e-7, 1, Cause::PatchExceeded));
    assert!(time > 0.0 && time < 1e-6, "{time:e}");
    // Nothing moved, nothing was booked; the cut and the rejected step are on record.
    let [before, after] = [before, simulation.snapshot("")].map(|snapshot| serde_json::to_value(&snapshot).unwrap());
    for part in ["taken", "motion", "contacts", "trace", "complementarity"] {
        assert_eq!(before[part], after[part], "{part}");
    }
    assert_eq!(simulation.cuts().len(), 1);
    assert_eq!(simulation.balance().work.rejected_steps, 1);
    let message = failure.to_string();
    for part in ["contact 1", "finely meshed patch", "model.mesh_density"] {
        assert!(message.contains(part), "{message}");
    }

    let (failure, _, simulation) = fails(2);
    let FeaError::StepGivenUp { time: later, step, .. } = failure else { panic!("{failure}") };
    assert!(step == 2.5e-8 && later >= time && later < time + 1e-7, "{later:e} {step:e}");
    let sizes: Vec<f64> = simulation.cuts().iter().map(|cut| cut.step_s).collect();
    assert_eq!((sizes[0], sizes[1]), (1e-7, 5e-8));
    assert!(simulation.cuts().iter().all(|cut| cut.cause == Cause::PatchExceeded && cut.contact == 1));
}

#[test]
fn a_state_saved_as_json_ends_in_the_bits_of_the_uninterrupted_run() {
    let overrides = ["model.mesh_density=4", "duration=60 us", "output_step=0.2 us"];
    for (name, more) in [
        ("rigid", ["model.integrator=hht", "model.numerical_dissipation=0.1"]),
        ("annulus", ["damping.tension=true", "alpha=1"]),
    ] {
        let scene = scene(name, &[&overrides[..], &more[..]].concat());
        let (whole, expected) = run(&scene);
        let mut first = Simulation::new(&scene, Control::default()).unwrap();
        // An odd number of steps: between two samples.
        (0..333).for_each(|_| first.advance().unwrap());
        let text = serde_json::to_string(&first.snapshot("run 7")).unwrap();
        let mut second = Simulation::new(&scene, Control::default()).unwrap();
        let other = second.restore(serde_json::from_str(&text).unwrap(), "run 8");
        assert!(matches!(other, Err(FeaError::OtherState { .. })));
        second.restore(serde_json::from_str(&text).unwrap(), "run 7").unwrap();
        assert_eq!(finish(&mut second).unwrap(), expected);
        assert_eq!(second.complementarity(), whole.complementarity());
        assert_eq!(second.balance(), whole.balance());
    }
}

/// Trapezoid sum of a force sampled at every step, N·s, up to each sample.
fn impulses(response: &Response, contact: usize) -> Vec<f64> {
    let force = &response.contact_force[contact];
    let mut sum = 0.0;
    let mut sums = vec![0.0];
    sums.extend(force.values.windows(2).map(|pair| {
        sum += 0.5 * force.step * (pair[0] + pair[1]);
        sum
    }));
    sums
}

#[test]
fn momentum_is_the_impulse_of_piston_and_support() {
    for name in ["rigid", "annulus"] {
        let scene = scene(name, &["model.mesh_density=4", "duration=60 us"]);
        let mut simulation = Simulation::new(&scene, Control::default()).unwrap();
        let mass = simulation.arrangement().kinds[0].total_mass();
        let mut momentum = vec![0.0];
        while !simulation.is_done() {
            simulation.advance().unwrap();
            momentum.push(mass * mean_velocities(&simulation).iter().sum::<f64>());
        }
        let response = simulation.response();
        let (first, last) = (impulses(&response, 0), impulses(&response, 6));
        let largest = first.iter().copied().fold(0.0, f64::max);
        assert!(largest > 1e-7, "{largest:e}");
        for (step, momentum) in momentum.iter().enumerate() {
            // The trapezoid's own sum: only rounding of 600 steps is left.
            let error = (momentum - (first[step] - last[step])).abs();
            assert!(error < 1e-9 * largest, "{name} step {step}: {error:e} of {largest:e}");
        }
    }
}

#[test]
fn dashpots_and_a_spring_support_take_their_part_of_the_work() {
    let kinds = ["linear", "kuwabara-kono", "linear+kuwabara-kono"];
    for kind in kinds {
        for tension in [false, true] {
            let (kind, tension) = (format!("damping.kind={kind}"), format!("damping.tension={tension}"));
            let overrides = [
                "model.mesh_density=4",
                "duration=60 us",
                "support.kind=spring",
                "support.stiffness=1e6 N/m",
                &kind,
                &tension,
            ];
            let (simulation, response) = run(&scene("rigid", &overrides));
            let energy = response.energy;
            assert!(energy.dissipated_j > 0.1 * energy.piston_work_j && energy.stored_j > 0.0);
            // As without dashpots at this mesh, 4.2e-3, and a fifth for the steps in which a dashpot switches.
            assert!(simulation.balance().balance() < 5e-3, "{:e}", simulation.balance().balance());
        }
    }
}

/// A motion twice as large and twice as slow.
struct Doubled(Box<dyn PistonMotion>, Vec<f64>);

impl PistonMotion for Doubled {
    fn on_piece(&self, piece: usize, t: f64) -> (f64, f64) {
        let (displacement, velocity) = self.0.on_piece(piece, 0.5 * t);
        (2.0 * displacement, velocity)
    }

    fn breaks(&self) -> &[f64] {
        &self.1
    }
}

#[test]
fn a_bench_of_twice_the_size_does_the_same_in_twice_the_time() {
    // Elasticity and contact know no length: velocities stay, forces grow fourfold, energies eightfold. Powers of two leave every bit.
    let small = scene("rigid", &["model.mesh_density=4", "duration=60 us"]);
    let large = scene(
        "rigid",
        &["model.mesh_density=4", "duration=120 us", "output_step=0.2 us", "model.step=0.2 us", "chain.radius=1 mm"],
    );
    let motion = small.drive.motion(1.0);
    let breaks = motion.breaks().iter().map(|instant| 2.0 * instant).collect();
    let (_, expected) = run(&small);
    let mut simulation =
        Simulation::with_motion(&large, Box::new(Doubled(motion, breaks)), Control::default()).unwrap();
    let found = finish(&mut simulation).unwrap();
    let peak = expected.bead_velocity[5].peak();
    for (sample, (a, b)) in expected.bead_velocity[5].values.iter().zip(&found.bead_velocity[5].values).enumerate() {
        assert!((a - b).abs() < 1e-9 * peak, "{sample}: {a} {b}");
    }
    let force = |response: &Response| response.contact_force[0].peak();
    assert!((force(&found) / force(&expected) - 4.0).abs() < 1e-9);
    assert!((found.energy.piston_work_j / expected.energy.piston_work_j - 8.0).abs() < 1e-8);
}

#[test]
fn a_bead_thrown_on_the_support_meets_what_a_piston_that_hits_it_meets() {
    // The same collision seen from the other end and from a moving frame.
    let overrides = ["chain.beads=1", "duration=5 us", "model.mesh_density=4"];
    let hit = scene("rigid", &[&overrides[..], &["chain.gaps={contact2=\"10 um\"}"]].concat());
    let thrown_at = scene("rigid", &[&overrides[..], &["chain.gaps={contact1=\"10 um\"}"]].concat());
    let mut piston = Simulation::with_motion(&hit, push(0.1, 1.0), Control::default()).unwrap();
    let at_front = finish(&mut piston).unwrap().contact_force.remove(0);
    let at_back = finish(&mut thrown(&thrown_at, 1, 0.1)).unwrap().contact_force.remove(1);
    let peak = at_front.peak();
    for (a, b) in at_front.values.iter().zip(&at_back.values) {
        assert!((a - b).abs() < 1e-9 * peak, "{a} {b}");
    }
}

#[test]
fn bodies_at_rest_stay_at_rest() {
    let scene = scene("rigid", &["model.mesh_density=4", "duration=20 us"]);
    let mut simulation = Simulation::with_motion(&scene, still(), Control::default()).unwrap();
    let response = finish(&mut simulation).unwrap();
    assert!(response.bead_velocity.iter().chain(&response.contact_force).all(|series| series.peak() == 0.0));
    assert_eq!(response.work.active_sets, 0);
}
