//! Studies whose runs fall into points that need nothing of one another: what is run at a point, and what all points say together.

use std::ops::Range;

use serde::{Serialize, de::DeserializeOwned};

use crate::failure::StudyError;
use granchain_calibration::predict::replicates::Watch;

/// A study that falls into numbered points.
pub trait Divided: Sync {
    /// What is kept of a point; read again from JSON it is the same.
    type Point: Serialize + DeserializeOwned + Send;
    /// What all of them say.
    type Outcome;

    fn points(&self) -> usize;

    fn runs_of(&self, point: usize) -> usize;

    /// Points that are shown and timed together, in order: their name and number.
    fn stages(&self) -> Vec<(&'static str, usize)> {
        vec![("run", self.points())]
    }

    /// Run the points `part`; one value each, whatever else is run.
    ///
    /// # Errors
    /// [`StudyError::Stopped`]; a run that everything rests on.
    fn part(&self, part: Range<usize>, watch: &dyn Watch) -> Result<Vec<Self::Point>, StudyError>;

    /// What the values of all points say.
    ///
    /// # Errors
    /// Too few of the runs were left; a run that is drawn failed.
    fn outcome(&self, points: Vec<Self::Point>) -> Result<Self::Outcome, StudyError>;

    fn runs(&self) -> usize {
        (0..self.points()).map(|point| self.runs_of(point)).sum()
    }

    /// All of it.
    ///
    /// # Errors
    /// As [`Divided::part`] and [`Divided::outcome`].
    fn run(&self, watch: &dyn Watch) -> Result<Self::Outcome, StudyError> {
        self.outcome(self.part(0..self.points(), watch)?)
    }
}
