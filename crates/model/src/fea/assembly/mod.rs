//! From elements to the matrices of a body: unknowns, columns of unknowns, symmetric sparse matrices.
//!
//! Unknown 2 n + d is the displacement of node n along r (d = 0) or z (d = 1). Fixed unknowns (u_r on the axis, clamped nodes) keep their
//! number and stay zero: fields need no translation, and the scalar mass matrix acts on whole nodes.
//!
//! The displacements of all bodies of a kind are columns side by side ([`Columns`]): an entry of a matrix or of a factor is
//! read once and used for all of them.

mod columns;
mod dof;
mod lanes;
mod sparse;

pub use columns::Columns;
pub use dof::{Direction, DofMap};
pub(crate) use lanes::{Arithmetic, Kernel, Numbers, Vectors, run};
pub(crate) use sparse::SymmetricSparse;
