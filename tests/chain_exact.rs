//! Exact numbers of the discrete chain.
use granchain::{
    model::{
        Model,
        chain::{ChainModel, InitialState},
    },
    scene::*,
};

fn bead() -> Bead {
    Bead { radius: 0.5e-3, material: Material::chrome_steel() }
}

fn s1(tolerance: f64) -> Scene {
    Scene {
        name: "s1".into(),
        description: String::new(),
        chain: Chain { beads: vec![bead(); 6], gaps: vec![0.0; 7], precompression: 0.0 },
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
fn probe() {
    let scene = s1(1e-13);
    let motion = scene.drive.motion(1.0);
    let reference = ChainModel.run(&s1(1e-13), &mut |_| true).unwrap();
    let t = ChainModel.trajectory(&scene, motion.as_ref(), &InitialState::at_rest(6), &mut |_| true).unwrap();
    println!("{:?} {:?}", t.energy, t.work);
    println!("{:?} {:?}", t.maximum_velocity(5, 0.0, 120e-6), t.minimum_velocity(5, 0.0, 120e-6));
    for time in [10e-6, 40e-6, 68e-6] {
        println!("{:.12}", t.velocity(5, time));
    }
    let peak = reference.bead_velocity.iter().map(|s| s.peak()).fold(0.0, f64::max);
    for k in 2..14 {
        let tolerance = 10f64.powi(-k);
        let scene = s1(tolerance);
        let mut best = f64::INFINITY;
        let mut r = None;
        for _ in 0..20 {
            let now = std::time::Instant::now();
            r = Some(ChainModel.run(&scene, &mut |_| true).unwrap());
            best = best.min(now.elapsed().as_secs_f64());
        }
        let r = r.unwrap();
        let mut error: f64 = 0.0;
        let mut e70: f64 = 0.0;
        for (a, b) in r.bead_velocity.iter().zip(&reference.bead_velocity) {
            for (i, (x, y)) in a.values.iter().zip(&b.values).enumerate() {
                error = error.max((x - y).abs());
                if i < 700 {
                    e70 = e70.max((x - y).abs())
                }
            }
        }
        println!(
            "{tolerance:e} err {:.2e} (70us {:.2e}) time {:.1} us steps {} rej {} ev {} events {} residual {:.2e}",
            error / peak,
            e70 / peak,
            best * 1e6,
            r.work.steps,
            r.work.rejected_steps,
            r.work.evaluations,
            r.work.events,
            r.energy.residual_j / r.energy.largest_j
        );
    }
}
