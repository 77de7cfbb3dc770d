//! Where the time of a run goes. Times never enter a response: they differ from run to run.

use std::time::{Duration, Instant};

/// Wall-clock time by stage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Profile {
    /// Meshing, elements, assembly, contact geometry.
    pub assembly: Duration,
    pub factorisation: Duration,
    /// Products with the mass matrix (and, for a lagging scheme, with the stiffness).
    pub mass: Duration,
    pub forward: Duration,
    pub contact: Duration,
    pub backward: Duration,
    /// New velocities and accelerations, and the next prediction.
    pub update: Duration,
    /// Samples, energies, checks.
    pub record: Duration,
}

impl Profile {
    /// Begin to take laps.
    pub fn start(&self) -> Laps {
        Laps(Instant::now())
    }

    /// Name and time of every stage, in order.
    pub fn stages(&self) -> [(&'static str, Duration); 8] {
        [
            ("mesh and assembly", self.assembly),
            ("factor and condense", self.factorisation),
            ("mass product", self.mass),
            ("forward substitution", self.forward),
            ("contact", self.contact),
            ("backward substitution", self.backward),
            ("update", self.update),
            ("record and check", self.record),
        ]
    }
}

/// A running clock.
#[derive(Debug, Clone, Copy)]
pub struct Laps(Instant);

impl Laps {
    /// Time since the start or the last lap.
    pub(crate) fn lap(&mut self) -> Duration {
        let now = Instant::now();
        now - std::mem::replace(&mut self.0, now)
    }
}
