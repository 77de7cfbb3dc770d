//! Sparse matrices of the water, and the factor of the coupled step.

use faer::{
    Par, Side,
    dyn_stack::{MemBuffer, MemStack},
    linalg::cholesky::ldlt::factor::LdltRegularization,
    sparse::{
        FaerError, SparseColMatRef, SymbolicSparseColMatRef,
        linalg::{
            SupernodalThreshold,
            cholesky::{CholeskySymbolicParams, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky},
        },
    },
};

use super::ElementsError;

/// Entries in any order; equal places add up.
pub(super) type Entries = Vec<(u32, u32, f64)>;

/// A sparse matrix by rows, 32-bit indices, columns ascending in a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Sparse {
    starts: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Sparse {
    pub(super) fn new(rows: usize, mut entries: Entries) -> Self {
        entries.sort_by_key(|&(row, column, _)| (row, column));
        let mut out = Self { starts: vec![0; rows + 1], columns: Vec::new(), values: Vec::new() };
        let mut last = None;
        for (row, column, value) in entries {
            if last == Some((row, column)) {
                if let Some(sum) = out.values.last_mut() {
                    *sum += value;
                }
                continue;
            }
            last = Some((row, column));
            out.columns.push(column);
            out.values.push(value);
            out.starts[row as usize + 1] = out.columns.len() as u32;
        }
        for row in 0..rows {
            out.starts[row + 1] = out.starts[row + 1].max(out.starts[row]);
        }
        out
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Entries of a row: columns and values.
    #[must_use]
    pub fn row(&self, row: usize) -> (&[u32], &[f64]) {
        let range = self.starts[row] as usize..self.starts[row + 1] as usize;
        (&self.columns[range.clone()], &self.values[range])
    }

    /// y += s A x.
    pub fn add_product(&self, scale: f64, x: &[f64], y: &mut [f64]) {
        for (row, sum) in y.iter_mut().enumerate() {
            let (columns, values) = self.row(row);
            let product: f64 = columns.iter().zip(values).map(|(&column, value)| value * x[column as usize]).sum();
            *sum += scale * product;
        }
    }

    /// y += s Aᵀ x.
    pub fn add_transposed(&self, scale: f64, x: &[f64], y: &mut [f64]) {
        for (row, value) in x.iter().enumerate() {
            let (columns, values) = self.row(row);
            for (&column, entry) in columns.iter().zip(values) {
                y[column as usize] += scale * value * entry;
            }
        }
    }

    /// xᵀ A y.
    #[must_use]
    pub fn form(&self, x: &[f64], y: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (row, value) in x.iter().enumerate() {
            let (columns, values) = self.row(row);
            sum += value * columns.iter().zip(values).map(|(&column, entry)| entry * y[column as usize]).sum::<f64>();
        }
        sum
    }

    /// All entries, `scale` times as large, moved to the block that begins at (`down`, `right`).
    pub(super) fn block(&self, scale: f64, down: usize, right: usize) -> impl Iterator<Item = (u32, u32, f64)> + '_ {
        (0..self.rows()).flat_map(move |row| {
            let (columns, values) = self.row(row);
            let place =
                move |(&column, value): (&u32, &f64)| ((row + down) as u32, column + right as u32, scale * value);
            columns.iter().zip(values).map(place)
        })
    }
}

/// L D Lᵀ of a symmetric quasi-definite matrix [A, Bᵀ; B, −C], A and C positive definite, rows in any order: it exists without pivoting.
///
/// Vanderbei (1995), *SIAM J. Optim.* 5, 100; ordering by approximate minimum degree.
#[derive(Debug, Clone)]
pub struct QuasiDefinite {
    order: Vec<u32>,
    starts: Vec<u32>,
    rows: Vec<u32>,
    values: Vec<f64>,
    /// 1/D.
    inverse: Vec<f64>,
    work: Vec<f64>,
}

