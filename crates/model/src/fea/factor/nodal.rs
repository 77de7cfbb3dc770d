//! Vectors by the nodes of a factor.

use std::ops::Range;

use super::pair::BLOCKS;
use crate::fea::assembly::Columns;

/// Several vectors by the nodes of a factor, in blocks of at most six columns one behind the other: a block holds node after node the pairs (r, z)
/// of its columns.
#[derive(Debug, Clone)]
pub(crate) struct Nodal {
    data: Vec<f64>,
    nodes: usize,
    count: usize,
}

/// Columns of the blocks of so many vectors.
fn widths(count: usize) -> impl Iterator<Item = usize> {
    let mut left = count;
    std::iter::from_fn(move || {
        // One column more costs less than two blocks.
        let width = *BLOCKS.iter().rev().find(|&&block| block >= left).unwrap_or(&BLOCKS[0]);
        let is_any = left > 0;
        left = left.saturating_sub(width);
        is_any.then_some(width)
    })
}

impl Nodal {
    pub(crate) fn new(nodes: usize, count: usize) -> Self {
        let numbers = 2 * nodes * widths(count).sum::<usize>();
        Self { data: vec![0.0; numbers], nodes, count }
    }

    pub(crate) fn clear(&mut self) {
        self.data.fill(0.0);
    }

    #[inline(always)]
    pub(crate) fn blocks(&mut self, mut work: impl FnMut(Range<usize>, &mut [f64])) {
        let (mut rest, mut first) = (self.data.as_mut_slice(), 0);
        for width in widths(self.count) {
            let (block, behind) = rest.split_at_mut(2 * self.nodes * width);
            work(first..first + width, block);
            (rest, first) = (behind, first + width);
        }
    }

    pub(crate) fn take(&mut self, nodes: &[u32], from: &Columns) {
        self.blocks(|columns, block| match columns.len() {
            6 => take::<6>(nodes, block, from, columns.start),
            4 => take::<4>(nodes, block, from, columns.start),
            2 => take::<2>(nodes, block, from, columns.start),
            _ => take::<1>(nodes, block, from, columns.start),
        });
    }

    pub(crate) fn give(&mut self, nodes: &[u32], to: &mut Columns) {
        self.blocks(|columns, block| match columns.len() {
            6 => give::<6>(nodes, block, to, columns.start),
            4 => give::<4>(nodes, block, to, columns.start),
            2 => give::<2>(nodes, block, to, columns.start),
            _ => give::<1>(nodes, block, to, columns.start),
        });
    }

    /// Set the unknowns at `places`, 2 × node + direction, to the rows of `from`.
    pub(crate) fn set(&mut self, places: &[u32], from: &Columns) {
        self.blocks(|columns, block| {
            for (row, place) in places.iter().enumerate() {
                for (number, value) in pair_places(*place, columns.len()).zip(&from.row(row)[columns.clone()]) {
                    block[number] = *value;
                }
            }
        });
    }

    pub(crate) fn get(&mut self, places: &[u32], to: &mut Columns) {
        self.blocks(|columns, block| {
            for (row, place) in places.iter().enumerate() {
                for (number, value) in pair_places(*place, columns.len()).zip(&mut to.row_mut(row)[columns.clone()]) {
                    *value = block[number];
                }
            }
        });
    }

    pub(crate) fn copy_last(&mut self, other: &mut Self) {
        let Self { data, nodes, .. } = self;
        let (own, mut first) = (*nodes, 0);
        other.blocks(|columns, block| {
            let length = 2 * own * columns.len();
            data[first..first + length].copy_from_slice(&block[block.len() - length..]);
            first += length;
        });
    }

    pub(crate) fn add_to_last(&self, other: &mut Self) {
        let mut first = 0;
        other.blocks(|columns, block| {
            let length = 2 * self.nodes * columns.len();
            let start = block.len() - length;
            block[start..].iter_mut().zip(&self.data[first..]).for_each(|(sum, part)| *sum += part);
            first += length;
        });
    }
}

/// Where the columns of an unknown lie in a block of so many columns.
fn pair_places(place: u32, columns: usize) -> impl Iterator<Item = usize> {
    let (node, direction) = (place as usize / 2, place as usize % 2);
    (0..columns).map(move |column| 2 * (node * columns + column) + direction)
}

fn take<const W: usize>(nodes: &[u32], block: &mut [f64], from: &Columns, first: usize) {
    let width = from.width();
    let (own, all) = (block.as_chunks_mut::<2>().0, from.as_slice());
    for (own, &node) in own.chunks_exact_mut(W).zip(nodes) {
        let (r, z) = all[2 * node as usize * width..][..2 * width].split_at(width);
        for ((own, r), z) in own.iter_mut().zip(&r[first..]).zip(&z[first..]) {
            *own = [*r, *z];
        }
    }
}

fn give<const W: usize>(nodes: &[u32], block: &[f64], to: &mut Columns, first: usize) {
    let width = to.width();
    let (own, all) = (block.as_chunks::<2>().0, to.as_mut_slice());
    for (own, &node) in own.chunks_exact(W).zip(nodes) {
        let (r, z) = all[2 * node as usize * width..][..2 * width].split_at_mut(width);
        for ((own, r), z) in own.iter().zip(&mut r[first..]).zip(&mut z[first..]) {
            (*r, *z) = (own[0], own[1]);
        }
    }
}
