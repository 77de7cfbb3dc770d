//! Whether an adaptive run will end.

use crate::ModelError;

/// Looks now and then how far a run has come, and gives up one that creeps: where its last steps were so short that the rest would take more
/// steps than allowed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Forecast {
    /// End of the run, s.
    end: f64,
    /// Most steps of the run, 1.
    most: f64,
    /// Time at the last look, s.
    seen: f64,
}

impl Forecast {
    const STEPS: u64 = 65_536;

    /// Of a run up to `end` (s) in at most so many steps.
    pub(crate) fn new(end: f64, most: f64) -> Self {
        Self { end, most, seen: 0.0 }
    }

    /// Look after `steps` steps at `time` (s).
    #[inline(always)]
    pub(crate) fn look(&mut self, steps: u64, time: f64) -> Result<(), ModelError> {
        if !steps.is_multiple_of(Self::STEPS) {
            return Ok(());
        }
        let Self { end, most: limit, seen } = *self;
        self.seen = time;
        let expected = steps as f64 + (end - time) / (time - seen) * Self::STEPS as f64;
        if expected > limit { Err(ModelError::TooManySteps { steps, time, end, expected, limit }) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_creeps_is_given_up_and_one_that_gets_on_is_not() {
        let every = Forecast::STEPS;
        let mut forecast = Forecast::new(1.0, 1e9);
        assert_eq!(forecast.look(every - 1, 1e-9), Ok(()));
        assert_eq!(forecast.look(every, 0.1), Ok(()));
        let error = forecast.look(2 * every, 0.1 + 1e-6).unwrap_err();
        let ModelError::TooManySteps { expected, .. } = error else { panic!("{error}") };
        assert!((expected / 5.9e10 - 1.0).abs() < 0.01, "{expected:e}");
        // One that stands still.
        assert!(forecast.look(3 * every, 0.1 + 1e-6).is_err());
    }
}
