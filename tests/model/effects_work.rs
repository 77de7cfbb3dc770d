//! Off means absent: a scene without an effect does exactly the work of one that never had it. Counts, no times.

use granchain::{
    model,
    response::{Preparation, SolverWork},
    scene::{self, Scene},
};

/// Of `name` with these keys: what making its bodies ready took, and what the run did.
fn work(name: &str, overrides: &[&str]) -> (Preparation, SolverWork) {
    of(&load(name, overrides))
}

fn of(scene: &Scene) -> (Preparation, SolverWork) {
    let prepared = model::prepare(scene).unwrap_or_else(|error| panic!("{error}"));
    let response = prepared.run(scene, &mut |_| true).unwrap_or_else(|error| panic!("{error}"));
    (prepared.work(), response.work)
}

fn load(name: &str, overrides: &[&str]) -> Scene {
    let base = ["duration=20 us", "model.mesh_density=4", "model.modes=3"];
    let kind = overrides.iter().find_map(|key| key.strip_prefix("model.kind=")).unwrap();
    // The chain has neither mesh nor modes.
    let base = base.iter().take(if kind == "chain" {
        1
    } else if kind == "fea" {
        2
    } else {
        3
    });
    let all: Vec<String> = base.chain(overrides).map(|text| (*text).to_owned()).collect();
    scene::load(name, &all).unwrap_or_else(|error| panic!("{error}"))
}

/// The counts of effects: everything but those that every run of the model has.
fn effects(work: SolverWork) -> SolverWork {
    let SolverWork {
        acoustic_unknowns,
        kernels,
        memory_terms,
        pressure_samples,
        absorbed_records,
        dashpot_evaluations,
        equilibrium_sweeps,
        horn_evaluations,
        holder_evaluations,
        friction_turns,
        gravity_evaluations,
        yields,
        relaxation_evaluations,
        loss_evaluations,
        ..
    } = work;
    SolverWork {
        acoustic_unknowns,
        kernels,
        memory_terms,
        pressure_samples,
        absorbed_records,
        dashpot_evaluations,
        equilibrium_sweeps,
        horn_evaluations,
        holder_evaluations,
        friction_turns,
        gravity_evaluations,
        yields,
        relaxation_evaluations,
        loss_evaluations,
        ..SolverWork::default()
    }
}

const NONE: SolverWork = SolverWork {
    unknowns: 0,
    steps: 0,
    rejected_steps: 0,
    evaluations: 0,
    events: 0,
    factorisations: 0,
    contact_sweeps: 0,
    most_contact_sweeps: 0,
    active_sets: 0,
    solves: 0,
    acoustic_unknowns: 0,
    kernels: 0,
    memory_terms: 0,
    pressure_samples: 0,
    absorbed_records: 0,
    dashpot_evaluations: 0,
    equilibrium_sweeps: 0,
    horn_evaluations: 0,
    holder_evaluations: 0,
    friction_turns: 0,
    gravity_evaluations: 0,
    yields: 0,
    relaxation_evaluations: 0,
    loss_evaluations: 0,
};

#[test]
fn plain_scenes_do_the_work_of_no_effect() {
    for kind in ["chain", "reduced", "fea"] {
        let (made, done) = work("rigid", &[&format!("model.kind={kind}")]);
        assert_eq!(effects(done), NONE, "{kind}");
        let beads = match kind {
            // One kind of bead: factors of its statics, of the modes and of their count by inertia.
            "reduced" => Preparation { bodies: 1, factorisations: 3, modes: 4, ..Preparation::default() },
            _ => Preparation::default(),
        };
        assert_eq!(made, beads, "{kind}");
        assert_eq!(
            done.unknowns,
            match kind {
                "chain" => 12,
                "reduced" => 24,
                _ => done.unknowns,
            }
        );
    }
    let (_, done) = work("rigid", &["model.kind=chain"]);
    let own =
        SolverWork { steps: done.steps, rejected_steps: done.rejected_steps, evaluations: done.evaluations, ..NONE };
    assert_eq!(done, SolverWork { unknowns: 12, events: done.events, ..own });
}

