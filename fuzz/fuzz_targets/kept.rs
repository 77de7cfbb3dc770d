//! Any bytes as a file that the program reads back or is handed: one byte says of which kind, then the file.

#![no_main]

use std::{fs, path::PathBuf};

use granchain::{
    calibration::{
        Plan,
        fingerprints::{self, Names},
    },
    measurement::{
        PublishedFeatures,
        seal::{sealed, unsealed},
    },
    model::fea::mesh::gmsh::parse,
    study::{run_log::RunLog, sweep},
};
use libfuzzer_sys::fuzz_target;

/// A file of these bytes, the same for every case of a process.
fn file(bytes: &[u8]) -> PathBuf {
    let place = std::env::temp_dir().join(format!("granchain-fuzz-{}", std::process::id()));
    fs::write(&place, bytes).expect("a file can be written");
    place
}

fn names() -> Names {
    Names {
        parameters: vec!["alpha".into(), "damping".into()],
        features: vec![vec!["peak".into(), "line_1/3".into()]],
        lower: "chain".into(),
        upper: "reduced".into(),
    }
}

fuzz_target!(|bytes: &[u8]| {
    let [kind, bytes @ ..] = bytes else { return };
    match kind % 6 {
        0 => {
            if let Ok(plan) = Plan::read(&file(bytes)) {
                let _ = (plan.records(), plan.fitted());
            }
        }
        1 => {
            if let Ok(printed) = PublishedFeatures::from_bytes(&PathBuf::from("features.toml"), bytes) {
                let _ = printed.value("positive_peak");
            }
        }
        2 => {
            if let Ok(candidates) = fingerprints::from_csv(&names(), bytes) {
                let again = fingerprints::to_csv(&names(), &candidates).expect("what was read can be written");
                let again = fingerprints::from_csv(&names(), &again).expect("what was written can be read");
                assert_eq!(format!("{again:?}"), format!("{candidates:?}"));
            }
        }
        3 => {
            if let Ok(body) = unsealed(bytes) {
                assert_eq!(sealed(body), bytes);
            }
        }
        // Forged: the digests are right.
        4 => {
            let lines = bytes.split(|byte| *byte == b'\n').flat_map(|line| [sealed(line), vec![b'\n']].concat());
            let _ = RunLog::open::<sweep::Run>(&file(&lines.collect::<Vec<u8>>())).expect("damage is left out");
        }
        _ => match parse(bytes, 1e-3) {
            Ok((mesh, _)) => assert!(mesh.nodes.iter().flatten().all(|place| place.is_finite())),
            Err(refused) => assert!(!refused.to_string().is_empty()),
        },
    }
});
