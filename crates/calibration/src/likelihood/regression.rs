//! The regression at one point of the box.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};
use pulp::Simd;

use super::{SMALLEST_WEIGHT, TrainingRuns, tricube};

/// Factor on the off-diagonals of the residual covariance.
const SHRINKAGE: f64 = 0.4;

/// Ridge on the slopes of the regression, relative to the unit-scaled Gram matrix.
const RIDGE: f64 = 1e-4;

/// Features per tile: two vectors of the widest instruction set.
const TILE: usize = 8;

/// Rows of a covariance summed at once, one tile wide, to fit into registers.
const ROWS: usize = 4;

/// Number of regressors for `dimension` parameters.
const fn columns_of(dimension: usize) -> usize {
    dimension + 1
}

/// A local regression at one point.
#[derive(Debug, Clone)]
pub struct Local {
    /// Expected z − z₀ of each feature.
    pub deviation: Vec<f64>,
    /// Residual standard deviation of each feature, nugget included.
    pub scatter: Vec<f64>,
    pub effective: f64,
    /// Degrees of freedom ν that the regression leaves.
    freedom: f64,
    /// Change of each feature (a column) along each coordinate (a row) over the neighbourhood's radius.
    pub(crate) slopes: DMatrix<f64>,
    pub(crate) records: Vec<Judged>,
}

/// Distribution of the features of one record.
#[derive(Debug, Clone)]
pub(crate) struct Judged {
    pub(crate) features: Range<usize>,
    counted: usize,
    pub(crate) covariance: DMatrix<f64>,
}

impl TrainingRuns {
    /// Regression at `at` over runs at these squared distances, compiled for vectors of four; no
    /// operations are fused, so all machines give the same result.
    pub(super) fn regress_over(&self, at: &[f64], squared: &[f64]) -> Option<Local> {
        struct Regression<'a>(&'a TrainingRuns, &'a [f64], &'a [f64]);
        impl pulp::WithSimd for Regression<'_> {
            type Output = Option<Local>;

