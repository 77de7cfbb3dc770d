//! The factor of the coupled step.

use faer::sparse::{
    SparseColMatRef, SymbolicSparseColMatRef,
    linalg::cholesky::{SymmetricOrdering, supernodal::SupernodalLdltRef},
};

use super::{
    ElementsError,
    panel::Panels,
    sparse::{Entries, Sparse},
};
use crate::fea::factor::cholesky::{Failure, ldlt, supernodal};

/// L D Lᵀ of a symmetric quasi-definite matrix [A, Bᵀ; B, −C], A and C positive definite, rows in any order: it exists without pivoting. Held
/// as (L |D|^½) sign D (L |D|^½)ᵀ, so that both halves of a solve are those of the finite elements' Cholesky factors.
///
/// Vanderbei (1995), *SIAM J. Optim.* 5, 100; ordering by approximate minimum degree.
#[derive(Debug, Clone)]
pub(crate) struct QuasiDefinite {
    order: Vec<u32>,
    panels: Panels,
    signs: Vec<f64>,
    work: Vec<f64>,
}

impl QuasiDefinite {
    /// Factor the matrix whose upper triangle (row ≤ column) is `matrix`.
    pub(super) fn new(matrix: &Sparse) -> Result<Self, ElementsError> {
        let unknowns = matrix.rows();
        // The rows of the lower triangle are the columns of the upper one.
        let mut entries = Entries::new();
        for row in 0..unknowns {
            let (columns, values) = matrix.row(row);
            entries.extend(columns.iter().zip(values).map(|(&column, &value)| (column, row as u32, value)));
        }
        let lower = Sparse::new(unknowns, entries);
        let (starts, columns, values) = lower.parts();
        let pattern = SymbolicSparseColMatRef::new_checked(unknowns, unknowns, starts, None, columns);
        let (symbolic, factor) =
            ldlt(SparseColMatRef::new(pattern, values), SymmetricOrdering::Amd).map_err(|failure| match failure {
                Failure::Size(source) => ElementsError::Size { unknowns, source },
                Failure::Pivot(_) => ElementsError::Singular { unknowns },
            })?;
        let order = symbolic.perm().map_or_else(|| (0..unknowns as u32).collect(), |perm| perm.arrays().0.to_vec());
        let pattern = supernodal(&symbolic).ok_or(ElementsError::Singular { unknowns })?;
        let factor = SupernodalLdltRef::new(pattern, &factor);
        let (mut panels, mut signs) = (Panels::default(), Vec::with_capacity(unknowns));
        for supernode in (0..pattern.n_supernodes()).map(|index| factor.supernode(index)) {
            let block = supernode.val();
            let pivots: Vec<f64> = (0..block.ncols()).map(|column| block[(column, column)]).collect();
            if pivots.iter().any(|pivot| !(pivot.abs() > 0.0 && pivot.is_finite())) {
                return Err(ElementsError::Singular { unknowns });
            }
            signs.extend(pivots.iter().map(|pivot| pivot.signum()));
            let roots: Vec<f64> = pivots.iter().map(|pivot| pivot.abs().sqrt()).collect();
            panels.push(supernode.start(), block.ncols(), supernode.pattern(), |row, column| {
                if row == column { roots[column] } else { roots[column] * block[(row, column)] }
            });
        }
        Ok(Self { order, panels, signs, work: vec![0.0; unknowns] })
    }

    /// Entries of L, pivots included: what a solve reads twice.
    pub(crate) fn nonzeros(&self) -> usize {
        self.panels.stored()
    }

    /// x = A⁻¹ x; nothing is allocated.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        let Self { order, panels, signs, work } = self;
        for (work, &place) in work.iter_mut().zip(&*order) {
            *work = x[place as usize];
        }
        panels.forward(work);
        work.iter_mut().zip(signs).for_each(|(work, sign)| *work *= *sign);
        panels.backward(work);
        for (work, &place) in work.iter().zip(&*order) {
            x[place as usize] = *work;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quasi_definite_matrix_is_solved() {
        // A grid's Laplacian above, its negative below, coupled by a bidiagonal block.
        let n = 40_u32;
        let mut entries = Entries::new();
        for k in 0..n {
            for (sign, start) in [(1.0, 0), (-1.0, n)] {
                entries.push((start + k, start + k, sign * (2.0 + 0.1 * f64::from(k))));
                if k + 1 < n {
                    entries.push((start + k, start + k + 1, -sign));
                }
            }
            entries.push((k, n + k, 3.0));
            entries.push((k, n + (k + 5) % n, -0.7));
        }
        let upper = Sparse::new(2 * n as usize, entries.clone());
        let mut factor = QuasiDefinite::new(&upper).unwrap();
        let exact: Vec<f64> = (0..2 * n).map(|k| (0.3 * f64::from(k)).sin()).collect();
        let mut x = vec![0.0; exact.len()];
        for (row, column, value) in entries {
            x[row as usize] += value * exact[column as usize];
            if row != column {
                x[column as usize] += value * exact[row as usize];
            }
        }
        factor.solve(&mut x);
        for (x, exact) in x.iter().zip(&exact) {
            // Rounding times a condition of about 1e2.
            assert!((x - exact).abs() < 1e-13, "{x} {exact}");
        }
    }
}
