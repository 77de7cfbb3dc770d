//! Bodies of the user's own, meshed elsewhere.

use std::path::PathBuf;

/// A Gmsh file (.msh) with the mesh of a body, in place of the program's own.
///
/// Its physical groups name materials and contact boundaries; what none names is made of the material that the scene gives the body.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFile {
    pub path: PathBuf,
    /// Length of its unit, m.
    pub unit: f64,
}
