//! Every run of a calibration on disk: `fingerprints.csv`, from which the answer is read again without running anything.
//!
//! One line a run, in the order made:
//!
//! | column | content |
//! |---|---|
//! | `candidate` | damping law, behind it the mount where mounts compete |
//! | `stage` | `search` on the chain, or `correction`: a line for each rung of a pair; `correction-2` on the rung above that; `narrow-1` and so on: searches of boxes on whose bounds the best runs pressed, or that explained nothing; `wide`: a search of a wider box that explained no more |
//! | `batch`, `run` | number of the batch or round within the stage, number of the run within the candidate, from 1 |
//! | `model` | what made the run |
//! | `u_NAME` | position in the unit box |
//! | `z_NAME` | z = ½ ln(f² + floor²) of each feature; empty where the run failed. Of a second record `z2_NAME`, and so on |
//! | `failure` | why it failed |
//!
//! Numbers are the shortest decimals that read back to the same bits.

use std::{fmt::Write, io};

use thiserror::Error;

use super::{forward::Run, rung::Pair};

/// Name of the file.
pub const FILE: &str = "fingerprints.csv";

/// Stage of a wider box that explains no more.
const WIDE: &str = "wide";

/// Columns before the positions.
const LEADING: [&str; 5] = ["candidate", "stage", "batch", "run", "model"];

