//! Mean and covariance of a trace near the answer, and the parameters inferred from them.
//!
//! Of n runs with independent draws of gaps and noise, V the traces and z the parameters about the answer, in units of
//! the spread of the runs:
//!
//! V(t) = B₀(t) + J(t) z + z' Q(t) z + R(t),    Σ = σ² I + U U',    U = [R/√(n − k), further columns],
//!
//! k the number of regression coefficients. The further columns are instrument effects that no run contains: a shift
//! in time, its sensitivity, its clock, its coupling, a slow drift, crosstalk. By Woodbury's identity only matrices of
//! the size of U'U are factored.

use faer::{
    Mat, MatRef, Side,
    linalg::solvers::{Llt, Solve},
};

/// Runs of an ensemble, one record: a column of samples each.
pub(super) struct Regression {
    /// Coefficients of every sample, a column each: B₀, J, then Q of every pair of parameters.
    pub coefficients: Mat<f64>,
    /// What is left of every run.
    pub residuals: Mat<f64>,
    /// n − k.
    pub freedom: f64,
}

/// Number of regression coefficients for `dimension` parameters, with or without quadratic terms.
pub(super) fn terms(dimension: usize, quadratic: bool) -> usize {
    1 + dimension + if quadratic { dimension * (dimension + 1) / 2 } else { 0 }
}

/// 1, z, and the products z_i z_j, i ≤ j.
pub(super) fn row(z: &[f64], quadratic: bool) -> Vec<f64> {
    let mut row = vec![1.0];
    row.extend_from_slice(z);
    if quadratic {
        for i in 0..z.len() {
            row.extend((i..z.len()).map(|j| z[i] * z[j]));
        }
    }
    row
}

/// Derivatives of [`row`] with respect to every z.
pub(super) fn slopes(z: &[f64], quadratic: bool) -> Vec<Vec<f64>> {
    let dimension = z.len();
    let slope = |d: usize| {
        let mut slope = vec![0.0; terms(dimension, quadratic)];
        slope[1 + d] = 1.0;
        if quadratic {
            let mut at = 1 + dimension;
            for i in 0..dimension {
                for j in i..dimension {
                    slope[at] = if i == d { z[j] } else { 0.0 } + if j == d { z[i] } else { 0.0 };
                    at += 1;
                }
            }
        }
        slope
    };
    (0..dimension).map(slope).collect()
}

impl Regression {
    /// Regression of traces (a column per run) at the points z; `None` for too few runs.
    pub(crate) fn of(points: &[Vec<f64>], traces: MatRef<'_, f64>, quadratic: bool) -> Option<Self> {
        let (runs, dimension) = (points.len(), points.first()?.len());
        let count = terms(dimension, quadratic);
        if runs < count + 8 {
            return None;
        }
        let rows: Vec<Vec<f64>> = points.iter().map(|z| row(z, quadratic)).collect();
        let design = Mat::from_fn(runs, count, |i, j| rows[i][j]);
        let normal = (design.transpose() * &design).llt(Side::Lower).ok()?;
        // (X'X)⁻¹ X', transposed.
        let projector = normal.solve(design.transpose()).transpose().to_owned();
        let coefficients = traces * &projector;
        let residuals = traces - &coefficients * design.transpose();
        Some(Self { coefficients, residuals, freedom: (runs - count) as f64 })
    }

    /// B₀, J z and the rest together: the mean trace at z.
    pub(crate) fn mean(&self, z: &[f64]) -> Vec<f64> {
        let row = row(z, self.coefficients.ncols() > 1 + z.len());
        let value = |t: usize| row.iter().enumerate().map(|(j, weight)| weight * self.coefficients[(t, j)]).sum();
        (0..self.coefficients.nrows()).map(value).collect()
    }
}

fn divided(rows: MatRef<'_, f64>, by: &[f64]) -> Mat<f64> {
    Mat::from_fn(rows.nrows(), rows.ncols(), |i, j| rows[(i, j)] / by[i])
}

