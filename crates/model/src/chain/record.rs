//! The run on the scene's output grid.

use super::{
    dormand_prince::{Clock, Stepper},
    equation::Equation,
    system::System,
};
use crate::{
    contact_law::{ElasticLaw, Terms},
    response::{EnergyBalance, ObservedPoint, Recorder, Response, SolverWork},
    scene::{PistonMotion, Scene},
};

/// Samples that are gathered before they go into their series: a cache line of each.
const BLOCK: usize = 8;

/// Collects every series of a response; its buffers are allocated once.
///
/// A sample of a long chain belongs into thousands of series, each in memory of its own. So samples are put side by side, and every few of
/// them go into the series together.
#[derive(Debug)]
pub(super) struct Grid {
    step: f64,
    padded: usize,
    columns: Recorder,
    piston_velocity: Vec<f64>,
    taken: usize,
    /// The last samples, one behind the other: displacements and velocities, then forces.
    block: Vec<[f64; 4]>,
    /// Rows of displacements and velocities in each.
    moment: usize,
    held: usize,
}

impl Grid {
    /// Instants 0, step, 2 step … up to the scene's duration, with the piston sampled at all of them.
    pub(crate) fn new(scene: &Scene, system: &System, motion: &dyn PistonMotion) -> Self {
        let samples = scene.samples();
        let times: Vec<f64> = (0..samples).map(|i| i as f64 * scene.output_step).collect();
        let mut columns = Recorder { piston: vec![0.0; samples], ..Recorder::new(samples, system.beads, false) };
        let mut piston_velocity = vec![0.0; samples];
        motion.sample(&times, &mut columns.piston, &mut piston_velocity);
        Self {
            step: scene.output_step,
            padded: system.padded,
            columns,
            piston_velocity,
            taken: 0,
            block: system.moment().repeat(2 * BLOCK),
            moment: system.moment().len(),
            held: 0,
        }
    }

    /// Instant of the last sample, s.
    pub(crate) fn end(&self) -> f64 {
        (self.columns.piston.len() - 1) as f64 * self.step
    }

    /// Largest speed of the piston at the samples, m/s.
    pub(crate) fn piston_speed(&self) -> f64 {
        self.piston_velocity.iter().fold(0.0, |speed, v| f64::max(speed, v.abs()))
    }

    #[inline(always)]
    fn sample(&mut self) -> (&mut [[f64; 4]], &mut [[f64; 4]]) {
        self.block[2 * self.held * self.moment..][..2 * self.moment].split_at_mut(self.moment)
    }

    #[inline(always)]
    pub(crate) fn store<const DAMPED: Terms, L: ElasticLaw>(&mut self, equation: &mut Equation<'_, DAMPED, L>) {
        let (sample, padded) = (self.taken, self.padded);
        let piston = (self.columns.piston[sample], self.piston_velocity[sample]);
        let (state, forces) = self.sample();
        let state = state.as_flattened_mut();
        (state[0], state[padded]) = piston;
        if L::HAS_EFFECTS {
            equation.add_horn_motion(state);
            equation.relax(state, None);
        }
        let (u, v) = state.split_at(padded);
        let force = equation.contact_forces(u, &v[..padded]);
        for (out, force) in forces.as_flattened_mut().iter_mut().zip(force) {
            *out = *force;
        }
        if L::HAS_EFFECTS {
            self.columns.piston[sample] = u[0];
        }
        self.held += 1;
        self.taken += 1;
        if self.held == BLOCK {
            self.sort_in();
        }
    }

    #[inline(never)]
    fn sort_in(&mut self) {
        let (width, held, block) = (8 * self.moment, self.held, self.block.as_flattened());
        let Recorder { displacement, velocity, force, .. } = &mut self.columns;
        let blocks = [(1, displacement), (1 + self.padded, velocity), (4 * self.moment, force)];
        for (first, series) in blocks {
            for (place, series) in (first..).zip(series) {
                series.extend((0..held).map(|sample| block[sample * width + place]));
            }
        }
        self.held = 0;
    }

    pub(crate) fn is_full(&self) -> bool {
        self.taken == self.columns.piston.len()
    }

    /// Whether the continuous extension of a step up to `to` (s) is needed.
    #[inline(always)]
    pub(crate) fn wants(&self, to: f64) -> bool {
        !self.is_full() && self.next_time() <= to
    }

    /// Take the samples of an extended step from its start up to `to` (s).
    #[inline(always)]
    pub(crate) fn take<const DAMPED: Terms, L: ElasticLaw>(
        &mut self,
        equation: &mut Equation<'_, DAMPED, L>,
        stepper: &Stepper,
        clock: &Clock,
        to: f64,
    ) {
        while self.wants(to) {
            stepper.values(clock.sigma(self.next_time()), self.buffer());
            self.store(equation);
        }
    }

    pub(crate) fn begin<const DAMPED: Terms, L: ElasticLaw>(
        &mut self,
        equation: &mut Equation<'_, DAMPED, L>,
        state: &[f64],
    ) {
        let buffer = self.buffer().as_flattened_mut();
        buffer.copy_from_slice(&state[..buffer.len()]);
        self.store(equation);
    }

    /// Instant of the next sample, s.
    pub(crate) fn next_time(&self) -> f64 {
        self.taken as f64 * self.step
    }

    /// Where the next sample's displacements and velocities are to be put before [`Grid::store`].
    pub(crate) fn buffer(&mut self) -> &mut [[f64; 4]] {
        self.sample().0
    }

    pub(crate) fn response(mut self, observed: ObservedPoint, energy: EnergyBalance, work: SolverWork) -> Response {
        self.sort_in();
        let Recorder { piston, displacement, velocity, force, .. } = &mut self.columns;
        for column in [displacement, velocity, force].into_iter().flatten() {
            column.resize(piston.len(), 0.0);
        }
        self.columns.response(self.step, None, observed, energy, work)
    }
}
