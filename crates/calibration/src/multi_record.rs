//! Several records fitted together: one set of parameters, one run per record at every point of the box.
//!
//! The records share the fitted parameters (α, damping). Each has its own drive, trigger, baseline, noise and cutoff,
//! and may have its own number of beads; every run draws its gaps and drive factor. Given the parameters, the records
//! are independent and their likelihoods multiply:
//!
//! SL(x) = Σ_r SL_r(x), every SL_r from its own features z_r by the regression of [`super::likelihood`].
//!
//! Since every point is run for every record, the result of one record alone follows from the same runs ([`Share`]).

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::{
    estimate::{Estimate, estimates_of},
    forward::{Forward, Run},
    likelihood::TrainingRuns,
    parameter::Parameter,
    posterior::Posterior,
};

/// Points of a search for several records with which intervals were tested.
pub const TESTED_TOGETHER: usize = 1200;

/// Distance between the seeds of two records: larger than any number of runs.
const SEED_STRIDE: u64 = 1 << 40;

/// Relative difference up to which two drive frequencies count as equal: the resolution of a lock-in or a spectrum of
/// forty periods.
const SAME_FREQUENCY: f64 = 1e-3;

/// A drive frequency and its source.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedFrequency {
    pub path: PathBuf,
    /// Its line, from 1; `None` if it is not on one line.
    pub line: Option<usize>,
    /// f0, Hz.
    pub frequency: f64,
}

impl std::fmt::Display for StatedFrequency {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}", self.path.display()),
            None => write!(f, "{}", self.path.display()),
        }
    }
}

/// Why records cannot be fitted together.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum JointError {
    #[error(
        "{found}: expected a drive of {:.4} kHz as {expected} states, found {:.4} kHz; one α holds for one frequency of the horn: correct the \
         frequency, pass --drive-frequency, or fit it by itself", expected.frequency * 1e-3, found.frequency * 1e-3
    )]
    OtherFrequency { found: StatedFrequency, expected: StatedFrequency },
}

/// Refuses records at different drive frequencies: α holds at one frequency, and features are taken at its multiples.
pub fn at_one_frequency(stated: &[StatedFrequency]) -> Result<(), JointError> {
    let Some((expected, others)) = stated.split_first() else { return Ok(()) };
    let differs = |found: &&StatedFrequency| (found.frequency / expected.frequency - 1.0).abs() > SAME_FREQUENCY;
    match others.iter().find(differs) {
        Some(found) => Err(JointError::OtherFrequency { found: found.clone(), expected: expected.clone() }),
        None => Ok(()),
    }
}

/// Records that are fitted together, at least one, with the same parameters.
#[derive(Clone)]
pub struct MultiRecord {
    pub(super) records: Vec<Forward>,
}

impl From<&Forward> for MultiRecord {
    fn from(record: &Forward) -> Self {
        Self { records: vec![record.clone()] }
    }
}

impl MultiRecord {
    /// Of records with the same parameters; the runs of each have their own seed.
    pub(super) fn of(records: Vec<Forward>) -> Self {
        let seeded = |(number, record): (u64, Forward)| record.reseeded(number.wrapping_mul(SEED_STRIDE));
        Self { records: (0..).zip(records).map(seeded).collect() }
    }

    pub(super) fn first(&self) -> &Forward {
        &self.records[0]
    }

    /// The same with a finer step for every record; `None` if impossible.
    pub(super) fn refined(&self) -> Option<Self> {
        Some(Self { records: self.records.iter().map(Forward::refined).collect::<Option<_>>()? })
    }

    /// Runs the points for every record, numbered from `first`: the fingerprints of all records, concatenated. A point
    /// fails if one of its runs fails.
    pub(crate) fn run(&self, first: u64, positions: &[Vec<f64>]) -> Vec<Run> {
        let mut runs = self.first().run(first, positions);
        for (number, record) in self.records.iter().enumerate().skip(1) {
            for (run, more) in runs.iter_mut().zip(record.run(first, positions)) {
                match (&mut run.outcome, more.outcome) {
                    (Ok(features), Ok(more)) => features.extend(more),
                    (Ok(_), Err(reason)) => run.outcome = Err(format!("record {}: {reason}", number + 1)),
                    (Err(_), _) => {}
                }
            }
        }
        runs
    }
}

/// Result of one of several records alone.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Share {
    /// Its estimates, from the runs made for all records.
    pub estimates: Vec<Estimate>,
    /// Correlation of the logarithms of the first two parameters.
    pub correlation: f64,
    /// Its posterior, from the runs made for all records.
    pub posterior: Posterior,
    /// Misfit per feature of this record at the runs that are best for all records.
    pub misfit: f64,
    /// p-value of this record at the joint answer.
    pub p: f64,
}

/// Result of each of several records alone, with its p at the joint answer; empty for one record.
pub(super) fn shares(
    parameters: &[Parameter],
    training: &TrainingRuns,
    best: &[usize],
    p: &[f64],
    scatter: &[f64],
) -> Vec<Share> {
    if training.records() < 2 {
        return vec![];
    }
    let share = |record: usize| {
        let alone = training.of_record(record);
        let posterior = Posterior::of(&alone, parameters.len())?;
        let (estimates, _) = estimates_of(parameters, &alone, &posterior);
        let misfits = alone.misfits(scatter.get(training.part(record))?);
        let mut misfits: Vec<f64> = best.iter().filter_map(|run| misfits.get(*run).copied()).collect();
        misfits.sort_by(f64::total_cmp);
        Some(Share {
            estimates,
            correlation: posterior.first_correlation(),
            posterior,
            misfit: misfits.get(misfits.len() / 2).copied().unwrap_or(f64::INFINITY),
            p: *p.get(record)?,
        })
    };
    // A point at which all records can be judged is one at which each can.
    (0..training.records()).map(share).collect::<Option<_>>().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_at_another_frequency_are_refused_with_file_and_line() {
        let stated = |path: &str, line, frequency| StatedFrequency { path: path.into(), line, frequency };
        let first = stated("low/vib.csv", Some(2), 73e3);
        // Two spectra of forty periods differ by less than a thousandth.
        assert!(at_one_frequency(&[first.clone(), stated("high/vib.csv", None, 73.05e3)]).is_ok());
        let error = at_one_frequency(&[first, stated("high/vib.csv", Some(3), 80e3)]).unwrap_err().to_string();
        for part in ["high/vib.csv:3", "80.0000 kHz", "73.0000 kHz", "low/vib.csv:2", "by itself"] {
            assert!(error.contains(part), "{part}: {error}");
        }
    }
}