impl QuasiDefinite {
    /// Factor the matrix whose upper triangle (row ≤ column) is `matrix`.
    pub(super) fn new(matrix: &Sparse) -> Result<Self, ElementsError> {
        let unknowns = matrix.rows();
        let size = |source: FaerError| ElementsError::Size { unknowns, source };
        // The rows of the lower triangle are the columns of the upper one.
        let mut entries = Entries::new();
        for row in 0..unknowns {
            let (columns, values) = matrix.row(row);
            entries.extend(columns.iter().zip(values).map(|(&column, &value)| (column, row as u32, value)));
        }
        let lower = Sparse::new(unknowns, entries);
        let pattern = SymbolicSparseColMatRef::new_checked(unknowns, unknowns, &lower.starts, None, &lower.columns);
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SIMPLICIAL,
            ..CholeskySymbolicParams::default()
        };
        let symbolic =
            factorize_symbolic_cholesky(pattern, Side::Upper, SymmetricOrdering::Amd, parameters).map_err(size)?;
        let mut values = vec![0.0; symbolic.len_val()];
        let needed = symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, faer::Spec::default());
        let mut memory = MemBuffer::try_new(needed).map_err(|_| size(FaerError::OutOfMemory))?;
        symbolic
            .factorize_numeric_ldlt(
                &mut values,
                SparseColMatRef::new(pattern, &lower.values),
                Side::Upper,
                LdltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                faer::Spec::default(),
            )
            .map_err(|_| ElementsError::Singular { unknowns })?;
        let order = symbolic.perm().map_or_else(|| (0..unknowns as u32).collect(), |perm| perm.arrays().0.to_vec());
        let SymbolicCholeskyRaw::Simplicial(pattern) = symbolic.raw() else {
            return Err(ElementsError::Singular { unknowns });
        };
        let (starts, rows) = (pattern.col_ptr().to_vec(), pattern.row_idx().to_vec());
        // The first entry of a column is its pivot.
        let inverse: Vec<f64> = (0..unknowns).map(|column| 1.0 / values[starts[column] as usize]).collect();
        if inverse.iter().any(|pivot| !pivot.is_finite()) {
            return Err(ElementsError::Singular { unknowns });
        }
        Ok(Self { order, starts, rows, values, inverse, work: vec![0.0; unknowns] })
    }

    /// Entries of L, pivots included: what a solve reads twice.
    #[must_use]
    pub fn nonzeros(&self) -> usize {
        self.values.len()
    }

    /// x = A⁻¹ x; nothing is allocated.
    pub fn solve(&mut self, x: &mut [f64]) {
        let Self { order, starts, rows, values, inverse, work } = self;
        for (work, &place) in work.iter_mut().zip(&*order) {
            *work = x[place as usize];
        }
        let column = |k: usize| starts[k] as usize + 1..starts[k + 1] as usize;
        for k in 0..work.len() {
            let value = work[k];
            for (&row, entry) in rows[column(k)].iter().zip(&values[column(k)]) {
                work[row as usize] -= entry * value;
            }
        }
        for k in (0..work.len()).rev() {
            let products =
                rows[column(k)].iter().zip(&values[column(k)]).map(|(&row, entry)| entry * work[row as usize]);
            let sum: f64 = products.sum();
            work[k] = work[k] * inverse[k] - sum;
        }
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

    #[test]
    fn equal_places_add_up_and_empty_rows_stay_empty() {
        let matrix = Sparse::new(4, vec![(2, 1, 1.0), (0, 0, 2.0), (2, 1, 3.0), (2, 0, -1.0)]);
        assert_eq!(matrix.row(0), (&[0][..], &[2.0][..]));
        assert_eq!(matrix.row(1), (&[][..], &[][..]));
        assert_eq!(matrix.row(2), (&[0, 1][..], &[-1.0, 4.0][..]));
        let (mut y, mut z) = (vec![1.0; 4], vec![0.0; 2]);
        matrix.add_product(2.0, &[1.0, 1.0], &mut y);
        assert_eq!(y, [5.0, 1.0, 7.0, 1.0]);
        matrix.add_transposed(1.0, &[1.0, 5.0, 1.0, 0.0], &mut z);
        assert_eq!(z, [1.0, 4.0]);
        assert_eq!(matrix.form(&[0.0, 0.0, 1.0, 0.0], &[1.0, 1.0]), 3.0);
    }
}
