//! The answer to a force at one instant: disc and water are linear, so this is all that a chain in front of them needs.

use super::OnWater;
use crate::{response::SolverWork, tally};

/// Displacement and pressure after a force that is 1 N at the first instant and 0 at all others, straight in between.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitResponse {
    /// Step Δ of the clock, s.
    pub step: f64,
    /// Displacement of the front where the force acts, m/N, at the instant of the force and after.
    pub pole: Vec<f64>,
    /// Velocity in the lowest modes there, m/s/N ([`OnWater::predicted_modal_velocity`]).
    pub modal: Vec<f64>,
    /// Velocity of the middle of the back, m/s/N.
    pub back: Vec<f64>,
    /// Pressure at each field point, Pa/N.
    pub pressure: Vec<Vec<f64>>,
}

impl UnitResponse {
    /// Record `instants` values from a disc at rest, at its first `points` field points.
    pub fn record(mut disc: impl OnWater, points: usize, instants: usize) -> Self {
        tally::add(|made| made.recorded_steps += instants as u64);
        let empty = || Vec::with_capacity(instants);
        let (pole, modal, back) = (empty(), empty(), empty());
        let mut out = Self { step: disc.step(), pole, modal, back, pressure: vec![empty(); points] };
        for instant in 0..instants {
            let force = if instant == 0 { 1.0 } else { 0.0 };
            disc.predict();
            out.modal.push(disc.predicted_modal_velocity() + force * disc.modal_compliance());
            disc.push(force);
            out.pole.push(disc.pole_displacement());
            out.back.push(disc.back_velocity());
            for (point, trace) in out.pressure.iter_mut().enumerate() {
                trace.push(disc.pressure(point));
            }
        }
        out
    }

    /// The recorded disc, at rest, for a run of at most as many steps as there are values.
    pub(crate) fn played(&self) -> Played<'_> {
        Played {
            response: self,
            forces: Vec::with_capacity(self.pole.len()),
            // Between two spans lies an instant without a force.
            pressed: Vec::with_capacity(self.pole.len() / 2 + 1),
            pole: 0.0,
            work: 0.0,
            terms: 0,
        }
    }
}

/// A recorded disc under way: every value is a sum over the forces so far, those of open contacts left out.
///
/// It knows what is done on disc and water together, not which of them has it: [`OnWater::energy`] is 0 and
/// [`OnWater::work_on_water`] the work of the contact force.
#[derive(Debug, Clone)]
pub(crate) struct Played<'a> {
    response: &'a UnitResponse,
    forces: Vec<f64>,
    /// Spans of instants with a force, half open.
    pressed: Vec<(usize, usize)>,
    pole: f64,
    work: f64,
    /// Past forces summed over by steps.
    terms: u64,
}

impl Played<'_> {
    /// Σ r(n − m) F(m) over the instants m < n with a force.
    fn sum(&self, response: &[f64], n: usize) -> f64 {
        let over = |&(from, to): &(usize, usize)| -> f64 {
            let late = response[n + 1 - to..n + 1 - from].iter().rev();
            self.forces[from..to].iter().zip(late).map(|(force, value)| force * value).sum()
        };
        self.pressed.iter().map(over).sum()
    }

    fn with_force(&self) -> u64 {
        self.pressed.iter().map(|(from, to)| (to - from) as u64).sum()
    }

    /// The same at the last instant, its own force included.
    fn now(&self, response: &[f64]) -> f64 {
        self.forces.len().checked_sub(1).map_or(0.0, |last| self.sum(response, last))
    }
}

impl OnWater for Played<'_> {
    fn step(&self) -> f64 {
        self.response.step
    }

    fn compliance(&self) -> f64 {
        self.response.pole[0]
    }

    fn predict(&mut self) -> f64 {
        self.terms += self.with_force();
        self.sum(&self.response.pole, self.forces.len())
    }

    fn push(&mut self, force: f64) {
        let instant = self.forces.len();
        let before = self.forces.last().copied().unwrap_or(0.0);
        self.forces.push(force);
        if force != 0.0 {
            match self.pressed.last_mut() {
                Some((_, to)) if *to == instant => *to += 1,
                _ => self.pressed.push((instant, instant + 1)),
            }
        }
        let pole = self.now(&self.response.pole);
        self.terms += self.with_force();
        self.work += 0.5 * (before + force) * (pole - self.pole);
        self.pole = pole;
    }

    fn predicted_modal_velocity(&self) -> f64 {
        self.sum(&self.response.modal, self.forces.len())
    }

    fn modal_compliance(&self) -> f64 {
        self.response.modal[0]
    }

    fn back_velocity(&self) -> f64 {
        self.now(&self.response.back)
    }

    fn pole_displacement(&self) -> f64 {
        self.pole
    }

    fn pressure(&self, point: usize) -> f64 {
        self.now(&self.response.pressure[point])
    }

    fn energy(&mut self) -> f64 {
        0.0
    }

    fn work_on_water(&self) -> f64 {
        self.work
    }

    fn count(&self, work: &mut SolverWork) {
        work.memory_terms += self.terms;
    }
}