#[test]
fn dashpots_are_evaluated_where_the_scene_has_them_only() {
    for kind in ["chain", "reduced", "fea"] {
        let model = format!("model.kind={kind}");
        let (none, without) = work("rigid", &[&model]);
        // Dashpots of no strength are none.
        let (same, idle) = work("rigid", &[&model, "damping.kind=linear", "damping.coefficient=0"]);
        assert_eq!((none, without), (same, idle), "{kind}");
        let count = |at: &str| work("rigid", &[&model, "damping.kind=linear", "damping.coefficient=0.3", at]).1;
        let (all, beads) = (count("damping.at=all"), count("damping.at=beads"));
        assert!(all.dashpot_evaluations > beads.dashpot_evaluations && beads.dashpot_evaluations > 0, "{kind}");
        if kind == "chain" {
            // Every evaluation of the right-hand side holds the dashpots of seven contacts, or of five.
            assert_eq!(all.dashpot_evaluations, 7 * all.evaluations);
            assert_eq!(beads.dashpot_evaluations, 5 * beads.evaluations);
        }
        assert_eq!(effects(SolverWork { dashpot_evaluations: 0, ..all }), NONE, "{kind}");
    }
}

#[test]
fn a_precompression_costs_an_equilibrium_and_only_then() {
    for kind in ["reduced", "fea"] {
        let model = format!("model.kind={kind}");
        let (_, without) = work("rigid", &[&model, "chain.precompression=0"]);
        let (_, with) = work("rigid", &[&model, "chain.precompression=0.05 N"]);
        assert_eq!((without.equilibrium_sweeps, without), (0, work("rigid", &[&model]).1));
        assert!(with.equilibrium_sweeps > 1, "{kind}");
        assert_eq!((with.unknowns, with.factorisations), (without.unknowns, without.factorisations));
    }
    // The chain has it in closed form.
    assert_eq!(work("rigid", &["model.kind=chain", "chain.precompression=0.05 N"]).1.equilibrium_sweeps, 0);
}

#[test]
fn bodies_are_made_once_a_kind_and_modes_only_where_asked_for() {
    let (rigid, _) = work("rigid", &["model.kind=reduced"]);
    let (annulus, _) = work("annulus", &["model.kind=reduced"]);
    let mut unlike = load("rigid", &["model.kind=reduced"]);
    unlike.chain.beads[1].radius *= 0.9;
    let (unequal, _) = of(&unlike);
    assert_eq!((rigid.bodies, annulus.bodies, unequal.bodies), (1, 2, 2));
    let (still, run) = work("rigid", &["model.kind=reduced", "model.modes=0"]);
    assert_eq!((still.modes, still.factorisations, run.unknowns), (0, 1, 6));
    let (ringing, run) = work("rigid", &["model.kind=reduced", "model.modes=5"]);
    // The rigid motion counts as one.
    assert_eq!((ringing.modes, ringing.factorisations, run.unknowns), (6, 3, 36));
    let laws = |law: &str| work("annulus", &["model.kind=chain", law]).0.fitted_laws;
    assert_eq!((laws("contact.law=hertz"), laws("contact.law=finite-body")), (0, 3));
}

#[test]
fn a_scene_without_water_has_no_acoustic_unknown_and_builds_no_kernel() {
    for (kind, damping) in [("chain", "damping.at=all"), ("reduced", "damping.at=beads"), ("fea", "damping.at=beads")] {
        let model = format!("model.kind={kind}");
        let count = |key: &str| {
            let (made, done) = work("water", &[&model, damping, key]);
            ((made.kernels + done.kernels, made.water_meshes, made.recorded_steps), done)
        };
        let (made, dry) = count("water.medium=none");
        assert_eq!(made, (0, 0, 0), "{kind}");
        let of_water = [dry.acoustic_unknowns, dry.memory_terms, dry.pressure_samples, dry.absorbed_records];
        assert_eq!(of_water, [0; 4], "{kind}");

        let (made, rayleigh) = count("water.method=rayleigh");
        // The disc's load, and the one field point.
        assert_eq!((made, rayleigh.acoustic_unknowns, rayleigh.absorbed_records), ((2, 0, 0), 0, 0), "{kind}");
        assert!(rayleigh.memory_terms > rayleigh.steps && rayleigh.pressure_samples > 0);

        let (_, elements) = count("water.method=elements");
        assert_eq!(elements.kernels, 0, "{kind}");
        assert!(elements.acoustic_unknowns > 1000 && elements.acoustic_unknowns < elements.unknowns, "{kind}");
        assert_eq!(elements.pressure_samples, rayleigh.pressure_samples, "{kind}");
    }
}

