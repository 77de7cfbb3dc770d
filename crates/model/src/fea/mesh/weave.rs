//! Putting a mesh together from vertices: the middle of every side is made once and shared by both its elements.

use std::collections::BTreeMap;

use super::{Boundary, Element, Mesh};

#[derive(Default)]
pub(super) struct Weave {
    nodes: Vec<[f64; 2]>,
    middles: BTreeMap<(u32, u32), u32>,
    elements: Vec<Element>,
    boundaries: Vec<Boundary>,
}

impl Weave {
    pub(crate) fn vertex(&mut self, place: [f64; 2]) -> u32 {
        self.nodes.push(place);
        (self.nodes.len() - 1) as u32
    }

    pub(crate) fn place(&self, node: u32) -> [f64; 2] {
        self.nodes[node as usize]
    }

    pub(crate) fn curve(&mut self, a: u32, b: u32, place: [f64; 2]) {
        let node = self.vertex(place);
        let before = self.middles.insert((a.min(b), a.max(b)), node);
        debug_assert!(before.is_none(), "the side {a}–{b} has a middle already");
    }

    /// The middle node of the side a–b, straight unless [`Weave::curve`] said otherwise.
    fn middle(&mut self, a: u32, b: u32) -> u32 {
        let side = (a.min(b), a.max(b));
        if let Some(node) = self.middles.get(&side) {
            return *node;
        }
        let ([r0, z0], [r1, z1]) = (self.place(a), self.place(b));
        let node = self.vertex([0.5 * (r0 + r1), 0.5 * (z0 + z1)]);
        self.middles.insert(side, node);
        node
    }

    pub(crate) fn quadrilateral(&mut self, mut corners: [u32; 4]) {
        let area: f64 = (0..4)
            .map(|i| (self.place(corners[i]), self.place(corners[(i + 1) % 4])))
            .map(|([r0, z0], [r1, z1])| r0 * z1 - r1 * z0)
            .sum();
        if area < 0.0 {
            corners[1..].reverse();
        }
        let mut nodes = [0; 8];
        for i in 0..4 {
            nodes[i] = corners[i];
            nodes[4 + i] = self.middle(corners[i], corners[(i + 1) % 4]);
        }
        self.elements.push(nodes);
    }

    pub(crate) fn boundary(&mut self, name: &str, vertices: &[u32]) {
        let mut nodes = vertices[..1].to_vec();
        for side in vertices.windows(2) {
            nodes.extend([self.middle(side[0], side[1]), side[1]]);
        }
        self.boundaries.push(Boundary { name: name.to_owned(), nodes });
    }

    /// Add the mirror image at the plane z = 0, sharing the nodes on it; `rename` names the image of a boundary.
    ///
    /// The image differs from the original in the sign of z and in nothing else.
    pub(crate) fn mirrored(mut self, rename: impl Fn(&str) -> String) -> Self {
        let original = self.nodes.len();
        let image: Vec<u32> = (0..original)
            .map(|node| {
                let [r, z] = self.nodes[node];
                if z == 0.0 { node as u32 } else { self.vertex([r, -z]) }
            })
            .collect();
        for index in 0..self.elements.len() {
            // Corners 1, 4, 3, 2 and the middles between them keep the sense of rotation.
            let mirrored = [0, 3, 2, 1, 7, 6, 5, 4].map(|i| image[self.elements[index][i] as usize]);
            self.elements.push(mirrored);
        }
        for index in 0..self.boundaries.len() {
            let Boundary { name, nodes } = &self.boundaries[index];
            let nodes = nodes.iter().map(|node| image[*node as usize]).collect();
            self.boundaries.push(Boundary { name: rename(name), nodes });
        }
        self
    }

    pub(crate) fn finish(self) -> Mesh {
        Mesh { nodes: self.nodes, elements: self.elements, boundaries: self.boundaries }
    }
}
