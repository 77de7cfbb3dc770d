//! Which unknowns a body has.

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    Radial,
    Axial,
}

/// Numbering of the unknowns: 2 n + d, with the fixed ones marked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DofMap {
    is_free: Vec<bool>,
    fixed: Vec<u32>,
    free: Vec<u32>,
}

impl DofMap {
    pub(in crate::fea) fn new(is_free: Vec<bool>) -> Self {
        let numbers = |wanted: bool| {
            (0_u32..).zip(&is_free).filter(|&(_, &free)| free == wanted).map(|(dof, _)| dof).collect::<Vec<_>>()
        };
        let (fixed, free) = (numbers(false), numbers(true));
        Self { is_free, fixed, free }
    }

    pub fn dof(node: u32, direction: Direction) -> u32 {
        2 * node + u32::from(direction == Direction::Axial)
    }

    pub fn place(dof: u32) -> (u32, Direction) {
        (dof / 2, if dof.is_multiple_of(2) { Direction::Radial } else { Direction::Axial })
    }

    /// Length of a vector of unknowns: twice the number of nodes, fixed ones included.
    pub fn len(&self) -> usize {
        self.is_free.len()
    }

    pub fn is_empty(&self) -> bool {
        self.is_free.is_empty()
    }

    pub fn is_free(&self, dof: u32) -> bool {
        self.is_free.get(dof as usize).copied().unwrap_or(false)
    }

    /// The unknowns that may move, ascending. Their number is what is called the number of unknowns in reports.
    pub fn free(&self) -> &[u32] {
        &self.free
    }

    pub fn fixed(&self) -> &[u32] {
        &self.fixed
    }
}
