//! Posterior predictive p-value: how well the model explains a record, compared with runs of the model itself.
//!
//! Each run near the answer takes the place of the record in turn (leave-one-out). The other runs give its expected
//! features, by the regression of [`super::likelihood`]. The parameters are refitted, and the residual is
//!
//! T = Σ_records rᵀ Σ⁻¹ r.
//!
//! p is the share of these runs whose T is at least that of the record. A correct model is thus rejected with
//! probability p, for any model, set of features and number of records, and without further runs. If the record lies
//! beyond all runs, the tail of ln T is taken as a Student t.
//!
//! Each run also gets the known error of the model (the nuggets), since the record has it too.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::{likelihood::TrainingRuns, residue::Residue};

/// p below which the model does not explain the record.
pub const OUTSIDE: f64 = 0.01;

/// p below which the verdict is doubtful.
pub const DOUBTFUL: f64 = 0.05;

/// Most runs near the answer used as reference.
const REFERENCES: usize = 150;

const FEWEST: usize = 30;

/// Fewest runs beyond the record for which p is their share; with fewer, the tail is modelled.
const COUNTED: usize = 5;

/// Mean of the exponential prior of γ, as in `BSLmisspec` (Frazier & Drovandi, J. Comput. Graph. Stat. 30 (2021) 958).
const PRIOR: f64 = 0.5;

/// The record compared with reference runs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// p-value: the share of reference runs that fit as badly as the record. For several records: twice the smaller of
    /// their joint p and of the least single p times their number.
    pub p: f64,
    /// p of each record alone.
    pub records: Vec<f64>,
    /// Residual of each feature of the record after the fit, r/σ.
    pub pulls: Vec<f64>,
    pub references: usize,
}

impl Agreement {
    /// Compares the record at the point `at` of the box; `None` if there are too few runs around it.
    pub(crate) fn of(training: &TrainingRuns, at: &[f64], seed: u64) -> Option<Self> {
        let local = training.regress(at)?;
        let own = local.residue(&local.deviation)?;
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x00A6_4EE5);
        let mut drawn = || -> f64 { StandardNormal.sample(&mut random) };
        let reference = |run| {
            let (of_run, local) = training.regress_leaving(run)?;
            let known = training.nuggets.iter().map(|nugget| nugget * drawn());
            let apart: Vec<f64> =
                local.deviation.iter().zip(of_run).zip(known).map(|((all, own), known)| all - own + known).collect();
            local.residue(&apart)
        };
        let references: Vec<Residue> = training.nearest(at, REFERENCES).into_iter().filter_map(reference).collect();
        if references.len() < FEWEST {
            return None;
        }
        let of_record = |record: usize| {
            let others: Vec<f64> = references.iter().map(|residue| residue.squares[record]).collect();
            share_beyond(own.squares[record], others)
        };
        let records: Vec<f64> = (0..own.squares.len()).map(of_record).collect();
        let together = |residue: &Residue| residue.squares.iter().sum::<f64>();
        let all = share_beyond(together(&own), references.iter().map(together).collect());
        let p = match records.as_slice() {
            [_] => all,
            several => {
                let least = several.iter().copied().fold(1.0, f64::min) * several.len() as f64;
                (2.0 * least.min(all)).min(1.0)
            }
        };
        Some(Self { p, records, pulls: own.pulls, references: references.len() })
    }
}

/// γ² of each feature: the most likely value under an exponential prior; 0 for residuals up to about three standard
/// deviations.
pub(crate) fn inflation(pulls: &[f64]) -> Vec<f64> {
    pulls.iter().map(|pull| most_likely_inflation(*pull)).collect()
}
/// γ² at which ½ ln(1 + γ²) + ½ pull²/(1 + γ²) + γ/mean is least.
fn most_likely_inflation(pull: f64) -> f64 {
    let cost = |gamma: f64| {
        let variance = 1.0 + gamma * gamma;
        0.5 * variance.ln() + 0.5 * pull * pull / variance + gamma / PRIOR
    };
    // The cost has one maximum before its minimum at most: a grid up to where the pull is explained finds the better end.
    const GRID: usize = 400;
    let most = pull.abs();
    let gamma = (0..=GRID).map(|i| most * i as f64 / GRID as f64).min_by(|a, b| cost(*a).total_cmp(&cost(*b)));
    gamma.unwrap_or(0.0).powi(2)
}

