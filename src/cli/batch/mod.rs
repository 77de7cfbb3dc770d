//! Work in parts, wherever there are workers: `granchain batch`, and `--on` of the commands whose work falls into points.
//!
//! A batch is a folder. `batch.json` in it says which command falls into which chunks of points; a chunk is done when `chunks/K.json` stands,
//! which appears whole. Any worker may do any chunk again, to the same bytes. The scheduler's part is to start `batch run-chunk FOLDER K` for
//! every K; nothing here schedules.

mod engine;
mod hyperqueue;
mod job;
mod slurm;
mod wait;

use std::{
    collections::BTreeSet,
    ops::Range,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, bail};
use clap::{Args, Subcommand};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, json};

pub use self::engine::{Engine, NoEngine};
use self::job::Job;
use super::{
    Outcome,
    arguments::{Session, usage},
    divisible, interrupt, program, typed as typed_line,
};

/// What a chunk is to take, s: long beside the start of a process, short beside a scheduler's limits.
const CHUNK_SECONDS: f64 = 60.0;

/// Most points in a chunk that nobody asked for: one chunk is held in memory at a time.
const MOST_IN_CHUNK: usize = 10_000;

/// A command whose work falls into numbered points that need nothing of one another.
pub(super) trait Divisible {
    /// Their number.
    fn points(&self) -> usize;
    /// Where the results go.
    fn out(&self) -> Option<&Path>;
    /// Everything that decides what the runs are.
    fn plan(&self) -> anyhow::Result<Vec<u8>>;
    /// What decides the runs that the command line does not say; kept with the batch.
    fn besides(&self) -> anyhow::Result<Option<Value>> {
        Ok(None)
    }
    /// A point to be timed, and how many times as long the longest takes.
    fn sample(&self) -> (usize, f64) {
        (0, 1.0)
    }
    /// Run the points `part`; one value each.
    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>>;
    /// Write and print what the values of all points say.
    fn finish(self: Box<Self>, kept: &Kept<'_>) -> anyhow::Result<Outcome>;
}

/// What came of points, as a chunk keeps it.
pub(super) fn values(runs: &[impl Serialize]) -> anyhow::Result<Vec<Value>> {
    runs.iter().map(serde_json::to_value).collect::<Result<_, _>>().context("a run cannot be written as JSON")
}

/// What came of all points, read chunk by chunk.
pub(super) struct Kept<'a>(&'a Job);

impl Kept<'_> {
    /// Hand on every point in order.
    ///
    /// # Errors
    /// Those of `seen`; a chunk that is not there or not what was kept.
    pub fn each_typed<T: DeserializeOwned>(
        &self,
        mut seen: impl FnMut(usize, T) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let mut index = 0;
        for chunk in 0..self.0.chunks() {
            for value in self.0.read(chunk)?.runs {
                let typed = serde_json::from_value(value);
                let other =
                    "the chunks hold other runs than this command makes; delete the batch's folder and start anew";
                seen(index, typed.context(other)?)?;
                index += 1;
            }
        }
        Ok(())
    }

    /// All points in memory.
    ///
    /// # Errors
    /// As [`Kept::each_typed`].
    pub fn all<T: DeserializeOwned>(&self) -> anyhow::Result<Vec<T>> {
        let mut all = Vec::new();
        self.each_typed(|_, point| {
            all.push(point);
            Ok(())
        })?;
        Ok(all)
    }
}

/// `--on`, `--chunk`, `--dry-run`: where else the points of a command are run.
#[derive(Debug, Clone, Default, Args)]
pub struct OnArguments {
    /// Run the points on a cluster, wait for them and collect: slurm or hyperqueue, or slurm:OPTION=VALUE,… with options of sbatch or hq submit
    #[arg(long, value_name = "ENGINE", value_parser = Engine::parse, requires = "out", help_heading = "Cluster")]
    pub on: Option<Engine>,
    /// Points in a chunk [default: as many as take a minute, by one of them]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), requires = "on", help_heading = "Cluster")]
    pub chunk: Option<u32>,
    /// Print the script that --on would submit, and nothing more
    #[arg(long, requires = "on", help_heading = "Cluster")]
    pub dry_run: bool,
}

/// A cluster that was asked for.
#[derive(Debug)]
pub struct Asked {
    engine: Engine,
    chunk: Option<u32>,
    dry_run: bool,
}

