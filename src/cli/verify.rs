//! `granchain verify`: a calibration made again from its recorded inputs, and every number compared with those in its folder.
//!
//! `manifest.json` holds the arguments and the SHA-256 of every input. The inputs are checked, the whole calibration is run again, and numbers of
//! `calibration.json` and of all tables are compared within a tolerance; every file is compared with its digest in the manifest. The folder is
//! read only.

pub mod comparison;
mod inputs;

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    path::{Path, PathBuf},
};

use anyhow::{Context, anyhow, bail};
use clap::{Args, Parser};
use serde::Serialize;

use self::comparison::{Comparison, Difference};
use super::{
    Outcome,
    arguments::Session,
    calibrate::{
        self, InMemory,
        files::{self, Files, Stop},
        manifest::{self, Manifest},
    },
    output::{LIST, digest, files_below, list_faults},
    summary,
    timing::{self, Timing},
};
use crate::{
    measurement::read_back::{LARGE, read_back},
    model::vector_unit,
};

/// Differences that are printed; `--json` has all.
const PRINTED: usize = 12;

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain verify calibrations/annulus-73khz")]
pub struct Arguments {
    /// Folder that `granchain calibrate` wrote
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// Folder with the record and the other input files. Their names may differ; they are recognised by their SHA-256 [default: their original place]
    #[arg(long, value_name = "DIR")]
    pub inputs: Option<PathBuf>,
}

/// The arguments of `calibrate`, from the manifest.
#[derive(Debug, Parser)]
#[command(name = "granchain calibrate")]
struct Line {
    #[command(flatten)]
    arguments: calibrate::Arguments,
}

#[derive(Debug, Serialize)]
struct Verification {
    folder: PathBuf,
    verified: bool,
    written_by: String,
    verified_by: String,
    /// Relative tolerance of every number.
    tolerance: f64,
    numbers: usize,
    differences: Vec<Difference>,
    /// Files of the manifest that are not in the folder.
    missing: Vec<String>,
    /// Files in the folder that the manifest does not know.
    unknown: Vec<String>,
}

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let Arguments { folder, inputs } = arguments;
    let folder = std::path::absolute(folder).context("the current folder is unknown")?;
    let manifest = read_manifest(&folder)?;
    let (stored, unknown) = read(&folder, &manifest)?;
    // The folder for the inputs goes when this is dropped.
    let place = super::output::scratch().context("a folder for the inputs cannot be made")?;
    let session = elsewhere(session.clone())?;
    if let Some(inputs) = &inputs {
        let here = inputs::stage(&manifest.inputs, inputs, place.path())?;
        std::env::set_current_dir(&here).with_context(|| format!("{}: cannot be entered", here.display()))?;
    }
    inputs::check(&manifest.inputs)?;
    let derived = made_again(&manifest, &session)?;

    let mut comparison = Comparison::new(manifest.processor == vector_unit());
    for (name, found) in stored.iter().filter(|(name, _)| *name != manifest::FILE && *name != timing::FILE) {
        match derived.get(name).filter(|_| name.ends_with(".json") || name.ends_with(".csv")) {
            Some(expected) if name.ends_with(".csv") => comparison.tables(name, expected, found),
            Some(expected) => comparison.documents(name, expected, found),
            None => {}
        }
        let (written, found) = (manifest.files.get(name), digest(name, found));
        if let Some(written) = written.filter(|written| **written != found) {
            comparison.differ(format!("{name}: SHA-256"), written, found);
        }
    }
    // The files that the manifest names are those that a calibration writes.
    let own = [manifest::FILE, timing::FILE];
    let place = |name: &str| format!("{}: files.{name}", manifest::FILE);
    for name in manifest.files.keys().filter(|name| !derived.contains_key(*name)) {
        comparison.differ(place(name), "no such file", "its digest");
    }
    for name in derived.keys().filter(|name| !manifest.files.contains_key(*name) && !own.contains(&name.as_str())) {
        comparison.differ(place(name), "its digest", "none");
    }
    for fault in list_faults(&folder, |name| manifest.files.contains_key(name) || own.contains(&name))? {
        // What the manifest tells to be altered needs no second witness.
        if !comparison.differences.iter().any(|difference| difference.place.starts_with(&fault.name)) {
            comparison.differ(fault.place.into(), "as it was written", fault.found);
        }
    }
    let verification = Verification {
        folder,
        verified: comparison.differences.is_empty(),
        written_by: manifest.program.clone(),
        verified_by: summary::program(),
        tolerance: comparison.tolerance,
        numbers: comparison.numbers,
        differences: comparison.differences,
        missing: manifest.files.keys().filter(|name| !stored.contains_key(*name)).cloned().collect(),
        unknown,
    };
    session.result(text(&verification), &verification)?;
    Ok(if verification.verified { Outcome::Done } else { Outcome::Broken })
}

