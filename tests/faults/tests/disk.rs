//! A disk that is full, or broken, from every change on or for that change alone: the command says so and keeps its state, and taken up
//! again it ends in the same bytes with at most one batch made twice.
#![allow(clippy::unwrap_used, reason = "tests")]

mod bench;

use bench::{
    CALIBRATE, Case, FEA, Fault, Place, SWEEP, COVERAGE, compare, count, drop_kept, ended, judge, recover, representative,
    said,
};

/// `wholly`: at every change, and for one call alone too; else at the representative ones.
fn fail_everywhere(case: &Case, wholly: bool) {
    let begin = std::time::Instant::now();
    let arguments = [case.arguments, &["--out", "out"]];
    let unbroken = Place::of(case);
    let before = unbroken.copy();
    let (output, whole) = unbroken.run(&arguments, Fault::None, 0);
    assert!(output.status.success(), "{}", said(&output));
    let batches = count(&whole, case.keeps);
    let expected = unbroken.contents("work");
    let chosen = if wholly { (1..=whole.len()).collect() } else { representative(&whole) };
    let faults = [Fault::Full, Fault::Broken, Fault::FullOnce, Fault::BrokenOnce];
    for fault in faults.into_iter().take(if wholly { 4 } else { 2 }) {
        let (mut points, mut refused, mut unharmed, mut most_lost, mut failures) = (0, 0, 0, 0, Vec::new());
        for &at in &chosen {
            let change = &whole[at - 1];
            points += 1;
            let place = before.copy();
            let (output, log) = place.run(&arguments, fault, at);
            let what =
                format!("{} {fault:?} at {at} of {} ({} {:?})", case.name, whole.len(), change.call, change.paths);
            // The call that failed is no batch kept; none after it is, where all fail.
            let last = if matches!(fault, Fault::FullOnce | Fault::BrokenOnce) { log.len() } else { at - 1 };
            let kept = count(&log[..at - 1], case.keeps) + count(log.get(at + 1..last).unwrap_or_default(), case.keeps);
            let mut check = || -> Result<(), String> {
                match ended(&output)? {
                    0 => {
                        // What it could do without: the results stand.
                        unharmed += 1;
                        compare(&place, "work/out", &sub(&expected))?;
                    }
                    1 => {
                        refused += 1;
                        let reported = ["No space left on device", "Input/output error"]
                            .iter()
                            .any(|text| said(&output).contains(text));
                        if !reported || !said(&output).contains('/') {
                            return Err(format!("the message does not say what is wrong and where: {}", said(&output)));
                        }
                        let there = place.contents("work/out");
                        if !there.is_empty() && there != sub(&expected) {
                            return Err("a part of the results stands".into());
                        }
                    }
                    code => return Err(format!("exit code {code}: {}", said(&output))),
                }
                let done = output.status.success();
                drop_kept(&place, &said(&output));
                let (_, log) = recover(&place, &arguments, case.resumes)?;
                compare(&place, "work", &expected)?;
                if !done {
                    let lost = (kept + count(&log, case.keeps)).saturating_sub(batches);
                    most_lost = most_lost.max(lost);
                    if lost > 1 {
                        return Err(format!("{lost} batches that were kept were made again"));
                    }
                }
                Ok(())
            };
            if let Err(why) = check() {
                failures.push(format!("{what}: {why}"));
            }
        }
        println!(
            "disk {fault:?} | {} | {points} fault points | {refused} said so, {unharmed} finished all the same | at most {most_lost} of {batches} \
             batches made again | {} failed | {:.0} s",
            case.name,
            failures.len(),
            begin.elapsed().as_secs_f64()
        );
        judge(case.name, &failures);
    }
}

/// What is in `out`.
fn sub(work: &bench::Contents) -> bench::Contents {
    work.iter()
        .filter_map(|(name, bytes)| Some((name.strip_prefix("out/")?.to_owned(), bytes.clone())))
        .filter(|(name, _)| !name.is_empty())
        .collect()
}

#[test]
fn a_sweep() {
    fail_everywhere(&SWEEP, true);
}

#[test]
fn a_calibration() {
    fail_everywhere(&CALIBRATE, false);
}

#[test]
fn a_finite_element_analysis() {
    fail_everywhere(&FEA, false);
}

#[test]
fn coverage() {
    fail_everywhere(&COVERAGE, false);
}
