//! Vectors of unknowns side by side.

use std::ops::Range;

/// Several vectors of the same length, interleaved: the values of one unknown in all vectors lie together.
///
/// A factor or matrix entry then serves all vectors with one read and full vector instructions. The row length [`Columns::width`] is
/// 1, 2, 4, 6 or a multiple of 8; places beyond the last column are zero and stay zero under linear operations. The two rows of a node start where
/// a vector of four numbers does.
#[derive(Debug)]
pub struct Columns {
    data: Vec<f64>,
    start: usize,
    rows: usize,
    count: usize,
    width: usize,
}

impl Columns {
    pub fn new(rows: usize, count: usize) -> Self {
        let width = Self::width_of(count);
        let data = vec![0.0; rows * width + 7];
        // An alignment that cannot be had only costs time.
        let start = match data.as_ptr().align_offset(64) {
            start @ 0..=7 => start,
            _ => 0,
        };
        Self { data, start, rows, count, width }
    }

    /// Row length for that many columns.
    pub(crate) fn width_of(count: usize) -> usize {
        match count {
            0..=2 => count.max(1),
            3..=4 => 4,
            5..=6 => 6,
            _ => count.next_multiple_of(8),
        }
    }

    pub fn from_vector(values: &[f64]) -> Self {
        let mut out = Self::new(values.len(), 1);
        out.as_mut_slice().copy_from_slice(values);
        out
    }

    pub fn rows(&self) -> usize {
        self.rows
    }

    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Numbers a row: at least `Columns::count`.
    pub fn width(&self) -> usize {
        self.width
    }

    fn range(&self) -> Range<usize> {
        self.start..self.start + self.rows * self.width
    }

    pub fn as_slice(&self) -> &[f64] {
        &self.data[self.range()]
    }

    /// All numbers, row after row. Keep the places beyond the last column zero.
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        let range = self.range();
        &mut self.data[range]
    }

    pub(crate) fn row(&self, row: usize) -> &[f64] {
        let start = self.start + row * self.width;
        &self.data[start..start + self.width]
    }

    pub fn row_mut(&mut self, row: usize) -> &mut [f64] {
        let start = self.start + row * self.width;
        &mut self.data[start..start + self.width]
    }

    pub fn get(&self, row: usize, column: usize) -> f64 {
        self.row(row)[column]
    }

    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.row_mut(row)[column] = value;
    }

    pub(crate) fn column(&self, column: usize) -> Vec<f64> {
        self.as_slice().chunks_exact(self.width).map(|row| row[column]).collect()
    }

    pub fn set_column(&mut self, column: usize, values: &[f64]) {
        let width = self.width;
        for (row, value) in self.as_mut_slice().chunks_exact_mut(width).zip(values) {
            row[column] = *value;
        }
    }

    pub(crate) fn clear(&mut self) {
        self.as_mut_slice().fill(0.0);
    }

    /// Become a copy of `other`, which has the same shape.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.as_mut_slice().copy_from_slice(other.as_slice());
    }
}

impl Clone for Columns {
    fn clone(&self) -> Self {
        let mut out = Self::new(self.rows, self.count);
        out.copy_from(self);
        out
    }
}

impl PartialEq for Columns {
    fn eq(&self, other: &Self) -> bool {
        self.count == other.count && self.as_slice() == other.as_slice()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_back_as_they_went_in() {
        for count in 1..=19 {
            let mut all = Columns::new(5, count);
            for column in 0..count {
                all.set_column(column, &[1.0, 2.0, 3.0, 4.0, column as f64]);
            }
            let all = all.clone();
            assert!(all.width() >= count);
            assert_eq!(all.column(count - 1), [1.0, 2.0, 3.0, 4.0, (count - 1) as f64]);
            assert!(all.row(3)[count..].iter().all(|&padding| padding == 0.0));
        }
    }
}
