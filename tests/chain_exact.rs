//! Exact numbers of the discrete chain.

use granchain::{
    model::chain::{ChainModel, InitialState},
    scene::{
        Bead, Chain, Damping, DampingKind, DampingPlacement, Drive, DriveKind, FlatContact, Integrator, Material,
        ModelKind, ModelSettings, Scene, Support,
    },
};

fn rigid(tolerance: f64) -> Scene {
    let bead = Bead { radius: 0.5e-3, material: Material::chrome_steel() };
    Scene {
        name: "rigid".into(),
        description: String::new(),
        chain: Chain { beads: vec![bead; 6], gaps: vec![0.0; 7], precompression: 0.0 },
        piston: FlatContact::Rigid,
        drive: Drive { kind: DriveKind::SineCycles { cycles: 5.0 }, amplitude: 1e-6, frequency: 73e3 },
        amplitude_scale: 1.0,
        support: Support::Flat(FlatContact::Rigid),
        damping: Damping {
            kind: DampingKind::None,
            linear: 0.0,
            kuwabara_kono: 0.0,
            placement: DampingPlacement::All,
            tension: false,
        },
        duration: 120e-6,
        output_step: 1e-7,
        model: ModelSettings { kind: ModelKind::Chain, integrator: Integrator::DormandPrince853 { tolerance } },
    }
}

#[test]
fn the_rigid_scene_has_the_tabulated_extremes_and_samples() {
    let scene = rigid(1e-12);
    let motion = scene.drive.motion(1.0);
    let run = ChainModel.trajectory(&scene, motion.as_ref(), &InitialState::at_rest(6), &mut |_| true).unwrap();
    // The table ends at 70 µs, where waveforms of the undamped chain are still reproducible; 1e-8 m/s is its tolerance.
    let (time, value) = run.maximum_velocity(5, 0.0, 70e-6);
    assert!((value - 0.683_176_961).abs() < 1e-8 && (time - 63.580_54e-6).abs() < 1e-10, "{value:.9} at {time:e}");
    let (time, value) = run.minimum_velocity(5, 0.0, 70e-6);
    assert!((value + 0.705_301_767).abs() < 1e-8 && (time - 65.660_61e-6).abs() < 1e-10, "{value:.9} at {time:e}");
    for (time, expected) in [(10e-6, 0.336_428_016_202), (40e-6, -0.061_424_596_604), (68e-6, 0.026_901_201_869)] {
        let value = run.velocity(5, time);
        assert!((value - expected).abs() < 1e-8, "{value:.12} at {time:e}, expected {expected}");
    }
}
