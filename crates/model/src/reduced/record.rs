//! What is recorded of a run.

use super::{contact::State, stepping::Motion};
use crate::{
    fea::trace::{Sampling, edge_radius},
    number::Number,
    response::{EnergySums, ObservedPoint, Recorder, Response, SolverWork, empty_columns, push},
};

/// Velocities of watched places at the samples: of every bead's centre, and last of the far pole. They carry none of their own (their
/// flexibility is static): it is the central difference of their displacements over the two steps around the sample.
#[derive(Debug)]
pub(super) struct Follower<N> {
    sampling: Sampling,
    /// The first of the places that are followed, to the last.
    first: usize,
    pub(super) velocity: Vec<Vec<N>>,
    /// Displacements at this step, the last, and the one before, m.
    steps: [Vec<N>; 3],
}

impl<N: Number> Follower<N> {
    pub(super) fn new(sampling: Sampling, first: usize, beads: usize) -> Self {
        let places = beads + 1 - first;
        Self {
            sampling,
            first,
            velocity: empty_columns(places, sampling.samples),
            steps: std::array::from_fn(|_| vec![N::ZERO; places]),
        }
    }

    pub(super) fn follow<B>(&mut self, taken: usize, motion: &Motion<'_, N, B>) {
        let stride = self.sampling.steps_per_sample;
        if !matches!(taken % stride, 0 | 1) && taken % stride != stride - 1 {
            return;
        }
        self.steps.rotate_right(1);
        let (reduction, states) = (motion.reduction, &motion.states);
        let beads = reduction.beads.len();
        for (place, value) in (self.first..).zip(&mut self.steps[0]) {
            let bead = place.min(beads - 1);
            let watch = &motion.mechanics.watched[reduction.beads[bead]][place - bead];
            if let Some(body) = &motion.bodies[bead + 1] {
                let felt = |end: usize| motion.creep.as_ref().and_then(|creep| creep.felt(bead + 1, end));
                let [front, back] = [0, 1].map(|end| felt(end).unwrap_or(&states[bead + end].forces));
                *value = watch.displacement(body.rigid, &body.modal, front, back);
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
            self.velocity.iter_mut().for_each(|column| column.push(N::ZERO));
        }
    }

    fn push_velocity(&mut self, older: usize, time: f64) {
        for place in 0..self.velocity.len() {
            let velocity = self.over(place, older, time);
            self.velocity[place].push(velocity);
        }
    }

    /// Mean velocity of a place since the displacement `older` of the last three, `time` (s) ago.
    fn over(&self, place: usize, older: usize, time: f64) -> N {
        (self.steps[0][place] - self.steps[older][place]) / time
    }

    /// Velocity of the first place at the end of a run that ends with the step last followed.
    pub(super) fn at_the_end(&self) -> N {
        if self.sampling.steps() == 0 { N::ZERO } else { self.over(0, 1, self.sampling.step()) }
    }
}

#[derive(Debug)]
pub(super) struct Record {
    pub(super) follower: Follower<f64>,
    columns: Recorder,
}

impl Record {
    pub(super) fn new(sampling: Sampling, beads: usize) -> Self {
        Self { follower: Follower::new(sampling, 0, beads), columns: Recorder::new(sampling.samples, beads, true) }
    }

    pub(super) fn sample<B>(&mut self, motion: &Motion<'_, f64, B>) {
        let Recorder { piston, displacement, force, radius, .. } = &mut self.columns;
        piston.push(motion.piston);
        push(displacement, self.follower.steps[0].iter().copied());
        push(force, motion.states.iter().map(State::total));
        let geometries = motion.reduction.contacts.iter().map(|&pair| &motion.reduction.geometries[pair]);
        let pressed = geometries.zip(&motion.states).map(|(geometry, state)| match state.is_pressed() {
            true => edge_radius(&geometry.positions, geometry.is_ring, state.pressed),
            false => 0.0,
        });
        push(radius, pressed);
    }

    pub(super) fn response(self, observed: ObservedPoint, balance: &EnergySums, work: SolverWork) -> Response {
        let output_step = self.follower.sampling.output_step;
        let mut velocity = self.follower.velocity;
        let pole = velocity.pop();
        Recorder { velocity, ..self.columns }.response(output_step, pole, observed, balance.balance(), work)
    }
}