/// Why stored runs cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FingerprintsError {
    /// No table.
    #[error("{FILE}: expected a table of runs; calibrate again to write one")]
    Form(#[from] csv::Error),
    /// Other columns.
    #[error("{FILE}:1: expected the columns `{expected}`, found `{found}`; calibrate again to write them")]
    Columns {
        /// What the fit has.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A cell that means nothing.
    #[error("{FILE}:{line}: column `{column}`: expected {expected}, found `{found}`")]
    Cell {
        /// Line, from 1.
        line: u64,
        /// Column by name.
        column: String,
        /// What could stand there.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
}

/// The runs of one candidate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CandidateRuns {
    /// Damping law, behind it the mount where mounts compete.
    pub candidate: String,
    /// Searches of narrower boxes, batch by batch, that were given up for the next.
    pub narrow: Vec<Vec<Vec<Run>>>,
    /// The search on the chain, batch by batch.
    pub search: Vec<Vec<Run>>,
    /// A search of a wider box that explains the record no better; empty where there was none.
    pub wide: Vec<Vec<Run>>,
    /// The rounds of the correction on each rung above the chain, the lowest first; none where the chain answers.
    pub corrections: Vec<Vec<Vec<Pair>>>,
}

impl CandidateRuns {
    /// Number of runs made, those of a pair counted by themselves.
    #[must_use]
    pub fn len(&self) -> usize {
        let beside: usize = self.narrow.iter().flatten().chain(&self.wide).map(Vec::len).sum();
        beside + self.before(0) + 2 * self.pairs(self.corrections.len())
    }

    /// Number of runs made before rung `rung` above the chain, from 0, those of the rungs below it but for repetitions in pairs.
    #[must_use]
    pub fn before(&self, rung: usize) -> usize {
        self.search.iter().map(Vec::len).sum::<usize>() + self.pairs(rung)
    }

    /// Pairs of the lowest so many rungs.
    fn pairs(&self, rungs: usize) -> usize {
        self.corrections.iter().take(rungs).flatten().map(Vec::len).sum()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// What the columns and the models of a calibration are called.
#[derive(Debug, Clone, PartialEq)]
pub struct Names {
    /// The parameters.
    pub parameters: Vec<String>,
    /// The features of each record.
    pub features: Vec<Vec<String>>,
    /// The model that searches, and those that correct it, one after another.
    pub models: Vec<String>,
}

impl Names {
    /// The model of a rung, the one that searches number 0.
    #[must_use]
    pub fn model(&self, rung: usize) -> &str {
        self.models.get(rung).map_or("?", String::as_str)
    }

    /// The header, cell by cell.
    #[must_use]
    pub fn columns(&self) -> Vec<String> {
        let mut columns = LEADING.map(String::from).to_vec();
        columns.extend(self.parameters.iter().map(|name| format!("u_{name}")));
        for (record, features) in self.features.iter().enumerate() {
            let number = if record == 0 { String::new() } else { (record + 1).to_string() };
            columns.extend(features.iter().map(|name| format!("z{number}_{name}")));
        }
        columns.push("failure".into());
        columns
    }
}

/// The table of all runs.
///
/// # Errors
/// What the writer says of memory that is full.
pub fn to_csv(names: &Names, candidates: &[CandidateRuns]) -> Result<Vec<u8>, FingerprintsError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let columns = names.columns();
    writer.write_record(&columns)?;
    for candidate in candidates {
        let mut number = 0;
        let mut line = |stage: &str, batch: usize, number: usize, model: &str, run: &Run| {
            let mut cells = vec![candidate.candidate.clone(), stage.into(), (batch + 1).to_string()];
            cells.extend([number.to_string(), model.to_owned()]);
            cells.extend(run.position.iter().map(f64::to_string));
            match &run.outcome {
                Ok(features) => {
                    cells.extend(features.iter().map(f64::to_string));
                    cells.push(String::new());
                }
                Err(reason) => {
                    cells.resize(columns.len() - 1, String::new());
                    cells.push(reason.clone());
                }
            }
            writer.write_record(&cells)
        };
        for (narrower, batches) in candidate.narrow.iter().enumerate() {
            let stage = format!("narrow-{}", narrower + 1);
            let runs = batches.iter().enumerate().flat_map(|(batch, runs)| runs.iter().map(move |run| (batch, run)));
            for (number, (batch, run)) in runs.enumerate() {
                line(&stage, batch, number + 1, names.model(0), run)?;
            }
        }
        for (batch, runs) in candidate.search.iter().enumerate() {
            for run in runs {
                number += 1;
                line("search", batch, number, names.model(0), run)?;
            }
        }
        let wide = candidate.wide.iter().enumerate().flat_map(|(batch, runs)| runs.iter().map(move |run| (batch, run)));
        for (number, (batch, run)) in wide.enumerate() {
            line(WIDE, batch, number + 1, names.model(0), run)?;
        }
        for (rung, rounds) in candidate.corrections.iter().enumerate() {
            let stage = correction(rung);
            for (round, pair) in
                rounds.iter().enumerate().flat_map(|(round, pairs)| pairs.iter().map(move |it| (round, it)))
            {
                number += 1;
                line(&stage, round, number, names.model(rung), &pair.lower)?;
                line(&stage, round, number, names.model(rung + 1), &pair.upper)?;
            }
        }
    }
    writer.into_inner().map_err(|error| csv::Error::from(io::Error::from(error.into_error().kind())).into())
}

/// Read a table of runs whose columns are `names`'.
///
/// # Errors
/// [`FingerprintsError`] with line and column.
pub fn from_csv(names: &Names, bytes: &[u8]) -> Result<Vec<CandidateRuns>, FingerprintsError> {
    let mut reader = csv::Reader::from_reader(bytes);
    let columns = names.columns();
    let found: Vec<&str> = reader.headers()?.iter().collect();
    if columns != found {
        return Err(FingerprintsError::Columns { expected: columns.join(","), found: found.join(",") });
    }
    let mut candidates: Vec<CandidateRuns> = Vec::new();
    let mut lower: Option<Run> = None;
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        let cell = |column: usize, expected: &'static str| FingerprintsError::Cell {
            line,
            column: columns[column].clone(),
            expected,
            found: record[column].to_owned(),
        };
        let number = |column: usize| {
            let value: Option<f64> = record[column].parse().ok().filter(|value: &f64| value.is_finite());
            value.ok_or_else(|| cell(column, "a finite number"))
        };
        let batch: usize = record[2].parse().map_err(|_: std::num::ParseIntError| cell(2, "a whole number"))?;
        let first = LEADING.len() + names.parameters.len();
        let position = (LEADING.len()..first).map(number).collect::<Result<Vec<_>, _>>()?;
        let outcome = match &record[columns.len() - 1] {
            "" => Ok((first..columns.len() - 1).map(number).collect::<Result<Vec<_>, _>>()?),
            reason => Err(reason.to_owned()),
        };
        let run = Run { position, outcome };
        if candidates.last().is_none_or(|last| last.candidate != record[0]) {
            candidates.push(CandidateRuns { candidate: record[0].to_owned(), ..CandidateRuns::default() });
        }
        let Some(candidate) = candidates.last_mut() else { continue };
        let misplaced = || cell(2, "the number of the batch before it, or the next");
        match (&record[1], lower.take()) {
            (stage, None) if candidate.search.is_empty() && narrower(stage, candidate.narrow.len()).is_some() => {
                if narrower(stage, candidate.narrow.len()) == Some(candidate.narrow.len()) {
                    candidate.narrow.push(Vec::new());
                }
                let Some(last) = candidate.narrow.last_mut() else { continue };
                batch_of(last, batch).ok_or_else(misplaced)?.push(run);
            }
            ("search", None) if candidate.corrections.is_empty() => {
                batch_of(&mut candidate.search, batch).ok_or_else(misplaced)?.push(run);
            }
            (WIDE, None) if candidate.corrections.is_empty() => {
                batch_of(&mut candidate.wide, batch).ok_or_else(misplaced)?.push(run);
            }
            (stage, None) if corrected(stage, candidate.corrections.len()).is_some() => lower = Some(run),
            (stage, Some(lower)) if corrected(stage, candidate.corrections.len()).is_some() => {
                if corrected(stage, candidate.corrections.len()) == Some(candidate.corrections.len()) {
                    candidate.corrections.push(Vec::new());
                }
                let Some(last) = candidate.corrections.last_mut() else { continue };
                batch_of(last, batch).ok_or_else(misplaced)?.push(Pair { lower, upper: run });
            }
            _ => return Err(cell(1, "`search`, and then `correction` twice a pair, rung by rung")),
        }
    }
    Ok(candidates)
}