            #[inline(always)]
            fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
                self.0.regressed(simd, self.1, self.2)
            }
        }
        granchain_signal::vectors::of_four(Regression(self, at, squared))
    }

    #[inline(always)]
    fn regressed<S: Simd>(&self, simd: S, at: &[f64], squared: &[f64]) -> Option<Local> {
        let dimension = at.len();
        let inside = self.frame.as_ref().map(|(frame, _)| frame.inside(at));
        let at = inside.as_deref().unwrap_or(at);
        let positions = self.measured();
        let (radius, order) = nearest(squared, self.neighbours)?;
        let weights: Vec<f64> = order.iter().map(|run| tricube(squared[*run].sqrt() / radius)).collect();
        let total: f64 = weights.iter().sum();
        let effective = total.powi(2) / weights.iter().map(|w| w * w).sum::<f64>();
        let spent = columns_of(dimension).max(3) as f64;
        if effective <= spent + 1.0 {
            return None;
        }
        let columns = columns_of(dimension);
        let features = self.nuggets.len();
        // A row of tiles a run: its regressors, then the features of each record. What is summed over runs lies side by side.
        let mut firsts = vec![columns.div_ceil(TILE)];
        for part in &self.parts {
            firsts.push(firsts[firsts.len() - 1] + part.len().div_ceil(TILE));
        }
        let (of_regressors, tiles) = (firsts[0], firsts[self.parts.len()]);
        let mut rows = vec![[0.0; TILE]; order.len() * tiles];
        for (row, run) in rows.chunks_exact_mut(tiles).zip(&order) {
            let regressors = row.as_flattened_mut();
            regressors[0] = 1.0;
            for d in 0..dimension {
                regressors[1 + d] = (positions[*run][d] - at[d]) / radius;
            }
            for (part, first) in self.parts.iter().zip(&firsts) {
                row[*first..].as_flattened_mut()[..part.len()].copy_from_slice(&self.deviations[*run][part.clone()]);
            }
        }
        let shares: Vec<f64> = weights.iter().map(|weight| weight / total).collect();
        let mut moments = vec![[0.0; TILE]; columns * tiles];
        for (row, share) in rows.chunks_exact(tiles).zip(&shares) {
            for (moments, regressor) in moments.chunks_exact_mut(tiles).zip(row.as_flattened()) {
                add(moments, share * regressor, row);
            }
        }
        let gram = DMatrix::from_fn(columns, columns, |a, b| {
            moments[a * tiles..].as_flattened()[b] + if a == b && a > 0 { RIDGE } else { 0.0 }
        });
        let inverse = Cholesky::new(gram)?.inverse();
        let mut coefficients = vec![[0.0; TILE]; columns * tiles];
        for (a, coefficients) in coefficients.chunks_exact_mut(tiles).enumerate() {
            for (b, moments) in moments.chunks_exact(tiles).enumerate() {
                add(&mut coefficients[of_regressors..], inverse[(a, b)], &moments[of_regressors..]);
            }
        }
        for row in rows.chunks_exact_mut(tiles) {
            let (regressors, row) = row.split_at_mut(of_regressors);
            for (t, tile) in row.iter_mut().enumerate() {
                let mut fitted = [0.0; TILE];
                for (coefficients, regressor) in coefficients.chunks_exact(tiles).zip(regressors.as_flattened()) {
                    fitted = added(fitted, *regressor, coefficients[of_regressors + t]);
                }
                for i in 0..TILE {
                    tile[i] -= fitted[i];
                }
            }
        }
        let small_sample = effective / (effective - spent);
        let extrapolation = 1.0 + inverse[(0, 0)] / effective;
        let mut records = Vec::with_capacity(self.parts.len());
        for (part, first) in self.parts.iter().zip(&firsts) {
            let residuals = rows.chunks_exact(tiles).map(|row| &row[*first..]);
            records.push(self.judge(simd, part, residuals.zip(&shares), small_sample, extrapolation));
        }
        let scatter = |record: &Judged| -> Vec<f64> {
            let own = |(f, at): (usize, usize)| (record.covariance[(f, f)] * self.weights[at] / extrapolation).sqrt();
            record.features.clone().enumerate().map(own).collect()
        };
        let scatter = records.iter().flat_map(scatter).collect();
        let of_row = |a: usize| {
            let row = coefficients[a * tiles..].as_flattened();
            self.parts.iter().zip(&firsts).flat_map(move |(part, first)| &row[first * TILE..][..part.len()]).copied()
        };
        let deviation = of_row(0).collect();
        let slopes = DMatrix::from_row_iterator(dimension, features, (1..columns).flat_map(of_row));
        Some(Local { deviation, scatter, effective, freedom: effective - spent, slopes, records })
    }

    /// The covariance Σ of one record's features, from the residuals of all runs and their shares of the weight.
    #[inline(always)]
    fn judge<'a, S: Simd>(
        &self,
        simd: S,
        part: &Range<usize>,
        residuals: impl Iterator<Item = (&'a [[f64; TILE]], &'a f64)> + Clone,
        small_sample: f64,
        extrapolation: f64,
    ) -> Judged {
        let (first, features) = (part.start, part.len());
        let mut covariance: DMatrix<f64> = DMatrix::zeros(features, features);
        const { assert!(2 * S::F64_LANES <= TILE) };
        let width = 2 * S::F64_LANES;
        for f in (0..features).step_by(ROWS) {
            for g in (0..features.min(f + ROWS)).step_by(width) {
                let mut sums = [[simd.splat_f64s(0.0); 2]; ROWS];
                for (residuals, share) in residuals.clone() {
                    let residuals = residuals.as_flattened();
                    let (of_f, of_g) = (&residuals[f..f + ROWS], S::as_simd_f64s(&residuals[g..g + width]).0);
                    for (sums, of_f) in sums.iter_mut().zip(of_f) {
                        let amount = simd.splat_f64s(share * of_f);
                        for (sum, of_g) in sums.iter_mut().zip(of_g) {
                            *sum = simd.add_f64s(*sum, simd.mul_f64s(amount, *of_g));
                        }
                    }
                }
                for (f, sums) in (f..features).zip(&sums) {
                    let sums: &[f64] = pulp::bytemuck::cast_slice(sums);
                    for (g, sum) in (g..features).zip(sums) {
                        covariance[(g, f)] = *sum;
                    }
                }
            }
        }
        for f in 0..features {
            for g in 0..f {
                let shrunk = covariance[(g, f)] * SHRINKAGE * small_sample * extrapolation;
                covariance[(f, g)] = shrunk;
                covariance[(g, f)] = shrunk;
            }
            let own = (covariance[(f, f)] * small_sample + self.nuggets[first + f].powi(2)) * extrapolation;
            covariance[(f, f)] = own * (1.0 + self.inflation[first + f]);
        }
        let (sensitivity, answers) = &self.sensitivity;
        if *sensitivity > 0.0 {
            for f in 0..features {
                for g in 0..features {
                    covariance[(f, g)] += sensitivity.powi(2) * answers[first + f] * answers[first + g];
                }
            }
        }
        let weights = &self.weights[part.clone()];
        if weights.iter().any(|weight| *weight != 1.0) {
            for f in 0..features {
                for g in 0..features {
                    covariance[(f, g)] /= (weights[f] * weights[g]).sqrt();
                }
            }
        }
        let counted = weights.iter().filter(|weight| **weight > SMALLEST_WEIGHT).count();
        Judged { features: part.clone(), counted, covariance }
    }
}

impl Local {
    /// Sum over records of the Student-t log-density of each.
    pub(super) fn log_likelihood(self) -> f64 {
        let freedom = self.freedom;
        let mut sum = 0.0;
        for Judged { features, counted, covariance } in self.records {
            let deviation = DVector::from_column_slice(&self.deviation[features]);
            let features = counted as f64;
            let Some(factor) = Cholesky::new(covariance) else { return f64::NEG_INFINITY };
            let mahalanobis = deviation.dot(&factor.solve(&deviation));
            let half_log_determinant: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
            sum += libm::lgamma(0.5 * (freedom + features))
                - libm::lgamma(0.5 * freedom)
                - 0.5 * features * (freedom * std::f64::consts::PI).ln()
                - half_log_determinant
                - 0.5 * (freedom + features) * (mahalanobis / freedom).ln_1p();
        }
        sum
    }
}

