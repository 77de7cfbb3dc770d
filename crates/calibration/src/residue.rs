//! Residual after the fit: the part of a deviation that a change of the parameters cannot remove.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::likelihood::{Judged, Local};

/// Residual of a deviation after a change of the parameters.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Residue {
    /// r/σ of each feature, σ the run-to-run standard deviation.
    pub pulls: Vec<f64>,
    /// rᵀ Σ⁻¹ r of each record.
    pub squares: Vec<f64>,
}

impl Local {
    /// Residual of a deviation (z − z₀ of a run or record, or between two) after the parameters have moved by δ radii
    /// of the neighbourhood such that Σ_r rᵀ Σ⁻¹ r + |δ|² is least, r = deviation + Sδ.
    pub(crate) fn residue(&self, deviation: &[f64]) -> Option<Residue> {
        let dimension = self.slopes.nrows();
        let factors: Vec<_> =
            self.records.iter().map(|record| Cholesky::new(record.covariance.clone())).collect::<Option<_>>()?;
        let of = |record: &Judged| {
            let slopes = self.slopes.columns(record.features.start, record.features.len()).transpose();
            (slopes, DVector::from_column_slice(&deviation[record.features.clone()]))
        };
        let mut normal: DMatrix<f64> = DMatrix::identity(dimension, dimension);
        let mut right: DVector<f64> = DVector::zeros(dimension);
        for (record, factor) in self.records.iter().zip(&factors) {
            let (slopes, deviation) = of(record);
            normal += slopes.transpose() * factor.solve(&slopes);
            right -= slopes.transpose() * factor.solve(&deviation);
        }
        let moved = Cholesky::new(normal)?.solve(&right);
        let mut pulls = vec![0.0; deviation.len()];
        let mut squares = Vec::with_capacity(self.records.len());
        for (record, factor) in self.records.iter().zip(&factors) {
            let (slopes, deviation) = of(record);
            let left = deviation + slopes * &moved;
            for (f, at) in record.features.clone().enumerate() {
                pulls[at] = left[f] / record.covariance[(f, f)].sqrt();
            }
            squares.push(left.dot(&factor.solve(&left)));
        }
        Some(Residue { pulls, squares })
    }

    /// Factor of the first record's amplitudes over the expected ones, by generalised least squares; `answers` is the
    /// response of each feature to its logarithm.
    pub(crate) fn factor(&self, answers: &[f64]) -> Option<f64> {
        let record = self.records.first()?;
        let factor = Cholesky::new(record.covariance.clone())?;
        let answers = DVector::from_column_slice(answers.get(record.features.clone())?);
        let deviation = DVector::from_column_slice(&self.deviation[record.features.clone()]);
        let weighed = factor.solve(&answers);
        Some((-weighed.dot(&deviation) / weighed.dot(&answers)).exp())
    }
}
