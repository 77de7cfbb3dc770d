//! Work in parts: `--part K/N` runs some of the points of a command and writes one file; `granchain merge` joins the files to the results of the
//! whole run, byte for byte.
//!
//! A part file may come from anywhere. Its size is checked before it is read, and it decides nothing but values: `merge` itself says where results go,
//! with which cache and on how many threads, and the arguments in the file are understood by `sweep` and `coverage` alone.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    ops::Range,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use clap::Args;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::{Value, json};

use super::{
    Outcome,
    arguments::{OutputArguments, Session, expected, usage},
    divisible,
    output::write_atomically,
    summary, typed, without,
};
use crate::{
    measurement::{
        read_back::{LARGE, read_back},
        sha256, shell_line,
    },
    model::vector_unit,
};

/// Most numbers of parts in a message.
const MOST_LISTED: usize = 10;

/// Flags that do not change what a part holds, and those of them with a value.
const SILENT: [&str; 2] = ["--quiet", "--json"];
const SILENT_WITH_VALUE: [&str; 4] = ["--part", "--out", "--threads", "--cache"];

/// A command whose work falls into numbered points that need nothing of one another.
pub trait Divisible {
    fn points(&self) -> usize;
    fn out(&self) -> Option<&Path>;
    /// Everything that decides what the runs are.
    fn plan(&self) -> anyhow::Result<Vec<u8>>;
    /// Run the points `part`; one value each.
    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>>;
    /// Write and print the results of all points.
    fn finish(self: Box<Self>, parts: &Parts) -> anyhow::Result<Outcome>;
}

/// Runs as a part file holds them.
pub fn values(runs: &[impl Serialize]) -> anyhow::Result<Vec<Value>> {
    runs.iter().map(serde_json::to_value).collect::<Result<_, _>>().context("a run cannot be written as JSON")
}

#[derive(Debug, Clone, Default, Args)]
pub struct PartArguments {
    /// Run only part K of N. Here --out names a file; `granchain merge` joins the parts into one result
    #[arg(long, value_name = "K/N", value_parser = Part::parse, requires = "out", conflicts_with = "force", help_heading = "Cluster")]
    pub part: Option<Part>,
}

/// Part `number`, from 1, of `of` parts of nearly equal size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    number: usize,
    of: usize,
}

impl Part {
    pub fn parse(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        let part = numbers.map(|(number, of)| Self { number, of }).filter(|part| (1..=part.of).contains(&part.number));
        part.ok_or_else(|| expected("K/N with K from 1 to N, such as `3/8`", text))
    }

    /// Its points, of so many.
    fn range(self, points: usize) -> Range<usize> {
        let end = |part: usize| (points as u128 * part as u128 / self.of as u128) as usize;
        end(self.number - 1)..end(self.number)
    }
}

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// What a part file says of itself.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Head {
    /// Program and version that ran it; no other joins it.
    program: String,
    /// Command and arguments, without what cannot change the runs.
    arguments: Vec<String>,
    /// Digest of everything that decides what the runs are.
    plan_sha256: String,
    /// Points of the whole work.
    points: usize,
    part: Part,
}

#[derive(Debug, Serialize, Deserialize)]
struct PartFile {
    #[serde(flatten)]
    head: Head,
    processor: String,
    runs: Vec<Value>,
}

impl PartFile {
    /// Read one that holds what it claims to hold.
    fn read(path: &Path) -> anyhow::Result<Self> {
        let no_part = || format!("{}: expected a file that --part wrote", path.display());
        if !path.exists() {
            anyhow::bail!("{}: expected a file written by --part, found none", path.display());
        }
        let bytes = read_back(path, LARGE).with_context(no_part)?;
        let file: Self = serde_json::from_slice(&bytes).with_context(no_part)?;
        let Head { program, points, part, .. } = &file.head;
        if *program != summary::program() {
            let this = summary::program();
            bail!(
                "{}: expected a part that {this} ran, found one of {program}; merge it with that version, or run it again",
                path.display()
            );
        }
        let is_part = (1..=part.of).contains(&part.number) && part.of <= *points;
        if !is_part || file.runs.len() != part.range(*points).len() {
            let found = file.runs.len();
            bail!(
                "{}: expected the runs of part {part} of {points} points, found {found} runs; delete the file and run the part again",
                path.display()
            );
        }
        Ok(file)
    }
}

