//! Cost of the chain: one run of the rigid scene, one step at several lengths, one run of an ensemble; the same with finite-body laws.
//!
//! `cargo bench --bench chain [-- WORD]` prints the least and the median of repeated timings, one thread; WORD picks lines.

use std::{hint::black_box, time::Instant};

use granchain::{
    model::chain::{
        ChainModel, FiniteBodyLaws, InitialState,
        ensemble::{Ensemble, Variation},
    },
    scene::{
        Bead, Chain, ContactLaw, Damping, DampingCoefficients, DampingKind, DampingPlacement, DampingTerm, Drive,
        DriveKind, FlatContact, Integrator, Material, MaterialLoss, ModelSettings, Scene, Support,
    },
};

fn rigid(beads: usize, integrator: Integrator) -> Scene {
    let bead = Bead::sphere(0.5e-3, Material::chrome_steel());
    Scene {
        name: "rigid".into(),
        description: "six beads between rigid flats, five cycles of 73 kHz, 1 µm".into(),
        chain: Chain {
            beads: vec![bead; beads],
            gaps: vec![0.0; beads + 1],
            precompression: 0.0,
            gravity: 0.0,
            sensor: None,
        },
        piston: FlatContact::Rigid,
        piston_material: None,
        drive: Drive { kind: DriveKind::SineCycles { cycles: 5.0 }, amplitude: 1e-6, frequency: 73e3 },
        amplitude_scale: 1.0,
        support: Support::Flat(FlatContact::Rigid),
        water: None,
        damping: Damping {
            kind: DampingKind::None,
            coefficients: DampingCoefficients::default(),
            placement: DampingPlacement::All,
            tension: false,
        },
        contact_law: ContactLaw::Hertz,
        yield_strength: None,
        horn: None,
        holder: None,
        loss: MaterialLoss::default(),
        duration: 120e-6,
        output_step: 1e-7,
        vibrometer_bandwidth: 1.5e6,
        model: ModelSettings::chain(integrator),
    }
}

/// The annulus scene's chain with linear dampers, under a tone burst of 700 µs.
fn annulus(duration: f64) -> Scene {
    let mut scene = rigid(6, Integrator::DormandPrince853 { tolerance: 1e-9 });
    scene.support = Support::resin_annulus(1.0);
    scene.damping.kind = DampingKind::Linear;
    scene.damping.coefficients[DampingTerm::Linear] = 0.3;
    scene.drive.kind = DriveKind::ToneBurst { cycles: 40.0, ring_up: 100e-6 };
    scene.amplitude_scale = 0.5;
    scene.duration = duration;
    scene
}

