//! The features of runs, regressed on parameters and shared unknowns.
//!
//! f = m(u) + B ν + ε, m a cubic in each parameter with products of pairs, ν the shared unknowns in standard deviations, ε what is left: sampling
//! phase, the hit's own velocity, and collisions at the foot that answer to tiny changes.

use nalgebra::{DMatrix, DVector, SMatrix};

use crate::{
    hit::{FEATURES, Features},
    run::{Run, SHARED},
};

pub(crate) type Covariance = SMatrix<f64, FEATURES, FEATURES>;

/// Residual, in robust standard deviations, beyond which a run is left out: another impulse was taken for the returned one.
const OUTLIER: f64 = 4.5;
const TRIMMINGS: usize = 3;

/// Median of |x| over the standard deviation of a normal x.
const NORMAL: f64 = 0.6745;

#[derive(Debug, Clone)]
pub(crate) struct Regression {
    /// Part of the box that the runs cover.
    within: Vec<[f64; 2]>,
    coefficients: DMatrix<f64>,
    /// (X'X)⁻¹.
    inverse: DMatrix<f64>,
    /// Covariance of ε.
    pub scatter: Covariance,
    /// B Bᵀ: covariance of what the hits share.
    pub shared: Covariance,
}

/// What hits at a point show.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Expected {
    pub mean: Features,
    /// Variance of the regression over that of a run, 1.
    pub leverage: f64,
}

/// 1; u, P₂(u), P₃(u) of each parameter over its part of the box; products of pairs.
fn terms(at: &[f64], within: &[[f64; 2]]) -> Vec<f64> {
    let x: Vec<f64> = at.iter().zip(within).map(|(u, [low, high])| 2.0 * (u - low) / (high - low) - 1.0).collect();
    let legendre = |x: &f64| [*x, 0.5 * (3.0 * x * x - 1.0), 0.5 * x * (5.0 * x * x - 3.0)];
    let pairs = (0..x.len()).flat_map(|a| (a + 1..x.len()).map(move |b| (a, b)));
    std::iter::once(1.0).chain(x.iter().flat_map(legendre)).chain(pairs.map(|(a, b)| x[a] * x[b])).collect()
}

impl Regression {
    /// `None` if too few runs finished.
    pub(crate) fn of(runs: &[Run], within: &[[f64; 2]]) -> Option<Self> {
        let inside = |run: &&Run| run.at.iter().zip(within).all(|(u, [low, high])| (*low..=*high).contains(u));
        let mut kept: Vec<(Vec<f64>, Features)> = runs
            .iter()
            .filter(inside)
            .filter_map(|run| Some((terms(&run.at, within), run.nuisance, *run.features.as_ref().ok()?)))
            .map(|(terms, nuisance, features)| (terms.into_iter().chain(nuisance.iter().copied()).collect(), features))
            .collect();
        let mut regression = Self::fitted(&kept, within)?;
        for _ in 0..TRIMMINGS {
            let residuals: Vec<Features> = kept.iter().map(|(x, f)| f - regression.at(x)).collect();
            let deviation = Features::from_fn(|feature, _| {
                let mut sizes: Vec<f64> = residuals.iter().map(|residual| residual[feature].abs()).collect();
                sizes.sort_unstable_by(f64::total_cmp);
                sizes[sizes.len() / 2] / NORMAL
            });
            let count = kept.len();
            let mut near =
                residuals.iter().map(|residual| residual.iter().zip(&deviation).all(|(r, sd)| r.abs() <= OUTLIER * sd));
            kept.retain(|_| near.next().unwrap_or(true));
            if kept.len() == count {
                break;
            }
            regression = Self::fitted(&kept, within)?;
        }
        Some(regression)
    }

    fn fitted(runs: &[(Vec<f64>, Features)], within: &[[f64; 2]]) -> Option<Self> {
        let columns = runs.first()?.0.len();
        let freedom = runs.len().checked_sub(columns + FEATURES).filter(|freedom| *freedom > columns)? as f64;
        let x = DMatrix::from_fn(runs.len(), columns, |run, column| runs[run].0[column]);
        let y = DMatrix::from_fn(runs.len(), FEATURES, |run, feature| runs[run].1[feature]);
        let inverse = (x.transpose() * &x).cholesky()?.inverse();
        let coefficients = &inverse * x.transpose() * &y;
        let residual = y - x * &coefficients;
        let scatter = Covariance::from_fn(|a, b| residual.column(a).dot(&residual.column(b)) / freedom);
        let b = coefficients.rows(columns - SHARED, SHARED);
        let shared = Covariance::from_fn(|i, j| b.column(i).dot(&b.column(j)));
        Some(Self { within: within.to_vec(), coefficients, inverse, scatter, shared })
    }

    fn at(&self, x: &[f64]) -> Features {
        let x = DVector::from_column_slice(x);
        Features::from_fn(|feature, _| self.coefficients.column(feature).dot(&x))
    }

    /// At a point of the box, the shared unknowns at their middle.
    pub(crate) fn expected(&self, at: &[f64]) -> Expected {
        let mut x = terms(at, &self.within);
        x.extend([0.0; SHARED]);
        let vector = DVector::from_column_slice(&x);
        Expected { mean: self.at(&x), leverage: vector.dot(&(&self.inverse * &vector)) }
    }
}