/// Which of the narrower boxes a stage is of, from 0: one of `known`, or the next.
fn narrower(stage: &str, known: usize) -> Option<usize> {
    let number: usize = stage.strip_prefix("narrow-")?.parse().ok()?;
    (number >= 1 && (number == known || number == known + 1)).then(|| number - 1)
}

/// The stage of a rung above the chain, from 0.
fn correction(rung: usize) -> String {
    if rung == 0 { "correction".into() } else { format!("correction-{}", rung + 1) }
}

/// Which rung above the chain a stage is of, from 0: the last of `known`, or the next.
fn corrected(stage: &str, known: usize) -> Option<usize> {
    [known.checked_sub(1), Some(known)].into_iter().flatten().find(|rung| correction(*rung) == stage)
}

/// Batch `number`, from 1: the last one, or a new one behind it.
fn batch_of<T>(batches: &mut Vec<Vec<T>>, number: usize) -> Option<&mut Vec<T>> {
    if number == batches.len() + 1 {
        batches.push(Vec::new());
    }
    if number == batches.len() { batches.last_mut() } else { None }
}

/// What differs between a run as stored and as made again, in words; `None` where it is the same to the last bit or, if `allowed` is above 0, where no number
/// is further away than that.
#[must_use]
pub fn difference(names: &Names, stored: &Run, again: &Run, allowed: f64) -> Option<String> {
    if stored == again || distance(stored, again).is_some_and(|distance| distance <= allowed) {
        return None;
    }
    let (Ok(expected), Ok(found)) = (&again.outcome, &stored.outcome) else {
        let told = |run: &Run| run.outcome.as_ref().map_or_else(Clone::clone, |_| "a finished run".into());
        return Some(format!("expected {}, found {}", told(again), told(stored)));
    };
    let columns = names.columns();
    let first = LEADING.len() + names.parameters.len();
    let mut text = String::new();
    for (index, (expected, found)) in expected.iter().zip(found).enumerate() {
        if expected.to_bits() != found.to_bits() {
            let separator = if text.is_empty() { "" } else { "; " };
            let column = columns.get(first + index).map_or("?", String::as_str);
            // Writing to a string cannot fail.
            let _ = write!(text, "{separator}column `{column}`: expected {expected}, found {found}");
        }
    }
    Some(text)
}

