//! Regression synthetic likelihood: the likelihood of a point of the box, from all runs.
//!
//! Near a point x the features z of the k nearest runs are regressed, locally linearly, on the parameters. The
//! regression's value at x is the expected fingerprint. Its residuals are the run-to-run scatter (chaos, noise and
//! nuisances, which every run draws again). The record's z₀ is then judged by a multivariate Student t:
//!
//! SL(x) = ln t_ν(z₀; z̄(x), Σ(x)),  Σ = C · n/ν · (1 + (G⁻¹)₀₀/n),  ν = n − max(3, p + 1),
//!
//! with p the number of parameters, n = (Σw)²/Σw² the effective number of runs under tricube weights w, C the weighted
//! residual covariance with its off-diagonals shrunk by 0.4 and a nugget² on its diagonal, G the weighted Gram matrix
//! of the regressors (1, x − x₀).
//!
//! Runs without features (motion that stays below the record's threshold, or begins too late) are part of the
//! likelihood too: ln P(x)/β is added to SL, P the share of finished runs among the k nearest of all, under the same
//! weights, since the record has features.
//!
//! Several records have independent runs at a given x, so SL is the sum over the records (`TrainingRuns::parted`).
//!
//! After S. N. Wood, *Nature* 466 (2010) 1102. The regression in place of replicates, k, the shrinkage and the
//! tempering exponent β of [`super::posterior`] were tuned on synthetic records, see `docs/method.md`.

mod regression;

use std::ops::Range;

pub(super) use self::regression::Judged;
pub use self::regression::Local;
use super::frame::Frame;

/// Neighbours k of a local regression on one or two parameters.
pub(crate) const NEIGHBOURS: usize = 40;

/// Neighbours k of a local regression on `dimension` parameters: more parameters need more neighbours.
pub(crate) const fn neighbours(dimension: usize) -> usize {
    match dimension {
        0..=2 => NEIGHBOURS,
        3 => 60,
        _ => 80,
    }
}

/// Replaces a weight of zero.
const SMALLEST_WEIGHT: f64 = 1e-12;

/// Finished runs, prepared for the regression.
#[derive(Debug, Clone)]
pub(crate) struct TrainingRuns {
    positions: Vec<Vec<f64>>,
    deviations: Vec<Vec<f64>>,
    /// Positions of the runs without features, in the coordinates for distances.
    lost: Vec<Vec<f64>>,
    /// Smallest scatter allowed to each feature.
    pub(super) nuggets: Vec<f64>,
    weights: Vec<f64>,
    /// Features of each record, in order.
    parts: Vec<Range<usize>>,
    neighbours: usize,
    /// Tempering exponent β of the likelihood.
    pub(super) power: f64,
    domain: Option<(Vec<f64>, Vec<f64>)>,
    /// Frame for distances, and the runs in it; `None`: the unit box.
    pub(super) frame: Option<(Frame, Vec<Vec<f64>>)>,
    /// γ² of each feature: added variance relative to its own, for features that no run reproduces.
    inflation: Vec<f64>,
    /// Standard deviation of ln of a record's amplitude factor, and the response of each feature to it.
    sensitivity: (f64, Vec<f64>),
}

