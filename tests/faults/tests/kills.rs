//! Killed before every change it makes to a file, and in the middle of every write, a command taken up again ends in the same bytes.
#![allow(clippy::unwrap_used, reason = "tests")]

mod bench;

use bench::{CALIBRATE, Case, FEA, Fault, Place, REDUCED, Recovery, SWEEP, TWINS, compare, judge, recover, was_killed};

fn kill_everywhere(case: &Case) {
    let begin = std::time::Instant::now();
    let arguments = [case.arguments, &["--out", "out"]];
    let unbroken = Place::of(case);
    let before = unbroken.copy();
    let (output, whole) = unbroken.run(&arguments, Fault::None, 0);
    assert!(output.status.success(), "{}", bench::said(&output));
    assert!(whole.len() > 30, "only {} changes were seen", whole.len());
    let expected = ["work", "tmp", "cache"].map(|folder| (folder, unbroken.contents(folder)));
    let (mut points, mut resumed, mut again, mut failures) = (0, 0, 0, Vec::new());
    for at in 1..=whole.len() {
        let change = &whole[at - 1];
        for fault in [Fault::Kill, Fault::Tear] {
            if fault == Fault::Tear && change.call != "write" {
                continue;
            }
            points += 1;
            let place = before.copy();
            let (output, log) = place.run(&arguments, fault, at);
            let what = format!("{} {fault:?} at {at} of {} ({} {:?})", case.name, whole.len(), change.call, change.paths);
            assert!(was_killed(&output) && log.len() == at, "{what}: {} after {} changes", output.status, log.len());
            let outcome = recover(&place, &arguments, case.resumes).and_then(|(recovery, _)| {
                expected.iter().try_for_each(|(folder, expected)| compare(&place, folder, expected)).map(|()| recovery)
            });
            match outcome {
                Ok(Recovery::Resumed) => resumed += 1,
                Ok(Recovery::Again) => again += 1,
                Err(why) => failures.push(format!("{what}: {why}")),
            }
        }
    }
    println!(
        "kills | {} | {} changes | {points} fault points | {} same bytes: {resumed} resumed, {again} by the command again | {} failed | {:.0} s",
        case.name,
        whole.len(),
        resumed + again,
        failures.len(),
        begin.elapsed().as_secs_f64()
    );
    judge(case.name, &failures);
}

#[test]
fn a_sweep() {
    kill_everywhere(&SWEEP);
}

#[test]
fn a_sweep_that_keeps_reduced_bodies() {
    kill_everywhere(&REDUCED);
}

#[test]
fn a_calibration() {
    kill_everywhere(&CALIBRATE);
}

#[test]
fn a_finite_element_analysis() {
    kill_everywhere(&FEA);
}

#[test]
fn twins() {
    kill_everywhere(&TWINS);
}
