//! What is recorded of a run.

use super::{contact::State, mechanics::Mechanics, motion::Moving, reduction::Reduction};
use crate::{
    fea::{
        energy::Ledger,
        trace::{Sampling, edge_radius},
    },
    response::{ObservedPoint, Response},
};
use granchain_signal::Series;

/// Series taken at the samples. Centres and far pole carry no velocity of their own (their flexibility is static): it is the central
/// difference of their displacements over the two steps around the sample.
#[derive(Debug)]
pub(super) struct Record {
    sampling: Sampling,
    piston: Vec<f64>,
    displacement: Vec<Vec<f64>>,
    velocity: Vec<Vec<f64>>,
    force: Vec<Vec<f64>>,
    radius: Vec<Vec<f64>>,
    /// Displacements of the watched places at this step, the last, and the one before, m.
    steps: [Vec<f64>; 3],
}

impl Record {
    pub(super) fn new(sampling: Sampling, beads: usize) -> Self {
        let columns = |count: usize| (0..count).map(|_| Vec::with_capacity(sampling.samples)).collect();
        Self {
            sampling,
            piston: Vec::with_capacity(sampling.samples),
            displacement: columns(beads),
            velocity: columns(beads + 1),
            force: columns(beads + 1),
            radius: columns(beads + 1),
            steps: [const { Vec::new() }; 3].map(|_: Vec<f64>| vec![0.0; beads + 1]),
        }
    }

    /// Follow the watched places through step `taken`, where a sample needs it.
    pub(super) fn follow(
        &mut self,
        taken: usize,
        reduction: &Reduction,
        mechanics: &Mechanics,
        bodies: &[Option<Moving>],
        states: &[State],
    ) {
        let stride = self.sampling.steps_per_sample;
        if !matches!(taken % stride, 0 | 1) && taken % stride != stride - 1 {
            return;
        }
        self.steps.rotate_right(1);
        let beads = reduction.beads.len();
        for (place, value) in self.steps[0].iter_mut().enumerate() {
            let bead = place.min(beads - 1);
            let watch = &mechanics.watched[reduction.beads[bead]][place - bead];
            if let Some(body) = &bodies[bead + 1] {
                *value = watch.displacement(body.rigid, &body.modal, &states[bead].forces, &states[bead + 1].forces);
            }
        }
        let h = self.sampling.step();
        if taken % stride == 1 % stride && taken > 0 {
            // The step after a sample; the first sample has none before.
            let (older, time) = if taken == 1 { (1, h) } else { (2, 2.0 * h) };
            self.push_velocity(older, time);
        }
        if taken > 0 && taken == self.sampling.steps() {
            self.push_velocity(1, h);
        }
        if taken == 0 && self.sampling.steps() == 0 {
            self.velocity.iter_mut().for_each(|column| column.push(0.0));
        }
    }

    fn push_velocity(&mut self, older: usize, time: f64) {
        for (place, column) in self.velocity.iter_mut().enumerate() {
            column.push((self.steps[0][place] - self.steps[older][place]) / time);
        }
    }

    /// Take a sample.
    pub(super) fn sample(&mut self, piston: f64, reduction: &Reduction, states: &[State]) {
        self.piston.push(piston);
        for (column, value) in self.displacement.iter_mut().zip(&self.steps[0]) {
            column.push(*value);
        }
        for (contact, state) in states.iter().enumerate() {
            self.force[contact].push(state.total());
            let geometry = &reduction.geometries[reduction.contacts[contact]];
            let radius = if state.is_pressed() {
                edge_radius(&geometry.positions, geometry.is_ring, state.pressed)
            } else {
                0.0
            };
            self.radius[contact].push(radius);
        }
    }

    pub(super) fn response(self, observed: ObservedPoint, ledger: &Ledger) -> Response {
        let series = |values: Vec<f64>| Series::new(0.0, self.sampling.output_step, values);
        let all = |columns: Vec<Vec<f64>>| columns.into_iter().map(series).collect::<Vec<_>>();
        let mut velocity = all(self.velocity);
        let pole_velocity = velocity.pop().unwrap_or_else(|| series(Vec::new()));
        Response {
            piston_displacement: series(self.piston),
            bead_displacement: all(self.displacement),
            bead_velocity: velocity,
            pole_velocity,
            observed,
            contact_force: all(self.force),
            contact_radius: Some(all(self.radius)),
            disc: None,
            energy: ledger.books(),
            work: ledger.work,
        }
    }
}
