//! An older output that is replaced with `--force`: killed at any instant, or on a failing disk, the folder holds the old output or the new one.
//!
//! Where a stranger's file keeps the folder from being exchanged, results go in one by one: then old and new may stand side by side until
//! the command is taken up again. At how many instants, the test prints.
#![allow(clippy::unwrap_used, reason = "tests")]

mod bench;

use std::fs;

use bench::{Contents, Fault, Place, compare, drop_kept, ended, judge, recover, said};

struct Way {
    name: &'static str,
    arguments: &'static [&'static str],
    old: &'static [&'static str],
    resumes: bool,
    stranger: bool,
}

const SWEEP: &[&str] = &["sweep", "--scene", "rigid", "--model", "chain", "--set", "duration=100us", "--vary"];
const REPLAY: &[&str] = &["replay", "--scene", "rigid", "--model", "chain", "--set", "duration=50us"];

const WAYS: [Way; 4] = [
    Way { name: "replay", arguments: &["--alpha", "0.5"], old: &[], resumes: false, stranger: false },
    Way { name: "sweep", arguments: &["alpha=0.5,0.7"], old: &["drive.cycles=20,40"], resumes: true, stranger: false },
    Way {
        name: "replay beside a stranger's file",
        arguments: &["--alpha", "0.5"],
        old: &[],
        resumes: false,
        stranger: true,
    },
    Way {
        name: "sweep beside a stranger's file",
        arguments: &["alpha=0.5,0.7"],
        old: &["drive.cycles=20,40"],
        resumes: true,
        stranger: true,
    },
];

fn replace_everywhere(way: &Way) {
    let begin = std::time::Instant::now();
    let command = if way.resumes { SWEEP } else { REPLAY };
    let before = Place::new();
    assert!(before.plain(&[command, way.old, &["--out", "out"]]).status.success());
    if way.stranger {
        fs::write(before.work("out/thesis.tex"), "years of work").unwrap();
    }
    let arguments: [&[&str]; 3] = [command, way.arguments, &["--out", "out", "--force"]];
    let old = before.contents("work/out");
    let unbroken = before.copy();
    let (output, whole) = unbroken.run(&arguments, Fault::None, 0);
    assert!(output.status.success(), "{}", said(&output));
    let (expected, new) = (unbroken.contents("work"), unbroken.contents("work/out"));
    assert!(old != new);
    let mut failures = Vec::new();
    let (mut missing, mut mixed, mut points) = (Vec::new(), Vec::new(), 0);
    let mut see = |place: &Place, what: &str, at: usize| {
        points += 1;
        let found: Contents = place.contents("work/out");
        if found.is_empty() {
            missing.push(at);
        } else if found != old && found != new {
            mixed.push(at);
        }
        if way.stranger && found.get("thesis.tex").map(Vec::as_slice) != Some(b"years of work") {
            failures.push(format!("{what}: the stranger's file is gone"));
        }
        if let Err(why) = recover(place, &arguments, way.resumes).and_then(|_| compare(place, "work", &expected)) {
            failures.push(format!("{what}: {why}"));
        }
    };
    let stopped = before.copy();
    let mut at = 0;
    stopped.stopped(&arguments, |change, half| {
        at += usize::from(!half);
        see(&stopped.copy(), &format!("{} killed at {at} ({change:?})", way.name), at);
    });
    for fault in [Fault::Full, Fault::BrokenOnce] {
        // From the list of the results on; before it nothing is changed that stands.
        let list =
            whole.iter().position(|change| change.paths.last().unwrap().ends_with("/results/.granchain")).unwrap();
        for at in list - 3..=whole.len() {
            let place = before.copy();
            let (output, _) = place.run(&arguments, fault, at);
            let what = format!("{} {fault:?} at {at} ({:?})", way.name, whole[at - 1]);
            match ended(&output) {
                Ok(0 | 1) => {
                    drop_kept(&place, &said(&output));
                    see(&place, &what, at)
                }
                other => panic!("{what}: {other:?}"),
            }
        }
    }
    for instants in [&mut missing, &mut mixed] {
        instants.sort_unstable();
        instants.dedup();
    }
    println!(
        "replaced | {} | {} changes | {points} fault points | missing at {missing:?} | mixed at {mixed:?} | {} failed | {:.0} s",
        way.name,
        whole.len(),
        failures.len(),
        begin.elapsed().as_secs_f64()
    );
    judge(way.name, &failures);
    assert!(missing.is_empty(), "{}: the output was missing", way.name);
    assert!(way.stranger || mixed.is_empty(), "{}: old and new stood side by side", way.name);
}

#[test]
fn a_replay() {
    replace_everywhere(&WAYS[0]);
}

#[test]
fn a_sweep() {
    replace_everywhere(&WAYS[1]);
}

#[test]
fn beside_a_strangers_file() {
    replace_everywhere(&WAYS[2]);
    replace_everywhere(&WAYS[3]);
}