impl Asked {
    /// This cluster, with so many points in a chunk.
    pub(super) fn of(engine: Engine, chunk: Option<u32>) -> Self {
        Self { engine, chunk, dry_run: false }
    }
}

impl OnArguments {
    /// The cluster, where one was asked for.
    pub(super) fn asked(self) -> Option<Asked> {
        let Self { on, chunk, dry_run } = self;
        on.map(|engine| Asked { engine, chunk, dry_run })
    }
}

/// Arguments of `granchain batch`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  granchain batch plan scan.batch --chunk 50 -- sweep --model chain --scene annulus --vary alpha=0.2:2:0.001 --out scan\n  \
granchain batch run-chunk scan.batch 0\n  granchain batch status scan.batch\n  granchain batch collect scan.batch\n\n\
Any scheduler, Make or Snakemake can start the chunks; `sweep --on slurm` and `sweep --on hyperqueue` do all of it, so of `twins` and `study`."
)]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Cut the points of a sweep, of twins or of a study into chunks, and write the batch's folder
    Plan {
        /// Folder of the batch; it must not exist
        folder: PathBuf,
        /// Points in a chunk [default: as many as take a minute, by one of them]
        #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
        chunk: Option<u32>,
        /// The command and its arguments, with --out
        #[arg(last = true, required = true, value_name = "COMMAND")]
        command: Vec<String>,
    },
    /// Run one chunk; what any worker may do again, to the same bytes
    RunChunk {
        /// Folder of the batch
        folder: PathBuf,
        /// Number of the chunk, from 0
        chunk: usize,
    },
    /// Which chunks are done, and what the others last said
    Status {
        /// Folder of the batch
        folder: PathBuf,
    },
    /// Submit the chunks that are not done, and return
    Submit {
        /// Folder of the batch
        folder: PathBuf,
        /// As of `sweep --on`
        #[arg(long, value_name = "ENGINE", value_parser = Engine::parse)]
        on: Engine,
        /// Print the script and submit nothing
        #[arg(long)]
        dry_run: bool,
    },
    /// Submit the chunks that are not done as they were submitted before, unless that is still queued or running
    Retry {
        /// Folder of the batch
        folder: PathBuf,
    },
    /// Write the results of the command from all chunks; the bytes are those of running it here
    Collect {
        /// Folder of the batch
        folder: PathBuf,
        /// Refuse chunks of unlike processors, whose last digits may differ, instead of naming them
        #[arg(long)]
        same_processor: bool,
    },
}

/// Run it.
///
/// # Errors
/// A folder that is no batch or is of another version, a chunk that does not exist or fails, an engine that refuses; Ctrl-C.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let Arguments { action, session } = arguments;
    match action {
        Action::Plan { folder, chunk, command } => plan(&folder, chunk, command, &session),
        Action::RunChunk { folder, chunk } => run_chunk(&Job::open(&folder)?, chunk, &session),
        Action::Status { folder } => status(&Job::open(&folder)?, &session),
        Action::Submit { folder, on, dry_run } => {
            let job = Job::open(&folder)?;
            if dry_run {
                let script = on.script(job.folder(), &job.missing());
                session.result(&script, &json!({ "script": script }))?;
            } else {
                let ids = on.submit(&job, &job.missing())?;
                session.note(format_args!("submitted as {}", ids.join(", ")));
            }
            Ok(Outcome::Done)
        }
        Action::Retry { folder } => retry(&Job::open(&folder)?, &session),
        Action::Collect { folder, same_processor } => collect(Job::open(&folder)?, None, same_processor, &session),
    }
}

fn plan(folder: &Path, chunk: Option<u32>, command: Vec<String>, session: &Session) -> anyhow::Result<Outcome> {
    let study = divisible(&command, None)?;
    if study.out().is_none() {
        return Err(usage("the command to be cut into chunks needs --out DIR, for what `batch collect` writes"));
    }
    let chunk = chunk_of(study.as_ref(), chunk, session)?;
    let job = Job::create(folder, command, study.as_ref(), chunk)?;
    let (points, chunks) = (job.plan.points, job.chunks());
    session.result(
        format!(
            "{points} points in {chunks} chunks, 0 to {}\n  each by    {} batch run-chunk {} K\n  then       {} batch collect {}\n",
            chunks - 1,
            program(),
            folder.display(),
            program(),
            folder.display()
        ),
        &json!({ "folder": folder, "points": points, "chunks": chunks, "chunk": job.plan.chunk }),
    )?;
    Ok(Outcome::Done)
}

