//! The regression at one point of the box.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::{Cloud, SMALLEST_WEIGHT};

/// Factor on the off-diagonals of the residual covariance.
const SHRINKAGE: f64 = 0.4;

/// Ridge on the slopes of the regression, relative to the unit-scaled Gram matrix.
const RIDGE: f64 = 1e-4;

/// Regressors of so many parameters.
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
    /// Effective number of runs.
    pub effective: f64,
    /// Degrees of freedom ν that the regression leaves.
    freedom: f64,
    /// Change of each feature (a column) along each coordinate (a row) over the neighbourhood's radius.
    pub(crate) slopes: DMatrix<f64>,
    pub(crate) records: Vec<Judged>,
}

/// What the features of one record are judged by.
#[derive(Debug, Clone)]
pub(crate) struct Judged {
    pub(crate) features: Range<usize>,
    /// Features that count.
    counted: usize,
    pub(crate) covariance: DMatrix<f64>,
}

impl Cloud {
    /// Regress at `at` over runs at such squared distances, compiled for the widest vectors this machine has: nothing is fused, so every machine finds
    /// the same.
    pub(super) fn regress_over(&self, at: &[f64], order: Vec<(f64, usize)>) -> Option<Local> {
        struct Regression<'a>(&'a Cloud, &'a [f64], Vec<(f64, usize)>);
        impl pulp::NullaryFnOnce for Regression<'_> {
            type Output = Option<Local>;

            #[inline(always)]
            fn call(self) -> Self::Output {
                self.0.regressed(self.1, self.2)
            }
        }
        pulp::Arch::new().dispatch(Regression(self, at, order))
    }

    #[inline(always)]
    fn regressed(&self, at: &[f64], mut order: Vec<(f64, usize)>) -> Option<Local> {
        let dimension = at.len();
        if order.len() < self.neighbours + 1 {
            return None;
        }
        let inside = self.frame.as_ref().map(|(frame, _)| frame.inside(at));
        let at = inside.as_deref().unwrap_or(at);
        let positions = self.measured();
        order.select_nth_unstable_by(self.neighbours, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let radius = order[self.neighbours].0.sqrt();
        if radius <= 0.0 {
            return None;
        }
        order.truncate(self.neighbours);
        order.sort_unstable_by_key(|entry| entry.1);
        let weights: Vec<f64> =
            order.iter().map(|(squared, _)| (1.0 - (squared.sqrt() / radius).powi(3)).powi(3)).collect();
        let total: f64 = weights.iter().sum();
        let effective = total.powi(2) / weights.iter().map(|w| w * w).sum::<f64>();
        let spent = columns_of(dimension).max(3) as f64;
        if effective <= spent + 1.0 {
            return None;
        }
        let columns = columns_of(dimension);
        let features = self.nuggets.len();
        // One run a column: what is summed over runs then lies side by side.
        let regressors = DMatrix::from_fn(columns, order.len(), |a, i| match a {
            0 => 1.0,
            a => (positions[order[i].1][a - 1] - at[a - 1]) / radius,
        });
        let mut gram: DMatrix<f64> = DMatrix::zeros(columns, columns);
        let mut moments: DMatrix<f64> = DMatrix::zeros(features, columns);
        for ((regressor, weight), (_, run)) in regressors.as_slice().chunks(columns).zip(&weights).zip(&order) {
            for (a, (of_a, moments)) in
                regressor.iter().zip(moments.as_mut_slice().chunks_mut(features.max(1))).enumerate()
            {
                let weighted = weight / total * of_a;
                for (b, of_b) in regressor.iter().enumerate() {
                    gram[(a, b)] += weighted * of_b;
                }
                add(moments, [weighted], [&self.deviations[*run]]);
            }
        }
        for a in 1..columns {
            gram[(a, a)] += RIDGE;
        }
        let inverse = Cholesky::new(gram)?.inverse();
        let coefficients: DMatrix<f64> = &inverse * moments.transpose();
        let by_feature = coefficients.transpose();
        let mut residuals = vec![0.0; features * order.len()];
        let rows = residuals.chunks_mut(features.max(1)).zip(regressors.as_slice().chunks(columns)).zip(&order);
        for ((row, regressor), (_, run)) in rows {
            for (of_a, coefficients) in regressor.iter().zip(by_feature.as_slice().chunks(features.max(1))) {
                add(row, [*of_a], [coefficients]);
            }
            row.iter_mut().zip(&self.deviations[*run]).for_each(|(fitted, deviation)| *fitted = deviation - *fitted);
        }
        let shares: Vec<f64> = weights.iter().map(|weight| weight / total).collect();
        let small_sample = effective / (effective - spent);
        let extrapolation = 1.0 + inverse[(0, 0)] / effective;
        let records: Vec<Judged> =
            self.parts.iter().map(|part| self.judge(part, &residuals, &shares, small_sample, extrapolation)).collect();
        let scatter = |record: &Judged| -> Vec<f64> {
            let own = |(f, at): (usize, usize)| (record.covariance[(f, f)] * self.weights[at] / extrapolation).sqrt();
            record.features.clone().enumerate().map(own).collect()
        };
        let scatter = records.iter().flat_map(scatter).collect();
        let deviation = (0..features).map(|f| coefficients[(0, f)]).collect();
        let slopes = coefficients.rows(1, dimension).into_owned();
        Some(Local { deviation, scatter, effective, freedom: effective - spent, slopes, records })
    }

    /// The covariance Σ of one record's features, from the residuals of all runs (one behind the other) and their shares of the weight.
    #[inline(always)]
    fn judge(
        &self,
        part: &Range<usize>,
        residuals: &[f64],
        shares: &[f64],
        small_sample: f64,
        extrapolation: f64,
    ) -> Judged {
        let (first, features) = (part.start, part.len());
        let mut covariance: DMatrix<f64> = DMatrix::zeros(features, features);
        let runs: Vec<&[f64]> = residuals.chunks(self.nuggets.len().max(1)).map(|run| &run[part.clone()]).collect();
        let ((fours, rest), (shares_of_four, shares)) = (runs.as_chunks::<4>(), shares.as_chunks::<4>());
        for (f, sums) in covariance.as_mut_slice().chunks_mut(features.max(1)).enumerate() {
            let sums = &mut sums[..=f];
            for (runs, shares) in fours.iter().zip(shares_of_four) {
                add(sums, std::array::from_fn::<_, 4, _>(|k| shares[k] * runs[k][f]), *runs);
            }
            for (run, share) in rest.iter().zip(shares) {
                add(sums, [share * run[f]], [*run]);
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
        for f in 0..features {
            for g in 0..features {
                covariance[(f, g)] /= (weights[f] * weights[g]).sqrt();
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

/// Add every amount times its values to the sums, one amount after another; at least as many values of each as there are sums.
#[allow(clippy::needless_range_loop, reason = "one index for several lists is what the compiler turns into vectors")]
#[inline(always)]
fn add<const TERMS: usize>(sums: &mut [f64], amounts: [f64; TERMS], values: [&[f64]; TERMS]) {
    let values = values.map(|values| &values[..sums.len()]);
    for (i, sum) in sums.iter_mut().enumerate() {
        for term in 0..TERMS {
            *sum += amounts[term] * values[term][i];
        }
    }
}
