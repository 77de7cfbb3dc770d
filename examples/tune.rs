//! scratch
use granchain::{calibration::{*, fit::fit, forward::*, search::Search, observation::*, parameter::*}, scene::*, signal::Series, response::*, feature::fingerprint::FeatureSet, model::chain::ensemble::*};
use rayon::prelude::*;
fn main() {
    let count: u64 = std::env::args().nth(1).unwrap().parse().unwrap();
    let seed: u64 = std::env::args().nth(2).map_or(1, |s| s.parse().unwrap());
    let wrong = std::env::args().nth(3).unwrap_or_default();
    let steel = Material::chrome_steel();
    let base = Scene { name: "a".into(), description: "".into(), chain: Chain { beads: vec![Bead { radius: 5e-4, material: steel }; 6], gaps: vec![0.0; 7], precompression: 0.0 },
        piston: FlatContact::Rigid, drive: Drive { kind: DriveKind::ToneBurst { cycles: 40.0, ring_up: 100e-6 }, amplitude: 1e-6, frequency: 73e3 }, amplitude_scale: 1.0,
        support: Support::Annulus { stiffness_factor: 1.0 }, damping: Damping { kind: DampingKind::Linear, linear: 0.3, kuwabara_kono: 0.0, placement: DampingPlacement::All, tension: false },
        duration: 900e-6, output_step: 1e-7, model: ModelSettings { kind: ModelKind::Chain, integrator: Integrator::DormandPrince853 { tolerance: 1e-9 } } };
    let rows: Vec<_> = (0..count).into_par_iter().map(|i| {
        let scene = twin::scene_of(&base, i);
        let ps = vec![Parameter::alpha(), Parameter::damping(scene.damping.kind).unwrap()];
        let un = Uncertainty::default();
        let w = wrong.clone();
        let (truth, rec) = twin::twin(&scene, &ps, &un, i, seed, &move |s, _| {
            let mut v = Variation::of(s);
            v.gap_offsets = s.chain.gaps.clone();
            if w == "support" { v.support_stiffness_factor = 0.7; }
            if w == "law" { if s.damping.kind == DampingKind::Linear { v.kuwabara_kono_damping = v.linear_damping * 12200.0; v.linear_damping = 0.0 } else { v.linear_damping = v.kuwabara_kono_damping / 12200.0; v.kuwabara_kono_damping = 0.0 } }
            let p = Ensemble::new(s, 960).unwrap().run(&[v]).pop().unwrap().unwrap();
            let e = Series::new(0.0, 1.0, vec![]);
            Ok(Response { piston_displacement: e.clone(), bead_displacement: vec![], bead_velocity: vec![], pole_velocity: p, contact_force: vec![], energy: EnergyLedger::default(), work: SolverWork::default() })
        }).unwrap();
        let t = std::time::Instant::now();
        let run = |scene: &Scene, ps: &Vec<Parameter>| {
            let obs = Observation::new(&rec, 73e3, 40.0, FeatureSet::Full).map_err(|e| e.to_string())?;
            let f = Forward::new(scene, ps.clone(), obs, un, seed + 1000 + i, std::sync::Arc::new(|_| true)).unwrap();
            let s = Search::new(&f, 600, seed + 7000 + i);
            fit(&f, s, None).map_err(|e| e.to_string())
        };
        let r = run(&scene, &ps);
        let mut other = scene.clone();
        other.damping.kind = if scene.damping.kind == DampingKind::Linear { DampingKind::KuwabaraKono } else { DampingKind::Linear };
        let r2 = if std::env::var("LAW").is_ok() { run(&other, &vec![Parameter::alpha(), Parameter::damping(other.damping.kind).unwrap()]).ok() } else { None };
        (truth, r, r2, t.elapsed().as_secs_f64())
    }).collect();
    let (mut cov, mut wid, mut err, mut n) = ([0, 0], [vec![], vec![]], [vec![], vec![]], 0);
    let mut cmed = 0;
    for (t, r, r2, time) in &rows {
        match r {
            Ok(f) => {
                if std::env::var("FAIL").is_ok() { let mut m = std::collections::BTreeMap::new(); for run in &f.runs { if let Err(e) = &run.outcome { m.entry(e.clone()[..9].to_string()).or_insert(vec![]).push((f.parameters[0].value(run.position[0]), f.parameters[1].value(run.position[1]), e.clone())); } } for (k, v) in m { println!("   {k}: {} e.g. {:?}", v.len(), &v[v.len() / 2]); } }
                n += 1;
                print!("{:3} {:8}{:14} noise {:.3} fs {:5.2}M |", t.index, t.support, t.damping_kind, t.noise, t.sample_rate_hz / 1e6);
                for d in 0..2 {
                    let e = &f.estimates[d];
                    let inn = t.values[d] >= e.low && t.values[d] <= e.high;
                    cov[d] += inn as i32;
                    wid[d].push((e.high / e.low).ln());
                    err[d].push((e.median / t.values[d]).ln().abs());
                    print!(" {:9.4} [{:9.4} {:9.4}] {} w {:.3} e {:.3} ev {:.3}|", t.values[d], e.low, e.high, if inn { " " } else { "X" }, (e.high / e.low).ln(), (e.median / t.values[d]).ln(), (e.value / t.values[d]).ln());
                }
                let maxdev = f.deviations.iter().fold(0.0f64, |a, b| a.max(b.abs()));
                let rms = (f.deviations.iter().map(|d| d * d).sum::<f64>() / f.deviations.len() as f64).sqrt();
                println!(" FIT {:.2} drift {:.2} lobes {} fail {} dev {:.2} {:.2} lnE {:.1} {} {:.2}s {:?}", f.misfit, f.drift, f.lobes.len(), f.failed(), maxdev, rms, r2.as_ref().map_or(f64::NAN, |g| f.log_evidence - g.log_evidence), r2.as_ref().map_or(String::new(), |g| format!("other FIT {:.2}", g.misfit)), time, f.verdict);
                cmed += (f.misfit <= 1.5) as i32;
            }
            Err(e) => println!("{:3} {e}", t.index),
        }
    }
    for d in 0..2 {
        wid[d].sort_by(f64::total_cmp);
        err[d].sort_by(f64::total_cmp);
        println!("param {d}: coverage {}/{} median width {:.4} median error {:.4}", cov[d], n, wid[d][n / 2], err[d][n / 2]);
    }
    println!("FIT<=1.5: {cmed}/{n}");
}
