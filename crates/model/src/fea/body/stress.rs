//! Stress at the nodes of a body.

use super::Body;
use crate::fea::{
    assembly::Columns,
    element::{node_stress, von_mises},
};

/// Stress at the nodes, averaged over the elements of each material: across an interface of materials it may jump.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalStress {
    nodes: usize,
    /// By material, then node: sum of stress and number of elements, then mean.
    stress: Vec<[f64; 4]>,
    elements: Vec<u32>,
}

impl NodalStress {
    /// (rr, zz, θθ, rz) at a node in a material, Pa, tension positive; none where the material does not reach the node.
    pub fn at(&self, node: u32, material: u16) -> Option<[f64; 4]> {
        let place = usize::from(material) * self.nodes + node as usize;
        (*self.elements.get(place)? > 0).then(|| self.stress[place])
    }

    /// Von Mises' stress at a node, Pa: the largest of the materials that meet there.
    pub fn von_mises(&self, node: u32) -> f64 {
        (0..self.stress.len() / self.nodes.max(1))
            .filter_map(|material| self.at(node, material as u16))
            .map(von_mises)
            .fold(0.0, f64::max)
    }
}

impl Body {
    pub fn stress(&self, u: &Columns, column: usize) -> NodalStress {
        let nodes = self.mesh.nodes.len();
        let mut stress = vec![[0.0; 4]; nodes * self.materials.len()];
        let mut elements = vec![0; stress.len()];
        for element in &self.mesh.elements {
            let mut places = [[0.0; 2]; 8];
            let mut displacement = [[0.0; 2]; 8];
            for (k, &node) in element.nodes().iter().enumerate() {
                places[k] = self.mesh.nodes[node as usize];
                displacement[k] = [0, 1].map(|d| u.get(2 * node as usize + d, column));
            }
            let count = element.nodes().len();
            let material = usize::from(element.material);
            let at = node_stress(element.shape, &places[..count], &self.materials[material], &displacement[..count]);
            for (&node, part) in element.nodes().iter().zip(at) {
                let place = material * nodes + node as usize;
                elements[place] += 1;
                for (sum, part) in stress[place].iter_mut().zip(part) {
                    *sum += part;
                }
            }
        }
        for (stress, &count) in stress.iter_mut().zip(&elements) {
            *stress = stress.map(|sum| sum / f64::from(count.max(1)));
        }
        NodalStress { nodes, stress, elements }
    }
}
