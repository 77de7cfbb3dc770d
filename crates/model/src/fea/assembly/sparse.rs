//! Symmetric sparse matrices and their product with several columns.

use super::{Arithmetic, Kernel, run};

/// A symmetric matrix by the columns of its lower triangle; 32-bit indices, rows ascending in a column.
#[derive(Debug, Clone, PartialEq)]
pub struct SymmetricSparse {
    starts: Vec<u32>,
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl SymmetricSparse {
    /// A zero matrix of that pattern.
    ///
    /// `starts[j]..starts[j + 1]` are the places of column j in `rows`, which ascend from j on.
    pub(in crate::fea) fn zeros(starts: Vec<u32>, rows: Vec<u32>) -> Self {
        let values = vec![0.0; rows.len()];
        Self { starts, rows, values }
    }

    pub(crate) fn order(&self) -> usize {
        self.starts.len() - 1
    }

    /// Entries stored: those of the lower triangle.
    pub(crate) fn stored(&self) -> usize {
        self.rows.len()
    }

    pub fn column(&self, column: usize) -> (&[u32], &[f64]) {
        let range = self.starts[column] as usize..self.starts[column + 1] as usize;
        (&self.rows[range.clone()], &self.values[range])
    }

    /// One entry; zero outside the pattern.
    pub fn get(&self, row: u32, column: u32) -> f64 {
        let (row, column) = (row.max(column), row.min(column));
        let (rows, values) = self.column(column as usize);
        rows.binary_search(&row).map_or(0.0, |place| values[place])
    }

    /// Add to one entry of the pattern; what lies outside it is not stored.
    pub(in crate::fea) fn add(&mut self, row: u32, column: u32, value: f64) {
        let start = self.starts[column as usize] as usize;
        let end = self.starts[column as usize + 1] as usize;
        if let Ok(place) = self.rows[start..end].binary_search(&row) {
            self.values[start + place] += value;
        }
    }

    /// The same matrix without the rows and columns for which `keep` is false (they become empty).
    pub(in crate::fea) fn without(&self, keep: impl Fn(u32) -> bool) -> Self {
        let mut out = Self { starts: vec![0], rows: Vec::new(), values: Vec::new() };
        for column in 0..self.order() {
            let (rows, values) = self.column(column);
            if keep(column as u32) {
                for (&row, &value) in rows.iter().zip(values).filter(|&(&row, _)| keep(row)) {
                    out.rows.push(row);
                    out.values.push(value);
                }
            }
            out.starts.push(out.rows.len() as u32);
        }
        out
    }

    /// y = A x for rows of `width` numbers (1, 2, 4, 6, 8, 12 or a multiple of 8); nothing is allocated.
    pub(crate) fn multiply(&self, x: &[f64], y: &mut [f64], width: usize) {
        debug_assert_eq!(x.len(), self.order() * width);
        debug_assert_eq!(y.len(), x.len());
        run(width, Product { matrix: self, x, y });
    }
}

struct Product<'a> {
    matrix: &'a SymmetricSparse,
    x: &'a [f64],
    y: &'a mut [f64],
}

impl Kernel for Product<'_> {
    #[inline(always)]
    fn run<A: Arithmetic>(self, a: A, step: usize) {
        let SymmetricSparse { starts, rows, values } = self.matrix;
        let (x, y) = (A::rows(self.x), A::rows_mut(self.y));
        y.fill(a.zero());
        for block in 0..step {
            for (column, ends) in starts.windows(2).enumerate() {
                let range = ends[0] as usize..ends[1] as usize;
                let own = x[column * step + block];
                let mut sum = y[column * step + block];
                let (rows, values) = (&rows[range.clone()], &values[range]);
                let mut entries = rows.iter().zip(values);
                if rows.first() == Some(&(column as u32))
                    && let Some((_, &diagonal)) = entries.next()
                {
                    sum = a.plus(sum, diagonal, own);
                }
                for (&row, &value) in entries {
                    let place = row as usize * step + block;
                    sum = a.plus(sum, value, x[place]);
                    y[place] = a.plus(y[place], value, own);
                }
                y[column * step + block] = sum;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_product_with_columns_is_the_dense_one() {
        // Lower triangle of a 4 × 4 matrix with an empty last row.
        let mut matrix = SymmetricSparse::zeros(vec![0, 2, 4, 5, 5], vec![0, 2, 1, 2, 2]);
        for (row, column, value) in [(0, 0, 2.0), (2, 0, -1.0), (1, 1, 3.0), (2, 1, 0.5), (2, 2, 4.0)] {
            matrix.add(row, column, value);
        }
        let dense = [[2.0, 0.0, -1.0, 0.0], [0.0, 3.0, 0.5, 0.0], [-1.0, 0.5, 4.0, 0.0], [0.0; 4]];
        for width in [1, 2, 3, 4, 6, 8, 12, 16, 24, 32] {
            let x: Vec<f64> = (0..4 * width).map(|k| (k as f64 * 0.7).sin()).collect();
            let mut y = vec![f64::NAN; x.len()];
            matrix.multiply(&x, &mut y, width);
            for row in 0..4 {
                for column in 0..width {
                    let exact: f64 = (0..4).map(|k| dense[row][k] * x[k * width + column]).sum();
                    // Rounding of four terms.
                    assert!((y[row * width + column] - exact).abs() < 1e-15 * 4.0, "width {width}");
                }
            }
        }
    }
}
