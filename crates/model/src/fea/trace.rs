//! What is recorded of a run.

use super::{
    arrangement::Arrangement,
    assembly::{Direction, DofMap},
    contact::{chain::ContactState, pair::Pair},
    energy::EnergyTerms,
    motion::Motion,
};
use crate::{
    response::{ObservedPoint, Recorder, Response, push},
    scene::Scene,
};
use granchain_signal::Series;

/// Series taken at the samples; the far pole is followed at every step.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Trace {
    sampling: Sampling,
    #[serde(flatten)]
    columns: Recorder,
    pole: Vec<f64>,
}

/// Steps and samples of a run: a whole number of steps a sample.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Sampling {
    /// Interval of the samples, s.
    pub output_step: f64,
    pub steps_per_sample: usize,
    /// Samples, the one at the start included.
    pub samples: usize,
}

impl Sampling {
    /// Of a scene, with the step nearest the wanted one (s) that divides the scene's output step.
    pub(crate) fn new(scene: &Scene, wanted: f64) -> Self {
        let output_step = scene.output_step;
        let steps_per_sample = (output_step / wanted).round().max(1.0) as usize;
        Self { output_step, steps_per_sample, samples: scene.samples() }
    }

    pub(crate) fn step(&self) -> f64 {
        self.output_step / self.steps_per_sample as f64
    }

    pub(crate) fn steps(&self) -> usize {
        (self.samples - 1) * self.steps_per_sample
    }
}