/// Least and median time of `repeats` calls, s.
fn timed(repeats: usize, mut call: impl FnMut()) -> (f64, f64) {
    call();
    let mut times: Vec<f64> = (0..repeats)
        .map(|_| {
            let begin = Instant::now();
            call();
            begin.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    (times[0], times[repeats / 2])
}

fn line(name: &str, (least, median): (f64, f64), per: f64, unit: &str) {
    println!("{name:<58} {:>10.3} {:>10.3} {unit}", least / per * 1e6, median / per * 1e6);
}

fn main() {
    let word = std::env::args().skip(1).find(|argument| !argument.starts_with("--")).unwrap_or_default();
    let wanted = |name: &str| name.contains(&word);
    println!("{:<58} {:>10} {:>10}", "", "least", "median");
    for tolerance in [1e-6, 1e-7, 1e-8, 1e-10, 1e-12] {
        let name = format!("S1, 120 µs, adaptive, tolerance {tolerance:e}");
        if wanted(&name) {
            let scene = rigid(6, Integrator::DormandPrince853 { tolerance });
            let run = || ChainModel.run(&scene, &mut |_| true).expect("the scene runs");
            let work = run().work;
            line(&name, timed(200, || drop(black_box(run()))), 1.0, "µs a run");
            println!("    {work:?}");
        }
    }
    let name = "annulus, linear 0.3, 700 µs, adaptive, tolerance 1e-9";
    if wanted(name) {
        let scene = annulus(700e-6);
        let run = || ChainModel.run(&scene, &mut |_| true).expect("the scene runs");
        line(name, timed(20, || drop(black_box(run()))), 1.0, "µs a run");
    }
    for beads in [6, 10, 1000] {
        let name = format!("one adaptive step, tolerance 1e-8, per bead, N = {beads}");
        if wanted(&name) {
            let mut scene = rigid(beads, Integrator::DormandPrince853 { tolerance: 1e-8 });
            scene.chain.precompression = 1.0;
            scene.drive.amplitude = 1e-8;
            let run = || ChainModel.run(&scene, &mut |_| true).expect("the scene runs");
            let steps = run().work.steps as f64;
            line(&name, timed(20, || drop(black_box(run()))), steps * beads as f64, "µs a bead and step");
        }
    }
    for (name, scene) in [
        ("one of 8 runs of an ensemble, annulus, 700 µs", annulus(700e-6)),
        ("one of 8 runs of an ensemble, rigid, no dampers, 700 µs", {
            let mut scene = rigid(6, Integrator::DormandPrince853 { tolerance: 1e-8 });
            scene.duration = 700e-6;
            scene
        }),
    ] {
        for law in [ContactLaw::Hertz, ContactLaw::FiniteBody] {
            let name = if law == ContactLaw::Hertz { name.to_owned() } else { format!("{name}, finite bodies") };
            if wanted(&name) {
                let scene = Scene { contact_law: law, ..scene.clone() };
                let ensemble = Ensemble::new(&scene, Ensemble::STEPS_PER_PERIOD).expect("the scene runs");
                let variations = vec![Variation::of(&scene); 8];
                line(&name, timed(60, || drop(black_box(ensemble.run(&variations)))), 8.0, "µs a run");
            }
        }
    }
    scale(&wanted);
    finite_bodies(wanted);
}

/// Cost per bead and step of chains of 10, 100 and 1000 beads, and the last over the first.
fn scale(wanted: &impl Fn(&str) -> bool) {
    let adaptive = Integrator::DormandPrince853 { tolerance: 1e-8 };
    // All contacts pressed throughout; a sample a step or one in ten; beads that rattle, so that steps end where contacts part and meet.
    let cases = [
        ("adaptive, pressed, sampled at 0.1 µs", adaptive, 1e-7, true),
        ("adaptive, pressed, sampled at 5 µs", adaptive, 5e-6, true),
        ("adaptive, rattling, sampled at 0.1 µs", adaptive, 1e-7, false),
        ("adaptive, rattling, sampled at 5 µs", adaptive, 5e-6, false),
    ];
    for (name, integrator, output_step, pressed) in cases {
        let name = format!("scale: {name}");
        if !wanted(&name) {
            continue;
        }
        let costs = [10, 100, 1000].map(|beads| {
            let mut scene = rigid(beads, integrator);
            scene.output_step = output_step;
            let mut still = InitialState::at_rest(beads);
            if pressed {
                scene.chain.precompression = 1.0;
                scene.drive.amplitude = 1e-8;
            } else {
                // No two neighbours alike, none a multiple of another: a low-discrepancy sequence.
                let golden = 0.5 * (5f64.sqrt() - 1.0);
                still
                    .velocities
                    .iter_mut()
                    .enumerate()
                    .for_each(|(i, v)| *v = 0.1 * ((i as f64 * golden).fract() - 0.5));
                scene.duration = if beads > 100 { 20e-6 } else { 60e-6 };
            }
            let run = || ChainModel.run_from(&scene, &still, &mut |_| true).expect("the scene runs");
            let work = run().work;
            let repeats = if beads > 100 { 5 } else { 40 };
            let (least, median) = timed(repeats, || drop(black_box(run())));
            let per = beads as f64 * work.steps as f64;
            line(&format!("{name}, N = {beads}"), (least, median), per * 1e-3, "ns a bead and step");
            println!("    {} steps, {} events, {} evaluations", work.steps, work.events, work.evaluations);
            least / per
        });
        println!("    1000 beads over 10: {:.2}", costs[2] / costs[0]);
    }
    let name = "scale: ensemble of 8";
    if wanted(name) {
        let costs = [10, 100, 1000].map(|beads| {
            let scene = rigid(beads, adaptive);
            let ensemble = Ensemble::new(&scene, Ensemble::STEPS_PER_PERIOD).expect("the scene runs");
            let variations = vec![Variation::of(&scene); 8];
            let steps = (scene.duration * scene.drive.frequency * f64::from(Ensemble::STEPS_PER_PERIOD)).ceil();
            let (least, median) =
                timed(if beads > 100 { 5 } else { 40 }, || drop(black_box(ensemble.run(&variations))));
            let per = 8.0 * beads as f64 * steps;
            line(&format!("{name}, N = {beads}"), (least, median), per * 1e-3, "ns a bead, step and run");
            least / per
        });
        println!("    1000 beads over 10: {:.2}", costs[2] / costs[0]);
    }
}

/// Fitting the laws of finite bodies, and runs with them.
fn finite_bodies(wanted: impl Fn(&str) -> bool) {
    let finite = |scene: Scene| Scene { contact_law: ContactLaw::FiniteBody, ..scene };
    let accurate = Integrator::DormandPrince853 { tolerance: 1e-8 };
    for (name, scene) in [
        ("fit of the finite-body laws, rigid, density 12", finite(rigid(6, accurate))),
        ("fit of the finite-body laws, annulus, density 12", finite(annulus(700e-6))),
    ] {
        if wanted(name) {
            let fit = || FiniteBodyLaws::fit(&scene).expect("the bodies can be meshed");
            line(name, timed(10, || drop(black_box(fit()))), 1.0, "µs");
        }
    }
    let mut pressed = rigid(6, accurate);
    pressed.chain.precompression = 1.0;
    pressed.drive.amplitude = 1e-8;
    for (name, scene, per_step) in [
        ("S1, 120 µs, finite bodies, adaptive, tolerance 1e-8", rigid(6, accurate), false),
        ("annulus, linear 0.3, 700 µs, finite bodies, tolerance 1e-9", annulus(700e-6), false),
        ("one adaptive step, finite bodies, per bead, N = 6", pressed, true),
    ] {
        if !wanted(name) {
            continue;
        }
        let scene = finite(scene);
        let laws = FiniteBodyLaws::fit(&scene).expect("the bodies can be meshed");
        let motion = scene.drive.motion(scene.amplitude_scale);
        let still = InitialState::at_rest(scene.chain.beads.len());
        let run =
            || ChainModel.run_with_laws(&scene, Some(&laws), motion.as_ref(), &still, &mut |_| true).expect("it runs");
        let work = run().work;
        let (per, unit) = if per_step { (6.0 * work.steps as f64, "µs a bead and step") } else { (1.0, "µs a run") };
        line(name, timed(50, || drop(black_box(run()))), per, unit);
        println!("    {work:?}");
    }
}
