//! How long the adaptive run's next step is, and in which variable it is even.

use super::dormand_prince::Clock;

#[derive(Debug, Clone, Copy)]
pub(super) enum Pace {
    Plain {
        step: f64,
    },
    /// Even in √(t − t*), √s, since a contact closed at t*; `root` = √(t − t*) now.
    SinceClosing {
        closing: f64,
        root: f64,
        step: f64,
    },
    /// Even in √(t* − t) up to t* = now + `step` (s), when a contact without dashpot is expected to open.
    ToOpening {
        switch: usize,
        step: f64,
        refinements: u32,
    },
}

impl Pace {
    /// The clock of the next step from `time`, at most up to `stop`; whether it reaches it.
    pub(crate) fn clock(&self, time: f64, stop: f64) -> (Clock, bool) {
        match *self {
            Self::Plain { step } => {
                let last = time + 1.01 * step >= stop;
                let step = if last { stop - time } else { step };
                (Clock { start: time, linear: step, quadratic: 0.0 }, last)
            }
            Self::SinceClosing { closing, root, step } => {
                let longest = (stop - closing).sqrt() - root;
                let last = 1.01 * step >= longest;
                let step = if last { longest } else { step };
                (Clock { start: time, linear: 2.0 * root * step, quadratic: step * step }, last)
            }
            Self::ToOpening { step, .. } => (Clock { start: time, linear: 2.0 * step, quadratic: -step }, false),
        }
    }

    /// After the rejected step of this clock: `factor` times as long, in the pace's own variable.
    pub(crate) fn shortened(self, clock: &Clock, factor: f64) -> Self {
        match self {
            Self::Plain { .. } => Self::Plain { step: factor * clock.linear },
            Self::SinceClosing { closing, root, .. } => {
                Self::SinceClosing { closing, root, step: factor * clock.quadratic.sqrt() }
            }
            // Leave for the approach what it can do in one step.
            Self::ToOpening { step, .. } => Self::Plain { step: (1.0 - factor * factor).max(0.3) * step },
        }
    }
}