/// Run a part and write its file, which appears whole or not at all. One that is there already is left as it is.
pub fn write(part: Part, study: &dyn Divisible, session: &Session) -> anyhow::Result<Outcome> {
    let (points, out) = (study.points(), study.out().context("--part needs --out FILE")?);
    if part.of > points {
        return Err(usage(format!("--part {part}: expected at most {points} parts, one per point")));
    }
    let arguments = without(typed().skip(1), &SILENT, &SILENT_WITH_VALUE);
    if let Some(word) = arguments.iter().find(|word| word.contains(char::REPLACEMENT_CHARACTER)) {
        bail!("{word}: expected arguments that are UTF-8 text, for a part file names them; rename the file");
    }
    let plan_sha256 = sha256(&study.plan()?);
    let head = Head { program: summary::program(), arguments, plan_sha256, points, part };
    if !is_there(out, &head)? {
        let runs = study.run(part.range(points))?;
        let body = serde_json::to_vec(&PartFile { head: head.clone(), processor: vector_unit(), runs })
            .context("a part cannot be written as JSON")?;
        if let Some(folder) = out.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            fs::create_dir_all(folder).with_context(|| format!("{}: cannot create the folder", folder.display()))?;
        }
        // Another process may have put something there meanwhile.
        if !is_there(out, &head)? {
            write_atomically(out, &body)?;
        }
    }
    let points = part.range(points).len();
    session.result(
        format!("part {part}, {points} points, is in {}\n", out.display()),
        &json!({ "part": part.number, "parts": part.of, "points": points, "file": out }),
    )?;
    Ok(Outcome::Done)
}

/// Whether this very part is there already.
fn is_there(path: &Path, head: &Head) -> anyhow::Result<bool> {
    if fs::symlink_metadata(path).is_err_and(|error| error.kind() == std::io::ErrorKind::NotFound) {
        return Ok(false);
    }
    if PartFile::read(path).is_ok_and(|found| found.head == *head) {
        return Ok(true);
    }
    bail!(
        "{}: expected no file, or part {} of this command, found something else, which is left as it is; name another --out, or move it",
        path.display(),
        head.part
    )
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  granchain sweep --model chain --scene annulus --vary alpha=0.2:2:0.1 --part 1/2 --out 1.part\n  \
granchain sweep --model chain --scene annulus --vary alpha=0.2:2:0.1 --part 2/2 --out 2.part\n  granchain merge 1.part 2.part --out scan\n\n\
Run it in the folder in which the parts were run: scene and records are read again."
)]
pub struct Arguments {
    /// The files of all parts, in any order
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
}

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let Arguments { files, output } = arguments;
    if output.out.is_none() {
        return Err(usage("merge needs --out DIR, the folder for the results"));
    }
    if session.seed.is_some() {
        return Err(usage("--seed would do nothing: the parts have their seed; leave it out"));
    }
    let parts = Parts::of(&files)?;
    refuse_devices(&parts.head.arguments)?;
    let study = divisible(&parts.head.arguments, &output, session).with_context(|| {
        let line = shell_line(&parts.head.arguments);
        format!(
            "the parts are of `{line}`, which cannot be read; run `merge` in the folder in which the parts were run"
        )
    })?;
    if study.points() != parts.head.points || sha256(&study.plan()?) != parts.head.plan_sha256 {
        bail!(
            "{}: the part was run with another scene, grid, drive record or seed: an input of its command has changed since; undo that, or run \
             all parts again",
            files[0].display()
        );
    }
    if parts.processors.len() > 1 {
        let found = parts.processors.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
        session.note(format_args!(
            "warning: the parts were run on different processors, whose last digits may differ: {found}"
        ));
    }
    study.finish(&parts)
}

