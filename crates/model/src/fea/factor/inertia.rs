//! How many eigenvalues lie below a number: Sylvester's law of inertia.

use faer::sparse::linalg::cholesky::{SymmetricOrdering, supernodal::SupernodalLdltRef};

use super::{
    FactorError,
    cholesky::{Failure, ldlt, supernodal},
    ordering::Ordering,
};
use crate::fea::body::Body;

/// Number of eigenvalues λ = ω² of K x = λ M x below `shift` (1/s²): the negative pivots of K − shift M = L D Lᵀ.
///
/// Massless nodes add only positive pivots, so the count is of the finite eigenvalues. No pivoting: the count is right as long as the
/// shift is not within rounding of an eigenvalue of a leading block, which moving it by a percent mends.
///
/// Parlett (1998), *The Symmetric Eigenvalue Problem*, §3.3.
pub fn eigenvalues_below(body: &Body, shift: f64) -> Result<usize, FactorError> {
    let ordering = Ordering::interface_last(body, &[], None)?;
    let matrix = ordering.matrix(body, 1.0, -shift)?;
    let (symbolic, values) = ldlt(matrix.as_ref(), SymmetricOrdering::Identity).map_err(|failure| match failure {
        Failure::Size(source) => FactorError::Size { unknowns: matrix.nrows(), source },
        Failure::Pivot(_) => FactorError::Singular { mass_scale: shift },
    })?;
    let Some(pattern) = supernodal(&symbolic) else { return Ok(0) };
    let factor = SupernodalLdltRef::new(pattern, &values);
    let mut below = 0;
    for index in 0..pattern.n_supernodes() {
        let block = factor.supernode(index).val();
        for k in 0..block.ncols() {
            let pivot = block[(k, k)];
            if !pivot.is_finite() {
                return Err(FactorError::Singular { mass_scale: shift });
            }
            below += usize::from(pivot < 0.0);
        }
    }
    Ok(below)
}
