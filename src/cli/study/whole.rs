//! What every study has on the command line: it is run here from end to end, or in parts elsewhere.

use std::{ops::Range, path::Path};

use anyhow::Context;
use serde::Serialize;
use serde_json::{Value, json};

use super::{NOTHING_WRITTEN, StudyArguments, write};
use crate::{
    cli::{
        Outcome,
        arguments::{OutputArguments, Session},
        interrupt::{self, Interrupted},
        output::{OutputFolder, page_results},
        parts::{self, Divisible, Parts},
        progress, summary,
        timing::Timing,
    },
    report::page::Files,
    scene::Scene,
    study::{Divided, failure::StudyError},
};

/// What is known of a page before its outcome.
pub(super) struct Head {
    /// Program and version.
    pub program: String,
    /// Command line that makes the same page.
    pub command_line: String,
}

/// A study as it is shown.
pub(super) trait Shown: Divided {
    /// Name of the command, and of its summary.
    const NAME: &str;

    /// The scene that it begins with.
    fn scene(&self) -> &Scene;

    /// What is run.
    fn plan(&self) -> impl Serialize + '_;

    /// Say how many runs there are and how long they take, by a few of them.
    ///
    /// # Errors
    /// When they cannot be run.
    fn foretell(&self, session: &Session) -> anyhow::Result<()>;

    /// Where the seconds of one of its stages went.
    fn breakdown(&self, _stage: &str, _seconds: f64) -> Option<(&'static str, f64)> {
        None
    }

    /// What the terminal shows.
    fn text(&self, outcome: &Self::Outcome) -> String;

    /// What `--json` prints.
    fn json(&self, outcome: &Self::Outcome) -> Value;

    /// The page and its files.
    ///
    /// # Errors
    /// A figure that cannot be drawn.
    fn files(&self, outcome: Self::Outcome, head: Head) -> anyhow::Result<Files>;
}

/// A study that is read from the command line and can be run here too.
pub(super) trait Command: Divisible {
    /// All of it on this machine.
    fn run_here(self: Box<Self>) -> anyhow::Result<Outcome>;
}

/// A study with what the command line says besides.
pub(super) struct Whole<S> {
    pub study: S,
    pub shared: StudyArguments,
    /// As it is shown in the command line of the page.
    pub members: Option<u32>,
    pub output: OutputArguments,
    pub session: Session,
    pub timing: Timing,
}

impl<S: Shown> Whole<S> {
    /// The folder of results, where one is asked for.
    fn staged(&self) -> anyhow::Result<Option<OutputFolder>> {
        let (main, force) = (format!("{}.json", S::NAME), self.output.force);
        let stage = |out| OutputFolder::stage(out, &page_results(&main), force);
        Ok(self.output.out.as_deref().map(stage).transpose()?)
    }

    /// Write and print what came out.
    fn conclude(self, points: Vec<S::Point>, folder: Option<OutputFolder>) -> anyhow::Result<Outcome> {
        let Self { study, shared, members, session, mut timing, .. } = self;
        let outcome = stopped(study.outcome(points))?;
        timing.stage("evaluate");
        interrupt::check()?;
        let (mut text, json) = (study.text(&outcome), study.json(&outcome));
        match folder {
            Some(folder) => {
                let command_line = shared.command_line(S::NAME, members, &session);
                let head = Head { program: summary::program(), command_line };
                let files = study.files(outcome, head).context("the report cannot be made")?;
                write(folder, files, timing, &session)?;
            }
            None => text.push_str(NOTHING_WRITTEN),
        }
        session.result(text, &json)?;
        Ok(Outcome::Done)
    }

    fn bar(&self, part: Range<usize>) -> progress::Bar {
        let runs: usize = part.map(|point| self.study.runs_of(point)).sum();
        progress::Bar(progress::bar(&self.session, runs as u64, "runs"))
    }
}

impl<S: Shown> Command for Whole<S> {
    fn run_here(mut self: Box<Self>) -> anyhow::Result<Outcome> {
        let folder = self.staged()?;
        self.timing.stage("read");
        self.study.foretell(&self.session)?;
        self.timing.stage("estimate");
        let bar = self.bar(0..self.study.points());
        let mut points = Vec::with_capacity(self.study.points());
        for (stage, count) in self.study.stages() {
            let made = self.study.part(points.len()..points.len() + count, &bar);
            points.extend(stopped(made).inspect_err(|_| bar.0.finish_and_clear())?);
            let seconds = self.timing.stage(stage);
            if let Some(part) = self.study.breakdown(stage, seconds) {
                self.timing.breakdown(stage, &[part]);
            }
        }
        bar.0.finish_and_clear();
        self.conclude(points, folder)
    }
}

impl<S: Shown> Divisible for Whole<S> {
    fn points(&self) -> usize {
        self.study.points()
    }

    fn out(&self) -> Option<&Path> {
        self.output.out.as_deref()
    }

    fn plan(&self) -> anyhow::Result<Vec<u8>> {
        summary::json(&json!({
            "program": summary::program(),
            "study": S::NAME,
            "plan": serde_json::to_value(self.study.plan()).context("the plan cannot be written as JSON")?,
            "overrides": self.shared.set,
            "scene_sha256": summary::scene_digest(self.study.scene()),
        }))
    }

    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>> {
        let bar = self.bar(part.clone());
        let points = self.study.part(part, &bar);
        bar.0.finish_and_clear();
        parts::values(&stopped(points)?)
    }

    fn finish(self: Box<Self>, parts: &Parts) -> anyhow::Result<Outcome> {
        let folder = self.staged()?;
        self.conclude(parts.all()?, folder)
    }
}

/// A study that was stopped is a program that was interrupted.
pub(super) fn stopped<T>(outcome: Result<T, StudyError>) -> anyhow::Result<T> {
    match outcome {
        Err(StudyError::Stopped) => Err(Interrupted.into()),
        outcome => Ok(outcome?),
    }
}