/// Σ = σ² D² + U U' over some samples, factored; D is diagonal. It is kept as σ² I + D⁻¹ U U' D⁻¹.
pub(super) struct Covariance {
    /// D; empty for I.
    louder: Vec<f64>,
    columns: Mat<f64>,
    factor: Llt<f64>,
    variance: f64,
}

impl Covariance {
    /// Of a standard deviation of white noise, D and the columns of U.
    pub(crate) fn of(sigma: f64, louder: Vec<f64>, columns: Mat<f64>) -> Option<Self> {
        let columns = if louder.is_empty() { columns } else { divided(columns.as_ref(), &louder) };
        let variance = sigma * sigma;
        let mut inner = columns.transpose() * &columns;
        for i in 0..inner.nrows() {
            inner[(i, i)] += variance;
        }
        let factor = inner.llt(Side::Lower).ok()?;
        Some(Self { louder, columns, factor, variance })
    }

    /// a' Σ⁻¹ b for all columns of both.
    pub(crate) fn inner(&self, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
        if self.louder.is_empty() {
            return self.inner_of_white(a, b);
        }
        let [a, b] = [a, b].map(|rows| divided(rows, &self.louder));
        self.inner_of_white(a.as_ref(), b.as_ref())
    }

    fn inner_of_white(&self, a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
        let (of_a, of_b) = (self.columns.transpose() * a, self.columns.transpose() * b);
        let plain = a.transpose() * b;
        let taken = of_a.transpose() * self.factor.solve(&of_b);
        let scale = 1.0 / self.variance;
        Mat::from_fn(plain.nrows(), plain.ncols(), |i, j| scale * (plain[(i, j)] - taken[(i, j)]))
    }

    /// Residual of a vector after its most likely amounts of the columns are removed, over D: its white noise.
    pub(crate) fn left(&self, vector: MatRef<'_, f64>) -> Mat<f64> {
        let vector = if self.louder.is_empty() { vector.to_owned() } else { divided(vector, &self.louder) };
        let of_columns = self.columns.transpose() * &vector;
        vector - &self.columns * self.factor.solve(of_columns)
    }

    /// Effective number of directions of the first `count` columns against the noise: tr of U'U (σ² + U'U)⁻¹.
    pub(crate) fn directions(&self, count: usize) -> f64 {
        let size = self.columns.ncols();
        let unit = Mat::from_fn(size, count, |i, j| f64::from(u8::from(i == j)));
        let inverse = self.factor.solve(&unit);
        (0..count).map(|i| 1.0 - self.variance * inverse[(i, i)]).sum()
    }
}

/// Negative log-likelihood of z for a record's samples: ½ φ' M φ with φ = (1, −z, −z z), summed over all records, plus
/// a prior of z.
pub(super) struct Misfit {
    pub gram: Mat<f64>,
    pub dimension: usize,
    pub quadratic: bool,
}

impl Misfit {
    pub(crate) fn phi(&self, z: &[f64]) -> Vec<f64> {
        let mut phi = row(z, self.quadratic);
        phi.iter_mut().skip(1).for_each(|value| *value = -*value);
        phi
    }

    fn times(&self, vector: &[f64]) -> Vec<f64> {
        let sum = |i: usize| vector.iter().enumerate().map(|(j, value)| self.gram[(i, j)] * value).sum();
        (0..self.gram.nrows()).map(sum).collect()
    }

    /// T, twice the cost, at z.
    pub(crate) fn squares(&self, z: &[f64]) -> f64 {
        let phi = self.phi(z);
        dot(&phi, &self.times(&phi))
    }

    fn slopes(&self, z: &[f64]) -> Vec<Vec<f64>> {
        let mut slopes = slopes(z, self.quadratic);
        slopes.iter_mut().flatten().for_each(|value| *value = -*value);
        slopes
    }

    pub(crate) fn gradient(&self, z: &[f64]) -> Vec<f64> {
        let image = self.times(&self.phi(z));
        self.slopes(z).iter().map(|slope| dot(slope, &image)).collect()
    }

