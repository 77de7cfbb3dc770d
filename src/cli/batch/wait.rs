//! Waiting for chunks that a cluster runs.

use std::{
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, bail};

use super::{Session, engine::Engine, job::Job, listed};
use crate::cli::{
    interrupt::{self, Interrupted},
    progress,
};

/// Between two looks for new chunks, and between two questions to the engine.
const LOOK: Duration = Duration::from_millis(200);
const ASK: Duration = Duration::from_secs(5);

/// How often what was lost is submitted again.
const MOST_SUBMISSIONS: usize = 6;

/// Submit what is not done and is not under way already, and return when every chunk is done. Chunks that a worker lost are submitted again, as
/// long as that brings some more of them to an end.
pub(super) fn finished(job: &Job, engine: Engine, session: &Session) -> anyhow::Result<()> {
    let mut missing = job.missing();
    let mut ids = match job.submissions()?.pop() {
        Some(last) if last.engine.is_alive(&last.ids)? => last.ids,
        _ if missing.is_empty() => return Ok(()),
        _ => engine.submit(job, &missing)?,
    };
    session.note(format_args!("{} chunks are with {} as {}", missing.len(), engine.name(), ids.join(", ")));
    let bar = progress::bar(session, job.chunks() as u64, "chunks");
    let (mut before, mut submissions, mut asked) = (missing.len(), 1, Instant::now());
    loop {
        missing.retain(|chunk| job.is_missing(*chunk));
        bar.set_position((job.chunks() - missing.len()) as u64);
        if missing.is_empty() {
            bar.finish_and_clear();
            return Ok(());
        }
        if interrupt::requested() {
            // A part of what a command does is of use to that command alone.
            let or = match job.plan.besides {
                None => format!(" or `batch collect {}`", job.folder().display()),
                Some(_) => String::new(),
            };
            return Err(anyhow::Error::from(Interrupted).context(format!(
                "the chunks go on without this program: come back with --resume{or}, or end them with `{}`",
                engine.end(&ids)
            )));
        }
        if asked.elapsed() > ASK {
            asked = Instant::now();
            let alive = engine.is_alive(&ids).with_context(|| kept(job))?;
            missing.retain(|chunk| job.is_missing(*chunk));
            if !alive && !missing.is_empty() {
                // A chunk may be lost with its worker; one that fails by itself fails again.
                if submissions > 1 && missing.len() == before || submissions == MOST_SUBMISSIONS {
                    bail!("{}", lost(job, &missing));
                }
                let text = format!("chunks {} were lost and are submitted again", listed(&missing));
                bar.suspend(|| session.note(text));
                ids = engine.submit(job, &missing).with_context(|| kept(job))?;
                (before, submissions) = (missing.len(), submissions + 1);
            }
        }
        thread::sleep(LOOK);
    }
}

fn kept(job: &Job) -> String {
    format!("what is done is kept in {}; go on with --resume", job.folder().display())
}

/// What to say of chunks that come to nothing.
fn lost(job: &Job, missing: &[usize]) -> String {
    let first = missing.first().copied().unwrap_or_default();
    let words = job.last_words(first).unwrap_or_else(|| "it printed nothing".into());
    format!(
        "{} of {} chunks came to nothing, and not when submitted again ({}); of chunk {first}: {words}\n{}; all that they say is in {}",
        missing.len(),
        job.chunks(),
        listed(missing),
        kept(job),
        job.logs().display()
    )
}
