//! Figures of the meshes of a scene: the section of the whole chain, and its contacts closely.

mod section;

pub use section::{Window, chain, contacts};

use crate::figure::{Colour, extent};
use granchain_model::fea::mesh::{CLAMPED_BOUNDARY, CONTACT_BOUNDARIES, Mesh};

/// One body where it stands.
#[derive(Debug, Clone, Copy)]
pub struct Standing<'a> {
    /// What it is called in legends: equal names share one entry.
    pub name: &'a str,
    pub mesh: &'a Mesh,
    /// z of the origin of its coordinates, m; 0 is the piston's face.
    pub offset: f64,
}

impl Standing<'_> {
    /// Where a node stands: r and z, m.
    fn place(&self, node: u32) -> [f64; 2] {
        let [r, z] = self.mesh.nodes[node as usize];
        [r, z + self.offset]
    }
}

/// The bodies of a scene, and the rigid faces that hold them.
#[derive(Debug, Clone)]
pub struct Bench<'a> {
    /// The bodies, from the piston.
    pub bodies: Vec<Standing<'a>>,
    /// z of the rigid flat behind the last bead, if there is one, m.
    pub flat: Option<f64>,
}

/// Fills of bodies in the order of their first appearance.
const BODY_COLOURS: [(Colour, f64); 4] =
    [(Colour::SkyBlue, 0.28), (Colour::Orange, 0.32), (Colour::Green, 0.25), (Colour::Purple, 0.25)];
/// Fill of the piston and of rigid flats.
const RIGID: (Colour, f64) = (Colour::Grey, 0.45);

impl Bench<'_> {
    /// Names in the order of their first appearance.
    fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for body in &self.bodies {
            if !names.contains(&body.name) {
                names.push(body.name);
            }
        }
        names
    }

    fn colour(&self, name: &str) -> (Colour, f64) {
        let index = self.names().iter().position(|other| *other == name).unwrap_or(0);
        BODY_COLOURS[index % BODY_COLOURS.len()]
    }

    /// Smallest and largest (r, z) of all nodes, m.
    fn extent(&self) -> ([f64; 2], [f64; 2]) {
        let nodes = || self.bodies.iter().flat_map(|body| body.mesh.nodes.iter().map(|[r, z]| [*r, z + body.offset]));
        let [r, z] = [0, 1].map(|d| extent(nodes().map(|node| node[d])));
        ([r.0, z.0], [r.1, z.1])
    }

    /// Outlines (r, z) of the piston and of the rigid flat, anticlockwise, m.
    fn rigid_outlines(&self) -> Vec<[[f64; 2]; 4]> {
        let (_, [reach, _]) = self.extent();
        let (radius, thickness) = (1.1 * reach, 0.3 * reach);
        let plate = |low: f64| [[0.0, low], [radius, low], [radius, low + thickness], [0.0, low + thickness]];
        std::iter::once(plate(-thickness)).chain(self.flat.map(plate)).collect()
    }
}

/// A point of the quadratic side through `a`, `middle`, `b` at 0 ≤ t ≤ 1.
fn on_side(a: [f64; 2], middle: [f64; 2], b: [f64; 2], t: f64) -> [f64; 2] {
    let weights = [(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)];
    [0, 1].map(|d| weights[0] * a[d] + weights[1] * middle[d] + weights[2] * b[d])
}

/// Points along a side after its start, few where it is straight.
fn along_side(a: [f64; 2], middle: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
    let off = (middle[0] - 0.5 * (a[0] + b[0])).hypot(middle[1] - 0.5 * (a[1] + b[1]));
    let pieces = if off < 2e-3 * (b[0] - a[0]).hypot(b[1] - a[1]) { 1 } else { 6 };
    (1..=pieces)
        .map(|i| if i == pieces { b } else { on_side(a, middle, b, f64::from(i) / f64::from(pieces)) })
        .collect()
}

/// Nodes of the boundaries that may touch.
fn contact_nodes(mesh: &Mesh) -> Vec<u32> {
    let boundaries = CONTACT_BOUNDARIES.iter().filter_map(|name| mesh.boundary(name));
    boundaries.flat_map(|boundary| boundary.nodes.iter().copied()).collect()
}

/// Nodes of the clamped boundary.
fn clamped_nodes(mesh: &Mesh) -> &[u32] {
    mesh.boundary(CLAMPED_BOUNDARY).map_or(&[], |boundary| &boundary.nodes)
}