    /// J' Σ⁻¹ J at z, prior included.
    pub(crate) fn information(&self, z: &[f64]) -> Vec<Vec<f64>> {
        let slopes = self.slopes(z);
        let images: Vec<Vec<f64>> = slopes.iter().map(|slope| self.times(slope)).collect();
        slopes.iter().map(|slope| images.iter().map(|image| dot(slope, image)).collect()).collect()
    }

    /// Adds prior information on z: a' z has mean `mean` and standard deviation 1.
    pub(crate) fn add_prior(&mut self, a: &[f64], mean: f64) {
        // (mean − a' z)² = φ-form with first entry `mean` and entries a for −z.
        let mut vector = vec![0.0; self.gram.nrows()];
        vector[0] = mean;
        vector[1..=a.len()].copy_from_slice(a);
        for i in 0..vector.len() {
            for j in 0..vector.len() {
                self.gram[(i, j)] += vector[i] * vector[j];
            }
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    fn normal(random: &mut ChaCha8Rng) -> f64 {
        StandardNormal.sample(random)
    }

    #[test]
    fn a_quadratic_mean_is_found_and_what_is_left_is_the_scatter() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let points: Vec<Vec<f64>> = (0..200).map(|_| vec![normal(&mut random), normal(&mut random)]).collect();
        let shape = |t: usize| (t as f64 * 0.3).sin();
        let traces = Mat::from_fn(50, 200, |t, run| {
            let z = &points[run];
            shape(t) + z[0] * (t as f64 * 0.1) - 0.2 * z[1] + 0.05 * z[0] * z[1] * t as f64
        });
        let regression = Regression::of(&points, traces.as_ref(), true).unwrap();
        for t in 0..50 {
            assert!(
                (regression.mean(&[0.5, -0.3])[t] - (shape(t) + 0.05 * t as f64 + 0.06 - 0.0075 * t as f64)).abs()
                    < 1e-9
            );
        }
        assert!((0..200).all(|run| regression.residuals[(7, run)].abs() < 1e-9));
        assert_eq!(regression.freedom, 194.0);
    }

    #[test]
    fn the_inverse_by_woodbury_is_the_inverse() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let columns = Mat::from_fn(6, 3, |_, _| normal(&mut random));
        let sigma = 0.7;
        let full = &columns * columns.transpose() + Mat::from_fn(6, 6, |i, j| if i == j { sigma * sigma } else { 0.0 });
        let (a, b) = (Mat::from_fn(6, 2, |_, _| normal(&mut random)), Mat::from_fn(6, 1, |_, _| normal(&mut random)));
        let direct = a.transpose() * full.llt(Side::Lower).unwrap().solve(&b);
        let covariance = Covariance::of(sigma, vec![], columns.clone()).unwrap();
        let by_woodbury = covariance.inner(a.as_ref(), b.as_ref());
        assert!((0..2).all(|i| (direct[(i, 0)] - by_woodbury[(i, 0)]).abs() < 1e-12));
        // Against no noise three columns cover three directions.
        assert!((Covariance::of(1e-6, vec![], columns).unwrap().directions(3) - 3.0).abs() < 1e-6);
    }

    #[test]
    fn gradient_and_information_are_derivatives_of_the_squares() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let half = Mat::from_fn(9, 6, |_, _| normal(&mut random));
        let mut misfit = Misfit { gram: half.transpose() * &half, dimension: 2, quadratic: true };
        misfit.add_prior(&[2.0, 0.0], 0.3);
        let (z, h) = ([0.4, -0.7], 1e-5);
        for d in 0..2 {
            let moved = |by: f64| {
                let mut z = z;
                z[d] += by;
                0.5 * misfit.squares(&z)
            };
            assert!(((moved(h) - moved(-h)) / (2.0 * h) - misfit.gradient(&z)[d]).abs() < 1e-6);
        }
        let information = misfit.information(&z);
        assert!(information[0][0] > 0.0 && (information[0][1] - information[1][0]).abs() < 1e-12);
        // With no quadratic part the information is the whole second derivative.
        let mut linear =
            Misfit { gram: Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 0.2 }), dimension: 1, quadratic: false };
        linear.add_prior(&[1.0], 0.0);
        assert!((linear.information(&[0.0])[0][0] - 2.0).abs() < 1e-12);
    }
}
