//! Rounds of runs that other processes make: what they have to know of a run, and how the runs come back.
//!
//! A run depends on its number, its point, its duration and on what the fit is made from, so that any process with the same records and flags makes
//! the same of it.

use std::{ops::Range, sync::Arc};

use serde::{Deserialize, Serialize};

use super::{
    forward::Run,
    ladder::joint,
    parameter::Parameter,
    problem::Problem,
    refusal::{Contradiction, Refusal},
    rung::{Bodies, Unmade},
};

/// Runs of the highest rung that need nothing of one another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Round {
    /// Key of the candidate.
    pub candidate: String,
    /// What is fitted, in the box that its search was left with.
    pub parameters: Vec<Parameter>,
    /// Whether on the finer bodies of the rung.
    pub finer: bool,
    /// The runs.
    pub points: Vec<RoundPoint>,
}

/// One run to be made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RoundPoint {
    /// Its number, which says what is drawn.
    pub number: u64,
    /// Unit coordinates.
    pub position: Vec<f64>,
    /// How long it is simulated, s; where that proves too short it is made again at full length.
    pub duration: f64,
}

/// Has the runs of a round made, one a point, in order.
pub type Hand = dyn Fn(&Round) -> Result<Vec<Run>, Unmade> + Send + Sync;

/// Whom a rung hands its rounds to, and as whose.
#[derive(Clone)]
pub(super) struct Handed {
    pub hand: Arc<Hand>,
    /// Without points.
    pub round: Round,
}

impl Handed {
    /// The same for the finer bodies of the rung.
    pub fn finer(&self) -> Self {
        Self { hand: Arc::clone(&self.hand), round: Round { finer: true, ..self.round.clone() } }
    }

    /// Have runs made; none of none.
    pub fn made(&self, points: Vec<RoundPoint>) -> Result<Vec<Run>, Unmade> {
        if points.is_empty() {
            return Ok(Vec::new());
        }
        (self.hand)(&Round { points, ..self.round.clone() })
    }
}

impl Problem {
    /// Make a part of a round that another process has handed over.
    ///
    /// # Errors
    /// A round of another problem; what cannot be run.
    pub fn part_of(&self, round: &Round, part: Range<usize>, bodies: &Bodies) -> Result<Vec<Run>, Refusal> {
        let own = self.candidates.iter().find(|candidate| candidate.key() == round.candidate);
        let other = || Refusal::from(Contradiction::OtherRound { candidate: round.candidate.clone() });
        let mut candidate = own.ok_or_else(other)?.clone();
        candidate.parameters.clone_from(&round.parameters);
        let joint = joint(self, &candidate, Some(bodies), &(Arc::new(|_| true) as _))?;
        let rungs = bodies.rungs(joint.first(), candidate.scene());
        let rung = rungs.last().and_then(|rung| if round.finer { rung.finer() } else { Some(rung) });
        let points = round.points.get(part).ok_or_else(other)?;
        rung.ok_or_else(other)?.here(points.to_vec()).map_err(|_| Refusal::Stopped)
    }
}
