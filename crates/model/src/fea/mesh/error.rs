//! Why a mesh is refused.

use std::path::PathBuf;

use thiserror::Error;

use super::gmsh::GmshError;

/// Why a mesh cannot be made or used.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    #[error("mesh of the {body}: expected {name} {expected}, found {found:e}")]
    Parameter {
        body: &'static str,
        /// Which number, with its unit.
        name: &'static str,
        expected: &'static str,
        /// What was given, SI.
        found: f64,
    },
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m: expected a positive Jacobian determinant, found {determinant:.3e} m²; \
         move its middle nodes towards the middles of their sides or refine the curved side there"
    )]
    NegativeJacobian {
        /// Element, by its number in the file it came from, else its position in the list, counted from 1.
        element: u64,
        /// Where, m.
        r: f64,
        /// Where, m.
        z: f64,
        /// Determinant found, m² a unit area of the reference element.
        determinant: f64,
    },
    #[error("{}: {source}", path.display())]
    Gmsh {
        path: PathBuf,
        /// What, where, and the remedy.
        source: Box<GmshError>,
    },
}
