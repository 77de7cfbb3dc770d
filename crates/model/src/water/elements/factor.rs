//! The factor of the coupled step.

use std::{mem::MaybeUninit, sync::Arc};

use faer::{
    ColMut, Conj, Par,
    dyn_stack::MemStack,
    sparse::{
        SparseColMatRef, SymbolicSparseColMatRef,
        linalg::cholesky::{LdltRef, SymbolicCholesky, SymmetricOrdering},
    },
};

use super::{
    ElementsError,
    sparse::{Entries, Sparse},
};
use crate::fea::factor::cholesky::{Failure, ldlt};

/// L D Lᵀ of a symmetric quasi-definite matrix [A, Bᵀ; B, −C], A and C positive definite, rows in any order: it exists without pivoting.
///
/// Vanderbei (1995), *SIAM J. Optim.* 5, 100; ordering by approximate minimum degree.
#[derive(Debug, Clone)]
pub(crate) struct QuasiDefinite {
    symbolic: Arc<SymbolicCholesky<u32>>,
    values: Arc<[f64]>,
    /// Working memory of a solve.
    memory: Vec<MaybeUninit<u8>>,
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
        let (symbolic, values) =
            ldlt(SparseColMatRef::new(pattern, values), SymmetricOrdering::Amd).map_err(|failure| match failure {
                Failure::Size(source) => ElementsError::Size { unknowns, source },
                Failure::Pivot(_) => ElementsError::Singular { unknowns },
            })?;
        if values.iter().any(|value| !value.is_finite()) {
            return Err(ElementsError::Singular { unknowns });
        }
        let needed = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq).unaligned_bytes_required();
        Ok(Self { symbolic: Arc::new(symbolic), values: values.into(), memory: vec![MaybeUninit::uninit(); needed] })
    }

    /// Entries of L, pivots included: what a solve reads twice.
    pub(crate) fn nonzeros(&self) -> usize {
        self.symbolic.len_val()
    }

    /// x = A⁻¹ x; nothing is allocated.
    pub(crate) fn solve(&mut self, x: &mut [f64]) {
        let stack = MemStack::new(&mut self.memory);
        LdltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            ColMut::from_slice_mut(x).as_mat_mut(),
            Par::Seq,
            stack,
        );
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