/// Sums plus `amount` times `values`.
#[inline(always)]
fn added(mut sums: [f64; TILE], amount: f64, values: [f64; TILE]) -> [f64; TILE] {
    for i in 0..TILE {
        sums[i] += amount * values[i];
    }
    sums
}

/// The same, tile by tile.
#[inline(always)]
fn add(sums: &mut [[f64; TILE]], amount: f64, values: &[[f64; TILE]]) {
    for (sums, values) in sums.iter_mut().zip(values) {
        *sums = added(*sums, amount, *values);
    }
}

/// Distance of the run after the `count` nearest, and those runs by number; of equal distances the lowest numbers are
/// taken. `None` if there are too few runs, or if a distance is not finite.
#[inline(always)]
fn nearest(squared: &[f64], count: usize) -> Option<(f64, Vec<usize>)> {
    let mut parted = squared.to_vec();
    if parted.len() <= count {
        return None;
    }
    let (nearer, &mut radius, _) = parted.select_nth_unstable_by(count, f64::total_cmp);
    let mut as_far = nearer.iter().filter(|squared| **squared == radius).count();
    let mut nearest = Vec::with_capacity(count);
    for (run, squared) in squared.iter().enumerate() {
        if *squared < radius {
            nearest.push(run);
        } else if *squared == radius && as_far > 0 {
            as_far -= 1;
            nearest.push(run);
        }
    }
    (radius > 0.0 && radius.is_finite()).then(|| (radius.sqrt(), nearest))
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn of_runs_as_far_as_the_last_the_first_are_the_nearest() {
        assert_eq!(nearest(&[4.0, 1.0, 9.0, 4.0, 4.0, 16.0], 3), Some((2.0, vec![0, 1, 3])));
        assert_eq!(nearest(&[4.0, 1.0, 9.0], 3), None);
        // A run left out is infinitely far, and what stands on the point has no distance.
        assert_eq!(nearest(&[4.0, f64::INFINITY], 1), None);
        assert_eq!(nearest(&[0.0; 3], 2), None);
    }

    #[test]
    fn covariances_are_those_of_a_weighted_regression_matrix_by_matrix() {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut draw = |count: usize| -> Vec<f64> { (0..count).map(|_| random.random::<f64>() - 0.5).collect() };
        // Two records: one of fewer features than stand side by side, one of more.
        let counts = [3, 11];
        let runs: Vec<(Vec<f64>, Vec<f64>)> = (0..60).map(|_| (draw(2), draw(14))).collect();
        let pairs = runs.iter().map(|(at, z)| (at.as_slice(), z.as_slice()));
        let training = TrainingRuns::new(pairs, &[0.1; 14], &[0.0; 14], &[1.0; 14], 40).parted(&counts);
        let local = training.regress(&[0.0; 2]).unwrap();

        let distance = |run: usize| runs[run].0[0].hypot(runs[run].0[1]);
        let mut order: Vec<usize> = (0..60).collect();
        order.sort_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        let (radius, order) = (distance(order[40]), &order[..40]);
        let weights = DVector::from_fn(40, |i, _| (1.0 - (distance(order[i]) / radius).powi(3)).powi(3));
        let shares = DMatrix::from_diagonal(&(&weights / weights.sum()));
        let regressors = DMatrix::from_fn(40, 3, |i, a| if a == 0 { 1.0 } else { runs[order[i]].0[a - 1] / radius });
        let features = DMatrix::from_fn(40, 14, |i, f| runs[order[i]].1[f] - 0.1);
        let mut gram = regressors.transpose() * &shares * &regressors;
        (1..3).for_each(|a| gram[(a, a)] += RIDGE);
        let inverse = gram.try_inverse().unwrap();
        let coefficients = &inverse * regressors.transpose() * &shares * &features;
        let residuals = features - regressors * &coefficients;
        let effective = weights.sum().powi(2) / weights.norm_squared();
        let factor = effective / (effective - 3.0) * (1.0 + inverse[(0, 0)] / effective);
        let expected = residuals.transpose() * shares * residuals * factor;
        for (record, first) in local.records.iter().zip([0, 3]) {
            for f in 0..record.features.len() {
                for g in 0..record.features.len() {
                    let expected = expected[(first + f, first + g)] * if f == g { 1.0 } else { SHRINKAGE };
                    assert!((record.covariance[(f, g)] - expected).abs() < 1e-12, "{first} {f} {g}");
                }
            }
        }
        for f in 0..14 {
            assert!((local.deviation[f] - coefficients[(0, f)]).abs() < 1e-12);
            assert!((0..2).all(|d| (local.slopes[(d, f)] - coefficients[(1 + d, f)]).abs() < 1e-12));
        }
    }
}
