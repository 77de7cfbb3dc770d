//! Why a Gmsh file is refused: what, where, and the remedy.

use thiserror::Error;

/// Why a Gmsh file is refused. Nodes and elements go by their numbers in the file, places are in metres after scaling.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum GmshError {
    /// The file could not be read.
    #[error("the file cannot be read ({kind})")]
    Unreadable {
        /// What the file system said.
        kind: std::io::ErrorKind,
    },
    /// The first section is not that of a mesh file of this version.
    #[error("expected a Gmsh file of format 4.1, found `{found}`; save it with `Mesh.MshFileVersion = 4.1`")]
    Version {
        /// First lines of the file.
        found: String,
    },
    /// The file does not follow its format.
    #[error("byte {offset}: expected format 4.1, found an error in {place}; save the mesh again")]
    Syntax {
        /// Where in the file.
        offset: usize,
        /// What was being read, outermost first.
        place: String,
    },
    /// A section is missing.
    #[error("expected a section `${section}`, found none; save a meshed model with physical groups from Gmsh itself")]
    MissingSection {
        /// Name of the section.
        section: &'static str,
    },
    /// The length of the unit is no length.
    #[error("expected a unit of positive length in m, found {found:e}")]
    Unit {
        /// What was given.
        found: f64,
    },
    /// A node number that no node has.
    #[error("element {element}: expected nodes of the file, found number {node}; save the mesh again")]
    UnknownNode {
        /// Which element.
        element: u64,
        /// The number.
        node: u64,
    },
    /// An element without middle nodes.
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m: expected quadratic elements, found one with {nodes} nodes; \
         mesh with `Mesh.ElementOrder = 2`"
    )]
    Linear {
        /// Which element.
        element: u64,
        /// Where its first node lies, m.
        r: f64,
        /// Where its first node lies, m.
        z: f64,
        /// Number of its nodes.
        nodes: usize,
    },
    /// A quadrilateral with a node in its centre.
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m: expected 8 nodes, found a ninth in the centre; mesh with \
         `Mesh.SecondOrderIncomplete = 1`"
    )]
    NineNodes {
        /// Which element.
        element: u64,
        /// Where its first node lies, m.
        r: f64,
        /// Where its first node lies, m.
        z: f64,
    },
    /// An element that is none of the analysis.
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m: expected triangles of 6 or quadrilaterals of 8 nodes in the half-plane \
         x = r, y = z, found {found}; mesh the section only, with `Mesh.ElementOrder = 2`"
    )]
    Unsupported {
        /// Which element.
        element: u64,
        /// Where its first node lies, m.
        r: f64,
        /// Where its first node lies, m.
        z: f64,
        /// Gmsh's name of its type.
        found: String,
    },
    /// There is nothing to compute with.
    #[error("expected surface elements, found none; put the surface into a physical group and mesh it")]
    NoElements,
    /// A node outside the half-plane.
    #[error(
        "node {node} at x = {r:.6e} m, y = {z:.6e} m: expected x = r ≥ 0, found a point beyond the axis; move the section to x ≥ 0"
    )]
    BeyondAxis {
        /// Which node.
        node: u64,
        /// Its x, m.
        r: f64,
        /// Its y, m.
        z: f64,
    },
    /// A node off the plane.
    #[error(
        "node {node} at x = {r:.6e} m, y = {z:.6e} m: expected the plane z = 0 of the file, found its third coordinate {third:.6e} m; \
         the section lies in x = r, y = z"
    )]
    OffPlane {
        /// Which node.
        node: u64,
        /// Its x, m.
        r: f64,
        /// Its y, m.
        z: f64,
        /// Its third coordinate, m.
        third: f64,
    },
    /// An element that is turned inside out somewhere.
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m: expected a positive Jacobian determinant, found {determinant:.3e} m²; \
         refine the curved side there or mesh with `Mesh.HighOrderOptimize = 2`"
    )]
    NegativeJacobian {
        /// Which element.
        element: u64,
        /// Where it is negative, m.
        r: f64,
        /// Where it is negative, m.
        z: f64,
        /// Determinant, m² a unit area of the reference element.
        determinant: f64,
    },
    /// Two elements cover the same place.
    #[error(
        "elements {element} and {other} overlap at r = {r:.6e} m, z = {z:.6e} m; one file holds one body: cut overlapping surfaces with \
         `BooleanFragments`, and mesh every surface once"
    )]
    Overlap {
        /// One of them.
        element: u64,
        /// The other.
        other: u64,
        /// Where, m.
        r: f64,
        /// Where, m.
        z: f64,
    },
    /// Two nodes at one place: surfaces that touch but are not joined.
    #[error(
        "nodes {node} and {other} lie both at r = {r:.6e} m, z = {z:.6e} m: expected one node; join the surfaces with `Coherence` or the \
         mesh with `Coherence Mesh`"
    )]
    Coincident {
        /// One of them.
        node: u64,
        /// The other.
        other: u64,
        /// Where, m.
        r: f64,
        /// Where, m.
        z: f64,
    },
    /// Parts that do not hang together.
    #[error(
        "element {element} at r = {r:.6e} m, z = {z:.6e} m is not connected with element {other}: expected one body; give every body its \
         own file, and join parts of one body with `Coherence`"
    )]
    Separate {
        /// An element of a second part.
        element: u64,
        /// An element of the first part.
        other: u64,
        /// Where the element's first node lies, m.
        r: f64,
        /// Where the element's first node lies, m.
        z: f64,
    },
    /// A physical curve without name.
    #[error(
        "physical curve {group} through r = {r:.6e} m, z = {z:.6e} m has no name: expected `front`, `back`, `contact` or `clamped`; \
         write `Physical Curve(\"front\") = {{…}};`"
    )]
    UnnamedBoundary {
        /// Number of the physical group.
        group: i32,
        /// A node of it, m.
        r: f64,
        /// A node of it, m.
        z: f64,
    },
    /// No boundary can come into contact.
    #[error(
        "expected a physical curve named `front`, `back` or `contact`, found {found:?}; name the curves that may touch, as in \
         `Physical Curve(\"front\") = {{…}};`"
    )]
    NoContactBoundary {
        /// Names found.
        found: Vec<String>,
    },
    /// A line element of a boundary that is no outer side of a surface element.
    #[error(
        "boundary `{boundary}`, line element {element} at r = {r:.6e} m, z = {z:.6e} m: expected an outer side of one surface element, \
         found one of {sides}; name curves of the body's own surface"
    )]
    NotOnSurface {
        /// Name of the boundary.
        boundary: String,
        /// Which line element.
        element: u64,
        /// Its first node, m.
        r: f64,
        /// Its first node, m.
        z: f64,
        /// Number of surface elements it is a side of.
        sides: usize,
    },
    /// A boundary in several pieces, closed or branching.
    #[error(
        "boundary `{boundary}` at r = {r:.6e} m, z = {z:.6e} m: expected one connected curve with two ends, found {found}; give every \
         piece a name of its own"
    )]
    NotOneCurve {
        /// Name of the boundary.
        boundary: String,
        /// Where, m.
        r: f64,
        /// Where, m.
        z: f64,
        /// What it is instead.
        found: &'static str,
    },
    /// A surface in several physical groups.
    #[error(
        "surface {surface} belongs to physical groups {groups:?}: expected one at most, the material; take it out of the others"
    )]
    AmbiguousMaterial {
        /// Gmsh's number of the surface.
        surface: i32,
        /// Its groups.
        groups: Vec<i32>,
    },
    /// More than the analysis can count.
    #[error("expected at most {most} {what}, found {found}; mesh more coarsely")]
    TooMany {
        /// What is counted.
        what: &'static str,
        /// How many can be.
        most: usize,
        /// How many there are.
        found: usize,
    },
}
