//! The cheap steppers against the accurate one.

use granchain::{
    model::{
        ModelError,
        chain::{
            ChainModel,
            ensemble::{EffectVariation, Ensemble, Variation},
        },
    },
    scene::{
        Bead, Chain, ContactLaw, Damping, DampingKind, DampingPlacement, DampingTerm, Drive, DriveKind, FlatContact,
        Integrator, Material, MaterialLoss, ModelSettings, Scene, Support,
    },
    signal::Series,
};

fn scene(support: Support, kind: DampingKind) -> Scene {
    let bead = Bead::sphere(0.5e-3, Material::chrome_steel());
    let linear = if matches!(kind, DampingKind::Linear) { 0.3 } else { 0.0 };
    let kuwabara_kono = if matches!(kind, DampingKind::KuwabaraKono) { 3660.0 } else { 0.0 };
    let coefficients = [(DampingTerm::Linear, linear), (DampingTerm::KuwabaraKono, kuwabara_kono)].into();
    Scene {
        name: "test".into(),
        description: String::new(),
        chain: Chain { beads: vec![bead; 6], gaps: vec![0.0; 7], precompression: 0.0, gravity: 0.0, sensor: None },
        piston: FlatContact::Rigid,
        piston_material: None,
        drive: Drive { kind: DriveKind::ToneBurst { cycles: 40.0, ring_up: 100e-6 }, amplitude: 1e-6, frequency: 73e3 },
        amplitude_scale: 1.0,
        support,
        water: None,
        damping: Damping { kind, coefficients, placement: DampingPlacement::All, tension: false },
        contact_law: ContactLaw::Hertz,
        yield_strength: None,
        horn: None,
        holder: None,
        loss: MaterialLoss::default(),
        duration: 200e-6,
        output_step: 1.0 / (73e3 * 160.0),
        vibrometer_bandwidth: 1.5e6,
        model: ModelSettings::chain(Integrator::DormandPrince853 { tolerance: 1e-10 }),
    }
}

fn annulus() -> Support {
    Support::resin_annulus(1.0)
}

const RIGID: Support = Support::Flat(FlatContact::Rigid);

fn accurate(scene: &Scene) -> Series {
    ChainModel.run(scene, &mut |_| true).unwrap().pole_velocity
}

/// Largest difference of two series on the same grid, over the second's peak.
fn difference(series: &Series, reference: &Series) -> f64 {
    let pairs = series.values.iter().zip(&reference.values);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / reference.peak()
}

/// A precompressed chain that never opens: the equations are smooth, so the steppers show their order.
fn smooth(kind: DampingKind) -> Scene {
    let mut scene = scene(RIGID, kind);
    scene.chain.precompression = 1.0;
    scene.drive.amplitude = 2e-8;
    scene.drive.kind = DriveKind::SineCycles { cycles: 100.0 };
    scene.duration = 100e-6;
    scene
}

/// Slope of log error over log step, from two halvings.
fn order(errors: [f64; 3]) -> f64 {
    (errors[0] / errors[2]).log2() / 2.0
}

#[test]
fn the_ensemble_is_of_fourth_order_where_the_motion_is_smooth() {
    for kind in [DampingKind::None, DampingKind::Linear, DampingKind::KuwabaraKono] {
        let mut scene = smooth(kind);
        scene.output_step = 1.0 / (73e3 * 80.0);
        let reference = accurate(&scene);
        let errors = [80, 160, 320].map(|steps| {
            let ensemble = Ensemble::new(&scene, steps).unwrap();
            let run = ensemble.run(&[Variation::of(&scene)]).remove(0).unwrap();
            let thinned =
                Series::new(0.0, scene.output_step, run.values.into_iter().step_by(steps as usize / 80).collect());
            difference(&thinned, &reference)
        });
        // Order 4 within 0.1; the piston's only jump of velocity lies at the start.
        println!("{kind:?}: {errors:?}, order {:.2}", order(errors));
        assert!((order(errors) - 4.0).abs() < 0.1, "{kind:?}: {errors:?}");
    }
}

