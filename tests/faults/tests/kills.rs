//! Killed before every change it makes to a file, and in the middle of every write, a command taken up again ends in the same bytes.
//!
//! The sweep is killed at each of these instants. The other commands are stopped there once each in one run, and what then stands on disk
//! is copied and taken up: the same instants in half the time.
#![allow(clippy::unwrap_used, reason = "tests")]

mod bench;

use bench::{
    CALIBRATE, Case, Contents, FEA, Fault, Place, REDUCED, Recovery, SWEEP, COVERAGE, compare, judge, recover, said,
    was_killed,
};

struct Tally<'a> {
    case: &'a Case,
    arguments: [&'a [&'a str]; 2],
    expected: [(&'static str, Contents); 2],
    points: usize,
    resumed: usize,
    again: usize,
    /// Points after which something lies in the temporary folder, which nobody sweeps but the system.
    in_tmp: usize,
    failures: Vec<String>,
}

impl Tally<'_> {
    fn take_up(&mut self, place: &Place, what: &str) {
        self.points += 1;
        let outcome = recover(place, &self.arguments, self.case.resumes).and_then(|(recovery, _)| {
            self.expected.iter().try_for_each(|(folder, expected)| compare(place, folder, expected)).map(|()| recovery)
        });
        self.in_tmp += usize::from(!place.contents("tmp").is_empty());
        match outcome {
            Ok(Recovery::Resumed) => self.resumed += 1,
            Ok(Recovery::Again) => self.again += 1,
            Err(why) => self.failures.push(format!("{what}: {why}")),
        }
    }
}

fn kill_everywhere(case: &Case, really: bool) {
    let begin = std::time::Instant::now();
    let arguments = [case.arguments, &["--out", "out"]];
    let unbroken = Place::of(case);
    let before = unbroken.copy();
    let (output, whole) = unbroken.run(&arguments, Fault::None, 0);
    assert!(output.status.success(), "{}", said(&output));
    assert!(whole.len() > 30, "only {} changes were seen", whole.len());
    let expected = ["work", "cache"].map(|folder| (folder, unbroken.contents(folder)));
    let mut tally =
        Tally { case, arguments, expected, points: 0, resumed: 0, again: 0, in_tmp: 0, failures: Vec::new() };
    if really {
        for at in 1..=whole.len() {
            let change = &whole[at - 1];
            for fault in [Fault::Kill, Fault::Tear].into_iter().take(1 + usize::from(change.call == "write")) {
                let place = before.copy();
                let (output, log) = place.run(&arguments, fault, at);
                let what =
                    format!("{} {fault:?} at {at} of {} ({} {:?})", case.name, whole.len(), change.call, change.paths);
                assert!(
                    was_killed(&output) && log.len() == at,
                    "{what}: {} after {} changes",
                    output.status,
                    log.len()
                );
                tally.take_up(&place, &what);
            }
        }
    } else {
        before.stopped(&arguments, |change, half| {
            let what = format!(
                "{} stopped at {} ({change:?}{})",
                case.name,
                tally.points,
                if half { ", half done" } else { "" }
            );
            tally.take_up(&before.copy(), &what);
        });
        assert!(tally.points >= whole.len(), "{} of {} changes were seen", tally.points, whole.len());
    }
    println!(
        "kills | {} | {} changes | {} fault points | {} same bytes: {} resumed, {} by the command again | {} left something in the temporary folder | {} failed | {:.0} s",
        case.name,
        whole.len(),
        tally.points,
        tally.resumed + tally.again,
        tally.resumed,
        tally.again,
        tally.in_tmp,
        tally.failures.len(),
        begin.elapsed().as_secs_f64()
    );
    judge(case.name, &tally.failures);
}

#[test]
fn a_sweep() {
    kill_everywhere(&SWEEP, true);
}

#[test]
fn a_sweep_that_keeps_reduced_bodies() {
    kill_everywhere(&REDUCED, false);
}

#[test]
fn a_calibration() {
    kill_everywhere(&CALIBRATE, false);
}

#[test]
fn a_finite_element_analysis() {
    kill_everywhere(&FEA, false);
}

#[test]
fn coverage() {
    kill_everywhere(&COVERAGE, false);
}