/// The manifest, before anything else of the folder is read.
fn read_manifest(folder: &Path) -> anyhow::Result<Manifest> {
    let path = folder.join(manifest::FILE);
    if !path.is_file() {
        bail!(
            "{}: expected the folder of a calibration, found no {}; name one that `granchain calibrate` wrote",
            folder.display(),
            manifest::FILE
        );
    }
    let bytes = read_back(&path, LARGE).with_context(|| format!("{}: cannot be read", path.display()))?;
    serde_json::from_slice(&bytes)
        .with_context(|| format!("{}: expected a manifest; the file was altered", path.display()))
}

type Stored = BTreeMap<String, Vec<u8>>;

/// The files of the folder that the manifest knows, and the names of the others, which are not read.
fn read(folder: &Path, manifest: &Manifest) -> anyhow::Result<(Stored, Vec<String>)> {
    let (mut stored, mut unknown) = (BTreeMap::new(), Vec::new());
    for name in files_below(folder)?.into_iter().filter(|name| name != LIST) {
        if manifest.files.contains_key(&name) || [manifest::FILE, timing::FILE].contains(&name.as_str()) {
            let path = folder.join(&name);
            let bytes = read_back(&path, LARGE).with_context(|| format!("{}: cannot be read", path.display()))?;
            stored.insert(name, bytes);
        } else {
            unknown.push(name);
        }
    }
    Ok((stored, unknown))
}

/// The session, good in any folder.
fn elsewhere(mut session: Session) -> anyhow::Result<Session> {
    if let Some(cache) = session.cache.take() {
        let named = cache.as_os_str() != "none";
        session.cache = Some(if named { std::path::absolute(cache).context("--cache")? } else { cache });
    }
    Ok(session)
}

/// Every file of the calibration, made again.
fn made_again(manifest: &Manifest, session: &Session) -> anyhow::Result<Stored> {
    let line = std::iter::once("granchain calibrate").chain(manifest.arguments.iter().map(String::as_str));
    let Line { arguments } = Line::try_parse_from(line)
        .map_err(|error| anyhow!("{}: arguments: {}", manifest::FILE, error.to_string().trim()))?;
    let mut job = calibrate::prepare(arguments, manifest.arguments.clone(), &InMemory::default())?;
    job.program.clone_from(&manifest.program);
    let session = Session { json: false, ..session.clone() };
    let mut timing = Timing::start();
    let fitted = files::fitted(&job, Vec::new(), &session, &mut timing)?;
    let made = Files::of(&job, &fitted, &session, &mut timing, &Stop::on_interrupt())?;
    Ok(made.files.into_iter().map(|(name, bytes)| (name.display().to_string(), bytes)).collect())
}

fn text(verification: &Verification) -> String {
    let Verification { folder, written_by, verified_by, differences, numbers, tolerance, .. } = verification;
    let mut text = format!("{}: written by {written_by}, run again by {verified_by}\n", folder.display());
    for (what, files) in [
        ("Of the manifest but not in the folder, so not verified", &verification.missing),
        ("In the folder but not of the manifest, so not verified", &verification.unknown),
    ] {
        if !files.is_empty() {
            let more = files.len().saturating_sub(PRINTED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let shown: Vec<&str> = files.iter().take(PRINTED).map(String::as_str).collect();
            let _ = writeln!(text, "{what}: {}{more}", shown.join(", "));
        }
    }
    for Difference { place, expected, found } in differences.iter().take(PRINTED) {
        let _ = writeln!(text, "{place}\n    expected {expected}, found {found}");
    }
    let _ = match differences.len() {
        0 => writeln!(
            text,
            "Verified: {numbers} numbers are those that follow from the inputs, within {tolerance:e} of each."
        ),
        count => writeln!(
            text,
            "Not verified: of {numbers} numbers and all pages and pictures, {count} differ (tolerance {tolerance:e} of each number)."
        ),
    };
    text
}
