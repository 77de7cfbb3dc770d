//! Sparse matrices of the water.

use std::ops::Range;

/// Entries in any order; equal places add up.
pub(super) type Entries = Vec<(u32, u32, f64)>;

/// A sparse matrix by rows, 32-bit indices, columns ascending in a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Sparse {
    /// From the first row with an entry to behind the last.
    filled: Range<usize>,
    starts: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Sparse {
    pub(super) fn new(rows: usize, mut entries: Entries) -> Self {
        entries.sort_by_key(|&(row, column, _)| (row, column));
        let filled =
            entries.first().map_or(0, |entry| entry.0 as usize)..entries.last().map_or(0, |entry| entry.0 as usize + 1);
        let mut out = Self { filled, starts: vec![0; rows + 1], columns: Vec::new(), values: Vec::new() };
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

    /// Where the entries of the rows begin, columns, values.
    pub(super) fn parts(&self) -> (&[u32], &[u32], &[f64]) {
        (&self.starts, &self.columns, &self.values)
    }

    pub(crate) fn rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// From the first row with an entry to behind the last.
    pub(crate) fn filled(&self) -> Range<usize> {
        self.filled.clone()
    }

    pub(crate) fn row(&self, row: usize) -> (&[u32], &[f64]) {
        let range = self.starts[row] as usize..self.starts[row + 1] as usize;
        (&self.columns[range.clone()], &self.values[range])
    }

    /// y += s A x.
    pub(crate) fn add_product(&self, scale: f64, x: &[f64], y: &mut [f64]) {
        for row in self.filled() {
            let (columns, values) = self.row(row);
            let product: f64 = columns.iter().zip(values).map(|(&column, value)| value * x[column as usize]).sum();
            y[row] += scale * product;
        }
    }

    /// y += s Aᵀ x.
    pub(crate) fn add_transposed(&self, scale: f64, x: &[f64], y: &mut [f64]) {
        for row in self.filled() {
            let (columns, values) = self.row(row);
            for (&column, entry) in columns.iter().zip(values) {
                y[column as usize] += scale * x[row] * entry;
            }
        }
    }

    /// xᵀ A y.
    pub(crate) fn form(&self, x: &[f64], y: &[f64]) -> f64 {
        let mut sum = 0.0;
        for row in self.filled() {
            let (columns, values) = self.row(row);
            sum += x[row] * columns.iter().zip(values).map(|(&column, entry)| entry * y[column as usize]).sum::<f64>();
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

#[cfg(test)]
mod tests {
    use super::*;

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
