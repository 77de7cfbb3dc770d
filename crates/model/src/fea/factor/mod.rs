//! The factor of a kind of body: A = κ K + σ M = L Lᵀ, computed once, then one forward and one backward solve a step for all its bodies.
//!
//! The *interface* (all unknowns that any contact measures or pushes) is ordered last, minimum degree on the interior only:
//!
//! ```text
//!     [ L_ii      ]            y_i = L_ii⁻¹ f_i                          forward
//! L = [           ] ,          y_b = L_bb⁻¹ (f_b − L_bi y_i)
//!     [ L_bi L_bb ]            u_b = L_bb⁻ᵀ y_b   free displacement of the interface, before any contact force
//!
//! W = (A⁻¹)_bb = L_bb⁻ᵀ L_bb⁻¹                     compliance of the interface
//! y_b += L_bb⁻¹ p,  then  u = L⁻ᵀ y                 contact forces p and the backward solve
//! ```
//!
//! So contact costs nothing beyond the interface itself: the forces enter between the two halves of the one solve.
//!
//! Davis (2006), *Direct Methods for Sparse Linear Systems*, ch. 4 and 7; Amestoy, Davis & Duff (1996), *SIAM J. Matrix Anal. Appl.* 17, 886.

pub(crate) mod cholesky;
mod inertia;
mod nodal;
mod ordering;
mod pair;
mod panel;
mod rest;

pub use inertia::eigenvalues_below;
pub use rest::StaticFactor;

use thiserror::Error;

use self::{cholesky::Cholesky, nodal::Nodal, ordering::Ordering, panel::Panels};
use super::{assembly::Columns, body::Body};
use crate::tally;

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FactorError {
    #[error(
        "interface unknown {dof} (node {node}): expected a free unknown of the body, named once; found it fixed, absent or named twice"
    )]
    Interface { dof: u32, node: u32 },
    #[error(
        "{stiffness_scale:e} K + {mass_scale:e} M is not positive definite at node {node}; expected κ > 0 and, for a body that can move \
         rigidly, σ > 0"
    )]
    NotPositiveDefinite { stiffness_scale: f64, mass_scale: f64, node: u32 },
    #[error("the factor of {unknowns} unknowns does not fit ({source}); coarsen the mesh")]
    Size { unknowns: usize, source: faer::sparse::FaerError },
    #[error("K − σ M has no factor at σ = {mass_scale:e} 1/s²: an eigenvalue lies there; move the shift")]
    Singular { mass_scale: f64 },
}

/// The factor of κ K + σ M of a body, with its interface last.
///
/// All methods work on [`Columns`] of all bodies of the kind at once and allocate nothing. Both unknowns of a node stand together.
#[derive(Debug, Clone)]
pub struct Factor {
    nodes: Vec<u32>,
    unknowns: usize,
    fixed: Vec<u32>,
    interface: Vec<u32>,
    /// Where they stand among the nodes of the interface.
    places: Vec<u32>,
    tail_nodes: usize,
    panels: Panels,
    tail: Panels,
}

/// A solution between its two halves, y, in the factor's own order.
#[derive(Debug, Clone)]
pub struct Half {
    y: Nodal,
    tail: Nodal,
}

impl Half {
    pub(crate) fn new(body: &Body, interface: &[u32], count: usize) -> Self {
        let mut interface: Vec<u32> = interface.iter().map(|dof| dof / 2).collect();
        interface.sort_unstable();
        interface.dedup();
        let mut nodes: Vec<u32> = body.dofs().free().iter().map(|dof| dof / 2).collect();
        nodes.dedup();
        Self { y: Nodal::new(nodes.len(), count), tail: Nodal::new(interface.len(), count) }
    }
}

impl Factor {
    /// Factor κ K + σ M.
    ///
    /// - `stiffness_scale`: κ, 1
    /// - `mass_scale`: σ, 1/s² (4/Δt² for the trapezoid)
    /// - `interface`: unknowns 2 n + d of the interface; the order given is the order of every interface vector
    pub fn new(body: &Body, stiffness_scale: f64, mass_scale: f64, interface: &[u32]) -> Result<Self, FactorError> {
        Self::without(body, stiffness_scale, mass_scale, interface, None)
    }