impl TrainingRuns {
    /// Runs (unit coordinates, fingerprint) to be judged against `observed`; `weights` w divide the covariance of features
    /// f and g by √(w_f w_g).
    pub(crate) fn new<'a>(
        runs: impl Iterator<Item = (&'a [f64], &'a [f64])>,
        observed: &[f64],
        nuggets: &[f64],
        weights: &[f64],
        neighbours: usize,
    ) -> Self {
        let mut training = Self {
            positions: vec![],
            deviations: vec![],
            lost: vec![],
            nuggets: nuggets.to_vec(),
            weights: weights.iter().map(|weight| weight.max(SMALLEST_WEIGHT)).collect(),
            parts: std::iter::once(0..nuggets.len()).collect(),
            neighbours,
            power: super::posterior::POWER,
            domain: None,
            frame: None,
            inflation: vec![0.0; nuggets.len()],
            sensitivity: (0.0, vec![0.0; nuggets.len()]),
        };
        for (position, features) in runs {
            training.positions.push(position.to_vec());
            training.deviations.push(features.iter().zip(observed).map(|(z, z0)| z - z0).collect());
        }
        training
    }

    /// The same with the positions of runs without features.
    #[must_use]
    pub(crate) fn losing<'a>(mut self, runs: impl Iterator<Item = &'a [f64]>) -> Self {
        self.lost = runs.map(<[f64]>::to_vec).collect();
        self
    }

    /// The same with another tempering exponent β.
    #[must_use]
    pub(crate) fn tempered(mut self, power: f64) -> Self {
        self.power = power;
        self
    }

    /// The same with the model's discretisation error: `shift` is added to every run's features, `nuggets` to their
    /// scatter.
    #[must_use]
    pub(crate) fn corrected(mut self, shift: &[f64], nuggets: &[f64]) -> Self {
        for deviation in &mut self.deviations {
            deviation.iter_mut().zip(shift).for_each(|(deviation, shift)| *deviation += shift);
        }
        self.nuggets.iter_mut().zip(nuggets).for_each(|(own, more)| *own = own.hypot(*more));
        self
    }

    /// The same with the variance of each feature 1 + γ² times as large.
    #[must_use]
    pub(crate) fn inflated(mut self, inflation: Vec<f64>) -> Self {
        self.inflation = inflation;
        self
    }

    /// The same with an unknown factor on all amplitudes of a record (`deviation`: standard deviation in ln;
    /// `answers`: response of each feature). This is exact; a factor drawn in the runs would be lost when the
    /// off-diagonals are shrunk.
    #[must_use]
    pub(crate) fn scaled(mut self, deviation: f64, answers: Vec<f64>) -> Self {
        self.sensitivity = (deviation, answers);
        self
    }

    /// The same with features of several records: `counts` gives their numbers, which sum to all features.
    #[must_use]
    pub(crate) fn parted(mut self, counts: &[usize]) -> Self {
        let mut end = 0;
        let part = |count: &usize| {
            end += count;
            end - count..end
        };
        self.parts = counts.iter().map(part).collect();
        self
    }

    pub(crate) fn records(&self) -> usize {
        self.parts.len()
    }

    /// Range of the features of record `record`.
    pub(crate) fn part(&self, record: usize) -> Range<usize> {
        self.parts[record].clone()
    }

    /// The same runs, judged by record `record` alone.
    #[must_use]
    pub(crate) fn of_record(&self, record: usize) -> Self {
        let part = self.part(record);
        Self {
            positions: self.positions.clone(),
            deviations: self.deviations.iter().map(|deviation| deviation[part.clone()].to_vec()).collect(),
            // It is not known which record a run has no features for.
            lost: vec![],
            nuggets: self.nuggets[part.clone()].to_vec(),
            weights: self.weights[part.clone()].to_vec(),
            parts: std::iter::once(0..part.len()).collect(),
            neighbours: self.neighbours,
            power: self.power,
            domain: self.domain.clone(),
            inflation: self.inflation[part.clone()].to_vec(),
            sensitivity: (self.sensitivity.0, self.sensitivity.1[part.clone()].to_vec()),
            // What one record leaves open is wider than the frame of all.
            frame: None,
        }
    }

    /// The same, distances measured in a frame.
    #[must_use]
    pub(crate) fn framed(mut self, frame: Frame) -> Self {
        let inside = self.positions.iter().map(|position| frame.inside(position)).collect();
        self.lost.iter_mut().for_each(|position| *position = frame.inside(position));
        self.frame = Some((frame, inside));
        self
    }

    /// The same, restricted to a region between two corners of the unit box: outside it the likelihood is 0.
    #[must_use]
    pub(crate) fn within(mut self, low: Vec<f64>, high: Vec<f64>) -> Self {
        self.domain = Some((low, high));
        self
    }

    pub(crate) fn domain(&self, dimension: usize) -> (Vec<f64>, Vec<f64>) {
        self.domain.clone().unwrap_or_else(|| (vec![0.0; dimension], vec![1.0; dimension]))
    }

    pub(crate) fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are no runs.
    pub(crate) fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Squared distance of every run from `at`, in the frame if there is one.
    fn distances(&self, at: &[f64]) -> Vec<f64> {
        self.distances_of(self.measured(), at)
    }

    fn distances_of(&self, positions: &[Vec<f64>], at: &[f64]) -> Vec<f64> {
        let inside = self.frame.as_ref().map(|(frame, _)| frame.inside(at));
        let at = inside.as_deref().unwrap_or(at);
        let squared = |position: &Vec<f64>| position.iter().zip(at).map(|(a, b)| (a - b).powi(2)).sum();
        positions.iter().map(squared).collect()
    }

    /// Share of finished runs among the nearest of all, where `squared` are the distances of the finished ones. A run
    /// of half the largest weight is added to both, so that it is above 0.
    fn finished_share(&self, at: &[f64], squared: &[f64]) -> f64 {
        if self.lost.is_empty() {
            return 1.0;
        }
        let lost = self.distances_of(&self.lost, at);
        let mut all = [squared, &lost].concat();
        let last = self.neighbours.min(all.len() - 1);
        let radius = all.select_nth_unstable_by(last, f64::total_cmp).1.sqrt().max(f64::MIN_POSITIVE);
        let weight = |squared: &f64| tricube((squared.sqrt() / radius).min(1.0));
        let [finished, lost] = [squared, &lost].map(|runs| runs.iter().map(weight).sum::<f64>());
        (finished + 0.5) / (finished + lost + 0.5)
    }

    /// Positions in the coordinates for distances.
    fn measured(&self) -> &[Vec<f64>] {
        self.frame.as_ref().map_or(&self.positions, |(_, inside)| inside)
    }

    /// The runs nearest to a point, nearest first.
    pub(crate) fn nearest(&self, at: &[f64], count: usize) -> Vec<usize> {
        let squared = self.distances(at);
        let mut order: Vec<usize> = (0..squared.len()).collect();
        order.sort_by(|a, b| squared[*a].total_cmp(&squared[*b]));
        order.truncate(count);
        order
    }

    /// Regress at the point `at`; `None` with too few runs or a degenerate neighbourhood.
    pub(crate) fn regress(&self, at: &[f64]) -> Option<Local> {
        self.regress_over(at, &self.distances(at))
    }

    /// The regression at a run's position without that run: the run's deviation from it, and the regression.
    pub(crate) fn regress_leaving(&self, run: usize) -> Option<(&[f64], Local)> {
        let at = &self.positions[run];
        let mut squared = self.distances(at);
        squared[run] = f64::INFINITY;
        Some((&self.deviations[run], self.regress_over(at, &squared)?))
    }

    /// SL at a point; −∞ if a regression is impossible.
    pub(crate) fn log_likelihood(&self, at: &[f64]) -> f64 {
        if let Some((low, high)) = &self.domain
            && !at.iter().zip(low.iter().zip(high)).all(|(u, (low, high))| (*low..=*high).contains(u))
        {
            return f64::NEG_INFINITY;
        }
        let squared = self.distances(at);
        let known = || self.finished_share(at, &squared).ln() / self.power;
        self.regress_over(at, &squared).map_or(f64::NEG_INFINITY, |local| local.log_likelihood() + known())
    }

    /// Misfit of each run: mean over features of min(|z − z₀|/s, 5)², s the scatter.
    pub(crate) fn misfits(&self, scatter: &[f64]) -> Vec<f64> {
        let total: f64 = self.weights.iter().sum();
        self.deviations
            .iter()
            .map(|deviation| misfit(deviation.iter().copied(), scatter, &self.weights, total))
            .collect()
    }

    /// Standard deviation of each feature over all runs, nugget included: the scatter before any regression.
    pub(crate) fn spread(&self) -> Vec<f64> {
        let count = self.len().max(1) as f64;
        (0..self.nuggets.len())
            .map(|f| {
                let mean = self.deviations.iter().map(|d| d[f]).sum::<f64>() / count;
                let variance = self.deviations.iter().map(|d| (d[f] - mean).powi(2)).sum::<f64>() / count;
                (variance + self.nuggets[f].powi(2)).sqrt()
            })
            .collect()
    }

    /// Distance from a run to its `rank`-th nearest other run, in unit coordinates.
    pub(crate) fn spacing(&self, run: usize, rank: usize) -> f64 {
        let mut distances: Vec<f64> = (0..self.len())
            .filter(|&other| other != run)
            .map(|other| {
                let squared: f64 =
                    self.positions[other].iter().zip(&self.positions[run]).map(|(a, b)| (a - b).powi(2)).sum();
                squared.sqrt()
            })
            .collect();
        distances.sort_unstable_by(f64::total_cmp);
        distances.get(rank.saturating_sub(1)).copied().unwrap_or(0.5)
    }

    pub(crate) fn position(&self, run: usize) -> &[f64] {
        &self.positions[run]
    }
}

