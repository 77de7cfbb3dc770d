//! `calibrate --on`: the rounds of the model that answers, made on a cluster while the search waits here.
//!
//! Each round is a batch beside the folder of the results; what the command line does not say of its runs, their points, is kept with the batch.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use anyhow::{Context, bail};
use serde_json::{Value, json};

use crate::{
    calibration::{
        Problem,
        elsewhere::{Hand, Round},
        rung::Unmade,
    },
    cli::{
        Outcome,
        arguments::{Session, usage},
        batch::{self, Asked, Divisible, Kept},
        interrupt::{self, Interrupted},
        summary,
    },
};

/// A round of a problem.
pub(super) struct Part {
    pub problem: Arc<Problem>,
    pub round: Round,
    pub session: Session,
}

impl Part {
    /// The round that was handed over with a batch.
    pub fn handed(problem: Problem, besides: Option<&Value>, session: Session) -> anyhow::Result<Self> {
        let Some(besides) = besides else {
            return Err(usage(
                "every round of `calibrate` rests on those before, so that it falls into no batch of its own: let it hand its rounds over, with \
                 `calibrate --on ENGINE`",
            ));
        };
        let round = serde_json::from_value(besides.clone()).context("batch.json: `besides` holds no round")?;
        Ok(Self { problem: Arc::new(problem), round, session })
    }
}

impl Divisible for Part {
    fn points(&self) -> usize {
        self.round.points.len()
    }

    fn out(&self) -> Option<&Path> {
        None
    }

    fn plan(&self) -> anyhow::Result<Vec<u8>> {
        let own = self.problem.candidates.iter().find(|candidate| candidate.key() == self.round.candidate);
        let fit = own.map(|candidate| self.problem.key(candidate));
        summary::json(&json!({ "program": summary::program(), "fit": fit, "round": self.round }))
    }

    fn besides(&self) -> anyhow::Result<Option<Value>> {
        Ok(Some(serde_json::to_value(&self.round).context("a round cannot be written as JSON")?))
    }

    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>> {
        let bodies = self.problem.bodies(self.session.cache().as_ref())?;
        let bodies = bodies.context("this fit has no model above the chain")?;
        let runs = self.problem.part_of(&self.round, part, &bodies)?;
        interrupt::check()?;
        batch::values(&runs)
    }

    fn finish(self: Box<Self>, _: &Kept<'_>) -> anyhow::Result<Outcome> {
        bail!("a round is taken up by the `calibrate` that handed it over: repeat that command with --resume")
    }
}

/// Where rounds are made.
#[derive(Clone)]
pub struct Rounds {
    asked: Arc<Asked>,
    folder: PathBuf,
    /// Whether a batch that stands in the folder is one of this fit's rounds.
    goes_on: Arc<AtomicBool>,
    session: Session,
}

impl Rounds {
    /// On this cluster, for results in `out`, from where an earlier process stopped if `resume`.
    pub fn new(asked: Asked, out: &Path, resume: bool, session: &Session) -> Self {
        let goes_on = Arc::new(AtomicBool::new(resume));
        Self { asked: Arc::new(asked), folder: batch::beside(out), goes_on, session: session.clone() }
    }

    /// What has rounds of a problem made, `usual` runs in a chunk where nobody asked for a number.
    pub fn hand(&self, problem: &Problem, usual: usize) -> Arc<Hand> {
        let (own, problem) = (self.clone(), Arc::new(problem.clone()));
        Arc::new(move |round| {
            let part = Part { problem: Arc::clone(&problem), round: round.clone(), session: own.session.clone() };
            let goes_on = own.goes_on.swap(true, Ordering::Relaxed);
            let made = batch::made_on(&own.asked, &own.folder, &part, usual, goes_on, &own.session);
            let runs = made.and_then(|values| {
                let runs = values.into_iter().map(serde_json::from_value);
                runs.collect::<Result<Vec<_>, _>>().context("a chunk holds no runs; delete the batch's folder")
            });
            runs.map_err(|error| {
                if error.is::<Interrupted>() {
                    own.session.note(error);
                    return Unmade::Stopped;
                }
                Unmade::NotMade(error.into())
            })
        })
    }

    /// The results stand.
    pub fn remove(&self) {
        if self.goes_on.load(Ordering::Relaxed) {
            batch::remove(&self.folder);
        }
    }
}