#[test]
fn absorption_filters_one_record_a_field_point_or_none() {
    for (kind, damping) in [("chain", "damping.at=all"), ("reduced", "damping.at=beads")] {
        let model = format!("model.kind={kind}");
        let lossless = work("water", &[&model, damping]);
        let lossy = work("water", &[&model, damping, "water.absorption=0.2 Np/m", "water.absorption_exponent=1.1"]);
        assert_eq!((lossless.1.absorbed_records, lossy.1.absorbed_records), (0, 1), "{kind}");
        // It loads nothing.
        assert_eq!((lossless.0, SolverWork { absorbed_records: 1, ..lossless.1 }), lossy, "{kind}");
    }
}

#[test]
fn what_a_cache_holds_is_not_made_again() {
    let place = tempfile::tempdir().unwrap();
    let cache = model::reduced::Cache::new(place.path());
    let keys = ["model.kind=reduced", "model.mesh_density=4", "model.modes=3", "duration=5 us"].map(str::to_owned);
    let scene = scene::load("annulus", &keys).unwrap();
    let made = || model::prepare_with(&scene, Some(&cache)).unwrap().work();
    let first = made();
    assert!(first.bodies == 2 && first.factorisations == 6 && first.modes == 3 + 1 + 3, "{first:?}");
    assert_eq!(made(), Preparation::default());
}

#[test]
fn horn_bead_guide_and_losses_are_evaluated_where_the_scene_has_them_only() {
    for kind in ["reduced", "fea"] {
        let model = format!("model.kind={kind}");
        let count = |keys: &[&str]| work("annulus", &[&[&model[..], "damping.kind=none"], keys].concat()).1;
        let none = count(&[]);
        assert_eq!(effects(none), NONE, "{kind}");
        // The steps tried and taken are as many: nothing is cut here.
        assert_eq!(none.rejected_steps, 0);
        let (steps, beads) = (none.steps, 6);
        let only = |keys: &[&str], expected: SolverWork| {
            let found = count(keys);
            assert_eq!(effects(found), expected, "{kind} {keys:?}");
            // One factor a kind of body as before.
            assert_eq!(
                (found.factorisations, found.unknowns, found.steps),
                (none.factorisations, none.unknowns, steps)
            );
        };
        only(&["horn.mass=1 g"], SolverWork { horn_evaluations: steps, ..NONE });
        for keys in [
            &["holder.drag=0.01 N s/m"][..],
            &["holder.friction_force=1 mN"],
            &["holder.drag=0.01 N s/m", "holder.friction_force=1 mN"],
        ] {
            only(keys, SolverWork { holder_evaluations: beads * steps, ..NONE });
        }
        only(&["loss.beads=0.01"], SolverWork { loss_evaluations: beads * steps, ..NONE });
        only(&["loss.support=0.01"], SolverWork { loss_evaluations: steps, ..NONE });
        let relaxing = ["loss.relaxation=0.5", "loss.relaxation_time=2 us"];
        only(&relaxing, SolverWork { relaxation_evaluations: steps, ..NONE });
        // Of no strength they are none.
        for none_of in ["holder.drag=0 N s/m", "loss.beads=0", "loss.support=0"] {
            assert_eq!(count(&[none_of]), none, "{kind} {none_of}");
        }
    }
    let disc = |key: &str| work("water", &["model.kind=chain", "water.medium=none", key]).1;
    let none = disc("alpha=1");
    let horn = disc("horn.mass=1 g");
    assert_eq!((none.horn_evaluations, horn.horn_evaluations), (0, none.steps));
    let drag = disc("holder.drag=0.01 N s/m");
    let beads = load("water", &["model.kind=chain"]).chain.beads.len() as u64;
    assert_eq!((none.holder_evaluations, drag.holder_evaluations), (0, none.steps * beads));
}
