//! Stress at the nodes of a body.

use super::Body;
use crate::fea::{assembly::Columns, element::node_stress};

impl Body {
    /// (rr, zz, θθ, rz) at every node, averaged over its elements, Pa, tension positive.
    pub fn stress(&self, u: &Columns, column: usize) -> Vec<[f64; 4]> {
        let mut stress = vec![[0.0; 4]; self.mesh.nodes.len()];
        let mut elements = vec![0; stress.len()];
        for element in &self.mesh.elements {
            let displacement = element.map(|node| [0, 1].map(|d| u.get(2 * node as usize + d, column)));
            let at = node_stress(&self.mesh.places(element), &self.material, &displacement);
            for (&node, part) in element.iter().zip(at) {
                elements[node as usize] += 1;
                for (sum, part) in stress[node as usize].iter_mut().zip(part) {
                    *sum += part;
                }
            }
        }
        for (stress, &count) in stress.iter_mut().zip(&elements) {
            *stress = stress.map(|sum| sum / f64::from(count.max(1)));
        }
        stress
    }
}
