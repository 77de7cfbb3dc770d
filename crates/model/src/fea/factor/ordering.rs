//! The order of the unknowns in a factor, and the matrix in that order.

use faer::{
    dyn_stack::{MemBuffer, MemStack},
    sparse::{FaerError, SymbolicSparseColMatRef, linalg::amd},
};

use super::FactorError;
use crate::fea::{assembly::DofMap, body::Body};

/// Where a fixed unknown stands.
const NOWHERE: u32 = u32::MAX;

/// A symmetric matrix by the columns of its upper triangle, rows ascending.
#[derive(Debug, Clone)]
pub(super) struct Upper {
    pub starts: Vec<u32>,
    pub rows: Vec<u32>,
    pub values: Vec<f64>,
}

impl Upper {
    pub fn order(&self) -> usize {
        self.starts.len() - 1
    }

    pub fn pattern(&self) -> SymbolicSparseColMatRef<'_, u32> {
        SymbolicSparseColMatRef::new_checked(self.order(), self.order(), &self.starts, None, &self.rows)
    }

    /// From entries in any order, each once, in either triangle.
    fn new(order: usize, entries: &[(u32, u32, f64)]) -> Self {
        // Sorted by row, then stably by column: both by counting.
        let by = |key: &dyn Fn(&(u32, u32, f64)) -> u32, entries: &[(u32, u32, f64)]| {
            let mut starts = vec![0_u32; order + 1];
            for entry in entries {
                starts[key(entry) as usize + 1] += 1;
            }
            for k in 0..order {
                starts[k + 1] += starts[k];
            }
            let mut next = starts.clone();
            let mut sorted = vec![(0, 0, 0.0); entries.len()];
            for entry in entries {
                let place = &mut next[key(entry) as usize];
                sorted[*place as usize] = *entry;
                *place += 1;
            }
            (starts, sorted)
        };
        let (_, by_row) = by(&|entry| entry.0.min(entry.1), entries);
        let (starts, sorted) = by(&|entry| entry.0.max(entry.1), &by_row);
        let rows = sorted.iter().map(|entry| entry.0.min(entry.1)).collect();
        Self { starts, rows, values: sorted.iter().map(|entry| entry.2).collect() }
    }
}

/// Position → unknown, and back.
#[derive(Debug, Clone)]
pub(super) struct Ordering {
    order: Vec<u32>,
    position: Vec<u32>,
}

impl Ordering {
    /// Approximate minimum degree on the interior, then the interface as given.
    pub(crate) fn interface_last(body: &Body, interface: &[u32], pinned: Option<u32>) -> Result<Self, FactorError> {
        let dofs = body.dofs();
        let mut inside = vec![true; dofs.len()];
        for &dof in dofs.fixed().iter().chain(&pinned) {
            inside[dof as usize] = false;
        }
        for &dof in interface {
            let is_sound = inside.get_mut(dof as usize).is_some_and(|inside| std::mem::replace(inside, false));
            if !is_sound {
                return Err(FactorError::Interface { dof, node: DofMap::place(dof).0 });
            }
        }
        let interior: Vec<u32> = dofs.free().iter().copied().filter(|&dof| inside[dof as usize]).collect();
        let natural = Self::of(interior, dofs.len());
        let permuted = minimum_degree(&natural.matrix(body, 1.0, 0.0))
            .map_err(|source| FactorError::Size { unknowns: dofs.free().len(), source })?;
        let mut order: Vec<u32> = permuted.iter().map(|&place| natural.order[place as usize]).collect();
        order.extend(interface);
        Ok(Self::of(order, dofs.len()))
    }

    fn of(order: Vec<u32>, unknowns: usize) -> Self {
        let mut position = vec![NOWHERE; unknowns];
        for (place, &dof) in (0_u32..).zip(&order) {
            position[dof as usize] = place;
        }
        Self { order, position }
    }

    /// Position → unknown.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    pub(crate) fn into_order(self) -> Vec<u32> {
        self.order
    }

    /// κ K + σ M in this order.
    pub fn matrix(&self, body: &Body, stiffness_scale: f64, mass_scale: f64) -> Upper {
        let mut entries = Vec::with_capacity(body.stiffness().stored());
        for &dof in &self.order {
            let (rows, values) = body.stiffness().column(dof as usize);
            let (nodes, masses) = body.mass().column(dof as usize / 2);
            let mut masses = nodes.iter().zip(masses).peekable();
            for (&row, &value) in rows.iter().zip(values) {
                if self.position[row as usize] == NOWHERE {
                    continue;
                }
                let node = row / 2;
                while masses.next_if(|&(&other, _)| other < node).is_some() {}
                let mass = match masses.peek() {
                    Some(&(&other, &mass)) if other == node && row % 2 == dof % 2 => mass,
                    _ => 0.0,
                };
                let entry = stiffness_scale * value + mass_scale * mass;
                entries.push((self.position[row as usize], self.position[dof as usize], entry));
            }
        }
        Upper::new(self.order.len(), &entries)
    }
}

fn minimum_degree(matrix: &Upper) -> Result<Vec<u32>, FaerError> {
    let order = matrix.order();
    let (mut forward, mut inverse) = (vec![0_u32; order], vec![0_u32; order]);
    let needed = amd::order_scratch::<u32>(order, matrix.rows.len());
    let mut memory = MemBuffer::try_new(needed).map_err(|_| FaerError::OutOfMemory)?;
    amd::order(&mut forward, &mut inverse, matrix.pattern(), amd::Control::default(), MemStack::new(&mut memory))?;
    Ok(forward)
}