/// Refuse arguments of a part file that name a device, a pipe or a socket: reading one may never end.
fn refuse_devices(arguments: &[String]) -> anyhow::Result<()> {
    let names = arguments.iter().flat_map(|word| word.split(['=', ',', ':']).chain([word.as_str()]));
    for name in names {
        if fs::metadata(name).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
            bail!(
                "{name}: expected a plain file, for a part file names it, found a device, pipe or socket; run the parts on files"
            );
        }
    }
    Ok(())
}

/// All parts of one work, read file by file: no more than one is in memory.
#[derive(Debug)]
pub struct Parts {
    /// What all of them say; the part is that of the first.
    head: Head,
    files: BTreeMap<usize, PathBuf>,
    processors: BTreeSet<String>,
}

impl Parts {
    pub fn of(files: &[PathBuf]) -> anyhow::Result<Self> {
        let mut parts: Option<Self> = None;
        for path in files {
            let PartFile { head, processor, .. } = PartFile::read(path)?;
            let number = head.part.number;
            let parts = parts.get_or_insert_with(|| Self {
                head: head.clone(),
                files: BTreeMap::new(),
                processors: BTreeSet::new(),
            });
            if !parts.holds(&head) {
                let (first, own) = (&files[0].display(), &parts.head.part);
                bail!(
                    "{}: expected a part of the same work as {first}, part {own}, found part {} of another command, other inputs or another \
                     number of parts; merge the parts of one command alone",
                    path.display(),
                    head.part
                );
            }
            if let Some(other) = parts.files.insert(number, path.clone()) {
                bail!("{}: part {} was given already, as {}; name it once", path.display(), head.part, other.display());
            }
            parts.processors.insert(processor);
        }
        let parts = parts.context("merge needs the files of all parts")?;
        let (of, found) = (parts.head.part.of, parts.files.len());
        if found < of {
            let missing = (1..=of).filter(|number| !parts.files.contains_key(number));
            let listed: Vec<String> = missing.take(MOST_LISTED).map(|number| format!("{number}/{of}")).collect();
            let more = if of - found > MOST_LISTED { ", …" } else { "" };
            bail!(
                "expected {of} parts, found {found}; missing: {}{more}; run each with --part and name its file too",
                listed.join(", ")
            );
        }
        Ok(parts)
    }

    /// Whether a part is one of this work.
    fn holds(&self, head: &Head) -> bool {
        let of = head.part.of;
        of == self.head.part.of && *head == Head { part: head.part, ..self.head.clone() }
    }

    /// Hand on every run in order.
    pub fn each<T: DeserializeOwned>(
        &self,
        mut use_run: impl FnMut(usize, T) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        for (number, path) in &self.files {
            let file = PartFile::read(path)?;
            if !self.holds(&file.head) || file.head.part.number != *number {
                bail!("{}: the file was changed while it was merged; merge again", path.display());
            }
            for (index, run) in file.head.part.range(self.head.points).zip(file.runs) {
                let run = serde_json::from_value(run).with_context(|| {
                    format!("{}: expected runs of its command, found others; run the part again", path.display())
                })?;
                use_run(index, run)?;
            }
        }
        Ok(())
    }

    pub fn all<T: DeserializeOwned>(&self) -> anyhow::Result<Vec<T>> {
        let mut all = Vec::new();
        self.each(|_, run| {
            all.push(run);
            Ok(())
        })?;
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_hold_every_point_once_and_differ_by_at_most_one() {
        for (points, of) in [(7, 3), (7, 7), (1000, 9), (1, 1), (usize::MAX, 5)] {
            let ranges: Vec<_> = (1..=of).map(|number| Part { number, of }.range(points)).collect();
            assert_eq!((ranges[0].start, ranges[of - 1].end), (0, points));
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert!(ranges.iter().all(|range| range.len().abs_diff(points / of) <= 1));
        }
    }

    #[test]
    fn what_names_no_part_is_refused() {
        assert_eq!(Part::parse("3/8"), Ok(Part { number: 3, of: 8 }));
        for text in ["0/8", "9/8", "1", "/", "1/0", "-1/2", "a/b", "1/2/3", "18446744073709551616/1"] {
            assert!(Part::parse(text).is_err_and(|error| error.ends_with(&format!("found `{text}`"))));
        }
    }
}
