//! Triangular solves with several right-hand sides side by side, node by node.
//!
//! A supernode of L is cut into panels of at most two nodes, four columns, stored by the nodes below: one panel is a straight run through memory,
//! its own unknowns stay in registers, and each pair of entries multiplies all right-hand sides in one vector instruction for two of them.

use faer::{Mat, sparse::linalg::cholesky::supernodal::SupernodeRef};

use super::{
    nodal::Nodal,
    pair::{Kernel, Pairs, run},
};

const PANEL: usize = 2;

/// Some neighbouring nodes of L, whose columns have a common pattern.
#[derive(Debug, Clone, Copy)]
struct Panel {
    start: u32,
    /// Number of nodes, 1 to [`PANEL`].
    nodes: u32,
    /// Nodes below: where their numbers begin, and how many.
    pattern: u32,
    below: u32,
    /// Where its pairs of entries begin: of every node of its own the inverse of its triangle, (1/l₀₀, 1/l₁₁) and (0, −l₁₀/(l₀₀ l₁₁)), behind it its
    /// entries in the nodes of the panel below it; then the nodes below one by one, (l_r, l_z) column by column.
    values: usize,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Panels {
    panels: Vec<Panel>,
    rows: Vec<u32>,
    values: Vec<[f64; 2]>,
}

impl Panels {
    /// From faer's supernodes, whose columns and rows come in pairs.
    pub(crate) fn new<'a>(supernodes: impl Iterator<Item = SupernodeRef<'a, u32, f64>>) -> Self {
        let mut out = Self::default();
        for supernode in supernodes {
            let block = supernode.val();
            out.push(supernode.start(), block.ncols(), supernode.pattern(), |row, column| block[(row, column)]);
        }
        out.values.shrink_to_fit();
        out
    }

    pub(crate) fn dense(triangle: &Mat<f64>) -> Self {
        let mut out = Self::default();
        out.push(0, triangle.ncols(), &[], |row, column| triangle[(row, column)]);
        out
    }

    /// Add the supernode of the columns `start`…, with the rows `below` it; its entries by place in the supernode, row ≥ column.
    fn push(&mut self, start: usize, columns: usize, below: &[u32], entry: impl Fn(usize, usize) -> f64) {
        let pairs = || below.chunks(2);
        debug_assert!(start.is_multiple_of(2) && columns.is_multiple_of(2), "nodes are not parted");
        debug_assert!(pairs().all(|pair| pair.len() == 2 && pair[0].is_multiple_of(2) && pair[1] == pair[0] + 1));
        let (start, nodes, all) = (start / 2, columns / 2, (columns + below.len()) / 2);
        let pattern = self.rows.len();
        self.rows.extend((start..start + nodes).map(|node| node as u32).chain(pairs().map(|pair| pair[0] / 2)));
        for first in (0..nodes).step_by(PANEL) {
            let last = nodes.min(first + PANEL);
            self.panels.push(Panel {
                start: (start + first) as u32,
                nodes: (last - first) as u32,
                pattern: (pattern + last) as u32,
                below: (all - last) as u32,
                values: self.values.len(),
            });
            let pair = |node: usize, column: usize| [entry(2 * node, column), entry(2 * node + 1, column)];
            for own in first..last {
                let [[first, between], [_, second]] = [pair(own, 2 * own), pair(own, 2 * own + 1)];
                self.values.push([1.0 / first, 1.0 / second]);
                self.values.push([0.0, -between / (first * second)]);
                for node in own + 1..last {
                    self.values.extend([pair(node, 2 * own), pair(node, 2 * own + 1)]);
                }
            }
            for node in last..all {
                self.values.extend((2 * first..2 * last).map(|column| pair(node, column)));
            }
        }
    }

    pub(crate) fn stored(&self) -> usize {
        2 * self.values.len()
    }

    /// x ← L⁻¹ x.
    pub(crate) fn forward(&self, x: &mut Nodal) {
        x.blocks(|columns, x| run(columns.len(), Solve::<true> { panels: self, x }));
    }

    /// x ← L⁻ᵀ x.
    pub(crate) fn backward(&self, x: &mut Nodal) {
        x.blocks(|columns, x| run(columns.len(), Solve::<false> { panels: self, x }));
    }

    /// A panel of `P` nodes, C = 2 P columns, `H` pairs before the nodes below.
    #[inline(always)]
    fn parts<const C: usize, const H: usize>(&self, panel: &Panel) -> Parts<'_, C, H> {
        let below = panel.below as usize;
        let (head, rest) = self.values[panel.values..][..H + C * below].split_at(H);
        let (head, entries) = (head.as_chunks().0, rest.as_chunks().0);
        let rows = &self.rows[panel.pattern as usize..][..below];
        Parts { start: panel.start as usize, head: &head[0], entries, rows }
    }
}

