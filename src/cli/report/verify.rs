//! `granchain report verify`: whether the numbers in a calibration's folder are those that follow from its inputs.
//!
//! Inputs and stored runs → the answer by the same likelihood, the fitted simulation run again, the records measured anew → every file of
//! the folder made again → what differs from the folder, number by number. The folder is read only.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail};
use clap::{Args, Parser};
use serde::Serialize;
use serde_json::Value;

use super::{
    difference::{Difference, ROUNDING, Rounded, differences, numbers},
    inputs,
};
use crate::{
    calibration::{
        fingerprints::{self, difference, distance},
        forward::Run,
        ladder::{Made, SavedFit},
        outcome::CalibrationOutcome,
    },
    cli::{
        Outcome,
        arguments::Session,
        calibrate::{
            self, InMemory, Job,
            files::{self, Files, Stop},
            manifest::{self, Manifest},
        },
        output::{LIST, digest, files_below, list_text},
        summary,
        timing::{self, Timing},
    },
    measurement::{
        read_back::{LARGE, SMALL, read_back},
        sha256,
    },
    model::vector_unit,
    report::{number::significant, page},
};

/// Stored runs of each candidate that are made again, on the chain and as pairs.
const RUNS_AGAIN: usize = 12;
const PAIRS_AGAIN: usize = 3;

/// How far aside runs are made once more to see what rounding does to them, widths of the box: far above what any processor's rounding is.
const ASIDE: f64 = 1e-12;

/// Differences of one file that are printed.
const PRINTED: usize = 8;

/// Arguments of `granchain report verify`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Folder that `granchain calibrate` wrote
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Folder with the record and the other inputs, under any names: they are known by their digests [default: where they were]
    #[arg(long, value_name = "DIR")]
    pub inputs: Option<PathBuf>,
    /// Make every run of the fit again, in place of taking those stored
    #[arg(long)]
    pub whole: bool,
}

/// The arguments of `calibrate`, from the manifest.
#[derive(Debug, Parser)]
#[command(name = "granchain calibrate")]
struct Line {
    #[command(flatten)]
    arguments: calibrate::Arguments,
}

/// What came of it.
#[derive(Debug, Serialize)]
struct Verification {
    folder: PathBuf,
    /// Whether nothing differs.
    verified: bool,
    /// What the folder says it was written by.
    written_by: String,
    verified_by: String,
    /// What did the arithmetic then, and what does it now.
    written_on: String,
    verified_on: String,
    /// Numbers that are another processor's rounding apart; none are allowed where it is the same.
    rounded: Option<Rounded>,
    parts: Vec<Part>,
    differences: Vec<Difference>,
    /// Files of the manifest that are not in the folder.
    missing: Vec<String>,
    /// Files in the folder that the manifest does not know.
    unknown: Vec<String>,
}

/// Some of the numbers, and what holds them.
#[derive(Debug, Serialize)]
struct Part {
    what: String,
    numbers: usize,
    how: String,
}

/// Run it.
///
/// # Errors
/// When the folder holds no calibration, an input is missing or another one, or the calibration cannot be derived anew.
pub fn execute(arguments: &Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let folder = std::path::absolute(&arguments.folder).context("the current folder cannot be told")?;
    let manifest = read_manifest(&folder)?;
    let Stored { files: stored, unknown } = read(&folder, &manifest)?;
    let mut verification = Verification {
        folder,
        verified: false,
        written_by: manifest.program.clone(),
        verified_by: summary::program(),
        written_on: manifest.processor.clone(),
        verified_on: vector_unit(),
        rounded: (manifest.processor != vector_unit()).then(Rounded::default),
        parts: Vec::new(),
        differences: told_twice(&manifest, &stored),
        missing: manifest.files.keys().filter(|name| !stored.contains_key(*name)).cloned().collect(),
        unknown,
    };
    if verification.differences.is_empty() {
        // The folder for the inputs goes when this is dropped.
        let place = tempfile::tempdir().context("a folder for the inputs cannot be made")?;
        let session = elsewhere(session)?;
        provide(&manifest, &stored, arguments.inputs.as_deref(), place.path())?;
        verify(&manifest, &stored, arguments.whole, &session, &mut verification)?;
    }
    if verification.differences.is_empty() {
        verification.differences = list_differences(&verification.folder, &stored, &manifest)?;
    }
    verification.verified = verification.differences.is_empty();
    session.result(text(&verification), &verification)?;
    Ok(if verification.verified { Outcome::Done } else { Outcome::Broken })
}