/// The largest distance of a number of two runs at the same point; `None` where either failed and the other did not, or otherwise.
#[must_use]
pub fn distance(a: &Run, b: &Run) -> Option<f64> {
    match (&a.outcome, &b.outcome) {
        (Ok(a), Ok(b)) if a.len() == b.len() => {
            let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            apart.clone().all(f64::is_finite).then(|| apart.fold(0.0, f64::max))
        }
        (Err(a), Err(b)) if a == b => Some(0.0),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Names {
        let own = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        Names {
            parameters: own(&["alpha", "damping"]),
            features: vec![own(&["positive_peak", "band_1/3"]), own(&["positive_peak"])],
            models: own(&["chain", "reduced", "fea"]),
        }
    }

    fn runs() -> Vec<CandidateRuns> {
        let run = |seed: f64| Run { position: vec![seed / 3.0, 0.25], outcome: Ok(vec![-seed, 1e-300 * seed, -0.0]) };
        let failed = Run { position: vec![0.1, 0.2], outcome: Err("no onset, \"ever\"".into()) };
        vec![
            CandidateRuns {
                candidate: "linear".into(),
                narrow: vec![vec![vec![run(5.0)], vec![run(6.0)]], vec![vec![run(7.0)]]],
                search: vec![vec![run(1.0), failed.clone()], vec![run(2.0)]],
                wide: vec![vec![run(10.0), run(11.0)]],
                corrections: vec![
                    vec![vec![Pair { lower: run(3.0), upper: failed }]],
                    vec![vec![Pair { lower: run(8.0), upper: run(9.0) }], vec![]],
                ],
            },
            CandidateRuns {
                candidate: "kuwabara-kono".into(),
                narrow: vec![],
                search: vec![vec![run(4.0)]],
                wide: vec![],
                corrections: vec![],
            },
        ]
    }

    #[test]
    fn runs_come_back_to_the_last_bit() {
        let mut runs = runs();
        runs[0].corrections[1].pop();
        let bytes = to_csv(&names(), &runs).unwrap();
        let text = String::from_utf8(bytes.clone()).unwrap();
        assert!(text.starts_with(
            "candidate,stage,batch,run,model,u_alpha,u_damping,z_positive_peak,z_band_1/3,z2_positive_peak,failure\n"
        ));
        let again = from_csv(&names(), &bytes).unwrap();
        assert_eq!(again, runs);
        assert!(again[0].search[0][0].features().unwrap()[2].is_sign_negative());
        assert_eq!((runs[0].len(), runs[0].before(1)), (12, 4));
    }

    #[test]
    fn a_broken_cell_is_named_with_line_and_column() {
        let text = String::from_utf8(to_csv(&names(), &runs()).unwrap()).unwrap();
        for (from, to, said) in [
            (",-2,", ",-2x,", "fingerprints.csv:7: column `z_positive_peak`: expected a finite number, found `-2x`"),
            ("search,2,", "search,4,", "fingerprints.csv:7: column `batch`"),
            ("search,2,", "searched,2,", "fingerprints.csv:7: column `stage`"),
            ("z2_", "z3_", "fingerprints.csv:1: expected the columns"),
        ] {
            let error = from_csv(&names(), text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }

    #[test]
    fn a_run_that_differs_says_in_which_column() {
        let stored = &runs()[0].search[0][0];
        let mut again = stored.clone();
        assert_eq!(difference(&names(), stored, &again, 0.0), None);
        again.outcome.as_mut().unwrap()[0] = -1.5;
        let told = "column `z_positive_peak`: expected -1.5, found -1";
        for allowed in [0.0, 0.49] {
            assert_eq!(difference(&names(), stored, &again, allowed).unwrap(), told);
        }
        assert_eq!(difference(&names(), stored, &again, 0.5), None);
    }
}
