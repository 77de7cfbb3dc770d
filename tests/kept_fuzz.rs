//! Whatever a file that the program reads back or is handed holds, it is read or refused: plans, logs of runs.
//! `PROPTEST_CASES=10000000` for a long run; records and scenes have tests of their own, kept bodies theirs beside the code.
#![allow(clippy::unwrap_used, reason = "a test may fail by panicking")]

mod harm;
mod kept;

use std::{fs, path::PathBuf, sync::LazyLock};

use granchain::{cli::parts::Parts, study::sweep};
use harm::{cases, harm, harmed};
use proptest::prelude::*;

fn shipped(name: &str) -> Vec<u8> {
    fs::read(PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap()
}

static PLANS: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let of = |name: &str| shipped(&format!("calibrations/{name}.toml"));
    ["annulus-73khz", "twin-annulus", "twin-levels", "twin-water"].map(of).to_vec()
});

/// One finished point of a sweep, and one that failed.
const RUNS: [&str; 2] = [
    r#"{"index":0,"run":{"finished":{"observation":[0.5,-0.25,null,1e-9,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125,0.125],"energy_residual":1e-9,"ensemble":null}}}"#,
    r#"{"index":1,"run":{"failed":{"reason":"no"}}}"#,
];

/// A whole sweep in one part.
static PART: LazyLock<String> = LazyLock::new(|| {
    let runs = RUNS.map(|run| run.split_once("\"run\":").unwrap().1.strip_suffix('}').unwrap());
    format!(
        r#"{{"program":"{}","arguments":["sweep","--scene","rigid"],"plan_sha256":"0","points":2,"part":{{"number":1,"of":1}},"processor":"x","runs":[{}]}}"#,
        granchain::calibration::problem::program(),
        runs.join(",")
    )
});

fn words() -> Vec<Vec<u8>> {
    let signs = [
        "\n",
        "=",
        "\"",
        "[",
        "]",
        "{",
        "}",
        ",",
        ":",
        "-1",
        "0",
        "1e308",
        "1e999",
        "nan",
        "null",
        "99999999999999999999",
        "\u{1b}",
        "\0",
    ];
    let own = ["[[record]]\n", "[parameters.alpha]\n", "low", "search", "correction", "narrow-1", "index", "run"];
    signs.into_iter().chain(own).map(|word| word.as_bytes().to_vec()).collect()
}

/// A file in memory, where the system has such a place: the disk took longer than all the reading.
fn place() -> tempfile::NamedTempFile {
    tempfile::NamedTempFile::new_in("/dev/shm").or_else(|_| tempfile::NamedTempFile::new()).unwrap()
}

/// What may happen to a file.
fn harms() -> impl Strategy<Value = Vec<harm::Harm>> {
    prop::collection::vec(harm(words()), 1..6)
}

proptest! {
    #![proptest_config(cases(20_000))]

    #[test]
    fn harmed_plans_are_read_or_refused(plan in 0..4usize, harms in harms()) {
        kept::plan(place().path(), &harmed(&PLANS[plan], &harms));
    }

    #[test]
    fn harmed_logs_are_read_or_left_out(harms in harms()) {
        kept::log(place().path(), RUNS.iter().map(|run| harmed(run.as_bytes(), &harms)));
    }

    #[test]
    fn harmed_parts_are_read_or_refused(harms in harms()) {
        let place = place();
        let part = harmed(PART.as_bytes(), &harms);
        fs::write(place.path(), &part).unwrap();
        let read = Parts::of(&[place.path().to_owned()])
            .and_then(|parts| parts.each::<sweep::Run>(|index, _| { assert!(index < 2); Ok(()) }));
        // The whole part is read, so that harmed ones meet more than the first refusal.
        prop_assert!(part != PART.as_bytes() || read.is_ok());
    }
}