/// The files of a calibration's folder.
struct Stored {
    /// Those that the manifest knows, and itself, by their names.
    files: BTreeMap<String, Vec<u8>>,
    /// Names of the others, which are not read.
    unknown: Vec<String>,
}

/// The manifest, before anything else of the folder is read.
fn read_manifest(folder: &Path) -> anyhow::Result<Manifest> {
    for name in [manifest::FILE, fingerprints::FILE] {
        if !folder.join(name).is_file() {
            bail!(
                "{}: expected the folder of a calibration, found no {name}; name one that `granchain calibrate` wrote, or calibrate again: \
                 versions before this file cannot be verified",
                folder.display()
            );
        }
    }
    let path = folder.join(manifest::FILE);
    let bytes = read_back(&path, LARGE).with_context(|| format!("{}: cannot be read", path.display()))?;
    serde_json::from_slice(&bytes)
        .with_context(|| format!("{}: expected a manifest; the file was altered", path.display()))
}

/// Look through the folder.
fn read(folder: &Path, manifest: &Manifest) -> anyhow::Result<Stored> {
    let mut stored = Stored { files: BTreeMap::new(), unknown: Vec::new() };
    let own = [manifest::FILE, fingerprints::FILE, timing::FILE];
    for name in files_below(folder)?.into_iter().filter(|name| name != LIST) {
        if manifest.files.contains_key(&name) || own.contains(&name.as_str()) {
            let path = folder.join(&name);
            let bytes = read_back(&path, LARGE).with_context(|| format!("{}: cannot be read", path.display()))?;
            stored.files.insert(name, bytes);
        } else {
            stored.unknown.push(name);
        }
    }
    Ok(stored)
}

/// What the manifest and another file both say, and say otherwise: without either there is nothing to begin from.
fn told_twice(manifest: &Manifest, stored: &BTreeMap<String, Vec<u8>>) -> Vec<Difference> {
    let mut told = Vec::new();
    let mut compare = |key: &str, other: &str, expected: Option<String>, found: String| {
        let Some(expected) = expected.filter(|expected| *expected != found) else { return };
        let place = format!("{}: {key}, beside {other}; one of them was altered", manifest::FILE);
        let differing = differences(manifest::FILE, expected.as_bytes(), found.as_bytes(), None);
        told.extend(differing.into_iter().map(|difference| Difference { place: place.clone(), ..difference }));
    };
    let outcome: Option<Value> = stored.get("calibration.json").and_then(|bytes| serde_json::from_slice(bytes).ok());
    let program = outcome.as_ref().and_then(|outcome| outcome["program"].as_str().map(String::from));
    compare("program", "calibration.json: program", program, manifest.program.clone());
    let shown = stored.get("report.html").and_then(|page| shown_command_line(&String::from_utf8_lossy(page)));
    compare("arguments", "report.html: command line", shown, manifest::command_line(&manifest.arguments));
    told
}

/// The command line that a page shows.
fn shown_command_line(page: &str) -> Option<String> {
    let (_, rest) = page.split_once("<pre>granchain calibrate")?;
    let (line, _) = rest.split_once("</pre>")?;
    let plain = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&amp;", "&")]
        .iter()
        .fold(line.to_owned(), |line, (escaped, letter)| line.replace(escaped, letter));
    Some(format!("granchain calibrate{plain}"))
}

/// Where the folder's list is another one than that of its files; a folder may have been copied without it.
fn list_differences(
    folder: &Path,
    stored: &BTreeMap<String, Vec<u8>>,
    manifest: &Manifest,
) -> anyhow::Result<Vec<Difference>> {
    let path = folder.join(LIST);
    if std::fs::symlink_metadata(&path).is_err() {
        return Ok(Vec::new());
    }
    let mut found = read_back(&path, SMALL).with_context(|| format!("{}: cannot be read", path.display()))?;
    if !stored.contains_key(timing::FILE) {
        // Not in the manifest; a folder may be passed on without it.
        let lines = found.split_inclusive(|byte| *byte == b'\n');
        found = lines.filter(|line| !line.ends_with(b"  timing.json\n")).collect::<Vec<_>>().concat();
    }
    let gone = manifest.files.iter().filter(|(name, _)| !stored.contains_key(*name));
    let there = stored.iter().map(|(name, bytes)| (name.clone(), digest(name, bytes)));
    let expected = list_text(there.chain(gone.map(|(name, digest)| (name.clone(), digest.clone()))));
    Ok(differences(LIST, expected.as_bytes(), &found, None))
}

