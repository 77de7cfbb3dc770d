//! Why a mesh is refused.

use thiserror::Error;

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    #[error("mesh of the {body}: expected {name} {expected}, found {found:e}")]
    Parameter { body: &'static str, name: &'static str, expected: &'static str, found: f64 },
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m: expected a positive Jacobian determinant, found {determinant:.3e} m²; \
         move its middle nodes towards the middles of their sides or refine the curved side there"
    )]
    NegativeJacobian { element: u64, r: f64, z: f64, determinant: f64 },
}