#[test]
fn the_ensemble_follows_the_accurate_integrator_in_regular_regimes() {
    // Kuwabara–Kono damping keeps neighbouring motions together; the linear one does in the first 70 µs, and undamped the first cycles.
    let cases = [
        // Measured 6.4e-3: the Kuwabara–Kono force starts like the root of time at every closing, which costs a fixed step most.
        (annulus(), DampingKind::KuwabaraKono, 1.5, 500e-6, 8e-3),
        // Measured 8.4e-4, 1.9e-3, 9.1e-4, 3.0e-5.
        (RIGID, DampingKind::KuwabaraKono, 1.0, 500e-6, 2e-3),
        (annulus(), DampingKind::Linear, 0.5, 70e-6, 4e-3),
        (RIGID, DampingKind::Linear, 1.0, 70e-6, 2e-3),
        (RIGID, DampingKind::None, 1.0, 40e-6, 1e-4),
    ];
    for (support, kind, alpha, duration, limit) in cases {
        let mut scene = scene(support.clone(), kind);
        scene.amplitude_scale = alpha;
        scene.duration = duration;
        let ensemble = Ensemble::new(&scene, Ensemble::STEPS_PER_PERIOD).unwrap();
        let fast = ensemble.run(&[Variation::of(&scene)]).remove(0).unwrap();
        let error = difference(&fast, &accurate(&scene));
        println!("{support:?} {kind:?} α {alpha}: {error:.1e} of peak");
        assert!(error < limit, "{support:?} {kind:?}: {error:e}");
    }
}

#[test]
fn another_modulus_is_the_same_motion_on_another_clock() {
    // Behind a rigid wall, whose contact goes with the beads: exact up to the tolerances.
    let mut scene = scene(RIGID, DampingKind::KuwabaraKono);
    scene.duration = 200e-6;
    for factor in [0.9, 1.2] {
        let variation = Variation { modulus_factor: factor, ..Variation::of(&scene) };
        let mut stiffer = scene.clone();
        stiffer.chain.beads.iter_mut().for_each(|bead| bead.material.youngs_modulus *= factor);
        let expected = accurate(&stiffer);
        let clocked = accurate(&variation.written_over(&scene, |gap| gap));
        let found = variation.on_the_record(clocked, expected.len());
        let error = difference(&found, &expected);
        // 3.2e-4: the cubic between samples.
        assert!(error < 6e-4, "{factor}: {error:e}");
        // The lanes scale the stiffness itself.
        let ensemble = Ensemble::new(&scene, Ensemble::STEPS_PER_PERIOD).unwrap();
        let in_lanes = ensemble.run(&[variation]).remove(0).unwrap();
        let error = difference(&in_lanes, &expected);
        assert!(error < 4e-3, "{factor}, in lanes: {error:e}");
        assert!(difference(&accurate(&scene), &expected) > 0.02, "{factor}: nothing changed");
    }
}

#[test]
fn a_variation_has_the_same_bits_whatever_its_place_and_company() {
    let scene = scene(annulus(), DampingKind::Linear);
    let ensemble = Ensemble::new(&scene, Ensemble::STEPS_PER_PERIOD).unwrap();
    let variations: Vec<Variation> = (0..21)
        .map(|i| Variation {
            amplitude_scale: 0.3 + 0.05 * f64::from(i),
            damping: [
                (DampingTerm::Linear, if i % 3 == 0 { 0.0 } else { 0.1 * f64::from(i % 5) }),
                (DampingTerm::KuwabaraKono, if i % 4 == 0 { 3660.0 } else { 0.0 }),
            ]
            .into(),
            gap_offsets: (0..7).map(|contact| 1e-10 * f64::from((i * contact) % 5 - 2)).collect(),
            precompression: 0.01 * f64::from(i % 2),
            support_stiffness_factor: 1.0 - 0.01 * f64::from(i),
            modulus_factor: 1.0 + 0.004 * f64::from(i),
            effects: EffectVariation::default(),
            shaken: vec![],
        })
        .collect();
    let together = ensemble.run(&variations);
    for (variation, run) in variations.iter().zip(&together) {
        assert_eq!(&ensemble.run(std::slice::from_ref(variation))[0], run);
    }
    let backwards: Vec<Variation> = variations.iter().rev().cloned().collect();
    let mut back = ensemble.run(&backwards);
    back.reverse();
    assert_eq!(back, together);
}