/// Velocity (m/s) at every sample from displacements (m) at every step: central differences over two steps, one-sided at the ends.
pub(crate) fn central_velocity(steps: &[f64], sampling: &Sampling, samples: usize) -> Vec<f64> {
    let last = steps.len().saturating_sub(1);
    let at = |sample: usize| {
        let here = sample * sampling.steps_per_sample;
        let (a, b) = (here.saturating_sub(1), (here + 1).min(last));
        if b > a { (steps[b] - steps[a]) / ((b - a) as f64 * sampling.step()) } else { 0.0 }
    };
    (0..samples).map(at).collect()
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Watched {
    /// Axial unknown of every bead's centre.
    pub centres: Vec<u32>,
    /// Axial unknown of the last bead's far pole.
    pub pole: u32,
    /// Which of the last bead's a laser looks at.
    pub observed: ObservedPoint,
}

impl Watched {
    /// Centres (the axis node nearest the middle between the poles) and the far pole.
    pub(crate) fn new(arrangement: &Arrangement) -> Self {
        let centres = arrangement.beads.iter().map(|&kind| axis_node(arrangement, kind, 0.5)).collect();
        let pole = arrangement.beads.last().map_or(0, |&kind| axis_node(arrangement, kind, 1.0));
        let observed =
            ObservedPoint::of(arrangement.support.is_none() && arrangement.front.is_none() && !arrangement.free);
        Self { centres, pole, observed }
    }
}

/// Axial unknown of the axis node nearest a fraction of the way from front pole to back pole.
fn axis_node(arrangement: &Arrangement, kind: usize, fraction: f64) -> u32 {
    let mesh = arrangement.kinds[kind].mesh();
    let (front, back) = mesh.poles();
    let wanted = front + fraction * (back - front);
    let nearest = mesh
        .nodes
        .iter()
        .enumerate()
        .filter(|(_, place)| place[0] == 0.0)
        .min_by(|(_, a), (_, b)| (a[1] - wanted).abs().total_cmp(&(b[1] - wanted).abs()));
    DofMap::dof(nearest.map_or(0, |(node, _)| node as u32), Direction::Axial)
}

/// Contact radius, m: half-way between the last pressed point and the next at a pole, half the width of the pressed band on a ring.
pub(crate) fn contact_radius(pair: &Pair, state: &ContactState) -> f64 {
    let Some(last) = state.forces.iter().rposition(|&force| force > 0.0) else { return 0.0 };
    let first = state.forces.iter().position(|&force| force > 0.0).unwrap_or(0);
    edge_radius(&pair.positions, pair.is_on_ring(), [first, last + 1])
}

/// The same, m, from where the points lie (m), whether it is a ring, and the points from the first pressed to behind the last.
pub(crate) fn edge_radius(positions: &[f64], is_ring: bool, [first, end]: [usize; 2]) -> f64 {
    let edge = |inner: usize, outer: usize| 0.5 * (positions[inner] + positions[outer]);
    let outer = edge(end - 1, end.min(positions.len() - 1));
    if is_ring { 0.5 * (outer - edge(first, first.saturating_sub(1))).abs() } else { outer }
}

impl Trace {
    pub(crate) fn new(arrangement: &Arrangement, sampling: Sampling) -> Self {
        let columns = Recorder::new(sampling.samples, arrangement.beads.len(), true);
        Self { sampling, columns, pole: Vec::with_capacity(sampling.steps() + 1) }
    }

    /// Whether this is the trace of the same run as `other`, after so many steps.
    pub(super) fn is_of(&self, other: &Self, steps: usize) -> bool {
        let samples = steps / self.sampling.steps_per_sample.max(1) + 1;
        let groups = |Recorder { displacement, velocity, force, radius, .. }: &Recorder| {
            [displacement, velocity, force, radius].map(Vec::len)
        };
        let Recorder { piston, displacement, velocity, force, radius } = &self.columns;
        let all = [displacement, velocity, force, radius].into_iter().flatten();
        self.sampling == other.sampling
            && groups(&self.columns) == groups(&other.columns)
            && all.chain([piston]).all(|column| column.len() == samples)
            && self.pole.len() == steps + 1
    }

    /// Follow the far pole by one step.
    pub(crate) fn follow(&mut self, watched: &Watched, motion: &Motion) {
        let last = watched.centres.len();
        self.pole.push(motion.displacement(last, watched.pole));
    }

    pub(crate) fn sample(
        &mut self,
        arrangement: &Arrangement,
        watched: &Watched,
        motion: &Motion,
        piston: f64,
        contacts: &[ContactState],
    ) {
        let Recorder { piston: face, displacement, velocity, force, radius } = &mut self.columns;
        face.push(piston);
        let centres = || (1..).zip(&watched.centres);
        push(displacement, centres().map(|(slot, &unknown)| motion.displacement(slot, unknown)));
        push(velocity, centres().map(|(slot, &unknown)| motion.velocity(slot, unknown)));
        push(force, contacts.iter().map(ContactState::total));
        let pairs = arrangement.contacts.iter().map(|&pair| &arrangement.pairs[pair]);
        push(radius, pairs.zip(contacts).map(|(pair, state)| contact_radius(pair, state)));
    }

    pub(crate) fn forces(&self) -> Vec<Series> {
        let series = |values: &Vec<f64>| Series::new(0.0, self.sampling.output_step, values.clone());
        self.columns.force.iter().map(series).collect()
    }

    pub(crate) fn samples(&self) -> usize {
        self.columns.piston.len()
    }

    /// The response. The far pole may carry no mass, so its velocity is the central difference of its displacement over two steps.
    pub(crate) fn response(&self, watched: &Watched, balance: &EnergyTerms) -> Response {
        let pole = central_velocity(&self.pole, &self.sampling, self.samples());
        let Sampling { output_step, .. } = self.sampling;
        self.columns.clone().response(output_step, Some(pole), watched.observed, balance.energy_balance(), balance.work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        fea::{contact::complementarity::Ordering, operator::Interfaces},
        scene::{self, Scene},
    };

    fn pair(positions: &[f64], ring: bool) -> Pair {
        let scene = scene();
        let arrangement = Arrangement::new(&scene).unwrap();
        let mut pair = arrangement.pairs[if ring { arrangement.pairs.len() - 1 } else { 0 }].clone();
        pair.positions = positions.to_vec();
        pair.gaps = vec![0.0; positions.len()];
        assert_eq!(pair.is_on_ring(), ring);
        assert_eq!(pair.ordering == Ordering::Any, ring);
        pair
    }

    fn scene() -> Scene {
        scene::load("annulus", &["model.kind=fea".into(), "model.mesh_density=4".into()]).unwrap()
    }

    fn pressed(forces: &[f64]) -> ContactState {
        ContactState { forces: forces.to_vec(), ..ContactState::open(forces.len()) }
    }

    #[test]
    fn the_edge_of_a_contact_lies_half_way_from_the_last_pressed_point_to_the_next() {
        let pole = pair(&[1e-6, 2e-6, 4e-6, 7e-6], false);
        assert_eq!(contact_radius(&pole, &pressed(&[0.0; 4])), 0.0);
        assert!((contact_radius(&pole, &pressed(&[1.0, 0.5, 0.0, 0.0])) - 3e-6).abs() < 1e-18);
        let ring = pair(&[-4e-6, -1e-6, 1e-6, 3e-6], true);
        assert!((contact_radius(&ring, &pressed(&[0.0, 1.0, 1.0, 0.0])) - 0.5 * (2e-6 + 2.5e-6)).abs() < 1e-18);
    }

    #[test]
    fn centres_and_the_far_pole_are_watched_where_they_are() {
        let arrangement = Arrangement::new(&scene()).unwrap();
        let watched = Watched::new(&arrangement);
        let place = |bead: usize, unknown: u32| {
            let (node, direction) = DofMap::place(unknown);
            assert_eq!(direction, Direction::Axial);
            arrangement.kinds[arrangement.beads[bead]].mesh().nodes[node as usize]
        };
        for (bead, &unknown) in watched.centres.iter().enumerate() {
            assert_eq!(place(bead, unknown), [0.0, 0.0]);
        }
        assert_eq!(place(5, watched.pole), [0.0, 0.5e-3]);
    }

    #[test]
    fn the_poles_velocity_is_the_central_difference_of_every_step_at_the_samples() {
        let arrangement = Arrangement::new(&scene()).unwrap();
        let interfaces = Interfaces::new(&arrangement);
        let watched = Watched::new(&arrangement);
        let motion = Motion::at_rest(&arrangement, &interfaces, &vec![None; 8]);
        let mut trace = Trace::new(&arrangement, Sampling { output_step: 2e-7, steps_per_sample: 2, samples: 3 });
        let open: Vec<_> =
            arrangement.contacts.iter().map(|&pair| ContactState::open(arrangement.pairs[pair].len())).collect();
        (0..3).for_each(|_| trace.sample(&arrangement, &watched, &motion, 1e-6, &open));
        // z = 3 t² at steps of 0.1 µs: 6 t is met by the central difference, the ends are one-sided.
        trace.pole = (0..5).map(|i| 3.0 * (1e-7 * f64::from(i)).powi(2)).collect();
        let response = trace.response(&watched, &EnergyTerms::default());
        let expected = [3e-7, 12e-7, 3.0 * 7e-7];
        for (found, expected) in response.pole_velocity.values.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-18, "{found:e} {expected:e}");
        }
        assert_eq!((trace.samples(), response.piston_displacement.values), (3, vec![1e-6; 3]));
    }
}
