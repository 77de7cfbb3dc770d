//! Where the time of a run goes. Times never enter a response: they differ from run to run.

use std::time::Duration;

use web_time::Instant;

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Profile {
    pub assembly: Duration,
    pub factorisation: Duration,
    /// Products with the mass matrix (and, for a lagging scheme, with the stiffness).
    pub mass: Duration,
    pub forward: Duration,
    pub contact: Duration,
    pub backward: Duration,
    pub update: Duration,
    pub record: Duration,
}

impl Profile {
    pub(crate) fn start(&self) -> Laps {
        Laps(Instant::now())
    }

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

#[derive(Debug, Clone, Copy)]
pub(crate) struct Laps(Instant);

impl Laps {
    pub(crate) fn lap(&mut self) -> Duration {
        let now = Instant::now();
        now - std::mem::replace(&mut self.0, now)
    }
}