/// Points in a chunk: as asked, or by the time that one takes.
fn chunk_of(study: &dyn Divisible, asked: Option<u32>, session: &Session) -> anyhow::Result<usize> {
    if let Some(asked) = asked {
        return Ok(asked as usize);
    }
    let (sample, longest) = study.sample();
    let timed = || -> anyhow::Result<f64> {
        let begin = Instant::now();
        study.run(sample..sample + 1)?;
        Ok(longest * begin.elapsed().as_secs_f64())
    };
    // The first run of all may make bodies that the others find.
    let seconds = timed().and_then(|first| if first < CHUNK_SECONDS / 10.0 { timed() } else { Ok(first) })?;
    let most = study.points().min(MOST_IN_CHUNK);
    let chunk = (CHUNK_SECONDS / seconds).round().clamp(1.0, most as f64) as usize;
    session.note(format_args!("a point takes {seconds:.2} s here: {chunk} a chunk (say otherwise with --chunk)"));
    Ok(chunk)
}

/// The command that a batch was planned for. A worker may begin anywhere; its paths are from the folder where it was planned.
fn planned(job: &Job) -> anyhow::Result<Box<dyn Divisible>> {
    let folder = &job.plan.folder;
    std::env::set_current_dir(folder)
        .with_context(|| format!("{}: the folder in which the batch was planned", folder.display()))?;
    divisible(&job.plan.command, job.plan.besides.as_ref())
}

fn run_chunk(job: &Job, chunk: usize, session: &Session) -> anyhow::Result<Outcome> {
    let part = job.range(chunk)?;
    let study = planned(job)?;
    job.agrees(study.as_ref())?;
    let runs = study.run(part)?;
    job.keep(chunk, runs)?;
    session.note(format_args!("chunk {chunk} is done"));
    Ok(Outcome::Done)
}

fn status(job: &Job, session: &Session) -> anyhow::Result<Outcome> {
    let missing = job.missing();
    let is_waiting = match job.submissions()?.last() {
        Some(last) => last.engine.is_alive(&last.ids)?,
        None => false,
    };
    let mut text = format!("{} of {} chunks are done\n", job.chunks() - missing.len(), job.chunks());
    for chunk in &missing {
        let last = job.last_words(*chunk).map_or_else(String::new, |words| format!(": {words}"));
        text.push_str(&format!("  {chunk} is not{last}\n"));
    }
    if is_waiting {
        text.push_str("what was submitted last is queued or running\n");
    }
    let value = json!({ "chunks": job.chunks(), "missing": missing, "is_waiting": is_waiting });
    session.result(text, &value)?;
    Ok(Outcome::Done)
}

fn retry(job: &Job, session: &Session) -> anyhow::Result<Outcome> {
    let missing = job.missing();
    if missing.is_empty() {
        bail!("{}: every chunk is done; write the results with `batch collect`", job.folder().display());
    }
    let Some(last) = job.submissions()?.pop() else {
        bail!("{}: nothing was submitted yet; use `batch submit --on ENGINE`", job.folder().display());
    };
    if last.engine.is_alive(&last.ids)? {
        bail!(
            "{}: what was submitted last ({}) is still queued or running; wait for it, or end it with `{}`",
            job.folder().display(),
            last.ids.join(", "),
            last.engine.end(&last.ids)
        );
    }
    let ids = last.engine.submit(job, &missing)?;
    session.note(format_args!("{} chunks submitted again, as {}", missing.len(), ids.join(", ")));
    Ok(Outcome::Done)
}

/// Write the results of all chunks; `study` where it is at hand.
fn collect(
    job: Job,
    study: Option<Box<dyn Divisible>>,
    same_processor: bool,
    session: &Session,
) -> anyhow::Result<Outcome> {
    let missing = job.missing();
    if let Some(first) = missing.first() {
        bail!(
            "{}: {} of {} chunks have no result ({}); submit them again with `batch retry`, or run one here with `batch run-chunk {} {first}`",
            job.folder().display(),
            missing.len(),
            job.chunks(),
            listed(&missing),
            job.folder().display()
        );
    }
    let study = study.map_or_else(|| planned(&job), Ok)?;
    job.agrees(study.as_ref())?;
    let processors = job.processors()?;
    if processors.len() > 1 {
        if same_processor {
            let found = processors.into_iter().collect::<Vec<_>>().join(", ");
            bail!("{}: expected chunks of one kind of processor, found {found}", job.folder().display());
        }
        session.note(unlike(&processors));
    }
    let outcome = study.finish(&Kept(&job))?;
    job.remove();
    Ok(outcome)
}

