//! What effects cost and change: switches that are each other's inverse, differences that are zero for nothing, advice for a target.

use granchain::{
    response::{Preparation, SolverWork},
    scene::{self, Scene},
    study::replicates::Unwatched,
    validate::effects::{
        Advised, Belongs, Change, Cost, EffectCosts, Marginal, Measured, advise, is_on, measured, names, pair,
    },
};

fn load(name: &str, keys: &[&str]) -> Scene {
    scene::load(name, &keys.iter().map(|key| (*key).to_owned()).collect::<Vec<_>>()).unwrap()
}

fn costs(name: &str, keys: &[&str]) -> EffectCosts {
    measured(&load(name, keys), &Unwatched).unwrap()
}

fn of<'a>(costs: &'a EffectCosts, name: &str) -> &'a Marginal {
    costs.effects.iter().find(|row| row.name == name).unwrap()
}

#[test]
fn every_switch_is_an_effect_that_scenes_know() {
    let known = scene::effects(&load("rigid", &[]));
    for name in names().filter(|name| *name != "water by elements") {
        assert!(known.iter().any(|effect| effect.name == name), "{name}");
    }
}

#[test]
fn a_pair_of_scenes_differs_in_its_effect_and_a_second_pair_is_the_first() {
    let mut seen = Vec::new();
    for (scene, keys) in [
        ("rigid", &["model.kind=chain"][..]),
        ("rigid", &["model.kind=reduced", "damping.kind=linear"]),
        ("rigid", &["model.kind=fea"]),
        ("annulus", &["model.kind=reduced"]),
        ("water", &[]),
        ("water", &["water.method=elements"]),
    ] {
        let scene = load(scene, keys);
        for name in names() {
            let Some((without, with)) = pair(&scene, name) else { continue };
            assert!(!is_on(&without, name) && is_on(&with, name), "{name}: {keys:?}");
            // From the scene that has it, it is taken out of that scene.
            let (again, same) = pair(&with, name).unwrap();
            assert!(!is_on(&again, name) && same == with, "{name}: {keys:?}");
            seen.push(name);
        }
    }
    let missing: Vec<&str> = names().filter(|name| !seen.contains(name) && *name != "numerical dissipation").collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn dampers_slow_the_bead_and_an_absent_effect_adds_no_work() {
    let costs = costs("rigid", &["model.kind=chain", "duration=60 us"]);
    let dampers = of(&costs, "linear dampers");
    let found = dampers.measured.unwrap();
    assert!(!dampers.on && found.without.work.dashpot_evaluations == 0 && found.with.work.dashpot_evaluations > 0);
    assert_eq!((found.without.work, found.unknowns()), (costs.base.work, 0));
    // Left out, the bead is faster.
    assert!(found.change.peak > 0.05 && found.change.waveform > 0.05, "{:?}", found.change);
    let bodies = of(&costs, "elastic bodies").measured.unwrap();
    assert!(bodies.unknowns() > 0 && bodies.with.preparation.factorisations > 0);
    assert!(bodies.change.size() > 1e-3 && bodies.change.size() < 0.5, "{:?}", bodies.change);
    // Fitted to the bodies' statics, the law of the contacts has most of what the bodies change.
    let law = of(&costs, "finite-body contacts").measured.unwrap();
    assert_eq!((law.unknowns(), law.with.preparation.fitted_laws), (0, 2));
}

#[test]
fn a_support_matters_once_the_pulse_is_there() {
    let change = |duration: &str| {
        let costs = costs("rigid", &["model.kind=chain", duration]);
        of(&costs, "resin annulus").measured.unwrap().change.waveform
    };
    // The head of the pulse takes some 8 us to the last bead; its foot is there sooner.
    let (early, late) = (change("duration=6 us"), change("duration=60 us"));
    assert!(early < 0.01 && late > 0.3, "{early} {late}");
}

#[test]
fn small_effects_of_the_model_are_given_up_until_their_sum_is_the_target() {
    let row = |name, on, belongs, size: f64, factor| {
        let cost = |run_s| Cost {
            work: SolverWork::default(),
            preparation: Preparation::default(),
            run_s,
            prepare_s: 0.0,
            runs: 1,
        };
        let change = Change { waveform: size, peak: -0.5 * size, ratio_third: None, pressure: None };
        let measured = Some(Measured { without: cost(1.0), with: cost(factor), change });
        Marginal { name, on, belongs, key: String::new(), measured, refused: None }
    };
    let rows = [
        row("large", true, Belongs::Model, 0.2, 3.0),
        row("small", true, Belongs::Model, 0.004, 2.0),
        row("medium", true, Belongs::Model, 0.007, 2.0),
        row("free", true, Belongs::Model, 0.001, 1.0),
        row("bench", true, Belongs::Bench, 0.001, 2.0),
        row("absent", false, Belongs::Model, 0.05, 2.0),
        row("nothing", false, Belongs::Model, 0.002, 2.0),
    ];
    let names = |list: &[Advised]| list.iter().map(|effect| effect.name).collect::<Vec<_>>();
    let advice = advise(&rows, 0.01);
    assert_eq!(names(&advice.dispensable), ["small"]);
    assert_eq!(names(&advice.needed), ["free", "medium", "large"]);
    assert_eq!(names(&advice.missing), ["absent"]);
    assert_eq!(names(&advice.rightly_off), ["nothing"]);
    assert_eq!(names(&advise(&rows, 0.012).dispensable), ["small", "medium"]);
}