/// Probability of a statistic of at least `own`, estimated from `others`.
fn share_beyond(own: f64, others: Vec<f64>) -> f64 {
    tail_share(own, &others, |logarithms, mean| {
        let n = logarithms.len() as f64;
        let deviation = (logarithms.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        (n - 1.0, deviation * (1.0 + 1.0 / n).sqrt())
    })
}

/// Share of `others` that are at least `own`. If there are very few, the tail of the logarithms is taken as a Student
/// t; `tail` gives degrees of freedom and scale from the logarithms and their mean.
pub(crate) fn tail_share(own: f64, others: &[f64], tail: impl Fn(&[f64], f64) -> (f64, f64)) -> f64 {
    let count = others.len() as f64;
    let beyond = others.iter().filter(|other| **other >= own).count();
    let counted = (beyond as f64 + 1.0) / (count + 1.0);
    if beyond >= COUNTED || own <= 0.0 {
        return counted;
    }
    let logarithms: Vec<f64> = others.iter().filter(|other| **other > 0.0).map(|other| other.ln()).collect();
    let mean = logarithms.iter().sum::<f64>() / logarithms.len() as f64;
    let (freedom, scale) = tail(&logarithms, mean);
    let Ok(student) = StudentsT::new(0.0, 1.0, freedom) else { return counted };
    let tail = student.sf((own.ln() - mean) / scale);
    // Where none of so many lies beyond, p is no larger than the first of them would make it.
    tail.min(counted)
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;
    use crate::likelihood::NEIGHBOURS;

    /// Runs whose five features answer to two parameters and scatter, as heavy-tailed as stated; a record of the same, off by `off` in its last.
    fn p_of(seed: u64, heavy: bool, off: f64) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let slopes: [[f64; 2]; 5] = [[1.0, 0.2], [0.3, -1.0], [0.5, 0.5], [-0.2, 0.8], [0.0, 0.1]];
        let run = |at: &[f64], random: &mut ChaCha8Rng| -> Vec<f64> {
            let scatter = |random: &mut ChaCha8Rng| -> f64 {
                let draw: f64 = StandardNormal.sample(random);
                let scale: f64 = if heavy && random.random::<f64>() < 0.1 { 4.0 } else { 1.0 };
                0.05 * scale * draw
            };
            slopes.iter().map(|slope| slope[0] * at[0] + slope[1] * at[1] + scatter(random)).collect()
        };
        let runs: Vec<(Vec<f64>, Vec<f64>)> = (0..300)
            .map(|_| {
                let at = vec![random.random::<f64>(), random.random::<f64>()];
                let z = run(&at, &mut random);
                (at, z)
            })
            .collect();
        let truth = [0.5, 0.5];
        let mut observed = run(&truth, &mut random);
        observed[4] += off;
        let pairs = runs.iter().map(|(at, z)| (at.as_slice(), z.as_slice()));
        let training = TrainingRuns::new(pairs, &observed, &[1e-3; 5], &[1.0; 5], NEIGHBOURS);
        Agreement::of(&training, &truth, seed).unwrap().p
    }

    #[test]
    fn a_right_model_is_called_wrong_as_often_as_p_says() {
        for heavy in [false, true] {
            let p: Vec<f64> = (0..400).map(|seed| p_of(seed, heavy, 0.0)).collect();
            let share = |limit: f64| p.iter().filter(|p| **p < limit).count();
            // Binomial: 4 ± 2, 20 ± 4.4 and 200 ± 10 of 400; three of that.
            assert!(share(OUTSIDE) <= 10 && share(DOUBTFUL) <= 33, "{heavy}: {} {}", share(OUTSIDE), share(DOUBTFUL));
            assert!((170..=230).contains(&share(0.5)), "{heavy}: {}", share(0.5));
        }
    }

    #[test]
    fn a_feature_that_no_run_has_is_found() {
        // Six scatters.
        let found = (0..50).filter(|seed| p_of(*seed, false, 0.3) < OUTSIDE).count();
        assert!(found >= 48, "{found} of 50");
    }

    #[test]
    fn what_agrees_is_not_inflated_and_what_does_not_is_explained() {
        assert_eq!(most_likely_inflation(2.0), 0.0);
        let far = most_likely_inflation(8.0);
        assert!(far > 4.0 && far < 64.0, "{far}");
    }
}
