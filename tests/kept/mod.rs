//! What holds of any bytes in the place of a file that the program reads back or is handed, for tests and for the fuzz target.

use std::{fs, path::Path};

use granchain::{calibration::Plan, measurement::run_log::RunLog, study::sweep};

/// A plan, in a file at `place`.
pub fn plan(place: &Path, bytes: &[u8]) {
    fs::write(place, bytes).unwrap();
    if let Ok(plan) = Plan::read(place) {
        let _ = plan.records();
        let _ = plan.fitted();
    }
}

/// A log of runs, in a file at `place`.
pub fn log(place: &Path, lines: impl IntoIterator<Item = impl AsRef<[u8]>>) {
    let lines = lines.into_iter().flat_map(|line| [line.as_ref(), b"\n"].concat());
    fs::write(place, lines.collect::<Vec<u8>>()).unwrap();
    let _ = RunLog::open::<sweep::Run>(place).unwrap();
}
