//! Runs of the reduced model side by side: the same bits as each alone.

use std::sync::atomic::{AtomicU64, Ordering};

use granchain::{
    model::{self, ModelError},
    scene::{self, DampingTerm, Scene},
    signal::Series,
};

fn load(name: &str, sets: &[&str]) -> Scene {
    let sets: Vec<String> =
        ["model.kind=reduced", "model.mesh_density=8"].iter().chain(sets).map(ToString::to_string).collect();
    scene::load(name, &sets).unwrap()
}

/// The traces of the scenes, held to the bit against a run of each.
fn held(scenes: &[Scene]) -> Vec<Result<Series, ModelError>> {
    let prepared = model::prepare(&scenes[0]).unwrap();
    let traces = prepared.traces(scenes, &|| true);
    assert_eq!(traces.len(), scenes.len());
    for (index, (trace, scene)) in traces.iter().zip(scenes).enumerate() {
        let alone = prepared.run(scene, &mut |_| true).map(|response| response.observed_velocity().clone());
        match (trace, alone) {
            (Ok(trace), Ok(alone)) => {
                assert_eq!((trace.start, trace.step, trace.len()), (alone.start, alone.step, alone.len()), "{index}");
                for (sample, (one, other)) in trace.values.iter().zip(&alone.values).enumerate() {
                    assert_eq!(one.to_bits(), other.to_bits(), "run {index}, sample {sample}: {one:e} {other:e}");
                }
            }
            (trace, alone) => assert_eq!(trace, &alone, "run {index}"),
        }
    }
    traces
}

/// The scene in so many variations of everything that may differ.
fn variations(scene: &Scene, count: usize) -> Vec<Scene> {
    (0..count)
        .map(|index| {
            let (mut own, share) = (scene.clone(), index as f64 / count as f64);
            own.amplitude_scale = 0.3 + 1.4 * share;
            for term in DampingTerm::ALL {
                own.damping.coefficients[term] *= 0.2 + share;
            }
            own.duration *= 1.0 - 0.3 * ((index * 5) % count) as f64 / count as f64;
            for (contact, gap) in own.chain.gaps.iter_mut().enumerate() {
                *gap = if own.chain.precompression > 0.0 { 0.0 } else { 1e-9 * share * (contact % 3) as f64 };
            }
            own.chain.precompression *= 0.5 + share;
            own
        })
        .collect()
}

#[test]
fn of_every_support_with_and_without_damping_gaps_and_precompression() {
    for (name, sets) in [
        ("annulus", &["duration=150us"][..]),
        (
            "annulus",
            &[
                "duration=60us",
                "damping.kind=kuwabara-kono",
                "damping.coefficient=900 N s/m^1.5",
                "damping.tension=true",
            ],
        ),
        ("rigid", &["duration=80us"]),
        (
            "rigid",
            &[
                "duration=40us",
                "support.kind=spring",
                "support.stiffness=1e6 N/m",
                "damping.kind=linear",
                "damping.coefficient=0.2 N s/m",
            ],
        ),
        ("rigid", &["duration=40us", "chain.precompression=0.5 N"]),
        ("rigid", &["duration=40us", "model.modes=0"]),
    ] {
        let traces = held(&variations(&load(name, sets), 11));
        let peaks: Vec<f64> = traces
            .iter()
            .map(|trace| trace.as_ref().unwrap().values.iter().fold(0.0, |a: f64, b| a.max(b.abs())))
            .collect();
        assert!(peaks.iter().all(|peak| *peak > 1e-3) && peaks[0] != peaks[1], "{name} {sets:?}: {peaks:?}");
    }
}

#[test]
fn a_run_that_fails_takes_no_other_with_it() {
    let mut scenes = variations(&load("annulus", &["duration=60us"]), 9);
    // So far into the support that the fine elements of the patches end, and a gap under a static force.
    scenes[2].amplitude_scale = 60.0;
    scenes[7].chain.precompression = 1.0;
    scenes[7].chain.gaps[1] = 1e-9;
    let traces = held(&scenes);
    let failed: Vec<usize> = (0..9).filter(|index| traces[*index].is_err()).collect();
    assert_eq!(failed, [2, 7]);
}

#[test]
fn a_stiffer_support_between_them_is_run_apart() {
    let mut scenes = variations(&load("annulus", &["duration=40us"]), 7);
    *scenes[3].support.stiffness_mut().unwrap() = 1.5;
    let traces = held(&scenes);
    assert!(traces.iter().all(Result::is_ok));
}

#[test]
fn whoever_watches_stops_all() {
    let scenes = variations(&load("rigid", &["duration=80us"]), 8);
    let asked = AtomicU64::new(0);
    let prepared = model::prepare(&scenes[0]).unwrap();
    let traces = prepared.traces(&scenes, &|| asked.fetch_add(1, Ordering::Relaxed) < 100);
    for trace in traces {
        assert!(matches!(trace, Err(ModelError::Stopped { time }) if time > 0.0 && time < 80e-6), "{trace:?}");
    }
}