/// What to say of chunks from more than one kind of processor.
fn unlike(processors: &BTreeSet<String>) -> String {
    let found = processors.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
    format!("warning: the chunks were run on unlike processors, whose last digits may differ: {found}")
}

/// Numbers of chunks, not more than a line of them.
fn listed(chunks: &[usize]) -> String {
    const MOST: usize = 10;
    let shown: Vec<String> = chunks.iter().take(MOST).map(ToString::to_string).collect();
    format!("{}{}", shown.join(", "), if chunks.len() > MOST { ", …" } else { "" })
}

/// Run the points of a command on a cluster, wait for them, and write its results.
pub(super) fn run_on(
    asked: Asked,
    study: Box<dyn Divisible>,
    resume: bool,
    session: &Session,
) -> anyhow::Result<Outcome> {
    let Asked { engine, chunk, dry_run } = asked;
    let Some(out) = study.out() else { return Err(usage("--on needs --out DIR")) };
    let folder = beside(out);
    if dry_run {
        let chunk = chunk_of(study.as_ref(), chunk, session)?;
        let chunks = study.points().div_ceil(chunk);
        let script = engine.script(&job::absolute(&folder)?, &(0..chunks).collect::<Vec<_>>());
        session.result(&script, &json!({ "script": script, "points": study.points(), "chunks": chunks }))?;
        return Ok(Outcome::Done);
    }
    let job = if resume {
        let job = Job::open(&folder)?;
        job.agrees(study.as_ref())?;
        job
    } else {
        let chunk = chunk_of(study.as_ref(), chunk, session)?;
        interrupt::check()?;
        Job::create(&folder, without_on(typed_line().skip(1)), study.as_ref(), chunk)?
    };
    wait::finished(&job, engine, session)?;
    collect(job, Some(study), false, session)
}

/// The folder of a batch whose results go to `out`.
pub(super) fn beside(out: &Path) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_os_string();
    name.push(".batch");
    out.with_file_name(name)
}

/// Have points made on a cluster that are a part of what the command does, `usual` of them in a chunk where nobody asked for a number, and wait for them. The
/// batch stays in `folder` until the next one takes its place: what an earlier process left there is taken up where `goes_on`.
pub(super) fn made_on(
    asked: &Asked,
    folder: &Path,
    work: &dyn Divisible,
    usual: usize,
    goes_on: bool,
    session: &Session,
) -> anyhow::Result<Vec<Value>> {
    let found = if goes_on && folder.exists() { Some(Job::open(folder)?) } else { None };
    let job = match found {
        Some(same) if same.agrees(work).is_ok() => same,
        found => {
            found.into_iter().for_each(Job::remove);
            let chunk = asked.chunk.map_or(usual, |chunk| chunk as usize);
            Job::create(folder, without_on(typed_line().skip(1)), work, chunk)?
        }
    };
    wait::finished(&job, asked.engine.clone(), session)?;
    let processors = job.processors()?;
    if processors.len() > 1 {
        session.note(unlike(&processors));
    }
    let chunks = (0..job.chunks()).map(|chunk| Ok(job.read(chunk)?.runs));
    Ok(chunks.collect::<anyhow::Result<Vec<_>>>()?.concat())
}

/// Remove the batch in a folder, where there is one of this version.
pub(super) fn remove(folder: &Path) {
    Job::open(folder).into_iter().for_each(Job::remove);
}

/// A command line without what sends it elsewhere.
fn without_on(line: impl Iterator<Item = String>) -> Vec<String> {
    let (mut kept, mut is_value) = (Vec::new(), false);
    for word in line {
        if std::mem::take(&mut is_value) {
            continue;
        }
        match word.as_str() {
            "--on" | "--chunk" => is_value = true,
            "--dry-run" | "--resume" => {}
            other if other.starts_with("--on=") || other.starts_with("--chunk=") => {}
            _ => kept.push(word),
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::without_on;

    #[test]
    fn a_chunk_is_of_the_command_as_it_is_run_here() {
        let line = "sweep --on slurm:time=10:00 --scene annulus --chunk=5 --vary alpha=1,2 --resume --out on --chunk 7";
        let kept = without_on(line.split(' ').map(str::to_owned));
        assert_eq!(kept.join(" "), "sweep --scene annulus --vary alpha=1,2 --out on");
    }
}
