//! Discretisation error of the model: pairs of runs at the answer with the same draws, one at the setting of the fit
//! and one at a finer setting.
//!
//! In n pairs the features differ by d̄ ± s/√n on average. The error of the fit's setting enters as
//!
//! - shift = κ e d̄, added to every run's features, with κ = d̄²/(d̄² + s²/n), since pairs of chaotic motion diverge
//!   and d̄ is then not significant; e converts the difference between two settings into the error of the coarser one
//!   by the order of convergence;
//! - nugget² = κ e² s²/n + (shift/2)², added to the variance of each feature: half of the correction is taken as
//!   uncertain.
//!
//! It is measured at the answer and assumed constant around it.

use serde::{Deserialize, Serialize};

use super::{
    fidelity::{FidelityLevel, Incomplete},
    forward::Run,
    likelihood::TrainingRuns,
    multi_record::MultiRecord,
};

/// Pairs on the chain, whose runs are cheap.
const CHAIN_PAIRS: usize = 24;

/// Pairs on a fidelity level above.
pub(crate) const FIDELITY_PAIRS: usize = 8;

const FEWEST: usize = 4;

/// Error of the chain's step over its difference from one a quarter as long: contacts that touch within a step make it of first order.
pub(crate) const CHAIN_ERROR: f64 = 4.0 / 3.0;

/// Error of a mesh over its difference from one 1.5 times as dense. Contact nodes that join and leave make it fall faster than in second order: in nine
/// scenes at density 12 it is 0.85 ± 0.3 of that difference, against a mesh 3.5 times as dense.
pub(crate) const MESH_ERROR: f64 = 1.0;

/// Negligible error, ln of an amplitude; the smallest scatter of a feature is 0.01.
const FELT: f64 = 1e-3;

/// Share of a corrected error that is taken as uncertain.
pub(crate) const LEFT: f64 = 0.5;

/// Discretisation error of each feature, z.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Discrepancy {
    /// Added to every run's features.
    pub shift: Vec<f64>,
    /// Added to the scatter of each feature, in quadrature.
    pub nuggets: Vec<f64>,
    pub pairs: usize,
}

impl Discrepancy {
    pub(crate) fn none(training: &TrainingRuns) -> Self {
        let zero = vec![0.0; training.nuggets.len()];
        Self { shift: zero.clone(), nuggets: zero, pairs: 0 }
    }

    /// Whether any error is significant.
    pub(crate) fn is_felt(&self) -> bool {
        self.shift.iter().chain(&self.nuggets).any(|z| z.abs() > FELT)
    }

    /// Error of the step of a search's runs at a point of the box, with runs numbered from `first`; `None` if there is
    /// no finer step, or if too few runs finish.
    pub(crate) fn of_search(joint: &MultiRecord, at: &[f64], first: u64) -> Option<Self> {
        let points = vec![at.to_vec(); CHAIN_PAIRS];
        let finer = joint.refined()?;
        let (runs, finer) = rayon::join(|| joint.run(first, &points), || finer.run(first, &points));
        Self::of(&runs, &finer, CHAIN_ERROR)
    }

    /// Error of the bodies' mesh on a fidelity level, from the same runs on finer bodies; `None` if too few finish.
    pub(crate) fn of_level(
        fidelity: &FidelityLevel,
        finer: &FidelityLevel,
        at: &[f64],
        first: u64,
    ) -> Result<Option<Self>, Incomplete> {
        let points = vec![at.to_vec(); FIDELITY_PAIRS];
        let upper = |fidelity: &FidelityLevel| -> Result<Vec<Run>, Incomplete> {
            Ok(fidelity.pairs(first, &points)?.into_iter().map(|pair| pair.upper).collect())
        };
        let (runs, finer) = rayon::join(|| upper(fidelity), || upper(finer));
        Ok(Self::of(&runs?, &finer?, MESH_ERROR))
    }

    /// From runs and the same runs at a finer setting.
    pub(crate) fn of(runs: &[Run], finer: &[Run], error: f64) -> Option<Self> {
        let both = runs.iter().zip(finer).filter_map(|(run, finer)| Some((run.features()?, finer.features()?)));
        let apart: Vec<Vec<f64>> =
            both.map(|(run, finer)| finer.iter().zip(run).map(|(finer, run)| finer - run).collect()).collect();
        if apart.len() < FEWEST {
            return None;
        }
        let n = apart.len() as f64;
        let each = |f: usize| {
            let mean = apart.iter().map(|d| d[f]).sum::<f64>() / n;
            let square = apart.iter().map(|d| (d[f] - mean).powi(2)).sum::<f64>() / (n - 1.0) / n;
            let known = if mean == 0.0 { 0.0 } else { mean * mean / (mean * mean + square) };
            let shift = known * error * mean;
            (shift, (known * error * error * square + (LEFT * shift).powi(2)).sqrt())
        };
        let (shift, nuggets) = (0..apart[0].len()).map(each).unzip();
        Some(Self { shift, nuggets, pairs: apart.len() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn runs(features: &[f64]) -> Vec<Run> {
        features.iter().map(|z| Run { position: vec![0.5], outcome: Ok(vec![*z]) }).collect()
    }

    #[test]
    fn an_error_that_all_pairs_show_is_taken_away_and_half_of_it_kept_as_scatter() {
        let found = Discrepancy::of(&runs(&[1.0, 2.0, 3.0, 4.0]), &runs(&[1.02, 2.02, 3.02, 4.02]), 2.0).unwrap();
        assert!((found.shift[0] - 0.04).abs() < 1e-9 && (found.nuggets[0] - 0.02).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn pairs_that_chaos_parts_say_next_to_nothing() {
        // d̄ = 0.05 ± 0.45: κ = 0.012.
        let found = Discrepancy::of(&runs(&[0.0; 4]), &runs(&[1.0, -1.0, 0.6, -0.4]), 1.0).unwrap();
        assert!(found.shift[0].abs() < 1e-3 && found.nuggets[0] < 0.06, "{found:?}");
        assert!(Discrepancy::of(&runs(&[0.0; 3]), &runs(&[0.0; 3]), 1.0).is_none());
    }
}