struct Parts<'a, const C: usize, const H: usize> {
    start: usize,
    head: &'a [[f64; 2]; H],
    entries: &'a [[[f64; 2]; C]],
    rows: &'a [u32],
}

struct Solve<'a, const FORWARD: bool> {
    panels: &'a Panels,
    x: &'a mut [f64],
}

impl<const FORWARD: bool> Kernel for Solve<'_, FORWARD> {
    #[inline(always)]
    fn run<A: Pairs>(self, a: A) {
        let panels = self.panels;
        let x = A::rows_mut(self.x);
        if FORWARD {
            for panel in &panels.panels {
                match panel.nodes {
                    1 => down_one(a, x, &panels.parts(panel)),
                    _ => down_two(a, x, &panels.parts(panel)),
                }
            }
        } else {
            for panel in panels.panels.iter().rev() {
                match panel.nodes {
                    1 => up_one(a, x, &panels.parts(panel)),
                    _ => up_two(a, x, &panels.parts(panel)),
                }
            }
        }
    }
}

#[inline(always)]
fn solved<A: Pairs>(a: A, sum: A::Row, pivots: [f64; 2], between: [f64; 2]) -> A::Row {
    a.with(a.times(pivots, sum), between, a.turned(sum))
}

#[inline(always)]
fn solved_back<A: Pairs>(a: A, sum: A::Row, pivots: [f64; 2], [_, between]: [f64; 2]) -> A::Row {
    a.with(a.times(pivots, sum), [between, 0.0], a.turned(sum))
}

#[inline(always)]
fn down_one<A: Pairs>(a: A, x: &mut [A::Row], parts: &Parts<'_, 2, 2>) {
    let [pivots, between] = *parts.head;
    let own = solved(a, x[parts.start], pivots, between);
    x[parts.start] = own;
    below(a, x, parts, a.spread(own));
}

#[inline(always)]
fn down_two<A: Pairs>(a: A, x: &mut [A::Row], parts: &Parts<'_, 4, 6>) {
    let [pivots, between, first, second, its_pivots, its_between] = *parts.head;
    let own = solved(a, x[parts.start], pivots, between);
    x[parts.start] = own;
    let [r, z] = a.spread(own);
    let next = a.without(a.without(x[parts.start + 1], first, r), second, z);
    let next = solved(a, next, its_pivots, its_between);
    x[parts.start + 1] = next;
    let [next_r, next_z] = a.spread(next);
    below(a, x, parts, [r, z, next_r, next_z]);
}

/// Take the own unknowns, each over both places of its pair, from the nodes below.
#[inline(always)]
fn below<A: Pairs, const C: usize, const H: usize>(a: A, x: &mut [A::Row], parts: &Parts<'_, C, H>, own: [A::Row; C]) {
    for (&row, entries) in parts.rows.iter().zip(parts.entries) {
        let row = &mut x[row as usize];
        let mut sum = *row;
        for k in 0..C {
            sum = a.without(sum, entries[k], own[k]);
        }
        *row = sum;
    }
}

#[inline(always)]
fn up_one<A: Pairs>(a: A, x: &mut [A::Row], parts: &Parts<'_, 2, 2>) {
    let [pivots, between] = *parts.head;
    let sum = a.sum(x[parts.start], a.gathered(above(a, x, parts)));
    x[parts.start] = solved_back(a, sum, pivots, between);
}

#[inline(always)]
fn up_two<A: Pairs>(a: A, x: &mut [A::Row], parts: &Parts<'_, 4, 6>) {
    let [pivots, between, first, second, its_pivots, its_between] = *parts.head;
    let [r, z, next_r, next_z] = above(a, x, parts);
    let next = a.sum(x[parts.start + 1], a.gathered([next_r, next_z]));
    let next = solved_back(a, next, its_pivots, its_between);
    x[parts.start + 1] = next;
    let sum = a.gathered([a.without(r, first, next), a.without(z, second, next)]);
    x[parts.start] = solved_back(a, a.sum(x[parts.start], sum), pivots, between);
}

/// What the nodes below take from each own unknown, by both places of their pairs.
#[inline(always)]
fn above<A: Pairs, const C: usize, const H: usize>(a: A, x: &[A::Row], parts: &Parts<'_, C, H>) -> [A::Row; C] {
    // Nodes last to first: the whole solve then runs backwards through memory in one line.
    let mut sums = [a.zero(); C];
    for (&row, entries) in parts.rows.iter().zip(parts.entries).rev() {
        let row = x[row as usize];
        for k in 0..C {
            sums[k] = a.without(sums[k], entries[k], row);
        }
    }
    sums
}