/// The session, good in any folder.
fn elsewhere(session: &Session) -> anyhow::Result<Session> {
    let mut session = session.clone();
    if let Some(cache) = session.cache.take() {
        let named = cache.as_os_str() != "none";
        session.cache = Some(if named { std::path::absolute(cache).context("--cache")? } else { cache });
    }
    Ok(session)
}

/// Have every input where the calibration found it, if need be by going elsewhere.
fn provide(
    manifest: &Manifest,
    stored: &BTreeMap<String, Vec<u8>>,
    folder: Option<&Path>,
    place: &Path,
) -> anyhow::Result<()> {
    if let Some(folder) = folder {
        let here = inputs::stage(&manifest.inputs, folder, place)?;
        std::env::set_current_dir(&here).with_context(|| format!("{}: cannot be entered", here.display()))?;
    }
    let outcome = stored.get("calibration.json").and_then(|bytes| serde_json::from_slice::<Value>(bytes).ok());
    let digest = |role: &String| {
        let digest = outcome.as_ref()?["inputs"][role.as_str()]["sha256"].as_str()?;
        Some((role.clone(), digest.to_owned()))
    };
    inputs::check(&manifest.inputs, &manifest.inputs.keys().filter_map(digest).collect())
}

fn verify(
    manifest: &Manifest,
    stored: &BTreeMap<String, Vec<u8>>,
    whole: bool,
    session: &Session,
    verification: &mut Verification,
) -> anyhow::Result<()> {
    let line = std::iter::once("granchain calibrate").chain(manifest.arguments.iter().map(String::as_str));
    let Line { arguments } = Line::try_parse_from(line)
        .map_err(|error| anyhow!("{}: arguments: {}", manifest::FILE, error.to_string().trim()))?;
    let mut job = calibrate::prepare(arguments, manifest.arguments.clone(), &InMemory::default())?;
    job.program.clone_from(&manifest.program);
    let session = Session { json: false, ..session.clone() };
    let names = job.problem.names();

    let runs = &stored[fingerprints::FILE];
    let as_told = manifest.files.get(fingerprints::FILE) == Some(&sha256(runs));
    if !as_told && !whole {
        session.note(format_args!(
            "{} is not what {} says: every run is made again to find what was altered",
            fingerprints::FILE,
            manifest::FILE
        ));
    }
    let taken = as_told && !whole;
    let saved: Vec<SavedFit> = if taken { saved(&job, fingerprints::from_csv(&names, runs)?)? } else { Vec::new() };
    let mut timing = Timing::start();
    let fitted = files::fitted(&job, saved, &session, &mut timing)?;
    let rounds = verification.rounded.is_some();
    let again = if taken { make_again(&fitted.made, &names, rounds, &mut verification.differences) } else { 0 };
    let same = match (verification.differences.is_empty(), rounds) {
        (true, false) => "all the same to the last digit",
        (true, true) => "all the same but for rounding",
        (false, _) => "not all the same",
    };
    let mut derived = Files::of(&job, &fitted, &session, &mut timing, &Stop::on_interrupt())?;
    if let Some((_, bytes)) = derived.files.iter_mut().find(|(name, _)| rounds && name == Path::new(manifest::FILE)) {
        *bytes = as_written(bytes, manifest, stored)?;
    }

    for (name, bytes) in &derived.files {
        let name = name.display().to_string();
        if let Some(found) = stored.get(&name) {
            let rounded = verification.rounded.as_mut().filter(|_| name != manifest::FILE);
            verification.differences.extend(differences(&name, bytes, found, rounded));
        }
    }
    if stored.get(timing::FILE).is_some_and(|bytes| timing::is_as_sealed(bytes) != Some(true)) {
        verification.differences.push(Difference {
            place: format!("{}: sha256", timing::FILE),
            expected: "the digest of the times beside it".into(),
            found: "that of others; which of them was altered cannot be told".into(),
        });
    }
    let made: usize = fitted.made.iter().map(|made| made.runs.len()).sum();
    let how_runs = if taken {
        format!("SHA-256; {again} of {made} runs made again, {same}")
    } else {
        format!("all {made} runs made again")
    };
    verification.parts = parts(manifest, stored, &derived.files, &derived.outcome, how_runs, taken);
    Ok(())
}

/// The manifest derived, with the digests of the files as they are stored: where another processor made them, those made here have others.
fn as_written(derived: &[u8], manifest: &Manifest, stored: &BTreeMap<String, Vec<u8>>) -> anyhow::Result<Vec<u8>> {
    let mut derived: Manifest = serde_json::from_slice(derived)?;
    derived.processor.clone_from(&manifest.processor);
    for (name, digest) in &mut derived.files {
        // A file that was taken out of the folder is told of elsewhere.
        if let Some(found) = stored.get(name).map(|bytes| sha256(bytes)).or_else(|| manifest.files.get(name).cloned()) {
            *digest = found;
        }
    }
    summary::json(&derived)
}