#[test]
fn a_bad_variation_fails_alone() {
    let scene = scene(RIGID, DampingKind::Linear);
    let ensemble = Ensemble::new(&scene, Ensemble::STEPS_PER_PERIOD).unwrap();
    let good = Variation::of(&scene);
    let negative = Variation { damping: [(DampingTerm::Linear, -1.0)].into(), ..good.clone() };
    let short = Variation { gap_offsets: vec![0.0; 3], ..good.clone() };
    // So stiff a dashpot that the fixed step blows up.
    let stiff = Variation { damping: [(DampingTerm::Linear, 1e4)].into(), ..good.clone() };
    let runs = ensemble.run(&[good.clone(), negative, stiff, short, good.clone()]);
    assert_eq!(runs[0], runs[4]);
    assert!(runs[0].is_ok());
    assert!(matches!(runs[1], Err(ModelError::Unphysical { found: -1.0, .. })));
    assert!(matches!(runs[2], Err(ModelError::NonFinite { .. })), "{:?}", runs[2].as_ref().map(Series::peak));
    assert!(matches!(runs[3], Err(ModelError::Count { expected: 7, found: 3, .. })));
}

#[test]
fn the_annulus_scene_comes_near_the_published_peaks() {
    // Prototype: linear 0.3 at α 0.5 +288/−195, Kuwabara–Kono 3660 at α 1.5 +199/−64 mm/s (printed: +296/−207, +214/−71). Gaps are
    // jittered by 0.3 nm. The first case is chaotic: single runs fall near +288/−190 or near +330/−230 (the accurate integrator's
    // mean over 24 is +312/−213), so its mean may lie 20 % off one draw. The second is regular: 3 %.
    for (kind, alpha, positive, negative, tolerance) in
        [(DampingKind::Linear, 0.5, 0.288, -0.195, 0.2), (DampingKind::KuwabaraKono, 1.5, 0.199, -0.064, 0.03)]
    {
        let mut scene = scene(annulus(), kind);
        scene.amplitude_scale = alpha;
        scene.duration = 700e-6;
        let variations: Vec<Variation> = (0..24)
            .map(|run| Variation {
                gap_offsets: (0..7)
                    .map(|contact| 3e-10 * (f64::from((run * 7 + contact) * 37 % 101) / 50.0 - 1.0))
                    .collect(),
                ..Variation::of(&scene)
            })
            .collect();
        let runs = Ensemble::new(&scene, Ensemble::STEPS_PER_PERIOD).unwrap().run(&variations);
        let peaks = |pick: fn(f64, f64) -> f64| -> Vec<f64> {
            runs.iter().map(|run| run.as_ref().unwrap().values.iter().copied().fold(0.0, pick)).collect()
        };
        for (name, found, expected) in
            [("positive", peaks(f64::max), positive), ("negative", peaks(f64::min), negative)]
        {
            let mean = found.iter().sum::<f64>() / 24.0;
            let scatter = (found.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 23.0).sqrt();
            println!(
                "{kind:?} α {alpha}: {name} peak {:.1} ± {:.1} mm/s, prototype {:.0}",
                mean * 1e3,
                scatter * 1e3,
                expected * 1e3
            );
            assert!(
                (mean / expected - 1.0).abs() < tolerance,
                "{kind:?} {name}: {mean} ± {scatter}, expected {expected}"
            );
        }
    }
}

/// The piston of a burst of an odd number of cycles under a Gaussian envelope first draws back: for half a period nothing touches anything.
#[test]
fn a_piston_that_draws_back_first_still_meets_its_bead() {
    let mut scene = scene(annulus(), DampingKind::KuwabaraKono);
    scene.drive.kind = DriveKind::GaussianBurst { cycles: 31.0 };
    scene.chain.gaps = vec![3e-10; 7];
    scene.duration = 300e-6;
    let reference = accurate(&scene);
    assert!(reference.peak() > 0.01, "{} m/s", reference.peak());
    scene.output_step = 1.0 / (73e3 * 160.0);
    let ensemble = Ensemble::new(&scene, 160).unwrap();
    let fixed = ensemble.run(&[Variation::of(&scene)]).remove(0).unwrap();
    let reference = accurate(&scene);
    assert!(difference(&fixed, &reference) < 0.01, "{}", difference(&fixed, &reference));
}
