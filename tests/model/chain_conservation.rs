//! What every run of the chain keeps: energy, momentum, the sign of forces, symmetry, equilibrium.

use granchain::{
    model::{
        ModelError,
        chain::{ChainModel, InitialState},
    },
    response::Response,
    scene::{
        Bead, Chain, ContactLaw, Damping, DampingKind, DampingPlacement, DampingTerm, Drive, DriveKind, FlatContact,
        Integrator, Material, MaterialLoss, ModelSettings, Scene, Support,
    },
};

fn scene(support: Support, kind: DampingKind) -> Scene {
    let bead = Bead::sphere(0.5e-3, Material::chrome_steel());
    Scene {
        name: "test".into(),
        description: String::new(),
        chain: Chain { beads: vec![bead; 6], gaps: vec![0.0; 7], precompression: 0.0, gravity: 0.0, sensor: None },
        piston: FlatContact::Rigid,
        piston_material: None,
        drive: Drive { kind: DriveKind::ToneBurst { cycles: 10.0, ring_up: 30e-6 }, amplitude: 1e-6, frequency: 73e3 },
        amplitude_scale: 1.0,
        support,
        water: None,
        damping: Damping {
            kind,
            coefficients: [(DampingTerm::Linear, 0.3), (DampingTerm::KuwabaraKono, 3660.0)].into(),
            placement: DampingPlacement::All,
            tension: false,
        },
        contact_law: ContactLaw::Hertz,
        yield_strength: None,
        horn: None,
        holder: None,
        loss: MaterialLoss::default(),
        duration: 200e-6,
        output_step: 1e-7,
        vibrometer_bandwidth: 1.5e6,
        model: ModelSettings::chain(Integrator::DormandPrince853 { tolerance: 1e-9 }),
    }
}

fn run(scene: &Scene) -> Response {
    ChainModel.run(scene, &mut |_| true).unwrap()
}

const RIGID: Support = Support::Flat(FlatContact::Rigid);

fn annulus() -> Support {
    Support::resin_annulus(1.0)
}

fn supports() -> [Support; 4] {
    [RIGID, Support::Flat(FlatContact::HalfSpace), annulus(), Support::Spring { stiffness: 8e5 }]
}

const KINDS: [DampingKind; 4] =
    [DampingKind::None, DampingKind::Linear, DampingKind::KuwabaraKono, DampingKind::LinearAndKuwabaraKono];

#[test]
fn work_in_is_stored_kinetic_or_dissipated_whatever_the_support_and_dampers() {
    for support in supports() {
        for kind in KINDS {
            for tension in [false, true] {
                let mut scene = scene(support.clone(), kind);
                scene.damping.tension = tension;
                let energy = run(&scene).energy;
                // Tolerance 1e-9 a step in the velocity, some thousand steps; the work adds up linearly.
                let residual = (energy.residual_j / energy.largest_j).abs();
                assert!(residual < 2e-7, "{support:?} {kind:?} {tension}: {residual:e}");
                assert!(energy.piston_work_j > 0.0 && energy.kinetic_j >= 0.0 && energy.stored_j >= 0.0);
                assert_eq!(energy.dissipated_j == 0.0, kind == DampingKind::None);
                assert!(energy.dissipated_j >= 0.0);
            }
        }
    }
}

#[test]
fn momentum_is_the_impulse_of_the_ends() {
    let scene = scene(RIGID, DampingKind::Linear);
    let response = run(&scene);
    let mass = scene.chain.beads[0].mass();
    let last = response.pole_velocity.len() - 1;
    let momentum: f64 = response.bead_velocity.iter().map(|v| mass * v.values[last]).sum();
    let (first, end) = (&response.contact_force[0], &response.contact_force[6]);
    let net: Vec<f64> = first.values.iter().zip(&end.values).map(|(a, b)| a - b).collect();
    let impulse: f64 = net.windows(2).map(|pair| 0.5e-7 * (pair[0] + pair[1])).sum();
    // Trapezoid over samples of a force with jumps: 0.1 µs times a jump of 0.1 N, a few dozen of either sign.
    let scale = mass * response.pole_velocity.peak();
    assert!((momentum - impulse).abs() < 0.02 * scale, "{momentum:e} {impulse:e} {scale:e}");
}

#[test]
fn no_contact_ever_pulls_and_only_with_leave_does_a_dashpot() {
    for kind in KINDS {
        let mut scene = scene(RIGID, kind);
        for force in run(&scene).contact_force {
            assert!(force.values.iter().all(|value| *value >= 0.0));
        }
        scene.damping.tension = true;
        let pulls = run(&scene).contact_force.iter().any(|force| force.values.iter().any(|value| *value < 0.0));
        assert_eq!(pulls, kind != DampingKind::None);
    }
}

