//! The run as a function of time, between the samples too.

use super::dormand_prince::{Clock, Course, Stepper};
use crate::response::{EnergyLedger, SolverWork};

/// Displacement and velocity of every bead at any instant of a run, by the integrator's continuous extension of order 7.
///
/// Beads are counted from 0 at the piston. Instants outside the run are answered with its first or last state.
#[derive(Debug, Clone)]
pub struct Trajectory {
    beads: usize,
    padded: usize,
    pieces: Vec<Piece>,
    pub energy: EnergyLedger,
    pub work: SolverWork,
}

#[derive(Debug, Clone)]
struct Piece {
    clock: Clock,
    to: f64,
    /// Each entry of the displacement and velocity blocks.
    courses: Vec<Course>,
}

impl Trajectory {
    pub(super) fn new(beads: usize, padded: usize) -> Self {
        let (energy, work) = (EnergyLedger::default(), SolverWork::default());
        Self { beads, padded, pieces: Vec::new(), energy, work }
    }

    /// End of the run, s.
    pub fn end(&self) -> f64 {
        self.pieces.last().map_or(0.0, |piece| piece.to)
    }

    fn value(&self, entry: usize, time: f64) -> f64 {
        let index = self.pieces.partition_point(|piece| piece.to < time).min(self.pieces.len().saturating_sub(1));
        self.pieces.get(index).map_or(0.0, |piece| piece.courses[entry].at(piece.clock.sigma(time.min(piece.to))))
    }

    /// Displacement of a bead at `time` (s), m.
    pub fn displacement(&self, bead: usize, time: f64) -> f64 {
        assert!(bead < self.beads, "bead {bead} of {}", self.beads);
        self.value(1 + bead, time)
    }

    /// Velocity of a bead at `time` (s), m/s.
    pub fn velocity(&self, bead: usize, time: f64) -> f64 {
        assert!(bead < self.beads, "bead {bead} of {}", self.beads);
        self.value(self.padded + 1 + bead, time)
    }

    /// Instant (s) and value (m/s) of a bead's largest velocity from `from` to `to` (s), between the samples too.
    pub fn maximum_velocity(&self, bead: usize, from: f64, to: f64) -> (f64, f64) {
        self.largest(from, to, |time| self.velocity(bead, time))
    }

    /// Instant (s) and value (m/s) of a bead's smallest velocity from `from` to `to` (s), between the samples too.
    pub fn minimum_velocity(&self, bead: usize, from: f64, to: f64) -> (f64, f64) {
        let (time, negative) = self.largest(from, to, |time| -self.velocity(bead, time));
        (time, -negative)
    }

    /// Largest value of a function that is smooth on every piece: sixteen samples a piece, then a golden section.
    fn largest(&self, from: f64, to: f64, function: impl Fn(f64) -> f64) -> (f64, f64) {
        const PARTS: u32 = 16;
        let mut best = (from, function(from));
        let mut bracket = (from, from);
        let mut start = 0.0;
        for piece in &self.pieces {
            let (low, high) = (f64::max(start, from), f64::min(piece.to, to));
            start = piece.to;
            if high <= low {
                continue;
            }
            let width = (high - low) / f64::from(PARTS);
            for part in 0..=PARTS {
                let time = low + f64::from(part) * width;
                let value = function(time);
                if value > best.1 {
                    best = (time, value);
                    bracket = ((time - width).max(from), (time + width).min(to));
                }
            }
        }
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        let (mut low, mut high) = bracket;
        for _ in 0..60 {
            let (left, right) = (high - golden * (high - low), low + golden * (high - low));
            let (at_left, at_right) = (function(left), function(right));
            for (time, value) in [(left, at_left), (right, at_right)] {
                if value > best.1 {
                    best = (time, value);
                }
            }
            if at_left > at_right {
                high = right;
            } else {
                low = left;
            }
        }
        best
    }
}

impl Trajectory {
    /// Take the part of an extended step from its start up to `to` (s).
    pub(super) fn take(&mut self, stepper: &Stepper, clock: &Clock, to: f64) {
        let courses = (0..2 * self.padded).map(|entry| stepper.course(entry)).collect();
        self.pieces.push(Piece { clock: *clock, to, courses });
    }
}
