//! The fields of an analysis at one instant.

use std::sync::Arc;

use super::{Simulation, arrangement::Arrangement, element::von_mises};
use crate::response::{Field, FieldBody, FieldMesh};

#[derive(Debug, Clone)]
pub struct Frames {
    meshes: Vec<Arc<FieldMesh>>,
}

impl Frames {
    pub fn new(arrangement: &Arrangement) -> Self {
        Self { meshes: arrangement.kinds.iter().map(|kind| Arc::new(kind.mesh().to_field_mesh())).collect() }
    }

    /// Displacement, velocity and stress of all bodies now, beads first, then the support.
    ///
    /// Bodies stand where they just touch. The velocity of a node without mass is its displacement in the last step over the step.
    pub fn field(&self, simulation: &Simulation) -> Field {
        let arrangement = simulation.arrangement();
        let slots = 1..=arrangement.beads.len() + 1;
        let bodies = slots.filter_map(|slot| {
            let kind = arrangement.kind(slot)?;
            let name = if slot > arrangement.beads.len() { "support".to_owned() } else { format!("bead{slot}") };
            let mut body = FieldBody::at_rest(name, Arc::clone(&self.meshes[kind]), arrangement.origins[slot - 1]);
            let (displacement, velocity, column) = simulation.motion().columns(slot)?;
            let nodes = arrangement.kinds[kind].mesh().nodes.len();
            let pairs = |columns: &super::assembly::Columns| {
                (0..nodes).map(|node| [0, 1].map(|d| columns.get(2 * node + d, column))).collect::<Vec<_>>()
            };
            body.displacement = pairs(displacement);
            body.velocity = pairs(velocity);
            body.stress = arrangement.kinds[kind].stress(displacement, column);
            body.von_mises = body.stress.iter().map(|stress| von_mises(*stress)).collect();
            Some(body)
        });
        Field { time: simulation.time(), bodies: bodies.collect() }
    }
}