/// The stored runs, candidate by candidate.
fn saved(job: &Job, runs: Vec<fingerprints::CandidateRuns>) -> anyhow::Result<Vec<SavedFit>> {
    let expected: Vec<String> = job.problem.candidates.iter().map(|candidate| candidate.key()).collect();
    let found: Vec<&str> = runs.iter().map(|runs| runs.candidate.as_str()).collect();
    if expected != found {
        bail!(
            "{}: expected runs of {}, found those of {}; verify with --whole, or calibrate again",
            fingerprints::FILE,
            expected.join(", "),
            found.join(", ")
        );
    }
    Ok(runs.into_iter().map(SavedFit::ended).collect())
}

/// Make some of the stored runs again, evenly spread; returns how many. Where another processor `rounds` otherwise, a run may differ by as much as
/// it does from the one [`ASIDE`] of it.
fn make_again(all: &[Made], names: &fingerprints::Names, rounds: bool, told: &mut Vec<Difference>) -> usize {
    let spread = |count: usize, of: usize| (0..of.min(count)).map(move |index| index * count / of.min(count));
    let mut again = 0;
    for made in all {
        let candidate = &made.runs.candidate;
        let mut compare = |what: String, stored: &Run, anew: &Run, beside: Option<&Run>| {
            again += 1;
            let moved = |beside: &Run| ROUNDING + distance(anew, beside).unwrap_or(f64::INFINITY);
            if let Some(difference) = difference(names, stored, anew, beside.map_or(0.0, moved)) {
                told.push(Difference {
                    place: format!("{}: {what} of {candidate}", fingerprints::FILE),
                    expected: "the run made again".into(),
                    found: difference,
                });
            }
        };
        let searched: usize = made.runs.search.iter().map(Vec::len).sum();
        for number in spread(searched, RUNS_AGAIN) {
            if let Some((stored, anew)) = made.searched_again(number, 0.0) {
                let beside = rounds.then(|| made.searched_again(number, ASIDE)).flatten().map(|(_, run)| run);
                compare(format!("run {}", number + 1), stored, &anew, beside.as_ref());
            }
        }
        for (rung, rounds_of) in made.runs.corrections.iter().enumerate() {
            for number in spread(rounds_of.iter().map(Vec::len).sum(), PAIRS_AGAIN) {
                let Some((stored, anew)) = made.paired_again(rung, number, 0.0) else { continue };
                let beside = rounds.then(|| made.paired_again(rung, number, ASIDE)).flatten().map(|(_, pair)| pair);
                let of = |model: &str| format!("run {} on {model}", made.runs.before(rung) + number + 1);
                let [lower, upper] = [names.model(rung), names.model(rung + 1)].map(of);
                compare(lower, &stored.lower, &anew.lower, beside.as_ref().map(|pair| &pair.lower));
                compare(upper, &stored.upper, &anew.upper, beside.as_ref().map(|pair| &pair.upper));
            }
        }
    }
    again
}

/// What was held against what, with how many numbers.
fn parts(
    manifest: &Manifest,
    stored: &BTreeMap<String, Vec<u8>>,
    derived: &page::Files,
    outcome: &CalibrationOutcome,
    how_runs: String,
    taken: bool,
) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut add = |what: &str, numbers, how: &str| parts.push(Part { what: what.into(), numbers, how: how.into() });
    let roles: Vec<&str> = manifest.inputs.keys().map(String::as_str).collect();
    add(&format!("inputs: {}", roles.join(", ")), roles.len(), "SHA-256 of each file");
    let here: BTreeSet<String> = stored.keys().cloned().collect();
    let mut left: BTreeMap<String, usize> = derived
        .iter()
        .map(|(name, bytes)| (name.display().to_string(), numbers(bytes)))
        .filter(|(name, _)| here.contains(name))
        .collect();
    if let Some(count) = left.remove(fingerprints::FILE) {
        add(fingerprints::FILE, count, &how_runs);
    }
    if let Some(count) = left.remove("calibration.json") {
        let json = serde_json::to_value(outcome).unwrap_or_default();
        let leaves = |value: &Value| numbers(format!("{value:#}").as_bytes());
        let features = leaves(&json["features"])
            + json["records"]
                .as_array()
                .map_or(0, |records| records.iter().map(|record| leaves(&record["features"])).sum());
        add("calibration.json: features", features, "record measured anew, fitted simulation run again");
        let rest = if taken { "by the likelihood from the runs stored" } else { "by the likelihood from those runs" };
        add("calibration.json: everything else", count.saturating_sub(features), rest);
    }
    let mut group = |what: &str, how: &str, member: &dyn Fn(&str) -> bool| {
        let counts: Vec<usize> = left.iter().filter(|(name, _)| member(name)).map(|(_, count)| *count).collect();
        left.retain(|name, _| !member(name));
        if !counts.is_empty() {
            let files = if counts.len() == 1 { "1 file".into() } else { format!("{} files", counts.len()) };
            parts.push(Part { what: format!("{what} ({files})"), numbers: counts.iter().sum(), how: how.into() });
        }
    };
    group("recorded_*.csv", "record read anew", &|name| name.starts_with("recorded_"));
    group("simulated_*.csv", "fitted simulation run again", &|name| name.starts_with("simulated_"));
    group("figures", "drawn anew", &|name| name.starts_with("figures"));
    group("report and tables", "made anew from all of these", &|name| name != manifest::FILE);
    group(manifest::FILE, "inputs and files digested anew", &|_| true);
    if let Some(bytes) = stored.get(timing::FILE) {
        let how = "its own SHA-256 alone: times cannot be derived".to_owned();
        parts.push(Part { what: timing::FILE.into(), numbers: numbers(bytes), how });
    }
    parts
}

