//! Putting a mesh together from vertices: the middle of every side is made once and shared by both its elements.

use std::collections::BTreeMap;

use super::{Boundary, Element, Mesh, Shape};

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

    fn element<const CORNERS: usize>(&mut self, shape: Shape, mut corners: [u32; CORNERS]) {
        let area: f64 = (0..CORNERS)
            .map(|i| (self.place(corners[i]), self.place(corners[(i + 1) % CORNERS])))
            .map(|([r0, z0], [r1, z1])| r0 * z1 - r1 * z0)
            .sum();
        if area < 0.0 {
            corners[1..].reverse();
        }
        let mut nodes = [0; 8];
        for i in 0..CORNERS {
            nodes[i] = corners[i];
            nodes[CORNERS + i] = self.middle(corners[i], corners[(i + 1) % CORNERS]);
        }
        self.elements.push(Element { shape, nodes, material: 0 });
    }

    pub(crate) fn quadrilateral(&mut self, corners: [u32; 4]) {
        self.element(Shape::Quadrilateral8, corners);
    }

    pub(crate) fn triangles(&mut self, [a, b, c, d]: [u32; 4]) {
        let square = |weave: &Self, a: u32, b: u32| {
            let ([r0, z0], [r1, z1]) = (weave.place(a), weave.place(b));
            (r1 - r0).powi(2) + (z1 - z0).powi(2)
        };
        let halves =
            if square(self, a, c) <= square(self, b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
        for half in halves {
            self.element(Shape::Triangle6, half);
        }
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
            let Element { shape, nodes, material } = self.elements[index];
            let corners = shape.corners();
            let mut mirrored = [0; 8];
            for i in 0..corners {
                // Corners 1, n, n − 1, … and the middles between them keep the sense of rotation.
                mirrored[i] = image[nodes[(corners - i) % corners] as usize];
                mirrored[corners + i] = image[nodes[2 * corners - 1 - i] as usize];
            }
            self.elements.push(Element { shape, nodes: mirrored, material });
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