/// Weight of a run at a distance, over that of the farthest neighbour.
fn tricube(distance: f64) -> f64 {
    (1.0 - distance.powi(3)).powi(3)
}

/// Mean of min(|z − z₀|/s, 5)² over features, by their weights, of which `total` is the sum.
pub(super) fn misfit(deviations: impl Iterator<Item = f64>, scatter: &[f64], weights: &[f64], total: f64) -> f64 {
    let each = deviations.zip(scatter).map(|(deviation, s)| (deviation.abs() / s).min(5.0).powi(2));
    each.zip(weights).map(|(misfit, weight)| misfit * weight).sum::<f64>() / total
}

#[cfg(test)]
pub(super) mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Runs whose features are linear in the position with normal scatter: the regression must find both.
    pub(in super::super) fn linear_training(scatter: f64) -> (TrainingRuns, [f64; 2]) {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let truth = [0.4, 0.6];
        let features = |at: &[f64]| [2.0 * at[0] - at[1], at[0] + 3.0 * at[1]];
        let runs: Vec<(Vec<f64>, Vec<f64>)> = (0..600)
            .map(|_| {
                let at = vec![random.random::<f64>(), random.random::<f64>()];
                let z = features(&at)
                    .map(|value| {
                        let draw: f64 = StandardNormal.sample(&mut random);
                        value + scatter * draw
                    })
                    .to_vec();
                (at, z)
            })
            .collect();
        let pairs = runs.iter().map(|(at, z)| (at.as_slice(), z.as_slice()));
        (TrainingRuns::new(pairs, &features(&truth), &[1e-3; 2], &[1.0; 2], NEIGHBOURS), truth)
    }

    #[test]
    fn the_regression_is_exact_for_features_linear_in_the_parameters() {
        let (training, truth) = linear_training(0.0);
        let local = training.regress(&truth).unwrap();
        // The ridge of 1e-4 is all that is between the fit and the truth.
        assert!(local.deviation.iter().all(|deviation| deviation.abs() < 1e-4), "{:?}", local.deviation);
        assert!(local.scatter.iter().all(|scatter| (scatter - 1e-3).abs() < 1e-4), "{:?}", local.scatter);
    }

    #[test]
    fn runs_without_features_count_by_their_share() {
        let (whole, truth) = linear_training(0.05);
        // Of runs that lie alike, one for every one with features: ln ½, untempered, on both sides of that half of the box.
        let lost: Vec<Vec<f64>> = whole.positions.iter().filter(|at| at[0] < 0.5).cloned().collect();
        let training = whole.clone().losing(lost.iter().map(Vec::as_slice));
        let change = |at: &[f64]| training.power * (training.log_likelihood(at) - whole.log_likelihood(at));
        // 40 neighbours: the ends of the weights and the half run added leave a twentieth.
        assert!((change(&[0.25, 0.5]) - 0.5f64.ln()).abs() < 0.05, "{}", change(&[0.25, 0.5]));
        assert_eq!(change(&[0.9, 0.5]), 0.0);
        assert_eq!(whole.clone().losing(std::iter::empty()).log_likelihood(&truth), whole.log_likelihood(&truth));
    }

    #[test]
    fn the_scatter_of_a_single_run_is_recovered() {
        let (training, truth) = linear_training(0.05);
        let local = training.regress(&truth).unwrap();
        // A standard deviation from about 26 effective runs is good to 1/√52 = 14 %; three of that.
        assert!(local.scatter.iter().all(|scatter| (scatter / 0.05 - 1.0).abs() < 0.42), "{:?}", local.scatter);
    }

    #[test]
    fn the_likelihood_is_largest_near_the_truth_and_falls_away_from_it() {
        let (training, truth) = linear_training(0.05);
        let at = |x: f64, y: f64| training.log_likelihood(&[x, y]);
        let best = at(truth[0], truth[1]);
        for (x, y) in [(0.6, 0.6), (0.2, 0.6), (0.4, 0.8), (0.4, 0.4)] {
            assert!(best > at(x, y) + 3.0, "({x}, {y})");
        }
    }

    #[test]
    fn a_feature_of_weight_zero_says_nothing() {
        let (training, truth) = linear_training(0.05);
        let mut blind = training.clone();
        blind.weights = vec![1.0, SMALLEST_WEIGHT];
        // Along 2x − y = const the first feature does not change.
        let along = [truth[0] + 0.1, truth[1] + 0.2];
        let change =
            |training: &TrainingRuns| (training.log_likelihood(&along) - training.log_likelihood(&truth)).abs();
        assert!(change(&training) > 5.0 && change(&blind) < 1.5, "{} {}", change(&training), change(&blind));
    }

    #[test]
    fn records_that_share_the_parameters_add_their_likelihoods() {
        let (training, truth) = linear_training(0.05);
        let joint = training.clone().parted(&[1, 1]);
        for at in [truth, [0.45, 0.55], [0.3, 0.7]] {
            let alone: f64 = (0..2).map(|record| joint.of_record(record).log_likelihood(&at)).sum();
            assert!((joint.log_likelihood(&at) - alone).abs() < 1e-9 * alone.abs(), "{at:?}");
        }
        // One part is the whole: not a bit differs.
        assert_eq!(training.clone().parted(&[2]).log_likelihood(&truth), training.log_likelihood(&truth));
        // 2x − y alone says nothing along its own ridge, x + 3y crosses it.
        let along = [truth[0] + 0.1, truth[1] + 0.2];
        let fall = |training: &TrainingRuns| training.log_likelihood(&truth) - training.log_likelihood(&along);
        assert!(
            fall(&joint.of_record(0)).abs() < 1.5 && fall(&joint) > 5.0,
            "{} {}",
            fall(&joint.of_record(0)),
            fall(&joint)
        );
    }
}