#[test]
fn a_mirrored_collision_is_the_mirror_image() {
    let mut scene = scene(RIGID, DampingKind::LinearAndKuwabaraKono);
    scene.chain.gaps[0] = f64::INFINITY;
    scene.chain.gaps[6] = f64::INFINITY;
    scene.amplitude_scale = 0.0;
    let velocities = vec![0.3, 0.1, 0.0, -0.05, 0.0, -0.2];
    let initial = InitialState { displacements: vec![0.0; 6], velocities: velocities.clone() };
    let forth = ChainModel.run_from(&scene, &initial, &mut |_| true).unwrap();
    let mirrored = velocities.iter().rev().map(|v| -v).collect();
    let initial = InitialState { displacements: vec![0.0; 6], velocities: mirrored };
    let back = ChainModel.run_from(&scene, &initial, &mut |_| true).unwrap();
    for bead in 0..6 {
        for (a, b) in forth.bead_velocity[bead].values.iter().zip(&back.bead_velocity[5 - bead].values) {
            // Only the order of additions differs; damped, so nothing grows beyond the tolerance of 1e-9.
            assert!((a + b).abs() < 1e-7 * 0.3, "bead {bead}: {a} {b}");
        }
    }
    // Free chain: momentum is exact.
    let last = forth.pole_velocity.len() - 1;
    let after: f64 = forth.bead_velocity.iter().map(|v| v.values[last]).sum();
    assert!((after - velocities.iter().sum::<f64>()).abs() < 1e-12);
}

#[test]
fn a_precompressed_chain_at_rest_stays_at_rest() {
    for support in supports() {
        let mut scene = scene(support.clone(), DampingKind::Linear);
        scene.chain.precompression = 1.0;
        scene.amplitude_scale = 0.0;
        scene.model.integrator = Integrator::DormandPrince853 { tolerance: 1e-9 };
        let response = run(&scene);
        for force in &response.contact_force {
            // 1 N to rounding of overlaps near 1 µm, times the stiffness: some 1e-15.
            assert!(force.values.iter().all(|value| (value - 1.0).abs() < 1e-12), "{support:?}");
        }
        // Rounding of 1e-16 N on 4 mg for one period of the lowest mode, 15 µs.
        assert!(response.bead_velocity.iter().all(|v| v.peak() < 1e-12), "{support:?}");
    }
}

#[test]
fn the_same_scene_gives_the_same_bits() {
    let scene = scene(annulus(), DampingKind::KuwabaraKono);
    assert!(run(&scene) == run(&scene));
}

#[test]
fn what_cannot_be_run_is_refused_with_its_place() {
    let good = scene(RIGID, DampingKind::Linear);
    let refuse = |change: fn(&mut Scene)| {
        let mut scene = good.clone();
        change(&mut scene);
        ChainModel.run(&scene, &mut |_| true).err().unwrap()
    };
    let negative = refuse(|scene| scene.chain.beads[2].radius = -1.0);
    assert!(matches!(negative, ModelError::Unphysical { found: -1.0, .. }), "{negative}");
    assert!(matches!(refuse(|scene| scene.chain.beads.clear()), ModelError::Unsupported { .. }));
    assert!(matches!(refuse(|scene| scene.chain.gaps[3] = -1e-9), ModelError::Unphysical { .. }));
    assert!(matches!(refuse(|scene| scene.chain.gaps.truncate(3)), ModelError::Count { expected: 7, found: 3, .. }));
    let open = refuse(|scene| {
        scene.chain.precompression = 0.1;
        scene.chain.gaps[4] = 1e-9;
    });
    assert_eq!(open, ModelError::OpenGapUnderPrecompression { force: 0.1, contact: 5, gap: 1e-9 });
    let clock = refuse(|scene| scene.model.integrator = Integrator::OnDisc { step: 5e-8 });
    assert!(matches!(clock, ModelError::Unsupported { .. }), "{clock}");
    let stopped = ChainModel.run(&good, &mut |time| time < 50e-6).err().unwrap();
    assert!(matches!(stopped, ModelError::Stopped { time } if time >= 50e-6), "{stopped}");
}

#[test]
fn a_drive_that_is_not_finite_ends_in_a_typed_failure() {
    struct Broken;
    impl granchain::scene::PistonMotion for Broken {
        fn on_piece(&self, _piece: usize, t: f64) -> (f64, f64) {
            if t > 10e-6 { (f64::NAN, f64::NAN) } else { (1e-6 * (73e3 * t).sin(), 0.073 * (73e3 * t).cos()) }
        }
        fn breaks(&self) -> &[f64] {
            &[]
        }
    }
    let scene = scene(RIGID, DampingKind::Linear);
    let failure =
        ChainModel.run_with_laws(&scene, None, &Broken, &InitialState::at_rest(6), &mut |_| true).err().unwrap();
    assert!(
        matches!(failure, ModelError::NonFinite { time, .. } | ModelError::StepUnderflow { time, .. } if (time - 10e-6).abs() < 1e-7),
        "{failure}"
    );
}

#[test]
fn one_bead_and_a_thousand_beads_run() {
    for beads in [1, 2, 1000] {
        let mut scene = scene(annulus(), DampingKind::Linear);
        scene.chain.beads = vec![scene.chain.beads[0].clone(); beads];
        scene.chain.gaps = vec![0.0; beads + 1];
        scene.duration = 20e-6;
        let response = run(&scene);
        assert_eq!(response.bead_velocity.len(), beads);
        assert_eq!(response.contact_force.len(), beads + 1);
        assert!(response.bead_velocity[0].peak() > 0.0);
    }
}
