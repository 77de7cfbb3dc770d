//! Every run of a calibration on disk: `fingerprints.csv`, from which the answer is read again without running anything.
//!
//! One line a run, in the order made:
//!
//! | column | content |
//! |---|---|
//! | `candidate` | damping law, behind it the mount where mounts compete |
//! | `stage` | `search` on the chain, or `correction`: a line for each fidelity level of a pair; `correction-2` on the fidelity level above that; `narrow-1` and so on: searches of boxes on whose bounds the best runs pressed, or that explained nothing; `wide`: a search of a wider box that explained no more |
//! | `batch`, `run` | number of the batch or round within the stage, number of the run within the candidate, from 1 |
//! | `model` | what made the run |
//! | `u_NAME` | position in the unit box |
//! | `z_NAME` | z = ½ ln(f² + floor²) of each feature; empty where the run failed. Of a second record `z2_NAME`, and so on |
//! | `failure` | why it failed |
//!
//! Numbers are the shortest decimals that read back to the same bits.

use std::io;

use thiserror::Error;

use super::{fidelity::Pair, forward::Run};

pub const FILE: &str = "fingerprints.csv";

/// Stage of a wider box that gave no better answer.
const WIDE: &str = "wide";

const LEADING: [&str; 5] = ["candidate", "stage", "batch", "run", "model"];

/// Why runs cannot be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FingerprintsError {
    #[error("{FILE}: expected a table of runs; calibrate again to write one")]
    Form(#[from] csv::Error),
}

/// The runs of one candidate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CandidateRuns {
    /// Damping law, behind it the mount where mounts compete.
    pub candidate: String,
    /// Abandoned searches of narrower boxes, batch by batch.
    pub narrow: Vec<Vec<Vec<Run>>>,
    /// The search on the chain, batch by batch.
    pub search: Vec<Vec<Run>>,
    /// A search of a wider box that explains the record no better; empty if there was none.
    pub wide: Vec<Vec<Run>>,
    /// Rounds of the correction on each fidelity level above the chain, lowest first; empty if the chain answers.
    pub corrections: Vec<Vec<Vec<Pair>>>,
}

impl CandidateRuns {
    /// Number of runs made before level `fidelity` above the chain (from 0), without repetitions of lower levels in
    /// pairs.
    pub(crate) fn before(&self, fidelity: usize) -> usize {
        let pairs = self.corrections.iter().take(fidelity).flatten().map(Vec::len);
        self.search.iter().map(Vec::len).sum::<usize>() + pairs.sum::<usize>()
    }
}

/// Names of columns and models of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Names {
    pub parameters: Vec<String>,
    /// The features of each record.
    pub features: Vec<Vec<String>>,
    /// The model of the search, then those of the corrections.
    pub models: Vec<String>,
}

impl Names {
    /// The model of a fidelity level; 0 is that of the search.
    pub(crate) fn model(&self, fidelity: usize) -> &str {
        self.models.get(fidelity).map_or("?", String::as_str)
    }

    /// The header, cell by cell.
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
pub(crate) fn to_csv(names: &Names, candidates: &[CandidateRuns]) -> Result<Vec<u8>, FingerprintsError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let columns = names.columns();
    writer.write_record(&columns)?;
    for candidate in candidates {
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
        let narrow = candidate.narrow.iter().zip(1..).map(|(batches, number)| (format!("narrow-{number}"), batches));
        let own = [("search".to_owned(), &candidate.search), (WIDE.to_owned(), &candidate.wide)];
        for (stage, batches) in narrow.chain(own) {
            let runs = batches.iter().enumerate().flat_map(|(batch, runs)| runs.iter().map(move |run| (batch, run)));
            for ((batch, run), number) in runs.zip(1..) {
                line(&stage, batch, number, names.model(0), run)?;
            }
        }
        let mut number = candidate.before(0);
        for (fidelity, rounds) in candidate.corrections.iter().enumerate() {
            let stage = correction(fidelity);
            for (round, pair) in
                rounds.iter().enumerate().flat_map(|(round, pairs)| pairs.iter().map(move |it| (round, it)))
            {
                number += 1;
                line(&stage, round, number, names.model(fidelity), &pair.lower)?;
                line(&stage, round, number, names.model(fidelity + 1), &pair.upper)?;
            }
        }
    }
    writer.into_inner().map_err(|error| csv::Error::from(io::Error::from(error.into_error().kind())).into())
}

/// Name of the stage of a fidelity level above the chain, from 0.
fn correction(fidelity: usize) -> String {
    if fidelity == 0 { "correction".into() } else { format!("correction-{}", fidelity + 1) }
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
        let text = String::from_utf8(to_csv(&names(), &runs).unwrap()).unwrap();
        assert!(text.starts_with(
            "candidate,stage,batch,run,model,u_alpha,u_damping,z_positive_peak,z_band_1/3,z2_positive_peak,failure\n"
        ));
        // Every number comes back to the last bit.
        let row: Vec<&str> = text.lines().find(|line| line.contains(",search,1,")).unwrap().split(',').collect();
        let numbers: Vec<u64> = row[5..10].iter().map(|cell| cell.parse::<f64>().unwrap().to_bits()).collect();
        assert_eq!(numbers, [1.0 / 3.0, 0.25, -1.0, 1e-300, -0.0].map(f64::to_bits));
        assert_eq!((runs[0].before(0), runs[0].before(1)), (3, 4));
    }
}