fn text(verification: &Verification) -> String {
    let mut text = format!("{}: written by {}", verification.folder.display(), verification.written_by);
    // Writing to a string cannot fail.
    let _ = if verification.written_by == verification.verified_by {
        writeln!(text, ", the version that verifies it")
    } else {
        writeln!(text, ", verified by {}: another version may come to other numbers", verification.verified_by)
    };
    let width = verification.parts.iter().map(|part| part.what.chars().count()).max().unwrap_or(0);
    if !verification.parts.is_empty() {
        let _ = writeln!(text, "\n  {:width$}  {:>7}  how", "what", "numbers");
    }
    for part in &verification.parts {
        let _ = writeln!(text, "  {:width$}  {:>7}  {}", part.what, part.numbers, part.how);
    }
    for (what, files) in [
        ("Of the manifest but not in the folder, so not verified", &verification.missing),
        ("In the folder but not of the manifest, so not verified", &verification.unknown),
    ] {
        if !files.is_empty() {
            let more = files.len().saturating_sub(PRINTED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let shown: Vec<&str> = files.iter().take(PRINTED).map(String::as_str).collect();
            let _ = writeln!(text, "\n{what}: {}{more}", shown.join(", "));
        }
    }
    let _ = writeln!(text);
    let file = |difference: &Difference| difference.place.split(':').next().unwrap_or_default().to_owned();
    let mut told: BTreeMap<String, usize> = BTreeMap::new();
    for difference in &verification.differences {
        let count = told.entry(file(difference)).or_default();
        *count += 1;
        if *count <= PRINTED {
            let Difference { place, expected, found } = difference;
            let _ = writeln!(text, "{place}\n    expected {expected}, found {found}");
        }
    }
    for (file, count) in told.into_iter().filter(|(_, count)| *count > PRINTED) {
        let _ = writeln!(text, "{file}: {} more", count - PRINTED);
    }
    let _ = writeln!(text, "{}", verdict(verification));
    text
}

/// The last line, or two.
fn verdict(verification: &Verification) -> String {
    let of = "what this program derives from these inputs";
    let differing = match verification.differences.len() {
        0 => None,
        1 => Some(format!("Not verified: one number or word is not {of}.")),
        count => Some(format!("Not verified: {count} numbers or words are not {of}.")),
    };
    let Some(rounded) = &verification.rounded else {
        return differing.unwrap_or_else(|| format!("Verified: every number is {of}."));
    };
    let (then, now) = (&verification.written_on, &verification.verified_on);
    match differing {
        None => format!(
            "Verified to rounding: the folder was written by another processor ({then}; here {now}). Every number is {of} to {ROUNDING:e} of it; {} are not the \
             same to the last digit, the farthest by {} of it. Pictures (PNG) were held by their digests alone.",
            rounded.numbers,
            significant(rounded.largest, 1)
        ),
        Some(differing) => format!(
            "{differing}\nThe folder was written by another processor ({then}; here {now}): {} more differ by rounding, up to {ROUNDING:e}. Where the motion is \
             chaotic, rounding grows to the first digit within some ten periods; on a processor like the first, nothing but what was altered differs.",
            rounded.numbers
        ),
    }
}
