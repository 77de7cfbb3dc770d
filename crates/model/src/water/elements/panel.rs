//! Triangular solves with one right-hand side.
//!
//! A supernode of L is cut into panels of at most four columns, stored row by row: one panel is a straight run through memory, its
//! columns' unknowns stay in registers.

use crate::fea::assembly::{Arithmetic, Kernel, run_alone};

const PANEL: usize = 4;

#[derive(Debug, Clone, Copy)]
struct Panel {
    start: u32,
    /// Number of columns, 1 to [`PANEL`].
    width: u32,
    /// Rows below: where their numbers begin, and how many.
    pattern: u32,
    below: u32,
    /// Where its entries begin: the triangle on the diagonal by columns with inverted pivots (`width`² numbers), then row by row.
    values: usize,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Panels {
    panels: Vec<Panel>,
    rows: Vec<u32>,
    values: Vec<f64>,
    stored: usize,
}

impl Panels {
    /// Add the supernode of the columns `start`…, with the rows `below` it; its entries by place in the supernode, row ≥ column.
    pub(crate) fn push(&mut self, start: usize, columns: usize, below: &[u32], entry: impl Fn(usize, usize) -> f64) {
        let (pattern, all) = (self.rows.len(), columns + below.len());
        self.rows.extend((start..start + columns).map(|row| row as u32).chain(below.iter().copied()));
        for first in (0..columns).step_by(PANEL) {
            let width = PANEL.min(columns - first);
            self.panels.push(Panel {
                start: (start + first) as u32,
                width: width as u32,
                pattern: (pattern + first + width) as u32,
                below: (all - first - width) as u32,
                values: self.values.len(),
            });
            for column in first..first + width {
                for row in first..first + width {
                    self.values.push(match row.cmp(&column) {
                        std::cmp::Ordering::Less => 0.0,
                        std::cmp::Ordering::Equal => 1.0 / entry(row, column),
                        std::cmp::Ordering::Greater => entry(row, column),
                    });
                }
            }
            for row in first + width..all {
                self.values.extend((first..first + width).map(|column| entry(row, column)));
            }
            self.stored += width * (width + 1) / 2 + width * (all - first - width);
        }
    }

    pub(crate) fn stored(&self) -> usize {
        self.stored
    }

    /// x ← L⁻¹ x.
    pub(crate) fn forward(&self, x: &mut [f64]) {
        run_alone(Solve::<true> { panels: self, x });
    }

    /// x ← L⁻ᵀ x.
    pub(crate) fn backward(&self, x: &mut [f64]) {
        run_alone(Solve::<false> { panels: self, x });
    }

    /// The triangle on the diagonal, the rows below it with their numbers.
    #[inline(always)]
    fn parts<const P: usize>(&self, panel: &Panel) -> Parts<'_, P> {
        let below = panel.below as usize;
        let (entries, _) = self.values[panel.values..][..P * (P + below)].as_chunks::<P>();
        let (triangle, entries) = entries.split_at(P);
        Parts { start: panel.start as usize, triangle, entries, rows: &self.rows[panel.pattern as usize..][..below] }
    }
}

struct Parts<'a, const P: usize> {
    start: usize,
    triangle: &'a [[f64; P]],
    entries: &'a [[f64; P]],
    rows: &'a [u32],
}

struct Solve<'a, const FORWARD: bool> {
    panels: &'a Panels,
    x: &'a mut [f64],
}

impl<const FORWARD: bool> Kernel for Solve<'_, FORWARD> {
    #[inline(always)]
    fn run<A: Arithmetic>(self, a: A, _: usize) {
        let panels = self.panels;
        let mut at = Place { a, x: A::rows_mut(self.x) };
        if FORWARD {
            for panel in &panels.panels {
                match panel.width {
                    1 => at.down(&panels.parts::<1>(panel)),
                    2 => at.down(&panels.parts::<2>(panel)),
                    3 => at.down(&panels.parts::<3>(panel)),
                    _ => at.down(&panels.parts::<PANEL>(panel)),
                }
            }
        } else {
            for panel in panels.panels.iter().rev() {
                match panel.width {
                    1 => at.up(&panels.parts::<1>(panel)),
                    2 => at.up(&panels.parts::<2>(panel)),
                    3 => at.up(&panels.parts::<3>(panel)),
                    _ => at.up(&panels.parts::<PANEL>(panel)),
                }
            }
        }
    }
}

struct Place<'a, A: Arithmetic> {
    a: A,
    x: &'a mut [A::Row],
}

impl<A: Arithmetic> Place<'_, A> {
    #[inline(always)]
    fn down<const P: usize>(&mut self, parts: &Parts<'_, P>) {
        let a = self.a;
        let mut own: [A::Row; P] = std::array::from_fn(|k| self.x[parts.start + k]);
        for k in 0..P {
            own[k] = a.scale(parts.triangle[k][k], own[k]);
            for i in k + 1..P {
                own[i] = a.minus(own[i], parts.triangle[k][i], own[k]);
            }
            self.x[parts.start + k] = own[k];
        }
        for (&row, entries) in parts.rows.iter().zip(parts.entries) {
            let row = &mut self.x[row as usize];
            let mut sum = *row;
            for k in 0..P {
                sum = a.minus(sum, entries[k], own[k]);
            }
            *row = sum;
        }
    }

    #[inline(always)]
    fn up<const P: usize>(&mut self, parts: &Parts<'_, P>) {
        // Rows last to first: the whole solve then runs backwards through memory in one line.
        let a = self.a;
        let mut own: [A::Row; P] = std::array::from_fn(|k| self.x[parts.start + k]);
        for (&row, entries) in parts.rows.iter().zip(parts.entries).rev() {
            let row = self.x[row as usize];
            for k in 0..P {
                own[k] = a.minus(own[k], entries[k], row);
            }
        }
        for k in (0..P).rev() {
            for i in k + 1..P {
                own[k] = a.minus(own[k], parts.triangle[k][i], own[i]);
            }
            own[k] = a.scale(parts.triangle[k][k], own[k]);
            self.x[parts.start + k] = own[k];
        }
    }
}
