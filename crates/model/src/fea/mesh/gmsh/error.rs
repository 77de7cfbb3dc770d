//! Why a Gmsh file is refused: what, where, and the remedy.

use thiserror::Error;

/// Why a Gmsh file is refused. Nodes and elements go by their numbers in the file, places are in metres after scaling.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GmshError {
    #[error("the file cannot be read ({kind})")]
    Unreadable { kind: std::io::ErrorKind },
    #[error("expected a Gmsh file of format 4.1, found `{found}`; save it with `Mesh.MshFileVersion = 4.1`")]
    Version { found: String },
    #[error("byte {offset}: expected format 4.1, found an error in {place}; save the mesh again")]
    Syntax { offset: usize, place: String },
    #[error("expected a section `${section}`, found none; save a meshed model with physical groups from Gmsh itself")]
    MissingSection { section: &'static str },
    #[error("expected a unit of positive length in m, found {found:e}")]
    Unit { found: f64 },
    #[error("element {element}: expected nodes of the file, found number {node}; save the mesh again")]
    UnknownNode { element: u64, node: u64 },
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m: expected quadratic elements, found one with {nodes} nodes; \
         mesh with `Mesh.ElementOrder = 2`"
    )]
    Linear { element: u64, r: f64, z: f64, nodes: usize },
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m: expected 8 nodes, found a ninth in the centre; mesh with \
         `Mesh.SecondOrderIncomplete = 1`"
    )]
    NineNodes { element: u64, r: f64, z: f64 },
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m: expected triangles of 6 or quadrilaterals of 8 nodes in the half-plane \
         x = r, y = z, found {found}; mesh the section only, with `Mesh.ElementOrder = 2`"
    )]
    Unsupported { element: u64, r: f64, z: f64, found: String },
    #[error("expected surface elements, found none; put the surface into a physical group and mesh it")]
    NoElements,
    #[error(
        "node {node} at x = {r:.6e} m, y = {z:.6e} m: expected x = r ≥ 0, found a point beyond the axis; move the section to x ≥ 0"
    )]
    BeyondAxis { node: u64, r: f64, z: f64 },
    #[error(
        "node {node} at x = {r:.6e} m, y = {z:.6e} m: expected the plane z = 0 of the file, found its third coordinate {third:.6e} m; \
         the section lies in x = r, y = z"
    )]
    OffPlane { node: u64, r: f64, z: f64, third: f64 },
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m: expected a positive Jacobian determinant, found {determinant:.3e} m²; \
         refine the curved side there or mesh with `Mesh.HighOrderOptimize = 2`"
    )]
    NegativeJacobian { element: u64, r: f64, z: f64, determinant: f64 },
    #[error(
        "elements {element} and {other} overlap at r = {r:.6e} m, z = {z:.6e} m; one file holds one body: cut overlapping surfaces with \
         `BooleanFragments`, and mesh every surface once"
    )]
    Overlap { element: u64, other: u64, r: f64, z: f64 },
    #[error(
        "nodes {node} and {other} lie both at r = {r:.6e} m, z = {z:.6e} m: expected one node; join the surfaces with `Coherence` or the \
         mesh with `Coherence Mesh`"
    )]
    Coincident { node: u64, other: u64, r: f64, z: f64 },
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m is not connected with element {other}: expected one body; give every body its \
         own file, and join parts of one body with `Coherence`"
    )]
    Separate { element: u64, other: u64, r: f64, z: f64 },
    #[error(
        "physical curve {group} through r = {r:.6e} m, z = {z:.6e} m has no name: expected `front`, `back`, `contact` or `clamped`; \
         write `Physical Curve(\"front\") = {{…}};`"
    )]
    UnnamedBoundary { group: i32, r: f64, z: f64 },
    #[error(
        "expected a physical curve named `front`, `back` or `contact`, found {found:?}; name the curves that may touch, as in \
         `Physical Curve(\"front\") = {{…}};`"
    )]
    NoContactBoundary { found: Vec<String> },
    #[error(
        "boundary `{boundary}`, line element {element} at r = {r:.6e} m, z = {z:.6e} m: expected an outer side of one surface element, \
         found one of {sides}; name curves of the body's own surface"
    )]
    NotOnSurface { boundary: String, element: u64, r: f64, z: f64, sides: usize },
    #[error(
        "boundary `{boundary}` at r = {r:.6e} m, z = {z:.6e} m: expected one connected curve with two ends, found {found}; give every \
         piece a name of its own"
    )]
    NotOneCurve { boundary: String, r: f64, z: f64, found: &'static str },
    #[error(
        "surface {surface} belongs to physical groups {groups:?}: expected one at most, the material; take it out of the others"
    )]
    AmbiguousMaterial { surface: i32, groups: Vec<i32> },
    #[error("expected at most {most} {what}, found {found}; mesh more coarsely")]
    TooMany { what: &'static str, most: usize, found: usize },
}
