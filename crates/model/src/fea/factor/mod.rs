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

mod cholesky;
mod inertia;
mod ordering;
mod panel;
mod rest;

pub use inertia::eigenvalues_below;
pub use rest::StaticFactor;

pub(crate) use self::{cholesky::MERGE, panel::Panels};

use thiserror::Error;

use self::{cholesky::Cholesky, ordering::Ordering};
use super::{
    assembly::{Columns, DofMap},
    body::Body,
};
use crate::tally;

/// Why there is no factor.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FactorError {
    /// An interface unknown that cannot be one.
    #[error(
        "interface unknown {dof} (node {node}): expected a free unknown of the body, named once; found it fixed, absent or named twice"
    )]
    Interface {
        /// The unknown.
        dof: u32,
        /// Its node.
        node: u32,
    },
    /// κ K + σ M is not positive definite.
    #[error(
        "{stiffness_scale:e} K + {mass_scale:e} M is not positive definite at node {node}; expected κ > 0 and, for a body that can move \
         rigidly, σ > 0"
    )]
    NotPositiveDefinite {
        /// κ, 1.
        stiffness_scale: f64,
        /// σ, 1/s².
        mass_scale: f64,
        /// Node of the pivot that failed.
        node: u32,
    },
    /// More entries than 32-bit indices can count, or than memory holds.
    #[error("the factor of {unknowns} unknowns does not fit ({source}); coarsen the mesh")]
    Size {
        /// How many unknowns.
        unknowns: usize,
        /// What did not fit.
        source: faer::sparse::FaerError,
    },
    /// A shift that hits an eigenvalue.
    #[error("K − σ M has no factor at σ = {mass_scale:e} 1/s²: an eigenvalue lies there; move the shift")]
    Singular {
        /// σ, 1/s².
        mass_scale: f64,
    },
}

/// The factor of κ K + σ M of a body, with its interface last.
///
/// All methods work on [`Columns`] of all bodies of the kind at once and allocate nothing.
#[derive(Debug, Clone)]
pub struct Factor {
    order: Vec<u32>,
    fixed: Vec<u32>,
    interface: Vec<u32>,
    panels: Panels,
    tail: Panels,
}

impl Factor {
    /// Factor κ K + σ M.
    ///
    /// - `stiffness_scale`: κ, 1
    /// - `mass_scale`: σ, 1/s² (4/Δt² for the trapezoid)
    /// - `interface`: unknowns 2 n + d of the interface; the order given is the order of every interface vector
    ///
    /// # Errors
    /// [`FactorError`]: an interface unknown that is fixed or named twice, a matrix that is not positive definite.
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
        let matrix = ordering.matrix(body, stiffness_scale, mass_scale);
        tally::add(|made| made.factorisations += 1);
        let cholesky = Cholesky::new(&matrix).map_err(|failure| failure.at(&ordering, stiffness_scale, mass_scale))?;
        let panels = Panels::new(cholesky.supernodes());
        let tail = Panels::dense(&cholesky.trailing(interface.len()));
        let mut fixed = body.dofs().fixed().to_vec();
        fixed.extend(pinned);
        Ok(Self { order: ordering.into_order(), fixed, interface: interface.to_vec(), panels, tail })
    }

    /// The interface unknowns, in the order of interface vectors.
    #[must_use]
    pub fn interface(&self) -> &[u32] {
        &self.interface
    }

    /// Number of unknowns factored.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.order.len()
    }

    /// Non-zeros of L stored, explicit zeros of merged columns included: what one solve reads twice.
    #[must_use]
    pub fn nonzeros(&self) -> usize {
        self.panels.stored()
    }

    /// `count` zero vectors in the factor's own order, for y.
    #[must_use]
    pub fn columns(&self, count: usize) -> Columns {
        Columns::new(self.order.len(), count)
    }

    /// `count` zero interface vectors.
    #[must_use]
    pub fn interface_columns(&self, count: usize) -> Columns {
        Columns::new(self.interface.len(), count)
    }

    /// y = L⁻¹ P f: forward solve. `load` is by the body's unknowns (N for κ = 1), `y` in the factor's order.
    pub fn forward(&self, load: &Columns, y: &mut Columns) {
        let width = y.width();
        for (row, &dof) in y.as_mut_slice().chunks_exact_mut(width).zip(&self.order) {
            row.copy_from_slice(load.row(dof as usize));
        }
        self.panels.forward(y.as_mut_slice(), width);
    }

    /// u = Pᵀ L⁻ᵀ y: backward solve; `y` is overwritten, fixed rows of `u` are zero.
    pub fn backward(&self, y: &mut Columns, u: &mut Columns) {
        let width = y.width();
        self.panels.backward(y.as_mut_slice(), width);
        for (row, &dof) in y.as_slice().chunks_exact(width).zip(&self.order) {
            u.row_mut(dof as usize).copy_from_slice(row);
        }
        for &dof in &self.fixed {
            u.row_mut(dof as usize).fill(0.0);
        }
    }

    /// u = A⁻¹ f for all columns; `y` is work space.
    pub fn solve(&self, load: &Columns, y: &mut Columns, u: &mut Columns) {
        self.forward(load, y);
        self.backward(y, u);
    }

    /// Free displacement of the interface, u_b = L_bb⁻ᵀ y_b: what [`Factor::backward`] would give there without further forces.
    pub fn interface_displacement(&self, y: &Columns, u: &mut Columns) {
        u.as_mut_slice().copy_from_slice(self.tail_of(y.as_slice(), y.width()));
        let width = u.width();
        self.tail.backward(u.as_mut_slice(), width);
    }

    /// y_b += L_bb⁻¹ p: let interface forces p (N, along the unknowns) act before [`Factor::backward`]; `force` is overwritten.
    pub fn add_interface_force(&self, force: &mut Columns, y: &mut Columns) {
        let width = y.width();
        self.tail.forward(force.as_mut_slice(), width);
        let start = (self.order.len() - self.interface.len()) * width;
        for (sum, part) in y.as_mut_slice()[start..].iter_mut().zip(force.as_slice()) {
            *sum += part;
        }
    }

    fn tail_of<'a>(&self, y: &'a [f64], width: usize) -> &'a [f64] {
        &y[(self.order.len() - self.interface.len()) * width..]
    }

    /// W = (A⁻¹)_bb, dense and symmetric, row by row: displacement of the interface for unit forces on it, m/N for κ = 1.
    #[must_use]
    pub fn interface_compliance(&self) -> Vec<f64> {
        let size = self.interface.len();
        let mut columns = Columns::new(size, size);
        for k in 0..size {
            columns.set(k, k, 1.0);
        }
        let width = columns.width();
        self.tail.forward(columns.as_mut_slice(), width);
        self.tail.backward(columns.as_mut_slice(), width);
        symmetric(size, |row, column| columns.get(row, column))
    }
}

/// The symmetric part of a dense matrix, row by row.
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
                node: ordering.order().get(position).map_or(0, |&dof| DofMap::place(dof).0),
            },
            Self::Size(source) => FactorError::Size { unknowns: ordering.order().len(), source },
        }
    }
}
