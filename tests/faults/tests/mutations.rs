//! A bit flipped, or the end cut off, in every file that a later command reads: it ends in the same bytes, or the file is named.
//!
//! Of a file of more than `FAULTS_PLACES` bytes (150 where the variable is not set; for `verify`, which makes runs again, a quarter)
//! every n-th byte is taken, with n the least that gives no more than that many; of byte p the bit p modulo 8 is flipped, of files of up to 32
//! bytes every bit. Cuts are a fifth as many. That no flip
//! and no cut at all passes a seal is proved inside the project (`measurement::seal`, `measurement::run_log`); here it is seen what commands do then.
#![allow(clippy::unwrap_used, reason = "tests")]

mod bench;

use std::{fs, path::PathBuf};

use bench::{CALIBRATE, Case, FEA, Fault, Place, REDUCED, SWEEP, ended, judge, said, was_killed};

/// What an altered file is fed to.
struct Reader<'a> {
    place: &'a Place,
    arguments: &'a [&'a [&'a str]],
    /// Whether success must mean the same bytes in `out`; else success is a silent difference.
    makes: bool,
}

fn places(length: usize, makes: bool) -> Vec<usize> {
    let most: usize = std::env::var("FAULTS_PLACES").ok().and_then(|text| text.parse().ok()).unwrap_or(150);
    let most = if makes { most } else { most.div_ceil(4) };
    (0..length).step_by(length.div_ceil(most).max(1)).collect()
}

/// The file with a bit flipped at one of the places, or cut there, and what was done to it.
fn mutations(whole: &[u8], places: &[usize]) -> Vec<(String, Vec<u8>)> {
    let bits = |place: usize| if whole.len() <= 32 { (0..8).collect() } else { vec![place % 8] };
    let flip = |(place, bit): (usize, usize)| {
        let mut flipped = whole.to_vec();
        flipped[place] ^= 1 << bit;
        (format!("bit {bit} of byte {place}"), flipped)
    };
    let cut = |&length: &usize| (format!("cut to {length} bytes"), whole[..length].to_vec());
    let flips = places.iter().flat_map(|&place| bits(place).into_iter().map(move |bit| (place, bit)));
    flips.map(flip).chain(places.iter().step_by(5).map(cut)).collect()
}

fn mutate(file: &str, reader: &Reader<'_>) {
    let begin = std::time::Instant::now();
    let whole = fs::read(reader.place.root().join(file)).unwrap();
    let unaltered = reader.place.copy();
    let output = unaltered.plain(reader.arguments);
    assert!(output.status.success(), "{file}: {}", said(&output));
    let expected = unaltered.contents("work/out");
    let (mut same, mut named, mut failures) = (0, 0, Vec::new());
    let name = file.rsplit('/').next().unwrap();
    let places = places(whole.len(), reader.makes);
    let mutations = mutations(&whole, &places);
    for (what, bytes) in &mutations {
        let place = reader.place.copy();
        fs::write(place.root().join(file), bytes).unwrap();
        let output = place.plain(reader.arguments);
        let message = said(&output) + &String::from_utf8_lossy(&output.stdout);
        match ended(&output) {
            Err(why) => failures.push(format!("{file}: {what}: {why}")),
            Ok(0) if reader.makes && place.contents("work/out") == expected => same += 1,
            Ok(_) if message.contains(name) => named += 1,
            Ok(code) => failures.push(format!("{file}: {what}: exit {code} and not a word of it: {}", said(&output))),
        }
    }
    println!(
        "mutations | {} | {} of {} bytes, {} mutations | {same} same bytes | {named} named | {} failed | {:.0} s",
        file.rsplit_once("state/").map_or(file, |(_, name)| name),
        places.len(),
        whole.len(),
        mutations.len(),
        failures.len(),
        begin.elapsed().as_secs_f64()
    );
    judge(file, &failures);
}

/// What a run leaves that is killed at the first change for which `here` holds.
fn killed(case: &Case, here: impl Fn(&bench::Change) -> bool, skip: usize) -> Place {
    let arguments: [&[&str]; 2] = [case.arguments, &["--out", "out"]];
    let counted = Place::of(case);
    let place = counted.copy();
    let (_, whole) = counted.run(&arguments, Fault::None, 0);
    let at = whole.iter().enumerate().filter(|(_, change)| here(change)).nth(skip).unwrap().0 + 1;
    let (output, _) = place.run(&arguments, Fault::Kill, at);
    assert!(was_killed(&output));
    place
}

fn ends(change: &bench::Change, end: &str) -> bool {
    change.paths.last().is_some_and(|path| path.ends_with(end))
}

#[test]
fn the_state_of_a_sweep() {
    let place = killed(&SWEEP, |change| change.call == "write" && ends(change, "runs.jsonl"), 3);
    let arguments: [&[&str]; 2] = [SWEEP.arguments, &["--out", "out", "--resume"]];
    for name in ["runs.jsonl", "plan.json", "command"] {
        mutate(
            &format!("work/.out.unfinished/state/{name}"),
            &Reader { place: &place, arguments: &arguments, makes: true },
        );
    }
}

#[test]
fn the_state_of_a_calibration() {
    let place = killed(&CALIBRATE, |change| ends(change, ".out.unfinished/results"), 0);
    let arguments: [&[&str]; 2] = [CALIBRATE.arguments, &["--out", "out", "--resume"]];
    for name in ["linear.json", "command"] {
        mutate(
            &format!("work/.out.unfinished/state/{name}"),
            &Reader { place: &place, arguments: &arguments, makes: true },
        );
    }
}

#[test]
fn the_state_of_a_finite_element_analysis() {
    let place = killed(&FEA, |change| ends(change, ".out.unfinished/results"), 0);
    let arguments: [&[&str]; 2] = [FEA.arguments, &["--out", "out", "--resume"]];
    let fields = ["fields/field_000000.vtu", "fields/fields.pvd"];
    for name in ["checkpoint.json", "plan.json", "command"].into_iter().chain(fields) {
        mutate(
            &format!("work/.out.unfinished/state/{name}"),
            &Reader { place: &place, arguments: &arguments, makes: true },
        );
    }
}

#[test]
fn kept_reduced_bodies() {
    let place = Place::new();
    let arguments: [&[&str]; 2] = [REDUCED.arguments, &["--out", "out"]];
    assert!(place.plain(&arguments).status.success());
    fs::remove_dir_all(place.work("out")).unwrap();
    let kept: Vec<PathBuf> =
        fs::read_dir(place.root().join("cache/granchain")).unwrap().map(|entry| entry.unwrap().path()).collect();
    for file in kept {
        let file = file.strip_prefix(place.root()).unwrap().display().to_string();
        mutate(&file, &Reader { place: &place, arguments: &arguments, makes: true });
    }
}

#[test]
fn a_finished_calibration() {
    let place = Place::with_bench();
    assert!(place.plain(&[CALIBRATE.arguments, &["--out", "done"]]).status.success());
    let replay: [&[&str]; 1] =
        [&["replay", "--scene", "bench.toml", "--set", "duration=50us", "--calibration", "done", "--out", "out"]];
    for name in ["calibration.json", ".granchain"] {
        mutate(&format!("work/done/{name}"), &Reader { place: &place, arguments: &replay, makes: true });
    }
    let verify: [&[&str]; 1] = [&["verify", "done"]];
    for name in ["manifest.json", "calibration.json"] {
        mutate(&format!("work/done/{name}"), &Reader { place: &place, arguments: &verify, makes: false });
    }
}