    fn without(
        body: &Body,
        stiffness_scale: f64,
        mass_scale: f64,
        interface: &[u32],
        pinned: Option<u32>,
    ) -> Result<Self, FactorError> {
        let ordering = Ordering::interface_last(body, interface, pinned)?;
        let matrix = ordering.matrix(body, stiffness_scale, mass_scale)?;
        tally::add(|made| made.factorisations += 1);
        let cholesky =
            Cholesky::new(matrix.as_ref()).map_err(|failure| failure.at(&ordering, stiffness_scale, mass_scale))?;
        let panels = Panels::new(cholesky.supernodes());
        let tail = Panels::dense(&cholesky.trailing(2 * ordering.last()));
        let mut fixed = body.dofs().fixed().to_vec();
        fixed.extend(pinned);
        Ok(Self {
            nodes: ordering.nodes().to_vec(),
            unknowns: ordering.unknowns(),
            fixed,
            interface: interface.to_vec(),
            places: ordering.places(interface),
            tail_nodes: ordering.last(),
            panels,
            tail,
        })
    }

    pub(crate) fn interface(&self) -> &[u32] {
        &self.interface
    }

    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Numbers of L stored, explicit zeros of merged columns and of fixed unknowns included: what one solve reads twice.
    pub fn nonzeros(&self) -> usize {
        self.panels.stored()
    }

    /// `count` zero vectors in the factor's own order, for y.
    pub fn half(&self, count: usize) -> Half {
        Half { y: Nodal::new(self.nodes.len(), count), tail: Nodal::new(self.tail_nodes, count) }
    }

    pub fn interface_columns(&self, count: usize) -> Columns {
        Columns::new(self.interface.len(), count)
    }

    /// y = L⁻¹ P f: forward solve. `load` is by the body's unknowns (N for κ = 1).
    pub fn forward(&self, load: &Columns, half: &mut Half) {
        half.y.take(&self.nodes, load);
        self.panels.forward(&mut half.y);
    }

    /// u = Pᵀ L⁻ᵀ y: backward solve; y is overwritten, fixed rows of `u` are zero.
    pub fn backward(&self, half: &mut Half, u: &mut Columns) {
        self.panels.backward(&mut half.y);
        half.y.give(&self.nodes, u);
        for &dof in &self.fixed {
            u.row_mut(dof as usize).fill(0.0);
        }
    }

    /// u = A⁻¹ f for all columns; `half` is work space.
    pub fn solve(&self, load: &Columns, half: &mut Half, u: &mut Columns) {
        self.forward(load, half);
        self.backward(half, u);
    }

    /// Free displacement of the interface, u_b = L_bb⁻ᵀ y_b: what [`Factor::backward`] would give there without further forces.
    pub fn interface_displacement(&self, Half { y, tail }: &mut Half, u: &mut Columns) {
        tail.copy_last(y);
        self.tail.backward(tail);
        tail.get(&self.places, u);
    }

    /// y_b += L_bb⁻¹ p: let interface forces p (N, along the unknowns) act before [`Factor::backward`].
    pub fn add_interface_force(&self, force: &Columns, Half { y, tail }: &mut Half) {
        tail.clear();
        tail.set(&self.places, force);
        self.tail.forward(tail);
        tail.add_to_last(y);
    }

    /// W = (A⁻¹)_bb, dense and symmetric, row by row: displacement of the interface for unit forces on it, m/N for κ = 1.
    pub fn interface_compliance(&self) -> Vec<f64> {
        let size = self.interface.len();
        let mut columns = Columns::new(size, size);
        for k in 0..size {
            columns.set(k, k, 1.0);
        }
        let mut tail = Nodal::new(self.tail_nodes, size);
        tail.set(&self.places, &columns);
        self.tail.forward(&mut tail);
        self.tail.backward(&mut tail);
        tail.get(&self.places, &mut columns);
        symmetric(size, |row, column| columns.get(row, column))
    }
}

fn symmetric(size: usize, at: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let entries = (0..size).flat_map(|row| (0..size).map(move |column| (row, column)));
    entries.map(|(row, column)| 0.5 * (at(row, column) + at(column, row))).collect()
}

impl cholesky::Failure {
    fn at(self, ordering: &Ordering, stiffness_scale: f64, mass_scale: f64) -> FactorError {
        match self {
            Self::Pivot(position) => FactorError::NotPositiveDefinite {
                stiffness_scale,
                mass_scale,
                node: ordering.nodes().get(position / 2).copied().unwrap_or(0),
            },
            Self::Size(source) => FactorError::Size { unknowns: ordering.unknowns(), source },
        }
    }
}
