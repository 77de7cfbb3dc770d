//! Impulses of a measured column of beads, where its records are at hand.
//!
//! Records: repository pabseb22/SingleSolitaryWaveAnalysis (Villacreses and others, USFQ Quito), which states no licence: nothing of them is kept here.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

use std::path::PathBuf;

use granchain_signal::{
    Series,
    feature::{Return, Window, impulses},
};

#[test]
fn every_hit_of_the_measured_column_has_an_incident_and_a_returned_impulse() {
    let folder = std::env::var_os("GRANCHAIN_SSW").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/public-data/ssw-chain"),
        PathBuf::from,
    );
    let Ok(files) = std::fs::read_dir(folder.join("foams-csv")) else {
        println!("skipped: no {}; name the folder in GRANCHAIN_SSW", folder.display());
        return;
    };
    let mut hits = 0;
    for file in files {
        let path = file.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let rows: Vec<[f64; 2]> = text
            .lines()
            .skip(1)
            .map(|line| {
                let (time, value) = line.split_once(',').unwrap();
                [time.parse().unwrap(), value.parse().unwrap()]
            })
            .collect();
        let step = (rows.last().unwrap()[0] - rows[0][0]) / (rows.len() - 1) as f64;
        let series = Series::new(rows[0][0], step, rows.iter().map(|row| row[1]).collect());
        let found = impulses(&series, Window::whole(&series), 0.2).unwrap();
        let Some(Return { delay, ratio, widths }) = Return::of(&found) else { panic!("{}: {found:?}", path.display()) };
        // Seven foams of 16 to 445 MPa: the pulse returns after 1.1 to 2.1 ms.
        assert!((1.0e-3..2.2e-3).contains(&delay) && (0.2..0.8).contains(&ratio), "{}: {found:?}", path.display());
        assert!((30e-6..120e-6).contains(&widths[0]), "{}: {found:?}", path.display());
        hits += 1;
    }
    println!("{hits} hits");
}
