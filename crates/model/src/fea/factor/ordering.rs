//! The order of the nodes in a factor, and the matrix in that order.

use faer::{
    dyn_stack::{MemBuffer, MemStack},
    sparse::{CreationError, FaerError, SparseColMat, Triplet, linalg::amd},
};

use super::FactorError;
use crate::fea::{assembly::DofMap, body::Body};

const NOWHERE: u32 = u32::MAX;

/// A symmetric matrix by the columns of its upper triangle, from entries in either triangle, each once.
fn upper(order: usize, entries: impl Iterator<Item = (u32, u32, f64)>) -> Result<SparseColMat<u32, f64>, FaerError> {
    let entries: Vec<_> = entries.map(|(i, j, value)| Triplet::new(i.min(j), i.max(j), value)).collect();
    SparseColMat::try_new_from_triplets(order, order, &entries).map_err(|error| match error {
        CreationError::Generic(error) => error,
        CreationError::OutOfBounds { .. } => FaerError::IndexOverflow,
    })
}

/// The order of a body's nodes, the two unknowns of each one behind the other.
#[derive(Debug, Clone)]
pub(super) struct Ordering {
    nodes: Vec<u32>,
    /// How many of them are the interface's.
    last: usize,
    position: Vec<u32>,
    fixed: Vec<bool>,
}

impl Ordering {
    /// Approximate minimum degree on the interior, then the nodes of the interface in the order in which it first names them. Nodes that are fixed
    /// altogether have no place.
    pub(crate) fn interface_last(body: &Body, interface: &[u32], pinned: Option<u32>) -> Result<Self, FactorError> {
        let dofs = body.dofs();
        let mut fixed = vec![false; dofs.len()];
        for &dof in dofs.fixed().iter().chain(&pinned) {
            fixed[dof as usize] = true;
        }
        let mut taken = fixed.clone();
        let mut is_inside: Vec<bool> = fixed.chunks(2).map(|pair| pair.contains(&false)).collect();
        let mut last = Vec::new();
        for &dof in interface {
            let is_sound = taken.get_mut(dof as usize).is_some_and(|taken| !std::mem::replace(taken, true));
            let node = DofMap::place(dof).0;
            if !is_sound {
                return Err(FactorError::Interface { dof, node });
            }
            if std::mem::take(&mut is_inside[node as usize]) {
                last.push(node);
            }
        }
        let interior = (0..is_inside.len() as u32).filter(|&node| is_inside[node as usize]).collect();
        let natural = Self::of(interior, 0, fixed);
        let permuted = minimum_degree(&natural, body)
            .map_err(|source| FactorError::Size { unknowns: dofs.free().len(), source })?;
        let mut nodes: Vec<u32> = permuted.iter().map(|&place| natural.nodes[place as usize]).collect();
        nodes.extend(&last);
        Ok(Self::of(nodes, last.len(), natural.fixed))
    }

    fn of(nodes: Vec<u32>, last: usize, fixed: Vec<bool>) -> Self {
        let mut position = vec![NOWHERE; fixed.len() / 2];
        for (place, &node) in (0_u32..).zip(&nodes) {
            position[node as usize] = place;
        }
        Self { nodes, last, position, fixed }
    }

    pub(crate) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Unknowns that do not stay zero.
    pub(crate) fn unknowns(&self) -> usize {
        self.nodes.iter().flat_map(|node| [2 * node, 2 * node + 1]).filter(|&dof| !self.fixed[dof as usize]).count()
    }

    pub(crate) fn last(&self) -> usize {
        self.last
    }

    /// Where unknowns of the interface stand among its nodes.
    pub(crate) fn places(&self, interface: &[u32]) -> Vec<u32> {
        let first = (self.nodes.len() - self.last) as u32;
        interface.iter().map(|dof| 2 * (self.position[*dof as usize / 2] - first) + dof % 2).collect()
    }

    /// Pairs of nodes that K or M couples, once each, a node with itself among them.
    fn coupled(&self, body: &Body) -> impl Iterator<Item = (u32, u32)> {
        self.nodes.iter().flat_map(move |&node| {
            let rows = |dof: u32| body.stiffness().column(dof as usize).0;
            let mut others: Vec<u32> =
                [2 * node, 2 * node + 1].iter().flat_map(|&dof| rows(dof)).map(|row| row / 2).collect();
            others.push(node);
            others.sort_unstable();
            others.dedup();
            others.retain(|&other| self.position[other as usize] != NOWHERE);
            others.into_iter().map(move |other| (other, node))
        })
    }

    /// κ K + σ M in this order; 1 on the diagonal of an unknown that stays zero. Both unknowns of two coupled nodes are entries, zero or not: their
    /// columns stay together in the factor.
    pub(crate) fn matrix(
        &self,
        body: &Body,
        stiffness_scale: f64,
        mass_scale: f64,
    ) -> Result<SparseColMat<u32, f64>, FactorError> {
        let mut entries = Vec::with_capacity(body.stiffness().stored());
        for (row, column) in self.coupled(body) {
            let mass = body.mass().get(row, column);
            for (d, e) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (i, j) = (2 * row + d, 2 * column + e);
                if row == column && d < e {
                    continue;
                }
                let entry = if self.fixed[i as usize] || self.fixed[j as usize] {
                    f64::from(u8::from(i == j))
                } else {
                    let mass = if d == e { mass } else { 0.0 };
                    stiffness_scale * body.stiffness().get(i, j) + mass_scale * mass
                };
                let place = |node: u32, d| 2 * self.position[node as usize] + d;
                entries.push((place(row, d), place(column, e), entry));
            }
        }
        upper(2 * self.nodes.len(), entries.into_iter())
            .map_err(|source| FactorError::Size { unknowns: self.unknowns(), source })
    }
}

fn minimum_degree(natural: &Ordering, body: &Body) -> Result<Vec<u32>, FaerError> {
    let (order, place) = (natural.nodes.len(), |node: u32| natural.position[node as usize]);
    let pairs = natural.coupled(body).map(|(row, column)| (place(row), place(column), 1.0));
    let matrix = upper(order, pairs)?;
    let (mut forward, mut inverse) = (vec![0_u32; order], vec![0_u32; order]);
    let needed = amd::order_scratch::<u32>(order, matrix.row_idx().len());
    let mut memory = MemBuffer::try_new(needed).map_err(|_| FaerError::OutOfMemory)?;
    amd::order(&mut forward, &mut inverse, matrix.symbolic(), amd::Control::default(), MemStack::new(&mut memory))?;
    Ok(forward)
}
